//! What comes too late loses no mark: commands that miss their cycle, and setpoints that run out.

#![allow(clippy::unwrap_used)]

mod support;

use controller::{Outputs, Presence};
use machine::Machine;
use messages::feedback::status;
use messages::{CommandMode, ControllerState, FaultCode, Nanoseconds, OperatorVerb};
use support::{Bench, Job, check_marks, reach, started, two_marks};

/// Largest distance of the tool from the plan, with the laser on and off [m].
fn tracking(bench: &Bench) -> [f64; 2] {
    [true, false].map(|lit| {
        let records = bench.played().filter(|record| record.command.laser.is_lit() == lit);
        records.map(|record| record.tracking).fold(0.0, f64::max)
    })
}

#[test]
fn light_lost_in_missed_cycles_is_made_up_for() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let (on, off) = job.lit[0];
    // Feedbacks that the controller never saw, then commands that came too late.
    for (skipped, late) in [(0, 1), (0, 2), (1, 0), (2, 0), (1, 1)] {
        for moment in [on - 0.0015, on, on + 0.0007, on + 0.06, off - 0.0026, off - 0.001, off] {
            for rate in [1.0, 0.37] {
                let case = format!("{skipped} skipped, {late} late at {moment} s, rate {rate}");
                let mut bench = started(&machine, &job);
                assert!(bench.ask(Some(&job), OperatorVerb::Override, rate));
                reach(&mut bench, &job, moment);
                bench.skip(skipped);
                bench.late = late;
                bench.until(Some(&job), ControllerState::Idle, 6000);
                check_marks(&bench, &job, 0.5, &case);
                let report = bench.reports.last().unwrap();
                assert_eq!((report.completed, report.fault.is_some()), (1, false), "{case}");
                let [lit, dark] = tracking(&bench);
                assert!(lit < 10e-6 && dark < 60e-6, "{case}: {lit} m, {dark} m in the dark");
            }
        }
    }
}

#[test]
fn a_missed_cycle_in_the_dark_stops_nothing() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = started(&machine, &job);
    reach(&mut bench, &job, 0.03);
    bench.late = 1;
    bench.skip(1);
    while bench.state() != ControllerState::Idle {
        assert_eq!(bench.state(), ControllerState::Running);
        bench.run(Some(&job), 1);
    }
    check_marks(&bench, &job, 0.5, "missed in the dark");
}

#[test]
fn light_lost_again_and_again_at_one_place_stops_the_machine() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = started(&machine, &job);
    while bench.state() != ControllerState::Stopping {
        // Whenever there is light, the command comes too late.
        bench.late = u32::from(bench.last().command.laser.is_lit());
        bench.run(Some(&job), 1);
        assert!(bench.records.len() < 5000, "it tries for ever");
    }
    let fault = bench.last().command.fault;
    assert_eq!((fault.code(), fault.value), (FaultCode::StaleCommand, 4.0));
    bench.until(Some(&job), ControllerState::Faulted, 200);
}

#[test]
fn a_person_may_hold_what_holds_by_itself() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = started(&machine, &job);
    reach(&mut bench, &job, job.lit[0].0 + 0.05);
    bench.late = 1;
    bench.run(Some(&job), 2);
    assert_eq!(bench.state(), ControllerState::Holding);
    assert!(bench.ask(Some(&job), OperatorVerb::Hold, 0.0));
    bench.run(Some(&job), 1000);
    assert_eq!(bench.state(), ControllerState::Holding);
    assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0));
    bench.until(Some(&job), ControllerState::Idle, 3000);
    check_marks(&bench, &job, 0.5, "held twice");
}

/// Plays until `supply` setpoints have run out.
fn run_dry(machine: &Machine, job: &Job, supply: usize) -> Bench {
    let mut bench = Bench::enabled(machine);
    bench.supply = supply;
    assert!(bench.ask(Some(job), OperatorVerb::Start, 1.0));
    bench.until(Some(job), ControllerState::Running, 30);
    bench.until(Some(job), ControllerState::Holding, 900);
    assert!(!bench.last().command.laser.is_lit());
    bench.run(Some(job), 1000);
    assert_eq!(bench.state(), ControllerState::Holding, "with {supply}");
    let furthest = bench.played().map(|record| record.command.stream_time).fold(0.0, f64::max);
    assert!(furthest <= (supply - 1) as f64 * 1e-3, "played beyond the {supply} in hand");
    // Twice the way of an unhindered stop is kept in hand, and one is gone.
    assert!(furthest >= (supply - 75) as f64 * 1e-3, "{furthest}: stopped too soon");
    bench
}

