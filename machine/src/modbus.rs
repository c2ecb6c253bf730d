//! Devices beside the drives that are asked over Modbus TCP: chiller, extraction, laser source, interlock words.
//!
//! A device is one input of the machine, active while it does not answer, and each of its inputs is another; they
//! stand behind those of the port among the machine's inputs. Its outputs are those of `[outputs]`.

mod words;

use messages::Nanoseconds;

pub use messages::MAX_DEVICES;
pub use words::{device_words, exception_name, input_words};

/// The port of Modbus TCP.
pub const PORT: u16 = 502;

/// How much older than its period and timeout the newest answer of a device may be, for the process that asks it and
/// the memory between.
const MARGIN: Nanoseconds = Nanoseconds(100_000_000);

/// A device.
#[derive(Debug, Clone, PartialEq)]
pub struct Device {
    /// Its name in the machine file.
    pub name: String,
    /// Its host and port, such as `192.168.1.20:502`.
    pub address: String,
    /// Its unit identifier.
    pub unit: u8,
    /// How often it is asked.
    pub period: Nanoseconds,
    /// How long it may take for all requests of a period, a connection included.
    pub timeout: Nanoseconds,
    /// The index among the machine's inputs of the one that is active while it does not answer; its own follow.
    pub input: usize,
    /// What is read.
    pub reads: Vec<Read>,
    /// What is written.
    pub writes: Vec<Write>,
}

impl Device {
    /// How long ago its newest whole answer may be.
    pub fn longest_silence(&self) -> Nanoseconds {
        self.period + self.timeout + MARGIN
    }

    /// The bits of its own inputs among the machine's, without the one of its silence.
    pub fn inputs(&self) -> u64 {
        self.reads
            .iter()
            .fold(0, |bits, read| bits | 1_u64.checked_shl(read.input as u32).unwrap_or(0))
    }
}

/// An input that is read from a device.
#[derive(Debug, Clone, PartialEq)]
pub struct Read {
    /// Its index among the machine's inputs.
    pub input: usize,
    /// Where it stands in the device.
    pub place: ReadPlace,
    /// Its address, from 0.
    pub address: u16,
    /// When it is active.
    pub meaning: Meaning,
}

/// Where an input stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReadPlace {
    /// A discrete input, function code 2.
    Discrete,
    /// A coil, function code 1.
    Coil,
    /// An input register, function code 4.
    Input,
    /// A holding register, function code 3.
    Holding,
}

impl ReadPlace {
    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Discrete => "discrete input",
            Self::Coil => "coil",
            Self::Input => "input register",
            Self::Holding => "holding register",
        }
    }
}

/// What an input means.
#[derive(Debug, Clone, PartialEq)]
pub enum Meaning {
    /// A bit of its own, or this one of a register.
    Bit {
        /// Which bit of a register; 0 of a bit of its own.
        bit: u32,
        /// Whether it is active while it is 0.
        is_active_low: bool,
    },
    /// A number, active beyond its limits.
    Value {
        /// Whether the register is a number with a sign.
        is_signed: bool,
        /// The value of one count, in the unit.
        scale: f64,
        /// The unit, for people.
        unit: String,
        /// The least and the greatest value at which it is not active; infinite where there is none.
        limits: [f64; 2],
    },
}

impl Meaning {
    /// The value of the word that was read, in the unit; 0 or 1 of a bit.
    pub fn value(&self, word: u16) -> f64 {
        match self {
            Self::Bit { bit, .. } => f64::from(word >> bit & 1),
            Self::Value { is_signed: true, scale, .. } => f64::from(word.cast_signed()) * scale,
            Self::Value { scale, .. } => f64::from(word) * scale,
        }
    }

    /// Whether the input is active at this value.
    pub fn is_active(&self, value: f64) -> bool {
        match self {
            Self::Bit { is_active_low, .. } => (value != 0.0) != *is_active_low,
            Self::Value { limits: [least, most], .. } => !(*least..=*most).contains(&value),
        }
    }
}

/// An output that is written to a device.
#[derive(Debug, Clone, PartialEq)]
pub struct Write {
    /// Its index among the machine's outputs.
    pub output: usize,
    /// Where it stands in the device.
    pub place: WritePlace,
    /// Its address, from 0.
    pub address: u16,
    /// Whether it is on when the process that writes it ends, or the controller is gone.
    pub is_safe_on: bool,
}

/// Where an output stands, and what is written there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WritePlace {
    /// A coil, function code 5.
    Coil {
        /// Whether it is 0 while the output is on.
        is_active_low: bool,
    },
    /// A holding register, function code 6.
    Register {
        /// The word while the output is off, and while it is on.
        words: [u16; 2],
    },
}

impl Write {
    /// What it is called.
    pub fn place_name(&self) -> &'static str {
        match self.place {
            WritePlace::Coil { .. } => "coil",
            WritePlace::Register { .. } => "holding register",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Meaning;

    #[test]
    fn a_word_has_the_value_of_its_scale_and_sign() {
        let limits = [f64::NEG_INFINITY, 30.0];
        let value =
            |is_signed| Meaning::Value { is_signed, scale: 0.5, unit: String::new(), limits };
        assert_eq!(value(false).value(61), 30.5);
        assert_eq!((value(true).value(0xFFFE), value(false).value(0xFFFE)), (-1.0, 32767.0));
        assert!(value(true).is_active(30.5) && !value(true).is_active(30.0));
        assert!(!value(true).is_active(-40.0));
        let bit = |is_active_low| Meaning::Bit { bit: 3, is_active_low };
        assert_eq!((bit(false).value(0b1000), bit(false).value(0b0111)), (1.0, 0.0));
        assert!(bit(false).is_active(1.0) && !bit(false).is_active(0.0));
        assert!(bit(true).is_active(0.0) && !bit(true).is_active(1.0));
    }
}
