//! A small master, written for these tests alone: it shares no code with the emulator or the port.

use emulators::ethercat::{Layout, Segment};
use machine::Machine;
use messages::Nanoseconds;

pub(crate) const CYCLE: i64 = 1_000_000;

pub(crate) struct Master {
    pub(crate) segment: Segment,
    pub(crate) now: Nanoseconds,
    counter: u8,
}

/// A register's command numbers.
pub(crate) const APWR: u8 = 2;
pub(crate) const FPRD: u8 = 4;
pub(crate) const FPWR: u8 = 5;
pub(crate) const BRD: u8 = 7;
pub(crate) const BWR: u8 = 8;
pub(crate) const LRW: u8 = 12;
pub(crate) const FRMW: u8 = 14;

impl Master {
    pub(crate) fn new(layout: &Layout) -> Self {
        let segment = Segment::new(&Machine::builtin(), layout, drives::PlantOptions::default());
        let segment = segment.expect("a segment of the built-in machine");
        Self { segment, now: Nanoseconds(0), counter: 0 }
    }

    /// Sends one datagram; its data and working counter.
    pub(crate) fn ask(
        &mut self,
        command: u8,
        slave: u16,
        offset: u16,
        data: &[u8],
    ) -> (Vec<u8>, u16) {
        let mut frame = vec![0xFF; 6];
        frame.extend([0x10; 6]);
        frame.extend([0x88, 0xA4]);
        frame.extend((0x1000 | (data.len() as u16 + 12)).to_le_bytes());
        frame.extend([command, 0x55]);
        frame.extend(slave.to_le_bytes());
        frame.extend(offset.to_le_bytes());
        frame.extend((data.len() as u16).to_le_bytes());
        frame.extend([0, 0]);
        frame.extend(data);
        frame.extend([0, 0]);
        let back = self.segment.process(&frame, self.now).expect("a frame comes back");
        assert_eq!(back.len(), frame.len());
        assert_eq!(back[6], 0x12, "the first slave marks the source address");
        let (data, counter) = back[26..].split_at(data.len());
        (data.to_vec(), u16::from_le_bytes([counter[0], counter[1]]))
    }

    pub(crate) fn read(&mut self, slave: u16, offset: u16, length: usize) -> Vec<u8> {
        let (data, counter) = self.ask(FPRD, slave, offset, &vec![0; length]);
        assert_eq!(counter, 1, "slave {slave} at {offset:#06x}");
        data
    }

    pub(crate) fn word(&mut self, slave: u16, offset: u16) -> u16 {
        let data = self.read(slave, offset, 2);
        u16::from_le_bytes([data[0], data[1]])
    }

    pub(crate) fn write(&mut self, slave: u16, offset: u16, data: &[u8]) {
        assert_eq!(self.ask(FPWR, slave, offset, data).1, 1, "slave {slave} at {offset:#06x}");
    }

    /// Counts the slaves and gives each its station address, from 1 on.
    pub(crate) fn scan(&mut self) -> u16 {
        let (_, count) = self.ask(BRD, 0, 0, &[0]);
        for position in 0..count {
            let address = (position + 1).to_le_bytes();
            self.ask(APWR, 0_u16.wrapping_sub(position), 0x0010, &address);
        }
        count
    }

    /// Asks for a state; the state that is, and the code of why it is not.
    pub(crate) fn request(&mut self, slave: u16, state: u8) -> (u8, u16) {
        self.write(slave, 0x0120, &[state, 0]);
        (self.word(slave, 0x0130) as u8, self.word(slave, 0x0134))
    }

    /// The four bytes at a word address of the EEPROM.
    pub(crate) fn eeprom(&mut self, slave: u16, address: u32) -> u32 {
        let mut command = vec![0x00, 0x01];
        command.extend(address.to_le_bytes());
        self.write(slave, 0x0502, &command);
        let data = self.read(slave, 0x0508, 4);
        u32::from_le_bytes([data[0], data[1], data[2], data[3]])
    }

    /// Sets a sync manager.
    pub(crate) fn manager(&mut self, slave: u16, index: u16, start: u16, length: u16, control: u8) {
        let mut data = start.to_le_bytes().to_vec();
        data.extend(length.to_le_bytes());
        data.extend([control, 0, u8::from(length > 0), 0]);
        self.write(slave, 0x0800 + 8 * index, &data);
    }

    /// Maps `length` bytes at `logical` to `physical`; 1 to read, 2 to write.
    pub(crate) fn map(
        &mut self,
        slave: u16,
        index: u16,
        logical: u32,
        length: u16,
        (physical, kind): (u16, u8),
    ) {
        let mut data = logical.to_le_bytes().to_vec();
        data.extend(length.to_le_bytes());
        data.extend([0, 7]);
        data.extend(physical.to_le_bytes());
        data.extend([0, kind, 1, 0, 0, 0]);
        self.write(slave, 0x0600 + 16 * index, &data);
    }

