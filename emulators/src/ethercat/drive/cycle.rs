//! What a drive does in each of its periods, and with each new set of targets.

use messages::Nanoseconds;

use super::super::wires::Phases;
use super::cia402::State;
use super::homing::{Homed, Homing, Method, Step};
use super::objects::{HOMING, POSITION, TORQUE, VELOCITY};
use super::servo::Target;
use super::trajectory::{Ramp, Segment};
use super::{Drive, FOLLOWING_ERROR, is_mode};

/// For how long a ramp has stood when the motor counts as resting, and as resting come what may [s].
const SETTLED: f64 = 0.005;
const GIVEN_UP: f64 = 0.1;

impl Drive {
    /// Whether the power stage drives the motor.
    pub(super) fn is_powered(&self) -> bool {
        matches!(
            self.machine.state(),
            State::OperationEnabled | State::QuickStopActive | State::FaultReactionActive
        )
    }

    /// Where the motor is, as the encoder has it [rad].
    pub(super) fn angle(&self) -> f64 {
        self.wires.motor(self.motor).counts as f64 * self.servo.resolution()
    }

    /// From one target to the next where no sync signal tells [s].
    pub(super) fn interpolation_time(&self) -> f64 {
        let exponent = f64::from(self.dictionary.signed(0x60C2, 2).clamp(-6, 0));
        f64::from(self.dictionary.number(0x60C2, 1)) * messages::math::pow(10.0, exponent)
    }

    /// A fault has come up.
    pub(super) fn fail(&mut self, code: u16) {
        let already = matches!(self.machine.state(), State::Fault | State::FaultReactionActive);
        if !already {
            (self.code, self.emergency) = (code, Some(code));
        }
        self.machine.fail();
    }

    /// The drive's own supply is gone.
    pub(super) fn power_off(&mut self) {
        self.machine = Default::default();
        (self.ramp, self.homing, self.homed, self.pace) = (None, None, Homed::Not, 0.0);
        (self.code, self.mode, self.offset) = (0, 0, 0);
        self.wires.drive(self.motor, Phases::Open);
    }

    fn stays_after_quick_stop(&self) -> bool {
        self.dictionary.signed(0x605A, 0) >= 5
    }

    /// Takes the targets that stand in the objects, `period` [s] before the next ones.
    pub(super) fn take_targets(&mut self, at: Nanoseconds, period: f64) {
        let word = self.dictionary.number(0x6040, 0) as u16;
        let started = word & !self.machine.word() & 0x10 != 0;
        let (before, was_powered) = (self.machine.state(), self.is_powered());
        let stays = self.stays_after_quick_stop();
        self.machine.control(word, stays);
        if before == State::Fault && self.machine.state() != State::Fault {
            self.code = 0;
        }
        let mode = self.dictionary.signed(0x6060, 0) as i8;
        if mode != self.mode && (mode == 0 || is_mode(mode)) {
            self.mode = mode;
            self.segment = Segment::rest(at, self.angle());
            (self.homing, self.pace) = (None, 0.0);
        }
        // Without its bit, or with the one that halts, a homing is broken off.
        let following = self.machine.state() == State::OperationEnabled;
        if !following || word & 0x0110 != 0x10 {
            self.homing = None;
        }
        if !following {
            self.pace = 0.0;
        }
        let position = self.position_target();
        if !following || self.mode != POSITION {
            self.segment = Segment::rest(at, self.angle());
        } else if !was_powered || before == State::QuickStopActive {
            self.segment = Segment::rest(at, position);
        } else {
            self.segment = self.segment.then(at, position, period);
        }
        if following && !was_powered {
            self.servo.release();
            self.astray = 0.0;
        }
        if following && self.mode == HOMING && started {
            let number = self.dictionary.signed(0x6098, 0) as i8;
            let counts = self.wires.motor(self.motor).counts;
            let revolution = i64::from(self.dictionary.number(0x608F, 1));
            self.homing = Method::of(number).map(|it| Homing::new(it, counts, revolution));
            self.homed = Homed::Not;
        }
    }

