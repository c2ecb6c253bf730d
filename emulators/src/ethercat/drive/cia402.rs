//! The state machine of a drive (CiA 402-2, IEC 61800-7-201): control word in, status word out.

/// A drive's state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum State {
    /// Nothing may be powered.
    #[default]
    SwitchOnDisabled,
    /// It may be switched on.
    ReadyToSwitchOn,
    /// It is, without torque.
    SwitchedOn,
    /// It follows its targets.
    OperationEnabled,
    /// It comes to rest.
    QuickStopActive,
    /// It comes to rest because of a fault.
    FaultReactionActive,
    /// It has a fault and no power.
    Fault,
}

/// What a control word asks for (bits 0 to 3, and the rise of bit 7).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Request {
    Shutdown,
    SwitchOn,
    Enable,
    DisableVoltage,
    QuickStop,
}

impl Request {
    fn of(word: u16) -> Self {
        match word & 0x0F {
            low if low & 0x02 == 0 => Self::DisableVoltage,
            low if low & 0x04 == 0 => Self::QuickStop,
            low if low & 0x01 == 0 => Self::Shutdown,
            low if low & 0x08 == 0 => Self::SwitchOn,
            _ => Self::Enable,
        }
    }
}

/// The state machine with the control word before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Machine {
    state: State,
    word: u16,
}

impl Machine {
    /// The state.
    pub fn state(&self) -> State {
        self.state
    }

    /// Takes a control word; `stays` tells whether a quick stop, once at rest, stays in its state and can be
    /// left to be enabled again.
    pub fn control(&mut self, word: u16, stays: bool) {
        let reset = word & !self.word & 0x80 != 0;
        self.word = word;
        let request = Request::of(word);
        use Request::{DisableVoltage, Enable, QuickStop, Shutdown, SwitchOn};
        use State::{
            Fault, OperationEnabled, QuickStopActive, ReadyToSwitchOn, SwitchOnDisabled, SwitchedOn,
        };
        self.state = match (self.state, request) {
            (Fault, _) if reset => SwitchOnDisabled,
            (Fault | State::FaultReactionActive, _) => self.state,
            (_, DisableVoltage) => SwitchOnDisabled,
            (OperationEnabled, QuickStop) => QuickStopActive,
            (ReadyToSwitchOn | SwitchedOn, QuickStop) => SwitchOnDisabled,
            (SwitchOnDisabled | SwitchedOn | OperationEnabled, Shutdown) => ReadyToSwitchOn,
            (ReadyToSwitchOn, SwitchOn | Enable) => SwitchedOn,
            (SwitchedOn, Enable) => OperationEnabled,
            (OperationEnabled, SwitchOn) => SwitchedOn,
            (QuickStopActive, Enable) if stays => OperationEnabled,
            (state, _) => state,
        };
    }

    /// The control word in force.
    pub fn word(&self) -> u16 {
        self.word
    }

    /// A fault has come up: a powered drive first comes to rest.
    pub fn fail(&mut self) {
        self.state = match self.state {
            State::OperationEnabled | State::QuickStopActive | State::FaultReactionActive => {
                State::FaultReactionActive
            }
            _ => State::Fault,
        };
    }

    /// The drive has been told to come to rest by something else than a control word.
    pub fn stop(&mut self) {
        if self.state == State::OperationEnabled {
            self.state = State::QuickStopActive;
        }
    }

    /// The power stage goes off at once.
    pub fn disable(&mut self) {
        self.state = match self.state {
            State::Fault | State::FaultReactionActive => State::Fault,
            _ => State::SwitchOnDisabled,
        };
    }

    /// The motor has come to rest.
    pub fn rested(&mut self, stays: bool) {
        self.state = match self.state {
            State::FaultReactionActive => State::Fault,
            State::QuickStopActive if !stays => State::SwitchOnDisabled,
            state => state,
        };
    }

    /// The state's bits of the status word, and that there is voltage and the bus has the drive.
    pub fn status(&self) -> u16 {
        let bits = match self.state {
            State::SwitchOnDisabled => 0x40,
            State::ReadyToSwitchOn => 0x21,
            State::SwitchedOn => 0x23,
            State::OperationEnabled => 0x27,
            State::QuickStopActive => 0x07,
            State::FaultReactionActive => 0x0F,
            State::Fault => 0x08,
        };
        bits | 0x0210
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drive_is_enabled_step_by_step_and_stopped() {
        let mut machine = Machine::default();
        let states: Vec<_> = [0x0F, 0x06, 0x0F, 0x0F, 0x02]
            .into_iter()
            .map(|word| {
                machine.control(word, false);
                machine.state()
            })
            .collect();
        use State::{
            OperationEnabled, QuickStopActive, ReadyToSwitchOn, SwitchOnDisabled, SwitchedOn,
        };
        let expected =
            [SwitchOnDisabled, ReadyToSwitchOn, SwitchedOn, OperationEnabled, QuickStopActive];
        assert_eq!(states, expected);
        machine.control(0x0F, false);
        assert_eq!(machine.state(), QuickStopActive);
        machine.rested(false);
        assert_eq!(machine.state(), SwitchOnDisabled);
    }

    #[test]
    fn a_fault_is_reset_by_the_rise_of_its_bit_alone() {
        let mut machine = Machine::default();
        for word in [0x06, 0x07, 0x8F] {
            machine.control(word, false);
        }
        machine.fail();
        assert_eq!(machine.status() & 0x4F, 0x0F);
        machine.rested(false);
        assert_eq!(machine.status() & 0x4F, 0x08);
        machine.control(0x8F, false);
        assert_eq!(machine.state(), State::Fault);
        machine.control(0x00, false);
        machine.control(0x80, false);
        assert_eq!(machine.state(), State::SwitchOnDisabled);
    }
}
