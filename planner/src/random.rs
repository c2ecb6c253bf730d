//! What property tests draw besides even numbers.

use messages::random::SplitMix64;

/// Evenly over the orders of magnitude from `lower` to `upper`, in their unit.
pub(crate) fn logarithmic(random: &mut SplitMix64, lower: f64, upper: f64) -> f64 {
    use messages::math::{exp, ln};
    exp(random.between(ln(lower), ln(upper)))
}
