//! What reading and writing a slave's memory does, beyond moving bytes.

use messages::Nanoseconds;

use super::super::device::has_inputs;
use super::super::frame::{array, double_word, put, word};
use super::sdo::{Abort, Objects};
use super::sii::Use;
use super::state::State;
use super::sync_manager::Direction;
use super::{Passing, Slave, mapping, register};
use crate::ethercat::device::Device;

/// Registers that only the slave writes, as ranges of offsets.
const READ_ONLY: [(u16, u16); 8] = [
    (0x0000, 0x0010),
    (0x0110, 0x0112),
    (0x0130, 0x0136),
    (0x0210, 0x0224),
    (0x0440, 0x0442),
    (0x0900, 0x0910),
    (0x0918, 0x0920),
    (0x092C, 0x0930),
];

/// Event of a new state.
const STATE_EVENT: u16 = 0x0008;

/// Bit of a sync manager's status: the mailbox is full.
const FULL: u8 = 0x08;

impl Slave {
    /// Reads from `offset`; whether there is something to be read.
    pub(super) fn read(&mut self, offset: u16, data: &mut [u8], now: Nanoseconds) -> bool {
        let from = usize::from(offset);
        let to = from + data.len();
        if to > self.memory.len() {
            return false;
        }
        let mailbox = self.managers().find(|(_, it)| it.mailbox && it.overlaps(from, to));
        if let Some((index, manager)) = mailbox
            && (manager.direction == Direction::Write
                || from != usize::from(manager.start)
                || !self.is_full(index))
        {
            return false;
        }
        self.refresh(from, to, now);
        data.iter_mut().zip(self.memory.iter().skip(from)).for_each(|(to, from)| *to = *from);
        if let Some((index, manager)) = mailbox
            && to >= manager.end() as usize
        {
            self.last = data.get(..manager.length.into()).unwrap_or_default().to_vec();
            self.mark_full(index, false);
            self.offer();
        }
        if touches(from, to, register::AL_STATUS, 1) {
            let events = word(&self.memory, register::EVENTS.into()) & !STATE_EVENT;
            self.set(register::EVENTS, &events.to_le_bytes());
        }
        true
    }

    /// Puts what changes by itself into the memory, where it is going to be read.
    pub(super) fn refresh(&mut self, from: usize, to: usize, now: Nanoseconds) {
        if touches(from, to, register::SYSTEM_TIME, 8) {
            let time = self.clock.system(now);
            self.set(register::SYSTEM_TIME, &time.to_le_bytes());
        }
        let (first, end) = self.buffer(Use::Inputs);
        if has_inputs(self.state) && self.clock.sync().is_none() && from < end && first < to {
            self.device.inputs(self.memory.get_mut(first..end).unwrap_or_default(), now);
        }
    }

    /// Writes to `offset`; whether something took it.
    pub(super) fn write(&mut self, offset: u16, data: &[u8], passing: Passing) -> bool {
        let from = usize::from(offset);
        let to = from + data.len();
        if to > self.memory.len() {
            return false;
        }
        if touches(from, to, register::SYSTEM_TIME, 4) {
            self.compare(from, data, passing.out);
            return true;
        }
        let manager = self.managers().find(|(_, it)| it.overlaps(from, to));
        if let Some((_, manager)) = manager {
            if manager.direction == Direction::Read {
                return false;
            }
            if manager.mailbox {
                return from == usize::from(manager.start) && self.take_message(data, &manager);
            }
        }
        for (at, byte) in (from..).zip(data) {
            if !is_read_only(at)
                && let Some(to) = self.memory.get_mut(at)
            {
                *to = *byte;
            }
        }
        if manager.is_some() {
            self.took(to, passing.out);
        } else {
            self.react(from, to, passing);
        }
        true
    }

    /// Process data has been written up to before `to`: the last byte hands it over.
    pub(super) fn took(&mut self, to: usize, now: Nanoseconds) {
        let whole = |end: u32| to >= end as usize;
        let manager = self.managers().map(|(_, it)| it).find(|it| {
            !it.mailbox
                && it.direction == Direction::Write
                && it.overlaps(to - 1, to)
                && whole(it.end())
        });
        let Some(manager) = manager else { return };
        if manager.watchdog {
            self.feed(now);
        }
        if self.state != State::Op {
            return;
        }
        self.fresh = true;
        if self.clock.sync().is_none() {
            self.fresh = false;
            let (from, to) = self.buffer(Use::Outputs);
            self.device.outputs(self.memory.get(from..to).unwrap_or_default(), now, None);
            self.emergencies();
        }
    }

