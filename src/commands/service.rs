//! The services as commands: each joins the domain of its instance, builds itself from the
//! domain's configuration, and runs until it is told to end.

use crate::arguments::{MonitorArguments, PublishArguments, ServiceArguments};
use crate::commands::fleet::Station;
use crate::exit::{Exit, Failure};
use crate::notify;
use crate::pipeline::configuration::Configuration;
use crate::pipeline::slow;
use machine::Machine;
use runtime::domain::Role;
use runtime::thread::{CONTROLLER_PRIORITY, DRIVES_PRIORITY};
use runtime::{Domain, Instance, message, signal};

/// Runs the service with this role.
///
/// # Errors
/// A domain that is not there, or a channel that fails.
pub fn run(role: Role, arguments: &ServiceArguments) -> Result<Exit, Failure> {
    serve(role, arguments, &PublishArguments::default())
}

/// Runs the monitor, which says what the machine is doing to a fleet where it or the domain's holder was told of one.
///
/// # Errors
/// As [`run`].
pub fn monitor(arguments: &MonitorArguments) -> Result<Exit, Failure> {
    let service = ServiceArguments { instance: arguments.instance.clone() };
    serve(Role::Monitor, &service, &arguments.publish)
}

fn serve(
    role: Role,
    arguments: &ServiceArguments,
    publish: &PublishArguments,
) -> Result<Exit, Failure> {
    if role == Role::Modbus && !cfg!(feature = "modbus") {
        return Err(Failure::bad_input(format!("graver modbus: {}", slow::HOW_TO_BUILD)));
    }
    signal::install().map_err(Failure::service)?;
    let instance = Instance::new(&arguments.instance).map_err(Failure::bad_input)?;
    let domain = Domain::join(&instance, role).map_err(Failure::service)?;
    let configuration = Configuration::read(&instance)?;
    notify::ready(&format!("joined instance {}", instance.name()));
    // Controller and drives are watched by each other, cycle by cycle, and start no thread for it.
    if matches!(role, Role::Planner | Role::Monitor | Role::Modbus) {
        notify::watch().map_err(Failure::service)?;
    }
    match role {
        Role::Planner => planner::service::run(&domain, &configuration.machine()?),
        Role::Monitor => {
            let mut station = if publish.publish.is_some() {
                Station::start(publish, &instance)?
            } else {
                // The domain's holder has found it good; what has come since must not cost the recording.
                Station::start(&configuration.publish, &instance).unwrap_or_else(|failure| {
                    message::tell(&format!("fleet: {}", failure.refusal.text.trim()));
                    Station::default()
                })
            };
            let recording = configuration.recording();
            let machine = configuration.machine()?;
            monitor::service::run(&domain, &machine, &recording, &mut station.sinks())
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
        #[cfg(feature = "modbus")]
        Role::Modbus => modbus::service::run(&domain, &configuration.machine()?, || {
            signal::termination().is_some()
        }),
        #[cfg(not(feature = "modbus"))]
        Role::Modbus => Ok(()),
        Role::Domain | Role::Observer => Ok(()),
    }
    .map_err(Failure::service)?;
    notify::stopping();
    Ok(Exit::Done)
}
