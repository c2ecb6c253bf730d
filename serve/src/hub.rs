//! The newest of what the pipeline says: what pages and programs are answered from.
//!
//! One thread puts samples in ([`crate::observe`]), another what the operators' socket says ([`crate::poll`]); whoever
//! answers a request reads. Nothing here grows with the length of a run.

mod observed;

pub use observed::{HopReport, LatencyReport};

use crate::events::{Event, Events, Level, milliseconds};
use crate::machine_facts::MachineFacts;
use crate::metrics::Metrics;
use crate::path::{PathCursor, PathPoint};
use crate::poll::changes;
use crate::scope::{Frame, Scope, ScopeRequest};
use crate::signals::SignalName;
use machine::Machine;
use monitor::hub::Batch;
use observed::Observed;
use serde_json::{Value, json};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A text and its number, which grows with each change.
#[derive(Debug, Clone)]
pub struct Numbered {
    /// Its number; 0 before there is one.
    pub number: u64,
    /// The text.
    pub text: Arc<str>,
}

impl Default for Numbered {
    fn default() -> Self {
        Self { number: 0, text: "".into() }
    }
}

impl Numbered {
    fn set(&mut self, text: String) {
        *self = Self { number: self.number + 1, text: text.into() };
    }
}

#[derive(Default)]
struct State {
    observed: Option<Observed>,
    /// Counts the pipelines that were joined.
    joined: u64,
    status: Option<Value>,
    status_message: Numbered,
    queue: Option<Value>,
    queue_message: Numbered,
    latency_message: Numbered,
    events: Events,
    /// Why the pipeline does not answer; `None` while it does.
    silence: Option<String>,
}

/// What is known, for any thread.
pub struct Hub {
    state: Mutex<State>,
    metrics: Arc<Metrics>,
}

impl std::fmt::Debug for Hub {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Hub").finish_non_exhaustive()
    }
}

impl Hub {
    /// One that knows nothing yet.
    pub fn new(metrics: Arc<Metrics>) -> Self {
        Self { state: Mutex::default(), metrics }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // A thread that panicked has left one message out at worst.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins with the pipeline of this machine.
    pub fn join(&self, machine: &Machine) {
        let observed = Observed::new(machine);
        let mut state = self.lock();
        state.joined += 1;
        state.observed = Some(observed);
        let text = format!("the pipeline of {} is there", machine.name);
        state.events.add(Level::Info, text, None);
        self.metrics.joined(true);
    }

    /// The pipeline has ended, for this reason. What it showed last stays to be looked at.
    pub fn leave(&self, why: &str) {
        self.lock().events.add(Level::Warning, why, None);
        self.metrics.joined(false);
    }

    /// Tells pages of something.
    pub fn tell(&self, level: Level, text: &str) {
        self.lock().events.add(level, text, None);
    }

    /// Takes samples.
    pub fn take(&self, batch: &Batch) {
        if let Some(observed) = &mut self.lock().observed {
            observed.take(batch, &self.metrics);
        }
        for report in &batch.drives_reports {
            self.metrics.drives(report);
        }
    }

    /// Takes the status that the operators' socket gave, or why it gave none.
    pub fn post_status(&self, status: Result<Value, String>) {
        let mut state = self.lock();
        match status {
            Ok(status) => {
                for (level, text, advice) in changes(state.status.as_ref(), &status) {
                    state.events.add(level, text, advice);
                }
                self.metrics.status(state.status.as_ref(), &status);
                state.silence = None;
                let message = json!({ "type": "status", "sent": milliseconds(), "status": status });
                state.status_message.set(message.to_string());
                state.status = Some(status);
            }
            Err(why) => {
                if state.silence.as_ref() != Some(&why) {
                    let message = json!({ "type": "status", "sent": milliseconds(), "status": null, "error": why });
                    state.status_message.set(message.to_string());
                    self.metrics.silent();
                }
                state.silence = Some(why);
                (state.status, state.queue) = (None, None);
            }
        }
    }

    /// Takes the queue that the operators' socket gave.
    pub fn post_queue(&self, queue: Value) {
        let mut state = self.lock();
        if state.queue.as_ref() == Some(&queue) {
            return;
        }
        self.metrics.queue(&queue);
        state.queue_message.set(json!({ "type": "queue", "queue": queue }).to_string());
        state.queue = Some(queue);
    }

    /// Makes the message about latencies anew.
    pub fn post_latency(&self) {
        let mut state = self.lock();
        let Some(observed) = &state.observed else { return };
        let mut message = json!(observed.latency());
        message["type"] = json!("latency");
        state.latency_message.set(message.to_string());
    }

    /// The machine; `None` before a pipeline was joined.
    pub fn machine(&self) -> Option<Arc<MachineFacts>> {
        self.lock().observed.as_ref().map(Observed::facts)
    }

    /// The signals; none before a pipeline was joined.
    pub fn signals(&self) -> Arc<Vec<SignalName>> {
        self.lock().observed.as_ref().map(Observed::names).unwrap_or_default()
    }

    /// How many pipelines were joined: a page is told of the machine anew when this changes.
    pub fn joined(&self) -> u64 {
        self.lock().joined
    }

    /// The latencies since the pipeline was joined.
    pub fn latency(&self) -> LatencyReport {
        self.lock().observed.as_ref().map(Observed::latency).unwrap_or_default()
    }

    /// The newest status as a message.
    pub fn status_message(&self) -> Numbered {
        self.lock().status_message.clone()
    }

    /// The newest queue as a message.
    pub fn queue_message(&self) -> Numbered {
        self.lock().queue_message.clone()
    }

    /// The newest latencies as a message.
    pub fn latency_message(&self) -> Numbered {
        self.lock().latency_message.clone()
    }

    /// Events from `number` on, and the number of the next.
    pub fn events(&self, number: u64) -> (Vec<Event>, u64) {
        let state = self.lock();
        (state.events.from(number), state.events.next())
    }

    /// The next places of the tool after `cursor`, `most` at most, and whether they begin a new stream.
    pub fn path(&self, cursor: &mut PathCursor, most: usize) -> (Vec<PathPoint>, bool) {
        match &self.lock().observed {
            Some(observed) => observed.path.after(cursor, most),
            None => (Vec::new(), false),
        }
    }

    /// A scope.
    ///
    /// # Errors
    /// What of the request cannot be shown.
    pub fn scope(&self, request: ScopeRequest) -> Result<Scope, String> {
        match &self.lock().observed {
            Some(observed) => observed.scope(request),
            None => Err("no pipeline has been found yet: there are no signals".to_owned()),
        }
    }

    /// What `scope` shows next.
    pub fn frame(&self, scope: &mut Scope) -> Option<Frame> {
        scope.next(&self.lock().observed.as_ref()?.ring)
    }
}
