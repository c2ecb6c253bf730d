//! A fleet of machines: what one says and takes, jobs for all, and how they are.

mod local;

use self::local::LocalPipeline;
use crate::arguments::{
    FleetCommand, FleetServer, FleetStatusArguments, FleetSubmitArguments, PublishArguments,
};
use crate::exit::{Exit, Failure};
use crate::inputs::Overrides;
use crate::output::{self, say};
use crate::pipeline::state_file;
use ::fleet::{Address, Credentials, FleetError, Options, Pace, Publisher, Server};
use ::operator::fleet::{FleetMachine, FleetStatus, FleetSubmitted, JobRecord};
use monitor::hub::Sink;
use monitor::run_folder::local_time;
use planner::job::one_file::other_file;
use runtime::{Instance, message};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A machine's end of its fleet: one more reader of what the hub receives.
#[derive(Default)]
pub struct Station(Option<Publisher>);

impl Station {
    /// Begins to say what the pipeline of `instance` is doing, if there is a server to say it to.
    ///
    /// # Errors
    /// Arguments that cannot be, and no thread. A server that is not there is no error: it is looked for again and again.
    pub fn start(arguments: &PublishArguments, instance: &Instance) -> Result<Self, Failure> {
        let Some(options) = options(arguments, instance)? else { return Ok(Self(None)) };
        let pipeline = Arc::new(LocalPipeline::new(instance.clone()));
        let publisher = Publisher::start(options, pipeline).map_err(Failure::service)?;
        Ok(Self(Some(publisher)))
    }

    /// Those who read beside the recorder.
    pub fn sinks(&mut self) -> Vec<&mut dyn Sink> {
        self.0.iter_mut().map(|publisher| publisher as &mut dyn Sink).collect()
    }
}

/// Whether these arguments can be, before anything is started.
///
/// # Errors
/// What cannot.
pub fn check(arguments: &PublishArguments, instance: &Instance) -> Result<(), Failure> {
    options(arguments, instance).map(|_| ())
}

fn options(arguments: &PublishArguments, instance: &Instance) -> Result<Option<Options>, Failure> {
    let Some(url) = &arguments.publish else { return Ok(None) };
    let credentials = arguments.publish_credentials.as_deref();
    let server = server(url, "--publish", credentials, arguments.publish_ca.as_deref())?;
    let named = |option: &str, name: &String| {
        ::fleet::name::check(name).map_err(|error| Failure::bad_input(format!("{option} {error}")))
    };
    if let Some(name) = &arguments.publish_as {
        named("--publish-as", name)?;
    }
    if let Some(group) = &arguments.jobs_of {
        named("--jobs-of", group)?;
    }
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let machine = || ::fleet::name::of(host.trim(), instance.name());
    let spool =
        state_file(instance.name(), "fleet").unwrap_or_else(|| instance.root().join("fleet"));
    Ok(Some(Options {
        server,
        machine: arguments.publish_as.clone().unwrap_or_else(machine),
        group: arguments.jobs_of.clone(),
        spool,
        pace: Pace::default(),
    }))
}

fn server(
    url: &str,
    option: &str,
    credentials: Option<&Path>,
    ca: Option<&Path>,
) -> Result<Server, Failure> {
    let address: Address =
        url.parse().map_err(|error| Failure::bad_input(format!("{option}: {error}")))?;
    let credentials = credentials.map(Credentials::read).transpose().map_err(Failure::bad_input)?;
    if credentials.is_some() && !address.is_tls && !address.is_local() {
        message::tell(&format!(
            "warning: {address} is not encrypted unless the server asks for it: credentials may be read on the network; \
             tls:// makes sure"
        ));
    }
    let authority = match ca {
        Some(path) if !path.is_file() => {
            return Err(Failure::bad_input(format!(
                "{}: there is no file of certificates",
                path.display()
            )));
        }
        path => path.map(Path::to_owned),
    };
    Ok(Server { address, credentials, authority })
}

fn named_server(arguments: &FleetServer) -> Result<Server, Failure> {
    server(
        &arguments.server,
        "the server",
        arguments.credentials.as_deref(),
        arguments.ca.as_deref(),
    )
}

/// Hands a job to a fleet, or says how its machines are.
///
/// # Errors
/// No server, or a job that is none.
pub fn run(command: &FleetCommand) -> Result<Exit, Failure> {
    match command {
        FleetCommand::Submit(arguments) => submit(arguments),
        FleetCommand::Status(arguments) => status(arguments),
    }
}

