//! Slow inputs: what devices beside the drives say a few times a second, such as a chiller over Modbus TCP.

use crate::{Nanoseconds, sample};

/// The most devices.
pub const MAX_DEVICES: usize = 16;

/// The most inputs of a machine: one bit each in a sample.
pub const MAX_INPUTS: usize = 64;

/// How a device took its newest round of requests. Discriminants are the values in samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum DeviceState {
    /// Nobody has asked it yet.
    #[default]
    Unknown = 0,
    /// It answered all of it.
    Answering = 1,
    /// It could not be connected to.
    Unreachable = 2,
    /// It did not answer in time.
    Silent = 3,
    /// It refused a request by an exception reply.
    Refusing = 4,
    /// Its answer was none to what it was asked, or the connection broke.
    Garbled = 5,
}

impl DeviceState {
    /// The state with this number in a sample; an unknown number reads as [`Self::Garbled`].
    pub fn from_wire(value: u32) -> Self {
        match value {
            0 => Self::Unknown,
            1 => Self::Answering,
            2 => Self::Unreachable,
            3 => Self::Silent,
            4 => Self::Refusing,
            _ => Self::Garbled,
        }
    }
}

sample! {
    /// How one device took its newest round of requests.
    SlowDevice = "graver.SlowDevice.v1" {
        /// When it last answered a whole round; 0 before it has.
        answered: Nanoseconds,
        /// A [`DeviceState`].
        state: u32,
        /// The code of an exception reply; 0 without one.
        exception: u32,
        /// The request at which its newest round ended early, from 1: its inputs in their order, then its outputs;
        /// 0 for none.
        request: u32,
        /// Always 0; keeps the sample free of padding.
        reserved: u32,
    }
}

sample! {
    /// What the slow inputs say: from the process that asks their devices to the controller and the supervisor.
    SlowInputs = "graver.SlowInputs.v1" {
        /// When it was published; 0 before the first.
        published: Nanoseconds,
        /// The inputs by the newest answers, in the order of the machine's inputs, one bit each: 1 is active. Bits of
        /// inputs that no device reads are 0.
        active: u64,
        /// The devices, in the order of the machine file.
        devices: [SlowDevice; MAX_DEVICES],
        /// The newest value of each of the machine's inputs, in the unit that its file gives; 0 or 1 of a bit.
        values: [f64; MAX_INPUTS],
    }
}

#[cfg(test)]
mod tests {
    use super::DeviceState;

    #[test]
    fn a_state_keeps_its_number() {
        use DeviceState::{Answering, Garbled, Refusing, Silent, Unknown, Unreachable};
        for state in [Unknown, Answering, Unreachable, Silent, Refusing, Garbled] {
            assert_eq!(DeviceState::from_wire(state as u32), state);
        }
        assert_eq!(DeviceState::from_wire(1000), Garbled);
    }
}
