//! The jobs of an instance: the one under way, those that wait, and those that have ended.
//!
//! They are kept on disk, beside the faults, so that a pipeline that ends takes no job with it. One that was under way
//! then shows as aborted, and those that wait begin only when a person says so: nobody may be at the machine any more.

mod kept;

use super::control::JobControl;
use crate::exit::Failure;
use crossbeam::channel::Sender;
use kept::{Contents, Kept};
use monitor::summary::{Outcome, Summary};
use operator::{Queue, QueuedJob};
use planner::request::JobRequest;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

pub use kept::path;

/// Jobs that can wait.
const MOST_WAITING: usize = 100;

/// Jobs that have ended and are remembered.
const MOST_ENDED: usize = 100;

/// The longest that the texts of a job may be together [bytes]: all jobs go into one answer.
const LONGEST_JOB: usize = 4096;

/// What whoever submitted a job is told of it.
pub enum JobEvent {
    /// How far it has come, 0 to 1.
    Share(f64),
    /// The end: the summary, or an error.
    End(Value),
}

/// A job that was asked for.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Entry {
    /// What people see of it.
    #[serde(flatten)]
    pub job: QueuedJob,
    /// Below which folder its run folder is made when its turn comes; `None` where it has one, or for the folder in
    /// which the pipeline was started.
    #[serde(default)]
    pub below: Option<PathBuf>,
}

impl Entry {
    /// The job as the planner is asked for it, without the offsets of its turn.
    pub fn request(&self) -> JobRequest {
        let job = self.job.file.as_ref().map(PathBuf::from);
        JobRequest { job, set: self.job.set.clone(), offsets: None, confined: self.job.confined }
    }
}

#[derive(Default)]
struct State {
    contents: Contents,
    kept: Kept,
    /// Who follows which job.
    followers: BTreeMap<u64, Sender<JobEvent>>,
}

/// All jobs of an instance. Operators' threads and the supervisor's loop share it.
#[derive(Default)]
pub struct JobQueue {
    state: Mutex<State>,
}

impl JobQueue {
    /// Goes on with the jobs in the file at `path`; without one they are forgotten with the pipeline.
    pub fn open(path: Option<PathBuf>) -> Self {
        let (kept, mut contents) = Kept::open(path);
        let is_left = contents.running.is_some() || !contents.waiting.is_empty();
        if let Some(mut lost) = contents.running.take() {
            let message = "the pipeline ended while the job was under way".to_owned();
            note_end(&mut lost.job, Outcome::Aborted, Some(message));
            contents.remember(lost.job);
        }
        if !contents.waiting.is_empty() {
            let cause = "the pipeline was started again while jobs waited";
            contents.held.get_or_insert_with(|| cause.to_owned());
        }
        let mut state = State { contents, kept, ..State::default() };
        if is_left {
            state.save();
        }
        Self { state: Mutex::new(state) }
    }

    /// Adds a job behind those that wait. Its number.
    ///
    /// # Errors
    /// Too many jobs, or one whose changes are too long, in words.
    pub fn submit(
        &self,
        job: &JobRequest,
        out: Option<&Path>,
        follower: Option<Sender<JobEvent>>,
    ) -> Result<u64, String> {
        let mut state = self.lock();
        let entry = Entry { job: described(job, out), below: None };
        let number = state.add(entry)?;
        state.followers.extend(follower.map(|follower| (number, follower)));
        state.save();
        Ok(number)
    }

    /// Puts a job under way that nobody submitted, `graver run`'s own. Its number.
    pub fn begin_own(&self, job: &JobRequest, out: &Path, control: &JobControl) -> u64 {
        let mut state = self.lock();
        let entry = Entry { job: described(job, Some(out)), below: None };
        let number = state.contents.number(entry);
        let entry = state.contents.waiting.pop();
        state.begin(entry, control);
        number
    }

    /// Puts the next job under way, unless the queue is held or the machine is being stopped.
    pub fn begin_next(&self, control: &JobControl) -> Option<Entry> {
        let mut state = self.lock();
        let is_held = state.contents.held.is_some() || control.is_stopping();
        if is_held || state.contents.waiting.is_empty() {
            return None;
        }
        let next = state.contents.waiting.remove(0);
        state.begin(Some(next), control)
    }

