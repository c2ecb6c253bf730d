//! One job in a pipeline, from offer to summary.

use super::operators::{News, Submission};
use super::services::{Ended, Remedy};
use super::{LOOK, Pipeline, Starter};
use crate::exit::{Failure, error_summary};
use crate::output::ProgressLine;
use monitor::conclusion::{self, Ending};
use monitor::run_folder::RunFolder;
use monitor::summary::{ErrorSummary, Outcome, Summary};
use planner::request::{JobRequest, Refusal};
use runtime::domain::Role;
use runtime::signal;
use signals::{DrivesReport, Fault, FaultCode, OperatorVerb, PlannerPhase, run_folder};
use std::time::{Duration, Instant};

/// How long the controller may take to bring the axes to rest and say so.
const END_PATIENCE: Duration = Duration::from_secs(10);

/// How long the monitor may take to open its recording: without it the job runs unrecorded.
const RECORDING_PATIENCE: Duration = Duration::from_secs(2);

/// How long the monitor may take to complete its recording.
const WATCH_PATIENCE: Duration = Duration::from_secs(10);

/// How far a job has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// Offered to the planner.
    Planning,
    /// Checked; waiting for the recording to be open.
    Ready(Instant),
    /// Handed to the controller.
    Playing,
    /// Told to end, or left by a service: waiting for the axes to rest.
    Ending(Instant),
}

/// A job under way.
pub struct JobRun<'a> {
    pipeline: &'a mut Pipeline,
    folder: RunFolder,
    name: String,
    stream: u64,
    stage: Stage,
    started: Instant,
    ending: Ending,
    submission: Option<Submission>,
}

impl<'a> JobRun<'a> {
    /// Offers the job to the planner; its run folder must exist and is cleared.
    ///
    /// # Errors
    /// A folder that cannot be written, or a channel that fails.
    pub fn offer(
        pipeline: &'a mut Pipeline,
        job: &JobRequest,
        folder: RunFolder,
        started: Instant,
        submission: Option<Submission>,
    ) -> Result<Self, Failure> {
        folder.clear().map_err(Failure::bad_input)?;
        let request = serde_json::to_vec_pretty(job).map_err(Failure::service)?;
        folder.write(run_folder::REQUEST, request).map_err(Failure::service)?;
        let path = std::path::absolute(folder.path()).map_err(Failure::service)?;
        let stream = pipeline.offer(&path.to_string_lossy())?;
        let name = job_name(job);
        pipeline.board.name_job(Some(&name));
        let ending = Ending {
            job: name.clone(),
            overruns_before: pipeline.heard.drives.overruns,
            ..Ending::default()
        };
        let stage = Stage::Planning;
        Ok(Self { pipeline, folder, name, stream, stage, started, ending, submission })
    }

    /// Follows the job to its end and writes its summary.
    ///
    /// # Errors
    /// A channel that fails, or a run folder that cannot be written.
    pub fn follow(mut self) -> Result<Summary, Failure> {
        let line = ProgressLine::on_terminal();
        loop {
            for ended in self.pipeline.look()? {
                line.clear();
                self.note_ended(&ended);
            }
            if let Some(message) = self.missing() {
                self.end_with(message.into());
            }
            self.heed_termination()?;
            if self.advance()? {
                break;
            }
            let (share, text) = self.progress();
            line.draw(share, &text);
            if let Some(submission) = &self.submission {
                // A submitter that left hears nothing; the job goes on.
                let _ = submission.news.send(News::Share(share));
            }
            std::thread::sleep(LOOK);
        }
        line.clear();
        self.conclude()
    }

    /// Goes on to the next stage when its time has come; whether the job has ended.
    fn advance(&mut self) -> Result<bool, Failure> {
        let heard = self.pipeline.heard;
        let planner = (heard.planner.stream == self.stream)
            .then(|| PlannerPhase::from_wire(heard.planner.phase));
        let report = Some(heard.controller)
            .filter(|report| report.stream == self.stream && report.is_final == 1);
        match self.stage {
            Stage::Planning => match planner {
                Some(PlannerPhase::Refused) => {
                    self.refuse()?;
                    return Ok(true);
                }
                Some(PlannerPhase::Streaming) => {
                    self.ending.plan_time = heard.planner.plan_time;
                    self.stage = Stage::Ready(Instant::now());
                }
                _ => {}
            },
            Stage::Ready(since) => {
                let recorded = self.folder.file(run_folder::SAMPLES).exists();
                if !recorded && since.elapsed() < RECORDING_PATIENCE {
                    return Ok(false);
                }
                if !recorded {
                    self.ending.warnings.push("the monitor is not recording this job".into());
                }
                self.stage = Stage::Playing;
                if !self.pipeline.ask(OperatorVerb::Start, self.stream as f64) {
                    self.end_with("the controller refused to start the job".into());
                }
            }
            Stage::Playing | Stage::Ending(_) => {
                if let Some(report) = report {
                    self.ending.controller = Some(report);
                    return Ok(true);
                }
                if let Stage::Ending(since) = self.stage {
                    // Without drives nothing moves, and a controller without feedback says nothing.
                    let gone = !self.pipeline.has(Role::Drives);
                    let stopped = heard.drives.at_rest == 1 && heard.drives.fault.is_some();
                    let silent = !self.pipeline.has(Role::Controller) && stopped;
                    return Ok(gone || silent || since.elapsed() > END_PATIENCE);
                }
            }
        }
        Ok(false)
    }

