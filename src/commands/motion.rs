//! A motion by hand, from the request to the rest: how it is asked for, followed, stopped and told.

use super::operator::send_checked;
use crate::arguments::InstanceArguments;
use crate::exit::{Exit, Failure};
use crate::output::{self, say};
use operator::{AxisStatus, PastFault, Probed};
use operator::{Request, Verb};
use runtime::socket::{ANSWER_PATIENCE, OperatorClient};
use runtime::{Instance, message, signal};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::time::Duration;

/// How often the state is polled until a motion has ended.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// States in which something that a person asked for goes on.
const GOES_ON: [&str; 6] = ["enabling", "homing", "jogging", "probing", "pulsing", "stopping"];

/// How a motion by hand went, as `graver home --json` and its like print it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct MotionReply {
    /// Whether it was begun.
    pub accepted: bool,
    /// Why it was not, in words; null where it was.
    pub refusal: Option<String>,
    /// The same by name, such as `soft_limit`.
    pub code: Option<String>,
    /// How it ended: `reached`, `stopped`, `soft_limit`, `dead_man`, `door_open`, `interlock`, `not_touched`,
    /// `out_of_reach` or `fault`; null where it was not begun.
    pub end: Option<String>,
    /// The state of the machine at its end, or that the request met.
    pub state: String,
    /// The axes at its end.
    pub axes: BTreeMap<String, AxisStatus>,
    /// Where the probe touched, if that was asked for and it did.
    pub probed: Option<Probed>,
    /// The fault that ended it.
    pub fault: Option<PastFault>,
}

/// A request that was accepted.
pub(super) struct Motion<'a> {
    client: OperatorClient,
    arguments: &'a InstanceArguments,
    /// The number of the request.
    pub(super) number: u32,
    /// Signals that were heeded.
    heeded: u32,
}

impl<'a> Motion<'a> {
    /// Asks for a motion; `Err` with the exit code, and the words said, where it is refused.
    ///
    /// # Errors
    /// No pipeline.
    pub(super) fn begin(
        request: &Request,
        arguments: &'a InstanceArguments,
    ) -> Result<Result<Self, Exit>, Failure> {
        // A signal from here on ends the motion, and not this process before it.
        signal::install().map_err(Failure::service)?;
        let instance = Instance::new(&arguments.instance).map_err(Failure::bad_input)?;
        let mut client = OperatorClient::connect(&instance).map_err(Failure::service)?;
        let reply = send_checked(request, &mut client, ANSWER_PATIENCE)?;
        if reply["accepted"].as_bool() == Some(true) {
            let number = reply["number"].as_u64().and_then(|number| u32::try_from(number).ok());
            let number = number.unwrap_or_default();
            return Ok(Ok(Self { client, arguments, number, heeded: 0 }));
        }
        let text = |key: &str| reply[key].as_str().map(str::to_owned);
        let refusal = text("refusal").unwrap_or_else(|| "for a reason unknown".to_owned());
        message::tell(&format!("refused: {refusal}"));
        if arguments.json {
            output::json(&MotionReply {
                accepted: false,
                refusal: Some(refusal),
                code: text("code"),
                end: None,
                state: text("state").unwrap_or_default(),
                axes: BTreeMap::new(),
                probed: None,
                fault: None,
            })?;
        }
        Ok(Err(Exit::Stopped))
    }

    /// Asks for something more; whether it is accepted.
    ///
    /// # Errors
    /// No pipeline.
    pub(super) fn ask(&mut self, request: &Request) -> Result<bool, Failure> {
        let reply = send_checked(request, &mut self.client, ANSWER_PATIENCE)?;
        Ok(reply["accepted"].as_bool() == Some(true))
    }

    /// Whether a signal has come that was not heeded; it is from now on.
    pub(super) fn heed_signal(&mut self) -> bool {
        let signals = signal::termination().map_or(0, |termination| termination.count);
        let is_new = signals > self.heeded;
        self.heeded = signals;
        is_new
    }

    /// Waits until it has ended. A signal stops the machine.
    ///
    /// # Errors
    /// No pipeline, or one without a controller.
    pub(super) fn end(&mut self) -> Result<MotionReply, Failure> {
        loop {
            if self.heed_signal() {
                self.ask(&Request::Verb { verb: Verb::Stop, value: 0.0 })?;
            }
            let status = send_checked(&Request::Status, &mut self.client, ANSWER_PATIENCE)?;
            if status["services"]["controller"].is_null() {
                return Err(Failure::service("the controller has died: the machine is stopped"));
            }
            if has_ended(&status, self.number) {
                return Ok(reply(&status));
            }
            std::thread::sleep(POLL_INTERVAL);
        }
    }

    /// Where the probe touched last.
    ///
    /// # Errors
    /// No pipeline.
    pub(super) fn probed(&mut self) -> Result<Option<Probed>, Failure> {
        let status = send_checked(&Request::Status, &mut self.client, ANSWER_PATIENCE)?;
        Ok(serde_json::from_value(status["probed"].clone()).unwrap_or_default())
    }

