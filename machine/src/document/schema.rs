//! JSON schemas of documents, so that editors complete and check them.

use schemars::generate::SchemaSettings;

use super::decode::Decode;

/// The schema of a document of type `T`, as the text of a committed file: indented, with a final
/// line break.
pub fn schema_text<T: Decode>(title: &str) -> String {
    let generator = SchemaSettings::draft07().into_generator();
    let mut schema = generator.into_root_schema_for::<T>();
    schema.insert("title".to_owned(), title.into());
    let mut text = format!("{:#}", schema.to_value());
    text.push('\n');
    text
}
