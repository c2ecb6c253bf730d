//! A cycle of a bus that is set up: what is sent, what comes back, and what that means.

use ethercrab::{Command, SubDeviceState};
use machine::drives::Ethercat;
use machine::{Actuator, ActuatorMode, Machine};
use messages::{CommandMode, Fault, FaultCode, FaultQuantity, LaserCycle, Nanoseconds};

use super::cia402::{self, State, Wanted};
use super::gate;
use super::image::{Said, Told};
use super::network::{DriveFacts, Network};
use super::wire::Wire;
use crate::fired::Fired;
use crate::port::{Actuation, Freshness, Measurement, Power};

/// What of a period an answer may take.
const BUDGET: f64 = 0.6;
/// How long the slaves exchange process data before they are to act on them.
const SETTLING: u32 = 20;
/// How long they may take to do so [cycles].
const MOST_STARTING: u32 = 5000;
/// A word of the port's own: see `machine::drives::fault_text`.
const NO_ANSWER: f64 = 1.0;
const NOT_OPERATIONAL: f64 = 2.0;
const NOT_SYNCHRONOUS: f64 = 3.0;
/// What of a period the clocks may be apart: farther, a frame comes to the sync signal of another cycle, and
/// the gate's samples belong to another place.
const APART: f64 = 0.2;
/// AL control: to OP; to SAFE-OP, with an error acknowledged; to INIT.
const OPERATIONAL: u16 = 0x08;
const ACKNOWLEDGE: u16 = 0x14;
const INITIAL: u16 = 0x01;
const AL_CONTROL: u16 = 0x0120;

/// How far the slaves have come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// They exchange process data and are brought to act on them, for so many cycles.
    Starting(u32),
    /// They act on process data.
    Operational,
    /// One has left; they are started again when the axes are disabled.
    Fallen,
}

/// One drive in motion.
#[derive(Debug, Clone)]
struct Drive {
    facts: DriveFacts,
    mode: ActuatorMode,
    code: i8,
    /// Angle of a count [rad].
    resolution: f64,
    torque_constant: f64,
    /// Angle at which the machine stood when the port was opened [rad].
    home: f64,
    /// Position there [counts], from the first measurement on.
    zero: Option<i64>,
    /// Position without the wrap of its 32 bits [counts].
    counts: i64,
    said: Said,
    told: Told,
}

/// The cycle of a bus.
pub struct BusCycle {
    network: Network,
    /// Time of the bus minus ours when the port was opened [ns].
    offset: i64,
    wire: Wire,
    drives: Vec<Drive>,
    gate: Option<(usize, u16, u16)>,
    power: Option<usize>,
    period: Nanoseconds,
    stage: Stage,
    /// Cycles in a row without an answer, and how many are a fault.
    silent: u64,
    tolerated: u64,
    fired: Fired,
    /// What the laser was told in the newest cycle.
    laser: LaserCycle,
    /// And in the one before.
    before: LaserCycle,
    mode: CommandMode,
    fault: Fault,
    clock_offset: Nanoseconds,
}

impl BusCycle {
    /// The cycle of `network` on `wire`, for `machine`.
    pub fn new(
        (network, offset): (Network, i64),
        wire: Wire,
        (machine, bus): (&Machine, &Ethercat),
    ) -> Self {
        let period = machine.realtime.period.time();
        let gate = bus.gate.map(|it| (usize::from(it.slave), it.channel, it.oversampling.max(1)));
        let power = bus.power.map(usize::from);
        let drives = network.drives.iter().zip(&machine.actuators).map(|(facts, actuator)| {
            let joint = machine.home_joints.get(actuator.axis).copied().unwrap_or(0.0);
            Drive::new(facts.clone(), actuator, joint / actuator.ratio)
        });
        let drives = drives.collect();
        let fired =
            Fired::new(&machine.laser, machine.drives.gate_latency, machine.realtime.period);
        let tolerated = (bus.watchdog.0 / period.0.max(1)).max(1).unsigned_abs();
        Self {
            network,
            offset,
            wire,
            drives,
            gate,
            power,
            period,
            stage: Stage::Starting(0),
            silent: 0,
            tolerated,
            fired,
            laser: LaserCycle::OFF,
            before: LaserCycle::OFF,
            mode: CommandMode::Disabled,
            fault: Fault::default(),
            clock_offset: Nanoseconds(0),
        }
    }

