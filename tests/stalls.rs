//! Stalls of drives through the whole chain, in virtual time: planner, controller, bridge, plant and
//! the evaluation of the marks. What is tolerated costs no mark and lights none where nothing was
//! commanded, on motors and on steppers; what is longer stops the machine.

#![allow(clippy::unwrap_used)]

mod chain;

use std::path::Path;

use chain::{Chain, START};
use controller::Peers;
use machine::Machine;
use messages::feedback::status;
use messages::random::SplitMix64;
use messages::time::Period;
use messages::{ControllerReport, ControllerState, FaultCode, RealtimeFacts};
use monitor::marks::{MarkEvaluator, Marks, StreamEnd};
use monitor::recording::{CycleRecord, Recorder};
use monitor::trace::lit_share;
use planner::job::Job;
use planner::{Plan, plan};

/// What a run came to.
struct Played {
    marks: Marks,
    report: ControllerReport,
    /// Stalls that drives counted.
    stalls: u64,
    /// Cycles that it skipped.
    skipped: u64,
    state: ControllerState,
}

fn planned(machine: &Machine) -> Plan {
    plan(machine, &Job::builtin(&[], machine).unwrap()).unwrap()
}

/// Cycles in a setpoint.
fn per_setpoint(machine: &Machine) -> u64 {
    machine.realtime.period.cycles_for(Period::OF_SETPOINTS.time())
}

/// Plays the sample job; `stall` says after each cycle, by its number, how many are skipped.
fn play(machine: &Machine, plan: &Plan, mut stall: impl FnMut(u64) -> u64) -> Played {
    let mut chain = Chain::new(machine, plan);
    let (mut evaluator, mut recorder) =
        (MarkEvaluator::new(&plan.artwork, machine.realtime.period), Recorder::new());
    let mut skipped = 0;
    let mut report = ControllerReport::default();
    let mut left = u64::MAX;
    while chain.cycle < 60_000 * per_setpoint(machine) {
        let feedback = chain.begin();
        skipped += feedback.skipped;
        assert_no_light_uncommanded(&feedback, machine);
        chain.finish(&feedback, None, Peers::default());
        let outputs = &chain.outputs;
        recorder.feedback(&feedback);
        recorder.command(&outputs.command);
        evaluator.push(&CycleRecord { feedback, command: outputs.command });
        if let Some(ended) = outputs.report.filter(|report| report.is_final == 1) {
            (report, left) = (ended, 4);
        }
        left -= 1;
        if left == 0 {
            recorder.finish();
            assert_eq!(recorder.continuity().missing, 0, "what drives skipped is no loss");
            let state = outputs.command.state();
            let stalls = chain.bridge.report(RealtimeFacts::default()).stalls;
            let marks = evaluator.finish(StreamEnd::Reported(&report)).unwrap().marks;
            return Played { marks, report, stalls: stalls.count, skipped: skipped.into(), state };
        }
        chain.skip(stall(chain.cycle));
    }
    panic!("the job does not end");
}

/// Asserts that skipped cycles were dark; only the one before them may have been lit, by the gate's latency
/// later than it was sent.
fn assert_no_light_uncommanded(feedback: &messages::Feedback, machine: &Machine) {
    let (period, late) = (machine.realtime.period, machine.drives.gate_latency);
    let lit = lit_share(&feedback.laser, period.of(feedback.elapsed())) * feedback.elapsed() as f64;
    let most = 1.0 + late.seconds() / period.seconds();
    assert!(lit <= most + 1e-9, "{lit} cycles lit, {} skipped", feedback.skipped);
    let edges = feedback.laser.edges().iter();
    let end = (period.time() + late).0;
    let beyond = |edge: &&messages::GateEdge| i64::from(edge.offset) >= end;
    assert!(edges.filter(beyond).all(|edge| edge.gate == 0), "{:?}", feedback.laser);
}

fn load(name: &str) -> Machine {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("machines");
    Machine::load(&folder.join(name), &[]).unwrap()
}

/// Asserts that a run with stalls marked everything once, about as well as one without.
fn assert_whole(played: &Played, plain: &Played, case: &str) {
    let report = &played.report;
    assert_eq!(
        (report.completed, report.fault.is_some()),
        (1, false),
        "{case}: {:?}",
        report.fault
    );
    assert_eq!(played.state, ControllerState::Idle, "{case}");
    let (marks, plain) = (&played.marks, &plain.marks);
    assert_eq!((marks.strokes_lost, marks.stray), (0, 0.0), "{case}");
    // Where the light was taken up again is an end of its own, as accurate as after a hold.
    assert!(marks.error_max < plain.error_max + 12e-6, "{case}: {:e} m off", marks.error_max);
    assert!(marks.missing < plain.missing + 60e-6, "{case}: {:e} m missing", marks.missing);
    assert!(marks.double < plain.double + 60e-6, "{case}: {:e} m double", marks.double);
}

