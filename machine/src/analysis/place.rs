//! A mechanism's matrices at one joint position, their sizes no longer part of the type.

use nalgebra::{DMatrix, DVector, Vector3};

use super::Bodies;
use crate::actuator::Actuator;
use crate::axis::Axis;
use crate::kinematics::{Branch, Joints, KinematicsError, Margin, TaskSpace};
use crate::{Machine, Mechanism, MechanismVisitor, Motor, Pose};

/// A machine at one joint position.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// The joints, load side [m or rad].
    pub joints: Vec<f64>,
    /// The tool, in the frame of its positions [m].
    pub position: Vector3<f64>,
    /// How far it is from what it must keep away from.
    pub margins: Vec<Margin>,
    /// What moves, and where it is.
    pub bodies: Bodies,
    /// Velocity of the tool per joint rate, the directions that it can choose: 2 or 3 rows.
    pub(super) linear: DMatrix<f64>,
    /// The same with what of its attitude it can choose below: 2, 3 or 6 rows.
    pub(super) task: DMatrix<f64>,
    /// Inertia of the load in joint coordinates [kg or kg·m²].
    pub(super) mass: DMatrix<f64>,
    /// What the joints hold at rest [N or N·m].
    pub(super) gravity: DVector<f64>,
    /// Stiffness of the transmission [N/m or N·m/rad]; `None` where it is rigid.
    pub(super) stiffness: Option<DMatrix<f64>>,
    /// Each axis's motors.
    pub(super) motors: Vec<MotorSide>,
}

/// The motors of an axis, together, seen from its joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MotorSide {
    /// Joint units per radian of the first of them.
    pub(super) ratio: f64,
    /// Inertia of the rotors at the joint [kg or kg·m²].
    pub(super) inertia: f64,
    /// Torque that they give at standstill, as if all of it were at the first one's shaft [N·m].
    pub(super) torque: f64,
    /// Stiffness with which their loops, or their fields, hold the joint [N/m or N·m/rad].
    pub(super) hold: f64,
}

impl MotorSide {
    fn of((_, actuators): (&Axis, &[Actuator])) -> Self {
        let ratio = actuators.first().map_or(1.0, |first| first.ratio.abs());
        let mut side = Self { ratio, inertia: 0.0, torque: 0.0, hold: 0.0 };
        for actuator in actuators {
            let square = actuator.ratio * actuator.ratio;
            let hold = match &actuator.motor {
                Motor::Dc(_) => {
                    let gains = &actuator.gains;
                    gains.inertia * gains.velocity * gains.position
                }
                Motor::Stepper(motor) => motor.stiffness(),
            };
            side.inertia += actuator.motor.rotor_inertia() / square;
            side.torque += actuator.motor.stall_torque() * (ratio / actuator.ratio.abs());
            side.hold += hold / square;
        }
        side
    }
}

impl Place {
    /// `machine` with its joints at `joints`, load side [m or rad], on the branch in which it is built.
    /// What `joints` leaves out is 0.
    ///
    /// # Errors
    /// Where the chain cannot close.
    pub fn at(machine: &Machine, joints: &[f64]) -> Result<Self, KinematicsError> {
        machine.mechanism.visit(AtJoints { machine, joints })
    }

    /// `machine` with its tool at `position` [m] and its attitude that of home. The axes' limits are not
    /// asked; [`super::Area`] does that.
    ///
    /// # Errors
    /// Out of reach or singular, with how far.
    pub fn with_tool_at(machine: &Machine, position: [f64; 3]) -> Result<Self, KinematicsError> {
        machine.mechanism.visit(AtPosition { machine, position })
    }

    /// `machine` at home.
    ///
    /// # Errors
    /// Where the chain cannot close.
    pub fn home(machine: &Machine) -> Result<Self, KinematicsError> {
        Self::at(machine, &machine.home_joints)
    }

