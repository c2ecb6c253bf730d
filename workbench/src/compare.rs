//! Machines compared on the same jobs: each is planned, simulated, and simulated on plants that are other
//! than its file says.

mod job;
mod mismatch;
mod page;
mod picture;
mod ranking;
mod text;

pub use mismatch::mismatched;
pub use ranking::{CRITERIA, Weights};

use machine::kinematics::KinematicsError;
use machine::{Actuator, Machine};
use messages::plan::LimitUtilization;
use planner::request::JobRequest;
use schemars::JsonSchema;
use serde::Serialize;

use crate::mechanics::Mechanics;
use crate::operating::Demand;
use crate::spread::spread;
use crate::thesis::Table;
use crate::thesis::errata::Erratum;
use job::Run;

/// A machine to compare.
#[derive(Debug, Clone)]
pub struct Contender {
    /// Its file; `None` for the built-in machine.
    pub file: Option<String>,
    /// The machine that is planned for and controlled.
    pub machine: Machine,
    /// The machine that is simulated.
    pub plant: Machine,
    /// The jobs, for all machines as many and in the same order.
    pub jobs: Vec<JobRequest>,
}

/// How to compare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Plants that are other than the machine file says, of each machine and job.
    pub seeds: u64,
    /// What counts.
    pub weights: Weights,
}

/// One job on one machine.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JobReport {
    /// Its name.
    pub name: String,
    /// How the simulation ended.
    pub outcome: String,
    /// From the first motion to the last, as simulated [s].
    pub time: f64,
    /// The same as planned [s].
    pub planned: f64,
    /// Largest distance of a marked point from its line [m]; null where nothing was marked.
    pub error_max: Option<f64>,
    /// Root mean square of it [m].
    pub error_rms: Option<f64>,
}

/// The largest use of each limit of an axis, 1 at the limit.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct AxisUse {
    /// Speed of the joint.
    pub speed: f64,
    /// Current of a DC motor; null of a stepper.
    pub current: Option<f64>,
    /// Torque of a stepper against its pull-out torque; null of a DC motor.
    pub torque: Option<f64>,
    /// Voltage of a DC motor; null of a stepper.
    pub voltage: Option<f64>,
    /// Heating of a DC motor's winding; null of a stepper.
    pub heat: Option<f64>,
    /// Pulse rate of a stepper; null of a DC motor.
    pub pulse_rate: Option<f64>,
    /// Torque by the efficiencies of gear and screw in place of friction.
    pub sizing: f64,
}

impl AxisUse {
    /// Of `actuator`, the `index`th.
    fn of(actuator: &Actuator, index: usize, uses: &LimitUtilization) -> Self {
        let at = |uses: &[f64]| uses.get(index).copied().unwrap_or_default();
        let is_dc = actuator.motor.dc().is_some();
        let of_dc = |value: f64| is_dc.then_some(value);
        let of_stepper = |value: f64| (!is_dc).then_some(value);
        // Of a stepper, the places of current and voltage hold torque and pulse rate.
        Self {
            speed: uses.velocity.get(actuator.axis).copied().unwrap_or_default(),
            current: of_dc(at(&uses.current)),
            torque: of_stepper(at(&uses.current)),
            voltage: of_dc(at(&uses.voltage)),
            heat: of_dc(at(&uses.heat)),
            pulse_rate: of_stepper(at(&uses.voltage)),
            sizing: at(&uses.sizing),
        }
    }

    fn and(self, other: Self) -> Self {
        let most = |one: Option<f64>, other: Option<f64>| match (one, other) {
            (Some(one), Some(other)) => Some(one.max(other)),
            (one, other) => one.or(other),
        };
        Self {
            speed: self.speed.max(other.speed),
            current: most(self.current, other.current),
            torque: most(self.torque, other.torque),
            voltage: most(self.voltage, other.voltage),
            heat: most(self.heat, other.heat),
            pulse_rate: most(self.pulse_rate, other.pulse_rate),
            sizing: self.sizing.max(other.sizing),
        }
    }

    /// The largest of all.
    pub fn largest(&self) -> f64 {
        let optional = [self.current, self.torque, self.voltage, self.heat, self.pulse_rate];
        optional.into_iter().flatten().fold(self.speed.max(self.sizing), f64::max)
    }
}

/// What the jobs ask of one axis, or of each actuator where an axis has several.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct AxisReport {
    /// Its name.
    pub axis: String,
    /// The joint's unit.
    pub unit: String,
    /// Travel of the joint per radian of the motor [m or rad].
    pub ratio: f64,
    /// Share of the power that comes through the gear.
    pub efficiency: f64,
    /// What its motor must give over all jobs.
    #[serde(flatten)]
    pub demand: Demand,
    /// How much of its limits that is.
    #[serde(rename = "use")]
    pub uses: AxisUse,
}

