//! The numbers of a cycle by name: the one list that the scope, the page and the interface know.
//!
//! `feedback.…` is what drives measured at the deadline, `command.…` what the controller answered to it, `progress.…`
//! the newest of what it says of the stream.

use machine::Machine;
use messages::{Command, Feedback, Progress};
use schemars::JsonSchema;
use serde::Serialize;

/// A number by name, as `/api/v1/signals` lists it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct SignalName {
    /// Its name, such as `feedback.current.a`.
    pub name: String,
    /// Its unit; empty of a plain number.
    pub unit: String,
}

/// What a cycle's numbers are taken from.
#[derive(Debug, Clone, Copy)]
pub struct CycleSamples<'a> {
    /// What was measured.
    pub feedback: &'a Feedback,
    /// What was answered to it; `None` where nothing was.
    pub command: Option<&'a Command>,
    /// The newest of the controller's.
    pub progress: &'a Progress,
    /// Share of the time since the feedback before in which the gate was open, 0 to 1.
    pub lit: f64,
}

type Value = Box<dyn Fn(&CycleSamples<'_>) -> f64 + Send + Sync>;

/// A signal of one machine.
pub struct Signal {
    /// Its name and unit.
    pub name: SignalName,
    value: Value,
}

impl Signal {
    /// Its value in a cycle; not a number where there is none.
    pub fn value(&self, cycle: &CycleSamples<'_>) -> f64 {
        (self.value)(cycle)
    }
}

impl std::fmt::Debug for Signal {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.name.fmt(formatter)
    }
}

/// All signals of `machine`, in the order in which they are listed.
pub fn signals(machine: &Machine) -> Vec<Signal> {
    let mut list = List(Vec::new());
    list.feedback(machine);
    list.command(machine);
    list.progress(machine);
    list.0
}

/// Coordinates of the tool.
const DIRECTIONS: [&str; 3] = ["x", "y", "z"];

struct List(Vec<Signal>);

