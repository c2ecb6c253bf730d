//! A cycle of a bus that is set up: what is sent, what comes back, and what that means.

use ethercrab::{Command, SubDeviceState};
use machine::Machine;
use machine::drives::Ethercat;
use machine::operating::HomingMethod;
use messages::{CommandMode, Fault, FaultCode, FaultQuantity, LaserCycle, MAX_AXES, Nanoseconds};

use super::cia402::Wanted;
use super::digital::Digital;
use super::drive::Drive;
use super::gate;
use super::image::Said;
use super::network::Network;
use super::wire::Wire;
use crate::fired::Fired;
use crate::port::{Actuation, Freshness, Measurement, Power};
use crate::watchdog::impossible_light;

/// What of a period an answer may take.
const BUDGET: f64 = 0.6;
/// How long the slaves exchange process data before they are to act on them.
const SETTLING: u32 = 20;
/// How long they may take to do so [cycles].
const MOST_STARTING: u32 = 5000;
/// Words of the port's own: see `machine::drives::fault_text`.
const NO_ANSWER: f64 = 1.0;
const NOT_OPERATIONAL: f64 = 2.0;
const NOT_SYNCHRONOUS: f64 = 3.0;
const NOT_ALL: f64 = 4.0;
/// For how many cycles in a row without a whole answer the gate may open: drives go on at their speed for as long.
const BORNE: u64 = 3;
/// What of a period the clocks may be apart: farther, a frame comes to the sync signal of another cycle, and
/// the gate's samples belong to another place.
const APART: f64 = 0.2;
/// AL control: to OP; to SAFE-OP, with an error acknowledged; to INIT.
const OPERATIONAL: u16 = 0x08;
const ACKNOWLEDGE: u16 = 0x14;
const INITIAL: u16 = 0x01;
const AL_CONTROL: u16 = 0x0120;
/// AL status: all of them at once are those of each, joined bit by bit.
const AL_STATUS: u16 = 0x0130;
/// How often the slaves are sent to INIT until all are there, and how long each time [ns].
const CLOSING: u32 = 50;
const CLOSING_TIME: Nanoseconds = Nanoseconds(5_000_000);

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

