//! A server of the test's own, and pipelines that are none.

use fleet::{Options, Pace, Pipeline, Publisher, Server, Verdict};
use monitor::hub::{Batch, Sink};
use operator::fleet::{FleetStatus, JobRefusal};
use operator::{Queue, QueuedJob, Status};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Long beyond anything that a loaded computer needs; only a hang lasts so long.
pub(crate) const PATIENCE: Duration = Duration::from_secs(90);

/// Waits until `holds` gives something.
pub(crate) fn until<T>(what: &str, mut holds: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(found) = holds() {
            return found;
        }
        assert!(started.elapsed() < PATIENCE, "{what}: not within {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// The program `nats-server`: as `NATS_SERVER` says, or where commands are looked for.
fn program() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("NATS_SERVER") {
        return Some(named.into());
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    // Debian has it where only root looks.
    let folders = std::env::split_paths(&path).chain(["/usr/sbin".into()]);
    folders.map(|folder| folder.join("nats-server")).find(|file| file.is_file())
}

/// A server that ends with the test.
pub(crate) struct Nats {
    child: Child,
    folder: TempDir,
    port: u16,
    more: String,
}

impl Nats {
    /// One with JetStream. Without the program, this says on standard error that the test was not run, and gives none.
    pub(crate) fn start() -> Option<Self> {
        Self::start_with("jetstream { store_dir: \"FOLDER/store\" }")
    }

    /// One with this in its configuration; FOLDER stands for a folder of its own.
    pub(crate) fn start_with(more: &str) -> Option<Self> {
        let Some(program) = program() else {
            let thread = std::thread::current();
            // Past the test's own capture: nobody shall take it for run.
            let _ = writeln!(
                std::io::stderr(),
                "NOT RUN: {}: no nats-server in PATH. `apt-get install nats-server`, or name it in NATS_SERVER",
                thread.name().unwrap_or_default()
            );
            return None;
        };
        let folder = tempfile::tempdir().unwrap();
        let (child, port) = spawn(&program, folder.path(), -1, more);
        Some(Self { child, folder, port, more: more.to_owned() })
    }

    pub(crate) fn server(&self) -> Server {
        server(&format!("nats://127.0.0.1:{}", self.port))
    }

    /// Kills it, and lets `between` happen before it is there again.
    pub(crate) fn restart(&mut self, between: impl FnOnce()) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
        between();
        let port = i32::from(self.port);
        (self.child, _) = spawn(&program().unwrap(), self.folder.path(), port, &self.more);
    }
}

impl Drop for Nats {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn spawn(program: &Path, folder: &Path, port: i32, more: &str) -> (Child, u16) {
    let config = folder.join("nats.conf");
    let more = more.replace("FOLDER", folder.to_str().unwrap());
    std::fs::write(
        &config,
        format!(
            "host: 127.0.0.1\nport: {port}\nports_file_dir: \"{}\"\n{more}\n",
            folder.display()
        ),
    )
    .unwrap();
    let log = std::fs::File::create(folder.join("log")).unwrap();
    let child = Command::new(program)
        .arg("-c")
        .arg(&config)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(log)
        .spawn()
        .unwrap();
    let ports = folder.join(format!(
        "{}_{}.ports",
        program.file_name().unwrap().to_str().unwrap(),
        child.id()
    ));
    let port = until("the server's port", || {
        let text = std::fs::read_to_string(&ports).ok()?;
        let ports: serde_json::Value = serde_json::from_str(&text).ok()?;
        ports["nats"][0].as_str()?.rsplit(':').next()?.parse().ok()
    });
    (child, port)
}

/// A server at an address, which asks for nothing.
pub(crate) fn server(address: &str) -> Server {
    Server { address: address.parse().unwrap(), credentials: None, authority: None }
}

pub(crate) fn survey(server: &Server) -> FleetStatus {
    fleet::survey::survey(server).unwrap()
}

/// Hands the fleet a job.
pub(crate) fn submit(server: &Server, name: &str, text: &str) -> String {
    fleet::send::submit(server, "lasers", name, &["marking.power=30 %".to_owned()], text.into())
        .unwrap()
}

#[derive(Default)]
pub(crate) struct State {
    pub(crate) status: Status,
    pub(crate) queue: Queue,
    newest: u64,
    /// What was in the files of the jobs that were queued, in order.
    pub(crate) done: Vec<String>,
    /// Names that are refused, and why.
    pub(crate) refused: BTreeMap<String, JobRefusal>,
    pub(crate) told: Vec<String>,
}

/// A pipeline that does each job at once.
#[derive(Default)]
pub(crate) struct Cell {
    state: Mutex<State>,
    /// Whether a check goes on until nobody waits for it.
    pub(crate) hangs: AtomicBool,
    pub(crate) is_checking: AtomicBool,
    /// Whether it takes no job.
    pub(crate) is_full: AtomicBool,
}

impl Cell {
    pub(crate) fn idle() -> Arc<Self> {
        let cell = Self::default();
        cell.state().status.state = "idle".to_owned();
        Arc::new(cell)
    }

    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap()
    }

    /// Whether it was told something with this in it.
    pub(crate) fn heard(&self, words: &str) -> Option<String> {
        self.state().told.iter().find(|told| told.contains(words)).cloned()
    }
}

impl Pipeline for Cell {
    fn status(&self) -> Result<Status, String> {
        Ok(self.state().status.clone())
    }

    fn queue(&self) -> Result<Queue, String> {
        Ok(self.state().queue.clone())
    }

    fn check(&self, file: &Path, set: &[String], is_given_up: &dyn Fn() -> bool) -> Verdict {
        assert_eq!(set, ["marking.power=30 %"]);
        self.is_checking.store(true, Ordering::Relaxed);
        while self.hangs.load(Ordering::Relaxed) {
            if is_given_up() {
                return Verdict::Unknown("it was given up".to_owned());
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let name = file.file_name().unwrap().to_str().unwrap();
        match self.state().refused.get(name) {
            Some(refusal) => Verdict::Refused(refusal.clone()),
            None => Verdict::Fit,
        }
    }

    fn submit(&self, file: &Path, set: &[String]) -> Result<u64, String> {
        if self.is_full.load(Ordering::Relaxed) {
            return Err("100 jobs wait already".to_owned());
        }
        let text = std::fs::read_to_string(file).unwrap();
        let mut state = self.state();
        state.newest += 1;
        let job = QueuedJob {
            number: state.newest,
            name: text.clone(),
            file: Some(file.display().to_string()),
            set: set.to_vec(),
            outcome: Some("completed".to_owned()),
            ..QueuedJob::default()
        };
        state.queue.ended.push(job);
        state.done.push(text);
        Ok(state.newest)
    }

    fn tell(&self, text: &str) {
        self.state().told.push(text.to_owned());
    }
}

/// A machine of the fleet whose hub is polled.
pub(crate) struct Machine {
    pub(crate) publisher: Publisher,
    pub(crate) options: Options,
}

impl Machine {
    pub(crate) fn new(
        server: &Server,
        name: &str,
        group: Option<&str>,
        spool: &Path,
        cell: Arc<Cell>,
    ) -> Self {
        let pace = Pace {
            look: Duration::from_millis(20),
            repeat: Duration::from_millis(100),
            wait: Duration::from_millis(200),
            patience: Duration::from_millis(500),
        };
        let options = Options {
            server: server.clone(),
            machine: name.to_owned(),
            group: group.map(str::to_owned),
            spool: spool.join(name),
            pace,
        };
        let publisher = Publisher::start(options.clone(), cell).unwrap();
        Self { publisher, options }
    }

    /// Hands the hub's end a batch.
    pub(crate) fn poll(&mut self, batch: &Batch) {
        self.publisher.take(batch).unwrap();
    }
}
