//! What the marks of strokes come to, stroke by stroke.

use super::coverage::Coverage;

/// What strokes came to so far. Lengths in m.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Tally {
    pub(super) missing: f64,
    pub(super) unrecorded: f64,
    pub(super) double: f64,
    pub(super) missing_end_max: f64,
    pub(super) double_end_max: f64,
    /// Strokes without any light.
    pub(super) lost: u64,
    /// The first and the last stroke, from 1, of which not all was recorded.
    pub(super) hidden: Option<(u64, u64)>,
}

impl Tally {
    /// Takes the next stroke, of this `number`, `length` [m] and what of it was due [m]; `is_over` says that the job
    /// was through with it.
    pub(super) fn add(
        &mut self,
        number: u64,
        coverage: &Coverage,
        (length, due): (f64, f64),
        is_over: bool,
    ) {
        let extent = coverage.extent(length, due);
        if is_over && coverage.is_lost() {
            self.lost += 1;
        }
        if coverage.is_hidden() {
            let first = self.hidden.map_or(number, |(first, _)| first);
            self.hidden = Some((first, number));
        }
        self.missing += extent.missing + extent.unrecorded;
        self.unrecorded += extent.unrecorded;
        // A dot has no length to mark twice; straying from it is its error.
        if length > 0.0 {
            self.double += extent.double;
            let ends = extent.double_ends.into_iter();
            self.double_end_max = ends.fold(self.double_end_max, f64::max);
        }
        let ends = extent.missing_ends.into_iter();
        self.missing_end_max = ends.fold(self.missing_end_max, f64::max);
    }
}
