//! What every service can fail with.

use crate::channel::ChannelError;
use crate::domain::DomainError;

/// Why a service ended early.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// The domain could not be joined, or a port in it not be made.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// A channel failed.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// The operating system refused.
    #[error("{0}")]
    Io(#[from] std::io::Error),
}
