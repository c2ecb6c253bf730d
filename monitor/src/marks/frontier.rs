//! How far a job has come, and what of it passed while nobody recorded.
//!
//! Strokes are marked in their order, each from its start to its end. So what passed between the
//! last record before a gap and the first light after it lies between two places of the job,
//! whatever the machine did meanwhile: went on, was held, went back and resumed.

use super::tool_path::{Interval, Moment};
use std::cmp::Ordering;

/// A place in a job.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// The stroke, from 1; one more than the job has at its end.
    pub(super) stroke: u64,
    /// Arc length from the start of the stroke [m].
    pub(super) at: f64,
}

impl Place {
    /// Where every job starts.
    pub(super) const START: Self = Self { stroke: 1, at: 0.0 };

    /// The start of the stroke after this one.
    pub(super) fn next_stroke(self) -> Self {
        Self { stroke: self.stroke + 1, at: 0.0 }
    }

    /// Where the job is after marking `length` [m] from here on, with strokes of these `lengths` [m] from its own on.
    pub(super) fn after(self, length: f64, lengths: impl Iterator<Item = f64>) -> Self {
        let (mut place, mut left) = (self, length);
        for whole in lengths {
            if place.at + left < whole {
                return Self { at: place.at + left, ..place };
            }
            left -= (whole - place.at).max(0.0);
            place = place.next_stroke();
        }
        place
    }

    /// How far along a stroke of this number and `length` [m] the job is at this place [m].
    pub(super) fn along(self, stroke: u64, length: f64) -> f64 {
        match stroke.cmp(&self.stroke) {
            Ordering::Less => length,
            Ordering::Equal => self.at.clamp(0.0, length),
            Ordering::Greater => 0.0,
        }
    }

    /// Whether this is before `other` in the order of marking.
    pub(super) fn is_before(self, other: Self) -> bool {
        let order = self.stroke.cmp(&other.stroke).then(self.at.total_cmp(&other.at));
        order == Ordering::Less
    }

    /// The later of two places.
    pub(super) fn max(self, other: Self) -> Self {
        if self.is_before(other) { other } else { self }
    }
}

/// How far a job has come, as recorded.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frontier {
    /// Everything before it has had its light, or lost it.
    pub(super) place: Place,
    /// Whether light fell or was due at the end of the newest cycle.
    open: bool,
}

impl Frontier {
    /// Before the first cycle.
    pub(super) fn new() -> Self {
        Self { place: Place::START, open: false }
    }

    /// Takes the next cycle. `at` is where along the stroke that [`last_light`] names the tool was
    /// seen last.
    ///
    /// Light that ends because the plan says so ends its stroke. Light that ends in a hold, in a
    /// stop, or because drives kept a cycle dark, may come again where it ended.
    pub(super) fn advance(&mut self, interval: &Interval, at: Option<f64>) {
        let light = last_light(interval);
        if let (Some(light), Some(at)) = (light, at) {
            self.place = self.place.max(Place { stroke: light.stroke, at });
        }
        let open = light.is_some_and(|light| light.to == 1.0);
        let ended = (self.open || light.is_some()) && !open;
        let stroke = light.map_or(self.place.stroke, |light| light.stroke);
        let planned = interval.due().is_some_and(|due| due.running);
        if ended && planned && stroke == self.place.stroke {
            self.place = self.place.next_stroke();
        }
        self.open = open;
    }

    /// Everything before `place` is behind the job.
    pub(super) fn pass(&mut self, place: Place) {
        self.place = self.place.max(place);
    }
}

/// The end of the last light that falls or is due in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LastLight {
    /// The stroke.
    pub(super) stroke: u64,
    /// Where it ends, as a part of the cycle.
    pub(super) to: f64,
}

/// The last light that falls or is due in a cycle.
pub(super) fn last_light(interval: &Interval) -> Option<LastLight> {
    let fallen = interval.lit().as_slice().last().copied();
    let due = interval.due().and_then(|due| due.light).map(|(_, last)| last);
    let later = |a: LastLight, b: LastLight| if b.to > a.to { b } else { a };
    let lights = [fallen, due].into_iter().flatten();
    lights.map(|span| LastLight { stroke: span.stroke, to: span.to }).reduce(later)
}

/// The beginning of the first light that falls or is due in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FirstLight {
    /// The stroke.
    pub(super) stroke: u64,
    /// Where it begins, as a part of the cycle.
    pub(super) from: f64,
}

/// The first light that falls or is due in a cycle.
pub(super) fn first_light(interval: &Interval) -> Option<FirstLight> {
    let fallen = interval.lit().as_slice().first().copied();
    let due = interval.due().and_then(|due| due.light).map(|(first, _)| first);
    let earlier = |a: FirstLight, b: FirstLight| if b.from < a.from { b } else { a };
    let lights = [fallen, due].into_iter().flatten();
    lights.map(|span| FirstLight { stroke: span.stroke, from: span.from }).reduce(earlier)
}

/// A stretch of time that nobody recorded, and that is not yet known to have ended anywhere in
/// the job.
#[derive(Debug, Clone, Copy)]
pub(super) struct Unseen {
    /// The last cycle recorded before it; `None` before the first.
    pub(super) after: Option<u64>,
    /// How far the job had come.
    pub(super) from: Place,
    /// How long it was at most, together with later ones [cycles]; `None` where nobody knows.
    pub(super) cycles: Option<u64>,
    /// Whether no stream was being played before it, nor after it.
    pub(super) idle: bool,
}

/// Whether a record says that no stream is being played.
pub(super) fn is_idle(moment: &Moment) -> bool {
    moment.planned.is_some() && moment.asked.stream == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_is_marked_across_strokes_and_dots() {
        let lengths = [2.0, 0.0, 3.0];
        let check = |from: (u64, f64), length: f64, to: (u64, f64)| {
            let from = Place { stroke: from.0, at: from.1 };
            let found = from.after(length, lengths.into_iter().skip(from.stroke as usize - 1));
            assert_eq!((found.stroke, found.at), to, "{from:?} {length}");
        };
        check((1, 0.5), 1.0, (1, 1.5));
        check((1, 0.5), 1.5, (3, 0.0));
        check((1, 0.5), 2.5, (3, 1.0));
        check((1, 2.5), 0.5, (3, 0.5));
        check((2, 0.0), 0.0, (3, 0.0));
        check((3, 0.0), 9.0, (4, 0.0));
        check((4, 0.0), 9.0, (4, 0.0));
    }

    #[test]
    fn places_come_in_the_order_of_marking() {
        let place = |stroke, at| Place { stroke, at };
        assert!(place(1, 9.0).is_before(place(2, 0.0)));
        assert!(place(2, 0.0).is_before(place(2, 1.0)));
        assert!(!place(2, 1.0).is_before(place(2, 1.0)));
        assert_eq!(place(2, 1.0).max(place(1, 5.0)), place(2, 1.0));
    }
}
