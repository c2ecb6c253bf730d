//! The simulated plant as drives.

use super::{Age, Built, Latency, refuse_unknown, times};
use crate::actuator::Actuator;
use crate::document::{Diagnostics, Named};
use crate::drives::DrivesKind;
use crate::table;
use messages::Nanoseconds;

table! {
    /// The simulated plant. Its drives have every mode that the motors can follow.
    pub struct SimulatedTable {
        /// From the deadline at which a command is sent until a motor follows it.
        pub latency: Latency = "0 s",
        /// From when a command acts until a drive's current loop gives the torque that it asks for.
        pub torque_delay: Latency = "0 s",
        /// How late the laser's gate acts, as `latency`.
        pub gate_latency: Latency = "0 s",
        /// What is different of single actuators, by their names.
        pub actuators: Option<Named<SimulatedActuatorTable>>,
    }
}

table! {
    /// What is different of one simulated actuator.
    pub struct SimulatedActuatorTable {
        /// From the deadline at which a command is sent until this motor follows it.
        pub latency: Option<Latency>,
        /// From when a command acts until this drive's current loop gives the torque that it asks for.
        pub torque_delay: Option<Latency>,
    }
}

/// The drives of `table`.
pub(super) fn build(
    table: &SimulatedTable,
    actuators: &[Actuator],
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let SimulatedTable { latency, torque_delay, gate_latency, actuators: tables, span: _ } = table;
    refuse_unknown(tables.as_ref(), actuators, diagnostics);
    Some(Built {
        kind: DrivesKind::Simulated,
        gate_latency: Nanoseconds::from_seconds(gate_latency.value),
        latency: times(latency, tables.as_ref(), |own| own.latency, actuators),
        torque_delay: times(torque_delay, tables.as_ref(), |own| own.torque_delay, actuators),
        age: Age::None,
    })
}