    fn progress(&self) -> (f64, String) {
        let heard = &self.pipeline.heard;
        let what = match self.stage {
            Stage::Planning => "planning".to_owned(),
            Stage::Ready(_) => "starting".to_owned(),
            Stage::Playing => format!(
                "stroke {} of {}, rate {:.0} %",
                heard.progress.stroke,
                heard.planner.strokes,
                heard.progress.rate * 100.0
            ),
            Stage::Ending(_) => "coming to rest".to_owned(),
        };
        let played = if heard.progress.stream == self.stream { heard.progress.played } else { 0 };
        let share = played as f64 / heard.planner.samples.max(1) as f64;
        (share, format!("{}: {what}", self.name))
    }

    /// Ctrl-C: laser, then axes; a job that is still being planned is withdrawn.
    fn heed_termination(&mut self) -> Result<(), Failure> {
        if signal::termination().is_none() || matches!(self.stage, Stage::Ending(_)) {
            return Ok(());
        }
        self.ending.outcome = Some(Outcome::Stopped);
        self.pipeline.withdraw()?;
        self.pipeline.ask(OperatorVerb::Stop, 0.0);
        self.stage = Stage::Ending(Instant::now());
        Ok(())
    }

    /// A service has ended by itself: says so at once, and what is done about it.
    fn note_ended(&mut self, ended: &Ended) {
        let consequence = match ended.role {
            Role::Monitor => "the marks go on unharmed",
            Role::Planner => "laser off, the controller brings the axes to rest along the path",
            Role::Controller => "laser off, drives stops the axes",
            Role::Drives => "the simulated plant is gone with it",
            Role::Domain | Role::Observer => "",
        };
        let message = format!("{ended}: {consequence}");
        eprintln!("graver: {message}");
        match ended.remedy {
            Remedy::Restarted | Remedy::None => self.ending.warnings.push(message),
            Remedy::Stop => self.end_with(message),
        }
    }

    /// What ails a job whose services somebody else starts, when one that it cannot end without is
    /// gone. Of the others' deaths the controller tells.
    fn missing(&self) -> Option<&'static str> {
        if self.pipeline.starter() == Starter::Own {
            return None;
        }
        match self.stage {
            Stage::Planning if !self.pipeline.has(Role::Planner) => {
                Some("the planner is not running: start it and submit again")
            }
            Stage::Ready(_) | Stage::Playing if !self.pipeline.has(Role::Controller) => {
                Some("the controller has ended: laser off, drives stops the axes")
            }
            Stage::Ready(_) | Stage::Playing if !self.pipeline.has(Role::Drives) => {
                Some("drives has ended: start it, reset the fault and submit again")
            }
            _ => None,
        }
    }

    fn end_with(&mut self, message: String) {
        if self.ending.error.is_none() {
            self.ending.error =
                Some(ErrorSummary { file: None, line: None, column: None, message });
            self.ending.outcome = Some(Outcome::Aborted);
        }
        if !matches!(self.stage, Stage::Ending(_)) {
            self.stage = Stage::Ending(Instant::now());
        }
    }

    fn refuse(&mut self) -> Result<(), Failure> {
        let text =
            std::fs::read(self.folder.file(run_folder::REFUSAL)).map_err(Failure::service)?;
        let refusal: Refusal = serde_json::from_slice(&text).map_err(Failure::service)?;
        eprintln!("graver: {}", refusal.text.trim());
        self.ending.outcome = Some(Outcome::Refused);
        self.ending.error = Some(error_summary(&refusal));
        Ok(())
    }

    fn conclude(mut self) -> Result<Summary, Failure> {
        if self.ending.controller.is_none() {
            self.pipeline.withdraw()?;
        }
        if self.folder.file(run_folder::SAMPLES).exists() {
            self.await_recording();
        }
        self.ending.drives = Some(self.drives_with_cause());
        let machine = self.pipeline.configuration.source.machine()?;
        self.ending.warnings.splice(0..0, machine.job_warnings());
        let summary = conclusion::conclude(&self.folder, &machine, &self.ending, self.started)
            .map_err(Failure::service)?;
        self.pipeline.board.name_job(None);
        if let Some(submission) = self.submission.take() {
            let reply = serde_json::to_value(&summary).map_err(Failure::service)?;
            let _ = submission.news.send(News::End(reply));
        }
        Ok(summary)
    }

    /// What drives reported, with the cause of a death that the dead cannot tell: a controller
    /// without feedback says nothing, and drives without commands may name those first.
    fn drives_with_cause(&self) -> DrivesReport {
        let mut drives = self.pipeline.heard.drives;
        if self.ending.controller.is_some() || self.ending.error.is_none() {
            return drives;
        }
        let vague = matches!(drives.fault.code(), FaultCode::None | FaultCode::StaleCommand);
        if vague && !self.pipeline.has(Role::Drives) {
            drives.fault = Fault::new(FaultCode::DrivesLost).at(drives.fault.at);
        } else if vague && !self.pipeline.has(Role::Controller) {
            drives.fault = Fault::new(FaultCode::ControllerLost).at(drives.fault.at);
        }
        drives
    }

    /// Waits until the monitor has written all of it, as long as there is one.
    fn await_recording(&mut self) {
        let since = Instant::now();
        while !self.folder.file(run_folder::WATCH).exists()
            && since.elapsed() < WATCH_PATIENCE
            && self.pipeline.has(Role::Monitor)
        {
            if self.pipeline.look().is_err() {
                return;
            }
            std::thread::sleep(LOOK);
        }
    }
}

fn job_name(job: &JobRequest) -> String {
    let stem = job.job.as_deref().and_then(|path| path.file_stem());
    stem.map_or_else(|| "letters".to_owned(), |stem| stem.to_string_lossy().into_owned())
}
