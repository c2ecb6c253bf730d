//! Two actuators of variable length that meet in one joint and carry the tool (source 004 ch. 4.4).
//!
//! ```text
//!      J = A + La·u(θ),  |J − B| = Lb,  P = J + h·u(θ + π − θh)
//!          J
//!    La ／   ＼ Lb      the tool P sits on a plate fixed to actuator a
//!     A       B
//! ```
//!
//! The joints are the actuators' total lengths La and Lb, fixed part and stroke [m]. All of it lies
//! flat: gravity does no work.
//!
//! Each actuator is two bodies in line: the housing, which only turns about its base, and the rod,
//! which also moves out. The tool, with its plate, is a mass at P.

use nalgebra::{Matrix2, Matrix3x2, Vector2, Vector3};

use super::plane::{self, Body, cross, turned};
use super::scaled::{self, Scale};
use crate::analysis::Bodies;
use crate::kinematics::{
    Branch, Jacobian, JointMotion, Joints, KinematicsError, Margin, MarginKind, Mechanism, Pose,
    TaskSpace, ToolMotion, in_plane,
};
use crate::taylor::Scalar;
use crate::transmission::{self, Elasticity};
use messages::math;

/// The dimensions and masses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwinActuator {
    /// Pivots of the actuators, A then B [m].
    pub bases: [Vector2<f64>; 2],
    /// Distance of the tool from the joint J [m]. // h
    pub offset: f64,
    // Source 004 eq. 4.26 against 4.34: opposite signs; that of 4.26 and the text is kept.
    /// Angle at J from actuator a to the tool, clockwise from the way to A [rad]. // θh
    pub offset_angle: f64,
    /// Moving parts of actuator a, then b.
    pub bodies: [ActuatorBodies; 2],
    /// Mass of the tool with its plate, at P [kg].
    pub tool_mass: f64,
    /// What |sin θ′| must keep, θ′ being the angle at A: below it J is all but on the base line.
    pub baseline_limit: f64,
    /// What La − h·cos θh must keep [m]: below it the tool does not answer to θ.
    pub near_limit: f64,
    /// The solution in which the machine is built.
    pub branch: TwinBranch,
    /// Spring and damper along each actuator [N/m, N·s/m]; `None` when they are taken as rigid.
    pub elasticity: Option<[Elasticity; 2]>,
}

/// What an actuator moves. The housing's mass does not count: it turns about a fixed pivot in a
/// horizontal plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActuatorBodies {
    /// Inertia of the housing about its pivot [kg·m²].
    pub housing_inertia: f64,
    /// Mass of the rod and what goes out with it [kg].
    pub rod_mass: f64,
    /// Inertia of the rod about its centre of mass [kg·m²].
    pub rod_inertia: f64,
    /// Distance of the rod's centre of mass from J, towards the base [m].
    pub rod_center: f64,
}

/// On which side of the base line the actuators meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TwinBranch {
    /// +1 with J left of the way from A to B, −1 right of it.
    pub elbow: i32,
}

impl Branch for TwinBranch {
    fn choices(&self) -> Vec<(&'static str, Vec<i32>)> {
        vec![("elbow", vec![self.elbow])]
    }

    fn choose(self, name: &str, values: &[i32]) -> Option<Self> {
        match (name, values) {
            ("elbow", &[elbow]) => Some(Self { elbow: plane::sign(elbow)? }),
            _ => None,
        }
    }
}

/// The actuators at one pair of lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwinAssembly {
    /// The lengths [m].
    pub lengths: Joints<2>,
    /// Where the actuators meet [m].
    pub joint: Vector2<f64>,
    /// The tool [m].
    pub tool: Vector2<f64>,
    /// Unit vectors from the bases to J.
    pub directions: [Vector2<f64>; 2],
    /// Tool velocity per joint rate.
    pub jacobian: Matrix2<f64>,
    /// For each actuator, its rate of turning per joint rate [1/m].
    pub turning: [Vector2<f64>; 2],
    /// The tool from A, along actuator a and to its left [m].
    plate: Vector2<f64>,
    /// sin θ′, positive.
    baseline: f64,
    elbow: i32,
}

