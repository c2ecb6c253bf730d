//! Two carts on one rail, each with a link to the tool (source 003 ch. 6, "assi impropri").
//!
//! ```text
//!   │● P2
//!   │  ＼ L
//!   │    ● tool
//!   │  ／ L
//!   │● P1
//! ```
//!
//! The rail is the y axis, and the joints are the carts' places on it [m], the first below the
//! second: they cannot pass each other. All of it lies flat: gravity does no work.

use nalgebra::{Matrix2, Vector2, Vector3};

use super::plane::{self, Body, cross};
use super::scaled::{self, Scale};
use crate::analysis::Bodies;
use crate::kinematics::{
    Branch, Jacobian, JointMotion, Joints, KinematicsError, Margin, MarginKind, Mechanism, Pose,
    TaskSpace, ToolMotion, in_plane,
};
use crate::taylor::Scalar;
use crate::transmission::{self, Elasticity};

/// The dimensions and masses. Centres of mass are at mid-link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prrrp {
    /// Length of a link [m]. // L
    pub link: f64,
    /// Mass of a link [kg]. // m_L
    pub link_mass: f64,
    /// Inertia of a link about its centre of mass [kg·m²]. // J_L
    pub link_inertia: f64,
    // Source 003 eq. 6.7 and 6.8 leave the carts out: an erratum.
    /// Mass of a cart [kg].
    pub cart_mass: f64,
    /// Mass of the tool [kg]. // m_e
    pub tool_mass: f64,
    /// Mass of the bar that guides the tool; it moves in y only [kg].
    pub bar_mass: f64,
    /// What (P2 − P1)/2L must keep: below it the links all but coincide.
    pub type_1_limit: f64,
    /// What |x|/L must keep: below it the links are all but in line.
    pub type_2_limit: f64,
    /// The solution in which the machine is built.
    pub branch: PrrrpBranch,
    /// Spring and damper of each cart's drive [N/m, N·s/m]; `None` when they are taken as rigid.
    pub elasticity: Option<[Elasticity; 2]>,
}

/// On which side of the rail the tool is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PrrrpBranch {
    /// +1 with x > 0, −1 with x < 0.
    pub side: i32,
}

impl Branch for PrrrpBranch {
    fn choices(&self) -> Vec<(&'static str, Vec<i32>)> {
        vec![("side", vec![self.side])]
    }

    fn choose(self, name: &str, values: &[i32]) -> Option<Self> {
        match (name, values) {
            ("side", &[side]) => Some(Self { side: plane::sign(side)? }),
            _ => None,
        }
    }
}

/// The linkage at one joint position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrrrpChainState {
    /// The tool [m].
    pub tool: Vector2<f64>,
    /// From each cart to the tool [m].
    pub links: [Vector2<f64>; 2],
    /// Tool velocity per joint rate.
    pub jacobian: Matrix2<f64>,
    /// For each link, its rate of turning per joint rate [1/m].
    pub link_rates: [Vector2<f64>; 2],
    side: i32,
}

impl PrrrpChainState {
    /// Accelerations that carts moving evenly at `velocity` [m/s] cause: of the tool [m/s²] and of
    /// the links' angles [rad/s²].
    pub fn even_accelerations(&self, velocity: &Joints<2>) -> (Vector2<f64>, [f64; 2]) {
        // x² + (P2 − P1)²/4 = L², twice differentiated.
        let apart = (velocity[1] - velocity[0]) / 2.0;
        let x = self.jacobian[(0, 0)] * velocity[0] + self.jacobian[(0, 1)] * velocity[1];
        let tool = Vector2::new(-(x * x + apart * apart) / self.tool.x, 0.0);
        (tool, self.links.map(|link| cross(link, tool) / link.norm_squared()))
    }

    /// Velocity of a link's centre per joint rate.
    fn centre(&self, cart: usize) -> Matrix2<f64> {
        let mut velocity = self.jacobian;
        velocity[(1, cart)] += 1.0;
        velocity / 2.0
    }
}

