//! Requests to a running pipeline: hold, resume, override, stop.

use super::motion;
use crate::arguments::{InstanceArguments, OverrideArguments};
use crate::exit::{Exit, Failure};
use crate::output::{self, say};
use machine::quantity;
use operator::{Client, Request, Verb};
use runtime::socket::OperatorClient;
use runtime::{Instance, message};
use serde_json::{Value, json};
use std::time::Duration;

/// Asks for a verb without argument.
///
/// # Errors
/// No pipeline, or one that refuses.
pub fn verb(verb: Verb, arguments: &InstanceArguments) -> Result<Exit, Failure> {
    if verb == Verb::Enable {
        return motion::enable(arguments);
    }
    ask(&Request::Verb { verb, value: 0.0 }, arguments)
}

/// Asks for another rate, another one of rapids, another power, or several of them.
///
/// # Errors
/// A rate or a power that is none, no pipeline, or one that refuses.
pub fn overrides(arguments: &OverrideArguments) -> Result<Exit, Failure> {
    let asked = [
        ("rate", Verb::Override, &arguments.rate, 2.0),
        ("rapid", Verb::Rapid, &arguments.rapid, 1.0),
        ("power", Verb::Power, &arguments.power, 2.0),
    ];
    // All are read before any is asked for.
    let mut requests = Vec::new();
    for (name, verb, text, most) in asked {
        let Some(text) = text else { continue };
        requests.push(Request::Verb { verb, value: read_override(name, text, most)? });
    }
    let Some((last, others)) = requests.split_last() else { return Ok(Exit::Done) };
    for request in others {
        let reply = answer(request, &arguments.instance)?;
        if reply["accepted"].as_bool() != Some(true) {
            return report(&reply, &arguments.instance);
        }
    }
    let exit = ask(last, &arguments.instance)?;
    if exit == Exit::Done && arguments.power.is_some() && !arguments.instance.json {
        say!("the power is 100 % again when the job ends");
    }
    Ok(exit)
}

fn read_override(name: &str, text: &str, most: f64) -> Result<f64, Failure> {
    let value = quantity::read_share(text)
        .map_err(|error| Failure::bad_input(format!("{name} {text:?}: {error}")))?;
    if (0.1..=most).contains(&value) {
        return Ok(value);
    }
    let [percent, most] = [value, most].map(|share| share * 100.0);
    Err(Failure::bad_input(format!("{name} {text}: {percent:.0} % is outside 10 % to {most:.0} %")))
}

fn ask(request: &Request, arguments: &InstanceArguments) -> Result<Exit, Failure> {
    report(&answer(request, arguments)?, arguments)
}

fn answer(request: &Request, arguments: &InstanceArguments) -> Result<Value, Failure> {
    let instance = Instance::new(&arguments.instance).map_err(Failure::bad_input)?;
    let reply = Client::new(instance).ask(request).map_err(Failure::service)?;
    if let Some(silent) = reply["direct"].as_str() {
        message::tell(&format!("{silent}; the controller was asked directly"));
    }
    Ok(reply)
}

fn report(reply: &Value, arguments: &InstanceArguments) -> Result<Exit, Failure> {
    if arguments.json {
        output::json(reply)?;
    }
    let state = reply["state"].as_str().unwrap_or("unknown");
    if reply["accepted"].as_bool() == Some(true) {
        if !arguments.json {
            say!("accepted; the machine was {state}");
            if let Some(caps) = reply["capped_by"].as_str() {
                say!("{caps}");
            }
        }
        Ok(Exit::Done)
    } else {
        let otherwise = format!("not possible while the machine is {state}");
        message::tell(&format!("refused: {}", reply["refusal"].as_str().unwrap_or(&otherwise)));
        Ok(Exit::Stopped)
    }
}

/// Asks, and waits for the answer at most `patience`.
pub(super) fn send_checked(
    request: &Request,
    client: &mut OperatorClient,
    patience: Duration,
) -> Result<Value, Failure> {
    checked(client.request_within(&json!(request), patience).map_err(Failure::service)?)
}

/// Speaks to the pipeline that the arguments name.
pub(super) fn connect(arguments: &InstanceArguments) -> Result<OperatorClient, Failure> {
    let instance = Instance::new(&arguments.instance).map_err(Failure::bad_input)?;
    OperatorClient::connect(&instance).map_err(Failure::service)
}

pub(super) fn checked(reply: Value) -> Result<Value, Failure> {
    if reply.is_null() {
        return Err(Failure::service("the pipeline ended before it answered"));
    }
    match reply["error"].as_str() {
        Some(error) if reply.get("outcome").is_none() => Err(Failure::service(error)),
        _ => Ok(reply),
    }
}
