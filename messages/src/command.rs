//! Controller to drives: what the motors and the laser shall do in the next cycle.

use crate::{ActuatorArray, Cycle, Fault, LaserCycle, Nanoseconds, OperatorRequest, sample};

/// What drives shall do with the motors. Discriminants are the values in samples; 1 to 3 were modes of
/// the machine as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum CommandMode {
    /// Power stage off; the motor coasts.
    #[default]
    Disabled = 0,
    /// Each motor follows the target that the machine file has for its drive: voltage, torque, velocity or
    /// position.
    Driven = 4,
    /// The drive brakes to rest at its own limit of deceleration and holds.
    QuickStop = 5,
}

impl CommandMode {
    /// The mode with this number in a sample; an unknown number reads as [`Self::QuickStop`].
    pub fn from_wire(value: u32) -> Self {
        match value {
            0 => Self::Disabled,
            4 => Self::Driven,
            _ => Self::QuickStop,
        }
    }
}

/// Bits of [`Given::lost`].
pub mod lost {
    /// The planner.
    pub const PLANNER: u32 = 1;
    /// Drives.
    pub const DRIVES: u32 = 1 << 1;
    /// The domain's holder.
    pub const SUPERVISOR: u32 = 1 << 2;
}

sample! {
    /// What the controller was given for a command, beside the feedback and the setpoints themselves: with these it
    /// can be made again.
    Given = "graver.Given.v1" {
        /// When the newest of its setpoints was published; 0 without any.
        newest: Nanoseconds,
        /// How many setpoints it took from the planner.
        setpoints: u32,
        /// Peers that were lost, bits of [`lost`].
        lost: u32,
        /// Inputs that slow devices made active, one bit each in the order of the machine file.
        slow: u64,
        /// The request that it carried out or refused; zeros without one.
        request: OperatorRequest,
    }
}

sample! {
    /// The answer to one feedback. Drives latches it and applies it at the next deadline, always.
    Command = "graver.Command.v7" {
        /// The `Feedback::epoch` this answers: a command for another run of drives is not fresh.
        epoch: u64,
        /// The feedback this answers; it takes effect at the deadline of `cycle + 1`.
        cycle: Cycle,
        /// Ticket of the newest reset that a person asked for, 0 for none; drives clears its own
        /// latched stop only when this changes.
        reset: u64,
        /// The stream being played, 0 for none.
        stream: u64,
        /// Stroke being marked in the cycle in which this command acts, from 1; 0 for none.
        stroke: u64,
        /// When the controller read the feedback.
        received: Nanoseconds,
        /// When the controller published this.
        published: Nanoseconds,
        /// When the planner published the newest setpoint used here; 0 for none.
        setpoint_published: Nanoseconds,
        /// A [`CommandMode`].
        mode: u32,
        /// A [`ControllerState`](crate::ControllerState).
        state: u32,
        /// Digital outputs in the order of the machine file, one bit each: 1 is on, whichever level that is.
        outputs: u64,
        /// Actuators whose drives shall look for their references by themselves, one bit each: once each time that it is
        /// set. A drive whose bit is taken back comes to rest.
        homing: u64,
        /// Stream time at the instant of the feedback [s].
        stream_time: f64,
        /// Rate at which the stream is played, 1 as planned.
        rate: f64,
        /// Where the plan has the tool at the instant of the feedback, machine frame [m].
        tool: [f64; 3],
        /// Position reference at the instant of the feedback, motor side [rad].
        reference: ActuatorArray,
        /// Reference minus feedback [rad at the motor].
        following_error: ActuatorArray,
        /// Target position at the end of the cycle in which this acts [rad at the motor]. All targets are
        /// given; a drive follows the one of its mode, and may take those after it as feedforward.
        position: ActuatorArray,
        /// Target velocity in the cycle in which this acts [rad/s at the motor].
        velocity: ActuatorArray,
        /// Target torque in the cycle in which this acts [N·m at the motor].
        effort: ActuatorArray,
        /// Motor voltage for the cycle in which this acts [V].
        voltage: ActuatorArray,
        /// The laser in the cycle in which this acts.
        laser: LaserCycle,
        /// The latched fault, if any.
        fault: Fault,
        /// How many answers this controller has given, this one included: from 1, without gaps.
        number: u64,
        /// What it was made of.
        given: Given,
    }
}

impl Command {
    /// The mode.
    pub fn mode(&self) -> CommandMode {
        CommandMode::from_wire(self.mode)
    }

    /// The controller's state.
    pub fn state(&self) -> crate::ControllerState {
        crate::ControllerState::from_wire(self.state)
    }
}
