//! SIGKILL of every process of a pipeline, at seeded moments of a run: the laser is off from the
//! first deadline of drives after the death, the axes come to rest, the summary says what
//! happened, nothing is left, and the next start is clean.

#![allow(clippy::unwrap_used)]

mod support;

use messages::random::SplitMix64;
use messages::{CommandMode, Nanoseconds};
use monitor::recording::CycleRecord;
use runtime::clock;
use runtime::peer::Peer;
use serde_json::Value;
use support::{
    CONTINUE, Ended, KILL, PATIENCE, Place, STOP, TERMINATE, is_lit, lines, number, service,
    services,
};

const RUN: &str = "run";

/// Kills a process; the first instant at which it is known to be dead.
fn kill(peer: &Peer) -> Nanoseconds {
    peer.signal(KILL).unwrap();
    assert!(peer.ended_within(PATIENCE), "pid {} survives", peer.pid());
    clock::now()
}

/// Asserts that no cycle that began after `death` had any light, and says how many there were.
///
/// A feedback tells of the cycle that ended with it, so the light of the cycle that begins at a
/// record's deadline stands in the record after it.
fn assert_dark_since(death: Nanoseconds, records: &[CycleRecord], what: &str) -> usize {
    let mut since = 0;
    for pair in records.windows(2) {
        let [begins, ends] = pair else { continue };
        if begins.feedback.deadline >= death && ends.feedback.cycle == begins.feedback.cycle.next()
        {
            since += 1;
            let cycle = begins.feedback.cycle.0;
            assert!(!is_lit(ends), "{what}: lit in cycle {cycle}, {since} after the death");
        }
    }
    since
}

/// Asserts that a job runs in this place as if nothing had been before, and leaves nothing.
fn assert_starts_clean(place: &Place) {
    let job = place.file("next.ngc", &lines(1));
    let summary = place.run(&job, "next", &[]).wait().json(0);
    assert_eq!(summary["outcome"], "completed");
    assert_eq!(summary["marks"]["strokes_lost"], 0);
    place.assert_nothing_left(&[]);
}

/// What is left to see after a service was killed in the middle of a run.
struct Aftermath {
    place: Place,
    moment: String,
    death: Nanoseconds,
    services: Vec<Peer>,
    ended: Ended,
}

/// Runs four lines on the built-in machine and kills one service at a moment that `random` chooses.
fn kill_during_run(role: &str, random: &mut SplitMix64) -> Aftermath {
    kill_during_run_of(&[], role, random)
}

/// The same with these arguments of `graver run`.
fn kill_during_run_of(more: &[&str], role: &str, random: &mut SplitMix64) -> Aftermath {
    let place = Place::new();
    let job = place.file("lines.ngc", &lines(4));
    let mut running = place.run(&job, RUN, more);
    let played = 20 + random.below(1400);
    let status = place.await_played(&mut running, played);
    let services = services(&status);
    let death = kill(&service(&status, role));
    let moment = format!("{role} killed at {} of {}", status["played"], status["samples"]);
    Aftermath { place, moment, death, services, ended: running.wait() }
}

impl Aftermath {
    /// The summary of a run that could not go on, as printed and as kept.
    fn aborted(&self, role: &str) -> Value {
        let summary = self.ended.json(4);
        let what = &self.moment;
        support::assert_valid("summary", &summary);
        assert_eq!(self.place.summary(RUN), summary, "{what}");
        assert_eq!(summary["outcome"], "aborted", "{what}");
        let message = summary["error"]["message"].as_str().unwrap();
        assert!(message.contains(role) && message.contains("signal 9"), "{what}: {message}");
        assert!(self.ended.error.contains(message), "{what}: {}", self.ended.error);
        if !summary["marks"].is_null() {
            assert_true_marks(&summary, what);
        }
        summary
    }
}

