//! A slave: its controller's memory, and what a frame does to it on its way through.

pub mod clock;
pub mod dictionary;
pub mod fmmu;
pub mod mailbox;
pub mod mapping;
mod memory;
pub(crate) mod registers;
pub mod sdo;
pub mod sii;
pub mod state;
pub mod sync_manager;
mod transitions;

use messages::Nanoseconds;

use super::device::{Device, Loss, has_inputs};
use super::frame::{Access, Addressing, Command, Datagram, array, double_word, put, word};
use clock::{Clock, Sync};
use fmmu::{Fmmu, copy_bits};
use mailbox::Mailbox;
use registers as register;
use sii::Use;
use state::{Code, State};
use sync_manager::{Direction, SyncManager};

/// A slave with what stands behind it.
#[derive(Debug)]
pub struct Slave {
    memory: Vec<u8>,
    eeprom: Vec<u8>,
    clock: Clock,
    mailbox: Mailbox,
    /// The last message that the master has read, should it have got lost.
    last: Vec<u8>,
    state: State,
    /// Whether process data has come since it was last taken.
    fresh: bool,
    /// When the watchdog of the process data expires.
    watchdog: Option<Nanoseconds>,
    /// What its EEPROM says.
    description: sii::Description,
    device: Box<dyn Device>,
}

/// When frames pass a slave: its processing unit, and each of its ports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Passing {
    /// On the way out.
    pub out: Nanoseconds,
    /// On the way back.
    pub back: Nanoseconds,
}

impl Slave {
    /// A slave that has just been powered, its clock being `clock`.
    pub fn new(device: Box<dyn Device>, clock: Clock) -> Self {
        let description = device.description();
        let eeprom = description.image();
        let mut slave = Self {
            memory: vec![0; register::MEMORY],
            eeprom,
            clock,
            mailbox: Mailbox::default(),
            last: Vec::new(),
            state: State::Init,
            fresh: false,
            watchdog: None,
            description,
            device,
        };
        slave.reset();
        slave
    }

    /// Its memory as it is when the power comes.
    fn reset(&mut self) {
        self.memory.fill(0);
        // An ET1100; features: mapping by bits, clock of 64 bits.
        let features: [u8; 10] =
            [0x11, 0, 2, 0, register::FMMUS as u8, register::MANAGERS as u8, 8, 0x0F, 0x0C, 0];
        put(&mut self.memory, 0, &features);
        self.set(register::ALIAS, &array::<2>(&self.eeprom, 8));
        self.set(register::WATCHDOG_DIVIDER, &2498_u16.to_le_bytes());
        self.set(register::WATCHDOG_TIME, &1000_u16.to_le_bytes());
        self.set(register::WATCHDOG_STATUS, &[1]);
        // Eight bytes at a time, written word by word.
        self.set(register::EEPROM_CONTROL, &[0x40, 0]);
        self.set(register::AL_STATUS, &[State::Init as u8]);
        self.state = State::Init;
        (self.fresh, self.watchdog) = (false, None);
        self.mailbox = Mailbox::default();
        self.clock.offset = 0;
        self.clock.arm(Nanoseconds(0), None, 0);
    }

    /// Takes the power away at `now`, and gives it back.
    pub fn power_cycle(&mut self, now: Nanoseconds) {
        self.device.stop(now, Loss::Power);
        self.reset();
    }

    /// Falls back from OP to SAFE-OP at `now`, as by a fault of its own that it takes for a lack of sync signals.
    pub fn leave(&mut self, now: Nanoseconds) {
        if self.state == State::Op {
            self.fall(now, Loss::Synchronization, Code::Synchronization);
        }
    }

    /// What stands behind it.
    pub fn device(&self) -> &dyn Device {
        &*self.device
    }

    /// Its state.
    pub fn state(&self) -> State {
        self.state
    }

    /// The code of why a state was refused or left, 0 for none.
    pub fn code(&self) -> u16 {
        word(&self.memory, usize::from(register::AL_CODE))
    }

    /// How often its watchdog expired since it was powered.
    pub fn watchdog_count(&self) -> u8 {
        self.memory.get(usize::from(register::WATCHDOG_COUNT)).copied().unwrap_or(0)
    }

    /// How many frames with a wrong checksum it has counted, 255 at most.
    pub fn invalid_frames(&self) -> u8 {
        self.memory.get(usize::from(register::INVALID_FRAMES)).copied().unwrap_or(0)
    }

