//! The state machine of a drive (IEC 61800-7-201, CiA 402): what its status word says, and which control word
//! brings it where it shall be.

use machine::ActuatorMode;

/// A state of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// It starts up.
    NotReady,
    /// It must not be switched on.
    SwitchOnDisabled,
    /// It may be switched on.
    Ready,
    /// It is switched on; its motor is not driven.
    SwitchedOn,
    /// It drives its motor by the targets.
    Enabled,
    /// It brakes, or holds, by itself.
    QuickStop,
    /// It comes to rest after a fault.
    FaultReaction,
    /// It waits for a fault to be reset.
    Fault,
}

/// Where a drive shall be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// Unpowered; a fault is reset.
    Disabled,
    /// Following its targets.
    Enabled,
    /// Braking and holding by itself.
    QuickStop,
}

const SHUTDOWN: u16 = 0x06;
const SWITCH_ON: u16 = 0x07;
const ENABLE: u16 = 0x0f;
const DISABLE_VOLTAGE: u16 = 0x00;
const QUICK_STOP: u16 = 0x02;
const FAULT_RESET: u16 = 0x80;

impl State {
    /// The state that a status word (6041h) tells.
    pub fn of(status: u16) -> Self {
        match status & 0x4f {
            0x00 => return Self::NotReady,
            0x40 => return Self::SwitchOnDisabled,
            0x08 => return Self::Fault,
            0x0f => return Self::FaultReaction,
            _ => {}
        }
        match status & 0x6f {
            0x21 => Self::Ready,
            0x23 => Self::SwitchedOn,
            0x27 => Self::Enabled,
            0x07 => Self::QuickStop,
            _ => Self::NotReady,
        }
    }

    /// Whether its motor is driven.
    pub fn is_powered(self) -> bool {
        matches!(self, Self::Enabled | Self::QuickStop | Self::FaultReaction)
    }

    /// Whether it has a fault.
    pub fn is_fault(self) -> bool {
        matches!(self, Self::Fault | Self::FaultReaction)
    }

    /// The control word (6040h) that brings it nearer to where it shall be, after `before`.
    pub fn control(self, wanted: Wanted, before: u16) -> u16 {
        match (self, wanted) {
            // A reset is a rising edge: it is given in each second cycle.
            (Self::Fault, Wanted::Disabled) => before & FAULT_RESET ^ FAULT_RESET,
            (Self::Fault | Self::FaultReaction | Self::NotReady, _) | (_, Wanted::Disabled) => {
                DISABLE_VOLTAGE
            }
            (Self::Enabled | Self::QuickStop, Wanted::QuickStop) => QUICK_STOP,
            (_, Wanted::QuickStop) => DISABLE_VOLTAGE,
            (Self::SwitchOnDisabled, Wanted::Enabled) => SHUTDOWN,
            (Self::Ready, Wanted::Enabled) => SWITCH_ON,
            (Self::SwitchedOn | Self::Enabled, Wanted::Enabled) => ENABLE,
            // Back from a quick stop only by way of unpowered.
            (Self::QuickStop, Wanted::Enabled) => DISABLE_VOLTAGE,
        }
    }
}

/// The mode of operation (6060h) in which a drive follows such targets, and its bit among the supported ones
/// (6502h); none for a voltage.
pub fn mode(of: ActuatorMode) -> Option<(i8, u32)> {
    match of {
        ActuatorMode::Voltage => None,
        ActuatorMode::Position => Some((8, 1 << 7)),
        ActuatorMode::Velocity => Some((9, 1 << 8)),
        ActuatorMode::Torque => Some((10, 1 << 9)),
    }
}

/// The modes among the `supported` ones (6502h) that an actuator can have.
pub fn modes(supported: u32) -> Vec<ActuatorMode> {
    let has = |of: &ActuatorMode| mode(*of).is_some_and(|(_, bit)| supported & bit != 0);
    ActuatorMode::ALL.into_iter().filter(has).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_word_tells_the_state_whatever_its_other_bits_are() {
        for (status, state) in [
            (0x0000, State::NotReady),
            (0x0040, State::SwitchOnDisabled),
            (0x0021, State::Ready),
            (0x0023, State::SwitchedOn),
            (0x0027, State::Enabled),
            (0x0007, State::QuickStop),
            (0x000f, State::FaultReaction),
            (0x0008, State::Fault),
        ] {
            for other in [0, 0x0080, 0x0200, 0x1400, 0x9690] {
                assert_eq!(State::of(status | other), state, "{:04x}", status | other);
            }
        }
        assert_eq!(State::of(0x1237), State::Enabled);
    }

    #[test]
    fn a_drive_is_led_up_to_enabled_and_down_again() {
        let up = [
            (State::SwitchOnDisabled, 0x06),
            (State::Ready, 0x07),
            (State::SwitchedOn, 0x0f),
            (State::Enabled, 0x0f),
        ];
        for (state, control) in up {
            assert_eq!(state.control(Wanted::Enabled, 0), control, "{state:?}");
            assert_eq!(state.control(Wanted::Disabled, 0), 0, "{state:?}");
        }
        assert_eq!(State::Enabled.control(Wanted::QuickStop, 0x0f), 0x02);
        assert_eq!(State::QuickStop.control(Wanted::QuickStop, 0x02), 0x02);
        assert_eq!(State::SwitchedOn.control(Wanted::QuickStop, 0x07), 0);
    }

    #[test]
    fn a_fault_is_reset_by_edges_and_by_nothing_else() {
        assert_eq!(State::Fault.control(Wanted::Disabled, 0), 0x80);
        assert_eq!(State::Fault.control(Wanted::Disabled, 0x80), 0);
        assert_eq!(State::Fault.control(Wanted::Enabled, 0), 0);
        assert_eq!(State::Fault.control(Wanted::QuickStop, 0), 0);
    }

    #[test]
    fn modes_are_those_of_the_drive() {
        assert_eq!(
            modes(0x03a0),
            [ActuatorMode::Torque, ActuatorMode::Velocity, ActuatorMode::Position]
        );
        assert_eq!(modes(0x0001), []);
        assert_eq!(mode(ActuatorMode::Voltage), None);
    }
}