/// The cycle of a bus.
pub struct BusCycle {
    network: Network,
    /// Time of the bus minus ours when the port was opened [ns].
    offset: i64,
    wire: Wire,
    drives: Vec<Drive>,
    digital: Digital,
    /// The inputs of the newest measurement, and the outputs that are told, one bit each.
    inputs: u64,
    outputs: u64,
    gate: Option<(usize, u16, u16)>,
    power: Option<usize>,
    period: Nanoseconds,
    stage: Stage,
    /// Cycles in a row without an answer of all slaves, and how many are a fault.
    silent: u64,
    /// Cycles since the drives were heard.
    unheard: u64,
    tolerated: u64,
    /// What that is as a fault: nobody answers, or some slaves do not take part.
    lack: f64,
    fired: Fired,
    /// What the laser was told in the newest cycle.
    laser: LaserCycle,
    /// And in the one before.
    before: LaserCycle,
    mode: CommandMode,
    fault: Fault,
    /// How far the clock of the bus is ahead, where this cycle has told.
    clock_offset: Option<Nanoseconds>,
    /// The largest of it so far, whichever way [ns].
    clock_error_max: u64,
    /// By how much deadlines have been moved since the port was opened [ns].
    moved: i64,
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
            let homing = machine.operating.homing(actuator.axis);
            let homing = homing.filter(|homing| homing.method == HomingMethod::Drive);
            Drive::new(facts.clone(), actuator, joint / actuator.ratio, homing, period)
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
            digital: Digital::of(machine, bus),
            inputs: 0,
            outputs: 0,
            gate,
            power,
            period,
            stage: Stage::Starting(0),
            silent: 0,
            unheard: 0,
            tolerated,
            lack: NO_ANSWER,
            fired,
            laser: LaserCycle::OFF,
            before: LaserCycle::OFF,
            mode: CommandMode::Disabled,
            fault: Fault::default(),
            clock_offset: None,
            clock_error_max: 0,
            moved: 0,
        }
    }

    /// The wire, for its counters.
    pub fn wire(&self) -> &Wire {
        &self.wire
    }

    /// Deadlines come later by so much from the next one on.
    pub fn moved(&mut self, by: Nanoseconds) {
        self.moved = self.moved.wrapping_add(by.0);
    }

    /// How far the clock of the bus was from our deadlines at most [ns].
    pub fn clock_error_max(&self) -> u64 {
        self.clock_error_max
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
        let is_driven = actuation.mode == CommandMode::Driven;
        if is_driven && !actuation.laser.is_valid(self.period) && !self.fault.is_some() {
            self.fault = impossible_light(&actuation.laser);
        }
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
        let may_shine = actuation.freshness == Freshness::Fresh
            && is_driven
            && self.stage == Stage::Operational
            && !self.fault.is_some()
            && self.silent <= BORNE;
        self.begin_light(if may_shine { actuation.laser } else { LaserCycle::OFF });
        self.outputs = actuation.outputs;
        self.put();
    }

    /// A cycle begins. The light of the one that ends here is told with the next measurement: what was not acknowledged may have
    /// been fired all the same, since outputs come before inputs.
    fn begin_light(&mut self, laser: LaserCycle) {
        self.fired.pass(&self.laser);
        self.unheard = self.unheard.saturating_add(1);
        self.before = core::mem::replace(&mut self.laser, laser);
    }

    /// Writes what is told into the outputs of the slaves.
    fn put(&self) {
        self.digital.put(self.outputs, &self.network);
        let Network { main, group, .. } = &self.network;
        for drive in &self.drives {
            if let Ok(slave) = group.subdevice(main, drive.facts.slave) {
                drive.put(slave.io_raw_mut().outputs());
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
        self.clock_offset = None;
        self.wire.drain();
        let start = self.wire.now();
        let budget = Nanoseconds((self.period.0 as f64 * BUDGET) as i64);
        let Network { main, group, whole, .. } = &self.network;
        let question = group.tx_rx_sync_system_time(main);
        let answer = self.wire.ask(question, start + budget, budget);
        let end = self.wire.now();
        let mut is_measured = false;
        match answer {
            None => {
                self.wire.lost();
                self.lack = NO_ANSWER;
            }
            Some(Err(_)) => self.wire.corrupted(),
            // Outputs that a slave has not taken, or inputs that one has not given.
            Some(Ok(response)) if response.working_counter != *whole => {
                self.wire.corrupted();
                self.lack = NOT_ALL;
            }
            Some(Ok(response)) => {
                is_measured = true;
                if let Some(time) = response.extra {
                    let ours = (start.0 + end.0) / 2;
                    let apart = (time as i64).wrapping_sub(ours).wrapping_sub(self.offset);
                    let apart = apart.wrapping_add(self.moved);
                    self.clock_offset = Some(Nanoseconds(apart));
                }
                // When it was read, nobody knows closer than to half of its way there and back.
                let doubt = (end.0 - start.0).unsigned_abs() / 2;
                let apart = self.clock_offset.map_or(0, |offset| offset.0.unsigned_abs());
                let apart = apart.saturating_sub(doubt);
                self.clock_error_max = self.clock_error_max.max(apart);
                let apart = apart as f64 / self.period.0 as f64;
                if apart > APART && self.mode != CommandMode::Disabled {
                    self.fail(Fault::new(FaultCode::DriveFault), NOT_SYNCHRONOUS);
                }
                let mut states = response.subdevice_states.iter();
                let fallen = states.position(|state| *state != SubDeviceState::Op);
                self.advance_stage(fallen);
            }
        }
        if is_measured {
            self.silent = 0;
            let cycles = core::mem::take(&mut self.unheard);
            self.take(cycles);
        } else {
            self.wire.bridged();
            self.silent += 1;
            if self.silent > self.tolerated && self.mode != CommandMode::Disabled {
                self.fail(Fault::new(FaultCode::DriveFault), self.lack);
            }
        }
        self.describe(measurement);
    }

    /// Goes on towards the operational state, by one question a cycle; `fallen` is the first slave that is in
    /// another.
    fn advance_stage(&mut self, fallen: Option<usize>) {
        let is_operational = fallen.is_none();
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
                    self.fail(self.of_slave(fallen), NOT_OPERATIONAL);
                }
            }
            Stage::Operational if !is_operational => {
                self.stage = Stage::Fallen;
                if self.mode != CommandMode::Disabled {
                    self.fail(self.of_slave(fallen), NOT_OPERATIONAL);
                }
            }
            Stage::Operational | Stage::Fallen => {}
        }
    }

    /// A fault of the drive that is at `slave` on the bus, or of the port where none is.
    fn of_slave(&self, slave: Option<usize>) -> Fault {
        let fault = Fault::new(FaultCode::DriveFault);
        let mut drives = self.drives.iter();
        let index = drives.position(|drive| Some(drive.facts.slave) == slave);
        index.map_or(fault, |index| fault.on_actuator(index))
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

    /// Takes in what the drives say, so many `cycles` after they were heard before.
    fn take(&mut self, cycles: u64) {
        let Network { main, group, .. } = &self.network;
        let (mut faulty, mut lost) = (None, None);
        for (index, drive) in self.drives.iter_mut().enumerate() {
            let Ok(slave) = group.subdevice(main, drive.facts.slave) else { continue };
            let Some(said) = Said::read(slave.io_raw().inputs()) else { continue };
            drive.hear(said, cycles);
            if let Some(error) = drive.error() {
                faulty.get_or_insert((index, error));
            }
            if let Some(status) = drive.lost() {
                lost.get_or_insert((index, status));
            }
        }
        self.refer();
        self.inputs = self.digital.active(&self.network, &self.drives);
        if let Some((index, error)) = faulty
            && self.mode != CommandMode::Disabled
            && self.stage == Stage::Operational
        {
            self.fail(Fault::new(FaultCode::DriveFault).on_actuator(index), f64::from(error));
        }
        if let Some((index, status)) = lost
            && self.mode != CommandMode::Disabled
            && !self.fault.is_some()
        {
            let fault = Fault::new(FaultCode::HomingFailed).on_actuator(index);
            self.fault = fault.with(FaultQuantity::HomingStatus, f64::from(status));
        }
    }

    /// The drives of an axis tell their places from the references that they have found by themselves, as soon as all of
    /// them have.
    fn refer(&mut self) {
        for axis in 0..MAX_AXES {
            let own = |drive: &&mut Drive| drive.axis == axis;
            if self.drives.iter().any(|it| it.axis == axis && !it.has_found()) {
                continue;
            }
            self.drives.iter_mut().filter(own).for_each(Drive::refer);
        }
    }

    fn describe(&mut self, measurement: &mut Measurement) {
        let is_ready = self.stage == Stage::Operational;
        let is_powered =
            is_ready && !self.drives.is_empty() && self.drives.iter().all(Drive::is_powered);
        measurement.power = if is_powered { Power::On } else { Power::Off };
        // Who is not heard goes on at its speed, as drives do without a target.
        let coasted = self.unheard.min(BORNE);
        for (index, drive) in self.drives.iter().enumerate() {
            if let (Some(counts), Some(position), Some(current)) = (
                measurement.counts.get_mut(index),
                measurement.position.get_mut(index),
                measurement.current.get_mut(index),
            ) {
                (*counts, *position) = (drive.moved(coasted), drive.position(coasted));
                *current = drive.current();
            }
        }
        measurement.inputs = self.inputs;
        let away = self.drives.iter().enumerate().filter(|(_, drive)| drive.is_away());
        measurement.homing = away.fold(0, |bits, (index, _)| bits | 1 << index);
        measurement.tool = None;
        measurement.laser = self.fired.take();
        measurement.clock_offset = self.clock_offset;
        measurement.fault = self.fault;
    }

    /// A deadline passed in which nothing was sent: the gate's samples were those of no cycle, dark.
    pub fn pass(&mut self) {
        self.begin_light(LaserCycle::OFF);
    }

    /// Leaves the slaves dark and unpowered, in their initial state; whether all are there.
    pub fn close(&mut self) -> bool {
        let mut measurement = Measurement::default();
        for _ in 0..3 {
            self.send(&Actuation::DISABLED);
            self.receive(&mut measurement);
        }
        let slaves = self.network.group.len() as u16;
        (0..CLOSING).any(|_| {
            self.request(INITIAL);
            let main = self.network.main;
            let question = Command::brd(AL_STATUS).with_wkc(slaves).receive::<u16>(main);
            let until = self.wire.now() + CLOSING_TIME;
            self.wire.ask(question, until, CLOSING_TIME) == Some(Ok(INITIAL))
        })
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
