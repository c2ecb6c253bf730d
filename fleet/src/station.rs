//! The thread of a machine in a fleet: finds the server, and says what the machine is doing.

use crate::connection::{Connection, Unpublished, pause};
use crate::now;
use crate::pipeline::busy;
use crate::publisher::Shared;
use crate::taker::Taker;
use crate::{spool, streams};
use async_nats::connection::State;
use operator::fleet::{
    JobProgress, MachineFaults, MachineJob, MachineMetrics, MachineState, VERSION,
};
use operator::{Queue, Status};
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// How often it is asked whether to end.
const STEP: Duration = Duration::from_millis(20);

/// How long a goodbye may take.
const GOODBYE: Duration = Duration::from_secs(1);

/// From one message about how far a job has come to the next.
const PROGRESS: Duration = Duration::from_secs(1);

/// Runs until it is over.
pub(crate) async fn run(shared: &Arc<Shared>, counted: &Receiver<MachineMetrics>) {
    let mut failed = 0;
    let mut told = String::new();
    while !shared.is_over() {
        let pipeline = shared.pipeline.clone();
        let tell = Arc::new(move |text: &str| pipeline.tell(&format!("fleet: {text}")));
        let name = format!("graver {}", shared.options.machine);
        let opened = tokio::select! {
            opened = Connection::open(&shared.options.server, &name, tell) => opened,
            () = over(shared) => break,
        };
        match opened {
            Ok(connection) => {
                let options = &shared.options;
                let takes = match &options.group {
                    Some(group) => format!(", and takes jobs of group {group}"),
                    None => String::new(),
                };
                (failed, told) = (0, String::new());
                shared.pipeline.tell(&format!(
                    "fleet: {} is machine {}{takes}",
                    options.server.address, options.machine
                ));
                serve(shared, &connection, counted).await;
            }
            Err(error) => {
                failed += 1;
                // What came meanwhile is old when there is a server.
                let unsent = counted.try_iter().count() as u64;
                shared.unsent.fetch_add(unsent, Ordering::Relaxed);
                let text = format!("fleet: {error}; it is tried again and again");
                if text != told {
                    shared.pipeline.tell(&text);
                    told = text;
                }
            }
        }
        tokio::select! {
            () = tokio::time::sleep(pause(failed)) => {}
            () = over(shared) => {}
        }
    }
}

/// Returns when the thread shall end.
async fn over(shared: &Shared) {
    while !shared.is_over() {
        tokio::time::sleep(STEP).await;
    }
}

/// Speaks with a server until it is over, or until what the server keeps is gone.
async fn serve(shared: &Arc<Shared>, connection: &Connection, counted: &Receiver<MachineMetrics>) {
    let mut station = Station::new(shared.clone(), connection.clone());
    let taker = async {
        match &shared.options.group {
            Some(group) => {
                Taker::new(shared.clone(), connection.clone(), group.clone()).run().await
            }
            None => std::future::pending().await,
        }
    };
    tokio::select! {
        () = over(shared) => {}
        () = station.run(counted) => {}
        () = taker => {}
    }
    if shared.is_over() {
        let goodbye = async {
            station.say_goodbye().await;
            let _ = connection.client.flush().await;
        };
        // Without it, the others see how long this machine has been silent.
        let _ = tokio::time::timeout(GOODBYE, goodbye).await;
    }
}

/// What was published last on a subject.
struct Published {
    /// The message without its time.
    content: Value,
    at: Instant,
}

struct Station {
    shared: Arc<Shared>,
    connection: Connection,
    published: BTreeMap<&'static str, Published>,
    metrics: Option<MachineMetrics>,
}

impl Station {
    fn new(shared: Arc<Shared>, connection: Connection) -> Self {
        Self { shared, connection, published: BTreeMap::new(), metrics: None }
    }

    /// Publishes what changes, and at times what does not. Returns when the streams are gone.
    async fn run(&mut self, counted: &Receiver<MachineMetrics>) {
        loop {
            let (status, queue) = ask(&self.shared).await;
            self.metrics = counted.try_iter().last().or(self.metrics.take());
            let said = [
                self.publish("state", &self.state(&status, &queue, true), Duration::ZERO).await,
                self.publish("job", &self.job(&status, &queue), PROGRESS).await,
                self.publish("faults", &self.faults(&status), Duration::ZERO).await,
                self.publish_metrics().await,
            ];
            if said.contains(&Err(Unpublished::NoStream)) {
                self.shared
                    .pipeline
                    .tell("fleet: the server has forgotten its streams; they are made anew");
                return;
            }
            tokio::time::sleep(self.shared.options.pace.look).await;
        }
    }

