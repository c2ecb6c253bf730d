//! Which stretches of one stroke were marked: never, once, more than once, or beyond its ends; and
//! of which nobody knows.

/// Movement back along the stroke that is not yet a second mark [m]: the tool's vibration.
const VIBRATION: f64 = 1e-6;

/// A hidden stretch shorter than this is no more than the tool's distance from its plan [m].
const NOTABLE: f64 = 2e-5;

/// The marked stretches of a stroke, by arc length.
#[derive(Debug, Clone, Default)]
pub struct Coverage {
    stretches: Vec<(f64, f64)>,
    leg: Option<Leg>,
    /// Stretches that were passed while nobody recorded.
    hidden: Vec<(f64, f64)>,
}

/// The stretch being marked, in one direction.
#[derive(Debug, Clone, Copy)]
struct Leg {
    low: f64,
    high: f64,
    forward: bool,
}

/// What [`Coverage`] amounts to, for a stroke of known length [m].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Extent {
    /// Length of the stroke never marked.
    pub missing: f64,
    /// Length marked more than once, and beyond the ends.
    pub double: f64,
    /// Length of which nobody knows whether it was marked.
    pub unrecorded: f64,
    /// Length not marked at the start and at the end.
    pub missing_ends: [f64; 2],
    /// Length marked beyond the start and beyond the end.
    pub double_ends: [f64; 2],
}

impl Coverage {
    /// Light at arc length `at` [m], continuing the run of light, or starting one.
    pub fn mark(&mut self, at: f64) {
        let Some(leg) = &mut self.leg else {
            self.leg = Some(Leg { low: at, high: at, forward: true });
            return;
        };
        let turned = if leg.forward { at < leg.high - VIBRATION } else { at > leg.low + VIBRATION };
        if turned {
            self.stretches.push((leg.low, leg.high));
            let turn = if leg.forward { leg.high } else { leg.low };
            *leg = Leg { low: turn.min(at), high: turn.max(at), forward: !leg.forward };
        } else {
            leg.low = leg.low.min(at);
            leg.high = leg.high.max(at);
        }
    }

    /// The light goes off.
    pub fn end(&mut self) {
        if let Some(leg) = self.leg.take() {
            self.stretches.push((leg.low, leg.high));
        }
    }

    /// From arc length `from` to `to` [m] the stroke was passed while nobody recorded. A stretch of
    /// no length says it of a dot, or of an end.
    pub fn hide(&mut self, from: f64, to: f64) {
        self.hidden.push((from, to));
    }

    /// Whether it is certain that there was no light at all.
    pub fn is_lost(&self) -> bool {
        self.stretches.is_empty() && self.leg.is_none() && !self.is_hidden()
    }

    /// Whether more of it than the accuracy of an end was passed while nobody recorded, or all of a
    /// dot.
    pub fn is_hidden(&self) -> bool {
        self.hidden.iter().any(|(from, to)| from == to || to - from > NOTABLE)
    }

    /// How a stroke of `length` [m] was covered that should have been marked up to `due` [m], all of it or less.
    /// Call after [`Self::end`].
    pub fn extent(&self, length: f64, due: f64) -> Extent {
        let known = || self.stretches.iter();
        let all = || known().chain(&self.hidden);
        if all().next().is_none() {
            return Extent { missing: due, missing_ends: [due; 2], ..Extent::default() };
        }
        let low = all().fold(f64::INFINITY, |low, stretch| low.min(stretch.0));
        let high = all().fold(f64::NEG_INFINITY, |high, stretch| high.max(stretch.1));
        let missing_ends = [low.clamp(0.0, due), (due - high).clamp(0.0, due)];
        let double_ends =
            [measure(known(), f64::NEG_INFINITY, 0.0).0, measure(known(), length, f64::INFINITY).0];
        let (once, twice) = measure(known(), 0.0, length);
        let passed = measure(all(), 0.0, length).0;
        Extent {
            missing: (due - measure(all(), 0.0, due).0).max(0.0),
            double: twice + double_ends[0] + double_ends[1],
            unrecorded: (passed - once).max(0.0),
            missing_ends,
            double_ends,
        }
    }
}