/// Asserts that every length of the job is marked, missing, unrecorded or left, and none of it twice.
fn assert_balanced(summary: &Value, what: &str) {
    let marks = |key: &str| number(summary, &format!("/marks/{key}"));
    let left = summary.pointer("/left/length").and_then(Value::as_f64).unwrap_or(0.0);
    let sum = marks("length") + marks("missing") + left - marks("double");
    // Each stroke end may be off by the accuracy of a stroke end.
    let ends = 2.0 * 20e-6 * number(summary, "/job/strokes");
    let length = number(summary, "/job/length");
    assert!((sum - length).abs() <= ends, "{what}: {sum} of {length}: {}", summary["marks"]);
}

/// Asserts that marks of a run that was cut short say that something is left or may be missing, and that what
/// was marked lies where it should.
fn assert_true_marks(summary: &Value, what: &str) {
    let left = number(summary, "/left/length") + number(summary, "/marks/unrecorded");
    assert!(left > 1e-3, "{what}: only {left} m left");
    let lost = number(summary, "/marks/missing") - number(summary, "/marks/unrecorded");
    assert!(lost < 1e-4, "{what}: {lost} m missing of what it had come to");
    assert_balanced(summary, what);
    assert!(number(summary, "/marks/error_max") <= 20e-6, "{what}: {summary:#}");
    assert_eq!(number(summary, "/marks/stray"), 0.0, "{what}");
}

#[test]
fn without_a_planner_the_controller_brings_the_axes_to_rest_in_the_dark() {
    let mut random = SplitMix64::new(1);
    for _ in 0..3 {
        let aftermath = kill_during_run("planner", &mut random);
        let summary = aftermath.aborted("planner");
        assert_eq!(summary["fault"]["code"], "planner_lost", "{}", aftermath.moment);
        let records = aftermath.place.recording(RUN);
        let since = assert_dark_since(aftermath.death, &records, &aftermath.moment);
        assert!(since > 5, "{}: recorded only {since} cycles", aftermath.moment);
        support::assert_ends_dark_and_at_rest(&records, 2);
        aftermath.place.assert_nothing_left(&aftermath.services);
        assert_starts_clean(&aftermath.place);
    }
}

/// Asserts that steppers came to rest where the controller had them: each axis within a few of its
/// pulses of the reference for as long as it was followed. A feedback of a slow axis would not tell.
fn assert_rest_on_the_path(records: &[CycleRecord], axes: usize, what: &str) {
    let followed = |record: &&CycleRecord| record.command.mode() == CommandMode::Driven;
    let last: Vec<_> = records.iter().filter(followed).collect();
    assert!(last.len() > 100, "{what}: {} cycles", last.len());
    for record in &last[last.len() - 100..] {
        let cycle = record.feedback.cycle.0;
        for axis in 0..axes {
            let off = record.command.following_error[axis].abs();
            // 200 steps of 16 microsteps.
            assert!(off <= 3.0 * core::f64::consts::TAU / 3200.0, "{what}: {off} rad in {cycle}");
        }
    }
}

#[test]
fn steppers_come_to_rest_on_the_path_whoever_else_is_killed() {
    let machine = support::source("machines/cartesian_steppers.toml");
    let steppers = ["--machine", machine.to_str().unwrap()];
    let mut random = SplitMix64::new(8);
    for _ in 0..2 {
        let aftermath = kill_during_run_of(&steppers, "planner", &mut random);
        let summary = aftermath.aborted("planner");
        assert_eq!(summary["fault"]["code"], "planner_lost", "{}", aftermath.moment);
        let records = aftermath.place.recording(RUN);
        assert_dark_since(aftermath.death, &records, &aftermath.moment);
        assert_rest_on_the_path(&records, 2, &aftermath.moment);
        support::assert_ends_dark_and_at_rest(&records, 2);
    }
    // A supervisor that is killed, and drives that are told to end.
    for ordered in [false, true] {
        let place = Place::new();
        let job = place.file("lines.ngc", &lines(8));
        let mut running = place.run(&job, RUN, &steppers);
        let status = place.await_played(&mut running, 20 + random.below(1400));
        let what = format!("ended at {}, ordered {ordered}", status["played"]);
        let services = services(&status);
        let death = if ordered {
            service(&status, "drives").signal(TERMINATE).unwrap();
            None
        } else {
            Some(kill(&running.peer()))
        };
        running.wait();
        place.assert_nothing_left(&services);
        let records = place.recording(RUN);
        if let Some(death) = death {
            assert_dark_since(death, &records, &what);
        }
        assert_rest_on_the_path(&records, 2, &what);
        support::assert_ends_dark_and_at_rest(&records, 2);
    }
}

