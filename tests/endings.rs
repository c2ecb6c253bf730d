//! Every way in which a run ends: what happened on the machine is the outcome, whatever its
//! surroundings do. The rows of the table in docs/operating.md, one test each.

#![allow(clippy::unwrap_used)]

mod support;

use graver::arguments::{DrivesArguments, DrivesKind, MachineArguments};
use graver::inputs::MachineSource;
use graver::pipeline::configuration::Configuration;
use graver::pipeline::{JobSource, Pipeline, ServiceOwner};
use messages::DrivesReport;
use monitor::recording::file::parts::Extent;
use runtime::{Domain, Role, Samples, Subscriber};
use serde_json::Value;
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::Stdio;
use std::time::Duration;
use support::{
    CONTINUE, Ended, HANGUP, INTERRUPT, KILL, Place, Running, STOP, TERMINATE, lines, number,
    service, services, slow_to_plan,
};

/// Asserts how a run ended, and gives its summary, which is the one in the run folder.
fn assert_ended(place: &Place, ended: &Ended, code: i32, outcome: &str) -> Value {
    let summary = ended.json(code);
    support::assert_valid("summary", &summary);
    assert_eq!(summary["outcome"], outcome, "{summary:#}");
    assert_eq!(place.summary("run"), summary);
    summary
}

fn assert_stopped(place: &Place, ended: &Ended) -> Value {
    let summary = assert_ended(place, ended, 1, "stopped");
    assert_eq!((&summary["fault"], &summary["error"]), (&Value::Null, &Value::Null), "{summary:#}");
    summary
}

fn start(place: &Place, text: &str, more: &[&str]) -> Running {
    let job = place.file("job.ngc", text);
    place.run(&job, "run", more)
}

fn await_planning(place: &Place, running: &mut Running) -> Value {
    place.await_status(running, "planning", |status| {
        status["planner"] == "planning" && status["state"] == "idle"
    })
}

#[test]
fn a_signal_while_it_starts_stops_it() {
    for signal in [INTERRUPT, TERMINATE] {
        let place = Place::new();
        let mut running = start(&place, &lines(4), &[]);
        place.await_status(&mut running, "a pipeline", |_| true);
        running.signal(signal);
        let summary = assert_stopped(&place, &running.wait());
        assert_eq!(summary["marks"], Value::Null);
        place.assert_nothing_left(&[]);
    }
}

#[test]
fn a_signal_while_it_plans_stops_it() {
    for signal in [INTERRUPT, TERMINATE] {
        let place = Place::new();
        let mut running = start(&place, &slow_to_plan(), &[]);
        let services = services(&await_planning(&place, &mut running));
        running.signal(signal);
        assert_stopped(&place, &running.wait());
        place.assert_nothing_left(&services);
    }
}

#[test]
fn a_signal_while_it_marks_brings_the_axes_to_rest_along_the_path() {
    let place = Place::new();
    let mut running = start(&place, &lines(4), &[]);
    let services = services(&place.await_played(&mut running, 400));
    running.signal(TERMINATE);
    let summary = assert_stopped(&place, &running.wait());
    assert!(number(&summary, "/left/length") > 1e-3, "{summary:#}");
    support::assert_ends_dark_and_at_rest(&place.recording("run"), 2);
    place.assert_nothing_left(&services);
}

#[test]
fn a_terminal_that_closes_loses_no_job() {
    let place = Place::new();
    let mut running = start(&place, &lines(4), &[]);
    let services = services(&place.await_played(&mut running, 200));
    running.signal(HANGUP);
    for service in &services {
        service.signal(HANGUP).unwrap();
    }
    let summary = assert_ended(&place, &running.wait(), 0, "completed");
    assert!(number(&summary, "/marks/missing") < 1e-6, "{summary:#}");
    place.assert_nothing_left(&services);
}

#[test]
fn a_second_signal_waits_for_nothing_that_hangs() {
    let place = Place::new();
    let mut running = start(&place, &lines(4), &[]);
    let status = place.await_played(&mut running, 400);
    let all = services(&status);
    let monitor = service(&status, "monitor");
    monitor.signal(STOP).unwrap();
    running.signal(INTERRUPT);
    place.await_status(&mut running, "coming to rest", |status| status["state"] != "running");
    running.signal(INTERRUPT);
    let summary = running.wait().json(1);
    assert_eq!(summary["outcome"], "stopped");
    monitor.signal(CONTINUE).unwrap();
    place.assert_nothing_left(&all);
}

