//! Controller to planner and operators: how far the stream has come.

use crate::{Fault, Nanoseconds, sample};

sample! {
    /// Published every few cycles; the planner's licence to send more.
    Progress = "graver.Progress.v9" {
        /// When it was published.
        published: Nanoseconds,
        /// The stream in the look-ahead, 0 for none.
        stream: u64,
        /// Setpoints of this stream taken into the look-ahead so far: the acknowledged count.
        accepted: u64,
        /// Setpoints of this stream whose time has passed.
        played: u64,
        /// How many setpoints the look-ahead still has room for.
        room: u64,
        /// Stroke being marked, from 1; 0 for none.
        stroke: u64,
        /// Line of the job file where the motion under way begins, from 1; 0 where it has none.
        line: u64,
        /// The newest stream that was finished or given up, 0 for none.
        finished_stream: u64,
        /// Rate at which the stream is played.
        rate: f64,
        /// The rate that was asked for, 0.1..=2. Above 1 the stream is played as planned, and what is
        /// not yet sent may be planned anew at so much higher a speed.
        override_rate: f64,
        /// So many times the power that the stream asks for is given, 0.1..=2; 1 again after each stream.
        power_override: f64,
        /// The most of the rate that rapids are played at, 0.1..=1.
        rapid_override: f64,
        /// Tool position the plan has now, machine frame [m].
        tool: [f64; 3],
        /// Speed that the plan gives the tool along its path now, at the rate at which it is played [m/s].
        speed: f64,
        /// Laser power that the newest command asks for, as a fraction of full scale; 0 in the dark.
        power: f64,
        /// Joint reference now, load side [m or rad]: where a new stream must start.
        position: crate::AxisArray,
        /// Digital inputs in the order of the machine file, one bit each: 1 is active.
        inputs: u64,
        /// Digital outputs in the order of the machine file, one bit each: 1 is on.
        outputs: u64,
        /// Axes that know their place, one bit each.
        homed: u32,
        /// The axis that was probed last, from 1; 0 before the probe has touched.
        probed_axis: u32,
        /// Where its joint was when the probe touched [m or rad].
        probed: f64,
        /// How many requests of people the controller has accepted: an [`OperatorReply`](crate::OperatorReply)
        /// with a greater `number` has no effect here yet.
        requests: u32,
        /// A [`MotionEnd`](crate::MotionEnd): how the newest motion by hand ended, 0 while it lasts.
        motion_end: u32,
        /// A [`ControllerState`](crate::ControllerState).
        state: u32,
        /// 1 if the newest finished stream was played to its end, else 0.
        completed: u32,
        /// A [`HoldCause`](crate::HoldCause): why a stream that is held stands, 0 while none is.
        hold_cause: u32,
        /// 1 if light was measured in the newest cycle, else 0.
        lit: u32,
        /// The latched fault, if any.
        fault: Fault,
    }
}
