//! A controller step asks nothing of the heap: playing, holding, resuming, failing, resetting; in stalls,
//! with late commands and a stream that runs dry; on motors and on steppers.

#![allow(clippy::unwrap_used)]

mod support;

use controller::{Controller, Inputs, Outputs, Peers};
use machine::Machine;
use messages::feedback::status;
use messages::{
    CommandMode, ControllerState, Cycle, Feedback, Nanoseconds, OperatorRequest, OperatorVerb,
};
use runtime::allocation::{Allocations, CountingAllocator};
use support::{load, two_marks};

/// The cycle in which an axis is lost.
const LOST: u64 = 1300;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn no_step_allocates() {
    assert_no_step_allocates(&Machine::builtin(), 0.25);
    assert_no_step_allocates(&load("cartesian_steppers.toml"), 0.2);
}

fn assert_no_step_allocates(machine: &Machine, speed: f64) {
    let job = two_marks(machine, speed, 0.5);
    let mut controller = Controller::new(machine);
    let mut outputs = Outputs::default();
    let mut feedback = Feedback { status: status::POWERED, ..Feedback::default() };
    for (index, actuator) in machine.actuators.iter().enumerate().take(2) {
        feedback.position[index] = support::home(machine)[index] / actuator.ratio;
    }
    let mut sent = 0;
    let mut seen = [0; 7];
    let (mut rewound, mut dry) = (0, 0);
    for cycle in 1..2600_u64 {
        let verb = match cycle {
            5 => Some((OperatorVerb::Enable, 0.0)),
            50 => Some((OperatorVerb::Start, 1.0)),
            60 => Some((OperatorVerb::Override, 1.5)),
            300 => Some((OperatorVerb::Hold, 0.0)),
            600 => Some((OperatorVerb::Resume, 0.0)),
            2400 => Some((OperatorVerb::Reset, 0.0)),
            2450 => Some((OperatorVerb::Enable, 0.0)),
            _ => None,
        };
        let request = verb.map(|(verb, value)| OperatorRequest {
            verb: verb as u32,
            ticket: cycle as u32,
            value,
            ..OperatorRequest::default()
        });
        // Stalls of drives while it plays, while it is held, and on the way back for light; and commands
        // that come too late.
        let skipped = if [200, 330, 620, 640].contains(&cycle) { 7 } else { 0 };
        let late = u64::from(skipped > 0 || [100, 150, 260].contains(&cycle));
        feedback.cycle = Cycle(feedback.cycle.0 + 1 + skipped);
        feedback.missed += skipped + late;
        let command = &outputs.command;
        rewound += u32::from(command.rate < 0.0);
        dry += u32::from(command.state() == ControllerState::Holding && cycle > 1000);
        // The motors follow exactly, until one is lost.
        let follows = command.mode() == CommandMode::Driven;
        if follows && cycle < LOST {
            feedback.position = command.reference;
            let coasted = feedback.position.iter_mut().zip(&command.velocity);
            coasted.for_each(|(position, speed)| *position += speed * 1e-3 * skipped as f64);
        }
        if cycle == LOST {
            feedback.position[0] += 10.0;
        }
        let room = controller.room().min(64);
        // Dry for a while.
        let supply = if cycle < 1250 { job.setpoints.len() - 100 } else { job.setpoints.len() };
        let end = (sent + room).min(supply);
        let inputs = Inputs {
            feedback: &feedback,
            received: Nanoseconds(cycle as i64),
            setpoints: &job.setpoints[sent..end],
            request,
            peers: Peers::default(),
        };
        let ((), asked) = Allocations::during(|| {
            controller.step(Nanoseconds(cycle as i64), &inputs, &mut outputs);
        });
        assert_eq!(asked, Allocations::default(), "in cycle {cycle}");
        sent = end;
        seen[outputs.command.state as usize] += 1;
    }
    for state in [
        ControllerState::Disabled,
        ControllerState::Enabling,
        ControllerState::Idle,
        ControllerState::Running,
        ControllerState::Holding,
        ControllerState::Stopping,
        ControllerState::Faulted,
    ] {
        assert!(seen[state as usize] > 0, "{state:?} never came up: {seen:?}");
    }
    assert!(rewound > 20 && dry > 20, "{rewound} cycles back, {dry} dry");
}
