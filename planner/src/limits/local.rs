//! The limits at one place of a path, as rows of the time law: tool, joints and motors.

use machine::kinematics::{JointMotion, KinematicsError, ToolMotion};
use machine::{Actuator, Mechanism};
use messages::math;
use nalgebra::Vector3;

use crate::law::row::Row;
use crate::limits::limit_id::LimitId;
use crate::limits::motion_limits::MotionLimits;
use crate::limits::motor_rows::{AxisMotion, Overload, motor_rows};
use crate::limits::tightening::Tightening;

/// Directions in which the acceleration's norm is held: a polygon inside the circle, with corners
/// along the path and across it.
const SIDES: usize = 12;

/// Below this a derivative says nothing [1/m, 1/m²].
const STRAIGHT: f64 = 1e-9;

/// What is left of a place when its rows are written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Local {
    /// The largest u̇ [m/s].
    pub(crate) speed: f64,
    pub(crate) speed_source: LimitId,
    /// The largest third derivative of u from rest [m/s³].
    pub(crate) launch: f64,
    pub(crate) launch_source: LimitId,
}

impl Local {
    /// With the speed of the tool `speed` [m/s] that `source` allows, where it goes |p′| = `stretch`
    /// as fast as u.
    pub(crate) fn new(speed: f64, source: LimitId, stretch: f64, jerk: f64) -> Self {
        Self {
            speed: speed / stretch,
            speed_source: source,
            launch: jerk / stretch,
            launch_source: LimitId::TOOL_JERK,
        }
    }

    fn cap(&mut self, speed: f64, source: LimitId) {
        if speed < self.speed {
            (self.speed, self.speed_source) = (speed, source);
        }
    }

    fn launch(&mut self, jerk: f64, source: LimitId) {
        if jerk < self.launch {
            (self.launch, self.launch_source) = (jerk, source);
        }
    }
}

/// Appends the rows of the tool: |p′·ü + p″·u̇²| ≤ A and u̇·|p′·ü′ + 3p″·ü + p‴·u̇²| ≤ J.
pub(crate) fn tool_rows(
    [first, second, third]: [Vector3<f64>; 3],
    acceleration: f64,
    jerk: f64,
    rows: &mut Vec<Row>,
) {
    let along = first.normalize();
    let across = |vector: &Vector3<f64>| vector - along * along.dot(vector);
    let bent = across(&second);
    let wound = across(&third);
    let is_bent = bent.norm() > STRAIGHT;
    let is_straight = !is_bent && wound.norm() <= STRAIGHT;
    let normal = if is_bent {
        bent.normalize()
    } else if is_straight {
        Vector3::zeros()
    } else {
        wound.normalize()
    };
    // Out of the plane of the bend, which no side of the polygon sees: added to each.
    let aside = (wound - normal * normal.dot(&wound)).norm();
    let parts = |vector: &Vector3<f64>| (along.dot(vector), normal.dot(vector));
    let ((a1, _), (a2, n2), (a3, n3)) = (parts(&first), parts(&second), parts(&third));
    let sides = if is_straight { 2 } else { SIDES };
    let inside = if is_straight { 1.0 } else { math::cos(math::TURN / (2 * SIDES) as f64) };
    for side in 0..sides {
        let (sine, cosine) = if is_straight {
            (0.0, if side == 0 { 1.0 } else { -1.0 })
        } else {
            math::sin_cos(math::TURN * (side as f64 + 0.5) / SIDES as f64)
        };
        let (w1, w2, w3) = (cosine * a1, cosine * a2 + sine * n2, cosine * a3 + sine * n3);
        // Across, the acceleration is only ever towards the inside of the bend.
        if sine >= 0.0 {
            rows.push(Row {
                base: [0.0, w1, w2],
                by_speed: [0.0; 3],
                top: acceleration * inside,
                top_by_speed: 0.0,
                limit: LimitId::TOOL_ACCELERATION.0,
            });
        }
        rows.push(Row {
            base: [0.0; 3],
            by_speed: [w1, 3.0 * w2, w3 + aside],
            top: jerk * inside,
            top_by_speed: 0.0,
            limit: LimitId::TOOL_JERK.0,
        });
    }
}

