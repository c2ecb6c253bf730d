//! What the machine's interlocks and warnings say, in words, and whether this build can ask the devices of its file.

use crate::exit::Failure;
use machine::Machine;
use machine::modbus::input_words;
use machine::operating::InputFunction;
use messages::{DeviceState, SlowInputs};

/// What to do about a build that cannot ask devices on Modbus.
pub const HOW_TO_BUILD: &str = "this graver was built without the feature `modbus`: build it with that feature, as by \
                                `cargo build --release --features modbus`";

/// Refuses to start services for `machine` where one of them is not part of this build.
///
/// # Errors
/// Devices on Modbus in a build without that feature.
pub fn check_built(machine: &Machine) -> Result<(), Failure> {
    let first = machine.operating.devices.first();
    match first.filter(|_| !cfg!(feature = "modbus")) {
        Some(device) => Err(Failure::bad_input(format!(
            "the machine file has [modbus.{}], and {HOW_TO_BUILD}, or run with `--drives sim`",
            device.name
        ))),
        None => Ok(()),
    }
}

/// What each of the `inputs` with this function says that is active.
pub fn active(
    machine: &Machine,
    function: InputFunction,
    inputs: u64,
    slow: &SlowInputs,
) -> Vec<String> {
    let operating = &machine.operating;
    let each = operating.bits().enumerate();
    let active = each.filter(|(_, (bit, it))| it.function == function && inputs & bit != 0);
    active.map(|(index, _)| input_words(operating, index, slow)).collect()
}

/// Whether every device of `machine` has been asked.
pub fn have_all_spoken(machine: &Machine, slow: &SlowInputs) -> bool {
    let mut devices = machine.operating.devices.iter().zip(&slow.devices);
    devices.all(|(_, said)| said.state != DeviceState::Unknown as u32)
}

/// That interlocks are missing, and which.
pub fn missing(interlocks: &[String]) -> String {
    match interlocks {
        [] => "an interlock is missing".to_owned(),
        named => format!("an interlock is missing: {}", named.join("; ")),
    }
}