    /// The wire, for its counters.
    pub fn wire(&self) -> &Wire {
        &self.wire
    }

    /// The largest distance of the clock of the bus from ours so far.
    pub fn clock_offset(&self) -> Nanoseconds {
        self.clock_offset
    }

    /// The first deadline from `from` on at which the latency is that of the machine file.
    pub fn first_deadline(&self, from: Nanoseconds) -> Nanoseconds {
        let phase = from.0.wrapping_add(self.offset).rem_euclid(self.period.0.max(1));
        Nanoseconds(from.0 + (self.period.0 - phase).rem_euclid(self.period.0.max(1)))
    }

    /// Puts `actuation` into the process data; it goes out with the frame of [`Self::receive`].
    pub fn send(&mut self, actuation: &Actuation) {
        self.mode = actuation.mode;
        if actuation.mode == CommandMode::Disabled {
            self.fault = Fault::default();
            if self.stage == Stage::Fallen {
                self.stage = Stage::Starting(0);
            }
        }
        let fresh = actuation.freshness == Freshness::Fresh && !self.fault.is_some();
        self.before = self.laser;
        self.laser =
            if fresh && self.stage == Stage::Operational && actuation.laser.is_valid(self.period) {
                actuation.laser
            } else {
                LaserCycle::OFF
            };
        let wanted = match actuation.mode {
            _ if self.stage != Stage::Operational => Wanted::Disabled,
            CommandMode::Disabled => Wanted::Disabled,
            CommandMode::Driven if !self.fault.is_some() => Wanted::Enabled,
            _ => Wanted::QuickStop,
        };
        for (index, drive) in self.drives.iter_mut().enumerate() {
            if !drive.tell(wanted, actuation, index) && !self.fault.is_some() {
                self.fault = Fault::new(FaultCode::NotFinite).on_actuator(index);
            }
        }
        self.put();
    }

    /// Writes what is told into the outputs of the slaves.
    fn put(&self) {
        let Network { main, group, .. } = &self.network;
        for drive in &self.drives {
            if let Ok(slave) = group.subdevice(main, drive.facts.slave) {
                drive.told.write(slave.io_raw_mut().outputs());
            }
        }
        if let Some((slave, channel, samples)) = self.gate
            && let Ok(slave) = group.subdevice(main, slave)
        {
            let mut data = slave.io_raw_mut();
            if samples > 1 {
                gate::sample(&self.laser, samples, self.period, data.outputs());
            } else if let Some(byte) = data.outputs().get_mut(usize::from(channel / 8)) {
                let bit = 1 << (channel % 8);
                let mut level = [0];
                gate::sample(&self.laser, 1, self.period, &mut level);
                *byte = if level == [1] { *byte | bit } else { *byte & !bit };
            }
        }
        if let Some(slave) = self.power
            && let Ok(slave) = group.subdevice(main, slave)
            && let Some(value) = slave.io_raw_mut().outputs().first_chunk_mut::<2>()
        {
            // An analogue output acts at once, the gate by its latency later: a dark cycle leaves the power to the
            // light before it.
            let shown = if self.laser.is_lit() { &self.laser } else { &self.before };
            *value = gate::power(shown).to_le_bytes();
        }
    }

