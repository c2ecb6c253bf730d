//! A controller step asks nothing of the heap: playing, holding, resuming, failing, resetting.

#![allow(clippy::unwrap_used)]

mod support;

use controller::{Controller, Inputs, Outputs, Peers};
use machine::Machine;
use messages::feedback::status;
use messages::{ControllerState, Cycle, Feedback, Nanoseconds, OperatorRequest, OperatorVerb};
use runtime::allocation::{Allocations, CountingAllocator};
use support::two_marks;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn no_step_allocates() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut controller = Controller::new(&machine);
    let mut outputs = Outputs::default();
    let mut feedback = Feedback { status: status::POWERED, ..Feedback::default() };
    for (index, axis) in machine.axes.iter().enumerate() {
        feedback.position[index] = support::home(&machine)[index] / axis.ratio;
    }
    let mut sent = 0;
    let mut seen = [0; 7];
    for cycle in 1..2600_u64 {
        let verb = match cycle {
            5 => Some((OperatorVerb::Enable, 0.0)),
            50 => Some((OperatorVerb::Start, 1.0)),
            60 => Some((OperatorVerb::Override, 1.5)),
            300 => Some((OperatorVerb::Hold, 0.0)),
            600 => Some((OperatorVerb::Resume, 0.0)),
            1950 => Some((OperatorVerb::Reset, 0.0)),
            2000 => Some((OperatorVerb::Enable, 0.0)),
            _ => None,
        };
        let request = verb.map(|(verb, value)| OperatorRequest {
            verb: verb as u32,
            ticket: cycle as u32,
            value,
        });
        feedback.cycle = Cycle(cycle);
        // The motors follow exactly, until one is lost.
        if outputs.command.mode == 4 && cycle < 850 {
            feedback.position = outputs.command.reference;
        }
        if cycle == 850 {
            feedback.position[0] += 10.0;
        }
        let room = controller.room().min(64);
        let end = (sent + room).min(job.setpoints.len());
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
}
