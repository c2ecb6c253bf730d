//! `graver run` and the operator's commands, as processes and in real time.

#![allow(clippy::unwrap_used)]

mod support;

use std::collections::BTreeMap;
use std::path::Path;

use messages::random::SplitMix64;
use messages::run_folder;
use monitor::recording::CycleRecord;
use serde_json::Value;
use support::{INTERRUPT, Place, TERMINATE, is_lit, lines, number, service, services};

/// The tool at every instant of stream time at which it was lit, in milliseconds.
fn lit_path(records: &[CycleRecord]) -> BTreeMap<u64, [f64; 3]> {
    records
        .iter()
        .filter(|record| record.command.stream != 0 && is_lit(record))
        .map(|record| ((record.command.stream_time * 1e3).round() as u64, record.feedback.tool))
        .collect()
}

fn farthest(one: &BTreeMap<u64, [f64; 3]>, other: &BTreeMap<u64, [f64; 3]>) -> f64 {
    assert!(one.keys().eq(other.keys()), "lit at {} and {} instants", one.len(), other.len());
    let distances =
        one.values().zip(other.values()).map(|(a, b)| messages::artwork::distance(a, b));
    distances.fold(0.0, f64::max)
}

/// Marks without a gap or an overlap longer than this [m].
fn assert_whole(summary: &Value, most: f64) {
    for key in ["missing_end_max", "double_end_max", "missing", "double"] {
        let value = number(summary, &format!("/marks/{key}"));
        // Of the sums each stroke has its share.
        let ends = if key.ends_with("max") { 1.0 } else { number(summary, "/job/strokes") };
        assert!(value <= most * ends, "{key} {value:e}");
    }
    assert_eq!(summary["marks"]["strokes_lost"], 0);
    assert_eq!(number(summary, "/marks/stray"), 0.0);
}

#[test]
fn the_default_job_marks_what_simulate_marks() {
    let place = Place::new();
    let out = place.path("run");
    // Without real time, because another pipeline may own the core.
    let ended = place.ask(&["run", "--no-realtime", "--json", "--out", out.to_str().unwrap()]);
    let summary = ended.json(0);
    support::assert_valid("summary", &summary);
    assert_eq!(summary["outcome"], "completed");
    assert_eq!((&summary["fault"], &summary["error"]), (&Value::Null, &Value::Null));
    assert_eq!(place.summary("run"), summary);
    let absent = [run_folder::REFUSAL, run_folder::OLD_SAMPLES];
    for file in run_folder::ALL.into_iter().filter(|file| !absent.contains(file)) {
        assert!(out.join(file).metadata().is_ok_and(|file| file.len() > 0), "{file}");
    }
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(!page.contains("src=\"http") && !page.contains("href=\"http"), "not self-contained");

    let twin = place.path("simulated");
    let simulated = place.graver(&["simulate", "--json", "--out", twin.to_str().unwrap()]).json(0);
    support::assert_valid("summary", &simulated);
    support::assert_same_commands(&summary, &simulated);
    let distance =
        farthest(&lit_path(&place.recording("run")), &lit_path(&place.recording("simulated")));
    assert!(distance <= 5e-6, "{distance:e} m apart");
    for key in ["error_max", "error_rms", "tracking_max", "missing_end_max", "double_end_max"] {
        let pointer = format!("/marks/{key}");
        let difference = number(&summary, &pointer) - number(&simulated, &pointer);
        assert!(difference.abs() <= 5e-6, "{key} differs by {difference:e}");
    }
    assert_whole(&summary, 20e-6);
    assert_eq!(number(&summary, "/job/length"), number(&simulated, "/job/length"));
    assert_eq!(summary["limits"], simulated["limits"]);
    assert_eq!((&summary["time"], &summary["cycles"]), (&simulated["time"], &simulated["cycles"]));
    let hops: Vec<_> = summary["latency"].as_object().unwrap().keys().cloned().collect();
    let expected = ["command", "compute", "exchange", "feedback", "loop", "setpoint", "wake"];
    assert_eq!(hops, expected);
    place.assert_nothing_left(&[]);
}

