//! Every sample of a plan against every limit of path, area and axes, before the first one is sent.

use machine::trip::Limit;
use machine::trip::following::DISCONTINUITY;
use machine::{
    Actuator, Axis, DcMotor, Friction, LaserSource, Machine, Motor, PathLimits, WorkArea,
};
use messages::time::{Period, SETPOINT_PERIOD, SETPOINT_TIME};
use messages::{
    ActuatorArray, AxisArray, MAX_ACTUATORS, MAX_AXES, MAX_EDGES, Nanoseconds, Setpoint,
};

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
    /// Power of the laser [fraction of full scale].
    LaserPower,
    /// Pulse repetition rate of the laser [pulses/s].
    LaserFrequency,
    /// Changes of the laser in a cycle.
    LaserChanges,
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
            Self::LaserPower => "power of the laser",
            Self::LaserFrequency => "frequency of the laser",
            Self::LaserChanges => "changes of the laser in a control cycle",
        }
    }

    /// Whether it says where something is, so that no other speed along the same way changes it.
    pub fn is_place(self) -> bool {
        matches!(self, Self::ToolPosition(_) | Self::JointPosition | Self::JointJump)
    }

    /// Whether it is of the light, of which the source is told ahead of the motion that it belongs to.
    pub fn is_light(self) -> bool {
        matches!(self, Self::LaserPower | Self::LaserFrequency | Self::LaserChanges)
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

impl LimitViolation {
    /// More changes of the laser in the cycle of `setpoint` than it has room for.
    pub(crate) fn too_many_changes(setpoint: &Setpoint) -> Self {
        Self {
            time: setpoint.sequence as f64 * SETPOINT_TIME,
            axis: None,
            quantity: Quantity::LaserChanges,
            value: (MAX_EDGES + 1) as f64,
            limit: MAX_EDGES as f64,
            unit: "changes",
        }
    }
}

/// The largest value so far of a quantity whose limit stays the same. Only a value beyond it needs to be
/// held to the limit again.
#[derive(Debug, Clone, Copy, Default)]
struct Most(f64);

/// Whose quantity it is that is held to a limit, and when.
#[derive(Debug, Clone, Copy)]
struct Named<'a> {
    time: f64,
    axis: Option<&'a str>,
    quantity: Quantity,
    unit: &'static str,
}

impl Most {
    /// Holds `value` to `allowance` times `limit`, and keeps in `used` the largest share of the limit.
    #[inline]
    fn hold(
        &mut self,
        value: f64,
        [limit, allowance]: [f64; 2],
        used: &mut f64,
        named: Named<'_>,
    ) -> Result<(), LimitViolation> {
        if value <= self.0 {
            return Ok(());
        }
        *used = used.max(named.below(value, limit, allowance)?);
        self.0 = value;
        Ok(())
    }
}

/// The largest values of an axis.
#[derive(Debug, Clone, Copy, Default)]
struct AxisMost {
    velocity: Most,
    acceleration: Most,
    jerk: Most,
}

/// The largest values of an actuator.
#[derive(Debug, Clone, Copy, Default)]
struct MotorMost {
    current: Most,
    voltage: Most,
    /// Mean square of the current [A²].
    heating: Most,
    /// Torque of a DC motor by the efficiency of its gear [N·m].
    sizing: f64,
}

/// A motor at a sample.
#[derive(Debug, Clone, Copy, Default)]
struct MotorState {
    /// [rad].
    angle: f64,
    /// Of a DC motor [A].
    current: f64,
}

/// Holds samples to limits, one after the other.
#[derive(Debug, Clone)]
pub(crate) struct Checker {
    path: PathLimits,
    dark: f64,
    scope: Scope,
    source: LaserSource,
    /// The motors at the sample before.
    before: Option<[MotorState; MAX_ACTUATORS]>,
    /// The joints at the sample before: position and velocity.
    joints_before: Option<(AxisArray, AxisArray)>,
    /// Mean square of each motor's current, as the controller's watch averages it [A²].
    heating: ActuatorArray,
    /// The tool's speed in the dark and lit, its acceleration and its jerk.
    most: [Most; 4],
    axes: [AxisMost; MAX_AXES],
    motors: [MotorMost; MAX_ACTUATORS],
    /// The gate's newest changes, where a control cycle may begin anywhere between two setpoints.
    edges: Option<EdgeTimes>,
    uses: LimitUtilization,
}

