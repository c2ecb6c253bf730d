//! The pipeline of a machine as its fleet sees it.

use operator::fleet::JobRefusal;
use operator::{Queue, QueuedJob, Status};
use std::path::Path;

/// Whether a machine can do a job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// It can.
    Fit,
    /// It cannot, and will not later either.
    Refused(JobRefusal),
    /// That cannot be told now, for this reason.
    Unknown(String),
}

/// A pipeline, whether or not it runs. Each call may take its time, and none is made on the thread of the hub.
pub trait Pipeline: Send + Sync + 'static {
    /// What it is doing.
    ///
    /// # Errors
    /// No pipeline, or one that does not answer, in words.
    fn status(&self) -> Result<Status, String>;

    /// Its jobs.
    ///
    /// # Errors
    /// As [`Self::status`].
    fn queue(&self) -> Result<Queue, String>;

    /// Whether its machine can do the job in `file` with these changes. What a stranger sent is read in bounds, and no path that
    /// stands in it is opened. `is_given_up` says that nobody waits for the answer any more.
    fn check(&self, file: &Path, set: &[String], is_given_up: &dyn Fn() -> bool) -> Verdict;

    /// Puts the job into its queue, which is on disk when this returns; its number there.
    ///
    /// # Errors
    /// No pipeline, or one that takes no job now, in words.
    fn submit(&self, file: &Path, set: &[String]) -> Result<u64, String>;

    /// Tells the people at the machine.
    fn tell(&self, text: &str);
}

/// Why a pipeline takes no job of the fleet now; `None` where it waits for one.
pub(crate) fn busy(
    status: &Result<Status, String>,
    queue: &Result<Queue, String>,
) -> Option<String> {
    let (status, queue) = match (status, queue) {
        (Ok(status), Ok(queue)) => (status, queue),
        (Err(error), _) | (_, Err(error)) => return Some(error.clone()),
    };
    if let Some(fault) = &status.fault {
        return Some(format!("fault {fault}: a person must reset it"));
    }
    if let Some(why) = &queue.held {
        return Some(format!("the queue is held: {why}"));
    }
    if let Some(QueuedJob { number, .. }) = &queue.running {
        return Some(format!("job {number} is under way"));
    }
    if !queue.waiting.is_empty() {
        return Some(format!("{} jobs wait at the machine", queue.waiting.len()));
    }
    if !status.unhomed.is_empty() {
        return Some(format!("axes {} have to be homed", status.unhomed.join(", ")));
    }
    match status.state.as_str() {
        "idle" | "disabled" => None,
        state => Some(format!("the machine is {state}")),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_machine_takes_a_job_only_when_nothing_else_is_to_be_done_first() {
        let status = Status { state: "idle".to_owned(), ..Status::default() };
        let queue = Queue::default();
        let of = |status: &Status, queue: &Queue| busy(&Ok(status.clone()), &Ok(queue.clone()));
        assert_eq!(of(&status, &queue), None);
        assert_eq!(of(&Status { state: "disabled".to_owned(), ..Status::default() }, &queue), None);
        let job = || QueuedJob { number: 7, ..QueuedJob::default() };
        for (status, queue, word) in [
            (
                Status { fault: Some("overload".to_owned()), ..status.clone() },
                queue.clone(),
                "overload",
            ),
            (
                status.clone(),
                Queue { held: Some("job 3 faulted".to_owned()), ..queue.clone() },
                "job 3",
            ),
            (status.clone(), Queue { running: Some(job()), ..queue.clone() }, "job 7"),
            (status.clone(), Queue { waiting: vec![job()], ..queue.clone() }, "1 jobs wait"),
            (Status { unhomed: vec!["x".to_owned()], ..status.clone() }, queue.clone(), "homed"),
            (Status { state: "jogging".to_owned(), ..status.clone() }, queue.clone(), "jogging"),
        ] {
            let why = of(&status, &queue).unwrap();
            assert!(why.contains(word), "{why}");
        }
        assert_eq!(busy(&Err("none".to_owned()), &Ok(queue)), Some("none".to_owned()));
    }
}
