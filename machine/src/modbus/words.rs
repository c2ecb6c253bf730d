//! What slow inputs say, for people: device, register, value and limit.

use messages::{DeviceState, MAX_INPUTS, SlowInputs};

use super::{Device, Meaning, Read};
use crate::operating::Operating;

/// Why the device with this index does not answer, by the newest `slow`. One whose newest answer is all right by that
/// is not heard of any more.
pub fn device_words(operating: &Operating, index: usize, slow: &SlowInputs) -> Option<String> {
    let device = operating.devices.get(index)?;
    let said = slow.devices.get(index)?;
    let Device { name, address, unit, timeout, .. } = device;
    let place = format!("`{name}` ({address}, unit {unit})");
    let asked = request_words(operating, device, said.request as usize);
    Some(match DeviceState::from_wire(said.state) {
        DeviceState::Unknown => format!("{place} has not been asked yet"),
        DeviceState::Answering => format!(
            "{place} was not heard of for {} s: `graver modbus` does not run, or stands still",
            device.longest_silence().seconds()
        ),
        DeviceState::Unreachable => format!("{place} cannot be connected to"),
        DeviceState::Silent => {
            format!("{place} did not answer{asked} within {} s", timeout.seconds())
        }
        DeviceState::Refusing => format!(
            "{place} refused{asked}: exception {}, {}",
            said.exception,
            exception_name(said.exception)
        ),
        DeviceState::Garbled => format!(
            "{place} broke off, or answered something else than{}",
            if asked.is_empty() { " was asked" } else { &asked }
        ),
    })
}

/// The request with this number, from 1, of `device`, in words that go on; nothing for 0.
fn request_words(operating: &Operating, device: &Device, number: usize) -> String {
    let Some(index) = number.checked_sub(1) else { return String::new() };
    if let Some(read) = device.reads.get(index) {
        let name = operating.inputs.get(read.input).map_or("", |input| input.name.as_str());
        return format!(" the reading of {} {} (`{name}`)", read.place.name(), read.address);
    }
    let Some(write) = device.writes.get(index - device.reads.len()) else { return String::new() };
    let name = operating.outputs.get(write.output).map_or("", |output| output.name.as_str());
    format!(" the writing of {} {} (`{name}`)", write.place_name(), write.address)
}

/// What the input with this index among the machine's says that is active, by the newest `slow`: with device,
/// register, value and limit where a device reads it, else its name.
pub fn input_words(operating: &Operating, index: usize, slow: &SlowInputs) -> String {
    if let Some(device) = operating.devices.iter().position(|device| device.input == index)
        && let Some(words) = device_words(operating, device, slow)
    {
        return words;
    }
    let name = operating.inputs.get(index).map_or("", |input| input.name.as_str());
    let mut reads = operating
        .devices
        .iter()
        .flat_map(|device| device.reads.iter().map(move |read| (device, read)));
    match reads.find(|(_, read)| read.input == index) {
        Some((device, read)) => read_words(name, device, read, slow),
        None => format!("`{name}`"),
    }
}

fn read_words(name: &str, device: &Device, read: &Read, slow: &SlowInputs) -> String {
    let value = slow.values[read.input.min(MAX_INPUTS - 1)];
    let place = format!("{} {} of {}", read.place.name(), read.address, device.address);
    match &read.meaning {
        Meaning::Bit { bit, .. } => {
            let bit = match read.place {
                super::ReadPlace::Input | super::ReadPlace::Holding => format!("bit {bit} of "),
                _ => String::new(),
            };
            format!("`{name}`: {bit}{place} is {value}")
        }
        Meaning::Value { unit, limits: [least, most], scale, .. } => {
            let digits = digits(*scale);
            let quantity = |value: f64| {
                let space = if unit.is_empty() { "" } else { " " };
                format!("{value:.digits$}{space}{unit}")
            };
            let limit = match () {
                () if value > *most => format!(", limit {}", quantity(*most)),
                () if value < *least => format!(", at least {} is due", quantity(*least)),
                () => String::new(),
            };
            format!("`{name}`: {place} reads {}{limit}", quantity(value))
        }
    }
}

/// How many digits after the point a multiple of `scale` has, 6 at most.
fn digits(scale: f64) -> usize {
    let (mut digits, mut rest) = (0, scale);
    while digits < 6 && (rest - rest.round()).abs() > 1e-6 {
        (digits, rest) = (digits + 1, rest * 10.0);
    }
    digits
}

/// What an exception code of Modbus means.
pub fn exception_name(code: u32) -> &'static str {
    match code {
        1 => "illegal function",
        2 => "illegal data address",
        3 => "illegal data value",
        4 => "server device failure",
        5 => "acknowledge",
        6 => "server device busy",
        8 => "memory parity error",
        10 => "gateway path unavailable",
        11 => "gateway target does not respond",
        _ => "unknown",
    }
}
