//! The service in a domain of its own, with the test as the supervisor and the controller.

#![allow(clippy::unwrap_used)]

use super::{Service, Work};
use crate::request::{JobRequest, Refusal};
use machine::Machine;
use messages::artwork::Artwork;
use messages::setpoint::flags;
use messages::{
    AxisArray, ControllerState, JobOffer, Nanoseconds, PlannerPhase, PlannerReport, Progress,
    Setpoint, axis::axis_array, run_folder,
};
use runtime::{Domain, Instance, Publisher, Role, Samples, Subscriber};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// How long a plan may take before a test gives up.
const PATIENCE: Duration = Duration::from_secs(60);

struct Bench {
    service: Service,
    offers: Publisher<JobOffer>,
    progress: Publisher<Progress>,
    setpoints: Subscriber<Setpoint>,
    folder: tempfile::TempDir,
    said: Progress,
    // Last, so that all else has let go of the domain.
    _planner: Domain,
    _holder: Domain,
}

impl Bench {
    /// A planner that has heard a controller at rest at home.
    fn new() -> Self {
        let mut bench = Self::silent();
        bench.say(|_| ());
        bench
    }

    /// A planner that has heard nothing yet.
    fn silent() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!("planner-test-{}-{number}", std::process::id());
        let instance = Instance::new(&name).unwrap();
        let holder = Domain::create(&instance).unwrap();
        let planner = Domain::join(&instance, Role::Planner).unwrap();
        let service = Service::open(&planner, &Machine::builtin()).unwrap();
        Self {
            service,
            offers: holder.publisher().unwrap(),
            progress: holder.publisher().unwrap(),
            setpoints: holder.subscriber(Samples::All).unwrap(),
            folder: tempfile::tempdir().unwrap(),
            said: Progress {
                published: Nanoseconds(1),
                state: ControllerState::Idle as u32,
                position: at(0.1, 0.1),
                ..Progress::default()
            },
            _planner: planner,
            _holder: holder,
        }
    }

    fn say(&mut self, change: impl FnOnce(&mut Progress)) {
        change(&mut self.said);
        assert!(self.progress.publish(&self.said).unwrap());
    }

    /// Offers the built-in job with settings, small enough to be planned at once.
    fn offer(&mut self, stream: u64, set: &[&str]) {
        let set = set.iter().map(ToString::to_string).collect();
        let request = JobRequest { job: None, set, offsets: None, confined: false };
        let path = self.folder.path().join(run_folder::REQUEST);
        std::fs::write(path, serde_json::to_vec(&request).unwrap()).unwrap();
        let folder = self.folder.path().to_str().unwrap();
        self.offers.publish(&JobOffer::new(stream, folder).unwrap()).unwrap();
    }

    fn withdraw(&mut self, stream: u64) {
        self.offers.publish(&JobOffer { stream, ..JobOffer::default() }).unwrap();
    }

    fn phase(&self) -> PlannerPhase {
        PlannerPhase::from_wire(self.service.report.phase)
    }

    fn turn_until(&mut self, phase: PlannerPhase) {
        let started = Instant::now();
        while self.phase() != phase {
            assert!(started.elapsed() < PATIENCE, "{:?} instead of {phase:?}", self.phase());
            self.service.turn().unwrap();
        }
    }

    /// Offers the G-code program `text`.
    fn offer_program(&mut self, stream: u64, text: &str) -> PathBuf {
        let program = self.folder.path().join("program.nc");
        std::fs::write(&program, text).unwrap();
        let request = JobRequest {
            job: Some(program.clone()),
            set: Vec::new(),
            offsets: None,
            confined: false,
        };
        let path = self.folder.path().join(run_folder::REQUEST);
        std::fs::write(path, serde_json::to_vec(&request).unwrap()).unwrap();
        let folder = self.folder.path().to_str().unwrap();
        self.offers.publish(&JobOffer::new(stream, folder).unwrap()).unwrap();
        program
    }

    /// Takes all that is still to come, 300 at most at a time.
    fn send_rest(&mut self, all: &mut Vec<Setpoint>) {
        let started = Instant::now();
        while self.phase() == PlannerPhase::Streaming {
            assert!(started.elapsed() < PATIENCE, "{} came", all.len());
            let accepted = all.len() as u64;
            self.say(|progress| (progress.accepted, progress.room) = (accepted, 300));
            for _ in 0..20 {
                self.service.turn().unwrap();
                all.extend(self.arrived());
            }
            let new = all.len() as u64 - accepted;
            assert!(new <= 300, "{new}");
        }
        assert_eq!(self.phase(), PlannerPhase::Sent);
    }

    fn arrived(&mut self) -> Vec<Setpoint> {
        std::iter::from_fn(|| self.setpoints.receive().unwrap()).collect()
    }

    /// Turns until `count` setpoints came, or far more turns than that needs have passed.
    fn collect(&mut self, count: usize) -> Vec<Setpoint> {
        let mut all = Vec::new();
        for _ in 0..2000 {
            self.service.turn().unwrap();
            all.extend(self.arrived());
            if all.len() >= count {
                break;
            }
            std::thread::sleep(Duration::from_micros(100));
        }
        all
    }
}

