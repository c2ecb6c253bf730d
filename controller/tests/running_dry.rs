//! Setpoints that run out where the program stands: about a dwell and about a pause. What is played
//! never passes what is in hand, no reference jumps, and a pause waits for a person.

#![allow(clippy::unwrap_used)]

mod support;

use machine::Machine;
use messages::setpoint::flags;
use messages::{ControllerState, OperatorVerb};
use support::{Bench, COARSE, Job, Move, Part, check_marks, job, sharpest};

const POWER: f64 = 0.5;

/// As the planner rests about a pause [s].
const PAUSE_REST: f64 = 0.1;

fn move_of(speed: f64) -> Move {
    let acceleration = if speed > 0.1 { 10.0 } else { 2.0 };
    Move::new(0.03, speed, acceleration, 50.0 * acceleration)
}

/// A mark, a stand of `rest` with a pause in its middle if it is one, and a mark.
fn standing(machine: &Machine, rest: f64, pauses: bool, speed: f64) -> Job {
    let half = Part::Rest(rest / 2.0);
    let mut parts = vec![Part::Rest(0.02), Part::Mark(move_of(speed), [1.0, 0.4]), half.clone()];
    if pauses {
        parts.push(Part::Pause);
    }
    parts.extend([half, Part::Mark(move_of(speed), [-1.0, 0.3]), Part::Rest(0.05)]);
    job(machine, 1, &parts, POWER)
}

/// Started with `supply` setpoints in hand, at this override.
fn started(machine: &Machine, job: &Job, supply: usize, rate: f64) -> Bench {
    let mut bench = Bench::enabled_with(machine, COARSE);
    bench.supply = supply;
    assert!(bench.ask(None, OperatorVerb::Override, rate));
    assert!(bench.ask(Some(job), OperatorVerb::Start, 1.0));
    bench.until(Some(job), ControllerState::Running, 60);
    bench
}

/// Runs, and asserts that nothing is played that is not in hand.
fn run(bench: &mut Bench, job: &Job, cycles: usize, case: &str) {
    for _ in 0..cycles {
        let in_hand = bench.supply.min(job.setpoints.len());
        bench.run(Some(job), 1);
        let time = bench.last().command.stream_time;
        assert!(time <= (in_hand - 1) as f64 * 1e-3, "{case}: at {time} s of {in_hand} in hand");
    }
}

/// Supplies the rest, a few setpoints a cycle, as a planner that is late does.
fn trickle(bench: &mut Bench, job: &Job, case: &str) {
    while bench.supply < job.setpoints.len() {
        run(bench, job, 3, case);
        bench.supply += 16;
    }
}

fn finish(bench: &mut Bench, job: &Job, machine: &Machine, case: &str) {
    bench.until(Some(job), ControllerState::Idle, 6000);
    check_marks(bench, job, POWER, case);
    let report = bench.reports.last().unwrap();
    assert_eq!((report.completed, report.fault.is_some()), (1, false), "{case}");
    let sharpest = sharpest(&bench.records, machine);
    assert!(sharpest < 10.1, "{case}: a reference changed by {sharpest} m/s²");
}

#[test]
fn a_resume_waits_for_what_it_needs_to_stop_again() {
    let machine = Machine::builtin();
    for speed in [0.2, 0.06] {
        let job = standing(&machine, 0.2, false, speed);
        // The stand begins where the first mark's move has come to rest.
        let stands = ((0.02 + move_of(speed).duration()) * 1e3).ceil() as usize;
        for ahead in [4, 10, 30, 50, 60, 66, 75, 100, 140, 190] {
            let supply = stands + ahead;
            if supply < 251 {
                continue;
            }
            let case = format!("{speed} m/s, {ahead} in hand behind the begin of the stand");
            let mut bench = started(&machine, &job, supply, 1.0);
            run(&mut bench, &job, supply + 400, &case);
            assert_eq!(bench.state(), ControllerState::Holding, "{case}");
            assert!(bench.ask(Some(&job), OperatorVerb::Hold, 0.0));
            run(&mut bench, &job, 20, &case);
            assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0), "{case}");
            run(&mut bench, &job, 200, &case);
            assert_eq!(bench.state(), ControllerState::Holding, "{case}");
            trickle(&mut bench, &job, &case);
            finish(&mut bench, &job, &machine, &case);
        }
    }
}