    /// What registers do when they have been written.
    fn react(&mut self, from: usize, to: usize, passing: Passing) {
        let now = passing.out;
        if touches(from, to, register::AL_CONTROL, 1) {
            let [request] = array::<1>(&self.memory, register::AL_CONTROL.into());
            self.request(request, now);
        }
        if touches(from, to, register::EEPROM_CONTROL, 2) {
            self.eeprom();
        }
        if touches(from, to, register::RECEIVE_TIMES, 4) {
            let [out, back] = [passing.out, passing.back].map(|at| self.clock.local(at));
            self.set(register::RECEIVE_TIMES, &(out as u32).to_le_bytes());
            self.set(register::RECEIVE_TIMES + 4, &(back as u32).to_le_bytes());
            self.set(register::RECEIVE_TIME, &out.to_le_bytes());
        }
        if touches(from, to, register::SYSTEM_OFFSET, 8) {
            self.clock.offset =
                i64::from_le_bytes(array(&self.memory, register::SYSTEM_OFFSET.into()));
        }
        if touches(from, to, register::SYNC_ACTIVATION, 1) {
            let first = i64::from_le_bytes(array(&self.memory, register::SYNC_START.into()));
            self.clock.arm(now, self.asked_sync(), first);
        }
        if touches(from, to, register::WATCHDOG_COUNT, 1) {
            self.set(register::WATCHDOG_COUNT, &[0]);
        }
        if touches(from, to, register::INVALID_FRAMES, 8) {
            self.set(register::INVALID_FRAMES, &[0; 8]);
        }
        for index in 0..register::MANAGERS {
            let at = register::SYNC_MANAGERS + 8 * index as u16;
            if touches(from, to, at, 8) {
                self.manager_written(index, at);
            }
        }
    }

    /// A sync manager has been set: it starts empty. A toggled repeat bit asks for the last message again.
    fn manager_written(&mut self, index: usize, at: u16) {
        let [activate, control] = array::<2>(&self.memory, usize::from(at) + 6);
        let repeat = (activate ^ control) & 0x02 != 0;
        if activate & 1 == 0 {
            self.set(at + 5, &[0]);
            return;
        }
        if repeat {
            self.set(at + 7, &[control ^ 0x02]);
            let manager = super::SyncManager::of(&self.memory, index);
            if manager.mailbox && manager.direction == Direction::Read && !self.is_full(index) {
                let last = core::mem::take(&mut self.last);
                put(&mut self.memory, manager.start.into(), &last);
                self.mark_full(index, !last.is_empty());
            }
        }
    }

    /// Compares the clock with the reference's time that a master passes on.
    fn compare(&mut self, from: usize, data: &[u8], now: Nanoseconds) {
        if from != usize::from(register::SYSTEM_TIME) {
            return;
        }
        let delay = i64::from(double_word(&self.memory, register::SYSTEM_DELAY.into()));
        let own = self.clock.system(now);
        // Of a time of 32 bits, what is nearest to our own.
        let told = if data.len() >= 8 {
            i64::from_le_bytes(array(data, 0))
        } else {
            let low = double_word(data, 0).wrapping_sub(own as u32) as i32;
            own.wrapping_add(i64::from(low))
        };
        let difference = self.clock.compare(now, told.wrapping_add(delay));
        let size = difference.unsigned_abs().min(0x7FFF_FFFF) as u32;
        let sign = if difference < 0 { 0x8000_0000 } else { 0 };
        self.set(register::SYSTEM_DIFFERENCE, &(size | sign).to_le_bytes());
    }