/// Belt travels of the built-in machine with its tool at x and y [m].
fn at(x: f64, y: f64) -> AxisArray {
    axis_array(&[x + y, x - y])
}

const SMALL: [&str; 2] = ["letters.text=S", "letters.height=2 mm"];

#[test]
fn a_stream_waits_for_its_name_and_never_exceeds_its_credit() {
    let mut bench = Bench::new();
    bench.offer(1, &SMALL);
    bench.turn_until(PlannerPhase::Streaming);
    assert!(bench.folder.path().join(run_folder::ARTWORK).exists());
    assert!(bench.folder.path().join(run_folder::PLAN).exists());
    assert_eq!(bench.collect(1), [], "nothing goes out before the controller names the stream");

    bench.say(|progress| (progress.stream, progress.room) = (1, 10));
    let mut all = bench.collect(10);
    assert_eq!(all.len(), 10, "room for ten");
    // Six of them taken, room for five more: four are still under way, so one may follow.
    bench.say(|progress| (progress.accepted, progress.room) = (6, 5));
    all.extend(bench.collect(2));
    assert_eq!(all.len(), 11);
    // All taken, and room again.
    bench.send_rest(&mut all);
    assert_eq!(bench.service.report.samples, all.len() as u64);
    assert!(all.iter().enumerate().all(|(index, setpoint)| {
        setpoint.stream == 1 && setpoint.sequence == index as u64 && setpoint.published.0 > 0
    }));
    assert!(all.last().unwrap().has(flags::LAST));
}

#[test]
fn a_job_begins_where_the_axes_rest() {
    let mut bench = Bench::new();
    bench.say(|progress| {
        progress.state = ControllerState::Stopping as u32;
        progress.position = at(0.07, 0.12);
    });
    bench.offer(4, &SMALL);
    bench.collect(1);
    assert!(matches!(bench.service.work, Work::Waiting(_)), "the axes still move");
    // A stopped job has left the axes here, and its stream is over.
    bench.say(|progress| {
        progress.state = ControllerState::Idle as u32;
        progress.position = at(0.06, 0.13);
        progress.finished_stream = 3;
    });
    bench.turn_until(PlannerPhase::Streaming);
    bench.say(|progress| (progress.stream, progress.room) = (4, 100));
    let first = bench.collect(100)[0];
    assert!((first.tool[0] - 0.06).abs() < 1e-12 && (first.tool[1] - 0.13).abs() < 1e-12);
    assert_eq!((first.sequence, first.path_velocity), (0, 0.0));
}