/// A limit that bound the motion.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct BindingReport {
    /// The limit.
    pub limit: String,
    /// The axis whose limit it is; null for none.
    pub axis: Option<String>,
    /// Share of the time of all paths.
    pub share: f64,
}

/// Errors on plants that are other than the machine file says.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MismatchReport {
    /// Plants.
    pub seeds: u64,
    /// Median over plants and jobs of the largest error of the marks [m]; null where all ended in faults.
    pub error_median: Option<f64>,
    /// The largest [m].
    pub error_max: Option<f64>,
    /// Runs that did not come to their end.
    pub faults: u64,
}

/// One machine.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MachineReport {
    /// Its name.
    pub name: String,
    /// The kind of mechanism.
    pub mechanism: String,
    /// Its file; null for the built-in machine.
    pub file: Option<String>,
    /// Why it cannot do a job; null where it can do all. What the jobs come to is then null.
    pub refused: Option<String>,
    /// Time of all jobs [s].
    pub time: Option<f64>,
    /// Largest distance of a marked point from its line [m].
    pub error_max: Option<f64>,
    /// Root mean square of that distance over the jobs' times [m].
    pub error_rms: Option<f64>,
    /// Largest distance of the tool from where it should be at that time, while lit [m].
    pub tracking_max: Option<f64>,
    /// The jobs.
    pub jobs: Vec<JobReport>,
    /// The axes.
    pub axes: Vec<AxisReport>,
    /// What bound the motion, the limit that ruled longest first.
    pub binding: Vec<BindingReport>,
    /// The largest use of a limit of any axis, 1 at the limit.
    pub utilisation: Option<f64>,
    /// What it is before any job.
    #[serde(flatten)]
    pub mechanics: Mechanics,
    /// Errors under mismatch; null where none was asked for.
    pub mismatch: Option<MismatchReport>,
    /// What it has of each criterion, 1 for the best machine, in the order of the weights; null where it
    /// has no figure.
    pub shares: [Option<f64>; 8],
    /// The shares by their weights, 1 for a machine that is best in all; null where it was refused.
    pub score: Option<f64>,
    /// Its place, from 1; null where it was refused.
    pub rank: Option<u32>,
}

/// Machines compared.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Comparison {
    /// Names of the jobs.
    pub jobs: Vec<String>,
    /// The machines, in the order in which they were named.
    pub machines: Vec<MachineReport>,
    /// What counted.
    pub weights: Weights,
    /// The source's own comparison, where its machines are compared; else null.
    pub table_7_1: Option<Table>,
    /// The errata that it names.
    pub errata: Vec<Erratum>,
    /// What only pictures need.
    #[serde(skip)]
    #[schemars(skip)]
    drawn: Vec<picture::Drawn>,
}

impl Comparison {
    /// Names the job of `index` on all machines: a letter's own name does not say how high it is.
    pub fn name_job(&mut self, index: usize, name: &str) {
        let jobs = self.machines.iter_mut().filter_map(|machine| machine.jobs.get_mut(index));
        for known in jobs.map(|job| &mut job.name).chain(self.jobs.get_mut(index)) {
            name.clone_into(known);
        }
    }
}

/// Compares `contenders`.
///
/// # Errors
/// Where a mechanism has no solution at home.
pub fn compare(
    contenders: &[Contender],
    settings: &Settings,
) -> Result<Comparison, KinematicsError> {
    let items: Vec<(usize, &JobRequest)> = contenders
        .iter()
        .enumerate()
        .flat_map(|(index, contender)| contender.jobs.iter().map(move |job| (index, job)))
        .collect();
    let runs = spread(&items, |(index, job)| job::run(&contenders[*index], job, settings.seeds));
    let mut runs = runs.into_iter();
    let (mut machines, mut drawn) = (Vec::new(), Vec::new());
    for contender in contenders {
        let runs: Vec<Result<Run, String>> = runs.by_ref().take(contender.jobs.len()).collect();
        let (machine, pictured) = report(contender, runs, settings.seeds)?;
        machines.push(machine);
        drawn.push(pictured);
    }
    ranking::rank(&mut machines, &settings.weights);
    let named = machines.iter().find(|machine| machine.refused.is_none());
    let jobs = named
        .map_or_else(Vec::new, |machine| machine.jobs.iter().map(|job| job.name.clone()).collect());
    let weights = settings.weights;
    Ok(Comparison { jobs, machines, weights, table_7_1: None, errata: Vec::new(), drawn })
}

