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

    /// The largest torque that its power stage or driver gives at `speed` of the shaft [rad/s], in N·m. A
    /// DC motor's is the same at every speed for as long as the supply can drive the current.
    #[inline]
    pub fn largest_torque(&self, speed: f64) -> f64 {
        match self {
            Self::Dc(motor) => motor.largest_torque(),
            Self::Stepper(motor) => motor.pull_out_torque(speed),
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