impl TwinAssembly {
    /// Angle of actuator a [rad]. // θ
    pub fn angle(&self) -> f64 {
        math::atan2(self.directions[0].y, self.directions[0].x)
    }

    /// Accelerations that lengths changing evenly at `velocity` [m/s] cause: of the tool [m/s²] and
    /// of the actuators' angles [rad/s²].
    pub fn even_accelerations(&self, velocity: &Joints<2>) -> (Vector2<f64>, [f64; 2]) {
        let [u, b] = self.directions;
        let [n, side] = self.directions.map(turned);
        let [first, second] = self.turning.map(|turning| turning.dot(velocity));
        let [la, lb] = [self.lengths[0], self.lengths[1]];
        // J̈ in the polar coordinates of one actuator, and its part along the other.
        let inwards = u * (-la * first * first) + n * (2.0 * velocity[0] * first);
        let along = -lb * second * second;
        let first_turning = (along - b.dot(&inwards)) / (la * b.dot(&n));
        let joint = inwards + n * (la * first_turning);
        let second_turning = (side.dot(&joint) - 2.0 * velocity[1] * second) / lb;
        // The plate turns with actuator a and moves out with J.
        let arm = u * self.plate.x + n * self.plate.y;
        let tool =
            n * (2.0 * velocity[0] * first) + turned(arm) * first_turning - arm * (first * first);
        (tool, [first_turning, second_turning])
    }
}

impl TwinActuator {
    /// `h·cos θh` and `h·sin θh` [m].
    fn plate(&self) -> (f64, f64) {
        let (sine, cosine) = math::sin_cos(self.offset_angle);
        (self.offset * cosine, self.offset * sine)
    }

    /// The total lengths for the tool at (`x`, `y`).
    ///
    /// Source 004 eq. 4.23 to 4.28 with the square root in place of the law of sines, which fails
    /// for obtuse angles: `La = h·cos θh + √(|P − A|² − h²·sin² θh)`.
    fn lengths<S: Scalar>(
        &self,
        x: S,
        y: S,
        branch: TwinBranch,
    ) -> Result<[S; 2], KinematicsError> {
        let [base_a, base_b] = self.bases;
        let (forwards, sideways) = self.plate();
        let (x, y) = (x - base_a.x, y - base_a.y);
        let square = x * x + y * y;
        let root = square - sideways * sideways;
        let near = |value, limit| KinematicsError {
            code: "unreachable_near_A",
            axis: Some(0),
            value,
            limit,
            detail: "the tool is too near to the pivot of actuator a",
        };
        // Written so that a position that is not a number fails too.
        let root_value = root.value();
        if !(root_value > 0.0 && root_value.is_finite()) {
            return Err(near(square.value().sqrt(), sideways.abs()));
        }
        if root_value < self.near_limit * self.near_limit {
            return Err(near(root_value.sqrt(), self.near_limit));
        }
        let root = root.sqrt();
        let first = root + forwards;
        if first.value() <= 0.0 {
            return Err(near(first.value(), 0.0));
        }
        // P − A = root·u + sideways·n, solved for u, then J − B = A + La·u − B.
        let out = first / square;
        let joint = [(root * x + y * sideways) * out, (root * y - x * sideways) * out];
        let base = base_b - base_a;
        let height = cross(base, Vector2::new(joint[0].value(), joint[1].value()));
        let sine = f64::from(branch.elbow) * height / (base.norm() * first.value());
        self.check_baseline(sine)?;
        let (apart_x, apart_y) = (joint[0] - base.x, joint[1] - base.y);
        Ok([first, (apart_x * apart_x + apart_y * apart_y).sqrt()])
    }

