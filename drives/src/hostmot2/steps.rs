//! A stepper: the board makes steps at a rate, and the port closes the position loop around it.
//!
//! The rate of a cycle is what takes the accumulator from where it will be when the request arrives, by what is
//! known, to where the path is at the next arrival: `r = (P(t + T) − p̂(t))/T`, and `p̂(t + T) = p̂(t) + r·T`.
//! A reply that tells where it really was corrects `p̂`, so that errors are gone a cycle later and nothing adds
//! up. Where replies or requests are missing, the rate goes on, and `p̂` with it.

use super::lbp16::Request;
use super::{idrom::Module, path::Path};

/// Registers of a step generator.
mod register {
    pub(super) const RATE: u16 = 0;
    pub(super) const ACCUMULATOR: u16 = 1;
    pub(super) const MODE: u16 = 2;
    pub(super) const SETUP: u16 = 3;
    pub(super) const HOLD: u16 = 4;
    pub(super) const PULSE: u16 = 5;
    pub(super) const PAUSE: u16 = 6;
    pub(super) const MASTER: u16 = 9;
}

/// One step in the accumulator.
const STEP: f64 = 65_536.0;
/// What the rates have as the whole, in a turn of 32 bits.
const WHOLE: f64 = 4_294_967_296.0;
/// The longest time that a register takes, in ticks.
const LONGEST: f64 = 16_383.0;
/// By how much corrections may exceed the driver's rate of pulses.
const CORRECTION: f64 = 1.05;

/// One step generator.
#[derive(Debug, Clone)]
pub struct Steps {
    module: Module,
    unit: u32,
    /// Steps in a radian.
    per_radian: f64,
    /// The driver's largest rate [1/s].
    fastest: f64,
    /// How long a cycle is [s].
    period: f64,
    /// The share of a cycle by which the motor follows later.
    latency: f64,
    /// What the accumulator read last.
    word: u32,
    /// How far it has come from home [1/65,536 of a step].
    accumulator: i64,
    /// Where it is taken to be when the newest request arrives [steps].
    expected: f64,
    /// The rate that the newest request asks for [1/s].
    rate: f64,
}

impl Steps {
    /// The step generator `unit` of `module` at home, for a driver that takes `per_radian` steps in a radian and
    /// at most `fastest` of them in a second. The motor follows the path by the share `latency` of a cycle later.
    pub fn new(
        module: Module,
        unit: u32,
        per_radian: f64,
        fastest: f64,
        period: f64,
        latency: f64,
    ) -> Self {
        let (word, accumulator, expected, rate) = (0, 0, 0.0, 0.0);
        Self {
            module,
            unit,
            per_radian,
            fastest,
            period,
            latency,
            word,
            accumulator,
            expected,
            rate,
        }
    }

    /// Sets the generator up: step and direction, pulses as wide as their pauses, at rest.
    pub fn arm(&self, request: &mut Request) {
        let ticks = f64::from(self.module.clock) / (2.0 * CORRECTION * self.fastest);
        let ticks = ticks.floor().clamp(1.0, LONGEST) as u32;
        let address = |register| self.module.address(register, self.unit);
        request.write(address(register::RATE), 0);
        request.write(address(register::MODE), 0);
        for register in [register::SETUP, register::HOLD, register::PULSE, register::PAUSE] {
            request.write(address(register), ticks);
        }
        request.write(self.module.address(register::MASTER, 0), u32::MAX);
    }

    /// Begins a cycle along `path`, the angle from home.
    pub fn follow(&mut self, request: &mut Request, path: &Path) {
        let target = path.at(1.0 - self.latency) * self.per_radian;
        let most = self.fastest * CORRECTION;
        let rate = ((target - self.expected) / self.period).clamp(-most, most);
        // The rate as the register has it, so that its rounding does not add up.
        let counted = rate * WHOLE / f64::from(self.module.clock);
        let counted = counted.round().clamp(f64::from(i32::MIN), f64::from(i32::MAX)) as i32;
        self.rate = f64::from(counted) * f64::from(self.module.clock) / WHOLE;
        request.write(self.module.address(register::RATE, self.unit), counted as u32);
        self.expected += self.rate * self.period;
    }

