//! What a machine is: the machine file, its mechanism, motors, transmissions and limits.
//!
//! Pure: no clock, no threads, and no file but the one it is asked to read. A machine file is
//! parsed raw, with unknown keys refused, and then validated into the types here; whoever holds a
//! [`Machine`] need not check it again.

// Units stand in brackets throughout, `[m]`, which rustdoc takes for links.
#![allow(rustdoc::broken_intra_doc_links)]

pub mod actuator;
pub mod analysis;
pub mod axis;
pub mod directions;
pub mod document;
pub mod drives;
pub mod equation_of_motion;
pub mod file;
pub mod focus;
pub mod frame;
pub mod gcode_settings;
pub mod kinematics;
pub mod laser;
pub mod limits;
pub mod machine;
pub mod mechanisms;
pub mod modbus;
pub mod motor;
pub mod offsets;
pub mod operating;
pub mod path_check;
pub mod pulses;
pub mod quantity;
pub mod surface;
pub mod taylor;
pub mod transmission;
pub mod trip;

pub use actuator::{Actuator, Encoder, Friction, HoldingBrake, LoopGains};
pub use axis::{Axis, JointUnit};
pub use directions::Directions;
pub use document::{DocumentError, Override};
pub use drives::{ActuatorMode, Drives, DrivesKind};
pub use equation_of_motion::EquationOfMotion;
pub use frame::Frame;
pub use gcode_settings::{GcodeSettings, ZMeaning};
pub use kinematics::{Mechanism, Pose};
pub use laser::LaserSource;
pub use limits::{AxisLimits, CornerMode, PathLimits, StallTolerance, Timing, WorkArea};
pub use machine::{Machine, Warning};
pub use mechanisms::{Cartesian, CoreXy, Mcm, MechanismKind, MechanismVisitor, Polar, Serial};
pub use motor::{DcMotor, Motor, StepperMotor};
pub use operating::Operating;
