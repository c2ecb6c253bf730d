//! A board that drives: what is sent to it in each cycle, and what comes back.

use messages::{CommandMode, Fault, FaultCode, FaultQuantity, LaserCycle, Nanoseconds};

use super::arming::{BoardClock, Pins, Watchdog};
use super::axes::{Drive, Refusal};
use super::digital::Digital;
use super::gate::{Gate, LEAD, Light};
use super::grid::Grid;
use super::lbp16::{LONGEST, Reply, Request};
use super::path::is_driven;
use super::pwm::Pwms;
use crate::fired::Fired;
use crate::link::Link;
use crate::port::{Actuation, Freshness, Measurement, Power};
use crate::watchdog::impossible_light;

/// What was counted on the way to the board since it was opened.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counters {
    /// Requests.
    pub sent: u64,
    /// Those without a reply in their cycle; places that go on at their speed stood in.
    pub lost: u64,
    /// Replies that came in a later cycle.
    pub late: u64,
    /// Replies that came again.
    pub duplicated: u64,
    /// Replies that were not what was asked for, or tell what cannot be.
    pub corrupted: u64,
}

/// Why the board stops the machine by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trouble {
    /// Its watchdog has bitten.
    Bitten,
    /// It does not answer.
    Silent,
    /// It was reset, or is another one than before.
    Reset,
    /// A mirror was told a place beyond the full scale.
    Overflow,
}

impl Trouble {
    /// The fault word by which it travels; its text is that of [`machine::drives::fault_text`].
    pub fn word(self) -> u32 {
        match self {
            Self::Bitten => 1,
            Self::Silent => 2,
            Self::Reset => 3,
            Self::Overflow => 4,
        }
    }
}

/// What of the period a reply is waited for: the controller needs the rest.
const BUDGET: f64 = 0.6;
/// Cycles without a reply in a row after which it is a fault.
pub const SILENT_CYCLES: u32 = 5;
/// Replies in a row that are not believed after which the grid is learnt anew.
const MOST_DOUBTS: u32 = 16;
/// The largest number of cycles by which an older reply is told from rubbish.
const OLDEST: u32 = 1000;

/// The parts of a session, as opening has found and set them up.
pub struct Parts {
    /// The way to the board.
    pub link: Box<dyn Link>,
    /// Its watchdog.
    pub watchdog: Watchdog,
    /// Its clock.
    pub clock: BoardClock,
    /// Its pins.
    pub pins: Pins,
    /// The gate, where the laser has one.
    pub gate: Option<Gate>,
    /// The PWM generators.
    pub pwms: Option<Pwms>,
    /// The one of the laser's power.
    pub power: Option<u32>,
    /// The actuators.
    pub drives: Vec<Drive>,
    /// How the gate and the mirrors are later than the deadline [s].
    pub gate_latency: f64,
    /// Of the mirrors.
    pub mirror_latency: f64,
    /// How long a cycle is.
    pub period: Nanoseconds,
    /// The machine's inputs and outputs.
    pub digital: Digital,
    /// What the board knows this session by.
    pub name: u32,
    /// What tells the light.
    pub fired: Fired,
}

/// How far the request at hand is known to have come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Proof {
    /// Nothing is known.
    None,
    /// It was there before its gate was due.
    InTime,
}

/// A board that drives.
pub struct Session {
    parts: Parts,
    grid: Grid,
    request: Request,
    buffer: [u8; LONGEST],
    /// The number of the newest request, and of the newest that was answered.
    number: u32,
    answered: u32,
    until: Nanoseconds,
    parity: usize,
    /// The light of the cycle at hand, and whether it is shown to be carried out.
    laser: LaserCycle,
    proof: Proof,
    mode: CommandMode,
    /// Cycles since the newest reply.
    silent: u32,
    /// Cycles since a deadline without a request, that one included.
    elapsed: u32,
    started: bool,
    /// Whether the board must be set up again before it can drive.
    reset: bool,
    fault: Fault,
    trouble: Option<Trouble>,
    /// Replies in a row that say that the watchdog has bitten, those of a board that does not know the session,
    /// and those that were not believed.
    bites: u32,
    strange: u32,
    doubts: u32,
    /// The power of the newest cycle with light.
    power: f64,
    measurement: Measurement,
    counters: Counters,
}

