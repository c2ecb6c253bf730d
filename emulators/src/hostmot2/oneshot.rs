//! One-shots: two timers each, whose outputs are high for a set time after a trigger.
//!
//! A delay and a width are the two timers of one instance, the second triggered by the end of the first. A
//! trigger of the DPLL or of the rate generator counts as a rise and a fall at one instant. External
//! triggers are not connected.

use messages::Nanoseconds;

use super::clock::{Bank, Clock};
use super::layout::ONESHOTS;

/// Registers by their number.
mod register {
    pub(super) const WIDTH: [u16; 2] = [0, 1];
    pub(super) const FILTER: [u16; 2] = [2, 3];
    pub(super) const RATE: u16 = 4;
    pub(super) const CONTROL: u16 = 5;
}

/// Bits of the control register, of the first timer; those of the second stand 16 higher.
mod control {
    pub(super) const SOURCE: u32 = 7;
    pub(super) const ON_RISE: u32 = 1 << 3;
    pub(super) const ON_FALL: u32 = 1 << 4;
    pub(super) const AGAIN: u32 = 1 << 5;
    pub(super) const ENABLE: u32 = 1 << 6;
    pub(super) const RESET: u32 = 1 << 7;
    /// Read only.
    pub(super) const OUTPUT: u32 = 1 << 8;
    pub(super) const SOFTWARE: u32 = 1 << 10;
    /// What a write sets in both halves, and the timer of the DPLL.
    pub(super) const KEPT: u32 = 0x04ff_74ff;
}

/// What triggers a timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Source {
    Software = 1,
    Dpll = 3,
    Rate = 4,
    First = 5,
    Second = 6,
}

#[derive(Debug, Clone, Copy, Default)]
struct Shot {
    /// When each timer's output falls again; `None` if it is low.
    until: [Option<Nanoseconds>; 2],
    /// When the rate generator triggers next [ticks].
    tick: f64,
}

/// All of them.
#[derive(Debug, Clone, Default)]
pub struct Oneshots {
    shots: [Shot; ONESHOTS],
    width: [Bank<ONESHOTS>; 2],
    filter: [Bank<ONESHOTS>; 2],
    rate: Bank<ONESHOTS>,
    control: Bank<ONESHOTS>,
}

impl Oneshots {
    /// The register `index` of `instance`.
    pub fn read(&self, index: u16, instance: usize) -> u32 {
        for timer in 0..2 {
            if index == register::WIDTH[timer] {
                return self.width[timer].get(instance);
            }
            if index == register::FILTER[timer] {
                return self.filter[timer].get(instance);
            }
        }
        match index {
            register::RATE => self.rate.get(instance),
            register::CONTROL => {
                let outputs = [0, 1].map(|timer| match self.output(instance, timer) {
                    true => control::OUTPUT << (16 * timer),
                    false => 0,
                });
                self.control.get(instance) | outputs[0] | outputs[1]
            }
            _ => 0,
        }
    }

    /// Writes the register `index` of `instance` at `now`.
    pub fn write(&mut self, index: u16, instance: usize, value: u32, now: Nanoseconds) {
        for timer in 0..2 {
            if index == register::WIDTH[timer] {
                self.width[timer].set(instance, value);
            }
            if index == register::FILTER[timer] {
                self.filter[timer].set(instance, value);
            }
        }
        match index {
            register::RATE => {
                self.rate.set(instance, value);
                if let Some(shot) = self.shots.get_mut(instance) {
                    shot.tick = Clock::Low.ticks(now) as f64 + period(value);
                }
            }
            register::CONTROL => self.set_control(instance, value & control::KEPT, now),
            _ => {}
        }
    }

    fn set_control(&mut self, instance: usize, value: u32, now: Nanoseconds) {
        let before = self.control.get(instance);
        self.control.set(instance, value);
        for timer in 0..2 {
            let [old, new] = [before, value].map(|word| word >> (16 * timer));
            if new & control::RESET != 0
                && let Some(shot) = self.shots.get_mut(instance)
            {
                shot.until[timer] = None;
            }
            if (old ^ new) & control::SOFTWARE != 0 {
                let rises = new & control::SOFTWARE != 0;
                self.trigger(instance, timer, Source::Software, rises, now);
            }
        }
    }

    /// Whether the output of a timer of `instance`, 0 or 1, is high.
    pub fn output(&self, instance: usize, timer: usize) -> bool {
        let shot = self.shots.get(instance);
        shot.and_then(|shot| shot.until.get(timer)).is_some_and(Option::is_some)
    }

    /// When something changes by itself next.
    pub fn next(&self) -> Option<Nanoseconds> {
        let ends = self.shots.iter().flat_map(|shot| shot.until).flatten();
        let rates = self.shots.iter().zip(self.rate.all()).filter(|(_, rate)| **rate != 0);
        let ticks = rates.map(|(shot, _)| Clock::Low.time(shot.tick.ceil() as i64));
        ends.chain(ticks).min()
    }

    /// Does what is due at `now`.
    pub fn fire(&mut self, now: Nanoseconds) {
        for instance in 0..ONESHOTS {
            for timer in 0..2 {
                let Some(shot) = self.shots.get_mut(instance) else { continue };
                if shot.until[timer].is_some_and(|until| until <= now) {
                    shot.until[timer] = None;
                    self.follow(instance, timer, false, now);
                }
            }
            let rate = self.rate.get(instance);
            let Some(shot) = self.shots.get_mut(instance) else { continue };
            if rate != 0 && Clock::Low.time(shot.tick.ceil() as i64) <= now {
                shot.tick += period(rate);
                self.pulse(instance, Source::Rate, now);
            }
        }
    }

