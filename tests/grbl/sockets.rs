//! The server: who may connect, who operates, and what a client that does not behave costs the others.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use grbl::machine::{Answer, Ask, JobState, Machine};
use grbl::server::{Access, Server};
use grbl::session::Session;
use messages::random::SplitMix64;
use operator::{Status, Verb};

use crate::bench::{FakeMachine, machine};
use crate::fuzz::message;
use crate::support::PATIENCE;

/// A machine that any thread may ask, and whose time passes as it is asked.
#[derive(Clone)]
struct Cell(Arc<Mutex<FakeMachine>>);

impl Machine for Cell {
    fn status(&self) -> Result<Status, String> {
        let mut machine = self.0.lock().unwrap();
        machine.pass(0.05);
        Ok(machine.status.clone())
    }

    fn ask(&self, ask: &Ask) -> Answer {
        self.0.lock().unwrap().ask(ask)
    }

    fn job(&self, number: u64) -> Result<JobState, String> {
        Ok(self.0.lock().unwrap().job(number))
    }
}

/// A server and where it listens.
struct Served {
    server: Option<Server>,
    cell: Cell,
    address: std::net::SocketAddr,
    folder: tempfile::TempDir,
}

impl Served {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let session = Session::new(machine(), folder.path().join("spool"));
        let cell = Cell(Arc::new(Mutex::new(FakeMachine::new())));
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let access = Access { tty: Some(folder.path().join("port")), ..Access::default() };
        let server = Server::start(cell.clone(), session, Some(listener), access).unwrap();
        Self { server: Some(server), cell, address, folder }
    }

    fn connect(&self) -> Talk<TcpStream> {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        Talk { reader: BufReader::new(stream.try_clone().unwrap()), writer: stream }
    }
}

/// A client that waits for what it expects.
pub(crate) struct Talk<S: Read + Write> {
    pub(crate) reader: BufReader<S>,
    pub(crate) writer: S,
}

impl<S: Read + Write> Talk<S> {
    pub(crate) fn send(&mut self, bytes: impl AsRef<[u8]>) {
        self.writer.write_all(bytes.as_ref()).unwrap();
    }

    pub(crate) fn line(&mut self) -> String {
        let mut line = String::new();
        self.reader.read_line(&mut line).unwrap();
        line.trim_end().to_owned()
    }

    /// Lines up to the first one that begins with this.
    pub(crate) fn until(&mut self, start: &str) -> Vec<String> {
        let mut lines = Vec::new();
        loop {
            let mut line = String::new();
            let length = self.reader.read_line(&mut line).unwrap();
            assert!(length > 0, "the end, after {lines:?}, and no {start:?}");
            lines.push(line.trim_end().to_owned());
            if lines.last().unwrap().starts_with(start) {
                return lines;
            }
        }
    }

