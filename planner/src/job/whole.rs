//! Whole numbers in job files.

use std::ops::RangeInclusive;

use machine::document::{Diagnostics, Number, ProblemKind, Range};

/// The whole number in `range` that the `number` of `key` is; else notes what would be right.
pub(super) fn whole<R: Range>(
    number: &Number<R>,
    range: RangeInclusive<u64>,
    key: &str,
    diagnostics: &mut Diagnostics,
) -> Option<u64> {
    let value = number.value;
    if value.fract() == 0.0 && (*range.start() as f64..=*range.end() as f64).contains(&value) {
        return Some(value as u64);
    }
    diagnostics.refuse(
        ProblemKind::OutOfRange,
        number.span,
        format!("`{key}` cannot be {value}"),
        Some(format!("write a whole number from {} to {}", range.start(), range.end())),
    );
    None
}
