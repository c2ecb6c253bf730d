//! A chiller on Modbus TCP beside a machine: what it says holds a job in the dark, with its name, and what it is told.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use super::cell::{Cell, machine};
use super::support::lines;
use super::{refused, says};
use ::machine::Machine;
use runtime::{Domain, Instance, Role};
use serde_json::Value;

/// Registers and coils, and whether it answers.
#[derive(Default)]
struct Memory {
    words: BTreeMap<u16, u16>,
    coils: BTreeMap<u16, bool>,
    is_silent: bool,
}

/// A device on Modbus TCP, written from the specification and not with the crate that asks it.
#[derive(Clone)]
struct Device {
    memory: Arc<Mutex<Memory>>,
    address: SocketAddr,
}

impl Device {
    /// A chiller at 21.5 °C.
    fn chiller() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let words = BTreeMap::from([(10, 215)]);
        let memory = Arc::new(Mutex::new(Memory { words, ..Memory::default() }));
        let device = Self { memory, address: listener.local_addr().unwrap() };
        let own = device.clone();
        // It ends with the process.
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let own = own.clone();
                std::thread::spawn(move || own.talk(stream));
            }
        });
        device
    }

    /// Answers until the other end leaves: MBAP header of transaction, protocol 0, length and unit, then the PDU.
    fn talk(&self, mut stream: TcpStream) {
        let mut header = [0; 7];
        while stream.read_exact(&mut header).is_ok() {
            let length = usize::from(u16::from_be_bytes([header[4], header[5]])) - 1;
            let mut request = vec![0; length];
            if stream.read_exact(&mut request).is_err() {
                return;
            }
            let Some(answer) = self.answer(&request) else { continue };
            let length = u16::try_from(answer.len() + 1).unwrap().to_be_bytes();
            header[4..6].copy_from_slice(&length);
            if stream.write_all(&[&header[..], &answer].concat()).is_err() {
                return;
            }
        }
    }

    /// The answer to a request of function 3, 5 or 6; an exception to any other.
    fn answer(&self, request: &[u8]) -> Option<Vec<u8>> {
        let mut memory = self.memory.lock().unwrap();
        if memory.is_silent {
            return None;
        }
        let number = |at: usize| u16::from_be_bytes([request[at], request[at + 1]]);
        let (place, value) = (number(1), number(3));
        Some(match request[0] {
            3 => [&[3, 2][..], &memory.words[&place].to_be_bytes()].concat(),
            5 => {
                memory.coils.insert(place, value == 0xFF00);
                request.to_vec()
            }
            6 => {
                memory.words.insert(place, value);
                request.to_vec()
            }
            function => vec![function | 0x80, 1],
        })
    }

    fn set(&self, change: impl FnOnce(&mut Memory)) {
        change(&mut self.memory.lock().unwrap());
    }

    fn warm_to(&self, tenths: u16) {
        self.set(|memory| {
            memory.words.insert(10, tenths);
        });
    }

    /// Waits until the air's coil and the fan's register are these.
    fn await_told(&self, air: bool, fan: u16) {
        let started = std::time::Instant::now();
        loop {
            let memory = self.memory.lock().unwrap();
            let (coil, word) = (memory.coils.get(&3).copied(), memory.words.get(&20).copied());
            drop(memory);
            if (coil, word) == (Some(air), Some(fan)) {
                return;
            }
            let patience = super::support::PATIENCE;
            assert!(started.elapsed() < patience, "air {coil:?}, fan {word:?}");
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
    }

    /// The machine file's part for it.
    fn table(&self) -> String {
        format!(
            r#"
[outputs.air]
function = "air"
[outputs.fan]
function = "extraction"
after = "0 s"
[modbus.cooler]
address = "{}"
period = "20 ms"
timeout = "2 s"
[modbus.cooler.inputs.temperature]
holding = 10
scale = 0.1
unit = "°C"
max = 30
function = "interlock"
[modbus.cooler.outputs.air]
coil = 3
[modbus.cooler.outputs.fan]
register = 20
on = 700
safe = "on"
"#,
            self.address
        )
    }
}

