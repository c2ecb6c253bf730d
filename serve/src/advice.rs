//! What a person can do about a fault.

use messages::FaultCode;

/// What to do about the fault with this name; `None` where there is nothing to say.
pub fn advice(code: &str) -> Option<&'static str> {
    let known = ALL.into_iter().find(|known| known.name() == code)?;
    let text = match known {
        FaultCode::None => return None,
        FaultCode::FollowingError => {
            "Look for what hinders the axis: friction, a collision, a loose belt, a motor that lost its supply. Reset, \
             home it, and lower acceleration or raise `following_error` in the machine file if nothing is wrong."
        }
        FaultCode::PositionLimit => {
            "The axis is outside its soft limits: reset, enable, and jog it back. Home it if it lost its place."
        }
        FaultCode::SetpointLimit | FaultCode::StreamBroken | FaultCode::NotFinite => {
            "This should not happen: keep the run folder and report it. Reset, and start the pipeline again."
        }
        FaultCode::StreamStarved => {
            "The planner did not keep up: look at the load of this PC with `graver doctor`, and at the job's detail."
        }
        FaultCode::StreamStart => {
            "The axes moved since the job was planned: reset, and submit it again."
        }
        FaultCode::StaleFeedback | FaultCode::Overrun | FaultCode::StaleCommand => {
            "The PC was too late: `graver doctor` says what to change. Reset goes on."
        }
        FaultCode::PlannerLost
        | FaultCode::ControllerLost
        | FaultCode::DrivesLost
        | FaultCode::SupervisorLost => {
            "A process of the pipeline ended: its last words are on its standard error or in the journal. Start it again."
        }
        FaultCode::DriveFault => {
            "Read the fault of the drive, look at its supply, cables and temperature, and reset."
        }
        FaultCode::Overload => {
            "The motor was loaded above its rating: let it cool, look for friction, lower acceleration or speed."
        }
        FaultCode::Racking => {
            "The motors of one axis are apart: look whether the bridge is jammed or one side slipped, then home it."
        }
        FaultCode::EmergencyStop => {
            "Release the emergency stop when it is safe, reset, and enable."
        }
        FaultCode::HardLimit => {
            "The axis ran onto its limit switch: reset, enable, jog it away from it, and home it."
        }
        FaultCode::DoorOpened => "Close the door, and reset or resume.",
        FaultCode::HomingFailed => {
            "Look at the reference switch and its cable, and at the way that the axis may search."
        }
    };
    Some(text)
}

const ALL: [FaultCode; 22] = [
    FaultCode::None,
    FaultCode::FollowingError,
    FaultCode::PositionLimit,
    FaultCode::SetpointLimit,
    FaultCode::NotFinite,
    FaultCode::StaleFeedback,
    FaultCode::StreamStarved,
    FaultCode::StreamBroken,
    FaultCode::Overrun,
    FaultCode::StaleCommand,
    FaultCode::PlannerLost,
    FaultCode::ControllerLost,
    FaultCode::DrivesLost,
    FaultCode::DriveFault,
    FaultCode::Overload,
    FaultCode::SupervisorLost,
    FaultCode::StreamStart,
    FaultCode::Racking,
    FaultCode::EmergencyStop,
    FaultCode::HardLimit,
    FaultCode::DoorOpened,
    FaultCode::HomingFailed,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_advice_for_every_fault() {
        for code in 1..64 {
            let code = FaultCode::from_wire(code);
            assert!(advice(code.name()).is_some(), "{}", code.name());
        }
        assert_eq!(advice("none"), None);
        assert_eq!(advice("no such fault"), None);
    }
}
