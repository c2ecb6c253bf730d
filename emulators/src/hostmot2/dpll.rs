//! The DPLL: a clock that follows the reading of its synchronisation register, and four timers by it.
//!
//! Its counter goes round once a period. A read of the synchronisation register should find it at zero; what
//! it is off by is read, and taken back over the periods that follow. How fast the firmware takes it back is
//! in no public text: here by 1/(1 + time constant/64) in each period, at most the limit/2²⁴ of a period.

use messages::Nanoseconds;

use super::clock::Clock;

/// Bits of its counter.
const SIZE: u32 = 42;
/// Timers, the first of which fires where the counter goes round.
pub const TIMERS: usize = 5;

/// The DPLL, at rest until its rate is written.
#[derive(Debug, Clone, Default)]
pub struct Dpll {
    base_rate: u32,
    control: [u32; 2],
    timers: [u32; 2],
    /// Where the counter is, 0..1.
    phase: f64,
    /// What each period is shorter by, as a fraction.
    correction: f64,
    /// What the last synchronisation found, in 2⁻³² of a period.
    error: i32,
}

impl Dpll {
    /// The register `index`; reading the last one synchronises.
    pub fn read(&mut self, index: u16) -> u32 {
        match index {
            0 => self.base_rate,
            1 | 6 => {
                if index == 6 {
                    self.synchronise();
                }
                self.error as u32
            }
            2 => self.control[0],
            3 => self.control[1] & 0xffff_0000 | SIZE,
            4 | 5 => self.timers[usize::from(index - 4)],
            _ => 0,
        }
    }

    /// Writes the register `index`.
    pub fn write(&mut self, index: u16, value: u32) {
        match index {
            0 => self.base_rate = value,
            1 => {
                self.error = value as i32;
                self.phase = f64::from(value) / FULL;
                self.correction = 0.0;
            }
            2 | 3 => self.control[usize::from(index - 2)] = value,
            4 | 5 => self.timers[usize::from(index - 4)] = value,
            6 => self.synchronise(),
            _ => {}
        }
    }

    /// How often its counter goes round [1/s].
    pub fn frequency(&self) -> f64 {
        let prescale = f64::from((self.control[0] >> 24).max(1));
        let nominal = f64::from(Clock::Low.hertz()) * f64::from(self.base_rate)
            / ((1_u64 << SIZE) as f64 * prescale);
        nominal * (1.0 + self.correction)
    }

    /// When a timer fires next after `now`.
    pub fn next(&self, now: Nanoseconds) -> Option<Nanoseconds> {
        let frequency = self.frequency();
        if frequency <= 0.0 {
            return None;
        }
        let next =
            self.places().map(|place| ahead(self.phase, place)).into_iter().fold(1.0, f64::min);
        // A nanosecond late rather than early, so that the timer is passed by then.
        Some(now + Nanoseconds((next / frequency * 1e9) as i64 + 1))
    }

    /// Moves on by `duration`, which is no longer than to the next timer; which timers fired.
    pub fn advance(&mut self, duration: Nanoseconds) -> [bool; TIMERS] {
        let travel = self.frequency() * duration.seconds();
        let fired = self.places().map(|place| travel > 0.0 && ahead(self.phase, place) <= travel);
        self.phase = (self.phase + travel).fract();
        fired
    }

    /// Where in a period each timer fires.
    fn places(&self) -> [f64; TIMERS] {
        let place = |word: u32, shift: u32| f64::from(word >> shift & 0xffff) / 65536.0;
        let [first, second] = self.timers;
        [0.0, place(first, 0), place(first, 16), place(second, 0), place(second, 16)]
    }

    fn synchronise(&mut self) {
        let error = if self.phase < 0.5 { self.phase } else { self.phase - 1.0 };
        self.error = (error * FULL) as i32;
        let constant = f64::from(self.control[1] >> 16);
        let limit = f64::from(self.control[0] & 0x00ff_ffff) / f64::from(1 << 24);
        self.correction = (-error / (1.0 + constant / 64.0)).clamp(-limit, limit);
    }
}

/// A period in the register of the error.
const FULL: f64 = 4_294_967_296.0;

/// From `phase` to `place`, going round: more than 0, at most 1.
fn ahead(phase: f64, place: f64) -> f64 {
    let ahead = place - phase;
    if ahead > 0.0 { ahead } else { ahead + 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 kHz, the timers 100 µs and 200 µs before the synchronisation.
    fn running() -> Dpll {
        let mut dpll = Dpll::default();
        let (prescale, size) = (24.0, (1_u64 << SIZE) as f64);
        dpll.write(0, (1000.0 * size * prescale / 1e8) as u32);
        dpll.write(2, 24 << 24 | 0x40_0000);
        dpll.write(3, 2000 << 16);
        dpll.write(4, (0.8 * 65536.0) as u32 * 65536 + (0.9 * 65536.0) as u32);
        dpll
    }

    #[test]
    fn timers_fire_before_the_synchronisation() {
        let mut dpll = running();
        assert!((dpll.frequency() - 1000.0).abs() < 1e-3, "{}", dpll.frequency());
        let (mut now, mut fired) = (Nanoseconds(0), Vec::new());
        while let Some(next) = dpll.next(now).filter(|next| *next < Nanoseconds(1_900_000)) {
            for (timer, _) in dpll.advance(next - now).iter().enumerate().filter(|(_, f)| **f) {
                fired.push((timer, next.0 / 1000));
            }
            now = next;
        }
        // The third and fourth stand at zero, as the first.
        let expected = [(2, 800), (1, 899), (0, 1000), (3, 1000), (4, 1000), (2, 1800), (1, 1899)];
        let near = |(found, at): &(usize, i64), (timer, due): &(usize, i64)| {
            found == timer && (at - due).abs() <= 1
        };
        assert_eq!(fired.len(), expected.len(), "{fired:?}");
        assert!(fired.iter().zip(&expected).all(|(a, b)| near(a, b)), "{fired:?}");
    }

    #[test]
    fn it_follows_the_reads() {
        let mut dpll = running();
        // The reader's clock is 50 ppm slow, and begins a third of a period off.
        let period = Nanoseconds(1_000_050);
        dpll.advance(Nanoseconds(333_000));
        let errors: Vec<f64> = (0..400)
            .map(|_| {
                let error = dpll.read(6) as i32;
                dpll.advance(period);
                f64::from(error) / FULL
            })
            .collect();
        assert!((errors[0] - 0.333).abs() < 1e-3);
        // What remains is what the drift brings in the time that it takes to follow, 32 periods.
        let last = errors.last().copied().unwrap_or(1.0);
        assert!((last - 50e-6 * 32.0).abs() < 2e-4, "{last}");
    }

    #[test]
    fn its_phase_can_be_set() {
        let mut dpll = running();
        dpll.advance(Nanoseconds(400_000));
        dpll.write(1, 0);
        assert_eq!(dpll.read(6), 0);
    }
}
