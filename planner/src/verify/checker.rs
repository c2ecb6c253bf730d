//! Every sample of a plan against every limit of path, area and axes, before the first one is sent.

use machine::trip::Limit;
use machine::trip::following::DISCONTINUITY;
use machine::{Axis, DcMotor, Friction, Machine, Motor, PathLimits, WorkArea};
use messages::time::CYCLE_TIME;
use messages::{AxisArray, Setpoint};

use messages::plan::LimitUtilization;

use crate::limits::motion_limits::Scope;

/// What a sample may use of a limit of the path. Norms along smoothed joins are held to it by
/// measure between samples, not by construction, and speed along them is even to a part in 10⁴.
const ALLOWANCE: f64 = 1.001;

/// What a sample in the dark may use of the speed limit: the swing of a curved run-in adds to the
/// ramp up to 0.3 % shortly before the stroke.
const DARK_ALLOWANCE: f64 = 1.005;

/// Rounding allowed at the edge of an area or a soft limit [m or rad].
const ROUNDING: f64 = Limit::ROUNDING.plan;

/// What a plan holds to a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// A coordinate of the tool, 0 to 2 for x to z [m].
    ToolPosition(usize),
    /// Speed of the tool [m/s].
    ToolSpeed,
    /// Acceleration of the tool [m/s²].
    ToolAcceleration,
    /// Jerk of the tool [m/s³].
    ToolJerk,
    /// How far the tool strays from the drawn path between two setpoints [m].
    PathDeviation,
    /// Position of a joint [m or rad].
    JointPosition,
    /// How far a joint is from where the speeds of two setpoints that follow each other lead [m or rad].
    JointJump,
    /// Speed of a joint [m/s or rad/s].
    JointVelocity,
    /// Acceleration of a joint [m/s² or rad/s²].
    JointAcceleration,
    /// Jerk of a joint [m/s³ or rad/s³].
    JointJerk,
    /// Current of a DC motor [A].
    MotorCurrent,
    /// Voltage of a DC motor [V].
    MotorVoltage,
    /// Root mean square of a DC motor's current, which heats its winding [A].
    HeatingCurrent,
    /// Torque of a stepper [N·m].
    MotorTorque,
    /// Rate of a stepper's pulses [1/s].
    PulseRate,
}

impl Quantity {
    /// What a person reads.
    pub fn name(self) -> &'static str {
        match self {
            Self::ToolPosition(0) => "x of the tool",
            Self::ToolPosition(1) => "y of the tool",
            Self::ToolPosition(_) => "z of the tool",
            Self::ToolSpeed => "speed of the tool",
            Self::ToolAcceleration => "acceleration of the tool",
            Self::ToolJerk => "jerk of the tool",
            Self::PathDeviation => "deviation from the drawn path",
            Self::JointPosition => "joint position",
            Self::JointJump => "jump of a joint",
            Self::JointVelocity => "joint velocity",
            Self::JointAcceleration => "joint acceleration",
            Self::JointJerk => "joint jerk",
            Self::MotorCurrent => "motor current",
            Self::MotorVoltage => "motor voltage",
            Self::HeatingCurrent => "root mean square of current",
            Self::MotorTorque => "motor torque",
            Self::PulseRate => "pulse rate",
        }
    }

    /// Whether it says where something is, so that no other speed along the same way changes it.
    pub fn is_place(self) -> bool {
        matches!(self, Self::ToolPosition(_) | Self::JointPosition | Self::JointJump)
    }

    /// Whether it comes of all the motion before, and not of that at one instant.
    pub fn sums_up(self) -> bool {
        self == Self::HeatingCurrent
    }
}

impl core::fmt::Display for Quantity {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str(self.name())
    }
}

/// Which limit was broken, by how much.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitViolation {
    /// Stream time [s].
    pub time: f64,
    /// The axis, if it is one's limit.
    pub axis: Option<String>,
    /// What exceeds its limit.
    pub quantity: Quantity,
    /// Its value.
    pub value: f64,
    /// The limit that it breaks.
    pub limit: f64,
    /// The unit of both.
    pub unit: &'static str,
}

/// Holds samples to limits, one after the other.
#[derive(Debug, Clone)]
pub(crate) struct Checker {
    path: PathLimits,
    dark: f64,
    scope: Scope,
    /// The motors at the sample before: angle [rad] and current [A].
    before: Option<Vec<(f64, f64)>>,
    /// The joints at the sample before: position and velocity.
    joints_before: Option<(AxisArray, AxisArray)>,
    /// Mean square of each motor's current, as the controller's watch averages it [A²].
    heating: Vec<f64>,
    uses: LimitUtilization,
}

