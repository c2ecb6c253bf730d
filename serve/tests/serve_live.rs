//! The connection of a page, through a real server.

#![allow(clippy::unwrap_used)]

mod support;

use messages::{Command, Cycle, Feedback, Nanoseconds};
use monitor::hub::Batch;
use serde_json::{Value, json};
use std::net::TcpStream;
use std::time::{Duration, Instant};
use support::{OPERATE, PATIENCE, Place, WATCH};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

type Page = WebSocket<TcpStream>;

fn connect(place: &Place, headers: &[(&'static str, &str)]) -> Result<Page, u16> {
    let uri = format!("ws://{}/api/v1/live", place.address);
    let mut request = uri.into_client_request().unwrap();
    for (name, value) in headers {
        request.headers_mut().insert(*name, value.parse().unwrap());
    }
    match tungstenite::client(request, place.connect()) {
        Ok((page, _)) => Ok(page),
        Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
            Err(answer.status().as_u16())
        }
        Err(error) => panic!("{error}"),
    }
}

fn open(place: &Place) -> Page {
    connect(place, &[]).unwrap()
}

/// The next message for which `wanted` gives something.
fn await_message<T>(page: &mut Page, what: &str, wanted: impl Fn(&Message) -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        let message = page.read().unwrap_or_else(|error| panic!("{what}: {error}"));
        if let Some(found) = wanted(&message) {
            return found;
        }
        assert!(started.elapsed() < PATIENCE, "{what}: not within {PATIENCE:?}");
    }
}

fn await_type(page: &mut Page, kind: &str) -> Value {
    await_message(page, kind, |message| {
        let value: Value = serde_json::from_str(message.to_text().ok()?).ok()?;
        (value["type"] == kind).then_some(value)
    })
}

fn say(page: &mut Page, value: &Value) {
    page.send(Message::text(value.to_string())).unwrap();
}

/// Cycles of a stream in which the tool goes along x, lit by half.
fn cycles(stream: u64, numbers: std::ops::Range<u64>) -> Batch {
    let mut batch = Batch::default();
    for number in numbers {
        let mut feedback = Feedback {
            epoch: 1,
            cycle: Cycle(number),
            deadline: Nanoseconds(number as i64 * 1_000_000),
            status: messages::feedback::status::TOOL_KNOWN,
            tool: [number as f64 * 1e-3, 0.0, 0.0],
            ..Feedback::default()
        };
        feedback.laser.gate = 1;
        let _ = feedback.laser.push(messages::GateEdge { offset: 500_000, gate: 0, power: 0.0 });
        let published = feedback.deadline + Nanoseconds(50_000);
        let command = Command {
            epoch: 1,
            cycle: Cycle(number),
            received: feedback.deadline + Nanoseconds(20_000),
            published,
            stream,
            rate: 0.5,
            ..Command::default()
        };
        batch.feedbacks.push(feedback);
        batch.commands.push(command);
    }
    batch
}

#[test]
fn a_page_is_greeted_and_told_of_status_path_and_events() {
    let place = Place::new();
    place.context.hub.take(&cycles(3, 1..51));
    let mut page = open(&place);
    let hello = await_type(&mut page, "hello");
    assert_eq!(hello["role"], "operate");
    assert_eq!(hello["machine"]["axes"].as_array().unwrap().len(), 2);
    assert!(hello["signals"].as_array().unwrap().len() > 50);
    assert_eq!(await_type(&mut page, "status")["status"]["state"], "idle");
    assert_eq!(await_type(&mut page, "queue")["queue"]["waiting"], json!([]));
    let path = await_type(&mut page, "path");
    assert_eq!((&path["reset"], path["points"].as_array().unwrap().len()), (&json!(true), 50));
    assert_eq!(path["points"][9], json!([0.01, 0.0, 0.0, 0.5, 1]));
    let hops = await_type(&mut page, "latency")["hops"].clone();
    assert!(hops["compute"]["p50"].as_u64().unwrap().abs_diff(30_000) <= 30, "{hops}");
    place.context.hub.take(&cycles(4, 51..61));
    let path = await_type(&mut page, "path");
    assert_eq!((&path["reset"], path["points"].as_array().unwrap().len()), (&json!(true), 10));
    place.fake.status.lock().unwrap().state = "running".to_owned();
    let event = await_message(&mut page, "event", |message| {
        let value: Value = serde_json::from_str(message.to_text().ok()?).ok()?;
        (value["text"] == "the machine is running").then_some(value)
    });
    assert_eq!(event["level"], "info");
}

#[test]
fn a_scope_is_shown_as_bytes_and_a_wrong_one_is_refused() {
    let place = Place::new();
    let mut page = open(&place);
    say(&mut page, &json!({ "type": "scope", "signals": ["no"], "seconds": 1.0 }));
    let refusal = await_type(&mut page, "refusal");
    assert_eq!(refusal["of"], "scope");
    assert!(refusal["text"].as_str().unwrap().contains("no signal"));
    let signals = ["feedback.tool.x", "command.rate"];
    say(&mut page, &json!({ "type": "scope", "signals": signals, "seconds": 0.02 }));
    place.context.hub.take(&cycles(1, 1..101));
    let bytes = await_message(&mut page, "picture", |message| match message {
        Message::Binary(bytes) => Some(bytes.to_vec()),
        _ => None,
    });
    let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
    let header: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
    assert_eq!((&header["samples"], &header["period"]), (&json!(20), &json!(0.001)));
    assert_eq!((&header["signals"], &header["triggered"]), (&json!(signals), &json!(false)));
    let number = |index: usize| {
        let at = 4 + length + 4 * index;
        f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
    };
    assert_eq!(bytes.len(), 4 + length + 2 * 20 * 4);
    assert_eq!((number(19), number(20), number(39)), (0.1, 0.5, 0.5));
}

