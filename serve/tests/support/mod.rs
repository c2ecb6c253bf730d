//! A server with a pipeline that only writes down what it is asked, and a client that speaks plain HTTP.

#![allow(dead_code, reason = "each test binary uses its own part")]
#![allow(clippy::unwrap_used)]

use machine::Machine;
use operator::{ClientError, Queue, QueuedJob, Request, Status, VerbReply};
use serde_json::{Value, json};
use serve::context::Context;
use serve::pipeline::{Description, Pipeline};
use serve::server::{Options, Server};
use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Long beyond anything that a loaded computer needs; only a hang lasts so long.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

pub(crate) const OPERATE: &str = "operate-0123456789";
pub(crate) const WATCH: &str = "watch-0123456789ab";

/// A pipeline that writes down what it is asked.
pub(crate) struct Fake {
    asked: Mutex<Vec<Value>>,
    pub(crate) status: Mutex<Status>,
    pub(crate) queue: Mutex<Queue>,
    /// What a verb is answered with.
    pub(crate) refusal: Mutex<Option<String>>,
    /// Whether it answers at all.
    pub(crate) is_there: AtomicBool,
}

impl Fake {
    /// What was asked of it, but for what the server asks by itself.
    pub(crate) fn asked(&self) -> Vec<Value> {
        let asked = self.asked.lock().unwrap();
        let own = |it: &&Value| it["request"] != "status" && it["request"] != "queue";
        asked.iter().filter(own).cloned().collect()
    }
}

impl Pipeline for Fake {
    fn name(&self) -> &str {
        "fake"
    }

    fn ask(&self, request: &Request) -> Result<Value, ClientError> {
        if !self.is_there.load(Ordering::Relaxed) {
            return Err(ClientError::Refused("no pipeline is running".to_owned()));
        }
        self.asked.lock().unwrap().push(json!(request));
        Ok(match request {
            Request::Status => json!(*self.status.lock().unwrap()),
            Request::Queue | Request::HoldQueue | Request::StartQueue => {
                json!(*self.queue.lock().unwrap())
            }
            Request::Submit { .. } | Request::Repeat { .. } => json!({ "number": 7 }),
            Request::Verb { .. }
            | Request::Operate { .. }
            | Request::Input { .. }
            | Request::Output { .. } => match &*self.refusal.lock().unwrap() {
                None => json!(VerbReply { number: 5, ..VerbReply::accepted("idle") }),
                Some(words) => {
                    let code = messages::Refusal::SoftLimit;
                    json!(VerbReply::refused(code, words.clone(), "idle".to_owned()))
                }
            },
            _ => json!({}),
        })
    }

    fn describe(&self) -> Result<Description, String> {
        Ok(Description { machine: Machine::builtin(), arguments: Vec::new() })
    }
}

/// A server that answers.
pub(crate) struct Place {
    pub(crate) address: SocketAddr,
    pub(crate) context: Context,
    pub(crate) fake: Arc<Fake>,
    pub(crate) folder: tempfile::TempDir,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// An answer.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) headers: BTreeMap<String, String>,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|error| panic!("{error}: {:?}", String::from_utf8_lossy(&self.body)))
    }

    /// Asserts the status of an answer that says why not, and gives the words.
    pub(crate) fn error(&self, status: u16) -> String {
        assert_eq!(self.status, status, "{:?}", String::from_utf8_lossy(&self.body));
        self.json()["error"].as_str().unwrap().to_owned()
    }

    /// Asserts that it was done, and gives the JSON.
    pub(crate) fn done(&self) -> Value {
        assert_eq!(self.status, 200, "{:?}", String::from_utf8_lossy(&self.body));
        self.json()
    }
}

impl Place {
    /// One on which this user needs no token.
    pub(crate) fn new() -> Self {
        Self::with(true)
    }

    /// One on which everybody needs a token.
    pub(crate) fn strict() -> Self {
        Self::with(false)
    }

