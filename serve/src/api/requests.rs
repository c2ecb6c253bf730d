//! What the machine is asked for.

use super::{ApiError, answer, ask, parse};
use crate::context::Context;
use axum::body::Bytes;
use axum::extract::{Path, State};
use axum::response::Response;
use operator::{Request, Verb};
use schemars::JsonSchema;
use serde::Deserialize;

/// What a verb is about; each takes what it needs of these.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Arguments {
    /// Axes by name: of `home` any number, of `jog`, `jog-on`, `step` and `probe` one.
    pub axes: Vec<String>,
    /// The first number: rate of `override`, power of `power` as a multiple of what the job asks for, speed of `jog` [m/s or rad/s], number of the reply to the jog that
    /// `jog-on` goes on with, way of `step` and `probe` [m or rad], power of `test-pulse` (0 to 1).
    pub value: Option<f64>,
    /// The second number: speed of `step` and `probe` [m/s or rad/s], time of `test-pulse` [s].
    pub second: Option<f64>,
    /// The unit that the axis must have: `m` or `rad`.
    pub unit: Option<String>,
    /// The name of an input or an output.
    pub name: Option<String>,
    /// Whether the output is on from now on.
    pub is_on: Option<bool>,
    /// Whether the input of a simulated machine is active from now on.
    pub is_active: Option<bool>,
}

/// What a verb needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    Plain(Verb),
    Value(Verb),
    /// Any number of axes.
    Axes(Verb),
    /// So many numbers about one axis.
    Axis(Verb, usize),
    TestPulse,
    Input,
    Output,
}

/// All verbs by name.
pub(crate) const VERBS: [(&str, Form); 17] = [
    ("enable", Form::Plain(Verb::Enable)),
    ("disable", Form::Plain(Verb::Disable)),
    ("hold", Form::Plain(Verb::Hold)),
    ("resume", Form::Plain(Verb::Resume)),
    ("stop", Form::Plain(Verb::Stop)),
    ("reset", Form::Plain(Verb::Reset)),
    ("override", Form::Value(Verb::Override)),
    ("power", Form::Value(Verb::Power)),
    ("rapid", Form::Value(Verb::Rapid)),
    ("home", Form::Axes(Verb::Home)),
    ("jog", Form::Axis(Verb::Jog, 1)),
    ("jog-on", Form::Axis(Verb::JogOn, 1)),
    ("step", Form::Axis(Verb::Step, 2)),
    ("probe", Form::Axis(Verb::Probe, 2)),
    ("test-pulse", Form::TestPulse),
    ("input", Form::Input),
    ("output", Form::Output),
];

pub(crate) async fn request(
    State(context): State<Context>,
    Path(verb): Path<String>,
    body: Bytes,
) -> Result<Response, ApiError> {
    let request = of(&verb, parse(&body)?)?;
    Ok(answer(&ask(&context, request).await?))
}

/// The request with this name and these arguments.
fn of(name: &str, arguments: Arguments) -> Result<Request, ApiError> {
    let Some((_, form)) = VERBS.iter().find(|(verb, _)| *verb == name) else {
        let known = VERBS.map(|(name, _)| name).join(", ");
        return Err(ApiError::absent(format!("there is no request {name:?}: there are {known}")));
    };
    let needs = |what: &str| ApiError::bad(format!("{name} needs `{what}`"));
    let Arguments { axes, value, second, unit, is_on, is_active, .. } = arguments;
    let operate =
        |verb, axes, value, second, unit| Request::Operate { verb, axes, value, second, unit };
    Ok(match *form {
        Form::Plain(verb) => Request::Verb { verb, value: 0.0 },
        Form::Value(verb) => Request::Verb { verb, value: value.ok_or_else(|| needs("value"))? },
        Form::Axes(verb) => operate(verb, axes, 0.0, 0.0, None),
        Form::Axis(verb, numbers) => {
            if axes.len() != 1 {
                return Err(ApiError::bad(format!(
                    "{name} needs one axis in `axes`, not {}",
                    axes.len()
                )));
            }
            let value = value.ok_or_else(|| needs("value"))?;
            let second = match numbers {
                1 => 0.0,
                _ => second.ok_or_else(|| needs("second"))?,
            };
            operate(verb, axes, value, second, unit)
        }
        Form::TestPulse => {
            let value = value.ok_or_else(|| needs("value"))?;
            operate(
                Verb::TestPulse,
                Vec::new(),
                value,
                second.ok_or_else(|| needs("second"))?,
                None,
            )
        }
        Form::Input => Request::Input {
            name: arguments.name.ok_or_else(|| needs("name"))?,
            is_active: is_active.ok_or_else(|| needs("is_active"))?,
        },
        Form::Output => Request::Output {
            name: arguments.name.ok_or_else(|| needs("name"))?,
            is_on: is_on.ok_or_else(|| needs("is_on"))?,
        },
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use serde_json::{Value, json};

    fn asked(name: &str, arguments: Value) -> Result<Value, ApiError> {
        let request = of(name, serde_json::from_value(arguments).unwrap())?;
        Ok(serde_json::to_value(request).unwrap())
    }

    #[test]
    fn every_verb_becomes_the_request_of_the_operators_socket() {
        for (name, arguments, expect) in [
            ("stop", json!({}), json!({"request": "verb", "verb": "stop", "value": 0.0})),
            (
                "override",
                json!({"value": 0.5}),
                json!({"request": "verb", "verb": "override", "value": 0.5}),
            ),
            (
                "power",
                json!({"value": 0.8}),
                json!({"request": "verb", "verb": "power", "value": 0.8}),
            ),
            (
                "step",
                json!({"axes": ["x"], "value": 0.01, "second": 0.1, "unit": "m"}),
                json!({"request": "operate", "verb": "step", "axes": ["x"], "value": 0.01, "second": 0.1, "unit": "m"}),
            ),
            (
                "test-pulse",
                json!({"value": 0.05, "second": 0.1}),
                json!({"request": "operate", "verb": "test_pulse", "axes": [], "value": 0.05, "second": 0.1, "unit": null}),
            ),
            (
                "input",
                json!({"name": "door", "is_active": true}),
                json!({"request": "input", "name": "door", "is_active": true}),
            ),
            (
                "output",
                json!({"name": "air", "is_on": false}),
                json!({"request": "output", "name": "air", "is_on": false}),
            ),
        ] {
            assert_eq!(asked(name, arguments).unwrap(), expect, "{name}");
        }
    }

    #[test]
    fn what_a_verb_lacks_is_named() {
        let all = json!({"axes": ["x"], "value": 1.0, "second": 1.0, "name": "n", "is_on": true, "is_active": true});
        for (name, _) in VERBS {
            asked(name, all.clone()).unwrap();
        }
        for (name, arguments, word) in [
            ("override", json!({}), "value"),
            ("power", json!({}), "value"),
            ("jog", json!({"value": 1.0}), "axes"),
            ("jog", json!({"axes": ["x", "y"], "value": 1.0}), "not 2"),
            ("step", json!({"axes": ["x"], "value": 1.0}), "second"),
            ("test-pulse", json!({"value": 1.0}), "second"),
            ("input", json!({"name": "door"}), "is_active"),
            ("output", json!({"is_on": true}), "name"),
            ("explode", json!({}), "enable, disable"),
        ] {
            let error = format!("{:?}", asked(name, arguments).unwrap_err());
            assert!(error.contains(word), "{name}: {error}");
        }
    }
}
