//! The pipeline as this crate sees it: who answers requests, and what its machine is.

use machine::Machine;
use operator::{Client, ClientError, Request};
use runtime::Instance;
use serde_json::Value;
use std::ffi::OsString;

/// A pipeline, whether or not it runs.
pub trait Pipeline: Send + Sync {
    /// Its name.
    fn name(&self) -> &str;

    /// Asks it, and waits for the answer.
    ///
    /// # Errors
    /// No pipeline, one that does not answer, or one that says that it cannot do what is asked.
    fn ask(&self, request: &Request) -> Result<Value, ClientError>;

    /// What its machine is.
    ///
    /// # Errors
    /// No pipeline, in words.
    fn describe(&self) -> Result<Description, String>;
}

/// The machine of a pipeline.
#[derive(Debug, Clone)]
pub struct Description {
    /// The machine.
    pub machine: Machine,
    /// Arguments with which a `graver` that plans a job has the same one.
    pub arguments: Vec<OsString>,
}

/// How the machine of a pipeline that runs is found.
pub type Describe = dyn Fn(&Instance) -> Result<Description, String> + Send + Sync;

/// A pipeline of this computer.
pub struct LocalPipeline {
    client: Client,
    describe: Box<Describe>,
}

impl LocalPipeline {
    /// The pipeline of this instance.
    pub fn new(instance: Instance, describe: Box<Describe>) -> Self {
        Self { client: Client::new(instance), describe }
    }
}

impl std::fmt::Debug for LocalPipeline {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.client.instance().fmt(formatter)
    }
}

impl Pipeline for LocalPipeline {
    fn name(&self) -> &str {
        self.client.instance().name()
    }

    fn ask(&self, request: &Request) -> Result<Value, ClientError> {
        self.client.ask(request)
    }

    fn describe(&self) -> Result<Description, String> {
        (self.describe)(self.client.instance())
    }
}