    /// A drive in PRE-OP.
    pub(crate) fn pre_op(&mut self, slave: u16) {
        self.manager(slave, 0, 0x1000, 128, 0x26);
        self.manager(slave, 1, 0x1080, 128, 0x22);
        assert_eq!(self.request(slave, 2), (2, 0));
    }

    /// Sends an SDO request and gives what answers it.
    pub(crate) fn sdo(&mut self, slave: u16, request: &[u8]) -> Vec<u8> {
        self.counter = self.counter % 7 + 1;
        let mut message = (request.len() as u16 + 2).to_le_bytes().to_vec();
        message.extend([0, 0, 0, 3 | self.counter << 4, 0, 0x20]);
        message.extend(request);
        message.resize(128, 0);
        self.write(slave, 0x1000, &message);
        let mut answer = self.read(slave, 0x1080, 128);
        // Emergencies may stand before it.
        while answer[7] == 0x10 {
            answer = self.read(slave, 0x1080, 128);
        }
        let service = if answer[8] == 0x80 { 0x20 } else { 0x30 };
        assert_eq!((answer[5] & 0x0F, answer[7]), (3, service), "an SDO response");
        let length = usize::from(u16::from_le_bytes([answer[0], answer[1]]));
        answer[8..6 + length].to_vec()
    }

    /// Writes an object; the abort code, 0 for none.
    pub(crate) fn download(&mut self, slave: u16, index: u16, sub: u8, value: &[u8]) -> u32 {
        let mut request = vec![0x23 | (4 - value.len() as u8) << 2];
        request.extend(index.to_le_bytes());
        request.push(sub);
        request.extend(value);
        request.resize(8, 0);
        let answer = self.sdo(slave, &request);
        if answer[0] == 0x60 {
            return 0;
        }
        u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]])
    }

    /// Puts `objects` into the only list of a direction.
    pub(crate) fn remap(&mut self, slave: u16, (assignment, list): (u16, u16), objects: &[u32]) {
        let mut writes = vec![(assignment, 0, vec![0]), (list, 0, vec![0])];
        for (sub, object) in (1..).zip(objects) {
            writes.push((list, sub, object.to_le_bytes().to_vec()));
        }
        writes.push((list, 0, vec![objects.len() as u8]));
        writes.push((assignment, 1, list.to_le_bytes().to_vec()));
        writes.push((assignment, 0, vec![1]));
        for (index, sub, value) in writes {
            assert_eq!(self.download(slave, index, sub, &value), 0, "{index:04x}:{sub}");
        }
    }

    /// Starts SYNC0 at the next whole cycle of the slave's clock but two, and SYNC1 with every `count`th.
    pub(crate) fn synchronize(&mut self, slave: u16, sync0: u32, count: u32) {
        let time = self.read(slave, 0x0910, 8);
        let time = u64::from_le_bytes(time.try_into().expect("eight bytes"));
        let cycle = CYCLE as u64;
        let start = (time / cycle + 3) * cycle;
        self.write(slave, 0x0990, &start.to_le_bytes());
        self.write(slave, 0x09A0, &sync0.to_le_bytes());
        self.write(slave, 0x09A4, &(sync0 * (count - 1)).to_le_bytes());
        self.write(slave, 0x0981, &[if count > 1 { 7 } else { 3 }]);
    }

    /// Makes the clocks show the same: offsets and delays of a line.
    pub(crate) fn clocks(&mut self, count: u16) {
        self.ask(BWR, 0, 0x0900, &[0; 4]);
        let local = |data: Vec<u8>| i64::from_le_bytes(data.try_into().expect("eight bytes"));
        let port = |data: Vec<u8>| u32::from_le_bytes(data.try_into().expect("four bytes"));
        let reference = local(self.read(1, 0x0918, 8));
        let mut round = Vec::new();
        for slave in 1..=count {
            let own = local(self.read(slave, 0x0918, 8));
            let [out, back] = [0x0900, 0x0904].map(|offset| port(self.read(slave, offset, 4)));
            round.push(back.wrapping_sub(out));
            let delay = (round[0] - round[round.len() - 1]) / 2;
            let offset = reference - own + i64::from(delay);
            self.write(slave, 0x0920, &offset.to_le_bytes());
            self.write(slave, 0x0928, &delay.to_le_bytes());
        }
    }

    pub(crate) fn wait(&mut self, nanoseconds: i64) {
        self.now = self.now + Nanoseconds(nanoseconds);
        self.segment.advance(self.now);
    }
}
