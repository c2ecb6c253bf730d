//! What the controller did before its first job, kept until the recording of that begins: a replay begins with a new
//! controller, and brings it to where the job begins with this.

use super::supply::Supply;
use super::{CycleRecord, Recorder};
use messages::{Command, Feedback, Setpoint};

/// Bytes that are kept at most: some minutes at 1 kHz.
const MOST: usize = 32 << 20;

/// Cycles as messages, each with its deadline [ns].
pub type Messages = Vec<(i64, Vec<u8>)>;

/// With what a recording goes on.
#[derive(Debug, Default)]
pub struct Beginning {
    /// Pairs samples; it may have some that wait.
    pub recorder: Recorder,
    /// Setpoints that wait for their cycle.
    pub supply: Supply,
    /// All cycles since the controller began; none where not all of them are known, or they are too many.
    pub messages: Messages,
}

/// Pairs samples while no job is recorded.
#[derive(Debug, Default)]
pub struct Lead {
    recorder: Recorder,
    supply: Supply,
    /// `None` unless all cycles since the controller began are there.
    messages: Option<Messages>,
    size: usize,
    /// Answers of the controller so far.
    number: u64,
}

impl Lead {
    /// Takes what arrived.
    pub fn take(&mut self, feedbacks: &[Feedback], commands: &[Command], setpoints: &[Setpoint]) {
        setpoints.iter().for_each(|setpoint| self.supply.push(setpoint));
        commands.iter().for_each(|command| self.recorder.command(command));
        feedbacks.iter().for_each(|feedback| self.recorder.feedback(feedback));
        for record in self.recorder.take() {
            let setpoints = self.supply.take(&record.command.given);
            self.keep(&record, &setpoints);
        }
    }

    fn keep(&mut self, record: &CycleRecord, setpoints: &[Setpoint]) {
        if record.is_answered() {
            match record.command.number {
                1 => (self.messages, self.size) = (Some(Messages::new()), 0),
                number if number != self.number + 1 => self.messages = None,
                _ => {}
            }
            self.number = record.command.number;
        }
        let Some(messages) = &mut self.messages else { return };
        let mut message = Vec::new();
        record.put(setpoints, &mut message);
        self.size += message.len();
        if self.size > MOST {
            self.messages = None;
        } else {
            messages.push((record.origin().deadline, message));
        }
    }

    /// Hands over to the recording of a job. What is played after that is in the recording, and leads to no other one.
    pub fn hand_over(&mut self) -> Beginning {
        let beginning = Beginning {
            recorder: self.recorder.begun_anew(),
            supply: self.supply.clone(),
            messages: self.messages.take().unwrap_or_default(),
        };
        self.size = 0;
        beginning
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::{Cycle, Nanoseconds};

    /// Cycles `from..to`, of a controller that began with cycle `began`.
    fn take(lead: &mut Lead, from: u64, to: u64, began: u64) {
        for number in from..to {
            let cycle = Cycle(number);
            let feedback =
                Feedback { cycle, deadline: Nanoseconds(number as i64), ..Feedback::default() };
            let number = number + 1 - began;
            let command = Command { cycle, number, mode: 4, ..Command::default() };
            lead.take(&[feedback], &[command], &[]);
        }
    }

    fn deadlines(lead: &mut Lead) -> Option<(i64, i64)> {
        let messages = lead.hand_over().messages;
        Some((messages.first()?.0, messages.last()?.0))
    }

    #[test]
    fn it_is_all_since_the_controller_began_or_nothing() {
        let mut lead = Lead::default();
        take(&mut lead, 5, 40, 5);
        assert_eq!(deadlines(&mut lead), Some((5, 39)));
        take(&mut lead, 40, 60, 5);
        assert_eq!(deadlines(&mut lead), None, "the job before is in another recording");
        take(&mut lead, 60, 80, 60);
        assert_eq!(deadlines(&mut lead), Some((60, 79)), "another controller");
        take(&mut lead, 80, 90, 80);
        take(&mut lead, 91, 95, 80);
        assert_eq!(deadlines(&mut lead), None, "a cycle is missing");
        let mut late = Lead::default();
        take(&mut late, 8, 90, 5);
        assert_eq!(deadlines(&mut late), None, "it had begun");
    }
}
