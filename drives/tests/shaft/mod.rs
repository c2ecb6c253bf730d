//! A motor with nothing but its shaft, a load torque and perhaps an arm: the one-axis mechanism of
//! the motor's own tests.

use machine::kinematics::{
    Jacobian, JointMotion, Joints, KinematicsError, Margin, Mechanism, Pose, TaskSpace, ToolMotion,
};
use machine::transmission::gear::Efficiency;
use machine::{AxisLimits, DcMotor, Encoder, Friction, HoldingBrake, LoopGains, Motor};
use nalgebra::{SMatrix, Vector1, Vector3};

/// A rigid joint of 1 rad per radian.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shaft {
    /// Torque against positive motion [N·m].
    pub(crate) load: f64,
    /// Inertia that grows as the shaft turns, `spread·(1 + q²)` [kg·m²]: an arm that reaches out.
    pub(crate) spread: f64,
}

impl Mechanism<1> for Shaft {
    type Branch = ();
    type ChainState = Joints<1>;
    fn name(&self) -> &'static str {
        "shaft"
    }

    fn task_space(&self) -> TaskSpace {
        TaskSpace::Plane
    }

    fn branch(&self) {}

    fn branch_of(&self, _q: &Joints<1>) {}

    fn solve(
        &self,
        q: &Joints<1>,
        _branch: (),
        _near: Option<&Joints<1>>,
    ) -> Result<Joints<1>, KinematicsError> {
        Ok(*q)
    }

    fn pose(&self, q: &Joints<1>) -> Pose {
        Pose::at(Vector3::new(q[0], 0.0, 0.0))
    }

    fn margins(&self, _q: &Joints<1>) -> Vec<Margin> {
        Vec::new()
    }

    fn inverse(
        &self,
        pose: &Pose,
        _branch: (),
        _previous: &Joints<1>,
    ) -> Result<Joints<1>, KinematicsError> {
        Ok(Vector1::new(pose.position.x))
    }

    fn jacobian(&self, _q: &Joints<1>) -> Jacobian<1> {
        Jacobian::<1>::from_column_slice(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    fn joint_motion(
        &self,
        tool: &ToolMotion,
        _branch: (),
        _previous: &Joints<1>,
    ) -> Result<JointMotion<1>, KinematicsError> {
        Ok(JointMotion {
            position: Vector1::new(tool.position.x),
            velocity: Vector1::new(tool.velocity.x),
            acceleration: Vector1::new(tool.acceleration.x),
            jerk: Vector1::new(tool.jerk.x),
        })
    }

    fn mass_matrix(&self, q: &Joints<1>) -> SMatrix<f64, 1, 1> {
        SMatrix::from_element(self.spread * (1.0 + q[0] * q[0]))
    }

    fn bias(&self, q: &Joints<1>, velocity: &Joints<1>) -> Joints<1> {
        // Lagrange: ½·dM/dq·q̇².
        Vector1::new(self.load + self.spread * q[0] * velocity[0] * velocity[0])
    }

    fn gravity(&self, _q: &Joints<1>) -> Joints<1> {
        Vector1::new(self.load)
    }

    fn stiffness(&self) -> Option<SMatrix<f64, 1, 1>> {
        None
    }

    fn damping(&self) -> SMatrix<f64, 1, 1> {
        SMatrix::zeros()
    }
}

/// The axis of a bare motor.
pub(crate) fn axis() -> machine::Axis {
    machine::Axis {
        name: "shaft".to_owned(),
        unit: machine::JointUnit::Angle,
        backlash: 0.0,
        limits: AxisLimits {
            position: [-1e9, 1e9],
            velocity: 500.0,
            acceleration: f64::INFINITY,
            jerk: f64::INFINITY,
            following_error: 1.0,
            racking: 1.0,
        },
        actuators: 0..1,
    }
}

/// A bare motor: EC035.120 with `inertia` [kg·m²] and `friction` at its shaft.
pub(crate) fn actuator(inertia: f64, friction: Friction) -> machine::Actuator {
    machine::Actuator {
        name: "shaft".to_owned(),
        axis: 0,
        ratio: 1.0,
        share: 1.0,
        efficiency: Efficiency::LOSSLESS,
        motor: Motor::Dc(DcMotor {
            resistance: 2.3,
            inductance: 2.3e-3,
            torque_constant: 0.021,
            rotor_inertia: inertia,
            voltage: 12.0,
            current: 5.2,
            continuous_current: None,
        }),
        friction,
        brake: HoldingBrake { torque: 0.0, release: 0.0 },
        encoder: Encoder { counts: 4096.0 },
        gains: LoopGains { position: 40.0, velocity: 160.0, current: 349.0, inertia },
        mode: machine::ActuatorMode::Voltage,
        latency: messages::Nanoseconds(0),
        torque_delay: messages::Nanoseconds(0),
        age: messages::Nanoseconds(0),
        square: 0.0,
    }
}

/// So many axes and actuators as `actuator`, one to one.
#[allow(dead_code)] // Each test has its own copy of this module.
pub(crate) fn alike(
    actuator: &machine::Actuator,
    count: usize,
) -> (Vec<machine::Axis>, Vec<machine::Actuator>) {
    let own = |axis| machine::Actuator { axis, ..actuator.clone() };
    let of = |index: usize| machine::Axis { actuators: index..index + 1, ..axis() };
    ((0..count).map(of).collect(), (0..count).map(own).collect())
}
