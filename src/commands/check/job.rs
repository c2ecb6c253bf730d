//! What a job asks of a machine: its plan, its margins to singularities, and the use of its motors.

use machine::{Machine, Motor};
use planner::PlanFacts;
use planner::plan::LimitUtilization;
use planner::verify::margins::LeastMargin;
use serde::Serialize;

/// What a job comes to on a machine.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct JobReport {
    /// The plan.
    #[serde(flatten)]
    pub facts: PlanFacts,
    /// Every margin of the mechanism where it is least over the job; empty where it has none.
    pub margins: Vec<LeastMargin>,
    /// How much of each motor the job uses, in the order of the axes.
    pub motors: Vec<MotorUse>,
}

/// The largest share of what an axis and its motor can do; 1 is all.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct MotorUse {
    /// The axis.
    pub axis: String,
    /// Joint speed against its limit.
    pub speed: f64,
    /// Torque: current against the power stage's limit, or against a stepper's pull-out torque at
    /// its speed.
    pub torque: f64,
    /// Torque as the efficiencies of gear and screw have it in place of friction, at start the
    /// static one too, against the same limit.
    pub sizing: f64,
    /// Voltage against the supply; null for steppers.
    pub voltage: Option<f64>,
    /// Root mean square of the current against what the winding bears for ever; null for steppers
    /// and where the machine file does not say that.
    pub heat: Option<f64>,
    /// Pulse rate against the driver's largest; null for DC motors.
    pub pulse_rate: Option<f64>,
}

impl JobReport {
    /// Of a job that was planned.
    pub fn new(machine: &Machine, facts: PlanFacts, margins: Vec<LeastMargin>) -> Self {
        Self { margins, motors: motors(machine, &facts.uses), facts }
    }
}

/// The checker's uses by actuator; for a stepper it keeps pull-out torque and pulse rate where a DC
/// motor has current and voltage.
fn motors(machine: &Machine, uses: &LimitUtilization) -> Vec<MotorUse> {
    let at = |list: &[f64], index: usize| list.get(index).copied().unwrap_or_default();
    let motor = |(index, actuator): (usize, &machine::Actuator)| {
        let second = at(&uses.voltage, index);
        let (voltage, heat, pulse_rate) = match &actuator.motor {
            Motor::Dc(motor) => {
                let heat = motor.continuous_current.map(|_| at(&uses.heat, index));
                (Some(second), heat, None)
            }
            Motor::Stepper(_) => (None, None, Some(second)),
        };
        MotorUse {
            axis: actuator.name.clone(),
            speed: at(&uses.velocity, actuator.axis),
            torque: at(&uses.current, index),
            sizing: at(&uses.sizing, index),
            voltage,
            heat,
            pulse_rate,
        }
    };
    machine.actuators.iter().enumerate().map(motor).collect()
}
