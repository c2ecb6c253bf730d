//! A curve over the cycles as lowest and highest value per bucket; buckets widen as it grows.

use messages::time::Period;

/// A curve of bounded size that keeps every extreme.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelope {
    buckets: Vec<Bucket>,
    /// Cycles per bucket.
    stride: u64,
    /// Cycles in the last bucket, `1..=stride`; 0 before the first.
    filled: u64,
}

/// The lowest and the highest value of some cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bucket {
    low: f32,
    /// Below `low` in cycles without a value.
    high: f32,
}

impl Bucket {
    const GAP: Self = Self { low: f32::INFINITY, high: f32::NEG_INFINITY };

    /// Of one value; what is not finite is a gap.
    fn of(value: Option<f64>) -> Self {
        let value = value.map(|value| value as f32).filter(|value| value.is_finite());
        value.map_or(Self::GAP, |value| Self { low: value, high: value })
    }

    fn join(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Lowest and highest; `None` of a gap.
    pub fn range(self) -> Option<(f64, f64)> {
        (self.low <= self.high).then(|| (f64::from(self.low), f64::from(self.high)))
    }
}

impl Default for Envelope {
    fn default() -> Self {
        Self { buckets: Vec::new(), stride: 1, filled: 0 }
    }
}

impl Envelope {
    /// The most buckets kept: every cycle of four minutes at 1 kHz.
    pub const CAPACITY: usize = 1 << 18;

    /// About one bucket per picture element of a chart.
    const CHART: usize = 2000;

    /// Appends the value of the next cycle; `None`, or a number that is not finite, leaves a gap.
    pub fn push(&mut self, value: Option<f64>) {
        let bucket = Bucket::of(value);
        if self.filled > 0 && self.filled < self.stride {
            if let Some(last) = self.buckets.last_mut() {
                *last = last.join(bucket);
            }
            self.filled += 1;
            return;
        }
        if self.buckets.len() >= Self::CAPACITY {
            self.widen();
        }
        self.buckets.push(bucket);
        self.filled = 1;
    }

    /// Leaves a gap of this many cycles.
    pub fn skip(&mut self, cycles: u64) {
        let mut left = cycles;
        while left > 0 {
            // The rest of the last bucket, or as much of the next one as there is.
            let free =
                if self.filled < self.stride { self.stride - self.filled } else { self.stride };
            self.push(None);
            let more = left.min(free) - 1;
            self.filled += more;
            left -= more + 1;
        }
    }

    /// Makes one bucket of every two.
    fn widen(&mut self) {
        let before = self.buckets.len();
        let halved = before.div_ceil(2);
        for index in 0..halved {
            let pair = self.buckets.get(2 * index..(2 * index + 2).min(before)).unwrap_or(&[]);
            let joined = pair.iter().fold(Bucket::GAP, |a, b| a.join(*b));
            if let Some(bucket) = self.buckets.get_mut(index) {
                *bucket = joined;
            }
        }
        self.buckets.truncate(halved);
        if before > 0 && before.is_multiple_of(2) {
            self.filled += self.stride;
        }
        self.stride *= 2;
    }

    /// The same in buckets of `stride` cycles or wider.
    #[must_use]
    pub fn at_stride(&self, stride: u64) -> Self {
        let mut coarse = self.clone();
        while coarse.stride < stride {
            coarse.widen();
        }
        coarse
    }

    /// The buckets, each of [`Self::stride`] cycles, from the first cycle on.
    pub fn buckets(&self) -> &[Bucket] {
        &self.buckets
    }

    /// Cycles per bucket, a power of two.
    pub fn stride(&self) -> u64 {
        self.stride
    }

    /// Lowest and highest of all; `None` when empty.
    pub fn range(&self) -> Option<(f64, f64)> {
        self.buckets.iter().fold(Bucket::GAP, |a, b| a.join(*b)).range()
    }

