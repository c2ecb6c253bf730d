//! Final reports: what each stage alone can know, sent when a stream ends and every second.

use crate::{ActuatorArray, AxisArray, Cycle, Fault, Stalls, sample};

/// Bits of [`RealtimeFacts::refused`].
pub mod refused {
    /// SCHED_FIFO with the priority asked for.
    pub const PRIORITY: u32 = 1;
    /// Locking the process's memory.
    pub const MEMORY: u32 = 1 << 1;
    /// Pinning to the CPU asked for.
    pub const CORE: u32 = 1 << 2;
    /// The name that claims the CPU: somebody holds it who has no real-time thread there.
    pub const CLAIM: u32 = 1 << 3;
}

sample! {
    /// Facts of a stage's real-time set-up: what its thread got, and what it asked for in vain.
    RealtimeFacts = "graver.RealtimeFacts.v3" {
        /// 1 when the thread runs under SCHED_FIFO, 0 otherwise.
        fifo: u32,
        /// Its priority, 0 without SCHED_FIFO.
        priority: u32,
        /// The CPU the thread is pinned to, or −1.
        core: i32,
        /// 1 when memory is locked.
        locked: u32,
        /// What was asked for and refused: bits of [`refused`].
        refused: u32,
        /// The priority asked for, 1..=99; 0 when the ordinary scheduler was asked for.
        asked_priority: u32,
        /// The operating system's error number for a refused priority.
        priority_error: u32,
        /// The operating system's error number for memory that is not locked; 0 when it was not
        /// asked, because `memory_needed` is above `memory_limit`.
        memory_error: u32,
        /// The CPU that was refused.
        asked_core: u32,
        /// The last CPU that the process may use, when one was refused.
        last_core: u32,
        /// What the process may lock [bytes], when locking was refused.
        memory_limit: u64,
        /// What it has to lock [bytes], when locking was refused.
        memory_needed: u64,
        /// The process that holds the name of the CPU, when the claim was refused; 0 when it could
        /// not be told.
        claim_pid: u32,
        /// Its user; `u32::MAX` when it could not be told.
        claim_user: u32,
    }
}

sample! {
    /// What the controller counted over one stream: published every second, also after its end.
    ControllerReport = "graver.ControllerReport.v3" {
        /// The stream it speaks of.
        stream: u64,
        /// 1 once the stream has ended and this is final, else 0.
        is_final: u32,
        /// 1 if it was played to its end, else 0.
        completed: u32,
        /// Cycles from the first setpoint to the last.
        cycles: u64,
        /// The feedback cycle answered with the stream's first setpoint.
        first_cycle: Cycle,
        /// The feedback cycle answered with its last.
        last_cycle: Cycle,
        /// Hash over what the commands meant; see `controller::digest`.
        digest: u64,
        /// Samples behind the root mean squares.
        count: u64,
        /// Largest |reference − feedback| at the motor [rad].
        following_error_max: ActuatorArray,
        /// Sum of the squares of it [rad²].
        following_error_squares: ActuatorArray,
        /// Largest share of the limit used: joint velocity.
        velocity_use: AxisArray,
        /// Largest share of the limit used: joint acceleration.
        acceleration_use: AxisArray,
        /// Largest share of the limit used: joint jerk.
        jerk_use: AxisArray,
        /// Largest share of the current limit commanded.
        effort_use: ActuatorArray,
        /// Largest share of the limit used: acceleration along and across the path.
        path_acceleration_use: f64,
        /// Largest share of the limit used: jerk along and across the path.
        path_jerk_use: f64,
        /// Least and greatest override of the power while light was commanded; both 0 where none was.
        power_override: [f64; 2],
        /// The fault that ended the stream, if any.
        fault: Fault,
        /// Real-time set-up of the controller's thread.
        realtime: RealtimeFacts,
    }
}

sample! {
    /// What a port counted on the link to its hardware since it was opened; all 0 where there is none.
    LinkCounters = "graver.LinkCounters.v1" {
        /// Frames or packets sent.
        sent: u64,
        /// Those that nothing came back of.
        lost: u64,
        /// Answers that came after their cycle.
        late: u64,
        /// Answers that came more than once, or out of order.
        duplicated: u64,
        /// Answers that could not be read, or were not what was asked.
        corrupted: u64,
        /// Cycles without a measurement of their own: the motors were taken to go on at their speed.
        bridged: u64,
        /// Largest distance of the clock of the bus from ours while it was followed [ns].
        clock_error_max: u64,
    }
}

sample! {
    /// What drives counted since it started.
    DrivesReport = "graver.DrivesReport.v4" {
        /// The newest cycle.
        cycle: Cycle,
        /// Cycles whose work did not end before the next deadline, slips and skipped cycles included.
        overruns: u64,
        /// Overruns that were waited for because the drives are simulated.
        slips: u64,
        /// Cycles without a fresh command.
        missed: u64,
        /// Times the watchdog closed an open gate.
        gate_trips: u64,
        /// Times drives stopped the axes by itself.
        stops: u64,
        /// 1 when the axes are at rest and the laser is off for good.
        at_rest: u32,
        /// 1 when the gate is open right now.
        lit: u32,
        /// The fault of the drives, if any.
        fault: Fault,
        /// Times in which the cycle stood still, since the newest stream began.
        stalls: Stalls,
        /// What was counted on the link to the hardware.
        link: LinkCounters,
        /// Real-time set-up of the drives' thread.
        realtime: RealtimeFacts,
    }
}
