//! A whole pipeline in a fleet: its monitor speaks with a real server, which the test starts, and the pipeline does a job that came
//! from there. Where there is no `nats-server`, the tests say so and are not run.

#![cfg(feature = "fleet")]
#![allow(clippy::unwrap_used)]

mod support;

use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use support::{PATIENCE, Place, Running, assert_valid, lines, source};

/// A server with JetStream that ends with the test.
struct Nats {
    child: Child,
    address: String,
}

impl Nats {
    fn start(place: &Place) -> Option<Self> {
        Self::start_with(place, &[])
    }

    /// With these arguments too.
    fn start_with(place: &Place, more: &[&str]) -> Option<Self> {
        let named = std::env::var_os("NATS_SERVER").map(PathBuf::from);
        let path = std::env::var_os("PATH").unwrap_or_default();
        // Debian has it where only root looks.
        let mut folders = std::env::split_paths(&path).chain(["/usr/sbin".into()]);
        let program = named.or_else(|| {
            folders
                .find_map(|folder| Some(folder.join("nats-server")).filter(|file| file.is_file()))
        });
        let Some(program) = program else {
            // Past the test's own capture: nobody shall take it for run.
            let _ = writeln!(
                std::io::stderr(),
                "NOT RUN: a pipeline in a fleet: no nats-server in PATH. `apt-get install nats-server`, or name it in NATS_SERVER"
            );
            return None;
        };
        let folder = place.path("nats");
        std::fs::create_dir(&folder).unwrap();
        let child = Command::new(&program)
            .args(more)
            .args(["-a", "127.0.0.1", "-p", "-1", "-js", "-sd"])
            .arg(folder.join("store"))
            .arg("--ports_file_dir")
            .arg(&folder)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let name =
            format!("{}_{}.ports", program.file_name().unwrap().to_str().unwrap(), child.id());
        let ports = folder.join(name);
        let address = until("the server's port", || {
            let ports: Value = serde_json::from_slice(&std::fs::read(&ports).ok()?).ok()?;
            ports["nats"][0].as_str().map(str::to_owned)
        });
        Some(Self { child, address })
    }
}

