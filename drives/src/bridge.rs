//! One cycle between the samples and the port, as a step without input, output or clock.
//!
//! Duties, in the order of a cycle:
//!
//! 1. [`Bridge::begin`] at the deadline: puts in force what was latched in the cycle before,
//!    exchanges with the port, and fills the feedback. [`Bridge::stamp`] completes its time
//!    stamps just before it is published.
//! 2. [`Bridge::latch`] keeps the command that answers this feedback, or [`Bridge::miss`] says
//!    that none came. A command never acts before the next deadline, however early it comes.
//! 3. [`Bridge::finish`] when the cycle's work is done, so that overruns are counted.
//!
//! Before a begin, the service says whether every peer lives ([`Bridge::permit`]), and may stop
//! the axes ([`Bridge::stop`]).
//!
//! - *Fresh*: answers the newest feedback of this run of drives.
//! - *Overrun*: the cycle's work did not end before the next deadline.
//! - *Slip*: an overrun that simulated drives waited for; the deadlines that follow moved.
//! - *Skipped*: a cycle that drives, with strict deadlines, was too late for. Nobody measures in it,
//!   the gate is closed, the axes go on with what was in force, and the cycle numbers go on with the
//!   time: the deadline of cycle `n` stays `start + n × period`, by the clock of the bus where there is one.
//! - *Stall*: a time in which the cycle stood still; see [`messages::Stalls`].

use machine::{Machine, Timing};
use messages::{
    ActuatorArray, Command, CommandMode, Cycle, DrivesReport, Fault, FaultCode, Feedback,
    MAX_ACTUATORS, Nanoseconds, RealtimeFacts, StallCause, feedback::status,
};

use crate::discipline::Discipline;
use crate::port::{self, Actuation, Freshness, Measurement, Port, PortClock, PortError, Power};
use crate::stalls::{Stall, StallAccount};
pub use crate::watchdog::GatePermission;
use crate::watchdog::{Watch, Watchdog};

/// Time without a single encoder count after which an axis counts as at rest: at one count
/// (1/4096 of a turn) in 20 ms it would turn with less than 0.08 rad/s.
const REST: Nanoseconds = Nanoseconds(20_000_000);

/// Whether the clock waits for a controller that is late but alive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Deadlines {
    /// Never: hardware, and simulated drives with `--strict`.
    #[default]
    Strict,
    /// It may: simulated drives.
    Slipping,
}

/// How a bridge runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BridgeOptions {
    /// Identifies this run of drives: its start on the monotonic clock [ns].
    pub epoch: u64,
    /// Whether its clock may slip.
    pub deadlines: Deadlines,
    /// The period of the cycle, and how long the axes may go on without a fresh command.
    pub timing: Timing,
}

/// A command that waits for its deadline.
#[derive(Debug, Clone, Copy)]
struct Latched {
    command: Command,
    received: Nanoseconds,
}

/// How far the cycle at hand has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// No cycle has begun yet.
    Unstarted,
    /// Its deadline has come, its work is under way.
    Begun,
    /// Its work ended in time.
    Done,
    /// Its work ended after the next deadline, and that has been counted.
    Overrun,
}

/// A run of cycles without a fresh command that has not ended yet.
#[derive(Debug, Clone, Copy)]
struct Lack {
    cycle: Cycle,
    began: Nanoseconds,
    /// What explains it where the kernel tells nothing: bits of [`StallCause`].
    otherwise: u32,
}

/// What explains a stall in which drives was in time.
const LATE_ANSWER: u32 = StallCause::LateAnswer.bit();

/// The bridge between samples and a port.
pub struct Bridge {
    port: Box<dyn Port>,
    options: BridgeOptions,
    watchdog: Watchdog,
    permission: GatePermission,
    phase: Phase,
    latched: Option<Latched>,
    in_force: Actuation,
    measurement: Measurement,
    feedback: Feedback,
    discipline: Discipline,
    /// By how much the deadline to come is moved, beside a period after the one before.
    moved: Nanoseconds,
    slips: u64,
    /// Cycles without a single encoder count.
    resting: u64,
    lack: Option<Lack>,
    stalls: StallAccount,
    unexplained: Option<(u64, Stall)>,
}

impl core::fmt::Debug for Bridge {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter
            .debug_struct("Bridge")
            .field("options", &self.options)
            .field("watchdog", &self.watchdog)
            .field("cycle", &self.feedback.cycle)
            .finish_non_exhaustive()
    }
}

