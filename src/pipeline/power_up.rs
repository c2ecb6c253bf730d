//! From processes that were just started to motors that are powered and wait for a job.

use super::{Pipeline, slow};
use messages::{ControllerState, Fault, OperatorVerb};
use runtime::DomainError;
use runtime::domain::Role;
use std::time::{Duration, Instant};

/// How long services may take to come up.
const START_PATIENCE: Duration = Duration::from_secs(30);

/// How long the controller may take to power the motors, or to end what it does.
const POWER_PATIENCE: Duration = Duration::from_secs(10);

/// How long the controller may take to answer.
const ANSWER_PATIENCE: Duration = Duration::from_millis(250);

/// Why the motors are not powered.
#[derive(Debug, thiserror::Error)]
pub enum NotReady {
    /// There is too little shared memory.
    #[error(transparent)]
    Memory(#[from] DomainError),
    /// A service does not say anything.
    #[error("the {0} did not come up within {seconds} s", seconds = START_PATIENCE.as_secs())]
    Silent(Role),
    /// A fault is latched.
    #[error(
        "the machine is faulted: {}; clear it with `graver reset`",
        .0.code().name()
    )]
    Faulted(Fault),
    /// The controller does something else.
    #[error(
        "the controller did not become ready within {seconds} s: it is {name}",
        seconds = POWER_PATIENCE.as_secs(), name = .0.name()
    )]
    Busy(ControllerState),
}

/// How far it has come.
#[derive(Debug, Clone, Copy)]
enum Step {
    /// Waiting until every service has spoken.
    Services,
    /// Waiting for the motors; whether they were asked for.
    Motors { asked: bool },
}

/// The way to powered motors, one poll after the other.
#[derive(Debug, Clone, Copy)]
pub struct PowerUp {
    since: Instant,
    step: Step,
}

impl PowerUp {
    /// From now on.
    pub fn begin() -> Self {
        Self { since: Instant::now(), step: Step::Services }
    }

    /// Goes on after a poll of the pipeline; whether the motors are powered.
    ///
    /// # Errors
    /// A service that stays silent, a fault, or a controller that does not become ready.
    pub fn advance(&mut self, pipeline: &Pipeline) -> Result<bool, NotReady> {
        match self.step {
            // Not before all have spoken: drives that do not know their peers yet would take them
            // for lost, and stay stopped.
            Step::Services => match silent(pipeline) {
                None => {
                    pipeline.allocate()?;
                    *self = Self { since: Instant::now(), step: Step::Motors { asked: false } };
                }
                Some(role) if self.since.elapsed() > START_PATIENCE => {
                    return Err(NotReady::Silent(role));
                }
                Some(_) => {}
            },
            Step::Motors { asked } => {
                let progress = &pipeline.latest.progress;
                let state = ControllerState::from_wire(progress.state);
                match state {
                    ControllerState::Idle => return Ok(true),
                    ControllerState::Faulted => return Err(NotReady::Faulted(progress.fault)),
                    _ if self.since.elapsed() > POWER_PATIENCE => {
                        return Err(NotReady::Busy(state));
                    }
                    ControllerState::Disabled if !asked => {
                        let answer = pipeline.request(OperatorVerb::Enable, 0.0, ANSWER_PATIENCE);
                        let asked = answer.is_ok_and(|reply| reply.accepted == 1);
                        self.step = Step::Motors { asked };
                    }
                    _ => {}
                }
            }
        }
        Ok(false)
    }
}

/// A service that is not there or has not spoken yet. Nobody waits for a monitor that others start,
/// or that has died.
fn silent(pipeline: &Pipeline) -> Option<Role> {
    let latest = &pipeline.latest;
    [
        (Role::Planner, latest.planner.published.0 != 0),
        (Role::Controller, latest.progress.published.0 != 0),
        (Role::Drives, latest.drives.cycle.0 != 0),
        (Role::Modbus, slow::have_all_spoken(&pipeline.machine, &latest.slow)),
        (Role::Monitor, true),
    ]
    .into_iter()
    .filter(|(role, _)| match role {
        Role::Monitor => pipeline.starts(*role),
        Role::Modbus => !pipeline.machine.operating.devices.is_empty(),
        _ => true,
    })
    .find(|(role, spoke)| !spoke || !pipeline.has(*role))
    .map(|(role, _)| role)
}
