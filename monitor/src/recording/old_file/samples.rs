//! The samples as they stood in `samples.bin`; these never change again.

use messages::{
    ActuatorArray, Command, Cycle, Fault, Feedback, LaserCycle, MAX_ACTUATORS, Nanoseconds, Sample,
};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// A record of the file.
#[derive(Debug, Clone, Copy, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub(super) struct OldRecord {
    pub(super) feedback: OldFeedback,
    pub(super) command: OldCommand,
}

pub(super) use layouts::{OldCommand, OldFeedback};

/// Each field has the name and the meaning that it has in the sample of today.
#[allow(missing_docs, unreachable_pub)]
mod layouts {
    use super::*;

    messages::sample! {
        /// What drives measured.
        OldFeedback = "graver.Feedback.v4" {
            epoch: u64,
            cycle: Cycle,
            deadline: Nanoseconds,
            measured: Nanoseconds,
            published: Nanoseconds,
            exchange: Nanoseconds,
            command_cycle: Cycle,
            command_received: Nanoseconds,
            command_published: Nanoseconds,
            command_applied: Nanoseconds,
            missed: u64,
            overruns: u64,
            status: u32,
            skipped: u16,
            reserved: u16,
            inputs: u64,
            counts: [i64; MAX_ACTUATORS],
            position: ActuatorArray,
            velocity: ActuatorArray,
            current: ActuatorArray,
            tool: [f64; 3],
            laser: LaserCycle,
            fault: Fault,
        }
    }

    messages::sample! {
        /// What the controller answered.
        OldCommand = "graver.Command.v5" {
            epoch: u64,
            cycle: Cycle,
            reset: u64,
            stream: u64,
            stroke: u64,
            received: Nanoseconds,
            published: Nanoseconds,
            setpoint_published: Nanoseconds,
            mode: u32,
            state: u32,
            outputs: u64,
            stream_time: f64,
            rate: f64,
            tool: [f64; 3],
            reference: ActuatorArray,
            following_error: ActuatorArray,
            position: ActuatorArray,
            velocity: ActuatorArray,
            effort: ActuatorArray,
            voltage: ActuatorArray,
            laser: LaserCycle,
            fault: Fault,
        }
    }
}

impl From<&OldFeedback> for Feedback {
    fn from(old: &OldFeedback) -> Self {
        // What was reserved then is `homing` now.
        Self::read_from_bytes(old.as_bytes()).unwrap_or_else(|_| Self::zeroed())
    }
}

impl From<&OldCommand> for Command {
    fn from(old: &OldCommand) -> Self {
        Self {
            epoch: old.epoch,
            cycle: old.cycle,
            reset: old.reset,
            stream: old.stream,
            stroke: old.stroke,
            received: old.received,
            published: old.published,
            setpoint_published: old.setpoint_published,
            mode: old.mode,
            state: old.state,
            outputs: old.outputs,
            stream_time: old.stream_time,
            rate: old.rate,
            tool: old.tool,
            reference: old.reference,
            following_error: old.following_error,
            position: old.position,
            velocity: old.velocity,
            effort: old.effort,
            voltage: old.voltage,
            laser: old.laser,
            fault: old.fault,
            ..Self::zeroed()
        }
    }
}
