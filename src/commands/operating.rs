//! Operating a machine by hand: home, jog, probe, test pulse, and the inputs of a simulated machine.

use super::motion::{Motion, nearest_limit, operate, place, places};
use super::operator::{connect, send_checked};
use crate::arguments::{
    HomeArguments, InputArguments, InputLevel, InstanceArguments, JogArguments, OutputArguments,
    ProbeArguments, TestPulseArguments,
};
use crate::exit::{Exit, Failure};
use crate::output::{self, say};
use machine::quantity::{self, Kind, Travel, TravelSpeed};
use operator::{Request, Verb};
use runtime::message;
use runtime::socket::ANSWER_PATIENCE;
use std::time::Duration;

/// How often a jog is asked for anew: several times within any dead man's time.
const JOG_INTERVAL: Duration = Duration::from_millis(20);

/// Finds the references of axes, and waits until they are at home.
///
/// # Errors
/// No pipeline.
pub fn home(arguments: &HomeArguments) -> Result<Exit, Failure> {
    let request = operate(Verb::Home, &arguments.axes, [0.0; 2], None);
    let mut motion = match Motion::begin(&request, &arguments.instance)? {
        Ok(motion) => motion,
        Err(exit) => return Ok(exit),
    };
    let reply = motion.end()?;
    let done = format!("homed; {}", places(&reply.axes, &arguments.axes));
    motion.tell(&reply, &done)
}

/// Moves an axis by a distance, or until Ctrl-C.
///
/// # Errors
/// No pipeline; a quantity that is none.
pub fn jog(arguments: &JogArguments) -> Result<Exit, Failure> {
    let (speed, unit) = read::<TravelSpeed>("speed", &arguments.speed)?;
    let axes = [arguments.axis.clone()];
    let Some(distance) = &arguments.distance else {
        return jog_on(&axes, speed, unit, &arguments.instance);
    };
    let (distance, of_distance) = read::<Travel>("distance", distance)?;
    same_unit(of_distance, unit)?;
    let request = operate(Verb::Step, &axes, [distance, speed.abs()], Some(unit));
    let mut motion = match Motion::begin(&request, &arguments.instance)? {
        Ok(motion) => motion,
        Err(exit) => return Ok(exit),
    };
    let reply = motion.end()?;
    motion.tell(&reply, &places(&reply.axes, &axes))
}

/// Asks for the motion again and again until a signal comes. Whatever ends this process ends the motion too.
fn jog_on(
    axes: &[String; 1],
    speed: f64,
    unit: &str,
    arguments: &InstanceArguments,
) -> Result<Exit, Failure> {
    let request = operate(Verb::Jog, axes, [speed, 0.0], Some(unit));
    let mut motion = match Motion::begin(&request, arguments)? {
        Ok(motion) => motion,
        Err(exit) => return Ok(exit),
    };
    if !arguments.json {
        say!("{} moves; Ctrl-C stops it", axes[0]);
    }
    let go_on = operate(Verb::JogOn, axes, [f64::from(motion.number), 0.0], None);
    let mut goes_on = true;
    while goes_on && !motion.heed_signal() {
        std::thread::sleep(JOG_INTERVAL);
        goes_on = motion.ask(&go_on)?;
    }
    if goes_on {
        motion.ask(&operate(Verb::Jog, axes, [0.0; 2], None))?;
    }
    let reply = motion.end()?;
    let axis = reply.axes.get(&axes[0]);
    match (reply.end.as_deref(), axis.and_then(|axis| Some((axis, nearest_limit(axis)?)))) {
        (Some("soft_limit"), Some((axis, limit))) => {
            if arguments.json {
                output::json(&reply)?;
            } else {
                let limit = place(limit, &axis.unit);
                say!("{}: its soft limit is {limit}", places(&reply.axes, axes));
            }
            Ok(Exit::Done)
        }
        _ => motion.tell(&reply, &places(&reply.axes, axes)),
    }
}

