//! The speed that a job leaves open: the one that minimises the drawing's time (source 003 fig.
//! 2-12), with lines marked at one speed from a run-in to a run-out.

use machine::PathLimits;
use messages::math;
use nalgebra::Vector3;

use crate::drawing::Note;
use crate::geometry::contour::Contour;
use crate::geometry::jet::Jet;
use crate::geometry::operation::{Operation, OperationKind};
use crate::job::{Marking, MarkingSpeed};
use crate::law::flight::{DirectionLimit, Flight, FlightLimits, State};
use crate::law::profile::Move;
use crate::light::Policy;

/// Speeds tried before the best is refined, each by the same factor above the one before, and the first
/// as a share of the largest.
const TRIALS: usize = 60;
const FIRST: f64 = 1e-4;

/// Steps of golden section: the speed to a part in 10⁷ of a trial's width.
const REFINEMENTS: usize = 34;

/// (√5 − 1)/2.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The speeds of a job's lines.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Speeds {
    /// The largest while the laser is on [m/s].
    pub(crate) most: f64,
    /// What the job sets for all lines.
    fixed: Option<MarkingSpeed>,
    /// Where neither the job nor a line says anything, and of a job that asks for the optimum [m/s].
    open: f64,
}

impl Speeds {
    /// For a job that is marked as `marking` says, from `start` on, by joints that leave what `near`
    /// says.
    pub(crate) fn choose(
        start: Vector3<f64>,
        operations: &[Operation],
        limits: &PathLimits,
        near: &Near<'_>,
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
        let fixed = marking.speed;
        let asks = fixed.is_none();
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
            .filter(|contour| !matches!(fixed, Some(MarkingSpeed::Constant(_))) && is_open(contour))
            .map(|contour| (contour, contour.top_speed(limits).min(most)))
            .collect();
        let top = open.iter().map(|(_, top)| *top).fold(0.0, f64::max);
        if top > 0.0 {
            let travel = Travel::new(start, operations, limits, near);
            speeds.open = fastest(|speed| travel.time(speed, most), top);
        }
        speeds
    }

    /// The speed that the job has for a lit stretch that asks for `asked` [m/s], however fast the machine
    /// is: the measure of power that follows the speed.
    pub(crate) fn asked(&self, asked: Option<f64>) -> f64 {
        self.named(asked).unwrap_or(self.open)
    }

    /// The speed that is named for a lit stretch whose line asks for `asked` [m/s]; `None` where it is left
    /// to the planner.
    pub(crate) fn named(&self, asked: Option<f64>) -> Option<f64> {
        match self.fixed {
            Some(MarkingSpeed::Constant(speed)) => Some(speed),
            Some(MarkingSpeed::Optimum) => None,
            None => asked,
        }
    }

    /// The speed of a lit stretch that asks for `asked` [m/s].
    pub(crate) fn of(&self, asked: Option<f64>) -> f64 {
        self.asked(asked).min(self.most)
    }
}

fn paths(operations: &[Operation]) -> impl Iterator<Item = &Contour> {
    operations.iter().filter_map(|operation| match &operation.kind {
        OperationKind::Path(contour) => Some(&**contour),
        _ => None,
    })
}

/// What the joints leave of the tool's motion near a place [m].
pub(crate) type Near<'a> = dyn Fn(&Vector3<f64>) -> Vec<DirectionLimit> + 'a;

/// A drawing's moves, as far as their time depends on the speed of the open lines.
struct Travel<'a> {
    start: Vector3<f64>,
    limits: &'a PathLimits,
    moves: Vec<Step>,
}

/// One move of a drawing.
enum Step {
    /// In the dark, to a place [m].
    Go(Vector3<f64>),
    Line(Box<Line>),
}

/// A line that is marked at one speed.
struct Line {
    /// What it asks for [m/s].
    asked: Option<f64>,
    /// The largest speed at its bends [m/s].
    top: f64,
    length: f64,
    /// Its start, and its end backwards: where a run-in begins, and a run-out backwards in time.
    ends: [Jet; 2],
    /// What is left of the tool's limits along the ends.
    limits: [FlightLimits; 2],
}

