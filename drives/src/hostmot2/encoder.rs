//! Encoder counters: 16 bits on the board, carried on here.

use super::idrom::Module;
use super::lbp16::Request;

/// Registers of the counters.
mod register {
    pub(super) const COUNT: u16 = 0;
    pub(super) const CONTROL: u16 = 1;
}

/// One encoder.
#[derive(Debug, Clone)]
pub struct Counter {
    module: Module,
    unit: u32,
    word: u16,
    count: i64,
}

impl Counter {
    /// The counter `unit` of `module`, at home.
    pub fn new(module: Module, unit: u32) -> Self {
        Self { module, unit, word: 0, count: 0 }
    }

    /// Sets the counter up for two tracks, without index.
    pub fn arm(&self, request: &mut Request) {
        request.write(self.module.address(register::CONTROL, self.unit), 0);
    }

    /// Reads it.
    pub fn ask(&self, request: &mut Request) {
        request.read(self.module.address(register::COUNT, self.unit), 1);
    }

    /// It reads `word` at home.
    pub fn home(&mut self, word: u32) {
        (self.word, self.count) = (word as u16, 0);
    }

    /// Counts since the newest reply, where it reads `word`; `None` where it is more than `most`.
    pub fn moved(&self, word: u32, most: f64) -> Option<i16> {
        let moved = (word as u16).wrapping_sub(self.word) as i16;
        (f64::from(moved).abs() <= most).then_some(moved)
    }

    /// It had `moved` to `word`.
    pub fn take(&mut self, word: u32, moved: i16) {
        self.word = word as u16;
        self.count += i64::from(moved);
    }

    /// Counts from home.
    pub fn count(&self) -> i64 {
        self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_counts_on_beyond_16_bits_and_believes_no_leap() {
        let mut counter = Counter::new(Module::for_tests(100_000_000), 0);
        counter.home(0x1234_fff0);
        for step in 1..=8000_i64 {
            let word = (0xfff0 + 10 * step) as u32 & 0xffff;
            let Some(moved) = counter.moved(word, 50.0) else { panic!("step {step}") };
            counter.take(word, moved);
            assert_eq!(counter.count(), 10 * step);
        }
        let word = (0xfff0 + 80_000 - 60) as u32;
        assert_eq!(counter.moved(word, 50.0), None);
        assert_eq!(counter.moved(word, 70.0), Some(-60));
    }
}
