//! What happens in a run: the changes from one record to the next that people ask for first.

use super::CycleRecord;
use super::continuity::{Stamp, Succession};
use super::wire::{self, Malformed};
use messages::{ControllerState, FaultCode};

const CYCLE: u32 = 1;
const KIND: u32 = 2;
const TEXT: u32 = 3;
const VALUE: u32 = 4;

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// The cycle in which it was told.
    pub cycle: u64,
    /// The kind, a word for programs.
    pub kind: String,
    /// What happened, in words.
    pub text: String,
    /// Its number: state, fault code, stream, stroke, bits, or cycles missing.
    pub value: i64,
}

impl Event {
    /// Appends it as a message.
    pub fn put(&self, out: &mut Vec<u8>) {
        wire::put_number(CYCLE, self.cycle, out);
        wire::put_bytes(KIND, self.kind.as_bytes(), out);
        wire::put_bytes(TEXT, self.text.as_bytes(), out);
        wire::put_signed(VALUE, self.value, out);
    }

    /// Reads it from a message.
    ///
    /// # Errors
    /// Bytes that are no event.
    pub fn take(bytes: &[u8]) -> Result<Self, Malformed> {
        let mut event = Self { cycle: 0, kind: String::new(), text: String::new(), value: 0 };
        for field in wire::fields(bytes) {
            match field? {
                (CYCLE, wire) => event.cycle = wire.number()?,
                (KIND, wire) => event.kind = wire.text()?.to_owned(),
                (TEXT, wire) => event.text = wire.text()?.to_owned(),
                (VALUE, wire) => event.value = wire.signed()?,
                _ => {}
            }
        }
        Ok(event)
    }
}

/// Finds events in records that come in order.
#[derive(Debug, Default)]
pub struct EventFinder {
    before: Option<CycleRecord>,
    /// The newest answered one.
    answered: Option<CycleRecord>,
}

impl EventFinder {
    /// Takes the next record, and tells what is new in it.
    pub fn push(&mut self, record: &CycleRecord) -> Vec<Event> {
        let mut events = Vec::new();
        let cycle = record.feedback.cycle.0;
        let mut tell = |kind: &str, text: String, value: i64| {
            events.push(Event { cycle, kind: kind.to_owned(), text, value });
        };
        if let Some(before) = self.before.replace(*record) {
            let (before, now) = (&before.feedback, &record.feedback);
            match Succession::between(Stamp::of(before), Stamp::of(now)) {
                Succession::Next => {}
                Succession::After(gap) => {
                    let text = format!("cycles {} to {} were not recorded", gap.first, gap.last);
                    tell("gap", text, gap.cycles().cast_signed());
                }
                Succession::Apart => tell("gap", "drives was started again".to_owned(), 0),
            }
            if now.fault.code != before.fault.code && now.fault.is_some() {
                let code = now.fault.code();
                tell("drives_fault", code.name().to_owned(), i64::from(code as u32));
            }
            if now.inputs != before.inputs {
                let (was, is) = (before.inputs, now.inputs);
                tell("inputs", format!("inputs {was:b} became {is:b}"), is.cast_signed());
            }
        }
        if record.is_answered() {
            let before = self.answered.replace(*record).map(|record| record.command);
            let now = &record.command;
            let changed =
                |differs: &dyn Fn(&messages::Command) -> bool| before.as_ref().is_none_or(differs);
            if changed(&|before| before.state != now.state) {
                tell("state", ControllerState::name(now.state()).to_owned(), i64::from(now.state));
            }
            if changed(&|before| before.stream != now.stream) && now.stream != 0 {
                tell("stream", format!("stream {}", now.stream), now.stream.cast_signed());
            }
            if changed(&|before| before.stroke != now.stroke) && now.stroke != 0 {
                tell("stroke", format!("stroke {}", now.stroke), now.stroke.cast_signed());
            }
            if changed(&|before| before.outputs != now.outputs) {
                let text = format!("outputs {:b}", now.outputs);
                tell("outputs", text, now.outputs.cast_signed());
            }
            if changed(&|before| before.fault.code != now.fault.code) && now.fault.is_some() {
                let code: FaultCode = now.fault.code();
                tell("fault", code.name().to_owned(), i64::from(code as u32));
            }
        }
        events
    }
}
