//! Two arms on a common base whose forearms meet in the tool (source 003 ch. 5).
//!
//! ```text
//!            P
//!      a  ／   ＼  a
//!       A         B          elbows, outwards for working mode (+1, −1)
//!      b ＼     ／ b
//!        (−e,0) (+e,0)       motors
//! ```
//!
//! The joints are the absolute angles of the proximal links [rad]. All of it lies flat: gravity
//! does no work.

use nalgebra::{Matrix2, Vector2, Vector3};

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

/// How far an angle may be from the previous one before a turn is counted [rad]. Anything from
/// the longest step of a path to a full turn less that keeps a path continuous; above half a turn,
/// an angle from a standing start is that of the equations, not folded into ±π.
const TURN_HYSTERESIS: f64 = 0.75 * math::TURN;

/// The dimensions and masses. Centres of mass are at mid-link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FiveBar {
    /// Half the distance between the motors [m]. // e
    pub half_base: f64,
    /// Length of the links at the motors [m]. // b
    pub proximal: f64,
    /// Length of the links at the tool [m]. // a
    pub distal: f64,
    /// Mass of a proximal link [kg]. // m_b
    pub proximal_mass: f64,
    /// Inertia of a proximal link about its centre of mass [kg·m²]. // J_b
    pub proximal_inertia: f64,
    /// Mass of a distal link [kg]. // m_a
    pub distal_mass: f64,
    /// Inertia of a distal link about its centre of mass [kg·m²]. // J_a
    pub distal_inertia: f64,
    /// Mass of the tool [kg]. // m_e
    pub tool_mass: f64,
    /// Mass of the bar that guides the tool; it moves in y only [kg].
    pub bar_mass: f64,
    /// What |sin(Φi − θi)| must keep: below it an arm is all but stretched or folded.
    pub type_1_limit: f64,
    /// What |sin(Φ1 − Φ2)| must keep: below it the forearms are all but in line.
    pub type_2_limit: f64,
    /// The solution in which the machine is built.
    pub branch: FiveBarBranch,
    /// Torsion spring and damper of each arm, bending included [N·m/rad, N·m·s/rad]; `None` when
    /// they are taken as rigid.
    pub elasticity: Option<[Elasticity; 2]>,
}

/// On which side the elbows are, and on which the tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FiveBarBranch {
    /// For each arm: +1 with the elbow left of the way from motor to tool, −1 right of it.
    pub working_mode: [i32; 2],
    /// +1 with the tool left of the way from the first elbow to the second, −1 right of it.
    pub assembly_mode: i32,
}

impl Branch for FiveBarBranch {
    fn choices(&self) -> Vec<(&'static str, Vec<i32>)> {
        vec![
            ("working_mode", self.working_mode.to_vec()),
            ("assembly_mode", vec![self.assembly_mode]),
        ]
    }

    fn choose(self, name: &str, values: &[i32]) -> Option<Self> {
        match (name, values) {
            ("working_mode", &[first, second]) => {
                let working_mode = [plane::sign(first)?, plane::sign(second)?];
                Some(Self { working_mode, ..self })
            }
            ("assembly_mode", &[mode]) => Some(Self { assembly_mode: plane::sign(mode)?, ..self }),
            _ => None,
        }
    }
}

/// The linkage at one joint position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FiveBarChainState {
    /// From each motor to its elbow [m].
    pub proximal: [Vector2<f64>; 2],
    /// From each elbow to the tool [m].
    pub distal: [Vector2<f64>; 2],
    /// The tool [m].
    pub tool: Vector2<f64>,
    /// Tool velocity per joint rate [m].
    pub jacobian: Matrix2<f64>,
    /// For each distal link, its rate of turning per joint rate.
    pub distal_rates: [Vector2<f64>; 2],
    branch: FiveBarBranch,
}

