//! The monitor service: records every cycle of a job into its run folder.
//!
//! The machine does not wait for it. A [`Hub`] receives everything, always, and hands it to the sinks.
//! The recorder counts what was missed, and writes what it has. A monitor that was started again goes on with the recording
//! that its predecessor left. One that cannot write says so, gives the recording up, and watches
//! on. When the supervisor is lost it also writes the summary, because nobody else is left to.

mod alone;
mod recorder;
mod recording;

use crate::hub::{Hub, Sink as _};
use machine::Machine;
use messages::time::Period;
use recorder::JobRecorder;
use runtime::peer::{PeerState, Peers};
use runtime::{Domain, Role, ServiceError, heartbeat, signal};
use std::time::Duration;

/// How often the service polls its channels.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// How long feedback or commands may stay away before nothing more is waited for: three times what
/// the clock of simulated drives may slip.
const SILENCE: Duration = Duration::from_millis(300);

/// Runs until it is told to end (SIGTERM) or the supervisor dies.
///
/// # Errors
/// When a channel fails, or when a recording fails and not even that can be written down.
pub fn run(domain: &Domain, machine: &Machine) -> Result<(), ServiceError> {
    let mut service = Service::open(domain, machine.realtime.period)?;
    while signal::termination().is_none() && service.has_supervisor() {
        service.poll()?;
        heartbeat::beat();
        std::thread::sleep(POLL_INTERVAL);
    }
    // A summary takes its time.
    let _busy = heartbeat::busy();
    let polled = service.poll();
    let ended =
        if service.has_supervisor() { service.end() } else { service.conclude_alone(machine) };
    polled.and(ended)
}

struct Service {
    peers: Peers,
    hub: Hub,
    recorder: JobRecorder,
}

impl Service {
    fn open(domain: &Domain, period: Period) -> Result<Self, ServiceError> {
        Ok(Self {
            hub: Hub::open(domain)?,
            peers: Peers::watch(domain, &[Role::Domain, Role::Controller, Role::Drives])?,
            recorder: JobRecorder::new(period),
        })
    }

    fn has_supervisor(&mut self) -> bool {
        self.peers.state(Role::Domain) != PeerState::Dead
    }

    fn poll(&mut self) -> Result<(), ServiceError> {
        self.hub.poll(&mut [&mut self.recorder])?;
        let more_comes = self.more_comes();
        self.recorder.end_when_over(more_comes)
    }

    /// Whether controller and drives live and speak. A monitor that was started after their death
    /// never sees them alive; then their silence tells.
    fn more_comes(&mut self) -> bool {
        let dead = |role| self.peers.state(role) == PeerState::Dead;
        let dead = [Role::Controller, Role::Drives].into_iter().any(dead);
        !dead && self.hub.silence() < SILENCE
    }

    fn end(&mut self) -> Result<(), ServiceError> {
        self.recorder.end()
    }
}

#[cfg(test)]
mod tests;
