//! Playing faster and slower: limits hold, light per length stays.

#![allow(clippy::unwrap_used)]

mod support;

use machine::Machine;
use messages::{ControllerReport, ControllerState, OperatorVerb};
use support::{Bench, COARSE, Move, Part, job, lit_stretches, two_marks};

/// Plays a gentle job with an override set after `cycles`; its largest rate and its report.
fn play(rate: f64, cycles: usize) -> (f64, ControllerReport) {
    let machine = Machine::builtin();
    let path = Move::new(0.08, 0.1, 2.0, 100.0);
    let parts = [Part::Rest(0.01), Part::Mark(path, [0.5, 0.5]), Part::Rest(0.05)];
    let job = job(&machine, 1, &parts, 0.5);
    let mut bench = Bench::enabled(&machine);
    assert!(bench.ask(Some(&job), OperatorVerb::Start, 1.0));
    bench.run(Some(&job), cycles);
    assert!(bench.ask(Some(&job), OperatorVerb::Override, rate));
    bench.until(Some(&job), ControllerState::Idle, 12_000);
    let (stretches, exposure) = lit_stretches(&bench.records);
    assert_eq!(stretches.len(), 1, "at rate {rate}");
    let (on, off) = job.lit[0];
    assert!((stretches[0].0 - on).abs() < 3e-9 && (stretches[0].1 - off).abs() < 3e-9);
    assert!((exposure - (off - on) * 0.5).abs() < 1e-6, "{exposure} at rate {rate}");
    let lit = bench.played().filter(|record| record.command.laser.is_lit());
    let worst = lit.map(|record| record.tracking).fold(0.0, f64::max);
    assert!(worst < 10e-6, "{worst} m off at rate {rate}");
    let fastest = bench.played().map(|record| record.command.rate).fold(0.0, f64::max);
    (fastest, *bench.reports.last().unwrap())
}

#[test]
fn an_override_slows_and_keeps_every_limit_and_the_light_per_length() {
    // Half of the joints' sum: the tool moves at half of the path coordinate, so jerk is used to
    // 50/500, acceleration to 1/10, speed to 0.05/0.25.
    for (rate, cycles) in [(0.5, 10), (0.8, 60), (0.3, 400), (0.1, 10)] {
        let (fastest, report) = play(rate, cycles);
        let uses = [report.path_acceleration_use, report.path_jerk_use, report.velocity_use[0]];
        assert!(uses.iter().all(|share| *share <= 1.0), "{uses:?} at rate {rate}");
        assert!(fastest <= 1.0, "{fastest} at rate {rate}");
    }
}

#[test]
fn above_one_the_stream_is_played_as_planned_and_the_planner_hears_of_it() {
    for (rate, cycles) in [(1.7, 10), (2.0, 60)] {
        let (fastest, report) = play(rate, cycles);
        assert_eq!(fastest, 1.0);
        assert!(report.path_jerk_use <= 0.1 + 1e-9, "{}", report.path_jerk_use);
    }
    let mut bench = Bench::enabled(&Machine::builtin());
    for rate in [1.25, 0.5, 2.0] {
        assert!(bench.ask(None, OperatorVerb::Override, rate));
        bench.run(None, 5);
        let progress = bench.progress.unwrap();
        assert_eq!(progress.override_rate, rate);
    }
}

#[test]
fn only_rates_from_a_tenth_to_two_are_taken() {
    let mut bench = Bench::enabled(&Machine::builtin());
    for rate in [0.0, 0.099, 2.001, -1.0, f64::NAN, f64::INFINITY] {
        assert!(!bench.ask(None, OperatorVerb::Override, rate), "{rate}");
    }
    let request = bench.request(OperatorVerb::Override, 0.25);
    let reply = bench.cycle(None, Some(request), |_| {}).unwrap();
    assert_eq!((reply.accepted, reply.value), (1, 0.25));
}

#[test]
fn two_runs_have_one_digest() {
    let digest = |power: f64| {
        let machine = Machine::builtin();
        let job = two_marks(&machine, 0.25, power);
        let mut bench = Bench::enabled(&machine);
        assert!(bench.ask(Some(&job), OperatorVerb::Start, 1.0));
        bench.until(Some(&job), ControllerState::Running, 30);
        bench.until(Some(&job), ControllerState::Idle, 2000);
        bench.reports.last().unwrap().digest
    };
    assert_eq!(digest(0.5), digest(0.5));
    assert_ne!(digest(0.5), digest(0.25));
}

#[test]
fn no_light_is_weaker_than_the_source_can_give_at_any_rate() {
    let mut machine = Machine::builtin();
    machine.laser.min_power = 0.2;
    let job = two_marks(&machine, 0.25, 0.3);
    for rate in [0.1, 0.4, 0.7, 0.9] {
        let mut bench = Bench::enabled_with(&machine, COARSE);
        assert!(bench.ask(Some(&job), OperatorVerb::Start, 1.0));
        assert!(bench.ask(Some(&job), OperatorVerb::Override, rate));
        bench.run(Some(&job), 300);
        assert!(bench.ask(Some(&job), OperatorVerb::Hold, 0.0));
        bench.run(Some(&job), 200);
        assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0));
        bench.until(Some(&job), ControllerState::Idle, 12_000);
        let commands = bench.played().map(|record| &record.command.laser);
        let powers: Vec<f64> = commands
            .flat_map(|laser| {
                let edges = laser.edges().iter().map(|edge| (edge.gate, edge.power));
                core::iter::once((laser.gate, laser.power)).chain(edges)
            })
            .filter_map(|(gate, power)| (gate != 0).then_some(power))
            .collect();
        let [least, most] =
            [f64::min, f64::max].map(|choose| powers.iter().copied().reduce(choose).unwrap());
        assert!(least >= 0.2 && most <= 0.3 + 1e-12, "{least} to {most} at {rate}");
        // Above two thirds of the rate nothing is stronger than in proportion.
        let expected = f64::max(0.2, 0.3 * rate);
        let common = powers.iter().filter(|power| (**power - expected).abs() < 1e-6).count();
        assert!(common * 2 > powers.len(), "{common} of {} at {rate}", powers.len());
    }
}