    fn with(trusts_own_user: bool) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let tokens = folder.path().join("tokens");
        std::fs::write(&tokens, format!("operate {OPERATE}\nwatch {WATCH}\n")).unwrap();
        std::fs::set_permissions(&tokens, PermissionsExt::from_mode(0o600)).unwrap();
        let fake = Arc::new(Fake {
            asked: Mutex::default(),
            status: Mutex::new(Status { state: "idle".to_owned(), ..Status::default() }),
            queue: Mutex::default(),
            refusal: Mutex::default(),
            is_there: AtomicBool::new(true),
        });
        let options = options(folder.path(), tokens, trusts_own_user);
        let server = Server::bind(options, fake.clone()).unwrap();
        let (address, context) = (server.address(), server.context().clone());
        context.hub.join(&Machine::builtin());
        let is_over = Arc::new(AtomicBool::new(false));
        let ends = is_over.clone();
        let run = move || server.run(|| ends.load(Ordering::Relaxed)).unwrap();
        let thread = Some(std::thread::spawn(run));
        Self { address, context, fake, folder, is_over, thread }
    }

    pub(crate) fn send(
        &self,
        method: &str,
        path: &str,
        headers: &[(&str, &str)],
        body: &[u8],
    ) -> Answer {
        let mut stream = self.connect();
        let mut head = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\n");
        if !headers.iter().any(|(name, _)| *name == "Host") {
            head += &format!("Host: {}\r\n", self.address);
        }
        for (name, value) in headers {
            head += &format!("{name}: {value}\r\n");
        }
        if !headers.iter().any(|(name, _)| *name == "Content-Length") {
            head += &format!("Content-Length: {}\r\n", body.len());
        }
        stream.write_all(&[head.as_bytes(), b"\r\n", body].concat()).unwrap();
        let mut bytes = Vec::new();
        let _ = stream.read_to_end(&mut bytes);
        let end = bytes.windows(4).position(|it| it == b"\r\n\r\n").expect("no answer");
        let head = String::from_utf8(bytes[..end].to_vec()).unwrap();
        let mut lines = head.lines();
        let status = lines.next().unwrap().split(' ').nth(1).unwrap().parse().unwrap();
        let headers = lines.filter_map(|line| line.split_once(": "));
        let headers = headers.map(|(name, value)| (name.to_ascii_lowercase(), value.to_owned()));
        Answer { status, headers: headers.collect(), body: bytes[end + 4..].to_vec() }
    }

    pub(crate) fn get(&self, path: &str) -> Answer {
        self.send("GET", path, &[], b"")
    }

    pub(crate) fn post(&self, path: &str, body: &[u8]) -> Answer {
        self.send("POST", path, &[("X-Graver", "1")], body)
    }

    pub(crate) fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    /// Waits until something holds.
    pub(crate) fn await_that(&self, what: &str, holds: impl Fn() -> bool) {
        let started = Instant::now();
        while !holds() {
            assert!(started.elapsed() < PATIENCE, "{what}: not within {PATIENCE:?}");
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

/// Options of a server of which everything is in `folder`.
pub(crate) fn options(folder: &Path, tokens: PathBuf, trusts_own_user: bool) -> Options {
    Options {
        listen: "127.0.0.1:0".parse().unwrap(),
        token_file: Some(tokens),
        trusts_own_user,
        names: vec!["laser.example".to_owned()],
        spool: folder.join("spool"),
        program: folder.join("graver"),
        observed: None,
    }
}

/// A job that has ended.
pub(crate) fn ended(number: u64, folder: &Path) -> QueuedJob {
    QueuedJob {
        number,
        name: format!("job {number}"),
        out: Some(folder.display().to_string()),
        started: Some(100),
        ended: Some(130),
        outcome: Some("completed".to_owned()),
        ..QueuedJob::default()
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(ended.is_ok() || std::thread::panicking(), "the server panicked");
        }
    }
}