    /// The curve over cycles of `period` as lines without gaps, as fine as a chart shows it: `(time [s], value ×
    /// scale)`, one or two points a bucket.
    pub fn lines(&self, scale: f64, period: Period) -> Vec<Vec<(f64, f64)>> {
        let parts = self.buckets.len().div_ceil(Self::CHART).max(1).next_power_of_two();
        let width = (self.stride * parts as u64) as f64 * period.seconds();
        let mut lines = vec![Vec::new()];
        for (index, buckets) in self.buckets.chunks(parts).enumerate() {
            let time = index as f64 * width;
            let bucket = buckets.iter().fold(Bucket::GAP, |a, b| a.join(*b));
            match (bucket.range(), lines.last_mut()) {
                (Some((low, high)), Some(line)) => {
                    line.push((time, low * scale));
                    if high > low {
                        line.push((time + 0.5 * width, high * scale));
                    }
                }
                (None, Some(line)) if !line.is_empty() => lines.push(Vec::new()),
                _ => {}
            }
        }
        lines.retain(|line| !line.is_empty());
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_spike_survives_a_long_run() {
        let mut envelope = Envelope::default();
        for cycle in 0..1_000_000 {
            envelope.push(Some(if cycle == 654_321 { 7.0 } else { 1.0 }));
        }
        assert!(envelope.buckets.len() <= Envelope::CAPACITY);
        assert_eq!((envelope.range(), envelope.stride()), (Some((1.0, 7.0)), 4));
        assert_eq!(envelope.buckets()[654_321 / 4].range(), Some((1.0, 7.0)));
        let lines = envelope.lines(1.0, Period::OF_SETPOINTS);
        let spike = lines[0].iter().find(|point| point.1 == 7.0).expect("the spike");
        let width = 1000.0 / Envelope::CHART as f64;
        assert!((spike.0 - 654.321).abs() <= 2.0 * width, "{spike:?}");
        let last = lines[0].last().expect("a point");
        assert!((last.0 - 1000.0).abs() <= 2.0 * width, "{last:?}");
    }

    #[test]
    fn a_skipped_stretch_is_as_long_as_so_many_cycles_without_a_value() {
        let capacity = Envelope::CAPACITY as u64;
        for (before, skipped, after) in [
            (0, 3, 1),
            (5, 0, 2),
            (1, 1, 1),
            (capacity - 1, 1, 5),
            (capacity - 500, 7000, 3000),
            (9001, 4 * capacity + 1, 7),
        ] {
            let (mut one, mut other) = (Envelope::default(), Envelope::default());
            for envelope in [&mut one, &mut other] {
                (0..before).for_each(|_| envelope.push(Some(1.0)));
            }
            one.skip(skipped);
            (0..skipped).for_each(|_| other.push(None));
            for envelope in [&mut one, &mut other] {
                (0..after).for_each(|_| envelope.push(Some(2.0)));
            }
            assert_eq!(one, other, "{before} {skipped} {after}");
        }
    }

    #[test]
    fn a_coarser_curve_goes_on_where_its_last_bucket_is_full() {
        for count in 1..20_u32 {
            let mut envelope = Envelope::default();
            (0..count).for_each(|cycle| envelope.push(Some(f64::from(cycle))));
            let mut coarse = envelope.at_stride(4);
            coarse.push(Some(f64::from(count)));
            let ranges: Vec<_> = coarse.buckets().iter().map(|bucket| bucket.range()).collect();
            let expect: Vec<_> = (0..=count)
                .step_by(4)
                .map(|low| Some((f64::from(low), f64::from((low + 3).min(count)))))
                .collect();
            assert_eq!(ranges, expect, "{count}");
        }
    }

    #[test]
    fn gaps_split_the_line() {
        let mut envelope = Envelope::default();
        for value in [None, Some(1.0), Some(2.0), None, None, Some(f64::NAN), Some(3.0)] {
            envelope.push(value);
        }
        assert_eq!(
            envelope.lines(2.0, Period::OF_SETPOINTS),
            [vec![(0.001, 2.0), (0.002, 4.0)], vec![(0.006, 6.0)]]
        );
    }
}
