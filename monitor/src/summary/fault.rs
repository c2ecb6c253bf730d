//! A fault in words: what was found, with its quantity and unit, and the limit that it broke.

use super::StallSummary;
use machine::drives::fault_text;
use machine::{JointUnit, Machine};
use messages::fault::FaultUnit;
use messages::time::Period;
use messages::{CommandMode, Fault, FaultCode, FaultQuantity};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A fault as summaries tell it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct FaultSummary {
    /// The code, such as `following_error`.
    pub code: String,
    /// The axis by name, or the actuator where an axis has several; null when it belongs to none.
    pub axis: Option<String>,
    /// What was found, with value, unit and limit.
    pub detail: String,
}

impl FaultSummary {
    /// The summary of a fault of `machine`; `None` when there is none.
    pub fn of(fault: &Fault, machine: &Machine) -> Option<Self> {
        let index = |number: u16| usize::from(number).checked_sub(1);
        let axis = index(fault.axis).and_then(|index| machine.axes.get(index));
        let actuator = index(fault.actuator).and_then(|index| machine.actuators.get(index));
        let driven = actuator.and_then(|actuator| machine.axes.get(actuator.axis));
        let name = actuator.map(|it| &it.name).or(axis.map(|it| &it.name));
        fault.is_some().then(|| Self {
            code: fault.code().name().to_owned(),
            axis: name.cloned(),
            detail: match word(fault, machine) {
                Some(told) => told,
                None => {
                    detail(fault, driven.or(axis).map(|axis| axis.unit), machine.realtime.period)
                }
            },
        })
    }

    /// Adds the longest stall and its causes to a fault that says that something came too late.
    pub fn blame(&mut self, stalls: &StallSummary) {
        let late = [FaultCode::StaleCommand, FaultCode::StaleFeedback, FaultCode::Overrun];
        if stalls.count > 0 && late.iter().any(|code| code.name() == self.code) {
            self.detail += &format!("; the longest stall was {}", stalls.longest_text());
        }
    }
}

impl std::fmt::Display for FaultSummary {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let axis = self.axis.as_ref().map(|axis| format!(" of axis {axis}")).unwrap_or_default();
        write!(formatter, "{}{axis}: {}", self.code, self.detail)
    }
}

/// A fault word of the drives with its text, where the fault is one; words of a drive on a bus in hexadecimal, as
/// its manual has them.
fn word(fault: &Fault, machine: &Machine) -> Option<String> {
    if fault.quantity() != FaultQuantity::DriveWord {
        return None;
    }
    let word = fault.value as u32;
    let number = if word < 0x100 { format!("{word}") } else { format!("{word:04X}h") };
    Some(match fault_text(&machine.drives.kind, word) {
        Some(text) => format!("{text} (fault word {number} of {})", machine.drives.kind.name()),
        None => format!(
            "fault word {number} of {}, which its manual explains",
            machine.drives.kind.name()
        ),
    })
}

fn detail(fault: &Fault, joint: Option<JointUnit>, period: Period) -> String {
    let quantity = fault.quantity();
    match (fault.code(), quantity) {
        (code, FaultQuantity::None) => without_value(code).to_owned(),
        (FaultCode::StaleFeedback, _) if fault.value == 0.0 => "feedback did not go on".to_owned(),
        (FaultCode::StaleFeedback, _) if fault.limit().is_some_and(|most| fault.value <= most) => {
            "feedback came of another run of drives".to_owned()
        }
        (_, FaultQuantity::Mode) => unexpected_mode(fault.value),
        (_, FaultQuantity::HomingStatus) => lost_homing(fault.value as u16),
        (_, FaultQuantity::Setpoint) => {
            format!("setpoint {} came where setpoint {} was due", fault.value, fault.limit)
        }
        _ => {
            let (name, unit) = quantity.name();
            let amount = |value: f64| match quantity {
                FaultQuantity::Cycles | FaultQuantity::Overruns => in_time(value, period),
                _ => amount(value, unit, joint),
            };
            let found = format!("{name} {}", amount(fault.value));
            match fault.limit() {
                Some(limit) => format!("{found}, limit {}", amount(limit)),
                None => found,
            }
        }
    }
}

/// What it means that drives was told a mode before it had heard that the motors are disabled.
fn unexpected_mode(mode: f64) -> String {
    let told = match CommandMode::from_wire(mode as u32) {
        CommandMode::Driven => "drive the motors",
        CommandMode::QuickStop | CommandMode::Disabled => "brake the motors",
    };
    format!(
        "drives was told to {told} (command mode {mode}) before it had heard that they are disabled: while they were, no \
         command had come for longer than `realtime.stall`, as on a loaded PC, or the controller is a new one. `graver \
         reset` and `graver enable` go on; if it comes again, `graver doctor` says what of this PC to change"
    )
}