impl Checker {
    /// Against those limits of `machine` that are in `scope`, and against `path`.
    pub(crate) fn new(machine: &Machine, path: PathLimits, scope: Scope) -> Self {
        let is_checked = usize::from(scope == Scope::Machine);
        let none = || vec![0.0; is_checked * machine.axes.len()];
        let no_motors = || vec![0.0; is_checked * machine.actuators.len()];
        Self {
            path,
            dark: path.rapid.max(path.speed),
            scope,
            source: machine.laser,
            before: None,
            joints_before: None,
            heating: [0.0; MAX_ACTUATORS],
            most: [Most::default(); 4],
            axes: [AxisMost::default(); MAX_AXES],
            motors: [MotorMost::default(); MAX_ACTUATORS],
            edges: EdgeTimes::new(machine.realtime.period, machine.drives.gate_latency),
            uses: LimitUtilization {
                velocity: none(),
                acceleration: none(),
                jerk: none(),
                current: no_motors(),
                voltage: no_motors(),
                heat: no_motors(),
                sizing: no_motors(),
                ..LimitUtilization::default()
            },
        }
    }

    /// Largest shares of all limits so far.
    pub(crate) fn utilization(&self) -> &LimitUtilization {
        &self.uses
    }

    /// Checks the next sample against the limits of axes, actuators and `area`.
    pub(crate) fn check(
        &mut self,
        setpoint: &Setpoint,
        (axes, actuators): (&[Axis], &[Actuator]),
        area: &WorkArea,
    ) -> Result<(), LimitViolation> {
        let time = setpoint.sequence as f64 * SETPOINT_TIME;
        light(setpoint, &self.source, time)?;
        if self.edges.as_mut().is_some_and(|edges| !edges.take(setpoint)) {
            return Err(LimitViolation::too_many_changes(setpoint));
        }
        self.path(setpoint, time)?;
        if self.scope == Scope::PathAlone {
            return Ok(());
        }
        for index in 0..3 {
            let value = setpoint.tool[index];
            let limit = value.clamp(area.lower[index], area.upper[index]);
            let quantity = Quantity::ToolPosition(index);
            within(value, limit, Named { time, axis: None, quantity, unit: "m" })?;
        }
        self.joints(setpoint, axes, time)?;
        self.motors(setpoint, actuators, time)
    }