    /// Carries an EEPROM command out, at once.
    fn eeprom(&mut self) {
        let control = word(&self.memory, register::EEPROM_CONTROL.into());
        let address = double_word(&self.memory, register::EEPROM_ADDRESS.into()) as usize;
        let at = address.saturating_mul(2);
        match control & 0x0700 {
            0x0100 => {
                let data = if at < self.eeprom.len() { array(&self.eeprom, at) } else { [0xFF; 8] };
                self.set(register::EEPROM_DATA, &data);
            }
            0x0200 if control & 1 != 0 => {
                let word: [u8; 2] = array(&self.memory, register::EEPROM_DATA.into());
                put(&mut self.eeprom, at, &word);
            }
            _ => {}
        }
        self.set(register::EEPROM_CONTROL, &[0x40, 0]);
    }

    fn take_message(&mut self, data: &[u8], manager: &super::SyncManager) -> bool {
        if self.state == State::Init || data.len() < usize::from(manager.length) {
            return false;
        }
        let room = self.managers().find(|(_, it)| it.mailbox && it.direction == Direction::Read);
        let room = room.map_or(0, |(_, it)| usize::from(it.length));
        let mut objects = Served { device: &mut *self.device, state: self.state };
        self.mailbox.take(data, room, &mut objects);
        self.offer();
        true
    }

    /// Puts the next message where the master reads it, if the last one is read.
    pub(super) fn offer(&mut self) {
        let Some((index, manager)) = self
            .managers()
            .find(|(_, it)| it.active && it.mailbox && it.direction == Direction::Read)
        else {
            return;
        };
        if !self.is_full(index)
            && let Some(message) = self.mailbox.pop()
        {
            let start = usize::from(manager.start);
            if let Some(buffer) = self.memory.get_mut(start..manager.end() as usize) {
                buffer.fill(0);
                put(buffer, 0, &message);
                self.mark_full(index, true);
            }
        }
    }

    fn is_full(&self, index: usize) -> bool {
        word(&self.memory, usize::from(register::SYNC_MANAGERS) + 8 * index + 5) as u8 & FULL != 0
    }

    fn mark_full(&mut self, index: usize, full: bool) {
        let status = if full { FULL } else { 0 };
        self.set(register::SYNC_MANAGERS + 8 * index as u16 + 5, &[status]);
        let event = 0x0010_u16 << index;
        let events = word(&self.memory, register::EVENTS.into());
        let events = if full { events | event } else { events & !event };
        self.set(register::EVENTS, &events.to_le_bytes());
    }

    /// Tells a new state, and why if it is a fault.
    pub(super) fn tell_state(&mut self, state: State, code: Option<super::Code>) {
        self.state = state;
        let fault = if code.is_some() { 0x10 } else { 0 };
        self.set(register::AL_STATUS, &[state as u8 | fault]);
        self.set(register::AL_CODE, &code.map_or(0, |code| code as u16).to_le_bytes());
        let events = word(&self.memory, register::EVENTS.into()) | STATE_EVENT;
        self.set(register::EVENTS, &events.to_le_bytes());
    }
}

/// The device's objects, in the state that the slave is in.
struct Served<'a> {
    device: &'a mut dyn Device,
    state: State,
}

impl Objects for Served<'_> {
    fn read(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, Abort> {
        let dictionary = self.device.dictionary().ok_or(Abort::NoObject)?;
        dictionary.read(index, sub).map(<[u8]>::to_vec)
    }

    fn write(&mut self, index: u16, sub: u8, value: &[u8]) -> Result<(), Abort> {
        let dictionary = self.device.dictionary().ok_or(Abort::NoObject)?;
        dictionary.may_write(index, sub, value, self.state)?;
        mapping::check(dictionary, index, sub, value)?;
        self.device.check(index, sub, value)?;
        if let Some(dictionary) = self.device.dictionary() {
            dictionary.put(index, sub, value);
        }
        Ok(())
    }
}

fn touches(from: usize, to: usize, offset: u16, length: usize) -> bool {
    let offset = usize::from(offset);
    from < offset + length && offset < to
}

fn is_read_only(at: usize) -> bool {
    let managers = usize::from(register::SYNC_MANAGERS);
    let of_manager = (managers..managers + 8 * register::MANAGERS).contains(&at)
        && matches!((at - managers) % 8, 5 | 7);
    of_manager
        || READ_ONLY.iter().any(|(from, to)| (usize::from(*from)..usize::from(*to)).contains(&at))
}
