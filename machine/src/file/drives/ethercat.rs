//! Drives on an EtherCAT bus.

use super::{Age, Built, Latency, each, times, whole};
use crate::actuator::Actuator;
use crate::document::{
    Diagnostics, Named, NonNegative, Number, Positive, ProblemKind, Quantity, Spanned,
};
use crate::drives::{DrivesKind, Ethercat, EthercatGate, EthercatIdentity, EthercatLink};
use crate::quantity::Duration;
use crate::table;
use messages::Nanoseconds;

/// A whole number.
pub(super) type Whole = Number<NonNegative>;

/// The last position on a bus.
pub(super) const LAST_SLAVE: u32 = 65_534;

/// The last channel of a terminal.
const LAST_CHANNEL: u32 = 63;

/// The most samples in a cycle.
const MOST_SAMPLES: u32 = 1000;

table! {
    /// Drives on an EtherCAT bus.
    pub struct EthercatTable {
        /// The network interface of the bus, for raw frames. Instead of `udp`.
        pub interface: Option<Spanned<String>>,
        /// The address that takes the frames in UDP packets, such as `127.0.0.1:34980`. Instead of
        /// `interface`.
        pub udp: Option<Spanned<String>>,
        /// How long a drive goes on without process data before it stops by itself.
        pub watchdog: Quantity<Duration, Positive> = "20 ms",
        /// From the deadline at which a command is sent until a motor follows it.
        pub latency: Latency = "500 us",
        /// From when a command acts until a drive's current loop gives the torque that it asks for.
        pub torque_delay: Latency = "0 s",
        /// How late the laser's gate acts, as `latency`.
        pub gate_latency: Latency = "500 us",
        /// What opens the laser's gate.
        pub gate: Option<EthercatGateTable>,
        /// What sets the laser's power.
        pub power: Option<EthercatPowerTable>,
        /// The drive of each actuator, by the actuators' names.
        pub actuators: Named<EthercatActuatorTable>,
        /// Where the machine's inputs are, by their names.
        pub inputs: Option<Named<EthercatBitTable>>,
        /// Where its outputs are.
        pub outputs: Option<Named<EthercatBitTable>>,
        /// Who slaves shall be, by their positions on the bus, from 0.
        pub slaves: Option<Named<EthercatSlaveTable>>,
    }
}

table! {
    /// Where an input or an output is.
    pub struct EthercatBitTable {
        /// Position of the terminal on the bus, from 0; of an input, that of a drive too.
        pub slave: Whole,
        /// The bit, from 0: of the terminal's process data, or of a drive's digital inputs (60FDh), of which 0 is the
        /// negative limit switch, 1 the positive one, 2 the home switch.
        pub bit: Whole,
    }
}

table! {
    /// Who a slave shall be, as its EEPROM says.
    pub struct EthercatSlaveTable {
        /// Number of the maker.
        pub vendor: Whole,
        /// The maker's number of it.
        pub product: Whole,
        /// Revision; any when left out.
        pub revision: Option<Whole>,
        /// Serial number; any when left out.
        pub serial: Option<Whole>,
    }
}

table! {
    /// An oversampling output that opens the laser's gate.
    pub struct EthercatGateTable {
        /// Its position on the bus, from 0.
        pub slave: Whole,
        /// Its channel, from 0.
        pub channel: Whole = 0.0,
        /// Samples in a cycle.
        pub oversampling: Whole = 100.0,
    }
}

table! {
    /// An analogue output of 16 bits that sets the laser's power, once a cycle.
    pub struct EthercatPowerTable {
        /// Its position on the bus, from 0.
        pub slave: Whole,
    }
}

table! {
    /// The drive of an actuator.
    pub struct EthercatActuatorTable {
        /// Its position on the bus, from 0.
        pub slave: Whole,
        /// From the deadline at which a command is sent until this motor follows it.
        pub latency: Option<Latency>,
        /// From when a command acts until this drive's current loop gives the torque that it asks for.
        pub torque_delay: Option<Latency>,
    }
}

/// The drives of `table`.
pub(super) fn build(
    table: &EthercatTable,
    actuators: &[Actuator],
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let link = match (&table.interface, &table.udp) {
        (Some(interface), None) => Some(EthercatLink::Interface(interface.value.clone())),
        (None, Some(address)) => Some(EthercatLink::Udp(address.value.clone())),
        _ => {
            diagnostics.contradict(
                table.span,
                "how the bus is reached is not clear".to_owned(),
                "give either its `interface`, such as \"enp3s0\", or its `udp` address",
            );
            None
        }
    };
    let mut number = |number: &Whole, most| whole(number, most, diagnostics) as u16;
    let gate = table.gate.as_ref().map(|gate| EthercatGate {
        slave: number(&gate.slave, LAST_SLAVE),
        channel: number(&gate.channel, LAST_CHANNEL),
        oversampling: number(&gate.oversampling, MOST_SAMPLES),
    });
    let power = table.power.as_ref().map(|power| number(&power.slave, LAST_SLAVE));
    let tables = each(&table.actuators, "ethercat", actuators, diagnostics)?;
    let slave = |own: &EthercatActuatorTable| whole(&own.slave, LAST_SLAVE, diagnostics) as u16;
    let slaves = tables.into_iter().map(slave).collect();
    let own: [fn(&EthercatActuatorTable) -> Option<Latency>; 2] =
        [|own| own.latency, |own| own.torque_delay];
    let [latency, torque_delay] = [(&table.latency, own[0]), (&table.torque_delay, own[1])]
        .map(|(all, own)| times(all, Some(&table.actuators), own, actuators));
    let identities = identities(table, diagnostics);
    Some(Built {
        gate_latency: Nanoseconds::from_seconds(table.gate_latency.value),
        latency,
        torque_delay,
        age: Age::Latched,
        kind: DrivesKind::Ethercat(Ethercat {
            link: link?,
            watchdog: Nanoseconds::from_seconds(table.watchdog.value),
            actuators: slaves,
            gate,
            power,
            inputs: Vec::new(),
            outputs: Vec::new(),
            identities,
        }),
    })
}

/// Who the slaves of `table` shall be.
fn identities(table: &EthercatTable, diagnostics: &mut Diagnostics) -> Vec<EthercatIdentity> {
    let mut identities = Vec::new();
    for (position, own) in table.slaves.iter().flat_map(|slaves| &slaves.entries) {
        let slave = position.value.parse::<u16>().ok();
        let Some(slave) = slave.filter(|slave| u32::from(*slave) <= LAST_SLAVE) else {
            diagnostics.refuse(
                ProblemKind::UnknownKey,
                position.span,
                format!("`{}` is no position on a bus", position.value),
                Some(format!("write a whole number from 0 to {LAST_SLAVE}")),
            );
            continue;
        };
        let mut number = |number: &Whole| whole(number, u32::MAX, diagnostics);
        identities.push(EthercatIdentity {
            slave,
            vendor: number(&own.vendor),
            product: number(&own.product),
            revision: own.revision.as_ref().map(&mut number),
            serial: own.serial.as_ref().map(&mut number),
        });
    }
    identities
}
