//! One job in a pipeline, from the start of the machine to the summary.

use super::control::JobControl;
use super::operators::{self, JobEvent, Submission};
use super::power_up::{NotReady, PowerUp};
use super::services::{Ended, Recovery};
use super::{POLL_INTERVAL, Pipeline, ServiceOwner, is_dark_and_at_rest};
use crate::exit::{Failure, error_summary};
use crate::output::ProgressLine;
use messages::{Cycle, DrivesReport, Fault, FaultCode, OperatorVerb, PlannerPhase, run_folder};
use monitor::conclusion::{self, RecordingState, RunOutcome};
use monitor::run_folder::RunFolder;
use monitor::summary::text::duration;
use monitor::summary::{ErrorSummary, Outcome, Summary};
use planner::request::{JobRequest, Refusal};
use runtime::domain::Role;
use runtime::{message, signal};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long the controller may take to bring the axes to rest and say so.
const REST_PATIENCE: Duration = Duration::from_secs(10);

/// How long the controller's last word may follow when the axes rest: it comes with the next cycle,
/// unless the controller hangs or is dead.
const WORD_PATIENCE: Duration = Duration::from_millis(250);

/// How long the axes may take to stand of a job that was never played: they only held.
const UNPLAYED_PATIENCE: Duration = Duration::from_millis(500);

/// How long drives may say nothing while a job is played; its clock may slip by some tenths of a
/// second.
const DRIVES_PATIENCE: Duration = Duration::from_secs(5);

/// How long the monitor may take to open its recording: without it the job runs unrecorded.
const OPENING_PATIENCE: Duration = Duration::from_secs(2);

/// How long the monitor may take to complete its recording, on a loaded computer or a slow disk.
const WRITING_PATIENCE: Duration = Duration::from_secs(5);

/// How long a monitor that somebody has stopped is waited for.
const STOPPED_PATIENCE: Duration = Duration::from_millis(250);

/// How far a job has come.
#[derive(Debug, Clone, Copy)]
enum Stage {
    /// Waiting for the services and the motors.
    Starting(PowerUp),
    /// Offered to the planner.
    Planning,
    /// Checked; waiting for the recording to be open, and for a person who holds it.
    Ready(Instant),
    /// Handed to the controller.
    Playing,
    /// It will not go on: waiting for the axes to rest.
    Resting(Instant),
}

/// A job under way.
pub struct JobRun<'a> {
    pipeline: &'a mut Pipeline,
    control: Arc<JobControl>,
    folder: RunFolder,
    name: String,
    /// Its number for planner and controller; `None` before it was offered.
    stream: Option<u64>,
    stage: Stage,
    /// Whether the controller may have played any of it.
    played: bool,
    /// Since when the controller has refused to play it.
    refused: Option<Instant>,
    /// Since when nothing can move any more, whatever the controller says.
    quiet: Option<Instant>,
    /// What was left of the job when it was last played [s].
    time_left: f64,
    /// The newest cycle of drives that was heard of, and when.
    drives_heard: (Cycle, Instant),
    started: Instant,
    run_outcome: RunOutcome,
    submission: Option<Submission>,
}

