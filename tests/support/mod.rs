//! A pipeline of its own for each test: a private run directory, a child process, and the proof
//! that nothing is left.

#![allow(dead_code, reason = "each test binary uses its own part")]
#![allow(clippy::unwrap_used)]

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use monitor::recording::CycleRecord;
use monitor::recording::file::parts::PartsReader;
use runtime::Instance;
use runtime::peer::Peer;
use runtime::socket::OperatorClient;
use serde_json::{Value, json};
use tempfile::TempDir;

/// Long beyond anything that a loaded computer needs; only a hang lasts so long.
pub(crate) const PATIENCE: Duration = Duration::from_secs(90);

/// Numbers of signals; signal(7).
pub(crate) const HANGUP: i32 = 1;
pub(crate) const CONTINUE: i32 = 18;
pub(crate) const STOP: i32 = 19;
pub(crate) const INTERRUPT: i32 = 2;
pub(crate) const KILL: i32 = 9;
pub(crate) const TERMINATE: i32 = 15;

/// The root of the source tree.
pub(crate) fn source(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The golden vectors of this name.
pub(crate) fn golden(name: &str) -> Value {
    let path = source("tests/golden").join(format!("{name}.json"));
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// A place where one instance lives alone: no other test and no other user can meet it.
#[derive(Debug)]
pub(crate) struct Place {
    directory: TempDir,
    instance: Instance,
}

impl Place {
    /// A fresh place.
    pub(crate) fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let directory = tempfile::Builder::new().prefix("gr").tempdir_in("/tmp").unwrap();
        let name = format!("test-{}-{number}", std::process::id());
        let instance = Instance::below(&directory.path().join("graver"), &name).unwrap();
        Self { directory, instance }
    }

    /// A path in it.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// A file in it with this text.
    pub(crate) fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    /// The instance that lives here.
    pub(crate) fn instance(&self) -> &Instance {
        &self.instance
    }

    /// `graver` with these arguments, in this place.
    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        self.command_of(Path::new(env!("CARGO_BIN_EXE_graver")), arguments)
    }

    /// A copy of `graver` with these arguments, in this place.
    pub(crate) fn command_of(&self, program: &Path, arguments: &[&str]) -> Command {
        let mut command = Command::new(program);
        command
            .args(arguments)
            .env("XDG_RUNTIME_DIR", self.directory.path())
            .env("XDG_STATE_HOME", self.directory.path().join("state"))
            .current_dir(self.directory.path())
            .stdin(Stdio::null());
        command
    }

    /// Runs `graver` to its end.
    pub(crate) fn graver(&self, arguments: &[&str]) -> Ended {
        self.start(arguments).wait()
    }

    /// Runs `graver` with `--instance` of this place to its end.
    pub(crate) fn ask(&self, arguments: &[&str]) -> Ended {
        let mut all = arguments.to_vec();
        all.extend(["--instance", self.instance.name()]);
        self.graver(&all)
    }

    /// Starts `graver` and does not wait.
    pub(crate) fn start(&self, arguments: &[&str]) -> Running {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let output = self.path(&format!("stdout-{number}"));
        let error = self.path(&format!("stderr-{number}"));
        let child = self
            .command(arguments)
            .stdout(File::create(&output).unwrap())
            .stderr(File::create(&error).unwrap())
            .spawn()
            .unwrap();
        Running { child: Some(child), code: None, output, error }
    }

    /// Starts `graver run` of a job into `out` here, with JSON.
    ///
    /// Without real-time scheduling: several tests share one core.
    pub(crate) fn run(&self, job: &Path, out: &str, more: &[&str]) -> Running {
        let out = self.path(out);
        let mut arguments = vec!["run", job.to_str().unwrap(), "--json", "--no-realtime"];
        arguments.extend(["--instance", self.instance.name(), "--out", out.to_str().unwrap()]);
        arguments.extend(more);
        self.start(&arguments)
    }

    /// What the pipeline says of itself; `None` while there is none.
    pub(crate) fn status(&self) -> Option<Value> {
        OperatorClient::connect(&self.instance).ok()?.request(&json!({"request": "status"})).ok()
    }

    /// Waits until the pipeline's status holds what is asked for.
    pub(crate) fn await_status(
        &self,
        running: &mut Running,
        what: &str,
        holds: impl Fn(&Value) -> bool,
    ) -> Value {
        let started = Instant::now();
        loop {
            if let Some(status) = self.status()
                && holds(&status)
            {
                return status;
            }
            if let Some(code) = running.try_code() {
                panic!("{what}: ended before, code {code:?}\n{}", running.said());
            }
            assert!(started.elapsed() < PATIENCE, "{what}: not within {PATIENCE:?}");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Waits until `played` setpoints of the job were played.
    pub(crate) fn await_played(&self, running: &mut Running, played: u64) -> Value {
        self.await_status(running, &format!("{played} setpoints played"), |status| {
            status["state"] == "running" && status["played"].as_u64() >= Some(played)
        })
    }

    /// The recording in the run folder of this name: all records that are whole.
    pub(crate) fn recording(&self, out: &str) -> Vec<CycleRecord> {
        PartsReader::open(&self.path(out)).unwrap().map_while(Result::ok).collect()
    }

    /// The summary in the run folder of this name.
    pub(crate) fn summary(&self, out: &str) -> Value {
        let path = self.path(out).join("summary.json");
        let text = std::fs::read(&path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
        serde_json::from_slice(&text).unwrap()
    }

    /// Everything of the instance that exists in the file system.
    pub(crate) fn left(&self) -> Vec<PathBuf> {
        let prefix = self.instance.prefix();
        let shared = std::fs::read_dir("/dev/shm").unwrap().flatten();
        let mut left: Vec<PathBuf> = shared
            .filter(|entry| entry.file_name().to_string_lossy().starts_with(&prefix))
            .map(|entry| entry.path())
            .collect();
        left.extend(
            [self.instance.root(), self.instance.lock_path()]
                .into_iter()
                .filter(|path| path.exists()),
        );
        left
    }

    /// Asserts that nothing is left as soon as these processes have ended.
    pub(crate) fn assert_nothing_left(&self, services: &[Peer]) {
        for service in services {
            assert!(service.ended_within(PATIENCE), "pid {} does not end", service.pid());
        }
        assert_eq!(self.left(), Vec::<PathBuf>::new());
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        // A test that failed half-way was killed half-way too: its own remains go with it.
        for path in self.left() {
            let _ = std::fs::remove_file(&path);
        }
    }
}

/// The service of this name in a status.
pub(crate) fn service(status: &Value, name: &str) -> Peer {
    let pid = status["services"][name].as_i64().unwrap_or_else(|| panic!("no {name}: {status}"));
    Peer::open(i32::try_from(pid).unwrap()).unwrap()
}

/// All services in a status.
pub(crate) fn services(status: &Value) -> Vec<Peer> {
    ["planner", "controller", "drives", "monitor"].map(|name| service(status, name)).into()
}

/// A `graver` that runs.
#[derive(Debug)]
pub(crate) struct Running {
    /// `None` once it has ended.
    child: Option<Child>,
    /// Its exit code then.
    code: Option<i32>,
    output: PathBuf,
    error: PathBuf,
}

impl Running {
    /// One whose output goes elsewhere than into files.
    pub(crate) fn of(child: Child) -> Self {
        let (output, error) = ("/dev/null".into(), "/dev/null".into());
        Self { child: Some(child), code: None, output, error }
    }

    /// Its process.
    pub(crate) fn peer(&self) -> Peer {
        let child = self.child.as_ref().expect("it has ended");
        Peer::open(i32::try_from(child.id()).unwrap()).unwrap()
    }

    /// Sends it a signal.
    pub(crate) fn signal(&self, number: i32) {
        self.peer().signal(number).unwrap();
    }

    /// Its exit code if it has ended; `Some(None)` after a signal.
    pub(crate) fn try_code(&mut self) -> Option<Option<i32>> {
        let Some(child) = &mut self.child else { return Some(self.code) };
        self.code = child.try_wait().unwrap()?.code();
        self.child = None;
        Some(self.code)
    }

    /// Waits for its end, and gives what came through its pipes.
    pub(crate) fn output(mut self) -> Output {
        let child = self.child.take().expect("it has ended");
        child.wait_with_output().unwrap()
    }

    /// What it has said so far.
    pub(crate) fn said(&self) -> String {
        std::fs::read_to_string(&self.error).unwrap()
            + &std::fs::read_to_string(&self.output).unwrap()
    }

    /// Waits for its end.
    pub(crate) fn wait(mut self) -> Ended {
        let started = Instant::now();
        let code = loop {
            if let Some(code) = self.try_code() {
                break code;
            }
            assert!(started.elapsed() < PATIENCE, "does not end:\n{}", self.said());
            std::thread::sleep(Duration::from_millis(2));
        };
        let output = std::fs::read_to_string(&self.output).unwrap();
        let error = std::fs::read_to_string(&self.error).unwrap();
        assert!(!error.contains("panicked"), "{error}");
        Ended { code, output, error }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// How a `graver` ended.
#[derive(Debug)]
pub(crate) struct Ended {
    /// Its exit code; `None` after a signal.
    pub(crate) code: Option<i32>,
    /// Its standard output.
    pub(crate) output: String,
    /// Its standard error.
    pub(crate) error: String,
}

impl Ended {
    /// Asserts that it did what it was asked.
    pub(crate) fn accepted(&self) {
        assert_eq!(self.code, Some(0), "{}", self.error);
    }

    /// Asserts the exit code, and gives the JSON object on standard output.
    pub(crate) fn json(&self, code: i32) -> Value {
        assert_eq!(self.code, Some(code), "{}\n{}", self.error, self.output);
        serde_json::from_str(&self.output)
            .unwrap_or_else(|error| panic!("{error}: {}\n{}", self.output, self.error))
    }
}

/// Whether a record tells of light in the cycle that ended with its measurement.
pub(crate) fn is_lit(record: &CycleRecord) -> bool {
    record.feedback.laser.is_lit()
}

/// Asserts that a recording ends dark and at rest: no light in its last cycles, and every axis
/// within two encoder counts of one place.
pub(crate) fn assert_ends_dark_and_at_rest(records: &[CycleRecord], axes: usize) {
    const LAST: usize = 5;
    assert!(records.len() > LAST, "{} records", records.len());
    let last = &records[records.len() - LAST..];
    assert!(!last.iter().any(is_lit), "lit at the end");
    for axis in 0..axes {
        let counts = last.iter().map(|record| record.feedback.counts[axis]);
        let (low, high) = (counts.clone().min().unwrap(), counts.max().unwrap());
        assert!(high - low <= 2, "axis {axis} moves by {} counts in {LAST} ms", high - low);
    }
}

/// A program that marks `lines` parallel lines of 30 mm at 0.1 m/s around the middle of the area:
/// lit for most of its time, about 0.45 s a line.
pub(crate) fn lines(lines: u32) -> String {
    let mut text = String::from("G21 G90 G54\nM3 S800 F6000\n");
    for line in 0..lines {
        let y = 2 * line;
        let (from, to) = if line % 2 == 0 { (-15, 15) } else { (15, -15) };
        text += &format!("G0 X{from} Y{y}\nG1 X{to}\n");
    }
    text + "M5\nM2\n"
}

/// A program of hours that is planned to its end before anything moves: its last line is out of reach.
pub(crate) fn slow_to_plan() -> String {
    let lines = "G1 X15\nG1 X-15\n".repeat(20);
    format!("G21 G90 G54\nM3 S800 F1\nG0 X-15 Y0\n{lines}G1 X1000\nM5\nM2\n")
}

/// Asserts that a JSON value is valid against the committed schema of this name.
pub(crate) fn assert_valid(name: &str, value: &Value) {
    let path = source("docs/schema").join(format!("{name}.json"));
    let schema = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    let errors: Vec<String> = validator
        .iter_errors(value)
        .map(|error| format!("{}: {error}", error.instance_path()))
        .collect();
    assert!(errors.is_empty(), "{name}: {errors:#?}\n{value:#}");
}

/// A number inside a JSON value, by its path of keys.
pub(crate) fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} in {value:#}"))
}

/// Asserts that a run gave its drives the commands that the simulation did. On a computer that is busy
/// enough a machine holds by itself, and says so: then it marks the same by other commands.
pub(crate) fn assert_same_commands(run: &Value, simulated: &Value) {
    let warnings = run["warnings"].to_string();
    if !["the machine went back", "the machine waited"].iter().any(|held| warnings.contains(held)) {
        assert_eq!(run["digest"], simulated["digest"], "{warnings}");
        assert_eq!(run["limits"], simulated["limits"], "{warnings}");
    }
}
