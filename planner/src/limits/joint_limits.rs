//! What a motion of the joints asks of axes, motors and path, against what they can give.

use machine::kinematics::{JointMotion, Joints, KinematicsError, ToolMotion};
use machine::{Axis, Mechanism, Motor, PathLimits};
use messages::math;

use crate::attitude::AttitudeLaw;

/// Share of a motor's current and voltage that is planned with; the rest is for what a look at one
/// instant does not know, above all the springs of the transmission.
const MOTOR_SHARE: f64 = 0.95;

/// Share of a motor's torque that the first guess at a joint move's acceleration takes.
const TORQUE_SHARE: f64 = 0.8;

/// Share of the supply's voltage that the first guess at a joint move's jerk leaves to the
/// inductance.
const VOLTAGE_SHARE: f64 = 0.25;

/// Share of an axis's limit that the first guess at a joint move uses: the rest is rounding, which the
/// check would take for a breach.
const INSIDE: f64 = 1.0 - 1e-9;

/// Limits of a machine's axes and path, asked about one motion after the other.
#[derive(Debug, Clone)]
pub(crate) struct Demands<'a, const N: usize, M: Mechanism<N>> {
    pub(crate) mechanism: &'a M,
    pub(crate) axes: &'a [Axis],
    pub(crate) path: PathLimits,
    pub(crate) branches: Vec<M::Branch>,
    pub(crate) attitude: AttitudeLaw,
}

impl<'a, const N: usize, M: Mechanism<N>> Demands<'a, N, M> {
    /// For a machine whose joints stand near `near`.
    pub(crate) fn new(
        mechanism: &'a M,
        axes: &'a [Axis],
        path: PathLimits,
        near: &Joints<N>,
        attitude: AttitudeLaw,
    ) -> Self {
        let branches = crate::posture::branches(mechanism, near);
        Self { mechanism, axes, path, branches, attitude }
    }

    /// The joints' motion for `tool`, turned as the job asks, continuous with `previous`.
    pub(crate) fn follow(
        &self,
        tool: &ToolMotion,
        branch: &mut usize,
        previous: &Joints<N>,
    ) -> Result<JointMotion<N>, KinematicsError> {
        let tool = self.attitude.apply(tool)?;
        crate::posture::follow(self.mechanism, &self.branches, &tool, branch, previous)
    }

    /// The mechanism with the joints at `joints` on the branch with this number.
    pub(crate) fn solve(
        &self,
        joints: &Joints<N>,
        branch: usize,
        near: Option<&M::ChainState>,
    ) -> Result<M::ChainState, KinematicsError> {
        self.mechanism.solve(joints, self.branches[branch], near)
    }

    /// Largest speed, acceleration and jerk along `change`, by the share of it, as far as they can
    /// be told before the motion is known: from the axes' limits, from the motors standing at
    /// `from`, and from the longest |p′| of the tool [m].
    pub(crate) fn along(
        &self,
        change: &Joints<N>,
        from: &Joints<N>,
        branch: usize,
        longest: f64,
    ) -> Result<[f64; 3], KinematicsError> {
        let assembly = self.solve(from, branch, None)?;
        let mass = self.mechanism.mass_matrix(&assembly);
        let path = &self.path;
        let mut most =
            [path.rapid, path.acceleration, path.jerk].map(|limit| INSIDE * limit / longest);
        for (index, axis) in self.axes.iter().enumerate().take(N) {
            let way = change[index].abs();
            if way <= 0.0 {
                continue;
            }
            let motor = &axis.motor;
            let [torque, slew] = torque_and_slew(motor);
            let inertia = motor.rotor_inertia() / axis.ratio + axis.ratio * mass[(index, index)];
            let acceleration = TORQUE_SHARE * torque / inertia;
            let jerk = VOLTAGE_SHARE * slew / inertia;
            let limits = &axis.limits;
            most[0] = most[0].min(INSIDE * limits.velocity / way);
            most[1] = most[1].min(INSIDE * limits.acceleration.min(acceleration) / way);
            most[2] = most[2].min(INSIDE * limits.jerk.min(jerk) / way);
        }
        Ok(most)
    }

