//! An override of the power: what it scales, what bounds it, and that it ends with its job.

#![allow(clippy::unwrap_used)]

mod support;

use machine::Machine;
use messages::setpoint::flags;
use messages::{ControllerReport, ControllerState, OperatorRequest, OperatorVerb};
use support::{Bench, COARSE, Job, two_marks};

/// The largest power that is commanded in these records.
fn strongest(bench: &Bench, from: usize) -> f64 {
    let lights = bench.records[from..].iter().flat_map(|record| {
        let laser = &record.command.laser;
        let edges = laser.edges().iter().map(|edge| (edge.gate, edge.power));
        std::iter::once((laser.gate, laser.power)).chain(edges).collect::<Vec<_>>()
    });
    lights.filter(|(gate, _)| *gate != 0).map(|(_, power)| power).fold(0.0, f64::max)
}

/// Plays `job` with this override, asked for before it begins; the strongest light, and the report.
fn play(machine: &Machine, job: &Job, power: f64) -> (Bench, f64, ControllerReport) {
    let mut bench = Bench::enabled_with(machine, COARSE);
    assert!(bench.ask(Some(job), OperatorVerb::Power, power));
    assert!(bench.ask(Some(job), OperatorVerb::Start, 1.0));
    bench.until(Some(job), ControllerState::Running, 40);
    assert_eq!(bench.progress.unwrap().power_override, power);
    bench.until(Some(job), ControllerState::Idle, 2000);
    let strongest = strongest(&bench, 0);
    let report = *bench.reports.last().unwrap();
    (bench, strongest, report)
}

#[test]
fn it_scales_the_power_up_to_full_and_is_told() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.4);
    for (power, expect) in [(0.5, 0.2), (1.0, 0.4), (1.5, 0.6), (2.0, 0.8)] {
        let (_, strongest, report) = play(&machine, &job, power);
        assert!((strongest - expect).abs() < 1e-9, "{strongest} at {power}");
        assert_eq!(report.power_override, [power; 2]);
    }
    let (_, strongest, _) = play(&machine, &two_marks(&machine, 0.25, 0.9), 2.0);
    assert_eq!(strongest, 1.0);
}

#[test]
fn it_ends_with_the_job_however_that_ends() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.4);
    let (mut bench, ..) = play(&machine, &job, 1.5);
    let progress = |bench: &mut Bench| {
        bench.run(None, 10);
        bench.progress.unwrap().power_override
    };
    assert_eq!(progress(&mut bench), 1.0);
    // Nor does a rate end that was asked for beside it.
    let mut bench = Bench::enabled_with(&machine, COARSE);
    assert!(bench.ask(Some(&job), OperatorVerb::Start, 1.0));
    bench.until(Some(&job), ControllerState::Running, 40);
    assert!(bench.ask(Some(&job), OperatorVerb::Power, 0.5));
    assert!(bench.ask(Some(&job), OperatorVerb::Override, 0.8));
    bench.run(Some(&job), 100);
    assert!(bench.ask(Some(&job), OperatorVerb::Hold, 0.0));
    bench.run(Some(&job), 300);
    assert_eq!(bench.progress.unwrap().power_override, 0.5, "a hold is not the end");
    assert!(bench.ask(Some(&job), OperatorVerb::Stop, 0.0));
    bench.until(Some(&job), ControllerState::Idle, 500);
    assert_eq!(progress(&mut bench), 1.0);
    assert_eq!(bench.progress.unwrap().override_rate, 0.8);
}

#[test]
fn a_lit_frame_is_never_brighter_than_the_machine_allows() {
    let machine = Machine::builtin();
    let most = machine.operating.safety.frame_power;
    let mut frame = two_marks(&machine, 0.25, most * 0.8);
    frame.setpoints.iter_mut().for_each(|setpoint| setpoint.flags |= flags::FRAME);
    for (power, expect) in [(2.0, most), (1.25, most), (0.5, most * 0.4), (1.0, most * 0.8)] {
        let (_, strongest, _) = play(&machine, &frame, power);
        assert!(strongest <= most && (strongest - expect).abs() < 1e-9, "{strongest} at {power}");
    }
    // Whatever a planner sends.
    let mut bright = two_marks(&machine, 0.25, 0.9);
    bright.setpoints.iter_mut().for_each(|setpoint| setpoint.flags |= flags::FRAME);
    assert_eq!(play(&machine, &bright, 1.0).1, most);
}

#[test]
fn a_test_pulse_has_the_power_that_was_asked_for_whatever_the_override() {
    let machine = Machine::builtin();
    let most = machine.operating.safety.test_power;
    let mut bench = Bench::enabled_with(&machine, COARSE);
    assert!(bench.ask(None, OperatorVerb::Power, 2.0));
    let from = bench.records.len();
    let request = bench.request(OperatorVerb::TestPulse, most);
    let request = OperatorRequest { second: 5e-3, ..request };
    assert_eq!(bench.cycle(None, Some(request), |_| {}).unwrap().accepted, 1);
    bench.run(None, 20);
    assert_eq!(strongest(&bench, from), most);
}

#[test]
fn only_powers_from_a_tenth_to_two_are_taken() {
    let mut bench = Bench::enabled_with(&Machine::builtin(), COARSE);
    for power in [0.0, 0.099, 2.001, -1.0, f64::NAN, f64::INFINITY] {
        assert!(!bench.ask(None, OperatorVerb::Power, power), "{power}");
    }
    let request = bench.request(OperatorVerb::Power, 0.25);
    let reply = bench.cycle(None, Some(request), |_| {}).unwrap();
    assert_eq!((reply.accepted, reply.value, reply.power), (1, 1.0, 0.25));
}
