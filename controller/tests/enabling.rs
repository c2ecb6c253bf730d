//! Enabling a machine with a weight: the motors bear it before their brakes open, all axes have come to
//! rest in their places before the machine counts as enabled, and one that does not is named.

#![allow(clippy::unwrap_used)]

mod support;

use controller::{Controller, Inputs, Outputs, Peers};
use machine::{HoldingBrake, Machine};
use messages::feedback::status;
use messages::math;
use messages::time::{SETPOINT_PERIOD as CYCLE_PERIOD, SETPOINT_TIME as CYCLE_TIME};
use messages::{
    ActuatorArray, Command, CommandMode, ControllerState, FaultCode, FaultQuantity, Feedback,
    MAX_ACTUATORS, OperatorRequest, OperatorVerb,
};
use runtime::allocation::{Allocations, CountingAllocator};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// The slide of the serial arm: 0.5 kg on a screw of 10 mm/rev, held by a brake that takes 20 ms.
const SLIDE: usize = 2;

/// Cycles from the power to the open brake, with those that the controller adds.
const RELEASE: usize = 22;

/// Cycles that all axes must have stood for.
const STANDING: usize = 20;

/// A controller on drives that obey one cycle later, and axes that stand where the test has them.
struct Rig {
    controller: Controller,
    feedback: Feedback,
    outputs: Outputs,
    /// Where the motors stand at home [rad].
    home: ActuatorArray,
    /// When the power is on.
    power: Power,
}

/// When the motors have power.
#[derive(Clone, Copy, PartialEq)]
enum Power {
    /// From the cycle after it was asked for.
    Asked,
    Always,
    Never,
}

impl Rig {
    fn new(machine: &Machine) -> Self {
        let mut home = ActuatorArray::default();
        let joints = machine.actuators.iter().zip(&machine.home_joints);
        home.iter_mut().zip(joints).for_each(|(angle, (it, joint))| *angle = joint / it.ratio);
        let feedback = Feedback { epoch: 5, position: home, ..Feedback::default() };
        let controller = Controller::new(machine);
        Self { controller, feedback, outputs: Outputs::default(), home, power: Power::Asked }
    }

    /// One cycle with the slide `away` from home [rad].
    fn cycle(&mut self, verb: Option<OperatorVerb>, away: f64) -> &Command {
        let mode = self.outputs.command.mode();
        let feedback = &mut self.feedback;
        feedback.cycle = feedback.cycle.next();
        feedback.deadline = feedback.deadline + CYCLE_PERIOD;
        let is_powered = match self.power {
            Power::Asked => mode != CommandMode::Disabled,
            Power::Always => true,
            Power::Never => false,
        };
        feedback.status = if is_powered { status::POWERED } else { 0 };
        let before = feedback.position[SLIDE];
        feedback.position[SLIDE] = self.home[SLIDE] + away;
        feedback.velocity[SLIDE] = (feedback.position[SLIDE] - before) / CYCLE_TIME;
        let request = verb.map(|verb| OperatorRequest {
            verb: verb as u32,
            ticket: 1,
            value: 0.0,
            ..OperatorRequest::default()
        });
        let now = feedback.deadline;
        let peers = Peers::default();
        let inputs = Inputs { feedback, received: now, setpoints: &[], request, peers, slow: 0 };
        let ((), asked) = Allocations::during(|| {
            self.controller.step(now, &inputs, &mut self.outputs);
        });
        assert_eq!(asked, Allocations::default(), "a step allocates");
        &self.outputs.command
    }

    /// Asked to enable its axes at home, which are not powered yet.
    fn asked(machine: &Machine) -> Self {
        let mut rig = Self::new(machine);
        rig.cycle(None, 0.0);
        rig.cycle(Some(OperatorVerb::Enable), 0.0);
        rig
    }

    /// Cycles until it is no more enabling, with the slide `away` [rad] by the cycle.
    fn enabling(&mut self, away: impl Fn(usize) -> f64) -> usize {
        (1..3000)
            .find(|cycle| self.cycle(None, away(*cycle)).state() != ControllerState::Enabling)
            .unwrap()
    }

    /// The actuator, quantity, value and limit of the fault.
    fn fault(&self) -> (u16, FaultQuantity, f64, f64) {
        let fault = &self.outputs.command.fault;
        assert_eq!(fault.code(), FaultCode::DriveFault);
        (fault.actuator, fault.quantity(), fault.value, fault.limit().unwrap())
    }
}

