//! The machine as grbl knows it: what the operators' socket answers.

use grbl::machine::{Answer, Ask, JobState, Machine};
use operator::{Client, ClientError, Queue, Request, Status, Submitted, Verb, VerbReply};
use planner::request::JobRequest;

/// A machine behind the operators' socket.
pub(super) struct Operated {
    client: Client,
}

impl Operated {
    pub(super) fn new(client: Client) -> Self {
        Self { client }
    }

    fn verb(&self, request: &Request) -> Result<Answer, ClientError> {
        self.client.ask_for::<VerbReply>(request).map(Answer::from)
    }

    /// Puts a program into the queue. One that is held begins with it where nothing else waits: whoever sends a program
    /// is at the machine.
    fn submit(&self, job: JobRequest) -> Result<Answer, ClientError> {
        // What holds it afterwards only is a stop that this program must not undo.
        let held = self.queue()?.held;
        let request = Request::Submit { job, out: None, detached: true };
        let Submitted { number, .. } = self.client.ask_for(&request)?;
        let queue = self.queue()?;
        let is_alone = queue.waiting.iter().all(|job| job.number == number);
        if queue.held.is_some() && queue.held == held && is_alone {
            self.client.ask(&Request::StartQueue)?;
        }
        Ok(Answer::Submitted(number))
    }

    fn queue(&self) -> Result<Queue, ClientError> {
        self.client.ask_for(&Request::Queue)
    }

    fn carry_out(&self, ask: &Ask) -> Result<Answer, ClientError> {
        match ask.clone() {
            Ask::Verb { verb, value } => self.verb(&Request::Verb { verb, value }),
            Ask::Operate { verb, axes, value, second } => {
                let has_way = matches!(verb, Verb::Step | Verb::Probe);
                let unit = has_way.then(|| "m".to_owned());
                self.verb(&Request::Operate { verb, axes, value, second, unit })
            }
            Ask::Output { name, is_on } => self.verb(&Request::Output { name, is_on }),
            Ask::Submit { file, set } => {
                self.submit(JobRequest { job: Some(file), set, offsets: None, confined: true })
            }
            Ask::Withdraw { job } => {
                self.client.ask(&Request::Withdraw { job })?;
                Ok(Answer::Done(0))
            }
        }
    }
}

impl Machine for Operated {
    fn status(&self) -> Result<Status, String> {
        self.client.status().map_err(|error| error.to_string())
    }

    fn ask(&self, ask: &Ask) -> Answer {
        self.carry_out(ask).unwrap_or_else(|error| Answer::Refused(error.to_string()))
    }

    fn job(&self, number: u64) -> Result<JobState, String> {
        let queue = self.queue().map_err(|error| error.to_string())?;
        let goes = queue.running.iter().chain(&queue.waiting).any(|job| job.number == number);
        if goes {
            return Ok(JobState::Goes);
        }
        let ended = queue.ended.into_iter().rev().find(|job| job.number == number);
        Ok(match ended {
            Some(job) => {
                let outcome = job.outcome.unwrap_or_else(|| "aborted".to_owned());
                JobState::Ended { outcome, message: job.message }
            }
            None => {
                let message = Some("the pipeline knows nothing of it any more".to_owned());
                JobState::Ended { outcome: "aborted".to_owned(), message }
            }
        })
    }
}
