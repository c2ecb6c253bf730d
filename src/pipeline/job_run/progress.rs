//! What is done for a job while it is not played, for people.

use super::{JobRun, Stage};

impl JobRun<'_> {
    /// What is done for the job before it is played, and after; `None` while it is.
    pub(super) fn stage(&self) -> Option<&'static str> {
        match self.stage {
            Stage::Starting(_) => Some("starting"),
            Stage::Homing(_) => Some("homing"),
            Stage::Planning => Some("planning"),
            Stage::Ready(_) => Some("waiting for the recording"),
            Stage::Playing => None,
            Stage::Resting(_) => Some("coming to rest"),
        }
    }
}
