//! The supervisor: a domain, its four services, and the jobs that run in it.
//!
//! `graver run` is a [`Pipeline`] with services of its own and one job; `graver domain` is one
//! whose services systemd starts and whose jobs operators submit. The supervisor is not on the
//! real-time path: it watches, asks and writes down.

mod caps;
mod cause;
pub mod configuration;
pub mod control;
pub mod fault_history;
pub mod job_run;
pub mod operators;
pub mod power_up;
pub mod queue;
pub(crate) mod refusals;
pub mod services;
pub mod serving;
pub mod slow;
pub mod status;

use crate::arguments::AccessArguments;
use crate::exit::Failure;
use configuration::Configuration;
use control::JobControl;
use machine::{DrivesKind, Machine};
use messages::time::SETPOINT_TIME;
use messages::{
    ControllerReport, ControllerState, DrivesReport, JobOffer, OperatorReply, OperatorVerb,
    PlannerReport, Progress, SimulatedInputs, SlowInputs,
};
use monitor::recording::level::Level;
use operators::Operators;
use power_up::PowerUp;
use queue::JobQueue;
use runtime::domain::Role;
use runtime::operator::{OperatorError, OperatorLink};
use runtime::peer::Peer;
use runtime::{Domain, DomainError, Instance, Publisher, Samples, Subscriber, heartbeat, message};
use services::{Ended, Recovery, Services};
use serving::Serving;
use status::StatusBoard;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// How often the supervisor polls the services.
pub const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// How long the axes may take to come to rest.
const REST_PATIENCE: Duration = Duration::from_secs(10);

/// How long the controller may take to answer when the pipeline ends: one that lives answers within
/// a few cycles of its operators' thread.
const LAST_ANSWER: Duration = Duration::from_millis(300);

/// Who starts the services.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ServiceOwner {
    /// This process does.
    Own,
    /// Somebody else does, such as systemd.
    Others,
}

/// Where the jobs of a pipeline come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JobSource {
    /// It has one of its own, which it ends with.
    Own,
    /// People submit them.
    Submitted,
}

/// The newest of what the services say.
#[derive(Debug, Clone, Copy, Default)]
pub struct Latest {
    /// From the controller.
    pub progress: Progress,
    /// From the controller.
    pub controller: ControllerReport,
    /// From drives.
    pub drives: DrivesReport,
    /// From the planner.
    pub planner: PlannerReport,
    /// Of the devices on Modbus.
    pub slow: SlowInputs,
}

impl Latest {
    /// Stream time of the job under way at its end, as planned or estimated [s].
    fn end(&self) -> Option<f64> {
        let Self { progress, planner, .. } = self;
        let is_played = progress.stream != 0 && progress.stream == planner.stream;
        // The plan's own estimate is never less than what it has planned.
        is_played.then(|| planner.estimate.max(planner.duration))
    }

    /// How long the job under way still takes at the rate asked for [s].
    pub fn time_left(&self) -> Option<f64> {
        let played = self.progress.played as f64 * SETPOINT_TIME;
        self.end().map(|end| (end - played).max(0.0) / self.rate())
    }

    /// How much of the job under way has been played, 0 to 1.
    pub fn share(&self) -> f64 {
        let played = self.progress.played as f64 * SETPOINT_TIME;
        self.end().filter(|end| *end > 0.0).map_or(0.0, |end| (played / end).min(1.0))
    }

    /// The rate at which setpoints are played, as asked for.
    fn rate(&self) -> f64 {
        let rate = self.progress.override_rate.min(1.0);
        if rate > 0.0 { rate } else { 1.0 }
    }
}

struct Subscriptions {
    progress: Subscriber<Progress>,
    controller: Subscriber<ControllerReport>,
    drives: Subscriber<DrivesReport>,
    planner: Subscriber<PlannerReport>,
    slow: Subscriber<SlowInputs>,
}