impl Checker {
    /// Against those limits of `machine` that are in `scope`, and against `path`.
    pub(crate) fn new(machine: &Machine, path: PathLimits, scope: Scope) -> Self {
        let count = if scope == Scope::Machine { machine.axes.len() } else { 0 };
        let none = || vec![0.0; count];
        Self {
            path,
            dark: path.rapid.max(path.speed),
            scope,
            before: None,
            joints_before: None,
            heating: none(),
            uses: LimitUtilization {
                velocity: none(),
                acceleration: none(),
                jerk: none(),
                current: none(),
                voltage: none(),
                heat: none(),
                sizing: none(),
                ..LimitUtilization::default()
            },
        }
    }

    /// Largest shares of all limits so far.
    pub(crate) fn utilization(&self) -> &LimitUtilization {
        &self.uses
    }

    /// Checks the next sample against the limits of `axes` and `area`.
    pub(crate) fn check(
        &mut self,
        setpoint: &Setpoint,
        axes: &[Axis],
        area: &WorkArea,
    ) -> Result<(), LimitViolation> {
        let time = setpoint.sequence as f64 * CYCLE_TIME;
        self.path(setpoint, time)?;
        if self.scope == Scope::PathAlone {
            return Ok(());
        }
        for index in 0..3 {
            let value = setpoint.tool[index];
            let limit = value.clamp(area.lower[index], area.upper[index]);
            within(value, limit, time, None, Quantity::ToolPosition(index), "m")?;
        }
        self.joints(setpoint, axes, time)?;
        self.motors(setpoint, axes, time)
    }

    fn path(&mut self, setpoint: &Setpoint, time: f64) -> Result<(), LimitViolation> {
        let (path, uses) = (&self.path, &mut self.uses);
        let (speed, allowance) = if setpoint.laser.is_lit() {
            (path.speed, ALLOWANCE)
        } else {
            (self.dark, DARK_ALLOWANCE)
        };
        let value = setpoint.path_velocity;
        let share = below(value, speed, allowance, time, None, Quantity::ToolSpeed, "m/s")?;
        uses.path_speed = uses.path_speed.max(share);
        let (value, limit) = (setpoint.path_acceleration, path.acceleration);
        let quantity = Quantity::ToolAcceleration;
        let share = below(value, limit, ALLOWANCE, time, None, quantity, "m/s²")?;
        uses.path_acceleration = uses.path_acceleration.max(share);
        let (value, limit) = (setpoint.path_jerk, path.jerk);
        let share = below(value, limit, ALLOWANCE, time, None, Quantity::ToolJerk, "m/s³")?;
        uses.path_jerk = uses.path_jerk.max(share);
        Ok(())
    }

    fn joints(
        &mut self,
        setpoint: &Setpoint,
        axes: &[Axis],
        time: f64,
    ) -> Result<(), LimitViolation> {
        let uses = &mut self.uses;
        for (index, axis) in axes.iter().enumerate() {
            let limits = &axis.limits;
            let name = Some(axis.name.as_str());
            let position = setpoint.position[index];
            let nearest = position.clamp(limits.position[0], limits.position[1]);
            let [place, speed, acceleration, jerk] = axis.unit.names();
            within(position, nearest, time, name, Quantity::JointPosition, place)?;
            if let Some((positions, velocities)) = &self.joints_before {
                let mean = (velocities[index] + setpoint.velocity[index]) / 2.0;
                let jump = (position - positions[index] - mean * CYCLE_TIME).abs();
                // What supervision forgives, and what a change of acceleration in the cycle makes.
                let most = DISCONTINUITY * limits.following_error
                    + setpoint.acceleration[index].abs() * CYCLE_TIME * CYCLE_TIME;
                below(jump, most, 1.0, time, name, Quantity::JointJump, place)?;
            }
            let demands = [
                (
                    setpoint.velocity[index],
                    axis.velocity_limit().plan,
                    Quantity::JointVelocity,
                    speed,
                ),
                (
                    setpoint.acceleration[index],
                    axis.acceleration_limit().plan,
                    Quantity::JointAcceleration,
                    acceleration,
                ),
                (setpoint.jerk[index], axis.jerk_limit().plan, Quantity::JointJerk, jerk),
            ];
            let most =
                [&mut uses.velocity[index], &mut uses.acceleration[index], &mut uses.jerk[index]];
            for ((value, limit, quantity, unit), most) in demands.into_iter().zip(most) {
                let share = below(value.abs(), limit, 1.0, time, name, quantity, unit)?;
                *most = most.max(share);
            }
        }
        self.joints_before = Some((setpoint.position, setpoint.velocity));
        Ok(())
    }

