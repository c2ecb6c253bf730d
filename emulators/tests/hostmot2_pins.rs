//! Inputs and outputs of the machine file on pins of the emulated HostMot2 board, and the words by which the board's
//! own faults are told.

mod board;

use board::{BoardCable, OnBoard};
use drives::{Actuation, Measurement, Port, PortError};
use emulators::hostmot2::spaces::Identity;
use emulators::hostmot2::{Board, Emulator, Faults};
use machine::Machine;
use machine::drives::fault_text;
use messages::{CommandMode, FaultCode, FaultQuantity, LaserCycle, Nanoseconds};

const STEPPERS: &str = include_str!("../../machines/hostmot2_steppers.toml");
const PINS: &str = r#"
[inputs.door]
function = "door"
[inputs.spare]
function = "general"
[inputs.estop]
function = "estop"
active = "low"
[outputs.air]
function = "air"
active = "low"
[outputs.brake]
function = "brake"
[outputs.lamp]
function = "general"
[drives.hostmot2.inputs]
door = { pin = 20 }
spare = { pin = 22 }
estop = { pin = 42 }
[drives.hostmot2.outputs]
air = { pin = 21 }
brake = { pin = 70 }
lamp = { pin = 71 }
"#;
const DOOR: usize = 20;
const SPARE: usize = 22;
const ESTOP: usize = 42;

fn machine(more: &str) -> Result<Machine, String> {
    Machine::parse("board.toml", &format!("{STEPPERS}{more}"), &[]).map_err(|error| {
        let told: Vec<String> = error.problems().map(|problem| problem.message()).collect();
        told.join("; ")
    })
}

/// An open port on the board of a machine, at deadlines.
fn open(more: &str) -> Result<OnBoard, PortError> {
    board::open(machine(more).expect("the machine"), &Faults::default())
}

fn on_board<T>(bench: &OnBoard, look: impl FnOnce(&mut Board) -> T) -> T {
    bench.cable.with(|emulator, _| look(emulator.board_mut()))
}

/// `cycles` at home with these outputs; what was measured in the last.
fn run(bench: &mut OnBoard, mode: CommandMode, outputs: u64, cycles: u32) -> Measurement {
    let standing = bench.driven(0.0, 0.0, LaserCycle::OFF);
    bench.cycles(&Actuation { mode, outputs, ..standing }, cycles);
    bench.measurement
}

/// Levels of the pins of air, brake and lamp.
fn levels(bench: &OnBoard) -> [bool; 3] {
    on_board(bench, |board| [21, 70, 71].map(|pin| board.modules().pins.level(pin, false)))
}

/// The text of the fault word that is measured, and the actuator that it is of, none.
fn told(bench: &OnBoard, measurement: &Measurement) -> Option<&'static str> {
    let fault = measurement.fault;
    assert_eq!((fault.code(), fault.actuator), (FaultCode::DriveFault, 0));
    assert_eq!(fault.quantity(), FaultQuantity::DriveWord);
    fault_text(&bench.machine.drives.kind, fault.value as u32)
}

#[test]
fn inputs_are_active_by_their_level() {
    let mut bench = open(PINS).expect("an open port");
    for (door, estop, active) in [(false, true, 0), (true, true, 1), (false, false, 4)] {
        on_board(&bench, |board| {
            board.drive(DOOR, door);
            board.drive(ESTOP, estop);
            board.drive(SPARE, false);
        });
        let measured = run(&mut bench, CommandMode::Disabled, 0, 2);
        assert_eq!(measured.inputs, active, "door {door}, emergency stop {estop}");
    }
}

#[test]
fn outputs_have_the_level_of_their_bit_and_are_high_after_a_bite() {
    let mut bench = open(PINS).expect("an open port");
    // Off from the start: air by a high level, the others by a low one.
    assert_eq!(levels(&bench), [true, false, false]);
    run(&mut bench, CommandMode::Driven, 0b001, 2);
    assert_eq!(levels(&bench), [false, false, false]);
    run(&mut bench, CommandMode::Driven, 0b110, 2);
    assert_eq!(levels(&bench), [true, true, true]);
    run(&mut bench, CommandMode::Disabled, 0b000, 2);
    assert_eq!(levels(&bench), [true, false, false]);
    // Without a word the watchdog makes inputs of them, which are pulled high.
    bench.die(20);
    assert_eq!((levels(&bench), bench.cable.bites().len()), ([true; 3], 1));
}

#[test]
fn a_pin_that_is_taken_or_not_there_is_named() {
    for (pin, name) in [(0, "a step pin"), (72, "beyond the board"), (20, "an output already")] {
        let more = PINS.replace("lamp = { pin = 71 }", &format!("lamp = {{ pin = {pin} }}"));
        let more = more.replace("air = { pin = 21 }", "air = { pin = 20 }");
        let more = more.replace("door = { pin = 20 }", "door = { pin = 23 }");
        let error = open(&more).err().map(|error| error.to_string()).unwrap_or_default();
        let (pins, what) = ("the pins 0 to 71", format!("pin {pin} as `lamp`"));
        assert!(error.contains(pins) && error.contains(&what), "{name}: {error}");
    }
}

#[test]
fn a_pin_of_nothing_a_switch_without_one_and_an_index_pulse_are_refused() {
    let without = machine(&PINS.replace("estop = { pin = 42 }", "")).expect_err("refused");
    assert!(without.contains("nothing is said of where the input `estop` is"), "{without}");
    let unknown = machine(&format!("{PINS}dorr = {{ pin = 12 }}\n")).expect_err("refused");
    assert!(unknown.contains("the machine has no output `dorr`"), "{unknown}");
    let index = PINS.replace("function = \"door\"", "function = \"index\"\naxis = \"x\"");
    let index = machine(&index).expect_err("refused");
    assert!(index.contains("index pulse `door` is shorter than a cycle"), "{index}");
}

#[test]
fn the_boards_faults_are_told_in_words() {
    let mut bench = open("").expect("an open port");
    run(&mut bench, CommandMode::Driven, 0, 100);
    for _ in 0..15 {
        bench.pass(&Actuation::DISABLED);
    }
    let bitten = run(&mut bench, CommandMode::Driven, 0, 3);
    assert_eq!(told(&bench, &bitten), Some("the card's watchdog has bitten"));
    assert!(!run(&mut bench, CommandMode::Disabled, 0, 5).fault.is_some());

    let mut bench = open("").expect("an open port");
    run(&mut bench, CommandMode::Driven, 0, 100);
    // Its power was gone for a moment.
    bench.cable.with(|emulator, now| {
        let mut other = Board::new(Identity::default());
        other.advance(now);
        *emulator = Emulator::new(other, &Faults::default(), board::FLIGHT);
    });
    let reset = run(&mut bench, CommandMode::Driven, 0, 3);
    let text = told(&bench, &reset).unwrap_or_default();
    assert!(text.starts_with("the card was reset"), "{text}");
    // It stays one that does not know us.
    run(&mut bench, CommandMode::Disabled, 0, 5);
    assert!(run(&mut bench, CommandMode::Driven, 0, 5).fault.is_some());

    let mut bench = open("").expect("an open port");
    run(&mut bench, CommandMode::Driven, 0, 100);
    let silent = Faults { silent_from: Some(Nanoseconds(0)), ..Faults::default() };
    let nobody = Emulator::new(Board::new(Identity::default()), &silent, board::FLIGHT);
    bench.cable.with(|emulator, _| *emulator = nobody);
    let silent = run(&mut bench, CommandMode::Driven, 0, 10);
    assert_eq!(told(&bench, &silent), Some("the card does not answer"));
}
