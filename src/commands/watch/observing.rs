//! The thread that measures: it reads the samples of the pipeline as the page does, and tells the latencies since it
//! joined. The machine waits for no reader.

use super::asking::News;
use monitor::hub::{Batch, Hub, Sink};
use monitor::stage::{Inputs, MonitorStage, Outputs};
use runtime::peer::{PeerState, Peers};
use runtime::{Domain, Instance, Role, ServiceError};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

/// How often the channels are emptied.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// How often a pipeline is looked for, and the latencies are told.
const INTERVAL: Duration = Duration::from_millis(500);

/// Observes the pipeline of `instance`, and those that come after it, until the view `is_over`.
pub(super) fn observe(instance: &Instance, news: &Sender<News>, is_over: &AtomicBool) {
    while !is_over.load(Ordering::Relaxed) {
        // Without a pipeline there is nothing to measure, and the status says why.
        if let Ok(domain) = Domain::join_within(instance, Role::Observer, Duration::ZERO)
            && let Some((hub, peers)) = join(&domain)
        {
            follow(hub, peers, news, is_over);
        }
        let searched = Instant::now();
        while searched.elapsed() < INTERVAL && !is_over.load(Ordering::Relaxed) {
            std::thread::sleep(POLL_INTERVAL);
        }
    }
}

/// `None` where there is no room for one more reader.
fn join(domain: &Domain) -> Option<(Hub, Peers)> {
    Some((Hub::open(domain).ok()?, Peers::watch(domain, &[Role::Domain]).ok()?))
}

/// Reads until the holder of the domain has ended: the instance is in use for as long as anybody is in it.
fn follow(mut hub: Hub, mut peers: Peers, news: &Sender<News>, is_over: &AtomicBool) {
    let mut latencies = Latencies(MonitorStage::new());
    let mut told = Instant::now();
    while !is_over.load(Ordering::Relaxed) && peers.state(Role::Domain) != PeerState::Dead {
        if hub.poll(&mut [&mut latencies]).is_err() {
            return;
        }
        if told.elapsed() >= INTERVAL {
            told = Instant::now();
            // That nobody listens any more the flag says.
            let _ = news.send(News::Latencies(latencies.0.histograms().summary()));
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

struct Latencies(MonitorStage);

impl Sink for Latencies {
    fn take(&mut self, batch: &Batch) -> Result<(), ServiceError> {
        let inputs = Inputs { feedbacks: &batch.feedbacks, commands: &batch.commands };
        self.0.step(&inputs, &mut Outputs::default());
        Ok(())
    }
}
