//! `graver serve`: the ways in for people and programs beside the operators' socket, as a process of its own.
//!
//! Killed, it takes nothing with it but the connections.

mod machine;
#[cfg_attr(not(feature = "serve"), path = "serve/no_page.rs")]
pub(crate) mod page;

use self::machine::Operated;
use self::page::Page;
use crate::arguments::ServeArguments;
use crate::exit::{Exit, Failure};
use crate::pipeline::configuration::Configuration;
use crate::pipeline::state_file;
use ::operator::Client;
use grbl::server::{Access, Server};
use grbl::session::Session;
use runtime::{Instance, message, signal};
use std::net::TcpListener;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// How often it is checked whether the pipeline is still there.
const LOOK_PERIOD: Duration = Duration::from_millis(200);

/// How long a pipeline may take to answer before it counts as gone: the time of its start.
const PATIENCE: Duration = Duration::from_secs(5);

/// Serves until a signal comes or the pipeline ends.
///
/// # Errors
/// No pipeline, an address in use.
pub fn run(arguments: &ServeArguments) -> Result<Exit, Failure> {
    signal::install().map_err(Failure::service)?;
    let access = &arguments.access.or_page();
    let instance = Instance::new(&arguments.instance).map_err(Failure::bad_input)?;
    let page = Page::start(access, &instance)?;
    if access.grbl.is_none() && access.grbl_tty.is_none() {
        // The page stays up between pipelines, and says that there is none.
        while signal::termination().is_none() {
            std::thread::sleep(LOOK_PERIOD);
        }
        return page.map_or(Ok(Exit::Done), Page::end);
    }
    let client = Client::new(instance.clone());
    // It says better than a file that is not there that no pipeline runs.
    client.status().map_err(Failure::service)?;
    let configuration = Configuration::read(&instance)?;
    let session = Session::new(configuration.machine()?, spools(&instance));
    let listener = listen(access)?;
    let served = Access { networks: access.grbl_from.clone(), tty: access.grbl_tty.clone() };
    let server = Server::start(Operated::new(client.clone()), session, listener, served)
        .map_err(Failure::service)?;
    if let Some(path) = &access.grbl_tty {
        message::tell(&format!("grbl at the serial port {}", path.display()));
    }
    let mut heard = Instant::now();
    while signal::termination().is_none() {
        std::thread::sleep(LOOK_PERIOD);
        match client.status() {
            Ok(_) => heard = Instant::now(),
            Err(error) if heard.elapsed() > PATIENCE => return Err(Failure::service(error)),
            Err(_) => {}
        }
    }
    drop(server);
    page.map_or(Ok(Exit::Done), Page::end)
}

/// Listens at the address for grbl, if there is one, and says where.
fn listen(access: &crate::arguments::AccessArguments) -> Result<Option<TcpListener>, Failure> {
    let Some(address) = access.grbl else { return Ok(None) };
    if !address.ip().is_loopback() && access.grbl_from.is_empty() {
        return Err(Failure::bad_input(format!(
            "--grbl {address} is reached from other computers, and grbl knows no password: say with --grbl-from \
             NETWORK who may operate the machine, such as 192.168.1.0/24, or listen at 127.0.0.1:{}",
            address.port()
        )));
    }
    let failed = |error: std::io::Error| Failure::service(format!("--grbl {address}: {error}"));
    let listener = TcpListener::bind(address).map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    message::tell(&format!("grbl at {address}"));
    Ok(Some(listener))
}

/// Where the programs of this instance's clients are kept.
fn spools(instance: &Instance) -> PathBuf {
    state_file(instance.name(), "grbl").unwrap_or_else(|| instance.root().join("grbl"))
}