fn serial() -> Machine {
    support::load("serial.toml")
}

#[test]
fn the_weight_is_borne_from_the_first_voltage_on() {
    let machine = serial();
    let motor = *machine.actuators[SLIDE].motor.dc().unwrap();
    let torque = 0.5 * 9.80665 * machine.actuators[SLIDE].ratio;
    let volts = motor.voltage(torque / motor.torque_constant, 0.0, 0.0);
    let mut rig = Rig::new(&machine);
    assert_eq!(rig.cycle(None, 0.0).voltage, [0.0; MAX_ACTUATORS], "unpowered");
    let mut current = 0.0;
    for cycle in 0..200 {
        let verb = (cycle == 0).then_some(OperatorVerb::Enable);
        rig.feedback.current[SLIDE] = current;
        let command = *rig.cycle(verb, 0.0);
        assert!(
            (command.voltage[SLIDE] - volts).abs() < 1e-4,
            "{cycle}: {}",
            command.voltage[SLIDE]
        );
        assert!(command.voltage[0].abs() + command.voltage[1].abs() < 1e-9, "{cycle}");
        // The winding of a motor that stands, from the cycle after its first voltage on.
        if cycle > 0 {
            let keep = math::exp(-CYCLE_TIME * motor.resistance / motor.inductance);
            current = keep * current + (1.0 - keep) * volts / motor.resistance;
        }
    }
    assert_eq!(rig.outputs.command.state(), ControllerState::Idle);
}

#[test]
fn it_waits_for_the_slowest_brake() {
    let mut machine = serial();
    assert_eq!(Rig::asked(&machine).enabling(|_| 0.0), 1 + RELEASE + STANDING);
    machine.actuators[0].brake = HoldingBrake { torque: 0.1, release: 0.2 };
    assert_eq!(Rig::asked(&machine).enabling(|_| 0.0), 1 + 202 + STANDING);
    machine.actuators.iter_mut().for_each(|it| it.brake.release = 0.0);
    assert_eq!(Rig::asked(&machine).enabling(|_| 0.0), 1 + 2 + STANDING);
    // Without a brake there is nothing to wait for.
    machine.actuators.iter_mut().for_each(|it| it.brake.torque = 0.0);
    assert_eq!(Rig::asked(&machine).enabling(|_| 0.0), 1 + STANDING);
}

#[test]
fn an_axis_that_gives_way_is_waited_for_until_it_has_come_back() {
    let machine = serial();
    let ratio = machine.actuators[SLIDE].ratio;
    // The brake opens, and it sinks by 40 µm in 20 ms, and comes back in 200.
    let back = 10 + 20 + 200;
    let away = |cycle: usize| match cycle {
        0..=10 => 0.0,
        11..=30 => -2e-6 * (cycle - 10) as f64 / ratio,
        _ => -0.2e-6 * back.max(cycle).abs_diff(cycle).min(200) as f64 / ratio,
    };
    let mut rig = Rig::asked(&machine);
    let ended = rig.enabling(away);
    // 5 µm are the path's tolerance.
    assert_eq!(rig.outputs.command.state(), ControllerState::Idle);
    assert!(ended.abs_diff(back - 25 + STANDING) <= 1, "{ended}");
}

#[test]
fn an_axis_that_stays_away_or_moves_on_is_named() {
    let machine = serial();
    let ratio = machine.actuators[SLIDE].ratio;
    let mut rig = Rig::asked(&machine);
    let ended = rig.enabling(|cycle| if cycle < 10 { 0.0 } else { -6e-6 / ratio });
    assert!((1000..1050).contains(&ended), "{ended}");
    let (axis, quantity, value, limit) = rig.fault();
    assert_eq!((axis, quantity), (SLIDE as u16 + 1, FaultQuantity::HoldDistance));
    assert!((value - 6e-6).abs() < 1e-9 && (limit - 5e-6).abs() < 1e-9, "{value} {limit}");

    // Within the tolerance, but by two counts there and back in every cycle.
    let count = machine.actuators[SLIDE].encoder.resolution();
    let mut rig = Rig::asked(&machine);
    rig.enabling(|cycle| if cycle < 10 || cycle % 2 == 0 { 0.0 } else { 2.0 * count });
    let (axis, quantity, value, limit) = rig.fault();
    assert_eq!((axis, quantity), (SLIDE as u16 + 1, FaultQuantity::Velocity));
    assert!((value / limit - 2.0 / 1.5).abs() < 1e-6, "{value} {limit}");
}

