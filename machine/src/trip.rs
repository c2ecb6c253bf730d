//! How far a plan may go, and where supervision stops the machine, side by side.
//!
//! A plan at its limit must never trip by rounding, by the resolution of a measurement, or by what the
//! loops add to the feedforward. So each limit that both check has two values here: the planner's
//! checker asks for [`Limit::plan`], the controller's supervision for [`Limit::trip`]. No other part
//! keeps a margin of its own.

use crate::actuator::Actuator;
use crate::axis::Axis;
use crate::motor::{DcMotor, Motor, StepperMotor};

/// Supervision tolerates planned values up to 0.1 % beyond a limit. Planner and controller compute the same
/// numbers, so only rounding lies between them.
const PLANNED_EXCESS: f64 = 1.001;

/// What of its continuous current a plan may warm a winding with. The measured current also has what
/// the loops add, which has no mean: its mean square adds to that of the plan. A hundredth less of the
/// plan leaves room for loops that add 14 % of it, many times what they do.
const HEATING_SHARE: f64 = 0.99;

/// What of a power stage's current and voltage a plan may use. Nothing trips at the end of either, but
/// loops without room cannot correct anything there: a hundredth is what they take on a sound machine.
const POWER_SHARE: f64 = 0.99;

/// What of a stepper's pull-out torque a plan may use.
const TORQUE_SHARE: f64 = 0.97;

/// Rounding of a planned position at a soft limit [m or rad].
const PLANNED_ROUNDING: f64 = 1e-9;

/// The same in the setpoint that comes in: ten times as much, so that it is never the first to say so.
const RECEIVED_ROUNDING: f64 = 1e-8;

/// One limit, for a plan and for supervision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// The most that a plan may ask for.
    pub plan: f64,
    /// What stops the machine where it is exceeded.
    pub trip: f64,
}

impl Limit {
    /// A limit of what is planned: the machine stops where more than rounding is beyond it.
    pub fn planned(limit: f64) -> Self {
        Self { plan: limit, trip: limit * PLANNED_EXCESS }
    }

    /// Rounding allowed at a soft limit [m or rad].
    pub const ROUNDING: Self = Self { plan: PLANNED_ROUNDING, trip: RECEIVED_ROUNDING };
}

impl DcMotor {
    /// Current of the power stage [A], which cuts it at the trip.
    pub fn current_limit(&self) -> Limit {
        Limit { plan: POWER_SHARE * self.current, trip: self.current }
    }

    /// Voltage of the supply [V], which ends at the trip.
    pub fn voltage_limit(&self) -> Limit {
        Limit { plan: POWER_SHARE * self.voltage, trip: self.voltage }
    }

    /// Root mean square of the current that warms the winding [A], averaged over
    /// [`Self::HEATING_TIME`]; `None` where the file does not say what it bears for ever.
    pub fn heating_limit(&self) -> Option<Limit> {
        let continuous = self.continuous_current?;
        Some(Limit { plan: HEATING_SHARE * continuous, trip: continuous })
    }
}

impl StepperMotor {
    /// Torque that a plan may ask for at `speed` [rad/s], in N·m: at the pull-out torque itself nothing
    /// holds the rotor where it is any more; here a quarter of its stiffness at rest still does.
    pub fn torque_limit(&self, speed: f64) -> f64 {
        TORQUE_SHARE * self.pull_out_torque(speed)
    }
}

impl Axis {
    /// Speed of the joint [m/s or rad/s].
    pub fn velocity_limit(&self) -> Limit {
        Limit::planned(self.limits.velocity)
    }

    /// Acceleration of the joint [m/s² or rad/s²].
    pub fn acceleration_limit(&self) -> Limit {
        Limit::planned(self.limits.acceleration)
    }

    /// Jerk of the joint [m/s³ or rad/s³].
    pub fn jerk_limit(&self) -> Limit {
        Limit::planned(self.limits.jerk)
    }
}

impl Actuator {
    /// Torque of the motor at `speed` of its shaft [rad/s], without what friction takes, which may be
    /// against the motion or help to brake it [N·m].
    pub fn effort_limit(&self, speed: f64) -> Limit {
        let friction = self.friction.coulomb + self.friction.viscous * speed.abs();
        Limit::planned(
            friction
                + match &self.motor {
                    Motor::Dc(motor) => motor.largest_torque(),
                    Motor::Stepper(motor) => motor.holding_torque,
                },
        )
    }
}

/// What supervision compares with the largest following error of an axis, as shares of it.
pub mod following {
    /// The largest difference between a setpoint and the one before it plus the mean of both speeds times the
    /// cycle. Planned motion has jerk·T³/12, 40 nm at 500 m/s³.
    pub const DISCONTINUITY: f64 = 0.01;

    /// How much the lead may change between two setpoints.
    pub const LEAD_STEP: f64 = 0.25;

    /// How far an axis may move in a cycle at a planned rest.
    pub const CREEP: f64 = 0.001;
}

#[cfg(test)]
mod tests {
    use super::Limit;
    use crate::machine::Machine;

    #[test]
    fn every_plan_stays_below_what_trips() {
        let mut machine = Machine::builtin();
        for axis in &mut machine.axes {
            axis.limits.acceleration = 10.0;
            axis.limits.jerk = 500.0;
            let limits = [axis.velocity_limit(), axis.acceleration_limit(), axis.jerk_limit()];
            for limit in limits {
                assert!(limit.trip >= 1.000_999 * limit.plan, "{limit:?}");
            }
        }
        for actuator in &mut machine.actuators {
            if let Some(motor) = actuator.motor.dc_mut() {
                motor.continuous_current = Some(3.0);
            }
            let dc = actuator.motor.dc();
            let heating = dc.and_then(|motor| motor.heating_limit());
            let power = dc.map(|motor| [motor.current_limit(), motor.voltage_limit()]);
            let limits =
                [actuator.effort_limit(100.0), actuator.effort_limit(-100.0), Limit::ROUNDING];
            for limit in limits.into_iter().chain(heating).chain(power.into_iter().flatten()) {
                assert!(limit.trip >= 1.000_999 * limit.plan, "{limit:?}");
            }
        }
    }
}
