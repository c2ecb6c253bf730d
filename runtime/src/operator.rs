//! Operator requests on their way into the controller's cycle and back.
//!
//! ```text
//! domain holder                     controller process
//! OperatorLink ──request-response──► thread ──lock-free queue──► step
//!              ◄────────────────────        ◄──lock-free queue──
//! ```
//! The cycle only pops and pushes; everything that waits or allocates is on the two threads.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crossbeam::channel::{Receiver, Sender, bounded};
use crossbeam::queue::ArrayQueue;
use iceoryx2::node::Node;
use iceoryx2::prelude::{AttributeSpecifier, AttributeVerifier, BackpressureStrategy, ipc};
use iceoryx2::service::port_factory::request_response::PortFactory;
use messages::{OperatorReply, OperatorRequest, OperatorVerb, Sample};

use crate::channel::{ChannelError, Wire};
use crate::domain::{Domain, DomainError, Entry, Role};
use crate::room::need;

const SERVICE: &str = "operator-requests";

/// How long a request may take without another word, the controller's cycles included.
pub const PATIENCE: Duration = Duration::from_secs(2);

/// How often the controller's thread polls for requests: a person does not feel it.
const LOOK_PERIOD: Duration = Duration::from_millis(5);

/// How often the asking side polls for the answer.
const ANSWER_PERIOD: Duration = Duration::from_millis(1);

/// Requests that can wait for the cycle.
const QUEUE: usize = 16;

type Factory = PortFactory<ipc::Service, Wire<OperatorRequest>, (), Wire<OperatorReply>, ()>;

/// Why a request got no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OperatorError {
    /// Nobody is there to answer.
    #[error("the controller is not running")]
    NoController,
    /// The controller is there and did not answer in time.
    #[error("the controller did not answer within {} ms", .0.as_millis())]
    NoAnswer(Duration),
    /// The channel failed.
    #[error(transparent)]
    Channel(#[from] ChannelError),
}

fn refused(reason: impl Debug) -> ChannelError {
    ChannelError::Refused { channel: SERVICE, reason: format!("{reason:?}") }
}

fn layout() -> String {
    format!("{:016x}{:016x}", OperatorRequest::LAYOUT, OperatorReply::LAYOUT)
}

pub(crate) fn create(
    node: &Node<ipc::Service>,
) -> Result<Box<dyn Any + Send + Sync>, ChannelError> {
    let key = "layout".try_into().map_err(refused)?;
    let value = layout().as_str().try_into().map_err(refused)?;
    let attributes = AttributeSpecifier::new().define(&key, &value).map_err(refused)?;
    let factory = node
        .service_builder(&SERVICE.try_into().map_err(refused)?)
        .request_response::<Wire<OperatorRequest>, Wire<OperatorReply>>()
        .max_servers(1)
        .max_clients(2)
        .max_nodes(16)
        .create_with_attributes(&attributes)
        .map_err(refused)?;
    Ok(Box::new(factory))
}

fn open(domain: &Domain) -> Result<Factory, ChannelError> {
    let key = "layout".try_into().map_err(refused)?;
    let value = layout().as_str().try_into().map_err(refused)?;
    let attributes = AttributeVerifier::new().require(&key, &value).map_err(refused)?;
    domain
        .node()
        .service_builder(&SERVICE.try_into().map_err(refused)?)
        .request_response::<Wire<OperatorRequest>, Wire<OperatorReply>>()
        .open_with_attributes(&attributes)
        .map_err(refused)
}

/// Starts a thread that enters the domain and tells whether `serve` could set up.
fn start<F>(domain: &Domain, name: &str, serve: F) -> Result<JoinHandle<()>, DomainError>
where
    F: FnOnce(Entry, Sender<Result<(), DomainError>>) + Send + 'static,
{
    let entry = domain.entry();
    let (ready, set_up) = bounded(1);
    let thread = std::thread::Builder::new()
        .name(name.into())
        .spawn(move || serve(entry, ready))
        .map_err(|source| DomainError::io(std::path::Path::new(name), source))?;
    match set_up.recv() {
        Ok(Ok(())) => Ok(thread),
        Ok(Err(error)) => {
            let _ = thread.join();
            Err(error)
        }
        Err(_) => Err(ChannelError::Lost { channel: SERVICE }.into()),
    }
}