    /// Puts the state of the ports into the data link's status: whether another slave is behind this one.
    pub fn link(&mut self, behind: bool) {
        // Ports 0 and 1 have a link and are open, or 1 is closed; 2 and 3 are not there. The application runs.
        let status: u16 = if behind { 0x5A33 } else { 0x5613 };
        self.set(register::DL_STATUS, &status.to_le_bytes());
    }

    /// Counts a frame with a wrong checksum.
    pub fn invalid_frame(&mut self) {
        let count = array::<1>(&self.memory, register::INVALID_FRAMES.into());
        self.set(register::INVALID_FRAMES, &count.map(|count| count.saturating_add(1)));
    }

    /// What `datagram` does as it passes.
    pub fn pass(&mut self, datagram: &mut Datagram<'_>, passing: Passing) {
        match datagram.command {
            Command::Nop => return,
            Command::Logical(access) => self.logical(datagram, access, passing.out),
            Command::Register { by, access } => {
                let offset = datagram.offset();
                let chosen = self.is_chosen(datagram, by);
                if chosen && by == Addressing::Broadcast {
                    self.broadcast(datagram, access, passing);
                } else if chosen {
                    self.register(datagram, offset, access, passing);
                }
            }
            Command::ReadMultipleWrite(by) => {
                let offset = datagram.offset();
                let access =
                    if self.is_chosen(datagram, by) { Access::Read } else { Access::Write };
                self.register(datagram, offset, access, passing);
            }
        }
        let events = self.events() & word(&self.memory, register::EVENT_MASK.into());
        datagram.raise(events);
    }

    /// Whether `datagram` means this slave; counts its position up.
    fn is_chosen(&self, datagram: &mut Datagram<'_>, by: Addressing) -> bool {
        let asked = datagram.slave();
        match by {
            Addressing::Broadcast => {
                datagram.count_up();
                true
            }
            Addressing::Position => {
                datagram.count_up();
                asked == 0
            }
            Addressing::Station => {
                let alias = word(&self.memory, register::ALIAS_ENABLED.into()) & 1 != 0;
                asked == word(&self.memory, register::STATION.into())
                    || alias && asked == word(&self.memory, register::ALIAS.into())
            }
        }
    }

    fn register(
        &mut self,
        datagram: &mut Datagram<'_>,
        offset: u16,
        access: Access,
        passing: Passing,
    ) {
        let written = access.writes().then(|| datagram.data.to_vec());
        if access.reads() && self.read(offset, datagram.data, passing.out) {
            datagram.worked(1);
        }
        if let Some(written) = written
            && self.write(offset, &written, passing)
        {
            datagram.worked(if access.reads() { 2 } else { 1 });
        }
    }

    /// Reads of all slaves are joined bit by bit.
    fn broadcast(&mut self, datagram: &mut Datagram<'_>, access: Access, passing: Passing) {
        let offset = datagram.offset();
        if !access.reads() {
            return self.register(datagram, offset, access, passing);
        }
        let before = datagram.data.to_vec();
        self.register(datagram, offset, access, passing);
        datagram.data.iter_mut().zip(before).for_each(|(byte, before)| *byte |= before);
    }

    fn logical(&mut self, datagram: &mut Datagram<'_>, access: Access, now: Nanoseconds) {
        let address = datagram.logical();
        let written = datagram.data.to_vec();
        let (mut read, mut wrote) = (false, false);
        for index in 0..register::FMMUS {
            let Some(unit) = Fmmu::of(&self.memory, index) else { continue };
            let Some(overlap) = unit.overlap(address, written.len()) else { continue };
            let (from, to) = overlap.bytes();
            if access.reads() && unit.reads && self.readable(from, to) {
                self.refresh(from, to, now);
                copy_bits(&self.memory, overlap.memory, datagram.data, overlap.data, overlap.bits);
                read = true;
            }
            if access.writes() && unit.writes && self.writable(from, to) {
                let bits = overlap.bits;
                copy_bits(&written, overlap.data, &mut self.memory, overlap.memory, bits);
                self.took(to, now);
                wrote = true;
            }
        }
        let both = access.reads();
        datagram.worked(u16::from(read) + if wrote { 1 + u16::from(both) } else { 0 });
    }

    /// When the next thing happens by itself, seen at `now`.
    pub fn next_event(&self, now: Nanoseconds) -> Option<Nanoseconds> {
        match (self.watchdog, self.clock.next(now)) {
            (Some(watchdog), Some(sync)) => Some(watchdog.min(sync)),
            (watchdog, sync) => watchdog.or(sync),
        }
    }

