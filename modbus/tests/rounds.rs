//! Rounds with devices that answer, do not answer, refuse, and answer something else.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::future::{Ready, ready};
use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use machine::modbus::{Device, device_words, input_words};
use machine::{Machine, Operating};
use messages::{DeviceState, Nanoseconds, SlowInputs};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio_modbus::server::Service;
use tokio_modbus::server::tcp::{Server, accept_tcp_connection};
use tokio_modbus::{ExceptionCode, Request, Response};

use modbus::conversation::{Conversation, Outputs};
use modbus::heard::{Failed, Heard};
use modbus::tasks::{Orders, attend};

/// What a device holds, and how it behaves.
#[derive(Debug, Default)]
struct Memory {
    bits: BTreeMap<u16, bool>,
    words: BTreeMap<u16, u16>,
    /// Whether it answers nothing.
    is_silent: bool,
    /// Writes that it took, coils and registers, in their order.
    written: Vec<(u16, u16)>,
}

/// A device on the other end of a socket. An address that it does not hold is refused.
#[derive(Debug, Clone, Default)]
struct Chiller(Arc<Mutex<Memory>>);

impl Chiller {
    fn set(&self, change: impl FnOnce(&mut Memory)) {
        change(&mut self.0.lock().unwrap());
    }

    fn written(&self) -> Vec<(u16, u16)> {
        std::mem::take(&mut self.0.lock().unwrap().written)
    }

    /// Listens at `address` until the task is aborted; the address where it does.
    async fn listen(&self, address: SocketAddr) -> (SocketAddr, JoinHandle<()>) {
        let listener = TcpListener::bind(address).await.unwrap();
        let address = listener.local_addr().unwrap();
        let own = self.clone();
        let task = tokio::spawn(async move {
            let accept = |stream, place| {
                let own = own.clone();
                async move { accept_tcp_connection(stream, place, move |_| Ok(Some(own.clone()))) }
            };
            let _ = Server::new(listener).serve(&accept, |_| {}).await;
        });
        (address, task)
    }
}

impl Service for Chiller {
    type Request = Request<'static>;
    type Response = Option<Response>;
    type Exception = ExceptionCode;
    type Future = Ready<Result<Option<Response>, ExceptionCode>>;

    fn call(&self, request: Self::Request) -> Self::Future {
        let mut memory = self.0.lock().unwrap();
        if memory.is_silent {
            return ready(Ok(None));
        }
        let bit = |at: u16| memory.bits.get(&at).copied().ok_or(ExceptionCode::IllegalDataAddress);
        let word =
            |at: u16| memory.words.get(&at).copied().ok_or(ExceptionCode::IllegalDataAddress);
        let response = match request {
            Request::ReadCoils(at, 1) => bit(at).map(|bit| Response::ReadCoils(vec![bit])),
            Request::ReadDiscreteInputs(at, 1) => {
                bit(at).map(|bit| Response::ReadDiscreteInputs(vec![bit]))
            }
            Request::ReadInputRegisters(at, 1) => {
                word(at).map(|word| Response::ReadInputRegisters(vec![word]))
            }
            Request::ReadHoldingRegisters(at, 1) => {
                word(at).map(|word| Response::ReadHoldingRegisters(vec![word]))
            }
            Request::WriteSingleCoil(at, level) => {
                memory.written.push((at, u16::from(level)));
                Ok(Response::WriteSingleCoil(at, level))
            }
            Request::WriteSingleRegister(at, word) => {
                memory.written.push((at, word));
                Ok(Response::WriteSingleRegister(at, word))
            }
            _ => Err(ExceptionCode::IllegalFunction),
        };
        ready(response.map(Some))
    }
}

const ANYWHERE: &str = "127.0.0.1:0";

/// A machine with one device at `address`, with this `timeout`.
fn operating(address: SocketAddr, timeout: &str) -> Operating {
    let text = format!(
        r#"{builtin}
[outputs.fan]
function = "extraction"
[outputs.air]
function = "air"
active = "low"
[outputs.pump]
function = "signal"
states = ["running"]
[inputs.door]
function = "door"
[modbus.chiller]
address = "{address}"
timeout = "{timeout}"
[modbus.chiller.inputs.alarm]
discrete = 4
function = "interlock"
[modbus.chiller.inputs.flow]
coil = 5
function = "interlock"
active = "low"
[modbus.chiller.inputs.temperature]
input = 10
scale = 0.1
signed = true
unit = "°C"
min = 5
max = 30
function = "interlock"
[modbus.chiller.inputs.filter]
holding = 11
bit = 3
function = "warning"
[modbus.chiller.outputs.fan]
register = 20
on = 3000
safe = "on"
[modbus.chiller.outputs.air]
coil = 21
"#,
        builtin = machine::machine::BUILTIN
    );
    Machine::parse("chiller.toml", &text, &[]).unwrap().operating
}

/// The bits of the machine above.
const ALARM: u64 = 1 << 2;
const FLOW: u64 = 1 << 3;
const TEMPERATURE: u64 = 1 << 4;
const FILTER: u64 = 1 << 5;
const FAN: u64 = 1;
const AIR: u64 = 2;