#[test]
fn a_job_that_cannot_be_read_is_refused_before_anything_starts() {
    let place = Place::new();
    let job = place.file("broken.ngc", "G21 G90\nM3 S100 F600\nG1 X10 Q5\n");
    let ended = place.run(&job, "run", &[]).wait();
    let summary = ended.json(2);
    support::assert_valid("summary", &summary);
    assert_eq!(summary["outcome"], "refused");
    assert!(summary["error"]["file"].as_str().unwrap().ends_with("broken.ngc"), "{summary}");
    assert_eq!(summary["error"]["line"], 3);
    assert!(ended.error.contains("broken.ngc"), "{}", ended.error);
    assert!(!place.path("run").exists(), "a run folder for a job that was never offered");
    place.assert_nothing_left(&[]);
}

#[test]
fn a_job_that_the_machine_cannot_do_is_refused_by_the_planner() {
    let place = Place::new();
    // Of an earlier run in the same folder nothing stays.
    std::fs::create_dir(place.path("run")).unwrap();
    for file in run_folder::ALL {
        place.file(&format!("run/{file}"), "old");
    }
    let job = place.file("far.ngc", "G21 G90 G54\nM3 S100 F6000\nG1 X10\nG1 Y150\nM2\n");
    let ended = place.run(&job, "run", &[]).wait();
    let summary = ended.json(2);
    support::assert_valid("summary", &summary);
    assert_eq!(summary["outcome"], "refused");
    assert!(summary["error"]["file"].as_str().unwrap().ends_with("far.ngc"), "{summary}");
    assert_eq!(summary["error"]["line"], 4, "{summary}");
    assert_eq!(summary["marks"], Value::Null);
    assert_eq!(place.summary("run")["outcome"], "refused");
    for file in run_folder::ALL {
        let text = std::fs::read(place.path("run").join(file)).unwrap_or_default();
        assert_ne!(text, b"old", "{file}");
    }
    place.assert_nothing_left(&[]);
}

#[test]
fn an_instance_in_use_names_who_uses_it() {
    let place = Place::new();
    let job = place.file("lines.ngc", &lines(4));
    let mut first = place.run(&job, "first", &[]);
    let services = services(&place.await_played(&mut first, 50));
    let second = place.run(&job, "second", &[]).wait();
    let summary = second.json(4);
    assert_eq!(summary["outcome"], "aborted");
    let pid = first.peer().pid().to_string();
    let message = summary["error"]["message"].as_str().unwrap();
    assert!(message.contains(&pid) && message.contains("in use"), "{message}, not {pid}");
    // The first is unharmed.
    assert_whole(&first.wait().json(0), 20e-6);
    place.assert_nothing_left(&services);
}

#[test]
fn an_interrupt_stops_laser_then_axes_then_processes() {
    let mut random = SplitMix64::new(4);
    for _ in 0..2 {
        let place = Place::new();
        let job = place.file("lines.ngc", &lines(4));
        let mut running = place.run(&job, "run", &[]);
        let services = services(&place.await_played(&mut running, 100 + random.below(900)));
        running.signal(INTERRUPT);
        let summary = running.wait().json(1);
        support::assert_valid("summary", &summary);
        assert_eq!(summary["outcome"], "stopped");
        assert_eq!(summary["fault"], Value::Null);
        assert_judged_by_what_was_due(&summary);
        assert!(number(&summary, "/marks/error_max") < 20e-6, "{summary:#}");
        support::assert_ends_dark_and_at_rest(&place.recording("run"), 2);
        place.assert_nothing_left(&services);
    }
}

/// Asserts that of a job that was broken off nothing is missing but what is left, and that it says where to go on.
fn assert_judged_by_what_was_due(summary: &Value) {
    let marks = |key: &str| number(summary, &format!("/marks/{key}"));
    let left = |key: &str| number(summary, &format!("/left/{key}"));
    let sum = marks("length") + marks("missing") + left("length") - marks("double");
    let length = number(summary, "/job/length");
    assert!((sum - length).abs() < 1e-4, "{sum} of {length}: {summary:#}");
    assert!(marks("missing") < 1e-4 && left("length") > 1e-3, "{summary:#}");
    assert_eq!(summary["marks"]["strokes_lost"], 0, "{summary:#}");
    assert_eq!(left("from_stroke"), left("strokes_done") + 1.0, "{summary:#}");
    assert_eq!(left("from_stroke"), number(summary, "/place/stroke"), "{summary:#}");
}