/// A domain with its services. Dropping it, in a panic too, is its ordered end: laser, axes,
/// processes; nothing is left in shared memory afterwards.
pub struct Pipeline {
    /// The machine that it drives.
    pub machine: Machine,
    /// The newest of what the services say.
    pub latest: Latest,
    /// What operators see.
    pub board: Arc<StatusBoard>,
    /// What they ask of the job under way.
    pub control: Arc<JobControl>,
    /// The jobs.
    pub queue: Arc<JobQueue>,
    _operators: Operators,
    link: Arc<OperatorLink>,
    offers: Publisher<JobOffer>,
    /// Inputs of a simulated machine that people have set.
    inputs: Arc<AtomicU64>,
    simulated: Publisher<SimulatedInputs>,
    subscriptions: Subscriptions,
    services: Services,
    serving: Serving,
    owner: ServiceOwner,
    jobs: JobSource,
    level: Level,
    streams: u64,
    domain: Domain,
}

impl Pipeline {
    /// Creates the domain, and starts the services if they are its own. They need time to come up:
    /// see [`PowerUp`].
    ///
    /// # Errors
    /// An instance in use, or a service that cannot be started.
    pub fn start(
        instance: &Instance,
        configuration: &Configuration,
        owner: ServiceOwner,
        jobs: JobSource,
    ) -> Result<Self, Failure> {
        for warning in instance.warnings() {
            message::tell(&warning);
        }
        let machine = configuration.machine()?;
        if owner == ServiceOwner::Own {
            slow::check_built(&machine)?;
        }
        let domain = Domain::create(instance).map_err(Failure::service)?;
        configuration.write(instance)?;
        let subscriptions = Subscriptions {
            progress: domain.subscriber(Samples::Latest).map_err(Failure::service)?,
            controller: domain.subscriber(Samples::Latest).map_err(Failure::service)?,
            drives: domain.subscriber(Samples::Latest).map_err(Failure::service)?,
            planner: domain.subscriber(Samples::Latest).map_err(Failure::service)?,
            slow: domain.subscriber(Samples::Latest).map_err(Failure::service)?,
        };
        let offers = domain.publisher().map_err(Failure::service)?;
        let link = Arc::new(OperatorLink::start(&domain).map_err(Failure::service)?);
        let board = Arc::new(StatusBoard::default());
        let control = Arc::new(JobControl::default());
        if jobs == JobSource::Own {
            // Its one job is under way from here on: an operator who says stop means it.
            control.begin();
        }
        let queue = Arc::new(JobQueue::open(queue::path(instance.name())));
        board.know(&machine, configuration.source.path().as_deref());
        board.keep_faults(fault_history::path(instance.name()));
        let inputs = Arc::new(AtomicU64::new(0));
        let simulated = domain.publisher().map_err(Failure::service)?;
        let answers = operators::Answers::new(
            link.clone(),
            board.clone(),
            control.clone(),
            queue.clone(),
            &machine,
            (machine.drives.kind == DrivesKind::Simulated).then(|| inputs.clone()),
        );
        let operators = Operators::bind(&domain, answers, jobs)?;
        let services = match owner {
            ServiceOwner::Own => Services::start(&domain, &machine)?,
            ServiceOwner::Others => Services::of_others(&machine),
        };
        Ok(Self {
            machine,
            latest: Latest::default(),
            board,
            control,
            queue,
            _operators: operators,
            link,
            offers,
            inputs,
            simulated,
            subscriptions,
            services,
            serving: Serving::default(),
            owner,
            jobs,
            level: configuration.record.level,
            streams: 0,
            domain,
        })
    }

    /// Lets people and programs in by the ways that `access` names.
    ///
    /// # Errors
    /// A process that cannot be started.
    pub fn serve(&mut self, access: &AccessArguments) -> Result<(), Failure> {
        self.serving = Serving::start(&self.domain, access)?;
        Ok(())
    }

