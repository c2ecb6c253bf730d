//! The planner service: takes a job offer, plans and checks it, and streams its setpoints as far
//! ahead as the controller has room for.
//!
//! Three threads joined by bounded channels: one plans, one samples the checked plan, and the main
//! one talks to the domain. Nothing is sent before the whole job has been checked, and nothing
//! before the controller names the stream: until then its channel may be emptied unread.

use crate::job::Job;
use crate::request::{ARTWORK_FILE, JobRequest, PLAN_FILE, REFUSAL_FILE, REQUEST_FILE, Refusal};
use crate::{Plan, plan};
use crossbeam::channel::{Receiver, TryRecvError, bounded};
use machine::{Machine, Mechanism, MechanismVisitor};
use nalgebra::Vector3;
use runtime::peer::{PeerState, Peers};
use runtime::{Domain, Publisher, Reading, Role, ServiceError, Subscriber, clock, signal};
use signals::{AxisArray, JobOffer, PlannerPhase, PlannerReport, Progress, Setpoint};
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How often the service looks at its channels.
const LOOK: Duration = Duration::from_millis(2);

/// How often it reports when nothing changes.
const REPORT_INTERVAL: Duration = Duration::from_millis(100);

/// Setpoints that wait between sampling and sending.
const SAMPLED_AHEAD: usize = 1024;

/// A start farther than this from where the drawing begins is reached by a move of its own [m]:
/// the axes stand within a few encoder counts of where they were told to.
const START_TOLERANCE: f64 = 20e-6;

/// Runs until it is told to end (SIGTERM) or the supervisor dies.
///
/// # Errors
/// When a channel fails.
pub fn run(domain: &Domain, machine: &Machine) -> Result<(), ServiceError> {
    let mut service = Service::open(domain, machine)?;
    while signal::termination().is_none() && service.peers.state(Role::Domain) != PeerState::Dead {
        service.take_offer()?;
        service.take_plan()?;
        service.send()?;
        service.report_now_and_then()?;
        std::thread::sleep(LOOK);
    }
    Ok(())
}

/// What the service is doing, with what that needs.
enum Work {
    Idle,
    Planning { folder: PathBuf, started: Instant, result: Receiver<Result<Plan, Refusal>> },
    Sending { samples: Receiver<Setpoint>, waiting: Option<Setpoint>, _sampler: JoinHandle<()> },
}

struct Service {
    machine: Machine,
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
            peers: Peers::watch(domain, &[Role::Domain])?,
            offers: domain.subscriber(Reading::Newest)?,
            progress: domain.subscriber(Reading::Newest)?,
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

    fn take_offer(&mut self) -> Result<(), ServiceError> {
        if let Some(progress) = self.progress.newest()? {
            self.newest_progress = progress;
        }
        let Some(offer) = self.offers.newest()? else { return Ok(()) };
        let folder = offer.folder().filter(|folder| !folder.is_empty());
        let finished = offer.stream <= self.newest_progress.finished_stream;
        let Some(folder) = folder.filter(|_| !finished) else {
            if offer.stream == self.report.stream {
                self.work = Work::Idle;
                self.enter(PlannerPhase::Idle)?;
            }
            return Ok(());
        };
        let folder = PathBuf::from(folder);
        let machine = self.machine.clone();
        let start = self.newest_progress.position;
        let standing = self.newest_progress.published.0 != 0;
        let (sender, result) = bounded(1);
        let place = folder.clone();
        spawn("plan", move || {
            let planned = plan_request(&place, &machine, standing.then_some(&start));
            // Nobody listens any more when the offer was withdrawn.
            let _ = sender.send(planned);
        })?;
        self.work = Work::Planning { folder, started: Instant::now(), result };
        self.report = PlannerReport { stream: offer.stream, ..PlannerReport::default() };
        self.enter(PlannerPhase::Planning)
    }

