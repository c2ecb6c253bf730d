//! Step generators: a rate that is added up at every clock, and a step for each whole number passed.
//!
//! The accumulator holds steps with 32 bits behind the point, of which the register shows 16. When the rate
//! changes its sign, direction hold and set-up time pass before the accumulator moves on: no public text
//! says how the firmware delays the steps, so that is a choice of this emulator. What steps are asked for
//! faster than pulse and pause allow is counted, not left out.

use super::clock::{Bank, Clock};
use super::layout::STEPGENS;
use messages::Nanoseconds;

/// Registers by their number.
mod register {
    pub(super) const RATE: u16 = 0;
    pub(super) const ACCUMULATOR: u16 = 1;
    pub(super) const MODE: u16 = 2;
    pub(super) const SETUP: u16 = 3;
    pub(super) const HOLD: u16 = 4;
    pub(super) const PULSE: u16 = 5;
    pub(super) const PAUSE: u16 = 6;
    pub(super) const MASTER: u16 = 9;
    pub(super) const SAMPLED: u16 = 10;
}

/// One step in the accumulator.
const STEP: i64 = 1 << 32;

#[derive(Debug, Clone, Copy, Default)]
struct Generator {
    rate: i32,
    /// Steps since power-on, 32 bits behind the point.
    accumulator: i64,
    /// The same, of the steps that left by a connected pin.
    delivered: i64,
    /// What the register shows where the DPLL samples it.
    sample: i64,
    /// Sign of the last motion.
    direction: i32,
    /// Ticks to wait for the direction.
    waiting: i64,
    /// Whether the pin of its steps is connected.
    connected: bool,
}

/// All of them.
#[derive(Debug, Clone, Default)]
pub struct Stepgens {
    generators: [Generator; STEPGENS],
    mode: Bank<STEPGENS>,
    setup: Bank<STEPGENS>,
    hold: Bank<STEPGENS>,
    pulse: Bank<STEPGENS>,
    pause: Bank<STEPGENS>,
    /// What all rates are scaled by, as a fraction of 2³².
    master: u32,
    /// Which timer of the DPLL samples the accumulators, if one does.
    sampled: u32,
    too_fast: u64,
}

impl Stepgens {
    /// The register `index` of `instance`.
    pub fn read(&self, index: u16, instance: usize) -> u32 {
        let generator = self.generators.get(instance).copied().unwrap_or_default();
        match index {
            register::RATE => generator.rate as u32,
            register::ACCUMULATOR => {
                let shown =
                    if self.timer().is_some() { generator.sample } else { generator.accumulator };
                (shown >> 16) as u32
            }
            register::MODE => self.mode.get(instance),
            register::SETUP => self.setup.get(instance),
            register::HOLD => self.hold.get(instance),
            register::PULSE => self.pulse.get(instance),
            register::PAUSE => self.pause.get(instance),
            register::MASTER => self.master,
            register::SAMPLED => self.sampled,
            _ => 0,
        }
    }

    /// Writes the register `index` of `instance`.
    pub fn write(&mut self, index: u16, instance: usize, value: u32) {
        match index {
            register::RATE => self.set_rate(instance, value as i32),
            register::ACCUMULATOR => {
                if let Some(generator) = self.generators.get_mut(instance) {
                    generator.accumulator = i64::from(value as i32) << 16;
                }
            }
            register::MODE => self.mode.set(instance, value),
            register::SETUP => self.setup.set(instance, value & 0x3fff),
            register::HOLD => self.hold.set(instance, value & 0x3fff),
            register::PULSE => self.pulse.set(instance, value & 0x3fff),
            register::PAUSE => self.pause.set(instance, value & 0x3fff),
            register::MASTER => self.master = value,
            register::SAMPLED => self.sampled = value,
            _ => {}
        }
    }

    fn set_rate(&mut self, instance: usize, rate: i32) {
        let turn = i64::from(self.setup.get(instance)) + i64::from(self.hold.get(instance));
        let step = i64::from(self.pulse.get(instance)) + i64::from(self.pause.get(instance));
        let Some(generator) = self.generators.get_mut(instance) else { return };
        if rate != 0 && generator.direction * rate.signum() < 0 {
            generator.waiting = turn;
        }
        if rate != 0 {
            generator.direction = rate.signum();
        }
        generator.rate = rate;
        self.too_fast += u64::from(i64::from(rate).saturating_abs().saturating_mul(step) > STEP);
    }

    /// Moves from `from` to `to`, with the rates as they are.
    pub fn advance(&mut self, from: Nanoseconds, to: Nanoseconds) {
        let ticks = Clock::Low.ticks(to) - Clock::Low.ticks(from);
        // All ones is the whole rate.
        let scale = if self.master == 0 { 0 } else { i128::from(self.master) + 1 };
        for generator in &mut self.generators {
            let waited = generator.waiting.min(ticks);
            generator.waiting -= waited;
            let travel = i128::from(generator.rate) * i128::from(ticks - waited) * scale;
            let travel = (travel >> 32) as i64;
            generator.accumulator = generator.accumulator.wrapping_add(travel);
            if generator.connected {
                generator.delivered = generator.delivered.wrapping_add(travel);
            }
        }
    }

