//! Jobs that wait: kept over a restart, moved, cancelled, repeated, and left to the pipeline by whoever submitted them.

#![allow(clippy::unwrap_used)]

mod support;

use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant};
use support::{KILL, PATIENCE, Place, Running, TERMINATE, assert_valid, lines, services};

/// A line that takes a minute and a half.
const LONG: &str = "G21 G90 G54\nM3 S800 F20\nG0 X-15 Y0\nG1 X15\nM5\nM2\n";

/// A pipeline that takes jobs, with services of its own.
struct Desk {
    place: Place,
    domain: Running,
}

impl Desk {
    fn new() -> Self {
        Self::in_place(Place::new())
    }

    fn in_place(place: Place) -> Self {
        let name = place.instance().name().to_owned();
        let mut domain =
            place.start(&["domain", "--services", "--no-realtime", "--instance", &name]);
        place.await_status(&mut domain, "services", |status| {
            status["services"].as_object().unwrap().values().all(Value::is_number)
        });
        Self { place, domain }
    }

    fn submit(&self, job: &Path, more: &[&str]) -> Running {
        let name = self.place.instance().name();
        let submit = ["submit", job.to_str().unwrap(), "--json", "--instance", name];
        self.place.start(&[&submit[..], more].concat())
    }

    /// Submits a job that nobody follows; its number.
    fn detach(&self, job: &Path) -> u64 {
        let submitted = self.submit(job, &["--detach"]).wait().json(0);
        assert_valid("submitted", &submitted);
        submitted["number"].as_u64().unwrap()
    }

    fn queue(&self, arguments: &[&str]) -> Value {
        let queue = self.place.ask(&[&["queue"], arguments, &["--json"]].concat()).json(0);
        assert_valid("queue", &queue);
        queue
    }

