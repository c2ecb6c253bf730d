//! Why a machine stands, in words.

use super::slow;
use machine::Machine;
use machine::operating::InputFunction;
use messages::{ControllerState, Fault, HoldCause, Progress};
use monitor::summary::FaultSummary;

/// Why the machine stands or does not go on, with the `fault` that is latched and the `interlocks` that are missing;
/// `None` where there is nothing to say.
pub(super) fn cause(
    progress: &Progress,
    fault: &Fault,
    machine: &Machine,
    interlocks: &[String],
) -> Option<String> {
    if let Some(fault) = FaultSummary::of(fault, machine) {
        return Some(fault.to_string());
    }
    let active = |function: InputFunction| {
        let mut inputs = machine.operating.bits();
        inputs.any(|(bit, input)| input.function == function && progress.inputs & bit != 0)
    };
    let is_open = active(InputFunction::Door);
    match ControllerState::from_wire(progress.state) {
        ControllerState::Holding => Some(match HoldCause::from_wire(progress.hold_cause) {
            HoldCause::Program if progress.line == 0 => "programmed pause (M0)".to_owned(),
            HoldCause::Program => format!("programmed pause (M0), line {}", progress.line),
            HoldCause::Door if is_open => "door open".to_owned(),
            HoldCause::Door => "the door was opened".to_owned(),
            HoldCause::Interlock if !interlocks.is_empty() => slow::missing(interlocks),
            HoldCause::Interlock => "an interlock was missing".to_owned(),
            HoldCause::Setpoints => "waiting for setpoints".to_owned(),
            HoldCause::Light => "going back for light that was not given".to_owned(),
            HoldCause::Person | HoldCause::None => "feed hold".to_owned(),
        }),
        ControllerState::Enabling => Some("the motors are being powered".to_owned()),
        ControllerState::Stopping => Some("coming to rest".to_owned()),
        ControllerState::Idle | ControllerState::Disabled if is_open => {
            Some("door open".to_owned())
        }
        ControllerState::Idle | ControllerState::Disabled if !interlocks.is_empty() => {
            Some(slow::missing(interlocks))
        }
        _ => None,
    }
}