    /// The `timer` of the DPLL, 0..=4, fires at `now`.
    pub fn dpll(&mut self, timer: u8, now: Nanoseconds) {
        for instance in 0..ONESHOTS {
            if self.control.get(instance) >> 12 & 7 == u32::from(timer) {
                self.pulse(instance, Source::Dpll, now);
            }
        }
    }

    fn pulse(&mut self, instance: usize, source: Source, now: Nanoseconds) {
        for timer in 0..2 {
            self.trigger(instance, timer, source, true, now);
            self.trigger(instance, timer, source, false, now);
        }
    }

    /// The output of `timer` changed: the other timer may follow it.
    fn follow(&mut self, instance: usize, timer: usize, rises: bool, now: Nanoseconds) {
        let source = if timer == 0 { Source::First } else { Source::Second };
        self.trigger(instance, 1 - timer, source, rises, now);
    }

    fn trigger(
        &mut self,
        instance: usize,
        timer: usize,
        source: Source,
        rises: bool,
        now: Nanoseconds,
    ) {
        let control = self.control.get(instance) >> (16 * timer);
        let edge = if rises { control::ON_RISE } else { control::ON_FALL };
        let ready = control & (control::ENABLE | control::RESET) == control::ENABLE;
        let width = self.width.get(timer).map_or(0, |width| width.get(instance));
        let Some(shot) = self.shots.get_mut(instance) else { return };
        let Some(until) = shot.until.get_mut(timer) else { return };
        let idle = until.is_none();
        if control & control::SOURCE != source as u32
            || control & edge == 0
            || !ready
            || width == 0
            || !(idle || control & control::AGAIN != 0)
        {
            return;
        }
        *until = Some(now + Clock::Low.time(i64::from(width)));
        if idle {
            self.follow(instance, timer, true, now);
        }
    }
}

/// From one trigger of the rate generator to the next [ticks].
fn period(rate: u32) -> f64 {
    (1_u64 << 32) as f64 / f64::from(rate.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// First timer by software, second at the end of the first: a delay and a width.
    const DELAYED: u32 =
        1 | control::ON_RISE | control::ENABLE | (5 | control::ON_FALL | control::ENABLE) << 16;

    fn run(oneshots: &mut Oneshots, to: Nanoseconds) -> Vec<(i64, bool)> {
        let mut edges = Vec::new();
        while let Some(next) = oneshots.next().filter(|next| *next <= to) {
            let before = oneshots.output(0, 1);
            oneshots.fire(next);
            if oneshots.output(0, 1) != before {
                edges.push((next.0, !before));
            }
        }
        edges
    }

    #[test]
    fn a_pulse_has_its_delay_and_width_to_the_clock() {
        let mut oneshots = Oneshots::default();
        oneshots.write(0, 0, 12_345, Nanoseconds(0));
        oneshots.write(1, 0, 678, Nanoseconds(0));
        oneshots.write(5, 0, DELAYED, Nanoseconds(0));
        oneshots.write(5, 0, DELAYED | control::SOFTWARE, Nanoseconds(1000));
        let edges = run(&mut oneshots, Nanoseconds(1_000_000));
        assert_eq!(edges, [(1000 + 123_450, true), (1000 + 130_230, false)]);
    }

    #[test]
    fn the_trigger_is_its_rise() {
        let mut oneshots = Oneshots::default();
        oneshots.write(0, 0, 100, Nanoseconds(0));
        oneshots.write(5, 0, DELAYED | control::SOFTWARE, Nanoseconds(0));
        assert!(oneshots.output(0, 0));
        oneshots.fire(Nanoseconds(1000));
        oneshots.write(5, 0, DELAYED | control::SOFTWARE, Nanoseconds(2000));
        assert!(!oneshots.output(0, 0), "it stayed high");
    }

    #[test]
    fn one_that_may_start_again_goes_on() {
        let mut oneshots = Oneshots::default();
        let again = 3 | control::ON_RISE | control::ENABLE | control::AGAIN | 2 << 12;
        oneshots.write(0, 3, 1000, Nanoseconds(0));
        oneshots.write(5, 3, again, Nanoseconds(0));
        oneshots.dpll(1, Nanoseconds(0));
        assert!(!oneshots.output(3, 0), "another timer");
        oneshots.dpll(2, Nanoseconds(0));
        oneshots.dpll(2, Nanoseconds(4000));
        assert_eq!(oneshots.next(), Some(Nanoseconds(14_000)));
        oneshots.write(5, 3, again & !control::AGAIN, Nanoseconds(4000));
        oneshots.dpll(2, Nanoseconds(8000));
        assert_eq!(oneshots.next(), Some(Nanoseconds(14_000)));
        oneshots.write(5, 3, again | control::RESET, Nanoseconds(9000));
        assert!(!oneshots.output(3, 0));
    }

    #[test]
    fn the_rate_generator_triggers_evenly() {
        let mut oneshots = Oneshots::default();
        oneshots.write(1, 0, 10, Nanoseconds(0));
        oneshots.write(5, 0, (4 | control::ON_RISE | control::ENABLE) << 16, Nanoseconds(0));
        oneshots.write(4, 0, 1 << 16, Nanoseconds(0)); // 65,536 ticks.
        let edges = run(&mut oneshots, Nanoseconds(1_400_000));
        assert_eq!(
            edges,
            [(655_360, true), (655_460, false), (1_310_720, true), (1_310_820, false)]
        );
    }
}