/// Lights the laser for a moment.
///
/// # Errors
/// No pipeline; a quantity that is none.
pub fn test_pulse(arguments: &TestPulseArguments) -> Result<Exit, Failure> {
    let power = quantity::read_share(&arguments.power)
        .map_err(|error| Failure::bad_input(format!("power {:?}: {error}", arguments.power)))?;
    let (time, _) = read::<quantity::Duration>("time", &arguments.time)?;
    let request = operate(Verb::TestPulse, &[], [power, time], None);
    let mut motion = match Motion::begin(&request, &arguments.instance)? {
        Ok(motion) => motion,
        Err(exit) => return Ok(exit),
    };
    let reply = motion.end()?;
    motion.tell(&reply, &format!("lit for {} ms at {} %", time * 1e3, power * 100.0))
}

/// Moves an axis until the probe touches, and says where.
///
/// # Errors
/// No pipeline; a quantity that is none.
pub fn probe(arguments: &ProbeArguments) -> Result<Exit, Failure> {
    let (distance, unit) = read::<Travel>("distance", &arguments.distance)?;
    let (speed, of_speed) = read::<TravelSpeed>("speed", &arguments.speed)?;
    same_unit(unit, of_speed)?;
    let axes = [arguments.axis.clone()];
    let request = operate(Verb::Probe, &axes, [distance, speed.abs()], Some(unit));
    let mut motion = match Motion::begin(&request, &arguments.instance)? {
        Ok(motion) => motion,
        Err(exit) => return Ok(exit),
    };
    let mut reply = motion.end()?;
    reply.probed = if reply.end.as_deref() == Some("reached") { motion.probed()? } else { None };
    let touched = reply.probed.as_ref().map(|it| place(it.position, &it.unit));
    let places = places(&reply.axes, &axes);
    motion.tell(&reply, &format!("touched at {}; {places}", touched.unwrap_or_default()))
}

/// Sets an input of a simulated machine.
///
/// # Errors
/// No pipeline.
pub fn input(arguments: &InputArguments) -> Result<Exit, Failure> {
    let is_active = arguments.level == InputLevel::On;
    let request = Request::Input { name: arguments.name.clone(), is_active };
    let done = format!("{} is {}", arguments.name, if is_active { "active" } else { "not active" });
    switch(&request, &arguments.instance, &done)
}

/// Switches an output.
///
/// # Errors
/// No pipeline.
pub fn output(arguments: &OutputArguments) -> Result<Exit, Failure> {
    let is_on = arguments.level == InputLevel::On;
    let request = Request::Output { name: arguments.name.clone(), is_on };
    let done = format!("{} is {}", arguments.name, if is_on { "on" } else { "off" });
    switch(&request, &arguments.instance, &done)
}

fn switch(request: &Request, arguments: &InstanceArguments, done: &str) -> Result<Exit, Failure> {
    let reply = send_checked(request, &mut connect(arguments)?, ANSWER_PATIENCE)?;
    if arguments.json {
        output::json(&reply)?;
    }
    if reply["accepted"].as_bool() != Some(true) {
        message::tell(&format!("refused: {}", reply["refusal"].as_str().unwrap_or_default()));
        return Ok(Exit::Stopped);
    }
    if !arguments.json {
        say!("{done}");
    }
    Ok(Exit::Done)
}

/// The value of a quantity, SI, and the unit that an axis has which it is meant for.
fn read<K: Kind>(name: &str, text: &str) -> Result<(f64, &'static str), Failure> {
    let read = quantity::read_form::<K>(text);
    let (value, form) =
        read.map_err(|error| Failure::bad_input(format!("{name} {text:?}: {error}")))?;
    Ok((value, if form == 0 { "m" } else { "rad" }))
}

/// Refuses a distance and a speed of which one is a length's and the other an angle's.
fn same_unit(distance: &str, speed: &str) -> Result<(), Failure> {
    if distance == speed {
        return Ok(());
    }
    Err(Failure::bad_input(
        "distance and speed do not fit: write \"10 mm\" and \"20 mm/s\", or \"10 deg\" and \"20 deg/s\"",
    ))
}
