//! The board: its memory, its modules, and its time.

use messages::Nanoseconds;

use super::dpll::Dpll;
use super::encoder::Encoders;
use super::idrom::Idrom;
use super::layout::{Function, Kind, PINS, Register, STEPGENS, functions, pin_of};
use super::lbp16::{Command, LONGEST_REPLY};
use super::oneshot::Oneshots;
use super::pins::Pins;
use super::pwmgen::Pwmgens;
use super::record::Record;
use super::rig::Rig;
use super::spaces::{Identity, Spaces};
use super::stepgen::Stepgens;
use super::watchdog::Watchdog;
use super::wiring::Wiring;
use super::xy2mod::Xy2mods;

/// The modules of a board.
#[derive(Debug, Clone, Default)]
pub struct Modules {
    /// The watchdog.
    pub watchdog: Watchdog,
    /// The pins.
    pub pins: Pins,
    /// The encoder counters.
    pub encoders: Encoders,
    /// The step generators.
    pub stepgens: Stepgens,
    /// The PWM generators.
    pub pwmgens: Pwmgens,
    /// The interface to a scan head.
    pub mirrors: Xy2mods,
    /// The one-shots.
    pub oneshots: Oneshots,
    /// The DPLL.
    pub dpll: Dpll,
    /// The lights on the board, from bit 31 down.
    pub leds: u32,
}

/// A HostMot2 board that speaks LBP16.
#[derive(Debug)]
pub struct Board {
    modules: Modules,
    functions: [Function; PINS],
    idrom: Idrom,
    spaces: Spaces,
    /// Where each space's next command without an address goes.
    pointers: [u16; 8],
    reply: Vec<u8>,
    now: Nanoseconds,
    rig: Option<Rig>,
    /// Pins of the gate line.
    gate: Vec<usize>,
    /// The PWM generator of the power.
    power: Option<usize>,
    record: Record,
}

impl Board {
    /// A board that has just been powered, at time 0.
    pub fn new(identity: Identity) -> Self {
        Self {
            modules: Modules::default(),
            functions: functions(),
            idrom: Idrom::default(),
            spaces: Spaces::new(identity),
            pointers: [0; 8],
            reply: Vec::with_capacity(LONGEST_REPLY),
            now: Nanoseconds(0),
            rig: None,
            gate: Vec::new(),
            power: None,
            record: Record::default(),
        }
    }

    /// The same with a machine behind it: `rig`, connected by `wiring`, of which `record` keeps what it does.
    #[must_use]
    pub fn with_machine(self, rig: Rig, wiring: &Wiring, record: Record) -> Self {
        Self { rig: Some(rig), gate: wiring.gate.clone(), power: wiring.power, record, ..self }
    }

    /// What has passed since it was powered.
    pub fn now(&self) -> Nanoseconds {
        self.now
    }

    /// Its modules as they are.
    pub fn modules(&self) -> &Modules {
        &self.modules
    }

    /// What it did so far.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// The machine behind it.
    pub fn rig(&self) -> Option<&Rig> {
        self.rig.as_ref()
    }

    /// Notes a frame that arrived damaged: its check sum is wrong, and nothing in it is looked at.
    pub fn note_damaged(&mut self) {
        let counters = &mut self.spaces.counters;
        counters.damaged = counters.damaged.wrapping_add(1);
    }

    /// Drives `pin` from outside, where it is an input.
    pub fn drive(&mut self, pin: usize, high: bool) {
        self.modules.pins.drive(pin, high);
    }

    /// Lets the time go on to `to`; back it does not go.
    pub fn advance(&mut self, to: Nanoseconds) {
        while self.now < to {
            let Modules { watchdog, oneshots, dpll, .. } = &self.modules;
            let cycle = self.rig.as_ref().map(Rig::next);
            let events = [watchdog.expiry(), oneshots.next(), dpll.next(self.now), cycle];
            let next = events.into_iter().flatten().fold(to, Nanoseconds::min).max(self.now);
            self.pass(next);
            self.events();
        }
    }