#[test]
fn a_hold_and_a_resume_lose_and_double_no_mark() {
    let place = Place::new();
    let job = place.file("lines.ngc", &lines(4));
    let mut running = place.run(&job, "run", &[]);
    let mut random = SplitMix64::new(11);
    let mut played = 0;
    for _ in 0..3 {
        played += 150 + random.below(300);
        place.await_played(&mut running, played);
        place.ask(&["hold"]).accepted();
        let held = place.await_status(&mut running, "at rest", |status| {
            status["state"] == "holding" && status["rate"].as_f64() == Some(0.0)
        });
        place.ask(&["resume"]).accepted();
        played = played.max(held["played"].as_u64().unwrap());
    }
    let summary = running.wait().json(0);
    assert_eq!(summary["outcome"], "completed");
    assert_whole(&summary, 20e-6);
    assert!(number(&summary, "/marks/error_max") < 15e-6, "{summary:#}");
    place.assert_nothing_left(&[]);
}

#[test]
fn half_the_rate_marks_the_same_lines_in_more_time() {
    let place = Place::new();
    let job = place.file("lines.ngc", &lines(3));
    let mut running = place.run(&job, "run", &[]);
    place.await_played(&mut running, 100);
    let reply = place.ask(&["override", "50 %", "--json", "--power", "80 %"]).json(0);
    assert_eq!((number(&reply, "/value"), number(&reply, "/power")), (0.5, 0.8));
    place.await_status(&mut running, "both overrides", |status| {
        status["rate_override"] == 0.5 && status["power_override"] == 0.8
    });
    let reply = place.ask(&["override", "--power", "100 %"]);
    assert!(reply.error.contains("100 % again when the job ends"), "{}", reply.error);
    let reply = place.ask(&["override", "50 %", "--json"]).json(0);
    assert_eq!(number(&reply, "/power"), 1.0);
    assert_eq!((&reply["accepted"], reply["value"].as_f64()), (&Value::Bool(true), Some(0.5)));
    place.await_status(&mut running, "half rate", |status| status["rate"] == 0.5);
    let summary = running.wait().json(0);
    assert_whole(&summary, 20e-6);
    assert!(number(&summary, "/marks/error_max") < 15e-6, "{summary:#}");
    let planned = place.graver(&["plan", job.to_str().unwrap(), "--json"]).json(0);
    let share = number(&summary, "/time") / number(&planned, "/time");
    assert!(share > 1.3, "{share} of the planned time");
    // Without the pipeline there is nobody to ask.
    let late = place.ask(&["override", "50 %"]);
    assert_eq!(late.code, Some(4), "{}", late.error);
    place.assert_nothing_left(&[]);
}

