//! Emulated hardware on the other end of a bus: what the ports of `drives` are proved against, and what
//! masters that are not ours accept.
//!
//! Nothing here is part of the shipped program. Each emulator moves the motors of the simulated plant, so that
//! a job runs on it as it would on a machine.

// Units stand in brackets throughout, `[m]`, which rustdoc takes for links.
#![allow(rustdoc::broken_intra_doc_links)]

pub mod cable;
pub mod ethercat;
pub mod hostmot2;
