//! One job in a pipeline, from the start of the machine to the summary.

mod conclude;
mod held;
mod homing;
mod place;
mod progress;
mod slow;
mod watch;

use watch::WORD_PATIENCE;

use super::control::JobControl;
use super::power_up::{NotReady, PowerUp};
use super::{POLL_INTERVAL, Pipeline};
use crate::exit::Failure;
use crate::output::progress::{JobProgress, ProgressLine};
use messages::{Cycle, Fault, OperatorVerb, PlannerPhase, run_folder};
use monitor::conclusion::{RecordingState, RunOutcome};
use monitor::run_folder::RunFolder;
use monitor::summary::{ErrorSummary, Outcome, Summary};
use planner::request::JobRequest;
use runtime::domain::Role;
use runtime::signal;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long the monitor may take to open its recording: without it the job runs unrecorded.
const OPENING_PATIENCE: Duration = Duration::from_secs(2);

/// How far a job has come.
#[derive(Debug, Clone, Copy)]
enum Stage {
    /// Waiting for the services and the motors.
    Starting(PowerUp),
    /// Homing, accepted under this number.
    Homing(u32),
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
    /// Whether axes that do not know their place are homed first.
    homes: bool,
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
    /// The job file.
    file: Option<String>,
    /// The newest cycle of drives that was heard of, and when.
    drives_heard: (Cycle, Instant),
    started: Instant,
    run_outcome: RunOutcome,
    /// Its number in the queue.
    number: u64,
    /// The interlocks and warnings that its summary tells already, one bit for each input.
    told: u64,
    holds: held::OwnHolds,
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
        number: u64,
    ) -> Result<Self, Failure> {
        folder.clear().map_err(Failure::bad_input)?;
        let request = serde_json::to_vec_pretty(job).map_err(Failure::service)?;
        folder.write(run_folder::REQUEST, request).map_err(Failure::bad_input)?;
        let name = job_name(job);
        pipeline.board.begin_job(number, &name, folder.path(), started);
        let run_outcome = RunOutcome { job: name, ..RunOutcome::default() };
        Ok(Self {
            control: pipeline.control.clone(),
            pipeline,
            folder,
            homes: false,
            stream: None,
            stage: Stage::Starting(PowerUp::begin()),
            played: false,
            refused: None,
            quiet: None,
            time_left: 0.0,
            file: job.job.as_ref().map(|file| file.display().to_string()),
            drives_heard: (Cycle::default(), Instant::now()),
            started,
            run_outcome,
            number,
            told: 0,
            holds: held::OwnHolds::default(),
        })
    }

    /// Follows the job to its end and writes its summary.
    pub fn follow(mut self) -> Summary {
        let line = ProgressLine::begin();
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
            self.note_place();
            self.note_inputs();
            self.note_holds();
            self.pipeline.board.note_stage(self.stage());
            let board = &self.pipeline.board;
            line.draw(|| Some(JobProgress::of(&board.read())));
            let latest = &self.pipeline.latest;
            let is_ours = Some(latest.progress.stream) == self.stream;
            let share = if is_ours { latest.share() } else { 0.0 };
            self.pipeline.queue.tell_share(self.number, share);
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
                    Ok(true) => self.home_or_offer()?,
                    Err(NotReady::Faulted(fault)) => self.fail(fault),
                    Err(other) => self.end_with(other.to_string()),
                }
            }
            Stage::Homing(_) | Stage::Planning | Stage::Ready(_) if self.latched().is_some() => {
                self.fail(self.latched());
            }
            Stage::Homing(number) => self.heed_homing(number)?,
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
        let stream = self.stream.unwrap_or_default();
        let recorded = RecordingState::of(&self.folder, stream) == RecordingState::Open;
        let awaited = self.pipeline.has(Role::Monitor) || self.pipeline.starts(Role::Monitor);
        if !recorded && awaited && since.elapsed() < OPENING_PATIENCE {
            return;
        }
        if !self.control.play() {
            return;
        }
        if !recorded {
            self.run_outcome.warnings.push("the monitor is not recording this job".into());
        }
        let answer = self.pipeline.request(OperatorVerb::Start, stream as f64, WORD_PATIENCE);
        let reply = answer.ok().filter(|reply| reply.accepted == 0);
        let Some(reply) = reply else {
            // Without an answer it may be playing all the same.
            self.stage = Stage::Playing;
            self.played = true;
            return;
        };
        // The fault for which it refuses is heard with the next poll, if there is one.
        let refused = *self.refused.get_or_insert_with(Instant::now);
        if refused.elapsed() > WORD_PATIENCE {
            self.end_with(self.why_refused(&reply));
        }
    }

    /// The fault that the controller or drives holds.
    fn latched(&self) -> Fault {
        let latest = &self.pipeline.latest;
        if latest.progress.fault.is_some() { latest.progress.fault } else { latest.drives.fault }
    }

    /// A signal or a person's `stop`: laser, then axes; a job that is not played yet is withdrawn.
    /// A second signal says that the person is in a hurry: whether to wait for nothing more.
    fn heed_people(&mut self) -> bool {
        if signal::termination().is_none() && !self.control.is_stopped() {
            return false;
        }
        if !matches!(self.stage, Stage::Resting(_)) {
            self.run_outcome.outcome = Some(Outcome::Stopped);
            let moves = self.played || matches!(self.stage, Stage::Homing(_));
            self.rest();
            if moves {
                self.pipeline.ask(OperatorVerb::Stop, 0.0);
            }
        }
        self.in_a_hurry()
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
}

/// The name of a job before it is read.
pub fn job_name(job: &JobRequest) -> String {
    let stem = job.job.as_deref().and_then(|path| path.file_stem());
    stem.map_or_else(|| "letters".to_owned(), |stem| stem.to_string_lossy().into_owned())
}