impl Drop for Nats {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn until<T>(what: &str, mut holds: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(found) = holds() {
            return found;
        }
        assert!(started.elapsed() < PATIENCE, "{what}: not within {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// A pipeline that takes jobs of the group `lasers`.
fn pipeline(place: &Place, address: &str) -> Running {
    let machine = source("machines/corexy.toml");
    let mut arguments =
        vec!["domain", "--services", "--no-realtime", "--machine", machine.to_str().unwrap()];
    arguments.extend(["--publish", address, "--publish-as", "cell-1", "--jobs-of", "lasers"]);
    arguments.extend(["--instance", place.instance().name()]);
    place.start(&arguments)
}

fn status(place: &Place, address: &str) -> Value {
    let told = place.graver(&["fleet", "status", address, "--json"]).json(0);
    assert_valid("fleet_status", &told);
    told
}

fn submit(place: &Place, address: &str, job: &Path) -> String {
    let arguments =
        ["fleet", "submit", address, job.to_str().unwrap(), "--group", "lasers", "--json"];
    let told = place.graver(&arguments).json(0);
    assert_valid("fleet_submitted", &told);
    told["id"].as_str().unwrap().to_owned()
}

/// The record of a job, when it is in this state.
fn record(place: &Place, address: &str, id: &str, state: &str) -> Value {
    until(&format!("job {id} {state}"), || {
        let fleet = status(place, address);
        let jobs = fleet["jobs"].as_array().unwrap();
        jobs.iter().find(|job| job["id"] == id && job["state"] == state).cloned()
    })
}

#[test]
fn a_job_goes_from_the_fleet_to_a_machine_and_what_cannot_be_done_is_put_aside() {
    let place = Place::new();
    let Some(nats) = Nats::start(&place) else { return };
    let mut domain = pipeline(&place, &nats.address);
    place.await_status(&mut domain, "idle", |status| {
        status["state"] == "disabled" || status["state"] == "idle"
    });
    let fleet = until("the machine is heard", || {
        let fleet = status(&place, &nats.address);
        let metrics = &fleet["machines"]["cell-1"]["metrics"];
        metrics["latency"]["loop"]["count"].as_u64().is_some_and(|count| count > 0).then_some(fleet)
    });
    let machine = &fleet["machines"]["cell-1"];
    assert_eq!(
        (&machine["is_heard"], &machine["state"]["group"]),
        (&true.into(), &"lasers".into())
    );
    for (schema, key) in [
        ("fleet_state", "state"),
        ("fleet_job", "job"),
        ("fleet_metrics", "metrics"),
        ("fleet_faults", "faults"),
    ] {
        assert_valid(schema, &machine[key]);
    }

    let good = submit(&place, &nats.address, &place.file("two lines.ngc", &lines(2)));
    // It is planned before it is taken: a machine that cannot do it does not have it.
    let wide =
        submit(&place, &nats.address, &place.file("wide.ngc", "G21\nM3 S1\nG1 X9000 F600\nM2\n"));
    let done = record(&place, &nats.address, &good, "completed");
    assert_valid("fleet_record", &done);
    assert_eq!((&done["machine"], &done["name"]), (&"cell-1".into(), &"two lines.ngc".into()));
    let refused = record(&place, &nats.address, &wide, "refused");
    let words = refused["message"].as_str().unwrap();
    assert!(words.starts_with("wide.ngc:3:"), "{words}");
    assert_eq!(status(&place, &nats.address)["refused"]["lasers"], 1);
    let queue = place.ask(&["queue", "list", "--json"]).json(0);
    let ended = queue["ended"].as_array().unwrap();
    assert_eq!(
        (ended.len(), &ended[0]["outcome"], &ended[0]["number"]),
        (1, &"completed".into(), &done["number"])
    );

    // The server dies in the middle of a job, which nobody at the machine notices.
    let long = submit(&place, &nats.address, &place.file("long.ngc", &lines(8)));
    place.await_played(&mut domain, 50);
    drop(nats);
    until("the job's end", || {
        let queue = place.ask(&["queue", "list", "--json"]).json(0);
        let ended = queue["ended"].as_array().unwrap().last().unwrap().clone();
        (ended["name"] == "long").then(|| assert_eq!(ended["outcome"], "completed"))
    });
    assert!(domain.said().contains("is away"), "{}", domain.said());
    assert!(domain.said().contains(&long), "{}", domain.said());
    domain.signal(support::TERMINATE);
    domain.wait().accepted();
    place.assert_nothing_left(&[]);
}

#[test]
fn what_is_no_fleet_is_refused_before_anything_starts_and_a_server_that_is_not_there_is_no_reason()
{
    let place = Place::new();
    let name = place.instance().name();
    for (arguments, words) in [
        (&["--publish", "http://hall"][..], "nats://HOST"),
        (&["--publish", "nats://ada:geheim@hall"], "credentials"),
        (&["--publish", "nats://hall", "--publish-as", "a.b"], "--publish-as"),
        (&["--publish", "nats://hall", "--jobs-of", "*"], "--jobs-of"),
        (&["--publish", "nats://hall", "--publish-credentials", "none.creds"], "none.creds"),
        (&["--publish", "tls://hall", "--publish-ca", "none.pem"], "none.pem"),
    ] {
        let ended =
            place.graver(&[&["domain", "--services", "--instance", name], arguments].concat());
        assert!(ended.code == Some(2) && ended.error.contains(words), "{ended:?}");
        assert!(!ended.error.contains("geheim"), "{ended:?}");
    }
    let job = place.file("other.toml", "[gcode]\nfile = \"/etc/passwd\"\n");
    let arguments =
        ["fleet", "submit", "nats://127.0.0.1:1", job.to_str().unwrap(), "--group", "lasers"];
    let ended = place.graver(&arguments);
    assert!(ended.code == Some(2) && ended.error.contains("other.toml:2"), "{ended:?}");
    let ended = place.graver(&["fleet", "status", "nats://127.0.0.1:1"]);
    assert!(ended.code == Some(4) && ended.error.contains("cannot be reached"), "{ended:?}");

    let mut domain = pipeline(&place, "nats://127.0.0.1:1");
    place.await_status(&mut domain, "ready", |status| {
        status["state"] == "disabled" || status["state"] == "idle"
    });
    let job = place.file("lines.ngc", &lines(1));
    let done = place.ask(&["submit", job.to_str().unwrap(), "--json"]).json(0);
    assert_eq!(done["outcome"], "completed");
    assert!(done["marks"].is_object(), "{done:#}");
    until("it is told", || domain.said().contains("cannot be reached").then_some(()));
    domain.signal(support::TERMINATE);
    domain.wait().accepted();
    place.assert_nothing_left(&[]);
}

/// A certificate authority, and a key and a certificate of `localhost` by it, in this folder; `false` where there is no openssl.
fn certificates(folder: &Path) -> bool {
    std::fs::create_dir(folder).unwrap();
    let new_key = "req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes";
    let authority = "-x509 -days 2 -subj /CN=hall -keyout ca.key -out ca.pem \
                     -addext basicConstraints=critical,CA:TRUE -addext keyUsage=critical,keyCertSign";
    let steps = [
        format!("{new_key} {authority}"),
        format!("{new_key} -subj /CN=localhost -keyout server.key -out server.csr"),
        "x509 -req -in server.csr -CA ca.pem -CAkey ca.key -CAcreateserial -days 2 -extfile names -out server.pem"
            .to_owned(),
    ];
    std::fs::write(folder.join("names"), "subjectAltName=DNS:localhost\n").unwrap();
    steps.iter().all(|step| {
        let mut openssl = Command::new("openssl");
        openssl.args(step.split_whitespace()).current_dir(folder);
        let Ok(made) = openssl.stdin(Stdio::null()).output() else {
            let _ = writeln!(std::io::stderr(), "NOT RUN: a fleet over TLS: no openssl in PATH");
            return false;
        };
        assert!(made.status.success(), "{step}: {}", String::from_utf8_lossy(&made.stderr));
        true
    })
}

#[test]
fn a_server_is_known_by_its_certificate_and_nobody_speaks_with_another_one() {
    let place = Place::new();
    let folder = place.path("tls");
    if !certificates(&folder) {
        return;
    }
    let file = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let (key, certificate, ca) = (file("server.key"), file("server.pem"), file("ca.pem"));
    let encrypted = ["--tls", "--tlskey", &key, "--tlscert", &certificate];
    let Some(nats) = Nats::start_with(&place, &encrypted) else { return };
    let port = nats.address.rsplit(':').next().unwrap();
    let address = format!("tls://localhost:{port}");

    // Whoever does not know who signed it, or asks for another name, does not speak with it.
    for (address, more) in
        [(address.clone(), &[][..]), (format!("tls://127.0.0.1:{port}"), &["--ca", &ca])]
    {
        let ended = place.graver(&[&["fleet", "status", &address][..], more].concat());
        assert_eq!(ended.code, Some(4), "{address}: {}", ended.error);
    }
    let fleet = ["fleet", "status", &address, "--ca", &ca, "--json"];
    assert_valid("fleet_status", &place.graver(&fleet).json(0));

    let job = place.file("lines.ngc", &lines(1));
    let submit = ["fleet", "submit", &address, job.to_str().unwrap(), "--group", "lasers"];
    place.graver(&[&submit[..], &["--ca", &ca]].concat()).accepted();
    let machine = source("machines/corexy.toml");
    let start = [
        &["domain", "--services", "--no-realtime", "--machine", machine.to_str().unwrap()][..],
        &["--publish", &address, "--publish-ca", &ca, "--publish-as", "cell-1"],
        &["--jobs-of", "lasers", "--instance", place.instance().name()],
    ];
    let domain = place.start(&start.concat());
    until("the job is done", || {
        let told = place.graver(&fleet).json(0);
        let jobs = told["jobs"].as_array().unwrap();
        jobs.iter().any(|job| job["state"] == "completed").then_some(())
    });
    domain.signal(support::TERMINATE);
    domain.wait().accepted();
    place.assert_nothing_left(&[]);
}
