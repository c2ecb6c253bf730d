//! The laser's gate: one-shots that the board's clock starts, so that edges fall by it alone.
//!
//! Each one-shot makes one pulse in every second cycle: its first timer is the delay, its second the width. A
//! timer of the board's clock starts it, whose turn is longer than the watchdog's time: a request that comes
//! late sets a start that has passed, one that is lost sets none, and either way it is dark. One-shots of even
//! and odd cycles take turns, so that no register is written while its pulse is under way, and light across
//! the border of two cycles is one pulse after the other. Their outputs are wired together, active low with
//! open drains: who pulls it low opens the gate.

use messages::{LaserCycle, MAX_EDGES};

use super::idrom::Module;
use super::lbp16::Request;

/// Registers of a one-shot.
mod register {
    pub(super) const DELAY: u16 = 0;
    pub(super) const WIDTH: u16 = 1;
    pub(super) const CONTROL: u16 = 5;
}

/// Started by the board's clock at a rise.
const BY_CLOCK: u32 = 3 | 1 << 3 | 1 << 6;
/// Which timer of the board's clock, from this bit on.
const TIMER: u32 = 12;
/// The second timer, started by the fall of the first.
const AFTER_DELAY: u32 = (5 | 1 << 4 | 1 << 6) << 16;
/// Both timers low, at once.
pub const DARK: u32 = 1 << 7 | 1 << 23;

/// By how much a pulse that lasts to the end of its cycle goes on into the next [ns]: what the corrections
/// of the board's clock may move the next one's start by.
const OVERLAP: f64 = 500.0;
/// From the start by the board's clock to the beginning of the cycle [ns]: a delay of 0 would start nothing.
pub const LEAD: f64 = 1000.0;
/// The most pulses in a cycle.
pub const MOST_PULSES: usize = MAX_EDGES / 2 + 1;

/// A time with light, from the beginning of the cycle [ns].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pulse {
    /// Its beginning.
    pub from: f64,
    /// Its end.
    pub to: f64,
}

/// The times with light of a cycle, and its power.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Light {
    pulses: [Pulse; MOST_PULSES],
    count: usize,
    /// The mean power where it is lit, 0..=1.
    pub power: f64,
}

impl Light {
    /// The light of `laser` in a cycle of `period` [ns].
    pub fn of(laser: &LaserCycle, period: f64) -> Self {
        let mut light = Self::default();
        let (mut at, mut gate, mut power) = (0.0, laser.gate, laser.power);
        let (mut energy, mut time) = (0.0, 0.0);
        let ends = laser.edges().iter().map(|edge| (f64::from(edge.offset), edge.gate, edge.power));
        for (offset, next_gate, next_power) in ends.chain([(period, 0, 0.0)]) {
            let offset = offset.min(period);
            if gate != 0 && offset > at {
                light.add(Pulse { from: at, to: offset });
                energy += power * (offset - at);
                time += offset - at;
            }
            (at, gate, power) = (offset, next_gate, next_power);
        }
        light.power = if time > 0.0 { energy / time } else { 0.0 };
        light
    }

    /// The times with light, in order.
    pub fn pulses(&self) -> &[Pulse] {
        self.pulses.get(..self.count).unwrap_or(&[])
    }

    fn add(&mut self, pulse: Pulse) {
        let last = self.count.checked_sub(1).and_then(|last| self.pulses.get_mut(last));
        if let Some(last) = last
            && last.to >= pulse.from
        {
            last.to = pulse.to;
        } else if let Some(place) = self.pulses.get_mut(self.count) {
            *place = pulse;
            self.count += 1;
        }
    }
}

/// The one-shots of the gate.
#[derive(Debug, Clone)]
pub struct Gate {
    module: Module,
    /// Instances for even and for odd cycles.
    shots: [Vec<u32>; 2],
    /// How long a cycle is [ns].
    period: f64,
}

impl Gate {
    /// A gate of the instances `shots` of `module`, half of them for each second cycle of `period` [ns].
    pub fn new(module: Module, shots: &[u32], period: f64) -> Self {
        let every_second = |first: usize| shots.iter().copied().skip(first).step_by(2).collect();
        Self { module, shots: [every_second(0), every_second(1)], period }
    }

    /// Pulses that a cycle may have.
    pub fn most(&self) -> usize {
        self.shots[0].len().min(self.shots[1].len())
    }

    /// Makes the gate dark at once.
    pub fn dark(&self, request: &mut Request) {
        for shot in self.shots.iter().flatten() {
            request.write(self.module.address(register::CONTROL, *shot), DARK);
        }
    }

    /// Sets the `light` of a cycle, which the timer `1 + parity` of the board's clock starts; `early` is how
    /// long before the cycle's beginning it does [ns].
    pub fn set(&self, request: &mut Request, parity: usize, light: &[Pulse], early: f64) {
        let Some(shots) = self.shots.get(parity) else { return };
        let ticks =
            |time: f64| (time * f64::from(self.module.clock) * 1e-9).round().max(1.0) as u32;
        for (index, shot) in shots.iter().enumerate() {
            let control = self.module.address(register::CONTROL, *shot);
            // A request that comes after newer ones ends their pulse, and does not change it.
            request.write(control, DARK);
            let Some(pulse) = light.get(index) else { continue };
            let lasts = if pulse.to >= self.period { OVERLAP } else { 0.0 };
            let (from, to) = (ticks(pulse.from + early), ticks(pulse.to + lasts + early));
            request.write(self.module.address(register::DELAY, *shot), from);
            request
                .write(self.module.address(register::WIDTH, *shot), to.saturating_sub(from).max(1));
            let timer = (1 + parity as u32) << TIMER;
            request.write(control, BY_CLOCK | timer | AFTER_DELAY);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::GateEdge;

    fn cycle(gate: u32, edges: &[(u32, u32, f64)]) -> LaserCycle {
        let mut cycle = LaserCycle { gate, power: 0.5, ..LaserCycle::OFF };
        for &(offset, gate, power) in edges {
            assert!(cycle.push(GateEdge { offset, gate, power }));
        }
        cycle
    }

    fn check(cycle: &LaserCycle, pulses: &[(f64, f64)], power: f64) {
        let light = Light::of(cycle, 1e6);
        let found: Vec<_> = light.pulses().iter().map(|pulse| (pulse.from, pulse.to)).collect();
        assert_eq!(found, pulses, "{cycle:?}");
        assert!((light.power - power).abs() < 1e-12, "{cycle:?}: {}", light.power);
    }

    #[test]
    fn edges_become_pulses() {
        check(&LaserCycle::OFF, &[], 0.0);
        check(&cycle(3, &[]), &[(0.0, 1e6)], 0.5);
        check(&cycle(3, &[(250_000, 0, 0.0)]), &[(0.0, 250_000.0)], 0.5);
        check(
            &cycle(0, &[(100, 1, 0.2), (300, 0, 0.0), (900_000, 2, 0.2)]),
            &[(100.0, 300.0), (900_000.0, 1e6)],
            0.2,
        );
        // A change of power is no edge of the gate.
        check(&cycle(1, &[(500_000, 1, 1.0)]), &[(0.0, 1e6)], 0.75);
        check(&cycle(0, &[(7, 1, 0.5), (7, 0, 0.0)]), &[], 0.0);
    }
}
