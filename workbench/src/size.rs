//! Which motor and gear each axis needs for a job: what the job asks, held against a catalogue.
//!
//! The need is that of the motion which the job asks for within the limits of path and joints, as if the
//! motors could give anything: a motor that is too small would slow the plan down and so hide what is
//! missing. It stands at the joints, so that it is the same whatever drives them. What is chosen is written
//! into the machine file, planned with and simulated before it is called right.

pub mod belt;
pub mod candidate;
pub mod checks;
pub mod choose;
pub mod confirm;
pub mod gear;
pub mod need;
mod parts;
pub mod report;
pub mod screw;
pub mod thermal;
pub mod write;

use crate::catalogue::Catalogue;
use machine::document::DocumentError;
use machine::{Machine, Override};
use need::AxisNeed;
use planner::{Job, PlanError};
use report::{AxisSize, SizeReport};
use schemars::JsonSchema;
use serde::Serialize;

/// Times that a choice is planned with, simulated and made anew with more in hand.
const ROUNDS: usize = 4;

/// By how much more is kept in hand where a choice was not confirmed.
const MORE: f64 = 1.1;

/// What makes a motor the better one of those that can do the job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Order {
    /// The least mass of motor and gear; the least power where one of them has no mass.
    #[default]
    Mass,
    /// The least rated power.
    Power,
}

/// Which gears are considered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gears {
    /// The ratio that the machine has.
    Keep,
    /// Those of the catalogue, and none.
    Catalogue,
    /// Any ratio.
    Any,
}

/// How motors are chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// By what the need is multiplied before it is compared with what a motor gives.
    pub margin: f64,
    /// Temperature of the air around the motors [°C].
    pub ambient: f64,
    /// The axes; all where it is empty.
    pub axes: Vec<String>,
    /// What makes a motor the better one.
    pub order: Order,
    /// Which gears are considered.
    pub gears: Gears,
}

/// A machine as its file has it.
#[derive(Debug, Clone, Copy)]
pub struct MachineFile<'a> {
    /// Its name, as in errors.
    pub name: &'a str,
    /// Its text.
    pub text: &'a str,
    /// Changes that are laid over it.
    pub overrides: &'a [Override],
}

/// Why motors could not be chosen.
#[derive(Debug, thiserror::Error)]
pub enum SizeError {
    /// The machine file is not sound.
    #[error(transparent)]
    Machine(#[from] DocumentError),
    /// The job cannot be planned.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// An axis that the machine does not have.
    #[error("there is no axis `{name}`; the machine has {known}")]
    NoAxis {
        /// What was asked for.
        name: String,
        /// The machine's axes.
        known: String,
    },
    /// The machine file cannot be changed.
    #[error("the machine file cannot be written: {0}")]
    Write(String),
}

/// What became of planning and simulating with what was chosen.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Confirmation {
    /// Whether the job is done in the time that it takes without limits of the motors, with every check held.
    pub is_right: bool,
    /// Why not; null where it is right.
    pub because: Option<String>,
    /// Time of the job without limits of the motors [s].
    pub time_asked: f64,
    /// Time of the job with these motors [s]; null where it cannot be planned with them.
    pub time: Option<f64>,
    /// Largest deviation of a mark in the simulation [m]; null where nothing was marked.
    pub error: Option<f64>,
    /// By what the need was multiplied in the end.
    pub margin: f64,
}

/// Chooses motors for `job` on `machine`, which is what `file` says, from `catalogue`; gives what was found and,
/// where every axis has its motor, the machine file with them.
///
/// # Errors
/// A machine or job that does not hold, or an axis that the machine does not have.
pub fn size(
    file: MachineFile<'_>,
    machine: &Machine,
    job: &Job,
    catalogue: &Catalogue,
    options: &Options,
) -> Result<(SizeReport, Option<String>), SizeError> {
    let table = need::table(file)?;
    let unknown = options.axes.iter().find(|name| machine.axes.iter().all(|it| it.name != **name));
    if let Some(name) = unknown {
        let known: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
        return Err(SizeError::NoAxis { name: name.clone(), known: known.join(", ") });
    }
    let (plan, needs) = need::needs(machine, &table, job)?;
    let mut margin = options.margin;
    let mut rounds = 0;
    loop {
        let options = Options { margin, ..options.clone() };
        let axes: Vec<AxisSize> = needs
            .iter()
            .map(|need| {
                let is_asked = options.axes.is_empty() || options.axes.contains(&need.axis);
                choose::axis(need, catalogue, &options, is_asked)
            })
            .collect();
        let energy = report::bus(&needs, &axes, catalogue);
        let mut report = SizeReport::new(machine, &plan, &options, axes, energy);
        if !report.is_complete() {
            return Ok((report, None));
        }
        let text = write::machine_file(file.text, &report.axes, &needs)?;
        let written = MachineFile { text: &text, ..file };
        let asked = plan.facts.duration;
        let mut confirmation = confirm::confirm(written, job, asked, &needs)?;
        confirmation.margin = margin;
        let is_right = confirmation.is_right;
        report.confirmation = Some(confirmation);
        rounds += 1;
        if is_right || rounds == ROUNDS || report.axes.iter().all(|axis| axis.chosen.is_none()) {
            return Ok((report, Some(text)));
        }
        margin *= MORE;
    }
}

/// The actuator of `needs` with this name.
pub(crate) fn named<'a>(needs: &'a [AxisNeed], name: &str) -> Option<&'a AxisNeed> {
    needs.iter().find(|need| need.name == name)
}