impl Session {
    /// A session on a board that is set up, whose drives are at home.
    pub fn new(parts: Parts) -> Self {
        let grid = Grid::new(parts.clock.turn, parts.period.seconds());
        let mut measurement = Measurement::default();
        fill(&mut measurement, &parts.drives, 0.0);
        Self {
            parts,
            grid,
            request: Request::default(),
            buffer: [0; LONGEST],
            number: 0,
            answered: 0,
            until: Nanoseconds(0),
            parity: 0,
            laser: LaserCycle::OFF,
            proof: Proof::None,
            mode: CommandMode::Disabled,
            silent: 0,
            elapsed: 0,
            started: false,
            reset: false,
            fault: Fault::default(),
            trouble: None,
            bites: 0,
            strange: 0,
            doubts: 0,
            power: 0.0,
            measurement,
            counters: Counters::default(),
        }
    }

    /// What was counted.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// The way to the board, and what is to be switched off at its end.
    pub fn parts(&mut self) -> &mut Parts {
        &mut self.parts
    }

    /// A deadline has passed without a request: dark, and the axes go on.
    pub fn pass(&mut self) {
        self.begin();
        self.parts.drives.iter_mut().for_each(Drive::pass);
        self.laser = LaserCycle::OFF;
        self.proof = Proof::None;
    }

    /// Sends the request of a cycle under `actuation`.
    pub fn send(&mut self, actuation: &Actuation) {
        self.begin();
        let accepted = self.accept(actuation);
        self.mode = accepted.mode;
        self.laser = accepted.laser;
        self.number = self.number.wrapping_add(1);
        self.write(&accepted);
        self.counters.sent += 1;
        if let Some(datagram) = self.request.datagram() {
            self.parts.link.send(datagram);
        }
        let budget = Nanoseconds((self.parts.period.0 as f64 * BUDGET) as i64);
        self.until = self.parts.link.now() + budget;
    }

    /// Waits for the reply, and gives what it tells, or where the motors are that went on at their speed.
    pub fn receive(&mut self, measurement: &mut Measurement) {
        let mut answered = false;
        while !answered {
            let Some(length) = self.parts.link.receive(&mut self.buffer, self.until) else { break };
            answered = self.take(length);
        }
        if answered {
            (self.silent, self.elapsed) = (0, 0);
        } else {
            self.counters.lost += 1;
            self.silent = self.silent.saturating_add(1);
            if self.silent > SILENT_CYCLES {
                self.stop(Trouble::Silent);
            }
        }
        // What is not told goes on at its speed.
        let coasted = f64::from(self.elapsed.min(SILENT_CYCLES)) * self.parts.period.seconds();
        fill(&mut self.measurement, &self.parts.drives, coasted);
        self.measurement.power =
            if self.mode == CommandMode::Disabled { Power::Off } else { Power::On };
        self.measurement.laser = self.parts.fired.take();
        self.measurement.fault = self.fault;
        *measurement = self.measurement;
    }

    /// Ends the cycle before, and begins one.
    fn begin(&mut self) {
        if self.started {
            let fired = if self.proof == Proof::InTime { self.laser } else { LaserCycle::OFF };
            self.parts.fired.pass(&fired);
        }
        self.started = true;
        self.proof = Proof::None;
        self.grid.advance();
        self.parity = 1 - self.parity;
        self.elapsed = self.elapsed.saturating_add(1);
    }

    /// What of `actuation` the board carries out: all of it, or nothing but the brake.
    fn accept(&mut self, actuation: &Actuation) -> Actuation {
        if actuation.mode == CommandMode::Disabled {
            (self.fault, self.trouble) = (Fault::default(), None);
            return Actuation { laser: LaserCycle::OFF, ..*actuation };
        }
        if !self.fault.is_some() {
            self.fault = self.refusal(actuation).unwrap_or_default();
        }
        if self.fault.is_some() {
            return if self.mode == CommandMode::Disabled {
                Actuation::DISABLED
            } else {
                Actuation::QUICK_STOP
            };
        }
        let dark = actuation.freshness == Freshness::Stale || !is_driven(actuation.mode);
        let laser = if dark { LaserCycle::OFF } else { actuation.laser };
        Actuation { laser, ..*actuation }
    }