    async fn publish_metrics(&mut self) -> Result<(), Unpublished> {
        let Some(mut metrics) = self.metrics.take() else { return Ok(()) };
        metrics.unsent = self.shared.unsent.load(Ordering::Relaxed);
        self.publish("metrics", &Some(metrics), Duration::ZERO).await
    }

    /// Publishes `message` if it says something new and the last is at least so old, or if the last is old anyway.
    async fn publish<T: Serialize>(
        &mut self,
        what: &'static str,
        message: &Option<T>,
        least: Duration,
    ) -> Result<(), Unpublished> {
        let Some(message) = message else { return Ok(()) };
        let mut content = serde_json::to_value(message).unwrap_or_default();
        if let Some(message) = content.as_object_mut() {
            message.remove("time");
        }
        if let Some(last) = self.published.get(what) {
            let age = last.at.elapsed();
            let is_due =
                age >= self.shared.options.pace.repeat || (last.content != content && age >= least);
            if !is_due {
                return Ok(());
            }
        }
        // A message for a server that is away would only be old when it is there again.
        let said = match self.connection.client.connection_state() {
            State::Connected => {
                let subject = streams::machine(&self.shared.options.machine, what);
                self.connection.tell(subject, message).await
            }
            _ => Err(Unpublished::Failed("the server is away".to_owned())),
        };
        match &said {
            Ok(()) => {
                self.published.insert(what, Published { content, at: Instant::now() });
            }
            Err(_) => {
                self.shared.unsent.fetch_add(1, Ordering::Relaxed);
            }
        }
        said
    }

    async fn say_goodbye(&mut self) {
        let (status, queue) = ask(&self.shared).await;
        let state = self.state(&status, &queue, false);
        // Whether or not it arrives, nobody waits any longer.
        let _ = self.publish("state", &state, Duration::ZERO).await;
    }

    fn state(
        &self,
        status: &Result<Status, String>,
        queue: &Result<Queue, String>,
        online: bool,
    ) -> Option<MachineState> {
        let options = &self.shared.options;
        let common = MachineState {
            version: VERSION,
            machine: options.machine.clone(),
            time: now(),
            interval: options.pace.repeat.as_secs_f64(),
            online,
            group: options.group.clone(),
            busy: options.group.as_ref().and_then(|_| busy(status, queue)),
            ..MachineState::default()
        };
        Some(match status {
            Ok(status) => MachineState {
                state: status.state.clone(),
                cause: status.cause.clone(),
                fault: status.fault.clone(),
                machine_file: status.machine_file.clone(),
                unhomed: status.unhomed.clone(),
                ..common
            },
            Err(error) => {
                MachineState { state: "unknown".to_owned(), cause: Some(error.clone()), ..common }
            }
        })
    }

    fn job(
        &self,
        status: &Result<Status, String>,
        queue: &Result<Queue, String>,
    ) -> Option<MachineJob> {
        let (status, queue) = (status.as_ref().ok()?, queue.as_ref().ok()?);
        let file = queue.running.as_ref().and_then(|job| job.file.as_deref());
        let job = status.job_number.map(|number| JobProgress {
            number,
            name: status.job.clone().unwrap_or_default(),
            id: file.and_then(|file| spool::id_of(&self.shared.options.spool, file)),
            share: status.share,
            elapsed: status.elapsed,
            time_left: status.time_left,
            stroke: status.stroke,
            strokes: status.strokes,
            rate: status.rate,
            held: status.held,
        });
        Some(MachineJob {
            version: VERSION,
            machine: self.shared.options.machine.clone(),
            time: now(),
            job,
            waiting: queue.waiting.len() as u64,
            held: queue.held.clone(),
        })
    }

    fn faults(&self, status: &Result<Status, String>) -> Option<MachineFaults> {
        Some(MachineFaults {
            version: VERSION,
            machine: self.shared.options.machine.clone(),
            time: now(),
            faults: status.as_ref().ok()?.faults.clone(),
        })
    }
}

/// Asks the pipeline, on a thread that may wait.
pub(crate) async fn ask(shared: &Arc<Shared>) -> (Result<Status, String>, Result<Queue, String>) {
    let own = shared.clone();
    let asked = tokio::task::spawn_blocking(move || {
        let status = own.pipeline.status();
        let queue = if status.is_ok() { own.pipeline.queue() } else { Err(String::new()) };
        (status, queue)
    });
    match asked.await {
        Ok(asked) => asked,
        Err(error) => (Err(error.to_string()), Err(error.to_string())),
    }
}
