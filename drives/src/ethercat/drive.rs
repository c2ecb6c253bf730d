//! One drive in motion: from the targets of an actuator to what the drive is told, and from what it says to what was
//! measured.

use machine::{Actuator, ActuatorMode};
use messages::Nanoseconds;

use super::cia402::{self, State, Wanted};
use super::homing::{Heard, Homing};
use super::image::{Said, Told};
use super::network::DriveFacts;
use crate::port::Actuation;
use machine::operating::Homing as Search;

/// How much farther than its speed takes it a drive that looks for its reference may come in a cycle: by a late frame.
const MOST_STEP: f64 = 2.0;

/// The drive of an actuator.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    /// What it told of itself.
    pub(super) facts: DriveFacts,
    mode: ActuatorMode,
    code: i8,
    /// Angle of a count [rad].
    resolution: f64,
    torque_constant: f64,
    /// Angle at which the machine stood when the port was opened [rad].
    home: f64,
    /// Position there [counts], from the first measurement on.
    zero: Option<i64>,
    /// Position without the wrap of its 32 bits [counts].
    counts: i64,
    /// How far it moved in a cycle when it was heard last [counts].
    speed: f64,
    /// The axis that it moves.
    pub(super) axis: usize,
    homing: Homing,
    /// The angle of the reference that it finds by itself, if it does [rad].
    reference: Option<f64>,
    /// The most that it moves in a cycle while it looks for that [counts].
    most: u64,
    /// Whether it has failed to.
    is_lost: bool,
    said: Said,
    told: Told,
}

impl Drive {
    /// The drive that told `facts`, of an actuator that stands at `home` [rad], in cycles of `period`; how it looks for its
    /// reference by itself, if it does.
    pub(super) fn new(
        facts: DriveFacts,
        actuator: &Actuator,
        home: f64,
        looks: Option<&Search>,
        period: Nanoseconds,
    ) -> Self {
        let resolution = actuator.encoder.resolution();
        let counts = |joint: f64| (joint / (actuator.ratio * resolution)).abs();
        let most = looks.map_or(0.0, |it| MOST_STEP * counts(it.speed) * period.seconds());
        Self {
            facts,
            mode: actuator.mode,
            code: cia402::mode(actuator.mode).map_or(0, |(code, _)| code),
            resolution,
            torque_constant: actuator.motor.dc().map_or(1.0, |motor| motor.torque_constant),
            home,
            zero: None,
            counts: 0,
            speed: 0.0,
            axis: actuator.axis,
            homing: Homing::new(period),
            reference: looks.map(|it| it.position / actuator.ratio),
            most: most.ceil() as u64,
            is_lost: false,
            said: Said::default(),
            told: Told::default(),
        }
    }

    /// Takes what it shall be told: `false` where a target is no number, which is not told.
    pub(super) fn tell(&mut self, wanted: Wanted, actuation: &Actuation, index: usize) -> bool {
        let state = State::of(self.said.status);
        self.told = Told {
            control: state.control(wanted, self.told.control),
            mode: self.code,
            position: self.counts as i32,
            ..Told::default()
        };
        if wanted != Wanted::Enabled || state != State::Enabled {
            self.homing.forget();
            self.is_lost = false;
            return true;
        }
        let asked = self.reference.is_some() && actuation.homing >> index & 1 != 0;
        let (control, mode) = self.homing.ask(asked && !self.is_lost);
        self.told.control |= control;
        self.told.mode = mode.unwrap_or(self.code);
        let of =
            |targets: &messages::ActuatorArray| targets.get(index).copied().unwrap_or(f64::NAN);
        let [position, velocity, effort] =
            [of(&actuation.position), of(&actuation.velocity), of(&actuation.effort)];
        let needed = match self.mode {
            ActuatorMode::Position => [position, effort],
            ActuatorMode::Velocity => [velocity, effort],
            ActuatorMode::Torque | ActuatorMode::Voltage => [effort, effort],
        };
        if needed.iter().any(|number| !number.is_finite()) {
            self.told.control = state.control(Wanted::QuickStop, self.told.control);
            return false;
        }
        let torque = (effort / self.facts.rated * 1000.0).round() as i16;
        if self.homing.is_away() {
            // Its targets are where it is, and the torque that its weight takes, until it follows them again.
            if self.mode == ActuatorMode::Torque {
                self.told.torque = torque;
            }
            return true;
        }
        match self.mode {
            ActuatorMode::Position => {
                let moved = ((position - self.home) / self.resolution).round() as i64;
                // The position of a drive goes round in its 32 bits.
                self.told.position = (self.zero.unwrap_or(self.counts) + moved) as i32;
                self.told.torque_offset = torque;
            }
            ActuatorMode::Velocity => {
                self.told.velocity = (velocity / self.resolution).round() as i32;
                self.told.torque_offset = torque;
            }
            ActuatorMode::Torque | ActuatorMode::Voltage => self.told.torque = torque,
        }
        true
    }

