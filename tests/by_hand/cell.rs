//! A machine with switches, as services in a place of its own.

#[path = "../support/switches.rs"]
mod switches;

use crate::support::{Ended, Place, Running, TERMINATE};
use serde_json::Value;
use switches::Switches;

/// The machine file with switches next to where the machine stands at first, so that homing is short, and `more`.
pub(crate) fn machine(more: &str) -> String {
    let switches = Switches {
        x_home: "90 mm",
        y_home: "110 mm",
        y_method: "switch",
        y_reference: "110 mm",
        probe: "105 mm",
        speeds: ["100 mm/s", "10 mm/s"],
    };
    switches.machine() + more
}

/// A domain with its services, all running.
pub(crate) struct Cell {
    pub(crate) place: Place,
    pub(crate) domain: Running,
    services: Vec<Running>,
}

impl Cell {
    /// With `more` in its machine file.
    pub(crate) fn new(more: &str) -> Self {
        Self::of(&machine(more))
    }

    /// With this machine file.
    pub(crate) fn of(machine: &str) -> Self {
        let place = Place::new();
        place.file("cell.toml", machine);
        Self::start_in(place)
    }

    fn start_in(place: Place) -> Self {
        let file = place.path("cell.toml");
        let name = place.instance().name().to_owned();
        let domain = ["domain", "--no-realtime", "--machine", file.to_str().unwrap()];
        let mut domain = place.start(&[&domain[..], &["--instance", &name]].concat());
        place.await_status(&mut domain, "domain", |_| true);
        let roles = ["monitor", "drives", "planner", "controller"];
        let services = roles.map(|role| place.start(&[role, "--instance", &name])).into();
        let mut cell = Self { place, domain, services };
        cell.until("services", |status| {
            roles.iter().all(|role| status["services"][role].is_number())
                && status["cycles"].as_u64() > Some(0)
        });
        cell
    }

    /// With its motors on.
    pub(crate) fn enabled(more: &str) -> Self {
        let cell = Self::new(more);
        cell.ask(&["enable"]).accepted();
        cell
    }

    /// At home.
    pub(crate) fn homed(more: &str) -> Self {
        let cell = Self::enabled(more);
        cell.ask(&["home"]).accepted();
        cell
    }

    /// What `graver` says to these arguments.
    pub(crate) fn ask(&self, arguments: &[&str]) -> Ended {
        self.place.ask(arguments)
    }

    /// A `graver` with these arguments that goes on.
    pub(crate) fn start(&self, arguments: &[&str]) -> Running {
        let instance = ["--instance", self.place.instance().name()];
        self.place.start(&[arguments, &instance[..]].concat())
    }

    /// The first status of which this holds.
    pub(crate) fn until(&mut self, what: &str, holds: impl Fn(&Value) -> bool) -> Value {
        self.place.await_status(&mut self.domain, what, holds)
    }

    /// What the machine says of itself now.
    pub(crate) fn status(&self) -> Value {
        self.place.status().unwrap()
    }

    /// Where x is [m].
    pub(crate) fn x(&self) -> f64 {
        self.status()["axes"]["x"]["position"].as_f64().unwrap()
    }

    /// Ends it all, and starts it again in the same place.
    pub(crate) fn again(self) -> Self {
        Self::start_in(self.stop())
    }

    /// Ends it all, with the proof that nothing is left.
    pub(crate) fn end(self) {
        self.stop();
    }

    /// The same; the place is left.
    pub(crate) fn stop(self) -> Place {
        let Self { place, domain, services } = self;
        domain.signal(TERMINATE);
        assert_eq!(domain.wait().code, Some(0));
        for mut service in services {
            // One that a test has killed has ended.
            if service.try_code().is_none() {
                service.signal(TERMINATE);
            }
            service.wait();
        }
        place.assert_nothing_left(&[]);
        place
    }
}
