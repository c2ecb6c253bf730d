//! Limits of the path, of each axis, of the area that the tool may reach, and of the time for which
//! the axes may go on without a command.

use messages::Nanoseconds;
use messages::time::Period;

/// Limits of the tool's motion; they bind the norms of the vectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathLimits {
    /// Largest speed while marking [m/s].
    pub speed: f64,
    /// Largest speed of a free move [m/s].
    pub rapid: f64,
    /// Largest acceleration along and across the path together [m/s²].
    pub acceleration: f64,
    /// Largest jerk along and across the path together [m/s³].
    pub jerk: f64,
    /// How far a smoothed join may lie from the drawn line, and the tool from its path between two
    /// setpoints [m].
    pub tolerance: f64,
}

/// How the corners of a path are passed where a job says nothing of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CornerMode {
    /// On the way, rounded within the path's tolerance.
    Blend,
    /// At rest, exactly.
    Exact,
}

/// Limits of one axis, in its joint's own unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisLimits {
    /// Soft limits of the joint position [m or rad], lower then upper.
    pub position: [f64; 2],
    /// Largest joint speed [m/s or rad/s]; from the motor's speed where the file gives none.
    pub velocity: f64,
    /// Largest joint acceleration [m/s² or rad/s²], infinite where the file gives none.
    pub acceleration: f64,
    /// Largest joint jerk [m/s³ or rad/s³], infinite where the file gives none.
    pub jerk: f64,
    /// Largest |setpoint − feedback| before the machine stops, joint units [m or rad].
    pub following_error: f64,
    /// Largest distance of two actuators of the axis from each other before the machine stops, joint
    /// units [m or rad].
    pub racking: f64,
}

/// The box that the tool may reach, machine frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkArea {
    /// Lower corner [m].
    pub lower: [f64; 3],
    /// Upper corner [m].
    pub upper: [f64; 3],
}

/// When the control cycle comes, and how late it may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// Its period.
    pub period: Period,
    /// How long the axes may go on without a fresh command.
    pub stall: StallTolerance,
}

impl Timing {
    /// What a file that says nothing has.
    pub const DEFAULT: Self =
        Self { period: Period::OF_SETPOINTS, stall: StallTolerance(Nanoseconds(10_000_000)) };

    /// Cycles in a row that may lack a fresh command, at least 1: whole ones, because a command acts
    /// for a whole cycle or not at all.
    pub fn stalled_cycles(self) -> u64 {
        self.period.cycles_in(self.stall.time()).max(1)
    }

    /// Cycles from one feedback to the next that the controller sees, at most: the answer to the one
    /// before is still in force in the first of them, the others lack a command.
    pub fn feedback_gap(self) -> u64 {
        self.stalled_cycles() + 1
    }
}

/// How long the axes may go on with their last command, in the dark, before they are stopped.
///
/// Every watch over time derives from this one value:
///
/// - drives stops the axes once more than [`Timing::stalled_cycles`] cycles in a row lack a fresh
///   command, be it that drives itself was late for them or the controller;
/// - the controller takes a feedback that came at most [`Timing::feedback_gap`] cycles after the one
///   before;
/// - the controller stops the axes once drives has been late for more than [`Timing::stalled_cycles`]
///   cycles without a cycle in time between.
///
/// A hardware bridge arms the watchdog of its drives with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct StallTolerance(Nanoseconds);

impl StallTolerance {
    /// The longest that makes sense. At 10 m/s² an axis that keeps its speed is then 12 mm from its
    /// reference: any following error is found long before.
    pub const LONGEST: Self = Self(Nanoseconds(50_000_000));

    /// The shortest that makes sense: one cycle, which a single late command takes.
    pub fn shortest(period: Period) -> Self {
        Self(period.time())
    }

    /// This long, where the cycle has this `period`; `None` outside of [`Self::shortest`] to
    /// [`Self::LONGEST`].
    pub fn new(time: Nanoseconds, period: Period) -> Option<Self> {
        (Self::shortest(period)..=Self::LONGEST).contains(&Self(time)).then_some(Self(time))
    }

    /// The time.
    pub fn time(self) -> Nanoseconds {
        self.0
    }
}