    /// How many times slower a motion in the dark must be for every limit to hold; played c times
    /// slower, speed falls by c, acceleration by c² and jerk by c³.
    ///
    /// # Errors
    /// Where a motor cannot even hold the load.
    pub(crate) fn pace(
        &self,
        motion: &JointMotion<N>,
        tool: &ToolMotion,
        assembly: &M::ChainState,
    ) -> Result<f64, KinematicsError> {
        let path = &self.path;
        let pace = (tool.velocity.norm() / path.rapid.max(path.speed))
            .max((tool.acceleration.norm() / path.acceleration).sqrt())
            .max(math::cbrt(tool.jerk.norm() / path.jerk));
        self.pace_of_axes(pace, motion, assembly)
    }

    /// As [`Self::pace`] for the axes and motors alone; at least `pace`.
    pub(crate) fn pace_of_axes(
        &self,
        pace: f64,
        motion: &JointMotion<N>,
        assembly: &M::ChainState,
    ) -> Result<f64, KinematicsError> {
        let mut pace = pace;
        for (index, axis) in self.axes.iter().enumerate().take(N) {
            let limits = &axis.limits;
            pace = pace
                .max(motion.velocity[index].abs() / limits.velocity)
                .max((motion.acceleration[index].abs() / limits.acceleration).sqrt())
                .max(math::cbrt(motion.jerk[index].abs() / limits.jerk));
        }
        let most = self.motor_rate(1.0 / pace.max(1.0), motion, assembly)?;
        Ok(pace.max(1.0 / most))
    }

    /// The largest rate up to `rate` at which the motors can play `motion`.
    pub(crate) fn motor_rate(
        &self,
        rate: f64,
        motion: &JointMotion<N>,
        assembly: &M::ChainState,
    ) -> Result<f64, KinematicsError> {
        let gravity = self.mechanism.gravity(assembly);
        let mass = self.mechanism.mass_matrix(assembly);
        // What of the effort goes with the square of the rate.
        let bias = self.mechanism.bias(assembly, &motion.velocity) - gravity;
        let moving = mass * motion.acceleration + bias;
        let slew = mass * motion.jerk;
        let worst = |rate: f64| {
            let mut worst: f64 = 0.0;
            for (index, axis) in self.axes.iter().enumerate().take(N) {
                let (motor, ratio) = (&axis.motor, axis.ratio);
                let speed = motion.velocity[index] * rate / ratio;
                let rotor = motor.rotor_inertia() / ratio;
                let square = rate * rate;
                let torque = ratio * gravity[index]
                    + (rotor * motion.acceleration[index] + ratio * moving[index]) * square;
                let slew = (rotor * motion.jerk[index] + ratio * slew[index]) * square * rate;
                let torque = torque + axis.friction.torque(speed);
                worst = worst.max(match motor {
                    Motor::Dc(motor) => {
                        let current = torque / motor.torque_constant;
                        let voltage = motor.resistance * current
                            + motor.inductance * slew / motor.torque_constant
                            + motor.torque_constant * speed;
                        let current = current.abs() / (motor.current * MOTOR_SHARE);
                        current.max(voltage.abs() / (motor.voltage * MOTOR_SHARE))
                    }
                    Motor::Stepper(motor) => {
                        let rate = speed.abs() * motor.pulses_per_radian() / motor.pulse_rate;
                        let most = motor.pull_out_torque(speed) * MOTOR_SHARE;
                        // Beyond its fastest a stepper has no torque at all.
                        if most > 0.0 { rate.max(torque.abs() / most) } else { f64::INFINITY }
                    }
                });
            }
            worst
        };
        let mut rate = rate;
        for _ in 0..400 {
            if worst(rate) <= 1.0 {
                return Ok(rate);
            }
            rate /= 1.05;
        }
        Err(KinematicsError {
            code: "overload",
            axis: None,
            value: worst(0.0),
            limit: 1.0,
            detail: "the motors cannot hold the load here",
        })
    }
}

/// A motor's largest torque from rest [N·m], and how fast it can change [N·m/s].
pub(crate) fn torque_and_slew(motor: &Motor) -> [f64; 2] {
    /// A stepper's torque is there after so many seconds.
    const SOON: f64 = 1e-3;
    match motor {
        Motor::Dc(motor) => [
            motor.current * motor.torque_constant,
            motor.voltage / motor.inductance * motor.torque_constant,
        ],
        Motor::Stepper(motor) => {
            let torque = motor.pull_out_torque(0.0);
            [torque, torque / SOON]
        }
    }
}
