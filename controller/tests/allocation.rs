//! A controller step asks nothing of the heap: playing, holding, resuming, failing, resetting; in stalls,
//! with late commands and a stream that runs dry; on motors and on steppers, and with drives that act later and measure
//! before; at other rates and powers; homing, jogging and moving by steps, beside slow devices.

#![allow(clippy::unwrap_used)]

mod support;

use controller::slow::Slow;
use controller::{Controller, Inputs, Outputs, Peers, Presence};
use machine::Machine;
use messages::feedback::status;
use messages::{
    CommandMode, ControllerState, Cycle, DeviceState, Feedback, MotionEnd, Nanoseconds,
    OperatorRequest, OperatorVerb, SlowInputs,
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

#[test]
fn no_step_allocates_where_drives_act_later_and_measure_before() {
    let mut machine = Machine::builtin();
    for (actuator, [latency, age]) in machine.actuators.iter_mut().zip([[1300, 500], [400, 0]]) {
        actuator.latency = Nanoseconds(latency * 1000);
        actuator.age = Nanoseconds(age * 1000);
    }
    machine.drives.gate_latency = Nanoseconds(600_000);
    assert_no_step_allocates(&machine, 0.25);
}

/// Switches next to where the axes stand at power-on, and a device on Modbus.
const OPERATED: &str = r#"
[inputs.x_home]
function = "home"
axis = "x"
[inputs.y_home]
function = "home"
axis = "y"
[axis.x.homing]
position = "95 mm"
speed = "50 mm/s"
latch_speed = "10 mm/s"
[axis.y.homing]
position = "95 mm"
speed = "50 mm/s"
latch_speed = "10 mm/s"
order = 1
[modbus.chiller]
address = "10.0.0.5"
inputs.alarm = { discrete = 0, function = "interlock" }
"#;

#[test]
fn no_step_allocates_while_axes_are_homed_and_moved_by_hand() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../machines/cartesian.toml");
    let text = std::fs::read_to_string(file).unwrap() + OPERATED;
    let machine = Machine::parse("operated.toml", &text, &[]).unwrap();
    let mut controller = Controller::new(&machine);
    let mut outputs = Outputs::default();
    let mut feedback = Feedback { status: status::POWERED, ..Feedback::default() };
    let mut slow = SlowInputs::default();
    let mut devices = Slow::new(&machine);
    slow.devices[0].state = DeviceState::Answering as u32;
    let (mut seen, mut ends) = ([0; 16], Vec::with_capacity(16));
    for cycle in 1..6000_u64 {
        let now = Nanoseconds(cycle as i64 * 1_000_000);
        let (verb, axis, value, second) = match cycle {
            5 => (OperatorVerb::Enable, 0, 0.0, 0.0),
            100 => (OperatorVerb::Home, 0, 0.0, 0.0),
            4000 => (OperatorVerb::Jog, 1, 0.02, 0.0),
            4100 => (OperatorVerb::JogOn, 1, 3.0, 0.0),
            4800 => (OperatorVerb::Step, 2, 0.004, 0.05),
            5500 => (OperatorVerb::TestPulse, 0, 0.05, 0.01),
            _ => (OperatorVerb::Enable, 0, 0.0, 0.0),
        };
        let is_asked = [5, 100, 4000, 4100, 4800, 5500].contains(&cycle);
        let request = is_asked.then(|| {
            let (verb, ticket) = (verb as u32, cycle as u32);
            OperatorRequest { verb, ticket, axis, value, second, reserved: 0 }
        });
        feedback.cycle = Cycle(cycle);
        // The motors follow exactly; the switches are 5 mm below where they stood at power-on.
        if outputs.command.mode() == CommandMode::Driven {
            feedback.position = outputs.command.reference;
        }
        let is_on = |axis: usize| feedback.position[axis] * machine.actuators[axis].ratio < -5e-3;
        feedback.inputs = u64::from(is_on(0)) | u64::from(is_on(1)) << 1;
        slow.devices[0].answered = now;
        let ((), asked) = Allocations::during(|| {
            devices.hear(&slow);
            let inputs = Inputs {
                feedback: &feedback,
                received: now,
                setpoints: &[],
                request,
                peers: Peers::default(),
                slow: devices.active(now, Presence::Present),
            };
            controller.step(now, &inputs, &mut outputs);
        });
        assert_eq!(asked, Allocations::default(), "in cycle {cycle}");
        if let Some(reply) = outputs.reply {
            assert_eq!(reply.accepted, 1, "{verb:?}: {reply:?}");
        }
        seen[outputs.command.state as usize] += 1;
        if let Some(progress) = outputs.progress
            && ends.last() != Some(&progress.motion_end)
        {
            ends.push(progress.motion_end);
        }
    }
    for state in [ControllerState::Homing, ControllerState::Jogging, ControllerState::Pulsing] {
        assert!(seen[state as usize] > 0, "{state:?} never came up: {seen:?}");
    }
    for end in [MotionEnd::Reached, MotionEnd::DeadMan] {
        assert!(ends.contains(&(end as u32)), "{end:?} is not among {ends:?}");
    }
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
            55 => Some((OperatorVerb::Override, 0.8)),
            58 => Some((OperatorVerb::Power, 0.5)),
            60 => Some((OperatorVerb::Override, 1.5)),
            120 => Some((OperatorVerb::Power, 2.0)),
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
            slow: 0,
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