/// Why a drive with this status word has not found its reference by itself.
fn lost_homing(status: u16) -> String {
    /// That it has failed, by CiA 402.
    const FAILED: u16 = 1 << 13;
    let (what, look) = if status & FAILED != 0 {
        (
            "the drive has not found its reference by its own method",
            "at its switches and at `drive_method`",
        )
    } else {
        ("the drive does not go into its homing mode", "at its set-up by the tool of its maker")
    };
    format!("{what} (status word {status:04X}h): look {look}")
}

/// What a fault means that has no value.
fn without_value(code: FaultCode) -> &'static str {
    match code {
        FaultCode::PlannerLost => "the planner process died or left",
        FaultCode::ControllerLost => "the controller process died or left",
        FaultCode::DrivesLost => "the drives process died or left",
        FaultCode::SupervisorLost => "the supervisor died or left",
        FaultCode::StaleCommand => "drives got no fresh command and stopped the axes by itself",
        FaultCode::DriveFault => "the drives or the motors refuse",
        FaultCode::EmergencyStop => "it was pressed",
        FaultCode::DoorOpened => "the door was opened while a job was under way",
        _ => "no value was reported",
    }
}

/// A number of cycles, and the time that they take.
fn in_time(cycles: f64, period: Period) -> String {
    format!("{cycles} ({} ms)", cycles * (period.seconds() * 1e3))
}

