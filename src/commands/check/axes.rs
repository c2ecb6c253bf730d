//! The axes of a machine and what their motors can do.

use machine::transmission::gear::LoadClass;
use machine::{Actuator, Axis, JointUnit, Machine};
use serde::Serialize;

/// One axis and what its motor can do; of an axis with several actuators, one of them.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct AxisReport {
    /// Its name, or that of the actuator where the axis has several.
    pub name: String,
    /// What its joint is measured in.
    pub unit: Unit,
    /// Soft limits [m or rad]; null where the joint may turn without end.
    pub position: [Option<f64>; 2],
    /// Speed limit [m/s or rad/s].
    pub velocity: f64,
    /// Speed at which the supply is used up without load, or a stepper's at its largest pulse rate
    /// [m/s or rad/s].
    pub no_load_velocity: f64,
    /// Torque at standstill with the supply or the current limit used up [N·m at the motor].
    pub stall_torque: f64,
    /// The same at the joint, after what gear and screw lose from standstill [N or N·m].
    pub stall_effort: f64,
    /// Inertia of the load beside the rotor's, seen at the shaft; null for a planar motor, which has
    /// no rotor.
    pub inertia_ratio: Option<f64>,
    /// What a gear calls such a load.
    pub load_class: Option<LoadClassName>,
    /// How far the joint moves freely [m or rad].
    pub backlash: f64,
    /// Angle of one encoder count or pulse, seen at the joint [m or rad].
    pub resolution: f64,
}

/// How hard a gear is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LoadClassName {
    /// The load has up to 0.3 times the rotor's inertia.
    Uniform,
    /// Up to 3 times.
    Medium,
    /// Up to 10 times.
    Heavy,
    /// More.
    Extreme,
}

impl LoadClassName {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Medium => "medium",
            Self::Heavy => "heavy",
            Self::Extreme => "extreme",
        }
    }
}

impl From<LoadClass> for LoadClassName {
    fn from(class: LoadClass) -> Self {
        match class {
            LoadClass::Uniform => Self::Uniform,
            LoadClass::Medium => Self::Medium,
            LoadClass::Heavy => Self::Heavy,
            LoadClass::Extreme => Self::Extreme,
        }
    }
}

/// The unit of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, schemars::JsonSchema)]
pub enum Unit {
    /// It moves along a line.
    #[serde(rename = "m")]
    Metre,
    /// It turns.
    #[serde(rename = "rad")]
    Radian,
}

impl From<JointUnit> for Unit {
    fn from(unit: JointUnit) -> Self {
        match unit {
            JointUnit::Length => Self::Metre,
            JointUnit::Angle => Self::Radian,
        }
    }
}

/// The actuators of `machine` with their axes, in order.
pub fn axes(machine: &Machine) -> Vec<AxisReport> {
    machine.drives().map(report).collect()
}

fn report((actuator, axis): (&Actuator, &Axis)) -> AxisReport {
    let motor = &actuator.motor;
    let has_rotor = motor.stepper().is_none_or(|stepper| !stepper.is_planar());
    let inertia_ratio = has_rotor.then(|| actuator.gains.inertia / motor.rotor_inertia() - 1.0);
    let lost = actuator.efficiency.dynamic * actuator.efficiency.at_start;
    AxisReport {
        name: actuator.name.clone(),
        unit: axis.unit.into(),
        position: axis.limits.position.map(|limit| limit.is_finite().then_some(limit)),
        velocity: axis.limits.velocity,
        no_load_velocity: motor.largest_speed() * actuator.ratio.abs(),
        stall_torque: motor.stall_torque(),
        stall_effort: actuator.effort(motor.stall_torque()) * lost,
        inertia_ratio,
        load_class: inertia_ratio.map(|ratio| LoadClass::of(ratio).into()),
        backlash: axis.backlash,
        resolution: actuator.count(),
    }
}
