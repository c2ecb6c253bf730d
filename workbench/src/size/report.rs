//! What `graver size` says.

use super::candidate::Candidate;
use super::checks::{self, Use};
use super::choose::Judged;
use super::need::AxisNeed;
use super::{Confirmation, Options, belt, screw};
use crate::catalogue::{Catalogue, Screw};
use crate::operating::{AxisCourse, Demand};
use machine::transmission::gear::LoadClass;
use machine::{Machine, Motor};
use messages::time::SETPOINT_TIME;
use planner::Plan;
use schemars::JsonSchema;
use serde::Serialize;

/// What a job needs of each motor, and what of a catalogue does it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SizeReport {
    /// The job.
    pub job: String,
    /// The machine.
    pub machine: String,
    /// By what every need was multiplied.
    pub margin: f64,
    /// Temperature of the air [°C].
    pub ambient: f64,
    /// The axes.
    pub axes: Vec<AxisSize>,
    /// What the motors give back to their supply.
    pub supply: SupplySize,
    /// What became of planning and simulating with what was chosen; null where an axis has nothing.
    pub confirmation: Option<Confirmation>,
    /// Where the machine file with the motors was written.
    pub written: Option<String>,
    /// The page of the pictures that were drawn; null where none was asked for.
    pub pictures: Option<String>,
}

/// What an axis needs, has and gets.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct AxisSize {
    /// The axis.
    pub axis: String,
    /// What its joint is measured in.
    pub unit: &'static str,
    /// What the job asks of it, with the motor and gear that it has.
    pub need: NeedSize,
    /// What its belt needs; null where the machine has none on this axis.
    pub belt: Option<BeltSize>,
    /// What its screw is like; null where the catalogue says nothing of it.
    pub screw: Option<ScrewSize>,
    /// What it has.
    pub now: Drive,
    /// Whether a motor was looked for.
    pub is_asked: bool,
    /// The kind of its motor, which can only be replaced by one of the same.
    pub kind: &'static str,
    /// Motors of that kind in the catalogue.
    pub candidates: usize,
    /// The smallest motor with the gear that do it; null where none does, or none was asked for.
    pub chosen: Option<Drive>,
    /// Of the motors that do not do it with any gear, those that come nearest.
    pub rejected: Vec<Rejected>,
    /// What it has, and what that does for the job.
    #[serde(skip)]
    pub present: Judged,
    /// The chosen pair, for what is done with it.
    #[serde(skip)]
    pub judged: Option<Judged>,
}

/// The preload of a belt, after source 003 eq. 4.11 to 4.13.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct BeltSize {
    /// Largest force that it passes on [N].
    pub force: f64,
    /// Preload of both strands together [N].
    pub preload: f64,
    /// Force in the tight strand [N].
    pub tight: f64,
    /// Force in the slack strand [N].
    pub slack: f64,
}

impl BeltSize {
    /// Of a belt that passes on what the joint of `need` takes.
    pub fn new(need: &AxisNeed) -> Self {
        let force = need.points.iter().fold(0.0, |most: f64, it| most.max(it.effort.abs()));
        let belt::Preload { preload, strands: [tight, slack] } = belt::preload(force);
        Self { force, preload, tight, slack }
    }
}

/// A screw by its geometry.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct ScrewSize {
    /// Speed at which it whips [rad/s].
    pub critical_speed: f64,
    /// Moment of inertia of the length between its supports [kg·m²].
    pub inertia: f64,
}

impl ScrewSize {
    /// Of `screw`.
    pub fn new(screw: &Screw) -> Self {
        let Screw { diameter, bore, length, density, .. } = screw;
        Self {
            critical_speed: screw::critical_speed(screw),
            inertia: screw::inertia(*diameter, *bore, *length, *density),
        }
    }
}

/// What a job asks of a motor.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct NeedSize {
    /// What it must give.
    #[serde(flatten)]
    pub demand: Demand,
    /// Load inertia over the rotor's, seen at the shaft.
    pub inertia_ratio: f64,
    /// How hard that makes the use of a gear.
    pub class: Class,
}

/// How hard a gear is used, by the load's inertia beside the rotor's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// Up to 0.3.
    Uniform,
    /// Up to 3.
    Medium,
    /// Up to 10.
    Heavy,
    /// More.
    Extreme,
}

impl From<LoadClass> for Class {
    fn from(class: LoadClass) -> Self {
        match class {
            LoadClass::Uniform => Self::Uniform,
            LoadClass::Medium => Self::Medium,
            LoadClass::Heavy => Self::Heavy,
            LoadClass::Extreme => Self::Extreme,
        }
    }
}

