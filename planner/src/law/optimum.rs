//! The speed that a job leaves open: the one that minimises the drawing's time (source 003 fig.
//! 2-12), with lines marked at one speed from a run-in to a run-out.

use machine::PathLimits;
use nalgebra::Vector3;

use crate::drawing::Note;
use crate::geometry::contour::Contour;
use crate::geometry::jet::Jet;
use crate::geometry::operation::{Operation, OperationKind};
use crate::job::{Marking, MarkingSpeed};
use crate::law::flight::{Flight, FlightLimits, State};
use crate::law::profile::Move;
use crate::light::Policy;

/// Speeds tried between nothing and the largest before the best is refined.
const TRIALS: usize = 50;

/// Steps of golden section: the speed to a part in 10⁷ of a trial's width.
const REFINEMENTS: usize = 34;

/// (√5 − 1)/2.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The speeds of a job's lines.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Speeds {
    /// The largest while the laser is on [m/s].
    pub(crate) most: f64,
    /// What the job sets for all lines [m/s].
    fixed: Option<f64>,
    /// Where neither the job nor a line says anything [m/s].
    open: f64,
}

impl Speeds {
    /// For a job that is marked as `marking` says, from `start` on.
    pub(crate) fn choose(
        start: Vector3<f64>,
        operations: &[Operation],
        limits: &PathLimits,
        marking: &Marking,
        notes: &mut Vec<Note>,
    ) -> Self {
        let most = match marking.max_speed {
            Some(most) if most > limits.speed => {
                let text = format!(
                    "max_speed of {most} m/s is above the machine's {} m/s, which rules",
                    limits.speed
                );
                notes.push(Note { line: 0, text });
                limits.speed
            }
            Some(most) => most,
            None => limits.speed,
        };
        let fixed = match marking.speed {
            Some(MarkingSpeed::Constant(speed)) => Some(speed),
            Some(MarkingSpeed::Optimum) | None => None,
        };
        let asks = marking.speed.is_none();
        let mut speeds = Self { most, fixed, open: most };
        let is_open = |contour: &Contour| {
            !asks
                || contour
                    .demands()
                    .iter()
                    .any(|demand| demand.power > 0.0 && demand.speed.is_none())
        };
        let open: Vec<(&Contour, f64)> = paths(operations)
            .filter(|contour| contour.policy == Policy::Constant && contour.is_lit())
            .filter(|contour| fixed.is_none() && is_open(contour))
            .map(|contour| (contour, contour.top_speed(limits).min(most)))
            .collect();
        let top = open.iter().map(|(_, top)| *top).fold(0.0, f64::max);
        if top > 0.0 {
            speeds.open = fastest(|speed| travel(start, operations, limits, speed, most), top);
        }
        if marking.speed == Some(MarkingSpeed::Optimum) {
            speeds.fixed = Some(speeds.open);
        }
        speeds
    }

    /// The speed of a lit stretch that asks for `asked` [m/s].
    pub(crate) fn of(&self, asked: Option<f64>) -> f64 {
        self.fixed.or(asked).unwrap_or(self.open).min(self.most)
    }
}

fn paths(operations: &[Operation]) -> impl Iterator<Item = &Contour> {
    operations.iter().filter_map(|operation| match &operation.kind {
        OperationKind::Path(contour) => Some(&**contour),
        _ => None,
    })
}

/// The time of all moves with the open lines at `open` [m/s], each from a run-in to a run-out [s].
fn travel(
    start: Vector3<f64>,
    operations: &[Operation],
    limits: &PathLimits,
    open: f64,
    most: f64,
) -> f64 {
    let mut place = start;
    let mut total = 0.0;
    for operation in operations {
        let mut go = |to: Vector3<f64>, place: &mut Vector3<f64>| {
            let length = (to - *place).norm();
            total += Move::new(length, limits.rapid, limits.acceleration, limits.jerk).duration();
            *place = to;
        };
        match &operation.kind {
            OperationKind::Path(contour) => {
                let asked = contour.demands().first().and_then(|demand| demand.speed);
                let speed = asked.unwrap_or(open).min(most).min(contour.top_speed(limits));
                let run_in = run_in_of(&contour.start(), speed, limits);
                let end = contour.end();
                // Backwards in time the velocity is the other way, and the acceleration the same.
                let run_out = run_in_of(&Jet { first: -end.first, ..end }, speed, limits);
                go(run_in.at(0.0).position, &mut place);
                total += run_in.duration() + contour.length() / speed + run_out.duration();
                place = run_out.at(0.0).position;
            }
            OperationKind::Rapid(to) => go(*to, &mut place),
            OperationKind::Dot(dot) => go(dot.at, &mut place),
            _ => {}
        }
    }
    total
}

/// From rest to a place of a line at `speed` [m/s].
fn run_in_of(start: &Jet, speed: f64, limits: &PathLimits) -> Flight {
    let to = State {
        position: start.point,
        velocity: start.first * speed,
        acceleration: start.second * (speed * speed),
    };
    let PathLimits { acceleration, jerk, .. } = *limits;
    Flight::ramp_in(&to, &FlightLimits { speed, acceleration, jerk })
}

/// The speed up to `most` with the least time. The time has one minimum for one stroke; for many
/// it may have more, so trials come first.
fn fastest(time: impl Fn(f64) -> f64, most: f64) -> f64 {
    let trial = |index: usize| most * index as f64 / TRIALS as f64;
    let (mut best, mut least) = (1, f64::INFINITY);
    for index in 1..=TRIALS {
        let found = time(trial(index));
        // Of equal times the faster: it is what the limits allow.
        if found <= least {
            (best, least) = (index, found);
        }
    }
    let (mut low, mut high) = (trial(best - 1).max(most * 1e-3), trial((best + 1).min(TRIALS)));
    let (mut left, mut right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut at_left, mut at_right) = (time(left), time(right));
    for _ in 0..REFINEMENTS {
        if at_left < at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - GOLDEN * (high - low);
            at_left = time(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + GOLDEN * (high - low);
            at_right = time(right);
        }
    }
    let refined = (low + high) / 2.0;
    if time(refined) < least { refined } else { trial(best) }
}
