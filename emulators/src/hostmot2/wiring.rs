//! What of the machine is connected to which module of the board.

use machine::drives::{DrivesKind, Hostmot2Actuator};
use machine::{Actuator, Machine};

use super::layout::{ENCODERS, Function, PWMGENS, STEPGENS, pin_of};

/// What moves an actuator, and what counts its motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// A stepper driver, a step being a pulse of the machine file.
    Stepgen {
        /// Which step generator.
        stepgen: usize,
    },
    /// An amplifier with the motor's supply: the motor's voltage is the duty of it.
    Pwm {
        /// Which PWM generator.
        pwm: usize,
    },
    /// A mirror of the scan head.
    Mirror {
        /// Which scan head.
        xy2mod: usize,
        /// 0 its X, 1 its Y.
        axis: usize,
        /// Angle of the motor at the full scale [rad].
        full_scale: f64,
    },
}

/// One actuator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Connection {
    /// What moves it.
    pub drive: Drive,
    /// The counter of its encoder.
    pub encoder: Option<usize>,
    /// Counts of the encoder in a revolution of the motor, with an index pulse in each.
    pub counts: f64,
}

/// All that is connected.
#[derive(Debug, Clone, PartialEq)]
pub struct Wiring {
    /// The actuators, in the order of the machine.
    pub actuators: Vec<Connection>,
    /// Pins of one line that are low for light: the gate, a wired OR of outputs.
    pub gate: Vec<usize>,
    /// The PWM generator whose duty is the power; without one the power is full.
    pub power: Option<usize>,
}

impl Wiring {
    /// What `[drives.hostmot2]` of the machine file says, else the usual. The gate's line is that of all
    /// one-shots, whichever of them the file names.
    pub fn of(machine: &Machine) -> Self {
        let DrivesKind::Hostmot2(hostmot2) = &machine.drives.kind else {
            return Self::usual(machine);
        };
        let actuators = hostmot2.actuators.iter().zip(&machine.actuators);
        Self {
            actuators: actuators.map(|(own, driven)| connection(own, driven)).collect(),
            gate: gate_pins(),
            power: hostmot2.power.map(|power| power as usize),
        }
    }

    /// What an actuator without a word in the machine file is connected to: the nth stepper to the nth step
    /// generator, the nth motor to the PWM generator after it, both to the nth encoder; the gate to the
    /// second timers of all one-shots, the power to the first PWM generator.
    pub fn usual(machine: &Machine) -> Self {
        let actuators = machine.drives().enumerate().map(|(index, (actuator, _))| Connection {
            drive: match actuator.motor.dc() {
                None => Drive::Stepgen { stepgen: index },
                Some(_) => Drive::Pwm { pwm: index + 1 },
            },
            encoder: Some(index),
            counts: actuator.encoder.counts,
        });
        Self { actuators: actuators.collect(), gate: gate_pins(), power: Some(0) }
    }

    /// The same with a scan head: X and Y are the first two actuators, and ±`full_scale` [rad] of the motor
    /// the whole range.
    #[must_use]
    pub fn with_scan_head(mut self, full_scale: f64) -> Self {
        for (axis, connection) in self.actuators.iter_mut().take(2).enumerate() {
            connection.drive = Drive::Mirror { xy2mod: 0, axis, full_scale };
            connection.encoder = None;
        }
        self
    }

    /// What of it the board does not have, in words.
    pub fn lacking(&self) -> Option<String> {
        self.actuators.iter().enumerate().find_map(|(index, connection)| {
            let (module, unit, count) = match connection.drive {
                Drive::Stepgen { stepgen } => ("stepgen", stepgen, STEPGENS),
                Drive::Pwm { pwm } => ("pwm", pwm, PWMGENS),
                Drive::Mirror { xy2mod, .. } => ("xy2mod", xy2mod, super::layout::XY2MODS),
            };
            let encoder = connection.encoder.unwrap_or(0);
            if unit >= count {
                Some(format!("actuator {index} is on {module} {unit}, and the board has {count}"))
            } else if encoder >= ENCODERS {
                Some(format!(
                    "actuator {index} is on encoder {encoder}, and the board has {ENCODERS}"
                ))
            } else {
                None
            }
        })
    }
}

/// What `own` says of an actuator.
fn connection(own: &Hostmot2Actuator, actuator: &Actuator) -> Connection {
    let index = |number: u32| number as usize;
    let (drive, encoder) = match *own {
        Hostmot2Actuator::Stepgen { stepgen, encoder } => {
            (Drive::Stepgen { stepgen: index(stepgen) }, encoder)
        }
        Hostmot2Actuator::Pwm { pwm, encoder } => (Drive::Pwm { pwm: index(pwm) }, Some(encoder)),
        Hostmot2Actuator::Xy2mod { xy2mod, axis, full_scale, .. } => {
            (Drive::Mirror { xy2mod: index(xy2mod), axis: index(axis), full_scale }, None)
        }
    };
    Connection { drive, encoder: encoder.map(index), counts: actuator.encoder.counts }
}

/// The pins of the second timers of all one-shots.
fn gate_pins() -> Vec<usize> {
    (0..super::layout::ONESHOTS).filter_map(|unit| pin_of(Function::Oneshot(4, unit))).collect()
}