impl Line {
    fn new(contour: &Contour, limits: &PathLimits, near: &Near<'_>) -> Self {
        let end = contour.end();
        let ends = [contour.start(), Jet { first: -end.first, ..end }];
        let PathLimits { speed, acceleration, jerk, .. } = *limits;
        let all = FlightLimits { speed, acceleration, jerk };
        let limits_at = |jet: &Jet| all.along(&jet.first, &near(&jet.point));
        Self {
            asked: contour.demands().first().and_then(|demand| demand.speed),
            top: contour.top_speed(limits).min(top_of_joints(contour, &all, near)),
            length: contour.length(),
            limits: [limits_at(&ends[0]), limits_at(&ends[1])],
            ends,
        }
    }
}

/// The largest constant speed along `contour` that the joints allow [m/s], looked at here and there.
fn top_of_joints(contour: &Contour, all: &FlightLimits, near: &Near<'_>) -> f64 {
    /// Places between the ends.
    const LOOKS: u32 = 8;
    (0..=LOOKS)
        .map(|look| {
            let jet = contour.at(contour.length() * f64::from(look) / f64::from(LOOKS));
            let directions = near(&jet.point);
            let infinite = FlightLimits { speed: f64::INFINITY, ..*all };
            let along = infinite.along(&jet.first, &directions).speed / jet.first.norm();
            // V²·p″ and V³·p‴, of which nothing is infinite.
            let across = all.along(&jet.second, &directions).acceleration / jet.second.norm();
            let wound = all.along(&jet.third, &directions).jerk / jet.third.norm();
            along.min(across.sqrt()).min(math::cbrt(wound))
        })
        .fold(f64::INFINITY, f64::min)
}

impl<'a> Travel<'a> {
    fn new(
        start: Vector3<f64>,
        operations: &[Operation],
        limits: &'a PathLimits,
        near: &Near<'_>,
    ) -> Self {
        let moves = operations.iter().filter_map(|operation| match &operation.kind {
            OperationKind::Path(contour) => {
                Some(Step::Line(Box::new(Line::new(contour, limits, near))))
            }
            OperationKind::Rapid(to) => Some(Step::Go(*to)),
            OperationKind::Dot(dot) => Some(Step::Go(dot.at)),
            _ => None,
        });
        Self { start, limits, moves: moves.collect() }
    }

    /// The time of all moves with the open lines at `open` [m/s], each from a run-in to a run-out [s].
    fn time(&self, open: f64, most: f64) -> f64 {
        let PathLimits { rapid, acceleration, jerk, .. } = *self.limits;
        let mut place = self.start;
        let mut total = 0.0;
        let go = |from: &Vector3<f64>, to: &Vector3<f64>| {
            Move::new((to - from).norm(), rapid, acceleration, jerk).duration()
        };
        for step in &self.moves {
            match step {
                Step::Go(to) => {
                    total += go(&place, to);
                    place = *to;
                }
                Step::Line(line) => {
                    let speed = line.asked.unwrap_or(open).min(most).min(line.top);
                    let [run_in, run_out] =
                        [0, 1].map(|end| run_in_of(&line.ends[end], speed, &line.limits[end]));
                    total += go(&place, &run_in.at(0.0).position);
                    total += run_in.duration() + line.length / speed + run_out.duration();
                    place = run_out.at(0.0).position;
                }
            }
        }
        total
    }
}

/// The part of the acceleration that the bend at an end may take in a run-in: the rest changes the speed.
const BENT: f64 = 0.99;

/// From rest to a place of a line at `speed` [m/s]. At the largest speed of its bend, or beyond what the
/// joints leave along it, nothing would be left for the run-in, which then takes hours: it is told as at
/// a bend that leaves a little.
fn run_in_of(start: &Jet, speed: f64, limits: &FlightLimits) -> Flight {
    let to = State {
        position: start.point,
        velocity: start.first * speed,
        acceleration: start.second * (speed * speed),
        ..State::rest(start.point)
    };
    let acceleration = limits.acceleration.max(to.acceleration.norm() / BENT);
    Flight::ramp_in(&to, &FlightLimits { speed, acceleration, ..*limits })
}

/// The speed up to `most` with the least time. The time has one minimum for one stroke; for many
/// it may have more, so trials come first.
pub(crate) fn fastest(time: impl Fn(f64) -> f64, most: f64) -> f64 {
    let trial = |index: usize| most * math::pow(FIRST, 1.0 - index as f64 / TRIALS as f64);
    let (mut best, mut least) = (1, f64::INFINITY);
    for index in 1..=TRIALS {
        let found = time(trial(index));
        // Of equal times the faster: it is what the limits allow.
        if found <= least {
            (best, least) = (index, found);
        }
    }
    let (mut low, mut high) = (trial(best - 1), trial((best + 1).min(TRIALS)));
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
