//! What a job asks at each joint of what drives it, whatever that is: of several actuators of a joint
//! each bears its share.

use super::{MachineFile, SizeError};
use core::f64::consts::TAU;
use machine::document::Document;
use machine::file::bounds::BOUNDS;
use machine::file::tables::{AxisTable, MachineTable};
use machine::kinematics::Joints;
use machine::transmission::gear::Efficiency;
use machine::{
    Actuator, DcMotor, Friction, JointUnit, Machine, Mechanism, MechanismVisitor, Motor,
};
use messages::time::SETPOINT_TIME;
use planner::{Job, Plan};

/// What a joint does at one instant, on the motor's side of its spring.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NeedPoint {
    /// Stream time [s].
    pub time: f64,
    /// Whether the laser is lit in the cycle that begins then.
    pub is_lit: bool,
    /// The stroke that it marks, from 1; 0 for none.
    pub stroke: u64,
    /// [m/s or rad/s].
    pub speed: f64,
    /// [m/s² or rad/s²].
    pub acceleration: f64,
    /// What the load takes, without losses and without any rotor [N or N·m].
    pub effort: f64,
}

/// What a job asks of one actuator at its joint, and what stands between the joint and its motor.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisNeed {
    /// Name of the actuator: that of its axis where it is the only one.
    pub name: String,
    /// Name of its axis.
    pub axis: String,
    /// What the joint is measured in.
    pub unit: JointUnit,
    /// What it does, one point a cycle.
    pub points: Vec<NeedPoint>,
    /// Joint travel per radian of the gear's output [m/rad or rad/rad].
    pub travel: f64,
    /// Inertia that turns stiffly with the gear's output, such as a screw [kg·m²].
    pub stiff_inertia: f64,
    /// Its share of the load that the joint moves at home, the other joints at rest [kg or kg·m²].
    pub load: f64,
    /// Pitch diameter of the pulley on the gear's output; `None` where a coupling stands there [m].
    pub pulley: Option<f64>,
    /// The ratio of the gear that the machine has.
    pub gear: f64,
    /// The actuator as the machine has it, its ratio without the sign: which way it turns takes nothing.
    pub actuator: Actuator,
    /// Its motor's own inertia [kg·m²].
    pub rotor_inertia: f64,
    /// The path's tolerance at the joint, by how far the joint moves the tool at home [m or rad].
    pub tolerance: f64,
    /// The largest speed that the machine file sets for the joint [m/s or rad/s].
    pub velocity: Option<f64>,
}

impl AxisNeed {
    /// What gear and screw or belt lose, and friction at a shaft that turns the joint by `ratio`
    /// [joint unit/rad]: the joint's friction is the same, whatever drives it.
    pub fn friction_at(&self, ratio: f64) -> Friction {
        let share = ratio / self.actuator.ratio;
        Friction {
            coulomb: self.actuator.friction.coulomb * share,
            viscous: self.actuator.friction.viscous * share * share,
        }
    }

    /// The efficiency behind a gear that passes on `gear`: what the machine file says of gear and screw
    /// together, but no more than the gear alone.
    pub fn efficiency_with(&self, gear: Option<Efficiency>) -> Efficiency {
        let Efficiency { dynamic, at_start } = self.actuator.efficiency;
        gear.map_or(self.actuator.efficiency, |gear| Efficiency {
            dynamic: dynamic.min(gear.dynamic),
            at_start: at_start.min(gear.at_start),
        })
    }
}

/// The tables of a machine file.
///
/// # Errors
/// A file that is not sound.
pub fn table(file: MachineFile<'_>) -> Result<MachineTable, SizeError> {
    let document = Document::parse(file.name, file.text)?;
    let document = document.override_with(file.overrides, "machine.")?;
    Ok(document.decode_within::<MachineTable>(BOUNDS)?.0)
}

/// What `job` asks of each joint of `machine`, whose file has `table`, and the plan without limits of the
/// motors from which that follows.
///
/// # Errors
/// A job that no motor could do.
pub fn needs(
    machine: &Machine,
    table: &MachineTable,
    job: &Job,
) -> Result<(Plan, Vec<AxisNeed>), SizeError> {
    let plan = planner::plan(&unbounded(machine, table), job)?;
    let mut needs = axes(machine, table);
    let setpoints: Vec<_> = plan.setpoints(1).collect();
    for (index, need) in needs.iter_mut().enumerate() {
        let Actuator { axis, ratio, .. } = machine.actuators[index];
        let motor_side = |at: usize| setpoints[at].position[axis] + setpoints[at].lead[index];
        let last = setpoints.len().saturating_sub(1);
        need.points = (0..setpoints.len())
            .map(|at| {
                let setpoint = &setpoints[at];
                let (before, after) = (at.saturating_sub(1), (at + 1).min(last));
                let lead = |at: usize| setpoints[at].lead[index];
                let bending = lead(after) - 2.0 * lead(at) + lead(before);
                NeedPoint {
                    time: setpoint.sequence as f64 * SETPOINT_TIME,
                    is_lit: setpoint.laser.is_lit(),
                    stroke: setpoint.stroke,
                    speed: (motor_side(at) - motor_side(before)) / SETPOINT_TIME,
                    acceleration: setpoint.acceleration[axis]
                        + bending / (SETPOINT_TIME * SETPOINT_TIME),
                    effort: setpoint.effort[index] / ratio,
                }
            })
            .collect();
    }
    Ok((plan, needs))
}

