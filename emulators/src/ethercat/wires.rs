//! What the devices and the machine share: the wires to motors and laser.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use messages::Nanoseconds;

/// What a power stage does with its motor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Phases {
    /// It is off.
    #[default]
    Open,
    /// It drives this voltage [V].
    Driven(f64),
}

/// The wires between a drive and its motor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotorWires {
    /// What the power stage does.
    pub phases: Phases,
    /// Encoder counts since power-on.
    pub counts: i64,
    /// Current [A].
    pub current: f64,
}

/// The light changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightEdge {
    /// When.
    pub at: Nanoseconds,
    /// To which part of full power, 0 for dark.
    pub power: f64,
}

/// The gate's and the power's signal to the laser, and the light that they make: the power while the gate
/// is open.
#[derive(Debug, Clone, Default)]
pub struct Light {
    gate: bool,
    power: f64,
    pending: VecDeque<(Nanoseconds, bool)>,
    edges: Vec<LightEdge>,
}

impl Light {
    /// The light, dark as yet; without a `power` signal the source has full power.
    pub fn new(has_power_signal: bool) -> Self {
        Self { power: if has_power_signal { 0.0 } else { 1.0 }, ..Self::default() }
    }

    /// The gate's signal from `at` on, in the place of all that was to come.
    pub fn gate(&mut self, at: Nanoseconds, open: bool) {
        self.pending.clear();
        self.set(at, open, self.power);
    }

    /// The power's signal from `at` on, 0..=1.
    pub fn power(&mut self, at: Nanoseconds, power: f64) {
        self.settle(at);
        self.set(at, self.gate, power);
    }

    /// What the gate's signal will be, in the place of all that was to come after `at`.
    pub fn pattern(&mut self, at: Nanoseconds, levels: impl Iterator<Item = (Nanoseconds, bool)>) {
        self.settle(at);
        self.pending.clear();
        self.pending.extend(levels);
        self.settle(at);
    }

    /// Goes on to `now`.
    pub fn settle(&mut self, now: Nanoseconds) {
        while let Some((at, open)) = self.pending.front().copied()
            && at <= now
        {
            self.pending.pop_front();
            self.set(at, open, self.power);
        }
    }

    fn set(&mut self, at: Nanoseconds, gate: bool, power: f64) {
        (self.gate, self.power) = (gate, power);
        let light = if gate { power } else { 0.0 };
        let before = self.edges.last().map_or(0.0, |edge| edge.power);
        if light != before {
            self.edges.push(LightEdge { at, power: light });
        }
    }

    /// All changes so far, in their order.
    pub fn edges(&self) -> &[LightEdge] {
        &self.edges
    }

    /// Takes the changes so far out, so that a long run does not keep them all.
    pub fn take_edges(&mut self) -> Vec<LightEdge> {
        let last = self.edges.last().copied();
        let edges = core::mem::take(&mut self.edges);
        self.edges.extend(last);
        edges
    }

    /// Whether there is light.
    pub fn is_lit(&self) -> bool {
        self.gate && self.power > 0.0
    }
}

/// All wires.
#[derive(Debug, Clone, Default)]
pub struct Bundle {
    /// Those of the motors, in the order of the machine's actuators.
    pub motors: Vec<MotorWires>,
    /// Those of the laser.
    pub light: Light,
    /// Levels of the digital inputs, eight bits for each terminal of them in the order of the line.
    pub inputs: u64,
    /// Levels of the digital outputs, likewise; one of them may be the gate.
    pub outputs: u64,
}

/// The wires, as each device holds them.
#[derive(Debug, Clone, Default)]
pub struct Wires(Arc<Mutex<Bundle>>);

impl Wires {
    /// Wires as `bundle` has them.
    pub fn new(bundle: Bundle) -> Self {
        Self(Arc::new(Mutex::new(bundle)))
    }

    /// Takes them in hand.
    pub fn lock(&self) -> MutexGuard<'_, Bundle> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The wires of the motor `index`.
    pub fn motor(&self, index: usize) -> MotorWires {
        self.lock().motors.get(index).copied().unwrap_or_default()
    }

    /// What the power stage of the motor `index` does.
    pub fn drive(&self, index: usize, phases: Phases) {
        if let Some(motor) = self.lock().motors.get_mut(index) {
            motor.phases = phases;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MICROSECOND: i64 = 1000;

    #[test]
    fn a_pattern_is_played_in_time_and_cut_where_the_gate_is_closed() {
        let at = |time: i64| Nanoseconds(time * MICROSECOND);
        let mut light = Light::new(false);
        light.pattern(at(0), [(at(10), true), (at(30), false), (at(50), true)].into_iter());
        light.settle(at(40));
        light.gate(at(45), false);
        light.settle(at(100));
        let edges: Vec<_> = light.edges().iter().map(|edge| (edge.at, edge.power)).collect();
        assert_eq!(edges, [(at(10), 1.0), (at(30), 0.0)]);
    }
}
