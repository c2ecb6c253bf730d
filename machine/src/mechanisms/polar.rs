//! A rotary arm over a rotary table, with a vertical axis (source 000).
//!
//! Joints: the arm's angle θ₁ [rad], the table's angle θ₂ [rad], the height d of the head [m]. The
//! machine's frame has the arm's pivot in its origin, the table's axis at (c, 0) and z up. Positions
//! of the tool are in the workpiece's frame, which the table carries and whose origin is the centre
//! of the table: `p = Rz(−θ₂)·(a₁·(cos θ₁, sin θ₁) − (c, 0))`, `z = z₀ + d`.
//!
//! An arm that is as long as the table is far, a₁ = c, reaches the centre of the table, and a path
//! may cross it; `center` tells how. Another arm leaves a blind disc of radius |a₁ − c|.

pub(super) mod center;
mod dynamics;

use core::f64::consts::FRAC_PI_2;

use messages::math;
use nalgebra::{Matrix3, Vector3};

use super::scaled::{self, Scale};
use crate::analysis::Bodies;
use crate::kinematics::{
    Branch, Jacobian, JointMotion, Joints, KinematicsError, Margin, MarginKind, Mechanism, Pose,
    TaskSpace, ToolMotion, finite,
};
use crate::taylor::Scalar;
use crate::transmission::{self, Elasticity};

pub use dynamics::PolarLoad;

/// How far from the centre a path may pass and still be taken as passing through it [m]: rounding
/// of a planned line, far below any encoder's count.
const CENTER_TOLERANCE: f64 = 1e-12;

/// Below this sine of θ₁/2, or cosine, the arm and the table's axis are in line and the derivatives
/// of a reach between a blind disc and a rim have no value.
const EDGE_TOLERANCE: f64 = 1e-9;

/// The arm on its pivot, the table below it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polar {
    /// Length of the arm, a₁: from its pivot to the beam [m].
    pub arm: f64,
    /// Distance of the table's axis from the arm's pivot, c [m].
    pub center_distance: f64,
    /// Height of the focus over the table with d = 0, z₀ [m].
    pub height: f64,
    /// Nearer to the centre than this a position alone does not tell the table's angle well enough,
    /// ρ_sing [m].
    pub singular_radius: f64,
    /// Whether the table may turn without end; with `false` its axis has limits.
    pub endless: bool,
    /// The branch in which the machine works.
    pub branch: PolarBranch,
    /// Masses and inertias.
    pub load: PolarLoad,
    /// Spring and damper of each joint; `None` when they are taken as rigid.
    pub elasticity: Option<[Elasticity; 3]>,
}

/// The side of the arm, and the turn of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PolarBranch {
    /// Sign of θ₁, 1 or −1; `None` takes the side whose joints are nearest to the previous ones.
    pub side: Option<i32>,
    /// Turns of the table from zero: θ₂ lies within half a turn of so many turns. `None` takes the
    /// turn nearest to the previous θ₂.
    pub table_turn: Option<i32>,
}

impl Branch for PolarBranch {
    fn choices(&self) -> Vec<(&'static str, Vec<i32>)> {
        let of = |name, value: Option<i32>| value.map(|value| (name, vec![value]));
        [of("side", self.side), of("table_turn", self.table_turn)].into_iter().flatten().collect()
    }

    /// No values leave the choice to the previous joints. `branch` is another name for `side`, the
    /// one that the golden vectors of source 000 have.
    fn choose(self, name: &str, values: &[i32]) -> Option<Self> {
        match (name, values) {
            ("side" | "branch", []) => Some(Self { side: None, ..self }),
            ("side" | "branch", &[side @ (1 | -1)]) => Some(Self { side: Some(side), ..self }),
            ("table_turn", []) => Some(Self { table_turn: None, ..self }),
            ("table_turn", &[turn]) => Some(Self { table_turn: Some(turn), ..self }),
            _ => None,
        }
    }

    fn in_any_turn(self) -> Self {
        Self { table_turn: None, ..self }
    }
}

