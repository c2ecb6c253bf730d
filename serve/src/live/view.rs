//! What a page has been told, and what it is told next.

use crate::access::Right;
use crate::context::Context;
use crate::events::Event;
use crate::path::PathCursor;
use crate::scope::{Scope, ScopeRequest};
use axum::extract::ws::Message;
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Points of the path in a message.
const POINTS: usize = 4000;

/// Events of before that a page is told.
const EVENTS_BEFORE: u64 = 20;

/// A status is told so often also without a change, so that a page knows a connection that is lost.
const STATUS_AGAIN: Duration = Duration::from_millis(900);

/// Things to say that wait for their turn; what is asked in between is forgotten.
const MOST_SAID: usize = 16;

/// What is told in one round, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Topic {
    Hello,
    Status,
    Queue,
    Latency,
    Events,
    Said,
    Path,
    Scope,
}

const ROUND: [Topic; 8] = [
    Topic::Hello,
    Topic::Status,
    Topic::Queue,
    Topic::Latency,
    Topic::Events,
    Topic::Said,
    Topic::Path,
    Topic::Scope,
];

/// What a page has been told.
pub(super) struct View {
    context: Context,
    right: Right,
    /// Where in the round it is.
    topic: usize,
    greeted: Option<u64>,
    status: u64,
    status_told: Option<Instant>,
    queue: u64,
    latency: u64,
    next_event: u64,
    events: VecDeque<Event>,
    said: VecDeque<Value>,
    path: PathCursor,
    scope: Option<Scope>,
}

impl View {
    pub(super) fn new(context: Context, right: Right) -> Self {
        let (_, next) = context.hub.events(u64::MAX);
        Self {
            context,
            right,
            topic: 0,
            greeted: None,
            status: 0,
            status_told: None,
            queue: 0,
            latency: 0,
            next_event: next.saturating_sub(EVENTS_BEFORE),
            events: VecDeque::new(),
            said: VecDeque::new(),
            path: PathCursor::default(),
            scope: None,
        }
    }

    /// Whether the server ends.
    pub(super) fn is_over(&self) -> bool {
        self.context.is_over.load(Ordering::Relaxed)
    }

    /// Something to say to this page.
    pub(super) fn say(&mut self, value: Value) {
        if self.said.len() < MOST_SAID {
            self.said.push_back(value);
        }
    }

    /// Shows another scope, or none.
    pub(super) fn show(&mut self, request: Option<ScopeRequest>) {
        self.scope = None;
        let Some(request) = request else { return };
        match self.context.hub.scope(request) {
            Ok(scope) => self.scope = Some(scope),
            Err(text) => self.say(json!({ "type": "refusal", "of": "scope", "text": text })),
        }
    }

    /// The next message of this round; `None` at its end. It is made now, so that it is the newest when it leaves.
    pub(super) fn next(&mut self) -> Option<Message> {
        while let Some(topic) = ROUND.get(self.topic) {
            if let Some(message) = self.about(*topic) {
                // Of these more than one message may wait; of a path the rest is for the next round.
                if !matches!(topic, Topic::Events | Topic::Said) {
                    self.topic += 1;
                }
                return Some(message);
            }
            self.topic += 1;
        }
        self.topic = 0;
        None
    }

    fn about(&mut self, topic: Topic) -> Option<Message> {
        let hub = &self.context.hub;
        match topic {
            Topic::Hello => {
                let joined = hub.joined();
                if self.greeted == Some(joined) {
                    return None;
                }
                self.greeted = Some(joined);
                // What stands on the page is of another pipeline.
                (self.status, self.queue, self.latency) = (0, 0, 0);
                // Places in a cycle may be others now.
                self.scope = None;
                let hello = json!({
                    "type": "hello",
                    "role": self.right,
                    "machine": hub.machine().as_deref(),
                    "signals": &*hub.signals(),
                });
                Some(text(hello))
            }
            Topic::Status => {
                let status = hub.status_message();
                let is_old = self.status_told.is_none_or(|told| told.elapsed() >= STATUS_AGAIN);
                if status.number == 0 || (status.number == self.status && !is_old) {
                    return None;
                }
                (self.status, self.status_told) = (status.number, Some(Instant::now()));
                Some(Message::Text((&*status.text).into()))
            }
            Topic::Queue => newer(&mut self.queue, &hub.queue_message()),
            Topic::Latency => newer(&mut self.latency, &hub.latency_message()),
            Topic::Events => {
                if self.events.is_empty() {
                    let (events, next) = hub.events(self.next_event);
                    (self.events, self.next_event) = (events.into(), next);
                }
                let mut event = json!(self.events.pop_front()?);
                event["type"] = json!("event");
                Some(text(event))
            }
            Topic::Said => self.said.pop_front().map(text),
            Topic::Path => {
                let (points, begins) = hub.path(&mut self.path, POINTS);
                if points.is_empty() && !begins {
                    return None;
                }
                let mut path = json!({ "type": "path", "points": points });
                if begins {
                    path["reset"] = json!(true);
                }
                Some(text(path))
            }
            Topic::Scope => {
                let frame = hub.frame(self.scope.as_mut()?)?;
                Some(Message::Binary(frame.bytes().into()))
            }
        }
    }
}

fn newer(told: &mut u64, message: &crate::hub::Numbered) -> Option<Message> {
    if message.number == *told {
        return None;
    }
    *told = message.number;
    Some(Message::Text((&*message.text).into()))
}

fn text(value: Value) -> Message {
    Message::Text(value.to_string().into())
}