#[test]
fn a_dry_stream_goes_on_when_setpoints_come_again() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    // From inside the run-in to the second mark; then again and again.
    for supply in [251, 270, 300, 333, 400, 500] {
        let mut bench = run_dry(&machine, &job, supply);
        let case = format!("dry after {supply}");
        // A trickle does not set it off.
        bench.supply += 100;
        bench.run(Some(&job), 300);
        assert_eq!(bench.state(), ControllerState::Holding, "{case}");
        bench.supply += 200;
        bench.until(Some(&job), ControllerState::Running, 100);
        bench.run(Some(&job), 700);
        bench.supply = usize::MAX;
        bench.until(Some(&job), ControllerState::Idle, 4000);
        check_marks(&bench, &job, 0.5, &case);
        assert_eq!(bench.reports.last().unwrap().completed, 1, "{case}");
        let [lit, dark] = tracking(&bench);
        // In the dark, stiction may hold an axis back as it sets off from a long rest.
        assert!(lit < 10e-6 && dark < 80e-6, "{case}: {lit} m, {dark} m in the dark");
    }
}

#[test]
fn a_dry_stream_waits_for_a_planner_that_lives_and_not_for_ever() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = run_dry(&machine, &job, 400);
    bench.peers.planner = Presence::Lost;
    bench.run(Some(&job), 1);
    assert_eq!(bench.last().command.fault.code(), FaultCode::PlannerLost);
    bench.until(Some(&job), ControllerState::Faulted, 50);

    let mut bench = run_dry(&machine, &job, 400);
    assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0), "it will, when it can");
    assert_eq!(bench.state(), ControllerState::Holding);
    assert!(bench.ask(Some(&job), OperatorVerb::Stop, 0.0));
    bench.until(Some(&job), ControllerState::Idle, 50);

    let mut bench = run_dry(&machine, &job, 400);
    bench.until(Some(&job), ControllerState::Faulted, 60_000);
    assert_eq!(bench.last().command.fault.code(), FaultCode::StreamStarved);
}

#[test]
fn whoever_starts_a_stream_hears_of_its_end() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let heard = |bench: &Bench, code: FaultCode| {
        let report = bench.reports.last().unwrap();
        assert_eq!((report.stream, report.is_final, report.completed), (1, 1, 0));
        assert_eq!(report.fault.code(), code);
    };
    // Stopped before the first setpoint has come.
    let mut bench = Bench::enabled(&machine);
    assert!(bench.ask(None, OperatorVerb::Start, 1.0));
    assert!(bench.ask(None, OperatorVerb::Stop, 0.0));
    heard(&bench, FaultCode::None);
    // Left by the planner before that.
    let mut bench = Bench::enabled(&machine);
    assert!(bench.ask(None, OperatorVerb::Start, 1.0));
    bench.peers.planner = Presence::Lost;
    bench.until(None, ControllerState::Faulted, 50);
    heard(&bench, FaultCode::PlannerLost);
    // Elsewhere than the axes stand.
    let mut elsewhere = two_marks(&machine, 0.25, 0.5);
    for setpoint in &mut elsewhere.setpoints {
        setpoint.position[0] += 1e-3;
    }
    let mut bench = Bench::enabled(&machine);
    assert!(bench.ask(Some(&elsewhere), OperatorVerb::Start, 1.0));
    bench.until(Some(&elsewhere), ControllerState::Faulted, 60);
    heard(&bench, FaultCode::StreamStart);
    // Spoilt while the motors are still unpowered.
    let mut spoilt = two_marks(&machine, 0.25, 0.5);
    spoilt.setpoints[3].position[0] = f64::NAN;
    let mut bench = Bench::new(&machine);
    bench.run(None, 2);
    assert!(bench.ask(None, OperatorVerb::Start, 1.0));
    bench.run(Some(&spoilt), 2);
    heard(&bench, FaultCode::NotFinite);
    // Drives died, and no feedback comes.
    let mut bench = started(&machine, &job);
    reach(&mut bench, &job, job.lit[0].0 + 0.05);
    let mut outputs = Outputs { command: bench.last().command, ..Outputs::default() };
    assert!(outputs.command.laser.is_lit());
    bench.controller.abandon(Nanoseconds(7), &mut outputs);
    bench.reports.extend(outputs.report);
    heard(&bench, FaultCode::DrivesLost);
    assert!(!outputs.command.laser.is_lit() && outputs.command.mode() == CommandMode::Disabled);
    assert_eq!(outputs.command.state(), ControllerState::Faulted);
    bench.controller.abandon(Nanoseconds(8), &mut outputs);
    assert!(outputs.report.is_none() && outputs.progress.is_none(), "once is enough");
}

#[test]
fn a_closed_gate_lets_no_stream_begin_and_ends_one() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = Bench::enabled(&machine);
    assert!(bench.ask(Some(&job), OperatorVerb::Start, 1.0));
    for _ in 0..100 {
        bench.cycle(Some(&job), None, |feedback| feedback.status |= status::GATE_INHIBITED);
        assert_eq!(bench.state(), ControllerState::Idle);
    }
    bench.until(Some(&job), ControllerState::Running, 2);
    bench.run(Some(&job), 50);
    bench.cycle(Some(&job), None, |feedback| feedback.status |= status::GATE_INHIBITED);
    assert_eq!(bench.last().command.fault.code(), FaultCode::DriveFault);
    assert!(!bench.last().command.laser.is_lit());
}
