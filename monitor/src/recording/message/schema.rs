//! The schema of the messages: a `FileDescriptorSet` of protobuf, with the meaning and the unit of each
//! field as its comment.

use super::{FieldDescription, Message as _, Shape};
use crate::recording::wire::{put_bytes, put_message, put_number};
use messages::{Command, Fault, Feedback, Given, LaserCycle, OperatorRequest, Setpoint};

/// The package of the messages.
pub const PACKAGE: &str = "graver";

/// A record: what stands in the channel of cycles.
pub const CYCLE: &str = "Cycle";

/// What stands in the channel of events.
pub const EVENT: &str = "Event";

/// Every message with its fields.
fn described() -> Vec<(&'static str, Vec<FieldDescription>)> {
    let field = |(number, name, shape, meaning)| FieldDescription { number, name, shape, meaning };
    let cycle = [
        (
            1,
            "cycle",
            Shape::Number,
            "number of the cycle; the log time is its deadline [ns, monotonic]",
        ),
        (2, "epoch", Shape::Number, "run of drives: its start on the monotonic clock [ns]"),
        (3, "feedback", Shape::Message(Feedback::TITLE), "what drives measured at the deadline"),
        (
            4,
            "command",
            Shape::Message(Command::TITLE),
            "what the controller answered; absent without an answer",
        ),
        (
            5,
            "setpoint",
            Shape::Messages(Setpoint::TITLE),
            "setpoints that the controller took for its answer",
        ),
    ];
    let event = [
        (1, "cycle", Shape::Number, "cycle in which it was told"),
        (
            2,
            "kind",
            Shape::Text,
            "state, fault, drives_fault, stream, stroke, inputs, outputs or gap",
        ),
        (3, "text", Shape::Text, "what happened"),
        (
            4,
            "value",
            Shape::Signed,
            "its number: state, fault code, stream, stroke, bits, or cycles missing",
        ),
    ];
    vec![
        (CYCLE, cycle.map(field).into()),
        (EVENT, event.map(field).into()),
        (Feedback::TITLE, Feedback::description()),
        (Command::TITLE, Command::description()),
        (Given::TITLE, Given::description()),
        (LaserCycle::TITLE, LaserCycle::description()),
        (Fault::TITLE, Fault::description()),
        (Setpoint::TITLE, Setpoint::description()),
        (OperatorRequest::TITLE, OperatorRequest::description()),
    ]
}

// descriptor.proto: the numbers of fields and types that are needed here.
const FILE: u32 = 1;
const FILE_NAME: u32 = 1;
const FILE_PACKAGE: u32 = 2;
const FILE_MESSAGE: u32 = 4;
const FILE_SOURCE: u32 = 9;
const FILE_SYNTAX: u32 = 12;
const MESSAGE_NAME: u32 = 1;
const MESSAGE_FIELD: u32 = 2;
const FIELD_NAME: u32 = 1;
const FIELD_NUMBER: u32 = 3;
const FIELD_LABEL: u32 = 4;
const FIELD_TYPE: u32 = 5;
const FIELD_TYPE_NAME: u32 = 6;
const LOCATION: u32 = 1;
const LOCATION_PATH: u32 = 1;
const LOCATION_SPAN: u32 = 2;
const LOCATION_COMMENT: u32 = 3;

/// Label and type of a field.
fn label_and_type(shape: Shape) -> (u64, u64) {
    const ONE: u64 = 1;
    const LIST: u64 = 3;
    const DOUBLE: u64 = 1;
    const UINT64: u64 = 4;
    const STRING: u64 = 9;
    const MESSAGE: u64 = 11;
    const SINT64: u64 = 18;
    match shape {
        Shape::Number => (ONE, UINT64),
        Shape::Signed => (ONE, SINT64),
        Shape::Double => (ONE, DOUBLE),
        Shape::Doubles => (LIST, DOUBLE),
        Shape::Signeds => (LIST, SINT64),
        Shape::Text => (ONE, STRING),
        Shape::Message(_) => (ONE, MESSAGE),
        Shape::Messages(_) => (LIST, MESSAGE),
    }
}

/// The schema as it stands in a recording.
pub fn descriptor_set() -> Vec<u8> {
    let described = described();
    let mut out = Vec::new();
    put_message(FILE, &mut out, |out| {
        put_bytes(FILE_NAME, b"graver.proto", out);
        put_bytes(FILE_PACKAGE, PACKAGE.as_bytes(), out);
        for (name, fields) in &described {
            put_message(FILE_MESSAGE, out, |out| {
                put_bytes(MESSAGE_NAME, name.as_bytes(), out);
                fields.iter().for_each(|field| put_field(field, out));
            });
        }
        put_message(FILE_SOURCE, out, |out| put_comments(&described, out));
        put_bytes(FILE_SYNTAX, b"proto3", out);
    });
    out
}

fn put_field(field: &FieldDescription, out: &mut Vec<u8>) {
    let (label, kind) = label_and_type(field.shape);
    put_message(MESSAGE_FIELD, out, |out| {
        put_bytes(FIELD_NAME, field.name.as_bytes(), out);
        put_number(FIELD_NUMBER, u64::from(field.number), out);
        put_number(FIELD_LABEL, label, out);
        put_number(FIELD_TYPE, kind, out);
        if let Shape::Message(name) | Shape::Messages(name) = field.shape {
            put_bytes(FIELD_TYPE_NAME, format!(".{PACKAGE}.{name}").as_bytes(), out);
        }
    });
}

/// The meaning of every field, at the place of the field in the file.
fn put_comments(described: &[(&'static str, Vec<FieldDescription>)], out: &mut Vec<u8>) {
    for (message, (_, fields)) in (0_u8..).zip(described) {
        for (index, field) in (0_u8..).zip(fields) {
            put_message(LOCATION, out, |out| {
                // All of these are below 128, and so stand for themselves in a list of numbers.
                let path = [FILE_MESSAGE as u8, message, MESSAGE_FIELD as u8, index];
                put_bytes(LOCATION_PATH, &path, out);
                put_bytes(LOCATION_SPAN, &[0, 0, 0], out);
                put_bytes(LOCATION_COMMENT, field.meaning.as_bytes(), out);
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_field_shares_a_name_or_a_number_and_each_says_what_it_means() {
        for (message, fields) in described() {
            let names: BTreeSet<_> = fields.iter().map(|field| field.name).collect();
            let numbers: BTreeSet<_> = fields.iter().map(|field| field.number).collect();
            assert_eq!((names.len(), numbers.len()), (fields.len(), fields.len()), "{message}");
            assert!(fields.iter().all(|field| field.meaning.len() > 5), "{message}");
            assert!(fields.len() < 128, "{message}");
        }
    }
}
