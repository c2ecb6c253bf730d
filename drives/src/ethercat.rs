//! The port to servo drives and terminals on an EtherCAT bus, by the crate `ethercrab`.
//!
//! - [`link`]: how frames travel; [`wire`]: the crate's frames on it, with a budget of time and without tasks.
//! - [`cia402`]: the state machine of a drive; [`image`]: a drive's process data; [`gate`]: the laser's.
//! - [`network`]: finds the slaves, holds them to the machine file and sets them up; [`cycle`]: a cycle of them;
//!   `drive`: one of its drives; `homing`: how that finds its reference by itself; `digital`: inputs and outputs; [`identity`]: who shall answer; [`port`]: the port.
//!
//! A frame goes out at the deadline and comes back within a part of the period. SYNC0 of all slaves comes by
//! the latency of the machine file later: there targets come into force together, and the gate's samples begin.
//! Our clock follows that of the bus.

pub mod cia402;
pub mod cycle;
mod digital;
mod drive;
pub mod gate;
mod homing;
pub mod identity;
pub mod image;
pub mod link;
pub mod network;
pub mod port;
pub mod wire;

pub use port::EthercatPort;