/// A planner that was started again is offered the newest job anew, be it long over.
#[test]
fn a_job_that_is_over_is_not_planned_again() {
    for concluded in [false, true] {
        let mut bench = Bench::silent();
        if concluded {
            // Refused or given up before it began: the controller never heard of it.
            std::fs::write(bench.folder.path().join(run_folder::SUMMARY), "{}").unwrap();
        }
        bench.offer(3, &SMALL);
        bench.collect(1);
        bench.say(|progress| progress.finished_stream = if concluded { 2 } else { 3 });
        bench.collect(1);
        assert!(matches!(bench.service.work, Work::Idle), "{concluded}");
        assert!(!bench.folder.path().join(run_folder::ARTWORK).exists());
    }
}

#[test]
fn encoder_rounding_at_the_edge_of_the_area_refuses_no_job() {
    let mut bench = Bench::new();
    let count = 1e-6;
    bench.say(|progress| progress.position = at(-count, 0.05));
    bench.offer(1, &SMALL);
    bench.turn_until(PlannerPhase::Streaming);
    bench.say(|progress| (progress.stream, progress.room) = (1, 10));
    assert_eq!(bench.collect(10)[0].tool[0], 0.0);
}

#[test]
fn rounding_where_the_drawing_begins_needs_no_move_of_its_own() {
    let mut bench = Bench::new();
    bench.say(|progress| progress.position = at(0.1 + 1e-6, 0.1));
    bench.offer(1, &SMALL);
    bench.turn_until(PlannerPhase::Streaming);
    bench.say(|progress| (progress.stream, progress.room) = (1, 10));
    assert_eq!(bench.collect(10)[0].tool, [0.1, 0.1, 0.0]);
}

#[test]
fn a_withdrawn_job_ends_in_every_phase() {
    let mut bench = Bench::new();
    bench.offer(1, &SMALL);
    bench.service.turn().unwrap();
    bench.withdraw(1);
    bench.turn_until(PlannerPhase::Idle);
    bench.say(|progress| (progress.stream, progress.room) = (1, 100));
    assert_eq!(bench.collect(1), []);

    bench.say(|progress| *progress = Progress { stream: 0, finished_stream: 1, ..*progress });
    bench.offer(2, &SMALL);
    bench.turn_until(PlannerPhase::Streaming);
    bench.say(|progress| (progress.stream, progress.room) = (2, 20));
    assert_eq!(bench.collect(20).len(), 20);
    // The withdrawal of another stream is none of this one.
    bench.withdraw(1);
    bench.say(|progress| (progress.accepted, progress.room) = (20, 20));
    assert_eq!(bench.collect(20).len(), 20);
    bench.withdraw(2);
    bench.turn_until(PlannerPhase::Idle);
    bench.say(|progress| (progress.accepted, progress.room) = (40, 20));
    assert_eq!(bench.collect(1), []);
}

#[test]
fn a_new_offer_replaces_the_job_that_is_planned_or_sent() {
    let mut bench = Bench::new();
    bench.offer(1, &SMALL);
    bench.service.turn().unwrap();
    bench.offer(2, &SMALL);
    bench.service.turn().unwrap();
    bench.turn_until(PlannerPhase::Streaming);
    assert_eq!(bench.service.report.stream, 2);
    bench.say(|progress| (progress.stream, progress.room) = (2, 50));
    assert_eq!(bench.collect(50).len(), 50);
    bench.offer(3, &SMALL);
    bench.service.turn().unwrap();
    bench.turn_until(PlannerPhase::Streaming);
    assert_eq!(bench.collect(1), [], "stream 2 has ended with its offer");
    bench.say(|progress| (progress.stream, progress.accepted, progress.room) = (3, 0, 50));
    let new = bench.collect(50);
    assert!(
        new.iter()
            .enumerate()
            .all(|(index, setpoint)| { (setpoint.stream, setpoint.sequence) == (3, index as u64) })
    );
    assert_eq!(new.len(), 50);
}