    /// Does what is due at `now`.
    pub fn happen(&mut self, now: Nanoseconds) {
        if self.clock.next(now).is_some_and(|next| next <= now)
            && let Some(sync) = self.clock.sync()
        {
            self.clock.passed();
            self.synchronize(now, sync);
        }
        if self.watchdog.is_some_and(|at| at <= now) {
            self.watchdog = None;
            self.bite(now);
        }
    }

    /// The device's loops go on, the motors having been measured at `at`.
    pub fn tick(&mut self, at: Nanoseconds) {
        self.device.tick(at);
        self.emergencies();
    }

    /// A cycle of the sync signals begins.
    fn synchronize(&mut self, now: Nanoseconds, sync: Sync) {
        if self.state == State::Op {
            if core::mem::take(&mut self.fresh) {
                let (from, to) = self.buffer(Use::Outputs);
                self.device.outputs(self.memory.get(from..to).unwrap_or_default(), now, Some(sync));
            } else if let Err(code) = self.device.missed(now, sync) {
                self.fall(now, Loss::Synchronization, code);
            }
        }
        if has_inputs(self.state) {
            let (from, to) = self.buffer(Use::Inputs);
            self.device.inputs(self.memory.get_mut(from..to).unwrap_or_default(), now);
        }
        self.emergencies();
    }

    /// The watchdog of the process data has expired.
    fn bite(&mut self, now: Nanoseconds) {
        let count = self.watchdog_count().saturating_add(1);
        self.set(register::WATCHDOG_STATUS, &[0]);
        self.set(register::WATCHDOG_COUNT, &[count]);
        if self.state == State::Op {
            self.fall(now, Loss::Watchdog, Code::Watchdog);
        }
    }

    /// Falls back from OP with a fault.
    fn fall(&mut self, now: Nanoseconds, loss: Loss, code: Code) {
        self.device.stop(now, loss);
        self.tell_state(State::SafeOp, Some(code));
        self.emergencies();
    }

    fn emergencies(&mut self) {
        while let Some((code, register)) = self.device.emergency() {
            self.mailbox.emergency(code, register);
            self.offer();
        }
    }

    /// Feeds the watchdog of the process data, if there is one.
    fn feed(&mut self, now: Nanoseconds) {
        let divider = i64::from(word(&self.memory, register::WATCHDOG_DIVIDER.into())) + 2;
        let time = i64::from(word(&self.memory, register::WATCHDOG_TIME.into())) * divider * 40;
        self.watchdog = (time > 0).then(|| now + Nanoseconds(time));
        self.set(register::WATCHDOG_STATUS, &[1]);
    }

    /// Where the process data for `purpose` is in the memory, as its manager has been set.
    fn buffer(&self, purpose: Use) -> (usize, usize) {
        let Some((index, _)) = self.description.manager(purpose) else { return (0, 0) };
        let manager = SyncManager::of(&self.memory, index);
        let inside = manager.active && manager.end() as usize <= self.memory.len();
        if inside { (manager.start.into(), manager.end() as usize) } else { (0, 0) }
    }

    /// Events to the master: a new state, and full mailboxes.
    fn events(&self) -> u16 {
        word(&self.memory, register::EVENTS.into())
    }

    /// The sync signals that are asked for, whether or not they are made.
    fn asked_sync(&self) -> Option<Sync> {
        let at = |offset: u16| double_word(&self.memory, offset.into());
        let [activation] = array::<1>(&self.memory, register::SYNC_ACTIVATION.into());
        Sync::of(activation, at(register::SYNC0_PERIOD), at(register::SYNC1_PERIOD))
    }

    fn set(&mut self, offset: u16, value: &[u8]) {
        put(&mut self.memory, offset.into(), value);
    }

    fn managers(&self) -> impl Iterator<Item = (usize, SyncManager)> + '_ {
        (0..register::MANAGERS).map(|index| (index, SyncManager::of(&self.memory, index)))
    }

    /// Whether logical reads reach the bytes.
    fn readable(&self, from: usize, to: usize) -> bool {
        to <= self.memory.len()
            && !self.managers().any(|(_, manager)| {
                manager.mailbox && manager.overlaps(from, to)
                    || manager.direction == Direction::Write && manager.overlaps(from, to)
            })
    }

    /// Whether logical writes reach the bytes: process data to the slave, or plain memory.
    fn writable(&self, from: usize, to: usize) -> bool {
        from >= usize::from(register::PROCESS_MEMORY)
            && to <= self.memory.len()
            && !self.managers().any(|(_, manager)| {
                manager.overlaps(from, to)
                    && (manager.mailbox || manager.direction == Direction::Read)
            })
    }
}
