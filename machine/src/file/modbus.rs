//! The tables of devices on Modbus TCP, and what they become.

use messages::{MAX_DEVICES, Nanoseconds};

use super::drives::{refuse_others, whole};
use crate::document::{
    Diagnostics, Named, NonNegative, Number, Positive, ProblemKind, Quantity, Spanned,
};
use crate::modbus::{Device, Meaning, PORT, Read, ReadPlace, Write, WritePlace};
use crate::operating::{Input, InputFunction, MAX_INPUTS, Operating};
use crate::quantity as unit;
use crate::table;

use super::operating::Level;

/// The address of a bit or register, from 0.
type Address = Number<NonNegative>;

/// The last address, and the largest word.
const LAST: u32 = 65535;

/// The last unit identifier.
const LAST_UNIT: u32 = 255;

table! {
    /// A device that is asked over Modbus TCP, such as a chiller; see `docs/modbus.md`.
    pub struct ModbusTable {
        /// The device's address, `192.168.1.20` or `192.168.1.20:502`.
        pub address: Spanned<String>,
        /// Its unit identifier, which a gateway needs; most devices take any.
        pub unit: Number<NonNegative> = 1.0,
        /// How often it is asked.
        pub period: Quantity<unit::Duration, Positive> = "250 ms",
        /// How long it may take to answer all that it is asked in a period.
        pub timeout: Quantity<unit::Duration, Positive> = "500 ms",
        /// What it does to a job that the device does not answer: `interlock` or `warning`.
        pub silence: Spanned<Silence> = "interlock",
        /// What is read from it, named.
        pub inputs: Option<Named<ModbusInputTable>>,
        /// What is written to it, by the names of the machine's outputs.
        pub outputs: Option<Named<ModbusOutputTable>>,
    }
}

table! {
    /// What is read from a device: one of `discrete`, `coil`, `input` and `holding`.
    pub struct ModbusInputTable {
        /// Address of a discrete input, from 0.
        pub discrete: Option<Address>,
        /// Address of a coil, from 0.
        pub coil: Option<Address>,
        /// Address of an input register, from 0.
        pub input: Option<Address>,
        /// Address of a holding register, from 0.
        pub holding: Option<Address>,
        /// What it does while it is active: `interlock` holds a job with the light off and lets none begin, `warning`
        /// tells of it, `general` does nothing.
        pub function: Spanned<ModbusFunction>,
        /// Which level of a bit is active.
        pub active: Option<Spanned<Level>>,
        /// The bit of a register that it is, from 0, the lowest.
        pub bit: Option<Number<NonNegative>>,
        /// The value of one count of a register that is a number.
        pub scale: Option<Number>,
        /// Whether that number has a sign, as two's complement.
        pub signed: Option<Spanned<bool>>,
        /// The unit of the value, for people.
        pub unit: Option<Spanned<String>>,
        /// The least value at which it is not active.
        pub min: Option<Number>,
        /// The greatest value at which it is not active.
        pub max: Option<Number>,
    }
}

table! {
    /// Where an output of the machine is written to: a `coil` or a `register`.
    pub struct ModbusOutputTable {
        /// Address of a coil, from 0.
        pub coil: Option<Address>,
        /// Address of a holding register, from 0.
        pub register: Option<Address>,
        /// The word while the output is off; 0 when left out.
        pub off: Option<Number<NonNegative>>,
        /// The word while it is on; 1 when left out.
        pub on: Option<Number<NonNegative>>,
        /// How it is left when the process that writes it ends, or the controller is gone.
        pub safe: Spanned<Switched> = "off",
    }
}

/// What the silence of a device does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Silence(InputFunction);

/// What an input does while it is active.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModbusFunction(InputFunction);

/// How an output is left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Switched {
    /// Off.
    Off,
    /// On.
    On,
}

crate::keyword! {
    Silence, "what a silent device does",
    "interlock" => Self(InputFunction::Interlock),
    "warning" => Self(InputFunction::Warning),
}

crate::keyword! {
    ModbusFunction, "what an input does",
    "interlock" => Self(InputFunction::Interlock),
    "warning" => Self(InputFunction::Warning),
    "general" => Self(InputFunction::General),
}

crate::keyword! { Switched, "on or off", "off" => Self::Off, "on" => Self::On }

/// The names of the outputs that `tables` have a place for.
pub(super) fn switched(tables: Option<&Named<ModbusTable>>) -> Vec<&str> {
    let outputs = tables.into_iter().flat_map(|tables| &tables.entries);
    let outputs = outputs.flat_map(|(_, table)| &table.outputs).flat_map(|named| &named.entries);
    outputs.map(|(name, _)| name.value.as_str()).collect()
}