    /// The first list of jobs of which this holds.
    fn until(&self, what: &str, holds: impl Fn(&Value) -> bool) -> Value {
        let since = Instant::now();
        loop {
            let queue = self.queue(&["list"]);
            if holds(&queue) {
                return queue;
            }
            assert!(since.elapsed() < PATIENCE, "{what}: {queue:#}\n{}", self.domain.said());
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits until the job with this number is under way.
    fn await_running(&self, number: u64) {
        self.until("running", |queue| queue["running"]["number"] == number);
    }

    /// How the job with this number has ended.
    fn ended(&self, number: u64) -> Value {
        let queue = self.until("ended", |queue| !find(&queue["ended"], number).is_null());
        find(&queue["ended"], number)
    }

    fn end(self) -> Place {
        self.domain.signal(TERMINATE);
        assert_eq!(self.domain.wait().code, Some(0));
        self.place.assert_nothing_left(&[]);
        self.place
    }
}

fn find(jobs: &Value, number: u64) -> Value {
    let mut jobs = jobs.as_array().unwrap().iter();
    jobs.find(|job| job["number"] == number).cloned().unwrap_or_default()
}

fn numbers(jobs: &Value) -> Vec<u64> {
    jobs.as_array().unwrap().iter().map(|job| job["number"].as_u64().unwrap()).collect()
}

#[test]
fn a_pipeline_with_services_of_its_own_runs_what_is_submitted() {
    let desk = Desk::new();
    let job = desk.place.file("job.ngc", &lines(2));
    let summary = desk.submit(&job, &[]).wait().json(0);
    assert_eq!(summary["outcome"], "completed");
    let ended = desk.ended(1);
    assert_eq!((&ended["outcome"], &ended["message"]), (&json!("completed"), &Value::Null));
    assert_eq!(ended["out"], summary["out"]);
    let broken = desk.place.file("broken.ngc", "G21 G90 G54\nG1 X5 F600\nG77\nM2\n");
    let refused = desk.submit(&broken, &[]).wait().json(2);
    let ended = desk.ended(2);
    assert_eq!(ended["outcome"], "refused");
    let message = ended["message"].as_str().unwrap();
    assert!(message.contains(refused["error"]["message"].as_str().unwrap()), "{message}");
    let text = desk.place.ask(&["queue", "list"]).error;
    assert!(text.contains("1  completed") && text.contains("2  refused"), "{text}");
    desk.end();
}

#[test]
fn jobs_that_wait_survive_the_end_of_their_pipeline_and_begin_when_a_person_says_so() {
    let desk = Desk::new();
    let long = desk.place.file("long.ngc", LONG);
    let short = desk.place.file("short.ngc", &lines(1));
    assert_eq!(desk.detach(&long), 1);
    desk.await_running(1);
    assert_eq!([desk.detach(&short), desk.detach(&short), desk.detach(&short)], [2, 3, 4]);
    assert_eq!(numbers(&desk.queue(&["move", "4", "1"])["waiting"]), [4, 2, 3]);
    let refused = desk.place.ask(&["queue", "move", "2", "7"]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.error.contains("there is no place 7: 3 jobs wait"), "{}", refused.error);
    let queue = desk.queue(&["cancel", "2"]);
    assert_eq!(numbers(&queue["waiting"]), [4, 3]);
    assert_eq!(find(&queue["ended"], 2)["outcome"], "stopped");
    let refused = desk.place.ask(&["queue", "cancel", "2"]);
    assert!(refused.error.contains("job 2 has ended: stopped"), "{}", refused.error);

    let members = services(&desk.place.status().unwrap());
    desk.domain.signal(KILL);
    assert_eq!(desk.domain.wait().code, None);
    for member in members {
        assert!(member.ended_within(PATIENCE));
    }
    let desk = Desk::in_place(desk.place);
    let queue = desk.queue(&["list"]);
    assert_eq!(numbers(&queue["waiting"]), [4, 3]);
    assert_eq!((&queue["running"], numbers(&queue["ended"])), (&Value::Null, vec![2, 1]));
    assert_eq!(find(&queue["ended"], 1)["outcome"], "aborted");
    let why = queue["held"].as_str().unwrap();
    let cause = desk.place.status().unwrap()["cause"].clone();
    assert!(cause.as_str().unwrap().contains(why), "{cause}");
    assert!(desk.domain.said().contains("2 jobs wait"), "{}", desk.domain.said());

    let repeated = desk.place.ask(&["queue", "repeat", "2", "--json"]).json(0);
    assert_eq!(repeated["number"], 5);
    assert_eq!(numbers(&desk.queue(&["start"])["waiting"]).last(), Some(&5));
    for number in [4, 3, 5] {
        assert_eq!(desk.ended(number)["outcome"], "completed");
    }
    let outs = [4, 3, 5].map(|number| desk.ended(number)["out"].as_str().unwrap().to_owned());
    assert!(outs.iter().all(|out| Path::new(out).join("summary.json").exists()), "{outs:?}");
    assert!(outs[0] != outs[1] && outs[1] != outs[2], "{outs:?}");
    // It ended in order, and nothing waits: the next job begins at once.
    let place = desk.end();
    let desk = Desk::in_place(place);
    assert_eq!(desk.queue(&["list"])["held"], Value::Null);
    assert_eq!(desk.detach(&short), 6);
    assert_eq!(desk.ended(6)["outcome"], "completed");
    desk.end();
}

#[test]
fn what_a_held_queue_means_is_said_to_whoever_holds_it_and_whoever_submits() {
    let desk = Desk::new();
    let none = desk.place.ask(&["queue", "hold"]);
    assert!(none.error.contains("nothing is held"), "{}", none.error);
    let job = desk.place.file("long.ngc", LONG);
    let first = desk.detach(&job);
    desk.await_running(first);
    desk.detach(&job);
    let held = desk.place.ask(&["queue", "hold"]);
    assert!(!held.error.contains("nothing is held"), "{}", held.error);
    let told = desk.submit(&job, &["--detach"]).wait().json(0);
    assert_valid("submitted", &told);
    assert!(told["held"].as_str().unwrap().contains("a person holds the queue"), "{told:#}");
    let words = desk.place.ask(&["submit", job.to_str().unwrap(), "--detach"]);
    assert!(words.error.contains("the queue is held"), "{}", words.error);
    let repeated = desk.place.ask(&["queue", "repeat", &first.to_string(), "--json"]).json(0);
    assert!(repeated["held"].is_string(), "{repeated:#}");
    desk.end().assert_nothing_left(&[]);
}

#[test]
fn a_job_outlives_whoever_submitted_it() {
    let desk = Desk::new();
    // Long enough to be there still when it is looked at on a loaded computer.
    let job = desk.place.file("job.ngc", &lines(12));
    let follower = desk.submit(&job, &[]);
    desk.await_running(1);
    follower.signal(KILL);
    assert_eq!(follower.wait().code, None);
    let closed = desk.submit(&job, &[]);
    desk.until("a second job", |queue| {
        queue["running"]["number"] == 2 || !find(&queue["waiting"], 2).is_null()
    });
    closed.signal(support::HANGUP);
    let left = closed.wait();
    assert!(left.error.contains("job 2 goes on"), "{}", left.error);
    for number in [1, 2] {
        assert_eq!(desk.ended(number)["outcome"], "completed");
    }
    desk.end();
}

#[test]
fn a_stop_of_the_machine_holds_what_waits() {
    let desk = Desk::new();
    let job = desk.place.file("job.ngc", LONG);
    desk.detach(&job);
    desk.detach(&job);
    desk.await_running(1);
    desk.place.ask(&["stop"]).accepted();
    assert_eq!(desk.ended(1)["outcome"], "stopped");
    let queue = desk.queue(&["list"]);
    assert_eq!((&queue["running"], numbers(&queue["waiting"])), (&Value::Null, vec![2]));
    assert!(queue["held"].as_str().unwrap().contains("stopped"), "{queue}");
    desk.queue(&["start"]);
    desk.await_running(2);
    // The job under way is stopped as one that waits is taken back.
    desk.queue(&["cancel", "2"]);
    assert_eq!(desk.ended(2)["outcome"], "stopped");
    desk.end();
}

#[test]
fn a_job_that_is_withdrawn_while_it_is_planned_is_gone_at_once() {
    let desk = Desk::new();
    let long = desk.place.file("long.ngc", &support::slow_to_plan());
    let short = desk.place.file("short.ngc", &lines(1));
    desk.detach(&long);
    desk.detach(&short);
    desk.until("planning", |_| {
        desk.place.status().is_some_and(|status| status["cause"] == "planning")
    });
    desk.queue(&["cancel", "1"]);
    let withdrawn = desk.ended(1);
    assert_eq!((&withdrawn["outcome"], &withdrawn["message"]), (&json!("stopped"), &Value::Null));
    assert_eq!(desk.ended(2)["outcome"], "completed");
    desk.end();
}
