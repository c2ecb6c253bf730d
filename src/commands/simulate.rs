//! `graver simulate`: the stages in one process, in virtual time.

use crate::arguments::SimulateArguments;
use crate::exit::{Exit, Failure};
use crate::files::Claim;
use crate::simulation::simulate;
use crate::{inputs, output};
use drives::PlantOptions;
use monitor::conclusion::{self, Ending};
use monitor::examination::{Clock, Examination};
use monitor::marks::StreamEnd;
use monitor::recording::file::RecordingWriter;
use monitor::run_folder::RunFolder;
use signals::run_folder;
use signals::time::CYCLE_TIME;
use std::fs::File;
use std::io::{self, BufWriter};
use std::time::Instant;

/// Runs the command.
///
/// # Errors
/// A machine or job that does not hold, or a run folder that cannot be written.
pub fn run(arguments: &SimulateArguments) -> Result<Exit, Failure> {
    let started = Instant::now();
    let input = inputs::machine(&arguments.machine)?;
    let request = inputs::job_request(
        arguments.job.as_deref(),
        &input.machine,
        input.folder.as_deref(),
        &input.job_overrides,
    );
    let plan = request.plan(&input.machine)?;
    let plan_time = started.elapsed().as_secs_f64();

    let folder = arguments.out.as_deref().map(RunFolder::create_at).transpose();
    let folder = folder.map_err(Failure::bad_input)?;
    let _claim = folder.as_ref().map(Claim::of).transpose()?;
    folder.as_ref().map_or(Ok(()), RunFolder::clear).map_err(Failure::bad_input)?;
    let mut writer = folder.as_ref().map(recording).transpose().map_err(Failure::service)?;
    let mut failed: io::Result<()> = Ok(());
    let mut examination = Examination::new(&plan.artwork, Clock::Virtual);
    let options = PlantOptions { seed: arguments.seed, ..PlantOptions::default() };
    let simulated = simulate(&input.machine, &input.plant, &plan, options, |records| {
        records.iter().for_each(|record| examination.push(record));
        if let (Some(writer), Ok(())) = (&mut writer, &failed) {
            failed = writer.write(records);
        }
    })
    .map_err(Failure::bad_input)?;
    failed.map_err(Failure::service)?;
    if let Some(writer) = writer {
        writer.finish().map_err(Failure::service)?;
    }

    let examining = Instant::now();
    let findings = examination.finish(StreamEnd::Reported(&simulated.controller));
    let time = simulated.controller.cycles as f64 * CYCLE_TIME;
    let ending = Ending {
        controller: Some(simulated.controller),
        drives: Some(simulated.drives),
        plan_time,
        warnings: input.machine.job_warnings(),
        realtime_factor: Some(time / simulated.stepping.as_secs_f64()),
        ..Ending::default()
    };
    let (machine, facts) = (&input.machine, &plan.facts);
    let mut summary =
        conclusion::summarise(machine, facts, &ending, Some(&findings), Clock::Virtual);
    summary.report_time = examining.elapsed().as_secs_f64();
    summary.wall = started.elapsed().as_secs_f64();
    if let Some(folder) = &folder {
        let artwork = serde_json::to_vec(&plan.artwork).map_err(Failure::service)?;
        folder.write(run_folder::ARTWORK, artwork).map_err(Failure::service)?;
        conclusion::write(folder, &input.machine, &plan.artwork, &mut summary, Some(&findings));
    }
    Ok(output::summary(&summary, arguments.json))
}

fn recording(folder: &RunFolder) -> io::Result<RecordingWriter<BufWriter<File>>> {
    RecordingWriter::new(BufWriter::new(File::create(folder.file(run_folder::SAMPLES))?))
}