impl FiveBarChainState {
    /// Accelerations that joints moving evenly at `velocity` [rad/s] cause: of the tool [m/s²] and
    /// of the distal links' angles [rad/s²].
    pub fn even_accelerations(&self, velocity: &Joints<2>) -> (Vector2<f64>, [f64; 2]) {
        let [d1, d2] = self.distal;
        let pulls = self.pulls(velocity);
        // With θ̈ = 0, a distal link gives dᵢ·P̈ = −θ̇ᵢ²·dᵢ·pᵢ − ωᵢ²·a².
        let along = [0, 1].map(|arm| {
            let rate = self.distal_rates[arm].dot(velocity);
            let distal = self.distal[arm];
            -distal.dot(&pulls[arm]) - rate * rate * distal.norm_squared()
        });
        let tool =
            Vector2::new(d2.y * along[0] - d1.y * along[1], d1.x * along[1] - d2.x * along[0])
                / cross(d1, d2);
        let turning = [0, 1].map(|arm| {
            let distal = self.distal[arm];
            cross(distal, tool + pulls[arm]) / distal.norm_squared()
        });
        (tool, turning)
    }

    /// What pulls the elbows towards their motors, `θ̇²·p` [m/s²].
    fn pulls(&self, velocity: &Joints<2>) -> [Vector2<f64>; 2] {
        [0, 1].map(|arm| self.proximal[arm] * (velocity[arm] * velocity[arm]))
    }

    /// Velocity of a distal link's centre per joint rate.
    fn centre(&self, arm: usize) -> Matrix2<f64> {
        let mut velocity = self.jacobian;
        let mut own = velocity.column_mut(arm);
        own += turned(self.proximal[arm]);
        velocity / 2.0
    }
}

/// The linkage closed, and nothing derived from that.
struct Closed {
    /// From each motor to its elbow [m].
    proximal: [Vector2<f64>; 2],
    /// The elbows [m].
    elbows: [Vector2<f64>; 2],
    /// The tool [m].
    tool: Vector2<f64>,
}

/// The elbow of an arm whose tool is given.
struct Elbow<S> {
    /// From the motor to it, times the square of the tool's distance [m³].
    direction: [S; 2],
    /// Where it is [m].
    place: Vector2<f64>,
}

impl<S: Scalar> Elbow<S> {
    /// The joint's angle [rad], on the turn of the tool's own, which is `above` the motors or not.
    #[inline]
    fn angle(&self, above: bool, side: i32) -> S {
        let angle = self.direction[1].atan2(self.direction[0]);
        // The rotation from the tool's direction to the elbow's is below half a turn, so it
        // crossed the cut of atan2 exactly if the two lie on either side of it this way round.
        match (side > 0, above, self.direction[1].value() < 0.0) {
            (true, true, true) => angle + math::TURN,
            (false, false, false) => angle - math::TURN,
            _ => angle,
        }
    }
}

/// The angle on a turn that makes a path continuous with `previous` [rad].
#[inline]
fn near<S: Scalar>(angle: S, previous: f64) -> S {
    if (angle.value() - previous).abs() < TURN_HYSTERESIS {
        return angle;
    }
    angle + (math::nearest_turn(angle.value(), previous) - angle.value())
}

impl FiveBar {
    /// The motor of `arm`, on the x axis [m].
    fn base(&self, arm: usize) -> f64 {
        [-self.half_base, self.half_base][arm]
    }

    fn forearm(&self) -> Body {
        Body::new(self.distal_mass, self.distal_inertia)
    }

    fn tool_and_bar(&self) -> Body {
        let mass = Vector2::new(self.tool_mass, self.tool_mass + self.bar_mass);
        Body { mass, inertia: 0.0 }
    }

    /// Inertia of a proximal link about its motor [kg·m²].
    fn arm_inertia(&self) -> f64 {
        let centre = self.proximal / 2.0;
        self.proximal_inertia + self.proximal_mass * centre * centre
    }

