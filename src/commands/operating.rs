//! Operating a machine by hand: home, jog, probe, test pulse, and the inputs of a simulated machine.

use super::operator::{ask, send_checked};
use crate::arguments::{
    HomeArguments, InputArguments, InputLevel, InstanceArguments, JogArguments, ProbeArguments,
    TestPulseArguments,
};
use crate::exit::{Exit, Failure};
use crate::output::say;
use crate::pipeline::operators::{Request, Verb};
use machine::quantity::{self, Travel, TravelSpeed};
use runtime::socket::ANSWER_PATIENCE;
use runtime::{Instance, message, signal};
use serde_json::{Value, json};
use std::time::Duration;

/// How often a jog is asked for anew: several times within any dead man's time.
const JOG_INTERVAL: Duration = Duration::from_millis(20);

/// How often the state is polled until a motion has ended.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Finds the references of axes, and waits until they are at home.
///
/// # Errors
/// No pipeline, or one that refuses.
pub fn home(arguments: &HomeArguments) -> Result<Exit, Failure> {
    let request = operate(Verb::Home, arguments.axes.clone(), [0.0; 2]);
    carry_out(&request, &arguments.instance, "homing").map(|(exit, _)| exit)
}

/// Moves an axis by a distance, or until Ctrl-C.
///
/// # Errors
/// No pipeline, or one that refuses; a quantity that is none.
pub fn jog(arguments: &JogArguments) -> Result<Exit, Failure> {
    let speed = read::<TravelSpeed>("speed", &arguments.speed)?;
    let axes = vec![arguments.axis.clone()];
    let Some(distance) = &arguments.distance else {
        return jog_on(&axes, speed, &arguments.instance);
    };
    let distance = read::<Travel>("distance", distance)?;
    let request = operate(Verb::Step, axes, [distance, speed.abs()]);
    carry_out(&request, &arguments.instance, "jogging").map(|(exit, _)| exit)
}

/// Asks for the motion again and again until a signal comes. Whatever ends this process ends the motion too.
fn jog_on(axes: &[String], speed: f64, arguments: &InstanceArguments) -> Result<Exit, Failure> {
    signal::install().map_err(Failure::service)?;
    let request = operate(Verb::Jog, axes.to_vec(), [speed, 0.0]);
    let exit = ask(&request, arguments)?;
    if exit != Exit::Done {
        return Ok(exit);
    }
    let instance = Instance::new(&arguments.instance).map_err(Failure::bad_input)?;
    while signal::termination().is_none() {
        std::thread::sleep(JOG_INTERVAL);
        let reply = send_checked(&request, &instance, ANSWER_PATIENCE)?;
        if reply["accepted"].as_bool() != Some(true) {
            message::tell(&format!("refused: {}", reply["refusal"].as_str().unwrap_or("unknown")));
            return Ok(Exit::Stopped);
        }
    }
    ask(&operate(Verb::Jog, axes.to_vec(), [0.0; 2]), arguments)
}

/// Lights the laser for a moment.
///
/// # Errors
/// No pipeline, or one that refuses; a quantity that is none.
pub fn test_pulse(arguments: &TestPulseArguments) -> Result<Exit, Failure> {
    let power = quantity::read_share(&arguments.power)
        .map_err(|error| Failure::bad_input(format!("power {:?}: {error}", arguments.power)))?;
    let time = read::<quantity::Duration>("time", &arguments.time)?;
    ask(&operate(Verb::TestPulse, Vec::new(), [power, time]), &arguments.instance)
}

/// Moves an axis until the probe touches, and says where.
///
/// # Errors
/// No pipeline, or one that refuses; a quantity that is none.
pub fn probe(arguments: &ProbeArguments) -> Result<Exit, Failure> {
    let distance = read::<Travel>("distance", &arguments.distance)?;
    let speed = read::<TravelSpeed>("speed", &arguments.speed)?;
    let request = operate(Verb::Probe, vec![arguments.axis.clone()], [distance, speed.abs()]);
    let (exit, status) = carry_out(&request, &arguments.instance, "probing")?;
    if exit != Exit::Done {
        return Ok(exit);
    }
    match status["probed"].as_f64() {
        Some(place) => {
            say!("touched at {:.4} mm", place * 1e3);
            Ok(Exit::Done)
        }
        None => {
            message::tell("the probe did not touch");
            Ok(Exit::Stopped)
        }
    }
}

/// Sets an input of a simulated machine.
///
/// # Errors
/// No pipeline, or no such input.
pub fn input(arguments: &InputArguments) -> Result<Exit, Failure> {
    let instance = Instance::new(&arguments.instance.instance).map_err(Failure::bad_input)?;
    let is_active = arguments.level == InputLevel::On;
    let request = Request::Input { name: arguments.name.clone(), is_active };
    send_checked(&request, &instance, ANSWER_PATIENCE)?;
    say!("{} is {}", arguments.name, if is_active { "active" } else { "not active" });
    Ok(Exit::Done)
}

fn operate(verb: Verb, axes: Vec<String>, [value, second]: [f64; 2]) -> Request {
    Request::Operate { verb, axes, value, second }
}

/// Asks, and waits while the machine is in the state called `during`: the last status.
fn carry_out(
    request: &Request,
    arguments: &InstanceArguments,
    during: &str,
) -> Result<(Exit, Value), Failure> {
    let exit = ask(request, arguments)?;
    if exit != Exit::Done {
        return Ok((exit, json!({})));
    }
    let instance = Instance::new(&arguments.instance).map_err(Failure::bad_input)?;
    signal::install().map_err(Failure::service)?;
    let mut told_to_stop = false;
    loop {
        std::thread::sleep(POLL_INTERVAL);
        if signal::termination().is_some() && !told_to_stop {
            told_to_stop = true;
            ask(&Request::Verb { verb: Verb::Stop, value: 0.0 }, arguments)?;
        }
        let status = send_checked(&Request::Status, &instance, ANSWER_PATIENCE)?;
        let state = status["state"].as_str().unwrap_or_default();
        if state == during || state == "stopping" || told_to_stop && state == "jogging" {
            continue;
        }
        let fault = status["fault"].as_str();
        if let Some(fault) = fault {
            message::tell(&format!("fault: {fault}"));
        } else if told_to_stop {
            message::tell("stopped");
        }
        let exit = match fault {
            Some(_) => Exit::Fault,
            None if told_to_stop || state != "idle" => Exit::Stopped,
            None => Exit::Done,
        };
        return Ok((exit, status));
    }
}

fn read<K: quantity::Kind>(name: &str, text: &str) -> Result<f64, Failure> {
    let value = quantity::read_form::<K>(text).map(|(value, _)| value);
    value.map_err(|error| Failure::bad_input(format!("{name} {text:?}: {error}")))
}
