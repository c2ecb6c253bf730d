//! What the joints near a configuration leave of the tool's motion: along the direction in which each
//! of them moves, and along that in which its motor is loaded. For a linear mechanism that is exact
//! but for friction and back-EMF; for others it holds near the configuration, and how the joints
//! follow a flight says what is missing.

use machine::kinematics::{Joints, KinematicsError, Pose, ToolMotion};
use machine::{Actuator, Axis, Machine, Mechanism, MechanismVisitor, Motor, PathLimits};
use nalgebra::{SMatrix, Vector3};

use crate::geometry::attitude::AttitudeLaw;
use crate::joint_space::configuration::Configuration;
use crate::law::flight::DirectionLimit;
use crate::limits::limit_id::JointLimit;
use crate::limits::motion_limits::{MotionLimits, Scope};
use crate::limits::tightening::{AxisShares, Tightening};

/// BindingTimes of what is left of each joint's limits, by [`JointLimit`].
pub(crate) type Parts<const N: usize> = [[f64; JointLimit::COUNT]; N];

/// What of its torque a motor has in any case, though friction and load take all of the share: [1].
const LEAST: f64 = 0.1;

/// The limits of the joints near `near`, each taken `parts` of.
///
/// # Errors
/// Where the mechanism cannot be there.
pub(crate) fn directions<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    near: &Configuration<N>,
    shares: &Tightening,
    parts: &Parts<N>,
) -> Result<Vec<DirectionLimit>, KinematicsError> {
    let mechanism = limits.mechanism;
    let state = limits.solve(&near.joints, near.branch, None)?;
    let pose = mechanism.pose(&state);
    let mut rates = SMatrix::<f64, N, 3>::zeros();
    for axis in 0..3 {
        let tool = ToolMotion { velocity: Vector3::ith(axis, 1.0), ..ToolMotion::rest(&pose) };
        let mut branch = near.branch;
        let motion = limits.follow(&tool, &mut branch, &near.joints)?;
        rates.set_column(axis, &motion.velocity);
    }
    let loads = mechanism.mass_matrix(&state) * rates;
    let gravity = mechanism.gravity(&state);
    let mut found = Vec::with_capacity(2 * N);
    for (index, axis) in limits.axes.iter().enumerate().take(N) {
        let (share, parts) = (&shares.axes[index], &parts[index]);
        let joint: Vector3<f64> = rates.row(index).transpose();
        let actuators = axis.driven_by(limits.actuators);
        found.extend(joint_direction(axis, actuators, &joint, share, parts));
        for actuator in actuators {
            let (ratio, part) = (actuator.ratio, actuator.share);
            let rotor = actuator.motor.rotor_inertia() / ratio;
            let shaft = joint * rotor + loads.row(index).transpose() * (part * ratio);
            let held = ratio.abs() * (part * gravity[index].abs()) + actuator.friction.coulomb;
            found.extend(motor_direction(actuator, &shaft, held, share, parts));
        }
    }
    Ok(found)
}

/// |q̇|, |q̈| and |q⃛| of a joint that goes `joint` as fast as the tool.
fn joint_direction(
    axis: &Axis,
    actuators: &[Actuator],
    joint: &Vector3<f64>,
    share: &AxisShares,
    parts: &[f64; JointLimit::COUNT],
) -> Option<DirectionLimit> {
    let length = joint.norm();
    let direction = joint.try_normalize(f64::MIN_POSITIVE)?;
    let mut velocity =
        parts[JointLimit::Velocity as usize] * share.velocity * axis.velocity_limit().plan;
    for actuator in actuators {
        let Motor::Stepper(motor) = &actuator.motor else { continue };
        let most = motor.pulse_rate / motor.pulses_per_radian() * actuator.ratio.abs();
        velocity = velocity.min(parts[JointLimit::Voltage as usize] * share.velocity * most);
    }
    let acceleration = parts[JointLimit::Acceleration as usize]
        * share.acceleration
        * axis.acceleration_limit().plan;
    let jerk = parts[JointLimit::Jerk as usize] * share.jerk * axis.jerk_limit().plan;
    Some(DirectionLimit {
        direction,
        speed: velocity / length,
        acceleration: acceleration / length,
        jerk: jerk / length,
    })
}

/// The torque of a motor whose shaft is loaded by `shaft` per acceleration of the tool [kg·m] beside
/// `held` [N·m]; and of a DC motor the voltage, as if it were all for the current or all for its change.
fn motor_direction(
    actuator: &Actuator,
    shaft: &Vector3<f64>,
    held: f64,
    share: &AxisShares,
    parts: &[f64; JointLimit::COUNT],
) -> Option<DirectionLimit> {
    let length = shaft.norm();
    let direction = shaft.try_normalize(f64::MIN_POSITIVE)?;
    let left = |torque: f64| (torque - held).max(LEAST * torque);
    let [by_torque, by_voltage] =
        [JointLimit::Torque, JointLimit::Voltage].map(|limit| parts[limit as usize]);
    let (torque, rate) = match &actuator.motor {
        Motor::Dc(motor) => {
            let current = share.torque * motor.current_limit().plan * motor.torque_constant;
            let voltage = share.voltage * motor.voltage_limit().plan * motor.torque_constant;
            let stalled = by_voltage * left(voltage / motor.resistance);
            let rate = by_voltage * voltage / motor.inductance;
            ((by_torque * left(current)).min(stalled), rate)
        }
        Motor::Stepper(motor) => {
            (by_torque * left(share.torque * motor.torque_limit(0.0)), f64::INFINITY)
        }
    };
    Some(DirectionLimit {
        direction,
        speed: f64::INFINITY,
        acceleration: torque / length,
        jerk: rate / length,
    })
}

/// The limits of the joints of `machine` near a place, on the branch that it has itself; none where it
/// cannot be there.
pub(crate) fn directions_near(
    machine: &Machine,
    path: PathLimits,
    attitude: AttitudeLaw,
    scope: Scope,
) -> impl Fn(&Vector3<f64>) -> Vec<DirectionLimit> + '_ {
    let at = move |place: Vector3<f64>| {
        machine.mechanism.visit(Near { machine, path, attitude, scope, place }).unwrap_or_default()
    };
    let is_same = machine.mechanism.visit(IsLinear) || scope == Scope::PathAlone;
    let everywhere = is_same.then(|| at(Vector3::from(machine.home)));
    move |place| everywhere.clone().unwrap_or_else(|| at(*place))
}

struct IsLinear;

impl MechanismVisitor for IsLinear {
    type Output = bool;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> bool {
        mechanism.is_linear()
    }
}

struct Near<'a> {
    machine: &'a Machine,
    path: PathLimits,
    attitude: AttitudeLaw,
    scope: Scope,
    place: Vector3<f64>,
}

impl MechanismVisitor for Near<'_> {
    type Output = Result<Vec<DirectionLimit>, KinematicsError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self { machine, path, attitude, scope, place } = self;
        if scope == Scope::PathAlone {
            return Ok(Vec::new());
        }
        let home = Joints::<N>::from_fn(|axis, _| machine.home_joints[axis]);
        let limits = MotionLimits::new(&mechanism, machine, path, &home, attitude, scope);
        let tool = attitude.apply(&ToolMotion::rest(&Pose::at(place)))?;
        let joints = mechanism.inverse(&tool.pose(), limits.branches[0], &home)?;
        let near = Configuration { joints, branch: 0 };
        directions(&limits, &near, &Tightening::none(N), &[[1.0; JointLimit::COUNT]; N])
    }
}