#[test]
fn tolerated_stalls_at_any_time_cost_no_mark_on_motors_and_steppers() {
    for name in ["corexy.toml", "cartesian_steppers.toml", "five_bar.toml"] {
        bear_stalls(name, &load(name), 450, 0..6);
    }
}

#[test]
fn at_4_khz_tolerated_stalls_cost_no_mark_either() {
    for name in ["corexy.toml", "cartesian_steppers.toml"] {
        let mut machine = load(name);
        machine.realtime.period = Period::new(messages::Nanoseconds(250_000)).unwrap();
        bear_stalls(name, &machine, 900, 0..12);
    }
}

#[test]
fn drives_that_act_later_lose_no_mark_by_stalls_either() {
    let late = ["drives.simulated.latency=1.3 ms", "drives.simulated.gate_latency=0.6 ms"];
    let late = late.map(|change| change.parse().unwrap());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("machines");
    for name in ["corexy.toml", "cartesian_steppers.toml"] {
        let machine = Machine::load(&folder.join(name), &late).unwrap();
        bear_stalls(name, &machine, 600, 0..4);
    }
}

/// Stalls at random, `apart` ms or up to 500 ms more: whoever loses light more than three times about one
/// place is stopped, at any rate of the cycle.
fn bear_stalls(name: &str, machine: &Machine, apart: u64, seeds: core::ops::Range<u64>) {
    let scale = per_setpoint(machine);
    let plan = planned(machine);
    let plain = play(machine, &plan, |_| 0);
    assert_eq!((plain.stalls, plain.skipped), (0, 0));
    for seed in seeds {
        let mut random = SplitMix64::new(seed);
        let mut next = START + random.bits() % (300 * scale);
        let longest = machine.realtime.stalled_cycles() - 1;
        let played = play(machine, &plan, |step| {
            if step < next {
                return 0;
            }
            // So far apart that no place loses its light more often than is borne.
            next = step + (apart + random.bits() % 500) * scale;
            1 + random.bits() % longest
        });
        assert!(played.stalls >= 3 && played.skipped >= played.stalls, "{name}");
        assert_whole(&played, &plain, &format!("{name}, seed {seed}"));
    }
}

#[test]
fn a_stall_is_a_fault_exactly_when_it_is_longer_than_the_machine_file_says() {
    let mut machine = Machine::builtin();
    for tolerated in [1, 4, 10] {
        let period = machine.realtime.period;
        machine.realtime.stall =
            machine::StallTolerance::new(period.of(tolerated), period).unwrap();
        let plan = planned(&machine);
        for moment in [START + 30, START + 200, START + 700] {
            // The cycle that drives is in time for lacks a fresh command too.
            for (skipped, borne) in [(tolerated - 1, true), (tolerated, false), (300, false)] {
                let played = play(&machine, &plan, |step| if step == moment { skipped } else { 0 });
                let case = format!("{skipped} skipped of {tolerated} at {moment}");
                let fault = played.report.fault;
                assert_eq!(fault.code() == FaultCode::None, borne, "{case}: {fault:?}");
                assert_eq!(played.report.completed, u32::from(borne), "{case}");
                if !borne {
                    assert_eq!(fault.code(), FaultCode::StaleCommand, "{case}");
                    assert_eq!(
                        (fault.value, fault.limit),
                        (skipped as f64 + 1.0, tolerated as f64)
                    );
                    assert_eq!(played.state, ControllerState::Faulted, "{case}");
                }
            }
        }
    }
}

#[test]
fn the_time_of_a_run_counts_what_was_skipped() {
    let machine = Machine::builtin();
    let plan = planned(&machine);
    let plain = play(&machine, &plan, |_| 0);
    // In the dark and at rest, before anything moves: nothing has to be made up for.
    let stalled = play(&machine, &plan, |step| if step == START + 3 { 6 } else { 0 });
    assert_eq!(stalled.report.cycles, plain.report.cycles);
    assert_eq!(stalled.skipped, 6);
    let cycles = |report: &ControllerReport| report.last_cycle.0 - report.first_cycle.0 + 1;
    assert_eq!(cycles(&stalled.report), stalled.report.cycles);
}

#[test]
fn the_feedback_after_a_stall_says_that_commands_were_missed() {
    let machine = Machine::builtin();
    let mut chain = Chain::idle(&machine);
    for skipped in [0, 0, 0, 4, 0, 0] {
        chain.skip(skipped);
        let feedback = chain.begin();
        assert_eq!(feedback.has(status::COMMAND_MISSED), skipped > 0);
        chain.finish(&feedback, None, Peers::default());
    }
}