#[test]
fn a_stream_that_the_controller_is_done_with_is_let_go() {
    let mut bench = Bench::new();
    bench.offer(1, &SMALL);
    bench.turn_until(PlannerPhase::Streaming);
    bench.say(|progress| (progress.stream, progress.room) = (1, 20));
    bench.collect(20);
    bench.say(|progress| (progress.stream, progress.finished_stream) = (0, 1));
    bench.turn_until(PlannerPhase::Idle);
    assert!(matches!(bench.service.work, Work::Idle));
    // Its offer heard again, as by a planner that was restarted, plans nothing.
    bench.offer(1, &SMALL);
    bench.service.turn().unwrap();
    assert_eq!(bench.phase(), PlannerPhase::Idle);
}

#[test]
fn a_planner_restarted_in_the_middle_of_a_stream_sends_none_of_it() {
    let mut bench = Bench::new();
    bench.say(|progress| {
        progress.state = ControllerState::Running as u32;
        (progress.stream, progress.accepted, progress.room) = (1, 500, 100);
    });
    bench.offer(1, &SMALL);
    assert_eq!(bench.collect(1), []);
    assert_eq!(bench.phase(), PlannerPhase::Idle);
}

/// Rounds of a circle of 30 mm in chords of 0.3 mm, 50 mm/s.
fn rounds(count: usize) -> String {
    rounds_in("M4", count, 628)
}

/// Rounds of it in so many chords each.
fn rounds_in(policy: &str, count: usize, chords: usize) -> String {
    let mut text = format!("G21 G90\n{policy} S500\nG0 X30 Y0\nG1 F3000\n");
    for index in 1..=count * chords {
        let angle = messages::math::TURN * index as f64 / chords as f64;
        let (sine, cosine) = messages::math::sin_cos(angle);
        text.push_str(&format!("X{:.3} Y{:.3}\n", 30.0 * cosine, 30.0 * sine));
    }
    text
}

#[test]
fn a_long_job_is_sent_while_it_is_planned() {
    let mut bench = Bench::new();
    bench.offer_program(1, &rounds(40));
    bench.turn_until(PlannerPhase::Streaming);
    bench.say(|progress| (progress.stream, progress.room) = (1, 300));
    let mut all = bench.collect(300);
    assert_eq!(all.len(), 300);
    let PlannerReport { is_complete, samples, estimate, .. } = bench.service.report;
    assert_eq!(is_complete, 0, "{samples} setpoints planned");
    bench.send_rest(&mut all);
    let whole = all.len() as f64 * 1e-3;
    assert!((estimate - whole).abs() < 0.02 * whole, "{estimate} s estimated of {whole} s");
    assert!(all.iter().enumerate().all(|(index, it)| it.sequence == index as u64));
    assert!(all.last().unwrap().has(flags::LAST));
    // All of it is one line, never stopped on.
    let text = std::fs::read_to_string(bench.folder.path().join(run_folder::ARTWORK)).unwrap();
    let mut artwork = Artwork::default();
    text.lines().for_each(|line| artwork.add(serde_json::from_str(line).unwrap()));
    assert_eq!(artwork.strokes.len(), 1);
    let length = 40.0 * 0.03 * messages::math::TURN;
    assert!((artwork.length() - length).abs() < 1e-3 * length, "{}", artwork.length());
    let lit: Vec<&Setpoint> = all.iter().filter(|it| it.laser.is_lit()).collect();
    let slow = lit.iter().filter(|it| it.path_velocity < 0.0499).count();
    assert!(slow < 50, "{slow} samples below the speed of {}", lit.len());
}

#[test]
fn what_is_not_sent_yet_is_planned_anew_when_it_shall_be_faster() {
    for policy in ["M3", "M4"] {
        plans_anew_at_other_rates(&rounds_in(policy, 30, 628));
        // In parts, of which the next is put behind the one before at any rate.
        plans_anew_at_other_rates(&rounds_in(policy, 30, 4_000));
    }
}

