//! The four services as child processes: started, watched, stopped in order.

use crate::exit::Failure;
use runtime::Domain;
use runtime::child::ChildProcess;
use runtime::domain::Role;
use std::process::Command;
use std::time::Duration;

/// The order in which services start; they stop in the reverse order of danger, see
/// [`Services::stop`].
const ROLES: [Role; 4] = [Role::Monitor, Role::Planner, Role::Controller, Role::Drives];

/// How long a service may take to end after it was told to.
const END_PATIENCE: Duration = Duration::from_secs(5);

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
    pub remedy: Remedy,
}

/// What was done about a service that ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Remedy {
    /// Started again: nothing depends on it.
    Restarted,
    /// Nothing: it has been started again before.
    None,
    /// The machine is stopped.
    Stop,
}

impl std::fmt::Display for Ended {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{} (pid {}) {}", self.role, self.pid, self.how)?;
        match self.remedy {
            Remedy::Restarted => write!(formatter, "; started again"),
            Remedy::None => write!(formatter, " once more; not started again"),
            Remedy::Stop => Ok(()),
        }
    }
}

struct Service {
    role: Role,
    child: Option<ChildProcess>,
    restarts: u32,
}

/// The services that this process has started.
pub struct Services {
    services: Vec<Service>,
}

impl Services {
    /// Starts all four.
    ///
    /// # Errors
    /// A process that cannot be started.
    pub fn start(domain: &Domain) -> Result<Self, Failure> {
        let mut services = Vec::with_capacity(ROLES.len());
        for role in ROLES {
            services.push(Service { role, child: Some(spawn(domain, role)?), restarts: 0 });
        }
        Ok(Self { services })
    }

    /// None of our own.
    pub fn of_others() -> Self {
        Self { services: Vec::new() }
    }

    /// The services that have ended since the last look. A monitor is started again once.
    ///
    /// # Errors
    /// A process that cannot be started again.
    pub fn look(&mut self, domain: &Domain) -> Result<Vec<Ended>, Failure> {
        let mut ended = Vec::new();
        for service in &mut self.services {
            let Some(child) = &mut service.child else { continue };
            let Ok(Some(status)) = child.try_wait() else { continue };
            let pid = child.pid();
            service.child = None;
            domain.clean();
            let remedy = match (service.role, service.restarts) {
                (Role::Monitor, 0) => Remedy::Restarted,
                (Role::Monitor, _) => Remedy::None,
                _ => Remedy::Stop,
            };
            if remedy == Remedy::Restarted {
                service.restarts = 1;
                service.child = Some(spawn(domain, service.role)?);
            }
            ended.push(Ended { role: service.role, pid, how: describe(status), remedy });
        }
        Ok(ended)
    }

    /// The process ids of the living services, by name.
    pub fn pids(&self, domain: &Domain) -> Vec<(&'static str, Option<i32>)> {
        ROLES
            .into_iter()
            .map(|role| {
                let own = self.services.iter().find(|service| service.role == role);
                let pid = match own {
                    Some(service) => service.child.as_ref().map(ChildProcess::pid),
                    None => domain.peer(role).map(|peer| peer.pid()),
                };
                (role.name(), pid)
            })
            .collect()
    }

    /// Tells all to end, and makes sure that they do: the controller before drives, so that the
    /// axes are brought to rest by whoever can do it best; the monitor last.
    pub fn stop(&mut self) {
        for role in [Role::Planner, Role::Controller, Role::Drives, Role::Monitor] {
            let Some(service) = self.services.iter_mut().find(|service| service.role == role)
            else {
                continue;
            };
            let Some(mut child) = service.child.take() else { continue };
            // A child that is gone cannot be told; dropping one that stays kills it.
            let _ = child.terminate();
            let _ = child.wait_within(END_PATIENCE);
        }
    }
}

fn spawn(domain: &Domain, role: Role) -> Result<ChildProcess, Failure> {
    let program = std::env::current_exe().map_err(Failure::service)?;
    let mut command = Command::new(program);
    command.arg(role.name()).arg("--instance").arg(domain.instance().name());
    command.stdin(std::process::Stdio::null()).stdout(std::process::Stdio::null());
    ChildProcess::spawn(domain, command).map_err(Failure::service)
}

fn describe(status: std::process::ExitStatus) -> String {
    use std::os::unix::process::ExitStatusExt;
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("ended with exit code {code}"),
        (None, Some(signal)) => format!("was killed by signal {signal}"),
        (None, None) => "ended".to_owned(),
    }
}
