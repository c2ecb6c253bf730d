//! The drives service: owns the clock of the machine and moves samples between the bridge and the
//! channels.
//!
//! A cycle: sleep until the deadline, check whether the peers live, let the bridge apply and
//! measure, publish the feedback, wait for the command with a bound, latch it. The bound is strict
//! on hardware and with `--strict`; simulated drives wait longer for a controller that is alive and
//! followed, and move the later deadlines by what that took. Strict deadlines never move: those after
//! which another has passed are skipped, and the cycle goes on with the newest.
//!
//! Each stall is handed to a thread that is not real-time, which asks the kernel for its causes.
//!
//! Told to end, or left by the supervisor, the service closes the gate at once. A live controller
//! then brings the axes to rest; where it does not, drives stops them, and leaves when they rest.

use crate::bridge::{Bridge, BridgeOptions, Deadlines, GatePermission};
use crate::port::{Freshness, Port, PortError};
use machine::Machine;
use messages::feedback::status;
use messages::report::refused;
use messages::time::Period;
use messages::{
    Command, DrivesReport, FaultCode, Feedback, Nanoseconds, RealtimeFacts, SimulatedInputs,
};
use runtime::clock::{self, PeriodicClock};
use runtime::peer::{PeerState, Peers};
use runtime::stall::{StallNote, StallWatch};
use runtime::thread::{self, RealtimeOptions};
use runtime::wake::{Listener, Notifier, Wake};
use runtime::{Domain, Publisher, Role, Samples, ServiceError, Subscriber, message, signal};

/// Part of the period for which drives waits for a command, from the deadline or the feedback, whichever
/// was later, when it is strict: what made drives late is not the controller's to make up for. 300 µs
/// of 1 ms.
const STRICT_BOUND: [i64; 2] = [3, 10];

/// The largest part of the period for which drives spins before a deadline: what is left is the
/// controller's, on the same core.
const SPIN_PART: i64 = 10;

/// How long simulated drives wait for the command of a controller that is alive.
const SLIPPING_BOUND: Nanoseconds = Nanoseconds(100_000_000);

/// After how many such waits in a row without an answer drives takes the controller to hang.
const SLIPS_IN_VAIN: u64 = 3;

/// Time between two reports.
const REPORT_INTERVAL: Nanoseconds = Nanoseconds(100_000_000);

/// How long a service that shall end leaves the axes to a live controller.
const CONTROLLER_PATIENCE: Nanoseconds = Nanoseconds(1_000_000_000);

/// How long a service that shall end waits for the axes to rest.
const LAST_PATIENCE: Nanoseconds = Nanoseconds(3_000_000_000);

/// How the service runs.
#[derive(Debug, Clone, Copy)]
pub struct ServiceOptions {
    /// Whether the clock may slip.
    pub deadlines: Deadlines,
    /// Real-time set-up of the cycle's thread.
    pub realtime: RealtimeOptions,
}

/// Drives `machine` by `port` until it is told to end (SIGTERM) or the supervisor dies; the axes are at rest then.
///
/// # Errors
/// When the port cannot be opened or closed, a channel fails, or another pipeline owns the real-time core. The
/// port is unpowered, dark and closed before this returns.
pub fn run(
    domain: &Domain,
    machine: &Machine,
    port: Box<dyn Port>,
    options: &ServiceOptions,
) -> Result<(), ServiceError> {
    let mut cycle = ServiceCycle::open(domain, port, options, machine)?;
    let result = cycle.drive(machine, options);
    let closed = cycle.bridge.close().map_err(work);
    result.and(closed)
}

/// A failure of the port as one of the service.
fn work(error: PortError) -> ServiceError {
    ServiceError::Work(error.to_string())
}

/// Who is there, as one check of the peers tells.
#[derive(Debug, Clone, Copy)]
struct Vitality {
    planner: PeerState,
    controller: PeerState,
    supervisor: PeerState,
}