/// The actuators of `machine`, whose file has `table`, before anything is asked of them.
pub fn axes(machine: &Machine, table: &MachineTable) -> Vec<AxisNeed> {
    let need = |actuator: &Actuator| {
        let axis = axis_table(table, &machine.axes.get(actuator.axis)?.name)?;
        let entries = axis.actuator.iter().flat_map(|actuators| &actuators.entries);
        let name = actuator.name.split_once('.').map(|(_, name)| name);
        let own = entries.into_iter().find(|(found, _)| Some(found.value.as_str()) == name);
        let axis = own.map_or_else(|| axis.clone(), |(_, own)| axis.with_own(own));
        Some(axis_need(machine, table, actuator, &axis))
    };
    machine.actuators.iter().filter_map(need).collect()
}

fn axis_table<'a>(table: &'a MachineTable, name: &str) -> Option<&'a AxisTable> {
    table.axis.entries.iter().find(|(key, _)| key.value == name).map(|(_, axis)| axis)
}

fn axis_need(
    machine: &Machine,
    table: &MachineTable,
    actuator: &Actuator,
    axis_table: &AxisTable,
) -> AxisNeed {
    let axis = &machine.axes[actuator.axis];
    let actuator = Actuator { ratio: actuator.ratio.abs(), ..actuator.clone() };
    let Actuator { ratio, ref motor, .. } = actuator;
    let gear = axis_table.gear.value;
    let own = match (&axis_table.motor.dc, &axis_table.motor.stepper) {
        (Some(dc), _) => dc.rotor_inertia.value,
        (_, Some(stepper)) => stepper.rotor_inertia.value,
        _ => motor.rotor_inertia(),
    };
    let corexy = table.mechanism.corexy.as_ref().map(|corexy| corexy.pulley_radius.value);
    let belt = axis_table.transmission.belt.as_ref().map(|belt| belt.pulley_radius.value);
    AxisNeed {
        name: actuator.name.clone(),
        axis: axis.name.clone(),
        unit: axis.unit,
        points: Vec::new(),
        travel: ratio * gear,
        stiff_inertia: (motor.rotor_inertia() - own).max(0.0) * gear * gear,
        load: (actuator.gains.inertia - motor.rotor_inertia()) / (ratio * ratio),
        pulley: corexy.or(belt).map(|radius| 2.0 * radius),
        gear,
        actuator: actuator.clone(),
        rotor_inertia: own,
        tolerance: machine.path.tolerance / lever(machine, actuator.axis),
        velocity: axis_table.limits.velocity.map(|velocity| velocity.value),
    }
}

/// How far the joint of this number moves the tool at home [m per joint unit]; 1 where it does not.
fn lever(machine: &Machine, index: usize) -> f64 {
    struct Levers<'a>(&'a [f64]);
    impl MechanismVisitor for Levers<'_> {
        type Output = Vec<f64>;
        fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Vec<f64> {
            let home = Joints::<N>::from_fn(|row, _| self.0.get(row).copied().unwrap_or(0.0));
            let Ok(chain) = mechanism.solve(&home, mechanism.branch(), None) else {
                return Vec::new();
            };
            let jacobian = mechanism.jacobian(&chain);
            jacobian.column_iter().map(|column| column.fixed_rows::<3>(0).norm()).collect()
        }
    }
    /// A joint that moves the tool by less only turns it [m per joint unit].
    const LEAST: f64 = 1e-6;
    let levers = machine.mechanism.visit(Levers(&machine.home_joints));
    levers.get(index).copied().filter(|lever| *lever > LEAST).unwrap_or(1.0)
}

/// `machine` with motors that give anything and weigh nothing, so that only path and joints limit it.
fn unbounded(machine: &Machine, table: &MachineTable) -> Machine {
    let mut unbounded = machine.clone();
    for actuator in &mut unbounded.actuators {
        actuator.motor = Motor::Dc(DcMotor {
            resistance: 1e-6,
            inductance: 1e-9,
            torque_constant: 1.0,
            rotor_inertia: 1e-15,
            voltage: 1e9,
            current: 1e9,
            continuous_current: None,
        });
        let axis = &mut unbounded.axes[actuator.axis];
        axis.backlash = 0.0;
        let limits = axis_table(table, &axis.name).map(|table| &table.limits);
        if limits.is_none_or(|limits| limits.velocity.is_none()) {
            axis.limits.velocity = FASTEST * actuator.ratio.abs().max(1.0);
        }
    }
    unbounded
}

/// A speed that no joint is asked for [m/s or rad/s].
const FASTEST: f64 = 1e4 * TAU;