#[test]
fn without_a_controller_drives_stops_the_axes_in_the_dark() {
    let mut random = SplitMix64::new(2);
    for _ in 0..3 {
        let aftermath = kill_during_run("controller", &mut random);
        let summary = aftermath.aborted("controller");
        assert_eq!(summary["fault"]["code"], "controller_lost", "{}", aftermath.moment);
        let records = aftermath.place.recording(RUN);
        let since = assert_dark_since(aftermath.death, &records, &aftermath.moment);
        assert!(since > 5, "{}: recorded only {since} cycles", aftermath.moment);
        support::assert_ends_dark_and_at_rest(&records, 2);
        aftermath.place.assert_nothing_left(&aftermath.services);
        assert_starts_clean(&aftermath.place);
    }
}

#[test]
fn without_drives_the_simulated_plant_is_gone_and_the_summary_says_so() {
    let mut random = SplitMix64::new(3);
    for _ in 0..3 {
        let aftermath = kill_during_run("drives", &mut random);
        let summary = aftermath.aborted("drives");
        assert_eq!(summary["fault"]["code"], "drives_lost", "{}", aftermath.moment);
        let records = aftermath.place.recording(RUN);
        assert_dark_since(aftermath.death, &records, &aftermath.moment);
        aftermath.place.assert_nothing_left(&aftermath.services);
        assert_starts_clean(&aftermath.place);
    }
}

#[test]
fn without_a_supervisor_the_services_end_and_the_monitor_writes_the_summary() {
    let mut random = SplitMix64::new(4);
    for _ in 0..3 {
        let place = Place::new();
        let job = place.file("lines.ngc", &lines(8));
        let mut running = place.run(&job, RUN, &[]);
        let status = place.await_played(&mut running, 20 + random.below(1400));
        let what = format!("supervisor killed at {}", status["played"]);
        let services = services(&status);
        let death = kill(&running.peer());
        assert_eq!(running.wait().code, None);
        place.assert_nothing_left(&services);

        let summary = place.summary(RUN);
        support::assert_valid("summary", &summary);
        assert_eq!(summary["outcome"], "aborted", "{what}");
        let message = summary["error"]["message"].as_str().unwrap();
        assert!(message.contains("supervisor"), "{what}: {message}");
        assert_eq!(summary["fault"]["code"], "supervisor_lost", "{what}");
        if !summary["marks"].is_null() {
            assert_true_marks(&summary, &what);
        }
        let records = place.recording(RUN);
        let since = assert_dark_since(death, &records, &what);
        assert!(since > 5, "{what}: recorded only {since} cycles");
        support::assert_ends_dark_and_at_rest(&records, 2);
        assert_starts_clean(&place);
    }
}

