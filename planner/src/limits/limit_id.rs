//! Which limit a row of the time law is.

use machine::Machine;
use messages::plan::Binding;

use crate::verify::checker::Quantity;

/// Axes come after the limits of the tool, this many numbers apart.
const PER_AXIS: u16 = 16;

/// Which limit of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum JointLimit {
    Velocity,
    Acceleration,
    Jerk,
    /// Current of a DC motor, or torque of a stepper.
    Torque,
    /// Voltage of a DC motor, or pulse rate of a stepper.
    Voltage,
}

impl JointLimit {
    /// How many there are.
    pub(crate) const COUNT: usize = Self::ALL.len();

    /// By number.
    const ALL: [Self; 5] =
        [Self::Velocity, Self::Acceleration, Self::Jerk, Self::Torque, Self::Voltage];
}

/// A limit by number, as the time law carries it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct LimitId(pub(crate) u16);

impl LimitId {
    /// The speed that the job asks for.
    pub(crate) const FEED: Self = Self(0);
    /// The machine's largest speed while marking.
    pub(crate) const MARKING_SPEED: Self = Self(1);
    /// The machine's largest speed of a free move.
    pub(crate) const RAPID: Self = Self(2);
    /// Acceleration of the tool.
    pub(crate) const TOOL_ACCELERATION: Self = Self(3);
    /// Jerk of the tool.
    pub(crate) const TOOL_JERK: Self = Self(4);

    /// A turn, a run-in or a run-out in the dark, within acceleration and jerk of the tool and
    /// whatever the axes leave of them.
    pub(crate) const DARK_TURN: Self = Self(5);

    fn of_axis(axis: usize, limit: JointLimit) -> Self {
        Self((axis as u16 + 1) * PER_AXIS + limit as u16)
    }

    /// The number of the axis and which of its limits it is; `None` for one of the tool.
    pub(crate) fn joint_limit(self) -> Option<(usize, JointLimit)> {
        let axis = (self.0 / PER_AXIS).checked_sub(1)?;
        let limit = JointLimit::ALL.get(usize::from(self.0 % PER_AXIS))?;
        Some((usize::from(axis), *limit))
    }

    /// Speed of a joint.
    pub(crate) fn joint_velocity(axis: usize) -> Self {
        Self::of_axis(axis, JointLimit::Velocity)
    }

    /// Acceleration of a joint.
    pub(crate) fn joint_acceleration(axis: usize) -> Self {
        Self::of_axis(axis, JointLimit::Acceleration)
    }

    /// Jerk of a joint.
    pub(crate) fn joint_jerk(axis: usize) -> Self {
        Self::of_axis(axis, JointLimit::Jerk)
    }

    /// Current of a DC motor, or torque of a stepper.
    pub(crate) fn torque(axis: usize) -> Self {
        Self::of_axis(axis, JointLimit::Torque)
    }

    /// Voltage of a DC motor, or pulse rate of a stepper.
    pub(crate) fn voltage(axis: usize) -> Self {
        Self::of_axis(axis, JointLimit::Voltage)
    }

    /// What a person reads, with the name of the axis.
    pub(crate) fn describe(self, machine: &Machine) -> (String, Option<String>) {
        let Some((axis, limit)) = self.joint_limit() else {
            let name = match self {
                Self::FEED => Binding::SPEED_ASKED_FOR,
                Self::MARKING_SPEED => Binding::MARKING_SPEED,
                Self::RAPID => "largest rapid speed",
                Self::DARK_TURN => "turns and runs in the dark",
                Self::TOOL_ACCELERATION => Quantity::ToolAcceleration.name(),
                _ => Quantity::ToolJerk.name(),
            };
            return (name.to_owned(), None);
        };
        let axis = machine.axes.get(axis);
        let motors = axis.map(|axis| axis.driven_by(&machine.actuators)).unwrap_or_default();
        let is_stepper = motors.iter().any(|actuator| actuator.motor.stepper().is_some());
        let quantity = match (limit, is_stepper) {
            (JointLimit::Velocity, _) => Quantity::JointVelocity,
            (JointLimit::Acceleration, _) => Quantity::JointAcceleration,
            (JointLimit::Jerk, _) => Quantity::JointJerk,
            (JointLimit::Torque, false) => Quantity::MotorCurrent,
            (JointLimit::Torque, true) => Quantity::MotorTorque,
            (JointLimit::Voltage, false) => Quantity::MotorVoltage,
            (JointLimit::Voltage, true) => Quantity::PulseRate,
        };
        (quantity.name().to_owned(), axis.map(|axis| axis.name.clone()))
    }
}

/// How long each limit ruled.
#[derive(Debug, Clone, Default)]
pub(crate) struct BindingTimes {
    /// By limit: the time [s], and the longest single stretch with its line and place.
    found: std::collections::BTreeMap<LimitId, Share>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Share {
    time: f64,
    worst: f64,
    line: u64,
    position: [f64; 3],
}

impl BindingTimes {
    /// Notes that `source` ruled for `time` [s] near `position` [m] in `line`.
    pub(crate) fn add(&mut self, source: LimitId, time: f64, line: u64, position: [f64; 3]) {
        let share = self.found.entry(source).or_default();
        share.time += time;
        if time > share.worst {
            (share.worst, share.line, share.position) = (time, line, position);
        }
    }

    /// Adds what others found.
    pub(crate) fn merge(&mut self, other: &Self) {
        for (source, share) in &other.found {
            let mine = self.found.entry(*source).or_default();
            let time = mine.time + share.time;
            if share.worst > mine.worst {
                *mine = *share;
            }
            mine.time = time;
        }
    }

    /// The shares of all time, the largest first.
    pub(crate) fn report(&self, machine: &Machine) -> Vec<Binding> {
        let all: f64 = self.found.values().map(|share| share.time).sum();
        let mut report: Vec<Binding> = self
            .found
            .iter()
            .map(|(source, share)| {
                let (limit, axis) = source.describe(machine);
                Binding {
                    limit,
                    axis,
                    share: share.time / all,
                    time: share.time,
                    line: share.line,
                    position: share.position,
                }
            })
            .collect();
        report.sort_by(|one, other| other.time.total_cmp(&one.time));
        report
    }
}
