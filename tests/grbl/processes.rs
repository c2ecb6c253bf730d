//! A real pipeline: what is marked over grbl is what is marked from the same file.

use std::io::BufReader;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::sockets::Talk;
use crate::support::{KILL, PATIENCE, Place, Running, TERMINATE};

const JOB: &str =
    "G21 G90 G54\nM4 S600 F3000\nG0 X-10 Y-10\nG1 X10\nG1 Y10\nG2 X0 Y20 I-10 J0\nM5\nM2\n";

/// The port that `graver serve` tells.
fn port(running: &mut Running) -> u16 {
    let started = Instant::now();
    loop {
        let said = running.said();
        let told = said.lines().find_map(|line| line.split_once("grbl at 127.0.0.1:"));
        if let Some((_, port)) = told {
            return port.trim().parse().unwrap();
        }
        assert!(running.try_code().is_none(), "{said}");
        assert!(started.elapsed() < PATIENCE, "{said}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn connect(port: u16) -> Talk<TcpStream> {
    let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut talk = Talk { reader: BufReader::new(stream.try_clone().unwrap()), writer: stream };
    talk.until("Grbl 1.1h");
    talk
}

/// A pipeline with its services, and grbl.
fn domain(place: &Place) -> Running {
    let name = place.instance().name();
    let mut domain = place.start(&[
        "domain",
        "--services",
        "--no-realtime",
        "--grbl",
        "127.0.0.1:0",
        "--instance",
        name,
    ]);
    place.await_status(&mut domain, "services", |status| {
        let services = status["services"].as_object();
        services.is_some_and(|services| services.values().all(Value::is_number))
            && status["cycles"].as_u64() > Some(0)
    });
    domain
}

#[test]
fn a_job_over_grbl_marks_what_the_same_file_marks() {
    let place = Place::new();
    let file = place.file("job.nc", JOB);
    let expected = place.run(&file, "file", &[]).wait().json(0);

    let mut domain = domain(&place);
    let mut client = connect(port(&mut domain));
    client.until_state("Idle");
    for line in JOB.lines() {
        client.send(format!("{line}\n"));
        let lines = client.until("");
        assert_eq!(lines, ["ok"], "{line}");
    }
    client.until_state("Idle");
    let summary = summary(&place);
    assert_eq!(summary["outcome"], "completed");
    assert_eq!(summary["digest"], expected["digest"], "the same commands, bit for bit");
    for part in ["length", "missing", "double"] {
        let [one, other] = [&expected, &summary].map(|it| it["marks"][part].as_f64().unwrap());
        // What the plant marks with them differs where the computer is busy.
        assert!((one - other).abs() < 1e-4, "{part}: {one} and {other}");
    }

    // Over a jog, a hold and a reset it stays an orderly machine.
    client.send("$J=G91 X5 F6000\n");
    client.until("ok");
    client.until_state("Idle");
    client.send("G90 M3 S500 F600\nG1 X40\nG1 X-40\n");
    (0..3).for_each(|_| drop(client.until("ok")));
    client.until_state("Run");
    place.await_played(&mut domain, 100);
    client.send("!");
    client.until_state("Hold:0");
    client.send("~");
    client.until_state("Run");
    client.send("\x18");
    client.until("Grbl 1.1h");
    client.until_state("Idle");
    domain.signal(TERMINATE);
    assert_eq!(domain.wait().code, Some(0));
    place.assert_nothing_left(&[]);
}

/// The summary of the newest job below the folder of the place.
fn summary(place: &Place) -> Value {
    let started = Instant::now();
    loop {
        let runs = std::fs::read_dir(place.path("runs")).into_iter().flatten().flatten();
        let summaries =
            runs.map(|run| run.path().join("summary.json")).filter(|path| path.exists());
        if let Some(path) = summaries.max()
            && let Ok(summary) = serde_json::from_slice(&std::fs::read(path).unwrap())
        {
            return summary;
        }
        assert!(started.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn the_death_of_serve_is_told_and_ends_nothing() {
    let place = Place::new();
    let mut domain = domain(&place);
    let client = connect(port(&mut domain));
    let serve = child_called(&domain, "serve");
    serve.signal(KILL).unwrap();
    let started = Instant::now();
    while !domain.said().contains("graver serve (pid") {
        assert!(started.elapsed() < PATIENCE, "{}", domain.said());
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(place.status().is_some());
    drop(client);
    domain.signal(TERMINATE);
    assert_eq!(domain.wait().code, Some(0));
    place.assert_nothing_left(&[]);
}

/// The child of a process whose second word is this.
fn child_called(parent: &Running, word: &str) -> runtime::peer::Peer {
    let parent = parent.peer().pid();
    let children =
        std::fs::read_to_string(format!("/proc/{parent}/task/{parent}/children")).unwrap();
    let found = children.split_whitespace().find(|pid| {
        let words = std::fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        words.split(|byte| *byte == 0).nth(1) == Some(word.as_bytes())
    });
    runtime::peer::Peer::open(found.unwrap().parse().unwrap()).unwrap()
}

#[test]
fn serve_says_what_it_cannot_do() {
    let place = Place::new();
    let name = place.instance().name();
    let refused = |arguments: &[&str], code: i32, words: &str| {
        let ended = place.graver(&[&["serve", "--instance", name], arguments].concat());
        assert_eq!(ended.code, Some(code), "{}", ended.error);
        assert!(ended.error.contains(words), "{}", ended.error);
    };
    refused(&["--grbl", "7x"], 2, "such as 127.0.0.1:7123");
    refused(&["--grbl", "0"], 4, "no pipeline is running");
    let mut domain = domain(&place);
    let port = port(&mut domain);
    refused(&["--grbl", "0.0.0.0:0"], 2, "--grbl-from");
    refused(&["--grbl", &port.to_string()], 4, "in use");
}