    /// Takes the latest samples; call it every [`POLL_INTERVAL`]. Services of its own that have ended are told.
    ///
    /// # Errors
    /// A channel that fails.
    pub fn poll(&mut self) -> Result<Vec<Ended>, Failure> {
        heartbeat::beat();
        // An offer is published once: a service that was started again has not heard it.
        self.offers.greet().map_err(Failure::service)?;
        let inputs = SimulatedInputs { inputs: self.inputs.load(Ordering::Relaxed) };
        self.simulated.publish(&inputs).map_err(Failure::service)?;
        let latest = &mut self.latest;
        if let Some(sample) = self.subscriptions.progress.newest().map_err(Failure::service)? {
            latest.progress = sample;
        }
        if let Some(sample) = self.subscriptions.controller.newest().map_err(Failure::service)? {
            latest.controller = sample;
        }
        if let Some(sample) = self.subscriptions.drives.newest().map_err(Failure::service)? {
            latest.drives = sample;
        }
        if let Some(sample) = self.subscriptions.planner.newest().map_err(Failure::service)? {
            latest.planner = sample;
        }
        if let Some(sample) = self.subscriptions.slow.newest().map_err(Failure::service)? {
            latest.slow = sample;
        }
        let ended = self.services.poll(&self.domain);
        self.serving.poll();
        self.board.post(
            &self.latest,
            self.control.is_held(),
            self.queue.held(),
            &self.services.pids(&self.domain),
        );
        Ok(ended)
    }

    /// Offers a job to the planner under a new stream number, which it returns.
    ///
    /// # Errors
    /// A path too long for an offer, or a channel that fails.
    pub fn offer(&mut self, folder: &str) -> Result<u64, Failure> {
        self.streams += 1;
        let offer = JobOffer::new(self.streams, folder).ok_or_else(|| {
            Failure::bad_input(format!(
                "the path of the run folder is longer than {} bytes: {folder}",
                messages::job::MAX_PATH
            ))
        })?;
        self.offers.publish(&offer).map_err(Failure::service)?;
        Ok(self.streams)
    }

    /// Withdraws the newest offer. What of it is being played goes on until the axes rest.
    ///
    /// # Errors
    /// A channel that fails.
    pub fn withdraw(&mut self) -> Result<(), Failure> {
        self.take_back(JobOffer::default())
    }

    /// Withdraws the newest offer, of which nothing more will be played.
    ///
    /// # Errors
    /// A channel that fails.
    pub fn close(&mut self) -> Result<(), Failure> {
        self.take_back(JobOffer { is_over: 1, ..JobOffer::default() })
    }

    fn take_back(&mut self, offer: JobOffer) -> Result<(), Failure> {
        let offer = JobOffer { stream: self.streams, ..offer };
        self.offers.publish(&offer).map_err(Failure::service)?;
        Ok(())
    }

    /// Asks the controller; whether it agreed.
    pub fn ask(&self, verb: OperatorVerb, value: f64) -> bool {
        self.link.request(verb, value).is_ok_and(|reply| reply.accepted == 1)
    }

    /// Asks the controller, and waits for its answer at most `patience`.
    ///
    /// # Errors
    /// No controller, or no answer.
    pub fn request(
        &self,
        verb: OperatorVerb,
        value: f64,
        patience: Duration,
    ) -> Result<OperatorReply, OperatorError> {
        self.link.request_within(verb, value, patience)
    }

    /// What stays of a recording when its run has been judged, and where it goes on that its folder cannot take.
    pub fn recording(&self) -> (Level, PathBuf) {
        (self.level, monitor::service::spare(self.domain.instance()))
    }

    /// Who starts the services.
    pub fn owner(&self) -> ServiceOwner {
        self.owner
    }

    /// Where its jobs come from.
    pub fn jobs(&self) -> JobSource {
        self.jobs
    }

    /// How a service of its own ended without which it can run no job, if one has.
    pub fn lost(&self) -> Option<&Ended> {
        self.services.lost()
    }

    /// The living process with this role in the domain.
    pub fn peer(&self, role: Role) -> Option<Peer> {
        self.domain.peer(role)
    }

    /// Whether a process with this role lives in the domain.
    pub fn has(&self, role: Role) -> bool {
        self.peer(role).is_some()
    }