impl Polar {
    /// By how much the arm is longer than the table is far; 0 where the arm reaches the centre.
    fn offset(&self) -> f64 {
        let offset = self.arm - self.center_distance;
        if offset.abs() <= CENTER_TOLERANCE { 0.0 } else { offset }
    }

    /// Joints for a point on the ray `direction` [rad] at `distance` from the centre [m]. The
    /// distance may be negative; then so is θ₁, the ray being the opposite one.
    fn joints<S: Scalar>(&self, distance: S, direction: S, z: S) -> [S; 3] {
        let (arm, away) = (self.arm, self.center_distance);
        let offset = self.offset();
        // ρ² = (a₁ − c)² + 4·a₁·c·sin²(θ₁/2). The arc cosine of the law of cosines loses half of its
        // digits near the centre.
        let (half_sine, half_cosine) = if offset == 0.0 {
            let sine = distance / (2.0 * arm);
            (sine, (-(sine * sine) + 1.0).sqrt())
        } else {
            let scale = 4.0 * arm * away;
            let sine = ((distance * distance - offset * offset) / scale).sqrt();
            let rim = arm + away;
            let cosine = ((-(distance * distance) + rim * rim) / scale).sqrt();
            (if distance.value() < 0.0 { -sine } else { sine }, cosine)
        };
        let half = half_sine.atan2(half_cosine);
        // The tool from the table's axis, in the machine's frame: (a₁·cos θ₁ − c, a₁·sin θ₁).
        let ray = if offset == 0.0 {
            // The arc tangent below without its 0/0 at the centre; on the opposite ray half a turn
            // is in `direction`.
            half + FRAC_PI_2
        } else {
            let x = -(half_sine * half_sine * (2.0 * arm)) + offset;
            let y = half_sine * half_cosine * (2.0 * arm);
            if distance.value() < 0.0 { (-y).atan2(-x) } else { y.atan2(x) }
        };
        [half * 2.0, ray - direction, z - self.height]
    }

    /// The two sides at a `distance` from the centre in `direction`; of them the one that `branch`
    /// asks for, turned to the right turn of the table.
    fn choose<S: Scalar>(
        &self,
        [distance, direction, z]: [S; 3],
        branch: PolarBranch,
        previous: &Joints<3>,
    ) -> [S; 3] {
        let turned = |joints: [S; 3]| {
            let table = joints[1].value();
            let near = match branch.table_turn {
                Some(turn) => math::nearest_turn(table, 0.0) + f64::from(turn) * math::TURN,
                None => math::nearest_turn(table, previous[1]),
            };
            [joints[0], joints[1] + (near - table), joints[2]]
        };
        let ahead = turned(self.joints(distance, direction, z));
        let opposite = turned(self.joints(-distance, direction + core::f64::consts::PI, z));
        let sides = if distance.value() < 0.0 { [opposite, ahead] } else { [ahead, opposite] };
        match branch.side {
            // At the centre itself the arm has no side.
            Some(side) if distance.value() != 0.0 => sides[usize::from(side < 0)],
            _ => {
                let apart = |joints: &[S; 3]| {
                    math::hypot(joints[0].value() - previous[0], joints[1].value() - previous[1])
                };
                if apart(&sides[1]) < apart(&sides[0]) { sides[1] } else { sides[0] }
            }
        }
    }

    /// Refuses a distance from the centre [m] that the arm does not reach.
    fn check_reach(&self, radius: f64) -> Result<(), KinematicsError> {
        let inner = self.offset().abs();
        let outer = self.arm + self.center_distance;
        // False for a radius that is not a number too.
        if radius >= inner && radius <= outer {
            return Ok(());
        }
        let blind = radius < inner;
        Err(KinematicsError {
            code: "unreachable_radius",
            axis: Some(0),
            value: radius,
            limit: if blind { inner } else { outer },
            detail: if blind {
                "the arm does not reach so near to the centre of the table"
            } else {
                "the arm does not reach so far from the centre of the table"
            },
        })
    }

