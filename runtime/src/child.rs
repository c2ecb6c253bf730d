//! A child process in a process group of its own, so that Ctrl-C reaches the parent alone.
//!
//! A child is killed only where somebody says so, neither when its parent dies nor when the value
//! that stands for it is dropped, in a panic for example: drives and controller notice by
//! themselves that they are alone, and bring the machine to rest first.

use std::io;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus};
use std::time::Duration;

use crate::domain::{Domain, DomainError};
use crate::peer::Peer;

/// A running child; dropping it asks the child to end, and does not wait.
#[derive(Debug)]
pub struct ChildProcess {
    child: Child,
    peer: Peer,
    status: Option<ExitStatus>,
}

/// Why a child could not be started.
#[derive(Debug, thiserror::Error)]
pub enum SpawnError {
    /// The domain cannot be handed on.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// The operating system refused.
    #[error("{program:?} could not be started: {source}")]
    Start {
        /// The program.
        program: String,
        /// Why.
        source: io::Error,
    },
}

impl ChildProcess {
    /// Starts `command` as a future member of `domain`, which stays locked while the child lives.
    pub fn spawn(domain: &Domain, mut command: Command) -> Result<Self, SpawnError> {
        domain.inherit_lock(&mut command)?;
        let program = command.get_program().to_string_lossy().into_owned();
        let failed = |source| SpawnError::Start { program: program.clone(), source };
        let mut child = command.process_group(0).spawn().map_err(failed)?;
        match Peer::open(child.id() as i32) {
            Ok(peer) => Ok(Self { child, peer, status: None }),
            Err(source) => {
                let _ = child.kill();
                let _ = child.wait();
                Err(failed(source))
            }
        }
    }

    /// Its process id.
    pub fn pid(&self) -> i32 {
        self.peer.pid()
    }

    /// Its pipes and other parts.
    pub fn child(&mut self) -> &mut Child {
        &mut self.child
    }

    /// Whether it runs.
    pub fn is_alive(&self) -> bool {
        self.peer.is_alive()
    }

    /// Whether somebody has stopped it, by SIGSTOP or a debugger.
    pub fn is_stopped(&self) -> bool {
        self.peer.is_stopped()
    }

    /// Its exit status if it has ended; reaps it.
    pub fn try_wait(&mut self) -> io::Result<Option<ExitStatus>> {
        if self.status.is_none() {
            self.status = self.child.try_wait()?;
        }
        Ok(self.status)
    }

    /// Waits at most `patience` for its end; `None` if it still runs.
    pub fn wait_within(&mut self, patience: Duration) -> io::Result<Option<ExitStatus>> {
        if self.status.is_none() {
            self.peer.ended_within(patience);
        }
        self.try_wait()
    }

    /// Asks it to end (SIGTERM).
    pub fn terminate(&self) -> io::Result<()> {
        self.peer.signal(libc::SIGTERM)
    }

    /// Ends it (SIGKILL).
    pub fn kill(&self) -> io::Result<()> {
        self.peer.signal(libc::SIGKILL)
    }
}

impl Drop for ChildProcess {
    fn drop(&mut self) {
        if self.status.is_none() {
            // A child that has gone meanwhile cannot be asked.
            let _ = self.terminate();
        }
    }
}
