//! The speed of each stroke: what the job asks, what path and limits allow, and, where the job
//! leaves it open, the one that minimises the drawing's time (source 003 fig. 2-12).

use machine::PathLimits;
use nalgebra::Vector3;

use crate::drawing::Note;
use crate::itinerary::{Item, Stop};
use crate::job::{Marking, MarkingSpeed};
use crate::outline::Outline;
use crate::timing::travel;

/// Speeds tried between nothing and the largest before the best is refined.
const TRIALS: usize = 50;

/// Steps of golden section: the speed to a part in 10⁷ of a trial's width.
const REFINEMENTS: usize = 34;

/// (√5 − 1)/2.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Slower than this a stroke is not worth marking [m/s].
pub(crate) const CRAWL: f64 = 1e-5;

/// The speed of each stroke, in order [m/s], and what a person should know about it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct ChosenSpeeds {
    pub(crate) speeds: Vec<f64>,
    pub(crate) notes: Vec<Note>,
}

/// A stroke whose geometry allows no speed worth marking.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TooSharp {
    pub(crate) line: u64,
    pub(crate) speed: f64,
}

/// One stroke's demand.
struct Demand {
    /// The largest speed that path and limits allow.
    top: f64,
    /// The speed asked for; `None` for the optimum.
    asked: Option<f64>,
    line: u64,
}

/// Chooses the speeds of all strokes in `stops`.
pub(crate) fn choose(
    start: Vector3<f64>,
    stops: &[Stop],
    limits: &PathLimits,
    marking: &Marking,
) -> Result<ChosenSpeeds, TooSharp> {
    let mut chosen = ChosenSpeeds::default();
    let cap = match marking.max_speed {
        Some(most) if most > limits.speed => {
            chosen.note(
                0,
                format!(
                    "max_speed of {most} m/s is above the machine's {} m/s, which rules",
                    limits.speed
                ),
            );
            limits.speed
        }
        Some(most) => most,
        None => limits.speed,
    };
    let mut demands = Vec::new();
    for outline in outlines(stops) {
        let geometry = outline.top_speed(limits);
        if geometry < CRAWL || geometry.is_nan() {
            return Err(TooSharp { line: outline.line, speed: geometry });
        }
        let asked = match marking.speed {
            Some(MarkingSpeed::Constant(speed)) => Some(speed),
            Some(MarkingSpeed::Optimum) => None,
            None => outline.speed,
        };
        demands.push(Demand { top: geometry.min(cap), asked, line: outline.line });
    }
    chosen.note_reductions(&demands, cap);
    let speeds_at = |open: f64| -> Vec<f64> {
        demands.iter().map(|demand| demand.asked.unwrap_or(open).min(demand.top)).collect()
    };
    let open = demands.iter().filter(|demand| demand.asked.is_none());
    let most = open.map(|demand| demand.top).fold(0.0, f64::max);
    if most > 0.0 {
        let time = |open: f64| {
            let speeds = speeds_at(open);
            travel(start, stops, limits, |stroke| speeds[stroke], |_| ())
        };
        chosen.speeds = speeds_at(fastest(time, most));
    } else {
        chosen.speeds = speeds_at(cap);
    }
    Ok(chosen)
}

/// All strokes in order.
pub(crate) fn outlines(stops: &[Stop]) -> impl Iterator<Item = &Outline> {
    stops.iter().filter_map(|stop| match &stop.item {
        Item::Stroke(outline) => Some(outline),
        _ => None,
    })
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

impl ChosenSpeeds {
    fn note(&mut self, line: u64, text: String) {
        self.notes.push(Note { line, text });
    }

    /// One note for all strokes that are slower than asked.
    fn note_reductions(&mut self, demands: &[Demand], cap: f64) {
        let slower = |demand: &&Demand| demand.asked.is_some_and(|asked| asked > demand.top);
        let Some(first) = demands.iter().find(slower) else { return };
        let asked = first.asked.unwrap_or(cap);
        let count = demands.iter().filter(slower).count();
        let cause = if first.top < cap {
            "its curvature within the limits of acceleration and jerk"
        } else {
            "the largest marking speed"
        };
        self.note(
            first.line,
            format!(
                "marked at {:.4} m/s instead of {asked:.4} m/s: {cause} allows no more{}",
                first.top,
                match count {
                    1 => String::new(),
                    _ => format!("; {count} strokes are slower than asked"),
                }
            ),
        );
    }
}
