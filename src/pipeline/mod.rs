//! The supervisor: a domain, its four services, and the jobs that run in it.
//!
//! `graver run` is a [`Pipeline`] with services of its own and one job; `graver domain` is one
//! whose services systemd starts and whose jobs operators submit. The supervisor is not on the
//! real-time path: it watches, asks and writes down.

pub mod configuration;
pub mod job_run;
pub mod operators;
pub mod services;
pub mod status;

use crate::exit::Failure;
use configuration::Configuration;
use operators::{Operators, Submission};
use runtime::domain::Role;
use runtime::operator::OperatorLink;
use runtime::{Domain, Instance, Publisher, Reading, Subscriber};
use services::{Ended, Remedy, Services};
use signals::{
    ControllerReport, ControllerState, DrivesReport, JobOffer, OperatorVerb, PlannerReport,
    Progress,
};
use status::Board;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How often the supervisor looks.
pub const LOOK: Duration = Duration::from_millis(10);

/// How long services may take to come up.
const START_PATIENCE: Duration = Duration::from_secs(30);

/// How long the axes may take to come to rest.
const REST_PATIENCE: Duration = Duration::from_secs(10);

/// Who starts the services.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Starter {
    /// This process does.
    Own,
    /// Somebody else does, such as systemd.
    Others,
}

/// The newest of what the services say.
#[derive(Debug, Clone, Copy, Default)]
pub struct Heard {
    /// From the controller.
    pub progress: Progress,
    /// From the controller.
    pub controller: ControllerReport,
    /// From drives.
    pub drives: DrivesReport,
    /// From the planner.
    pub planner: PlannerReport,
}

struct Ears {
    progress: Subscriber<Progress>,
    controller: Subscriber<ControllerReport>,
    drives: Subscriber<DrivesReport>,
    planner: Subscriber<PlannerReport>,
}

/// A domain with its services.
pub struct Pipeline {
    /// What the services are built from.
    pub configuration: Configuration,
    /// The newest of what they say.
    pub heard: Heard,
    /// What operators see.
    pub board: Arc<Board>,
    operators: Operators,
    link: Arc<OperatorLink>,
    offers: Publisher<JobOffer>,
    ears: Ears,
    services: Services,
    starter: Starter,
    streams: u64,
    domain: Domain,
}

impl Pipeline {
    /// Creates the domain, starts the services if they are its own, and powers the motors.
    ///
    /// # Errors
    /// An instance in use, or a service that does not come up.
    pub fn start(
        instance: &Instance,
        configuration: Configuration,
        starter: Starter,
    ) -> Result<Self, Failure> {
        for warning in instance.warnings() {
            eprintln!("graver: {warning}");
        }
        let domain = Domain::create(instance).map_err(Failure::service)?;
        configuration.write(instance).map_err(Failure::service)?;
        let ears = Ears {
            progress: domain.subscriber(Reading::Newest).map_err(Failure::service)?,
            controller: domain.subscriber(Reading::Newest).map_err(Failure::service)?,
            drives: domain.subscriber(Reading::Newest).map_err(Failure::service)?,
            planner: domain.subscriber(Reading::Newest).map_err(Failure::service)?,
        };
        let offers = domain.publisher().map_err(Failure::service)?;
        let link = Arc::new(OperatorLink::start(&domain).map_err(Failure::service)?);
        let board = Arc::new(Board::default());
        let operators = Operators::bind(&domain, link.clone(), board.clone(), starter)?;
        let services = match starter {
            Starter::Own => Services::start(&domain)?,
            Starter::Others => Services::of_others(),
        };
        let mut pipeline = Self {
            configuration,
            heard: Heard::default(),
            board,
            operators,
            link,
            offers,
            ears,
            services,
            starter,
            streams: 0,
            domain,
        };
        if starter == Starter::Own {
            pipeline.enable()?;
        }
        Ok(pipeline)
    }

    /// Listens once; call it every [`LOOK`]. Services of its own that have ended are told.
    ///
    /// # Errors
    /// A channel that fails.
    pub fn look(&mut self) -> Result<Vec<Ended>, Failure> {
        let heard = &mut self.heard;
        if let Some(sample) = self.ears.progress.newest().map_err(Failure::service)? {
            heard.progress = sample;
        }
        if let Some(sample) = self.ears.controller.newest().map_err(Failure::service)? {
            heard.controller = sample;
        }
        if let Some(sample) = self.ears.drives.newest().map_err(Failure::service)? {
            heard.drives = sample;
        }
        if let Some(sample) = self.ears.planner.newest().map_err(Failure::service)? {
            heard.planner = sample;
        }
        let ended = self.services.look(&self.domain)?;
        self.board.post(&self.heard, &self.services.pids(&self.domain));
        Ok(ended)
    }