#[test]
fn without_a_monitor_the_marks_are_unharmed() {
    let mut random = SplitMix64::new(5);
    for kills in [1, 1, 2] {
        let place = Place::new();
        let job = place.file("lines.ngc", &lines(4));
        let mut running = place.run(&job, RUN, &[]);
        let mut played = 20;
        let mut killed = 0;
        for _ in 0..kills {
            played += random.below(600);
            // The monitor that was started again has another pid.
            let status = place.await_status(&mut running, "a new monitor", |status| {
                let pid = status["services"]["monitor"].as_i64();
                status["played"].as_u64() >= Some(played) && pid.is_some_and(|pid| pid != killed)
            });
            let monitor = service(&status, "monitor");
            killed = i64::from(monitor.pid());
            kill(&monitor);
        }
        let ended = running.wait();
        let summary = ended.json(0);
        support::assert_valid("summary", &summary);
        assert_eq!(summary["outcome"], "completed");
        let warnings = summary["warnings"].to_string();
        assert!(warnings.contains("monitor") && warnings.contains("signal 9"), "{warnings}");
        assert!(ended.error.contains("monitor"), "{}", ended.error);
        assert_completed_around_a_gap(&summary);
        let simulated = place.graver(&["simulate", job.to_str().unwrap(), "--json"]).json(0);
        support::assert_same_commands(&summary, &simulated);
        place.assert_nothing_left(&[]);
        assert_starts_clean(&place);
    }
}

/// Asserts what is judged of a completed job while whose monitor was dead for a time. What it missed
/// in half a second its successor still gets, and the rest is told as a gap.
fn assert_completed_around_a_gap(summary: &Value) {
    assert!(!summary["marks"].is_null(), "{summary:#}");
    assert_balanced(summary, "completed");
    let marks = |key: &str| number(summary, &format!("/marks/{key}"));
    assert!(marks("missing") - marks("unrecorded") < 1e-4, "{summary:#}");
    assert!(marks("double") < 1e-4, "{summary:#}");
    assert!(number(summary, "/marks/error_max") <= 20e-6, "{summary:#}");
    assert_eq!(
        (&summary["marks"]["strokes_lost"], number(summary, "/marks/stray")),
        (&0.into(), 0.0)
    );
    let gaps = summary["recording"]["gaps"].as_u64().unwrap();
    assert_eq!(gaps == 0, summary["recording"]["missing"] == 0, "{summary:#}");
    if gaps == 0 {
        assert_eq!(number(summary, "/marks/unrecorded"), 0.0, "{summary:#}");
    }
}

#[test]
fn what_passes_while_nobody_can_record_is_told_as_a_gap() {
    let place = Place::new();
    let job = place.file("lines.ngc", &lines(8));
    let mut running = place.run(&job, RUN, &[]);
    let status = place.await_played(&mut running, 100);
    // A supervisor that is stopped starts no successor.
    running.signal(STOP);
    kill(&service(&status, "monitor"));
    std::thread::sleep(std::time::Duration::from_millis(1200));
    running.signal(CONTINUE);
    let summary = running.wait().json(0);
    assert_eq!(summary["outcome"], "completed");
    assert_completed_around_a_gap(&summary);
    assert!(summary["recording"]["gaps"].as_u64() >= Some(1), "{summary:#}");
    assert!(number(&summary, "/marks/unrecorded") > 1e-3, "{summary:#}");
    place.assert_nothing_left(&[]);
}

/// Killed as soon as the job is offered, while it is planned, or while it is played: its successor
/// records the rest of the same job.
#[test]
fn a_monitor_that_was_started_again_goes_on_with_the_recording() {
    let mut random = SplitMix64::new(7);
    for played in [None, None, Some(20), Some(20 + random.below(600))] {
        let place = Place::new();
        let job = place.file("lines.ngc", &lines(8));
        let mut running = place.run(&job, RUN, &[]);
        let status = place.await_status(&mut running, "a job", |status| {
            status["job"].is_string() && status["played"].as_u64() >= played
        });
        let killed = service(&status, "monitor");
        kill(&killed);
        // In a hold the job waits, however slow the computer is.
        place.await_played(&mut running, 20);
        place.ask(&["hold"]).accepted();
        place.await_status(&mut running, "a new monitor", |status| {
            let pid = status["services"]["monitor"].as_i64();
            pid.is_some_and(|pid| pid != i64::from(killed.pid()))
        });
        let size = || -> u64 {
            let parts = monitor::recording::file::parts::of(&place.path(RUN));
            parts.iter().map(|part| part.metadata().map_or(0, |file| file.len())).sum()
        };
        let before = size();
        place.await_status(&mut running, "a recording that grows", |_| size() > before + 20_000);
        place.ask(&["resume"]).accepted();
        let summary = running.wait().json(0);
        support::assert_valid("summary", &summary);
        assert_eq!(summary["outcome"], "completed");
        assert_completed_around_a_gap(&summary);
        // All of the end is there.
        support::assert_ends_dark_and_at_rest(&place.recording(RUN), 2);
        let length = number(&summary, "/job/length");
        assert!(number(&summary, "/marks/length") > 0.4 * length, "{summary:#}");
        place.assert_nothing_left(&[]);
    }
}