    /// Target position as the encoder has it [rad].
    fn position_target(&self) -> f64 {
        let target = i64::from(self.dictionary.signed(0x607A, 0));
        let added = i64::from(self.dictionary.signed(0x60B0, 0));
        (target + added - self.offset) as f64 * self.servo.resolution()
    }

    /// An object in counts a second, or a second squared, in radians.
    fn rate(&self, index: u16, sub: u8) -> f64 {
        f64::from(self.dictionary.signed(index, sub)) * self.servo.resolution()
    }

    /// Torque of an object in thousandths of the rated one [N·m].
    fn torque(&self, index: u16) -> f64 {
        let rated = f64::from(self.dictionary.number(0x6076, 0)) / 1000.0;
        f64::from(self.dictionary.signed(index, 0)) / 1000.0 * rated
    }

    /// Goes on by one period, the motor having been measured at `at`.
    pub(super) fn run(&mut self, at: Nanoseconds) {
        self.ticked = at;
        let wires = self.wires.motor(self.motor);
        let angle = wires.counts as f64 * self.servo.resolution();
        self.servo.observe(angle, wires.current);
        let target = match self.machine.state() {
            State::OperationEnabled => self.followed(at, angle),
            State::QuickStopActive => self.brake(0x605A, angle),
            State::FaultReactionActive => self.brake(0x605E, angle),
            _ => None,
        };
        let phases = match target {
            Some(target) => {
                let bound = self.torque(0x6072);
                Phases::Driven(self.servo.follow(target, bound, angle, wires.current))
            }
            None => Phases::Open,
        };
        self.wires.drive(self.motor, phases);
    }

    /// What an enabled drive follows.
    fn followed(&mut self, at: Nanoseconds, angle: f64) -> Option<Target> {
        self.ramp = None;
        match self.mode {
            POSITION => {
                let [position, speed] = self.segment.at(at);
                self.supervise(position - angle);
                let speed = speed + self.rate(0x60B1, 0);
                Some(Target::Position([position, speed, self.torque(0x60B2)]))
            }
            VELOCITY => {
                let speed = self.rate(0x60FF, 0) + self.rate(0x60B1, 0);
                Some(Target::Velocity([speed, self.torque(0x60B2)]))
            }
            TORQUE => Some(Target::Torque(self.torque(0x6071) + self.torque(0x60B2))),
            HOMING => Some(self.search(at, angle)),
            _ => Some(Target::Velocity([0.0, 0.0])),
        }
    }

    /// A homing goes on.
    fn search(&mut self, at: Nanoseconds, angle: f64) -> Target {
        let counts = self.wires.motor(self.motor).counts;
        let closed = self.switches.closed(counts);
        let step = self.homing.as_mut().map(|homing| homing.step(counts, closed));
        let mut wanted = 0.0;
        match step {
            Some(Step::Move(way, quick)) => {
                wanted = way * self.rate(0x6099, if quick { 1 } else { 2 });
            }
            Some(Step::Found(found)) => {
                self.offset = i64::from(self.dictionary.signed(0x607C, 0)) - found;
                (self.homing, self.homed) = (None, Homed::Attained);
            }
            Some(Step::Failed) => (self.homing, self.homed) = (None, Homed::Failed),
            None if self.pace == 0.0 => {
                let [position, _] = self.segment.at(at);
                return Target::Position([position, 0.0, 0.0]);
            }
            None => {}
        }
        let change = self.rate(0x609A, 0) * self.step;
        self.pace += (wanted - self.pace).clamp(-change, change);
        self.segment = Segment::rest(at, angle);
        Target::Velocity([self.pace, 0.0])
    }

