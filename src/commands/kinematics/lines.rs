//! What `graver kinematics` reads and prints, one JSON object a line.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// The largest number of a request, SI: beyond any joint, pose, speed, acceleration or force of a
/// machine, and far below where products of a few such numbers leave the range of an `f64`.
pub const LARGEST: f64 = 1e9;

/// One line of input; which keys it needs depends on the verb. Joint values are in joint units, or
/// motor angles with `--motor`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Joint position [m or rad].
    pub q: Option<Vec<f64>>,
    /// Joint velocity [m/s or rad/s].
    pub qd: Option<Vec<f64>>,
    /// Joint acceleration [m/s² or rad/s²].
    pub qdd: Option<Vec<f64>>,
    /// Where the tool shall be.
    pub pose: Option<RequestPose>,
    /// Joint position to stay near [m or rad].
    pub previous: Option<Vec<f64>>,
    /// Force [N] and moment [N·m] of the tool on the work, up to six numbers, in the frame of the
    /// tool's positions.
    pub wrench: Option<Vec<f64>>,
    /// Whether the efforts of `dynamics` have the axes' friction in them; they do by default.
    pub friction: Option<bool>,
    /// The branch to take; mechanisms that have none accept an empty one.
    pub branch: Option<Map<String, Value>>,
}

/// Where the tool shall be.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RequestPose {
    /// Machine frame, two or three numbers [m].
    pub position: Vec<f64>,
    /// Orientation, row by row, where the tool has a free one.
    pub rotation: Option<[[f64; 3]; 3]>,
    /// Direction of the beam, where the tool has one.
    pub axis: Option<[f64; 3]>,
    /// Tilt of an mcm's head, machine frame, instead of `axis` [rad].
    pub a: Option<f64>,
    /// Turn of an mcm's head, machine frame, instead of `axis` [rad].
    pub r: Option<f64>,
}

/// One line of output.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Reply {
    /// Of `forward`.
    Forward {
        /// Where the tool is.
        pose: ReplyPose,
        /// The branch it is in; empty for mechanisms that have none.
        branch: Branch,
    },
    /// Of `inverse`.
    Inverse {
        /// Joint position [m or rad].
        q: Vec<f64>,
        /// The branch it is in; empty for mechanisms that have none.
        branch: Branch,
        /// Distance of each axis to its nearer soft limit [m or rad at the joint], and to each
        /// singularity, 0 being the singularity itself.
        margin: BTreeMap<String, f64>,
    },
    /// Of `jacobian`.
    Jacobian {
        /// Tool velocity per joint rate, a row for each direction; then angular velocity, or the
        /// rate of the beam's direction, where the tool can turn.
        j: Vec<Vec<f64>>,
        /// Its determinant; where it is not square, the root of that of J·Jᵀ or Jᵀ·J.
        det: f64,
        /// Its singular values, the largest first.
        singular_values: Vec<f64>,
    },
    /// Of `dynamics`.
    Dynamics {
        /// Effort of each joint [N or N·m], friction included.
        effort: Vec<f64>,
        /// The part of it that the axes' friction takes [N or N·m]; 0 where it is left out.
        friction: Vec<f64>,
    },
    /// Of `matrices`: `effort = m·q̈ + v + g + friction`, and `v = c·(q̇ⱼ²) + b·(q̇ⱼ·q̇ₖ)`.
    Matrices {
        /// Mass matrix [kg or kg·m²].
        m: Vec<Vec<f64>>,
        /// Centrifugal and Coriolis efforts at the joint velocity [N or N·m].
        v: Vec<f64>,
        /// Efforts of gravity [N or N·m].
        g: Vec<f64>,
        /// Centrifugal efforts, a column for the square of each joint rate.
        c: Vec<Vec<f64>>,
        /// Coriolis efforts, a column for the product of each pair of joint rates, in the order
        /// (1, 2), (1, 3), …, (2, 3), ….
        b: Vec<Vec<f64>>,
        /// What the axes' friction takes at the joint velocity [N or N·m].
        friction: Vec<f64>,
    },
    /// Of `ellipse`.
    Ellipse {
        /// Tool speeds that unit joint rates give.
        velocity: Ellipse,
        /// Tool forces that unit efforts give.
        force: Ellipse,
    },
    /// A line that has no answer.
    Error {
        /// Why.
        error: ErrorBody,
    },
}

/// The branch of a mechanism's solution, by the mechanism's own names.
pub type Branch = BTreeMap<String, Value>;

/// Where the tool is.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ReplyPose {
    /// Machine frame, two numbers for plane mechanisms, else three [m].
    pub position: Vec<f64>,
    /// Orientation, row by row, where the tool has a free one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation: Option<[[f64; 3]; 3]>,
    /// Direction of the beam, where the tool has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
}

/// An ellipse in the plane of the tool, or an ellipsoid where it moves in space.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Ellipse {
    /// Semi-axes, the larger first.
    pub axes: Vec<f64>,
    /// Angle of the largest one in the x-y plane, −π/2 to π/2 [rad].
    pub angle: f64,
    /// Direction of each, a unit vector.
    pub directions: Vec<Vec<f64>>,
}

/// Why a line has no answer.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ErrorBody {
    /// The code, such as `limit_a`.
    pub code: String,
    /// The axis, where it is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<String>,
    /// The value that is not allowed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The limit it breaks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<f64>,
    /// What is wrong, in words.
    pub detail: String,
}

impl ErrorBody {
    /// A line that does not ask what the verb answers.
    pub fn bad_request(detail: String) -> Self {
        Self::of("bad_request", detail)
    }

    /// A line that is not JSON, or is no request.
    pub fn not_json(detail: String) -> Self {
        Self::of("not_json", detail)
    }

    /// An iteration that came to no end.
    pub fn not_converged() -> Self {
        Self::of("not_converged", "the matrix here has no singular values in sight".into())
    }

    fn of(code: &str, detail: String) -> Self {
        Self { code: code.into(), axis: None, value: None, limit: None, detail }
    }
}

impl Request {
    /// Refuses numbers that no machine has.
    ///
    /// # Errors
    /// The first beyond [`LARGEST`], with its key.
    pub fn check(&self) -> Result<(), ErrorBody> {
        let lists = [
            ("q", self.q.as_deref()),
            ("qd", self.qd.as_deref()),
            ("qdd", self.qdd.as_deref()),
            ("previous", self.previous.as_deref()),
            ("wrench", self.wrench.as_deref()),
        ];
        for (key, values) in lists {
            values.map_or(Ok(()), |values| plausible(key, values))?;
        }
        let Some(pose) = &self.pose else { return Ok(()) };
        plausible("position", &pose.position)?;
        plausible("rotation", pose.rotation.as_ref().map_or(&[], |rows| rows.as_flattened()))?;
        plausible("axis", pose.axis.as_ref().map_or(&[], |axis| axis))?;
        plausible("a", pose.a.as_slice())?;
        plausible("r", pose.r.as_slice())
    }
}

fn plausible(key: &str, values: &[f64]) -> Result<(), ErrorBody> {
    // Put this way a value that is no number is refused too.
    let Some(value) = values.iter().find(|value| !(-LARGEST..=LARGEST).contains(*value)) else {
        return Ok(());
    };
    Err(ErrorBody {
        value: value.is_finite().then_some(*value),
        limit: Some(LARGEST),
        ..ErrorBody::of("too_large", format!("\"{key}\" has a number beyond any machine"))
    })
}
