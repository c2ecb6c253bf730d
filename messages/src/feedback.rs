//! Drives to controller: what was measured at a deadline, and what happened in the cycle before.

use crate::{ActuatorArray, Cycle, Fault, LaserCycle, MAX_ACTUATORS, Nanoseconds, sample};

/// Bits of [`Feedback::status`].
pub mod status {
    /// The power stages are on.
    pub const POWERED: u32 = 1;
    /// `tool` holds the tool position (simulated plant, or a bridge with a tool sensor).
    pub const TOOL_KNOWN: u32 = 1 << 1;
    /// No fresh command in the cycle that begins, or in one skipped before it: the watchdog keeps
    /// the gate closed.
    pub const COMMAND_MISSED: u32 = 1 << 2;
    /// Drives stops or has stopped the axes by itself.
    pub const WATCHDOG_TRIPPED: u32 = 1 << 3;
    /// The clock may slip for a live controller (simulated drives without `--strict`).
    pub const SLIPPING: u32 = 1 << 4;
    /// A peer was found dead at this deadline: the gate is closed whatever the command says.
    pub const GATE_INHIBITED: u32 = 1 << 5;
}

sample! {
    /// One measurement, taken at the deadline of `cycle`.
    Feedback = "graver.Feedback.v5" {
        /// Identifies this run of drives: its start on the monotonic clock [ns].
        epoch: u64,
        /// The cycle that starts with this measurement.
        cycle: Cycle,
        /// The absolute deadline of the cycle.
        deadline: Nanoseconds,
        /// When the measurement was taken.
        measured: Nanoseconds,
        /// When drives published this.
        published: Nanoseconds,
        /// How long the exchange with the hardware or the plant took.
        exchange: Nanoseconds,
        /// The feedback cycle that the command now in force answers (`Command::cycle`).
        command_cycle: Cycle,
        /// When that command reached drives; 0 before the first.
        command_received: Nanoseconds,
        /// When that command was published by the controller; 0 before the first.
        command_published: Nanoseconds,
        /// When that command was applied; 0 before the first.
        command_applied: Nanoseconds,
        /// Cycles so far in which no fresh command arrived in time.
        missed: u64,
        /// Cycles so far whose work did not end before the next deadline, slips and skipped cycles
        /// included.
        overruns: u64,
        /// Bits of [`status`].
        status: u32,
        /// Cycles left out between the feedback before and this one: drives was too late for their
        /// deadlines. Nobody measured in them, and the gate was closed. The largest number stands
        /// for all above it: so long a stall is a fault in any case.
        skipped: u16,
        /// Actuators whose drives look for their references by themselves or have not come back from that, one bit each:
        /// they follow no target. A drive that comes back without a fault has found its reference, and tells places in
        /// the machine from then on.
        homing: u16,
        /// Digital inputs in the order of the machine file, one bit each: 1 is active, whichever level that is.
        inputs: u64,
        /// Encoder counts since power-on.
        counts: [i64; MAX_ACTUATORS],
        /// Motor position from the encoder [rad].
        position: ActuatorArray,
        /// Motor velocity since the feedback before, on average [rad/s].
        velocity: ActuatorArray,
        /// Motor current [A].
        current: ActuatorArray,
        /// Tool centre point in the machine frame, if `status` says it is known [m].
        tool: [f64; 3],
        /// What the laser really did since the feedback before: in its cycle, and in those skipped
        /// after it, in which a source goes out. Offsets count from that feedback's deadline.
        laser: LaserCycle,
        /// The fault of the drives, if any.
        fault: Fault,
    }
}

impl Feedback {
    /// Cycles since the feedback before.
    pub fn elapsed(&self) -> u64 {
        u64::from(self.skipped) + 1
    }

    /// Whether all the status bits in `bits` are set.
    pub fn has(&self, bits: u32) -> bool {
        self.status & bits == bits
    }
}
