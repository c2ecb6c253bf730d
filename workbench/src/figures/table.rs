//! The numbers of a figure, as comma-separated values.

use core::fmt::Write;

/// One value.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A number; nothing is written of one that is not finite.
    Number(f64),
    /// A name without commas, quotes and line ends.
    Text(String),
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

/// Rows under named columns, SI units and radians unless a column's name says otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The file's name without its ending.
    pub stem: String,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// The rows, each as long as there are columns.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// A table without rows.
    pub fn new<S: Into<String>>(
        stem: impl Into<String>,
        columns: impl IntoIterator<Item = S>,
    ) -> Self {
        let columns = columns.into_iter().map(Into::into).collect();
        Self { stem: stem.into(), columns, rows: Vec::new() }
    }

    /// Adds a row of numbers.
    pub fn numbers(&mut self, row: impl IntoIterator<Item = f64>) {
        self.rows.push(row.into_iter().map(Cell::Number).collect());
    }

    /// The file: a line of names, then a line a row. Numbers are the shortest that read back alike.
    pub fn text(&self) -> String {
        let mut text = self.columns.join(",") + "\n";
        for row in &self.rows {
            for (index, cell) in row.iter().enumerate() {
                if index > 0 {
                    text.push(',');
                }
                match cell {
                    // Writing to memory never fails.
                    Cell::Number(number) if number.is_finite() => {
                        let _ = write!(text, "{number}");
                    }
                    Cell::Number(_) => {}
                    Cell::Text(name) => text.push_str(name),
                }
            }
            text.push('\n');
        }
        text
    }

    /// The numbers of a column, those that are missing as not a number; `None` where it has another name.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let index = self.columns.iter().position(|column| column == name)?;
        let number = |row: &Vec<Cell>| match row.get(index) {
            Some(Cell::Number(number)) => *number,
            _ => f64::NAN,
        };
        Some(self.rows.iter().map(number).collect())
    }
}
