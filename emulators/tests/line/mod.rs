//! The EtherCAT port on the emulated line of drives and terminals, in virtual time.

#![allow(dead_code, reason = "each test binary uses its own part")]
#![allow(unreachable_pub)]

use drives::ethercat::EthercatPort;
use drives::{PlantOptions, PortError};
use emulators::cable::{Bench, Cable};
use emulators::ethercat::faults::Rates;
use emulators::ethercat::{Layout, Link, Segment};
use machine::Machine;

/// The port, the cable and the line.
pub type Line = Bench<EthercatPort, Link>;

/// A machine file that ships.
pub fn shipped(name: &str) -> String {
    let path = format!("{}/../machines/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).expect("a machine file")
}

/// The built-in machine, whose motors follow targets of `mode` by drives on a bus.
pub fn corexy(mode: &str) -> Machine {
    Machine::parse("bus.toml", &corexy_file(mode), &[]).expect("the machine")
}

/// Its machine file.
pub fn corexy_file(mode: &str) -> String {
    let mut text = shipped("corexy");
    for axis in ["a", "b"] {
        let own = format!("[axis.{axis}]\n");
        text = text.replace(&own, &format!("{own}mode = \"{mode}\"\n"));
    }
    text + "
[drives.ethercat]
udp = \"127.0.0.1:34980\"
gate = { slave = 2, oversampling = 100 }
power = { slave = 3 }

[drives.ethercat.actuators]
a = { slave = 0 }
b = { slave = 1 }
"
}

/// The gantry with four drives that ships, with motors that follow targets of `mode`.
pub fn gantry(mode: &str) -> Machine {
    let text =
        shipped("servo_gantry").replace("mode = \"position\"", &format!("mode = \"{mode}\""));
    Machine::parse("servo_gantry.toml", &text, &[]).expect("the machine")
}

/// The line of `machine` with a port that is open, slaves' clocks drawn by `seed`, 0 for clocks that run right.
pub fn open(machine: Machine, rates: Rates, seed: u64) -> Line {
    let layout = Layout { seed, ..Layout::default() };
    try_open(machine, &layout, rates).expect("an open port")
}

/// The line of this `layout` with its port.
///
/// # Errors
/// What the port says when it is opened.
pub fn try_open(machine: Machine, layout: &Layout, rates: Rates) -> Result<Line, PortError> {
    let segment = Segment::new(&machine, layout, PlantOptions::default()).expect("a line");
    let cable = Cable::new(Link::new(segment, rates, 7));
    let port = EthercatPort::of(&machine)?.with_link(Box::new(cable.clone()));
    Bench::open(machine, cable, port)
}