impl Vitality {
    /// Whether all are known to live. A peer that nobody has seen yet may be dead already.
    fn is_complete(self) -> bool {
        [self.planner, self.controller, self.supervisor].iter().all(|s| *s == PeerState::Alive)
    }
}

struct ServiceCycle {
    bridge: Bridge,
    period: Period,
    deadlines: Deadlines,
    peers: Peers,
    feedbacks: Publisher<Feedback>,
    reports: Publisher<DrivesReport>,
    commands: Subscriber<Command>,
    simulated: Subscriber<SimulatedInputs>,
    feedback_wake: Notifier,
    command_wake: Listener,
    /// None where the operating system gives no thread: stalls stay unexplained.
    stalls: Option<StallWatch>,
    reported: DrivesReport,
    /// Since when the service shall end.
    leaving: Option<Nanoseconds>,
}

impl ServiceCycle {
    fn open(
        domain: &Domain,
        port: Box<dyn Port>,
        options: &ServiceOptions,
        machine: &Machine,
    ) -> Result<Self, ServiceError> {
        let timing = machine.realtime;
        let bridge_options = BridgeOptions {
            epoch: clock::now().0.unsigned_abs(),
            deadlines: options.deadlines,
            timing,
        };
        Ok(Self {
            bridge: Bridge::new(port, bridge_options).with_brakes(machine.operating.brakes()),
            period: timing.period,
            deadlines: options.deadlines,
            peers: Peers::watch(domain, &[Role::Domain, Role::Planner, Role::Controller])?,
            feedbacks: domain.publisher()?,
            reports: domain.publisher()?,
            commands: domain.subscriber(Samples::Latest)?,
            simulated: domain.subscriber(Samples::Latest)?,
            feedback_wake: domain.notifier(Wake::Feedback)?,
            command_wake: domain.listener(Wake::Command)?,
            stalls: StallWatch::start().ok(),
            reported: DrivesReport::default(),
            leaving: None,
        })
    }

    /// Opens the port, and drives what is behind it until the end.
    fn drive(&mut self, machine: &Machine, options: &ServiceOptions) -> Result<(), ServiceError> {
        self.bridge.open(machine).map_err(work)?;
        // What was refused is in the facts, which travel with the reports to the summary.
        let mut realtime = thread::enter_realtime(&options.realtime);
        let core = realtime.claim_core()?;
        if core.as_ref().is_some_and(|core| core.squatter().is_some()) {
            // A person who starts drives by hand has no summary to look at.
            let facts = RealtimeFacts { refused: refused::CLAIM, ..realtime.facts };
            thread::missing(&[("drives", facts)])
                .iter()
                .for_each(|warning| message::tell(&format!("drives: {warning}")));
        }
        self.keep_running(realtime.spin_margin(), realtime.facts)
    }

    fn keep_running(
        &mut self,
        margin: Nanoseconds,
        facts: RealtimeFacts,
    ) -> Result<(), ServiceError> {
        let period = self.period.time();
        let margin = margin.min(Nanoseconds(period.0 / SPIN_PART));
        let report_interval = self.period.cycles_for(REPORT_INTERVAL);
        let clock = PeriodicClock::new(period, margin);
        let first = self.bridge.first_deadline(clock.deadline());
        let mut clock = clock.starting_at(first);
        loop {
            clock.wait();
            let vitality = self.check_peers();
            // The last thing before the exchange: what is late then must not act as if it were not.
            if self.deadlines == Deadlines::Strict {
                clock.skip();
            }
            self.begin(clock.deadline())?;
            self.await_command(vitality)?;
            self.bridge.finish(clock::now());
            self.account_for_stalls();

            let report = self.bridge.report(facts);
            if report.cycle.0.is_multiple_of(report_interval) || self.has_news(&report) {
                self.publish(&report)?;
            }
            if self.may_end(&report) {
                return self.publish(&report);
            }
            clock.advance();
            clock.shift(self.bridge.follow_clock());
            if self.deadlines == Deadlines::Slipping {
                clock.slip();
            }
        }
    }