#[test]
fn an_axis_that_sinks_before_the_power_comes_is_named_at_once() {
    let mut machine = serial();
    let count = machine.actuators[SLIDE].encoder.resolution();
    // With its brake, two counts are no more than where the brake lets it rest.
    assert_eq!(Rig::asked(&machine).enabling(|_| -2.0 * count), 2 + RELEASE + STANDING);
    machine.actuators[SLIDE].brake.torque = 0.0;
    let mut rig = Rig::asked(&machine);
    assert_eq!(rig.enabling(|_| -2.0 * count), 1);
    let (axis, quantity, value, limit) = rig.fault();
    assert_eq!((axis, quantity), (SLIDE as u16 + 1, FaultQuantity::HoldDistance));
    let counts = [value, limit].map(|distance| distance / machine.actuators[SLIDE].ratio / count);
    assert!((counts[0] - 2.0).abs() < 1e-6 && (counts[1] - 1.5).abs() < 1e-6, "{counts:?}");
}

#[test]
fn a_motor_that_has_power_already_is_given_its_weight_first() {
    let machine = serial();
    let motor = *machine.actuators[SLIDE].motor.dc().unwrap();
    let torque = 0.5 * 9.80665 * machine.actuators[SLIDE].ratio;
    let volts = motor.voltage(torque / motor.torque_constant, 0.0, 0.0);
    let mut rig = Rig::new(&machine);
    rig.power = Power::Always;
    rig.cycle(None, 0.0);
    for cycle in 0..100 {
        rig.feedback.current[SLIDE] = volts / motor.resistance;
        let verb = (cycle == 0).then_some(OperatorVerb::Enable);
        let given = rig.cycle(verb, 0.0).voltage[SLIDE];
        assert!((given - volts).abs() < 1e-4, "{cycle}: {given} V");
    }
    assert_eq!(rig.outputs.command.state(), ControllerState::Idle);
}

#[test]
fn an_axis_that_is_moved_before_the_power_comes_is_waited_for() {
    let machine = serial();
    let ratio = machine.actuators[SLIDE].ratio;
    let mut rig = Rig::asked(&machine);
    // Pushed by 1 mm through its brake, from before the power comes on.
    let ended = rig.enabling(|cycle| 20e-6 * cycle.min(50) as f64 / ratio);
    assert_eq!(rig.outputs.command.state(), ControllerState::Idle);
    assert_eq!(ended, 50 + 1 + RELEASE + STANDING);
}

#[test]
fn what_fails_before_the_power_comes_stays_without() {
    let machine = serial();
    let mut rig = Rig::asked(&machine);
    rig.power = Power::Never;
    rig.enabling(|_| 0.0);
    let command = &rig.outputs.command;
    assert_eq!(command.state(), ControllerState::Faulted);
    assert_eq!((command.mode(), command.voltage), (CommandMode::Disabled, [0.0; MAX_ACTUATORS]));
    let (_, quantity, _, limit) = rig.fault();
    assert_eq!((quantity, limit), (FaultQuantity::Cycles, 1000.0 + RELEASE as f64));
}

#[test]
fn no_voltage_is_given_where_a_position_is_no_number() {
    let machine = serial();
    let mut rig = Rig::asked(&machine);
    rig.enabling(|_| 0.0);
    let last = rig.outputs.command;
    assert!(last.state() == ControllerState::Idle && last.voltage[SLIDE] != 0.0);
    let mut states = Vec::new();
    for cycle in 0..1200 {
        let verb = match cycle {
            1100 => Some(OperatorVerb::Reset),
            1101 => Some(OperatorVerb::Enable),
            _ => None,
        };
        let command = rig.cycle(verb, f64::NAN);
        assert_eq!(command.voltage, [0.0; MAX_ACTUATORS], "{cycle}");
        states.push(command.state());
    }
    assert_eq!(states[1100], ControllerState::Disabled);
    assert!(states[1102..].iter().all(|state| *state != ControllerState::Idle));
}