impl<const N: usize, M: Mechanism<N>> MotionLimits<'_, N, M> {
    /// Appends the rows of joints and motors where the joints go as `motion` with the path's
    /// parameter, and puts their speeds into `local`.
    ///
    /// # Errors
    /// Where a motor cannot hold its load.
    pub(crate) fn joint_rows(
        &self,
        motion: &JointMotion<N>,
        state: &M::ChainState,
        shares: &Tightening,
        local: &mut Local,
        rows: &mut Vec<Row>,
    ) -> Result<(), KinematicsError> {
        for (index, axis) in self.axes.iter().enumerate().take(N) {
            let share = &shares.axes[index];
            let [q1, q2, q3] =
                [motion.velocity[index], motion.acceleration[index], motion.jerk[index]];
            let velocity = share.velocity * axis.velocity_limit().plan;
            local.cap(velocity / q1.abs(), LimitId::joint_velocity(index));
            let acceleration = share.acceleration * axis.acceleration_limit().plan;
            let jerk = share.jerk * axis.jerk_limit().plan;
            local.launch(jerk / q1.abs(), LimitId::joint_jerk(index));
            for sign in [1.0, -1.0] {
                if acceleration.is_finite() {
                    rows.push(Row {
                        base: [0.0, sign * q1, sign * q2],
                        by_speed: [0.0; 3],
                        top: acceleration,
                        top_by_speed: 0.0,
                        limit: LimitId::joint_acceleration(index).0,
                    });
                }
                if jerk.is_finite() {
                    rows.push(Row {
                        base: [0.0; 3],
                        by_speed: [sign * q1, sign * 3.0 * q2, sign * q3],
                        top: jerk,
                        top_by_speed: 0.0,
                        limit: LimitId::joint_jerk(index).0,
                    });
                }
            }
        }
        self.all_motor_rows(motion, state, shares, local, rows)
    }

    fn all_motor_rows(
        &self,
        motion: &JointMotion<N>,
        state: &M::ChainState,
        shares: &Tightening,
        local: &mut Local,
        rows: &mut Vec<Row>,
    ) -> Result<(), KinematicsError> {
        let mechanism = self.mechanism;
        let gravity = mechanism.gravity(state);
        let mass = mechanism.mass_matrix(state);
        let loads = [mass * motion.velocity, mass * motion.acceleration, mass * motion.jerk];
        // What of the effort goes with the square of the speed beside the joints' own acceleration.
        let turning = mechanism.bias(state, &motion.velocity) - gravity;
        for (number, actuator) in self.actuators.iter().enumerate() {
            let Actuator { axis: index, ratio, share, .. } = *actuator;
            // What one is asked for, all that are like it bear.
            let first = self.axes[index].actuators.start;
            if self.actuators[first..number].iter().any(|other| actuator.is_like(other)) {
                continue;
            }
            let rotor = actuator.motor.rotor_inertia() / ratio;
            let shaft = |joint: f64, load: f64| rotor * joint + ratio * (share * load);
            let [w1, w2, w3] = [
                shaft(motion.velocity[index], loads[0][index]),
                shaft(motion.acceleration[index], loads[1][index]),
                shaft(motion.jerk[index], loads[2][index]),
            ];
            let motion = AxisMotion {
                velocity: motion.velocity[index],
                inertia: w1,
                turning: w2 + ratio * (share * turning[index]),
                rate: [w1, 3.0 * w2, w3],
                gravity: ratio * (share * gravity[index]),
            };
            let speed =
                motor_rows(actuator, index, &motion, &shares.axes[index], local.speed, rows)
                    .map_err(|Overload { needed, limit }| KinematicsError {
                        code: "overload",
                        axis: Some(index),
                        value: needed,
                        limit,
                        detail: "the motor's torque in N·m cannot hold the load here",
                    })?;
            local.cap(speed, LimitId::voltage(index));
        }
        Ok(())
    }
}

/// The derivatives of the tool's path by its parameter, from the motion at u̇ = 1.
pub(crate) fn derivatives(tool: &ToolMotion) -> [Vector3<f64>; 3] {
    [tool.velocity, tool.acceleration, tool.jerk]
}