    /// Notes the run folder of the job under way.
    pub fn note_folder(&self, folder: &Path) {
        let mut state = self.lock();
        if let Some(running) = &mut state.contents.running {
            running.job.out = Some(whole(folder));
        }
        state.save();
    }

    /// Tells whoever follows the job under way how far it has come.
    pub fn tell_share(&self, number: u64, share: f64) {
        if let Some(follower) = self.lock().followers.get(&number) {
            // A submitter that left hears nothing; the job goes on.
            let _ = follower.send(JobEvent::Share(share));
        }
    }

    /// The job under way is over. What a person should see before the next one begins holds the queue.
    pub fn end(&self, summary: &Summary) {
        let mut state = self.lock();
        let Some(mut entry) = state.contents.running.take() else { return };
        let fault = summary.fault.as_ref().map(ToString::to_string);
        let message = fault.or_else(|| summary.error.as_ref().map(ToString::to_string));
        note_end(&mut entry.job, summary.outcome, message);
        let number = entry.job.number;
        state.contents.remember(entry.job);
        if matches!(summary.outcome, Outcome::Faulted | Outcome::Aborted) {
            let how = summary.outcome.name();
            state.contents.hold(&format!("job {number} {how}"));
        }
        state.tell_end(number, json!(summary));
        state.save();
    }

    /// Takes a job back: one that waits is gone at once, one under way is stopped.
    ///
    /// # Errors
    /// No such job, in words.
    pub fn withdraw(&self, number: u64, control: &JobControl) -> Result<Queue, String> {
        let mut state = self.lock();
        if state.contents.running.as_ref().is_some_and(|it| it.job.number == number) {
            control.stop();
            return Ok(state.contents.list());
        }
        let place = state.contents.place(number)?;
        let mut entry = state.contents.waiting.remove(place);
        let message = "withdrawn before its turn came".to_owned();
        let failure = Failure::stopped(format!("the job was {message}"));
        note_end(&mut entry.job, Outcome::Stopped, Some(message));
        state.contents.remember(entry.job);
        state.contents.forget_hold();
        state.tell_end(number, json!(failure.summary()));
        state.save();
        Ok(state.contents.list())
    }

    /// Puts a job that waits at another place, from 1.
    ///
    /// # Errors
    /// No such job or place, in words.
    pub fn move_to(&self, number: u64, place: usize) -> Result<Queue, String> {
        let mut state = self.lock();
        let from = state.contents.place(number)?;
        let count = state.contents.waiting.len();
        if !(1..=count).contains(&place) {
            return Err(format!("there is no place {place}: {count} jobs wait, at 1 to {count}"));
        }
        let entry = state.contents.waiting.remove(from);
        state.contents.waiting.insert(place - 1, entry);
        state.save();
        Ok(state.contents.list())
    }

    /// Adds a job once more. Its new number.
    ///
    /// # Errors
    /// No such job, or too many, in words.
    pub fn repeat(&self, number: u64) -> Result<u64, String> {
        let mut state = self.lock();
        let Some(job) = state.contents.find(number) else {
            return Err(format!("there is no job {number}: `graver queue list` names them"));
        };
        let QueuedJob { name, file, set, confined, out, .. } = job.clone();
        // Beside the folder of the run before, which is kept.
        let runs = out.as_deref().map(Path::new).and_then(Path::parent);
        let runs = runs.filter(|runs| runs.file_name().is_some_and(|name| name == "runs"));
        let below = runs.and_then(Path::parent).map(Path::to_owned);
        let submitted = now();
        let job = QueuedJob { name, file, set, confined, submitted, ..QueuedJob::default() };
        let number = state.add(Entry { job, below })?;
        state.save();
        Ok(number)
    }

    /// Begins no other job that waits, for this cause. Where none waits there is nothing to hold.
    pub fn hold(&self, cause: &str) -> Queue {
        let mut state = self.lock();
        state.contents.hold(cause);
        state.save();
        state.contents.list()
    }

    /// Begins the jobs that wait, one after the other.
    pub fn start(&self) -> Queue {
        let mut state = self.lock();
        state.contents.held = None;
        state.save();
        state.contents.list()
    }

    /// All jobs.
    pub fn list(&self) -> Queue {
        self.lock().contents.list()
    }

    /// Why the jobs that wait do not begin.
    pub fn held(&self) -> Option<String> {
        self.lock().contents.held.clone()
    }

