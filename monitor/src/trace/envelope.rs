//! A curve over the cycles as lowest and highest value per bucket; buckets widen as it grows.

use messages::time::Period;

/// A curve of bounded size that keeps every extreme.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelope {
    buckets: Vec<Option<(f64, f64)>>,
    /// Cycles per bucket.
    stride: u64,
    /// Cycles in the last bucket, `1..=stride`; 0 before the first.
    filled: u64,
}

impl Default for Envelope {
    fn default() -> Self {
        Self { buckets: Vec::new(), stride: 1, filled: 0 }
    }
}

impl Envelope {
    /// The most buckets kept: about one per picture element of the charts.
    pub const CAPACITY: usize = 2000;

    /// Appends the value of the next cycle; `None`, or a number that is not finite, leaves a gap.
    pub fn push(&mut self, value: Option<f64>) {
        let value = value.filter(|value| value.is_finite()).map(|value| (value, value));
        if self.filled > 0 && self.filled < self.stride {
            if let Some(last) = self.buckets.last_mut() {
                *last = join(*last, value);
            }
            self.filled += 1;
            return;
        }
        if self.buckets.len() >= Self::CAPACITY {
            self.buckets = self
                .buckets
                .chunks(2)
                .map(|pair| pair.iter().fold(None, |a, b| join(a, *b)))
                .collect();
            self.stride *= 2;
        }
        self.buckets.push(value);
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

    /// Lowest and highest of all; `None` when empty.
    pub fn range(&self) -> Option<(f64, f64)> {
        self.buckets.iter().fold(None, |a, b| join(a, *b))
    }

    /// The curve over cycles of `period` as lines without gaps: `(time [s], value × scale)`, one or two points
    /// a bucket.
    pub fn lines(&self, scale: f64, period: Period) -> Vec<Vec<(f64, f64)>> {
        let width = self.stride as f64 * period.seconds();
        let mut lines = vec![Vec::new()];
        for (index, bucket) in self.buckets.iter().enumerate() {
            let time = index as f64 * width;
            match (bucket, lines.last_mut()) {
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

fn join(a: Option<(f64, f64)>, b: Option<(f64, f64)>) -> Option<(f64, f64)> {
    match (a, b) {
        (Some(a), Some(b)) => Some((a.0.min(b.0), a.1.max(b.1))),
        _ => a.or(b),
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
        assert_eq!(envelope.range(), Some((1.0, 7.0)));
        let lines = envelope.lines(1.0, Period::OF_SETPOINTS);
        let spike = lines[0].iter().find(|point| point.1 == 7.0).expect("the spike");
        let width = envelope.stride as f64 * 1e-3;
        assert!((spike.0 - 654.321).abs() <= width, "{spike:?}");
        let last = lines[0].last().expect("a point");
        assert!((last.0 - 1000.0).abs() <= 2.0 * width, "{last:?}");
    }

    #[test]
    fn a_skipped_stretch_is_as_long_as_so_many_cycles_without_a_value() {
        for (before, skipped, after) in
            [(0, 3, 1), (5, 0, 2), (1, 1, 1), (1999, 1, 5), (1500, 7000, 3000), (9001, 123_456, 7)]
        {
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
