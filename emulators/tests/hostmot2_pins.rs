//! Inputs and outputs of the machine file on pins of the emulated HostMot2 board, and the words by which the board's
//! own faults are told.

mod board;

use board::{Cable, World};
use drives::hostmot2::Hostmot2Port;
use drives::{Actuation, Freshness, Measurement, Port, PortError};
use emulators::hostmot2::spaces::Identity;
use emulators::hostmot2::{Board, Emulator, Faults};
use machine::Machine;
use machine::drives::fault_text;
use messages::{CommandMode, FaultCode, FaultQuantity, Nanoseconds};

const PERIOD: i64 = 1_000_000;
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
struct Bench {
    machine: Machine,
    cable: Cable,
    port: Hostmot2Port,
    deadline: i64,
}

impl Bench {
    fn new(more: &str) -> Result<Self, PortError> {
        let machine = machine(more).expect("the machine");
        let cable = Cable::new(&machine, &Faults::default());
        let mut port = Hostmot2Port::of(&machine)?.with_link(Box::new(cable.clone()));
        port.open()?;
        let deadline = (cable.now().0 / PERIOD + 2) * PERIOD;
        Ok(Self { machine, cable, port, deadline })
    }

    fn board<T>(&self, look: impl FnOnce(&mut Board) -> T) -> T {
        self.cable.with(|World { emulator, .. }| look(emulator.board_mut()))
    }

    /// `cycles` with these outputs; what was measured in the last.
    fn run(&mut self, mode: CommandMode, outputs: u64, cycles: u32) -> Measurement {
        let freshness = Freshness::Fresh;
        let mut actuation = Actuation { freshness, mode, outputs, ..Actuation::DISABLED };
        for (place, actuator) in actuation.position.iter_mut().zip(&self.machine.actuators) {
            *place = self.machine.home_joints[actuator.axis] / actuator.ratio;
        }
        let mut measurement = Measurement::default();
        for _ in 0..cycles {
            self.cable.until(Nanoseconds(self.deadline));
            self.port.exchange(&actuation, &mut measurement);
            self.deadline += PERIOD;
        }
        measurement
    }

    /// Levels of the pins of air, brake and lamp.
    fn levels(&self) -> [bool; 3] {
        self.board(|board| [21, 70, 71].map(|pin| board.modules().pins.level(pin, false)))
    }

    /// The text of the fault word that is measured, and the actuator that it is of, none.
    fn told(&self, measurement: &Measurement) -> Option<&'static str> {
        let fault = measurement.fault;
        assert_eq!((fault.code(), fault.actuator), (FaultCode::DriveFault, 0));
        assert_eq!(fault.quantity(), FaultQuantity::DriveWord);
        fault_text(&self.machine.drives.kind, fault.value as u32)
    }
}

#[test]
fn inputs_are_active_by_their_level() {
    let mut bench = Bench::new(PINS).expect("an open port");
    for (door, estop, active) in [(false, true, 0), (true, true, 1), (false, false, 4)] {
        bench.board(|board| {
            board.drive(DOOR, door);
            board.drive(ESTOP, estop);
            board.drive(SPARE, false);
        });
        let measured = bench.run(CommandMode::Disabled, 0, 2);
        assert_eq!(measured.inputs, active, "door {door}, emergency stop {estop}");
    }
}

#[test]
fn outputs_have_the_level_of_their_bit_and_are_high_after_a_bite() {
    let mut bench = Bench::new(PINS).expect("an open port");
    // Off from the start: air by a high level, the others by a low one.
    assert_eq!(bench.levels(), [true, false, false]);
    bench.run(CommandMode::Driven, 0b001, 2);
    assert_eq!(bench.levels(), [false, false, false]);
    bench.run(CommandMode::Driven, 0b110, 2);
    assert_eq!(bench.levels(), [true, true, true]);
    bench.run(CommandMode::Disabled, 0b000, 2);
    assert_eq!(bench.levels(), [true, false, false]);
    // Without a word the watchdog makes inputs of them, which are pulled high.
    let later = Nanoseconds(bench.deadline + 20 * PERIOD);
    bench.cable.until(later);
    assert_eq!((bench.levels(), bench.cable.bites().len()), ([true; 3], 1));
}

#[test]
fn a_pin_that_is_taken_or_not_there_is_named() {
    for (pin, name) in [(0, "a step pin"), (72, "beyond the board"), (20, "an output already")] {
        let more = PINS.replace("lamp = { pin = 71 }", &format!("lamp = {{ pin = {pin} }}"));
        let more = more.replace("air = { pin = 21 }", "air = { pin = 20 }");
        let more = more.replace("door = { pin = 20 }", "door = { pin = 23 }");
        let error = Bench::new(&more).err().map(|error| error.to_string()).unwrap_or_default();
        let (pins, what) = ("the pins 0 to 71", format!("pin {pin} as `lamp`"));
        assert!(error.contains(pins) && error.contains(&what), "{name}: {error}");
    }
}

#[test]
fn a_pin_of_nothing_a_switch_without_one_and_an_index_pulse_are_refused() {
    let without = machine(&PINS.replace("estop = { pin = 42 }", "")).expect_err("refused");
    assert!(without.contains("nothing is said of the pin of the input `estop`"), "{without}");
    let unknown = machine(&format!("{PINS}dorr = {{ pin = 12 }}\n")).expect_err("refused");
    assert!(unknown.contains("the machine has no output `dorr`"), "{unknown}");
    let index = PINS.replace("function = \"door\"", "function = \"index\"\naxis = \"x\"");
    let index = machine(&index).expect_err("refused");
    assert!(index.contains("index pulse `door` is shorter than a cycle"), "{index}");
}

#[test]
fn the_boards_faults_are_told_in_words() {
    let mut bench = Bench::new("").expect("an open port");
    bench.run(CommandMode::Driven, 0, 100);
    for _ in 0..15 {
        bench.port.pass(&Actuation::DISABLED);
        bench.deadline += PERIOD;
    }
    let bitten = bench.run(CommandMode::Driven, 0, 3);
    assert_eq!(bench.told(&bitten), Some("the card's watchdog has bitten"));
    assert!(!bench.run(CommandMode::Disabled, 0, 5).fault.is_some());

    let mut bench = Bench::new("").expect("an open port");
    bench.run(CommandMode::Driven, 0, 100);
    // Its power was gone for a moment.
    bench.cable.with(|World { emulator, now }| {
        let mut other = Board::new(Identity::default());
        other.advance(*now);
        *emulator = Emulator::new(other, &Faults::default(), board::FLIGHT);
    });
    let reset = bench.run(CommandMode::Driven, 0, 3);
    let text = bench.told(&reset).unwrap_or_default();
    assert!(text.starts_with("the card was reset"), "{text}");
    // It stays one that does not know us.
    bench.run(CommandMode::Disabled, 0, 5);
    assert!(bench.run(CommandMode::Driven, 0, 5).fault.is_some());

    let mut bench = Bench::new("").expect("an open port");
    bench.run(CommandMode::Driven, 0, 100);
    let silent = Faults { silent_from: Some(Nanoseconds(0)), ..Faults::default() };
    let nobody = Emulator::new(Board::new(Identity::default()), &silent, board::FLIGHT);
    bench.cable.with(|world| world.emulator = nobody);
    let silent = bench.run(CommandMode::Driven, 0, 10);
    assert_eq!(bench.told(&silent), Some("the card does not answer"));
}
