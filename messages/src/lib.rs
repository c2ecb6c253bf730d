//! What the stages of Graver say to each other: fixed-size samples, time, fault codes, and the
//! one source of transcendental functions and of random numbers.
//!
//! Nothing here does input or output, allocates in a cycle, or knows how a sample travels.
//! A sample is plain bytes: `#[repr(C)]`, no padding, no `bool`, no `enum`, no `Option`, arrays of
//! [`MAX_AXES`] or [`MAX_ACTUATORS`] with what is unused at zero. It can therefore be sent, hashed, logged and replayed
//! as it stands. [`sample::Sample`] names each type and hashes its layout.
//!
//! Units are SI with angles in radians. Names carry no unit, the documentation does.

pub mod artwork;
pub mod axis;
pub mod command;
pub mod delay;
pub mod fault;
pub mod feedback;
pub mod finite;
pub mod hop;
pub mod job;
pub mod laser;
pub mod math;
pub mod motion;
pub mod operator;
pub mod plan;
pub mod progress;
pub mod random;
pub mod refusal;
pub mod report;
pub mod run_folder;
pub mod sample;
pub mod setpoint;
pub mod slow;
pub mod stall;
pub mod state;
pub mod time;

pub use axis::{ActuatorArray, AxisArray, MAX_ACTUATORS, MAX_AXES};
pub use command::{Command, CommandMode, Given};
pub use fault::{Fault, FaultCode, FaultQuantity};
pub use feedback::Feedback;
pub use job::{JobOffer, PlannerPhase, PlannerReport};
pub use laser::{GateEdge, LaserCycle, MAX_EDGES, TooManyEdges};
pub use motion::MotionEnd;
pub use operator::{OperatorReply, OperatorRequest, OperatorVerb, SimulatedInputs};
pub use progress::Progress;
pub use refusal::Refusal;
pub use report::{ControllerReport, DrivesReport, LinkCounters, RealtimeFacts};
pub use sample::Sample;
pub use setpoint::{SentSetpoint, Setpoint};
pub use slow::{DeviceState, MAX_DEVICES, MAX_INPUTS, SlowDevice, SlowInputs};
pub use stall::{StallCause, Stalls};
pub use state::{ControllerState, HoldCause};
pub use time::{Cycle, Nanoseconds};
