//! Limits of the path, of each axis, and of the area that the tool may reach.

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
}

/// The box that the tool may reach, machine frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkArea {
    /// Lower corner [m].
    pub lower: [f64; 3],
    /// Upper corner [m].
    pub upper: [f64; 3],
}