    /// Exchanges the process data, and says what was measured.
    pub fn receive(&mut self, measurement: &mut Measurement) {
        self.wire.drain();
        let start = self.wire.now();
        let budget = Nanoseconds((self.period.0 as f64 * BUDGET) as i64);
        let Network { main, group, whole, .. } = &self.network;
        let question = group.tx_rx_sync_system_time(main);
        let answer = self.wire.ask(question, start + budget, budget);
        let end = self.wire.now();
        let mut is_measured = false;
        match answer {
            None => self.wire.lost(),
            Some(Err(_)) => self.wire.corrupted(),
            // Outputs that a slave has not taken, or inputs that one has not given.
            Some(Ok(response)) if response.working_counter != *whole => self.wire.corrupted(),
            Some(Ok(response)) => {
                is_measured = true;
                if let Some(time) = response.extra {
                    let ours = (start.0 + end.0) / 2;
                    self.clock_offset =
                        Nanoseconds((time as i64).wrapping_sub(ours).wrapping_sub(self.offset));
                }
                let apart = self.clock_offset.0.unsigned_abs() as f64 / self.period.0 as f64;
                if apart > APART && self.mode != CommandMode::Disabled {
                    self.fail(Fault::new(FaultCode::DriveFault), NOT_SYNCHRONOUS);
                }
                let all = response.subdevice_states.iter();
                let is_operational =
                    all.clone().all(|state| *state == SubDeviceState::Op) && all.len() > 0;
                self.advance_stage(is_operational);
            }
        }
        if is_measured {
            self.silent = 0;
            self.take();
        } else {
            self.wire.bridged();
            self.silent += 1;
            if self.silent > self.tolerated && self.mode != CommandMode::Disabled {
                self.fail(Fault::new(FaultCode::DriveFault), NO_ANSWER);
            }
        }
        // What was not acknowledged may have been fired all the same: outputs come before inputs.
        self.fired.pass(&self.laser);
        self.describe(measurement);
    }

    /// Goes on towards the operational state, by one question a cycle.
    fn advance_stage(&mut self, is_operational: bool) {
        match self.stage {
            Stage::Starting(_) if is_operational => self.stage = Stage::Operational,
            Stage::Starting(cycles) => {
                self.stage = Stage::Starting(cycles.saturating_add(1));
                match cycles {
                    1 => self.request(ACKNOWLEDGE),
                    cycles if cycles % 500 == SETTLING => self.request(OPERATIONAL),
                    _ => {}
                }
                if cycles > MOST_STARTING && self.mode != CommandMode::Disabled {
                    self.fail(Fault::new(FaultCode::DriveFault), NOT_OPERATIONAL);
                }
            }
            Stage::Operational if !is_operational => {
                self.stage = Stage::Fallen;
                if self.mode != CommandMode::Disabled {
                    self.fail(Fault::new(FaultCode::DriveFault), NOT_OPERATIONAL);
                }
            }
            Stage::Operational | Stage::Fallen => {}
        }
    }

    /// Asks all slaves for a state at once.
    fn request(&mut self, state: u16) {
        let budget = Nanoseconds(self.period.0 / 4);
        let question = Command::bwr(AL_CONTROL).ignore_wkc().send(self.network.main, state);
        let until = self.wire.now() + budget;
        let _ = self.wire.ask(question, until, budget);
    }

    fn fail(&mut self, fault: Fault, word: f64) {
        if !self.fault.is_some() {
            self.fault = fault.with(FaultQuantity::DriveWord, word);
        }
    }

    /// Takes in what the drives say.
    fn take(&mut self) {
        let Network { main, group, .. } = &self.network;
        let mut faulty = None;
        for (index, drive) in self.drives.iter_mut().enumerate() {
            let Ok(slave) = group.subdevice(main, drive.facts.slave) else { continue };
            let Some(said) = Said::read(slave.io_raw().inputs()) else { continue };
            drive.hear(said);
            if State::of(said.status).is_fault() {
                faulty.get_or_insert((index, said.error));
            }
        }
        if let Some((index, error)) = faulty
            && self.mode != CommandMode::Disabled
            && self.stage == Stage::Operational
        {
            self.fail(Fault::new(FaultCode::DriveFault).on_actuator(index), f64::from(error));
        }
    }

