//! Requests of operators, taken from the domain's socket.
//!
//! Verbs go straight to the controller; a submitted job waits in a queue for the supervisor's
//! loop, and its progress goes back to whoever submitted it.

use super::Starter;
use super::status::Board;
use crate::exit::Failure;
use crossbeam::channel::{Receiver, Sender, TryRecvError, bounded, unbounded};
use planner::request::JobRequest;
use runtime::Domain;
use runtime::operator::OperatorLink;
use runtime::socket::{Conversation, OperatorServer};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use signals::{ControllerState, OperatorVerb};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// What goes over the socket.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "request")]
pub enum Request {
    /// A verb for the controller.
    Verb {
        /// Its name.
        verb: Verb,
        /// Its argument.
        value: f64,
    },
    /// What is going on?
    Status,
    /// A job to run.
    Submit {
        /// The job.
        job: JobRequest,
        /// The run folder.
        out: Option<PathBuf>,
    },
}

/// A verb by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verb {
    /// Power the motors.
    Enable,
    /// Unpower the motors.
    Disable,
    /// Feed hold.
    Hold,
    /// Go on.
    Resume,
    /// Give the job up.
    Stop,
    /// Clear a fault.
    Reset,
    /// Another rate.
    Override,
}

/// The controller's answer to a verb, as `graver hold --json` and its like print it.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct VerbReply {
    /// Whether it is carried out; otherwise the state does not allow it.
    pub accepted: bool,
    /// The state that the request met.
    pub state: String,
    /// The rate now wanted, 1 as planned.
    pub value: f64,
}

impl From<Verb> for OperatorVerb {
    fn from(verb: Verb) -> Self {
        match verb {
            Verb::Enable => Self::Enable,
            Verb::Disable => Self::Disable,
            Verb::Hold => Self::Hold,
            Verb::Resume => Self::Resume,
            Verb::Stop => Self::Stop,
            Verb::Reset => Self::Reset,
            Verb::Override => Self::Override,
        }
    }
}

/// A job that an operator submitted.
pub struct Submission {
    /// The job.
    pub job: JobRequest,
    /// The run folder.
    pub out: Option<PathBuf>,
    /// Takes parts while it runs and, last, its reply.
    pub news: Sender<News>,
}

/// What a submitter hears.
pub enum News {
    /// How far it has come, 0 to 1.
    Share(f64),
    /// The end: the summary, or why there is none.
    End(Value),
}

/// The socket and the queue of submitted jobs.
pub struct Operators {
    submissions: Receiver<Submission>,
    _server: OperatorServer,
}

impl Operators {
    /// Opens the domain's socket.
    ///
    /// # Errors
    /// A socket that cannot be opened.
    pub fn bind(
        domain: &Domain,
        link: Arc<OperatorLink>,
        board: Arc<Board>,
        starter: Starter,
    ) -> Result<Self, Failure> {
        let (queue, submissions) = bounded(8);
        let server =
            OperatorServer::bind(
                domain,
                move |request, conversation| match serde_json::from_value(request) {
                    Ok(Request::Submit { .. }) if starter == Starter::Own => json!({
                        "error": "this pipeline belongs to a `graver run` and takes no other job; \
                                  submit to a `graver domain`"
                    }),
                    Ok(request) => answer(request, &link, &board, &queue, conversation),
                    Err(error) => json!({ "error": format!("not a request: {error}") }),
                },
            )
            .map_err(Failure::service)?;
        Ok(Self { submissions, _server: server })
    }

    /// The oldest job that waits.
    pub fn submission(&self) -> Option<Submission> {
        self.submissions.try_recv().ok()
    }
}

fn answer(
    request: Request,
    link: &OperatorLink,
    board: &Board,
    queue: &Sender<Submission>,
    conversation: &mut Conversation<'_>,
) -> Value {
    match request {
        Request::Status => json!(board.read()),
        Request::Verb { verb, value } => match link.request(verb.into(), value) {
            Ok(reply) => json!(VerbReply {
                accepted: reply.accepted == 1,
                state: ControllerState::from_wire(reply.state).name().to_owned(),
                value: reply.value,
            }),
            Err(error) => json!({ "error": error.to_string() }),
        },
        Request::Submit { job, out } => {
            let (news, heard) = unbounded();
            if queue.try_send(Submission { job, out, news }).is_err() {
                return json!({ "error": "eight jobs wait already; submit again later" });
            }
            follow(&heard, conversation)
        }
    }
}

/// Passes on what is heard of a job until it ends or the submitter leaves; the job goes on either
/// way.
fn follow(heard: &Receiver<News>, conversation: &mut Conversation<'_>) -> Value {
    loop {
        match heard.try_recv() {
            Ok(News::Share(share)) => {
                if conversation.tell(&json!({ "share": share })).is_err() {
                    return Value::Null;
                }
            }
            Ok(News::End(reply)) => return reply,
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
