//! Why a request was refused, in words.

use super::slow;
use machine::{JointUnit, Machine};
use messages::{ControllerState, MAX_AXES, OperatorReply, Refusal};
use operator::Verb;

/// Why the controller for `machine`, of which these `interlocks` are missing, does not start a job, by its `reply`.
pub(crate) fn not_started(
    reply: &OperatorReply,
    machine: &Machine,
    interlocks: &[String],
) -> String {
    // A job is started like one that goes on.
    let words = words(reply, Verb::Resume, machine, interlocks).unwrap_or_default();
    format!("the controller refused to start the job: {words}")
}

/// What `reply` of the controller for `machine`, of which these `interlocks` are missing, to `verb` says; `None` where it
/// is no refusal.
pub(super) fn words(
    reply: &OperatorReply,
    verb: Verb,
    machine: &Machine,
    interlocks: &[String],
) -> Option<String> {
    if reply.accepted == 1 {
        return None;
    }
    let mover = (reply.axis as usize).checked_sub(1);
    let axis = mover.and_then(|index| machine.axes.get(index));
    let direction = mover.and_then(|index| DIRECTIONS.get(index.checked_sub(MAX_AXES)?));
    let name = axis.map(|axis| axis.name.as_str()).or(direction.copied()).unwrap_or_default();
    let unit = axis.map(|axis| axis.unit).or(direction.map(|_| JointUnit::Length));
    let quantity = |value: f64| match unit {
        Some(JointUnit::Length) => format!("{:.3} mm", value * 1e3),
        Some(JointUnit::Angle) => format!("{:.3} deg", value.to_degrees()),
        None => format!("{value}"),
    };
    let speed = |value: f64| format!("{}/s", quantity(value));
    let (found, limit) = (reply.found, reply.limit);
    Some(match Refusal::from_wire(reply.refusal) {
        Refusal::None | Refusal::State => by_state(ControllerState::from_wire(reply.state), verb),
        Refusal::Unknown => "the controller knows no such request".to_owned(),
        Refusal::NoAxis => format!("there is no such axis; the machine has {}", names(machine)),
        Refusal::TooLarge if unit.is_some() => {
            format!("{name} is moved by hand at {} at most, not {}", speed(limit), speed(found))
        }
        Refusal::TooLarge if matches!(verb, Verb::Override | Verb::Power) => {
            format!("an override is from 10 % to 200 %, not {} %", short(found * 100.0))
        }
        Refusal::TooLarge if verb == Verb::Rapid => {
            format!("an override of rapids is from 10 % to 100 %, not {} %", short(found * 100.0))
        }
        Refusal::TooLarge => format!("{found} is too much: at most {limit}"),
        Refusal::TooSmall => format!("a speed of {} leads nowhere", speed(found)),
        Refusal::NotANumber => "a way or speed of 0, or none, leads nowhere".to_owned(),
        Refusal::NotHomed => format!("axis {name} is not homed: `graver home`"),
        Refusal::SoftLimit if (found - limit).abs() < LIMIT_REACHED => {
            format!("{name} is at its soft limit of {}", quantity(limit))
        }
        Refusal::SoftLimit if direction.is_some() => {
            let (found, limit) = (quantity(found), quantity(limit));
            format!("the tool would be at {name} {found}, beyond its area, which ends at {limit}")
        }
        Refusal::SoftLimit => {
            let (found, limit) = (quantity(found), quantity(limit));
            format!("{name} would be at {found}, beyond its soft limit of {limit}")
        }
        Refusal::EmergencyStop if verb == Verb::Reset => {
            "the emergency stop is pressed: release it first".to_owned()
        }
        Refusal::EmergencyStop => "the emergency stop is pressed".to_owned(),
        Refusal::DoorOpen => "the door is open".to_owned(),
        Refusal::Interlock => slow::missing(interlocks),
        Refusal::LimitSwitch => {
            format!("axis {name} is on its limit switch: jog it away from it")
        }
        Refusal::NothingToFind if verb == Verb::Probe => {
            "the machine file has no input with the function `probe`".to_owned()
        }
        Refusal::NothingToFind => {
            "none of these axes has a reference to find: they know their place".to_owned()
        }
        Refusal::Touching => "the probe touches already".to_owned(),
        Refusal::Stream => "there is no such stream to start".to_owned(),
        Refusal::StillThere => "what caused the fault is still there".to_owned(),
        Refusal::Power => format!(
            "a test pulse has {} % at {}, not {} %",
            short(limit * 100.0),
            if found > limit { "most (`safety.test_power`)" } else { "least (`laser.min_power`)" },
            short(found * 100.0)
        ),
        Refusal::Time if found > limit => format!(
            "a test pulse lasts {} ms at most (`safety.test_time`), not {} ms",
            short(limit * 1e3),
            short(found * 1e3)
        ),
        Refusal::Time => "a test pulse lasts longer than 0 s".to_owned(),
        Refusal::NotByHand => {
            "the machine switches this output by itself: people switch those with the functions `air` and \
             `general`"
                .to_owned()
        }
        Refusal::NoDirection => format!(
            "the tool of this machine does not go straight along {name} with its joints: jog its axes {}",
            names(machine)
        ),
        Refusal::Ended => format!("the jog of {name} has ended"),
    })
}

