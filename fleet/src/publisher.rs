//! The end of a fleet at a machine: a sink of the hub, and a thread that speaks with the server.

use crate::address::Server;
use crate::counts::Counts;
use crate::pipeline::Pipeline;
use crate::station;
use monitor::hub::{Batch, Lost, Sink};
use operator::fleet::MachineMetrics;
use runtime::ServiceError;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Counts that wait for a thread that is busy with a server; those that find no room are let go.
const ROOM: usize = 8;

/// How long the thread may take to say that the machine leaves; its requests have bounds of their own.
const END_PATIENCE: Duration = Duration::from_secs(2);

/// How a machine takes part in its fleet.
#[derive(Debug, Clone)]
pub struct Options {
    /// The server.
    pub server: Server,
    /// The machine's name, one part of a subject: see [`crate::name::check`].
    pub machine: String,
    /// Whose jobs it takes; `None` to take none.
    pub group: Option<String>,
    /// The folder of jobs that were taken.
    pub spool: PathBuf,
    /// How often it does what.
    pub pace: Pace,
}

/// How often a machine does what.
#[derive(Debug, Clone, Copy)]
pub struct Pace {
    /// From one look at the pipeline to the next.
    pub look: Duration,
    /// From one message to the next where nothing has changed.
    pub repeat: Duration,
    /// How long a request for a job waits at the server.
    pub wait: Duration,
    /// After what time a job that a machine was given is given to another, if it has not said anything.
    pub patience: Duration,
}

impl Default for Pace {
    fn default() -> Self {
        Self {
            look: Duration::from_millis(500),
            repeat: Duration::from_secs(5),
            wait: Duration::from_secs(5),
            patience: Duration::from_secs(60),
        }
    }
}

/// What the thread shares with the sink.
pub(crate) struct Shared {
    pub(crate) options: Options,
    pub(crate) pipeline: Arc<dyn Pipeline>,
    pub(crate) is_over: AtomicBool,
    /// Messages that were never sent.
    pub(crate) unsent: AtomicU64,
}

impl Shared {
    pub(crate) fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }
}

/// A machine's end of its fleet. Dropping it says goodbye.
pub struct Publisher {
    counts: Counts,
    told: Option<Instant>,
    sender: SyncSender<MachineMetrics>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl std::fmt::Debug for Publisher {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Publisher")
            .field("options", &self.shared.options)
            .finish_non_exhaustive()
    }
}

impl Publisher {
    /// Starts to look for the server. What is wrong with it is told to people, again and again tried, and no error here.
    ///
    /// # Errors
    /// A thread that cannot be started.
    pub fn start(options: Options, pipeline: Arc<dyn Pipeline>) -> io::Result<Self> {
        let runtime = crate::runtime()?;
        let (sender, receiver) = sync_channel(ROOM);
        let counts = Counts::new(options.machine.clone());
        let shared = Arc::new(Shared {
            options,
            pipeline,
            is_over: AtomicBool::new(false),
            unsent: AtomicU64::new(0),
        });
        let own = shared.clone();
        let work = move || {
            runtime.block_on(station::run(&own, &receiver));
            // A job that is being checked is given up with its thread; its message goes to another machine.
            runtime.shutdown_background();
        };
        let thread = std::thread::Builder::new().name("fleet".into()).spawn(work)?;
        Ok(Self { counts, told: None, sender, shared, thread: Some(thread) })
    }

    /// Messages that were never sent, for want of a server that takes them.
    pub fn unsent(&self) -> u64 {
        self.shared.unsent.load(Ordering::Relaxed)
    }

    /// Says that the machine leaves, and ends the thread, or leaves it to itself after some seconds.
    fn close(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        let Some(thread) = self.thread.take() else { return };
        let told = Instant::now();
        while !thread.is_finished() && told.elapsed() < END_PATIENCE {
            std::thread::sleep(Duration::from_millis(5));
        }
        if thread.is_finished() {
            // One that panicked has said so.
            let _ = thread.join();
        }
    }
}

impl Sink for Publisher {
    fn lose(&mut self, lost: Lost) {
        self.counts.lose(lost);
    }

    fn take(&mut self, batch: &Batch) -> Result<(), ServiceError> {
        self.counts.take(batch);
        if self.told.is_none_or(|told| told.elapsed() >= self.shared.options.pace.repeat) {
            self.told = Some(Instant::now());
            // Whoever reads them wants the newest, and the next ones have all that is in these.
            if self.sender.try_send(self.counts.metrics()).is_err() {
                self.shared.unsent.fetch_add(1, Ordering::Relaxed);
            }
        }
        Ok(())
    }

    fn end(&mut self) -> Result<(), ServiceError> {
        self.close();
        Ok(())
    }
}

impl Drop for Publisher {
    fn drop(&mut self) {
        self.close();
    }
}
