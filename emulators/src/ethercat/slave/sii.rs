//! The image of a slave's EEPROM (ETG.2010): who it is, and what a master must know before it can talk to it.

/// A slave's identity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// Vendor.
    pub vendor: u32,
    /// Product code.
    pub product: u32,
    /// Revision.
    pub revision: u32,
    /// Serial number.
    pub serial: u32,
}

/// What a sync manager is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Use {
    /// Mailbox to the slave.
    MailboxOut = 1,
    /// Mailbox from the slave.
    MailboxIn = 2,
    /// Process data to the slave.
    Outputs = 3,
    /// Process data from the slave.
    Inputs = 4,
}

/// A sync manager as it shall be set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Manager {
    /// What it is for.
    pub purpose: Use,
    /// First byte.
    pub start: u16,
    /// Bytes, before a master maps anything else.
    pub length: u16,
}

impl Manager {
    fn control(&self) -> u8 {
        match self.purpose {
            Use::MailboxOut => 0x26,
            Use::MailboxIn => 0x22,
            // With the watchdog.
            Use::Outputs => 0x64,
            Use::Inputs => 0x20,
        }
    }
}

/// An object in a list of process data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PdoEntry {
    /// Index of the object, 0 for padding.
    pub index: u16,
    /// Subindex.
    pub sub: u8,
    /// Its size.
    pub bits: u8,
}

/// A list of process data.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pdo {
    /// Index of the list.
    pub index: u16,
    /// Its sync manager.
    pub manager: u8,
    /// Whether it goes to the slave.
    pub output: bool,
    /// What is in it.
    pub entries: Vec<PdoEntry>,
}

/// What the image is made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Description {
    /// Who it is.
    pub identity: Identity,
    /// Its order code, and its name.
    pub names: [&'static str; 2],
    /// Its sync managers.
    pub managers: Vec<Manager>,
    /// Its process data as it is delivered.
    pub pdos: Vec<Pdo>,
}

impl Description {
    /// The manager for `purpose`, with its number.
    pub fn manager(&self, purpose: Use) -> Option<(usize, &Manager)> {
        self.managers.iter().enumerate().find(|(_, manager)| manager.purpose == purpose)
    }

    /// The image, of 2 KiB.
    pub fn image(&self) -> Vec<u8> {
        let mut image = Image(Vec::with_capacity(2048));
        // Process data interface of a microcontroller; control, configuration, pulse length, alias.
        image.words(&[0x0C08, 0, 0, 0, 0, 0, 0]);
        let checksum = checksum(&image.0);
        image.words(&[u16::from(checksum)]);
        let Identity { vendor, product, revision, serial } = self.identity;
        for number in [vendor, product, revision, serial] {
            image.0.extend(number.to_le_bytes());
        }
        image.words(&[0; 8]);
        let mailbox =
            |purpose| self.manager(purpose).map_or([0, 0], |(_, it)| [it.start, it.length]);
        image.words(&mailbox(Use::MailboxOut));
        image.words(&mailbox(Use::MailboxIn));
        let coe = self.manager(Use::MailboxOut).is_some();
        image.words(&[if coe { 0x0004 } else { 0 }]);
        image.0.resize(2 * 0x3E, 0);
        // 16 kbit; version 1.
        image.words(&[0x000F, 1]);
        self.categories(&mut image, coe);
        image.0.resize(2048, 0xFF);
        image.0
    }

    fn categories(&self, image: &mut Image, coe: bool) {
        let mut strings = vec![self.names.len() as u8];
        for name in self.names {
            strings.push(name.len() as u8);
            strings.extend(name.bytes());
        }
        image.category(10, &strings);
        let mut general = [0; 32];
        // Group, order code and name by the strings; SDOs, and lists that can be assigned and set.
        (general[2], general[3], general[14]) = (1, 2, 2);
        general[5] = if coe { 0x0D } else { 0 };
        // Two ports of 100BASE-TX.
        general[16] = 0x11;
        image.category(30, &general);
        let units: Vec<u8> = [Use::Outputs, Use::Inputs]
            .into_iter()
            .filter(|purpose| self.manager(*purpose).is_some())
            .map(|purpose| if purpose == Use::Outputs { 1 } else { 2 })
            .collect();
        image.category(40, &units);
        let mut managers = Vec::new();
        for manager in &self.managers {
            managers.extend(manager.start.to_le_bytes());
            managers.extend(manager.length.to_le_bytes());
            managers.extend([manager.control(), 0, 1, manager.purpose as u8]);
        }
        image.category(41, &managers);
        for pdo in &self.pdos {
            let mut list = pdo.index.to_le_bytes().to_vec();
            list.extend([pdo.entries.len() as u8, pdo.manager, 0, 2, 0, 0]);
            for entry in &pdo.entries {
                list.extend(entry.index.to_le_bytes());
                list.extend([entry.sub, 0, data_type(entry.bits), entry.bits, 0, 0]);
            }
            image.category(if pdo.output { 51 } else { 50 }, &list);
        }
        image.words(&[0xFFFF, 0xFFFF]);
    }
}

/// CoE's number of an unsigned type of `bits`.
fn data_type(bits: u8) -> u8 {
    match bits {
        1 => 1,
        8 => 5,
        16 => 6,
        32 => 7,
        _ => 0,
    }
}

struct Image(Vec<u8>);

impl Image {
    fn words(&mut self, words: &[u16]) {
        words.iter().for_each(|word| self.0.extend(word.to_le_bytes()));
    }

    fn category(&mut self, kind: u16, bytes: &[u8]) {
        self.words(&[kind, bytes.len().div_ceil(2) as u16]);
        self.0.extend(bytes);
        self.0.resize(self.0.len().next_multiple_of(2), 0);
    }
}

/// The checksum of the first seven words: x⁸ + x² + x + 1, from 0xFF.
fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0xFF, |sum, byte| {
        (0..8).fold(sum ^ byte, |sum, _| if sum & 0x80 == 0 { sum << 1 } else { sum << 1 ^ 0x07 })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_with_its_checksum_leaves_no_remainder() {
        let words = [0x04, 0x00, 0x00, 0x00, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        let sum = checksum(&words);
        let all = [&words[..], &[sum]].concat();
        assert_eq!(checksum(&all), 0);
    }

    #[test]
    fn an_image_has_its_categories_one_after_the_other() {
        let description = Description {
            identity: Identity { vendor: 1, product: 2, revision: 3, serial: 4 },
            names: ["A", "Bcd"],
            managers: vec![Manager { purpose: Use::Outputs, start: 0x1000, length: 1 }],
            pdos: vec![Pdo {
                index: 0x1600,
                manager: 0,
                output: true,
                entries: vec![PdoEntry { index: 0x7000, sub: 1, bits: 1 }],
            }],
        };
        let image = description.image();
        let (mut at, mut kinds) = (0x80, Vec::new());
        let word = |at: usize| crate::ethercat::frame::word(&image, at);
        while word(at) != 0xFFFF {
            kinds.push((word(at), word(at + 2)));
            at += 4 + 2 * usize::from(word(at + 2));
        }
        assert_eq!(kinds, [(10, 4), (30, 16), (40, 1), (41, 4), (51, 8)]);
    }
}
