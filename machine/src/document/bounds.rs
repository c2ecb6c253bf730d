//! Which values a key can have: what is possible, and what is usual.
//!
//! The bounds of a document are rows of one list. A value outside of what is possible is an error, one
//! outside of what is usual a warning; both stand at the value and name the bounds.

use super::diagnostics::Diagnostics;
use super::error::ProblemKind;
use super::node::Span;
use crate::quantity::{Dimension, read_any};

/// The bounds of some keys, as a person writes them. Both ends belong to the range.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    /// The keys, each after the name of its table's type: `DcMotorTable.resistance`.
    pub keys: &'static [&'static str],
    /// The smallest and the largest value that is taken.
    pub possible: [&'static str; 2],
    /// The smallest and the largest value that is taken without a warning.
    pub usual: [&'static str; 2],
    /// Where the bounds come from: products, or physics.
    pub reason: &'static str,
}

/// A number of a document, as it was understood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// SI units and radians.
    pub value: f64,
    /// What it is measured in.
    pub dimension: Dimension,
    /// Where it stands.
    pub span: Span,
}

impl Bounds {
    /// Whether they are those of `key` in the table of type `table`.
    pub fn is_of(&self, table: &str, key: &str) -> bool {
        self.keys.iter().any(|known| known.split_once('.') == Some((table, key)))
    }

    /// The numbers of `ends` and what they are measured in; `None` where they cannot be read, which a
    /// test of each list rules out.
    pub fn range(ends: [&str; 2]) -> Option<([f64; 2], Dimension)> {
        let (lower, dimension) = read_any(ends[0]).ok()?;
        let (upper, _) = read_any(ends[1]).ok().filter(|upper| upper.1 == dimension)?;
        Some(([lower, upper], dimension))
    }

    /// Whether `value` lies between `ends`.
    fn holds(ends: [&str; 2], value: f64) -> bool {
        Self::range(ends).is_none_or(|([lower, upper], _)| (lower..=upper).contains(&value))
    }
}

/// Holds `number`, the value of `key` in the table of type `table`, to its bounds: refuses what is not
/// possible, and notes what is unusual.
pub(super) fn check(table: &str, key: &str, number: &Measured, diagnostics: &mut Diagnostics) {
    let mut rows = diagnostics.bounds().iter().filter(|bounds| bounds.is_of(table, key));
    let mut row = rows.next();
    // A joint's travel has a row for lengths, and one for angles.
    while let (Some(bounds), Some(next)) = (row, rows.next()) {
        let fits = |bounds: &Bounds| {
            Bounds::range(bounds.possible).is_some_and(|(_, found)| found == number.dimension)
        };
        if !fits(bounds) {
            row = Some(next);
        }
    }
    let Some(bounds) = row else { return };
    let Bounds { possible, usual, reason, .. } = bounds;
    let written = diagnostics.written(number.span);
    let written = written.trim_matches('"').trim();
    if !Bounds::holds(*possible, number.value) {
        let message = format!("`{key}` cannot be `{written}`");
        let help = format!(
            "possible is {} to {}, usual {} to {}: {reason}",
            possible[0], possible[1], usual[0], usual[1]
        );
        diagnostics.refuse(ProblemKind::OutOfRange, number.span, message, Some(help));
    } else if !Bounds::holds(*usual, number.value) {
        let message = format!(
            "`{key}` of {written} is unusual: it is mostly {} to {} ({reason})",
            usual[0], usual[1]
        );
        diagnostics.warn(number.span, message);
    }
}