    /// Takes a datagram at `now`; the reply, where it reads anything.
    pub fn handle(&mut self, now: Nanoseconds, datagram: &[u8]) -> Option<&[u8]> {
        self.advance(now);
        if let Some(rig) = &mut self.rig {
            rig.align(self.now);
            rig.count(&mut self.modules, self.now);
        }
        self.reply.clear();
        let counters = &mut self.spaces.counters;
        counters.received = counters.received.wrapping_add(1);
        let mut rest = datagram;
        while !rest.is_empty() {
            let Some(after) = self.execute(rest) else {
                let counters = &mut self.spaces.counters;
                counters.parse_errors = counters.parse_errors.wrapping_add(1);
                counters.errors |= 1;
                break;
            };
            rest = after;
        }
        self.see_light();
        self.reply.truncate(LONGEST_REPLY);
        if self.reply.is_empty() {
            return None;
        }
        self.spaces.counters.sent = self.spaces.counters.sent.wrapping_add(1);
        Some(&self.reply)
    }

    /// What each module puts out at each pin.
    pub fn signals(&self) -> [bool; PINS] {
        let Modules { oneshots, pwmgens, stepgens, .. } = &self.modules;
        self.functions.map(|function| match function {
            Function::Oneshot(pin, unit) => oneshots.output(unit, usize::from(pin == 4)),
            Function::PwmEnable(unit) => !pwmgens.enabled(unit),
            Function::Pwmgen(1, unit) => pwmgens.duty(unit).abs() > 0.5,
            Function::Pwmgen(_, unit) => pwmgens.duty(unit) < 0.0,
            Function::Stepgen(2, unit) => stepgens.speed(unit) < 0.0,
            _ => false,
        })
    }

    /// Moves everything on to `to`, before which nothing else happens.
    fn pass(&mut self, to: Nanoseconds) {
        let duration = to - self.now;
        let Modules { stepgens, mirrors, dpll, encoders, oneshots, .. } = &mut self.modules;
        stepgens.advance(self.now, to);
        mirrors.advance(duration);
        self.now = to;
        let fired = dpll.advance(duration);
        let mut sample_encoders = false;
        for (timer, _) in fired.into_iter().enumerate().filter(|(_, fired)| *fired) {
            let timer = timer as u8;
            if stepgens.timer() == Some(timer) {
                stepgens.sample();
            }
            if encoders.timer() == Some(timer) {
                sample_encoders = true;
            }
            mirrors.dpll(timer);
            oneshots.dpll(timer, to);
        }
        if sample_encoders {
            if let Some(rig) = &self.rig {
                rig.count(&mut self.modules, to);
            }
            self.modules.encoders.sample();
        }
    }

    /// Does what is due now.
    fn events(&mut self) {
        self.modules.oneshots.fire(self.now);
        if self.modules.watchdog.bite(self.now) {
            self.record.bites.push(self.now);
            self.modules.pins.release();
            self.reconnect();
        }
        if let Some(rig) = &mut self.rig
            && rig.next() <= self.now
        {
            rig.step(&self.modules);
            if let Some(tool) = rig.tool() {
                self.record.tool(self.now, tool);
            }
        }
        self.see_light();
    }

    /// Notes the light as it is: with the gate's line low, by the power that stands at its pin.
    fn see_light(&mut self) {
        if self.gate.is_empty() {
            return;
        }
        let signals = self.signals();
        let signal = |pin: usize| signals.get(pin).copied().unwrap_or(false);
        let pins = &self.modules.pins;
        let dark = self.gate.iter().all(|pin| pins.level(*pin, signal(*pin)));
        let power = match self.power.map(|unit| (unit, pin_of(Function::Pwmgen(1, unit)))) {
            _ if dark => 0.0,
            Some((unit, Some(pin))) if pins.connected(pin) => {
                let duty = self.modules.pwmgens.duty(unit).abs();
                if pins.inverted(pin) { 1.0 - duty } else { duty }
            }
            Some((_, Some(pin))) => f64::from(u8::from(pins.level(pin, false))),
            _ => 1.0,
        };
        self.record.light(self.now, power);
    }

    /// Tells the step generators whether their pins are theirs.
    fn reconnect(&mut self) {
        let mut connected = [false; STEPGENS];
        for (pin, function) in self.functions.iter().enumerate() {
            if let Function::Stepgen(1, unit) = function
                && let Some(connected) = connected.get_mut(*unit)
            {
                *connected = self.modules.pins.connected(pin);
            }
        }
        self.modules.stepgens.connect(connected);
    }

