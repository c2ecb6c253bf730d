//! grbl 1.1 for a pipeline: what LightBurn, LaserGRBL, UGS, CNCjs, MeerK40t, Rayforge and their like speak.
//!
//! [`session`] is the protocol as a state machine without input or output: bytes and what the machine says go in, bytes
//! and requests come out. [`server`] moves them between sockets and the machine, which it knows by the trait
//! [`Machine`](machine::Machine) alone. A program is spooled and handed over as a whole, so that a job is checked whole:
//! see `docs/grbl.md`.

pub mod codes;
pub mod machine;
pub mod network;
pub mod report;
pub mod server;
pub mod session;
pub mod settings;
pub mod spool;
