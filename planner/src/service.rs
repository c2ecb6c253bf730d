//! The planner service: takes a job offer, plans and checks it, and streams its setpoints as far
//! ahead as the controller has room for.
//!
//! Three threads joined by bounded channels: one plans, one samples the checked plan, and the main
//! one talks to the domain and never waits for either. Nothing is sent before the whole job has
//! been checked, and nothing before the controller names the stream: until then its channel may be
//! emptied unread. A stream that the controller has gone on with without this process, or is done
//! with, is let go: no part of it is ever sent twice.

mod planning_task;
#[cfg(test)]
mod tests;

use crate::request::Refusal;
use crate::{Plan, PlanFacts};
use crossbeam::channel::{Receiver, TryRecvError, bounded};
use machine::Machine;
use messages::{
    ControllerState, JobOffer, PlannerPhase, PlannerReport, Progress, Setpoint, run_folder,
};
use planning_task::Abandoned;
use runtime::peer::{PeerState, Peers};
use runtime::{Domain, Publisher, Role, Samples, ServiceError, Subscriber, clock, signal};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How often the service looks at its channels.
const LOOK: Duration = Duration::from_millis(2);

/// How often it reports when nothing changes.
const REPORT_INTERVAL: Duration = Duration::from_millis(100);

/// Setpoints that wait between sampling and sending.
const SAMPLED_AHEAD: usize = 1024;

/// Runs until it is told to end (SIGTERM) or the supervisor dies.
///
/// # Errors
/// When a channel fails.
pub fn run(domain: &Domain, machine: &Machine) -> Result<(), ServiceError> {
    let mut service = Service::open(domain, machine)?;
    while signal::termination().is_none() && service.peers.state(Role::Domain) != PeerState::Dead {
        service.turn()?;
        std::thread::sleep(LOOK);
    }
    Ok(())
}

/// What the service is doing, with what that needs.
enum Work {
    Idle,
    /// The offer waits for the axes to rest: where they rest, the job begins.
    Waiting(PathBuf),
    Planning(Planning),
    Sending(Sending),
}

/// A plan in the making, on a thread of its own; dropping this makes that thread give up.
struct Planning {
    folder: PathBuf,
    started: Instant,
    result: Receiver<Result<Plan, Refusal>>,
    _abandoned: Abandoned,
}

/// A plan on its way to the controller; dropping this ends the thread that samples it.
struct Sending {
    samples: Receiver<Setpoint>,
    /// Sampled, but the channel was full.
    waiting: Option<Box<Setpoint>>,
}

struct Service {
    machine: Machine,
    /// The domain's directory, for a refusal that the run folder cannot take.
    spare: PathBuf,
    peers: Peers,
    offers: Subscriber<JobOffer>,
    progress: Subscriber<Progress>,
    newest_progress: Progress,
    setpoints: Publisher<Setpoint>,
    reports: Publisher<PlannerReport>,
    report: PlannerReport,
    reported: Instant,
    work: Work,
}

impl Service {
    fn open(domain: &Domain, machine: &Machine) -> Result<Self, ServiceError> {
        let mut service = Self {
            machine: machine.clone(),
            spare: domain.instance().root(),
            peers: Peers::watch(domain, &[Role::Domain])?,
            offers: domain.subscriber(Samples::Latest)?,
            progress: domain.subscriber(Samples::Latest)?,
            newest_progress: Progress::default(),
            setpoints: domain.publisher()?,
            reports: domain.publisher()?,
            report: PlannerReport::default(),
            reported: Instant::now(),
            work: Work::Idle,
        };
        service.publish_report()?;
        Ok(service)
    }

    /// Looks at everything once; never waits.
    fn turn(&mut self) -> Result<(), ServiceError> {
        if let Some(progress) = self.progress.newest()? {
            self.newest_progress = progress;
        }
        if let Some(offer) = self.offers.newest()? {
            self.take_offer(&offer)?;
        }
        self.let_go()?;
        self.begin_plan()?;
        self.take_plan()?;
        self.send()?;
        self.report_now_and_then()
    }

    fn take_offer(&mut self, offer: &JobOffer) -> Result<(), ServiceError> {
        match offer.folder().filter(|folder| !folder.is_empty()) {
            // Over already: this process is a new one, and the offer of an old job still stands.
            Some(_) if offer.stream <= self.newest_progress.finished_stream => Ok(()),
            Some(folder) if Path::new(folder).join(run_folder::SUMMARY).exists() => Ok(()),
            Some(folder) => {
                self.work = Work::Waiting(PathBuf::from(folder));
                self.report = PlannerReport { stream: offer.stream, ..PlannerReport::default() };
                self.enter(PlannerPhase::Planning)
            }
            None if offer.stream == self.report.stream => self.rest(),
            None => Ok(()),
        }
    }

    /// Gives up a stream that the controller is done with, or has begun without this process.
    fn let_go(&mut self) -> Result<(), ServiceError> {
        if matches!(self.work, Work::Idle) {
            return Ok(());
        }
        let (report, progress) = (&self.report, &self.newest_progress);
        let over = report.stream <= progress.finished_stream;
        let foreign = report.stream == progress.stream && report.sent < progress.accepted;
        if over || foreign { self.rest() } else { Ok(()) }
    }

