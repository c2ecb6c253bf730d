//! `graver serve` beside a pipeline: it sees what is marked, hands requests on, outlives the pipeline, and leaves
//! nothing.

#![cfg(feature = "serve")]
#![allow(clippy::unwrap_used)]

mod support;

use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};
use support::{CONTINUE, PATIENCE, Place, Running, STOP, assert_valid, lines};

/// Starts a server of the place's instance, and gives its address.
fn serve(place: &Place, more: &[&str]) -> (Running, String) {
    let mut arguments =
        vec!["serve", "--listen", "127.0.0.1:0", "--instance", place.instance().name()];
    arguments.extend(more);
    let mut server = place.start(&arguments);
    let address = address(&mut server);
    (server, address)
}

/// The address that a process says it serves the page at.
fn address(server: &mut Running) -> String {
    let started = Instant::now();
    loop {
        let said = server.said();
        let mut lines = said.lines().filter_map(|line| line.split_once("http://"));
        if let Some((_, address)) = lines.next()
            && said.ends_with('\n')
        {
            return address.to_owned();
        }
        assert_eq!(server.try_code(), None, "{said}");
        assert!(started.elapsed() < PATIENCE, "{said}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn send(address: &str, method: &str, path: &str, body: &[u8]) -> (u16, Vec<u8>) {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let head = format!(
        "{method} {path} HTTP/1.1\r\nHost: {address}\r\nX-Graver: 1\r\nConnection: close\r\nContent-Length: {}\r\n\r\n",
        body.len()
    );
    stream.write_all(&[head.as_bytes(), body].concat()).unwrap();
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).unwrap();
    let end = bytes.windows(4).position(|it| it == b"\r\n\r\n").unwrap();
    let status = std::str::from_utf8(&bytes[9..12]).unwrap().parse().unwrap();
    (status, bytes.split_off(end + 4))
}

fn done(address: &str, method: &str, path: &str, body: &[u8]) -> Value {
    let (status, body) = send(address, method, path, body);
    assert_eq!(status, 200, "{path}: {}", String::from_utf8_lossy(&body));
    serde_json::from_slice(&body).unwrap()
}

