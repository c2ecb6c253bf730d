//! Operating a machine on the simulated chain: homing, jogging, stops, door, test pulse, probe, and a thousand
//! random sequences of requests.

#![allow(missing_docs, unreachable_pub, clippy::unwrap_used)]

mod cell;
mod homing;
mod random;

use cell::{CHILLER, Cell, DOOR, ESTOP, X, Y, machine};
use messages::OperatorVerb::{
    Enable, Home, Jog, JogOn, Probe, Reset, Start, Step, Stop, TestPulse,
};
use messages::{CommandMode, ControllerState as State, FaultCode, MotionEnd, Refusal};

#[test]
fn a_machine_starts_unhomed_finds_its_references_and_goes_home() {
    let machine = machine("");
    let mut cell = Cell::enabled(&machine);
    assert_eq!(cell.progress.homed & 3, 0);
    assert_eq!(cell.refuse(Start, 0, 1.0, 0.0), Refusal::NotHomed);
    cell.accept(Home, 0, 0.0, 0.0);
    assert_eq!(cell.state(), State::Homing);
    assert_eq!(cell.refuse(Start, 0, 1.0, 0.0), Refusal::State);
    cell.until(State::Idle, 60_000);
    assert_eq!(cell.progress.homed & 3, 3);
    // The switch is found to half of what the axis moves in a cycle, and a count; the index likewise, but where
    // it is nobody has said.
    assert!((cell.truth(0) - 0.1).abs() < 3e-6, "{}", cell.truth(0));
    assert!((cell.place(0) - 0.1).abs() < 1e-12);
    cell.accept(Start, 0, 1.0, 0.0);
    cell.accept(Stop, 0, 0.0, 0.0);
}

#[test]
fn homing_repeats_within_a_count_and_one_axis_can_be_homed_alone() {
    let machine = machine("");
    let mut cell = Cell::homed(&machine);
    let before = [cell.truth(0), cell.truth(1)];
    cell.accept(Home, 0b10, 0.0, 0.0);
    cell.run(5);
    assert_eq!(cell.progress.homed & 3, 0b01, "x keeps its place");
    cell.until(State::Idle, 60_000);
    let count = machine.actuators[1].count();
    assert!((cell.truth(1) - before[1]).abs() < 2e-6 + count, "{} {}", cell.truth(1), before[1]);
    assert!((cell.truth(0) - before[0]).abs() < count);
}

#[test]
fn an_axis_that_stands_on_its_switch_is_homed_too_and_a_missing_switch_is_a_fault() {
    let mut machine = machine("");
    for input in &mut machine.operating.inputs {
        if input.name == "x_home" {
            input.simulated.as_mut().unwrap().at = 0.12;
        }
    }
    machine.operating.homing[0].as_mut().unwrap().position = 0.12;
    let mut cell = Cell::homed(&machine);
    assert!((cell.truth(0) - 0.1).abs() < 3e-6, "{}", cell.truth(0));
    for input in &mut machine.operating.inputs {
        if input.name == "x_home" {
            input.simulated = None;
        }
        if input.name == "x_min" {
            input.simulated.as_mut().unwrap().at = -10.0;
        }
    }
    cell = Cell::enabled(&machine);
    cell.accept(Home, 0b01, 0.0, 0.0);
    cell.until(State::Faulted, 20_000);
    assert_eq!(cell.outputs.command.fault.code(), FaultCode::HomingFailed);
}

#[test]
fn a_jog_lives_no_longer_than_its_dead_man_and_its_way_to_rest() {
    let machine = machine("");
    let mut cell = Cell::homed(&machine);
    let speed = 0.1;
    // Kept alive for half a second, and then left alone.
    let number = f64::from(cell.ask(Jog, X, speed, 0.0).number);
    for _ in 0..10 {
        cell.accept(JogOn, X, number, 0.0);
        cell.run(49);
    }
    let place = cell.place(0);
    assert_eq!(cell.state(), State::Jogging);
    cell.until(State::Idle, 1000);
    assert_eq!(cell.end(), MotionEnd::DeadMan);
    assert_eq!(cell.refuse(JogOn, X, number, 0.0), Refusal::Ended, "it is not begun anew");
    let way = cell.place(0) - place;
    let pace = controller::travel::Pace::new(&machine, &machine.axes[0]);
    let stopping =
        speed * (3.0 * speed / pace.acceleration).max((6.0 * speed / pace.jerk).sqrt()) / 2.0;
    let most = speed * (machine.operating.safety.dead_man + 3e-3) + stopping;
    assert!(way > speed * machine.operating.safety.dead_man - 0.01 && way <= most, "{way} {most}");
    // A jog that is told to stop does so at once.
    cell.accept(Jog, X, -speed, 0.0);
    cell.run(180);
    let place = cell.place(0);
    cell.accept(Jog, X, 0.0, 0.0);
    cell.until(State::Idle, 1000);
    assert!(place - cell.place(0) <= stopping + 1e-3);
}

