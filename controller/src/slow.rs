//! The inputs that slow devices tell, as the cycle takes them: without waiting for anybody.
//!
//! What is heard of a device holds for as long as its period and its timeout; after that, where it refuses a request,
//! and where the process that asks it has died, the input of its silence is active, and what it said last of its others stays.

use machine::Machine;
use messages::{DeviceState, MAX_DEVICES, Nanoseconds, SlowInputs};

use crate::exchange::Presence;

/// What is to be known of a device.
#[derive(Debug, Clone, Copy, Default)]
struct Watched {
    /// The bit of its silence.
    silence: u64,
    longest: Nanoseconds,
}

/// What was heard of the devices of one machine.
#[derive(Debug, Clone)]
pub struct Slow {
    devices: [Watched; MAX_DEVICES],
    count: usize,
    /// The bits of all inputs that devices tell, without those of their silence.
    told: u64,
    /// `None` where nobody asks them, as in virtual time.
    newest: Option<SlowInputs>,
}

impl Slow {
    /// Of this machine; nothing is expected of its devices before the first words.
    pub fn new(machine: &Machine) -> Self {
        let mut devices = [Watched::default(); MAX_DEVICES];
        let own = &machine.operating.devices;
        for (watched, device) in devices.iter_mut().zip(own) {
            let silence = 1_u64.checked_shl(device.input as u32).unwrap_or(0);
            *watched = Watched { silence, longest: device.longest_silence() };
        }
        let told = own.iter().fold(0, |bits, device| bits | device.inputs());
        Self { devices, count: own.len().min(MAX_DEVICES), told, newest: None }
    }

    /// Takes the newest words.
    pub fn hear(&mut self, slow: &SlowInputs) {
        self.newest = Some(*slow);
    }

    /// The inputs that are active at `now`, one bit each, with the process that asks being there or not.
    pub fn active(&self, now: Nanoseconds, asking: Presence) -> u64 {
        let Some(slow) = &self.newest else { return 0 };
        let devices = self.devices[..self.count].iter().zip(&slow.devices);
        devices.fold(slow.active & self.told, |active, (watched, said)| {
            // A time far ahead is no time at all, and must not hold for ever.
            let age = now.0.saturating_sub(said.answered.0).unsigned_abs();
            let is_heard = said.state == DeviceState::Answering as u32
                && age <= watched.longest.0.unsigned_abs()
                && asking == Presence::Present;
            if is_heard { active } else { active | watched.silence }
        })
    }
}