    /// Tells which step pins are connected to their generators.
    pub fn connect(&mut self, connected: [bool; STEPGENS]) {
        for (generator, connected) in self.generators.iter_mut().zip(connected) {
            generator.connected = connected;
        }
    }

    /// The timer of the DPLL that samples the accumulators, 0..=4; `None` if they are read as they are.
    pub fn timer(&self) -> Option<u8> {
        (self.sampled & 1 << 15 != 0).then_some((self.sampled >> 12 & 7) as u8)
    }

    /// Takes the sample that is read from now on.
    pub fn sample(&mut self) {
        for generator in &mut self.generators {
            generator.sample = generator.accumulator;
        }
    }

    /// Steps that left the board, with what of the next one has passed.
    pub fn delivered(&self, instance: usize) -> f64 {
        let steps = self.generators.get(instance).map_or(0, |generator| generator.delivered);
        steps as f64 / STEP as f64
    }

    /// Steps per second that leave the board.
    pub fn speed(&self, instance: usize) -> f64 {
        let Some(generator) = self.generators.get(instance) else { return 0.0 };
        if !generator.connected || self.master == 0 {
            return 0.0;
        }
        let scale = (f64::from(self.master) + 1.0) / STEP as f64;
        f64::from(generator.rate) / STEP as f64 * f64::from(Clock::Low.hertz()) * scale
    }

    /// How often a rate was written that pulse and pause do not allow.
    pub fn too_fast(&self) -> u64 {
        self.too_fast
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn running(rate: i32) -> Stepgens {
        let mut stepgens = Stepgens::default();
        stepgens.connect([true; STEPGENS]);
        stepgens.write(register::MASTER, 0, u32::MAX);
        stepgens.write(register::RATE, 0, rate as u32);
        stepgens
    }

    #[test]
    fn the_rate_is_added_at_every_clock() {
        // 10,000 steps/s.
        let rate = (1e4 * STEP as f64 / 1e8) as i32;
        let mut stepgens = running(rate);
        for millisecond in 0..1000 {
            let at = |index: i64| Nanoseconds(index * 1_000_000);
            stepgens.advance(at(millisecond), at(millisecond + 1));
        }
        // The rate is rounded to 0.02 steps/s.
        assert!((stepgens.delivered(0) - 1e4).abs() < 0.03, "{}", stepgens.delivered(0));
        assert_eq!(stepgens.read(register::ACCUMULATOR, 0) >> 16, 9999);
        assert!((stepgens.speed(0) - 1e4).abs() < 0.03);
    }

    #[test]
    fn without_the_master_rate_nothing_moves() {
        let mut stepgens = running(1 << 20);
        stepgens.write(register::MASTER, 0, 0);
        stepgens.advance(Nanoseconds(0), Nanoseconds(1_000_000));
        assert_eq!(stepgens.read(register::ACCUMULATOR, 0), 0);
    }

    #[test]
    fn a_step_that_nobody_is_connected_to_is_counted_but_not_delivered() {
        let mut stepgens = running(1 << 20);
        stepgens.connect([false; STEPGENS]);
        stepgens.advance(Nanoseconds(0), Nanoseconds(1_000_000));
        assert!(stepgens.read(register::ACCUMULATOR, 0) > 0);
        assert_eq!((stepgens.delivered(0), stepgens.speed(0)), (0.0, 0.0));
    }

    #[test]
    fn a_turn_waits_for_hold_and_setup() {
        let mut stepgens = running(1 << 20);
        stepgens.write(register::SETUP, 0, 1000);
        stepgens.write(register::HOLD, 0, 500);
        stepgens.advance(Nanoseconds(0), Nanoseconds(1_000_000));
        let before = stepgens.delivered(0);
        stepgens.write(register::RATE, 0, -(1 << 20) as u32);
        // 1,500 ticks are 15 µs.
        stepgens.advance(Nanoseconds(1_000_000), Nanoseconds(1_015_000));
        assert_eq!(stepgens.delivered(0), before);
        stepgens.advance(Nanoseconds(1_015_000), Nanoseconds(2_015_000));
        assert_eq!(stepgens.delivered(0), 0.0);
    }

    #[test]
    fn a_rate_beyond_pulse_and_pause_is_counted() {
        let mut stepgens = running(0);
        stepgens.write(register::PULSE, 0, 200);
        stepgens.write(register::PAUSE, 0, 200);
        // 400 ticks a step: 250,000 steps/s.
        let rate = |hertz: f64| (hertz * STEP as f64 / 1e8) as u32;
        stepgens.write(register::RATE, 0, rate(249e3));
        assert_eq!(stepgens.too_fast(), 0);
        stepgens.write(register::RATE, 0, rate(251e3));
        assert_eq!(stepgens.too_fast(), 1);
    }
}