    fn path(&mut self, setpoint: &Setpoint, time: f64) -> Result<(), LimitViolation> {
        let (path, uses) = (&self.path, &mut self.uses);
        let [dark, lit, acceleration, jerk] = &mut self.most;
        let named = |quantity, unit| Named { time, axis: None, quantity, unit };
        let (speed, most) = if setpoint.laser.is_lit() {
            ([path.speed, ALLOWANCE], lit)
        } else {
            ([self.dark, DARK_ALLOWANCE], dark)
        };
        let name = named(Quantity::ToolSpeed, "m/s");
        most.hold(setpoint.path_velocity, speed, &mut uses.path_speed, name)?;
        let limit = [path.acceleration, ALLOWANCE];
        let name = named(Quantity::ToolAcceleration, "m/s²");
        acceleration.hold(setpoint.path_acceleration, limit, &mut uses.path_acceleration, name)?;
        let limit = [path.jerk, ALLOWANCE];
        let name = named(Quantity::ToolJerk, "m/s³");
        jerk.hold(setpoint.path_jerk, limit, &mut uses.path_jerk, name)
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
            let name = axis.name.as_str();
            let named = |quantity, unit| Named { time, axis: Some(name), quantity, unit };
            let position = setpoint.position[index];
            let nearest = position.clamp(limits.position[0], limits.position[1]);
            let [place, speed, acceleration, jerk] = axis.unit.names();
            within(position, nearest, named(Quantity::JointPosition, place))?;
            if let Some((positions, velocities)) = &self.joints_before {
                let mean = (velocities[index] + setpoint.velocity[index]) / 2.0;
                let jump = (position - positions[index] - mean * SETPOINT_TIME).abs();
                // What supervision forgives, and what a change of acceleration in the cycle makes.
                let most = DISCONTINUITY * limits.following_error
                    + setpoint.acceleration[index].abs() * SETPOINT_TIME * SETPOINT_TIME;
                named(Quantity::JointJump, place).below(jump, most, 1.0)?;
            }
            let most = &mut self.axes[index];
            most.velocity.hold(
                setpoint.velocity[index].abs(),
                [axis.velocity_limit().plan, 1.0],
                &mut uses.velocity[index],
                named(Quantity::JointVelocity, speed),
            )?;
            most.acceleration.hold(
                setpoint.acceleration[index].abs(),
                [axis.acceleration_limit().plan, 1.0],
                &mut uses.acceleration[index],
                named(Quantity::JointAcceleration, acceleration),
            )?;
            most.jerk.hold(
                setpoint.jerk[index].abs(),
                [axis.jerk_limit().plan, 1.0],
                &mut uses.jerk[index],
                named(Quantity::JointJerk, jerk),
            )?;
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
        actuators: &[Actuator],
        time: f64,
    ) -> Result<(), LimitViolation> {
        let mut now = [MotorState::default(); MAX_ACTUATORS];
        for (index, actuator) in actuators.iter().enumerate() {
            let axis = actuator.axis;
            let angle = (setpoint.position[axis] + setpoint.lead[index]) / actuator.ratio;
            let before = self.before.as_ref().map(|motors| motors[index]);
            let speed = before.map_or(0.0, |before| (angle - before.angle) / SETPOINT_TIME);
            let effort = setpoint.effort[index];
            let torque = effort + actuator.friction.torque(speed);
            let sizing = sizing(actuator, effort, setpoint.acceleration[axis], speed);
            let name = actuator.name.as_str();
            let named = |quantity, unit| Named { time, axis: Some(name), quantity, unit };
            let (uses, most) = (&mut self.uses, &mut self.motors[index]);
            let motor = match &actuator.motor {
                Motor::Dc(motor) => motor,
                Motor::Stepper(motor) => {
                    let size = sizing / motor.pull_out_torque(standing(speed));
                    uses.sizing[index] = uses.sizing[index].max(size);
                    let (torque, most) = (torque.abs(), motor.torque_limit(speed));
                    let name = named(Quantity::MotorTorque, "N·m");
                    let share = name.below(torque, most, 1.0)?;
                    uses.current[index] = uses.current[index].max(share);
                    let (rate, most) = (speed.abs() * motor.pulses_per_radian(), motor.pulse_rate);
                    let share = named(Quantity::PulseRate, "1/s").below(rate, most, 1.0)?;
                    uses.voltage[index] = uses.voltage[index].max(share);
                    now[index].angle = angle;
                    continue;
                }
            };
            if sizing > most.sizing {
                most.sizing = sizing;
                uses.sizing[index] = sizing / (motor.current * motor.torque_constant);
            }
            let current = torque / motor.torque_constant;
            let earlier = before.map_or(current, |before| before.current);
            let voltage = motor.resistance * (current + earlier) / 2.0
                + motor.inductance * (current - earlier) / SETPOINT_TIME
                + motor.torque_constant * speed;
            let limit = [motor.current_limit().plan, 1.0];
            let name = named(Quantity::MotorCurrent, "A");
            most.current.hold(current.abs(), limit, &mut uses.current[index], name)?;
            let limit = [motor.voltage_limit().plan, 1.0];
            let name = named(Quantity::MotorVoltage, "V");
            most.voltage.hold(voltage.abs(), limit, &mut uses.voltage[index], name)?;
            if let Some(limit) = motor.heating_limit() {
                let heating = &mut self.heating[index];
                *heating = DcMotor::heated(*heating, current, SETPOINT_TIME, DcMotor::HEATING_TIME);
                let heating = *heating;
                // The root grows with what it is taken of, so that it is needed for the largest only.
                if heating > most.heating.0 || heating.is_nan() {
                    let name = named(Quantity::HeatingCurrent, "A");
                    let share = name.below(heating.sqrt(), limit.plan, 1.0)?;
                    uses.heat[index] = uses.heat[index].max(share);
                    most.heating.0 = heating;
                }
            }
            now[index] = MotorState { angle, current };
        }
        self.before = Some(now);
        Ok(())
    }
}

/// The torque that the motor of `axis` needs at `speed` [rad/s] by the efficiencies of its gear, which
/// data sheets give in place of friction [N·m]: its rotor's part of `effort` [N·m], taken from the
/// joint's acceleration, reaches no gear.
fn sizing(actuator: &Actuator, effort: f64, acceleration: f64, speed: f64) -> f64 {
    let rotor = actuator.motor.rotor_inertia() * acceleration / actuator.ratio;
    (rotor + actuator.efficiency.torque(effort - rotor, standing(speed))).abs()
}

/// `speed`, or 0 of a motor that stands: whatever stands is taken to be starting.
fn standing(speed: f64) -> f64 {
    if Friction::is_standing(speed) { 0.0 } else { speed }
}

/// When the gate's newest changes are, [`MAX_EDGES`] of them, where a control cycle may begin anywhere between two
/// setpoints: it is longer than a setpoint, or the gate is told a part of a cycle later. Wherever such a cycle begins, it
/// has room for no more.
#[derive(Debug, Clone, Copy)]
struct EdgeTimes {
    /// How long a control cycle is [ns].
    period: i64,
    /// Times [ns] in a ring, and where the oldest is.
    times: [i64; MAX_EDGES],
    oldest: usize,
    /// Gate and power at the end of the newest setpoint.
    last: (u32, f64),
}

impl EdgeTimes {
    /// `None` where each cycle is a part of a setpoint, whose own edges are counted.
    fn new(period: Period, gate_latency: Nanoseconds) -> Option<Self> {
        let (before, length) = (i64::MIN / 2, period.time().0);
        let is_anywhere = period > Period::OF_SETPOINTS || gate_latency.0 % length != 0;
        is_anywhere.then_some(Self {
            period: length,
            times: [before; MAX_EDGES],
            oldest: 0,
            last: (0, 0.0),
        })
    }