/// Longer than anything here takes.
const LONG: &str = "20 s";

/// A chiller that is well: 21.5 °C, water flows, no alarm.
fn well() -> Chiller {
    let chiller = Chiller::default();
    chiller.set(|memory| {
        memory.bits.extend([(4, false), (5, true)]);
        memory.words.extend([(10, 215), (11, 0)]);
    });
    chiller
}

fn device(operating: &Operating) -> Device {
    operating.devices[0].clone()
}

/// What was heard after a round that ended with `outcome`.
fn noted(heard: &Heard, outcome: Result<(), Failed>) -> SlowInputs {
    heard.note(0, outcome, Nanoseconds(7));
    heard.all()
}

#[tokio::test]
async fn a_round_reads_every_input_and_writes_every_output() {
    let chiller = well();
    let (address, _task) = chiller.listen(ANYWHERE.parse().unwrap()).await;
    let operating = operating(address, LONG);
    let (mut conversation, heard) = (Conversation::new(device(&operating)), Heard::default());
    let outcome = conversation.round(Outputs::Follow(FAN | AIR), &heard).await;
    let slow = noted(&heard, outcome);
    assert_eq!((outcome, slow.active), (Ok(()), 0));
    assert_eq!(slow.devices[0].state, DeviceState::Answering as u32);
    assert_eq!(slow.devices[0].answered, Nanoseconds(7));
    assert!((slow.values[4] - 21.5).abs() < 1e-9);
    // Air is on at the low level.
    assert_eq!(chiller.written(), [(20, 3000), (21, 0)]);

    chiller.set(|memory| {
        memory.bits.extend([(4, true), (5, false)]);
        memory.words.extend([(10, 342), (11, 0b1000)]);
    });
    let outcome = conversation.round(Outputs::Safe, &heard).await;
    let slow = noted(&heard, outcome);
    assert_eq!(slow.active, ALARM | FLOW | TEMPERATURE | FILTER);
    assert_eq!(chiller.written(), [(20, 3000), (21, 1)]);
    assert_eq!(
        input_words(&operating, 4, &slow),
        format!(
            "`chiller.temperature`: input register 10 of {address} reads 34.2 °C, limit 30.0 °C"
        )
    );
    assert_eq!(
        input_words(&operating, 2, &slow),
        format!("`chiller.alarm`: discrete input 4 of {address} is 1")
    );
    assert_eq!(
        input_words(&operating, 5, &slow),
        format!("`chiller.filter`: bit 3 of holding register 11 of {address} is 1")
    );
    assert_eq!(input_words(&operating, 0, &slow), "`door`");

    chiller.set(|memory| {
        memory.words.insert(10, (-12_i16).cast_unsigned());
    });
    let outcome = conversation.round(Outputs::Follow(0), &heard).await;
    let words = input_words(&operating, 4, &noted(&heard, outcome));
    assert!(words.ends_with("reads -1.2 °C, at least 5.0 °C is due"), "{words}");
    assert_eq!(chiller.written(), [(20, 0), (21, 1)]);
}

#[tokio::test]
async fn a_device_that_falls_silent_is_told_with_the_request_and_is_heard_again() {
    let chiller = well();
    let (address, _task) = chiller.listen(ANYWHERE.parse().unwrap()).await;
    let operating = operating(address, "2 s");
    let (mut conversation, heard) = (Conversation::new(device(&operating)), Heard::default());
    chiller.set(|memory| memory.is_silent = true);
    let outcome = conversation.round(Outputs::Safe, &heard).await;
    let silent = Failed { state: DeviceState::Silent, exception: 0, request: 1 };
    assert_eq!(outcome, Err(silent));
    let slow = noted(&heard, outcome);
    assert_eq!(
        device_words(&operating, 0, &slow).unwrap(),
        format!(
            "`chiller` ({address}, unit 1) did not answer the reading of discrete input 4 (`chiller.alarm`) \
             within 2 s"
        )
    );
    chiller.set(|memory| memory.is_silent = false);
    let mut patient = device(&operating);
    patient.timeout = Nanoseconds(20_000_000_000);
    let mut conversation = Conversation::new(patient);
    let outcome = conversation.round(Outputs::Safe, &heard).await;
    assert_eq!(noted(&heard, outcome).devices[0].state, DeviceState::Answering as u32);
}

#[tokio::test]
async fn a_refused_request_ends_no_other() {
    let chiller = well();
    chiller.set(|memory| {
        memory.bits.remove(&5);
        memory.words.insert(10, 999);
    });
    let (address, _task) = chiller.listen(ANYWHERE.parse().unwrap()).await;
    let operating = operating(address, LONG);
    let (mut conversation, heard) = (Conversation::new(device(&operating)), Heard::default());
    let outcome = conversation.round(Outputs::Follow(FAN), &heard).await;
    assert_eq!(outcome, Err(Failed { state: DeviceState::Refusing, exception: 2, request: 2 }));
    let slow = noted(&heard, outcome);
    assert_eq!((slow.active, slow.devices[0].answered), (TEMPERATURE, Nanoseconds(0)));
    assert_eq!(chiller.written(), [(20, 3000), (21, 1)]);
    assert_eq!(
        device_words(&operating, 0, &slow).unwrap(),
        format!(
            "`chiller` ({address}, unit 1) refused the reading of coil 5 (`chiller.flow`): exception 2, illegal \
             data address"
        )
    );
}