impl Prrrp {
    fn link_body(&self) -> Body {
        Body::new(self.link_mass, self.link_inertia)
    }

    fn tool_and_bar(&self) -> Body {
        let mass = Vector2::new(self.tool_mass, self.tool_mass + self.bar_mass);
        Body { mass, inertia: 0.0 }
    }

    /// The carts for the tool at (`x`, `y`): source 003 eq. 6.1 and 6.2, solved for the carts.
    fn carts<S: Scalar>(&self, x: S, y: S, side: i32) -> Result<[S; 2], KinematicsError> {
        let square = -(x * x) + self.link * self.link;
        let reach = x.value() * f64::from(side);
        // Written so that a position that is not a number fails too.
        if !(square.value() >= 0.0 && y.value().is_finite()) {
            return Err(self.out_of_reach(x.value().abs()));
        }
        self.check_spread(square.value().sqrt())?;
        if reach.abs() < self.type_2_limit * self.link || reach == 0.0 {
            return Err(KinematicsError {
                code: "singular_type_2",
                axis: None,
                value: reach / self.link,
                limit: self.type_2_limit,
                detail: "the links are all but in line",
            });
        }
        if reach < 0.0 {
            return Err(KinematicsError {
                code: "wrong_side",
                axis: None,
                value: reach,
                limit: 0.0,
                detail: "the tool is on the other side of the rail",
            });
        }
        let half = square.sqrt();
        Ok([y - half, y + half])
    }

    /// Refuses carts that are all but in one place, `half` being half their distance [m].
    fn check_spread(&self, half: f64) -> Result<(), KinematicsError> {
        let value = half / self.link;
        if value > 0.0 && value >= self.type_1_limit {
            return Ok(());
        }
        Err(KinematicsError {
            code: "singular_type_1",
            axis: None,
            value,
            limit: self.type_1_limit,
            detail: "the links all but coincide",
        })
    }

    fn out_of_reach(&self, value: f64) -> KinematicsError {
        KinematicsError {
            code: "unreachable_radius",
            axis: None,
            value,
            limit: self.link,
            detail: "a link is not as long as that",
        }
    }
}

impl Scale for Prrrp {
    fn scale(&mut self, mass: f64, stiffness: f64) {
        let masses = [
            &mut self.link_mass,
            &mut self.link_inertia,
            &mut self.cart_mass,
            &mut self.tool_mass,
            &mut self.bar_mass,
        ];
        scaled::all(masses, mass);
        scaled::soften(&mut self.elasticity, stiffness);
    }
}

impl Mechanism<2> for Prrrp {
    type Branch = PrrrpBranch;
    type ChainState = PrrrpChainState;