    /// Makes sure that all shared memory of the domain is there, so that none can lack in a cycle.
    ///
    /// # Errors
    /// What is lacking.
    pub fn allocate(&self) -> Result<(), DomainError> {
        self.domain.allocate()
    }

    /// The domain's own directory.
    pub fn root(&self) -> PathBuf {
        self.domain.instance().root()
    }

    /// Whether this process has started the service with this role, and it has not ended.
    pub fn starts(&self, role: Role) -> bool {
        self.services.runs(role)
    }

    /// Waits for the services, powers the motors and waits until the controller is ready for a
    /// stream.
    ///
    /// # Errors
    /// A service that does not come up or ends, or a controller that does not become ready.
    pub fn enable(&mut self) -> Result<(), Failure> {
        let mut power_up = PowerUp::begin();
        loop {
            for ended in self.poll()? {
                match ended.recovery {
                    Recovery::Stop => {
                        return Err(Failure::service(format!("{ended} while starting")));
                    }
                    _ => message::tell(&ended.to_string()),
                }
            }
            if power_up.advance(self).map_err(Failure::service)? {
                return Ok(());
            }
            std::thread::sleep(POLL_INTERVAL);
        }
    }

    /// Ends in order: laser, axes, processes. The same as dropping it, named so that the order is
    /// seen.
    pub fn shut_down(self) {
        drop(self);
    }

    /// Laser off and axes to rest, then unpowered; as far as somebody is there to do it.
    fn bring_to_rest(&mut self) {
        let able = self.has(Role::Controller) && self.has(Role::Drives);
        if !able || watchdog_tripped(&self.latest) {
            return;
        }
        // Without an answer the controller hangs, and drives stops alone.
        let _ = self.request(OperatorVerb::Stop, 0.0, LAST_ANSWER);
        // What was heard before may be older than the last thing that was asked.
        std::thread::sleep(POLL_INTERVAL);
        let _ = self.poll();
        self.wait(|latest| !is_moving(latest) || watchdog_tripped(latest));
        let _ = self.request(OperatorVerb::Disable, 0.0, LAST_ANSWER);
        self.wait(is_dark_and_at_rest);
    }

    fn wait(&mut self, condition: impl Fn(&Latest) -> bool) {
        let started = Instant::now();
        while !condition(&self.latest) && started.elapsed() < REST_PATIENCE {
            let able = self.has(Role::Controller) && self.has(Role::Drives);
            if !able || self.poll().is_err() {
                return;
            }
            std::thread::sleep(POLL_INTERVAL);
        }
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        self.queue.close();
        self.bring_to_rest();
        self.serving.stop();
        self.services.stop();
    }
}

/// The file called `NAME.KIND` in which something of the instance called `name` outlives its pipeline: in `graver`
/// below `$XDG_STATE_HOME`, or `~/.local/state` without it; `None` where there is no home.
pub(crate) fn state_file(name: &str, kind: &str) -> Option<PathBuf> {
    let absolute =
        |key: &str| std::env::var_os(key).map(PathBuf::from).filter(|it| it.is_absolute());
    let below =
        absolute("XDG_STATE_HOME").or_else(|| Some(absolute("HOME")?.join(".local/state")))?;
    Some(below.join("graver").join(format!("{name}.{kind}")))
}

/// Whether the controller moves the axes, or may.
fn is_moving(latest: &Latest) -> bool {
    matches!(
        ControllerState::from_wire(latest.progress.state),
        ControllerState::Running
            | ControllerState::Holding
            | ControllerState::Stopping
            | ControllerState::Homing
            | ControllerState::Jogging
            | ControllerState::Probing
            | ControllerState::Pulsing
    )
}

/// Whether drives says that the laser is off and the axes rest, for good.
fn is_dark_and_at_rest(latest: &Latest) -> bool {
    latest.drives.at_rest == 1 && latest.drives.lit == 0
}

/// Whether drives has stopped the axes without the controller.
fn watchdog_tripped(latest: &Latest) -> bool {
    latest.drives.fault.is_some() && is_dark_and_at_rest(latest)
}
