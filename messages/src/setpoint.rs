//! Planner to controller: the trajectory, one sample a setpoint period, ahead of time.

use crate::{ActuatorArray, AxisArray, LaserCycle, Nanoseconds, sample};

/// Bits of [`Setpoint::flags`].
pub mod flags {
    /// The last sample of the stream; everything is at rest.
    pub const LAST: u64 = 1;
    /// The program pauses here, at rest and in the dark, until a person resumes (M0).
    pub const PAUSE: u64 = 1 << 1;
    /// What is lit shows where a job lies: the machine file's `safety.frame_power` bounds its power.
    pub const FRAME: u64 = 1 << 2;
    /// On the way from one mark to the next, in the dark and as fast as may be: an override of rapids slows it.
    pub const RAPID: u64 = 1 << 3;
}

sample! {
    /// The planned motion at one instant of stream time, `sequence × SETPOINT_TIME`.
    ///
    /// Joint quantities are on the load side of the transmission, in the joint's own unit
    /// (metres of a carriage or belt, radians of an arm), and exact derivatives of the planned
    /// path, not differences. What the motors need for it is by actuator: their leads, in the unit of the
    /// joint and with its sign, and their efforts, torques at the shaft without friction, which the
    /// controller adds from the motor's own speed.
    ///
    /// Played at rate `r` (1 is as planned) and rate change `ṙ` [1/s], the effort is
    /// `static_effort + (effort − static_effort)·r² + momentum·ṙ`, and the lead is
    /// `static_lead + (lead − static_lead)·r² + lead_momentum·ṙ` up to the small part of the
    /// transmission's damping.
    Setpoint = "graver.Setpoint.v4" {
        /// The stream this sample belongs to; one job is one stream. Never 0.
        stream: u64,
        /// Position in the stream, from 0 without gaps.
        sequence: u64,
        /// When the planner published it: later than the one before.
        published: Nanoseconds,
        /// Bits of [`flags`].
        flags: u64,
        /// What the job has switched on: bit 0 is the air assist, bit P + 1 its digital output P.
        outputs: u64,
        /// The stroke being marked from here to the next setpoint, from 1; 0 for none.
        stroke: u64,
        /// Line of the job file where the motion under way begins, from 1; 0 where it has none.
        line: u64,
        /// Tool centre point in the machine frame [m].
        tool: [f64; 3],
        /// Speed of the tool along the path [m/s].
        path_velocity: f64,
        /// Norm of the tool's acceleration [m/s²].
        path_acceleration: f64,
        /// Norm of the tool's jerk [m/s³].
        path_jerk: f64,
        /// Joint position, load side [m or rad].
        position: AxisArray,
        /// Joint velocity, load side [m/s or rad/s].
        velocity: AxisArray,
        /// Joint acceleration, load side [m/s² or rad/s²].
        acceleration: AxisArray,
        /// Joint jerk, load side [m/s³ or rad/s³].
        jerk: AxisArray,
        /// How far the motor side is ahead of the load side through the elastic transmission, and a
        /// stepper's field ahead of its rotor, in joint units [m or rad].
        lead: ActuatorArray,
        /// The part of `lead` that does not move with the rate: what gravity stretches and turns.
        static_lead: ActuatorArray,
        /// The lead per unit of rate change [m·s or rad·s].
        lead_momentum: ActuatorArray,
        /// Torque of the motor for this motion, rotor included, friction excluded [N·m].
        effort: ActuatorArray,
        /// The part of `effort` that does not move with the rate: gravity [N·m].
        static_effort: ActuatorArray,
        /// Motor torque per unit of rate change [N·m·s].
        momentum: ActuatorArray,
        /// The laser from here to the next setpoint.
        laser: LaserCycle,
    }
}

impl Setpoint {
    /// Whether all the flags in `bits` are set.
    pub fn has(&self, bits: u64) -> bool {
        self.flags & bits == bits
    }
}

sample! {
    /// A setpoint that was sent, told once more for whoever records: on the channel of the setpoints themselves nobody
    /// but the controller may listen.
    SentSetpoint = "graver.SentSetpoint.v1" {
        /// The setpoint.
        setpoint: Setpoint,
    }
}
