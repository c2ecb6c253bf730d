//! Requests to a running pipeline: hold, resume, override, stop.

use super::motion;
use crate::arguments::{InstanceArguments, OverrideArguments};
use crate::exit::{Exit, Failure};
use crate::output::{self, say};
use machine::quantity;
use operator::{Request, Verb, VerbReply};
use runtime::operator::OperatorLink;
use runtime::socket::{ANSWER_PATIENCE, OperatorClient, SocketError};
use runtime::{Domain, Instance, Role, message};
use serde_json::{Value, json};
use std::time::Duration;

/// How long the supervisor may take to answer a stop or a hold, before the controller is asked past
/// it.
const URGENT_PATIENCE: Duration = Duration::from_secs(1);

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

/// Asks for another rate.
///
/// # Errors
/// A rate that is none, no pipeline, or one that refuses.
pub fn override_rate(arguments: &OverrideArguments) -> Result<Exit, Failure> {
    let value = quantity::read_share(&arguments.rate)
        .map_err(|error| Failure::bad_input(format!("rate {:?}: {error}", arguments.rate)))?;
    if !(0.1..=2.0).contains(&value) {
        return Err(Failure::bad_input(format!(
            "rate {}: {:.0} % is outside 10 % to 200 %",
            arguments.rate,
            value * 100.0
        )));
    }
    ask(&Request::Verb { verb: Verb::Override, value }, &arguments.instance)
}

fn ask(request: &Request, arguments: &InstanceArguments) -> Result<Exit, Failure> {
    let instance = Instance::new(&arguments.instance).map_err(Failure::bad_input)?;
    let reply = match send(request, &instance) {
        Err(error @ SocketError::Silent { .. }) => ask_controller(request, &instance, &error)?,
        reply => checked(reply.map_err(Failure::service)?)?,
    };
    if arguments.json {
        output::json(&reply)?;
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

/// Asks the controller directly when the supervisor does not answer: a stop or a hold must not fail
/// for want of a process that moves nothing.
fn ask_controller(
    request: &Request,
    instance: &Instance,
    silent: &SocketError,
) -> Result<Value, Failure> {
    let Request::Verb { verb: verb @ (Verb::Stop | Verb::Hold), value } = request else {
        return Err(Failure::service(silent));
    };
    let asked = || -> Result<VerbReply, String> {
        let domain = Domain::join_within(instance, Role::Observer, Duration::ZERO);
        let domain = domain.map_err(|error| error.to_string())?;
        let link = OperatorLink::start(&domain).map_err(|error| error.to_string())?;
        let reply = link.request((*verb).into(), *value).map_err(|error| error.to_string())?;
        Ok(VerbReply::from(reply))
    };
    let reply = asked().map_err(|error| {
        Failure::service(format!(
            "{silent}; the controller could not be asked directly either: {error}"
        ))
    })?;
    message::tell(&format!("{silent}; the controller was asked directly"));
    serde_json::to_value(reply).map_err(Failure::service)
}

pub(super) fn send(request: &Request, instance: &Instance) -> Result<Value, SocketError> {
    // A supervisor that lives answers a stop sooner, whatever the controller does.
    let urgent = matches!(request, Request::Verb { verb: Verb::Stop | Verb::Hold, .. });
    let patience = if urgent { URGENT_PATIENCE } else { ANSWER_PATIENCE };
    OperatorClient::connect(instance)?.request_within(&json!(request), patience)
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