#[tokio::test]
async fn a_device_that_goes_away_is_connected_to_again() {
    let chiller = well();
    let (address, task) = chiller.listen(ANYWHERE.parse().unwrap()).await;
    let operating = operating(address, LONG);
    let (mut conversation, heard) = (Conversation::new(device(&operating)), Heard::default());
    assert_eq!(conversation.round(Outputs::Safe, &heard).await, Ok(()));
    task.abort();
    let _ = task.await;
    let outcome = conversation.round(Outputs::Safe, &heard).await;
    assert_eq!(outcome, Err(Failed { state: DeviceState::Unreachable, exception: 0, request: 0 }));
    let words = device_words(&operating, 0, &noted(&heard, outcome)).unwrap();
    assert_eq!(words, format!("`chiller` ({address}, unit 1) cannot be connected to"));
    let (_, task) = chiller.listen(address).await;
    assert_eq!(conversation.round(Outputs::Safe, &heard).await, Ok(()));
    // It restarts between two rounds: the second connection of the same round has the answers.
    task.abort();
    let _ = task.await;
    let (_, _task) = chiller.listen(address).await;
    assert_eq!(conversation.round(Outputs::Safe, &heard).await, Ok(()));
}

/// Answers each request at `listener` with these bytes after the transaction's number.
async fn answer_with(listener: TcpListener, bytes: &'static [u8]) {
    loop {
        let (mut stream, _) = listener.accept().await.unwrap();
        let mut request = [0; 12];
        while stream.read_exact(&mut request).await.is_ok() {
            let answer = [&request[..2], bytes].concat();
            if stream.write_all(&answer).await.is_err() {
                break;
            }
        }
    }
}

#[tokio::test]
async fn an_answer_to_something_else_is_taken_for_no_value() {
    // A register of two words, none, another function, another unit.
    let answers: [&[u8]; 4] = [
        &[0, 0, 0, 7, 1, 4, 4, 0, 1, 0, 2],
        &[0, 0, 0, 3, 1, 2, 0],
        &[0, 0, 0, 5, 1, 3, 2, 0, 1],
        &[0, 0, 0, 4, 9, 2, 1, 0],
    ];
    for (place, bytes) in ["input", "discrete", "input", "discrete"].iter().zip(answers) {
        let listener = TcpListener::bind(ANYWHERE).await.unwrap();
        let address = listener.local_addr().unwrap();
        let task = tokio::spawn(answer_with(listener, bytes));
        let text = format!(
            "{}[modbus.source]\naddress = \"{address}\"\ntimeout = \"{LONG}\"\n\
             inputs.word = {{ {place} = 0, function = \"general\" }}\n",
            machine::machine::BUILTIN
        );
        let operating = Machine::parse("source.toml", &text, &[]).unwrap().operating;
        let (mut conversation, heard) = (Conversation::new(device(&operating)), Heard::default());
        let outcome = conversation.round(Outputs::Safe, &heard).await;
        let garbled = Failed { state: DeviceState::Garbled, exception: 0, request: 1 };
        assert_eq!(outcome, Err(garbled), "{bytes:?}");
        let words = device_words(&operating, 0, &noted(&heard, outcome)).unwrap();
        assert!(
            words.contains("broke off, or answered something else than the reading"),
            "{words}"
        );
        task.abort();
    }
}

#[tokio::test]
async fn outputs_are_written_as_they_change_and_go_to_their_safe_states_at_the_end() {
    let chiller = well();
    let (address, _task) = chiller.listen(ANYWHERE.parse().unwrap()).await;
    let operating = operating(address, LONG);
    let mut device = device(&operating);
    // Beyond the end of this test: what is written is written for a change.
    device.period = Nanoseconds(3_600_000_000_000);
    let follow = |bits| Orders { outputs: Outputs::Follow(bits), is_last: false };
    let (orders, listening) = watch::channel(follow(0));
    let heard = Heard::default();
    let task = tokio::spawn(attend(0, device, listening, heard.clone(), || Nanoseconds(1)));
    // All that a round writes.
    let written = async || {
        while chiller.0.lock().unwrap().written.len() < 2 {
            tokio::time::sleep(tokio::time::Duration::from_millis(1)).await;
        }
        chiller.written()
    };
    let rounds = [(0, [(20, 0), (21, 1)]), (AIR, [(20, 0), (21, 0)]), (FAN, [(20, 3000), (21, 1)])];
    for (bits, expected) in rounds {
        if bits != 0 {
            orders.send_replace(follow(bits));
        }
        assert_eq!(written().await, expected);
    }
    orders.send_replace(Orders { outputs: Outputs::Safe, is_last: true });
    task.await.unwrap();
    assert_eq!(chiller.written(), [(20, 3000), (21, 1)]);
    assert_eq!(heard.all().devices[0].state, DeviceState::Answering as u32);
}
