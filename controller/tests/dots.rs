//! Short light, and cycles that were lost while it was due: dots, and strokes of a few milliseconds, are
//! marked once wherever a stall falls, whatever the controller was about.

#![allow(clippy::unwrap_used)]

mod support;

use machine::Machine;
use messages::{ControllerState, OperatorVerb};
use support::{Bench, COARSE, Job, Move, Part, check_marks, job, reach, started_with};

const POWER: f64 = 0.5;

/// A row of short strokes on the run, dots between rests, and light where the stream begins and right
/// behind a pause.
fn dots(machine: &Machine) -> Job {
    let path = Move::new(0.04, 0.2, 10.0, 500.0);
    let (on, off) = path.cruise();
    // Of 1, 2.3, 3.6 … ms, 20 ms apart.
    let dashes = (0..)
        .map(|index| (on + 0.005 + 0.02 * f64::from(index), 0.001 + 0.0013 * f64::from(index)))
        .map(|(at, length)| (at, at + length))
        .take_while(|(_, to)| *to < off)
        .collect();
    let parts = [
        Part::Dot(0.0035),
        Part::Rest(0.03),
        Part::Dashes(path.clone(), [1.0, 0.3], dashes),
        Part::Rest(0.02),
        Part::Dot(0.002),
        Part::Rest(0.1),
        Part::Pause,
        Part::Rest(0.0034),
        Part::Dot(0.006),
        Part::Rest(0.02),
        Part::Mark(path, [-1.0, 0.5]),
        Part::Rest(0.05),
    ];
    job(machine, 1, &parts, POWER)
}

/// To the end, through the pause; all is marked once.
fn finish(bench: &mut Bench, job: &Job, case: &str) {
    for _ in 0..12 {
        if bench.reports.iter().any(|report| report.is_final == 1) {
            break;
        }
        if bench.state() == ControllerState::Holding {
            bench.ask(Some(job), OperatorVerb::Resume, 0.0);
        }
        bench.run(Some(job), 500);
    }
    bench.run(Some(job), 1);
    let fault = bench.last().command.fault;
    assert_eq!(bench.state(), ControllerState::Idle, "{case}: {fault:?}");
    check_marks(bench, job, POWER, case);
    let report = bench.reports.last().unwrap();
    assert_eq!((report.completed, report.fault.is_some()), (1, false), "{case}");
}

/// The lengths of stalls that are tried: up to the longest that is tolerated.
fn stalls(machine: &Machine) -> [u64; 4] {
    [1, 2, 4, machine.realtime.stalled_cycles() - 1]
}

#[test]
fn a_stall_while_braking_costs_no_short_light() {
    let machine = Machine::builtin();
    let job = dots(&machine);
    for cycles in stalls(&machine) {
        // All the way of a hold, which takes about 130 cycles, over dashes and over a dot.
        for held_at in [0.06, 0.09, 0.24, 0.26] {
            for delay in (0..140).step_by(4) {
                let case = format!("{cycles} cycles, {delay} after a hold at {held_at} s");
                let mut bench = started_with(&machine, &job, COARSE);
                reach(&mut bench, &job, held_at);
                assert!(bench.ask(Some(&job), OperatorVerb::Hold, 0.0));
                bench.run(Some(&job), delay);
                bench.stall(cycles);
                bench.run(Some(&job), 150);
                finish(&mut bench, &job, &case);
            }
        }
    }
}

#[test]
fn a_stall_on_the_way_back_for_light_costs_none() {
    let machine = Machine::builtin();
    let job = dots(&machine);
    for cycles in stalls(&machine) {
        // Held at the first dot, so that the way back ends at the stream's begin, and at a dash.
        for held_at in [0.002, 0.07] {
            for delay in (0..300).step_by(7) {
                let case = format!("{cycles} cycles, {delay} after a resume at {held_at} s");
                let mut bench = started_with(&machine, &job, COARSE);
                reach(&mut bench, &job, held_at);
                assert!(bench.ask(Some(&job), OperatorVerb::Hold, 0.0));
                bench.run(Some(&job), 160);
                assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0));
                bench.run(Some(&job), delay);
                bench.stall(cycles);
                bench.run(Some(&job), 1);
                finish(&mut bench, &job, &case);
            }
        }
    }
}

#[test]
fn a_stall_that_ends_where_the_stream_sets_off_costs_no_light() {
    let machine = Machine::builtin();
    let job = dots(&machine);
    for cycles in stalls(&machine) {
        for delay in 0..70 {
            let case = format!("{cycles} cycles, {delay} after the start");
            let mut bench = Bench::enabled_with(&machine, COARSE);
            assert!(bench.ask(Some(&job), OperatorVerb::Start, 1.0));
            bench.run(Some(&job), delay);
            bench.stall(cycles);
            bench.run(Some(&job), 1);
            finish(&mut bench, &job, &case);
        }
        for delay in 0..12 {
            let case = format!("{cycles} cycles, {delay} after the pause");
            let mut bench = started_with(&machine, &job, COARSE);
            bench.until(Some(&job), ControllerState::Holding, 1000);
            bench.run(Some(&job), 20);
            // A request that the stall delays, and one that it follows.
            if delay % 2 == 0 {
                bench.stall(cycles);
                assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0));
            } else {
                assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0));
                bench.run(Some(&job), delay / 2);
                bench.stall(cycles);
                bench.run(Some(&job), 1);
            }
            finish(&mut bench, &job, &case);
        }
    }
}

#[test]
fn a_stall_at_any_phase_of_short_light_costs_none() {
    let machine = Machine::builtin();
    let job = dots(&machine);
    let last = job.setpoints.len() - 60;
    for cycles in stalls(&machine) {
        for moment in (0..last).step_by(7) {
            // Every other one with a command that comes too late behind it.
            let late = u32::try_from(moment % 2).unwrap();
            let case = format!("{cycles} cycles, {late} late, {moment} after the start");
            let mut bench = started_with(&machine, &job, COARSE);
            bench.run(Some(&job), moment);
            bench.stall(cycles);
            bench.late = late;
            bench.run(Some(&job), 1);
            finish(&mut bench, &job, &case);
        }
    }
}