impl List {
    fn add(
        &mut self,
        name: impl Into<String>,
        unit: &str,
        value: impl Fn(&CycleSamples<'_>) -> f64 + Send + Sync + 'static,
    ) {
        let name = SignalName { name: name.into(), unit: unit.to_owned() };
        self.0.push(Signal { name, value: Box::new(value) });
    }

    fn measured(&mut self, name: &str, unit: &str, value: fn(&Feedback) -> f64) {
        self.add(format!("feedback.{name}"), unit, move |cycle| value(cycle.feedback));
    }

    fn commanded(&mut self, name: &str, unit: &str, value: fn(&Command) -> f64) {
        let value = move |cycle: &CycleSamples<'_>| cycle.command.map_or(f64::NAN, value);
        self.add(format!("command.{name}"), unit, value);
    }

    fn told(&mut self, name: &str, unit: &str, value: fn(&Progress) -> f64) {
        self.add(format!("progress.{name}"), unit, move |cycle| value(cycle.progress));
    }

    fn feedback(&mut self, machine: &Machine) {
        for (index, actuator) in machine.actuators.iter().enumerate() {
            let name = &actuator.name;
            let mut each = |quantity: &str, unit: &str, value: fn(&Feedback, usize) -> f64| {
                self.add(format!("feedback.{quantity}.{name}"), unit, move |cycle| {
                    value(cycle.feedback, index)
                });
            };
            each("position", "rad", |it, index| it.position[index]);
            each("velocity", "rad/s", |it, index| it.velocity[index]);
            each("current", "A", |it, index| it.current[index]);
            each("counts", "", |it, index| it.counts[index] as f64);
        }
        for (index, direction) in DIRECTIONS.iter().enumerate() {
            self.add(format!("feedback.tool.{direction}"), "m", move |cycle| {
                let known = cycle.feedback.has(messages::feedback::status::TOOL_KNOWN);
                if known { cycle.feedback.tool[index] } else { f64::NAN }
            });
        }
        self.add("feedback.lit", "", |cycle| cycle.lit);
        self.measured("gate", "", |it| f64::from(it.laser.last().0));
        self.measured("power", "", |it| it.laser.last().1);
        self.measured("edges", "", |it| it.laser.edges().len() as f64);
        self.measured("frequency", "1/s", |it| it.laser.frequency);
        for (bit, input) in machine.operating.bits() {
            self.add(format!("feedback.input.{}", input.name), "", move |cycle| {
                level(cycle.feedback.inputs & bit)
            });
        }
        // Stamps by how far they are from the deadline: as they are a scope could not show them.
        self.measured("measured", "s", |it| (it.measured - it.deadline).seconds());
        self.measured("published", "s", |it| (it.published - it.deadline).seconds());
        self.measured("exchange", "s", |it| it.exchange.seconds());
        self.measured("missed", "", |it| it.missed as f64);
        self.measured("overruns", "", |it| it.overruns as f64);
        self.measured("skipped", "", |it| f64::from(it.skipped));
        self.measured("status", "", |it| f64::from(it.status));
        self.measured("fault", "", |it| f64::from(it.fault.code));
    }

    fn command(&mut self, machine: &Machine) {
        for (index, actuator) in machine.actuators.iter().enumerate() {
            let name = &actuator.name;
            let mut each = |quantity: &str, unit: &str, value: fn(&Command, usize) -> f64| {
                self.add(format!("command.{quantity}.{name}"), unit, move |cycle| {
                    cycle.command.map_or(f64::NAN, |command| value(command, index))
                });
            };
            each("reference", "rad", |it, index| it.reference[index]);
            each("following_error", "rad", |it, index| it.following_error[index]);
            each("position", "rad", |it, index| it.position[index]);
            each("velocity", "rad/s", |it, index| it.velocity[index]);
            each("effort", "N·m", |it, index| it.effort[index]);
            each("voltage", "V", |it, index| it.voltage[index]);
        }
        for (index, direction) in DIRECTIONS.iter().enumerate() {
            self.add(format!("command.tool.{direction}"), "m", move |cycle| {
                cycle.command.map_or(f64::NAN, |command| command.tool[index])
            });
        }
        self.commanded("gate", "", |it| f64::from(it.laser.last().0));
        self.commanded("power", "", |it| it.laser.last().1);
        self.commanded("edges", "", |it| it.laser.edges().len() as f64);
        self.commanded("frequency", "1/s", |it| it.laser.frequency);
        for (bit, output) in machine.operating.output_bits() {
            self.add(format!("command.output.{}", output.name), "", move |cycle| {
                cycle.command.map_or(f64::NAN, |command| level(command.outputs & bit))
            });
        }
        self.add("command.received", "s", |cycle| {
            let late = |command: &Command| (command.received - cycle.feedback.deadline).seconds();
            cycle.command.map_or(f64::NAN, late)
        });
        self.add("command.published", "s", |cycle| {
            let late = |command: &Command| (command.published - cycle.feedback.deadline).seconds();
            cycle.command.map_or(f64::NAN, late)
        });
        self.commanded("stream", "", |it| it.stream as f64);
        self.commanded("stroke", "", |it| it.stroke as f64);
        self.commanded("stream_time", "s", |it| it.stream_time);
        self.commanded("rate", "", |it| it.rate);
        self.commanded("mode", "", |it| f64::from(it.mode));
        self.commanded("state", "", |it| f64::from(it.state));
        self.commanded("fault", "", |it| f64::from(it.fault.code));
    }

    fn progress(&mut self, machine: &Machine) {
        for (index, axis) in machine.axes.iter().enumerate() {
            self.add(format!("progress.position.{}", axis.name), axis.unit.name(), move |cycle| {
                cycle.progress.position[index]
            });
        }
        for (index, direction) in DIRECTIONS.iter().enumerate() {
            self.add(format!("progress.tool.{direction}"), "m", move |cycle| {
                cycle.progress.tool[index]
            });
        }
        self.told("stream", "", |it| it.stream as f64);
        self.told("accepted", "", |it| it.accepted as f64);
        self.told("played", "", |it| it.played as f64);
        self.told("room", "", |it| it.room as f64);
        self.told("stroke", "", |it| it.stroke as f64);
        self.told("finished_stream", "", |it| it.finished_stream as f64);
        self.told("rate", "", |it| it.rate);
        self.told("override_rate", "", |it| it.override_rate);
        self.told("power_override", "", |it| it.power_override);
        self.told("rapid_override", "", |it| it.rapid_override);
        self.told("homed", "", |it| f64::from(it.homed));
        self.told("probed", "", |it| it.probed);
        self.told("requests", "", |it| f64::from(it.requests));
        self.told("motion_end", "", |it| f64::from(it.motion_end));
        self.told("state", "", |it| f64::from(it.state));
        self.told("fault", "", |it| f64::from(it.fault.code));
    }
}

fn level(bits: u64) -> f64 {
    if bits == 0 { 0.0 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn value(name: &str, cycle: &CycleSamples<'_>) -> f64 {
        let signals = signals(&Machine::builtin());
        signals.iter().find(|it| it.name.name == name).unwrap().value(cycle)
    }

    #[test]
    fn every_signal_has_a_name_of_its_own_and_every_actuator_its_signals() {
        let machine = Machine::builtin();
        let signals = signals(&machine);
        let mut names: Vec<&str> = signals.iter().map(|it| it.name.name.as_str()).collect();
        names.sort_unstable();
        let count = names.len();
        names.dedup();
        assert_eq!(names.len(), count);
        for actuator in &machine.actuators {
            let of = names.iter().filter(|name| name.ends_with(&format!(".{}", actuator.name)));
            // Its ten, and the axis' place where that has the same name.
            assert!(of.count() >= 10, "{}", actuator.name);
        }
    }

    #[test]
    fn a_cycle_without_an_answer_has_no_command_to_show() {
        let (feedback, progress) = (
            Feedback { current: [1.5; 16], ..Feedback::default() },
            Progress { rate: 0.5, ..Progress::default() },
        );
        let command = Command { rate: 0.25, ..Command::default() };
        let mut cycle =
            CycleSamples { feedback: &feedback, command: None, progress: &progress, lit: 0.75 };
        assert!(value("command.rate", &cycle).is_nan());
        cycle.command = Some(&command);
        assert_eq!(value("command.rate", &cycle), 0.25);
        assert_eq!(value("progress.rate", &cycle), 0.5);
        assert_eq!(value("feedback.lit", &cycle), 0.75);
        assert_eq!(value("feedback.current.a", &cycle), 1.5);
        assert!(value("feedback.tool.x", &cycle).is_nan(), "drives did not see the tool");
    }
}
