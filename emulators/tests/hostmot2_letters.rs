//! The letters on the emulated HostMot2 board, whole and in virtual time, with the machine files that ship: what
//! the encoders say of the marks, and what the board says of the light and the tool.

mod board;

use board::job::{Played, play};
use emulators::hostmot2::Faults;
use machine::{Machine, Override};
use messages::artwork::{Artwork, Stroke, distance};
use messages::{LaserCycle, Nanoseconds};
use monitor::marks::{Marks, Source};
use planner::Plan;
use planner::job::Job;

/// How far a mark may be from its line, and its end from that of the stroke [m].
const ERROR: f64 = 20e-6;

/// A machine that ships, with these settings.
fn machine(name: &str, settings: &[&str]) -> Machine {
    let path = format!("{}/../machines/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let settings: Result<Vec<Override>, _> = settings.iter().map(|it| it.parse()).collect();
    Machine::load(path.as_ref(), &settings.expect("settings")).expect("the machine")
}

fn letters(machine: &Machine) -> Plan {
    let job = Job::builtin(&[], machine).expect("the letters");
    planner::plan(machine, &job).expect("a plan")
}

/// The marks as the summary of a run tells them.
fn judged(played: &Played) -> Marks {
    assert_eq!((played.report.completed, played.report.fault.is_some()), (1, false));
    let evaluation = played.results.marks.as_ref().expect("judged marks");
    assert_eq!(evaluation.unknown, 0);
    evaluation.marks.clone()
}

fn assert_marked(marks: &Marks) {
    assert_eq!(marks.source, Source::Encoders);
    assert_eq!((marks.strokes_lost, marks.stray), (0, 0.0));
    let all = [marks.error_max, marks.missing_end_max, marks.double_end_max];
    assert!(all.iter().all(|error| *error <= ERROR), "{marks:#?}");
}

/// The times with light that `laser` asks for in a cycle of `period`, from its beginning.
fn spans(laser: &LaserCycle, period: Nanoseconds) -> Vec<[i64; 2]> {
    let (mut spans, mut since, mut gate) = (Vec::new(), 0, laser.gate);
    let edges = laser.edges().iter().map(|edge| (i64::from(edge.offset), edge.gate));
    for (offset, next) in edges.chain([(period.0, 0)]) {
        if gate != 0 && offset > since {
            spans.push([since, offset]);
        }
        (since, gate) = (offset, next);
    }
    spans
}

/// The light that was asked for, by the clock of the cable; what goes on through the end of a cycle is one.
fn asked(played: &Played, machine: &Machine) -> Vec<[i64; 2]> {
    let period = machine.realtime.period.time();
    let later = board::FLIGHT.0 + machine.drives.gate_latency.0;
    let mut asked: Vec<[i64; 2]> = Vec::new();
    for record in &played.records {
        // It acts in the cycle after the one that it answers.
        let start = record.feedback.deadline.0 + period.0 + later;
        for span in spans(&record.command.laser, period) {
            let span = span.map(|at| start + at);
            match asked.last_mut() {
                Some(last) if last[1] == span[0] => last[1] = span[1],
                _ => asked.push(span),
            }
        }
    }
    asked
}

fn to_line(stroke: &Stroke, place: &[f64; 3]) -> f64 {
    let parts = stroke.points.windows(2).map(|ends| {
        let [from, to] = [&ends[0], &ends[1]];
        let (mut along, mut square) = (0.0, 0.0);
        for axis in 0..3 {
            along += (place[axis] - from[axis]) * (to[axis] - from[axis]);
            square += (to[axis] - from[axis]) * (to[axis] - from[axis]);
        }
        let part = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
        let foot = core::array::from_fn(|axis| from[axis] + part * (to[axis] - from[axis]));
        distance(place, &foot)
    });
    parts.fold(f64::MAX, f64::min)
}

/// The largest distance of the true tool from the stroke while the true light is on, and of either end of the
/// light from the end of its stroke [m]. By the board alone, and the delays of the laser.
fn truth(played: &Played, machine: &Machine, artwork: &Artwork) -> f64 {
    let later = [machine.laser.on_delay, machine.laser.off_delay].map(Nanoseconds::from_seconds);
    let lit = played.cable.lit().into_iter();
    let lit: Vec<[i64; 2]> = lit.map(|[from, to]| [from + later[0].0, to + later[1].0]).collect();
    assert_eq!(lit.len(), artwork.strokes.len());
    let tool = |at: i64| {
        let find = |world: &mut board::World| {
            world.emulator.board().record().tool_at(Nanoseconds(at)).expect("a tool")
        };
        played.cable.with(find)
    };
    let mut worst = 0.0_f64;
    for ([from, to], stroke) in lit.iter().zip(&artwork.strokes) {
        for part in 0..=2000 {
            worst = worst.max(to_line(stroke, &tool(from + (to - from) * part / 2000)));
        }
        for (at, end) in [(from, stroke.points.first()), (to, stroke.points.last())] {
            worst = worst.max(distance(&tool(*at), end.expect("a point")));
        }
    }
    worst
}

#[test]
fn steppers_mark_the_letters() {
    let machine = machine("hostmot2_steppers", &[]);
    let plan = letters(&machine);
    let played = play(&machine, &plan, &Faults::default());
    assert_marked(&judged(&played));
    let truth = truth(&played, &machine, &plan.artwork);
    assert!(truth <= ERROR, "{truth} m by the board");

    let (lit, asked) = (played.cable.lit(), asked(&played, &machine));
    assert_eq!(lit.len(), asked.len());
    let most = played.resolution.0 / 2;
    for (lit, asked) in lit.iter().flatten().zip(asked.iter().flatten()) {
        assert!((lit - asked).abs() <= most, "an edge at {lit} ns instead of {asked}");
    }
    let link = played.drives.link;
    assert_eq!((link.lost, link.late, link.duplicated, link.corrupted), (0, 0, 0, 0));
    assert!(link.sent > played.report.cycles && played.cable.bites().is_empty());
}

#[test]
fn a_scan_head_marks_the_letters() {
    let machine = machine("hostmot2_galvo", &[]);
    let plan = letters(&machine);
    let played = play(&machine, &plan, &Faults::default());
    assert_marked(&judged(&played));
    let truth = truth(&played, &machine, &plan.artwork);
    assert!(truth <= ERROR, "{truth} m by the board");
}

#[test]
fn four_cycles_in_a_millisecond_are_no_less_accurate_than_one() {
    let errors = |settings: &[&str]| {
        let machine = machine("hostmot2_steppers", settings);
        let plan = letters(&machine);
        let played = play(&machine, &plan, &Faults::default());
        assert_marked(&judged(&played));
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
