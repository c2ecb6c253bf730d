//! What stands for {n} and {column} in texts and codes.

use machine::document::{Diagnostics, Spanned};

use super::tables::SerialTable;
use crate::job::files::JobFiles;
use crate::job::whole::whole;

/// The largest number: what a number in TOML holds without rounding, 2⁵³.
const LARGEST: u64 = 1 << 53;

/// Numbers and rows of a drawing's places.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Serial {
    start: u64,
    step: u64,
    digits: usize,
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Serial {
    /// Of a drawing without such a table: nothing but the number of the place.
    pub(super) fn plain() -> Self {
        Self { start: 1, step: 1, digits: 1, columns: Vec::new(), rows: Vec::new() }
    }

    /// Reads `table` for so many `places`; what is wrong with it goes to `diagnostics`.
    pub(super) fn new(
        table: &SerialTable,
        files: &JobFiles,
        places: usize,
        diagnostics: &mut Diagnostics,
    ) -> Option<Self> {
        let start = whole(&table.start, 0..=LARGEST, "start", diagnostics);
        let step = whole(&table.step, 1..=LARGEST >> 20, "step", diagnostics);
        let digits = whole(&table.digits, 1..=20, "digits", diagnostics);
        let row = whole(&table.row, 1..=LARGEST, "row", diagnostics);
        let mut serial = Self {
            start: start?,
            step: step?,
            digits: digits? as usize,
            columns: Vec::new(),
            rows: Vec::new(),
        };
        let first = row? as usize - 1;
        let Some(file) = &table.csv else { return Some(serial) };
        let (columns, rows) = read(file, files, diagnostics)?;
        if rows.len() < first + places {
            diagnostics.contradict(
                file.span,
                format!(
                    "{places} places from row {} on need {} rows, {} has {}",
                    first + 1,
                    first + places,
                    file.value,
                    rows.len()
                ),
                "make the array smaller, add rows, or begin at an earlier `row`",
            );
            return None;
        }
        (serial.columns, serial.rows) = (columns, rows[first..first + places].to_vec());
        Some(serial)
    }

    /// `template` with what stands for {n} and {column} in a place, from 0; {{ and }} are braces.
    ///
    /// # Errors
    /// The name in braces that stands for nothing.
    pub(super) fn fill(&self, template: &str, place: usize) -> Result<String, String> {
        let mut text = String::new();
        let mut rest = template;
        while let Some(at) = rest.find(['{', '}']) {
            text.push_str(&rest[..at]);
            let brace = &rest[at..=at];
            rest = &rest[at + 1..];
            if let Some(after) = rest.strip_prefix(brace) {
                text.push_str(brace);
                rest = after;
                continue;
            }
            let Some((name, after)) = rest.split_once('}').filter(|_| brace == "{") else {
                return Err(brace.to_owned());
            };
            text.push_str(&self.value(name, place).ok_or_else(|| name.to_owned())?);
            rest = after;
        }
        text.push_str(rest);
        Ok(text)
    }

    fn value(&self, name: &str, place: usize) -> Option<String> {
        if let Some(column) = self.columns.iter().position(|column| column == name) {
            return Some(self.rows.get(place)?.get(column).cloned().unwrap_or_default());
        }
        let number = self.start.checked_add(self.step.checked_mul(place as u64)?)?;
        (name == "n").then(|| format!("{number:0digits$}", digits = self.digits))
    }

    /// What can stand in braces.
    pub(super) fn names(&self) -> Vec<&str> {
        core::iter::once("n").chain(self.columns.iter().map(String::as_str)).collect()
    }
}

/// Columns and rows of a CSV file.
fn read(
    file: &Spanned<String>,
    files: &JobFiles,
    diagnostics: &mut Diagnostics,
) -> Option<(Vec<String>, Vec<Vec<String>>)> {
    let path = files.path(&file.value);
    let read = || {
        let mut reader =
            csv::ReaderBuilder::new().flexible(true).from_reader(files.open(&file.value)?);
        let columns = reader.headers()?.iter().map(|name| name.trim().to_owned()).collect();
        let rows = reader
            .records()
            .map(|record| Ok(record?.iter().map(str::to_owned).collect()))
            .collect::<Result<_, csv::Error>>()?;
        Ok::<_, csv::Error>((columns, rows))
    };
    read()
        .map_err(|error| {
            let text = format!("{}: {error}", path.display());
            let help = "give a CSV file in UTF-8 whose first line names its columns";
            diagnostics.contradict(file.span, text, help);
        })
        .ok()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn braces_stand_for_numbers_and_columns() {
        let serial = Serial {
            start: 8,
            step: 2,
            digits: 3,
            columns: vec!["name".to_owned()],
            rows: vec![vec!["Ada".to_owned()], Vec::new()],
        };
        assert_eq!(serial.fill("{name} No. {n}", 0).unwrap(), "Ada No. 008");
        assert_eq!(serial.fill("{name} No. {n}", 1).unwrap(), " No. 010");
        assert_eq!(serial.fill("{{n}} µ{n}", 1).unwrap(), "{n} µ010");
        assert_eq!(serial.fill("{other}", 0), Err("other".to_owned()));
        assert_eq!(serial.fill("{n", 0), Err("{".to_owned()));
        assert_eq!(serial.fill("n}", 0), Err("}".to_owned()));
    }
}
