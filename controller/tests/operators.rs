//! Enabling is bumpless, verbs are refused where they make no sense, and only a started stream is
//! played.

#![allow(clippy::unwrap_used)]

mod support;

use machine::Machine;
use messages::{CommandMode, ControllerState, OperatorRequest, OperatorVerb};
use support::{Bench, two_marks};

#[test]
fn enabling_does_not_move_a_motor() {
    let mut machine = Machine::builtin();
    // Away from the encoder's grid, and not at rest on any reference.
    machine.home = [0.0987, 0.1031, 0.0];
    let mut bench = Bench::new(&machine);
    bench.run(None, 5);
    assert_eq!(bench.last().command.mode(), CommandMode::Disabled);
    let before: Vec<f64> = bench.motors.iter().map(|motor| motor.angle).collect();
    assert!(bench.ask(None, OperatorVerb::Enable, 0.0));
    bench.run(None, 500);
    assert_eq!(bench.state(), ControllerState::Idle);
    for record in &bench.records {
        assert!(record.command.voltage.iter().all(|voltage| voltage.abs() < 1e-9));
    }
    for (motor, before) in bench.motors.iter().zip(before) {
        assert_eq!(motor.angle, before);
    }
}

#[test]
fn each_state_takes_only_what_makes_sense() {
    use OperatorVerb::{Disable, Enable, Hold, Override, Reset, Resume, Start, Stop};
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let refuse = |bench: &mut Bench, verbs: &[OperatorVerb]| {
        for verb in verbs {
            let state = bench.state();
            assert!(!bench.ask(Some(&job), *verb, 0.0), "{verb:?} in {state:?}");
        }
    };
    let mut bench = Bench::new(&machine);
    bench.run(None, 2);
    refuse(&mut bench, &[Disable, Hold, Resume, Stop, Reset, Override, Start]);
    let unknown = OperatorRequest { verb: 99, ticket: 7, value: 0.0, ..OperatorRequest::default() };
    assert_eq!(bench.cycle(None, Some(unknown), |_| {}).unwrap().accepted, 0);
    assert!(bench.ask(None, Enable, 0.0));
    refuse(&mut bench, &[Enable, Hold, Resume, Stop, Reset]);
    bench.until(None, ControllerState::Idle, 60);
    refuse(&mut bench, &[Enable, Hold, Resume, Stop, Reset]);
    bench.run(Some(&job), 100);
    assert_eq!(bench.state(), ControllerState::Idle, "nobody started the stream");
    for bad in [0.5, -1.0, f64::NAN, f64::INFINITY] {
        assert!(!bench.ask(Some(&job), Start, bad), "stream {bad}");
    }
    assert!(bench.ask(Some(&job), Start, 1.0));
    bench.until(Some(&job), ControllerState::Running, 30);
    refuse(&mut bench, &[Enable, Disable, Resume, Reset, Start]);
    assert!(bench.ask(Some(&job), Hold, 0.0));
    assert!(bench.ask(Some(&job), Hold, 0.0), "again");
    refuse(&mut bench, &[Enable, Disable, Reset, Start]);
    assert!(bench.ask(Some(&job), Stop, 0.0));
    bench.until(Some(&job), ControllerState::Idle, 200);
    assert!(bench.ask(Some(&job), Disable, 0.0));
    assert_eq!(bench.last().command.mode(), CommandMode::Disabled);
}

#[test]
fn a_second_stream_starts_where_the_first_ended() {
    let machine = Machine::builtin();
    let first = two_marks(&machine, 0.25, 0.5);
    let mut second = two_marks(&machine, 0.2, 0.5);
    let end = first.setpoints.last().unwrap();
    for setpoint in &mut second.setpoints {
        setpoint.stream = 2;
        for index in 0..2 {
            setpoint.position[index] += end.position[index] - support::home(&machine)[index];
        }
        setpoint.tool = support::tool(&setpoint.position);
    }
    let mut bench = Bench::enabled(&machine);
    for (stream, job) in [(1.0, &first), (2.0, &second)] {
        bench.sent = 0;
        assert!(bench.ask(Some(job), OperatorVerb::Start, stream));
        bench.until(Some(job), ControllerState::Running, 40);
        bench.until(Some(job), ControllerState::Idle, 2000);
        let report = bench.reports.last().unwrap();
        assert_eq!((report.stream as f64, report.completed), (stream, 1));
        assert!(report.last_cycle.0 - report.first_cycle.0 + 1 == report.cycles);
        assert_eq!(report.count, report.cycles);
    }
    let worst = bench.played().map(|record| record.tracking).fold(0.0, f64::max);
    assert!(worst < 10e-6, "{worst} m");
}