    /// Current and voltage that the motion needs, friction included: what the controller will
    /// feed forward for the cycle between the sample before and this one. Of a stepper, the share of
    /// the pull-out torque at its speed stands for that of the current, and the share of the pulse
    /// rate for that of the voltage.
    fn motors(
        &mut self,
        setpoint: &Setpoint,
        axes: &[Axis],
        time: f64,
    ) -> Result<(), LimitViolation> {
        let mut now = Vec::with_capacity(axes.len());
        for (index, axis) in axes.iter().enumerate() {
            let angle = (setpoint.position[index] + setpoint.lead[index]) / axis.ratio;
            let before = self.before.as_ref().map(|motors| motors[index]);
            let speed = before.map_or(0.0, |(earlier, _)| (angle - earlier) / CYCLE_TIME);
            let torque = setpoint.effort[index] + axis.friction.torque(speed);
            let size = sizing(axis, setpoint.effort[index], setpoint.acceleration[index], speed);
            self.uses.sizing[index] = self.uses.sizing[index].max(size);
            let name = Some(axis.name.as_str());
            let motor = match &axis.motor {
                Motor::Dc(motor) => motor,
                Motor::Stepper(motor) => {
                    let (torque, most) = (torque.abs(), motor.pull_out_torque(speed));
                    let share = below(torque, most, 1.0, time, name, Quantity::MotorTorque, "N·m")?;
                    self.uses.current[index] = self.uses.current[index].max(share);
                    let (rate, most) = (speed.abs() * motor.pulses_per_radian(), motor.pulse_rate);
                    let share = below(rate, most, 1.0, time, name, Quantity::PulseRate, "1/s")?;
                    self.uses.voltage[index] = self.uses.voltage[index].max(share);
                    now.push((angle, 0.0));
                    continue;
                }
            };
            let current = torque / motor.torque_constant;
            let earlier = before.map_or(current, |(_, current)| current);
            let voltage = motor.resistance * (current + earlier) / 2.0
                + motor.inductance * (current - earlier) / CYCLE_TIME
                + motor.torque_constant * speed;
            let most = motor.current_limit();
            let share =
                below(current.abs(), most.plan, 1.0, time, name, Quantity::MotorCurrent, "A")?;
            self.uses.current[index] = self.uses.current[index].max(share);
            let most = motor.voltage_limit();
            let share =
                below(voltage.abs(), most.plan, 1.0, time, name, Quantity::MotorVoltage, "V")?;
            self.uses.voltage[index] = self.uses.voltage[index].max(share);
            if let Some(limit) = motor.heating_limit() {
                let heating = &mut self.heating[index];
                *heating = DcMotor::heated(*heating, current, CYCLE_TIME, DcMotor::HEATING_TIME);
                let value = heating.sqrt();
                let share =
                    below(value, limit.plan, 1.0, time, name, Quantity::HeatingCurrent, "A")?;
                self.uses.heat[index] = self.uses.heat[index].max(share);
            }
            now.push((angle, current));
        }
        self.before = Some(now);
        Ok(())
    }
}

/// The share of its torque that the motor of `axis` needs at `speed` [rad/s] by the efficiencies of
/// its gear, which data sheets give in place of friction: its rotor's part of `effort` [N·m],
/// taken from the joint's acceleration, reaches no gear. Whatever stands is taken to be starting.
fn sizing(axis: &Axis, effort: f64, acceleration: f64, speed: f64) -> f64 {
    let rotor = axis.motor.rotor_inertia() * acceleration / axis.ratio;
    let speed = if Friction::is_standing(speed) { 0.0 } else { speed };
    let torque = rotor + axis.efficiency.torque(effort - rotor, speed);
    let most = match &axis.motor {
        Motor::Dc(motor) => motor.current * motor.torque_constant,
        Motor::Stepper(motor) => motor.pull_out_torque(speed),
    };
    torque.abs() / most
}

fn within(
    value: f64,
    limit: f64,
    time: f64,
    axis: Option<&str>,
    quantity: Quantity,
    unit: &'static str,
) -> Result<(), LimitViolation> {
    if (value - limit).abs() <= ROUNDING {
        return Ok(());
    }
    Err(LimitViolation { time, axis: axis.map(str::to_owned), quantity, value, limit, unit })
}

/// The share of `limit` that `value` uses, at most `allowance`.
fn below(
    value: f64,
    limit: f64,
    allowance: f64,
    time: f64,
    axis: Option<&str>,
    quantity: Quantity,
    unit: &'static str,
) -> Result<f64, LimitViolation> {
    let share = value / limit;
    // Put this way a value that is no number breaks the limit.
    if share <= allowance {
        return Ok(share);
    }
    Err(LimitViolation { time, axis: axis.map(str::to_owned), quantity, value, limit, unit })
}
