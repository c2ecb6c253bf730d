//! What drove the motors, and what was counted on the way there.

use machine::{DrivesKind, Machine};
use messages::LinkCounters;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The port, how its actuators are driven, and its link.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DrivesSummary {
    /// The kind of port by the key of its table in the machine file: `simulated`, `hostmot2`, `ethercat`.
    pub port: String,
    /// What each actuator's drive follows: `voltage`, `torque`, `velocity` or `position`.
    pub mode: Vec<String>,
    /// From a deadline until each actuator follows what is sent then [s].
    pub latency: Vec<f64>,
    /// From a deadline until the offsets of the gate's edges count that are sent then [s].
    pub gate_latency: f64,
    /// What was counted on the link to the hardware; null where there is none.
    pub link: Option<LinkSummary>,
}

/// Counts since drives was started.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LinkSummary {
    /// Frames or packets sent.
    pub sent: u64,
    /// Those that nothing came back of.
    pub lost: u64,
    /// Answers that came after their cycle.
    pub late: u64,
    /// Answers that came more than once, or out of order.
    pub duplicated: u64,
    /// Answers that could not be read, or were not what was asked.
    pub corrupted: u64,
    /// Cycles without a measurement of their own; the one before stood in.
    pub bridged: u64,
    /// Largest distance of the clock of the bus from ours while it was followed [s].
    pub clock_error_max: f64,
}

impl DrivesSummary {
    /// The drives of `machine` as its file says.
    pub fn of(machine: &Machine) -> Self {
        Self {
            port: machine.drives.kind.name().to_owned(),
            mode: machine.actuators.iter().map(|it| it.mode.name().to_owned()).collect(),
            latency: machine.actuators.iter().map(|it| it.latency.seconds()).collect(),
            gate_latency: machine.drives.gate_latency.seconds(),
            link: None,
        }
    }

    /// The simulated plant in the place of the drives of `machine`.
    pub fn simulated(machine: &Machine) -> Self {
        Self { port: DrivesKind::Simulated.name().to_owned(), ..Self::of(machine) }
    }

    /// The same with what drives has counted.
    #[must_use]
    pub fn counted(self, counters: &LinkCounters) -> Self {
        let LinkCounters { sent, lost, late, duplicated, corrupted, bridged, clock_error_max } =
            *counters;
        let clock_error_max = clock_error_max as f64 * 1e-9;
        let link =
            LinkSummary { sent, lost, late, duplicated, corrupted, bridged, clock_error_max };
        Self { link: (*counters != LinkCounters::default()).then_some(link), ..self }
    }

    /// Modes and latencies of `actuators`, by name, and of the gate, in words; empty where all is as simulated
    /// drives usually are.
    pub fn text(&self, actuators: &[String]) -> String {
        let all = self.latency.iter().chain([&self.gate_latency]);
        if self.port == DrivesKind::Simulated.name() && all.clone().all(|latency| *latency == 0.0) {
            return String::new();
        }
        let mut parts = vec![self.port.clone()];
        for ((name, mode), latency) in actuators.iter().zip(&self.mode).zip(&self.latency) {
            parts.push(format!("{name} {mode} after {}", microseconds(*latency)));
        }
        parts.push(format!("gate after {}", microseconds(self.gate_latency)));
        parts.join(", ")
    }
}

impl core::fmt::Display for LinkSummary {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { sent, lost, late, duplicated, corrupted, bridged, clock_error_max } = self;
        write!(
            formatter,
            "{sent} sent, {lost} lost, {late} late, {duplicated} doubled, {corrupted} damaged, {bridged} cycles \
             bridged"
        )?;
        if *clock_error_max > 0.0 {
            write!(formatter, ", clock off by up to {}", microseconds(*clock_error_max))?;
        }
        Ok(())
    }
}

fn microseconds(time: f64) -> String {
    format!("{:.1} µs", time * 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simulated_drives_without_latency_go_without_saying() {
        let machine = Machine::builtin();
        let drives = DrivesSummary::of(&machine);
        let names: Vec<String> = machine.actuators.iter().map(|it| it.name.clone()).collect();
        assert_eq!((drives.text(&names), drives.link), (String::new(), None));
        let late = DrivesSummary { gate_latency: 4e-4, ..drives };
        let expected =
            "simulated, a voltage after 0.0 µs, b voltage after 0.0 µs, gate after 400.0 µs";
        assert_eq!(late.text(&names), expected);
    }

    #[test]
    fn what_was_counted_is_told_where_something_was_sent() {
        let drives = DrivesSummary::of(&Machine::builtin());
        assert_eq!(drives.clone().counted(&LinkCounters::default()).link, None);
        let counters = LinkCounters { sent: 9, lost: 2, bridged: 2, ..LinkCounters::default() };
        let link = drives.clone().counted(&counters).link.map(|link| link.to_string());
        let text = "9 sent, 2 lost, 0 late, 0 doubled, 0 damaged, 2 cycles bridged";
        assert_eq!(link.as_deref(), Some(text));
        let counters = LinkCounters { clock_error_max: 1500, ..counters };
        let link = drives.counted(&counters).link.map(|link| link.to_string());
        assert_eq!(link, Some(format!("{text}, clock off by up to 1.5 µs")));
    }
}