    fn rest(&mut self) -> Result<(), ServiceError> {
        self.work = Work::Idle;
        self.enter(PlannerPhase::Idle)
    }

    /// Begins to plan once the controller has said that the axes rest, and where: a process that was
    /// started again may be offered a job that is over before it hears that.
    fn begin_plan(&mut self) -> Result<(), ServiceError> {
        let Work::Waiting(folder) = &self.work else { return Ok(()) };
        let progress = &self.newest_progress;
        let moving = matches!(
            ControllerState::from_wire(progress.state),
            ControllerState::Running | ControllerState::Holding | ControllerState::Stopping
        );
        if progress.published.0 == 0 || moving {
            return Ok(());
        }
        let folder = folder.clone();
        let standing = progress.position;
        let abandoned = Abandoned::default();
        let (sender, result) = bounded(1);
        let (place, machine, watched) = (folder.clone(), self.machine.clone(), abandoned.watch());
        spawn("plan", move || {
            // Nobody listens any more when the offer was withdrawn.
            let _ = sender.send(planning_task::plan_request(&place, &machine, &standing, &watched));
        })?;
        let started = Instant::now();
        self.work = Work::Planning(Planning { folder, started, result, _abandoned: abandoned });
        Ok(())
    }

    fn take_plan(&mut self) -> Result<(), ServiceError> {
        let Work::Planning(Planning { folder, started, result, .. }) = &self.work else {
            return Ok(());
        };
        let planned = match result.try_recv() {
            Ok(planned) => planned,
            Err(TryRecvError::Empty) => return Ok(()),
            Err(TryRecvError::Disconnected) => {
                Err(Refusal::internal("planning ended without a result: a fault of the planner"))
            }
        };
        match planned {
            Ok(plan) => {
                let plan_time = started.elapsed().as_secs_f64();
                self.begin_stream(plan, plan_time)
            }
            Err(refusal) => {
                planning_task::write_refusal(folder, &self.spare, &refusal);
                self.work = Work::Idle;
                self.enter(PlannerPhase::Refused)
            }
        }
    }

    fn begin_stream(&mut self, plan: Plan, plan_time: f64) -> Result<(), ServiceError> {
        let stream = self.report.stream;
        let PlanFacts { samples, strokes, duration, length, .. } = plan.facts;
        self.report = PlannerReport {
            samples,
            strokes: strokes as u64,
            plan_time,
            duration,
            length,
            ..self.report
        };
        let setpoints = plan.setpoints(stream);
        // The stream holds what it needs; the rest of the plan can be large.
        drop(plan);
        let (sender, samples) = bounded(SAMPLED_AHEAD);
        spawn("sample", move || {
            for setpoint in setpoints {
                if sender.send(setpoint).is_err() {
                    return;
                }
            }
        })?;
        self.work = Work::Sending(Sending { samples, waiting: None });
        self.enter(PlannerPhase::Streaming)
    }

    /// Sends as many setpoints as the controller has room for, less those still under way.
    fn send(&mut self) -> Result<(), ServiceError> {
        let Work::Sending(Sending { samples, waiting }) = &mut self.work else { return Ok(()) };
        let progress = &self.newest_progress;
        if progress.stream != self.report.stream {
            return Ok(());
        }
        let under_way = self.report.sent.saturating_sub(progress.accepted);
        let mut licence = progress.room.saturating_sub(under_way);
        while licence > 0 && self.report.sent < self.report.samples {
            let mut setpoint =
                match waiting.take().map_or_else(|| samples.try_recv(), |setpoint| Ok(*setpoint)) {
                    Ok(setpoint) => setpoint,
                    Err(TryRecvError::Empty) => return Ok(()),
                    Err(TryRecvError::Disconnected) => {
                        let (sent, all) = (self.report.sent, self.report.samples);
                        let message = format!("sampling ended after {sent} of {all} setpoints");
                        return Err(ServiceError::Work(message));
                    }
                };
            setpoint.published = clock::now();
            if !self.setpoints.publish(&setpoint)? {
                *waiting = Some(Box::new(setpoint));
                return Ok(());
            }
            self.report.sent += 1;
            licence -= 1;
        }
        if self.report.sent == self.report.samples {
            self.work = Work::Idle;
            return self.enter(PlannerPhase::Sent);
        }
        Ok(())
    }

    fn report_now_and_then(&mut self) -> Result<(), ServiceError> {
        if self.reported.elapsed() >= REPORT_INTERVAL { self.publish_report() } else { Ok(()) }
    }

    fn enter(&mut self, phase: PlannerPhase) -> Result<(), ServiceError> {
        self.report.phase = phase as u32;
        self.publish_report()
    }

    fn publish_report(&mut self) -> Result<(), ServiceError> {
        self.report.published = clock::now();
        self.reports.publish(&self.report)?;
        self.reported = Instant::now();
        Ok(())
    }
}

/// Starts a thread that ends by itself when nobody listens to it.
fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<(), ServiceError> {
    let thread = std::thread::Builder::new().name(name.to_owned()).spawn(work);
    thread.map(drop).map_err(|source| ServiceError::thread(name, source))
}
