//! The periods of a cycle, kept in memory that is ready before the first one.

use signals::Nanoseconds;

/// Records the time between successive instants.
#[derive(Debug)]
pub struct PeriodRecorder {
    periods: Vec<Nanoseconds>,
    last: Option<Nanoseconds>,
    dropped: u64,
}

impl PeriodRecorder {
    /// A recorder with room for `capacity` periods, its memory touched.
    pub fn new(capacity: usize) -> Self {
        let mut periods = vec![Nanoseconds(1); capacity];
        periods.clear();
        Self { periods, last: None, dropped: 0 }
    }

    /// Takes an instant; the first one only starts. A full recorder counts instead. Does not
    /// allocate.
    pub fn record(&mut self, instant: Nanoseconds) {
        if let Some(last) = self.last.replace(instant) {
            if self.periods.len() < self.periods.capacity() {
                self.periods.push(instant - last);
            } else {
                self.dropped += 1;
            }
        }
    }

    /// The periods, in order.
    pub fn periods(&self) -> &[Nanoseconds] {
        &self.periods
    }

    /// Periods for which there was no room.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn periods_are_differences_and_a_full_recorder_counts() {
        let mut recorder = PeriodRecorder::new(3);
        for instant in [100, 110, 130, 131, 150, 180] {
            recorder.record(Nanoseconds(instant));
        }
        assert_eq!(recorder.periods(), [Nanoseconds(10), Nanoseconds(20), Nanoseconds(1)]);
        assert_eq!(recorder.dropped(), 2);
    }
}
