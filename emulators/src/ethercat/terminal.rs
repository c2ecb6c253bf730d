//! Terminals: digital inputs and outputs, an oversampled output for the gate, an analogue output for the power.

use messages::Nanoseconds;

use super::device::{Device, Loss};
use super::drive::VENDOR;
use super::frame::word;
use super::slave::clock::Sync;
use super::slave::sii::{Description, Identity, Manager, Pdo, PdoEntry, Use};
use super::slave::state::Code;
use super::wires::Wires;

/// Channels of the digital terminals.
pub const CHANNELS: u8 = 8;

/// Full power of the analogue output.
const FULL: f64 = 32_767.0;

/// Most samples of the oversampled output in a cycle.
const MOST_SAMPLES: u32 = 1000;

/// Shortest sample [ns].
const SHORTEST_SAMPLE: u32 = 1000;

/// What a terminal is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Eight digital inputs.
    Inputs,
    /// Eight digital outputs; one of them may be the gate.
    Outputs {
        /// The channel that is the gate's, if one is.
        gate: Option<u8>,
    },
    /// A digital output with as many samples in a cycle as SYNC0 comes in it: the gate.
    Oversampled,
    /// An analogue output, 0 to 32767: the power.
    Analogue,
}

/// A terminal.
#[derive(Debug)]
pub struct Terminal {
    kind: Kind,
    wires: Wires,
    /// The wire of its first channel, of those of digital terminals.
    first: u32,
    /// The last level of the oversampled output.
    level: bool,
}

impl Terminal {
    /// A terminal on `wires`; digital channels from the `first` wire on.
    pub fn new(kind: Kind, wires: Wires, first: u32) -> Self {
        Self { kind, wires, first: first.min(u64::BITS - u32::from(CHANNELS)), level: false }
    }

    /// Puts `levels` of the channels onto the wires of the outputs.
    fn switch(&self, outputs: &mut u64, levels: u8) {
        *outputs = *outputs & !(0xff << self.first) | u64::from(levels) << self.first;
    }

    fn facts(&self) -> (u32, [&'static str; 2]) {
        match self.kind {
            Kind::Inputs => (0x1008, ["GVT-1008", "Emulated terminal of 8 digital inputs"]),
            Kind::Outputs { .. } => {
                (0x2008, ["GVT-2008", "Emulated terminal of 8 digital outputs"])
            }
            Kind::Oversampled => (0x2262, ["GVT-2262", "Emulated oversampled digital output"]),
            Kind::Analogue => (0x4001, ["GVT-4001", "Emulated analogue output"]),
        }
    }
}

impl Device for Terminal {
    fn description(&self) -> Description {
        let (product, names) = self.facts();
        let input = self.kind == Kind::Inputs;
        let (index, base, subs, bits) = match self.kind {
            Kind::Inputs => (0x1A00, 0x6000, 1..=CHANNELS, 1),
            Kind::Outputs { .. } => (0x1600, 0x7000, 1..=CHANNELS, 1),
            Kind::Oversampled => (0x1600, 0x7000, 1..=1, 1),
            Kind::Analogue => (0x1600, 0x7000, 1..=1, 16),
        };
        let entries = subs.map(|sub| PdoEntry { index: base, sub, bits }).collect::<Vec<_>>();
        let purpose = if input { Use::Inputs } else { Use::Outputs };
        let length = (entries.len() as u16 * u16::from(bits)).div_ceil(8);
        Description {
            identity: Identity { vendor: VENDOR, product, revision: 1, serial: 0 },
            names,
            managers: vec![Manager { purpose, start: 0x1000, length }],
            pdos: vec![Pdo { index, manager: 0, output: !input, entries }],
        }
    }

    fn sizes(&self, sync: Option<Sync>) -> Result<[usize; 2], Code> {
        match self.kind {
            Kind::Inputs => Ok([0, 1]),
            Kind::Outputs { .. } => Ok([1, 0]),
            Kind::Analogue => Ok([2, 0]),
            Kind::Oversampled => {
                let samples = sync.map_or(1, |sync| sync.count);
                if samples > MOST_SAMPLES {
                    return Err(Code::Sync);
                }
                if sync.is_some_and(|sync| sync.sync0 < SHORTEST_SAMPLE) {
                    return Err(Code::SyncPeriod);
                }
                Ok([samples.div_ceil(8) as usize, 0])
            }
        }
    }

    fn outputs(&mut self, data: &[u8], at: Nanoseconds, sync: Option<Sync>) {
        let mut wires = self.wires.lock();
        match self.kind {
            Kind::Inputs => {}
            Kind::Outputs { gate } => {
                let levels = data.first().copied().unwrap_or(0);
                if let Some(channel) = gate {
                    wires.light.gate(at, levels >> channel.min(7) & 1 != 0);
                }
                self.switch(&mut wires.outputs, levels);
            }
            Kind::Oversampled => {
                let Sync { sync0, count } = sync.unwrap_or(Sync { sync0: 0, count: 1 });
                let level = |sample: u32| {
                    data.get(sample as usize / 8).is_some_and(|byte| byte >> (sample % 8) & 1 != 0)
                };
                let when = |sample: u32| at + Nanoseconds(i64::from(sample) * i64::from(sync0));
                wires.light.pattern(at, (0..count).map(|sample| (when(sample), level(sample))));
                self.level = level(count.saturating_sub(1));
            }
            Kind::Analogue => {
                let value = word(data, 0) as i16;
                wires.light.power(at, (f64::from(value) / FULL).clamp(0.0, 1.0));
            }
        }
    }

    fn inputs(&mut self, data: &mut [u8], _: Nanoseconds) {
        if self.kind == Kind::Inputs {
            let levels = self.wires.lock().inputs >> self.first;
            data.iter_mut().zip(levels.to_le_bytes()).for_each(|(to, from)| *to = from);
        }
    }

    /// An output of a cycle without new data holds its last level: the sample that came last.
    fn missed(&mut self, at: Nanoseconds, _: Sync) -> Result<(), Code> {
        if self.kind == Kind::Oversampled {
            let level = self.level;
            self.wires.lock().light.pattern(at, core::iter::once((at, level)));
        }
        Ok(())
    }

    fn stop(&mut self, at: Nanoseconds, _: Loss) {
        self.level = false;
        let mut wires = self.wires.lock();
        match self.kind {
            Kind::Inputs => {}
            Kind::Outputs { gate } => {
                self.switch(&mut wires.outputs, 0);
                if gate.is_some() {
                    wires.light.gate(at, false);
                }
            }
            Kind::Oversampled => wires.light.gate(at, false),
            Kind::Analogue => wires.light.power(at, 0.0),
        }
    }
}
