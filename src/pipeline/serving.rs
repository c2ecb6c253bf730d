//! `graver serve` as one more child of the supervisor: no role of the pipeline, whose death ends nothing.

use super::services::{describe, program};
use crate::arguments::AccessArguments;
use crate::exit::Failure;
use runtime::child::ChildProcess;
use runtime::{Domain, message};
use std::time::Duration;

/// How long it may take to end after it was told to.
const END_PATIENCE: Duration = Duration::from_secs(2);

/// The process that lets people and programs in, if there is one.
#[derive(Debug, Default)]
pub struct Serving {
    child: Option<ChildProcess>,
}

impl Serving {
    /// Starts it, if `access` has a way in.
    ///
    /// # Errors
    /// A process that cannot be started.
    pub fn start(domain: &Domain, access: &AccessArguments) -> Result<Self, Failure> {
        if access.is_empty() {
            return Ok(Self::default());
        }
        let failed = |error: String| Failure::service(format!("graver serve: {error}"));
        let mut command = program().map_err(failed)?;
        command.arg("serve").args(access.words()).arg("--instance").arg(domain.instance().name());
        command.stdin(std::process::Stdio::null()).stdout(std::process::Stdio::null());
        let child =
            ChildProcess::spawn(domain, command).map_err(|error| failed(error.to_string()))?;
        Ok(Self { child: Some(child) })
    }

    /// Tells that it has ended, once.
    pub fn poll(&mut self) {
        let Some(child) = &mut self.child else { return };
        let Ok(Some(status)) = child.try_wait() else { return };
        let pid = child.pid();
        self.child = None;
        message::tell(&format!(
            "graver serve (pid {pid}) {}: no page and no grbl any more; the machine goes on",
            describe(status)
        ));
    }

    /// Ends it.
    pub fn stop(&mut self) {
        let Some(mut child) = self.child.take() else { return };
        // A child that is gone can be told nothing, and that is no harm.
        let _ = child.terminate();
        if !matches!(child.wait_within(END_PATIENCE), Ok(Some(_))) {
            let _ = child.kill();
            let _ = child.wait_within(END_PATIENCE);
        }
    }
}