/// The Modbus service of a cell, on a thread of this process, which has the place in the domain.
struct Service {
    shall_end: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Service {
    fn start(cell: &Cell, file: &str) -> Self {
        let shall_end = Arc::new(AtomicBool::new(false));
        let (ends, instance) = (shall_end.clone(), cell.place.instance().clone());
        let machine = Machine::parse("cell.toml", file, &[]).unwrap();
        let thread = std::thread::spawn(move || serve(&instance, &machine, &ends));
        Self { shall_end, thread }
    }

    fn end(self) {
        self.shall_end.store(true, Ordering::Relaxed);
        self.thread.join().unwrap();
    }
}

fn serve(instance: &Instance, machine: &Machine, ends: &AtomicBool) {
    let domain = Domain::join(instance, Role::Modbus).unwrap();
    ::modbus::service::run(&domain, machine, || ends.load(Ordering::Relaxed)).unwrap();
}

/// What keeps the light off.
fn interlocks(status: &Value) -> String {
    let interlocks = status["interlocks"].as_array().unwrap();
    interlocks.iter().map(|words| words.as_str().unwrap()).collect::<Vec<_>>().join("; ")
}

#[test]
fn a_chiller_holds_a_job_in_the_dark_and_is_named() {
    let chiller = Device::chiller();
    let file = machine(&chiller.table());
    let mut cell = Cell::of(&file);
    cell.ask(&["enable"]).accepted();
    cell.ask(&["home"]).accepted();
    let unasked = format!("`cooler` ({}, unit 1) has not been asked yet", chiller.address);
    refused(
        &cell.ask(&["test-pulse", "5 %", "10 ms"]),
        &format!("an interlock is missing: {unasked}"),
    );
    let service = Service::start(&cell, &file);
    let status = cell.until("a chiller that is well", |status| interlocks(status).is_empty());
    assert_eq!(status["inputs"]["cooler.temperature"], false);
    assert!(status["services"]["modbus"].is_number(), "{status:#}");
    says(&cell.ask(&["output", "air", "on"]), 0, "air is on");
    chiller.await_told(true, 0);
    let job = cell.place.file("job.ngc", &lines(8));

    // Too warm, and then silent: each holds the job with the light off, and says why.
    let named = format!(
        "`cooler.temperature`: holding register 10 of {} reads 34.2 °C, limit 30.0 °C",
        chiller.address
    );
    let silent = format!(
        "`cooler` ({}, unit 1) did not answer the reading of holding register 10 (`cooler.temperature`) \
         within 2 s",
        chiller.address
    );
    for (is_silent, words) in [(false, named), (true, silent)] {
        let out = cell.place.path(if is_silent { "silent" } else { "warm" });
        let submit = ["submit", job.to_str().unwrap(), "--json", "--out", out.to_str().unwrap()];
        let submitted = cell.start(&submit);
        cell.until("light", |status| status["stroke"].as_u64() > Some(0));
        chiller.await_told(false, 700);
        chiller.set(|memory| memory.is_silent = is_silent);
        chiller.warm_to(if is_silent { 215 } else { 342 });
        let status = cell.until("a hold in the dark", |status| {
            status["state"] == "holding" && status["lit"] == false && status["speed"] == 0.0
        });
        assert_eq!(status["cause"], format!("an interlock is missing: {words}"));
        assert_eq!(interlocks(&status), words);
        let fault = status["faults"].as_array().unwrap().last().unwrap();
        assert_eq!((&fault["code"], &fault["detail"]), (&"interlock".into(), &status["cause"]));
        refused(&cell.ask(&["resume"]), &words);
        says(&cell.ask(&["faults"]), 0, &words);
        chiller.set(|memory| memory.is_silent = false);
        chiller.warm_to(215);
        let status = cell.until("a chiller that is well", |status| interlocks(status).is_empty());
        assert_eq!((&status["state"], &status["lit"]), (&"holding".into(), &false.into()));
        assert_eq!(status["cause"], "an interlock was missing");
        cell.ask(&["resume"]).accepted();
        let summary = submitted.wait().json(0);
        assert_eq!(summary["outcome"], "completed");
        for end in ["missing", "double"] {
            let length = summary["marks"][end].as_f64().unwrap();
            assert!(length < 1e-4, "{length} m {end}");
        }
        let told = summary["realtime"]["warnings"].as_array().into_iter().flatten();
        let told = told.chain(summary["warnings"].as_array().into_iter().flatten());
        let told: Vec<&str> = told.filter_map(Value::as_str).collect();
        assert!(told.contains(&format!("the job was held: {words}").as_str()), "{told:#?}");
    }
    chiller.await_told(false, 0);

    // Without the service the outputs are safe, and there is no light.
    service.end();
    chiller.await_told(false, 700);
    cell.until("silence", |status| interlocks(status).contains("was not heard of"));
    refused(&cell.ask(&["test-pulse", "5 %", "10 ms"]), "`graver modbus` does not run");
    cell.end();
}
