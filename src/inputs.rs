//! Machine, job and their overrides, as the command line names them.

use crate::arguments::MachineArguments;
use crate::exit::Failure;
use machine::Machine;
use machine::document::Override;
use planner::request::JobRequest;
use std::path::{Path, PathBuf};

/// What the arguments `--machine` and `--set` say together.
#[derive(Debug, Clone)]
pub struct MachineInput {
    /// The machine that is planned for and controlled.
    pub machine: Machine,
    /// The machine that is simulated: the same, but for `--set plant.…`.
    pub plant: Machine,
    /// Where the machine file is, `None` for the built-in one.
    pub folder: Option<PathBuf>,
    /// Changes of the job.
    pub job_overrides: Vec<Override>,
}

/// Reads the machine and sorts the overrides by what they change.
///
/// # Errors
/// A machine file or an override that does not hold.
pub fn machine(arguments: &MachineArguments) -> Result<MachineInput, Failure> {
    let sorted = Overrides::sort(&arguments.set)?;
    let file = arguments.machine.as_deref();
    let machine = load(file, &sorted.machine)?;
    let plant = if sorted.plant.is_empty() {
        machine.clone()
    } else {
        Machine::simulated(file, &sorted.machine, &sorted.plant)?
    };
    let folder = file.and_then(Path::parent).map(Path::to_owned);
    Ok(MachineInput { machine, plant, folder, job_overrides: sorted.job })
}

/// Loads a machine file, or the built-in machine.
///
/// # Errors
/// A file or an override that does not hold.
pub fn load(file: Option<&Path>, overrides: &[Override]) -> Result<Machine, Failure> {
    match file {
        Some(path) => Machine::load(path, overrides),
        None => Machine::builtin_with(overrides),
    }
    .map_err(Failure::from)
}

/// The job that the command line names, or the machine's sample job, or the built-in one.
///
/// `machine_folder` is what the machine file's own paths are relative to.
pub fn job_request(
    job: Option<&Path>,
    machine: &Machine,
    machine_folder: Option<&Path>,
    set: &[Override],
) -> JobRequest {
    let sample = || {
        let sample = machine.sample_job.as_ref()?;
        Some(machine_folder?.join(sample))
    };
    JobRequest {
        job: job.map(Path::to_owned).or_else(sample),
        set: set.iter().map(|change| format!("{}={}", change.key, change.value)).collect(),
    }
}

/// Overrides by what they change.
#[derive(Debug, Clone, Default)]
pub struct Overrides {
    /// `machine.…`, without the prefix.
    pub machine: Vec<Override>,
    /// `plant.…`, without the prefix.
    pub plant: Vec<Override>,
    /// Everything else.
    pub job: Vec<Override>,
}

impl Overrides {
    /// Sorts the values of `--set`.
    ///
    /// # Errors
    /// A value that is not `KEY=VALUE`.
    pub fn sort(values: &[String]) -> Result<Self, Failure> {
        let mut sorted = Self::default();
        for value in values {
            let change: Override = value.parse().map_err(Failure::bad_input)?;
            if let Some(key) = change.key.strip_prefix("machine.") {
                sorted.machine.push(Override { key: key.to_owned(), ..change });
            } else if let Some(key) = change.key.strip_prefix("plant.") {
                sorted.plant.push(Override { key: key.to_owned(), ..change });
            } else {
                sorted.job.push(change);
            }
        }
        Ok(sorted)
    }
}