fn plans_anew_at_other_rates(program: &str) {
    let mut bench = Bench::new();
    bench.offer_program(1, program);
    bench.turn_until(PlannerPhase::Streaming);
    bench.say(|progress| (progress.stream, progress.room) = (1, 300));
    let mut all = bench.collect(300);
    let speeds = |all: &[Setpoint]| {
        let lit = all.iter().filter(|it| it.laser.is_lit());
        lit.map(|it| it.path_velocity)
            .fold((f64::INFINITY, 0.0), |(least, most), speed| (speed.min(least), speed.max(most)))
    };
    for (rate, speed) in [(1.0, 0.05), (2.0, 0.1), (1.2, 0.06), (0.5, 0.05)] {
        bench.say(|progress| progress.override_rate = rate);
        let from = all.len() + 9_000;
        while all.len() < from + 1_000 {
            let accepted = all.len() as u64;
            bench.say(|progress| (progress.accepted, progress.room) = (accepted, 300));
            all.extend(bench.collect(300));
            assert_eq!(bench.phase(), PlannerPhase::Streaming);
        }
        let (least, most) = speeds(&all[from..]);
        assert!(least >= 0.99 * speed && most <= 1.001 * speed, "{least} to {most} m/s at {rate}");
    }
    bench.send_rest(&mut all);
    assert!(all.iter().enumerate().all(|(index, it)| it.sequence == index as u64));
    assert!(speeds(&all).1 <= 0.1001);
    let limits = Machine::builtin().path;
    let jumps = all.windows(4).map(|it| {
        let third = |row: usize| {
            (it[3].tool[row] - 3.0 * it[2].tool[row] + 3.0 * it[1].tool[row] - it[0].tool[row])
                * 1e9
        };
        messages::math::hypot(third(0), third(1))
    });
    assert!(jumps.fold(0.0, f64::max) <= 1.01 * limits.jerk);
    let text = std::fs::read_to_string(bench.folder.path().join(run_folder::ARTWORK)).unwrap();
    let mut artwork = Artwork::default();
    text.lines().for_each(|line| artwork.add(serde_json::from_str(line).unwrap()));
    assert_eq!(artwork.strokes.len(), 1, "nothing is drawn twice");
    let length = 30.0 * 0.03 * messages::math::TURN;
    assert!((artwork.length() - length).abs() < 1e-3 * length, "{}", artwork.length());
}

#[test]
fn a_long_job_is_withdrawn_while_it_is_planned() {
    let mut bench = Bench::new();
    bench.offer_program(1, &rounds(40));
    bench.turn_until(PlannerPhase::Streaming);
    assert_eq!(bench.service.report.is_complete, 0);
    bench.withdraw(1);
    bench.service.turn().unwrap();
    assert_eq!(bench.phase(), PlannerPhase::Idle);
}

#[test]
fn a_place_out_of_reach_far_down_refuses_all_of_a_long_job() {
    let mut bench = Bench::new();
    bench.offer_program(1, &(rounds(40) + "X900 Y100\n"));
    bench.say(|progress| (progress.stream, progress.room) = (1, 300));
    bench.turn_until(PlannerPhase::Refused);
    assert_eq!(bench.arrived(), []);
    let text = std::fs::read(bench.folder.path().join(run_folder::REFUSAL)).unwrap();
    let refusal: Refusal = serde_json::from_slice(&text).unwrap();
    assert_eq!(refusal.line, Some(40 * 628 + 5), "{}", refusal.message);
}

#[test]
fn a_refusal_is_written_or_at_least_reported() {
    let mut bench = Bench::new();
    bench.offer(1, &["letters.text=S", "letters.height=400 mm"]);
    bench.turn_until(PlannerPhase::Refused);
    let text = std::fs::read(bench.folder.path().join(run_folder::REFUSAL)).unwrap();
    let refusal: Refusal = serde_json::from_slice(&text).unwrap();
    assert!(refusal.message.contains("make it smaller"), "{}", refusal.message);

    bench.offers.publish(&JobOffer::new(2, "/nowhere/at/all").unwrap()).unwrap();
    bench.service.turn().unwrap();
    bench.turn_until(PlannerPhase::Refused);
    assert_eq!(bench.service.report.stream, 2);
}
