//! One pipeline for each real-time core.
//!
//! Two drives at the same priority on one core would make each other late. The claim is a bound
//! name in the abstract socket namespace: it is the same for all users, ends with its process
//! however that dies, and leaves no file.

use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};
use std::sync::mpsc;
use std::time::Duration;

use crate::socket::credentials;

/// How long asking for the owner's pid may take.
const PATIENCE: Duration = Duration::from_millis(200);

/// Why a core could not be claimed.
#[derive(Debug, thiserror::Error)]
pub enum CoreError {
    /// Another pipeline runs on it.
    #[error(
        "CPU {core} is the real-time core of another pipeline{}; name another with --core",
        .pid.map(|pid| format!(" (pid {pid})")).unwrap_or_default()
    )]
    InUse {
        /// The CPU.
        core: usize,
        /// The other pipeline's drives, if it could be told.
        pid: Option<i32>,
    },
    /// The operating system refused.
    #[error("CPU {core} could not be claimed: {source}")]
    Io {
        /// The CPU.
        core: usize,
        /// Why.
        source: io::Error,
    },
}

/// A claim on a real-time core; dropping it gives the core free.
#[derive(Debug)]
pub struct CoreLock {
    core: usize,
    _name: UnixListener,
}

impl CoreLock {
    /// Claims `core` for this process. Only drives that really have a real-time priority need it.
    pub fn claim(core: usize) -> Result<Self, CoreError> {
        Self::claim_named(core, &name(core))
    }

    fn claim_named(core: usize, name: &str) -> Result<Self, CoreError> {
        let failed = |source| CoreError::Io { core, source };
        let address = SocketAddr::from_abstract_name(name).map_err(failed)?;
        match UnixListener::bind_addr(&address) {
            Ok(listener) => Ok(Self { core, _name: listener }),
            Err(error) if error.kind() == io::ErrorKind::AddrInUse => {
                Err(CoreError::InUse { core, pid: owner(address) })
            }
            Err(source) => Err(failed(source)),
        }
    }

    /// The CPU.
    pub fn core(&self) -> usize {
        self.core
    }
}

fn name(core: usize) -> String {
    format!("graver/core/{core}")
}

/// The pid behind a bound name. Connecting can block when many have asked before, hence the
/// thread.
fn owner(address: SocketAddr) -> Option<i32> {
    let (send, receive) = mpsc::channel();
    let ask = move || {
        let found = UnixStream::connect_addr(&address).and_then(|stream| credentials(&stream));
        let _ = send.send(found.ok().map(|credentials| credentials.pid));
    };
    std::thread::Builder::new().name("core-owner".into()).spawn(ask).ok()?;
    receive.recv_timeout(PATIENCE).ok().flatten()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn a_claimed_core_names_its_owner_until_it_is_given_free() {
        let name = format!("graver/test-core/{}", std::process::id());
        let claim = CoreLock::claim_named(3, &name).unwrap();
        assert_eq!(claim.core(), 3);
        let pid = std::process::id();
        let error = CoreLock::claim_named(3, &name).unwrap_err().to_string();
        let expected = format!(
            "CPU 3 is the real-time core of another pipeline (pid {pid}); name another with --core"
        );
        assert_eq!(error, expected);
        drop(claim);
        assert!(CoreLock::claim_named(3, &name).is_ok());
    }
}
