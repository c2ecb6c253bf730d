//! What is told of the windows so far.

use machine::Mechanism;
use messages::plan::Bounds;
use nalgebra::Vector3;

use super::path_run::PathRun;
use super::{Draft, Planning};
use crate::drawing::Note;
use crate::law::time_law::TimeLaw;
use crate::limits::limit_id::{BindingTimes, LimitId};

/// A line that the limits slow below what was asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slowed {
    pub(crate) line: u64,
    pub(crate) asked: f64,
    pub(crate) speed: f64,
    pub(crate) place: Vector3<f64>,
}

/// The largest speed that the job asks for while the laser is on [m/s], and the line that does.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Asked {
    pub(crate) speed: f64,
    pub(super) line: u64,
}

impl Asked {
    pub(super) fn add(&mut self, speed: f64, line: u64) {
        if speed > self.speed {
            *self = Self { speed, line };
        }
    }

    /// The note of a job that asks for more than `most` [m/s].
    pub(super) fn note(&self, most: f64) -> Option<Note> {
        let Self { speed, line } = *self;
        let text = format!(
            "asks for {speed:.4} m/s, marked at {most:.4} m/s at most: the largest marking speed \
             (path.speed of the machine, or marking.max_speed)"
        );
        (speed > most * (1.0 + 1e-9)).then_some(Note { line, text })
    }
}

/// What is told of the windows so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct Account {
    pub(crate) shares: BindingTimes,
    /// The line that is slowed most, and how many are.
    pub(super) slowed: Option<Slowed>,
    slowed_lines: u64,
    pub(crate) notes: Vec<Note>,
    /// The largest speed while the laser is on [m/s].
    pub(crate) speed: f64,
    pub(crate) asked: Asked,
    /// Length that is marked [m], and the number of lines and dots.
    pub(crate) length: f64,
    pub(crate) strokes: u64,
    /// The box around all that is marked.
    pub(crate) bounds: Option<Bounds>,
    /// Least and largest power of the laser [fraction of full scale].
    pub(crate) power: Option<[f64; 2]>,
}

/// Takes a power into a range of them.
pub(super) fn widen(range: &mut Option<[f64; 2]>, power: f64) {
    let [least, most] = range.unwrap_or([power; 2]);
    *range = Some([least.min(power), most.max(power)]);
}

impl Account {
    pub(super) fn note_slowed(&mut self, slowed: &[Slowed]) {
        let share = |slowed: &Slowed| slowed.speed / slowed.asked;
        for slowed in slowed {
            self.slowed_lines += 1;
            if self.slowed.as_ref().is_none_or(|worst| share(slowed) < share(worst)) {
                self.slowed = Some(*slowed);
            }
        }
    }

    /// One note for all lines that the limits slow down.
    pub(super) fn slowed_note(&self) -> Option<Note> {
        let Slowed { line, asked, speed, place } = self.slowed?;
        let mut text = format!(
            "slowed to {speed:.4} m/s instead of {asked:.4} m/s near x {:.3} mm, y {:.3} mm: the \
             limits allow no more there",
            place.x * 1e3,
            place.y * 1e3
        );
        if self.slowed_lines > 1 {
            text.push_str(&format!("; {} lines are slowed somewhere", self.slowed_lines));
        }
        Some(Note { line, text })
    }
}

/// A note names a line that is marked at less than this fraction of the speed asked for.
const SLOW: f64 = 0.99;

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Notes what bound the law, and where light was slower than asked.
    pub(super) fn account(&self, run: &PathRun<N>, law: &TimeLaw, draft: &mut Draft<'_>) {
        let mut slowest: Option<Slowed> = None;
        for part in law.binding() {
            let middle = (part.places.start + part.places.end) / 2.0;
            let line = run.line_at(middle);
            let position: Vector3<f64> = run.path.at(middle).point;
            if run.contour.is_lit() {
                draft.bound.add(LimitId(part.limit), part.duration, line, position.into());
            }
            let mean = (part.places.end - part.places.start) / part.duration;
            for (demand, place, limit) in run.lit_within(part.places) {
                // What the machine's largest marking speed takes of it has a note of its own.
                let is_named = self.task.speeds.named(demand.speed).is_some();
                let asked = self.task.speeds.of(demand.speed) * self.faster(demand);
                let asked = if is_named { asked } else { limit };
                let speed = run.even.unwrap_or(mean.min(limit));
                draft.speed = draft.speed.max(speed);
                let worse = slowest.is_none_or(|worst| speed / asked < worst.speed / worst.asked);
                if !run.follows && speed < SLOW * asked && worse {
                    let place = run.path.at(place).point;
                    slowest = Some(Slowed { line: demand.line, asked, speed, place });
                }
            }
        }
        draft.slowed.extend(slowest);
    }
}
