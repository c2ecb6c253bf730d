//! Documents that people write: TOML read into typed tables, with every error at its place.
//!
//! A document is parsed with the place of every key and value kept, `--set` overrides are laid
//! over it, and it is then decoded into structs declared with [`table!`](crate::table!). Unknown
//! keys are errors. Everything that can be found wrong independently is reported together, in the
//! order of the file.
//!
//! ```
//! use machine::document::{Document, Positive, Quantity};
//! use machine::quantity::Length;
//!
//! machine::table! {
//!     /// What to write.
//!     pub struct Letters {
//!         /// Height of a letter.
//!         pub height: Quantity<Length, Positive> = "20 mm",
//!     }
//! }
//!
//! let document = Document::parse("job.toml", "hight = \"10 mm\"").unwrap();
//! let error = document.decode::<Letters>().unwrap_err();
//! assert_eq!(error.line(), Some(1));
//! assert_eq!(error.to_string(), "job.toml:1:1: unknown key `hight`");
//! assert_eq!(error.message(), "unknown key `hight`; did you mean `height`?");
//! ```

mod attachments;
mod bounds;
mod decode;
mod diagnostics;
mod error;
mod field;
mod node;
mod overrides;
mod position;
mod schema;
mod table;

use std::path::Path;
use std::sync::Arc;

pub(crate) use attachments::Attached;
pub use attachments::{Attachment, Attachments};
pub use bounds::{Bounds, Measured};
pub use decode::{Decode, Spanned};
pub use diagnostics::{Concern, Diagnostics, Warning};
pub use error::{DocumentError, Problem, ProblemKind};
pub use field::{
    Any, Either, Fraction, Keyword, Named, NonNegative, Number, Point, Positive, Quantity, Range,
};
pub use node::{Literal, Node, Span};
pub use overrides::{MalformedOverride, Override};
pub use position::Position;
pub use schema::schema_text;
#[doc(hidden)]
pub use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
#[doc(hidden)]
pub use table::table_schema;
pub use table::{Field, TableReader};

use error::Source;

/// A document that is well-formed TOML, not yet decoded.
#[derive(Debug)]
pub struct Document {
    root: Node,
    diagnostics: Diagnostics,
}

impl Document {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// Where it cannot be read, is not UTF-8, or is not TOML.
    pub fn read(path: &Path) -> Result<Self, DocumentError> {
        Self::parse(&path.display().to_string(), &Self::text(path)?)
    }

    /// The text of the file at `path`, for [`Self::parse`].
    ///
    /// # Errors
    /// Where it cannot be read, or is not UTF-8.
    pub fn text(path: &Path) -> Result<String, DocumentError> {
        let name = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|error| {
            DocumentError::unreadable(&name, format!("cannot be read: {error}"))
        })?;
        match String::from_utf8(bytes) {
            Ok(text) => Ok(text),
            Err(error) => {
                let valid = error.utf8_error().valid_up_to();
                let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
                let mut diagnostics = Diagnostics::new(Source::file(&name, &text));
                diagnostics.refuse(
                    ProblemKind::Syntax,
                    Span { source: 0, start: valid, end: valid + 1 },
                    "the file is not UTF-8 text".to_owned(),
                    Some("save it with the encoding UTF-8".to_owned()),
                );
                Err(diagnostics.into_error())
            }
        }
    }

    /// Parses `text`, which came from a file called `file`.
    ///
    /// # Errors
    /// Where it is not TOML.
    pub fn parse(file: &str, text: &str) -> Result<Self, DocumentError> {
        let mut diagnostics = Diagnostics::new(Source::file(file, text));
        match node::parse(text, 0, &mut diagnostics) {
            Some(root) => Ok(Self { root, diagnostics }),
            None => Err(diagnostics.into_error()),
        }
    }

    /// Finds the files that the document names in `attachments`; without this it finds none.
    #[must_use]
    pub fn attach(mut self, attachments: Attachments) -> Self {
        self.diagnostics.attach(attachments);
        self
    }

    /// The text that stands at the dotted `key`, such as `frame.mesh.file`.
    pub(crate) fn text_at(&self, key: &str) -> Option<&str> {
        self.root.text_at(key)
    }

    /// Lays `overrides` over the document, the later over the earlier. `prefix` is what stands
    /// before the key on the command line, such as `machine.`, and is named in errors.
    ///
    /// # Errors
    /// Where a key is malformed or leads through something that is no table. Whether the key
    /// exists is found when the document is decoded.
    pub fn override_with(
        mut self,
        overrides: &[Override],
        prefix: &str,
    ) -> Result<Self, DocumentError> {
        for setting in overrides {
            let source = self.diagnostics.add_source(Arc::new(setting.source(prefix)));
            overrides::lay_over(&mut self.root, setting, prefix, source, &mut self.diagnostics);
        }
        if self.diagnostics.is_empty() { Ok(self) } else { Err(self.diagnostics.into_error()) }
    }

    /// Decodes the document, and gives what was found beside it for further checks: hand every
    /// contradiction to [`Diagnostics::refuse`] and call [`Diagnostics::finish`].
    ///
    /// # Errors
    /// Everything that does not fit the declaration of `T`.
    pub fn decode<T: Decode>(self) -> Result<(T, Diagnostics), DocumentError> {
        self.decode_within(&[])
    }

    /// As [`Self::decode`], with every number held to its `bounds`.
    ///
    /// # Errors
    /// As [`Self::decode`], and every number that is not possible.
    pub fn decode_within<T: Decode>(
        mut self,
        bounds: &'static [Bounds],
    ) -> Result<(T, Diagnostics), DocumentError> {
        self.diagnostics.hold_to(bounds);
        match T::decode(&self.root, &mut self.diagnostics) {
            Some(value) if self.diagnostics.is_empty() => Ok((value, self.diagnostics)),
            _ => Err(self.diagnostics.into_error()),
        }
    }
}

/// The candidate most like `word`, if one is near enough to have been meant.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    /// Below this likeness (0 to 1) a suggestion would be a guess.
    const LIKELY: f64 = 0.7;
    let lower = word.to_lowercase();
    let likeness = |candidate: &str| {
        if candidate.to_lowercase() == lower {
            return 1.0;
        }
        // Jaro-Winkler favours a common beginning; the edit distance catches a slip in the first
        // letters of short words.
        let edits = strsim::damerau_levenshtein(word, candidate) as f64;
        let longest = word.chars().count().max(candidate.chars().count()).max(1) as f64;
        strsim::jaro_winkler(word, candidate).max(1.0 - edits / longest)
    };
    candidates
        .into_iter()
        .map(|candidate| (likeness(candidate), candidate))
        .filter(|(likeness, _)| *likeness >= LIKELY)
        // The first of equals, so that the order of a declaration decides.
        .fold(None, |best: Option<(f64, &str)>, next| match best {
            Some(best) if best.0 >= next.0 => Some(best),
            _ => Some(next),
        })
        .map(|(_, candidate)| candidate)
}