#[test]
fn a_service_that_dies_while_the_pipeline_starts_is_named() {
    let mut random = SplitMix64::new(6);
    for role in ["planner", "controller", "drives"] {
        let place = Place::new();
        let job = place.file("lines.ngc", &lines(4));
        let mut running = place.run(&job, RUN, &[]);
        let status = place
            .await_status(&mut running, "a process", |status| status["services"][role].is_number());
        std::thread::sleep(std::time::Duration::from_millis(random.below(100)));
        kill(&service(&status, role));
        let ended = running.wait();
        let summary = ended.json(4);
        assert_eq!(summary["outcome"], "aborted", "{role}");
        let message = summary["error"]["message"].as_str().unwrap();
        assert!(message.contains(role) && message.contains("signal 9"), "{role}: {message}");
        place.assert_nothing_left(&[]);
        assert_starts_clean(&place);
    }
}

#[test]
fn when_all_are_killed_at_once_the_next_start_removes_what_they_left() {
    let place = Place::new();
    let job = place.file("lines.ngc", &lines(4));
    let mut running = place.run(&job, RUN, &[]);
    let status = place.await_played(&mut running, 300);
    let mut peers = services(&status);
    peers.push(running.peer());
    for peer in &peers {
        peer.signal(KILL).unwrap();
    }
    for peer in &peers {
        assert!(peer.ended_within(PATIENCE));
    }
    assert_eq!(running.wait().code, None);
    assert_starts_clean(&place);
}

#[test]
fn a_domain_goes_on_after_drives_was_started_again_and_the_fault_reset() {
    let place = Place::new();
    let name = place.instance().name().to_owned();
    let mut domain = place.start(&["domain", "--no-realtime", "--instance", &name]);
    place.await_status(&mut domain, "domain", |_| true);
    let roles = ["monitor", "planner", "controller", "drives"];
    let mut started = Vec::from(roles.map(|role| place.start(&[role, "--instance", &name])));

    let job = place.file("lines.ngc", &lines(4));
    let submit = |out: &str| {
        let out = place.path(out);
        let out = out.to_str().unwrap();
        place.start(&["submit", job.to_str().unwrap(), "--json", "--out", out, "--instance", &name])
    };
    let first = submit("first");
    let status = place.await_played(&mut domain, 300);
    kill(&service(&status, "drives"));
    let summary = first.wait().json(4);
    assert_eq!(summary["outcome"], "aborted");
    assert_eq!(summary["fault"]["code"], "drives_lost");

    started.push(place.start(&["drives", "--instance", &name]));
    let faulted = place.await_status(&mut domain, "faulted", |status| status["state"] == "faulted");
    assert!(faulted["fault"].is_string(), "{faulted}");
    // A fault is latched until a person resets it.
    let refused = submit("refused").wait();
    assert_ne!(refused.code, Some(0), "{}", refused.output);
    place.ask(&["reset"]).accepted();
    let summary = submit("second").wait().json(0);
    assert_eq!(summary["outcome"], "completed");
    assert!(number(&summary, "/marks/error_max") < 15e-6, "{summary:#}");

    domain.signal(TERMINATE);
    assert_eq!(domain.wait().code, Some(0));
    for process in started {
        process.signal(TERMINATE);
        process.wait();
    }
    place.assert_nothing_left(&[]);
}
