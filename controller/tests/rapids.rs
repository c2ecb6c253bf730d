//! Rapids at a lower rate: the marks between them are as planned.

#![allow(clippy::unwrap_used)]

mod support;

use machine::Machine;
use messages::setpoint::flags;
use messages::{ControllerState, OperatorVerb};
use support::{Bench, Job, Move, Part, check_marks, job};

/// A mark, a rapid that lasts, a mark, a rapid that is too short to be slowed, a mark.
fn marks_and_rapids(machine: &Machine) -> Job {
    let mark = Move::new(0.02, 0.1, 2.0, 100.0);
    let long = Move::new(0.08, 0.1, 2.0, 100.0);
    let short = Move::new(0.0005, 0.02, 2.0, 200.0);
    let rapid = |path: &Move, shares| Part::Dashes(path.clone(), shares, Vec::new());
    let parts = [
        Part::Rest(0.02),
        Part::Mark(mark.clone(), [1.0, 0.6]),
        rapid(&long, [0.5, -0.5]),
        Part::Mark(mark.clone(), [-0.7, 1.0]),
        rapid(&short, [0.5, 0.5]),
        Part::Mark(mark, [-0.7, 0.4]),
        Part::Rest(0.05),
    ];
    let mut job = job(machine, 1, &parts, 0.5);
    let mut begin = 0.0;
    for part in &parts {
        let (duration, flies) = match part {
            Part::Rest(time) | Part::Dot(time) => (*time, false),
            Part::Mark(path, _) => (path.duration(), false),
            Part::Dashes(path, ..) => (path.duration(), true),
            Part::Pause => (0.0, false),
        };
        for setpoint in job.setpoints.iter_mut().filter(|_| flies) {
            let time = setpoint.sequence as f64 * 1e-3;
            if (begin..begin + duration).contains(&time) {
                setpoint.flags |= flags::RAPID;
            }
        }
        begin += duration;
    }
    job
}

/// Plays it with this override of rapids; cycles, and the least rate while it is played.
fn play(rapid: Option<f64>) -> (usize, f64) {
    let machine = Machine::builtin();
    let job = marks_and_rapids(&machine);
    let mut bench = Bench::enabled(&machine);
    if let Some(rapid) = rapid {
        assert!(bench.ask(None, OperatorVerb::Rapid, rapid));
        assert_eq!(bench.progress.unwrap().rapid_override, rapid);
    }
    assert!(bench.ask(Some(&job), OperatorVerb::Start, 1.0));
    // Until it has begun.
    bench.run(Some(&job), 100);
    bench.until(Some(&job), ControllerState::Idle, 12_000);
    check_marks(&bench, &job, 0.5, &format!("{rapid:?}"));
    let report = *bench.reports.last().unwrap();
    let uses = [report.path_acceleration_use, report.path_jerk_use, report.velocity_use[0]];
    assert!(uses.iter().all(|share| *share <= 1.0), "{uses:?} at {rapid:?}");
    let played: Vec<_> = bench.played().collect();
    let lit = played.iter().filter(|record| record.command.laser.is_lit());
    assert!(lit.clone().count() > 200);
    let slowest = lit.map(|record| record.command.rate).fold(1.0, f64::min);
    assert_eq!(slowest, 1.0, "marks are as fast as planned at {rapid:?}");
    // Before the first mark and after the last one the stream rests.
    let is_lit = |record: &&support::Record| record.command.laser.is_lit();
    let first = played.iter().position(is_lit).unwrap();
    let last = played.iter().rposition(is_lit).unwrap();
    let moving = &played[first..=last];
    let least = moving.iter().map(|record| record.command.rate).fold(1.0, f64::min);
    (played.len(), least)
}

#[test]
fn only_long_rapids_are_slower_and_marks_are_as_planned() {
    let (planned, even) = play(None);
    assert_eq!((play(Some(1.0)), even), ((planned, 1.0), 1.0));
    let mut before = planned;
    for rapid in [0.5, 0.25] {
        let (cycles, least) = play(Some(rapid));
        assert!((least - rapid).abs() < 1e-6, "{least} at {rapid}");
        assert!(cycles > before + 100, "{cycles} at {rapid}, {before} before");
        before = cycles;
    }
}

#[test]
fn an_override_of_rapids_is_a_share() {
    let mut bench = Bench::enabled(&Machine::builtin());
    for rapid in [0.0, 0.09, 1.01, f64::NAN] {
        assert!(!bench.ask(None, OperatorVerb::Rapid, rapid), "{rapid}");
    }
}
