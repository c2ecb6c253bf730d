//! A hash over what commands mean, to tell two runs apart with one number.
//!
//! It covers mode, targets, gate, power, frequency and outputs of every command given while a stream is
//! played. It leaves out stamps, cycle and stream numbers, and idle cycles, which differ between
//! runs of one job without any difference on the workpiece; and the voltage, which answers what
//! was measured and not only what was planned. So do the torque and the velocity of a drive that follows them.

use messages::Command;

/// A running hash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digest(u64);

/// An odd constant with well-spread bits: 2⁶⁴ over the golden ratio.
const SPREAD: u64 = 0x9e37_79b9_7f4a_7c15;

impl Digest {
    /// Of nothing.
    pub fn new() -> Self {
        Self(SPREAD)
    }

    /// Adds a command for a machine with so many `actuators`.
    pub fn add(&mut self, command: &Command, actuators: usize) {
        let laser = &command.laser;
        self.word(u64::from(command.mode) << 32 | u64::from(laser.edge_count));
        self.word(command.outputs);
        self.word(u64::from(laser.gate));
        self.word(laser.power.to_bits());
        // A source that is left as it is set says nothing of its frequency.
        if laser.frequency != 0.0 {
            self.word(laser.frequency.to_bits());
        }
        for edge in laser.edges() {
            self.word(u64::from(edge.offset) << 32 | u64::from(edge.gate));
            self.word(edge.power.to_bits());
        }
        for targets in [&command.position, &command.velocity, &command.effort] {
            for target in targets.iter().take(actuators) {
                self.word(target.to_bits());
            }
        }
    }

    /// The hash so far.
    pub fn value(self) -> u64 {
        self.0 ^ self.0 >> 32
    }

    fn word(&mut self, word: u64) {
        let mixed = (self.0 ^ word).wrapping_mul(SPREAD);
        self.0 = mixed ^ mixed >> 29;
    }
}

impl Default for Digest {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::{Cycle, GateEdge, Nanoseconds};

    fn digest(change: impl Fn(&mut Command)) -> u64 {
        let mut command = Command::default();
        assert!(command.laser.push(GateEdge { offset: 7, gate: 1, power: 0.5 }));
        change(&mut command);
        let mut digest = Digest::new();
        digest.add(&command, 2);
        digest.value()
    }

    #[test]
    fn sees_what_a_command_means_and_nothing_else() {
        let plain = digest(|_| {});
        let meanings: [fn(&mut Command); 9] = [
            |command| command.mode = 4,
            |command| command.outputs = 1,
            |command| command.laser.gate = 1,
            |command| command.laser.power = 0.1,
            |command| command.laser.frequency = 20e3,
            |command| command.laser.edges[0].offset = 8,
            |command| command.position[1] = 1e-300,
            |command| command.velocity[0] = 1.0,
            |command| command.effort[0] = 1.0,
        ];
        for (index, change) in meanings.iter().enumerate() {
            assert_ne!(digest(change), plain, "meaning {index}");
        }
        let stamps: [fn(&mut Command); 6] = [
            |command| command.cycle = Cycle(9),
            |command| command.stream = 3,
            |command| command.published = Nanoseconds(5),
            |command| command.received = Nanoseconds(5),
            |command| command.voltage[1] = 1.0,
            |command| command.position[2] = 1.0,
        ];
        for (index, change) in stamps.iter().enumerate() {
            assert_eq!(digest(change), plain, "stamp {index}");
        }
    }
}