    fn describe(&mut self, measurement: &mut Measurement) {
        let is_ready = self.stage == Stage::Operational;
        let powered = |drive: &Drive| {
            State::of(drive.said.status).is_powered() && drive.said.mode == drive.code
        };
        let is_powered = is_ready && !self.drives.is_empty() && self.drives.iter().all(powered);
        measurement.power = if is_powered { Power::On } else { Power::Off };
        for (index, drive) in self.drives.iter().enumerate() {
            let moved = drive.counts - drive.zero.unwrap_or(drive.counts);
            if let (Some(counts), Some(position), Some(current)) = (
                measurement.counts.get_mut(index),
                measurement.position.get_mut(index),
                measurement.current.get_mut(index),
            ) {
                let zero = (drive.home / drive.resolution).round();
                *counts = zero as i64 + moved;
                *position = drive.home + moved as f64 * drive.resolution;
                let torque = f64::from(drive.said.torque) * 1e-3 * drive.facts.rated;
                *current = torque / drive.torque_constant;
            }
        }
        measurement.tool = None;
        measurement.laser = self.fired.take();
        measurement.clock_offset = Some(self.clock_offset);
        measurement.fault = self.fault;
    }

    /// A deadline passed in which nothing was sent: the gate's samples were those of no cycle, dark.
    pub fn pass(&mut self) {
        self.fired.pass(&LaserCycle::OFF);
    }

    /// Leaves the slaves dark and unpowered, in their initial state.
    pub fn close(&mut self) {
        let mut measurement = Measurement::default();
        for _ in 0..3 {
            self.send(&Actuation::DISABLED);
            self.receive(&mut measurement);
        }
        self.request(INITIAL);
    }
}

impl core::fmt::Debug for BusCycle {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter
            .debug_struct("BusCycle")
            .field("stage", &self.stage)
            .field("drives", &self.drives)
            .field("fault", &self.fault)
            .finish_non_exhaustive()
    }
}

impl Drive {
    fn new(facts: DriveFacts, actuator: &Actuator, home: f64) -> Self {
        Self {
            facts,
            mode: actuator.mode,
            code: cia402::mode(actuator.mode).map_or(0, |(code, _)| code),
            resolution: actuator.encoder.resolution(),
            torque_constant: actuator.motor.dc().map_or(1.0, |motor| motor.torque_constant),
            home,
            zero: None,
            counts: 0,
            said: Said::default(),
            told: Told::default(),
        }
    }

    /// What it is told: `false` where a target is no number, which is not told.
    fn tell(&mut self, wanted: Wanted, actuation: &Actuation, index: usize) -> bool {
        let state = State::of(self.said.status);
        self.told = Told {
            control: state.control(wanted, self.told.control),
            mode: self.code,
            position: self.counts as i32,
            ..Told::default()
        };
        if wanted != Wanted::Enabled || state != State::Enabled {
            return true;
        }
        let of =
            |targets: &messages::ActuatorArray| targets.get(index).copied().unwrap_or(f64::NAN);
        let [position, velocity, effort] =
            [of(&actuation.position), of(&actuation.velocity), of(&actuation.effort)];
        let needed = match self.mode {
            ActuatorMode::Position => [position, effort],
            ActuatorMode::Velocity => [velocity, effort],
            ActuatorMode::Torque | ActuatorMode::Voltage => [effort, effort],
        };
        if needed.iter().any(|number| !number.is_finite()) {
            self.told.control = state.control(Wanted::QuickStop, self.told.control);
            return false;
        }
        let torque = (effort / self.facts.rated * 1000.0).round() as i16;
        match self.mode {
            ActuatorMode::Position => {
                let moved = ((position - self.home) / self.resolution).round() as i64;
                // The position of a drive goes round in its 32 bits.
                self.told.position = (self.zero.unwrap_or(self.counts) + moved) as i32;
                self.told.torque_offset = torque;
            }
            ActuatorMode::Velocity => {
                self.told.velocity = (velocity / self.resolution).round() as i32;
                self.told.torque_offset = torque;
            }
            ActuatorMode::Torque | ActuatorMode::Voltage => self.told.torque = torque,
        }
        true
    }

    fn hear(&mut self, said: Said) {
        match self.zero {
            None => {
                self.counts = i64::from(said.position);
                self.zero = Some(self.counts);
            }
            Some(_) => {
                let moved = said.position.wrapping_sub(self.counts as i32);
                self.counts += i64::from(moved);
            }
        }
        self.said = said;
    }
}
