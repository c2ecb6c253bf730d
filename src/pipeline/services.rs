//! The services as child processes: started, watched, stopped in order.

use crate::exit::Failure;
use machine::Machine;
use runtime::child::ChildProcess;
use runtime::domain::Role;
use runtime::{Domain, message};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// The order in which services start. That for Modbus is there where the machine has such devices.
const ROLES: [Role; 5] =
    [Role::Monitor, Role::Planner, Role::Modbus, Role::Controller, Role::Drives];

/// The order in which they stop: the controller before drives, so that the axes are brought to
/// rest by whoever can do it best; what switches outputs after both, and the monitor last.
const STOPPING: [Role; 5] =
    [Role::Planner, Role::Controller, Role::Drives, Role::Modbus, Role::Monitor];

/// How long a service may take to end after it was told to.
const END_PATIENCE: Duration = Duration::from_secs(5);

/// How long one that somebody has stopped is waited for: it hears nothing.
const STOPPED_PATIENCE: Duration = Duration::from_millis(100);

/// This program as the kernel has it open. Its path may lead to another build by now, or nowhere.
const THIS_PROGRAM: &str = "/proc/self/exe";

/// A service that has ended by itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ended {
    /// Which one.
    pub role: Role,
    /// Its process id.
    pub pid: i32,
    /// How, in words.
    pub how: String,
    /// What was done about it.
    pub recovery: Recovery,
}

/// What was done about a service that ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Recovery {
    /// Started again: nothing depends on it.
    Restarted,
    /// Nothing: it has been started again before.
    None,
    /// It could not be started again, for this reason; nothing depends on it.
    Impossible(String),
    /// The machine is stopped.
    Stop,
}

impl std::fmt::Display for Ended {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{} (pid {}) {}", self.role, self.pid, self.how)?;
        match &self.recovery {
            Recovery::Restarted => write!(formatter, "; started again"),
            Recovery::None => write!(formatter, " once more; not started again"),
            Recovery::Impossible(reason) => write!(formatter, "; not started again: {reason}"),
            Recovery::Stop => Ok(()),
        }
    }
}

struct Service {
    role: Role,
    child: Option<ChildProcess>,
    restarts: u32,
}

/// The services that this process has started; dropping them asks those that still run to end.
pub struct Services {
    /// Those that the machine needs.
    roles: Vec<Role>,
    services: Vec<Service>,
    /// The first that ended without which nothing goes on.
    lost: Option<Ended>,
}

impl Services {
    /// Starts all that `machine` needs.
    ///
    /// # Errors
    /// A process that cannot be started.
    pub fn start(domain: &Domain, machine: &Machine) -> Result<Self, Failure> {
        let mut services = Self::of_others(machine);
        for role in services.roles.clone() {
            let child = spawn(domain, role).map_err(Failure::service)?;
            services.services.push(Service { role, child: Some(child), restarts: 0 });
        }
        Ok(services)
    }

    /// None of our own.
    pub fn of_others(machine: &Machine) -> Self {
        let has_devices = !machine.operating.devices.is_empty();
        let needed = ROLES.into_iter().filter(|role| *role != Role::Modbus || has_devices);
        Self { roles: needed.collect(), services: Vec::new(), lost: None }
    }

    /// The services that have ended since the last poll. A monitor, and who asks devices on Modbus, is started again
    /// once, if that can be done.
    pub fn poll(&mut self, domain: &Domain) -> Vec<Ended> {
        let mut ended = Vec::new();
        for service in &mut self.services {
            let Some(child) = &mut service.child else { continue };
            let Ok(Some(status)) = child.try_wait() else { continue };
            let pid = child.pid();
            service.child = None;
            domain.clean();
            if let Err(error) = domain.allocate() {
                message::tell(&error.to_string());
            }
            let recovery = match (service.role, service.restarts) {
                (Role::Monitor | Role::Modbus, 0) => service.restart(domain),
                (Role::Monitor | Role::Modbus, _) => Recovery::None,
                _ => Recovery::Stop,
            };
            ended.push(Ended { role: service.role, pid, how: describe(status), recovery });
        }
        let mut fatal = ended.iter().filter(|ended| ended.recovery == Recovery::Stop);
        self.lost = self.lost.take().or_else(|| fatal.next().cloned());
        ended
    }

