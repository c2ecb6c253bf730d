//! What a plan comes to: the planner writes it as `plan.json` into the run folder, and whoever
//! summarises the run reads it there. Like [`artwork`](crate::artwork), not a sample.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a plan comes to.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlanFacts {
    /// The job's name.
    pub name: String,
    /// Strokes and dots to mark.
    pub strokes: usize,
    /// Strokes and dots of the job before those, which it says to pass over.
    #[serde(default)]
    pub passed_over: u64,
    /// How much of the first of those it says to leave out at its beginning [m].
    #[serde(default)]
    pub passed_along: f64,
    /// Whether the job has been planned to its end.
    #[serde(default)]
    pub is_whole: bool,
    /// Length to mark [m].
    pub length: f64,
    /// From the first motion to the last [s].
    pub duration: f64,
    /// Setpoints in the stream: the motion, and rest before and after it.
    pub samples: u64,
    /// Largest speed while the laser is on [m/s], 0 when nothing is drawn.
    pub speed: f64,
    /// The largest speed that the job asks for while the laser is on [m/s].
    pub speed_asked: f64,
    /// The largest that job and machine allow while the laser is on [m/s].
    pub speed_limit: f64,
    /// Least and largest power of the laser [fraction of full scale]; null where nothing is lit. Where the
    /// power follows the speed, it is that at the speed asked for.
    #[serde(default)]
    pub power: Option<[f64; 2]>,
    /// The box around all that is marked; null where nothing is.
    #[serde(default)]
    pub bounds: Option<Bounds>,
    /// Whether it is a dry run: the whole motion, and nothing lit.
    #[serde(default)]
    pub dry_run: bool,
    /// The layers of a drawing in the order of marking; empty for other jobs.
    #[serde(default)]
    pub layers: Vec<LayerFacts>,
    /// What a person should know.
    pub notes: Vec<Note>,
    /// Largest share of each limit that the plan uses.
    pub uses: LimitUtilization,
    /// What bound the motion along paths, the limit that ruled longest first.
    pub binding: Vec<Binding>,
    /// How far the tool strays from the path between two setpoints while it marks; null where the joints
    /// go straight with it, and of a plan against the limits of the path only.
    #[serde(default)]
    pub interpolation: Option<InterpolationFacts>,
}

/// What is marked in one way.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LayerFacts {
    /// Its name; null for what is on no layer.
    pub name: Option<String>,
    /// Lines and images on it, hatch lines each.
    pub marks: u64,
    /// The way along them in one pass, about [m].
    pub length: f64,
    /// Speed [m/s]; null where the planner chooses it.
    pub speed: Option<f64>,
    /// Power of the laser [fraction of full scale].
    pub power: f64,
    /// How often it is marked.
    pub passes: u64,
    /// Pulse repetition rate of the laser [pulses/s]; null as its source is set.
    pub frequency: Option<f64>,
    /// Whether the air assist is on.
    pub air: bool,
}

/// An upright box, machine frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Bounds {
    /// The lower corner [m].
    pub lower: [f64; 3],
    /// The upper corner [m].
    pub upper: [f64; 3],
}

impl Bounds {
    /// Takes a point into `bounds`.
    pub fn widen(bounds: &mut Option<Self>, point: &[f64; 3]) {
        let Self { lower, upper } = bounds.get_or_insert(Self { lower: *point, upper: *point });
        for (row, value) in point.iter().enumerate() {
            lower[row] = lower[row].min(*value);
            upper[row] = upper[row].max(*value);
        }
    }
}

/// How far the tool strays in the middle between two setpoints, which the controller joins by a cubic of
/// each joint.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct InterpolationFacts {
    /// From where it should be at that time [m].
    pub deviation: f64,
    /// From the surface that is marked on [m]; null where the job has none.
    pub surface: Option<f64>,
    /// Of the tool's axis from where it should point [rad].
    pub axis: f64,
    /// Line of the job file where it strays most, 0 for none.
    pub line: u64,
}

/// A limit that bound the motion, for how long, and where most.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Binding {
    /// The limit, such as `acceleration of the tool` or `motor current`.
    pub limit: String,
    /// The axis whose limit it is.
    pub axis: Option<String>,
    /// Share of the time of all paths [1].
    pub share: f64,
    /// The time [s].
    pub time: f64,
    /// Line of the job file that costs most, 0 for none.
    pub line: u64,
    /// The place that costs most, machine frame [m].
    pub position: [f64; 3],
}

impl Binding {
    /// The limit that is no limit of the machine: the speed that the job asks for.
    pub const SPEED_ASKED_FOR: &'static str = "speed asked for";
    /// The machine's largest speed while marking.
    pub const MARKING_SPEED: &'static str = "largest marking speed";
}

/// Largest value over limit, found over all setpoints.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LimitUtilization {
    /// Joint velocity, per axis.
    pub velocity: Vec<f64>,
    /// Joint acceleration, per axis.
    pub acceleration: Vec<f64>,
    /// Joint jerk, per axis.
    pub jerk: Vec<f64>,
    /// Motor current, friction included, per actuator.
    pub current: Vec<f64>,
    /// Motor voltage, per actuator.
    pub voltage: Vec<f64>,
    /// Heating of each actuator's DC winding, the root mean square of its current against what it
    /// bears for ever; 0 where the machine file does not say that.
    pub heat: Vec<f64>,
    /// Motor torque as the efficiencies of gear and screw have it, in place of friction: for
    /// sizing, against the power stage's limit or the pull-out torque, per actuator. No limit is held to
    /// it.
    pub sizing: Vec<f64>,
    /// Speed of the tool.
    pub path_speed: f64,
    /// Acceleration along and across the path.
    pub path_acceleration: f64,
    /// Jerk along and across the path.
    pub path_jerk: f64,
}

/// One remark on a job, such as a code that was accepted without effect.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Note {
    /// Line of the job file from 1, 0 for none.
    pub line: u64,
    /// What to know.
    pub text: String,
}
