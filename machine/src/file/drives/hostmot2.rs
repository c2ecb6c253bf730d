//! An FPGA card with HostMot2 firmware as drives.

use super::wiring::Wiring;
use super::{Age, Built, Latency, each, refuse_index, times, whole};
use crate::actuator::Actuator;
use crate::document::{Diagnostics, Named, NonNegative, Number, Positive, Quantity, Spanned};
use crate::drives::{DrivesKind, Hostmot2, Hostmot2Actuator, Xy2Frame};
use crate::operating::Operating;
use crate::quantity::{Angle, Duration};
use crate::table;
use messages::Nanoseconds;

/// The number of a module.
type Channel = Number<NonNegative>;

/// The largest number of a module.
const LAST_CHANNEL: u32 = 255;

table! {
    /// An FPGA card with HostMot2 firmware, over UDP.
    pub struct Hostmot2Table {
        /// The card's address, `192.168.1.121` or `192.168.1.121:27181`.
        pub address: Spanned<String>,
        /// How long the card goes on without a packet before it is dark and unpowered by itself.
        pub watchdog: Quantity<Duration, Positive> = "5 ms",
        /// From the deadline at which a command is sent until a motor follows it.
        pub latency: Latency = "0 s",
        /// The same of the laser's gate.
        pub gate_latency: Latency = "0 s",
        /// What opens the laser's gate.
        pub gate: Option<Hostmot2GateTable>,
        /// What sets the laser's power.
        pub power: Option<Hostmot2PowerTable>,
        /// What drives each actuator, by the actuators' names.
        pub actuators: Named<Hostmot2ActuatorTable>,
        /// Where the machine's inputs are, by their names.
        pub inputs: Option<Named<Hostmot2PinTable>>,
        /// Where its outputs are.
        pub outputs: Option<Named<Hostmot2PinTable>>,
    }
}

table! {
    /// Where an input or an output is.
    pub struct Hostmot2PinTable {
        /// Number of the pin, from 0: those of the first connector, then those of the next.
        pub pin: Channel,
    }
}

table! {
    /// What opens the laser's gate; active low, so that a card without power is dark.
    pub struct Hostmot2GateTable {
        /// Number of the one-shot.
        pub oneshot: Channel,
    }
}

table! {
    /// What sets the laser's power.
    pub struct Hostmot2PowerTable {
        /// Number of the PWM generator.
        pub pwm: Channel,
    }
}

table! {
    /// What drives an actuator: `stepgen`, `pwm` with `encoder`, or `xy2mod` with `channel` and `full_scale`.
    pub struct Hostmot2ActuatorTable {
        /// Number of the step generator.
        pub stepgen: Option<Channel>,
        /// Number of the PWM generator.
        pub pwm: Option<Channel>,
        /// Number of the galvo interface.
        pub xy2mod: Option<Channel>,
        /// Its channel: 0 for x, 1 for y.
        pub channel: Option<Channel>,
        /// The motor's angle at full scale of the interface, either way from the middle.
        pub full_scale: Option<Quantity<Angle, Positive>>,
        /// Bits of a position on the way to the scan head, 16 or 18; 16 when left out.
        pub bits: Option<Channel>,
        /// Number of the encoder.
        pub encoder: Option<Channel>,
        /// From the deadline at which a command is sent until this motor follows it.
        pub latency: Option<Latency>,
    }
}

/// The drives of `table`.
pub(super) fn build(
    table: &Hostmot2Table,
    actuators: &[Actuator],
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let mut channel = |number: &Channel| whole(number, LAST_CHANNEL, diagnostics);
    let gate = table.gate.as_ref().map(|gate| channel(&gate.oneshot));
    let power = table.power.as_ref().map(|power| channel(&power.pwm));
    let tables = each(&table.actuators, "hostmot2", actuators, diagnostics)?;
    let driven = tables.into_iter().map(|table| actuator(table, diagnostics));
    let driven: Vec<Option<Hostmot2Actuator>> = driven.collect();
    let own = |own: &Hostmot2ActuatorTable| own.latency;
    Some(Built {
        gate_latency: Nanoseconds::from_seconds(table.gate_latency.value),
        latency: times(&table.latency, Some(&table.actuators), own, actuators),
        // An amplifier is told voltages, and has no current loop.
        torque_delay: vec![Nanoseconds(0); actuators.len()],
        age: Age::None,
        kind: DrivesKind::Hostmot2(Hostmot2 {
            address: table.address.value.clone(),
            watchdog: Nanoseconds::from_seconds(table.watchdog.value),
            gate,
            power,
            actuators: driven.into_iter().collect::<Option<_>>()?,
            inputs: Vec::new(),
            outputs: Vec::new(),
        }),
    })
}

/// What drives the actuator of `table`; notes what is too much or too little.
fn actuator(
    table: &Hostmot2ActuatorTable,
    diagnostics: &mut Diagnostics,
) -> Option<Hostmot2Actuator> {
    let mut channel =
        |number: &Option<Channel>| number.as_ref().map(|it| whole(it, LAST_CHANNEL, diagnostics));
    let encoder = channel(&table.encoder);
    let all = [&table.stepgen, &table.pwm, &table.xy2mod, &table.channel].map(&mut channel);
    let mirror = (&table.full_scale, channel(&table.bits));
    let kind = match (all, encoder, mirror) {
        ([Some(stepgen), None, None, None], encoder, (None, None)) => {
            Some(Hostmot2Actuator::Stepgen { stepgen, encoder })
        }
        ([None, Some(pwm), None, None], Some(encoder), (None, None)) => {
            Some(Hostmot2Actuator::Pwm { pwm, encoder })
        }
        ([None, None, Some(xy2mod), Some(axis @ 0..=1)], None, (Some(full_scale), bits)) => {
            let frame = match bits {
                None | Some(16) => Some(Xy2Frame::Short),
                Some(18) => Some(Xy2Frame::Long),
                Some(_) => None,
            };
            let full_scale = full_scale.value;
            frame.map(|frame| Hostmot2Actuator::Xy2mod { xy2mod, axis, full_scale, frame })
        }
        _ => None,
    };
    if kind.is_none() {
        diagnostics.contradict(
            table.span,
            "what drives the actuator is not clear".to_owned(),
            "give `stepgen`; or `pwm` and `encoder`; or `xy2mod`, its `channel`, 0 or 1, the `full_scale`, and \
             18 `bits` where there are",
        );
    }
    kind
}

/// Puts the pins of what `operating` has into `card`; notes those of nothing, what has none, and an input that no
/// pin can see.
pub(super) fn connect(
    table: &Hostmot2Table,
    card: &mut Hostmot2,
    (operating, switched): (&Operating, &[&str]),
    diagnostics: &mut Diagnostics,
) {
    refuse_index(operating, "pin of a card", table.span, diagnostics);
    let wiring = Wiring {
        drives: "hostmot2",
        keys: "`pin`",
        span: table.span,
        inputs: table.inputs.as_ref(),
        outputs: table.outputs.as_ref(),
    };
    let pin = |table: &Hostmot2PinTable, diagnostics: &mut Diagnostics| {
        whole(&table.pin, LAST_CHANNEL, diagnostics)
    };
    (card.inputs, card.outputs) = wiring.places(operating, switched, pin, diagnostics);
}
