//! The machine file with what was identified.

use toml_edit::{Array, DocumentMut, InlineTable, Item, TableLike, Value, value};

use super::{CalibrationError, CalibrationReport, Part};

/// The machine file `text` with the numbers of `report` for the `free` parts; its comments stay.
///
/// # Errors
/// A file in which the platform has no table of its own.
pub fn machine_file(
    text: &str,
    report: &CalibrationReport,
    free: &[Part],
) -> Result<String, CalibrationError> {
    let mut document: DocumentMut = text
        .parse()
        .map_err(|error: toml_edit::TomlError| CalibrationError::Write(error.to_string()))?;
    let missing = || CalibrationError::Write("there is no table `mechanism.tri_planar`".to_owned());
    let platform = document
        .get_mut("mechanism")
        .and_then(|mechanism| mechanism.get_mut("tri_planar"))
        .and_then(Item::as_table_like_mut)
        .ok_or_else(missing)?;
    for (part, numbers) in free.iter().zip(report.numbers.chunks(6)) {
        let numbers: Vec<f64> = numbers.iter().map(|number| number.value).collect();
        match part {
            Part::Legs => {
                let pair = |pair: &[f64]| Array::from_iter(pair.iter().map(|at| length(*at)));
                let legs = Array::from_iter(numbers.chunks(2).map(pair));
                set(platform, "legs_length", Value::Array(legs));
            }
            Part::Base | Part::Tool => frame(platform, part.name(), &numbers),
        }
    }
    Ok(document.to_string())
}

/// Writes a frame into its table, or into a new one in the platform's.
fn frame(platform: &mut dyn TableLike, key: &str, numbers: &[f64]) {
    let position = Array::from_iter(numbers.iter().take(3).map(|at| length(*at)));
    let turns = ["roll", "pitch", "yaw"].into_iter().zip(numbers.iter().skip(3));
    let turns = turns.map(|(key, turn)| (key, Value::from(format!("{turn:.9} rad"))));
    let mut values = vec![("position", Value::Array(position))];
    values.extend(turns);
    if let Some(table) = platform.get_mut(key).and_then(Item::as_table_like_mut) {
        values.into_iter().for_each(|(key, value)| set(table, key, value));
    } else {
        let inline = Value::InlineTable(InlineTable::from_iter(values));
        platform.insert(key, value(inline));
    }
}

/// Sets `key`, keeping what stands beside the value that was there.
fn set(table: &mut dyn TableLike, key: &str, mut new: Value) {
    if let Some(old) = table.get(key).and_then(Item::as_value) {
        *new.decor_mut() = old.decor().clone();
    }
    table.insert(key, value(new));
}

/// A length to the nanometre.
fn length(meters: f64) -> String {
    format!("{:.6} mm", meters * 1e3)
}