    /// Puts what it is told into its outputs.
    pub(super) fn put(&self, outputs: &mut [u8]) {
        self.told.write(outputs);
    }

    /// Whether it drives its motor in the mode of its actuator.
    pub(super) fn is_powered(&self) -> bool {
        let is_in_mode = self.said.mode == self.code || self.homing.is_away();
        State::of(self.said.status).is_powered() && is_in_mode
    }

    /// Whether it looks for its reference by itself, or has not come back from that.
    pub(super) fn is_away(&self) -> bool {
        self.homing.is_away()
    }

    /// Its status word, where it has not found its reference.
    pub(super) fn lost(&self) -> Option<u16> {
        self.is_lost.then_some(self.said.status)
    }

    /// Its error code, if it has a fault.
    pub(super) fn error(&self) -> Option<u16> {
        State::of(self.said.status).is_fault().then_some(self.said.error)
    }

    /// Its digital inputs, where they are among what it says.
    pub(super) fn digital(&self) -> u32 {
        self.said.digital
    }

    /// Counts since the first measurement, or from the reference that it has found by itself, having gone on at its speed for
    /// so many cycles since it was heard.
    pub(super) fn moved(&self, coasted: u64) -> i64 {
        let moved = self.counts - self.zero.unwrap_or(self.counts);
        moved + (self.speed * coasted as f64).round() as i64
    }

    /// The motor's angle, likewise [rad].
    pub(super) fn position(&self, coasted: u64) -> f64 {
        self.home + self.moved(coasted) as f64 * self.resolution
    }

    /// What flows in the motor [A].
    pub(super) fn current(&self) -> f64 {
        f64::from(self.said.torque) * 1e-3 * self.facts.rated / self.torque_constant
    }

    /// Takes in what it says, so many `cycles` after it was heard before.
    pub(super) fn hear(&mut self, said: Said, cycles: u64) {
        match self.zero {
            None => {
                self.counts = i64::from(said.position);
                self.zero = Some(self.counts);
            }
            Some(_) => {
                let moved = i64::from(said.position.wrapping_sub(self.counts as i32));
                self.counts += moved;
                // A drive that has found its reference counts from there on before it says so: what is more than it can
                // have moved is that, and the place is told as before until all drives of the axis have found theirs.
                if self.homing.is_away() && moved.unsigned_abs() > self.most.saturating_mul(cycles)
                {
                    self.zero = self.zero.map(|zero| zero + moved);
                } else {
                    self.speed = moved as f64 / cycles.max(1) as f64;
                }
            }
        }
        match self.homing.hear(&said, self.code) {
            Heard::Nothing | Heard::Found => {}
            Heard::Failed => self.is_lost = true,
        }
        self.said = said;
    }

    /// Whether it has found its reference by itself, and waits.
    pub(super) fn has_found(&self) -> bool {
        self.homing.has_found()
    }

    /// From here on it tells places from the reference that it has found.
    pub(super) fn refer(&mut self) {
        self.counts = i64::from(self.said.position);
        self.zero = Some(0);
        self.home = self.reference.unwrap_or(self.home);
        self.homing.leave();
    }
}
