//! Seeded random numbers for property tests, so that a failing input can be made again.

/// A splitmix64 sequence.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut value = self.0;
        value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        value ^ (value >> 31)
    }

    /// Evenly in `lower..upper`.
    pub(crate) fn between(&mut self, lower: f64, upper: f64) -> f64 {
        lower + (upper - lower) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Evenly over the orders of magnitude from `lower` to `upper`.
    pub(crate) fn logarithmic(&mut self, lower: f64, upper: f64) -> f64 {
        use signals::math::{exp, ln};
        exp(self.between(ln(lower), ln(upper)))
    }
}
