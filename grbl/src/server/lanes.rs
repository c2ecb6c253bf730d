//! Threads that carry out requests, so that none that is urgent waits for another.

use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use operator::Verb;

use super::{Shared, spawn};
use crate::machine::{Ask, Machine};

/// Requests that can wait in a lane.
const MOST: usize = 64;

/// How often a lane without requests checks whether it shall end.
const PATIENCE: Duration = Duration::from_millis(200);

/// Which lane a request goes.
fn lane(ask: &Ask) -> usize {
    match ask {
        Ask::Verb { verb: Verb::Stop, .. } => 0,
        Ask::Verb { verb: Verb::Hold | Verb::Resume, .. } => 1,
        ask if ask.is_urgent() => 2,
        _ => 3,
    }
}

#[derive(Default)]
struct Lane {
    asks: Mutex<VecDeque<(u64, Ask)>>,
    there: Condvar,
}

/// Requests that wait to be carried out.
#[derive(Default)]
pub(super) struct Lanes {
    lanes: [Lane; 4],
}

impl Lanes {
    /// Adds a request; one that only says anew what the last one says takes its place.
    pub(super) fn add(&self, ticket: u64, ask: Ask) -> Result<(), &'static str> {
        let lane = &self.lanes[lane(&ask)];
        let mut asks = lane.asks.lock().unwrap_or_else(PoisonError::into_inner);
        if asks.back().is_some_and(|(_, last)| replaces(&ask, last)) {
            asks.pop_back();
        }
        if asks.len() >= MOST {
            return Err("too many requests at a time");
        }
        asks.push_back((ticket, ask));
        lane.there.notify_one();
        Ok(())
    }

    /// Wakes all that wait.
    pub(super) fn wake(&self) {
        self.lanes.iter().for_each(|lane| lane.there.notify_all());
    }
}

/// Whether `ask` makes `last`, which has not been carried out, superfluous.
fn replaces(ask: &Ask, last: &Ask) -> bool {
    match (ask, last) {
        (Ask::Verb { verb, .. }, Ask::Verb { verb: before, .. }) => {
            verb == before
                && matches!(
                    verb,
                    Verb::Stop
                        | Verb::Hold
                        | Verb::Resume
                        | Verb::Override
                        | Verb::Rapid
                        | Verb::Power
                )
        }
        _ => false,
    }
}

/// Starts the threads.
pub(super) fn start<M: Machine + 'static>(
    shared: &Arc<Shared<M>>,
) -> io::Result<Vec<JoinHandle<()>>> {
    let lanes = 0..shared.lanes.lanes.len();
    lanes
        .map(|index| {
            let shared = shared.clone();
            spawn("grbl-requests", move || carry_out(&shared, index))
        })
        .collect()
}

fn carry_out<M: Machine + 'static>(shared: &Shared<M>, index: usize) {
    let lane = &shared.lanes.lanes[index];
    while !shared.is_over() {
        let next = {
            let asks = lane.asks.lock().unwrap_or_else(PoisonError::into_inner);
            let waited = lane.there.wait_timeout_while(asks, PATIENCE, |asks| asks.is_empty());
            waited.unwrap_or_else(PoisonError::into_inner).0.pop_front()
        };
        if let Some((ticket, ask)) = next {
            shared.carry_out(ticket, &ask);
        }
    }
}