    /// A following error beyond its limit for longer than its time is a fault.
    fn supervise(&mut self, error: f64) {
        let limit = f64::from(self.dictionary.number(0x6065, 0)) * self.servo.resolution();
        self.astray = if error.abs() > limit { self.astray + self.step } else { 0.0 };
        if self.astray > f64::from(self.dictionary.number(0x6066, 0)) * 1e-3 {
            self.fail(FOLLOWING_ERROR);
        }
    }

    /// Comes to rest as the `option` object has it, and leaves the state when it has.
    fn brake(&mut self, option: u16, angle: f64) -> Option<Target> {
        let kind = self.dictionary.signed(option, 0);
        if kind == 0 {
            self.ramp = None;
            self.machine.rested(false);
            self.machine.disable();
            return None;
        }
        let slow = matches!(kind, 1 | 5);
        let deceleration = self.rate(if slow { 0x6084 } else { 0x6085 }, 0);
        let ramp =
            self.ramp.take().unwrap_or_else(|| Ramp::new(angle, self.servo.speed(), deceleration));
        let mut ramp = ramp;
        let [position, speed] = ramp.step(self.step);
        let still = self.servo.speed().abs() < 0.01 * self.rate(0x6099, 1).max(1e-3);
        let rested = ramp.standing() > SETTLED && still || ramp.standing() > GIVEN_UP;
        let stays = self.stays_after_quick_stop();
        self.ramp = Some(ramp);
        if rested {
            self.machine.rested(stays);
        }
        if !self.is_powered() {
            self.ramp = None;
            return None;
        }
        Some(Target::Position([position, speed, 0.0]))
    }

    /// Puts what the drive measures at `at` into its objects.
    pub(super) fn tell(&mut self, at: Nanoseconds) {
        let wires = self.wires.motor(self.motor);
        let resolution = self.servo.resolution();
        // Between two periods of the loops the motor goes on at its speed.
        let age = (at - self.ticked).seconds().clamp(0.0, self.step);
        let speed = self.servo.speed() / resolution;
        let ahead = (speed * age).round() as i64;
        let position = wires.counts + ahead + self.offset;
        let [demand, _] = self.segment.at(at);
        let demand = (demand / resolution).round() as i64 + self.offset;
        let powered = self.is_powered();
        let follows = powered && self.mode == POSITION;
        let error = if follows { demand - position } else { 0 };
        let rated = f64::from(self.dictionary.number(0x6076, 0)) / 1000.0;
        let torque = (self.servo.torque(wires.current) / rated * 1000.0).round() as i16;
        let inputs = self.switches.closed(wires.counts).bits();
        let status = self.status();
        let mut put = |index, value: &[u8]| self.dictionary.put(index, 0, value);
        put(0x6041, &status.to_le_bytes());
        put(0x603F, &self.code.to_le_bytes());
        put(0x6061, &self.mode.to_le_bytes());
        put(0x6062, &(demand as i32).to_le_bytes());
        put(0x6064, &(position as i32).to_le_bytes());
        put(0x606C, &(speed.round() as i32).to_le_bytes());
        put(0x6077, &torque.to_le_bytes());
        put(0x6078, &torque.to_le_bytes());
        put(0x60F4, &(error as i32).to_le_bytes());
        put(0x60FD, &inputs.to_le_bytes());
    }

    /// The status word, with what the mode adds to it.
    fn status(&self) -> u16 {
        let enabled = self.machine.state() == State::OperationEnabled;
        let mut status = self.machine.status();
        if self.servo.is_limited() && self.is_powered() {
            status |= 0x0800;
        }
        if enabled && matches!(self.mode, POSITION | VELOCITY | TORQUE) {
            status |= 0x1000;
        }
        if self.mode == POSITION && self.astray > 0.0 {
            status |= 0x2000;
        }
        if enabled && self.mode == HOMING && self.homing.is_none() {
            let ended = match self.homed {
                Homed::Not => 0x0000,
                Homed::Attained => 0x1000,
                Homed::Failed => 0x2000,
            };
            // Reached, or at rest.
            status |= if self.pace == 0.0 { ended | 0x0400 } else { ended };
        }
        status
    }
}