    /// Refuses a J that is all but on the base line, or beyond it; `sine` is that of the angle at A,
    /// positive on the elbow's side.
    fn check_baseline(&self, sine: f64) -> Result<(), KinematicsError> {
        let refusal = |code, detail| KinematicsError {
            code,
            axis: None,
            value: sine,
            limit: self.baseline_limit,
            detail,
        };
        if sine == 0.0 || sine.abs() < self.baseline_limit {
            let detail = "the actuators all but lie on the line between their pivots";
            return Err(refusal("singular_baseline", detail));
        }
        if sine > 0.0 {
            return Ok(());
        }
        Err(refusal("wrong_elbow", "the actuators would meet on the other side of the base line"))
    }

    fn tool_body(&self) -> Body {
        Body::new(self.tool_mass, 0.0)
    }
}

impl Scale for TwinActuator {
    fn scale(&mut self, mass: f64, stiffness: f64) {
        self.tool_mass *= mass;
        for body in &mut self.bodies {
            scaled::all(
                [&mut body.housing_inertia, &mut body.rod_mass, &mut body.rod_inertia],
                mass,
            );
        }
        scaled::soften(&mut self.elasticity, stiffness);
    }
}

impl Mechanism<2> for TwinActuator {
    type Branch = TwinBranch;
    type ChainState = TwinAssembly;

