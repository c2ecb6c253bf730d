//! The controller on exact motors: what accuracy the timing of references and feedforward gives.

#![allow(clippy::unwrap_used)]

mod support;

use machine::Machine;
use messages::{ControllerState, OperatorVerb};
use support::{Bench, lit_stretches, two_marks};

#[test]
fn a_nominal_machine_marks_within_ten_micrometres() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = Bench::enabled(&machine);
    assert!(bench.ask(Some(&job), OperatorVerb::Start, 1.0));
    bench.until(Some(&job), ControllerState::Running, 20);
    bench.until(Some(&job), ControllerState::Idle, 2000);

    let report = bench.reports.last().unwrap();
    assert_eq!((report.is_final, report.completed, report.stream), (1, 1, 1));
    let lit = |record: &&support::Record| record.command.laser.is_lit();
    let worst = bench.played().filter(lit).map(|record| record.tracking).fold(0.0, f64::max);
    let dark = bench.played().map(|record| record.tracking).fold(0.0, f64::max);
    println!("tracking: lit {:.2} µm, anywhere {:.2} µm", worst * 1e6, dark * 1e6);
    assert!(worst < 10e-6, "{worst} m with the laser on");
    assert!(dark < 15e-6, "{dark} m anywhere");

    let (stretches, exposure) = lit_stretches(&bench.records);
    assert_eq!(stretches.len(), job.lit.len());
    for (found, planned) in stretches.iter().zip(&job.lit) {
        // Offsets are whole nanoseconds.
        assert!((found.0 - planned.0).abs() < 2e-9 && (found.1 - planned.1).abs() < 2e-9);
    }
    let planned: f64 = job.lit.iter().map(|(on, off)| (off - on) * 0.5).sum();
    assert!((exposure - planned).abs() < 1e-8, "{exposure} against {planned}");
}

#[test]
fn the_final_report_is_repeated_for_who_joins_late_until_the_next_stream_begins() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = Bench::enabled(&machine);
    bench.run(None, 1500);
    assert_eq!(bench.reports.len(), 0, "nothing to say before the first stream");
    assert!(bench.ask(Some(&job), OperatorVerb::Start, 1.0));
    bench.until(Some(&job), ControllerState::Running, 20);
    bench.until(Some(&job), ControllerState::Idle, 2000);
    let told = bench.reports.len();
    let last = bench.reports[told - 1];
    bench.run(None, 2500);
    assert!(bench.reports.len() >= told + 2, "{} more", bench.reports.len() - told);
    assert!(bench.reports[told..].iter().all(|report| *report == last));
}