/// A value in the unit that people read it in: millimetres for places along a line.
fn amount(value: f64, unit: FaultUnit, joint: Option<JointUnit>) -> String {
    match (unit, joint) {
        (FaultUnit::Joint(""), Some(JointUnit::Length)) => format!("{:.4} mm", value * 1e3),
        (FaultUnit::Joint(per), Some(JointUnit::Length)) => format!("{value:.6} m{per}"),
        (FaultUnit::Joint(per), Some(JointUnit::Angle)) => format!("{value:.6} rad{per}"),
        (FaultUnit::Joint(per), None) => format!("{value:.6} (m or rad){per}"),
        (FaultUnit::Plain(""), _) => format!("{value}"),
        (FaultUnit::Plain(unit), _) => format!("{value:.4} {unit}"),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use FaultQuantity as Quantity;

    /// A CoreXY, whose joints are belts, with the second made to turn.
    fn machine() -> Machine {
        let mut machine = Machine::builtin();
        machine.axes[1].unit = JointUnit::Angle;
        machine
    }

    fn check(fault: Fault, expect: &str) {
        let summary = FaultSummary::of(&fault, &machine()).unwrap();
        assert_eq!(summary.detail, expect);
        assert_eq!(summary.code, fault.code().name());
    }

    #[test]
    fn quantity_and_unit_are_those_of_the_fault_and_the_axis() {
        let error = Fault::new(FaultCode::FollowingError);
        let found =
            |axis, value| error.on_actuator(axis).beyond(Quantity::FollowingError, value, 2e-3);
        check(found(0, 2.1e-3), "following error 2.1000 mm, limit 2.0000 mm");
        check(found(1, 0.0125), "following error 0.012500 rad, limit 0.002000 rad");
        let planned = Fault::new(FaultCode::SetpointLimit).on_axis(0);
        check(
            planned.beyond(Quantity::Velocity, 0.3, 0.25),
            "velocity 0.300000 m/s, limit 0.250000 m/s",
        );
        check(
            planned.beyond(Quantity::Torque, 0.12, 0.1),
            "motor torque 0.1200 N·m, limit 0.1000 N·m",
        );
        let light = Fault::new(FaultCode::SetpointLimit);
        check(light.beyond(Quantity::Edges, 9.0, 8.0), "gate edges in a cycle 9, limit 8");
        let broken = Fault::new(FaultCode::StreamBroken);
        check(
            broken.beyond(Quantity::Setpoint, 12.0, 10.0),
            "setpoint 12 came where setpoint 10 was due",
        );
        let overrun = Fault::new(FaultCode::Overrun);
        check(
            overrun.beyond(Quantity::Overruns, 4.0, 3.0),
            "late cycles in a row 4 (4 ms), limit 3 (3 ms)",
        );
    }

    #[test]
    fn a_fault_word_is_told_by_its_text() {
        let file = include_str!("../../../machines/hostmot2_steppers.toml");
        let board = Machine::parse("board.toml", file, &[]).unwrap();
        let told = |word: f64, machine: &Machine| {
            let fault = Fault::new(FaultCode::DriveFault).with(Quantity::DriveWord, word);
            FaultSummary::of(&fault, machine).unwrap().detail
        };
        assert_eq!(told(1.0, &board), "the card's watchdog has bitten (fault word 1 of hostmot2)");
        let unknown = told(f64::from(0x2310), &board);
        assert_eq!(unknown, "fault word 2310h of hostmot2, which its manual explains");
    }

    #[test]
    fn a_mode_that_came_too_early_is_told_with_what_to_do() {
        let told = |mode: CommandMode| {
            let fault =
                Fault::new(FaultCode::DriveFault).with(Quantity::Mode, f64::from(mode as u32));
            FaultSummary::of(&fault, &machine()).unwrap().detail
        };
        let driven = told(CommandMode::Driven);
        assert!(
            driven.starts_with("drives was told to drive the motors (command mode 4) before"),
            "{driven}"
        );
        assert!(
            driven.contains("no command had come for longer than `realtime.stall`"),
            "{driven}"
        );
        assert!(driven.contains("`graver reset` and `graver enable` go on"), "{driven}");
        assert!(
            told(CommandMode::QuickStop)
                .starts_with("drives was told to brake the motors (command mode 5)")
        );
    }

    #[test]
    fn a_drive_that_finds_no_reference_is_told_in_words() {
        let told = |status: f64| {
            let fault = Fault::new(FaultCode::HomingFailed).on_actuator(0);
            FaultSummary::of(&fault.with(Quantity::HomingStatus, status), &machine())
                .unwrap()
                .detail
        };
        let failed = told(f64::from(0x2637));
        assert_eq!(
            failed,
            "the drive has not found its reference by its own method (status word 2637h): look at its switches and at \
             `drive_method`"
        );
        assert!(told(f64::from(0x0237)).starts_with("the drive does not go into its homing mode"));
    }

    #[test]
    fn a_limit_of_zero_is_a_limit() {
        let fault = Fault::new(FaultCode::PositionLimit).on_axis(0);
        let expect = "position -1.5000 mm, limit 0.0000 mm";
        check(fault.beyond(Quantity::Position, -1.5e-3, 0.0), expect);
    }

    #[test]
    fn what_has_no_number_names_none() {
        let stale = |gap| Fault::new(FaultCode::StaleFeedback).beyond(Quantity::Cycles, gap, 3.0);
        check(Fault::new(FaultCode::PlannerLost), "the planner process died or left");
        check(Fault::new(FaultCode::DriveFault), "the drives or the motors refuse");
        check(stale(0.0), "feedback did not go on");
        check(stale(1.0), "feedback came of another run of drives");
        check(stale(4.0), "cycles gone by 4 (4 ms), limit 3 (3 ms)");
        let number = Fault::new(FaultCode::NotFinite).on_axis(0).with(Quantity::Number, f64::NAN);
        check(number, "number in a sample NaN");
        assert_eq!(FaultSummary::of(&Fault::default(), &machine()), None);
    }

    #[test]
    fn a_fault_of_lateness_names_the_longest_stall() {
        let causes = vec!["steal".to_owned()];
        let stalls =
            StallSummary { count: 1, longest: 31e-3, longest_causes: causes, ..Default::default() };
        let told = |fault: Fault, stalls: &StallSummary| {
            let mut summary = FaultSummary::of(&fault, &machine()).unwrap();
            summary.blame(stalls);
            summary.detail
        };
        let stale = Fault::new(FaultCode::StaleCommand).beyond(Quantity::Cycles, 31.0, 10.0);
        let found = "cycles gone by 31 (31 ms), limit 10 (10 ms)";
        assert_eq!(told(stale, &StallSummary::default()), found);
        let why = "the longest stall was 31.0 ms: the hypervisor took the CPU (steal time)";
        assert_eq!(told(stale, &stalls), format!("{found}; {why}"));
        let lost = Fault::new(FaultCode::PlannerLost);
        assert_eq!(told(lost, &stalls), "the planner process died or left");
    }

    #[test]
    fn a_fault_names_its_axis() {
        let on = |axis| {
            let fault = Fault { axis, ..Fault::new(FaultCode::FollowingError) };
            FaultSummary::of(&fault, &machine()).unwrap().axis
        };
        assert_eq!(on(2), Some(machine().axes[1].name.clone()));
        assert_eq!((on(0), on(8)), (None, None));
    }
}
