//! Machines, people and a real server, which each test starts for itself. Where there is no `nats-server`, each says so and is not
//! run; what needs none is in `without.rs`.

#![allow(clippy::unwrap_used)]

mod jobs;
mod said;
mod support;
mod without;