#[test]
fn stop_works_while_it_starts_and_while_it_plans() {
    for text in [lines(4), slow_to_plan()] {
        let place = Place::new();
        let mut running = start(&place, &text, &[]);
        if text == slow_to_plan() {
            await_planning(&place, &mut running);
        } else {
            place.await_status(&mut running, "a pipeline", |_| true);
        }
        place.ask(&["stop"]).accepted();
        assert_stopped(&place, &running.wait());
        place.assert_nothing_left(&[]);
    }
}

#[test]
fn hold_keeps_a_job_that_is_not_played_yet_until_it_is_resumed() {
    let place = Place::new();
    let mut running = start(&place, &lines(1), &[]);
    place.await_status(&mut running, "a pipeline", |_| true);
    place.ask(&["hold"]).accepted();
    let held = place.await_status(&mut running, "ready and held", |status| {
        status["planner"] == "streaming" && status["state"] == "holding"
    });
    assert_eq!(held["played"], 0, "{held:#}");
    place.ask(&["resume"]).accepted();
    let summary = assert_ended(&place, &running.wait(), 0, "completed");
    assert!(number(&summary, "/marks/missing") < 40e-6, "{summary:#}");
    place.assert_nothing_left(&[]);
}

#[test]
fn stop_is_never_refused() {
    let place = Place::new();
    let name = place.instance().name().to_owned();
    let mut domain = place.start(&["domain", "--no-realtime", "--instance", &name]);
    place.await_status(&mut domain, "domain", |_| true);
    let roles = ["planner", "controller", "drives"];
    let started = roles.map(|role| place.start(&[role, "--instance", &name]));
    place.await_status(&mut domain, "services", |status| {
        roles.iter().all(|role| status["services"][role].is_number())
    });
    // There is nothing to stop.
    place.ask(&["stop"]).accepted();
    domain.signal(TERMINATE);
    assert_eq!(domain.wait().code, Some(0));
    for process in started {
        process.signal(TERMINATE);
        process.wait();
    }
    place.assert_nothing_left(&[]);
}

#[test]
fn stop_reaches_the_controller_past_a_supervisor_that_hangs() {
    let place = Place::new();
    let mut running = start(&place, &lines(12), &[]);
    place.await_played(&mut running, 100);
    running.signal(STOP);
    let asked = place.ask(&["stop"]);
    asked.accepted();
    let pid = running.peer().pid().to_string();
    assert!(
        asked.error.contains(&pid) && asked.error.contains("did not answer"),
        "{}",
        asked.error
    );
    let status = place.ask(&["status"]);
    assert_eq!(status.code, Some(4));
    assert!(status.error.contains("stopped or hangs"), "{}", status.error);
    running.signal(CONTINUE);
    assert_stopped(&place, &running.wait());
    support::assert_ends_dark_and_at_rest(&place.recording("run"), 2);
    place.assert_nothing_left(&[]);
}

#[test]
fn a_fault_before_the_job_plays_is_a_fault() {
    let place = Place::new();
    let mut running = start(&place, &slow_to_plan(), &[]);
    let status = await_planning(&place, &mut running);
    let all = services(&status);
    let controller = service(&status, "controller");
    controller.signal(STOP).unwrap();
    // Drives hears no fresh command and stops alone.
    std::thread::sleep(Duration::from_millis(600));
    controller.signal(CONTINUE).unwrap();
    let summary = assert_ended(&place, &running.wait(), 3, "faulted");
    assert_eq!(summary["fault"]["code"], "stale_command", "{summary:#}");
    place.assert_nothing_left(&all);
}

#[test]
fn a_fault_while_it_marks_is_a_fault() {
    let place = Place::new();
    let plant = "plant.axis.a.friction.coulomb=2 N m";
    let running = start(&place, &lines(2), &["--set", plant]);
    let summary = assert_ended(&place, &running.wait(), 3, "faulted");
    assert_eq!(summary["fault"]["code"], "following_error", "{summary:#}");
    assert_eq!(summary["fault"]["axis"], "a", "{summary:#}");
    place.assert_nothing_left(&[]);
}

