//! A running pipeline over HTTP: its state, its jobs and requests for programs, and the page for people.
//!
//! A process of its own beside the pipeline. It reads samples as an observer ([`observe`]), keeps the newest of them
//! ([`hub`]), and asks through the operators' socket ([`pipeline`]), so whatever is refused is refused in the same
//! words as on the command line. The machine waits for nothing here, and loses nothing when this process ends.
//!
//! [`routes`] is the one table of what can be asked: the router and the description in `/openapi.json` are made of it.

pub mod access;
pub mod advice;
mod api;
pub mod assets;
pub mod context;
pub mod events;
pub mod hub;
pub mod live;
pub mod machine_facts;
pub mod metrics;
pub mod observe;
pub mod openapi;
pub mod outline;
pub mod path;
pub mod pipeline;
pub mod poll;
pub mod preview;
pub mod ring;
pub mod routes;
pub mod scope;
pub mod server;
pub mod signals;
pub mod spool;
