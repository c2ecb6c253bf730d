//! What is connected to a board, by the numbers of its modules.

use messages::Nanoseconds;

/// A board and what is connected to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Its address, and its port where that is not 27181.
    pub address: String,
    /// How long the board goes on without a request before it makes all its pins inputs.
    pub watchdog: Nanoseconds,
    /// The one-shots of the gate, half of them for every second cycle: two for each pulse in a cycle.
    pub gate: Vec<u32>,
    /// From a deadline until the offsets of its gate edges count [ns].
    pub gate_latency: Nanoseconds,
    /// The PWM generator that sets the laser's power.
    pub power: Option<u32>,
    /// What each actuator of the machine is on, in their order, and how it is later than a deadline [ns].
    pub actuators: Vec<(Connection, Nanoseconds)>,
    /// The pin of each input of the machine, in their order.
    pub inputs: Vec<u32>,
    /// The pin of each output.
    pub outputs: Vec<Option<u32>>,
}

/// What an actuator is on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Connection {
    /// A step generator.
    Stepgen {
        /// Its number.
        stepgen: u32,
        /// The encoder, if it has one.
        encoder: Option<u32>,
    },
    /// A PWM generator on an amplifier.
    Pwm {
        /// Its number.
        pwm: u32,
        /// The encoder.
        encoder: u32,
    },
    /// A mirror of a scan head.
    Xy2mod {
        /// The interface's number.
        xy2mod: u32,
        /// 0 for its x, 1 for its y.
        channel: u32,
        /// The motor's angle at full scale [rad].
        full_scale: f64,
        /// Whether its frames have 18 bits instead of 16.
        long: bool,
    },
}