/// Puts the devices of `tables` into `operating`, their inputs behind those of the port.
pub(super) fn connect(
    tables: Option<&Named<ModbusTable>>,
    operating: &mut Operating,
    diagnostics: &mut Diagnostics,
) {
    let Some(tables) = tables else { return };
    for (name, table) in &tables.entries {
        device(name, table, operating, diagnostics);
    }
    let counts = [
        (operating.devices.len(), MAX_DEVICES, "devices on Modbus"),
        (operating.inputs.len(), MAX_INPUTS, "inputs, one for each device included"),
    ];
    for (count, most, what) in counts {
        if count > most {
            let message = format!("the machine has {count} {what}");
            let help = format!("a machine can have {most} of them");
            diagnostics.contradict(tables.span, message, &help);
        }
    }
}

fn device(
    name: &Spanned<String>,
    table: &ModbusTable,
    operating: &mut Operating,
    diagnostics: &mut Diagnostics,
) {
    let input = operating.inputs.len();
    let mut add = |name: String, function: InputFunction, diagnostics: &mut Diagnostics| {
        if operating.input(&name).is_some() {
            let message = format!("the machine has an input `{name}` already");
            diagnostics.contradict(
                table.span,
                message,
                "give the device or the input another name",
            );
        }
        operating.inputs.push(Input { name, function, is_active_low: false, simulated: None });
        operating.inputs.len() - 1
    };
    add(name.value.clone(), table.silence.value.0, diagnostics);
    let mut reads = Vec::new();
    for (own, read) in table.inputs.iter().flat_map(|named| &named.entries) {
        let Some((place, address, meaning)) = reading(own, read, diagnostics) else { continue };
        let full = format!("{}.{}", name.value, own.value);
        let input = add(full, read.function.value.0, diagnostics);
        reads.push(Read { input, place, address, meaning });
    }
    let names: Vec<&str> = operating.outputs.iter().map(|output| output.name.as_str()).collect();
    refuse_others(table.outputs.as_ref(), "output", &names, diagnostics);
    let outputs = table.outputs.iter().flat_map(|named| &named.entries);
    let writes: Vec<Write> =
        outputs.filter_map(|(name, own)| writing(name, own, operating, diagnostics)).collect();
    let has_inputs = table.inputs.as_ref().is_some_and(|named| !named.entries.is_empty());
    let has_outputs = table.outputs.as_ref().is_some_and(|named| !named.entries.is_empty());
    if !has_inputs && !has_outputs {
        diagnostics.refuse(
            ProblemKind::MissingKey,
            name.span,
            format!("nothing is read from the device `{}`, and nothing written to it", name.value),
            Some(format!("add [modbus.{}.inputs.NAME]", name.value)),
        );
    }
    operating.devices.push(Device {
        name: name.value.clone(),
        address: address(&table.address, diagnostics),
        unit: whole(&table.unit, LAST_UNIT, diagnostics) as u8,
        period: Nanoseconds::from_seconds(table.period.value),
        timeout: Nanoseconds::from_seconds(table.timeout.value),
        input,
        reads,
        writes,
    });
}

/// Host and port; the port of Modbus TCP where none is given.
fn address(given: &Spanned<String>, diagnostics: &mut Diagnostics) -> String {
    let text = given.value.as_str();
    let (host, port) = match text.rsplit_once(':') {
        // An address of IPv6 without brackets has no port.
        Some((host, _)) if host.contains(':') && !host.ends_with(']') => (text, None),
        Some((host, port)) => (host, Some(port)),
        None => (text, None),
    };
    let is_port = |port: &str| port.parse::<u16>().is_ok_and(|port| port > 0);
    let is_host = !host.is_empty() && !host.contains(char::is_whitespace) && !host.contains('/');
    if !is_host || !port.is_none_or(is_port) {
        let message = format!("`{text}` is no address of a device");
        let help = "write an address such as \"192.168.1.20\" or \"192.168.1.20:502\"";
        diagnostics.contradict(given.span, message, help);
    }
    match port {
        Some(_) => text.to_owned(),
        None if host.contains(':') && !host.starts_with('[') => format!("[{host}]:{PORT}"),
        None => format!("{host}:{PORT}"),
    }
}

