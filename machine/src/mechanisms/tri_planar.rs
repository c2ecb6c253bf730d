//! A platform on three triangles that hinge on its sides, each with its tip on a planar motor that
//! moves in two coordinates over one stator (source 001): six degrees of freedom.
//!
//! The platform is an equilateral triangle ABC, its frame in the centroid with z upwards; the legs
//! are triangles of the same side. Foot D hangs on the side A–C, E on C–B, F on A–B. The joints
//! are the feet's places in the stator plane z = 0: x and y of D, then of E, then of F [m].
//!
//! A leg's tip must lie in the plane. Of the two turns about the hinge that bring it there, the
//! outward one spreads the leg away from the platform and the inward one folds it below.

mod assemblies;
mod chain_state;
mod dynamics;
mod inverse;
mod limits;
mod mounting;
mod struts;

use nalgebra::{SMatrix, SVector, Vector3};

pub use chain_state::TriPlanarChainState;
pub use mounting::{Mounting, Standing};

use mounting::rows;

use super::scaled::{self, Scale};
use crate::analysis::Bodies;
use crate::kinematics::{
    Branch, Jacobian, JointMotion, Joints, KinematicsError, Margin, Mechanism, Pose, TaskSpace,
    ToolMotion,
};
use crate::transmission::{self, Elasticity};

/// Which way a leg leans from its hinge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fold {
    /// Away from the platform.
    #[default]
    Outward,
    /// Below the platform.
    Inward,
}

impl Fold {
    /// The sign of the leg's normal along z, and of the root of its equation.
    fn sign(self) -> f64 {
        match self {
            Self::Outward => 1.0,
            Self::Inward => -1.0,
        }
    }
}

/// How the legs of D, E and F lean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Legs(pub [Fold; 3]);

impl Legs {
    fn is_outward(self) -> bool {
        self.0 == [Fold::Outward; 3]
    }
}

/// Which of the poses that close the legs on the feet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TriPlanarBranch {
    /// How the legs lean.
    pub legs: Legs,
    /// Where more than one pose has legs that lean so: its number, from 1, the most level one first.
    /// `None` is the only one there, the one that a solution near by goes on to, or, with all legs
    /// outward, the one that is tilted by at most 45°.
    pub assembly: Option<u8>,
}

impl From<Legs> for TriPlanarBranch {
    fn from(legs: Legs) -> Self {
        Self { legs, assembly: None }
    }
}

impl Branch for TriPlanarBranch {
    fn choices(&self) -> Vec<(&'static str, Vec<i32>)> {
        let legs = self.legs.0.map(|fold| if fold == Fold::Outward { 1 } else { -1 });
        let assembly = self.assembly.map(|number| ("assembly", vec![i32::from(number)]));
        [("legs", legs.to_vec())].into_iter().chain(assembly).collect()
    }

    fn choose(self, name: &str, values: &[i32]) -> Option<Self> {
        let fold = |value| match value {
            1 => Some(Fold::Outward),
            -1 => Some(Fold::Inward),
            _ => None,
        };
        match (name, values) {
            ("legs", &[d, e, f]) => {
                Some(Self { legs: Legs([fold(d)?, fold(e)?, fold(f)?]), ..self })
            }
            ("assembly", []) => Some(Self { assembly: None, ..self }),
            ("assembly", &[number]) => {
                let number = u8::try_from(number).ok().filter(|number| *number > 0)?;
                Some(Self { assembly: Some(number), ..self })
            }
            _ => None,
        }
    }

    /// An assembly's number is that of one place only.
    fn in_any_turn(self) -> Self {
        Self { assembly: None, ..self }
    }
}

