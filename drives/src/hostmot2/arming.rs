//! From a board that has been found to one that drives: its pins, its clock and its watchdog.

use messages::Nanoseconds;

use super::idrom::{Board, BoardError, Kind, Module};
use super::lbp16::Request;

/// Connectors of a board at most.
pub const MOST_PORTS: usize = 10;

/// Registers of the pins.
mod pins {
    pub(super) const DATA: u16 = 0;
    pub(super) const DIRECTION: u16 = 1;
    pub(super) const SOURCE: u16 = 2;
    pub(super) const OPEN_DRAIN: u16 = 3;
    pub(super) const INVERT: u16 = 4;
}

/// Registers of the DPLL.
mod dpll {
    pub(super) const RATE: u16 = 0;
    pub(super) const CONTROL: u16 = 2;
    pub(super) const SIZE: u16 = 3;
    pub(super) const TIMERS: u16 = 4;
    pub(super) const SYNC: u16 = 6;
}

/// Registers of the watchdog.
mod watchdog {
    pub(super) const TIME: u16 = 0;
    pub(super) const STATUS: u16 = 1;
    pub(super) const FEED: u16 = 2;
}

/// What feeds the watchdog.
const FEED: u32 = 0x5a00_0000;
/// What switches it off.
const OFF: u32 = 0x8000_0000;

/// The pins that the machine uses.
#[derive(Debug, Clone)]
pub struct Pins {
    module: Module,
    width: u32,
    ports: u32,
    /// Outputs of modules, one word for each connector.
    outputs: Vec<u32>,
    /// Those of them that are low for light.
    gate: Vec<u32>,
    /// Outputs of the port itself, and their levels.
    own: Vec<u32>,
    levels: Vec<u32>,
}

impl Pins {
    /// All pins of `board` as inputs.
    ///
    /// # Errors
    /// A board without pins.
    pub fn new(board: &Board) -> Result<Self, BoardError> {
        let ports = board.ports();
        let module = board.module(Kind::IoPort, ports.saturating_sub(1))?;
        if ports as usize > MOST_PORTS {
            let what = format!("{ports} connectors, and {MOST_PORTS} are known");
            return Err(BoardError::Inconsistent { board: board.name.clone(), what });
        }
        let none = vec![0; ports as usize];
        let (outputs, gate, own) = (none.clone(), none.clone(), none.clone());
        Ok(Self { module, width: board.port_width, ports, outputs, gate, own, levels: none })
    }

    /// Makes `pin` an output of its module.
    pub fn output(&mut self, pin: u32) {
        let (port, bit) = self.place(pin);
        if let Some(word) = self.outputs.get_mut(port) {
            *word |= bit;
        }
    }

    /// Makes `pin` an output of its module that pulls its line low for light, and lets it go for darkness.
    pub fn gate(&mut self, pin: u32) {
        self.output(pin);
        let (port, bit) = self.place(pin);
        if let Some(word) = self.gate.get_mut(port) {
            *word |= bit;
        }
    }

    /// Makes `pin` an output of the port, which starts at this level; whether it is there, and nobody's output.
    pub fn own(&mut self, pin: u32, high: bool) -> bool {
        let is_free = self.is_input(pin);
        let (port, bit) = self.place(pin);
        if is_free && let Some(word) = self.own.get_mut(port) {
            *word |= bit;
        }
        self.set(pin, high);
        is_free
    }

    /// Whether `pin` is there, and nobody's output.
    pub fn is_input(&self, pin: u32) -> bool {
        let (port, bit) = self.place(pin);
        let free = |words: &[u32]| words.get(port).is_some_and(|word| word & bit == 0);
        free(&self.outputs) && free(&self.own)
    }

    /// The level of an output of the port.
    pub fn set(&mut self, pin: u32, high: bool) {
        let (port, bit) = self.place(pin);
        if let Some(word) = self.levels.get_mut(port) {
            *word = if high { *word | bit } else { *word & !bit };
        }
    }

    /// The connector of `pin`, and its bit there.
    fn place(&self, pin: u32) -> (usize, u32) {
        ((pin / self.width()) as usize, 1 << (pin % self.width()))
    }

    /// Sets all pins up; the direction comes last, so that none is driven by what it is not meant for.
    pub fn arm(&self, request: &mut Request) {
        self.write(request);
        for (port, (outputs, gate)) in (0..).zip(self.outputs.iter().zip(&self.gate)) {
            let own = self.own.get(port as usize).copied().unwrap_or(0);
            request.write(self.module.address(pins::INVERT, port), *gate);
            request.write(self.module.address(pins::OPEN_DRAIN, port), *gate);
            request.write(self.module.address(pins::SOURCE, port), *outputs);
            request.write(self.module.address(pins::DIRECTION, port), outputs | own);
        }
    }

