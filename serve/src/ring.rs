//! The last seconds of every signal, each cycle of them.

/// Every cycle of the last seconds, by the number of the cycle.
#[derive(Debug, Default)]
pub struct Ring {
    /// Numbers in a cycle.
    width: usize,
    /// Cycles that are kept.
    capacity: u64,
    /// Cycle `n` stands at `n % capacity`.
    rows: Vec<f32>,
    begin: u64,
    end: u64,
}

impl Ring {
    /// An empty ring of `capacity` cycles with `width` numbers each.
    pub fn new(width: usize, capacity: usize) -> Self {
        let rows = vec![f32::NAN; width * capacity.max(1)];
        Self { width, capacity: capacity.max(1) as u64, rows, begin: 0, end: 0 }
    }

    /// Adds the numbers of `cycle`. Cycles that were left out have none; an older number than the newest begins anew.
    pub fn push(&mut self, cycle: u64, numbers: impl Iterator<Item = f64>) {
        let is_new = self.begin == self.end;
        if is_new || cycle < self.end || cycle - self.end >= self.capacity {
            (self.begin, self.end) = (cycle, cycle);
        }
        while self.end < cycle {
            let row = self.slot(self.end);
            self.rows[row].fill(f32::NAN);
            self.end += 1;
        }
        let row = self.slot(cycle);
        let numbers = numbers.chain(std::iter::repeat(f64::NAN));
        self.rows[row].iter_mut().zip(numbers).for_each(|(to, from)| *to = from as f32);
        self.end = cycle + 1;
        self.begin = self.begin.max(self.end.saturating_sub(self.capacity));
    }

    /// The oldest cycle that is kept.
    pub fn begin(&self) -> u64 {
        self.begin
    }

    /// The cycle after the newest.
    pub fn end(&self) -> u64 {
        self.end
    }

    /// Cycles that can be kept.
    pub fn capacity(&self) -> u64 {
        self.capacity
    }

    /// The number at place `signal` in `cycle`; not a number where there is none.
    pub fn value(&self, cycle: u64, signal: usize) -> f32 {
        if !(self.begin..self.end).contains(&cycle) || signal >= self.width {
            return f32::NAN;
        }
        self.rows[self.slot(cycle)][signal]
    }

    fn slot(&self, cycle: u64) -> std::ops::Range<usize> {
        let first = (cycle % self.capacity) as usize * self.width;
        first..first + self.width
    }
}

#[cfg(test)]
mod tests {
    use super::Ring;

    fn push(ring: &mut Ring, cycle: u64) {
        ring.push(cycle, [cycle as f64, -(cycle as f64)].into_iter());
    }

    #[test]
    fn it_keeps_the_newest_cycles_and_no_older_ones() {
        let mut ring = Ring::new(2, 4);
        (10..17).for_each(|cycle| push(&mut ring, cycle));
        assert_eq!((ring.begin(), ring.end()), (13, 17));
        assert_eq!((ring.value(13, 0), ring.value(16, 1)), (13.0, -16.0));
        for (cycle, signal) in [(12, 0), (17, 0), (13, 2)] {
            assert!(ring.value(cycle, signal).is_nan(), "{cycle} {signal}");
        }
    }

    #[test]
    fn cycles_that_were_left_out_have_no_numbers() {
        let mut ring = Ring::new(2, 8);
        push(&mut ring, 1);
        push(&mut ring, 4);
        assert_eq!((ring.begin(), ring.end()), (1, 5));
        assert_eq!((ring.value(1, 0), ring.value(4, 0)), (1.0, 4.0));
        assert!(ring.value(2, 0).is_nan() && ring.value(3, 1).is_nan());
    }

    #[test]
    fn a_clock_that_began_anew_or_a_long_gap_begins_the_ring_anew() {
        let mut ring = Ring::new(2, 4);
        (10..13).for_each(|cycle| push(&mut ring, cycle));
        push(&mut ring, 2);
        assert_eq!((ring.begin(), ring.end()), (2, 3));
        push(&mut ring, 1000);
        assert_eq!((ring.begin(), ring.end()), (1000, 1001));
    }
}
