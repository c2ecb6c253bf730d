//! Strict deadlines with drives stopped for some milliseconds, as processes: whether the job goes on
//! or a fault stops it is for the load of the PC to say; that no cycle is lit without a command, and
//! that the summary says what happened, is not.

#![allow(clippy::unwrap_used)]

mod support;

use std::time::{Duration, Instant};

use messages::feedback::status;
use messages::time::SETPOINT_PERIOD;
use monitor::recording::CycleRecord;
use runtime::peer::Peer;
use serde_json::Value;
use support::{PATIENCE, Place, Running, lines, number, service};

/// SIGCONT, SIGSTOP; signal(7).
const CONTINUE: i32 = 18;
const STOP: i32 = 19;

/// How long drives is stopped each time: at least four deadlines pass.
const STOPPED: Duration = Duration::from_millis(5);

/// The drives of a pipeline that has played some of its job; `None` when it has ended.
fn drives(place: &Place, running: &mut Running, played: u64) -> Option<Peer> {
    let started = Instant::now();
    loop {
        if running.try_code().is_some() {
            return None;
        }
        if let Some(status) = place.status()
            && status["played"].as_u64() >= Some(played)
            && status["services"]["drives"].is_number()
        {
            return Some(service(&status, "drives"));
        }
        assert!(started.elapsed() < PATIENCE, "nothing is played");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Asserts that light fell only in cycles with a fresh command: none after a deadline at which drives
/// had none, and none in a cycle that it skipped.
fn assert_no_light_uncommanded(records: &[CycleRecord]) {
    for pair in records.windows(2) {
        let [begins, ends] = pair else { continue };
        let (before, after) = (&begins.feedback, &ends.feedback);
        if after.cycle.0 != before.cycle.0 + after.elapsed() {
            continue;
        }
        let cycle = before.cycle.0;
        if before.has(status::COMMAND_MISSED) {
            assert!(!after.laser.is_lit(), "lit in cycle {cycle}, without a command");
        }
        let beyond = |offset: u32| i64::from(offset) >= SETPOINT_PERIOD.0;
        let late = after.laser.edges().iter().filter(|edge| beyond(edge.offset));
        assert!(late.clone().all(|edge| edge.gate == 0), "lit in a cycle skipped after {cycle}");
        let goes_out = after.skipped == 0 || after.laser.last().0 == 0;
        assert!(goes_out, "lit through the cycles skipped after {cycle}");
    }
}

fn assert_told(summary: &Value, code: Option<i32>) {
    support::assert_valid("summary", summary);
    let stalls = &summary["stalls"];
    match code {
        Some(0) => {
            assert_eq!(summary["outcome"], "completed");
            if !summary["marks"].is_null() {
                assert!(number(summary, "/marks/missing") < 2e-4, "{summary:#}");
                assert!(number(summary, "/marks/double") < 2e-4, "{summary:#}");
            }
            assert!(stalls["count"].as_u64() >= Some(1), "{stalls}");
            assert!(number(summary, "/stalls/longest") >= 4e-3, "{stalls}");
            assert!(number(summary, "/stalls/longest") <= 50e-3, "{stalls}");
            let warnings = summary["warnings"].to_string();
            assert!(warnings.contains("the longest stall was"), "{warnings}");
        }
        // On a PC under load the fault may come before the job has started.
        Some(3 | 4) => {
            let outcome = if code == Some(3) { "faulted" } else { "aborted" };
            assert_eq!(summary["outcome"], outcome);
            let detail = summary["fault"]["detail"].as_str().unwrap_or_else(|| {
                panic!("no fault: {summary:#}");
            });
            assert!(detail.contains("ms") || detail.contains("light was lost"), "{detail}");
        }
        other => panic!("exit code {other:?}: {summary:#}"),
    }
}

#[test]
fn drives_stopped_for_a_moment_goes_on_in_the_dark_or_says_why_not() {
    for stall in ["50 ms", "2 ms"] {
        let place = Place::new();
        let job = place.file("lines.ngc", &lines(4));
        let setting = format!("machine.realtime.stall={stall}");
        let mut running = place.run(&job, "run", &["--strict", "--set", &setting]);
        for played in [100, 700, 1300] {
            let Some(drives) = drives(&place, &mut running, played) else { break };
            drives.signal(STOP).unwrap();
            std::thread::sleep(STOPPED);
            drives.signal(CONTINUE).unwrap();
        }
        let ended = running.wait();
        let summary: Value = serde_json::from_str(&ended.output).unwrap();
        assert_eq!(place.summary("run"), summary);
        assert_told(&summary, ended.code);
        if place.path("run").join("samples.mcap").exists() {
            assert_no_light_uncommanded(&place.recording("run"));
        }
        place.assert_nothing_left(&[]);
    }
}
