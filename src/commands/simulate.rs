//! `graver simulate`: the stages in one process, in virtual time.

use crate::arguments::SimulateArguments;
use crate::exit::{Exit, Failure};
use crate::files::{Claim, Sources};
use crate::{inputs, output};
use drives::PlantOptions;
use messages::run_folder;
use monitor::conclusion::{self, RunOutcome};
use monitor::marks::StreamEnd;
use monitor::recording::file::Description;
use monitor::recording::file::writer::RecordingWriter;
use monitor::recording::level::Level;
use monitor::run_analysis::{Clock, RunAnalysis};
use monitor::run_folder::RunFolder;
use std::io;
use std::path::PathBuf;
use std::time::Instant;
use workbench::simulation::{SimulationError, Stretch, simulate_all};

/// Runs the command.
///
/// # Errors
/// A machine or job that does not hold, or a run folder that cannot be written.
pub fn run(arguments: &SimulateArguments) -> Result<Exit, Failure> {
    let started = Instant::now();
    let input = inputs::machine(&arguments.machine)?.with(&arguments.options);
    let mut request = inputs::job_request(
        arguments.job.as_deref(),
        &input.machine,
        input.folder.as_deref(),
        &input.job_overrides,
    );
    request.offsets = input.source.offsets()?;
    let job = request.read(&input.machine)?;
    let sources = Sources::new(arguments.machine.machine.as_deref(), &job.files);
    sources.spare(arguments.out.as_deref())?;
    let refuse = |error| request.refuse(&error);
    let plan = planner::plan(&input.machine, &job).map_err(refuse)?;
    let plan_time = started.elapsed().as_secs_f64();

    let folder = arguments.out.as_deref().map(RunFolder::create_at).transpose();
    let folder = folder.map_err(Failure::bad_input)?;
    let _claim = folder.as_ref().map(Claim::of).transpose()?;
    folder.as_ref().map_or(Ok(()), RunFolder::clear).map_err(Failure::bad_input)?;
    let period = input.machine.realtime.period;
    let actuators = input.machine.actuators.iter().map(|actuator| actuator.name.clone());
    let description = Description {
        stream: 1,
        simulated: true,
        seed: arguments.seed,
        actuators: actuators.collect(),
        machine: serde_json::to_string(&input.source).map_err(Failure::service)?,
        ..Description::of(period)
    };
    let recorded = folder.as_ref().filter(|_| arguments.record.level() > Level::Off);
    let begin = |folder| Recording::begin(folder, &description, arguments.record.level());
    let mut recording = recorded.map(begin);
    let mut analysis = RunAnalysis::new(&plan.artwork, Clock::Virtual, period)
        .with_actuators(input.machine.actuators.len());
    let options = PlantOptions { seed: arguments.seed, ..PlantOptions::default() };
    let simulated = simulate_all(&input.machine, &input.plant, &plan, options, |stretch| {
        if !stretch.is_power_up {
            stretch.records.iter().for_each(|record| analysis.push(record));
        }
        if let Some(recording) = &mut recording {
            recording.write(stretch);
        }
    });
    let simulated = match simulated {
        Ok(simulated) => simulated,
        Err(SimulationError::Faulted { fault, .. }) => {
            let warnings = input.machine.job_warnings();
            let run_outcome =
                RunOutcome { latched: fault, plan_time, warnings, ..RunOutcome::default() };
            let (machine, facts) = (&input.machine, &plan.facts);
            let mut summary =
                conclusion::summarise(machine, facts, &run_outcome, None, Clock::Virtual);
            summary.wall = started.elapsed().as_secs_f64();
            return Ok(output::summary(&summary, arguments.json));
        }
        Err(error) => return Err(Failure::bad_input(error)),
    };
    let mut warnings = input.machine.job_warnings();
    warnings.extend(recording.and_then(Recording::finish));

    let examining = Instant::now();
    let results = analysis.finish(StreamEnd::Reported(&simulated.controller));
    let time = period.of(simulated.controller.cycles).seconds();
    let run_outcome = RunOutcome {
        controller: Some(simulated.controller),
        drives: Some(simulated.drives),
        plan_time,
        warnings,
        realtime_factor: Some(time / simulated.stepping.as_secs_f64()),
        ..RunOutcome::default()
    };
    let (machine, facts) = (&input.machine, &plan.facts);
    let mut summary =
        conclusion::summarise(machine, facts, &run_outcome, Some(&results), Clock::Virtual);
    summary.report_time = examining.elapsed().as_secs_f64();
    summary.wall = started.elapsed().as_secs_f64();
    if let Some(folder) = &folder {
        if let Err(error) = conclusion::artwork::write(folder, &plan.artwork) {
            summary.warnings.push(format!("cannot write {error}"));
        }
        conclusion::write(folder, &input.machine, &plan.artwork, &mut summary, Some(&results));
    }
    Ok(output::summary(&summary, arguments.json))
}

/// The recording of a simulation, as far as it can be written: the simulation goes on without.
struct Recording {
    path: PathBuf,
    writer: io::Result<RecordingWriter>,
}

impl Recording {
    fn begin(folder: &RunFolder, description: &Description, level: Level) -> Self {
        let path = folder.file(run_folder::SAMPLES);
        Self { writer: RecordingWriter::create(&path, description, level), path }
    }

    fn write(&mut self, stretch: &Stretch<'_>) {
        if let Ok(writer) = &mut self.writer
            && let Err(error) = write(writer, stretch)
        {
            self.writer = Err(error);
        }
    }

    /// Why there is no recording, or not all of it.
    fn finish(self) -> Option<String> {
        let finished = self.writer.and_then(RecordingWriter::finish);
        finished.err().map(|error| format!("cannot write {}: {error}", self.path.display()))
    }
}

fn write(writer: &mut RecordingWriter, stretch: &Stretch<'_>) -> io::Result<()> {
    stretch.cycles().try_for_each(|(record, setpoints)| writer.write_cycle(record, &setpoints))
}
