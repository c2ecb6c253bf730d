//! The machine's inputs and outputs on an EtherCAT bus.

use super::ethercat::{EthercatBitTable, EthercatTable, LAST_SLAVE, Whole};
use super::wiring::Wiring;
use super::{find, refuse_index, whole};
use crate::document::Diagnostics;
use crate::drives::{Ethercat, EthercatBit};
use crate::operating::Operating;

/// The last bit of a terminal's process data.
const LAST_BIT: u32 = 255;

/// The last bit of a drive's digital inputs.
const LAST_INPUT_OF_DRIVE: u16 = 31;

/// Puts the places of what `operating` has into `bus`; notes those of nothing, what has none, and what cannot be there.
pub(super) fn connect(
    table: &EthercatTable,
    bus: &mut Ethercat,
    (operating, switched): (&Operating, &[&str]),
    diagnostics: &mut Diagnostics,
) {
    refuse_index(operating, "slave on a bus", table.span, diagnostics);
    let wiring = Wiring {
        drives: "ethercat",
        keys: "`slave` and `bit`",
        span: table.span,
        inputs: table.inputs.as_ref(),
        outputs: table.outputs.as_ref(),
    };
    let bit = |table: &EthercatBitTable, diagnostics: &mut Diagnostics| {
        let mut number = |number: &Whole, most| whole(number, most, diagnostics) as u16;
        EthercatBit { slave: number(&table.slave, LAST_SLAVE), bit: number(&table.bit, LAST_BIT) }
    };
    (bus.inputs, bus.outputs) = wiring.places(operating, switched, bit, diagnostics);
    for (input, place) in operating.inputs.iter().zip(&bus.inputs) {
        if bus.actuators.contains(&place.slave) && place.bit > LAST_INPUT_OF_DRIVE {
            let span =
                find(table.inputs.as_ref(), &input.name).map_or(table.span, |own| own.bit.span);
            diagnostics.contradict(
                span,
                format!("slave {} is a drive, which has no input {}", place.slave, place.bit),
                &format!("write 0 to {LAST_INPUT_OF_DRIVE}: the bits of its object 60FDh"),
            );
        }
    }
    for (index, output) in operating.outputs.iter().enumerate() {
        let Some(Some(place)) = bus.outputs.get(index) else { continue };
        let own = find(table.outputs.as_ref(), &output.name);
        let span = own.map_or(table.span, |own| own.slave.span);
        let mut refuse = |message: String, help: &str| diagnostics.contradict(span, message, help);
        let name = &output.name;
        if output.is_active_low {
            // All that a terminal knows to do by itself is to put its outputs low.
            refuse(
                format!(
                    "a terminal that hears nothing puts its outputs low, which would switch `{name}` on"
                ),
                "wire it so that a high level switches it on, and leave `active` out",
            );
        }
        if bus.actuators.contains(&place.slave) {
            refuse(
                format!(
                    "slave {} is a drive, and `{name}` cannot be one of its outputs",
                    place.slave
                ),
                "name a terminal of digital outputs",
            );
        }
        if let Some(user) = user(bus, *place) {
            refuse(
                format!("`{name}` is {user}"),
                "name a terminal of digital outputs, and a bit of its own",
            );
        }
        let mut before = bus.outputs.iter().take(index).zip(&operating.outputs);
        if let Some((_, other)) = before.find(|(other, _)| other.as_ref() == Some(place)) {
            refuse(
                format!(
                    "`{name}` is on bit {} of slave {}, as `{}` is",
                    place.bit, place.slave, other.name
                ),
                "give each output a bit of its own",
            );
        }
    }
}

/// What the laser has at `place`.
fn user(bus: &Ethercat, place: EthercatBit) -> Option<&'static str> {
    let is_gate = bus.gate.is_some_and(|gate| {
        gate.slave == place.slave && (gate.oversampling > 1 || gate.channel == place.bit)
    });
    match (is_gate, bus.power == Some(place.slave)) {
        (true, _) => Some("where the gate is"),
        (_, true) => Some("where the power is"),
        _ => None,
    }
}
