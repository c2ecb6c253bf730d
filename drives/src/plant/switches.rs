//! The switches of the simulated machine, and axes that do not know their place.
//!
//! A switch follows the place of its axis, or of its own actuator: active beyond it. An index pulse is active
//! in a measurement when the motor has passed it since the one before. What has no place, a door or an emergency stop,
//! is set from outside.
//!
//! An axis that has to be homed counts from where it stood at power-on, as an incremental encoder does; one
//! with an absolute encoder from where that reads 0. One whose drive finds its reference by itself does not move for that:
//! the simulated drive knows it, and takes a moment.

use core::f64::consts::TAU;

use machine::operating::{HomingMethod, InputFunction, SimulatedSwitch};
use machine::{Actuator, Machine};
use messages::{ActuatorArray, CommandMode, MAX_ACTUATORS, Nanoseconds};

use crate::port::{Actuation, Measurement, Port, Profile};

/// How long a simulated drive looks for its reference, and in how many cycles at least: its places change half way, and
/// commands are of the cycle before.
const LOOKING: Nanoseconds = Nanoseconds(8_000_000);
const LEAST_LOOKING: u64 = 4;

/// A simulated machine with its switches.
pub struct Switched {
    port: Box<dyn Port>,
    actuators: Vec<Actuator>,
    switches: Vec<Switch>,
    /// Which actuators count from where they stood at first.
    counts_from_start: [bool; MAX_ACTUATORS],
    /// Actuators whose drives find their references by themselves, one bit each; those that do so for so many cycles;
    /// and those that have, and are still asked to.
    by_drive: u16,
    homing: [Option<u64>; MAX_ACTUATORS],
    homed: u16,
    /// For how many cycles a drive looks.
    looking: u64,
    /// What is taken from each measured position; `None` before the first measurement [rad].
    zero: Option<ActuatorArray>,
    absolute: ActuatorArray,
    /// Where each motor was in the measurement before [rad].
    before: Option<ActuatorArray>,
    /// Inputs that are set from outside.
    set: u64,
    /// The actuation in the port's own places.
    shifted: Actuation,
}

#[derive(Debug, Clone, Copy)]
struct Switch {
    bit: u64,
    place: SimulatedSwitch,
    actuator: Option<usize>,
    is_index: bool,
}

impl core::fmt::Debug for Switched {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.debug_struct("Switched").field("set", &self.set).finish_non_exhaustive()
    }
}

impl Switched {
    /// The plant in `port`, which is one of `machine`; itself where that has neither inputs nor homing.
    #[allow(clippy::new_ret_no_self)]
    pub fn new(machine: &Machine, port: Box<dyn Port>) -> Box<dyn Port> {
        let operating = &machine.operating;
        if operating.inputs.is_empty() && operating.homing.iter().all(Option::is_none) {
            return port;
        }
        let (mut counts_from_start, mut absolute) = ([false; MAX_ACTUATORS], [0.0; MAX_ACTUATORS]);
        let mut by_drive = 0;
        for (index, actuator) in machine.actuators.iter().enumerate().take(MAX_ACTUATORS) {
            let Some(homing) = operating.homing(actuator.axis) else { continue };
            match homing.method {
                HomingMethod::Absolute => absolute[index] = homing.position / actuator.ratio,
                HomingMethod::Drive => {
                    counts_from_start[index] = true;
                    by_drive |= 1 << index;
                }
                _ => counts_from_start[index] = true,
            }
        }
        let switches = operating.bits().filter_map(|(bit, input)| {
            let (actuator, is_index) = match input.function {
                InputFunction::Home { actuator, .. } => (actuator, false),
                InputFunction::Index { actuator, .. } => (actuator, true),
                _ => (None, false),
            };
            input.simulated.map(|place| Switch { bit, place, actuator, is_index })
        });
        Box::new(Self {
            switches: switches.collect(),
            actuators: machine.actuators.clone(),
            port,
            counts_from_start,
            by_drive,
            homing: [None; MAX_ACTUATORS],
            homed: 0,
            looking: machine.realtime.period.cycles_for(LOOKING).max(LEAST_LOOKING),
            zero: None,
            absolute,
            before: None,
            set: 0,
            shifted: Actuation::DISABLED,
        })
    }

