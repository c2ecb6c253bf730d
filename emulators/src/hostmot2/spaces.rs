//! The small memory spaces beside the modules: EEPROM, timer, control of the communication, information.

use messages::Nanoseconds;

use super::layout::BOARD_NAME;

/// How a board is known in its network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// Its hardware address, as one reads it.
    pub mac: [u8; 6],
    /// Its address in the network.
    pub address: [u8; 4],
}

impl Default for Identity {
    fn default() -> Self {
        Self { mac: [0x00, 0x60, 0x1b, 0x16, 0x00, 0x01], address: [127, 0, 0, 1] }
    }
}

/// What the communication counts, in the order of its registers, 16 bits each.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counters {
    /// Bits of errors since they were cleared: 0 parsing, 1 memory, 2 writing.
    pub errors: u16,
    /// Datagrams that are no LBP16.
    pub parse_errors: u16,
    /// Accesses of a width that a space does not have.
    pub memory_errors: u16,
    /// Writes to what is read only.
    pub write_errors: u16,
    /// Datagrams received.
    pub received: u16,
    /// Frames that arrived damaged, and were not looked at.
    pub damaged: u16,
    /// Replies sent.
    pub sent: u16,
}

/// The spaces.
#[derive(Debug, Clone)]
pub struct Spaces {
    /// What the communication counts.
    pub counters: Counters,
    eeprom: [u8; 128],
    /// The waiting registers, and scratch from 0x10 on by which a master proves that a write arrived.
    timer: [u8; 32],
    information: [u8; 32],
    /// LED mode, LED pointer and scratch of the communication control, from 0x14.
    control: [u8; 8],
}

impl Spaces {
    /// The spaces of a board with `identity`.
    pub fn new(identity: Identity) -> Self {
        let mut eeprom = [0; 128];
        for (place, byte) in eeprom[2..8].iter_mut().zip(identity.mac.iter().rev()) {
            *place = *byte;
        }
        eeprom[16..32].copy_from_slice(BOARD_NAME);
        for (place, byte) in eeprom[32..36].iter_mut().zip(identity.address.iter().rev()) {
            *place = *byte;
        }
        let mut information = [0; 32];
        information[..16].copy_from_slice(BOARD_NAME);
        information[16] = 3; // Version of LBP16.
        information[18] = 20; // Version of the firmware.
        Self { counters: Counters::default(), eeprom, timer: [0; 32], information, control: [0; 8] }
    }

    /// The byte at `address` of `space`, 0 where nothing is.
    pub fn byte(&self, space: u8, address: u16, now: Nanoseconds) -> u8 {
        let at = usize::from(address);
        let byte = match space {
            2 => self.eeprom.get(at).copied(),
            // A microsecond counter comes first.
            4 if at < 2 => ((now.0 / 1000) as u16).to_le_bytes().get(at).copied(),
            4 => self.timer.get(at).copied(),
            6 => self.control_byte(at),
            7 => self.information.get(at).copied(),
            _ => None,
        };
        byte.unwrap_or(0)
    }

    /// Writes `byte` at `address` of `space`; `false` where that is read only.
    #[must_use]
    pub fn set_byte(&mut self, space: u8, address: u16, byte: u8) -> bool {
        let at = usize::from(address);
        let place = match space {
            4 => self.timer.get_mut(at),
            6 if (0..8).contains(&at) => {
                // Errors are cleared by writing.
                self.counters = Counters {
                    errors: 0,
                    parse_errors: 0,
                    memory_errors: 0,
                    write_errors: 0,
                    ..self.counters
                };
                return true;
            }
            6 => at.checked_sub(0x14).and_then(|at| self.control.get_mut(at)),
            _ => None,
        };
        let found = place.is_some();
        if let Some(place) = place {
            *place = byte;
        }
        found
    }

    /// What is known about `space`: a cookie, its sizes, its range, its address, its name.
    pub fn about(&self, space: u8, pointer: u16) -> [u8; 16] {
        // Bit 15 writable, then the type, then the widths of access, one bit each.
        let (sizes, range, name): (u16, u16, &[u8; 8]) = match space {
            0 => (0x8204, 16, b"HostMot2"),
            1 => (0x8102, 8, b"EtherChp"),
            2 => (0x0302, 7, b"EtherEEP"),
            3 => (0x0404, 4, b"FPGAFlsh"),
            4 => (0x8202, 5, b"Timers\0\0"),
            6 => (0x8202, 5, b"CommCtrl"),
            7 => (0x0302, 5, b"BoardInf"),
            _ => (0, 0, b"\0\0\0\0\0\0\0\0"),
        };
        let mut about = [0; 16];
        for (place, word) in
            about.chunks_exact_mut(2).zip([0x5a00 | u16::from(space), sizes, range, pointer])
        {
            place.copy_from_slice(&word.to_le_bytes());
        }
        about[8..].copy_from_slice(name);
        about
    }

    fn control_byte(&self, at: usize) -> Option<u8> {
        let Counters { errors, parse_errors, memory_errors, write_errors, received, damaged, sent } =
            self.counters;
        let words = [
            errors,
            parse_errors,
            memory_errors,
            write_errors,
            received,
            received,
            damaged,
            sent,
            sent,
        ];
        if let Some(word) = words.get(at / 2) {
            return word.to_le_bytes().get(at % 2).copied();
        }
        self.control.get(at.checked_sub(0x14)?).copied()
    }
}