/// Where an input stands and what it means; notes what is too much or too little.
fn reading(
    name: &Spanned<String>,
    table: &ModbusInputTable,
    diagnostics: &mut Diagnostics,
) -> Option<(ReadPlace, u16, Meaning)> {
    let places = [
        (ReadPlace::Discrete, &table.discrete),
        (ReadPlace::Coil, &table.coil),
        (ReadPlace::Input, &table.input),
        (ReadPlace::Holding, &table.holding),
    ];
    let given = places.iter().filter_map(|(place, address)| Some((*place, address.as_ref()?)));
    let given: Vec<(ReadPlace, &Address)> = given.collect();
    let [(place, at)] = given.as_slice() else {
        let message = format!("where the input `{}` stands is not clear", name.value);
        let help = "give one of `discrete`, `coil`, `input` and `holding`: its address from 0";
        diagnostics.contradict(name.span, message, help);
        return None;
    };
    let address = whole(at, LAST, diagnostics) as u16;
    let is_register = matches!(place, ReadPlace::Input | ReadPlace::Holding);
    let numeric = [
        ("scale", table.scale.as_ref().map(|it| it.span)),
        ("signed", table.signed.as_ref().map(|it| it.span)),
        ("unit", table.unit.as_ref().map(|it| it.span)),
        ("min", table.min.as_ref().map(|it| it.span)),
        ("max", table.max.as_ref().map(|it| it.span)),
    ];
    let is_bit = !is_register || table.bit.is_some();
    if is_bit {
        for (key, span) in numeric {
            let Some(span) = span else { continue };
            let message = format!("`{key}` has no effect: the input `{}` is a bit", name.value);
            diagnostics.contradict(span, message, &format!("remove `{key}`"));
        }
        if let Some(bit) = table.bit.as_ref().filter(|_| !is_register) {
            let message = format!("`bit` has no effect: a {} is one bit", place.name());
            diagnostics.contradict(bit.span, message, "remove `bit`");
        }
        let is_active_low = table.active.is_some_and(|level| level.value == Level::Low);
        let bit = table.bit.as_ref().map_or(0, |bit| whole(bit, 15, diagnostics));
        return Some((*place, address, Meaning::Bit { bit, is_active_low }));
    }
    if let Some(active) = &table.active {
        let message = format!("`active` has no effect: the input `{}` is a number", name.value);
        diagnostics.contradict(
            active.span,
            message,
            "give its `min` or `max`, or the `bit` that it is",
        );
    }
    let limits = [
        table.min.as_ref().map_or(f64::NEG_INFINITY, |it| it.value),
        table.max.as_ref().map_or(f64::INFINITY, |it| it.value),
    ];
    if limits[0] > limits[1] {
        let message = format!("no value is from {} to {}", limits[0], limits[1]);
        diagnostics.contradict(name.span, message, "give a `min` below the `max`");
    }
    if table.function.value.0 != InputFunction::General && limits.iter().all(|it| it.is_infinite())
    {
        let message = format!("the input `{}` is never active: its value has no limit", name.value);
        diagnostics.refuse(
            ProblemKind::MissingKey,
            name.span,
            message,
            Some("add `min` or `max`, the `bit` that it is, or make it `general`".to_owned()),
        );
    }
    let scale = table.scale.as_ref().map_or(1.0, |scale| scale.value);
    if let Some(given) = table.scale.as_ref().filter(|scale| scale.value == 0.0) {
        let message = "with a `scale` of 0 every value is 0".to_owned();
        diagnostics.contradict(given.span, message, "write the value of one count, such as 0.1");
    }
    Some((
        *place,
        address,
        Meaning::Value {
            is_signed: table.signed.is_some_and(|signed| signed.value),
            scale,
            unit: table.unit.as_ref().map_or_else(String::new, |unit| unit.value.clone()),
            limits,
        },
    ))
}

/// Where an output is written to; notes what is too much or too little.
fn writing(
    name: &Spanned<String>,
    table: &ModbusOutputTable,
    operating: &Operating,
    diagnostics: &mut Diagnostics,
) -> Option<Write> {
    let (output, known) = operating.output(&name.value)?;
    let mut word = |number: &Option<Number<NonNegative>>, otherwise: u16| {
        number.as_ref().map_or(otherwise, |number| whole(number, LAST, diagnostics) as u16)
    };
    let words = [word(&table.off, 0), word(&table.on, 1)];
    let (place, address) = match (&table.coil, &table.register) {
        (Some(coil), None) => {
            for (key, given) in [("off", &table.off), ("on", &table.on)] {
                let Some(given) = given else { continue };
                let message = format!("`{key}` has no effect: a coil has no words");
                let help = "remove it; `active = \"low\"` of the output turns a coil round";
                diagnostics.contradict(given.span, message, help);
            }
            (WritePlace::Coil { is_active_low: known.is_active_low }, coil)
        }
        (None, Some(register)) => {
            if words[0] == words[1] {
                let message = format!("the output `{}` is {} on and off", name.value, words[0]);
                diagnostics.contradict(name.span, message, "give other words as `on` and `off`");
            }
            if known.is_active_low {
                let message = format!(
                    "the output `{}` has an active level, and is a register here",
                    name.value
                );
                diagnostics.contradict(name.span, message, "swap `on` and `off` instead");
            }
            (WritePlace::Register { words }, register)
        }
        _ => {
            let message = format!("where the output `{}` stands is not clear", name.value);
            let help = "give either `coil` or `register`: its address from 0";
            diagnostics.contradict(name.span, message, help);
            return None;
        }
    };
    let address = whole(address, LAST, diagnostics) as u16;
    Some(Write { output, place, address, is_safe_on: table.safe.value == Switched::On })
}