    /// Where the forearms meet from the elbows that the joints give.
    #[inline]
    fn close(&self, q: &Joints<2>, branch: FiveBarBranch) -> Result<Closed, KinematicsError> {
        let proximal = |angle| {
            let (sine, cosine) = math::sin_cos(angle);
            Vector2::new(cosine, sine) * self.proximal
        };
        let proximal = [proximal(q[0]), proximal(q[1])];
        let elbow = |arm: usize| Vector2::new(self.base(arm), 0.0) + proximal[arm];
        let elbows = [elbow(0), elbow(1)];
        let between = elbows[1] - elbows[0];
        let square = between.norm_squared();
        // Source 003 eq. 5.1: the tool stands on the middle between the elbows.
        let height = self.distal * self.distal - square / 4.0;
        // Written so that joints that are not numbers fail too.
        if !(height > 0.0 && square > 0.0) {
            return Err(KinematicsError {
                code: "unreachable_elbows",
                axis: None,
                value: square.sqrt(),
                limit: 2.0 * self.distal,
                detail: "the forearms do not meet from these elbows",
            });
        }
        let up = turned(between) * (f64::from(branch.assembly_mode) * (height / square).sqrt());
        let tool = elbows[0] + between / 2.0 + up;
        Ok(Closed { proximal, elbows, tool })
    }

    /// The joint angles for the tool at (`x`, `y`).
    ///
    /// Source 003 eq. 5.1 with atan2, `θi = atan2(y, x ± e) + sᵢ·acos((b² + r² − a²)/(2·b·r))`,
    /// with the sum of the two angles taken as one rotation of vectors.
    fn angles<S: Scalar>(
        &self,
        x: S,
        y: S,
        branch: FiveBarBranch,
        previous: &Joints<2>,
    ) -> Result<[S; 2], KinematicsError> {
        let first = self.elbow(0, x, y, branch)?;
        let second = self.elbow(1, x, y, branch)?;
        let tool = Vector2::new(x.value(), y.value());
        self.check_forearms([tool - first.place, tool - second.place], branch)?;
        let above = tool.y >= 0.0;
        Ok([
            near(first.angle(above, branch.working_mode[0]), previous[0]),
            near(second.angle(above, branch.working_mode[1]), previous[1]),
        ])
    }

    /// The elbow of one arm.
    #[inline(always)] // Handed on through memory, two arms cost half as much again.
    fn elbow<S: Scalar>(
        &self,
        arm: usize,
        x: S,
        y: S,
        branch: FiveBarBranch,
    ) -> Result<Elbow<S>, KinematicsError> {
        let (a, b) = (self.distal, self.proximal);
        let x = x - self.base(arm);
        let square = x * x + y * y;
        // r times how far along r the elbow lies; twice the area of motor, elbow and tool.
        let along = (square + (b * b - a * a)) * 0.5;
        let twice_area = square * (b * b) - along * along;
        // Written so that a position that is not a number fails too.
        let area_value = twice_area.value();
        if !(area_value >= 0.0 && area_value.is_finite()) {
            return Err(self.unreachable(arm, square.value().sqrt()));
        }
        // Twice the area over a·b is the sine between the two links.
        let sine = area_value.sqrt() / (a * b);
        if sine == 0.0 || sine < self.type_1_limit {
            return Err(self.all_but_straight(arm, sine));
        }
        let across = twice_area.sqrt() * f64::from(branch.working_mode[arm]);
        let direction = [x * along - y * across, y * along + x * across];
        let [forwards, sideways] = [direction[0].value(), direction[1].value()];
        let scale = square.value();
        let place = Vector2::new(forwards / scale + self.base(arm), sideways / scale);
        Ok(Elbow { direction, place })
    }

    #[cold]
    fn unreachable(&self, arm: usize, radius: f64) -> KinematicsError {
        let (a, b) = (self.distal, self.proximal);
        KinematicsError {
            code: ["unreachable_leg_1", "unreachable_leg_2"][arm],
            axis: Some(arm),
            value: radius,
            limit: if radius < a + b { (a - b).abs() } else { a + b },
            detail: "the tool is farther from the motor than the stretched arm reaches, or \
                     nearer than the folded one",
        }
    }

