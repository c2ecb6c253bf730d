//! The bridge between commands and what they drive, and the clock of the machine.
//!
//! - [`port`]: the seam; what hardware or a plant must do.
//! - [`ports`]: the list of the ports that there are.
//! - [`plant`]: the simulated plant, motors and laser included.
//! - [`bridge`]: one cycle: apply the latched command, measure, tell.
//! - [`link`]: how datagrams and frames reach hardware and come back.
//! - [`watchdog`]: laser off without a fresh command, axes to rest when that lasts too long.
//! - [`stalls`]: the account of the times in which the cycle stood still.
//!
//! The bridge's step has no input or output and reads no clock; times come in as arguments.

// Units stand in brackets throughout, `[m]`, which rustdoc takes for links.
#![allow(rustdoc::broken_intra_doc_links)]

pub mod bridge;
pub mod discipline;
#[cfg(feature = "ethercat")]
pub mod ethercat;
pub mod fired;
pub mod hostmot2;
pub mod link;
pub mod plant;
pub mod port;
pub mod ports;
pub mod pulses;
pub mod service;
pub mod stalls;
pub mod watchdog;

pub use bridge::{Bridge, BridgeOptions, Deadlines};
pub use plant::{PlantOptions, SimulatedPlant};
pub use port::{
    Actuation, ActuatorProfile, Freshness, Measurement, Port, PortClock, PortError, Power, Profile,
};
pub use stalls::Stall;
pub use watchdog::GatePermission;
