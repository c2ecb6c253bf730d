//! Motors: what turns a shaft, and what that takes.

mod dc;
mod stepper;

pub use dc::DcMotor;
pub use stepper::{BeyondTorque, StepperMotor};

/// The motor of an axis. All axes of a machine have motors of one kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motor {
    /// A brushed motor, driven by voltage.
    Dc(DcMotor),
    /// A hybrid stepper, driven by pulses.
    Stepper(StepperMotor),
}

/// What bounds a motor's torque, and how fast it can change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Supply {
    /// Largest current; of a stepper, that of its pull-out torque [A].
    pub current: f64,
    /// Voltage of the supply [V].
    pub voltage: f64,
    /// Inductance that it has to overcome [H].
    pub inductance: f64,
    /// Torque per current [N·m/A].
    pub torque_constant: f64,
}

impl Motor {
    /// Inertia at the shaft on the motor's side of the transmission's spring [kg·m²].
    pub fn rotor_inertia(&self) -> f64 {
        match self {
            Self::Dc(motor) => motor.rotor_inertia,
            Self::Stepper(motor) => motor.rotor_inertia,
        }
    }

    /// The DC motor, if it is one.
    pub fn dc(&self) -> Option<&DcMotor> {
        match self {
            Self::Dc(motor) => Some(motor),
            Self::Stepper(_) => None,
        }
    }

    /// The DC motor, if it is one, to be changed.
    pub fn dc_mut(&mut self) -> Option<&mut DcMotor> {
        match self {
            Self::Dc(motor) => Some(motor),
            Self::Stepper(_) => None,
        }
    }

    /// The stepper, if it is one.
    pub fn stepper(&self) -> Option<&StepperMotor> {
        match self {
            Self::Dc(_) => None,
            Self::Stepper(motor) => Some(motor),
        }
    }

    /// The speed that it never exceeds [rad/s]: a DC motor's without load, a stepper's at its
    /// largest pulse rate.
    pub fn largest_speed(&self) -> f64 {
        match self {
            Self::Dc(motor) => motor.no_load_speed(),
            Self::Stepper(motor) => motor.largest_speed(),
        }
    }

    /// What the supply can do to the torque at `speed` [rad/s].
    pub fn supply(&self, speed: f64) -> Supply {
        match self {
            Self::Dc(motor) => Supply {
                current: motor.current,
                voltage: motor.voltage,
                inductance: motor.inductance,
                torque_constant: motor.torque_constant,
            },
            Self::Stepper(motor) => {
                let torque_constant = motor.holding_torque / motor.current;
                Supply {
                    current: motor.pull_out_torque(speed) / torque_constant,
                    voltage: motor.voltage,
                    inductance: motor.inductance,
                    torque_constant,
                }
            }
        }
    }

    /// The torque that it gives at standstill [N·m].
    pub fn stall_torque(&self) -> f64 {
        match self {
            Self::Dc(motor) => motor.stall_torque(),
            Self::Stepper(motor) => motor.holding_torque,
        }
    }
}