    /// The machine with a solved chain.
    pub(super) fn of_chain<const N: usize, M: Mechanism<N>>(
        machine: &Machine,
        mechanism: &M,
        joints: &Joints<N>,
        chain: &M::ChainState,
        margins: Vec<Margin>,
    ) -> Self {
        let pose = mechanism.pose(chain);
        let task = task_jacobian(mechanism, chain, &pose);
        let rows = if mechanism.task_space() == TaskSpace::Plane { 2 } else { 3 };
        let mass = mechanism.mass_matrix(chain);
        let gravity = mechanism.gravity(chain);
        let square = |matrix: nalgebra::SMatrix<f64, N, N>| {
            DMatrix::from_fn(N, N, |row, column| matrix[(row, column)])
        };
        Self {
            joints: joints.iter().copied().collect(),
            position: pose.position,
            margins,
            bodies: mechanism.bodies(chain),
            linear: task.rows(0, rows).into_owned(),
            task,
            mass: square(mass),
            gravity: DVector::from_fn(N, |row, _| gravity[row]),
            stiffness: mechanism.stiffness().map(square),
            motors: machine.driven().map(MotorSide::of).collect(),
        }
    }

    /// Number of axes.
    pub(super) fn axes(&self) -> usize {
        self.joints.len()
    }

    /// Inertia in joint coordinates, the rotors with it [kg or kg·m²].
    pub(super) fn inertia_with_rotors(&self) -> DMatrix<f64> {
        let mut inertia = self.mass.clone();
        for (axis, motor) in self.motors.iter().enumerate() {
            inertia[(axis, axis)] += motor.inertia;
        }
        inertia
    }
}

/// The rows of the tool's Jacobian in which a mechanism can choose the tool's motion.
fn task_jacobian<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    chain: &M::ChainState,
    pose: &Pose,
) -> DMatrix<f64> {
    let jacobian = mechanism.jacobian(chain);
    let rows = match mechanism.task_space() {
        TaskSpace::Plane => 2,
        TaskSpace::Space => 3,
        TaskSpace::Axis | TaskSpace::Pose => 6,
    };
    let mut task = DMatrix::from_fn(rows, N, |row, column| jacobian[(row, column)]);
    if mechanism.task_space() == TaskSpace::Axis {
        // The rate of the beam's direction, ω×t: turning about the beam does not show in it.
        let beam = -pose.rotation.column(2).into_owned();
        for column in 0..N {
            let turning: Vector3<f64> = jacobian.fixed_view::<3, 1>(3, column).into_owned();
            task.view_mut((3, column), (3, 1)).copy_from(&turning.cross(&beam));
        }
    }
    task
}

/// As many of `values` as there are joints.
pub(super) fn joints<const N: usize>(values: &[f64]) -> Joints<N> {
    Joints::from_fn(|axis, _| values.get(axis).copied().unwrap_or_default())
}

struct AtJoints<'a> {
    machine: &'a Machine,
    joints: &'a [f64],
}

impl MechanismVisitor for AtJoints<'_> {
    type Output = Result<Place, KinematicsError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let joints = joints::<N>(self.joints);
        let chain = mechanism.solve(&joints, mechanism.branch().in_any_turn(), None)?;
        let margins = mechanism.margins(&chain);
        Ok(Place::of_chain(self.machine, &mechanism, &joints, &chain, margins))
    }
}

struct AtPosition<'a> {
    machine: &'a Machine,
    position: [f64; 3],
}

impl MechanismVisitor for AtPosition<'_> {
    type Output = Result<Place, KinematicsError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let home = joints::<N>(&self.machine.home_joints);
        let branch = mechanism.branch().in_any_turn();
        let rotation = mechanism.forward(&home, branch)?.rotation;
        let pose = Pose { position: Vector3::from(self.position), rotation };
        let joints = mechanism.inverse(&pose, branch, &home)?;
        let chain = mechanism.solve_at(&pose, &joints, branch, None)?;
        let margins = mechanism.margins(&chain);
        Ok(Place::of_chain(self.machine, &mechanism, &joints, &chain, margins))
    }
}
