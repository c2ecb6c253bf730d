//! The HostMot2 port on the emulated board, in virtual time.

#![allow(dead_code, reason = "each test binary uses its own part")]
#![allow(unreachable_pub)]

use drives::PortError;
use drives::hostmot2::Hostmot2Port;
use emulators::cable::{Bench, Cable};
use emulators::hostmot2::record::Record;
use emulators::hostmot2::rig::Rig;
use emulators::hostmot2::spaces::Identity;
use emulators::hostmot2::wiring::Wiring;
use emulators::hostmot2::{Board, Emulator, Faults};
use machine::{Machine, Override};
use messages::Nanoseconds;

/// How long a frame takes each way.
pub const FLIGHT: Nanoseconds = Nanoseconds(30_000);

/// The port, the cable and the board.
pub type OnBoard = Bench<Hostmot2Port, Emulator>;

/// A machine file that ships, with these settings.
pub fn shipped(name: &str, settings: &[&str]) -> Machine {
    let path = format!("{}/../machines/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let settings: Result<Vec<Override>, _> = settings.iter().map(|it| it.parse()).collect();
    Machine::load(path.as_ref(), &settings.expect("settings")).expect("the machine")
}

/// The board of `machine` at the end of a cable, with these faults on the way.
pub fn cable(machine: &Machine, faults: &Faults) -> Cable<Emulator> {
    let wiring = Wiring::of(machine);
    let rig = Rig::new(machine, &wiring).expect("a rig");
    let board = Board::new(Identity::default()).with_machine(rig, &wiring, Record::with_way());
    Cable::new(Emulator::new(board, faults, FLIGHT))
}

/// The same with the port that the machine file asks for, open.
pub fn open(machine: Machine, faults: &Faults) -> Result<OnBoard, PortError> {
    let cable = cable(&machine, faults);
    let port = Hostmot2Port::of(&machine)?.with_link(Box::new(cable.clone()));
    Bench::open(machine, cable, port)
}

/// What a board tells of itself beyond what all hardware does.
pub trait BoardCable {
    /// Steps of the first step generator so far.
    fn delivered(&self) -> f64;
    /// Its steps per second.
    fn speed(&self) -> f64;
    /// When the watchdog has bitten.
    fn bites(&self) -> Vec<Nanoseconds>;
}

impl BoardCable for Cable<Emulator> {
    fn delivered(&self) -> f64 {
        self.with(|emulator, _| emulator.board().modules().stepgens.delivered(0))
    }

    fn speed(&self) -> f64 {
        self.with(|emulator, _| emulator.board().modules().stepgens.speed(0))
    }

    fn bites(&self) -> Vec<Nanoseconds> {
        self.with(|emulator, _| emulator.board().record().bites.clone())
    }
}
