//! `graver replay`: a recording played again, stage by stage, bit for bit.

use crate::arguments::ReplayArguments;
use crate::exit::{Exit, Failure};
use crate::inputs::MachineSource;
use crate::output::{self, say};
use drives::PlantOptions;
use messages::run_folder;
use monitor::recording::file::RecordingError;
use monitor::recording::file::parts::PartsReader;
use monitor::recording::file::reader::Entry;
use runtime::message;
use schemars::JsonSchema;
use serde::Serialize;
use std::path::{Path, PathBuf};
use workbench::replay::{Replayed, Simulated, StageDifference, replay};

/// What `replay --json` prints.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ReplayReport {
    /// The recording.
    recording: PathBuf,
    /// Whether every output is as it was recorded.
    equal: bool,
    /// Cycles that were played.
    cycles: u64,
    /// The first output that is not; null where all are.
    difference: Option<FirstDifference>,
}

/// The first output that is not as it was recorded.
#[derive(Debug, Serialize, JsonSchema)]
struct FirstDifference {
    /// The stage: `controller` or `drives`.
    stage: String,
    /// The cycle.
    cycle: u64,
    /// The field of its sample.
    field: String,
    /// What was recorded.
    recorded: String,
    /// What the stage gives now.
    found: String,
}

impl From<StageDifference> for FirstDifference {
    fn from(StageDifference { stage, cycle, difference }: StageDifference) -> Self {
        Self {
            stage: stage.to_owned(),
            cycle,
            field: difference.field,
            recorded: difference.recorded,
            found: difference.found,
        }
    }
}

/// Runs the command.
///
/// # Errors
/// A recording that cannot be read, or played.
pub fn run(arguments: &ReplayArguments) -> Result<Exit, Failure> {
    let place = &arguments.recording;
    let (path, reader) = if place.is_dir() {
        (place.join(run_folder::SAMPLES), PartsReader::open(place))
    } else {
        (place.clone(), PartsReader::of_file(place))
    };
    let at =
        |error: &dyn std::fmt::Display| Failure::bad_input(format!("{}: {error}", path.display()));
    let reader = reader.map_err(|error| at(&error))?;
    let description = reader.description().clone();
    let source: MachineSource = serde_json::from_str(&description.machine)
        .map_err(|error| at(&format!("the machine in it: {error}")))?;
    let (machine, plant) = (source.machine()?, source.plant()?);
    let options = PlantOptions { seed: description.seed, ..PlantOptions::default() };
    let simulated = description.simulated.then_some(Simulated { plant: &plant, options });
    let replayed = replay(&machine, simulated, whole(&path, reader.entries()));
    let Replayed { cycles, difference } = replayed.map_err(|error| at(&error))?;
    if cycles == 0 {
        return Err(at(&"no cycle is in it: recorded with --record events?"));
    }
    let equal = difference.is_none();
    let report =
        ReplayReport { recording: path, equal, cycles, difference: difference.map(Into::into) };
    tell(&report, description.simulated, arguments.json)?;
    Ok(if equal { Exit::Done } else { Exit::Stopped })
}

/// All that is whole: before a torn end everything is.
fn whole(
    path: &Path,
    entries: impl Iterator<Item = Result<Entry, RecordingError>>,
) -> impl Iterator<Item = Result<Entry, RecordingError>> {
    entries.map_while(|entry| match entry {
        Err(error @ RecordingError::Truncated { .. }) => {
            message::tell(&format!("warning: {}: {error}", path.display()));
            None
        }
        entry => Some(entry),
    })
}

fn tell(report: &ReplayReport, simulated: bool, json: bool) -> Result<(), Failure> {
    if json {
        return output::json(report);
    }
    match &report.difference {
        None => {
            let stages =
                if simulated { "controller and drives give" } else { "the controller gives" };
            say!("{} cycles: {stages} what was recorded, bit for bit", report.cycles);
        }
        Some(it) => say!(
            "cycle {}: {} of {} is {}, recorded was {}",
            it.cycle,
            it.field,
            it.stage,
            it.found,
            it.recorded
        ),
    }
    Ok(())
}