impl Bridge {
    /// A bridge to `port`, unpowered, dark, before its first cycle, which is number 0.
    pub fn new(port: Box<dyn Port>, options: BridgeOptions) -> Self {
        let actuators = port.profile().actuators.len();
        Self {
            port,
            options,
            watchdog: Watchdog::new(actuators, options.timing),
            permission: GatePermission::Granted,
            phase: Phase::Unstarted,
            latched: None,
            in_force: Actuation::DISABLED,
            measurement: Measurement::default(),
            feedback: Feedback { epoch: options.epoch, ..Feedback::default() },
            discipline: Discipline::new(options.timing.period),
            moved: Nanoseconds(0),
            slips: 0,
            resting: 0,
            lack: None,
            stalls: StallAccount::default(),
            unexplained: None,
        }
    }

    /// Opens the holding brakes by these outputs, one bit each, while the motors are powered.
    #[must_use]
    pub fn with_brakes(mut self, brakes: u64) -> Self {
        self.watchdog.set_brakes(brakes);
        self
    }

    /// Says whether the gate may open, from the next begin on until said otherwise.
    pub fn permit(&mut self, permission: GatePermission) {
        self.permission = permission;
    }

    /// Sets the inputs of a simulated machine that have no place of their own, one bit each.
    pub fn set_inputs(&mut self, inputs: u64) {
        self.port.set_inputs(inputs);
    }

    /// Stops the axes by the drive's own brake, from the next begin on, until a person resets.
    pub fn stop(&mut self, cause: FaultCode, now: Nanoseconds) {
        self.watchdog.stop(Fault::new(cause).at(now));
    }

    /// Opens the port and holds it to `machine`; the first thing that a service does, before its clock starts.
    ///
    /// # Errors
    /// As [`Port::open`]; a drive without the mode of its actuator, or with another latency than declared.
    pub fn open(&mut self, machine: &Machine) -> Result<(), PortError> {
        self.port.open()?;
        port::check(self.port.profile(), machine)
    }

    /// Leaves the port dark, unpowered and closed; the last thing that a service does.
    ///
    /// # Errors
    /// As [`Port::close`].
    pub fn close(&mut self) -> Result<(), PortError> {
        self.latched = None;
        self.in_force = Actuation::DISABLED;
        self.port.exchange(&self.in_force, &mut self.measurement);
        self.port.close()
    }

    /// The first deadline from `from` on that suits the port.
    pub fn first_deadline(&self, from: Nanoseconds) -> Nanoseconds {
        self.port.first_deadline(from)
    }

    /// Starts the cycle of `deadline` at `now`, not before it: puts the latched command in force,
    /// measures, and gives the feedback, whose `published` and `exchange` [`Self::stamp`] fills.
    ///
    /// With strict deadlines, each whole period beyond the one after the deadline before is a cycle
    /// that was skipped.
    pub fn begin(&mut self, now: Nanoseconds, deadline: Nanoseconds) -> &Feedback {
        let before = (self.watchdog.watch(), self.watchdog.misses());
        let skipped = self.count_late(now, deadline);
        let missed = self.watchdog.counts().missed;
        self.skip(skipped, now);
        self.engage(now);
        self.watch_lack(before, skipped, deadline);
        let missed = self.watchdog.counts().missed > missed;
        self.port.exchange(&self.in_force, &mut self.measurement);
        if self.measurement.fault.is_some() {
            self.in_force = self.watchdog.stop(Fault { at: now, ..self.measurement.fault });
        }
        let first = self.phase == Phase::Unstarted;
        self.describe(first, skipped);

        self.feedback.cycle = self.cycle_after(skipped);
        let feedback = &mut self.feedback;
        feedback.skipped = u16::try_from(skipped).unwrap_or(u16::MAX);
        feedback.deadline = deadline;
        feedback.measured = now;
        feedback.published = now;
        feedback.exchange = Nanoseconds(0);
        feedback.missed = self.watchdog.counts().missed;
        feedback.fault = *self.watchdog.fault();
        feedback.status = bit(status::COMMAND_MISSED, missed)
            | bit(status::POWERED, self.measurement.power == Power::On)
            | bit(status::TOOL_KNOWN, self.measurement.tool.is_some())
            | bit(status::WATCHDOG_TRIPPED, self.watchdog.watch() == Watch::Stopped)
            | bit(status::SLIPPING, self.options.deadlines == Deadlines::Slipping)
            | bit(status::GATE_INHIBITED, self.permission == GatePermission::Inhibited);
        self.phase = Phase::Begun;
        &self.feedback
    }

