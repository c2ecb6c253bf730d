//! `graver simulate`: the stages in one process, in virtual time.

mod planned_ahead;

use self::planned_ahead::PlannedAhead;
use crate::arguments::SimulateArguments;
use crate::exit::{Exit, Failure};
use crate::files::{Claim, Sources};
use crate::pipeline::refusals;
use crate::{inputs, output};
use drives::PlantOptions;
use messages::artwork::ArtworkLine;
use messages::run_folder;
use monitor::conclusion::artwork::ArtworkWriter;
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
    let job = request.open(&input.machine)?;
    let sources = Sources::new(arguments.machine.machine.as_deref(), &job.files);
    sources.spare(arguments.out.as_deref())?;
    let refuse = |error| request.refuse(&error);
    if !job.is_surely_within_reach(&input.machine) {
        // Refused as a whole, then, before anything is simulated.
        planner::plan_through(&input.machine, &job, |_| ()).map_err(refuse)?;
    }
    let reading = started.elapsed().as_secs_f64();
    let mut planned = PlannedAhead::start(&input.machine, job)?;
    planned.begin().map_err(refuse)?;

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
    let mut artwork = folder.as_ref().map(ArtworkWriter::create);
    let mut analysis =
        RunAnalysis::growing(Clock::Virtual, period).with_actuators(input.machine.actuators.len());
    let options = PlantOptions { seed: arguments.seed, ..PlantOptions::default() };
    let mut draw = |analysis: &mut RunAnalysis<'_>, line: ArtworkLine| {
        artwork.iter_mut().for_each(|artwork| artwork.add(&line));
        analysis.draw(line);
    };
    let examine = |planned: &mut PlannedAhead, stretch: &Stretch<'_>| {
        planned.strokes().into_iter().for_each(|line| draw(&mut analysis, line));
        if !stretch.is_power_up {
            stretch.records.iter().for_each(|record| analysis.push(record));
        }
        if let Some(recording) = &mut recording {
            recording.write(stretch);
        }
    };
    let simulated = simulate_all(&input.machine, &input.plant, &mut planned, options, examine);
    if let Err(error @ (SimulationError::Plant(_) | SimulationError::NotReady { .. })) = &simulated
    {
        return Err(Failure::bad_input(error));
    }
    if let Err(SimulationError::NotStarted { reply }) = &simulated {
        return Err(Failure::bad_input(refusals::not_started(reply, &input.machine, &[])));
    }
    let (facts, planning) = planned.finish(|line| draw(&mut analysis, line)).map_err(refuse)?;
    let plan_time = reading + planning;
    let simulated = match simulated {
        Ok(simulated) => simulated,
        Err(SimulationError::Faulted { fault, .. }) => {
            let warnings = input.machine.job_warnings();
            let run_outcome =
                RunOutcome { latched: fault, plan_time, warnings, ..RunOutcome::default() };
            let mut summary =
                conclusion::summarise(&input.machine, &facts, &run_outcome, None, Clock::Virtual);
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
    let machine = &input.machine;
    let mut summary =
        conclusion::summarise(machine, &facts, &run_outcome, Some(&results), Clock::Virtual);
    summary.report_time = examining.elapsed().as_secs_f64();
    summary.wall = started.elapsed().as_secs_f64();
    if let Some(folder) = &folder {
        if let Some(Err(error)) = artwork.map(ArtworkWriter::finish) {
            summary.warnings.push(format!("cannot write {error}"));
        }
        let drawn = conclusion::artwork::read(folder, None, &mut summary.warnings);
        let drawn = drawn.unwrap_or_default();
        conclusion::write(folder, machine, &drawn, &mut summary, Some(&results));
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
