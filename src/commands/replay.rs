//! `graver replay`: a recording of a simulation played again, stage by stage, bit for bit.

use crate::arguments::ReplayArguments;
use crate::exit::{Exit, Failure};
use crate::inputs::MachineSource;
use crate::output::{self, say};
use drives::PlantOptions;
use messages::run_folder;
use monitor::recording::file::reader::EntryReader;
use schemars::JsonSchema;
use serde::Serialize;
use std::path::PathBuf;
use workbench::replay::{Replayed, StageDifference, replay};

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
    let path = match &arguments.recording {
        folder if folder.is_dir() => folder.join(run_folder::SAMPLES),
        file => file.clone(),
    };
    let at =
        |error: &dyn std::fmt::Display| Failure::bad_input(format!("{}: {error}", path.display()));
    let reader = EntryReader::open(&path).map_err(|error| at(&error))?;
    let description = reader.description().clone();
    if !description.simulated {
        return Err(at(
            &"a recording in real time: what the controller got when is not in it; only one of \
              `graver simulate` can be played",
        ));
    }
    let source: MachineSource = serde_json::from_str(&description.machine)
        .map_err(|error| at(&format!("the machine in it: {error}")))?;
    let options = PlantOptions { seed: description.seed, ..PlantOptions::default() };
    let replayed = replay(&source.machine()?, &source.plant()?, options, reader);
    let Replayed { cycles, difference } = replayed.map_err(|error| at(&error))?;
    if cycles == 0 {
        return Err(at(&"no cycle is in it: recorded with --record events?"));
    }
    let equal = difference.is_none();
    let report =
        ReplayReport { recording: path, equal, cycles, difference: difference.map(Into::into) };
    tell(&report, arguments.json)?;
    Ok(if equal { Exit::Done } else { Exit::Stopped })
}

fn tell(report: &ReplayReport, json: bool) -> Result<(), Failure> {
    if json {
        return output::json(report);
    }
    match &report.difference {
        None => say!(
            "{} cycles: controller and drives give what was recorded, bit for bit",
            report.cycles
        ),
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