    /// The feedback as it is published at `now`, the exchange having just ended.
    pub fn stamp(&mut self, now: Nanoseconds) -> &Feedback {
        self.feedback.exchange = now - self.feedback.measured;
        self.feedback.published = now;
        &self.feedback
    }

    /// Keeps `command`, which reached drives at `received`, for the next deadline if it is fresh.
    /// Of several the newest counts.
    pub fn latch(&mut self, command: &Command, received: Nanoseconds) -> Freshness {
        let answers = command.epoch == self.options.epoch
            && command.cycle == self.feedback.cycle
            && self.phase != Phase::Unstarted;
        if !answers {
            return Freshness::Stale;
        }
        self.latched = Some(Latched { command: *command, received });
        Freshness::Fresh
    }

    /// Cycles in a row, to now, without a fresh command.
    pub fn misses(&self) -> u64 {
        self.watchdog.misses()
    }

    /// Says that no command is to be expected any more in this cycle.
    pub fn miss(&mut self) {
        self.latched = None;
    }

    /// Ends the work of the cycle.
    pub fn finish(&mut self, now: Nanoseconds) {
        if self.phase != Phase::Begun {
            return;
        }
        self.phase = Phase::Done;
        if now > self.feedback.deadline + self.options.timing.period.time() {
            self.phase = Phase::Overrun;
            self.feedback.overruns += 1;
        }
    }

    /// By how much the next deadline is to be moved, beside a period after this one, to follow the clock of
    /// the port; once in a cycle, after its work.
    pub fn follow_clock(&mut self) -> Nanoseconds {
        self.moved = match (self.port.profile().clock, self.measurement.clock_offset) {
            (PortClock::Bus, Some(ahead)) => self.discipline.follow(ahead),
            (PortClock::Bus, None) => self.discipline.coast(),
            (PortClock::Ours, _) => Nanoseconds(0),
        };
        self.port.moved(self.moved);
        self.moved
    }

    /// The newest feedback.
    pub fn feedback(&self) -> &Feedback {
        &self.feedback
    }

    /// What was counted so far.
    pub fn report(&self, realtime: RealtimeFacts) -> DrivesReport {
        let counts = self.watchdog.counts();
        let braked = matches!(self.in_force.mode, CommandMode::Disabled | CommandMode::QuickStop);
        let lit = self.in_force.laser.is_lit();
        DrivesReport {
            cycle: self.feedback.cycle,
            overruns: self.feedback.overruns,
            slips: self.slips,
            missed: counts.missed,
            gate_trips: counts.gate_trips,
            stops: counts.stops,
            at_rest: u32::from(braked && self.at_rest() && !lit),
            lit: u32::from(lit),
            fault: self.feedback.fault,
            stalls: *self.stalls.stalls(),
            link: self.port.link(),
            realtime,
        }
    }

    fn at_rest(&self) -> bool {
        self.resting >= self.options.timing.period.cycles_for(REST)
    }

    /// The stall that has ended in the newest begin, or stopped the axes there, to be explained by
    /// whoever can ask the kernel; with the number for [`Self::explain`].
    pub fn take_stall(&mut self) -> Option<(u64, Stall)> {
        self.unexplained.take()
    }

    /// Why the stall with this number was: bits of [`StallCause`].
    pub fn explain(&mut self, number: u64, causes: u32) {
        self.stalls.explain(number, causes);
    }

    /// A deadline later than one period after the last means that the clock slipped, or on strict
    /// deadlines that cycles were skipped. Counts either; returns how many were skipped.
    fn count_late(&mut self, now: Nanoseconds, deadline: Nanoseconds) -> u64 {
        let period = self.options.timing.period;
        let due = self.feedback.deadline + period.time() + self.moved;
        let late = deadline - due;
        if self.phase == Phase::Unstarted || late.0 <= 0 {
            return 0;
        }
        let counted = u64::from(self.phase == Phase::Overrun);
        let (overruns, skipped) = match self.options.deadlines {
            Deadlines::Slipping => {
                self.slips += 1;
                if late >= period.time() {
                    let published = self.latched.as_ref().map_or(now, |it| it.command.published);
                    let otherwise = if published < due { 0 } else { LATE_ANSWER };
                    let cycle = self.cycle_after(0);
                    self.note(Stall { cycle, began: due, length: late, otherwise });
                }
                (1, 0)
            }
            Deadlines::Strict => (period.cycles_for(late), period.cycles_in(late)),
        };
        self.feedback.overruns += overruns.saturating_sub(counted);
        skipped
    }