    /// The first that ended without which nothing goes on.
    pub fn lost(&self) -> Option<&Ended> {
        self.lost.as_ref()
    }

    /// Whether a service with this role was started here and has not ended.
    pub fn runs(&self, role: Role) -> bool {
        self.services.iter().any(|service| service.role == role && service.child.is_some())
    }

    /// The process ids of the living services, by name.
    pub fn pids(&self, domain: &Domain) -> Vec<(&'static str, Option<i32>)> {
        let pid = |role: Role| {
            let own = self.services.iter().find(|service| service.role == role);
            match own {
                Some(service) => service.child.as_ref().map(ChildProcess::pid),
                None => domain.peer(role).map(|peer| peer.pid()),
            }
        };
        self.roles.iter().map(|role| (role.name(), pid(*role))).collect()
    }

    /// Tells all to end, one after the other, and makes sure that they do: a service that hangs is
    /// killed; one that somebody has stopped is left alone. The axes must be at rest.
    pub fn stop(&mut self) {
        for role in STOPPING {
            let Some(service) = self.services.iter_mut().find(|service| service.role == role)
            else {
                continue;
            };
            let Some(mut child) = service.child.take() else { continue };
            // A child that is gone can be told nothing, and that is no harm.
            let _ = child.terminate();
            match await_end(&mut child) {
                End::Came => {}
                // It ends by itself as soon as it is continued, and removes what is left then.
                End::Stopped => message::tell(&format!(
                    "{role} (pid {pid}) was stopped by somebody, and keeps the instance until it is \
                     continued (`kill -CONT {pid}`) or killed",
                    pid = child.pid()
                )),
                End::Missing => {
                    let _ = child.kill();
                    let _ = child.wait_within(END_PATIENCE);
                }
            }
        }
    }
}

/// What became of a child that was told to end.
enum End {
    Came,
    /// Somebody has stopped it, by SIGSTOP or a debugger: it hears nothing.
    Stopped,
    /// It runs and does not end.
    Missing,
}

/// Waits for the end of a child that was told to end; for one that somebody has stopped, not long.
fn await_end(child: &mut ChildProcess) -> End {
    let told = Instant::now();
    loop {
        match child.wait_within(STOPPED_PATIENCE) {
            Ok(Some(_)) => return End::Came,
            Ok(None) if child.is_stopped() => return End::Stopped,
            Ok(None) if told.elapsed() < END_PATIENCE => {}
            _ => return End::Missing,
        }
    }
}

impl Service {
    fn restart(&mut self, domain: &Domain) -> Recovery {
        self.restarts += 1;
        match spawn(domain, self.role) {
            Ok(child) => {
                self.child = Some(child);
                Recovery::Restarted
            }
            Err(reason) => Recovery::Impossible(reason),
        }
    }
}

/// A command that starts this program once more.
pub(super) fn program() -> Result<Command, String> {
    let mut command = Command::new(THIS_PROGRAM);
    // By its own name in the list of processes.
    command.arg0(std::env::args_os().next().unwrap_or_else(|| "graver".into()));
    if !Path::new(THIS_PROGRAM).exists() {
        let program = std::env::current_exe();
        command = Command::new(program.map_err(|error| format!("{THIS_PROGRAM}: {error}"))?);
    }
    Ok(command)
}

fn spawn(domain: &Domain, role: Role) -> Result<ChildProcess, String> {
    let mut command = program()?;
    command.arg(role.name()).arg("--instance").arg(domain.instance().name());
    // They are watched over here, not by systemd.
    command.env_remove("NOTIFY_SOCKET").env_remove("WATCHDOG_USEC");
    command.stdin(std::process::Stdio::null()).stdout(std::process::Stdio::null());
    ChildProcess::spawn(domain, command).map_err(|error| format!("the {role}: {error}"))
}

/// How a process ended, in words.
pub(super) fn describe(status: std::process::ExitStatus) -> String {
    use std::os::unix::process::ExitStatusExt;
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("ended with exit code {code}"),
        (None, Some(signal)) => format!("was killed by signal {signal}"),
        (None, None) => "ended".to_owned(),
    }
}
