//! What happened, in words: the newest of it is kept for pages that come later.

use schemars::JsonSchema;
use serde::Serialize;
use std::collections::VecDeque;
use std::time::{SystemTime, UNIX_EPOCH};

/// Events that are kept.
const KEPT: usize = 200;

/// How much an event matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// To know.
    Info,
    /// To look at.
    Warning,
    /// It stopped the machine.
    Fault,
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Event {
    /// How much it matters.
    pub level: Level,
    /// What happened.
    pub text: String,
    /// What to do about it; null where there is nothing to say.
    pub advice: Option<String>,
    /// When, in milliseconds since 1970.
    pub time: u64,
}

/// The newest events, each with its number.
#[derive(Debug, Default)]
pub struct Events {
    newest: VecDeque<Event>,
    /// Number of the next one.
    next: u64,
}

impl Events {
    /// Adds one that happens now.
    pub fn add(&mut self, level: Level, text: impl Into<String>, advice: Option<String>) {
        if self.newest.len() == KEPT {
            self.newest.pop_front();
        }
        self.newest.push_back(Event { level, text: text.into(), advice, time: milliseconds() });
        self.next += 1;
    }

    /// The number that the next event gets.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// The number of the oldest that is kept.
    pub fn oldest(&self) -> u64 {
        self.next - self.newest.len() as u64
    }

    /// Those from number `from` on that are kept.
    pub fn from(&self, from: u64) -> Vec<Event> {
        self.newest.iter().skip(from.saturating_sub(self.oldest()) as usize).cloned().collect()
    }
}

/// Milliseconds since 1970.
pub fn milliseconds() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_events_are_kept_and_read_on_from_a_number() {
        let mut events = Events::default();
        (0..KEPT + 5).for_each(|number| events.add(Level::Info, number.to_string(), None));
        assert_eq!((events.oldest(), events.next()), (5, KEPT as u64 + 5));
        let texts: Vec<_> =
            events.from(KEPT as u64 + 3).into_iter().map(|event| event.text).collect();
        assert_eq!(texts, [(KEPT + 3).to_string(), (KEPT + 4).to_string()]);
        assert_eq!(events.from(0).len(), KEPT);
    }
}