    /// Why the board cannot carry `actuation` out, if it cannot.
    fn refusal(&self, actuation: &Actuation) -> Option<Fault> {
        if is_driven(actuation.mode) {
            let targets = [&actuation.position, &actuation.velocity, &actuation.voltage];
            for values in targets {
                let mut values = values.iter().take(self.parts.drives.len()).enumerate();
                if let Some((row, value)) = values.find(|(_, value)| !value.is_finite()) {
                    let fault = Fault::new(FaultCode::NotFinite).on_actuator(row);
                    return Some(fault.with(FaultQuantity::Number, *value));
                }
            }
        }
        for (row, drive) in self.parts.drives.iter().enumerate() {
            let fault = Fault::new(FaultCode::DriveFault).on_actuator(row);
            match drive.refusal(actuation, row) {
                Some(Refusal::TooFast(rate)) => {
                    return Some(fault.beyond(FaultQuantity::PulseRate, rate, 1.0));
                }
                Some(Refusal::Beyond(angle)) => {
                    return Some(fault.with(FaultQuantity::Position, angle));
                }
                None => {}
            }
        }
        if !actuation.laser.is_valid(self.parts.period) {
            return Some(impossible_light(&actuation.laser));
        }
        let light = Light::of(&actuation.laser, self.parts.period.0 as f64);
        let most = self.parts.gate.as_ref().map_or(0, Gate::most);
        let pulses = light.pulses().len();
        (pulses > most).then(|| {
            let fault = Fault::new(FaultCode::DriveFault);
            fault.beyond(FaultQuantity::ImpossibleEdges, 2.0 * pulses as f64, 2.0 * most as f64)
        })
    }

    /// Writes the request of the cycle.
    fn write(&mut self, actuation: &Actuation) {
        let Self { parts, grid, request, .. } = self;
        let Parts { watchdog, clock, pins, gate, pwms, drives, .. } = parts;
        request.clear();
        request.write_number(self.number);
        // First, since it tells when the request arrived.
        clock.ask(request);
        request.read_session();
        if self.reset && actuation.mode == CommandMode::Disabled {
            watchdog.arm(request);
            gate.iter().for_each(|gate| gate.dark(request));
            pins.arm(request);
        }
        if self.trouble == Some(Trouble::Overflow) {
            drives.iter().for_each(|drive| drive.reset(request));
        }
        parts.digital.set(pins, actuation);
        pins.write(request);
        watchdog.feed(request);

        let light = Light::of(&actuation.laser, parts.period.0 as f64);
        // The light of the cycle before still lasts while the gate's latency does, so a dark one leaves it.
        if !light.pulses().is_empty() {
            self.power = light.power;
        }
        let place = |after: f64| grid.phase(after).map_or(0.0, |phase| phase * TIMERS);
        let start = place(parts.gate_latency - LEAD * 1e-9);
        let before = place(parts.gate_latency - LEAD * 1e-9 - parts.period.seconds());
        let mirrors = place(parts.mirror_latency);
        // The start is rounded down to the timer's step, and the delay makes up for it.
        let early = LEAD + (start - start.floor()) / TIMERS * grid.turn() * 1e9;
        let mut places = [before, before];
        if let Some(place) = places.get_mut(self.parity) {
            *place = start;
        }
        clock.set(request, [places[0] as u16, places[1] as u16, mirrors as u16]);
        if let Some(gate) = gate {
            let driven = is_driven(actuation.mode) && grid.is_settled();
            if driven {
                gate.set(request, self.parity, light.pulses(), early);
            } else {
                gate.dark(request);
            }
        }
        for (row, drive) in drives.iter_mut().enumerate() {
            drive.follow(request, pwms.as_ref(), actuation, row);
        }
        if let Some(pwms) = pwms {
            let mut mask = 0;
            if let Some(power) = parts.power {
                pwms.set(request, power, self.power);
                mask |= if is_driven(actuation.mode) { bit(power) } else { 0 };
            }
            if actuation.mode != CommandMode::Disabled {
                mask |= drives.iter().filter_map(Drive::pwm).fold(0, |mask, unit| mask | bit(unit));
            }
            pwms.enable(request, mask);
        }

        watchdog.ask(request);
        drives.iter().for_each(|drive| drive.ask(request));
        pins.ask(request);
        request.read_number();
    }

    /// Reads a datagram of `length` bytes from the buffer; whether it is the reply to the newest request.
    fn take(&mut self, length: usize) -> bool {
        let expected = self.request.reply_length();
        let buffer = self.buffer;
        let Some((data, number)) = buffer.get(..length).and_then(|all| all.split_last_chunk::<4>())
        else {
            self.counters.corrupted += 1;
            return false;
        };
        let mut reply = Reply(data);
        let age = self.number.wrapping_sub(u32::from_le_bytes(*number));
        if length != expected || age > OLDEST {
            self.counters.corrupted += 1;
            return false;
        }
        if age > 0 {
            self.take_old(age, reply.word());
            return false;
        }
        if self.answered == self.number {
            self.counters.duplicated += 1;
            return false;
        }
        self.take_new(reply)
    }