    /// Says how it ended: `done` in words where it did what was asked for.
    ///
    /// # Errors
    /// Standard output that cannot be written.
    pub(super) fn tell(&self, reply: &MotionReply, done: &str) -> Result<Exit, Failure> {
        if self.arguments.json {
            output::json(reply)?;
        }
        if let Some(fault) = &reply.fault {
            message::tell(&format!("fault: {}", fault.detail));
            return Ok(Exit::Fault);
        }
        let cause = match reply.end.as_deref() {
            Some("reached") => {
                if !self.arguments.json {
                    say!("{done}");
                }
                return Ok(Exit::Done);
            }
            Some("stopped") if self.heeded > 0 => "as it was told to",
            Some("soft_limit") => "at the soft limit",
            Some("dead_man") => "because nobody asked for it any more",
            Some("door_open") => "because the door was opened",
            Some("interlock") => "because an interlock is missing",
            Some("not_touched") => "because the probe did not touch on its way",
            Some("out_of_reach") => "where the mechanism cannot go on",
            _ => "because somebody else said so",
        };
        message::tell(&format!("stopped {cause}; {}", places(&reply.axes, &[])));
        Ok(Exit::Stopped)
    }
}

/// Whether what was begun with the request of this number has ended.
fn has_ended(status: &Value, number: u32) -> bool {
    let requests = status["requests"].as_u64().and_then(|it| u32::try_from(it).ok());
    // Numbers go on from 0 after the largest.
    let is_known = requests.is_some_and(|it| it.wrapping_sub(number) < u32::MAX / 2);
    let state = status["state"].as_str().unwrap_or_default();
    is_known && !GOES_ON.contains(&state)
}

fn reply(status: &Value) -> MotionReply {
    let text = |key: &str| status[key].as_str().map(str::to_owned);
    let take = |key: &str| status[key].clone();
    let faults = serde_json::from_value::<Vec<PastFault>>(take("faults")).unwrap_or_default();
    let code = text("fault");
    // Told before it was remembered: then its name is all that is known.
    let fault = code.map(|code| {
        let known = faults.into_iter().rev().find(|fault| fault.code == code);
        known.unwrap_or_else(|| PastFault { time: 0, detail: code.clone(), code, job: None })
    });
    MotionReply {
        accepted: true,
        refusal: None,
        code: None,
        end: if fault.is_some() { Some("fault".to_owned()) } else { text("motion_end") },
        state: text("state").unwrap_or_default(),
        axes: serde_json::from_value(take("axes")).unwrap_or_default(),
        probed: None,
        fault,
    }
}

/// Where the axes are, all for no names.
pub(super) fn places(axes: &BTreeMap<String, AxisStatus>, names: &[String]) -> String {
    let meant = axes.iter().filter(|(name, _)| names.is_empty() || names.contains(name));
    let places = meant.map(|(name, axis)| {
        let doubt = if axis.homed { "" } else { " (not homed)" };
        format!("{name} at {}{doubt}", place(axis.position, &axis.unit))
    });
    places.collect::<Vec<_>>().join(", ")
}

/// A place of a joint, in the units that people write.
pub(super) fn place(position: f64, unit: &str) -> String {
    // No minus before a zero.
    let rounded = |value: f64, digits: f64| (value * digits).round() / digits + 0.0;
    match unit {
        "rad" => format!("{:.4} deg", rounded(position.to_degrees(), 1e4)),
        _ => format!("{:.3} mm", rounded(position * 1e3, 1e3)),
    }
}

/// The request for `verb` about axes with two numbers, in `unit` where they have one.
pub(super) fn operate(
    verb: Verb,
    axes: &[String],
    [value, second]: [f64; 2],
    unit: Option<&str>,
) -> Request {
    let unit = unit.map(str::to_owned);
    Request::Operate { verb, axes: axes.to_vec(), value, second, unit }
}

/// The soft limit of an axis that is nearest to where it is.
pub(super) fn nearest_limit(axis: &AxisStatus) -> Option<f64> {
    let limits = axis.limits.into_iter().flatten();
    limits
        .min_by(|one, other| (one - axis.position).abs().total_cmp(&(other - axis.position).abs()))
}

/// Waits until the motors are on, and says so, or why they are not.
///
/// # Errors
/// No pipeline.
pub(super) fn enable(arguments: &InstanceArguments) -> Result<Exit, Failure> {
    let request = Request::Verb { verb: Verb::Enable, value: 0.0 };
    let mut motion = match Motion::begin(&request, arguments)? {
        Ok(motion) => motion,
        Err(exit) => return Ok(exit),
    };
    let reply = motion.end()?;
    let is_on = reply.state == "idle";
    let end = Some(if is_on { "reached" } else { "stopped" }.to_owned());
    let reply = MotionReply { end: if reply.fault.is_some() { reply.end } else { end }, ..reply };
    motion.tell(&reply, &format!("enabled; {}", places(&reply.axes, &[])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_motion_has_ended_only_when_its_request_shows_and_nothing_goes_on() {
        let status = |requests: u32, state: &str| json!({ "requests": requests, "state": state });
        assert!(has_ended(&status(7, "idle"), 7));
        assert!(has_ended(&status(9, "faulted"), 7));
        assert!(!has_ended(&status(6, "idle"), 7), "of before it");
        assert!(!has_ended(&status(7, "homing"), 7));
        assert!(has_ended(&status(0, "idle"), u32::MAX), "numbers begin anew");
        assert!(!has_ended(&json!({}), 0));
    }

    #[test]
    fn places_are_told_in_the_units_that_people_write() {
        assert_eq!(place(0.1234567, "m"), "123.457 mm");
        assert_eq!(place(core::f64::consts::FRAC_PI_2, "rad"), "90.0000 deg");
        assert_eq!(place(-1e-9, "m"), "0.000 mm");
    }
}