impl<'a> JobRun<'a> {
    /// Prepares the job in its run folder, which must exist and is cleared.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn prepare(
        pipeline: &'a mut Pipeline,
        job: &JobRequest,
        folder: RunFolder,
        started: Instant,
        submission: Option<Submission>,
    ) -> Result<Self, Failure> {
        folder.clear().map_err(Failure::bad_input)?;
        let request = serde_json::to_vec_pretty(job).map_err(Failure::service)?;
        folder.write(run_folder::REQUEST, request).map_err(Failure::bad_input)?;
        let name = job_name(job);
        pipeline.board.name_job(Some((&name, folder.path())));
        let run_outcome = RunOutcome { job: name.clone(), ..RunOutcome::default() };
        Ok(Self {
            control: pipeline.control.clone(),
            pipeline,
            folder,
            name,
            stream: None,
            stage: Stage::Starting(PowerUp::begin()),
            played: false,
            refused: None,
            quiet: None,
            time_left: 0.0,
            drives_heard: (Cycle::default(), Instant::now()),
            started,
            run_outcome,
            submission,
        })
    }

    /// Follows the job to its end and writes its summary.
    pub fn follow(mut self) -> Summary {
        let line = ProgressLine::on_terminal();
        loop {
            match self.pipeline.poll() {
                Ok(ended) => {
                    for ended in ended {
                        line.clear();
                        self.note_ended(&ended);
                    }
                }
                // Without channels there is nothing to wait for; what follows ends the machine.
                Err(failure) => {
                    self.end_with(failure.refusal.message);
                    break;
                }
            }
            if let Some(message) = self.missing() {
                self.end_with(message.into());
            }
            match self.advance() {
                Ok(false) => {}
                Ok(true) => break,
                Err(failure) => self.end_with(failure.refusal.message),
            }
            if self.heed_people() {
                break;
            }
            self.time_left = self.pipeline.latest.time_left().unwrap_or(self.time_left);
            let (share, text) = self.progress();
            line.draw(share, &text);
            if let Some(submission) = &self.submission {
                // A submitter that left hears nothing; the job goes on.
                let _ = submission.events.send(JobEvent::Share(share));
            }
            std::thread::sleep(POLL_INTERVAL);
        }
        line.clear();
        self.conclude()
    }

    /// Goes on to the next stage when its time has come; whether the job has ended.
    fn advance(&mut self) -> Result<bool, Failure> {
        match self.stage {
            Stage::Starting(mut power_up) => {
                let ready = power_up.advance(self.pipeline);
                self.stage = Stage::Starting(power_up);
                match ready {
                    Ok(false) => {}
                    Ok(true) => self.offer()?,
                    Err(NotReady::Faulted(fault)) => self.fail(fault),
                    Err(other) => self.end_with(other.to_string()),
                }
            }
            Stage::Planning | Stage::Ready(_) if self.latched().is_some() => {
                self.fail(self.latched());
            }
            Stage::Planning => return self.heed_planner(),
            Stage::Ready(_) | Stage::Playing if self.is_refused_late() => self.give_up(),
            Stage::Ready(since) => self.play(since),
            Stage::Playing | Stage::Resting(_) => return Ok(self.is_over()),
        }
        Ok(false)
    }

    fn offer(&mut self) -> Result<(), Failure> {
        let path = std::path::absolute(self.folder.path()).map_err(|error| {
            Failure::bad_input(format!("{}: {error}", self.folder.path().display()))
        })?;
        self.run_outcome.overruns_before = self.pipeline.latest.drives.overruns;
        self.stream = Some(self.pipeline.offer(&path.to_string_lossy())?);
        self.stage = Stage::Planning;
        Ok(())
    }

    /// Whether the planner has refused the job; a plan that it streams is ready to be played.
    fn heed_planner(&mut self) -> Result<bool, Failure> {
        let report = self.pipeline.latest.planner;
        if Some(report.stream) != self.stream {
            return Ok(false);
        }
        match PlannerPhase::from_wire(report.phase) {
            PlannerPhase::Refused => {
                self.refuse();
                return Ok(true);
            }
            PlannerPhase::Streaming => {
                self.run_outcome.plan_time = report.plan_time;
                self.stage = Stage::Ready(Instant::now());
            }
            _ => {}
        }
        Ok(false)
    }

    /// Whether the planner found only while the job was played that it cannot be done.
    fn is_refused_late(&self) -> bool {
        let report = self.pipeline.latest.planner;
        Some(report.stream) == self.stream
            && PlannerPhase::from_wire(report.phase) == PlannerPhase::Refused
    }

    /// Stops a job that is played and cannot be done to its end.
    fn give_up(&mut self) {
        self.refuse();
        if self.played {
            self.run_outcome.outcome = Some(Outcome::Aborted);
            self.pipeline.ask(OperatorVerb::Stop, 0.0);
        }
        self.rest();
    }

    /// Hands the job to the controller as soon as it is recorded, or nobody is there to record it,
    /// and nobody holds it.
    fn play(&mut self, since: Instant) {
        let recorded = self.folder.file(run_folder::SAMPLES).exists();
        let awaited = self.pipeline.has(Role::Monitor) || self.pipeline.starts(Role::Monitor);
        if !recorded && awaited && since.elapsed() < OPENING_PATIENCE {
            return;
        }
        let stream = self.stream.unwrap_or_default();
        if !self.control.play() {
            return;
        }
        if !recorded {
            self.run_outcome.warnings.push("the monitor is not recording this job".into());
        }
        let answer = self.pipeline.request(OperatorVerb::Start, stream as f64, WORD_PATIENCE);
        if !answer.is_ok_and(|reply| reply.accepted == 0) {
            // Without an answer it may be playing all the same.
            self.stage = Stage::Playing;
            self.played = true;
            return;
        }
        // The fault for which it refuses is heard with the next poll, if there is one.
        let refused = *self.refused.get_or_insert_with(Instant::now);
        if refused.elapsed() > WORD_PATIENCE {
            self.end_with("the controller refused to start the job".into());
        }
    }

    /// Whether the controller has said how the job ended, or nothing more can be expected of it.
    fn is_over(&mut self) -> bool {
        let report = self.pipeline.latest.controller;
        if Some(report.stream) == self.stream && report.is_final == 1 {
            self.run_outcome.controller = Some(report);
            return true;
        }
        self.hear_drives();
        let since = match self.stage {
            // What was never played only holds, or is being stopped.
            Stage::Resting(since) if !self.played => {
                let holds =
                    self.pipeline.has(Role::Controller) && !self.run_outcome.latched.is_some();
                let gone = !self.pipeline.has(Role::Drives);
                let at_rest = is_dark_and_at_rest(&self.pipeline.latest);
                return holds || gone || at_rest || since.elapsed() > UNPLAYED_PATIENCE;
            }
            Stage::Resting(since) => Some(since),
            _ => None,
        };
        let latest = &self.pipeline.latest;
        // Without drives nothing moves, and axes that drives has stopped rest by themselves.
        let gone = !self.pipeline.has(Role::Drives);
        let at_rest =
            is_dark_and_at_rest(latest) && (since.is_some() || latest.drives.fault.is_some());
        self.quiet =
            if gone || at_rest { self.quiet.or_else(|| Some(Instant::now())) } else { None };
        let silent = self.quiet.is_some_and(|quiet| quiet.elapsed() > WORD_PATIENCE);
        if silent && since.is_none() {
            self.fail(latest.drives.fault);
        }
        silent || since.is_some_and(|since| since.elapsed() > REST_PATIENCE)
    }

    /// Gives a job up that is being played while drives says nothing: it reports ten times a second.
    fn hear_drives(&mut self) {
        let cycle = self.pipeline.latest.drives.cycle;
        if cycle != self.drives_heard.0 {
            self.drives_heard = (cycle, Instant::now());
        } else if self.drives_heard.1.elapsed() > DRIVES_PATIENCE {
            self.end_with(format!(
                "drives said nothing for {} s: it is stopped or hangs",
                DRIVES_PATIENCE.as_secs()
            ));
        }
    }

    /// The fault that the controller or drives holds.
    fn latched(&self) -> Fault {
        let latest = &self.pipeline.latest;
        if latest.progress.fault.is_some() { latest.progress.fault } else { latest.drives.fault }
    }

    fn progress(&self) -> (f64, String) {
        let latest = &self.pipeline.latest;
        let what = match self.stage {
            Stage::Starting(_) => "starting".to_owned(),
            Stage::Planning => "planning".to_owned(),
            Stage::Ready(_) if self.control.is_held() => "held".to_owned(),
            Stage::Ready(_) => "starting".to_owned(),
            Stage::Playing => {
                let strokes = match latest.planner.is_complete {
                    0 => String::new(),
                    _ => format!(" of {}", latest.planner.strokes),
                };
                let left = match latest.time_left() {
                    Some(left) => format!(", {} left", duration(left)),
                    None => String::new(),
                };
                let rate = latest.progress.rate * 100.0;
                format!("stroke {}{strokes}, rate {rate:.0} %{left}", latest.progress.stroke)
            }
            Stage::Resting(_) => "coming to rest".to_owned(),
        };
        let is_ours = Some(latest.progress.stream) == self.stream;
        let share = if is_ours { latest.share() } else { 0.0 };
        (share, format!("{}: {what}", self.name))
    }

    /// A signal or a person's `stop`: laser, then axes; a job that is not played yet is withdrawn.
    /// A second signal says that the person is in a hurry: whether to wait for nothing more.
    fn heed_people(&mut self) -> bool {
        if signal::termination().is_none() && !self.control.is_stopped() {
            return false;
        }
        if !matches!(self.stage, Stage::Resting(_)) {
            self.run_outcome.outcome = Some(Outcome::Stopped);
            self.rest();
            if self.played {
                self.pipeline.ask(OperatorVerb::Stop, 0.0);
            }
        }
        self.in_a_hurry()
    }

    /// A service has ended by itself: says so at once, and what is done about it.
    fn note_ended(&mut self, ended: &Ended) {
        let consequence = match (ended.role, self.stage) {
            (Role::Monitor, _) => "; the job goes on without harm",
            (_, Stage::Starting(_)) => " while starting",
            (Role::Planner, _) => {
                ": laser off, the controller brings the axes to rest along the path"
            }
            (Role::Controller, _) => ": laser off, drives stops the axes",
            (Role::Drives, _) => ": the simulated plant is gone with it",
            (Role::Domain | Role::Observer, _) => "",
        };
        let message = format!("{ended}{consequence}");
        message::tell(&message);
        match ended.recovery {
            Recovery::Stop => {
                if !self.run_outcome.latched.is_some() {
                    self.run_outcome.latched = Fault::new(death_of(ended.role));
                }
                self.end_with(message);
            }
            _ => self.run_outcome.warnings.push(message),
        }
    }

    /// What ails a job whose services somebody else starts, when one that it cannot end without is
    /// gone. Of the others' deaths the controller tells.
    fn missing(&self) -> Option<&'static str> {
        if self.pipeline.owner() == ServiceOwner::Own {
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
        if self.run_outcome.error.is_none() {
            self.run_outcome.error =
                Some(ErrorSummary { file: None, line: None, column: None, message });
            self.run_outcome.outcome = Some(Outcome::Aborted);
        }
        self.rest();
    }

    /// A fault that the controller does not report with the stream.
    fn fail(&mut self, fault: Fault) {
        self.run_outcome.latched = fault;
        self.run_outcome.outcome = Some(Outcome::Faulted);
        self.rest();
    }

    fn rest(&mut self) {
        if !matches!(self.stage, Stage::Resting(_)) {
            self.stage = Stage::Resting(Instant::now());
        }
    }

    /// Takes over why the planner refused. Where the run folder could not be written, the planner
    /// has left its reasons in the domain's directory.
    fn refuse(&mut self) {
        let places =
            [self.folder.file(run_folder::REFUSAL), self.pipeline.root().join(run_folder::REFUSAL)];
        let read = |path: &std::path::PathBuf| {
            serde_json::from_slice::<Refusal>(&std::fs::read(path).ok()?).ok()
        };
        let refusal = places.iter().find_map(read).unwrap_or_else(|| {
            Refusal::internal(format!(
                "the planner refused the job, and {} cannot be read",
                places[0].display()
            ))
        });
        message::tell(refusal.text.trim());
        self.run_outcome.outcome = Some(Outcome::Refused);
        self.run_outcome.error = Some(error_summary(&refusal));
    }

    fn conclude(mut self) -> Summary {
        if self.stream.is_some() {
            if self.run_outcome.controller.is_none() {
                // The planner rests, and the monitor ends its recording. Without channels neither
                // can be told; they end with the domain.
                let _ = self.pipeline.close();
            }
            self.await_recording();
        }
        self.run_outcome.drives = Some(self.drives_with_cause());
        let is_completed = self.run_outcome.controller.is_some_and(|it| it.completed == 1);
        if !is_completed && self.played {
            self.run_outcome.time_left = self.time_left;
        }
        if !self.run_outcome.latched.is_some() {
            self.run_outcome.latched = self.pipeline.latest.progress.fault;
        }
        let machine = &self.pipeline.machine;
        self.run_outcome.warnings.splice(0..0, machine.job_warnings());
        let summary = conclusion::conclude(&self.folder, machine, &self.run_outcome, self.started);
        self.pipeline.board.name_job(None);
        self.control.end();
        if let Some(submission) = self.submission.take() {
            operators::tell_end(&submission.events, &summary);
        }
        summary
    }

    /// Waits until the monitor has written all of it, as long as it can be expected to.
    fn await_recording(&mut self) {
        let stream = self.stream.unwrap_or_default();
        let since = Instant::now();
        while RecordingState::of(&self.folder, stream) == RecordingState::Open && !self.in_a_hurry()
        {
            let patience = match self.pipeline.peer(Role::Monitor) {
                Some(monitor) if monitor.is_stopped() => STOPPED_PATIENCE,
                Some(_) => WRITING_PATIENCE,
                None => return,
            };
            if since.elapsed() > patience || self.pipeline.poll().is_err() {
                return;
            }
            std::thread::sleep(POLL_INTERVAL);
        }
    }

    /// Whether a person has asked twice for the end.
    fn in_a_hurry(&self) -> bool {
        signal::termination().is_some_and(|termination| termination.count > 1)
    }

    /// What drives reported, with the cause of a death that the dead cannot tell: a controller
    /// without feedback says nothing, and drives without commands may name those first.
    fn drives_with_cause(&self) -> DrivesReport {
        let mut drives = self.pipeline.latest.drives;
        if self.run_outcome.controller.is_some() || self.run_outcome.error.is_none() {
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
}

/// The fault that the death of a service is.
fn death_of(role: Role) -> FaultCode {
    match role {
        Role::Planner => FaultCode::PlannerLost,
        Role::Controller => FaultCode::ControllerLost,
        Role::Drives => FaultCode::DrivesLost,
        Role::Domain => FaultCode::SupervisorLost,
        Role::Monitor | Role::Observer => FaultCode::None,
    }
}

fn job_name(job: &JobRequest) -> String {
    let stem = job.job.as_deref().and_then(|path| path.file_stem());
    stem.map_or_else(|| "letters".to_owned(), |stem| stem.to_string_lossy().into_owned())
}