/// Asks again and again until what is answered holds.
fn await_answer(address: &str, path: &str, holds: impl Fn(&Value) -> bool) -> Value {
    let started = Instant::now();
    loop {
        let (status, body) = send(address, "GET", path, b"");
        let answer = serde_json::from_slice(&body).unwrap_or_default();
        if status == 200 && holds(&answer) {
            return answer;
        }
        assert!(started.elapsed() < PATIENCE, "{path}: {status} {answer:#}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_server_sees_a_run_hands_requests_on_and_outlives_it() {
    let place = Place::new();
    let (server, address) = serve(&place, &[]);
    let (status, body) = send(&address, "GET", "/api/v1/status", b"");
    let text = String::from_utf8(body).unwrap();
    assert!(status == 503 && text.contains("no pipeline is running"), "{status} {text}");

    let job = place.file("lines.ngc", &lines(4));
    let mut running = place.run(&job, "run", &[]);
    place.await_played(&mut running, 50);
    assert_valid("status", &done(&address, "GET", "/api/v1/status", b""));
    let machine = await_answer(&address, "/api/v1/machine", |_| true);
    assert_eq!(machine["simulated"], true);
    let held = done(&address, "POST", "/api/v1/requests/hold", b"");
    assert_valid("reply", &held);
    assert_eq!(held["accepted"], true);
    await_answer(&address, "/api/v1/status", |status| status["state"] == "holding");
    let latency =
        await_answer(&address, "/api/v1/latency", |it| it["hops"]["loop"]["count"].is_u64());
    assert!(latency["hops"]["wake"]["histogram"][0][1].as_u64() > Some(0), "{latency:#}");
    let artwork = done(&address, "GET", "/api/v1/artwork", b"");
    assert_eq!(artwork["strokes"].as_array().unwrap().len(), 4);
    assert_eq!(done(&address, "POST", "/api/v1/requests/stop", b"")["accepted"], true);
    assert_eq!(running.wait().json(1)["outcome"], "stopped");

    let metrics = String::from_utf8(send(&address, "GET", "/metrics", b"").1).unwrap();
    let cycles = metrics.lines().find(|line| line.starts_with("graver_cycle_time_seconds_count"));
    let cycles: f64 = cycles.unwrap().rsplit(' ').next().unwrap().parse().unwrap();
    assert!(cycles > 50.0, "{metrics}");
    // The next pipeline of this instance is found too, and a server that is killed harms none.
    let mut running = place.run(&job, "again", &[]);
    place.await_played(&mut running, 50);
    await_answer(&address, "/api/v1/status", |status| status["state"] == "running");
    server.signal(support::KILL);
    drop(server);
    assert_eq!(running.wait().json(0)["outcome"], "completed");
    place.assert_nothing_left(&[]);
}

/// A stop goes past a process that hangs to the one that moves the machine.
#[test]
fn a_stop_over_http_reaches_the_controller_past_a_holder_that_hangs() {
    let place = Place::new();
    let (server, address) = serve(&place, &[]);
    let job = place.file("lines.ngc", &lines(8));
    let mut running = place.run(&job, "run", &[]);
    place.await_played(&mut running, 50);
    await_answer(&address, "/api/v1/status", |status| status["state"] == "running");
    running.signal(STOP);
    let reply = done(&address, "POST", "/api/v1/requests/stop", b"");
    assert_valid("reply", &reply);
    assert_eq!(reply["accepted"], true, "{reply:#}");
    assert!(reply["direct"].as_str().unwrap().contains("did not answer"), "{reply:#}");
    // Nothing else goes past it.
    running.signal(CONTINUE);
    assert_eq!(running.wait().json(1)["outcome"], "stopped");
    support::assert_ends_dark_and_at_rest(&place.recording("run"), 2);
    // It reads the samples for as long as there are any.
    server.signal(support::TERMINATE);
    server.wait();
    place.assert_nothing_left(&[]);
}

#[test]
fn what_cannot_be_served_is_refused_with_what_would_be_right() {
    let place = Place::new();
    let tokens = place.file("tokens", "operate 0123456789abcdef\n");
    let arguments = ["serve", "--listen", "0", "--token-file", tokens.to_str().unwrap()];
    let mode = |mode| {
        std::fs::set_permissions(&tokens, std::os::unix::fs::PermissionsExt::from_mode(mode))
    };
    mode(0o644).unwrap();
    let ended = place.graver(&arguments);
    assert!(ended.code == Some(2) && ended.error.contains("chmod 600"), "{ended:?}");
    mode(0o600).unwrap();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let ended = place.graver(&["serve", "--listen", &port]);
    assert!(ended.code == Some(4) && ended.error.contains(&port), "{ended:?}");
}

#[test]
fn a_pipeline_with_a_page_takes_a_job_from_its_upload_to_its_report() {
    let place = Place::new();
    let name = place.instance().name();
    let arguments =
        ["domain", "--services", "--listen", "127.0.0.1:0", "--no-realtime", "--instance", name];
    let mut domain = place.start(&arguments);
    let address = address(&mut domain);
    let program = lines(1);
    let file = done(&address, "POST", "/api/v1/jobs?name=one%20line.ngc", program.as_bytes());
    let of_file = |verb: &str| format!("/api/v1/jobs/{}/{verb}", file["id"].as_str().unwrap());
    await_answer(&address, "/api/v1/status", |status| status["services"]["drives"].is_i64());
    // A file of this user's that an upload has no business with, by a job file and by a change of one.
    let secret = place.file("secret.ngc", &lines(1));
    let names = format!("[gcode]\nfile = \"{}\"\n", secret.display());
    let spy = done(&address, "POST", "/api/v1/jobs?name=spy.toml", names.as_bytes());
    let of_spy = |verb: &str| format!("/api/v1/jobs/{}/{verb}", spy["id"].as_str().unwrap());
    let refused = done(&address, "POST", &of_spy("check"), b"");
    let why = refused["error"]["message"].as_str().unwrap();
    assert!(refused["ok"] == false && why.contains("below its own folder"), "{refused:#}");
    let (status, body) = send(&address, "POST", &of_spy("preview"), b"");
    assert_eq!(status, 422, "{}", String::from_utf8_lossy(&body));
    let number = done(&address, "POST", &of_spy("submit"), b"")["number"].as_u64().unwrap();
    let runs = await_answer(&address, "/api/v1/runs", |runs| {
        runs[0]["n"] == number && runs[0]["outcome"].is_string()
    });
    assert_eq!(runs[0]["outcome"], "refused", "{runs:#}");
    let summary = done(&address, "GET", &format!("/api/v1/runs/{number}/summary.json"), b"");
    let why = summary["error"]["message"].as_str().unwrap();
    assert!(why.contains("below its own folder"), "{summary:#}");
    let check = done(&address, "POST", &of_file("check"), b"");
    assert_eq!((&check["ok"], &check["strokes"]), (&json!(true), &json!(1)), "{check:#}");
    assert!((check["length"].as_f64().unwrap() - 0.03).abs() < 1e-6, "{check:#}");
    let number = done(&address, "POST", &of_file("submit"), b"")["number"].as_u64().unwrap();
    let runs = await_answer(&address, "/api/v1/runs", |runs| {
        runs[0]["n"] == number && runs[0]["outcome"].is_string()
    });
    assert_eq!(
        (&runs[0]["n"], &runs[0]["outcome"]),
        (&json!(number), &json!("completed")),
        "{runs:#}"
    );
    let summary = done(&address, "GET", &format!("/api/v1/runs/{number}/summary.json"), b"");
    assert_valid("summary", &summary);
    assert_eq!(summary["outcome"], "completed");
    // As long as it runs: its own server goes with it.
    domain.signal(support::TERMINATE);
    let ended = domain.wait();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert!(TcpStream::connect(&address).is_err());
    place.assert_nothing_left(&[]);
}
