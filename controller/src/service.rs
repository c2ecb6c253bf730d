//! The controller service: woken by the feedback, it answers with one command in the same cycle.
//!
//! It moves samples between the channels and [`Controller::step`] and decides nothing itself. The
//! thread that takes operators' requests is not real-time; a lock-free queue lies between.

use crate::controller::Controller;
use crate::exchange::{Inputs, Outputs, Peers as PeersPresent, Presence};
use crate::slow::Slow;
use machine::Machine;
use messages::{
    Command, ControllerReport, ControllerState, Feedback, Nanoseconds, OperatorRequest,
    OperatorVerb, Progress, Setpoint, SlowInputs,
};
use runtime::clock;
use runtime::operator::OperatorQueue;
use runtime::peer::{PeerState, Peers};
use runtime::thread::{self, RealtimeOptions};
use runtime::wake::{Listener, Notifier, Wake};
use runtime::{Domain, Publisher, Role, Samples, ServiceError, Subscriber, signal};

/// Setpoints taken in one cycle at most: a late planner is caught up with over several cycles.
const DRAIN: usize = 16;

/// How long to wait for a wake before checking the peers.
const POLL_INTERVAL: Nanoseconds = Nanoseconds(100_000_000);

/// Runs until it is told to end (SIGTERM), or the supervisor has died and the axes are at rest.
///
/// # Errors
/// When a channel fails.
pub fn run(
    domain: &Domain,
    machine: &Machine,
    realtime: &RealtimeOptions,
) -> Result<(), ServiceError> {
    let mut cycle = ServiceCycle::open(domain, machine)?;
    // What was refused is in the facts, which travel with the reports to the summary.
    let realtime = thread::enter_realtime(realtime);
    cycle.controller.set_realtime(realtime.facts);
    cycle.wake.drain()?;
    loop {
        let woken = cycle.wake.wait_until(clock::now() + POLL_INTERVAL)?;
        while let Some(feedback) = cycle.feedbacks.newest()? {
            cycle.answer(&feedback, clock::now())?;
        }
        if !woken {
            cycle.greet()?;
            cycle.check_drives()?;
        }
        if cycle.shall_end() {
            return Ok(());
        }
    }
}

struct ServiceCycle {
    controller: Controller,
    outputs: Outputs,
    setpoints_taken: Vec<Setpoint>,
    told_to_stop: bool,
    peers: Peers,
    operators: OperatorQueue,
    feedbacks: Subscriber<Feedback>,
    setpoints: Subscriber<Setpoint>,
    /// `None` where the machine has no slow devices.
    slow: Option<(Subscriber<SlowInputs>, Slow)>,
    commands: Publisher<Command>,
    progress: Publisher<Progress>,
    reports: Publisher<ControllerReport>,
    wake: Listener,
    answered: Notifier,
}

impl ServiceCycle {
    fn open(domain: &Domain, machine: &Machine) -> Result<Self, ServiceError> {
        let mut watched = vec![Role::Domain, Role::Planner, Role::Drives];
        let mut slow = None;
        if !machine.operating.devices.is_empty() {
            let mut said = Slow::new(machine);
            // Until they have spoken they are silent.
            said.hear(&SlowInputs::default());
            slow = Some((domain.subscriber(Samples::Latest)?, said));
            watched.push(Role::Modbus);
        }
        Ok(Self {
            controller: Controller::new(machine),
            outputs: Outputs::default(),
            setpoints_taken: Vec::with_capacity(DRAIN),
            told_to_stop: false,
            peers: Peers::watch(domain, &watched)?,
            operators: OperatorQueue::start(domain)?,
            feedbacks: domain.subscriber(Samples::Latest)?,
            setpoints: domain.subscriber(Samples::All)?,
            slow,
            commands: domain.publisher()?,
            progress: domain.publisher()?,
            reports: domain.publisher()?,
            wake: domain.listener(Wake::Feedback)?,
            answered: domain.notifier(Wake::Command)?,
        })
    }

    fn answer(&mut self, feedback: &Feedback, received: Nanoseconds) -> Result<(), ServiceError> {
        self.setpoints_taken.clear();
        while self.setpoints_taken.len() < DRAIN.min(self.controller.room()) {
            let Some(setpoint) = self.setpoints.receive()? else { break };
            self.setpoints_taken.push(setpoint);
        }
        let request = self.request();
        let (peers, slow) = (self.present(), self.slow(received)?);
        let setpoints = &self.setpoints_taken;
        let inputs = Inputs { feedback, received, setpoints, request, peers, slow };
        self.controller.step(received, &inputs, &mut self.outputs);

        // The command first: everything else can wait until drives has it.
        self.outputs.command.published = clock::now();
        self.commands.publish(&self.outputs.command)?;
        self.answered.notify()?;
        if let Some(reply) = self.outputs.reply {
            self.operators.answer(reply);
        }
        self.report()
    }

    /// No feedback has come for long: if drives is dead none will, and whoever waits for the end of
    /// a stream must hear of it.
    fn check_drives(&mut self) -> Result<(), ServiceError> {
        if self.peers.state(Role::Drives) != PeerState::Dead {
            return Ok(());
        }
        self.controller.abandon(clock::now(), &mut self.outputs);
        self.report()
    }

    /// Without feedback there is no cycle, and nothing is published: who joins now hears here what
    /// was said last.
    fn greet(&mut self) -> Result<(), ServiceError> {
        self.progress.greet()?;
        self.reports.greet()?;
        Ok(())
    }

    fn report(&mut self) -> Result<(), ServiceError> {
        if let Some(progress) = &mut self.outputs.progress {
            progress.published = clock::now();
            self.progress.publish(progress)?;
        }
        if let Some(report) = &self.outputs.report {
            self.reports.publish(report)?;
        }
        Ok(())
    }

    /// The oldest request of a person; being told to end is one too, to stop.
    fn request(&mut self) -> Option<OperatorRequest> {
        if let Some(request) = self.operators.take() {
            return Some(request);
        }
        if self.told_to_stop || signal::termination().is_none() {
            return None;
        }
        self.told_to_stop = true;
        Some(OperatorRequest { verb: OperatorVerb::Stop as u32, ..OperatorRequest::default() })
    }

    fn present(&mut self) -> PeersPresent {
        PeersPresent {
            planner: self.presence(Role::Planner),
            drives: self.presence(Role::Drives),
            supervisor: self.presence(Role::Domain),
        }
    }

    fn presence(&mut self, role: Role) -> Presence {
        match self.peers.state(role) {
            PeerState::Dead => Presence::Lost,
            PeerState::Unknown | PeerState::Alive => Presence::Present,
        }
    }

    /// The inputs that slow devices make active at `now`, one bit each.
    fn slow(&mut self, now: Nanoseconds) -> Result<u64, ServiceError> {
        let asking = self.presence(Role::Modbus);
        let Some((words, said)) = &mut self.slow else { return Ok(0) };
        if let Some(newest) = words.newest()? {
            said.hear(&newest);
        }
        Ok(said.active(now, asking))
    }

    /// Told to end, or without a supervisor; never while the axes may still be moving, unless nobody moves them.
    fn shall_end(&mut self) -> bool {
        let supervisor = self.peers.state(Role::Domain);
        if signal::termination().is_none() && supervisor != PeerState::Dead {
            return false;
        }
        let state = self.outputs.command.state();
        let resting = matches!(
            state,
            ControllerState::Disabled | ControllerState::Idle | ControllerState::Faulted
        );
        resting || self.peers.state(Role::Drives) == PeerState::Dead
    }
}
