//! What keys do.

use operator::{Request, Verb};
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

/// What a key asks for.
#[derive(Debug)]
pub(super) enum Action {
    /// To leave the view; the machine goes on.
    Leave,
    /// To show or hide the help.
    Help,
    /// Something of the machine.
    Ask(Request),
}

/// What an override may be.
const RANGE: [f64; 2] = [0.1, 2.0];

/// A step of the override.
const STEP: f64 = 0.1;

/// The keys, as the help shows them.
pub(super) const HELP: [(&str, &str); 10] = [
    ("h space", "hold: laser off, to rest along the path"),
    ("r", "resume"),
    ("s", "stop: give the job up"),
    ("x", "reset a fault"),
    ("+ -", "override, 10 % more or less"),
    ("0", "override 100 %"),
    ("[ ]", "power of the laser, 10 % less or more, until the job ends"),
    ("?", "this help, and away with it"),
    ("q esc", "leave; the machine goes on"),
    ("ctrl-c", "leave"),
];

/// The keys in one line.
pub(super) const LINE: &str =
    "h hold  r resume  s stop  x reset  +/-/0 override  [/] power  ? help  q leave";

/// What the key does with these overrides of rate and power in force.
pub(super) fn action(key: &KeyEvent, [rate, power]: [f64; 2]) -> Option<Action> {
    let verb = |verb, value| Some(Action::Ask(Request::Verb { verb, value }));
    let control = key.modifiers.contains(KeyModifiers::CONTROL);
    let step = |of: Verb, from: f64, by: f64| {
        // In whole steps, so that an override does not drift by rounding.
        let steps = (from / STEP).round() + by;
        verb(of, (steps / STEP.recip()).clamp(RANGE[0], RANGE[1]))
    };
    match key.code {
        KeyCode::Char('c') if control => Some(Action::Leave),
        _ if control => None,
        KeyCode::Char('q') | KeyCode::Esc => Some(Action::Leave),
        KeyCode::Char('?') => Some(Action::Help),
        KeyCode::Char('h' | ' ') => verb(Verb::Hold, 0.0),
        KeyCode::Char('r') => verb(Verb::Resume, 0.0),
        KeyCode::Char('s') => verb(Verb::Stop, 0.0),
        KeyCode::Char('x') => verb(Verb::Reset, 0.0),
        KeyCode::Char('+' | '=') => step(Verb::Override, rate, 1.0),
        KeyCode::Char('-') => step(Verb::Override, rate, -1.0),
        KeyCode::Char('0') => verb(Verb::Override, 1.0),
        KeyCode::Char(']') => step(Verb::Power, power, 1.0),
        KeyCode::Char('[') => step(Verb::Power, power, -1.0),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(code: KeyCode, rate: f64) -> Option<(Verb, f64)> {
        match action(&KeyEvent::new(code, KeyModifiers::NONE), [rate, 0.8]) {
            Some(Action::Ask(Request::Verb { verb, value })) => Some((verb, value)),
            _ => None,
        }
    }

    #[test]
    fn keys_ask_for_what_their_help_says() {
        assert_eq!(asked(KeyCode::Char('h'), 1.0), Some((Verb::Hold, 0.0)));
        assert_eq!(asked(KeyCode::Char(' '), 1.0), Some((Verb::Hold, 0.0)));
        assert_eq!(asked(KeyCode::Char('r'), 1.0), Some((Verb::Resume, 0.0)));
        assert_eq!(asked(KeyCode::Char('s'), 1.0), Some((Verb::Stop, 0.0)));
        assert_eq!(asked(KeyCode::Char('x'), 1.0), Some((Verb::Reset, 0.0)));
        assert_eq!(asked(KeyCode::Char('w'), 1.0), None);
    }

    #[test]
    fn overrides_go_in_steps_within_what_is_allowed() {
        assert_eq!(asked(KeyCode::Char('+'), 1.0), Some((Verb::Override, 1.1)));
        assert_eq!(asked(KeyCode::Char('-'), 0.3), Some((Verb::Override, 0.2)));
        assert_eq!(asked(KeyCode::Char('-'), 0.1), Some((Verb::Override, 0.1)));
        assert_eq!(asked(KeyCode::Char('+'), 2.0), Some((Verb::Override, 2.0)));
        assert_eq!(asked(KeyCode::Char('0'), 0.3), Some((Verb::Override, 1.0)));
        assert_eq!(asked(KeyCode::Char(']'), 0.3), Some((Verb::Power, 0.9)));
        assert_eq!(asked(KeyCode::Char('['), 0.3), Some((Verb::Power, 0.7)));
    }

    #[test]
    fn control_c_leaves_and_asks_nothing_of_the_machine() {
        let key = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        assert!(matches!(action(&key, [1.0; 2]), Some(Action::Leave)));
        let key = KeyEvent::new(KeyCode::Char('s'), KeyModifiers::CONTROL);
        assert!(action(&key, [1.0; 2]).is_none());
        let key = KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE);
        assert!(matches!(action(&key, [1.0; 2]), Some(Action::Leave)));
    }
}