    /// Tells whoever follows a job that waits that it is kept.
    pub fn close(&self) {
        let mut state = self.lock();
        for (number, follower) in std::mem::take(&mut state.followers) {
            let kept = match state.kept.path() {
                Some(_) => "it is kept, and waits until `graver queue start`",
                None => "it is lost: jobs could not be kept",
            };
            let error = format!("the pipeline ended before job {number} began; {kept}");
            let _ = follower.send(JobEvent::End(json!({ "error": error })));
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Every change is whole: a thread that panicked left nothing half done.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn add(&mut self, entry: Entry) -> Result<u64, String> {
        let QueuedJob { name, file, set, out, .. } = &entry.job;
        let texts = [Some(name), file.as_ref(), out.as_ref()].into_iter().flatten().chain(set);
        let length: usize = texts.map(String::len).sum();
        if length > LONGEST_JOB {
            return Err(format!(
                "the job's changes and paths have {length} bytes, more than {LONGEST_JOB}: write the changes into a \
                 job file"
            ));
        }
        if self.contents.waiting.len() >= MOST_WAITING {
            return Err(format!("{MOST_WAITING} jobs wait already; submit again later"));
        }
        Ok(self.contents.number(entry))
    }

    fn begin(&mut self, entry: Option<Entry>, control: &JobControl) -> Option<Entry> {
        let mut entry = entry?;
        entry.job.started = Some(now());
        control.begin();
        self.contents.running = Some(entry.clone());
        self.contents.forget_hold();
        self.save();
        Some(entry)
    }

    fn tell_end(&mut self, number: u64, reply: Value) {
        if let Some(follower) = self.followers.remove(&number) {
            // A submitter that has left is told nothing.
            let _ = follower.send(JobEvent::End(reply));
        }
    }

    fn save(&mut self) {
        self.kept.write(&self.contents);
    }
}

impl Contents {
    /// Adds a job under a number of its own, which it gives.
    fn number(&mut self, mut entry: Entry) -> u64 {
        self.newest += 1;
        entry.job.number = self.newest;
        self.waiting.push(entry);
        self.newest
    }

    /// Where a job waits.
    fn place(&self, number: u64) -> Result<usize, String> {
        let place = self.waiting.iter().position(|entry| entry.job.number == number);
        place.ok_or_else(|| match self.find(number) {
            Some(QueuedJob { outcome: Some(outcome), .. }) => {
                format!("job {number} has ended: {outcome}")
            }
            Some(_) => format!("job {number} is under way: it does not wait any more"),
            None => format!("there is no job {number}: `graver queue list` names them"),
        })
    }

    fn find(&self, number: u64) -> Option<&QueuedJob> {
        let known = self.running.iter().chain(&self.waiting).map(|entry| &entry.job);
        known.chain(&self.ended).find(|job| job.number == number)
    }

    fn remember(&mut self, job: QueuedJob) {
        self.ended.push(job);
        let beyond = self.ended.len().saturating_sub(MOST_ENDED);
        self.ended.drain(..beyond);
    }

    fn hold(&mut self, cause: &str) {
        if !self.waiting.is_empty() {
            self.held.get_or_insert_with(|| cause.to_owned());
        }
    }

    /// Where no job waits, the next one that is submitted is one that a person asks for now.
    fn forget_hold(&mut self) {
        if self.waiting.is_empty() {
            self.held = None;
        }
    }

    fn list(&self) -> Queue {
        Queue {
            running: self.running.as_ref().map(|entry| entry.job.clone()),
            waiting: self.waiting.iter().map(|entry| entry.job.clone()).collect(),
            ended: self.ended.clone(),
            held: self.held.clone(),
        }
    }
}

/// What people see of a job that was just asked for.
fn described(job: &JobRequest, out: Option<&Path>) -> QueuedJob {
    QueuedJob {
        name: super::job_run::job_name(job),
        file: job.job.as_deref().map(whole),
        set: job.set.clone(),
        confined: job.confined,
        out: out.map(whole),
        submitted: now(),
        ..QueuedJob::default()
    }
}

fn note_end(job: &mut QueuedJob, outcome: Outcome, message: Option<String>) {
    job.ended = Some(now());
    job.outcome = Some(outcome.name().to_owned());
    job.message = message;
}

/// A path as it holds from anywhere.
fn whole(path: &Path) -> String {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string()
}

/// Seconds since 1970.
fn now() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs()
}