    /// A peer that does not live closes the gate at this very deadline, and so does the end of this
    /// service; without a controller the axes are stopped here, because nobody else can.
    fn check_peers(&mut self) -> Vitality {
        let vitality = Vitality {
            planner: self.peers.state(Role::Planner),
            controller: self.peers.state(Role::Controller),
            supervisor: self.peers.state(Role::Domain),
        };
        let now = clock::now();
        if signal::termination().is_some() || vitality.supervisor == PeerState::Dead {
            self.leaving.get_or_insert(now);
        }
        let granted = vitality.is_complete() && self.leaving.is_none();
        self.bridge.permit(if granted {
            GatePermission::Granted
        } else {
            GatePermission::Inhibited
        });
        if vitality.controller == PeerState::Dead {
            self.bridge.stop(FaultCode::ControllerLost, now);
        }
        let left_alone = self.leaving.is_some_and(|since| now - since > CONTROLLER_PATIENCE);
        if left_alone {
            let lost = vitality.supervisor == PeerState::Dead;
            let cause = if lost { FaultCode::SupervisorLost } else { FaultCode::DrivesLost };
            self.bridge.stop(cause, now);
        }
        vitality
    }

    fn begin(&mut self, deadline: Nanoseconds) -> Result<(), ServiceError> {
        if let Some(simulated) = self.simulated.newest()? {
            self.bridge.set_inputs(simulated.inputs);
        }
        self.bridge.begin(clock::now(), deadline);
        let feedback = self.bridge.stamp(clock::now());
        self.feedbacks.publish(feedback)?;
        self.feedback_wake.notify()?;
        Ok(())
    }

    /// Latches the answer to this cycle's feedback, or lets the bound pass.
    fn await_command(&mut self, vitality: Vitality) -> Result<(), ServiceError> {
        // A controller that is not followed any more is not worth waiting for, nor one that has
        // been waited for in vain.
        let patient = self.deadlines == Deadlines::Slipping
            && vitality.controller == PeerState::Alive
            && !self.bridge.feedback().has(status::WATCHDOG_TRIPPED)
            && self.bridge.misses() < SLIPS_IN_VAIN;
        let Feedback { deadline, published, .. } = *self.bridge.feedback();
        let until = if patient {
            deadline + SLIPPING_BOUND
        } else {
            let [part, whole] = STRICT_BOUND;
            deadline.max(published) + Nanoseconds(self.period.time().0 * part / whole)
        };
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

    /// While waiting long for a controller, check every period whether it still lives.
    fn next_look(&self, until: Nanoseconds, patient: bool) -> Nanoseconds {
        if patient { until.min(clock::now() + self.period.time()) } else { until }
    }

    fn controller_is_gone(&mut self, patient: bool) -> bool {
        patient && self.peers.state(Role::Controller) != PeerState::Alive
    }

    /// Hands on a stall that is to be explained, and takes an explanation.
    fn account_for_stalls(&mut self) {
        let Some(watch) = &self.stalls else { return };
        if let Some((number, stall)) = self.bridge.take_stall() {
            let to = stall.began + stall.length;
            watch.tell(StallNote { number, from: stall.began, to, otherwise: stall.otherwise });
        }
        if let Some(explanation) = watch.explained() {
            self.bridge.explain(explanation.number, explanation.causes);
        }
    }

    fn has_news(&self, report: &DrivesReport) -> bool {
        let news = |report: &DrivesReport| {
            let DrivesReport { at_rest, stops, gate_trips, fault, stalls, .. } = *report;
            (at_rest, stops, gate_trips, fault.code, stalls)
        };
        news(report) != news(&self.reported)
    }

    fn publish(&mut self, report: &DrivesReport) -> Result<(), ServiceError> {
        self.reported = *report;
        self.reports.publish(report)?;
        Ok(())
    }

    /// Whether it shall end and the axes rest, or will not any more.
    fn may_end(&self, report: &DrivesReport) -> bool {
        let waited = self.leaving.map(|since| clock::now() - since);
        waited.is_some_and(|waited| report.at_rest == 1 || waited > LAST_PATIENCE)
    }
}
