//! What drives the motors: a kind of port, what it is told by the machine file, and the texts of its fault
//! words.

mod words;

use messages::Nanoseconds;

pub use words::fault_text;

/// Which target an actuator's drive follows, and so which loops the controller closes itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ActuatorMode {
    /// The motor's voltage: the controller closes the position, velocity and current loops.
    Voltage,
    /// The motor's torque: the drive closes the current loop.
    Torque,
    /// The motor's velocity, with the torque as feedforward: the drive closes the velocity loop too.
    Velocity,
    /// The motor's position, with velocity and torque as feedforward: the drive closes all loops. A stepper's
    /// drive places its pulses by it.
    Position,
}

impl ActuatorMode {
    /// All of them, from the one with the most loops in the controller to the one with none.
    pub const ALL: [Self; 4] = [Self::Voltage, Self::Torque, Self::Velocity, Self::Position];

    /// The word for it in the machine file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Voltage => "voltage",
            Self::Torque => "torque",
            Self::Velocity => "velocity",
            Self::Position => "position",
        }
    }
}

/// What drives the motors of a machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Drives {
    /// The kind of port, with what it is told.
    pub kind: DrivesKind,
    /// From the deadline at which an actuation is sent until its gate edges count from [ns]. How long a
    /// motor's target takes is [`crate::Actuator::latency`].
    pub gate_latency: Nanoseconds,
}

impl Default for Drives {
    fn default() -> Self {
        Self { kind: DrivesKind::Simulated, gate_latency: Nanoseconds(0) }
    }
}

/// A kind of port, with what the machine file tells it.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum DrivesKind {
    /// The simulated plant.
    #[default]
    Simulated,
    /// An FPGA card with HostMot2 firmware, over UDP.
    Hostmot2(Hostmot2),
    /// Drives on an EtherCAT bus.
    Ethercat(Ethercat),
}

impl DrivesKind {
    /// The key of its table in the machine file.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Simulated => "simulated",
            Self::Hostmot2(_) => "hostmot2",
            Self::Ethercat(_) => "ethercat",
        }
    }
}

/// An FPGA card with HostMot2 firmware.
#[derive(Debug, Clone, PartialEq)]
pub struct Hostmot2 {
    /// Its address, and its port where that is not 27181.
    pub address: String,
    /// How long the card goes on without a packet before it is dark and unpowered by itself [ns].
    pub watchdog: Nanoseconds,
    /// The one-shot that opens the gate.
    pub gate: Option<u32>,
    /// The PWM generator that sets the power of the laser.
    pub power: Option<u32>,
    /// What drives each actuator, in the order of the machine's.
    pub actuators: Vec<Hostmot2Actuator>,
    /// The pin of each of the machine's inputs, in their order.
    pub inputs: Vec<u32>,
    /// The pin of each of its outputs; `None` of one that is switched elsewhere.
    pub outputs: Vec<Option<u32>>,
}

/// What drives an actuator on a HostMot2 card: numbers of the card's modules, from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hostmot2Actuator {
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
    /// An axis of a galvo interface.
    Xy2mod {
        /// The interface's number.
        xy2mod: u32,
        /// 0 for its x, 1 for its y.
        axis: u32,
        /// The motor's angle at full scale, either way from the middle [rad].
        full_scale: f64,
        /// How a position travels.
        frame: Xy2Frame,
    },
}

/// Bits of a position in a frame of XY2-100.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Xy2Frame {
    /// 16.
    Short,
    /// 18.
    Long,
}

/// Drives on an EtherCAT bus.
#[derive(Debug, Clone, PartialEq)]
pub struct Ethercat {
    /// How the bus is reached.
    pub link: EthercatLink,
    /// How long a drive goes on without process data before it stops by itself [ns].
    pub watchdog: Nanoseconds,
    /// The position on the bus of each actuator's drive, in the order of the machine's.
    pub actuators: Vec<u16>,
    /// What opens the gate.
    pub gate: Option<EthercatGate>,
    /// The position on the bus of the analogue output that sets the power.
    pub power: Option<u16>,
    /// Where each of the machine's inputs is, in their order.
    pub inputs: Vec<EthercatBit>,
    /// Where each of its outputs is; `None` of one that is switched elsewhere.
    pub outputs: Vec<Option<EthercatBit>>,
    /// Who slaves shall be, in the order of the file; nothing is asked of those that are not here.
    pub identities: Vec<EthercatIdentity>,
}

/// A bit of what a slave exchanges.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct EthercatBit {
    /// Its position on the bus.
    pub slave: u16,
    /// The bit, from 0: of a terminal's process data, or of a drive's digital inputs (60FDh).
    pub bit: u16,
}

/// Who a slave shall be, by its EEPROM.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EthercatIdentity {
    /// Its position on the bus.
    pub slave: u16,
    /// The number of its maker.
    pub vendor: u32,
    /// The maker's number of it.
    pub product: u32,
    /// The revision, where it matters.
    pub revision: Option<u32>,
    /// The serial number, where it matters.
    pub serial: Option<u32>,
}

/// How an EtherCAT bus is reached.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum EthercatLink {
    /// By raw frames on a network interface.
    Interface(String),
    /// By frames in UDP packets to this address.
    Udp(String),
}

/// An oversampling output that opens the gate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EthercatGate {
    /// Its position on the bus.
    pub slave: u16,
    /// Its channel, from 0.
    pub channel: u16,
    /// Samples in a cycle.
    pub oversampling: u16,
}
