//! What operators ask of a running pipeline and what they are told: the requests on its socket, their answers, and
//! its status. The domain holder answers; the command line, the page and software that speaks grbl ask.

pub mod client;
mod direct;
pub mod fleet;
pub mod queue;
pub mod request;
pub mod status;

pub use client::{Client, ClientError};
pub use queue::{Queue, QueuedJob, Submitted};
pub use request::{Part, Request, Verb, VerbReply};
pub use status::{AxisStatus, PastFault, Probed, Status};
