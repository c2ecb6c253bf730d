//! From the table of the drives to [`Drives`], and what each actuator's drive is.

pub mod ethercat;
mod ethercat_wiring;
pub mod hostmot2;
pub mod simulated;
mod wiring;

use messages::Nanoseconds;
use messages::time::Period;

use super::drive_homing;
use crate::actuator::Actuator;
use crate::document::{
    Diagnostics, Named, NonNegative, Number, ProblemKind, Quantity, Span, Spanned, nearest,
};
use crate::drives::{ActuatorMode, Drives, DrivesKind};
use crate::operating::{InputFunction, Operating};
use crate::quantity::Duration;
use crate::table;

/// How long an actuation takes to act.
pub type Latency = Quantity<Duration, NonNegative>;

/// What the table of a kind of drives becomes.
pub(super) struct Built {
    pub(super) kind: DrivesKind,
    pub(super) gate_latency: Nanoseconds,
    /// Of each actuator.
    pub(super) latency: Vec<Nanoseconds>,
    /// Of the drive of each actuator, how long its current loop takes.
    pub(super) torque_delay: Vec<Nanoseconds>,
    /// How old the measurement of an actuator is whose targets act by such a latency.
    pub(super) age: Age,
}

/// How long before its deadline a motor is measured.
#[derive(Clone, Copy)]
pub(super) enum Age {
    /// At the deadline.
    None,
    /// When the targets of the cycle before have come into force: by the latency after the deadline before.
    Latched,
}

impl Age {
    /// Of an actuator whose targets act by `latency`, in cycles of `period`.
    fn of(self, latency: Nanoseconds, period: Period) -> Nanoseconds {
        match self {
            Self::None => Nanoseconds(0),
            Self::Latched => Nanoseconds((period.time() - latency).0.max(0)),
        }
    }
}