    fn name(&self) -> &'static str {
        "prrrp"
    }

    fn task_space(&self) -> TaskSpace {
        TaskSpace::Plane
    }

    fn branch(&self) -> PrrrpBranch {
        self.branch
    }

    fn branch_of(&self, chain: &PrrrpChainState) -> PrrrpBranch {
        PrrrpBranch { side: chain.side }
    }

    fn solve(
        &self,
        q: &Joints<2>,
        PrrrpBranch { side }: PrrrpBranch,
        _near: Option<&PrrrpChainState>,
    ) -> Result<PrrrpChainState, KinematicsError> {
        let half = (q[1] - q[0]) / 2.0;
        let square = self.link * self.link - half * half;
        // Written so that joints that are not numbers fail too.
        if !(square > 0.0 && (q[0] + q[1]).is_finite()) {
            return Err(self.out_of_reach(half.abs()));
        }
        if half <= 0.0 {
            return Err(KinematicsError {
                code: "carts_crossed",
                axis: Some(1),
                value: q[1],
                limit: q[0],
                detail: "the second cart must be above the first",
            });
        }
        // Source 003 eq. 6.1 and 6.2.
        let x = f64::from(side) * square.sqrt();
        let tool = Vector2::new(x, (q[0] + q[1]) / 2.0);
        let links = [Vector2::new(x, half), Vector2::new(x, -half)];
        // Eq. 6.3, whose signs in the first row are the other way round: an erratum.
        let slope = half / (2.0 * x);
        let jacobian = Matrix2::new(slope, -slope, 0.5, 0.5);
        let length = self.link * self.link;
        let link_rates = [0, 1].map(|cart| {
            let link = links[cart];
            let mut rate =
                Vector2::new(link.x * 0.5 - link.y * slope, link.x * 0.5 + link.y * slope);
            rate[cart] -= link.x;
            rate / length
        });
        Ok(PrrrpChainState { tool, links, jacobian, link_rates, side })
    }

    fn pose(&self, chain: &PrrrpChainState) -> Pose {
        Pose::at(Vector3::new(chain.tool.x, chain.tool.y, 0.0))
    }

    fn jacobian(&self, chain: &PrrrpChainState) -> Jacobian<2> {
        plane::jacobian(&chain.jacobian)
    }

    fn margins(&self, chain: &PrrrpChainState) -> Vec<Margin> {
        let [first, _] = chain.links;
        vec![
            Margin {
                name: "type_1",
                kind: MarginKind::Serial,
                value: first.y / self.link,
                limit: self.type_1_limit,
            },
            Margin {
                name: "type_2",
                kind: MarginKind::Parallel,
                value: first.x.abs() / self.link,
                limit: self.type_2_limit,
            },
        ]
    }

    fn inverse(
        &self,
        pose: &Pose,
        branch: PrrrpBranch,
        _previous: &Joints<2>,
    ) -> Result<Joints<2>, KinematicsError> {
        in_plane(&pose.position)?;
        self.carts(pose.position.x, pose.position.y, branch.side).map(Joints::from)
    }

    fn joint_motion(
        &self,
        tool: &ToolMotion,
        branch: PrrrpBranch,
        _previous: &Joints<2>,
    ) -> Result<JointMotion<2>, KinematicsError> {
        in_plane(&tool.position)?;
        let [x, y, _] = tool.series();
        Ok(JointMotion::of_series(&self.carts(x, y, branch.side)?))
    }

    // Source 003 eq. 5.7 with 6.7 and 6.8, carts added and 2/m_e read as m_e/2, in independent
    // coordinates: the loop is closed in the velocities, so that no multiplier is left.
    fn mass_matrix(&self, chain: &PrrrpChainState) -> Matrix2<f64> {
        let link = self.link_body();
        let mut mass = self.tool_and_bar().joint_mass(&chain.jacobian, &Vector2::zeros());
        for cart in 0..2 {
            mass += link.joint_mass(&chain.centre(cart), &chain.link_rates[cart]);
            mass[(cart, cart)] += self.cart_mass;
        }
        mass
    }

    fn bias(&self, chain: &PrrrpChainState, velocity: &Joints<2>) -> Joints<2> {
        let (tool, turning) = chain.even_accelerations(velocity);
        let still = Vector2::zeros();
        let link = self.link_body();
        let mut effort = self.tool_and_bar().joint_effort(&chain.jacobian, &still, tool, 0.0);
        for (cart, turning) in turning.into_iter().enumerate() {
            let rate = &chain.link_rates[cart];
            effort += link.joint_effort(&chain.centre(cart), rate, tool / 2.0, turning);
        }
        effort
    }

    fn gravity(&self, _chain: &PrrrpChainState) -> Joints<2> {
        Joints::zeros()
    }

    fn bodies(&self, chain: &PrrrpChainState) -> Bodies {
        let carts = [0, 1].map(|cart| chain.tool - chain.links[cart]);
        Bodies {
            moving_mass: 2.0 * (self.cart_mass + self.link_mass) + self.tool_mass + self.bar_mass,
            points: [carts[0], carts[1], chain.tool].map(plane::level).into(),
        }
    }

    fn stiffness(&self) -> Option<Matrix2<f64>> {
        transmission::stiffness(self.elasticity)
    }

    fn damping(&self) -> Matrix2<f64> {
        transmission::damping(self.elasticity)
    }
}