    /// A cycle goes by without a request: the rate goes on.
    pub fn pass(&mut self) {
        self.expected += self.rate * self.period;
    }

    /// Reads the accumulator.
    pub fn ask(&self, request: &mut Request) {
        request.read(self.module.address(register::ACCUMULATOR, self.unit), 1);
    }

    /// How far the accumulator has come by the time that it reads `word`, `elapsed` [s] after the newest reply;
    /// `None` where no motor could have followed.
    pub fn moved(&self, word: u32, elapsed: f64) -> Option<i32> {
        let moved = word.wrapping_sub(self.word) as i32;
        let most = 2.0 * self.fastest * CORRECTION * elapsed * STEP + STEP;
        (f64::from(moved).abs() <= most).then_some(moved)
    }

    /// The accumulator had `moved` to `word` when the newest request arrived, `late` [s] after it was due.
    pub fn take(&mut self, word: u32, moved: i32, late: f64) {
        self.word = word;
        self.accumulator += i64::from(moved);
        // The rate of the request acts from its arrival to the next one's.
        self.expected = self.steps() + self.rate * (self.period - late);
    }

    /// Steps from home at the newest reply.
    pub fn steps(&self) -> f64 {
        self.accumulator as f64 / STEP
    }

    /// Whole steps from home.
    pub fn count(&self) -> i64 {
        self.accumulator >> 16
    }

    /// The accumulator reads `word` at home, at rest.
    pub fn home(&mut self, word: u32) {
        (self.word, self.accumulator) = (word, 0);
        (self.expected, self.rate) = (0.0, 0.0);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const PERIOD: f64 = 1e-3;

    /// A generator that is asked for a sine of 2 turns at 2 Hz, and what the board's accumulator does about
    /// it; every `lost`-th request is lost. The largest error at an arrival [steps].
    fn error(lost: usize) -> f64 {
        let module = Module::for_tests(100_000_000);
        let mut steps = Steps::new(module, 0, 500.0, 200e3, PERIOD, 0.0);
        let (mut path, mut board, mut worst) = (Path::new(PERIOD), 0.0_f64, 0.0_f64);
        let mut rate = 0.0;
        let origin = 4_294_900_000_u32;
        steps.home(origin);
        for cycle in 1..1000_usize {
            let turned = 4.0 * core::f64::consts::PI * PERIOD * cycle as f64;
            let target = 2.0 * core::f64::consts::TAU * (1.0 - messages::math::cos(turned));
            path.rest(target);
            let mut request = Request::default();
            // What stands in the board at this arrival.
            if cycle > 20 && lost == 0 {
                let due = path_before(cycle) * 500.0;
                worst = worst.max((board - due).abs());
            }
            steps.follow(&mut request, &path);
            let arrives = lost == 0 || cycle % lost != 0;
            if arrives {
                rate = steps.rate;
                let word = origin.wrapping_add((board * STEP).round() as i64 as u32);
                let moved = steps.moved(word, PERIOD * 3.0).unwrap();
                steps.take(word, moved, 0.0);
            }
            board += rate * PERIOD;
            if lost != 0 && arrives && cycle % lost > 2 {
                worst = worst.max((board - target * 500.0).abs());
            }
        }
        worst
    }

    fn path_before(cycle: usize) -> f64 {
        let turned = 4.0 * core::f64::consts::PI * PERIOD * (cycle as f64 - 1.0);
        2.0 * core::f64::consts::TAU * (1.0 - messages::math::cos(turned))
    }

    #[test]
    fn the_steps_are_where_the_path_is_at_every_arrival() {
        assert!(error(0) < 0.01, "{}", error(0));
    }

    #[test]
    fn what_a_lost_request_leaves_behind_is_gone_two_cycles_later() {
        assert!(error(50) < 0.05, "{}", error(50));
    }

    #[test]
    fn a_place_that_no_motor_could_reach_is_not_believed() {
        let mut steps = Steps::new(Module::for_tests(100_000_000), 0, 500.0, 200e3, PERIOD, 0.0);
        steps.home(0xffff_0000);
        assert_eq!(steps.moved(0x0001_0000, PERIOD), Some(0x2_0000), "it passes 0");
        assert_eq!(steps.moved(0x8000_0000, PERIOD), None);
    }
}