    fn name(&self) -> &'static str {
        "twin_actuator"
    }

    fn task_space(&self) -> TaskSpace {
        TaskSpace::Plane
    }

    fn branch(&self) -> TwinBranch {
        self.branch
    }

    fn branch_of(&self, chain: &TwinAssembly) -> TwinBranch {
        TwinBranch { elbow: chain.elbow }
    }

    fn solve(
        &self,
        q: &Joints<2>,
        TwinBranch { elbow }: TwinBranch,
        _near: Option<&TwinAssembly>,
    ) -> Result<TwinAssembly, KinematicsError> {
        let (la, lb) = (q[0], q[1]);
        let base = self.bases[1] - self.bases[0];
        let distance = base.norm();
        // Source 004 eq. 4.33 with Lb for its second La.
        let cosine = (distance * distance + la * la - lb * lb) / (2.0 * distance * la);
        let square = 1.0 - cosine * cosine;
        // Written so that joints that are not numbers fail too.
        if !(la > 0.0 && lb > 0.0 && square > 0.0) {
            return Err(KinematicsError {
                code: "unreachable_lengths",
                axis: None,
                value: cosine,
                limit: 1.0,
                detail: "no triangle has these lengths and the base for its sides",
            });
        }
        let baseline = square.sqrt();
        let base = base / distance;
        let u = base * cosine + turned(base) * (f64::from(elbow) * baseline);
        let n = turned(u);
        let joint = self.bases[0] + u * la;
        let b = (joint - self.bases[1]) / lb;
        let (forwards, sideways) = self.plate();
        let plate = Vector2::new(la - forwards, sideways);
        // Source 004 eq. 4.34 and 4.35, with the sine, and θh in the sense of eq. 4.26.
        let arm = u * plate.x + n * plate.y;
        let tool = self.bases[0] + arm;
        // L̇b = b·J̇ gives the turning of a; that of b is what of J̇ is across it.
        let across = 1.0 / (la * b.dot(&n));
        let first = Vector2::new(-b.dot(&u) * across, across);
        let side = turned(b);
        let second = (first * (la * side.dot(&n)) + Vector2::new(side.dot(&u), 0.0)) / lb;
        let sweep = turned(arm);
        let jacobian = Matrix2::from_columns(&[u + sweep * first.x, sweep * first.y]);
        Ok(TwinAssembly {
            lengths: *q,
            joint,
            tool,
            directions: [u, b],
            jacobian,
            turning: [first, second],
            plate,
            baseline,
            elbow,
        })
    }

    fn pose(&self, chain: &TwinAssembly) -> Pose {
        Pose::at(Vector3::new(chain.tool.x, chain.tool.y, 0.0))
    }

    fn jacobian(&self, chain: &TwinAssembly) -> Jacobian<2> {
        plane::jacobian(&chain.jacobian)
    }

    // The plate with the tool is one body with actuator a.
    fn tool_turning(&self, chain: &TwinAssembly) -> Matrix3x2<f64> {
        let mut turning = Matrix3x2::zeros();
        turning.set_row(2, &chain.turning[0].transpose());
        turning
    }

    fn margins(&self, chain: &TwinAssembly) -> Vec<Margin> {
        vec![
            Margin {
                name: "baseline",
                kind: MarginKind::Parallel,
                value: chain.baseline,
                limit: self.baseline_limit,
            },
            Margin {
                name: "near_a",
                kind: MarginKind::Collision,
                value: chain.plate.x,
                limit: self.near_limit,
            },
        ]
    }

    fn inverse(
        &self,
        pose: &Pose,
        branch: TwinBranch,
        _previous: &Joints<2>,
    ) -> Result<Joints<2>, KinematicsError> {
        in_plane(&pose.position)?;
        self.lengths(pose.position.x, pose.position.y, branch).map(Joints::from)
    }

    fn joint_motion(
        &self,
        tool: &ToolMotion,
        branch: TwinBranch,
        _previous: &Joints<2>,
    ) -> Result<JointMotion<2>, KinematicsError> {
        in_plane(&tool.position)?;
        let [x, y, _] = tool.series();
        Ok(JointMotion::of_series(&self.lengths(x, y, branch)?))
    }

    fn mass_matrix(&self, chain: &TwinAssembly) -> Matrix2<f64> {
        let mut mass = self.tool_body().joint_mass(&chain.jacobian, &Vector2::zeros());
        for (actuator, bodies) in self.bodies.iter().enumerate() {
            let turning = chain.turning[actuator];
            let inertia = bodies.inertia(chain.lengths[actuator]);
            mass += turning * turning.transpose() * inertia;
            mass[(actuator, actuator)] += bodies.rod_mass;
        }
        mass
    }

    fn bias(&self, chain: &TwinAssembly, velocity: &Joints<2>) -> Joints<2> {
        let (tool, turning) = chain.even_accelerations(velocity);
        let still = Vector2::zeros();
        let mut effort = self.tool_body().joint_effort(&chain.jacobian, &still, tool, 0.0);
        for (actuator, bodies) in self.bodies.iter().enumerate() {
            let rate = chain.turning[actuator].dot(velocity);
            let length = chain.lengths[actuator];
            let moment = bodies.rod_mass * (length - bodies.rod_center);
            // Centrifugal along the rod; Coriolis and the actuator's own turning about the pivot.
            effort[actuator] -= moment * rate * rate;
            let torque = bodies.inertia(length) * turning[actuator]
                + 2.0 * moment * velocity[actuator] * rate;
            effort += chain.turning[actuator] * torque;
        }
        effort
    }

    fn gravity(&self, _chain: &TwinAssembly) -> Joints<2> {
        Joints::zeros()
    }

    fn bodies(&self, chain: &TwinAssembly) -> Bodies {
        let [a, b] = self.bases;
        let rods: f64 = self.bodies.iter().map(|body| body.rod_mass).sum();
        Bodies {
            moving_mass: rods + self.tool_mass,
            points: [a, b, chain.joint, chain.tool].map(plane::level).into(),
        }
    }

    fn stiffness(&self) -> Option<Matrix2<f64>> {
        transmission::stiffness(self.elasticity)
    }

    fn damping(&self) -> Matrix2<f64> {
        transmission::damping(self.elasticity)
    }
}

impl ActuatorBodies {
    /// Inertia about the pivot with the actuator `length` long [kg·m²].
    fn inertia(&self, length: f64) -> f64 {
        let centre = length - self.rod_center;
        self.housing_inertia + self.rod_inertia + self.rod_mass * centre * centre
    }
}