    /// Carries the first command of `bytes` out; what follows it, `None` if it is cut off.
    fn execute<'a>(&mut self, bytes: &'a [u8]) -> Option<&'a [u8]> {
        let (command, rest) = Command::parse(bytes)?;
        let pointer = self.pointers[usize::from(command.space & 7)];
        let mut address = command.address.unwrap_or(pointer);
        let (data, rest) = match command.write {
            true => rest.split_at_checked(command.length())?,
            false => (&[][..], rest),
        };
        let width = usize::from(command.width);
        if command.information {
            let about = self.spaces.about(command.space, pointer);
            let from = usize::from(address).min(about.len());
            let bytes = about.iter().skip(from).copied().chain(core::iter::repeat(0));
            self.reply.extend(bytes.take(command.length()));
            return Some(rest);
        }
        for index in 0..usize::from(command.count) {
            if command.write {
                let item = data.chunks_exact(width).nth(index).unwrap_or(&[]);
                self.write(command.space, address, item);
            } else {
                self.read(command.space, address, command.width);
            }
            if command.increment {
                address = address.wrapping_add(command.width);
            }
        }
        self.pointers[usize::from(command.space & 7)] = address;
        Some(rest)
    }

    fn read(&mut self, space: u8, address: u16, width: u16) {
        if space != 0 {
            for offset in 0..width {
                let byte = self.spaces.byte(space, address.wrapping_add(offset), self.now);
                self.reply.push(byte);
            }
            return;
        }
        if width < 4 {
            self.refuse();
            self.reply.extend(core::iter::repeat_n(0, usize::from(width)));
            return;
        }
        for offset in (0..width).step_by(4) {
            let word = self.word(address.wrapping_add(offset));
            self.reply.extend(word.to_le_bytes());
        }
    }

    fn write(&mut self, space: u8, address: u16, item: &[u8]) {
        if space != 0 {
            for (byte, offset) in item.iter().zip(0_u16..) {
                if !self.spaces.set_byte(space, address.wrapping_add(offset), *byte) {
                    let counters = &mut self.spaces.counters;
                    counters.write_errors = counters.write_errors.wrapping_add(1);
                    counters.errors |= 4;
                }
            }
            return;
        }
        if item.len() < 4 {
            self.refuse();
            return;
        }
        for (word, offset) in item.as_chunks::<4>().0.iter().zip([0, 4]) {
            self.set_word(address.wrapping_add(offset), u32::from_le_bytes(*word));
        }
    }

    /// The modules are read and written by words only.
    fn refuse(&mut self) {
        let counters = &mut self.spaces.counters;
        counters.memory_errors = counters.memory_errors.wrapping_add(1);
        counters.errors |= 2;
    }

    fn word(&mut self, address: u16) -> u32 {
        let Some(Register { kind, index, instance }) = Register::at(address) else {
            return self.idrom.word(address).unwrap_or(0);
        };
        match kind {
            Kind::IoPort => self.modules.pins.read(index, instance, &self.signals()),
            Kind::Watchdog => self.modules.watchdog.read(index),
            Kind::Encoder => self.modules.encoders.read(index, instance, self.now),
            Kind::Stepgen => self.modules.stepgens.read(index, instance),
            Kind::Pwmgen => self.modules.pwmgens.read(index, instance),
            Kind::Dpll => self.modules.dpll.read(index),
            Kind::Xy2mod => self.modules.mirrors.read(index, instance),
            Kind::Oneshot => self.modules.oneshots.read(index, instance),
            Kind::Led => self.modules.leds,
        }
    }

    fn set_word(&mut self, address: u16, value: u32) {
        let Some(Register { kind, index, instance }) = Register::at(address) else {
            let counters = &mut self.spaces.counters;
            counters.write_errors = counters.write_errors.wrapping_add(1);
            return;
        };
        let modules = &mut self.modules;
        match kind {
            Kind::IoPort => {
                modules.pins.write(index, instance, value);
                self.reconnect();
            }
            Kind::Watchdog => modules.watchdog.write(index, value, self.now),
            Kind::Encoder => modules.encoders.write(index, instance, value),
            Kind::Stepgen => modules.stepgens.write(index, instance, value),
            Kind::Pwmgen => modules.pwmgens.write(index, instance, value),
            Kind::Dpll => modules.dpll.write(index, value),
            Kind::Xy2mod => modules.mirrors.write(index, instance, value),
            Kind::Oneshot => modules.oneshots.write(index, instance, value, self.now),
            Kind::Led => modules.leds = value,
        }
    }
}
