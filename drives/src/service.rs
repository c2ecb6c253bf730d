//! The drives service: owns the clock of the machine and moves samples between the bridge and the
//! channels.
//!
//! A cycle: sleep until the deadline, look whether the peers live, let the bridge apply and
//! measure, publish the feedback, wait for the command with a bound, latch it. The bound is strict
//! on hardware and with `--strict`; simulated drives wait longer for a controller that is alive,
//! and move the later deadlines by what that took.

use crate::bridge::{Bridge, BridgeOptions, Deadlines, GatePermission};
use crate::port::{Freshness, Port};
use runtime::clock::{self, PeriodicClock};
use runtime::peer::{PeerState, Peers};
use runtime::thread::{self, RealtimeOptions};
use runtime::wake::{Listener, Notifier, Wake};
use runtime::{Domain, Publisher, Reading, Role, ServiceError, Subscriber, signal};
use signals::time::CYCLE_PERIOD;
use signals::{Command, DrivesReport, FaultCode, Feedback, Nanoseconds};

/// How long drives waits for a command in its cycle, from the deadline, when it is strict.
const STRICT_BOUND: Nanoseconds = Nanoseconds(300_000);

/// How long simulated drives wait for the command of a controller that is alive.
const SLIPPING_BOUND: Nanoseconds = Nanoseconds(100_000_000);

/// Cycles between two reports.
const REPORT_INTERVAL: u64 = 100;

/// Cycles after which a service that shall end no longer waits for the axes to rest.
const LAST_PATIENCE: u64 = 3000;

/// How the service runs.
#[derive(Debug, Clone, Copy)]
pub struct ServiceOptions {
    /// Whether the clock may slip.
    pub deadlines: Deadlines,
    /// Real-time set-up of the cycle's thread.
    pub realtime: RealtimeOptions,
    /// How long before a deadline the thread stops sleeping and spins, 0 to only sleep.
    pub margin: Nanoseconds,
}

/// Runs until it is told to end (SIGTERM) or nobody is left to obey; the axes are at rest then.
///
/// # Errors
/// When a channel fails. The port is dropped, dark and unpowered, before this returns.
pub fn run(
    domain: &Domain,
    port: Box<dyn Port + Send>,
    options: &ServiceOptions,
) -> Result<(), ServiceError> {
    let mut cycle = ServiceCycle::open(domain, port, options)?;
    let realtime = thread::enter_realtime(&options.realtime);
    let mut clock = PeriodicClock::new(CYCLE_PERIOD, options.margin);
    let mut patience = LAST_PATIENCE;
    loop {
        clock.wait();
        let vitality = cycle.look_after_peers();
        cycle.begin(clock.deadline())?;
        cycle.await_command(vitality)?;
        cycle.bridge.finish(clock::now());

        let report = cycle.bridge.report(realtime.facts);
        if report.cycle.0.is_multiple_of(REPORT_INTERVAL) || cycle.has_news(&report) {
            cycle.publish(&report)?;
        }
        if cycle.shall_end(vitality) {
            patience -= 1;
            if report.at_rest == 1 || patience == 0 {
                cycle.publish(&report)?;
                return Ok(());
            }
        }
        clock.advance();
        if options.deadlines == Deadlines::Slipping {
            clock.slip();
        }
    }
}

/// Who is there, as one look at the peers tells.
#[derive(Debug, Clone, Copy)]
struct Vitality {
    controller: PeerState,
    supervisor: PeerState,
}

struct ServiceCycle {
    bridge: Bridge,
    deadlines: Deadlines,
    peers: Peers,
    feedbacks: Publisher<Feedback>,
    reports: Publisher<DrivesReport>,
    commands: Subscriber<Command>,
    feedback_wake: Notifier,
    command_wake: Listener,
    reported: DrivesReport,
}

impl ServiceCycle {
    fn open(
        domain: &Domain,
        port: Box<dyn Port + Send>,
        options: &ServiceOptions,
    ) -> Result<Self, ServiceError> {
        let bridge_options =
            BridgeOptions { epoch: clock::now().0.unsigned_abs(), deadlines: options.deadlines };
        Ok(Self {
            bridge: Bridge::new(port, bridge_options),
            deadlines: options.deadlines,
            peers: Peers::watch(domain, &[Role::Domain, Role::Planner, Role::Controller])?,
            feedbacks: domain.publisher()?,
            reports: domain.publisher()?,
            commands: domain.subscriber(Reading::Newest)?,
            feedback_wake: domain.notifier(Wake::Feedback)?,
            command_wake: domain.listener(Wake::Command)?,
            reported: DrivesReport::default(),
        })
    }

    /// A peer that has died closes the gate at this very deadline; without a controller the axes
    /// are stopped here, because nobody else can.
    fn look_after_peers(&mut self) -> Vitality {
        let planner = self.peers.state(Role::Planner);
        let vitality = Vitality {
            controller: self.peers.state(Role::Controller),
            supervisor: self.peers.state(Role::Domain),
        };
        let dead = [planner, vitality.controller, vitality.supervisor].contains(&PeerState::Dead);
        self.bridge.permit(if dead { GatePermission::Inhibited } else { GatePermission::Granted });
        if vitality.controller == PeerState::Dead {
            self.bridge.stop(FaultCode::ControllerLost, clock::now());
        }
        vitality
    }

    fn begin(&mut self, deadline: Nanoseconds) -> Result<(), ServiceError> {
        self.bridge.begin(clock::now(), deadline);
        let feedback = self.bridge.stamp(clock::now());
        self.feedbacks.publish(feedback)?;
        self.feedback_wake.notify()?;
        Ok(())
    }

    /// Latches the answer to this cycle's feedback, or lets the bound pass.
    fn await_command(&mut self, vitality: Vitality) -> Result<(), ServiceError> {
        let patient =
            self.deadlines == Deadlines::Slipping && vitality.controller == PeerState::Alive;
        let bound = if patient { SLIPPING_BOUND } else { STRICT_BOUND };
        let until = self.bridge.feedback().deadline + bound;
        loop {
            while let Some(command) = self.commands.newest()? {
                if self.bridge.latch(&command, clock::now()) == Freshness::Fresh {
                    return Ok(());
                }
            }
            if clock::now() >= until || self.controller_is_gone(patient) {
                self.bridge.miss();
                return Ok(());
            }
            self.command_wake.wait_until(self.next_look(until, patient))?;
        }
    }

    /// While waiting long for a controller, look every period whether it still lives.
    fn next_look(&self, until: Nanoseconds, patient: bool) -> Nanoseconds {
        if patient { until.min(clock::now() + CYCLE_PERIOD) } else { until }
    }

    fn controller_is_gone(&mut self, patient: bool) -> bool {
        patient && self.peers.state(Role::Controller) != PeerState::Alive
    }

    fn has_news(&self, report: &DrivesReport) -> bool {
        (report.at_rest, report.stops, report.gate_trips, report.fault.code)
            != (
                self.reported.at_rest,
                self.reported.stops,
                self.reported.gate_trips,
                self.reported.fault.code,
            )
    }

    fn publish(&mut self, report: &DrivesReport) -> Result<(), ServiceError> {
        self.reported = *report;
        self.reports.publish(report)?;
        Ok(())
    }

    /// Told to, or left alone: a controller that still lives brings the axes to rest first.
    fn shall_end(&self, vitality: Vitality) -> bool {
        signal::termination().is_some()
            || (vitality.supervisor == PeerState::Dead && vitality.controller != PeerState::Alive)
    }
}