/// A motor with its gear.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Drive {
    /// The motor.
    pub motor: String,
    /// The gear of the catalogue; null for none, and for a ratio of which nothing else is known.
    pub gear: Option<String>,
    /// Turns of the motor per turn of the gear's output.
    pub gear_ratio: f64,
    /// Joint travel per radian of the motor [m/rad or rad/rad].
    pub ratio: f64,
    /// Motor and gear together [kg]; null where it is not known.
    pub mass: Option<f64>,
    /// Power for which the motor is made [W].
    pub rated_power: f64,
    /// What it uses of every limit.
    pub uses: Vec<Use>,
    /// Largest temperature of the winding [°C]; null where it is not known how it warms.
    pub temperature: Option<f64>,
    /// Where the data come from.
    pub sources: Vec<String>,
}

impl Drive {
    /// What is told of `candidate`, which uses `uses`.
    pub fn new(candidate: &Candidate, uses: Vec<Use>) -> Self {
        Self {
            motor: candidate.name.clone(),
            gear: candidate.gear.clone(),
            gear_ratio: candidate.gear_ratio,
            ratio: candidate.ratio,
            mass: candidate.mass,
            rated_power: candidate.rated_power(),
            uses,
            temperature: None,
            sources: candidate.sources.clone(),
        }
    }
}

/// A pair that does not do it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Rejected {
    /// The motor.
    pub motor: String,
    /// The gear with which it comes nearest; null for none or the machine's.
    pub gear: Option<String>,
    /// The limit that it breaks most.
    pub check: &'static str,
    /// By how much.
    #[serde(rename = "use")]
    pub share: f64,
}

impl Rejected {
    /// What is told of `judged`.
    pub fn new(judged: &Judged) -> Option<Self> {
        let worst = checks::worst(&judged.uses)?;
        Some(Self {
            motor: judged.candidate.name.clone(),
            gear: judged.candidate.gear.clone(),
            check: worst.check,
            share: worst.share,
        })
    }
}

/// What the motors give back to their supply.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct SupplySize {
    /// Energy that they give back at once at most, more than the others take [J].
    pub surplus: f64,
    /// The voltage to which that charges the supply's capacitance [V]; null where the catalogue has none.
    pub voltage: Option<f64>,
    /// The largest that it may be charged to [V].
    pub max_voltage: Option<f64>,
}

impl SizeReport {
    /// What was found for `axes`.
    pub fn new(
        machine: &Machine,
        plan: &Plan,
        options: &Options,
        axes: Vec<AxisSize>,
        supply: SupplySize,
    ) -> Self {
        Self {
            job: plan.facts.name.clone(),
            machine: machine.name.clone(),
            margin: options.margin,
            ambient: options.ambient,
            axes,
            supply,
            confirmation: None,
            written: None,
            pictures: None,
        }
    }

    /// Whether every axis that a motor was looked for has one.
    pub fn is_complete(&self) -> bool {
        self.axes.iter().all(|axis| !axis.is_asked || axis.chosen.is_some())
    }
}

/// What the motors of `axes` give back together.
pub fn bus(needs: &[AxisNeed], axes: &[AxisSize], catalogue: &Catalogue) -> SupplySize {
    let courses: Vec<&AxisCourse> =
        axes.iter().map(|axis| &axis.judged.as_ref().unwrap_or(&axis.present).course).collect();
    let count = courses.iter().map(|course| course.points.len()).min().unwrap_or(0);
    let (mut surplus, mut most): (f64, f64) = (0.0, 0.0);
    for at in 0..count {
        let taken: f64 = courses.iter().map(|course| course.points[at].supplied).sum();
        surplus = (surplus - taken * SETPOINT_TIME).max(0.0);
        most = most.max(surplus);
    }
    let nominal = needs.iter().zip(axes).fold(0.0, |most: f64, (need, axis)| {
        let chosen = axis.judged.as_ref().map(|judged| &judged.candidate.motor);
        most.max(match chosen.unwrap_or(&need.actuator.motor) {
            Motor::Dc(motor) => motor.voltage,
            Motor::Stepper(motor) => motor.voltage,
        })
    });
    let charged =
        catalogue.supply.map(|supply| (nominal * nominal + 2.0 * most / supply.capacitance).sqrt());
    SupplySize {
        surplus: most,
        voltage: charged,
        max_voltage: catalogue.supply.map(|supply| supply.max_voltage),
    }
}
