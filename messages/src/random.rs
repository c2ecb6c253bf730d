//! Repeatable random numbers: the same from the same seed, on every platform.

/// What the state grows by at each number: 2⁶⁴ over the golden ratio, made odd.
const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014):
/// a counter whose values are mixed. Good for samples and tests, not for secrets.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SplitMix64 {
    state: u64,
}

impl SplitMix64 {
    /// The sequence that belongs to `seed`; any seed is as good as another.
    pub const fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The next number, evenly over all 64 bits.
    pub const fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GAMMA);
        let mut mixed = self.state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// The next number, from 0 to below `end`, which is at least 1; evenly for ends far below 2⁶⁴.
    pub const fn below(&mut self, end: u64) -> u64 {
        self.bits() % end
    }

    /// The next number, evenly from 0 to below 1.
    pub fn fraction(&mut self) -> f64 {
        // The upper 53 bits: as many as a number holds.
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// The next number, evenly from `lower` to below `upper`, in their unit.
    pub fn between(&mut self, lower: f64, upper: f64) -> f64 {
        lower + (upper - lower) * self.fraction()
    }
}

#[cfg(test)]
mod tests {
    use super::SplitMix64;

    /// As the authors' C and Java's `SplittableRandom` have them.
    #[test]
    fn the_numbers_are_the_published_ones() {
        let mut random = SplitMix64::new(1_234_567);
        let found = [(); 5].map(|()| random.bits());
        assert_eq!(
            found,
            [
                6_457_827_717_110_365_317,
                3_203_168_211_198_807_973,
                9_817_491_932_198_370_423,
                4_593_380_528_125_082_431,
                16_408_922_859_458_223_821,
            ]
        );
        assert_eq!(SplitMix64::new(0).bits(), 0xe220_a839_7b1d_cdaf);
    }

    #[test]
    fn fractions_fill_their_range_evenly() {
        let mut random = SplitMix64::new(1);
        let mut counts = [0; 10];
        for _ in 0..10_000 {
            let fraction = random.fraction();
            assert!((0.0..1.0).contains(&fraction), "{fraction}");
            counts[(fraction * 10.0) as usize] += 1;
            let between = random.between(-3.0, 5.0);
            assert!((-3.0..5.0).contains(&between), "{between}");
        }
        assert!(counts.iter().all(|count| (900..1100).contains(count)), "{counts:?}");
    }
}
