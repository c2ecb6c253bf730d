//! The ports to hardware against the contract of ports, on emulated hardware in virtual time.

mod board;
#[path = "../../drives/tests/conformance/mod.rs"]
mod conformance;
mod line;

use conformance::Subject;
use emulators::ethercat::faults::Rates;
use emulators::hostmot2::Faults;
use machine::Machine;

/// Drives on a bus that follow targets of `mode`.
fn on_bus(mode: &'static str) -> Subject {
    let machine = line::corexy(mode);
    let port = line::open(machine.clone(), Rates::default(), 0);
    let subject = Subject::new(mode, machine, Box::new(port));
    Subject { starting: 60, holding: 1, ..subject }
}

/// The built-in machine's motors on amplifiers of a HostMot2 board.
fn amplified() -> Machine {
    let text = line::shipped("corexy")
        + "
[drives.hostmot2]
address = \"127.0.0.1\"
gate_latency = \"400 us\"
gate = { oneshot = 0 }
power = { pwm = 0 }

[drives.hostmot2.actuators]
a = { pwm = 1, encoder = 0 }
b = { pwm = 2, encoder = 1 }
";
    Machine::parse("board.toml", &text, &[]).expect("the machine")
}

/// What a HostMot2 board drives. It knows when its gate may open after it has seen some requests arrive; its four
/// one-shots give two pulses in a cycle.
fn on_board(name: &'static str, machine: Machine) -> Subject {
    let port = board::open(machine.clone(), &Faults::default()).expect("an open port");
    let subject = Subject::new(name, machine, Box::new(port));
    Subject { starting: 70, pulses: 2, holding: 1, measures_current: false, ..subject }
}

fn subjects() -> Vec<Subject> {
    vec![
        on_bus("position"),
        on_bus("velocity"),
        on_bus("torque"),
        on_board("steppers on a board", board::shipped("hostmot2_steppers", &[])),
        on_board("amplifiers on a board", amplified()),
    ]
}

conformance::suite! { subjects }
