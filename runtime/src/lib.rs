//! What lies between the stages of Graver and the computer: shared-memory channels, the clock,
//! real-time threads, and processes that watch each other.
//!
//! The only crate with `unsafe`, libc and iceoryx2. It knows how a sample travels and never what it
//! means. A pipeline is one [`Domain`]: its holder creates every channel, the
//! services join and only open them, and whoever leaves last removes what is left.
//!
//! Order in a service: join the domain, make all ports, helper threads and peers, then
//! [`thread::enter_realtime`], then the cycle. After that nothing here allocates, except the one
//! small block inside iceoryx2 for each [`Publisher::publish`](channel::Publisher::publish).

#![deny(rustdoc::broken_intra_doc_links)]

pub mod allocation;
pub mod beneath;
pub mod bounded;
pub mod channel;
pub mod child;
pub mod clock;
pub mod core_lock;
mod descriptors;
pub mod domain;
#[cfg(feature = "embassy")]
mod embassy_clock;
pub mod ethtool;
pub mod fitness;
pub mod heartbeat;
pub mod instance;
mod lock;
mod membership;
pub mod message;
pub mod operator;
pub mod peer;
pub mod peer_user;
pub mod pseudo_terminal;
pub mod raw_frames;
pub mod ready;
pub mod room;
pub mod service;
pub mod signal;
pub mod socket;
pub mod stall;
pub mod terminal;
pub mod thread;
pub mod wake;

pub use channel::{Publisher, Samples, Subscriber};
pub use domain::{Domain, DomainError, Role};
pub use instance::Instance;
pub use service::ServiceError;
