//! An EtherCAT segment: drives of CiA 402 and terminals on a line, coupled to the simulated plant.
//!
//! - [`frame`]: what stands where in a frame.
//! - [`slave`]: a slave's controller: its memory, states, mailbox and clock.
//! - [`device`]: what stands behind a controller: a [`drive`] or a [`terminal`].
//! - [`wires`] and [`plant`]: what moves, and what shines.
//! - [`segment`]: all of it, a pure function of the frames and the time.
//! - [`link`] and [`faults`]: the line to it, good or bad; [`bus`] and [`service`]: the same at a socket, in real time.

pub mod bus;
pub mod device;
pub mod drive;
pub mod faults;
pub mod frame;
pub mod link;
pub mod plant;
pub mod segment;
pub mod service;
pub mod slave;
pub mod terminal;
pub mod wires;

pub use link::{Framing, Link};
pub use segment::{Layout, Segment};