/// The one list of the drives that a machine file can have: key, table, and what builds them.
macro_rules! drives_tables {
    ($( $(#[doc = $about:expr])* $key:ident: $table:ty, $build:path; )*) => {
        table! {
            /// What drives the motors: at most one of these; the simulated plant when none is given.
            pub struct DrivesTable {
                $( $(#[doc = $about])* pub $key: Option<$table>, )*
            }
        }

        impl DrivesTable {
            /// Every kind that the file declares, and where its table stands.
            fn declared(&self) -> Vec<(&'static str, Span)> {
                let all = [$( (stringify!($key), self.$key.as_ref().map(|table| table.span)) ),*];
                all.into_iter().filter_map(|(name, span)| Some((name, span?))).collect()
            }

            /// The drives of the first table that there is.
            fn build(&self, actuators: &[Actuator], diagnostics: &mut Diagnostics) -> Option<Built> {
                $( if let Some(table) = &self.$key {
                    return $build(table, actuators, diagnostics);
                } )*
                Some(Built {
                    kind: DrivesKind::Simulated,
                    gate_latency: Nanoseconds(0),
                    latency: vec![Nanoseconds(0); actuators.len()],
                    torque_delay: vec![Nanoseconds(0); actuators.len()],
                    age: Age::None,
                })
            }
        }
    };
}

drives_tables! {
    /// The simulated plant.
    simulated: simulated::SimulatedTable, simulated::build;
    /// An FPGA card with HostMot2 firmware, over UDP.
    hostmot2: hostmot2::Hostmot2Table, hostmot2::build;
    /// Drives on an EtherCAT bus.
    ethercat: ethercat::EthercatTable, ethercat::build;
}

/// The drives of `table` in cycles of `period`, with the pins of what `operating` has, whose outputs called
/// `switched` are switched elsewhere; puts the latency of each actuator, and the age of its measurement, into
/// `actuators`.
pub(super) fn build(
    table: &DrivesTable,
    period: Period,
    actuators: &mut [Actuator],
    (operating, switched): (&Operating, &[&str]),
    diagnostics: &mut Diagnostics,
) -> Drives {
    if let [(first, first_place), (second, second_place), ..] = table.declared().as_slice() {
        diagnostics.contradict(
            *first_place.max(second_place),
            "the machine has two kinds of drives".to_owned(),
            &format!("keep either [drives.{first}] or [drives.{second}]"),
        );
    }
    let Some(built) = table.build(actuators, diagnostics) else {
        return Drives::default();
    };
    let Built { mut kind, gate_latency, latency, torque_delay, age } = built;
    let is_delayed = torque_delay.iter().any(|time| *time > Nanoseconds(0));
    for (actuator, (latency, torque_delay)) in
        actuators.iter_mut().zip(latency.into_iter().zip(torque_delay))
    {
        actuator.latency = latency;
        // A stepper is counted by the pulses that it is told, and its driver is told no torque.
        if actuator.motor.dc().is_none() {
            continue;
        }
        actuator.age = age.of(latency, period);
        if actuator.mode != ActuatorMode::Voltage {
            actuator.torque_delay = torque_delay;
        }
    }
    for (_, span) in table.declared() {
        if is_delayed && actuators.iter().all(|it| it.torque_delay == Nanoseconds(0)) {
            diagnostics.contradict(
                span,
                "`torque_delay` has no effect: no drive is told a torque".to_owned(),
                "remove it, or give an axis with a servo motor the `mode` torque, velocity or position",
            );
        }
        drive_homing::refuse(&kind, operating, span, diagnostics);
    }
    match (table, &mut kind) {
        (DrivesTable { hostmot2: Some(table), .. }, DrivesKind::Hostmot2(card)) => {
            hostmot2::connect(table, card, (operating, switched), diagnostics);
        }
        (DrivesTable { ethercat: Some(table), .. }, DrivesKind::Ethercat(bus)) => {
            ethercat_wiring::connect(table, bus, (operating, switched), diagnostics);
        }
        _ => {}
    }
    Drives { kind, gate_latency }
}

/// The time of each of `actuators`, as its latency: its own where its table has one, else that of all.
fn times<T>(
    all: &Latency,
    tables: Option<&Named<T>>,
    own: impl Fn(&T) -> Option<Latency>,
    actuators: &[Actuator],
) -> Vec<Nanoseconds> {
    let of = |actuator: &Actuator| find(tables, &actuator.name).and_then(&own).unwrap_or(*all);
    actuators.iter().map(|actuator| Nanoseconds::from_seconds(of(actuator).value)).collect()
}

/// The table called `name`.
fn find<'a, T>(tables: Option<&'a Named<T>>, name: &str) -> Option<&'a T> {
    let mut entries = tables?.entries.iter();
    entries.find(|(found, _)| found.value == name).map(|(_, table)| table)
}

/// Refuses tables whose names are of no actuator.
fn refuse_unknown<T>(
    tables: Option<&Named<T>>,
    actuators: &[Actuator],
    diagnostics: &mut Diagnostics,
) {
    let names: Vec<&str> = actuators.iter().map(|actuator| actuator.name.as_str()).collect();
    refuse_others(tables, "actuator", &names, diagnostics);
}

/// Refuses tables whose names are none of these of a `kind` of thing.
pub(super) fn refuse_others<T>(
    tables: Option<&Named<T>>,
    kind: &str,
    known: &[&str],
    diagnostics: &mut Diagnostics,
) {
    let names = || known.iter().copied();
    for (Spanned { value: name, span }, _) in tables.into_iter().flat_map(|tables| &tables.entries)
    {
        if names().any(|known| known == name) {
            continue;
        }
        let help = match nearest(name, names()) {
            Some(near) => format!("did you mean `{near}`?"),
            None if known.is_empty() => format!("add [{kind}s.{name}]"),
            None => {
                let list: Vec<String> = names().map(|name| format!("`{name}`")).collect();
                format!("the machine's {kind}s are {}", list.join(", "))
            }
        };
        let message = format!("the machine has no {kind} `{name}`");
        diagnostics.refuse(ProblemKind::UnknownKey, *span, message, Some(help));
    }
}

/// The table of each of `actuators`, in their order; notes those that have none, and those of none.
fn each<'a, T>(
    tables: &'a Named<T>,
    kind: &str,
    actuators: &[Actuator],
    diagnostics: &mut Diagnostics,
) -> Option<Vec<&'a T>> {
    refuse_unknown(Some(tables), actuators, diagnostics);
    let mut all = Some(Vec::with_capacity(actuators.len()));
    for Actuator { name, .. } in actuators {
        match find(Some(tables), name) {
            Some(table) => all.iter_mut().for_each(|all| all.push(table)),
            None => {
                let key = if name.contains('.') { format!("\"{name}\"") } else { name.clone() };
                diagnostics.refuse(
                    ProblemKind::MissingKey,
                    tables.span,
                    format!("nothing is said of what drives the actuator `{name}`"),
                    Some(format!("add [drives.{kind}.actuators.{key}]")),
                );
                all = None;
            }
        }
    }
    all
}

/// Notes an index pulse among the inputs, which drives of this kind, in words, do not see; their table is at `span`.
fn refuse_index(operating: &Operating, kind: &str, span: Span, diagnostics: &mut Diagnostics) {
    for input in &operating.inputs {
        if matches!(input.function, InputFunction::Index { .. }) {
            let name = &input.name;
            diagnostics.contradict(
                span,
                format!("the index pulse `{name}` is shorter than a cycle, and no {kind} sees it"),
                "home by a `switch`, and leave the input out",
            );
        }
    }
}

/// The whole number that `number` is; notes one that is not.
pub(super) fn whole(number: &Number<NonNegative>, most: u32, diagnostics: &mut Diagnostics) -> u32 {
    let rounded = number.value.round();
    if rounded != number.value || rounded > f64::from(most) {
        diagnostics.refuse(
            ProblemKind::OutOfRange,
            number.span,
            format!("{} is not possible here", number.value),
            Some(format!("write a whole number from 0 to {most}")),
        );
        return 0;
    }
    rounded as u32
}
