//! What stands in the place of a fleet in a build without the feature `fleet`.

use crate::arguments::{FleetCommand, PublishArguments};
use crate::exit::{Exit, Failure};
use monitor::hub::Sink;
use runtime::Instance;

/// There is none.
#[derive(Default)]
pub struct Station(());

impl Station {
    /// None.
    ///
    /// # Errors
    /// A server to speak with.
    pub fn start(arguments: &PublishArguments, instance: &Instance) -> Result<Self, Failure> {
        check(arguments, instance).map(Self)
    }

    /// None.
    pub fn sinks(&mut self) -> Vec<&mut dyn Sink> {
        Vec::new()
    }
}

/// Whether these arguments can be: those that name a server cannot.
///
/// # Errors
/// A server to speak with.
pub fn check(arguments: &PublishArguments, _: &Instance) -> Result<(), Failure> {
    match &arguments.publish {
        None => Ok(()),
        Some(_) => Err(missing()),
    }
}

/// Nothing can be done with a fleet.
///
/// # Errors
/// Always.
pub fn run(_: &FleetCommand) -> Result<Exit, Failure> {
    Err(missing())
}

fn missing() -> Failure {
    Failure::bad_input(
        "this graver was built without the feature `fleet`, and speaks with none: build it with `--features fleet`",
    )
}
