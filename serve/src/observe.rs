//! Reads the samples of the pipeline while there is one, and looks for the next when it has ended.
//!
//! The machine waits for no reader: what this thread is too slow for is lost to it alone. It leaves at once when the
//! holder of the domain has died, because the instance is in use for as long as anybody is in it.

use crate::context::Context;
use crate::events::Level;
use crate::hub::Hub as Known;
use monitor::hub::{Batch, Hub, Sink};
use runtime::peer::{PeerState, Peers};
use runtime::{Domain, Instance, Role, ServiceError};
use std::sync::atomic::Ordering;
use std::time::Duration;

/// How often the channels are emptied.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// How often a pipeline is looked for.
const SEARCH_INTERVAL: Duration = Duration::from_millis(200);

/// Observes the pipeline of `instance`, and those that come after it, until the server ends.
pub fn run(instance: &Instance, context: &Context) {
    let mut told = String::new();
    while !context.is_over.load(Ordering::Relaxed) {
        match Domain::join_within(instance, Role::Observer, Duration::ZERO) {
            Ok(domain) => match observe(&domain, context) {
                Ok(()) => {
                    told.clear();
                    context.hub.leave("the pipeline has ended");
                }
                Err(error) if error != told => {
                    context.hub.tell(Level::Warning, &format!("no samples can be read: {error}"));
                    told = error;
                }
                Err(_) => {}
            },
            // There is none; the status says so.
            Err(_) => told.clear(),
        }
        std::thread::sleep(SEARCH_INTERVAL);
    }
}

/// Reads until the holder of the domain has ended, or the server ends.
fn observe(domain: &Domain, context: &Context) -> Result<(), String> {
    let description = context.pipeline.describe()?;
    let mut channels = Hub::open(domain).map_err(|error| error.to_string())?;
    let peers = Peers::watch(domain, &[Role::Domain]);
    let mut peers = peers.map_err(|error| error.to_string())?;
    context.hub.join(&description.machine);
    let mut sink = Reader { known: &context.hub };
    while !context.is_over.load(Ordering::Relaxed) && peers.state(Role::Domain) != PeerState::Dead {
        channels.poll(&mut [&mut sink]).map_err(|error| error.to_string())?;
        std::thread::sleep(POLL_INTERVAL);
    }
    Ok(())
}

struct Reader<'a> {
    known: &'a Known,
}

impl Sink for Reader<'_> {
    fn take(&mut self, batch: &Batch) -> Result<(), ServiceError> {
        self.known.take(batch);
        Ok(())
    }
}
