//! What happened to the stream of a run: when it began, was held, resumed, ended, and what stopped it.

use crate::recording::CycleRecord;
use messages::{ControllerState, FaultCode};

/// A turn in the course of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Event {
    /// The cycle, from the first record on.
    pub cycle: u64,
    /// What happened.
    pub kind: EventKind,
}

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventKind {
    /// The controller came into this state.
    State(ControllerState),
    /// The controller or drives latched a fault.
    Fault(FaultCode),
}

impl EventKind {
    /// The event in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::State(state) => state.name(),
            Self::Fault(code) => code.name(),
        }
    }
}

/// The first events of a run.
#[derive(Debug, Clone, Default)]
pub struct Events {
    list: Vec<Event>,
    state: Option<ControllerState>,
    fault: Option<FaultCode>,
}

impl Events {
    /// The most events kept; later ones are left out.
    pub const CAPACITY: usize = 500;

    /// Takes the next record, which is of this cycle from the first record on.
    pub fn push(&mut self, cycle: u64, record: &CycleRecord) {
        let faults = [record.command.fault, record.feedback.fault];
        if let Some(fault) = faults.into_iter().find(|fault| fault.is_some())
            && self.fault.replace(fault.code()) != Some(fault.code())
        {
            self.add(Event { cycle, kind: EventKind::Fault(fault.code()) });
        }
        if record.is_answered() {
            let state = record.command.state();
            if self.state.replace(state).is_some_and(|before| before != state) {
                self.add(Event { cycle, kind: EventKind::State(state) });
            }
        }
    }

    fn add(&mut self, event: Event) {
        if self.list.len() < Self::CAPACITY {
            self.list.push(event);
        }
    }

    /// The events in their order.
    pub fn list(&self) -> &[Event] {
        &self.list
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::{Command, Cycle, Fault, Feedback};

    #[test]
    fn changes_of_the_state_and_the_first_sight_of_a_fault_are_events() {
        let mut events = Events::default();
        let states = [ControllerState::Running, ControllerState::Running, ControllerState::Holding];
        for (cycle, state) in (0..).zip(states) {
            let mut record =
                CycleRecord::unanswered(Feedback { cycle: Cycle(cycle), ..Feedback::default() });
            record.command =
                Command { cycle: Cycle(cycle), state: state as u32, stream: 1, ..record.command };
            if cycle > 0 {
                record.feedback.fault = Fault::new(FaultCode::DoorOpened);
            }
            events.push(cycle, &record);
        }
        let fault = Event { cycle: 1, kind: EventKind::Fault(FaultCode::DoorOpened) };
        let held = Event { cycle: 2, kind: EventKind::State(ControllerState::Holding) };
        assert_eq!(events.list(), [fault, held]);
    }
}