    #[cold]
    fn all_but_straight(&self, arm: usize, sine: f64) -> KinematicsError {
        KinematicsError {
            code: "singular_type_1",
            axis: Some(arm),
            value: sine,
            limit: self.type_1_limit,
            detail: "the arm is all but stretched or folded",
        }
    }

    /// Refuses forearms, from elbow to tool, with the tool on the other side or all but in line.
    #[inline]
    fn check_forearms(
        &self,
        [d1, d2]: [Vector2<f64>; 2],
        branch: FiveBarBranch,
    ) -> Result<(), KinematicsError> {
        let sine = f64::from(branch.assembly_mode) * cross(d1, d2) / (self.distal * self.distal);
        let refusal = |code, detail| KinematicsError {
            code,
            axis: None,
            value: sine,
            limit: self.type_2_limit,
            detail,
        };
        if sine == 0.0 || sine.abs() < self.type_2_limit {
            return Err(refusal("singular_type_2", "the forearms are all but in line"));
        }
        if sine > 0.0 {
            return Ok(());
        }
        Err(refusal("wrong_assembly_mode", "with these elbows the tool is on the other side"))
    }
}

impl Scale for FiveBar {
    fn scale(&mut self, mass: f64, stiffness: f64) {
        let masses = [
            &mut self.proximal_mass,
            &mut self.proximal_inertia,
            &mut self.distal_mass,
            &mut self.distal_inertia,
            &mut self.tool_mass,
            &mut self.bar_mass,
        ];
        scaled::all(masses, mass);
        scaled::soften(&mut self.elasticity, stiffness);
    }
}

impl Mechanism<2> for FiveBar {
    type Branch = FiveBarBranch;
    type ChainState = FiveBarChainState;

