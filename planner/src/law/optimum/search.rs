//! The least of a function of a speed.

use messages::math;

/// Speeds tried before the best is refined, each by the same factor above the one before, and the first
/// as a share of the largest.
const TRIALS: usize = 60;
const FIRST: f64 = 1e-4;

/// Steps of golden section: the speed to a part in 10⁷ of a trial's width.
const REFINEMENTS: usize = 34;

/// (√5 − 1)/2.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

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
    let between = [trial(best - 1), trial((best + 1).min(TRIALS))];
    let refined = refined(&time, between, REFINEMENTS);
    if time(refined) < least { refined } else { trial(best) }
}

/// The speed in between with the least time, by so many `steps` of golden section.
pub(super) fn refined(
    time: &impl Fn(f64) -> f64,
    [mut low, mut high]: [f64; 2],
    steps: usize,
) -> f64 {
    let (mut left, mut right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut at_left, mut at_right) = (time(left), time(right));
    for _ in 0..steps {
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
    (low + high) / 2.0
}