    /// An older reply, of `age` cycles ago, whose request found the board's clock at `phase`.
    fn take_old(&mut self, age: u32, phase: u32) {
        let number = self.number.wrapping_sub(age);
        let known = self.answered.wrapping_sub(number) <= OLDEST;
        if known && self.answered == number {
            self.counters.duplicated += 1;
        } else {
            self.counters.late += 1;
        }
        // A request that came after newer ones has taken the gate's settings of this cycle with it.
        let since = self.grid.phase(0.0).map(|due| {
            let turns = f64::from(phase) / PHASES - due;
            (turns - turns.round()) * self.grid.turn()
        });
        if since.is_some_and(|since| since > -0.5 * self.parts.period.seconds()) {
            self.proof = Proof::None;
        }
    }

    /// The reply to the newest request.
    fn take_new(&mut self, mut reply: Reply<'_>) -> bool {
        let phase = f64::from(reply.word()) / PHASES;
        // One damaged reply is no other board.
        self.strange =
            if reply.word() == self.parts.name { 0 } else { self.strange.saturating_add(1) };
        if self.strange > 0 {
            self.counters.corrupted += 1;
            if self.strange > 1 {
                self.stop(Trouble::Reset);
            }
            return false;
        }
        let status = reply.word();
        let elapsed = f64::from(self.elapsed.max(1)) * self.parts.period.seconds();
        let mut readable = true;
        for drive in &mut self.parts.drives {
            readable &= drive.read(&mut reply, elapsed);
        }
        if !readable || !self.grid.believes(phase) {
            self.counters.corrupted += 1;
            self.doubts += 1;
            if self.doubts > MOST_DOUBTS {
                // It is the grid that is wrong.
                self.grid.restart();
            }
            return false;
        }
        self.doubts = 0;
        self.answered = self.number;
        let late = self.grid.arrive(phase);
        for drive in &mut self.parts.drives {
            drive.take(elapsed, late);
        }
        // One damaged reply is no bite.
        self.bites = if status & 1 == 0 { 0 } else { self.bites.saturating_add(1) };
        let bitten = self.bites > 0;
        if bitten {
            self.reset = true;
            if self.bites > 1 {
                self.stop(Trouble::Bitten);
            }
        } else if self.mode == CommandMode::Disabled {
            self.reset = false;
        }
        if self.parts.drives.iter().any(Drive::is_overflown) {
            self.stop(Trouble::Overflow);
        }
        if self.grid.is_settled() && late < self.parts.gate_latency - LEAD * 1e-9 && !bitten {
            self.proof = Proof::InTime;
        }
        let levels = core::array::from_fn(|port| {
            if port < self.parts.pins.ports() as usize { reply.word() } else { 0 }
        });
        self.measurement.inputs = self.parts.digital.active(&levels, self.parts.pins.width());
        true
    }

    /// Why the board has stopped the machine, if that was what did first.
    pub fn trouble(&self) -> Option<Trouble> {
        self.trouble
    }

    /// Stops the machine unless it has been stopped before.
    fn stop(&mut self, trouble: Trouble) {
        if !self.fault.is_some() {
            let fault = Fault::new(FaultCode::DriveFault);
            self.fault = fault.with(FaultQuantity::DriveWord, f64::from(trouble.word()));
            self.trouble = Some(trouble);
        }
    }
}

/// Steps of the board's timers in a turn of its clock.
const TIMERS: f64 = 65_536.0;
/// Steps of what its clock reads.
const PHASES: f64 = 4_294_967_296.0;
/// The bit of the PWM generator `unit`; none beyond the 32 that a register holds.
fn bit(unit: u32) -> u32 {
    1_u32.checked_shl(unit).unwrap_or(0)
}

/// Puts what the drives have measured into `measurement`, and that they went on for `coasted` [s] since.
fn fill(measurement: &mut Measurement, drives: &[Drive], coasted: f64) {
    for (row, drive) in drives.iter().enumerate() {
        let (counts, position, current) = drive.measured(coasted);
        let places = (
            measurement.counts.get_mut(row),
            measurement.position.get_mut(row),
            measurement.current.get_mut(row),
        );
        if let (Some(count), Some(angle), Some(amperes)) = places {
            (*count, *angle, *amperes) = (counts, position, current);
        }
    }
}