/// Length between two arc lengths that these stretches cover at least once, and at least twice.
fn measure<'a>(stretches: impl Iterator<Item = &'a (f64, f64)>, from: f64, to: f64) -> (f64, f64) {
    let mut bounds: Vec<(f64, i64)> = Vec::new();
    for &(low, high) in stretches {
        let (low, high) = (low.max(from), high.min(to));
        if low < high {
            bounds.push((low, 1));
            bounds.push((high, -1));
        }
    }
    bounds.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
    let (mut once, mut twice, mut depth, mut since) = (0.0, 0.0, 0, 0.0);
    for (at, change) in bounds {
        if depth >= 1 {
            once += at - since;
        }
        if depth >= 2 {
            twice += at - since;
        }
        depth += change;
        since = at;
    }
    (once, twice)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(runs: &[&[f64]], expect: Extent) {
        let mut coverage = Coverage::default();
        for run in runs {
            run.iter().for_each(|&at| coverage.mark(at));
            coverage.end();
        }
        let extent = coverage.extent(10.0, 10.0);
        let pairs = [
            (extent.missing, expect.missing),
            (extent.double, expect.double),
            (extent.missing_ends[0], expect.missing_ends[0]),
            (extent.missing_ends[1], expect.missing_ends[1]),
            (extent.double_ends[0], expect.double_ends[0]),
            (extent.double_ends[1], expect.double_ends[1]),
        ];
        for (value, expected) in pairs {
            assert!((value - expected).abs() < 1e-12, "{runs:?}: {extent:?} not {expect:?}");
        }
    }

    #[test]
    fn every_length_is_counted_where_it_belongs() {
        let none = Extent::default();
        check(&[&[0.0, 4.0, 10.0]], none);
        check(&[], Extent { missing: 10.0, missing_ends: [10.0; 2], ..none });
        check(&[&[0.0, 4.0], &[4.0, 10.0]], none);
        check(&[&[0.0, 4.0], &[5.0, 10.0]], Extent { missing: 1.0, ..none });
        check(&[&[0.0, 4.0], &[3.0, 10.0]], Extent { double: 1.0, ..none });
        check(
            &[&[-0.5, 9.0]],
            Extent {
                missing: 1.0,
                double: 0.5,
                missing_ends: [0.0, 1.0],
                double_ends: [0.5, 0.0],
                ..none
            },
        );
        // Forward, back by two, forward again: marked three times there, counted once.
        check(&[&[0.0, 5.0, 3.0, 10.0]], Extent { double: 2.0, ..none });
        // Vibration at rest is no second mark.
        check(&[&[0.0, 5.0, 5.0 - 5e-7, 5.0 + 2e-7, 10.0]], none);
        check(
            &[&[11.0, 12.0]],
            Extent {
                missing: 10.0,
                double: 1.0,
                missing_ends: [10.0, 0.0],
                double_ends: [0.0, 1.0],
                ..none
            },
        );
    }

    #[test]
    fn what_was_not_due_is_not_missing() {
        let check = |runs: &[&[f64]], due: f64, missing: f64, double: f64, ends: [f64; 2]| {
            let mut coverage = Coverage::default();
            for run in runs {
                run.iter().for_each(|&at| coverage.mark(at));
                coverage.end();
            }
            let extent = coverage.extent(10.0, due);
            let found = (extent.missing, extent.double, extent.missing_ends);
            assert_eq!(found, (missing, double, ends), "{runs:?} {due}");
        };
        check(&[&[0.0, 4.0]], 4.0, 0.0, 0.0, [0.0; 2]);
        check(&[&[0.0, 4.0]], 5.0, 1.0, 0.0, [0.0, 1.0]);
        check(&[], 4.0, 4.0, 0.0, [4.0; 2]);
        check(&[], 0.0, 0.0, 0.0, [0.0; 2]);
        // Light beyond what was due is on the stroke all the same.
        check(&[&[1.0, 5.0]], 4.0, 1.0, 0.0, [1.0, 0.0]);
        check(&[&[0.0, 5.0], &[3.0, 4.0]], 4.0, 0.0, 1.0, [0.0; 2]);
    }

    #[test]
    fn what_is_hidden_is_neither_marked_nor_missing() {
        let check =
            |run: &[f64], hidden: &[(f64, f64)], missing: f64, unrecorded: f64, ends: [f64; 2]| {
                let mut coverage = Coverage::default();
                run.iter().for_each(|&at| coverage.mark(at));
                coverage.end();
                hidden.iter().for_each(|&(from, to)| coverage.hide(from, to));
                let extent = coverage.extent(10.0, 10.0);
                let found = (extent.missing, extent.unrecorded, extent.missing_ends);
                assert_eq!(found, (missing, unrecorded, ends), "{run:?} {hidden:?}");
                assert!(coverage.is_hidden() && !coverage.is_lost());
            };
        check(&[0.0, 4.0], &[(4.0, 10.0)], 0.0, 6.0, [0.0, 0.0]);
        check(&[0.0, 4.0], &[(5.0, 7.0)], 4.0, 2.0, [0.0, 3.0]);
        // Marked all the same, later: it is known then.
        check(&[3.0, 10.0], &[(0.0, 5.0)], 0.0, 3.0, [0.0, 0.0]);
        check(&[3.0, 10.0], &[(1.0, 3.0), (2.0, 4.0)], 1.0, 2.0, [1.0, 0.0]);
        check(&[], &[(-1.0, 11.0)], 0.0, 10.0, [0.0, 0.0]);
        check(&[], &[(2.0, 3.0)], 9.0, 1.0, [2.0, 7.0]);
    }
}