fn submit(arguments: &FleetSubmitArguments) -> Result<Exit, Failure> {
    let server = named_server(&arguments.server)?;
    let job: &PathBuf = &arguments.job;
    let at =
        |error: &dyn std::fmt::Display| Failure::bad_input(format!("{}: {error}", job.display()));
    let content = std::fs::read(job).map_err(|error| at(&error))?;
    // The machine would refuse it; here somebody reads why.
    serve::preview::check_changes(&arguments.set).map_err(Failure::bad_input)?;
    let set = Overrides::sort(&arguments.set)?.job;
    if let Some(other) = other_file(job, &content, &set) {
        return Err(match other.line {
            Some(line) => Failure::bad_input(format!("{}:{line}: {other}", job.display())),
            None => Failure::bad_input(format!("--set: {other}")),
        });
    }
    let name = job.file_name().unwrap_or_default().to_string_lossy();
    let id = ::fleet::send::submit(&server, &arguments.group, &name, &arguments.set, content)
        .map_err(failed)?;
    if arguments.server.json {
        output::json(&FleetSubmitted { id })?;
    } else {
        say!(
            "job {id} waits for a machine of group {}; `graver fleet status` tells of it",
            arguments.group
        );
    }
    Ok(Exit::Done)
}

fn failed(error: FleetError) -> Failure {
    match error {
        FleetError::TooLarge { .. } | FleetError::Refused(_) | FleetError::Credentials(_) => {
            Failure::bad_input(error)
        }
        _ => Failure::service(error),
    }
}

fn status(arguments: &FleetStatusArguments) -> Result<Exit, Failure> {
    let fleet = ::fleet::survey::survey(&named_server(&arguments.server)?).map_err(failed)?;
    if arguments.server.json {
        output::json(&fleet)?;
    } else {
        show(&fleet);
    }
    Ok(Exit::Done)
}

fn show(fleet: &FleetStatus) {
    if fleet.machines.is_empty() {
        say!("no machine has said anything yet");
    }
    for (name, machine) in &fleet.machines {
        say!("{}", machine_line(name, machine));
    }
    for (group, count) in &fleet.waiting {
        say!("{count} jobs wait for a machine of group {group}");
    }
    for (group, count) in &fleet.refused {
        say!("{count} jobs of group {group} were refused and lie in {}", ::fleet::streams::REFUSED);
    }
    for record in &fleet.jobs {
        say!("{}", record_line(record));
    }
}

/// A machine in one line.
fn machine_line(name: &str, machine: &FleetMachine) -> String {
    let state = machine.state.as_ref();
    let silent = match (state, machine.age) {
        (Some(state), _) if !state.online => Some("has left".to_owned()),
        (Some(_), Some(age)) if !machine.is_heard => {
            Some(format!("silent for {age:.0} s, before that"))
        }
        (None, _) => Some("never said what it is doing".to_owned()),
        _ => None,
    };
    let mut words: Vec<String> = silent.into_iter().collect();
    if let Some(state) = state.filter(|state| state.online) {
        words.push(state.state.clone());
        words.extend(state.cause.clone());
        words.extend(state.group.as_ref().map(|group| format!("takes jobs of {group}")));
    }
    let job = machine.job.as_ref().and_then(|job| job.job.as_ref()).filter(|_| machine.is_heard);
    if let Some(job) = job {
        let left = job.time_left.map(|left| format!(", {left:.0} s left")).unwrap_or_default();
        words.push(format!("job {} {} {:.0} %{left}", job.number, job.name, 100.0 * job.share));
    }
    format!("{name:<20}  {}", words.join("; "))
}

/// A job in one line.
fn record_line(record: &JobRecord) -> String {
    let JobRecord { id, name, machine, state, number, message, time, .. } = record;
    let number = number.map(|number| format!(" as its job {number}")).unwrap_or_default();
    let message = message.as_ref().map(|message| format!("\n      {message}")).unwrap_or_default();
    format!("{id}  {state:<9}  {}  {name}  {machine}{number}{message}", local_time(*time as u64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::operator::fleet::{JobProgress, MachineJob, MachineState};

    #[test]
    fn a_machine_is_told_in_one_line_and_a_silent_one_is_not_taken_for_what_it_was() {
        let state = MachineState {
            state: "running".to_owned(),
            online: true,
            group: Some("lasers".to_owned()),
            ..MachineState::default()
        };
        let progress = JobProgress {
            number: 3,
            name: "plate".to_owned(),
            share: 0.5,
            time_left: Some(7.2),
            ..JobProgress::default()
        };
        let job = MachineJob { job: Some(progress), ..MachineJob::default() };
        let heard = FleetMachine {
            is_heard: true,
            age: Some(1.0),
            state: Some(state.clone()),
            job: Some(job),
            ..FleetMachine::default()
        };
        let line = machine_line("one", &heard);
        assert!(
            line.ends_with("running; takes jobs of lasers; job 3 plate 50 %, 7 s left"),
            "{line}"
        );
        let silent = FleetMachine { is_heard: false, age: Some(63.0), ..heard.clone() };
        let line = machine_line("one", &silent);
        assert!(
            line.contains("silent for 63 s, before that; running") && !line.contains("plate"),
            "{line}"
        );
        let left = FleetMachine {
            state: Some(MachineState { online: false, ..state }),
            is_heard: false,
            ..heard
        };
        assert!(machine_line("one", &left).ends_with("has left"));
        assert!(machine_line("one", &FleetMachine::default()).contains("never said"));
    }
}
