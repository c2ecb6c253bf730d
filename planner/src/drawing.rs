//! What a job asks for, whatever language it was written in.
//!
//! Every reader (letters, points, G-code) ends here, and everything after starts here. Machine
//! frame, SI units. Nothing is timed yet.

use std::sync::Arc;

use machine::CornerMode;
use messages::math;
use nalgebra::Vector3;

pub use messages::plan::Note;

use crate::geometry::posed_path::PosedPath;
use crate::geometry::track::Track;

/// A job as geometry: what to mark and how to get there, in order.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// Name for summaries and run folders.
    pub name: String,
    /// Where the tool is at rest before the first step [m].
    pub start: Vector3<f64>,
    /// What to do, in order.
    pub steps: Vec<Step>,
    /// Things a person should know, each said once.
    pub notes: Vec<Note>,
}

/// One step of a drawing and the line of the job file that asked for it (from 1, 0 for none).
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// What to do.
    pub action: Action,
    /// Where it was asked for.
    pub line: u64,
}

/// What a step does.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Mark along a curve that starts where the tool is.
    Mark {
        /// The line to mark.
        curve: Curve,
        /// Speed while the laser is on [m/s]; `None` leaves it to the job's policy.
        speed: Option<f64>,
        /// The laser.
        power: Power,
    },
    /// Mark along a cubic Bézier curve that starts where the tool is. It may have corners, where its
    /// control points lie on each other.
    Trace {
        /// Its start, two control points and its end [m].
        points: [Vector3<f64>; 4],
        /// Speed while the laser is on [m/s]; `None` leaves it to the job's policy.
        speed: Option<f64>,
        /// The laser.
        power: Power,
    },
    /// Mark along a path through poses, whose turns the tool follows, wherever the tool is before.
    Follow {
        /// Where it goes, and how the tool is turned.
        path: Arc<PosedPath>,
        /// The laser.
        power: Power,
    },
    /// Move straight in the dark, as fast as the limits allow.
    Rapid {
        /// Where to [m].
        to: Vector3<f64>,
    },
    /// Follow a curve in the dark, at rest at both ends.
    Feed {
        /// The path.
        curve: Curve,
        /// Largest speed [m/s].
        speed: f64,
    },
    /// Stand still; with no time, only come to rest, so that marks before and after are apart.
    Dwell {
        /// How long [s].
        time: f64,
        /// Power of the laser meanwhile; `None` in the dark.
        lit: Option<f64>,
    },
    /// Switch a digital output at rest.
    Output {
        /// Which bit of the outputs.
        bit: u32,
        /// On or off.
        on: bool,
    },
    /// Set the pulse repetition rate of the laser, at rest and in the dark.
    Frequency {
        /// [pulses/s]; 0 leaves it as the source is set.
        value: f64,
    },
    /// Wait, at rest and in the dark, for a person to resume.
    Pause,
    /// How corners are passed from here on.
    Corners(Corners),
}

/// How the corners of a path are passed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Corners {
    /// As the machine file says, within its tolerance.
    AsMachine,
    /// At rest, exactly.
    Exact,
    /// On the way, rounded within this distance of the drawn line; `None` for the machine's
    /// tolerance [m].
    Blend(Option<f64>),
}

impl Corners {
    /// How far from a corner the tool may pass [m], 0 for exact corners, on a machine whose file says
    /// `mode` and `tolerance` [m].
    pub fn tolerance(self, mode: CornerMode, tolerance: f64) -> f64 {
        match (self, mode) {
            (Self::Exact, _) | (Self::AsMachine, CornerMode::Exact) => 0.0,
            (Self::Blend(own), _) => own.unwrap_or(tolerance),
            (Self::AsMachine, CornerMode::Blend) => tolerance,
        }
    }
}

/// Laser power along a mark.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Power {
    /// Fraction of full scale at the commanded speed, above 0 and up to 1.
    pub level: f64,
    /// Whether power follows the true speed (M4) or keeps its level (M3).
    pub follows_speed: bool,
}

/// A smooth piece of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Curve {
    /// A straight line.
    Line {
        /// Start [m].
        from: Vector3<f64>,
        /// End [m].
        to: Vector3<f64>,
    },
    /// An arc of an ellipse or circle, possibly rising as a helix:
    /// `p(φ) = centre + major·cos φ + minor·sin φ + rise·(φ − start)/sweep`.
    Arc {
        /// Centre [m].
        centre: Vector3<f64>,
        /// Semi-axis at φ = 0 [m].
        major: Vector3<f64>,
        /// Semi-axis at φ = π/2, perpendicular to `major` [m].
        minor: Vector3<f64>,
        /// φ at the start [rad].
        start: f64,
        /// Signed change of φ, not 0 [rad].
        sweep: f64,
        /// Displacement along the helix axis over the whole sweep [m].
        rise: Vector3<f64>,
    },
}

impl Curve {
    /// The point at `parameter`, 0 at the start and 1 at the end [m].
    pub fn point(&self, parameter: f64) -> Vector3<f64> {
        match *self {
            Self::Line { from, to } => from + (to - from) * parameter,
            Self::Arc { centre, major, minor, start, sweep, rise } => {
                let (sine, cosine) = math::sin_cos(start + sweep * parameter);
                centre + major * cosine + minor * sine + rise * parameter
            }
        }
    }

    /// How long it is [m].
    pub(crate) fn length(&self) -> f64 {
        match self {
            Self::Line { from, to } => (to - from).norm(),
            Self::Arc { .. } => Track::new(self).length(),
        }
    }

    /// Where it starts [m].
    pub fn from(&self) -> Vector3<f64> {
        self.point(0.0)
    }

    /// Where it ends [m].
    pub fn to(&self) -> Vector3<f64> {
        self.point(1.0)
    }
}

/// How the tool gets from one line that is marked at one speed to the next.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Turns {
    /// Without stopping, where that is quicker.
    #[default]
    Fly,
    /// By way of a rest.
    Stop,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drawing_rules_its_corners_and_the_machine_the_others() {
        let tolerances = |corners: Corners| {
            [CornerMode::Blend, CornerMode::Exact].map(|mode| corners.tolerance(mode, 5e-6))
        };
        assert_eq!(tolerances(Corners::AsMachine), [5e-6, 0.0]);
        assert_eq!(tolerances(Corners::Exact), [0.0, 0.0]);
        assert_eq!(tolerances(Corners::Blend(None)), [5e-6, 5e-6]);
        assert_eq!(tolerances(Corners::Blend(Some(1e-4))), [1e-4, 1e-4]);
    }
}
