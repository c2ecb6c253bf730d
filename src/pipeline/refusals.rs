//! Why a request was refused, in words.

use machine::{JointUnit, Machine};
use messages::{ControllerState, OperatorReply, Refusal};

/// What `reply` of the controller for `machine` says; `None` where it is no refusal.
pub(super) fn words(reply: &OperatorReply, machine: &Machine) -> Option<String> {
    if reply.accepted == 1 {
        return None;
    }
    let state = ControllerState::from_wire(reply.state).name();
    let axis = (reply.axis as usize).checked_sub(1).and_then(|index| machine.axes.get(index));
    let name = axis.map_or("", |axis| axis.name.as_str());
    let quantity = |value: f64| match axis.map(|axis| axis.unit) {
        Some(JointUnit::Length) => format!("{:.3} mm", value * 1e3),
        Some(JointUnit::Angle) => format!("{:.3} deg", value.to_degrees()),
        None => format!("{value}"),
    };
    let (found, limit) = (reply.found, reply.limit);
    Some(match Refusal::from_wire(reply.refusal) {
        Refusal::None | Refusal::State => format!("not possible while the machine is {state}"),
        Refusal::Unknown => "the controller knows no such request".to_owned(),
        Refusal::NoAxis => format!("there is no such axis; the machine has {}", names(machine)),
        Refusal::TooLarge => {
            format!("{} is too much: at most {}", quantity(found), quantity(limit))
        }
        Refusal::TooSmall => {
            format!("{} is too little: more than {}", quantity(found), quantity(limit))
        }
        Refusal::NotANumber => "that is no number to move by".to_owned(),
        Refusal::NotHomed => format!("axis {name} is not homed: `graver home`"),
        Refusal::SoftLimit => format!(
            "axis {name} would be at {}, beyond its soft limit {}",
            quantity(found),
            quantity(limit)
        ),
        Refusal::EmergencyStop => "the emergency stop is pressed".to_owned(),
        Refusal::DoorOpen => "the door is open".to_owned(),
        Refusal::Interlock => "an interlock is missing".to_owned(),
        Refusal::LimitSwitch => {
            format!("axis {name} is on its limit switch; it can be jogged away from it")
        }
        Refusal::NothingToFind => {
            "the machine file has nothing to find: no homing, or no probe".to_owned()
        }
        Refusal::Touching => "the probe touches already".to_owned(),
        Refusal::Stream => "there is no such stream to start".to_owned(),
        Refusal::StillThere => "what caused the fault is still there".to_owned(),
    })
}

/// The machine's axes by name.
fn names(machine: &Machine) -> String {
    machine.axes.iter().map(|axis| axis.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// The number of the axis called `name`, from 1.
///
/// # Errors
/// No such axis, in words.
pub(super) fn axis(machine: &Machine, name: &str) -> Result<u32, String> {
    let index = machine.axes.iter().position(|axis| axis.name == name);
    index
        .map(|index| index as u32 + 1)
        .ok_or_else(|| format!("there is no axis {name:?}; the machine has {}", names(machine)))
}