/// The platform, its legs and the stator below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriPlanar {
    /// Side of the platform, and of each leg as drawn [m].
    pub side: f64,
    /// For D, E and F, the two sides of the leg that meet in the foot, as measured: from A and C, from C
    /// and B, from A and B [m].
    pub struts: [[f64; 2]; 3],
    /// Where the stator stands and the tool is; `None` where the machine's frame is the stator's, and the
    /// tool the platform's centroid.
    pub mounting: Option<Mounting>,
    /// Where it stands at home, from where the assembly is carried on; `None` where nobody knows.
    pub home: Option<Standing>,
    /// Lowest and highest x, then y, of the stator [m].
    pub stator: [[f64; 2]; 2],
    /// Side of a planar motor's square body, which keeps parallel to the stator [m].
    pub inductor: f64,
    /// Least distance between two of these bodies [m].
    pub gap: f64,
    /// Least height of the platform's corners above the stator plane [m].
    pub clearance: f64,
    /// Least distance of a leg from standing upright: the z component of its unit normal.
    pub type_1_limit: f64,
    /// Least singular value of the matrix of the six struts, lengths divided by the side.
    pub type_2_limit: f64,
    /// Mass of the platform, tool included [kg].
    pub platform_mass: f64,
    /// Inertia of the platform about its frame's axes through the centroid, its centre of mass
    /// [kg·m²].
    pub platform_inertia: [f64; 3],
    /// Mass of one leg, a uniform thin triangle [kg].
    pub leg_mass: f64,
    /// Mass of the planar motor at a foot [kg].
    pub inductor_mass: f64,
    /// How the legs lean in the machine as built.
    pub legs: Legs,
    /// Spring and damper of each foot's drive along its axis; `None` when they are taken as rigid.
    pub elasticity: Option<[Elasticity; 6]>,
}

/// √3.
const ROOT_3: f64 = 1.732_050_807_568_877_2;

/// Unit vectors in the platform's frame, from the centroid to the middle of the side on which
/// D, E and F hang.
const OUTWARD: [[f64; 2]; 3] = [[ROOT_3 / 2.0, 0.5], [-ROOT_3 / 2.0, 0.5], [0.0, -1.0]];

/// The corners A, B and C in the platform's frame, in units of the side.
// Source 001 eq. 3; as printed, the sides would not equal a.
const CORNERS: [[f64; 2]; 3] = [[0.5, -0.5 / ROOT_3], [-0.5, -0.5 / ROOT_3], [0.0, 1.0 / ROOT_3]];

/// The corners from which the struts to D, E and F run, two for each.
const HINGES: [[usize; 2]; 3] = [[0, 2], [2, 1], [0, 1]];

impl TriPlanar {
    /// Height of the triangles [m].
    fn height(&self) -> f64 {
        self.side * (ROOT_3 / 2.0)
    }
}

impl Scale for TriPlanar {
    fn scale(&mut self, mass: f64, stiffness: f64) {
        scaled::all(&mut self.platform_inertia, mass);
        let masses = [&mut self.platform_mass, &mut self.leg_mass, &mut self.inductor_mass];
        scaled::all(masses, mass);
        scaled::soften(&mut self.elasticity, stiffness);
    }
}

impl Mechanism<6> for TriPlanar {
    type Branch = TriPlanarBranch;
    type ChainState = TriPlanarChainState;

