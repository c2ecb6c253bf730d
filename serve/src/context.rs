//! What everybody who answers a request shares.

use crate::access::Access;
use crate::hub::Hub;
use crate::metrics::Metrics;
use crate::pipeline::Pipeline;
use crate::preview::Previewer;
use crate::spool::Spool;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tokio::sync::Semaphore;

/// Uploads at a time: each is in memory as it comes.
const UPLOADS: usize = 2;

/// Jobs that are planned, or wait for it.
const PLANS: usize = 4;

/// How many may do the same at a time.
pub(crate) struct Slots;

impl Slots {
    pub(crate) fn for_uploads() -> Arc<Semaphore> {
        Arc::new(Semaphore::new(UPLOADS))
    }

    pub(crate) fn for_plans() -> Arc<Semaphore> {
        Arc::new(Semaphore::new(PLANS))
    }
}

/// Shared by all threads of the server.
#[derive(Clone)]
pub struct Context {
    /// Who is asked.
    pub pipeline: Arc<dyn Pipeline>,
    /// What is known.
    pub hub: Arc<Hub>,
    /// What is counted.
    pub metrics: Arc<Metrics>,
    /// The files that were uploaded.
    pub spool: Arc<Spool>,
    /// Plans jobs to see what they come to.
    pub previewer: Arc<Previewer>,
    /// Who may do what.
    pub access: Arc<Access>,
    /// Whether the server ends.
    pub is_over: Arc<AtomicBool>,
    /// Places for uploads.
    pub(crate) uploads: Arc<Semaphore>,
    /// Places for jobs to be planned.
    pub(crate) plans: Arc<Semaphore>,
}

impl std::fmt::Debug for Context {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Context").field("pipeline", &self.pipeline.name()).finish()
    }
}
