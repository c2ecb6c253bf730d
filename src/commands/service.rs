//! The four services as commands: each joins the domain of its instance, builds itself from the
//! domain's configuration, and runs until it is told to end.

use crate::arguments::ServiceArguments;
use crate::exit::{Exit, Failure};
use crate::notify;
use crate::pipeline::configuration::Configuration;
use machine::Machine;
use runtime::domain::Role;
use runtime::thread::{CONTROLLER_PRIORITY, DRIVES_PRIORITY};
use runtime::{Domain, Instance, signal};

/// Runs the service with this role.
///
/// # Errors
/// A domain that is not there, or a channel that fails.
pub fn run(role: Role, arguments: &ServiceArguments) -> Result<Exit, Failure> {
    signal::install().map_err(Failure::service)?;
    let instance = Instance::new(&arguments.instance).map_err(Failure::bad_input)?;
    let domain = Domain::join(&instance, role).map_err(Failure::service)?;
    let configuration = Configuration::read(&instance)?;
    notify::ready(&format!("joined instance {}", instance.name()));
    // Controller and drives are watched by each other, cycle by cycle, and start no thread for it.
    if matches!(role, Role::Planner | Role::Monitor) {
        notify::watch().map_err(Failure::service)?;
    }
    match role {
        Role::Planner => planner::service::run(&domain, &configuration.machine()?),
        Role::Monitor => {
            monitor::service::run(&domain, &configuration.machine()?, &configuration.recording())
        }
        Role::Controller => {
            let realtime = configuration.realtime_options(CONTROLLER_PRIORITY);
            controller::service::run(&domain, &configuration.machine()?, &realtime)
        }
        Role::Drives => {
            let machine = configuration.machine()?;
            // Whatever the plant's file says: drives is the one clock.
            let plant = Machine { realtime: machine.realtime, ..configuration.source.plant()? };
            let port = drives::ports::build(&machine, &plant).map_err(Failure::bad_input)?;
            let options = drives::service::ServiceOptions {
                deadlines: configuration.deadlines(&machine),
                realtime: configuration.realtime_options(DRIVES_PRIORITY),
            };
            drives::service::run(&domain, &machine, port, &options)
        }
        Role::Domain | Role::Observer => Ok(()),
    }
    .map_err(Failure::service)?;
    notify::stopping();
    Ok(Exit::Done)
}