    fn name(&self) -> &'static str {
        "tri_planar"
    }

    fn task_space(&self) -> TaskSpace {
        TaskSpace::Pose
    }

    fn branch(&self) -> TriPlanarBranch {
        self.legs.into()
    }

    fn solve(
        &self,
        q: &Joints<6>,
        branch: TriPlanarBranch,
        near: Option<&TriPlanarChainState>,
    ) -> Result<TriPlanarChainState, KinematicsError> {
        chain_state::solve(self, q, branch, near)
    }

    fn solve_at(
        &self,
        pose: &Pose,
        q: &Joints<6>,
        branch: TriPlanarBranch,
        near: Option<&TriPlanarChainState>,
    ) -> Result<TriPlanarChainState, KinematicsError> {
        chain_state::solve_at(self, &self.platform_pose(pose), q, branch.legs)
            .map_or_else(|| chain_state::solve(self, q, branch, near), Ok)
    }

    fn pose(&self, chain: &TriPlanarChainState) -> Pose {
        self.tool_pose(&Pose { position: chain.position, rotation: chain.rotation })
    }

    fn locate(
        &self,
        q: &Joints<6>,
        branch: TriPlanarBranch,
        near: Option<&TriPlanarChainState>,
    ) -> Result<Pose, KinematicsError> {
        chain_state::locate(self, q, branch, near).map(|platform| self.tool_pose(&platform))
    }

    fn branch_of(&self, chain: &TriPlanarChainState) -> TriPlanarBranch {
        chain_state::branch_of(self, chain)
    }

    fn jacobian(&self, chain: &TriPlanarChainState) -> Jacobian<6> {
        let Some(Mounting { base, tool }) = &self.mounting else { return chain.jacobian };
        let arm = chain.rotation * tool.position;
        let mut jacobian = Jacobian::<6>::zeros();
        for (column, mut twist) in jacobian.column_iter_mut().enumerate() {
            let rate = chain.jacobian.column(column);
            let turning = rate.fixed_rows::<3>(3).into_owned();
            let linear = rate.fixed_rows::<3>(0) + turning.cross(&arm);
            twist.fixed_rows_mut::<3>(0).copy_from(&(base.rotation * linear));
            twist.fixed_rows_mut::<3>(3).copy_from(&(base.rotation * turning));
        }
        jacobian
    }

    fn margins(&self, chain: &TriPlanarChainState) -> Vec<Margin> {
        limits::margins(self, chain)
    }

    fn inverse(
        &self,
        pose: &Pose,
        branch: TriPlanarBranch,
        _previous: &Joints<6>,
    ) -> Result<Joints<6>, KinematicsError> {
        let platform = self.platform_pose(pose);
        let (position, rotation) = (platform.position.into(), rows(&platform.rotation));
        let joints = SVector::from(inverse::feet(self, &position, &rotation, branch.legs)?);
        limits::check(self, &platform, &joints)?;
        Ok(joints)
    }

    fn joint_motion(
        &self,
        tool: &ToolMotion,
        branch: TriPlanarBranch,
        _previous: &Joints<6>,
    ) -> Result<JointMotion<6>, KinematicsError> {
        let (position, rotation) = self.platform_of(&tool.series(), &tool.attitude.series());
        let joints = inverse::feet(self, &position, &rotation, branch.legs)?;
        let motion = JointMotion::of_series(&joints);
        limits::check(self, &self.platform_pose(&tool.pose()), &motion.position)?;
        Ok(motion)
    }

    fn mass_matrix(&self, chain: &TriPlanarChainState) -> SMatrix<f64, 6, 6> {
        dynamics::mass_matrix(self, chain)
    }

    fn bias(&self, chain: &TriPlanarChainState, velocity: &Joints<6>) -> Joints<6> {
        dynamics::bias(self, chain, velocity)
    }

    fn gravity(&self, chain: &TriPlanarChainState) -> Joints<6> {
        dynamics::bias(self, chain, &Joints::zeros())
    }

    fn bodies(&self, chain: &TriPlanarChainState) -> Bodies {
        let feet = (0..3).map(|foot| chain.foot(foot));
        let corners = CORNERS
            .map(|[x, y]| chain.position + chain.rotation * Vector3::new(x, y, 0.0) * self.side);
        let in_machine = |point: Vector3<f64>| match &self.mounting {
            Some(Mounting { base, .. }) => base.position + base.rotation * point,
            None => point,
        };
        Bodies {
            moving_mass: self.platform_mass + 3.0 * (self.leg_mass + self.inductor_mass),
            points: feet.chain(corners).map(in_machine).collect(),
        }
    }

    fn stiffness(&self) -> Option<SMatrix<f64, 6, 6>> {
        transmission::stiffness(self.elasticity)
    }

    fn damping(&self) -> SMatrix<f64, 6, 6> {
        transmission::damping(self.elasticity)
    }
}
