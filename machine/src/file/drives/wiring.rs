//! The machine's inputs and outputs on an EtherCAT bus.

use super::ethercat::{EthercatBitTable, EthercatTable, LAST_SLAVE, Whole};
use super::{find, refuse_index, refuse_others, whole};
use crate::document::{Diagnostics, Named, ProblemKind, Span};
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
    let inputs: Vec<&str> = operating.inputs.iter().map(|input| input.name.as_str()).collect();
    let outputs: Vec<&str> = operating.outputs.iter().map(|output| output.name.as_str()).collect();
    let [wired_in, wired_out] = [table.inputs.as_ref(), table.outputs.as_ref()];
    let inputs_at = bits((wired_in, "input", table.span), &inputs, &[], diagnostics);
    bus.inputs = inputs_at.into_iter().flatten().collect();
    bus.outputs = bits((wired_out, "output", table.span), &outputs, switched, diagnostics);
    for (name, place) in inputs.iter().zip(&bus.inputs) {
        if bus.actuators.contains(&place.slave) && place.bit > LAST_INPUT_OF_DRIVE {
            let span = find(table.inputs.as_ref(), name).map_or(table.span, |own| own.bit.span);
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

/// The place of each of `names`, as `tables`, of which there should be some at `span`, have them; those in
/// `elsewhere` need none.
fn bits(
    (tables, kind, span): (Option<&Named<EthercatBitTable>>, &str, Span),
    names: &[&str],
    elsewhere: &[&str],
    diagnostics: &mut Diagnostics,
) -> Vec<Option<EthercatBit>> {
    refuse_others(tables, kind, names, diagnostics);
    let place = |name: &&str| match find(tables, name) {
        Some(table) => {
            let mut number = |number: &Whole, most| whole(number, most, diagnostics) as u16;
            let slave = number(&table.slave, LAST_SLAVE);
            Some(EthercatBit { slave, bit: number(&table.bit, LAST_BIT) })
        }
        None if elsewhere.contains(name) => None,
        None => {
            // A switch that nobody reads would never be active.
            let message = format!("nothing is said of where the {kind} `{name}` is");
            let help =
                Some(format!("add [drives.ethercat.{kind}s.{name}] with its `slave` and `bit`"));
            diagnostics.refuse(ProblemKind::MissingKey, span, message, help);
            Some(EthercatBit { slave: 0, bit: 0 })
        }
    };
    names.iter().map(place).collect()
}