fn report(
    contender: &Contender,
    runs: Vec<Result<Run, String>>,
    seeds: u64,
) -> Result<(MachineReport, picture::Drawn), KinematicsError> {
    let Contender { file, machine, .. } = contender;
    let mut report = MachineReport {
        name: machine.name.clone(),
        mechanism: machine.mechanism.name().to_owned(),
        file: file.clone(),
        refused: None,
        time: None,
        error_max: None,
        error_rms: None,
        tracking_max: None,
        jobs: Vec::new(),
        axes: Vec::new(),
        binding: Vec::new(),
        utilisation: None,
        mechanics: Mechanics::of(machine)?,
        mismatch: None,
        shares: [None; 8],
        score: None,
        rank: None,
    };
    let runs: Vec<Run> = match runs.into_iter().collect() {
        Ok(runs) => runs,
        Err(reason) => {
            report.refused = Some(reason);
            return Ok((report, picture::Drawn::of(machine, &[])?));
        }
    };
    let drawn = picture::Drawn::of(machine, &runs)?;
    report.time = Some(runs.iter().map(|run| run.report.time).sum());
    let most = |value: fn(&Run) -> Option<f64>| runs.iter().filter_map(value).reduce(f64::max);
    report.error_max = most(|run| run.report.error_max);
    report.tracking_max = most(|run| run.tracking_max);
    let squares = runs.iter().filter_map(|run| {
        let error = run.report.error_rms?;
        Some((error * error * run.lit, run.lit))
    });
    let (square, lit) = squares.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    report.error_rms = (lit > 0.0).then(|| (square / lit).sqrt());
    report.axes = axes(machine, &runs);
    report.utilisation = report.axes.iter().map(|axis| axis.uses.largest()).reduce(f64::max);
    report.binding = binding(&runs);
    if seeds > 0 {
        let mut errors: Vec<f64> =
            runs.iter().flat_map(|run| &run.mismatch).flatten().copied().collect();
        errors.sort_by(f64::total_cmp);
        report.mismatch = Some(MismatchReport {
            seeds,
            error_median: median(&errors),
            error_max: errors.last().copied(),
            faults: runs.iter().flat_map(|run| &run.mismatch).filter(|it| it.is_none()).count()
                as u64,
        });
    }
    report.jobs = runs.into_iter().map(|run| run.report).collect();
    Ok((report, drawn))
}

fn axes(machine: &Machine, runs: &[Run]) -> Vec<AxisReport> {
    let of = |(index, (actuator, axis)): (usize, (&Actuator, &machine::Axis))| {
        let demands = runs.iter().filter_map(|run| run.demands.get(index));
        let uses = runs.iter().map(|run| AxisUse::of(actuator, index, &run.uses));
        AxisReport {
            axis: actuator.name.clone(),
            unit: axis.unit.name().to_owned(),
            ratio: actuator.ratio.abs(),
            efficiency: actuator.efficiency.dynamic,
            demand: demands.fold(Demand::default(), |all, one| all.and(one)),
            uses: uses.reduce(AxisUse::and).unwrap_or_default(),
        }
    };
    machine.drives().enumerate().map(of).collect()
}

/// The limits that bound all runs, each by its part of the time of all paths.
fn binding(runs: &[Run]) -> Vec<BindingReport> {
    let mut merged: Vec<(BindingReport, f64)> = Vec::new();
    let mut whole = 0.0;
    for run in runs {
        let path = run.binding.iter().find(|binding| binding.share > 0.0);
        whole += path.map_or(0.0, |binding| binding.time / binding.share);
        for binding in &run.binding {
            let is = |(kept, _): &&mut (BindingReport, f64)| {
                kept.limit == binding.limit && kept.axis == binding.axis
            };
            match merged.iter_mut().find(is) {
                Some((_, time)) => *time += binding.time,
                None => {
                    let (limit, axis) = (binding.limit.clone(), binding.axis.clone());
                    merged.push((BindingReport { limit, axis, share: 0.0 }, binding.time));
                }
            }
        }
    }
    merged.sort_by(|one, other| other.1.total_cmp(&one.1));
    let share = |time: f64| if whole > 0.0 { time / whole } else { 0.0 };
    merged.into_iter().map(|(kept, time)| BindingReport { share: share(time), ..kept }).collect()
}

fn median(sorted: &[f64]) -> Option<f64> {
    let middle = sorted.len() / 2;
    let upper = sorted.get(middle)?;
    if sorted.len() % 2 == 1 {
        return Some(*upper);
    }
    Some((sorted.get(middle.checked_sub(1)?)? + upper) / 2.0)
}
