//! A record as a message, and back.

use super::CycleRecord;
use super::message::{Message as _, Origin, is_zero};
use super::wire::{self, Malformed};
use messages::{Command, Cycle, Feedback, Nanoseconds, Sample as _, Setpoint};

const CYCLE: u32 = 1;
const EPOCH: u32 = 2;
const FEEDBACK: u32 = 3;
const COMMAND: u32 = 4;
const SETPOINT: u32 = 5;

impl CycleRecord {
    /// What its messages are told against.
    pub fn origin(&self) -> Origin {
        let Feedback { epoch, cycle: Cycle(cycle), deadline: Nanoseconds(deadline), .. } =
            self.feedback;
        Origin { epoch, cycle, deadline }
    }

    /// Appends it as a message whose log time is the deadline, with the setpoints that the controller took in it.
    pub fn put(&self, setpoints: &[Setpoint], out: &mut Vec<u8>) {
        let origin = self.origin();
        wire::put_number(CYCLE, origin.cycle, out);
        wire::put_number(EPOCH, origin.epoch, out);
        wire::put_message(FEEDBACK, out, |out| self.feedback.put(&origin, out));
        if !is_zero(&self.command) {
            wire::put_message(COMMAND, out, |out| self.command.put(&origin, out));
        }
        for setpoint in setpoints {
            wire::put_message(SETPOINT, out, |out| setpoint.put(&origin, out));
        }
    }

    /// Reads it from a message with this log time.
    ///
    /// # Errors
    /// Bytes that are no record.
    pub fn take(bytes: &[u8], log_time: u64) -> Result<Self, Malformed> {
        let mut origin = Origin { deadline: log_time.cast_signed(), ..Origin::default() };
        let (mut feedback, mut command) = (None, None);
        for field in wire::fields(bytes) {
            match field? {
                (CYCLE, wire) => origin.cycle = wire.number()?,
                (EPOCH, wire) => origin.epoch = wire.number()?,
                (FEEDBACK, wire) => feedback = Some(wire.bytes()?),
                (COMMAND, wire) => command = Some(wire.bytes()?),
                _ => {}
            }
        }
        let feedback = Feedback::read(feedback.ok_or(Malformed)?, &origin)?;
        let command = command.map(|bytes| Command::read(bytes, &origin)).transpose()?;
        Ok(Self { feedback, command: command.unwrap_or_else(Command::zeroed) })
    }

    /// The setpoints that the controller took in it, in a message of which it was read.
    ///
    /// # Errors
    /// Bytes that are no record.
    pub fn take_setpoints(&self, bytes: &[u8]) -> Result<Vec<Setpoint>, Malformed> {
        let origin = self.origin();
        let mut setpoints = Vec::new();
        for field in wire::fields(bytes) {
            if let (SETPOINT, wire) = field? {
                setpoints.push(Setpoint::read(wire.bytes()?, &origin)?);
            }
        }
        Ok(setpoints)
    }
}