/// A place no further from a soft limit is at it [m or rad]: a jog stops a cycle's way before it.
const LIMIT_REACHED: f64 = 1e-3;

/// A number to a thousandth, without zeros at its end.
fn short(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// Why `verb` is not possible in a state, and what would make it so.
fn by_state(state: ControllerState, verb: Verb) -> String {
    use ControllerState as State;
    let moves = matches!(
        verb,
        Verb::Home
            | Verb::Jog
            | Verb::JogOn
            | Verb::Step
            | Verb::Probe
            | Verb::TestPulse
            | Verb::Output
    );
    let advice = match state {
        State::Disabled if moves => ": `graver enable`",
        State::Faulted | State::Halted if moves || verb == Verb::Enable => ": `graver reset`",
        State::Enabling if moves => ": wait until it is idle",
        State::Running | State::Holding if moves => ": a job is under way",
        State::Homing | State::Jogging | State::Probing | State::Pulsing if moves => {
            ": wait until it is idle, or `graver stop`"
        }
        _ => "",
    };
    format!("not possible while the machine is {}{advice}", state.name())
}

/// The machine's axes by name.
fn names(machine: &Machine) -> String {
    machine.axes.iter().map(|axis| axis.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// Directions of the tool, for who names no axis.
pub(super) const DIRECTIONS: [&str; 3] = ["x", "y", "z"];

/// The number of the axis called `name`, from 1, or of the direction of the tool, which must be moved in `unit` if
/// one is given.
///
/// # Errors
/// No such axis, or another unit, in words.
pub(super) fn axis(
    machine: &Machine,
    name: &str,
    unit: Option<&str>,
    verb: Verb,
) -> Result<u32, (Refusal, String)> {
    let found = machine.axes.iter().enumerate().find(|(_, axis)| axis.name == name);
    let direction = DIRECTIONS.iter().position(|direction| *direction == name);
    let (index, own) = if let Some((index, axis)) = found {
        (index, axis.unit)
    } else if let Some(direction) = direction.filter(|_| verb != Verb::Home) {
        (MAX_AXES + direction, JointUnit::Length)
    } else {
        let words = format!("there is no axis {name:?}; the machine has {}", names(machine));
        return Err((Refusal::NoAxis, words));
    };
    if unit.is_some_and(|unit| unit != own.name()) {
        let (turns, needed) = match own {
            JointUnit::Length => ("slides", "a length, such as \"10 mm\", and \"10 mm/s\""),
            JointUnit::Angle => ("turns", "an angle, such as \"10 deg\", and \"10 deg/s\""),
        };
        return Err((Refusal::NotANumber, format!("{name} {turns}: write {needed}")));
    }
    Ok(index as u32 + 1)
}

/// That there is no input called `name`.
pub(super) fn no_input(machine: &Machine, name: &str) -> String {
    let inputs = machine.operating.inputs.iter().map(|input| input.name.as_str());
    format!("there is no input {name:?}; the machine has {}", known(inputs))
}

/// That there is no output called `name`.
pub(super) fn no_output(machine: &Machine, name: &str) -> String {
    let outputs = machine.operating.outputs.iter().map(|output| output.name.as_str());
    format!("there is no output {name:?}; the machine has {}", known(outputs))
}

fn known<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