#[test]
fn a_jog_that_was_stopped_does_not_go_on_however_often_it_is_asked_for() {
    let machine = machine("");
    let mut cell = Cell::homed(&machine);
    let number = f64::from(cell.ask(Jog, X, 0.1, 0.0).number);
    cell.run(100);
    cell.accept(Stop, 0, 0.0, 0.0);
    assert_eq!(cell.refuse(Jog, X, 0.1, 0.0), Refusal::State, "it comes to rest first");
    let mut cycles = 0;
    while cell.state() != State::Idle {
        assert_eq!(cell.refuse(JogOn, X, number, 0.0), Refusal::Ended);
        cycles += 1;
        assert!(cycles < 1000);
    }
    assert_eq!(cell.end(), MotionEnd::Stopped);
    cell.run(6);
    let place = cell.place(0);
    assert_eq!(cell.refuse(JogOn, X, number, 0.0), Refusal::Ended);
    cell.run(100);
    assert_eq!(cell.place(0), place);
    // Another jog is not kept up by who asked for the first.
    cell.accept(Jog, X, -0.1, 0.0);
    assert_eq!(cell.refuse(JogOn, X, number, 0.0), Refusal::Ended);
}

#[test]
fn a_jog_stops_at_the_soft_limit_and_a_step_beyond_it_is_refused_with_the_limit() {
    let machine = machine("");
    let mut cell = Cell::homed(&machine);
    let upper = machine.axes[0].limits.position[1];
    let number = f64::from(cell.ask(Jog, X, 0.1, 0.0).number);
    for _ in 0..40 {
        cell.ask(JogOn, X, number, 0.0);
        cell.run(49);
        assert!(cell.place(0) <= upper);
    }
    assert!(cell.place(0) > upper - 1e-3, "{}", cell.place(0));
    assert_eq!((cell.state(), cell.end()), (State::Idle, MotionEnd::SoftLimit));
    let reply = cell.ask(Step, X, 0.01, 0.05);
    assert_eq!((reply.accepted, Refusal::from_wire(reply.refusal)), (0, Refusal::SoftLimit));
    assert!(reply.limit == upper && reply.axis == X && reply.found > upper);
    cell.run(500);
    let place = cell.place(0);
    cell.accept(Step, X, -0.0125, 0.05);
    cell.until(State::Idle, 5000);
    let off = cell.place(0) - place + 0.0125;
    assert!(off.abs() < 1e-9, "{off}");
    assert_eq!(cell.refuse(Step, X, 0.01, 99.0), Refusal::TooLarge);
    assert_eq!(cell.refuse(Step, 3, 0.01, 0.1), Refusal::NoAxis);
    assert_eq!(cell.refuse(Jog, Y, f64::NAN, 0.0), Refusal::NotANumber);
}

#[test]
fn an_unhomed_jog_is_stopped_by_the_limit_switch_and_gets_away_from_it() {
    let machine = machine("");
    let mut cell = Cell::enabled(&machine);
    let number = f64::from(cell.ask(Jog, X, 0.1, 0.0).number);
    for _ in 0..100 {
        cell.ask(JogOn, X, number, 0.0);
        cell.run(49);
    }
    cell.until(State::Faulted, 100);
    assert_eq!(cell.end(), MotionEnd::Fault);
    let fault = cell.outputs.command.fault;
    assert_eq!((fault.code(), fault.axis), (FaultCode::HardLimit, 1));
    assert!((0.206..0.21).contains(&cell.truth(0)), "{}", cell.truth(0));
    cell.accept(Reset, 0, 0.0, 0.0);
    cell.run(3);
    cell.accept(Enable, 0, 0.0, 0.0);
    cell.until(State::Idle, 3000);
    assert_eq!(cell.refuse(Jog, X, 0.05, 0.0), Refusal::LimitSwitch);
    cell.accept(Step, X, -0.01, 0.05);
    cell.until(State::Idle, 5000);
    assert!(cell.truth(0) < 0.204);
}