    /// Refuses rates where the arm is in line with the table's axis at the edge of its reach.
    fn check_edge(&self, radius: f64) -> Result<(), KinematicsError> {
        let scale = 4.0 * self.arm * self.center_distance;
        let rim = self.arm + self.center_distance;
        let cosine = ((rim * rim - radius * radius) / scale).max(0.0).sqrt();
        let offset = self.offset();
        let sine = ((radius * radius - offset * offset) / scale).max(0.0).sqrt();
        let margin = if offset == 0.0 { cosine } else { cosine.min(sine) };
        if margin > EDGE_TOLERANCE {
            return Ok(());
        }
        Err(KinematicsError {
            code: "singular_edge",
            axis: Some(0),
            value: margin,
            limit: EDGE_TOLERANCE,
            detail: "the arm is in line with the table's axis, at the edge of its reach",
        })
    }
}

impl Scale for Polar {
    fn scale(&mut self, mass: f64, stiffness: f64) {
        let load = &mut self.load;
        let masses = [
            &mut load.arm_mass,
            &mut load.arm_inertia,
            &mut load.head_mass,
            &mut load.head_inertia,
            &mut load.table_inertia,
            &mut load.workpiece_mass,
            &mut load.workpiece_inertia,
        ];
        scaled::all(masses, mass);
        scaled::soften(&mut self.elasticity, stiffness);
    }
}

impl Mechanism<3> for Polar {
    type Branch = PolarBranch;
    type ChainState = Joints<3>;

