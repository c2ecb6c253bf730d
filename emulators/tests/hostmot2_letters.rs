//! The letters on the emulated HostMot2 board, whole and in virtual time, with the machine files that ship: what
//! the encoders say of the marks, and what the board says of the light and the tool.

mod board;
mod job;

use board::{BoardCable, FLIGHT, shipped};
use emulators::hostmot2::{Emulator, Faults};
use machine::Machine;
use messages::Nanoseconds;
use messages::artwork::Artwork;
use messages::feedback::status;
use monitor::marks::{Marks, Source, StreamEnd};
use monitor::recording::CycleRecord;
use monitor::run_analysis::{Clock, RunAnalysis};
use planner::Plan;

/// How far a mark may be from its line, and its end from that of the stroke [m].
const ERROR: f64 = 20e-6;

/// What a job on the board came to.
type Played = job::Played<Emulator>;

fn play(machine: &Machine, plan: &Plan) -> Played {
    let bench = board::open(machine.clone(), &Faults::default()).expect("an open port");
    let played = job::play(bench, plan, None);
    assert_eq!((played.report.completed, played.report.fault.is_some()), (1, false));
    played
}

/// The marks as the summary of a run tells them: the board knows nothing of the tool.
fn judged(played: &Played, machine: &Machine, plan: &Plan) -> Marks {
    let analysis = RunAnalysis::new(&plan.artwork, Clock::Virtual, machine.realtime.period);
    let mut analysis = analysis.with_fastest(plan.facts.speed).with_machine(machine);
    for record in &played.records {
        let mut seen = CycleRecord { ..*record };
        seen.feedback.status &= !status::TOOL_KNOWN;
        seen.feedback.tool = [0.0; 3];
        analysis.push(&seen);
    }
    let results = analysis.finish(StreamEnd::Reported(&played.report));
    let evaluation = results.marks.expect("judged marks");
    assert_eq!(evaluation.unknown, 0);
    evaluation.marks
}

fn assert_marked(marks: &Marks) {
    assert_eq!(marks.source, Source::Encoders);
    assert_eq!((marks.strokes_lost, marks.stray), (0, 0.0));
    let all = [marks.error_max, marks.missing_end_max, marks.double_end_max];
    assert!(all.iter().all(|error| *error <= ERROR), "{marks:#?}");
}

/// Asserts that the commands of the job mean the same as on the simulated machine of the same latencies: nothing is closed
/// around what was measured.
fn assert_simulated(played: &Played, machine: &Machine, plan: &Plan) {
    let simulated = job::simulate(machine, plan);
    assert_eq!(simulated.report.completed, 1, "{:?}", simulated.report.fault);
    for targets in [false, true] {
        let [own, other] = [&played.records, &simulated.records];
        assert_eq!(job::digest(own, targets), job::digest(other, targets), "targets: {targets}");
    }
}

/// How far the true marks are off [m], by the board alone and the delays of the laser.
fn truth(played: &Played, machine: &Machine, artwork: &Artwork) -> f64 {
    let later = [machine.laser.on_delay, machine.laser.off_delay].map(Nanoseconds::from_seconds);
    let lit = played.cable.lit().into_iter();
    let lit: Vec<[i64; 2]> = lit.map(|[from, to]| [from + later[0].0, to + later[1].0]).collect();
    job::error(&lit, artwork, |at| {
        let find = |emulator: &mut Emulator, _| {
            emulator.board().record().tool_at(Nanoseconds(at)).expect("a tool")
        };
        played.cable.with(find)
    })
}

#[test]
fn steppers_mark_the_letters() {
    let machine = shipped("hostmot2_steppers", &[]);
    let plan = job::letters(&machine);
    let played = play(&machine, &plan);
    assert_marked(&judged(&played, &machine, &plan));
    let truth = truth(&played, &machine, &plan.artwork);
    assert!(truth <= ERROR, "{truth} m by the board");

    let later = FLIGHT.0 + machine.drives.gate_latency.0;
    let (lit, asked) = (played.cable.lit(), job::asked(&played.records, &machine, later));
    assert_eq!(lit.len(), asked.len());
    let most = played.resolution / 2;
    for (lit, asked) in lit.iter().flatten().zip(asked.iter().flatten()) {
        assert!((lit - asked).abs() <= most, "an edge at {lit} ns instead of {asked}");
    }
    assert_simulated(&played, &machine, &plan);

    let link = played.drives.link;
    assert_eq!((link.lost, link.late, link.duplicated, link.corrupted), (0, 0, 0, 0));
    assert!(link.sent > played.report.cycles && played.cable.bites().is_empty());
}

#[test]
fn a_scan_head_marks_the_letters() {
    let machine = shipped("hostmot2_galvo", &[]);
    let plan = job::letters(&machine);
    let played = play(&machine, &plan);
    assert_marked(&judged(&played, &machine, &plan));
    let truth = truth(&played, &machine, &plan.artwork);
    assert!(truth <= ERROR, "{truth} m by the board");
    assert_simulated(&played, &machine, &plan);
}

#[test]
fn four_cycles_in_a_millisecond_are_no_less_accurate_than_one() {
    let errors = |settings: &[&str]| {
        let machine = shipped("hostmot2_steppers", settings);
        let plan = job::letters(&machine);
        let played = play(&machine, &plan);
        assert_marked(&judged(&played, &machine, &plan));
        truth(&played, &machine, &plan.artwork)
    };
    let slow = errors(&[]);
    let fast = errors(&[
        "realtime.period=\"250 us\"",
        "drives.hostmot2.latency=\"100 us\"",
        "drives.hostmot2.gate_latency=\"100 us\"",
    ]);
    assert!(fast <= slow, "{fast} m at 4 kHz, {slow} m at 1 kHz");
}