#[test]
fn a_controller_that_hangs_for_good_is_a_fault_of_drives() {
    let place = Place::new();
    let mut running = start(&place, &lines(4), &[]);
    let status = place.await_played(&mut running, 400);
    let all = services(&status);
    let controller = service(&status, "controller");
    controller.signal(STOP).unwrap();
    let ended = running.wait();
    let summary = assert_ended(&place, &ended, 3, "faulted");
    assert_eq!(summary["fault"]["code"], "stale_command", "{summary:#}");
    // Whoever stopped it may have reasons; the next start would name it.
    assert!(ended.error.contains("keeps the instance until it is continued"), "{}", ended.error);
    controller.signal(CONTINUE).unwrap();
    place.assert_nothing_left(&all);
}

#[test]
fn a_controller_that_hangs_before_the_motors_are_powered_ends_the_job() {
    let place = Place::new();
    let name = place.instance().name().to_owned();
    let mut domain = place.start(&["domain", "--no-realtime", "--instance", &name]);
    place.await_status(&mut domain, "domain", |_| true);
    let roles = ["planner", "controller", "drives"];
    let started = roles.map(|role| place.start(&[role, "--instance", &name]));
    let status = place.await_status(&mut domain, "services", |status| {
        roles.iter().all(|role| status["services"][role].is_number())
            && status["cycles"].as_u64() > Some(0)
    });
    let controller = service(&status, "controller");
    controller.signal(STOP).unwrap();
    let job = place.file("job.ngc", &lines(1));
    let out = place.path("run");
    let arguments = ["submit", job.to_str().unwrap(), "--json", "--out", out.to_str().unwrap()];
    let summary = place.ask(&arguments).json(4);
    assert_eq!(summary["outcome"], "aborted", "{summary:#}");
    let message = summary["error"]["message"].as_str().unwrap();
    assert!(message.contains("controller did not"), "{message}");
    controller.signal(CONTINUE).unwrap();
    domain.signal(TERMINATE);
    assert_eq!(domain.wait().code, Some(0));
    for process in started {
        process.signal(TERMINATE);
        process.wait();
    }
    place.assert_nothing_left(&[]);
}

#[test]
fn a_planner_that_dies_while_it_plans_aborts_the_job() {
    let place = Place::new();
    let mut running = start(&place, &slow_to_plan(), &[]);
    let status = await_planning(&place, &mut running);
    let all = services(&status);
    service(&status, "planner").signal(KILL).unwrap();
    let summary = assert_ended(&place, &running.wait(), 4, "aborted");
    let message = summary["error"]["message"].as_str().unwrap();
    assert!(message.contains("planner") && message.contains("signal 9"), "{message}");
    place.assert_nothing_left(&all);
}

#[test]
fn a_closed_or_full_standard_error_changes_nothing() {
    for closed in [true, false] {
        let place = Place::new();
        let job = place.file("job.ngc", &lines(2));
        let out = place.path("run");
        let mut arguments = vec!["run", job.to_str().unwrap(), "--json", "--no-realtime"];
        arguments.extend(["--instance", place.instance().name(), "--out", out.to_str().unwrap()]);
        let mut command = place.command(&arguments);
        command.stdout(Stdio::piped());
        // A pipe whose reader has gone, and a device that is always full.
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let stderr = File::options().write(true).open("/dev/full").unwrap();
        command.stderr(if closed { Stdio::from(writer) } else { Stdio::from(stderr) });
        let mut running = Running::of(command.spawn().unwrap());
        // The monitor dies, which is told on standard error, and changes nothing.
        let status = place.await_played(&mut running, 100);
        service(&status, "monitor").signal(KILL).unwrap();
        let output = running.output();
        assert_eq!(output.status.code(), Some(0), "closed: {closed}");
        let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(summary["outcome"], "completed");
        place.assert_nothing_left(&[]);
    }
}

