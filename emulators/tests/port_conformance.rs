//! The ports to hardware against the contract of ports, on emulated hardware in virtual time.

#[path = "../../drives/tests/conformance/mod.rs"]
mod conformance;
mod line;

use conformance::Subject;
use emulators::ethercat::faults::Rates;

fn subjects() -> Vec<Subject> {
    ["position", "velocity", "torque"]
        .into_iter()
        .map(|mode| {
            let machine = line::corexy(mode);
            let port = line::open(machine.clone(), Rates::default(), 0);
            let subject = Subject::new(mode, machine, Box::new(port));
            Subject { starting: 60, holding: 1, ..subject }
        })
        .collect()
}

conformance::suite! { subjects }