/// The controller's end: what its cycle pops requests from and pushes replies to.
#[derive(Debug)]
pub struct OperatorQueue {
    requests: Arc<ArrayQueue<OperatorRequest>>,
    replies: Arc<ArrayQueue<OperatorReply>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl OperatorQueue {
    /// Starts the thread that takes requests. Call it before the cycle's thread becomes real-time.
    pub fn start(domain: &Domain) -> Result<Self, DomainError> {
        let requests = Arc::new(ArrayQueue::new(QUEUE));
        let replies = Arc::new(ArrayQueue::new(QUEUE));
        let stop = Arc::new(AtomicBool::new(false));
        let (sink, source, stopped) = (requests.clone(), replies.clone(), stop.clone());
        let thread = start(domain, "operator-queue", move |entry, ready| {
            answer_requests(&entry, &ready, &sink, &source, &stopped);
        })?;
        Ok(Self { requests, replies, stop, thread: Some(thread) })
    }

    /// The oldest request that waits. Neither waits nor allocates.
    pub fn take(&self) -> Option<OperatorRequest> {
        self.requests.pop()
    }

    /// Answers a request, whose ticket the reply carries. Neither waits nor allocates; with nobody
    /// taking replies the newest are dropped.
    pub fn answer(&self, reply: OperatorReply) {
        let _ = self.replies.push(reply);
    }
}

impl Drop for OperatorQueue {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn answer_requests(
    entry: &Entry,
    ready: &Sender<Result<(), DomainError>>,
    requests: &ArrayQueue<OperatorRequest>,
    replies: &ArrayQueue<OperatorReply>,
    stop: &AtomicBool,
) {
    let set_up = || {
        let domain = entry.enter()?;
        let factory = open(&domain)?;
        let builder =
            factory.server_builder().backpressure_strategy(BackpressureStrategy::DiscardData);
        let server = domain.room().open(need::operator(), || builder.create().map_err(refused))?;
        Ok((domain, server))
    };
    let (domain, server) = match set_up() {
        Ok(parts) => parts,
        Err(error) => {
            let _ = ready.send(Err(error));
            return;
        }
    };
    let _ = ready.send(Ok(()));
    let mut open_requests = Vec::new();
    while !stop.load(Ordering::Relaxed) {
        while let Ok(Some(active)) = server.receive() {
            // A full queue means a cycle that stands still: the asking side hears no answer.
            if requests.push(active.payload().0).is_ok() {
                open_requests.push((active, Instant::now()));
            }
        }
        while let Some(reply) = replies.pop() {
            let asked = |active: &OperatorRequest| active.ticket == reply.ticket;
            if let Some(index) =
                open_requests.iter().position(|(active, _)| asked(&active.payload().0))
            {
                let (active, _) = open_requests.swap_remove(index);
                let _ = active.send_copy(Wire(reply));
            }
        }
        open_requests.retain(|(_, since)| since.elapsed() < 2 * PATIENCE);
        std::thread::sleep(LOOK_PERIOD);
    }
    drop(open_requests);
    drop(server);
    drop(domain);
}

struct Question {
    request: OperatorRequest,
    patience: Duration,
    answer: Sender<Result<OperatorReply, OperatorError>>,
}

/// The domain holder's end; any thread may ask, one request goes at a time.
#[derive(Debug)]
pub struct OperatorLink {
    questions: Option<Sender<Question>>,
    tickets: AtomicU32,
    thread: Option<JoinHandle<()>>,
}

impl OperatorLink {
    /// Starts the thread that asks.
    pub fn start(domain: &Domain) -> Result<Self, DomainError> {
        let (questions, asked) = bounded::<Question>(QUEUE);
        let thread =
            start(domain, "operator-link", move |entry, ready| ask(&entry, &ready, &asked))?;
        Ok(Self { questions: Some(questions), tickets: AtomicU32::new(0), thread: Some(thread) })
    }

    /// Asks the controller and waits for its answer at most [`PATIENCE`]. `value` is the verb's
    /// argument, 0 without.
    pub fn request(&self, verb: OperatorVerb, value: f64) -> Result<OperatorReply, OperatorError> {
        self.request_within(verb, value, PATIENCE)
    }

    /// Like [`Self::request`], waiting at most `patience`.
    pub fn request_within(
        &self,
        verb: OperatorVerb,
        value: f64,
        patience: Duration,
    ) -> Result<OperatorReply, OperatorError> {
        let request = OperatorRequest { verb: verb as u32, value, ..OperatorRequest::default() };
        self.ask_within(request, patience)
    }

    /// Like [`Self::request_within`], with every argument; the ticket is given here.
    pub fn ask_within(
        &self,
        request: OperatorRequest,
        patience: Duration,
    ) -> Result<OperatorReply, OperatorError> {
        let lost = || OperatorError::Channel(ChannelError::Lost { channel: SERVICE });
        let ticket = self.tickets.fetch_add(1, Ordering::Relaxed).wrapping_add(1);
        let request = OperatorRequest { ticket, ..request };
        let (answer, answered) = bounded(1);
        let questions = self.questions.as_ref().ok_or_else(lost)?;
        questions.send(Question { request, patience, answer }).map_err(|_| lost())?;
        answered.recv().map_err(|_| lost())?
    }
}

impl Drop for OperatorLink {
    fn drop(&mut self) {
        self.questions = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn ask(entry: &Entry, ready: &Sender<Result<(), DomainError>>, questions: &Receiver<Question>) {
    let set_up = || {
        let domain = entry.enter()?;
        let factory = open(&domain)?;
        let builder =
            factory.client_builder().backpressure_strategy(BackpressureStrategy::DiscardData);
        let client = domain.room().open(need::operator(), || builder.create().map_err(refused))?;
        Ok((domain, client))
    };
    let (domain, client) = match set_up() {
        Ok(parts) => parts,
        Err(error) => {
            let _ = ready.send(Err(error));
            return;
        }
    };
    let _ = ready.send(Ok(()));
    while let Ok(Question { request, patience, answer }) = questions.recv() {
        let reply = || {
            let lost = |_| ChannelError::Lost { channel: SERVICE };
            let asked = Instant::now();
            let pending = loop {
                let pending = client
                    .send_copy(Wire(request))
                    .map_err(|_| ChannelError::Lost { channel: SERVICE })?;
                if pending.number_of_server_connections() > 0 {
                    break pending;
                }
                // A controller that has joined takes requests a moment later.
                if domain.peer(Role::Controller).is_none() || asked.elapsed() >= patience {
                    return Err(OperatorError::NoController);
                }
                std::thread::sleep(ANSWER_PERIOD);
            };
            while asked.elapsed() < patience {
                if let Some(reply) = pending.receive().map_err(lost)? {
                    return Ok(reply.payload().0);
                }
                std::thread::sleep(ANSWER_PERIOD);
            }
            Err(OperatorError::NoAnswer(patience))
        };
        let _ = answer.send(reply());
    }
    drop(client);
    drop(domain);
}