#[test]
fn an_emergency_stop_follows_its_category() {
    for category in 0..3 {
        let machine = machine(&format!("[safety]\nestop = {category}\n"));
        let mut cell = Cell::homed(&machine);
        cell.accept(Step, X, 0.05, 0.1);
        cell.run(300);
        cell.bridge.set_inputs(ESTOP);
        cell.run(2);
        let modes = [CommandMode::Disabled, cell.before[0].mode(), cell.before[0].mode()];
        assert_eq!(cell.outputs.command.mode(), modes[category], "category {category}");
        cell.until(if category == 2 { State::Halted } else { State::Faulted }, 1000);
        assert_eq!(cell.outputs.command.fault.code(), FaultCode::EmergencyStop);
        assert_eq!(cell.outputs.command.mode() == CommandMode::Disabled, category < 2);
        assert_eq!(cell.refuse(Reset, 0, 0.0, 0.0), Refusal::EmergencyStop);
        cell.bridge.set_inputs(0);
        cell.run(500);
        cell.accept(Reset, 0, 0.0, 0.0);
        if category < 2 {
            cell.run(3);
            cell.accept(Enable, 0, 0.0, 0.0);
        }
        cell.until(State::Idle, 3000);
        assert_eq!(cell.progress.homed & 3, 3, "its place is kept");
    }
}

#[test]
fn an_open_door_stops_axes_and_test_pulses_and_refuses_both() {
    let machine = machine("");
    let mut cell = Cell::homed(&machine);
    cell.accept(Step, X, 0.05, 0.1);
    cell.run(200);
    cell.bridge.set_inputs(DOOR);
    cell.until(State::Idle, 500);
    assert_eq!(cell.end(), MotionEnd::DoorOpen);
    assert!(cell.place(0) < 0.15 - 1e-3, "it did not go on");
    for (verb, axis, value, second) in
        [(Home, 0, 0.0, 0.0), (Jog, X, 0.1, 0.0), (TestPulse, 0, 0.05, 0.01), (Start, 0, 1.0, 0.0)]
    {
        assert_eq!(cell.refuse(verb, axis, value, second), Refusal::DoorOpen, "{verb:?}");
    }
    cell.bridge.set_inputs(CHILLER);
    cell.run(2);
    assert_eq!(cell.refuse(TestPulse, 0, 0.05, 0.01), Refusal::Interlock);
    cell.accept(Step, X, 0.01, 0.1);
}

#[test]
fn a_test_pulse_is_bounded_in_power_and_time_and_goes_out_with_the_door() {
    let machine = machine("");
    let mut cell = Cell::enabled(&machine);
    assert_eq!(cell.refuse(TestPulse, 0, 0.11, 0.01), Refusal::Power);
    assert_eq!(cell.refuse(TestPulse, 0, 0.1, 0.11), Refusal::Time);
    assert_eq!(cell.refuse(TestPulse, 0, 0.1, -1.0), Refusal::Time);
    cell.accept(TestPulse, 0, 0.1, 0.0125);
    let mut lit = 0.0;
    for _ in 0..40 {
        lit += lit_time(&cell);
        cell.run(1);
    }
    assert!((lit - 12.5e-3).abs() < 1e-9, "{lit}");
    assert_eq!(cell.state(), State::Idle);
    cell.accept(TestPulse, 0, 0.1, 0.1);
    cell.run(20);
    assert!(cell.outputs.command.laser.is_lit());
    cell.bridge.set_inputs(DOOR);
    cell.run(1);
    assert!(!cell.outputs.command.laser.is_lit(), "with the first command after it was seen");
    cell.until(State::Idle, 10);
}

/// How long the light of the newest feedback was on [s].
fn lit_time(cell: &Cell) -> f64 {
    let laser = &cell.feedback().laser;
    let (mut gate, mut from, mut lit) = (laser.gate, 0, 0);
    for edge in laser.edges() {
        lit += if gate != 0 { edge.offset - from } else { 0 };
        (gate, from) = (edge.gate, edge.offset);
    }
    f64::from(lit + if gate != 0 { 1_000_000 - from } else { 0 }) * 1e-9
}

#[test]
fn a_probe_is_found_where_it_is_and_the_way_to_it_is_bounded() {
    let machine = machine("");
    let mut cell = Cell::homed(&machine);
    cell.accept(Probe, X, 0.03, 0.01);
    cell.until(State::Idle, 10_000);
    assert_eq!((cell.progress.probed_axis, cell.end()), (0, MotionEnd::NotTouched));
    assert!((cell.place(0) - 0.13).abs() < 1e-3 && cell.place(0) <= 0.13);
    cell.accept(Probe, X, 0.03, 0.01);
    cell.until(State::Idle, 10_000);
    assert_eq!((cell.progress.probed_axis, cell.end()), (X, MotionEnd::Reached));
    assert!((cell.progress.probed - 0.15).abs() < 15e-6, "{}", cell.progress.probed);
    assert_eq!(cell.refuse(Probe, X, 0.03, 0.01), Refusal::Touching);
}