    /// Takes the changes of the next setpoint, the one at its beginning included; whether any control cycle can hold
    /// them and those before.
    fn take(&mut self, setpoint: &Setpoint) -> bool {
        let start = Period::OF_SETPOINTS.of(setpoint.sequence).0;
        let Setpoint { laser, .. } = setpoint;
        let begins = (self.last != (laser.gate, laser.power)).then_some(start);
        self.last = laser.last();
        let edges = laser.edges().iter().map(|edge| start + i64::from(edge.offset));
        begins.into_iter().chain(edges).all(|time| {
            let Some(oldest) = self.times.get_mut(self.oldest) else { return false };
            let apart = time - core::mem::replace(oldest, time);
            self.oldest = (self.oldest + 1) % MAX_EDGES;
            apart >= self.period
        })
    }
}

/// Whether drives and the `source` can do what is asked of the laser.
#[inline]
fn light(setpoint: &Setpoint, source: &LaserSource, time: f64) -> Result<(), LimitViolation> {
    let laser = &setpoint.laser;
    if !source.pulses_at(laser.frequency) {
        let [least, most] = source.frequency.unwrap_or_default();
        let quantity = Quantity::LaserFrequency;
        let named = Named { time, axis: None, quantity, unit: "pulses/s" };
        let limit = if laser.frequency < least { least } else { most };
        return Err(named.broken(laser.frequency, limit));
    }
    if laser.is_valid(SETPOINT_PERIOD) {
        return Ok(());
    }
    let mut powers = laser.edges().iter().map(|edge| edge.power).chain([laser.power]);
    if let Some(power) = powers.find(|power| !(0.0..=1.0).contains(power)) {
        let quantity = Quantity::LaserPower;
        let named = Named { time, axis: None, quantity, unit: "of full scale" };
        return Err(named.broken(power, 1.0));
    }
    Err(LimitViolation::too_many_changes(setpoint))
}

#[inline]
fn within(value: f64, limit: f64, named: Named<'_>) -> Result<(), LimitViolation> {
    if (value - limit).abs() <= ROUNDING { Ok(()) } else { Err(named.broken(value, limit)) }
}

impl Named<'_> {
    /// The share of `limit` that `value` uses, at most `allowance`.
    #[inline]
    fn below(&self, value: f64, limit: f64, allowance: f64) -> Result<f64, LimitViolation> {
        let share = value / limit;
        // Put this way a value that is no number breaks the limit.
        if share <= allowance { Ok(share) } else { Err(self.broken(value, limit)) }
    }

    #[cold]
    fn broken(&self, value: f64, limit: f64) -> LimitViolation {
        let Self { time, axis, quantity, unit } = *self;
        LimitViolation { time, axis: axis.map(str::to_owned), quantity, value, limit, unit }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use messages::GateEdge;

    use super::*;

    #[test]
    fn light_that_drives_refuse_is_refused_before() {
        let machine = Machine::builtin();
        let source = LaserSource { frequency: Some([20e3, 80e3]), ..machine.laser };
        let check = |change: &dyn Fn(&mut Setpoint)| {
            let mut setpoint = Setpoint::default();
            change(&mut setpoint);
            light(&setpoint, &source, 0.0).map_err(|violation| violation.quantity)
        };
        assert_eq!(check(&|_| ()), Ok(()));
        assert_eq!(check(&|it| it.laser.power = 1.0), Ok(()));
        let beyond = 1.0 + f64::EPSILON;
        for power in [beyond, -1e-9, f64::NAN] {
            assert_eq!(check(&|it| it.laser.power = power), Err(Quantity::LaserPower));
            let edge = GateEdge { offset: 1, gate: 1, power };
            assert_eq!(check(&|it| assert!(it.laser.push(edge))), Err(Quantity::LaserPower));
        }
        for frequency in [0.0, 20e3, 80e3] {
            assert_eq!(check(&|it| it.laser.frequency = frequency), Ok(()));
        }
        for frequency in [19e3, 81e3, -20e3, f64::NAN] {
            let found = check(&|it| it.laser.frequency = frequency);
            assert_eq!(found, Err(Quantity::LaserFrequency), "{frequency}");
        }
        let mut setpoint = Setpoint { tool: machine.home, ..Setpoint::default() };
        setpoint.laser.power = beyond;
        let mut checker = Checker::new(&machine, machine.path, Scope::PathAlone);
        let checked = checker.check(&setpoint, (&machine.axes, &machine.actuators), &machine.area);
        assert_eq!(checked.unwrap_err().quantity, Quantity::LaserPower);
    }
}