#[test]
fn a_jog_lasts_as_long_as_the_page_asks_and_ends_with_its_connection() {
    let place = Place::new();
    let mut page = open(&place);
    let of = |verb: &str| {
        let asked = place.fake.asked();
        asked.into_iter().filter(|it| it["verb"] == verb).collect::<Vec<_>>()
    };
    let jog = json!({ "type": "jog", "axis": "x", "speed": -0.05, "unit": "m" });
    let press = |page: &mut Page, what: &str, holds: &dyn Fn() -> bool| {
        let started = Instant::now();
        while !holds() {
            say(page, &jog);
            std::thread::sleep(Duration::from_millis(20));
            assert!(started.elapsed() < PATIENCE, "{what}");
        }
    };
    press(&mut page, "it goes on", &|| of("jog_on").len() >= 3);
    let begun = &of("jog")[0];
    assert_eq!(
        (&begun["axes"], &begun["value"], &begun["unit"]),
        (&json!(["x"]), &json!(-0.05), &json!("m"))
    );
    assert_eq!(of("jog_on")[0]["value"], 5.0, "the number of the reply");
    say(&mut page, &json!({ "type": "jog_stop" }));
    place.await_that("it is stopped", || of("jog").last().unwrap()["value"] == 0.0);
    let stops = of("jog").len();
    press(&mut page, "it begins again", &|| of("jog").len() > stops);
    drop(page);
    place.await_that("it is stopped by the closed connection", || {
        let jogs = of("jog");
        jogs.len() > stops + 1 && jogs.last().unwrap()["value"] == 0.0
    });
    // And a page that goes silent with the key pressed, as a computer that sleeps.
    let mut page = open(&place);
    let before = of("jog").len();
    press(&mut page, "it begins", &|| of("jog").len() > before);
    place.await_that("it is stopped by silence", || of("jog").last().unwrap()["value"] == 0.0);
}

#[test]
fn a_jog_that_is_refused_is_told_and_not_begun_again_before_the_key_was_up() {
    let place = Place::new();
    *place.fake.refusal.lock().unwrap() = Some("x is at its soft limit".to_owned());
    let mut page = open(&place);
    let jog = json!({ "type": "jog", "axis": "x", "speed": 0.05, "unit": "m" });
    for _ in 0..10 {
        say(&mut page, &jog);
        std::thread::sleep(Duration::from_millis(10));
    }
    let refusal = await_type(&mut page, "refusal");
    assert_eq!(
        (&refusal["of"], &refusal["text"]),
        (&json!("jog"), &json!("x is at its soft limit"))
    );
    assert_eq!(place.fake.asked().len(), 1);
    say(&mut page, &json!({ "type": "jog_stop" }));
    say(&mut page, &jog);
    place.await_that("the next press is asked for", || place.fake.asked().len() == 2);
}

#[test]
fn who_may_watch_sees_everything_and_moves_nothing() {
    let place = Place::strict();
    assert_eq!(connect(&place, &[]).unwrap_err(), 401);
    let bearer = |token: &str| format!("Bearer {token}");
    let mut page = connect(&place, &[("authorization", &bearer(WATCH))]).unwrap();
    assert_eq!(await_type(&mut page, "hello")["role"], "watch");
    say(&mut page, &json!({ "type": "jog", "axis": "x", "speed": 0.05, "unit": "m" }));
    assert!(await_type(&mut page, "refusal")["text"].as_str().unwrap().contains("watching"));
    assert_eq!(place.fake.asked(), [] as [Value; 0]);
    let foreign =
        [("authorization", bearer(OPERATE)), ("origin", "http://evil.example".to_owned())];
    let foreign = foreign.each_ref().map(|(name, value)| (*name, value.as_str()));
    assert_eq!(connect(&place, &foreign).unwrap_err(), 403);
}

#[test]
fn a_page_that_reads_nothing_misses_what_is_old_and_holds_nobody_up() {
    const LARGE: usize = 1 << 20;
    const TOLD: u64 = 30;
    let place = Place::new();
    let mut stuck = open(&place);
    let mut pages: Vec<Page> = (0..32).map(|_| open(&place)).collect();
    let number = |message: &Message| {
        let value: Value = serde_json::from_str(message.to_text().ok()?).ok()?;
        value["status"]["cycles"].as_u64()
    };
    place.fake.status.lock().unwrap().machine_file = Some("x".repeat(LARGE));
    for mark in 1..=TOLD {
        place.fake.status.lock().unwrap().cycles = mark;
        // One reads everything, so the next is made only when this one has been told.
        await_message(&mut pages[0], "the newest", |it| number(it).filter(|told| *told == mark));
    }
    // The others come later, and are told the newest of what they missed.
    for page in &mut pages[1..] {
        await_message(page, "the newest", |it| number(it).filter(|told| *told == TOLD));
    }
    let mut told = 0;
    loop {
        let message = stuck.read().unwrap();
        told += u64::from(number(&message).is_some());
        if number(&message) == Some(TOLD) {
            break;
        }
    }
    // What two sockets hold, and the message that waited: not what was said meanwhile.
    assert!(told <= TOLD / 2, "{told} of {TOLD} were kept for it");
}