#[test]
fn a_full_standard_output_does_not_change_what_happened() {
    let place = Place::new();
    let job = place.file("job.ngc", &lines(1));
    let job = job.to_str().unwrap();
    let full = || File::options().write(true).open("/dev/full").unwrap();
    let mut arguments = vec!["run", job, "--json", "--no-realtime"];
    arguments.extend(["--instance", place.instance().name()]);
    let output = place.command(&arguments).stdout(full()).output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{error}");
    assert!(error.contains("standard output") && error.contains("completed"), "{error}");

    for arguments in [&["plan", job, "--json"][..], &["completions", "bash"]] {
        let output = place.command(arguments).stdout(full()).output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {error}");
        assert!(error.contains("standard output"), "{error}");
    }
}

#[test]
fn a_domain_outlives_a_closed_standard_error_and_a_refused_job() {
    let place = Place::new();
    let name = place.instance().name().to_owned();
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut command = place.command(&["domain", "--no-realtime", "--instance", &name]);
    command.stdout(Stdio::null()).stderr(writer);
    let mut domain = Running::of(command.spawn().unwrap());
    place.await_status(&mut domain, "domain", |_| true);
    let roles = ["monitor", "planner", "controller", "drives"];
    let started = roles.map(|role| place.start(&[role, "--instance", &name]));
    let broken = place.file("broken.ngc", "G1 X1 F\n");
    for out in ["first", "second"] {
        let out = place.path(out);
        let arguments =
            ["submit", broken.to_str().unwrap(), "--json", "--out", out.to_str().unwrap()];
        assert_eq!(place.ask(&arguments).json(2)["outcome"], "refused");
    }
    assert!(domain.try_code().is_none());
    domain.signal(TERMINATE);
    assert_eq!(domain.output().status.code(), Some(0));
    for process in started {
        process.signal(TERMINATE);
        process.wait();
    }
    place.assert_nothing_left(&[]);
}

#[test]
fn a_monitor_that_cannot_be_started_again_costs_its_recording_only() {
    let place = Place::new();
    // The program as a new build replaces it: its path is gone, the processes run on.
    let program = place.path("graver-copy");
    std::fs::copy(env!("CARGO_BIN_EXE_graver"), &program).unwrap();
    let job = place.file("job.ngc", &lines(3));
    let out = place.path("run");
    let mut command = place.command_of(&program, &["run", job.to_str().unwrap(), "--json"]);
    command.args(["--no-realtime", "--instance", place.instance().name()]);
    command.args(["--out", out.to_str().unwrap()]).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut running = Running::of(command.spawn().unwrap());
    let status = place.await_played(&mut running, 100);
    std::fs::remove_file(&program).unwrap();
    service(&status, "monitor").signal(KILL).unwrap();
    let output = running.output();
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{error}");
    assert!(error.contains("started again") && !error.contains("not started again"), "{error}");
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["outcome"], "completed");
    place.assert_nothing_left(&[]);
}

#[test]
fn a_run_folder_that_vanishes_costs_its_files_only() {
    let place = Place::new();
    let mut running = start(&place, &lines(3), &[]);
    place.await_played(&mut running, 200);
    std::fs::remove_dir_all(place.path("run")).unwrap();
    let summary = running.wait().json(0);
    assert_eq!(summary["outcome"], "completed", "{summary:#}");
    let warnings = summary["warnings"].to_string();
    let path = place.path("run").join("summary.json");
    assert!(warnings.contains(path.to_str().unwrap()), "{warnings}");
    place.assert_nothing_left(&[]);
}

#[test]
fn two_runs_do_not_write_into_one_folder() {
    let place = Place::new();
    let mut first = start(&place, &lines(4), &[]);
    place.await_played(&mut first, 50);
    let job = place.path("job.ngc");
    let out = place.path("run");
    let (job, out) = (job.to_str().unwrap(), out.to_str().unwrap());
    let pid = first.peer().pid().to_string();
    for command in ["run", "simulate"] {
        let mut arguments = vec![command, job, "--json", "--out", out];
        if command == "run" {
            arguments.extend(["--no-realtime", "--instance", "another"]);
        }
        let refused = place.graver(&arguments).json(2);
        let message = refused["error"]["message"].as_str().unwrap();
        assert!(message.contains(out) && message.contains(&pid), "{message}");
    }
    assert_ended(&place, &first.wait(), 0, "completed");
}