    fn take_plan(&mut self) -> Result<(), ServiceError> {
        let Work::Planning { folder, started, result } = &self.work else { return Ok(()) };
        let planned = match result.try_recv() {
            Ok(planned) => planned,
            Err(TryRecvError::Empty) => return Ok(()),
            Err(TryRecvError::Disconnected) => Err(Refusal::internal("the planning thread ended")),
        };
        let plan_time = started.elapsed().as_secs_f64();
        let folder = folder.clone();
        match planned.and_then(|plan| write_plan(&folder, &plan).map(|()| plan)) {
            Ok(plan) => {
                let stream = self.report.stream;
                self.report = PlannerReport {
                    samples: plan.facts.samples,
                    strokes: plan.artwork.strokes.len() as u64,
                    plan_time,
                    duration: plan.facts.duration,
                    length: plan.facts.length,
                    ..self.report
                };
                let (sender, samples) = bounded(SAMPLED_AHEAD);
                let sampler = spawn("sample", move || {
                    for setpoint in plan.setpoints(stream) {
                        if sender.send(setpoint).is_err() {
                            return;
                        }
                    }
                })?;
                self.work = Work::Sending { samples, waiting: None, _sampler: sampler };
                self.enter(PlannerPhase::Streaming)
            }
            Err(refusal) => {
                let text = serde_json::to_vec_pretty(&refusal).map_err(std::io::Error::other)?;
                std::fs::write(folder.join(REFUSAL_FILE), text)?;
                self.work = Work::Idle;
                self.enter(PlannerPhase::Refused)
            }
        }
    }

    /// Sends as many setpoints as the controller has room for, less those still under way.
    fn send(&mut self) -> Result<(), ServiceError> {
        let Work::Sending { samples, waiting, .. } = &mut self.work else { return Ok(()) };
        let progress = &self.newest_progress;
        if progress.stream != self.report.stream {
            return Ok(());
        }
        let under_way = self.report.sent.saturating_sub(progress.accepted);
        let mut licence = progress.room.saturating_sub(under_way);
        while licence > 0 {
            let next = match waiting.take() {
                Some(setpoint) => Ok(setpoint),
                None => samples.try_recv(),
            };
            let mut setpoint = match next {
                Ok(setpoint) => setpoint,
                Err(TryRecvError::Empty) => return Ok(()),
                Err(TryRecvError::Disconnected) => {
                    self.work = Work::Idle;
                    return self.enter(PlannerPhase::Sent);
                }
            };
            setpoint.published = clock::now();
            if !self.setpoints.publish(&setpoint)? {
                *waiting = Some(setpoint);
                return Ok(());
            }
            self.report.sent += 1;
            licence -= 1;
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

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<JoinHandle<()>> {
    std::thread::Builder::new().name(name.to_owned()).spawn(work)
}

/// Reads and plans the job of a run folder, from where the joints stand.
fn plan_request(
    folder: &Path,
    machine: &Machine,
    standing: Option<&AxisArray>,
) -> Result<Plan, Refusal> {
    let text = std::fs::read(folder.join(REQUEST_FILE)).map_err(Refusal::internal)?;
    let request: JobRequest = serde_json::from_slice(&text).map_err(Refusal::internal)?;
    let mut job = request.read(machine)?;
    if let Some(position) = standing {
        approach(&mut job, machine, position)?;
    }
    plan(machine, &job).map_err(|error| request.refuse(&error))
}

/// Lets the job begin where the axes stand, with a rapid to where it wants to begin.
fn approach(job: &mut Job, machine: &Machine, position: &AxisArray) -> Result<(), Refusal> {
    let tool = machine.mechanism.visit(ToolAt { position }).map_err(Refusal::internal)?;
    if (tool - job.drawing.start).norm() > START_TOLERANCE {
        job.approach_from(tool);
    }
    Ok(())
}

struct ToolAt<'a> {
    position: &'a AxisArray,
}

impl MechanismVisitor for ToolAt<'_> {
    type Output = Result<Vector3<f64>, machine::kinematics::KinematicsError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let joints = nalgebra::SVector::from_fn(|axis, _| self.position[axis]);
        Ok(mechanism.forward(&joints, M::Branch::default())?.position)
    }
}

fn write_plan(folder: &Path, plan: &Plan) -> Result<(), Refusal> {
    let write = |name: &str, content: serde_json::Result<Vec<u8>>| {
        std::fs::write(folder.join(name), content.map_err(std::io::Error::other)?)
    };
    write(ARTWORK_FILE, serde_json::to_vec(&plan.artwork))
        .and_then(|()| write(PLAN_FILE, serde_json::to_vec_pretty(&plan.facts)))
        .map_err(Refusal::internal)
}