#[test]
fn stop_gives_the_job_up_and_status_tells_all_along() {
    let place = Place::new();
    let absent = place.ask(&["status"]);
    assert_eq!(absent.code, Some(4));
    assert!(absent.error.contains("no pipeline is running"), "{}", absent.error);

    let job = place.file("lines.ngc", &lines(4));
    let mut running = place.run(&job, "run", &[]);
    let services = services(&place.await_played(&mut running, 200));
    let status = place.ask(&["status", "--json"]).json(0);
    assert_eq!(status["state"], "running");
    assert!(status["job"].as_str().unwrap().contains("lines"), "{status}");
    assert!(status["samples"].as_u64().unwrap() > status["played"].as_u64().unwrap());
    assert!(place.ask(&["status"]).error.contains("running"));
    // What the state does not allow is refused, and the job goes on.
    for verb in ["enable", "disable", "reset", "resume"] {
        assert_eq!(place.ask(&[verb]).code, Some(1), "{verb}");
    }
    place.ask(&["stop"]).accepted();
    let ended = running.wait();
    let summary = ended.json(1);
    assert_eq!(summary["outcome"], "stopped");
    assert_judged_by_what_was_due(&summary);
    // What is left is what the job marks that goes on from there.
    let [stroke, strokes] = ["from_stroke", "strokes"].map(|key| &summary["left"][key]);
    let goes_on = stroke.to_string();
    let along = format!("{:.9} m", number(&summary, "/left/along"));
    let options = ["--from-stroke", &goes_on, "--from-along", &along, "--json"];
    let rest = place.graver(&[&["plan", job.to_str().unwrap()], &options[..]].concat()).json(0);
    let left = number(&summary, "/left/length");
    assert!((number(&rest, "/length") - left).abs() < 1e-6, "{rest:#}");
    assert_eq!(
        rest["strokes"].as_u64().unwrap() + stroke.as_u64().unwrap() - 1,
        strokes.as_u64().unwrap()
    );
    support::assert_ends_dark_and_at_rest(&place.recording("run"), 2);
    place.assert_nothing_left(&services);
}

#[test]
fn a_program_pauses_until_a_person_resumes() {
    let place = Place::new();
    let text = "G21 G90 G54\nM3 S800 F6000\nG1 X20\nM5\nM0\nM3\nG1 X0 Y10\nM2\n";
    let job = place.file("pause.ngc", text);
    let mut running = place.run(&job, "run", &[]);
    place.await_status(&mut running, "paused", |status| {
        status["state"] == "holding" && status["rate"].as_f64() == Some(0.0)
    });
    place.ask(&["resume"]).accepted();
    let summary = running.wait().json(0);
    assert_eq!(summary["outcome"], "completed");
    assert_eq!(number(&summary, "/job/strokes"), 2.0);
    assert_whole(&summary, 20e-6);
    place.assert_nothing_left(&[]);
}

#[test]
fn a_domain_takes_jobs_one_after_another() {
    let place = Place::new();
    let name = place.instance().name().to_owned();
    let mut domain = place.start(&["domain", "--no-realtime", "--instance", &name]);
    place.await_status(&mut domain, "domain", |_| true);
    let roles = ["monitor", "planner", "controller", "drives"];
    let started = roles.map(|role| place.start(&[role, "--instance", &name]));
    let status = place.await_status(&mut domain, "services", |status| {
        roles.iter().all(|role| status["services"][role].is_number())
    });
    for (role, process) in roles.iter().zip(&started) {
        assert_eq!(service(&status, role).pid(), process.peer().pid(), "{role}");
    }

    let submit = |job: &Path, out: &str| {
        let out = place.path(out);
        let arguments = ["submit", job.to_str().unwrap(), "--json", "--out", out.to_str().unwrap()];
        place.ask(&arguments)
    };
    let job = place.file("lines.ngc", &lines(2));
    for out in ["first", "second"] {
        let summary = submit(&job, out).json(0);
        support::assert_valid("summary", &summary);
        assert_eq!(summary["outcome"], "completed");
        assert_whole(&summary, 20e-6);
        assert_eq!(place.summary(out)["marks"], summary["marks"]);
    }
    let broken = place.file("broken.ngc", "G1 X1 F\n");
    let refused = submit(&broken, "refused").json(2);
    assert_eq!(refused["error"]["line"], 1, "{refused}");
    // A refused job leaves the domain ready for the next one.
    assert_eq!(submit(&job, "third").json(0)["outcome"], "completed");

    let again = place.start(&["controller", "--instance", &name]).wait();
    assert_eq!(again.code, Some(4));
    assert!(again.error.contains("already has a controller"), "{}", again.error);

    domain.signal(TERMINATE);
    assert_eq!(domain.wait().code, Some(0));
    for process in &started {
        process.signal(TERMINATE);
    }
    for (role, process) in roles.iter().zip(started) {
        let ended = process.wait();
        assert_eq!(ended.code, Some(0), "{role}: {}", ended.error);
    }
    place.assert_nothing_left(&[]);
}