    fn name(&self) -> &'static str {
        "five_bar"
    }

    fn task_space(&self) -> TaskSpace {
        TaskSpace::Plane
    }

    fn branch(&self) -> FiveBarBranch {
        self.branch
    }

    fn branch_of(&self, chain: &FiveBarChainState) -> FiveBarBranch {
        chain.branch
    }

    /// The assembly mode of `branch` decides; the working mode is then what the joints make it.
    fn solve(
        &self,
        q: &Joints<2>,
        branch: FiveBarBranch,
        _near: Option<&FiveBarChainState>,
    ) -> Result<FiveBarChainState, KinematicsError> {
        let Closed { proximal, elbows, tool } = self.close(q, branch)?;
        let [d1, d2] = [tool - elbows[0], tool - elbows[1]];
        let distal = [d1, d2];
        // Source 003 eq. 5.2: dᵢ·Ṗ = (pᵢ × dᵢ)·θ̇ᵢ; eq. 5.3 lacks b, and (X − e) in its second row.
        let drive = [cross(proximal[0], d1), cross(proximal[1], d2)];
        let det = cross(d1, d2);
        let (g1, g2) = (drive[0] / det, drive[1] / det);
        let jacobian = Matrix2::new(d2.y * g1, -d1.y * g2, -d2.x * g1, d1.x * g2);
        let lengths = self.distal * self.distal;
        let distal_rates = [0, 1].map(|arm| {
            let d = distal[arm];
            let mut rate = Vector2::new(
                d.x * jacobian[(1, 0)] - d.y * jacobian[(0, 0)],
                d.x * jacobian[(1, 1)] - d.y * jacobian[(0, 1)],
            );
            rate[arm] -= d.dot(&proximal[arm]);
            rate / lengths
        });
        let working_mode = drive.map(|drive| if drive <= 0.0 { 1 } else { -1 });
        let branch = FiveBarBranch { working_mode, assembly_mode: branch.assembly_mode };
        Ok(FiveBarChainState { proximal, distal, tool, jacobian, distal_rates, branch })
    }

    fn pose(&self, chain: &FiveBarChainState) -> Pose {
        Pose::at(Vector3::new(chain.tool.x, chain.tool.y, 0.0))
    }

    fn locate(
        &self,
        q: &Joints<2>,
        branch: FiveBarBranch,
        _near: Option<&FiveBarChainState>,
    ) -> Result<Pose, KinematicsError> {
        let Closed { tool, .. } = self.close(q, branch)?;
        Ok(Pose::at(Vector3::new(tool.x, tool.y, 0.0)))
    }

    fn jacobian(&self, chain: &FiveBarChainState) -> Jacobian<2> {
        plane::jacobian(&chain.jacobian)
    }

    fn margins(&self, chain: &FiveBarChainState) -> Vec<Margin> {
        let sine = |arm: usize| {
            cross(chain.proximal[arm], chain.distal[arm]).abs() / (self.proximal * self.distal)
        };
        let [d1, d2] = chain.distal;
        let type_2 = cross(d1, d2).abs() / (self.distal * self.distal);
        vec![
            Margin {
                name: "type_1",
                kind: MarginKind::Serial,
                value: sine(0).min(sine(1)),
                limit: self.type_1_limit,
            },
            Margin {
                name: "type_2",
                kind: MarginKind::Parallel,
                value: type_2,
                limit: self.type_2_limit,
            },
        ]
    }

    fn inverse(
        &self,
        pose: &Pose,
        branch: FiveBarBranch,
        previous: &Joints<2>,
    ) -> Result<Joints<2>, KinematicsError> {
        in_plane(&pose.position)?;
        self.angles(pose.position.x, pose.position.y, branch, previous).map(Joints::from)
    }

    fn joint_motion(
        &self,
        tool: &ToolMotion,
        branch: FiveBarBranch,
        previous: &Joints<2>,
    ) -> Result<JointMotion<2>, KinematicsError> {
        in_plane(&tool.position)?;
        let [x, y, _] = tool.series();
        Ok(JointMotion::of_series(&self.angles(x, y, branch, previous)?))
    }

    // Source 003 eq. 5.7, 5.10 and 5.11 (where 2/m_e is m_e/2), in independent coordinates: the
    // loop is closed in the velocities, so that no multiplier is left.
    fn mass_matrix(&self, chain: &FiveBarChainState) -> Matrix2<f64> {
        let forearm = self.forearm();
        let still = Vector2::zeros();
        let mut mass = self.tool_and_bar().joint_mass(&chain.jacobian, &still);
        for arm in 0..2 {
            mass += forearm.joint_mass(&chain.centre(arm), &chain.distal_rates[arm]);
            mass[(arm, arm)] += self.arm_inertia();
        }
        mass
    }

    fn bias(&self, chain: &FiveBarChainState, velocity: &Joints<2>) -> Joints<2> {
        let (tool, turning) = chain.even_accelerations(velocity);
        let pulls = chain.pulls(velocity);
        let forearm = self.forearm();
        let still = Vector2::zeros();
        let mut effort = self.tool_and_bar().joint_effort(&chain.jacobian, &still, tool, 0.0);
        for arm in 0..2 {
            let centre = (tool - pulls[arm]) / 2.0;
            let rate = &chain.distal_rates[arm];
            effort += forearm.joint_effort(&chain.centre(arm), rate, centre, turning[arm]);
        }
        effort
    }

    fn gravity(&self, _chain: &FiveBarChainState) -> Joints<2> {
        Joints::zeros()
    }

    fn bodies(&self, chain: &FiveBarChainState) -> Bodies {
        let motors = [0, 1].map(|arm| Vector2::new(self.base(arm), 0.0));
        let elbows = [0, 1].map(|arm| motors[arm] + chain.proximal[arm]);
        let points = [motors[0], motors[1], elbows[0], elbows[1], chain.tool];
        Bodies {
            moving_mass: 2.0 * (self.proximal_mass + self.distal_mass)
                + self.tool_mass
                + self.bar_mass,
            points: points.map(plane::level).into(),
        }
    }

    fn stiffness(&self) -> Option<Matrix2<f64>> {
        transmission::stiffness(self.elasticity)
    }

    fn damping(&self) -> Matrix2<f64> {
        transmission::damping(self.elasticity)
    }
}
