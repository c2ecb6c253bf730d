//! A source with delays, at an override and where a hold parts a mark, in virtual time through the whole
//! chain: the ends are off by what docs/operating.md says, and by no more.

#![allow(clippy::unwrap_used)]

mod chain;

use chain::Chain;
use controller::Peers;
use machine::Machine;
use messages::{ControllerState, OperatorVerb};
use monitor::marks::{MarkEvaluator, Marks, StreamEnd};
use monitor::recording::CycleRecord;
use planner::job::Job;
use planner::{Plan, plan};

/// What the ends of strokes are off by without any delay [m].
const ACCURACY: f64 = 12e-6;

/// Plays the sample job; `ask` says what a person asks for, from cycle to cycle.
fn play(
    machine: &Machine,
    plan: &Plan,
    mut ask: impl FnMut(u64, bool) -> Option<(OperatorVerb, f64)>,
) -> Marks {
    let mut chain = Chain::new(machine, plan);
    let mut evaluator = MarkEvaluator::new(&plan.artwork, machine.realtime.period);
    let mut ended = None;
    while chain.cycle < 60_000 {
        let feedback = chain.begin();
        let asked = ask(chain.cycle, chain.outputs.command.laser.is_lit());
        chain.finish(&feedback, asked, Peers::default());
        let outputs = &chain.outputs;
        evaluator.push(&CycleRecord { feedback, command: outputs.command });
        ended = outputs.report.filter(|report| report.is_final == 1).or(ended);
        if let Some(report) = ended
            && outputs.command.state() == ControllerState::Idle
            && chain.cycle > report.last_cycle.0 + 10
        {
            assert_eq!(report.completed, 1);
            return evaluator.finish(StreamEnd::Reported(&report)).unwrap().marks;
        }
    }
    panic!("the job does not end");
}

#[test]
fn what_the_delays_of_a_source_leave_is_what_the_manual_says() {
    let mut machine = Machine::builtin();
    let (on, off) = (200e-6, 500e-6);
    (machine.laser.on_delay, machine.laser.off_delay) = (on, off);
    let plan = plan(&machine, &Job::builtin(&[], &machine).unwrap()).unwrap();
    // As planned, both are made up for.
    let planned = play(&machine, &plan, |_, _| None);
    let ends = planned.missing_end_max.max(planned.double_end_max);
    assert!(ends < ACCURACY, "{ends:e} m at the planned rate");
    let speed = planned.speed_max;

    // Light begins and ends too early, by the part of either delay that the rate leaves over.
    for rate in [0.1, 0.5] {
        let marks =
            play(&machine, &plan, |step, _| (step == 50).then_some((OperatorVerb::Override, rate)));
        for (found, delay) in [(marks.double_end_max, on), (marks.missing_end_max, off)] {
            let expected = delay * (1.0 - rate) * speed;
            assert!((found - expected).abs() < ACCURACY, "{found:e}, not {expected:e} at {rate}");
        }
    }

    // A hold in the middle of a mark: what the source still gave is given once more.
    let mut lit = 0;
    let mut held = None;
    let marks = play(&machine, &plan, |step, is_lit| {
        lit += u64::from(is_lit);
        match held {
            None if lit == 60 => {
                held = Some(step);
                Some((OperatorVerb::Hold, 0.0))
            }
            Some(since) if step == since + 400 => Some((OperatorVerb::Resume, 0.0)),
            _ => None,
        }
    });
    let (found, expected) = (marks.double - planned.double, (off - on) * speed);
    // Where it was parted, the mark has two more ends.
    assert!((found - expected).abs() < 2.0 * ACCURACY, "{found:e}, not {expected:e} twice");
}
