//! The planner service: takes a job offer, plans and checks it, and streams its setpoints as far
//! ahead as the controller has room for.
//!
//! One thread plans and checks, window by window; the main one sends, talks to the domain and never waits
//! for the other. Nothing is sent that was not checked, and nothing before the controller names the
//! stream: until then its channel may be emptied unread. A stream that the controller has gone on with
//! without this process, or is done with, is let go: no part of it is ever sent twice.

mod departure;
mod plan_files;
mod planning_thread;
#[cfg(test)]
mod tests;

use crate::request::Refusal;
use crossbeam::channel::TryRecvError;
use machine::Machine;
use messages::{
    ControllerState, JobOffer, Nanoseconds, PlannerPhase, PlannerReport, Progress, SentSetpoint,
    Setpoint, run_folder,
};
use planning_thread::{Known, Planned, PlanningThread};
use runtime::peer::{PeerState, Peers};
use runtime::{
    Domain, Publisher, Role, Samples, ServiceError, Subscriber, clock, heartbeat, signal,
};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How often the service polls its channels.
const POLL_INTERVAL: Duration = Duration::from_millis(2);

/// How often it reports when nothing changes.
const REPORT_INTERVAL: Duration = Duration::from_millis(100);

/// Runs until it is told to end (SIGTERM) or the supervisor dies.
///
/// # Errors
/// When a channel fails.
pub fn run(domain: &Domain, machine: &Machine) -> Result<(), ServiceError> {
    let mut service = Service::open(domain, machine)?;
    while signal::termination().is_none() && service.peers.state(Role::Domain) != PeerState::Dead {
        service.turn()?;
        heartbeat::beat();
        std::thread::sleep(POLL_INTERVAL);
    }
    Ok(())
}

/// What the service is doing, with what that needs.
enum Work {
    Idle,
    /// The offer waits for the axes to rest: where they rest, the job begins.
    Waiting(PathBuf),
    Streaming(Streaming),
}

/// A plan that is made, and sent as it is made.
struct Streaming {
    folder: PathBuf,
    started: Instant,
    thread: PlanningThread,
    /// Setpoints of the window that is being sent.
    window: std::vec::IntoIter<Setpoint>,
    /// Taken from it, but the channel was full.
    waiting: Option<Box<Setpoint>>,
    /// Whether all windows have come.
    is_complete: bool,
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
    /// The same once more, for whoever records.
    sent: Publisher<SentSetpoint>,
    /// When the newest was sent.
    newest_sent: Nanoseconds,
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
            sent: domain.publisher()?,
            newest_sent: Nanoseconds(0),
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
        self.take_window()?;
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
        let stream = self.report.stream;
        let places = (folder.as_path(), self.spare.as_path());
        let thread = PlanningThread::start(places, &self.machine, &progress.position, stream)?;
        self.work = Work::Streaming(Streaming {
            folder,
            started: Instant::now(),
            thread,
            window: Vec::new().into_iter(),
            waiting: None,
            is_complete: false,
        });
        Ok(())
    }

    /// Takes the next window once the one before has been sent.
    fn take_window(&mut self) -> Result<(), ServiceError> {
        let Work::Streaming(streaming) = &mut self.work else { return Ok(()) };
        streaming.thread.set_rate(self.newest_progress.override_rate.max(1.0));
        if streaming.is_complete || streaming.waiting.is_some() || streaming.window.len() > 0 {
            return Ok(());
        }
        match streaming.thread.planned().try_recv() {
            Err(TryRecvError::Empty) => Ok(()),
            Ok(Planned::Window(setpoints, known)) => {
                self.report.samples += setpoints.len() as u64;
                streaming.window = setpoints.into_iter();
                let plan_time = streaming.started.elapsed().as_secs_f64();
                self.note(&known);
                if self.report.phase == PlannerPhase::Planning as u32 {
                    self.report.plan_time = plan_time;
                    return self.enter(PlannerPhase::Streaming);
                }
                Ok(())
            }
            Ok(Planned::Complete(facts)) => {
                streaming.is_complete = true;
                self.report.length = facts.length;
                (self.report.duration, self.report.is_complete) = (facts.duration, 1);
                self.publish_report()
            }
            Ok(Planned::Refused(refusal)) => self.refuse(&refusal),
            Err(TryRecvError::Disconnected) => self.refuse(&Refusal::internal(
                "planning ended without a result: a fault of the planner",
            )),
        }
    }

    fn note(&mut self, known: &Known) {
        self.report.strokes = known.strokes;
        (self.report.duration, self.report.estimate) = (known.end, known.estimate);
    }

    fn refuse(&mut self, refusal: &Refusal) -> Result<(), ServiceError> {
        if let Work::Streaming(Streaming { folder, .. }) = &self.work {
            plan_files::write_refusal(folder, &self.spare, refusal);
        }
        self.work = Work::Idle;
        self.enter(PlannerPhase::Refused)
    }

    /// Sends as many setpoints as the controller has room for, less those still under way.
    fn send(&mut self) -> Result<(), ServiceError> {
        let Work::Streaming(Streaming { window, waiting, is_complete, .. }) = &mut self.work else {
            return Ok(());
        };
        let progress = &self.newest_progress;
        if progress.stream != self.report.stream {
            return Ok(());
        }
        let under_way = self.report.sent.saturating_sub(progress.accepted);
        let mut credit = progress.room.saturating_sub(under_way);
        while credit > 0 {
            let next = waiting.take().map(|setpoint| *setpoint).or_else(|| window.next());
            let Some(mut setpoint) = next else { break };
            // By its time each is told from the one before.
            setpoint.published = clock::now().max(self.newest_sent + Nanoseconds(1));
            self.newest_sent = setpoint.published;
            // First: whoever records has it before it can act. One that is sent again has a newer time then.
            self.sent.publish(&SentSetpoint { setpoint })?;
            if !self.setpoints.publish(&setpoint)? {
                *waiting = Some(Box::new(setpoint));
                return Ok(());
            }
            self.report.sent += 1;
            credit -= 1;
        }
        if *is_complete && waiting.is_none() && window.len() == 0 {
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