    /// Goes through the cycles that drives was too late for. A command that waits was for the first
    /// of them, and acts in no other.
    fn skip(&mut self, skipped: u64, now: Nanoseconds) {
        if skipped == 0 {
            return;
        }
        self.latched = None;
        let port = &mut self.port;
        self.watchdog.skip(skipped, now, |actuation| port.pass(actuation));
    }

    /// Follows a run of cycles without a fresh command: it is a stall once it has ended, or has
    /// stopped the axes. `before` is the watchdog's state, and the length of the run, before this
    /// begin.
    fn watch_lack(&mut self, before: (Watch, u64), skipped: u64, deadline: Nanoseconds) {
        if self.options.deadlines == Deadlines::Slipping || before.0 != Watch::Following {
            self.lack = None;
            return;
        }
        let misses = self.watchdog.misses();
        if misses > 0 {
            let began = deadline - self.options.timing.period.of(skipped);
            let lack = Lack { cycle: self.cycle_after(0), began, otherwise: LATE_ANSWER };
            let lack = self.lack.get_or_insert(lack);
            if skipped > 0 {
                lack.otherwise = 0;
            }
        }
        let stopped = self.watchdog.watch() == Watch::Stopped;
        if misses == 0 || stopped {
            let cycles = if misses == 0 { before.1 } else { misses };
            let length = self.options.timing.period.of(cycles);
            if let Some(Lack { cycle, began, otherwise }) = self.lack.take() {
                self.note(Stall { cycle, began, length, otherwise });
            }
        }
    }

    fn note(&mut self, stall: Stall) {
        self.unexplained = Some((self.stalls.note(&stall), stall));
    }

    /// The number of the cycle that follows the newest, with so many left out.
    fn cycle_after(&self, skipped: u64) -> Cycle {
        match self.phase {
            Phase::Unstarted => Cycle(0),
            _ => Cycle(self.feedback.cycle.0 + 1 + skipped),
        }
    }

    /// Decides what is in force in the cycle that begins.
    fn engage(&mut self, now: Nanoseconds) {
        let resting = self.at_rest();
        let latched = self.latched.take();
        let command = latched.as_ref().map(|latched| &latched.command);
        self.in_force = self.watchdog.decide(command, self.permission, resting, now);
        if let Some(Latched { command, received }) = &latched
            && self.watchdog.watch() == Watch::Following
        {
            self.feedback.command_cycle = command.cycle;
            self.feedback.command_received = *received;
            self.feedback.command_published = command.published;
            self.feedback.command_applied = now;
        }
        if let Some(command) = command {
            self.stalls.play(command.stream);
        }
    }

    /// Copies the measurement into the feedback; `first` has nothing before it to differ from, and
    /// that lies `skipped` cycles further back than usual.
    fn describe(&mut self, first: bool, skipped: u64) {
        let measured = &self.measurement;
        let cycle_time = self.options.timing.period.seconds();
        let actuators = self.port.profile().actuators.len().min(MAX_ACTUATORS);
        let mut velocity: ActuatorArray = [0.0; MAX_ACTUATORS];
        let moved = measured.counts != self.feedback.counts;
        if !first {
            let pairs = measured.position.iter().zip(&self.feedback.position);
            for (velocity, (now, before)) in velocity.iter_mut().zip(pairs).take(actuators) {
                *velocity = (now - before) / (cycle_time * (1.0 + skipped as f64));
            }
        }
        self.resting = if first || moved { 0 } else { self.resting.saturating_add(1) };
        self.feedback.velocity = velocity;
        self.feedback.counts = measured.counts;
        self.feedback.position = measured.position;
        self.feedback.current = measured.current;
        self.feedback.inputs = measured.inputs;
        self.feedback.homing = measured.homing;
        self.feedback.tool = measured.tool.unwrap_or_default();
        self.feedback.laser = measured.laser;
    }
}

/// `mask` if `set`.
fn bit(mask: u32, set: bool) -> u32 {
    if set { mask } else { 0 }
}
