//! What the inputs say: emergency stop, door, interlocks, limit switches.
//!
//! None of it is a safety function: those are wired. It makes the software do what the wiring does, and say why.

use machine::Machine;
use machine::operating::{DoorAction, InputFunction, Side, StopCategory};
use messages::MAX_AXES;

/// The inputs that stand in the way of something.
#[derive(Debug, Clone)]
pub struct Safety {
    estop: u64,
    door: u64,
    interlock: u64,
    probe: u64,
    /// At the lower and the upper end of each axis.
    limits: [[u64; 2]; MAX_AXES],
    category: StopCategory,
    action: DoorAction,
    inputs: u64,
}

impl Safety {
    /// Of this machine.
    pub fn new(machine: &Machine) -> Self {
        let operating = &machine.operating;
        let mut limits = [[0; 2]; MAX_AXES];
        for (bit, input) in operating.bits() {
            if let InputFunction::Limit { axis, side } = input.function
                && let Some(ends) = limits.get_mut(axis)
            {
                ends[end(side)] |= bit;
            }
        }
        let mask = |meant: InputFunction| operating.mask(|function| *function == meant);
        Self {
            estop: mask(InputFunction::EmergencyStop),
            door: mask(InputFunction::Door),
            interlock: mask(InputFunction::Interlock),
            probe: mask(InputFunction::Probe),
            limits,
            category: operating.safety.estop,
            action: operating.safety.door,
            inputs: 0,
        }
    }

    /// Takes what was measured.
    pub fn see(&mut self, inputs: u64) {
        self.inputs = inputs;
    }

    /// The inputs, one bit each.
    pub fn inputs(&self) -> u64 {
        self.inputs
    }

    /// Whether the emergency stop is pressed.
    pub fn is_stopped(&self) -> bool {
        self.inputs & self.estop != 0
    }

    /// Whether the door is open.
    pub fn is_open(&self) -> bool {
        self.inputs & self.door != 0
    }

    /// Whether an interlock is missing.
    pub fn is_interlocked(&self) -> bool {
        self.inputs & self.interlock != 0
    }

    /// Whether there may be no light.
    pub fn is_dark(&self) -> bool {
        self.is_stopped() || self.is_open() || self.is_interlocked()
    }

    /// Whether there is a probe, and whether it touches.
    pub fn probe(&self) -> Option<bool> {
        (self.probe != 0).then_some(self.inputs & self.probe != 0)
    }

    /// Whether the joint of `axis` is on its limit switch at that end.
    pub fn is_at_limit(&self, axis: usize, side: Side) -> bool {
        self.limits.get(axis).is_some_and(|ends| self.inputs & ends[end(side)] != 0)
    }

    /// The first axis that is on a limit switch.
    pub fn limited(&self) -> Option<usize> {
        self.limits.iter().position(|ends| self.inputs & (ends[0] | ends[1]) != 0)
    }

    /// What an emergency stop does.
    pub fn category(&self) -> StopCategory {
        self.category
    }

    /// What an open door does.
    pub fn action(&self) -> DoorAction {
        self.action
    }
}

fn end(side: Side) -> usize {
    match side {
        Side::Lower => 0,
        Side::Upper => 1,
    }
}
