//! What the machine file says of how the machine is operated: inputs and outputs, homing, safety.

mod homing_safety;
mod inputs_outputs;

use super::axes::Joint;
use super::tables::AxisTable;
use crate::actuator::Actuator;
use crate::axis::Axis;
use crate::document::{Diagnostics, Named};
use crate::operating::{MAX_INPUTS, Operating, Output};
use homing_safety::safety;
pub use homing_safety::{HomingTable, SafetyTable};
use inputs_outputs::output;
pub use inputs_outputs::{InputTable, Level, OutputTable};

/// The parts of the machine file that say how it is operated.
pub(super) struct Tables<'a> {
    pub(super) inputs: Option<&'a Named<InputTable>>,
    pub(super) outputs: Option<&'a Named<OutputTable>>,
    pub(super) safety: &'a SafetyTable,
    /// In the order of the axes.
    pub(super) axes: &'a [&'a AxisTable],
    pub(super) joints: &'a [Joint],
}

/// How the machine of `tables` with these axes and actuators is operated.
pub(super) fn operating(
    tables: &Tables<'_>,
    axes: &[Axis],
    actuators: &[Actuator],
    diagnostics: &mut Diagnostics,
) -> Operating {
    let known = Known { axes, actuators, joints: tables.joints };
    let mut inputs = Vec::new();
    for (name, table) in tables.inputs.iter().flat_map(|named| &named.entries) {
        if let Some(input) = known.input(name, table, diagnostics) {
            inputs.push(input);
        }
    }
    let outputs = tables.outputs.iter().flat_map(|named| &named.entries);
    let outputs: Vec<Output> =
        outputs.filter_map(|(name, table)| output(name, table, diagnostics)).collect();
    let counts = [
        (tables.inputs.map(|named| named.span), inputs.len(), "inputs"),
        (tables.outputs.map(|named| named.span), outputs.len(), "outputs"),
    ];
    for (span, count, what) in counts {
        if let Some(span) = span.filter(|_| count > MAX_INPUTS) {
            let help = format!("a machine can have {MAX_INPUTS} of them");
            diagnostics.contradict(span, format!("the machine has {count} {what}"), &help);
        }
    }
    let each = axes.iter().zip(tables.axes).zip(tables.joints).enumerate();
    let homing = each.map(|(index, ((axis, table), joint))| {
        let table = table.homing.as_ref()?;
        let homing = known.homing(table, axis, joint, diagnostics)?;
        known.refuse_blind(index, &homing, &inputs, table, diagnostics);
        Some(homing)
    });
    Operating {
        homing: homing.collect(),
        inputs,
        outputs,
        devices: Vec::new(),
        safety: safety(tables.safety, diagnostics),
    }
}

/// What inputs and homing refer to.
struct Known<'a> {
    axes: &'a [Axis],
    actuators: &'a [Actuator],
    joints: &'a [Joint],
}