#[test]
fn a_submitters_signal_stops_its_job_and_says_so() {
    let place = Place::new();
    let name = place.instance().name().to_owned();
    let mut domain = place.start(&["domain", "--no-realtime", "--instance", &name]);
    place.await_status(&mut domain, "domain", |_| true);
    let roles = ["monitor", "planner", "controller", "drives"];
    let started = roles.map(|role| place.start(&[role, "--instance", &name]));
    let job = place.file("job.ngc", &lines(4));
    let submit = |out: &str| {
        let out = place.path(out);
        let out = out.to_str().unwrap();
        place.start(&["submit", job.to_str().unwrap(), "--json", "--out", out, "--instance", &name])
    };
    let first = submit("first");
    place.await_played(&mut domain, 100);
    // One that waits for its turn is taken back too, and the one under way goes on.
    let second = submit("second");
    std::thread::sleep(Duration::from_millis(300));
    second.signal(INTERRUPT);
    std::thread::sleep(Duration::from_millis(300));
    first.signal(INTERRUPT);
    for client in [first, second] {
        let ended = client.wait();
        assert_eq!(ended.json(1)["outcome"], "stopped", "{}", ended.error);
        assert!(ended.error.contains("stopping job"), "{}", ended.error);
    }
    support::assert_ends_dark_and_at_rest(&place.recording("first"), 2);
    let summary = submit("third").wait().json(0);
    assert_eq!(summary["outcome"], "completed");
    domain.signal(TERMINATE);
    domain.wait();
    for process in started {
        process.signal(TERMINATE);
        process.wait();
    }
    place.assert_nothing_left(&[]);
}

#[test]
fn output_never_goes_over_an_input() {
    let place = Place::new();
    let job = place.file("m.ngc", &lines(1));
    let machine = place.file(
        "m.toml",
        &std::fs::read_to_string(support::source("machines/cartesian_steppers.toml")).unwrap(),
    );
    let (job, machine) = (job.to_str().unwrap(), machine.to_str().unwrap());
    let cases: [&[&str]; 5] = [
        &["plan", job, "--samples", job],
        &["plan", job, "--machine", machine, "--samples", machine],
        &["plan", job, "--machine", machine, "--pulses", job],
        &["check", job, "--picture", job],
        &["check", "--machine", machine, "--picture", machine],
    ];
    let before = [job, machine].map(|path| std::fs::read(path).unwrap());
    for arguments in cases {
        let ended = place.graver(arguments);
        assert_eq!(ended.code, Some(2), "{arguments:?}: {}", ended.error);
        assert!(ended.error.contains("would be lost"), "{}", ended.error);
        assert_eq!([job, machine].map(|path| std::fs::read(path).unwrap()), before);
    }
}

#[test]
fn a_panic_of_the_supervisor_unpowers_the_motors() {
    let place = Place::new();
    let machine = MachineArguments { machine: None, set: Vec::new() };
    let drives =
        DrivesArguments { drives: DrivesKind::Sim, strict: false, core: None, no_realtime: true };
    let source = MachineSource::read(&machine).unwrap();
    let configuration = Configuration::new(source, &drives, Extent::default()).unwrap();
    let mut services = Vec::new();
    let mut observer = None;
    let panicked = catch_unwind(AssertUnwindSafe(|| {
        let mut pipeline =
            Pipeline::start(place.instance(), &configuration, ServiceOwner::Others, JobSource::Own)
                .unwrap();
        for role in ["planner", "controller", "drives"] {
            services.push(place.start(&[role, "--instance", place.instance().name()]));
        }
        let domain = Domain::join(place.instance(), Role::Observer).unwrap();
        let reports: Subscriber<DrivesReport> = domain.subscriber(Samples::Latest).unwrap();
        observer = Some((reports, domain));
        pipeline.enable().unwrap();
        panic!("as a fault in the supervisor would");
    }));
    assert!(panicked.is_err());
    let (mut reports, domain) = observer.unwrap();
    let started = std::time::Instant::now();
    while reports.newest().unwrap().is_none_or(|report| report.at_rest != 1) {
        assert!(started.elapsed() < support::PATIENCE, "the motors stay powered");
        std::thread::sleep(Duration::from_millis(2));
    }
    drop((reports, domain));
    for service in services {
        service.signal(TERMINATE);
        service.wait();
    }
    place.assert_nothing_left(&[]);
}