    /// Offers a job to the planner under a new stream number, which it returns.
    ///
    /// # Errors
    /// A path too long for an offer, or a channel that fails.
    pub fn offer(&mut self, folder: &str) -> Result<u64, Failure> {
        self.streams += 1;
        let offer = JobOffer::new(self.streams, folder).ok_or_else(|| {
            Failure::service(format!(
                "the path of the run folder is longer than {} bytes: {folder}",
                signals::job::MAX_PATH
            ))
        })?;
        self.offers.publish(&offer).map_err(Failure::service)?;
        Ok(self.streams)
    }

    /// Withdraws the newest offer.
    ///
    /// # Errors
    /// A channel that fails.
    pub fn withdraw(&mut self) -> Result<(), Failure> {
        let offer = JobOffer { stream: self.streams, ..JobOffer::default() };
        self.offers.publish(&offer).map_err(Failure::service)?;
        Ok(())
    }

    /// Asks the controller; whether it agreed.
    pub fn ask(&self, verb: OperatorVerb, value: f64) -> bool {
        self.link.request(verb, value).is_ok_and(|reply| reply.accepted == 1)
    }

    /// A job that an operator submitted and nobody has taken yet.
    pub fn submission(&self) -> Option<Submission> {
        self.operators.submission()
    }

    /// Who starts the services.
    pub fn starter(&self) -> Starter {
        self.starter
    }

    /// Whether a process with this role lives in the domain.
    pub fn has(&self, role: Role) -> bool {
        self.domain.peer(role).is_some()
    }

    /// Waits until every service has spoken. A controller that powers the motors sooner meets
    /// drives that know nobody yet, and they stop for good.
    fn await_services(&mut self) -> Result<(), Failure> {
        let started = Instant::now();
        while let Some(role) = self.silent() {
            self.look_while_starting()?;
            if started.elapsed() > START_PATIENCE {
                return Err(Failure::service(format!(
                    "the {role} did not come up within {} s",
                    START_PATIENCE.as_secs()
                )));
            }
            std::thread::sleep(LOOK);
        }
        Ok(())
    }

    /// A service that is not there or has not spoken yet. A monitor that others start may stay
    /// away: nobody waits for it.
    fn silent(&self) -> Option<Role> {
        let heard = &self.heard;
        [
            (Role::Planner, heard.planner.published.0 != 0),
            (Role::Controller, heard.progress.published.0 != 0),
            (Role::Drives, heard.drives.cycle.0 != 0),
            (Role::Monitor, true),
        ]
        .into_iter()
        .filter(|(role, _)| *role != Role::Monitor || self.starter == Starter::Own)
        .find(|(role, spoke)| !spoke || !self.has(*role))
        .map(|(role, _)| role)
    }

    /// Looks, and gives up when a service has ended that the machine cannot do without.
    fn look_while_starting(&mut self) -> Result<(), Failure> {
        for ended in self.look()? {
            match ended.remedy {
                Remedy::Restarted | Remedy::None => eprintln!("graver: {ended}"),
                Remedy::Stop => return Err(Failure::service(format!("{ended} while starting"))),
            }
        }
        Ok(())
    }

    /// Waits for the services, powers the motors and waits until the controller is ready for a
    /// stream.
    ///
    /// # Errors
    /// A service that does not come up or ends, or a controller that does not become ready, with
    /// its state and fault.
    pub fn enable(&mut self) -> Result<(), Failure> {
        self.await_services()?;
        let started = Instant::now();
        let mut asked = self.ask(OperatorVerb::Enable, 0.0);
        loop {
            self.look_while_starting()?;
            let state = ControllerState::from_wire(self.heard.progress.state);
            if state == ControllerState::Idle {
                return Ok(());
            }
            if started.elapsed() > REST_PATIENCE {
                return Err(Failure::service(format!(
                    "the controller did not become ready: it is {}, fault {}",
                    state.name(),
                    self.heard.progress.fault.code().name()
                )));
            }
            if !asked && state == ControllerState::Disabled {
                asked = self.ask(OperatorVerb::Enable, 0.0);
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Ends in order: laser, axes, processes. Nothing is left in shared memory afterwards.
    pub fn shut_down(mut self) {
        if self.has(Role::Controller) && self.has(Role::Drives) {
            self.ask(OperatorVerb::Stop, 0.0);
            self.wait(|heard| {
                !matches!(
                    ControllerState::from_wire(heard.progress.state),
                    ControllerState::Running | ControllerState::Holding | ControllerState::Stopping
                )
            });
            self.ask(OperatorVerb::Disable, 0.0);
            self.wait(|heard| heard.drives.at_rest == 1 && heard.drives.lit == 0);
        }
        self.services.stop();
    }

    fn wait(&mut self, condition: impl Fn(&Heard) -> bool) {
        let started = Instant::now();
        while !condition(&self.heard) && started.elapsed() < REST_PATIENCE {
            let able = self.has(Role::Controller) && self.has(Role::Drives);
            if !able || self.look().is_err() {
                return;
            }
            std::thread::sleep(LOOK);
        }
    }
}
