//! The watchdog: when it has not been fed for its time, it bites, and all pins become inputs.

use messages::Nanoseconds;

use super::clock::Clock;

/// What feeds it.
const FEED: u32 = 0x5a00_0000;
/// Bit of its time that switches it off.
const OFF: u32 = 0x8000_0000;

/// The watchdog, off until its time is written.
#[derive(Debug, Clone)]
pub struct Watchdog {
    timer: u32,
    bitten: bool,
    fed: Nanoseconds,
    longest: Nanoseconds,
}

impl Default for Watchdog {
    fn default() -> Self {
        Self { timer: OFF, bitten: false, fed: Nanoseconds(0), longest: Nanoseconds(0) }
    }
}

impl Watchdog {
    /// The register `index`.
    pub fn read(&self, index: u16) -> u32 {
        match index {
            0 => self.timer,
            1 => u32::from(self.bitten),
            _ => 0,
        }
    }

    /// Writes the register `index` at `now`.
    pub fn write(&mut self, index: u16, value: u32, now: Nanoseconds) {
        match index {
            0 => (self.timer, self.fed) = (value, now),
            1 => (self.bitten, self.fed) = (value & 1 != 0, now),
            2 if value & 0xff00_0000 == FEED => {
                if self.expiry().is_some() {
                    self.longest = self.longest.max(now - self.fed);
                }
                self.fed = now;
            }
            _ => {}
        }
    }

    /// When it bites if it is not fed before; `None` if it is off or has bitten.
    pub fn expiry(&self) -> Option<Nanoseconds> {
        if self.bitten || self.timer & OFF != 0 {
            return None;
        }
        Some(self.fed + Clock::Low.time(i64::from(self.timer) + 1))
    }

    /// Bites where its time is over at `now`; whether it did.
    #[must_use]
    pub fn bite(&mut self, now: Nanoseconds) -> bool {
        let over = self.expiry().is_some_and(|expiry| now >= expiry);
        self.bitten |= over;
        over
    }

    /// The longest that it waited to be fed without biting.
    pub fn longest(&self) -> Nanoseconds {
        self.longest
    }

    /// Whether it has bitten.
    pub fn has_bitten(&self) -> bool {
        self.bitten
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_bites_when_it_is_not_fed_and_until_it_is_cleared() {
        let mut watchdog = Watchdog::default();
        assert!(!watchdog.bite(Nanoseconds(1_000_000_000)));
        // 5 ms.
        watchdog.write(0, 499_999, Nanoseconds(0));
        watchdog.write(2, 0x5a00_0000, Nanoseconds(3_000_000));
        assert!(!watchdog.bite(Nanoseconds(7_999_999)));
        assert!(watchdog.bite(Nanoseconds(8_000_000)));
        watchdog.write(2, 0x5a00_0000, Nanoseconds(9_000_000));
        assert_eq!((watchdog.read(1), watchdog.expiry()), (1, None));
        watchdog.write(1, 0, Nanoseconds(10_000_000));
        assert_eq!(watchdog.expiry(), Some(Nanoseconds(15_000_000)));
    }

    #[test]
    fn only_its_own_word_feeds_it() {
        let mut watchdog = Watchdog::default();
        watchdog.write(0, 499_999, Nanoseconds(0));
        watchdog.write(2, 0xa500_0000, Nanoseconds(4_000_000));
        assert_eq!(watchdog.expiry(), Some(Nanoseconds(5_000_000)));
    }
}
