//! grbl as its clients see it: conversations with a session and a machine of the test, through sockets, and with a real
//! pipeline.

#![allow(clippy::unwrap_used)]

mod bench;
mod conversations;
mod fuzz;
mod jobs;
mod processes;
mod sockets;
#[path = "../support/mod.rs"]
mod support;
mod traps;
