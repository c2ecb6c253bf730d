//! What the devices have said, gathered for the sample that tells it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use machine::modbus::Read;
use messages::{DeviceState, Nanoseconds, SlowDevice, SlowInputs};

/// How a round with a device ended before its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Failed {
    /// How.
    pub state: DeviceState,
    /// The code of an exception reply, 0 without one.
    pub exception: u32,
    /// The request at which it ended, from 1; 0 for none.
    pub request: u32,
}

/// What all devices have said, shared by those who ask them.
#[derive(Debug, Clone, Default)]
pub struct Heard {
    slow: Arc<Mutex<SlowInputs>>,
}

impl Heard {
    /// All of it.
    pub fn all(&self) -> SlowInputs {
        *self.lock()
    }

    /// Takes the word that was read for an input.
    pub fn take(&self, read: &Read, word: u16) {
        let value = read.meaning.value(word);
        let mut slow = self.lock();
        if let Some(place) = slow.values.get_mut(read.input) {
            *place = value;
            let bit = 1_u64 << read.input;
            slow.active =
                if read.meaning.is_active(value) { slow.active | bit } else { slow.active & !bit };
        }
    }

    /// Notes how a round with the device of this index went, which ended at `now`.
    pub fn note(&self, index: usize, outcome: Result<(), Failed>, now: Nanoseconds) {
        let mut slow = self.lock();
        let Some(device) = slow.devices.get_mut(index) else { return };
        let answered = device.answered;
        *device = match outcome {
            Ok(()) => SlowDevice {
                answered: now,
                state: DeviceState::Answering as u32,
                ..SlowDevice::default()
            },
            Err(Failed { state, exception, request }) => {
                SlowDevice { answered, state: state as u32, exception, request, reserved: 0 }
            }
        };
    }

    fn lock(&self) -> MutexGuard<'_, SlowInputs> {
        // Who panicked cannot have left it half written: each change is one assignment.
        self.slow.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