    fn shift(&mut self, actuation: &Actuation) {
        self.shifted = *actuation;
        let zero = self.zero.unwrap_or(self.absolute);
        self.shifted.position.iter_mut().zip(zero).for_each(|(place, zero)| *place += zero);
        let asked = if actuation.mode == CommandMode::Driven { actuation.homing } else { 0 };
        self.homed &= asked;
        for index in 0..MAX_ACTUATORS {
            let bit = 1 << index;
            if asked & self.by_drive & !self.homed & bit == 0 {
                self.homing[index] = None;
            } else if self.homing[index].is_none() {
                self.homing[index] = Some(0);
            }
            // It stays where it is meanwhile.
            if let Some(before) = self.before.filter(|_| self.homing[index].is_some()) {
                (self.shifted.position[index], self.shifted.velocity[index]) = (before[index], 0.0);
            }
        }
    }

    /// Goes on with the homings; the bits of those that are under way.
    fn look(&mut self) -> u16 {
        let mut away = 0;
        for index in 0..MAX_ACTUATORS {
            let Some(cycles) = &mut self.homing[index] else { continue };
            *cycles += 1;
            // Found in the middle of its time: places change while it follows no target.
            if *cycles == self.looking / 2
                && let Some(zero) = &mut self.zero
            {
                zero[index] = 0.0;
            }
            if *cycles < self.looking {
                away |= 1 << index;
            } else {
                self.homing[index] = None;
                self.homed |= 1 << index;
            }
        }
        away
    }

    /// Whether `switch` is active with the motors at `angle`, which were at `before` [rad].
    fn is_active(&self, switch: &Switch, angle: &ActuatorArray, before: &ActuatorArray) -> bool {
        let SimulatedSwitch { axis, side, at } = switch.place;
        let mut own = self.actuators.iter().enumerate().filter(|(index, actuator)| {
            actuator.axis == axis && switch.actuator.is_none_or(|own| own == *index)
        });
        if switch.is_index {
            return own.next().is_some_and(|(index, actuator)| {
                let turn = |angle: f64| ((angle - at / actuator.ratio) / TAU).floor();
                turn(angle[index]) != turn(before[index])
            });
        }
        let (mut joint, mut shares) = (0.0, 0.0);
        for (index, actuator) in own {
            joint += actuator.share * angle[index] * actuator.ratio;
            shares += actuator.share;
        }
        shares > 0.0 && (joint / shares - at) * side.sign() >= 0.0
    }

    fn inputs(&self, angle: &ActuatorArray) -> u64 {
        let before = self.before.unwrap_or(*angle);
        let active = self.switches.iter().filter(|switch| self.is_active(switch, angle, &before));
        active.fold(self.set, |inputs, switch| inputs | switch.bit)
    }
}

impl Port for Switched {
    fn profile(&self) -> &Profile {
        self.port.profile()
    }

    fn send(&mut self, actuation: &Actuation) {
        self.shift(actuation);
        self.port.send(&self.shifted);
    }

    fn receive(&mut self, measurement: &mut Measurement) {
        self.port.receive(measurement);
        let angle = measurement.position;
        measurement.inputs = self.inputs(&angle);
        self.before = Some(angle);
        if self.zero.is_none() {
            let from = |index: usize| {
                if self.counts_from_start[index] { angle[index] } else { self.absolute[index] }
            };
            self.zero = Some(core::array::from_fn(from));
        }
        measurement.homing = self.look();
        let zero = self.zero.unwrap_or_default();
        measurement.position.iter_mut().zip(zero).for_each(|(place, zero)| *place -= zero);
    }

    fn pass(&mut self, actuation: &Actuation) {
        self.shift(actuation);
        self.port.pass(&self.shifted);
    }

    fn set_inputs(&mut self, inputs: u64) {
        self.set = inputs;
    }
}
