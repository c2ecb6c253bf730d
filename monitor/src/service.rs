//! The monitor service: records every cycle of a job into its run folder.
//!
//! The machine does not wait for it. A [`Hub`] receives everything, always, and hands it to the sinks.
//! The recorder counts what was missed, and writes what it has. A monitor that was started again goes on with the recording
//! that its predecessor left. One that cannot write says so, gives the recording up, and watches
//! on. When the supervisor is lost it also writes the summary, because nobody else is left to.

mod alone;
mod recorder;
mod recording;
mod store;

use crate::hub::{Hub, Sink};
use crate::recording::file::Description;
use crate::recording::level::Level;
use machine::Machine;
use recorder::JobRecorder;
use runtime::peer::{PeerState, Peers};
use runtime::{Domain, Instance, Role, ServiceError, heartbeat, signal};
use std::path::PathBuf;
use std::time::Duration;
use store::Setup;

/// How often the service polls its channels.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// How long feedback or commands may stay away before nothing more is waited for: three times what
/// the clock of simulated drives may slip.
const SILENCE: Duration = Duration::from_millis(300);

/// Where recordings of an instance go on when their folders take no more: in this directory of the instance.
const SPARE: &str = "recording";

/// How an instance records.
#[derive(Debug, Clone, Default)]
pub struct RecordingOptions {
    /// What the machine is built from, as JSON: recordings carry it.
    pub machine: String,
    /// What stays of a recording when its run has been judged.
    pub level: Level,
    /// How large a recording may grow [bytes].
    pub quota: Option<u64>,
}

/// The directory in which recordings of an instance go on when their folders take no more.
pub fn spare(instance: &Instance) -> PathBuf {
    instance.root().join(SPARE)
}

/// Runs until it is told to end (SIGTERM) or the supervisor dies. What the hub receives goes to the recorder, and after it to those
/// `beside`, who may neither wait nor fail: the recording would wait or end with them.
///
/// # Errors
/// When a channel fails, or when a recording fails and not even that can be written down.
pub fn run(
    domain: &Domain,
    machine: &Machine,
    options: &RecordingOptions,
    beside: &mut [&mut dyn Sink],
) -> Result<(), ServiceError> {
    let mut service = Service::open(domain, machine, options)?;
    while signal::termination().is_none() && service.has_supervisor() {
        service.poll(beside)?;
        heartbeat::beat();
        std::thread::sleep(POLL_INTERVAL);
    }
    // A summary takes its time.
    let _busy = heartbeat::busy();
    let polled = service.poll(beside);
    let ended =
        if service.has_supervisor() { service.end() } else { service.conclude_alone(machine) };
    let left = beside.iter_mut().try_for_each(|sink| sink.end());
    polled.and(ended).and(left)
}

struct Service {
    peers: Peers,
    hub: Hub,
    recorder: JobRecorder,
    /// What stays of a recording that is concluded here.
    level: Level,
}

impl Service {
    fn open(
        domain: &Domain,
        machine: &Machine,
        options: &RecordingOptions,
    ) -> Result<Self, ServiceError> {
        let actuators = machine.actuators.iter().map(|actuator| actuator.name.clone());
        let setup = Setup {
            description: Description {
                actuators: actuators.collect(),
                machine: options.machine.clone(),
                ..Description::of(machine.realtime.period)
            },
            quota: options.quota,
            spare: spare(domain.instance()),
        };
        Ok(Self {
            hub: Hub::recording(domain)?,
            peers: Peers::watch(domain, &[Role::Domain, Role::Controller, Role::Drives])?,
            recorder: JobRecorder::new(setup),
            level: options.level,
        })
    }

    fn has_supervisor(&mut self) -> bool {
        self.peers.state(Role::Domain) != PeerState::Dead
    }

    fn poll(&mut self, beside: &mut [&mut dyn Sink]) -> Result<(), ServiceError> {
        let mut sinks: Vec<&mut dyn Sink> = vec![&mut self.recorder];
        sinks.extend(beside.iter_mut().map(|sink| &mut **sink as &mut dyn Sink));
        self.hub.poll(&mut sinks)?;
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
