//! When what of a drawing happens on paper.

use machine::PathLimits;
use nalgebra::Vector3;

use super::course::{Course, VelocityTrapezoid};
use super::strokes::{Item, NOTHING, Stroke};
use super::{Paper, PaperFacts, Profile, SpeedTime, Stretch, StrokeTime, Way};
use crate::drawing::Note;
use crate::job::MarkingSpeed;
use crate::law::optimum::fastest;
use crate::law::profile::{Move, Ramp};

/// Speeds at which the time is told.
const SPEEDS: u32 = 25;

/// A drawing that shall be put on paper.
pub(super) struct Task {
    pub(super) start: Vector3<f64>,
    pub(super) items: Vec<Item>,
    pub(super) limits: PathLimits,
    /// The largest speed while the laser is on [m/s].
    pub(super) most: f64,
    pub(super) fixed: Option<MarkingSpeed>,
    pub(super) profile: Profile,
}

impl Task {
    pub(super) fn paper(self) -> Paper {
        let strokes = || {
            self.items.iter().filter_map(|item| match item {
                Item::Stroke(stroke) if stroke.is_lit => Some(stroke),
                _ => None,
            })
        };
        let alike = |speed: f64| self.time(&|_: &Stroke| speed);
        let draws = strokes().next().is_some();
        let least = draws.then(|| {
            let speed = fastest(alike, self.most);
            SpeedTime { speed, time: alike(speed) }
        });
        // Of strokes that say their speed it is not the job's to find it.
        let open = match (self.fixed, least) {
            (Some(MarkingSpeed::Optimum), Some(least)) => least.speed,
            (None, Some(_)) if strokes().any(|stroke| stroke.asked.is_none()) => {
                fastest(|open| self.time(&|stroke: &Stroke| self.speed(stroke, open)), self.most)
            }
            _ => self.most,
        };
        let mut stretches = Vec::new();
        let mut times = Vec::new();
        let mut speed = 0.0_f64;
        let time = self.walk(&|stroke| self.speed(stroke, open), &mut |stretch| {
            if let Way::Stroke { item, .. } = stretch.way
                && let Item::Stroke(stroke) = &self.items[item]
                && stroke.is_lit
            {
                speed = speed.max(stretch.course.speed());
                times.push(StrokeTime {
                    line: stroke.line,
                    length: stroke.length,
                    speed: stretch.course.speed(),
                    time: stretch.course.duration(),
                });
            }
            stretches.push(stretch);
        });
        let curve = (1..=if draws { SPEEDS } else { 0 }).map(|index| {
            let speed = self.most * f64::from(index) / f64::from(SPEEDS);
            SpeedTime { speed, time: alike(speed) }
        });
        let facts = PaperFacts {
            profile: self.profile,
            time,
            speed,
            strokes: times,
            times: curve.collect(),
            least,
        };
        let notes = self.bends(&stretches).into_iter().collect();
        Paper { facts, notes, start: self.start, items: self.items, stretches }
    }

    /// The speed of a lit stroke with the open ones at `open` [m/s].
    fn speed(&self, stroke: &Stroke, open: f64) -> f64 {
        let speed = match self.fixed {
            Some(MarkingSpeed::Constant(speed)) => speed,
            Some(MarkingSpeed::Optimum) => open,
            None => stroke.asked.unwrap_or(open),
        };
        speed.min(self.most)
    }

    /// The time of all of it, lit strokes at what `speed` says [s].
    fn time(&self, speed: &dyn Fn(&Stroke) -> f64) -> f64 {
        self.walk(speed, &mut |_| ())
    }

    /// Gives `each` the stretches in their order, lit strokes at what `speed` says, and gives back the
    /// time of all of it [s].
    fn walk(&self, speed: &dyn Fn(&Stroke) -> f64, each: &mut dyn FnMut(Stretch)) -> f64 {
        let PathLimits { rapid, acceleration, jerk, .. } = self.limits;
        let rest_to_rest = |length: f64, speed: f64| match self.profile {
            Profile::Trapezoid => Course::Jerk(Move::new(length, speed, acceleration, jerk)),
            Profile::Velocity => {
                Course::Velocity(VelocityTrapezoid::new(length, speed, acceleration))
            }
        };
        let (mut place, mut time, mut number) = (self.start, 0.0, 0);
        let mut go_on = |course: Course, way: Way| {
            each(Stretch { start: time, course, way });
            time += course.duration();
        };
        for (item, what) in self.items.iter().enumerate() {
            let target = match what {
                Item::Rest { time, is_lit } => {
                    go_on(Course::Rest(*time), Way::Stay { at: place, is_lit: *is_lit });
                    continue;
                }
                Item::Go(to) => (*to, None),
                Item::Stroke(stroke) if stroke.is_lit => {
                    number += 1;
                    let speed = speed(stroke);
                    let course = match self.profile {
                        Profile::Trapezoid => {
                            let ramp = Ramp::to_speed(speed, acceleration, jerk);
                            let cruise = stroke.length / speed;
                            let length = stroke.length + 2.0 * ramp.length();
                            Course::Jerk(Move { ramp, cruise, length })
                        }
                        Profile::Velocity => rest_to_rest(stroke.length, speed),
                    };
                    let before = (course.length() - stroke.length) / 2.0;
                    (stroke.at(-before).point, Some((course, stroke, number, before)))
                }
                Item::Stroke(stroke) => {
                    let speed = stroke.asked.map_or(rapid, |asked| asked.min(rapid));
                    let course = rest_to_rest(stroke.length, speed);
                    (stroke.at(0.0).point, Some((course, stroke, 0, 0.0)))
                }
            };
            let (to, along) = target;
            let way = to - place;
            let length = way.norm();
            if length > NOTHING {
                let direction = way / length;
                go_on(rest_to_rest(length, rapid), Way::Free { from: place, direction });
            }
            place = to;
            if let Some((course, stroke, number, before)) = along {
                go_on(course, Way::Stroke { item, number, before });
                place = stroke.at(stroke.length + before).point;
            }
        }
        time
    }

    /// A note where a bend by itself takes more than the path's acceleration.
    fn bends(&self, stretches: &[Stretch]) -> Option<Note> {
        let mut worst: Option<(f64, u64)> = None;
        for stretch in stretches {
            if let Way::Stroke { item, .. } = stretch.way
                && let Item::Stroke(stroke) = &self.items[item]
            {
                let speed = stretch.course.speed();
                let across = speed * speed * stroke.curvature;
                if across > worst.map_or(self.limits.acceleration, |(most, _)| most) {
                    worst = Some((across, stroke.line));
                }
            }
        }
        let (across, line) = worst?;
        let text = format!(
            "on paper this bend takes {across:.3} m/s² across the path, more than the {:.3} m/s² of the \
             machine, which the profile does not know",
            self.limits.acceleration
        );
        Some(Note { line, text })
    }
}
