//! The source's way of marking a letter, read literally: every line has a straight run-in from rest and
//! run-out to rest, what lies between is gone in the dark from rest to rest. Closed forms in time.
//!
//! Nothing here but the shapes of the letters and the profiles is shared with the planner, whose plans of
//! the same letters so have something to be compared with.

use machine::kinematics::{Attitude, ToolMotion};
use nalgebra::{Matrix3, Vector3};
use planner::drawing::{Action, Power};
use planner::job::letters::{self, Letter, Style};
use planner::law::profile::{Move, Ramp};

use super::data::{ACCELERATION, JERK, RAPID};

/// Time between two samples [s].
const SAMPLING: f64 = 2e-4;

/// Steps in which the instant of a maximum is looked for between two samples: to 1e-4 of the sampling.
const REFINEMENTS: usize = 20;

/// A move along a straight line from rest to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// Where it starts [m].
    pub from: Vector3<f64>,
    /// Its direction, of length 1.
    pub direction: Vector3<f64>,
    /// Its course along the line.
    pub course: Move,
    /// Whether it marks, run-in and run-out included.
    pub is_mark: bool,
}

impl Stretch {
    /// In the dark.
    fn free(from: Vector3<f64>, to: Vector3<f64>) -> Self {
        let length = (to - from).norm();
        let direction = if length > 0.0 { (to - from) / length } else { Vector3::x() };
        let course = Move::new(length, RAPID, ACCELERATION, JERK);
        Self { from, direction, course, is_mark: false }
    }

    /// A line that is marked at `speed` [m/s].
    fn mark(from: Vector3<f64>, to: Vector3<f64>, speed: f64) -> Self {
        let length = (to - from).norm();
        let direction = (to - from) / length;
        let ramp = Ramp::to_speed(speed, ACCELERATION, JERK);
        let course = Move { ramp, cruise: length / speed, length: length + 2.0 * ramp.length() };
        Self { from: from - direction * ramp.length(), direction, course, is_mark: true }
    }

    fn to(&self) -> Vector3<f64> {
        self.from + self.direction * self.course.length
    }

    /// The tool `time` after the start [s].
    pub fn at(&self, time: f64) -> ToolMotion {
        let along = self.course.at(time);
        ToolMotion {
            position: self.from + self.direction * along.position,
            velocity: self.direction * along.velocity,
            acceleration: self.direction * along.acceleration,
            jerk: self.direction * along.jerk,
            attitude: Attitude::fixed(Matrix3::identity()),
        }
    }

    /// Evenly spaced instants, and the ends of all phases [s], in order.
    fn instants(&self) -> Vec<f64> {
        let whole = self.course.duration();
        let count = (whole / SAMPLING).ceil().max(1.0) as usize;
        let mut instants: Vec<f64> =
            (0..=count).map(|index| whole * index as f64 / count as f64).collect();
        let mut end = 0.0;
        for (duration, _) in self.course.phases() {
            end += duration;
            instants.push(end.min(whole));
        }
        instants.sort_by(f64::total_cmp);
        instants.dedup();
        instants
    }

    /// The largest of `value` over the time of the stretch, its instant looked for between the samples
    /// by golden section.
    ///
    /// # Errors
    /// What `value` refuses.
    pub fn largest<E>(&self, value: impl Fn(&ToolMotion) -> Result<f64, E>) -> Result<f64, E> {
        let instants = self.instants();
        let at = |time: f64| value(&self.at(time));
        let mut best = (0, f64::NEG_INFINITY);
        for (index, time) in instants.iter().enumerate() {
            let found = at(*time)?;
            if found > best.1 {
                best = (index, found);
            }
        }
        let place = |index: usize| instants.get(index).copied().unwrap_or_default();
        let mut largest = best.1;
        let middle = place(best.0);
        let sides = [
            (place(best.0.saturating_sub(1)), middle),
            (middle, place((best.0 + 1).min(instants.len() - 1))),
        ];
        for (from, to) in sides {
            largest = largest.max(golden_section(at, from, to)?);
        }
        Ok(largest)
    }
}

/// The largest of `value` between `from` and `to`.
fn golden_section<E>(
    value: impl Fn(f64) -> Result<f64, E>,
    mut from: f64,
    mut to: f64,
) -> Result<f64, E> {
    /// The golden ratio less 1.
    const PART: f64 = 0.618_033_988_749_894_9;
    let mut inner = [to - PART * (to - from), from + PART * (to - from)];
    let mut values = [value(inner[0])?, value(inner[1])?];
    for _ in 0..REFINEMENTS {
        if values[0] > values[1] {
            to = inner[1];
            inner = [to - PART * (to - from), inner[0]];
            values = [value(inner[0])?, values[0]];
        } else {
            from = inner[0];
            inner = [inner[1], from + PART * (to - from)];
            values = [values[1], value(inner[1])?];
        }
    }
    Ok(values[0].max(values[1]))
}

/// The stretches of `letter` at `height` [m] around `home` [m], marked at `speed` [m/s].
pub fn stretches(letter: Letter, height: f64, home: Vector3<f64>, speed: f64) -> Vec<Stretch> {
    let power = Power { level: 1.0, follows_speed: false };
    let drawing = letters::draw(&[letter], height, Style::H1, power, home, 0);
    let mut at = drawing.start;
    let mut stretches = Vec::new();
    for step in &drawing.steps {
        let Action::Mark { curve, .. } = &step.action else { continue };
        let mark = Stretch::mark(curve.from(), curve.to(), speed);
        stretches.push(Stretch::free(at, mark.from));
        stretches.push(mark);
        at = mark.to();
    }
    stretches
}

/// Time to mark `letter` at `height` [m] with `speed` [m/s], from the first motion to the last [s].
pub fn time(letter: Letter, height: f64, speed: f64) -> f64 {
    let stretches = stretches(letter, height, Vector3::zeros(), speed);
    stretches.iter().map(|stretch| stretch.course.duration()).sum()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::thesis::data::{HEIGHTS, LETTERS};
    use core::convert::Infallible;
    use serde_json::Value;

    #[test]
    fn letters_take_the_golden_time() {
        let text =
            include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/golden/letters.json"));
        let golden: Value = serde_json::from_str(text).unwrap();
        for letter in LETTERS {
            let results = &golden["H1_literal_J500"]["letters"][format!("{letter:?}")]["results"];
            for (index, height) in HEIGHTS.into_iter().enumerate() {
                let model = &results[index]["model"]["path_limited"];
                let close = |speed: f64, expected: &Value| {
                    let found = time(letter, height, speed);
                    let off = (found - expected.as_f64().unwrap()).abs();
                    assert!(off < 1e-9, "{letter:?} {height}: {found} for {expected}");
                };
                let printed = results[index]["thesis"]["V"].as_f64().unwrap();
                close(printed, &model["T_at_table_V"]);
                close(model["V_opt"].as_f64().unwrap(), &model["T_opt"]);
            }
        }
    }

    #[test]
    fn a_maximum_between_samples_is_found() {
        let stretch = Stretch::free(Vector3::zeros(), Vector3::x());
        // A bell around a place that is no sample's.
        let bell = |tool: &ToolMotion| {
            let off = (tool.position.x - 0.333_333) / 1e-4;
            Ok::<_, Infallible>(1.0 / (1.0 + off * off))
        };
        let found = stretch.largest(bell).unwrap();
        assert!((found - 1.0).abs() < 1e-6, "{found}");
    }
}