    /// Asks for reports until the state is this one.
    pub(crate) fn until_state(&mut self, state: &str) {
        let started = Instant::now();
        loop {
            self.send("?");
            let lines = self.until("<");
            if lines.last().unwrap()[1..].starts_with(state) {
                return;
            }
            assert!(started.elapsed() < PATIENCE, "{state}: {lines:?}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

#[test]
fn whoever_only_watches_stops_the_machine_all_the_same() {
    let served = Served::new();
    let asked = |verb: Verb| {
        let started = Instant::now();
        while !served.cell.0.lock().unwrap().asked.contains(&Ask::Verb { verb, value: 0.0 }) {
            assert!(started.elapsed() < PATIENCE, "{verb:?}");
            std::thread::sleep(Duration::from_millis(2));
        }
    };
    let mut first = served.connect();
    first.until("Grbl 1.1h");
    first.send("G21\n");
    first.until("ok");
    let mut second = served.connect();
    second.until("[MSG:another client operates");
    second.send("!");
    asked(Verb::Hold);
    first.until("[MSG:another client holds the machine]");
    // In the middle of a line of the one that operates.
    first.send("G0 X");
    second.send("\x18");
    asked(Verb::Stop);
    first.until("[MSG:another client has reset the machine]");
    first.until("Grbl 1.1h");
    second.until("Grbl 1.1h");
    // It operates no more than before.
    second.send("G0 X1\n");
    second.until("error:9");
    first.send("\nG21\n");
    first.until("ok");
}

#[test]
fn one_client_operates_and_others_watch_until_they_take_over() {
    let served = Served::new();
    let mut first = served.connect();
    first.until("Grbl 1.1h");
    first.send("G21\n");
    first.until("ok");
    let mut second = served.connect();
    second.until("[MSG:another client operates");
    second.send("?");
    second.until("<Idle|");
    second.send("$$\n");
    second.until("ok");
    second.send("G0 X1\n");
    second.until("error:9");
    second.send([0x91, b'~']);
    second.send("$G\n");
    second.until("ok");
    assert!(served.cell.0.lock().unwrap().asked.is_empty(), "who watches moves nothing");
    second.send("$TAKE\n");
    second.until("Grbl 1.1h");
    first.until("[MSG:another client has taken over");
    second.send("G21\n");
    second.until("ok");
    drop(second);
    // Nobody operates now: the first one does, as soon as it wants to.
    let started = Instant::now();
    loop {
        first.send("G21\n");
        let answer = first.until("").pop().unwrap();
        if answer.starts_with("Grbl") || answer == "ok" {
            break;
        }
        assert!(started.elapsed() < PATIENCE);
    }
}

#[test]
fn a_job_goes_on_when_its_client_has_gone() {
    let served = Served::new();
    let mut client = served.connect();
    client.until("Grbl");
    client.send("G90 M4 S500 F3000\nG1 X20\nG1 X30\nM2\n");
    (0..3).for_each(|_| drop(client.until("ok")));
    client.until_state("Run");
    let started = Instant::now();
    while served.cell.0.lock().unwrap().asked.is_empty() {
        assert!(started.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(2));
    }
    drop(client);
    let mut next = served.connect();
    next.until("Grbl");
    next.until_state("Idle");
    let asked = served.cell.0.lock().unwrap().asked.clone();
    assert_eq!(asked.iter().filter(|ask| matches!(ask, Ask::Submit { .. })).count(), 1);
    assert!(!asked.iter().any(|ask| matches!(ask, Ask::Verb { verb: Verb::Stop, .. })));
}

#[test]
fn the_terminal_is_a_serial_port_like_any_other() {
    use std::os::unix::fs::OpenOptionsExt;
    let served = Served::new();
    let port = served.folder.path().join("port");
    let open =
        || std::fs::File::options().read(true).write(true).custom_flags(0o400).open(&port).unwrap();
    for _ in 0..2 {
        let file = open();
        let mut client = Talk { reader: BufReader::new(file.try_clone().unwrap()), writer: file };
        // Where the end of the one before has not been seen yet, nobody greets.
        client.send("\x18");
        client.until("Grbl 1.1h");
        client.send("$I\n");
        assert!(client.until("ok").iter().any(|line| line == "[OPT:VL,15,128]"));
        client.send("?");
        client.until("<Idle");
    }
}

#[test]
fn a_client_that_sends_anything_and_reads_nothing_harms_nobody() {
    let served = Served::new();
    let mut random = SplitMix64::new(7);
    for _ in 0..4 {
        let mut client = served.connect();
        client.until("Grbl");
        client.writer.set_write_timeout(Some(Duration::from_millis(200))).unwrap();
        for _ in 0..5_000 {
            if client.writer.write_all(&message(&mut random)).is_err() {
                break;
            }
        }
    }
    let mut client = served.connect();
    client.until("Grbl");
    let started = Instant::now();
    loop {
        client.send("\x18$X\n~?");
        if client.until("<").last().unwrap().starts_with("<Idle") {
            break;
        }
        assert!(started.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(10));
    }
    let asked = served.cell.0.lock().unwrap().asked.clone();
    assert!(!asked.iter().any(|ask| matches!(ask, Ask::Verb { verb: Verb::TestPulse, .. })));
}

#[test]
fn a_server_ends_with_clients_connected() {
    let mut served = Served::new();
    let mut client = served.connect();
    client.until("Grbl");
    served.server = None;
    let mut rest = String::new();
    let _ = client.reader.read_to_string(&mut rest);
    assert!(!served.folder.path().join("port").exists(), "the port goes too");
    assert_eq!(client.line(), "");
}