    fn name(&self) -> &'static str {
        "polar"
    }

    fn task_space(&self) -> TaskSpace {
        TaskSpace::Space
    }

    fn branch(&self) -> PolarBranch {
        self.branch
    }

    fn branch_of(&self, q: &Joints<3>) -> PolarBranch {
        let arm = math::nearest_turn(q[0], 0.0);
        let turn = (q[1] / math::TURN).round() as i32;
        PolarBranch { side: Some(if arm < 0.0 { -1 } else { 1 }), table_turn: Some(turn) }
    }

    fn solve(
        &self,
        q: &Joints<3>,
        _branch: PolarBranch,
        _near: Option<&Joints<3>>,
    ) -> Result<Joints<3>, KinematicsError> {
        Ok(*q)
    }

    // Source 000 eq. 3.3 and 3.5; in Table 1 the second column is α, and one variable d moves.
    fn pose(&self, q: &Joints<3>) -> Pose {
        let (half_sine, half_cosine) = math::sin_cos(q[0] / 2.0);
        // a₁·cos θ₁ − c = (a₁ − c) − 2·a₁·sin²(θ₁/2) keeps its digits near the centre.
        let x = self.offset() - 2.0 * self.arm * half_sine * half_sine;
        let y = 2.0 * self.arm * half_sine * half_cosine;
        let (sine, cosine) = math::sin_cos(q[1]);
        Pose::at(Vector3::new(x * cosine + y * sine, y * cosine - x * sine, self.height + q[2]))
    }

    // In the workpiece's frame; the table's turn moves the tool backwards. Source 000 eq. 6.1 is
    // the arm's part in the arm's frame.
    fn jacobian(&self, q: &Joints<3>) -> Jacobian<3> {
        let tool = self.pose(q).position;
        let (sine, cosine) = math::sin_cos(q[0] - q[1]);
        let mut jacobian = Jacobian::zeros();
        jacobian[(0, 0)] = -self.arm * sine;
        jacobian[(1, 0)] = self.arm * cosine;
        jacobian[(0, 1)] = tool.y;
        jacobian[(1, 1)] = -tool.x;
        jacobian[(2, 2)] = 1.0;
        jacobian
    }

    // The arm turns the tool, and the table turns the work away below it: source 000 eq. 5.8 by
    // virtual work, τ₁ = a₁·f_y + m_z with the force in the arm's frame, and the table bears −m_z.
    fn tool_turning(&self, _q: &Joints<3>) -> Matrix3<f64> {
        let mut turning = Matrix3::zeros();
        turning[(2, 0)] = 1.0;
        turning[(2, 1)] = -1.0;
        turning
    }

    /// `center` is |det J| over x and y, a₁·c·|sin θ₁| [m²], 0 where arm and table are in line; a
    /// path through the centre passes there. `reach` is what is left of the arm's reach [m].
    fn margins(&self, q: &Joints<3>) -> Vec<Margin> {
        let determinant = (self.arm * self.center_distance * math::sin(q[0])).abs();
        let radius = self.pose(q).position.xy().norm();
        let reach = self.arm + self.center_distance - radius;
        vec![
            Margin { name: "center", kind: MarginKind::Serial, value: determinant, limit: 0.0 },
            Margin { name: "reach", kind: MarginKind::Serial, value: reach, limit: 0.0 },
        ]
    }

    /// # Errors
    /// `unreachable_radius`, and `singular_center` nearer to the centre than the singular radius.
    fn inverse(
        &self,
        pose: &Pose,
        branch: PolarBranch,
        previous: &Joints<3>,
    ) -> Result<Joints<3>, KinematicsError> {
        let [x, y, z] = pose.position.into();
        let radius = math::hypot(x, y);
        self.check_reach(radius)?;
        finite(&pose.position)?;
        if radius < self.singular_radius {
            return Err(KinematicsError {
                code: "singular_center",
                axis: Some(1),
                value: radius,
                limit: self.singular_radius,
                detail: "at the centre of the table a position does not tell the table's angle",
            });
        }
        let polar = [radius, math::atan2(y, x), z];
        Ok(Joints::from(self.choose(polar, branch, previous)))
    }

    /// Goes through the centre where the path does and the arm reaches it. At rest in the centre
    /// the table keeps the previous angle. A path that misses the centre by little has the rates it
    /// needs, which the limits of the axes judge.
    ///
    /// # Errors
    /// `unreachable_radius`, and `singular_edge` at the rim of the reach or of the blind disc.
    fn joint_motion(
        &self,
        tool: &ToolMotion,
        branch: PolarBranch,
        previous: &Joints<3>,
    ) -> Result<JointMotion<3>, KinematicsError> {
        let radius = math::hypot(tool.position.x, tool.position.y);
        self.check_reach(radius)?;
        self.check_edge(radius)?;
        finite(&tool.position)?;
        let [x, y, z] = tool.series();
        let through = if self.offset() == 0.0 && radius < self.singular_radius {
            center::through(tool)
        } else {
            None
        };
        let joints = match through {
            Some([distance, direction]) => self.choose([distance, direction, z], branch, previous),
            None if radius <= CENTER_TOLERANCE && self.offset() == 0.0 => {
                [0.0.into(), previous[1].into(), z - self.height]
            }
            None => {
                let distance = (x * x + y * y).sqrt();
                self.choose([distance, y.atan2(x), z], branch, previous)
            }
        };
        Ok(JointMotion::of_series(&joints))
    }

    fn mass_matrix(&self, _q: &Joints<3>) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::from(self.load.inertia()))
    }

    // The inertias are constant, so nothing is centrifugal: source 000 eq. 7.19 follows from the
    // wrong 7.12.
    fn bias(&self, q: &Joints<3>, _velocity: &Joints<3>) -> Joints<3> {
        self.gravity(q)
    }

    fn gravity(&self, _q: &Joints<3>) -> Joints<3> {
        Joints::from([0.0, 0.0, self.load.weight()])
    }

    fn has_constant_mass(&self) -> bool {
        true
    }

    fn bodies(&self, q: &Joints<3>) -> Bodies {
        let (sine, cosine) = math::sin_cos(q[0]);
        let height = self.height + q[2];
        Bodies {
            moving_mass: self.load.arm_mass + self.load.head_mass + self.load.workpiece_mass,
            points: vec![
                Vector3::zeros(),
                Vector3::new(self.center_distance, 0.0, 0.0),
                Vector3::new(self.arm * cosine, self.arm * sine, height),
            ],
        }
    }

    fn stiffness(&self) -> Option<Matrix3<f64>> {
        transmission::stiffness(self.elasticity)
    }

    fn damping(&self) -> Matrix3<f64> {
        transmission::damping(self.elasticity)
    }
}
