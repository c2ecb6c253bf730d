//! The machine's digital inputs and outputs, as bits of what terminals and drives exchange.

use machine::Machine;
use machine::drives::{Ethercat, EthercatBit};
use machine::operating::MAX_INPUTS;

use super::drive::Drive;
use super::network::{Group, Network};
use crate::port::PortError;

/// An input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Input {
    place: EthercatBit,
    /// The actuator whose drive it is at, if it is at one.
    drive: Option<usize>,
    is_active_low: bool,
}

/// All of them, in the order of the machine file, in which each has a bit.
#[derive(Debug, Clone, Default)]
pub(super) struct Digital {
    inputs: Vec<Input>,
    /// `None` of those that are switched elsewhere.
    outputs: Vec<Option<EthercatBit>>,
}

impl Digital {
    /// Those of `machine` on `bus`.
    pub(super) fn of(machine: &Machine, bus: &Ethercat) -> Self {
        let inputs = machine.operating.inputs.iter().zip(&bus.inputs).map(|(input, place)| Input {
            place: *place,
            drive: bus.actuators.iter().position(|slave| *slave == place.slave),
            is_active_low: input.is_active_low,
        });
        Self {
            inputs: inputs.take(MAX_INPUTS).collect(),
            outputs: bus.outputs.iter().take(MAX_INPUTS).copied().collect(),
        }
    }

    /// Puts the outputs with a bit in `on` into the process data, 1 where they are on.
    pub(super) fn put(&self, on: u64, Network { main, group, .. }: &Network) {
        for (index, output) in self.outputs.iter().enumerate() {
            let Some(EthercatBit { slave, bit }) = output else { continue };
            let Ok(slave) = group.subdevice(main, usize::from(*slave)) else { continue };
            if let Some(byte) = slave.io_raw_mut().outputs().get_mut(usize::from(bit / 8)) {
                let mask = 1 << (bit % 8);
                *byte = if on >> index & 1 != 0 { *byte | mask } else { *byte & !mask };
            }
        }
    }

    /// The inputs as terminals and `drives` have told them, 1 where they are active.
    pub(super) fn active(&self, Network { main, group, .. }: &Network, drives: &[Drive]) -> u64 {
        let is_active = |input: &Input| {
            let EthercatBit { slave, bit } = input.place;
            let level = match input.drive {
                Some(drive) => {
                    let inputs = drives.get(drive).map_or(0, Drive::digital);
                    inputs.checked_shr(u32::from(bit)).unwrap_or(0) & 1 != 0
                }
                None => group.subdevice(main, usize::from(slave)).is_ok_and(|slave| {
                    let data = slave.io_raw();
                    let byte = data.inputs().get(usize::from(bit / 8)).copied().unwrap_or(0);
                    byte >> (bit % 8) & 1 != 0
                }),
            };
            level != input.is_active_low
        };
        let inputs = self.inputs.iter().enumerate();
        inputs.fold(0, |mask, (index, input)| mask | u64::from(is_active(input)) << index)
    }
}

/// Holds the bits that `bus` names for `machine` to what the slaves of `group` exchange.
///
/// # Errors
/// The first one that its slave does not have.
pub(super) fn check(
    main: &'static ethercrab::MainDevice<'static>,
    group: &Group,
    machine: &Machine,
    bus: &Ethercat,
) -> Result<(), PortError> {
    let operating = &machine.operating;
    let inputs = operating.inputs.iter().map(|it| (&it.name, "input")).zip(&bus.inputs);
    let outputs = operating.outputs.iter().map(|it| (&it.name, "output")).zip(&bus.outputs);
    let outputs = outputs.filter_map(|(output, place)| Some((output, place.as_ref()?)));
    for ((name, kind), EthercatBit { slave: position, bit }) in inputs.chain(outputs) {
        if bus.actuators.contains(position) {
            continue;
        }
        let Ok(slave) = group.subdevice(main, usize::from(*position)) else { continue };
        let data = slave.io_raw();
        let bits = 8 * if kind == "input" { data.inputs().len() } else { data.outputs().len() };
        if usize::from(*bit) >= bits {
            return Err(PortError::Mismatch {
                found: format!(
                    "slave {position}, \"{}\", has {bits} bits of {kind}s",
                    slave.name()
                ),
                expected: format!(
                    "the machine file has the {kind} `{name}` on its bit {bit}, counted from 0: change \
                     [drives.ethercat.{kind}s], or look at the order of the slaves"
                ),
            });
        }
    }
    Ok(())
}
