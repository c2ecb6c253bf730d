//! The Modbus service: moves samples between the channels of a domain and those who talk with the devices.

use machine::Machine;
use messages::{Nanoseconds, Progress, SlowInputs};
use runtime::peer::{PeerState, Peers};
use runtime::{Domain, Publisher, Role, Samples, ServiceError, Subscriber, clock, heartbeat};
use tokio::runtime::Builder;
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::{Duration, sleep, timeout};

use crate::conversation::Outputs;
use crate::heard::Heard;
use crate::tasks::{Orders, attend};

/// How often the channels are looked at, and what was heard is told.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// How old the controller's newest words may be for the outputs to follow them.
const LONGEST_SILENCE: Nanoseconds = Nanoseconds(1_000_000_000);

/// How long the last orders may take: a supervisor waits for 5 s.
const END_PATIENCE: Duration = Duration::from_secs(4);

/// Talks with the devices of `machine` until it `shall_end` or the supervisor dies; then the outputs go to their safe
/// states.
///
/// # Errors
/// When a channel fails, or the operating system refuses what sockets need.
pub fn run(
    domain: &Domain,
    machine: &Machine,
    shall_end: impl Fn() -> bool,
) -> Result<(), ServiceError> {
    let runtime = Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(|source| ServiceError::thread("modbus", source))?;
    let mut service = Service::open(domain)?;
    runtime.block_on(service.serve(machine, shall_end))
}

struct Service {
    peers: Peers,
    progress: Subscriber<Progress>,
    /// The newest.
    newest: Progress,
    slow: Publisher<SlowInputs>,
}

impl Service {
    fn open(domain: &Domain) -> Result<Self, ServiceError> {
        Ok(Self {
            peers: Peers::watch(domain, &[Role::Domain])?,
            progress: domain.subscriber(Samples::Latest)?,
            newest: Progress::default(),
            slow: domain.publisher()?,
        })
    }

    async fn serve(
        &mut self,
        machine: &Machine,
        shall_end: impl Fn() -> bool,
    ) -> Result<(), ServiceError> {
        let devices = &machine.operating.devices;
        let heard = Heard::default();
        let (orders, listening) = watch::channel(Orders { outputs: Outputs::Safe, is_last: false });
        let mut tasks = JoinSet::new();
        for (index, device) in devices.iter().enumerate() {
            let (listening, heard) = (listening.clone(), heard.clone());
            tasks.spawn(attend(index, device.clone(), listening, heard, clock::now));
        }
        let outcome = loop {
            if shall_end() || self.peers.state(Role::Domain) == PeerState::Dead {
                break Ok(());
            }
            heartbeat::beat();
            match self.turn(&heard) {
                Ok(outputs) => orders.send_if_modified(|orders| {
                    let is_other = orders.outputs != outputs;
                    orders.outputs = outputs;
                    is_other
                }),
                Err(error) => break Err(error),
            };
            sleep(POLL_INTERVAL).await;
        };
        orders.send_replace(Orders { outputs: Outputs::Safe, is_last: true });
        // A device that does not take them in its time would not take them later.
        let _ = timeout(END_PATIENCE, async { while tasks.join_next().await.is_some() {} }).await;
        outcome
    }

    /// Tells what was heard, and gives what the outputs are to be.
    fn turn(&mut self, heard: &Heard) -> Result<Outputs, ServiceError> {
        if let Some(progress) = self.progress.newest()? {
            self.newest = progress;
        }
        let now = clock::now();
        self.slow.publish(&SlowInputs { published: now, ..heard.all() })?;
        let is_current = now - self.newest.published <= LONGEST_SILENCE;
        Ok(if is_current { Outputs::Follow(self.newest.outputs) } else { Outputs::Safe })
    }
}
