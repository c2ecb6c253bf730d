//! The live page and the HTTP interface, on a thread beside the other ways in.

use crate::arguments::AccessArguments;
use crate::exit::{Exit, Failure};
use crate::pipeline::configuration::Configuration;
use crate::pipeline::state_file;
use runtime::{Instance, message};
use serve::pipeline::{Description, LocalPipeline};
use serve::server::{Options, ServeError, Server};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// This program as the kernel has it open: its path may lead to another build by now.
const THIS_PROGRAM: &str = "/proc/self/exe";

/// A page that is served.
pub(super) struct Page {
    is_over: Arc<AtomicBool>,
    thread: JoinHandle<Result<(), ServeError>>,
}

impl Page {
    /// Serves it, if `access` names an address.
    ///
    /// # Errors
    /// An address in use, tokens that cannot be read, or none where they are needed.
    pub(super) fn start(
        access: &AccessArguments,
        instance: &Instance,
    ) -> Result<Option<Self>, Failure> {
        let Some(listen) = access.listen else { return Ok(None) };
        let kept = |kind: &str| state_file(instance.name(), kind);
        let options = Options {
            listen,
            token_file: access.token_file.clone().or_else(|| kept("tokens")),
            trusts_own_user: !access.require_token,
            names: access.hosts.clone(),
            spool: kept("spool").unwrap_or_else(|| instance.root().join("spool")),
            program: program()?,
            observed: Some(instance.clone()),
        };
        let pipeline = LocalPipeline::new(instance.clone(), Box::new(describe));
        let server = Server::bind(options, Arc::new(pipeline)).map_err(|error| match error {
            ServeError::Tokens(_) | ServeError::NoTokens(_) => Failure::bad_input(error),
            ServeError::Listen { .. } | ServeError::Start(_) => Failure::service(error),
        })?;
        if let Some(path) = server.made_tokens() {
            message::tell(&format!("tokens for other users and computers: {}", path.display()));
        }
        message::tell(&format!("page at http://{}", server.address()));
        let is_over = Arc::new(AtomicBool::new(false));
        let ends = is_over.clone();
        let run = move || server.run(|| ends.load(Ordering::Relaxed));
        let thread = std::thread::Builder::new().name("page".into()).spawn(run);
        Ok(Some(Self { is_over, thread: thread.map_err(Failure::service)? }))
    }

    /// Ends it.
    ///
    /// # Errors
    /// What it could not begin with.
    pub(super) fn end(self) -> Result<Exit, Failure> {
        self.is_over.store(true, Ordering::Relaxed);
        match self.thread.join() {
            Ok(Ok(())) => Ok(Exit::Done),
            Ok(Err(error)) => Err(Failure::service(error)),
            Err(_) => Err(Failure::service("the thread of the page panicked")),
        }
    }
}

/// This program.
///
/// # Errors
/// One that nobody finds any more.
pub(crate) fn program() -> Result<PathBuf, Failure> {
    let path = Path::new(THIS_PROGRAM);
    if path.exists() {
        Ok(path.to_owned())
    } else {
        std::env::current_exe().map_err(Failure::service)
    }
}

/// The machine of the pipeline of this instance, as its holder wrote it down.
///
/// # Errors
/// No pipeline, in words.
pub(crate) fn describe(instance: &Instance) -> Result<Description, String> {
    let told = || -> Result<Description, Failure> {
        let configuration = Configuration::read(instance)?;
        let arguments = configuration.source.arguments()?;
        Ok(Description { machine: configuration.machine()?, arguments })
    };
    told().map_err(|failure| failure.refusal.message)
}