    /// Writes the levels of the port's own outputs.
    pub fn write(&self, request: &mut Request) {
        for (port, (own, levels)) in (0..).zip(self.own.iter().zip(&self.levels)) {
            if *own != 0 {
                request.write(self.module.address(pins::DATA, port), *levels);
            }
        }
    }

    /// Makes all pins inputs again.
    pub fn release(&self, request: &mut Request) {
        for port in 0..self.ports {
            request.write(self.module.address(pins::DIRECTION, port), 0);
        }
    }

    /// Reads the levels of all pins, a word for each connector.
    pub fn ask(&self, request: &mut Request) {
        for port in 0..self.ports {
            request.read(self.module.address(pins::DATA, port), 1);
        }
    }

    /// Pins of a connector.
    pub fn width(&self) -> u32 {
        self.width.max(1)
    }

    /// Connectors.
    pub fn ports(&self) -> u32 {
        self.ports
    }

    /// The first pin of the gate that is low by the levels of [`Self::ask`].
    pub fn lit(&self, levels: &[u32]) -> Option<u32> {
        let low = |(port, (gate, levels)): (u32, (&u32, &u32))| {
            let low = gate & !levels;
            (low != 0).then(|| port * self.width + low.trailing_zeros())
        };
        (0..).zip(self.gate.iter().zip(levels)).find_map(low)
    }
}

/// The board's clock: its DPLL, which follows nobody and goes round once in a turn.
#[derive(Debug, Clone, Copy)]
pub struct BoardClock {
    module: Module,
    rate: u32,
    /// Time of a turn [s].
    pub turn: f64,
}

impl BoardClock {
    /// A clock whose turn takes about `turn` [s], by a counter of `size` bits.
    pub fn new(module: Module, turn: f64, size: u32) -> Self {
        let counter = (1_u64 << size.min(60)) as f64;
        let ticks = turn * f64::from(module.clock);
        let rate = (counter / ticks).round().clamp(1.0, f64::from(u32::MAX));
        Self { module, rate: rate as u32, turn: counter / rate / f64::from(module.clock) }
    }

    /// Reads the size of its counter, in the lowest 8 bits.
    pub fn ask_size(module: &Module, request: &mut Request) {
        request.read(module.address(dpll::SIZE, 0), 1);
    }

    /// Lets it run, with no correction.
    pub fn arm(&self, request: &mut Request) {
        request.write(self.module.address(dpll::CONTROL, 0), 1 << 24);
        request.write(self.module.address(dpll::SIZE, 0), 0xffff << 16);
        request.write(self.module.address(dpll::RATE, 0), self.rate);
    }

    /// Reads where it stands, in 2⁻³² of a turn.
    pub fn ask(&self, request: &mut Request) {
        request.read(self.module.address(dpll::SYNC, 0), 1);
    }

    /// Lets timers 1 to 3 fire at `places`, in 2⁻¹⁶ of a turn.
    pub fn set(&self, request: &mut Request, places: [u16; 3]) {
        let [first, second, third] = places.map(u32::from);
        request.write(self.module.address(dpll::TIMERS, 0), first | second << 16);
        request.write(self.module.address(dpll::TIMERS + 1, 0), third);
    }
}

/// The watchdog.
#[derive(Debug, Clone, Copy)]
pub struct Watchdog {
    module: Module,
    ticks: u32,
}

impl Watchdog {
    /// A watchdog of `time`.
    pub fn new(module: Module, time: Nanoseconds) -> Self {
        let ticks = time.seconds() * f64::from(module.clock) - 1.0;
        Self { module, ticks: ticks.round().clamp(1.0, f64::from(OFF - 1)) as u32 }
    }

    /// Lets it wait for its food, whatever it did before.
    pub fn arm(&self, request: &mut Request) {
        request.write(self.module.address(watchdog::TIME, 0), self.ticks);
        request.write(self.module.address(watchdog::STATUS, 0), 0);
        self.feed(request);
    }

    /// Switches it off.
    pub fn disarm(&self, request: &mut Request) {
        request.write(self.module.address(watchdog::TIME, 0), OFF);
    }

    /// Feeds it.
    pub fn feed(&self, request: &mut Request) {
        request.write(self.module.address(watchdog::FEED, 0), FEED);
    }

    /// Reads its status, whose lowest bit says that it has bitten.
    pub fn ask(&self, request: &mut Request) {
        request.read(self.module.address(watchdog::STATUS, 0), 1);
    }
}
