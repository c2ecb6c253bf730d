//! Stalls of drives: cycles that nobody measured in and in which the axes went on by themselves. As
//! long as they are tolerated, no mark is lost or doubled and nothing jumps, whatever the controller
//! was about.

#![allow(clippy::unwrap_used)]

mod support;

use machine::Machine;
use messages::random::SplitMix64;
use messages::{ControllerState, FaultCode, FaultQuantity, Nanoseconds, OperatorVerb};
use support::{Bench, Job, check_marks, reach, stalling, started, two_marks};

/// Largest distance of the tool from the plan, with the laser on and off [m].
fn tracking(bench: &Bench) -> [f64; 2] {
    [true, false].map(|lit| {
        let records = bench.played().filter(|record| record.command.laser.is_lit() == lit);
        records.map(|record| record.tracking).fold(0.0, f64::max)
    })
}

/// To the end of the job, all of it marked once.
fn finish(bench: &mut Bench, job: &Job, case: &str) {
    bench.until(Some(job), ControllerState::Idle, 8000);
    check_marks(bench, job, 0.5, case);
    let report = bench.reports.last().unwrap();
    assert_eq!((report.completed, report.fault.is_some()), (1, false), "{case}");
    let [lit, dark] = tracking(bench);
    // Of what a stall left, each axis may have 5 µm to take back when the light comes on.
    assert!(lit < 15e-6, "{case}: {lit} m");
    assert!(dark < 500e-6, "{case}: {dark} m in the dark");
}

#[test]
fn a_tolerated_stall_at_any_phase_loses_no_mark_and_doubles_none() {
    let machine = Machine::builtin();
    let tolerated = machine.realtime.stalled_cycles();
    let job = two_marks(&machine, 0.25, 0.5);
    let (on, off) = job.lit[0];
    // Before the motion, in the run-in, at both ends of the mark and inside it, between the marks.
    let moments =
        [0.005, on - 0.03, on - 0.012, on - 0.003, on, on + 0.0007, on + 0.06, off - 0.004, off];
    for cycles in [1, 2, 3, tolerated / 2, tolerated - 1] {
        for moment in moments.into_iter().chain([off + 0.02, job.lit[1].0 - 0.001]) {
            for rate in [1.0, 0.37] {
                let case = format!("{cycles} cycles at {moment} s, rate {rate}");
                let mut bench = started(&machine, &job);
                assert!(bench.ask(Some(&job), OperatorVerb::Override, rate));
                reach(&mut bench, &job, moment);
                bench.stall(cycles);
                finish(&mut bench, &job, &case);
            }
        }
    }
}

#[test]
fn stalls_again_and_again_at_any_time_lose_nothing() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    for seed in 0..150 {
        let mut random = SplitMix64::new(seed);
        let mut bench = started(&machine, &job);
        let mut below = |bound: u64| random.bits() % bound;
        // Far enough apart that no place loses its light more often than is borne.
        for _ in 0..3 {
            bench.run(Some(&job), 350 + below(500) as usize);
            if bench.state() == ControllerState::Idle {
                break;
            }
            let held = below(4) == 0 && bench.state() == ControllerState::Running;
            if held {
                assert!(bench.ask(Some(&job), OperatorVerb::Hold, 0.0));
                bench.run(Some(&job), below(300) as usize);
            }
            bench.stall(below(machine.realtime.stalled_cycles()));
            if held {
                bench.run(Some(&job), 300);
                assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0));
            }
        }
        finish(&mut bench, &job, &format!("seed {seed}"));
    }
}

#[test]
fn stream_time_goes_on_with_the_time_and_no_reference_jumps() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = started(&machine, &job);
    // In the dark, far from any light, at the largest acceleration.
    reach(&mut bench, &job, job.lit[0].1 + 0.02);
    let before = bench.last().command;
    bench.stall(8);
    bench.run(Some(&job), 1);
    let after = bench.last().command;
    assert!((after.stream_time - before.stream_time - 9e-3).abs() < 1e-9);
    // No faster than the plan's speed at the path's limit of 0.25 m/s.
    for (index, actuator) in machine.actuators.iter().enumerate() {
        let moved = (after.reference[index] - before.reference[index]) * actuator.ratio;
        assert!(moved.abs() <= 0.36 * 9e-3, "axis {index} moved by {moved} m");
    }
    finish(&mut bench, &job, "in the dark");
}

#[test]
fn standing_axes_bear_a_stall_unmoved() {
    let machine = Machine::builtin();
    let mut bench = Bench::enabled(&machine);
    for _ in 0..20 {
        bench.stall(machine.realtime.stalled_cycles() - 1);
        bench.run(None, 5);
        assert_eq!(bench.state(), ControllerState::Idle);
    }
    let error = bench.last().command.following_error;
    let count = machine.actuators[0].encoder.resolution();
    assert!(error.iter().all(|error| error.abs() <= 1.01 * count), "{error:?}");
}

#[test]
fn the_machine_file_says_how_many_feedbacks_may_be_missing() {
    for milliseconds in [1, 2, 5, 20] {
        let machine = stalling(Nanoseconds(milliseconds * 1_000_000));
        let job = two_marks(&machine, 0.25, 0.5);
        for (skipped, borne) in [(milliseconds as u64, true), (milliseconds as u64 + 1, false)] {
            let mut bench = started(&machine, &job);
            bench.run(Some(&job), 60);
            // The controller was away: drives went on alone, and counts the same.
            bench.skip(skipped);
            bench.run(Some(&job), 1);
            let fault = bench.last().command.fault;
            assert_eq!(fault.is_some(), !borne, "{milliseconds} ms, {skipped}: {fault:?}");
        }
    }
}

#[test]
fn a_job_that_gets_on_between_losses_goes_on_and_one_that_does_not_is_stopped() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.2, 0.5);
    // Of these losses no more than three lie within 128 ms of the first, and all of them.
    for (apart, is_borne) in [(0.05, true), (0.01, false)] {
        let mut bench = started(&machine, &job);
        for loss in 0..5 {
            let at = job.lit[0].0 + 0.015 + apart * f64::from(loss);
            assert!(at < job.lit[0].1, "the mark is too short");
            let is_due = |bench: &Bench| {
                let command = &bench.last().command;
                command.laser.is_lit() && command.stream_time >= at || command.fault.is_some()
            };
            while !is_due(&bench) {
                bench.run(Some(&job), 1);
            }
            if bench.last().command.fault.is_some() {
                break;
            }
            bench.stall(2);
        }
        let case = format!("{apart} s apart");
        if is_borne {
            finish(&mut bench, &job, &case);
            continue;
        }
        let fault = bench.last().command.fault;
        assert_eq!(fault.code(), FaultCode::StaleCommand, "{case}");
        assert_eq!((fault.quantity(), fault.value), (FaultQuantity::Losses, 4.0), "{case}");
    }
}
