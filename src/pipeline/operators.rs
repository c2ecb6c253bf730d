//! Requests of operators, taken from the domain's socket.
//!
//! Verbs go to the controller, and to the supervisor while the job is not with the controller; a
//! submitted job goes into the queue, and what becomes of it back to whoever follows it.

use super::JobSource;
use super::caps::caps;
use super::control::{JobControl, Phase};
use super::queue::{JobEvent, JobQueue};
use super::refusals;
use super::status::StatusBoard;
use crate::exit::Failure;
use crossbeam::channel::{Receiver, TryRecvError, unbounded};
use machine::Machine;
use messages::{ControllerState, OperatorReply, OperatorRequest, OperatorVerb, Refusal};
use operator::{Part, Queue, Request, Submitted, Verb, VerbReply};
use runtime::Domain;
use runtime::operator::{OperatorError, OperatorLink};
use runtime::socket::{Conversation, OperatorServer};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// How long a job that was just started may take to be played, so that it can be held.
const HOLD_PATIENCE: Duration = Duration::from_secs(1);

/// How long the controller may take to answer a stop or a hold; one that lives takes some
/// milliseconds.
const STOP_PATIENCE: Duration = Duration::from_millis(500);

/// Pause between two tries to hold it.
const HOLD_RETRY: Duration = Duration::from_millis(5);

/// The domain's socket.
pub struct Operators {
    _server: OperatorServer,
}

impl Operators {
    /// Opens the domain's socket.
    ///
    /// # Errors
    /// A socket that cannot be opened.
    pub fn bind(domain: &Domain, answers: Answers, jobs: JobSource) -> Result<Self, Failure> {
        let answer = move |request: Value, conversation: &mut Conversation<'_>| {
            let request = match serde_json::from_value(request) {
                Ok(request) => request,
                Err(error) => return json!({ "error": format!("not a request: {error}") }),
            };
            match request {
                Request::Submit { .. } | Request::Repeat { .. } | Request::StartQueue
                    if jobs == JobSource::Own =>
                {
                    json!({
                        "error": "this pipeline belongs to a `graver run` and takes no other job; \
                                  submit to a `graver domain`"
                    })
                }
                Request::Submit { job, out, detached: true } => {
                    answers.submitted(answers.queue.submit(&job, out.as_deref(), None))
                }
                Request::Submit { job, out, detached: false } => {
                    let (events, follower) = unbounded();
                    match answers.queue.submit(&job, out.as_deref(), Some(events)) {
                        Ok(number) => follow(number, &follower, conversation),
                        Err(error) => json!({ "error": error }),
                    }
                }
                Request::Repeat { job } => answers.submitted(answers.queue.repeat(job)),
                Request::Queue => json!(answers.queue.list()),
                Request::Withdraw { job } => listed(answers.queue.withdraw(job, &answers.control)),
                Request::Move { job, place } => listed(answers.queue.move_to(job, place)),
                Request::HoldQueue => json!(answers.queue.hold("a person holds the queue")),
                Request::StartQueue => json!(answers.queue.start()),
                Request::Status => json!(answers.board.read()),
                Request::Verb { verb, value } => answers.carry_out(verb, value),
                Request::Operate { verb, axes, value, second, unit } => {
                    answers.operate(verb, &axes, unit.as_deref(), [value, second])
                }
                Request::Input { name, is_active } => answers.set_input(&name, is_active),
                Request::Output { name, is_on } => answers.set_output(&name, is_on),
            }
        };
        let server = OperatorServer::bind(domain, answer).map_err(Failure::service)?;
        Ok(Self { _server: server })
    }
}

/// The answer to what changes the queue.
fn listed(queue: Result<Queue, String>) -> Value {
    match queue {
        Ok(queue) => json!(queue),
        Err(error) => json!({ "error": error }),
    }
}

/// Passes on what becomes of a job until it ends or the submitter leaves; the job goes on either
/// way.
fn follow(number: u64, events: &Receiver<JobEvent>, conversation: &mut Conversation<'_>) -> Value {
    if conversation.tell(&json!(Part::Accepted(number))).is_err() {
        return Value::Null;
    }
    loop {
        match events.try_recv() {
            Ok(JobEvent::Share(share)) => {
                if conversation.tell(&json!(Part::Share(share))).is_err() {
                    return Value::Null;
                }
            }
            Ok(JobEvent::End(reply)) => return reply,
            Err(TryRecvError::Disconnected) => {
                return json!({ "error": "the pipeline ended before the job" });
            }
            Err(TryRecvError::Empty) => {
                if !conversation.is_open() {
                    return Value::Null;
                }
                std::thread::sleep(Duration::from_millis(20));
            }
        }
    }
}

/// What operators' requests are answered from.
pub struct Answers {
    link: Arc<OperatorLink>,
    board: Arc<StatusBoard>,
    control: Arc<JobControl>,
    queue: Arc<JobQueue>,
    machine: Machine,
    /// Inputs of a simulated machine that are set, one bit each; `None` where the machine is not simulated.
    inputs: Option<Arc<AtomicU64>>,
}

impl Answers {
    /// Answers for one pipeline.
    pub fn new(
        link: Arc<OperatorLink>,
        board: Arc<StatusBoard>,
        control: Arc<JobControl>,
        queue: Arc<JobQueue>,
        machine: &Machine,
        inputs: Option<Arc<AtomicU64>>,
    ) -> Self {
        Self { link, board, control, queue, machine: machine.clone(), inputs }
    }

    /// The answer to a job that nobody follows.
    fn submitted(&self, number: Result<u64, String>) -> Value {
        match number {
            Ok(number) => json!(Submitted { number, held: self.queue.held() }),
            Err(error) => json!({ "error": error }),
        }
    }

