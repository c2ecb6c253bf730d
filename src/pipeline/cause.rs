//! Why a machine stands, in words.

use machine::Machine;
use machine::operating::InputFunction;
use messages::{ControllerState, Fault, HoldCause, Progress};
use monitor::summary::FaultSummary;

/// Why the machine stands or does not go on, with the `fault` that is latched; `None` where there is nothing to say.
/// `has_job` says whether a job is under way.
pub(super) fn cause(
    progress: &Progress,
    fault: &Fault,
    has_job: bool,
    machine: &Machine,
) -> Option<String> {
    if let Some(fault) = FaultSummary::of(fault, machine) {
        return Some(fault.to_string());
    }
    let active = |function: InputFunction| {
        let mut inputs = machine.operating.bits();
        inputs.any(|(bit, input)| input.function == function && progress.inputs & bit != 0)
    };
    let resume = "`graver resume` goes on";
    match ControllerState::from_wire(progress.state) {
        ControllerState::Holding => Some(match HoldCause::from_wire(progress.hold_cause) {
            HoldCause::Program => match progress.line {
                0 => format!("programmed pause (M0): {resume}"),
                line => format!("programmed pause (M0), line {line}: {resume}"),
            },
            HoldCause::Door if active(InputFunction::Door) => "door open".to_owned(),
            HoldCause::Door => format!("the door was opened: {resume}"),
            HoldCause::Interlock if active(InputFunction::Interlock) => {
                "an interlock is missing".to_owned()
            }
            HoldCause::Interlock => format!("an interlock was missing: {resume}"),
            HoldCause::Setpoints => "waiting for setpoints".to_owned(),
            HoldCause::Light => "going back for light that was not given".to_owned(),
            HoldCause::Person | HoldCause::None => format!("feed hold: {resume}"),
        }),
        ControllerState::Disabled if has_job => Some("the motors are not powered yet".to_owned()),
        ControllerState::Enabling => Some("the motors are being powered".to_owned()),
        ControllerState::Idle | ControllerState::Disabled if active(InputFunction::Door) => {
            Some("door open".to_owned())
        }
        ControllerState::Stopping => Some("coming to rest".to_owned()),
        _ => None,
    }
}
