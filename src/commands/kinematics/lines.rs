//! What `graver kinematics` reads and prints, one JSON object a line.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

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
    /// Force [N] and moment [N·m] of the tool on the work, up to six numbers.
    pub wrench: Option<Vec<f64>>,
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
        /// Effort of each joint [N or N·m].
        effort: Vec<f64>,
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
        Self { code: "bad_request".into(), axis: None, value: None, limit: None, detail }
    }
}