#[test]
fn a_pause_that_was_reached_slowly_is_not_left_at_a_rate_that_cannot_stop() {
    let machine = Machine::builtin();
    let job = standing(&machine, 2.0 * PAUSE_REST, true, 0.06);
    let pause = pause(&job);
    for ahead in [6, 8, 12, 25, 40, 66, 80, 120] {
        let case = format!("{ahead} in hand behind the pause");
        let mut bench = started(&machine, &job, pause + 1 + ahead, 0.1);
        // A tenth of the rate takes ten times as long.
        run(&mut bench, &job, 12_000, &case);
        assert_eq!(bench.state(), ControllerState::Holding, "{case}");
        let time = bench.last().command.stream_time;
        assert!(time <= pause as f64 * 1e-3, "{case}: {time}");
        assert!(bench.ask(Some(&job), OperatorVerb::Override, 1.0));
        assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0));
        run(&mut bench, &job, 300, &case);
        trickle(&mut bench, &job, &case);
        // Where it had not come to the pause before, it waits there.
        for _ in 0..2 {
            run(&mut bench, &job, 600, &case);
            if bench.state() == ControllerState::Holding {
                assert_eq!(bench.last().command.stream_time, pause as f64 * 1e-3, "{case}");
                assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0));
            }
        }
        finish(&mut bench, &job, &machine, &case);
    }
}

/// The number of the setpoint at which the program pauses.
fn pause(job: &Job) -> usize {
    job.setpoints.iter().position(|setpoint| setpoint.has(flags::PAUSE)).unwrap()
}

#[test]
fn a_pause_waits_for_a_person_though_the_stream_ran_dry_about_it() {
    let machine = Machine::builtin();
    // As the planner rests, and with light right before and behind.
    for rest in [2.0 * PAUSE_REST, 0.01] {
        let job = standing(&machine, rest, true, 0.06);
        let pause = pause(&job);
        for ahead in (1..=160).step_by(3) {
            let case = format!("{ahead} in hand behind the pause, {rest} s of rest");
            let mut bench = started(&machine, &job, pause + 1 + ahead, 1.0);
            run(&mut bench, &job, pause + 400, &case);
            assert_eq!(bench.state(), ControllerState::Holding, "{case}");
            bench.supply = usize::MAX;
            run(&mut bench, &job, 2000, &case);
            // Nobody has asked for more than the pause.
            assert_eq!(bench.state(), ControllerState::Holding, "{case}");
            assert_eq!(bench.last().command.stream_time, pause as f64 * 1e-3, "{case}");
            assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0));
            finish(&mut bench, &job, &machine, &case);
        }
    }
}

#[test]
fn a_person_who_resumes_on_the_way_to_a_pause_is_asked_there() {
    let machine = Machine::builtin();
    let job = standing(&machine, 2.0 * PAUSE_REST, true, 0.06);
    let pause = pause(&job);
    for before in [5, 20, 40, 60, 66, 90] {
        let case = format!("held {before} before the pause");
        let mut bench = started(&machine, &job, usize::MAX, 1.0);
        support::reach(&mut bench, &job, (pause - before) as f64 * 1e-3);
        assert!(bench.ask(Some(&job), OperatorVerb::Hold, 0.0));
        assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0));
        run(&mut bench, &job, 1000, &case);
        assert_eq!(bench.state(), ControllerState::Holding, "{case}");
        assert_eq!(bench.last().command.stream_time, pause as f64 * 1e-3, "{case}");
        assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0));
        finish(&mut bench, &job, &machine, &case);
    }
}