    /// Asks the controller for a verb about axes.
    fn operate(
        &self,
        verb: Verb,
        axes: &[String],
        unit: Option<&str>,
        [value, second]: [f64; 2],
    ) -> Value {
        let mut numbers = Vec::with_capacity(axes.len());
        for name in axes {
            match refusals::axis(&self.machine, name, unit, verb) {
                Ok(number) => numbers.push(number),
                Err((code, words)) => {
                    return json!(VerbReply::refused(code, words, self.board.read().state));
                }
            }
        }
        let axis = match verb {
            Verb::Home => numbers.iter().fold(0, |bits, number| bits | 1 << (number - 1)),
            _ => numbers.first().copied().unwrap_or_default(),
        };
        let number = OperatorVerb::from(verb) as u32;
        let request = OperatorRequest { verb: number, axis, value, second, ..Default::default() };
        self.tell(request, verb)
    }

    /// Why the controller does not answer: one that has died cannot.
    fn silent(&self, error: &OperatorError) -> Value {
        let is_gone = self.board.read().services.get("controller") == Some(&None);
        let error = if is_gone { &OperatorError::NoController } else { error };
        json!({ "error": error.to_string() })
    }

    /// Sets an input of a simulated machine.
    fn set_input(&self, name: &str, is_active: bool) -> Value {
        let state = self.board.read().state;
        let Some((index, _)) = self.machine.operating.input(name) else {
            let words = refusals::no_input(&self.machine, name);
            return json!(VerbReply::refused(Refusal::Unknown, words, state));
        };
        let Some(inputs) = &self.inputs else {
            let words = "the machine is not simulated: its inputs say what is so".to_owned();
            return json!(VerbReply::refused(Refusal::State, words, state));
        };
        let bit = 1 << index;
        if is_active {
            inputs.fetch_or(bit, Ordering::Relaxed);
        } else {
            inputs.fetch_and(!bit, Ordering::Relaxed);
        }
        json!(VerbReply::accepted(&state))
    }

    /// Switches an output.
    fn set_output(&self, name: &str, is_on: bool) -> Value {
        let Some((index, _)) = self.machine.operating.output(name) else {
            let words = refusals::no_output(&self.machine, name);
            return json!(VerbReply::refused(Refusal::Unknown, words, self.board.read().state));
        };
        let request = OperatorRequest {
            verb: OperatorVerb::Output as u32,
            axis: index as u32 + 1,
            value: f64::from(u8::from(is_on)),
            ..OperatorRequest::default()
        };
        self.tell(request, Verb::Output)
    }

    fn tell(&self, request: OperatorRequest, verb: Verb) -> Value {
        match self.link.ask_within(request, STOP_PATIENCE) {
            Ok(reply) => json!(self.told(&reply, verb)),
            Err(error) => self.silent(&error),
        }
    }

    fn carry_out(&self, verb: Verb, value: f64) -> Value {
        match verb {
            Verb::Stop => self.stop(),
            Verb::Hold if self.control.hold() => json!(VerbReply::accepted("preparing")),
            Verb::Hold => self.hold(),
            Verb::Resume if self.control.resume() => json!(VerbReply::accepted("holding")),
            Verb::Override => match self.link.request(verb.into(), value) {
                Ok(reply) => {
                    let folder = self.board.folder();
                    let capped_by = folder.and_then(|folder| caps(&folder, reply.value));
                    json!(VerbReply { capped_by, ..self.told(&reply, verb) })
                }
                Err(error) => self.silent(&error),
            },
            verb => self.ask(verb, value),
        }
    }

    fn ask(&self, verb: Verb, value: f64) -> Value {
        match self.link.request(verb.into(), value) {
            Ok(reply) => json!(self.told(&reply, verb)),
            Err(error) => self.silent(&error),
        }
    }

    /// A stop is never refused: where there is nothing to stop, it has been obeyed already, and
    /// where the controller does not answer, the supervisor ends the job without it.
    fn stop(&self) -> Value {
        let met = self.control.begin_stop();
        let reply =
            self.link.request_within(OperatorVerb::Stop, 0.0, STOP_PATIENCE).map(VerbReply::from);
        // Whoever stops the machine does not want it to begin with something else. The queue goes to the disk, so it comes
        // after the machine.
        self.queue.hold("a person stopped the machine");
        self.control.end_stop();
        match (met, reply) {
            (Phase::Preparing, _) => json!(VerbReply::accepted("preparing")),
            (_, Ok(reply)) => json!(VerbReply { accepted: true, ..reply }),
            (Phase::Playing, Err(_)) => json!(VerbReply::accepted("running")),
            (Phase::None, Err(error)) => self.silent(&error),
        }
    }

    /// A job that was started this instant is held as soon as the controller plays it.
    fn hold(&self) -> Value {
        let asked = Instant::now();
        loop {
            let reply = match self.link.request_within(OperatorVerb::Hold, 0.0, STOP_PATIENCE) {
                Ok(reply) => self.told(&reply, Verb::Hold),
                Err(error) => return self.silent(&error),
            };
            let starting = !reply.accepted
                && reply.state == ControllerState::Idle.name()
                && self.control.phase() == Phase::Playing;
            if !starting || asked.elapsed() > HOLD_PATIENCE {
                return json!(reply);
            }
            std::thread::sleep(HOLD_RETRY);
        }
    }

    /// What the controller said about `verb`.
    fn told(&self, reply: &OperatorReply, verb: Verb) -> VerbReply {
        let interlocks = self.board.read().interlocks;
        let refusal = refusals::words(reply, verb, &self.machine, &interlocks);
        VerbReply { refusal, ..VerbReply::from(*reply) }
    }
}
