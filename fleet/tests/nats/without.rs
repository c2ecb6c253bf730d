//! Without a server, or with something that is none: people are told, and nobody waits.

use crate::support::{Cell, Machine, server, until};
use fleet::FleetError;
use monitor::hub::Batch;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

/// Something that answers every connection in its own way.
fn pretend(answer: impl Fn(TcpStream) + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("nats://{}", listener.local_addr().unwrap());
    // It ends with the process.
    std::thread::spawn(move || listener.incoming().flatten().for_each(answer));
    address
}

/// A port at which nobody is.
fn nobody() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    format!("nats://{}", listener.local_addr().unwrap())
}

#[test]
fn without_a_server_the_hub_never_waits_and_what_is_not_sent_is_counted() {
    let spool = tempfile::tempdir().unwrap();
    let cell = Cell::idle();
    let address = nobody();
    let mut machine =
        Machine::new(&server(&address), "one", Some("lasers"), spool.path(), cell.clone());
    until("it is told", || cell.heard("cannot be reached"));
    let told = cell.state().told.len();
    let unsent = machine.publisher.unsent();
    until("counts that are let go", || {
        machine.poll(&Batch::default());
        (machine.publisher.unsent() >= unsent + 3).then_some(())
    });
    assert_eq!(cell.state().told.len(), told, "once, not with every try: {:?}", cell.state().told);
    assert!(cell.heard(&address).is_some());
    drop(machine);
}

#[test]
fn a_server_that_says_nothing_fills_the_queue_and_keeps_nobody() {
    let spool = tempfile::tempdir().unwrap();
    let cell = Cell::idle();
    let address = pretend(|stream| {
        std::mem::forget(stream);
    });
    let mut machine = Machine::new(&server(&address), "one", None, spool.path(), cell);
    // The thread waits for the server's first word; the queue has room for eight, and the rest is let go.
    let started = Instant::now();
    until("a full queue", || {
        machine.poll(&Batch::default());
        (machine.publisher.unsent() > 0).then_some(())
    });
    let ended = Instant::now();
    drop(machine);
    // Nothing to do with speed: a server may keep somebody for 5 s, and kept nobody.
    assert!(
        ended.elapsed() < Duration::from_secs(4),
        "{:?} after {:?}",
        ended.elapsed(),
        started.elapsed()
    );
}

#[test]
fn what_is_no_fit_server_is_told_in_words() {
    let info = |version: &str| {
        format!(
            "INFO {{\"server_id\":\"x\",\"server_name\":\"x\",\"version\":\"{version}\",\"proto\":1,\"host\":\"127.0.0.1\",\
             \"port\":1,\"headers\":true,\"max_payload\":1048576,\"jetstream\":true,\"client_id\":1,\"go\":\"go1\",\
             \"auth_required\":false}}\r\n"
        )
    };
    let old = pretend(move |mut stream| {
        let _ = stream.write_all(info("2.2.6").as_bytes());
        let mut buffer = [0; 4096];
        while let Ok(count) = stream.read(&mut buffer) {
            if count == 0 {
                return;
            }
            if buffer[..count].windows(4).any(|it| it == b"PING") {
                let _ = stream.write_all(b"PONG\r\n");
            }
        }
    });
    let error = fleet::survey::survey(&server(&old)).unwrap_err();
    assert!(matches!(error, FleetError::TooOld { .. }), "{error}");
    assert!(error.to_string().contains("2.2.6, too old: 2.9.0"), "{error}");

    let web = pretend(|mut stream| {
        let _ = stream.write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n");
    });
    for address in [web, nobody()] {
        let error = fleet::survey::survey(&server(&address)).unwrap_err();
        assert!(matches!(error, FleetError::Unreachable { .. }), "{error}");
        assert!(error.to_string().starts_with(&address), "{error}");
    }
}
