//! The controller: one feedback in, one command out.
//!
//! # Duties
//!
//! - Play the stream: references, voltages and gate edges for the cycle in which they act.
//! - Close the loops on each motor: position, velocity, current.
//! - Watch: setpoints, feedback, following error, limits, peers. Any doubt leads to the safe
//!   state: laser off with this very command, then the axes to rest.
//! - Answer people: enable, disable, start, hold, resume, stop, reset, override.
//!
//! # Modes
//!
//! | state | drives | references | laser |
//! |---|---|---|---|
//! | `Disabled`, `Faulted` | off | follow the feedback | off |
//! | `Enabling` | voltage | follow the feedback until the power is on, then stand | off |
//! | `Idle` | voltage | stand | off |
//! | `Running` | voltage | the stream, at a rate | as the stream says |
//! | `Holding`, `Stopping` | voltage | along the stream to rest | off |
//! | `Stopping` after a fault | voltage while the axes follow, else quick stop | the same | off |
//!
//! # Glossary
//!
//! - *Stream time*: the planner's time, in setpoints; see [`player`](crate::player).
//! - *Rate*: stream time per time; 1 as planned, negative when going back.
//! - *now*, *next*, *after*: the deadline of the feedback, the one at which the command takes
//!   effect, and the one at which it ends.
//! - *Finding*: something wrong, not yet a fault. The first finding becomes the latched fault.

use crate::alignment::Alignment;
use crate::cascade::{Cascade, Measurement};
use crate::exchange::{Inputs, Outputs, Peers, Presence};
use crate::feedforward::Feedforward;
use crate::intake::Intake;
use crate::player::{Event, Player};
use crate::statistics::Statistics;
use crate::supervision::{Finding, Supervision, Tracking};
use machine::Machine;
use signals::feedback::status;
use signals::{
    Command, CommandMode, ControllerState, Cycle, Fault, FaultCode, Feedback, LaserCycle, MAX_AXES,
    Nanoseconds, OperatorReply, OperatorRequest, OperatorVerb, Progress, RealtimeFacts,
};

/// Cycles between two progress samples.
const PROGRESS_INTERVAL: u64 = 5;

/// Cycles between two reports.
const REPORT_INTERVAL: u64 = 1000;

/// Cycles of standing still before an axis counts as at rest without a plan, and of holding
/// before it counts as enabled.
const STANDING: u32 = 20;

/// Cycles that enabling, or a quick stop, may take.
const PATIENCE: u32 = 1000;

/// What the controller is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Disabled,
    /// Waiting for the power, then holding for a moment.
    Enabling {
        waited: u32,
        held: u32,
    },
    Idle,
    Running,
    Holding(AfterRest),
    Stopping,
    /// Coming to rest with a fault latched.
    Failing {
        tracking: Tracking,
        waited: u32,
    },
    Faulted,
}

/// What follows once a hold has come to rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum AfterRest {
    Wait,
    Resume,
}

impl State {
    fn to_wire(self) -> ControllerState {
        match self {
            Self::Disabled => ControllerState::Disabled,
            Self::Enabling { .. } => ControllerState::Enabling,
            Self::Idle => ControllerState::Idle,
            Self::Running => ControllerState::Running,
            Self::Holding(_) => ControllerState::Holding,
            Self::Stopping | Self::Failing { .. } => ControllerState::Stopping,
            Self::Faulted => ControllerState::Faulted,
        }
    }

    fn mode(self) -> CommandMode {
        match self {
            Self::Disabled | Self::Faulted => CommandMode::Disabled,
            Self::Failing { tracking: Tracking::Lost, .. } => CommandMode::QuickStop,
            _ => CommandMode::Voltage,
        }
    }

    /// Whether the plan holds the axes, so that they must follow it.
    fn follows(self) -> bool {
        match self {
            Self::Enabling { held, .. } => held > 0,
            state => state.mode() == CommandMode::Voltage,
        }
    }
}

/// The controller of one machine. Everything is allocated in [`Controller::new`].
#[derive(Debug)]
pub struct Controller {
    machine: Machine,
    state: State,
    fault: Fault,
    intake: Intake,
    player: Player,
    alignment: Alignment,
    feedforward: Feedforward,
    cascades: [Cascade; MAX_AXES],
    supervision: Supervision,
    statistics: Statistics,
    /// The stream being played, from its first setpoint until it is over; 0 for none.
    playing: u64,
    completed: bool,
    cycles: u64,
    reset_ticket: u64,
}

impl Controller {
    /// For this machine, disabled.
    ///
    /// # Panics
    /// If the machine has no axis; machine files without are refused when read.
    pub fn new(machine: &Machine) -> Self {
        let last = machine.axes.len() - 1;
        let cascade = |index: usize| Cascade::new(&machine.axes[index.min(last)]);
        Self {
            state: State::Disabled,
            fault: Fault::default(),
            intake: Intake::new(machine),
            player: Player::new(),
            alignment: Alignment::default(),
            feedforward: Feedforward::new(machine),
            cascades: core::array::from_fn(cascade),
            supervision: Supervision::new(machine),
            statistics: Statistics::new(machine),
            playing: 0,
            completed: false,
            cycles: 0,
            reset_ticket: 0,
            machine: machine.clone(),
        }
    }

    /// How many more setpoints the look-ahead has room for.
    pub fn room(&self) -> usize {
        self.intake.lookahead().room()
    }

    /// Says how the controller's thread was set up; the reports carry it.
    pub fn set_realtime(&mut self, facts: RealtimeFacts) {
        self.statistics.set_realtime(facts);
    }

    /// Answers one feedback.
    pub fn step(&mut self, now: Nanoseconds, inputs: &Inputs<'_>, outputs: &mut Outputs) {
        let feedback = inputs.feedback;
        let state_before = self.state.to_wire();
        self.cycles += 1;
        (outputs.progress, outputs.report, outputs.reply) = (None, None, None);
        for setpoint in inputs.setpoints {
            if let Err(finding) = self.intake.take(setpoint, inputs.received, &self.supervision) {
                self.fail(finding.at(now));
            }
        }
        let cycles = match self.check(feedback, inputs.peers) {
            Ok(cycles) => cycles,
            Err(finding) => {
                self.fail(finding.at(now));
                1
            }
        };
        outputs.reply = inputs.request.map(|request| self.request(&request));
        self.transition(now, feedback, outputs);
        for _ in 0..cycles {
            self.advance(now, feedback);
        }
        if self.state.follows()
            && let Err(finding) = self.supervision.motion(feedback, &self.feedforward.now().angle)
        {
            self.fail(finding.at(now));
        }
        self.command(now, inputs, &mut outputs.command);
        if self.playing != 0 {
            let now = self.feedforward.now();
            self.statistics.cycle(&outputs.command, feedback, now);
            if outputs.report.is_none() && self.cycles.is_multiple_of(REPORT_INTERVAL) {
                outputs.report = Some(self.statistics.report());
            }
        }
        let changed = self.state.to_wire() != state_before;
        if changed || outputs.report.is_some() || self.cycles.is_multiple_of(PROGRESS_INTERVAL) {
            outputs.progress = Some(self.progress(now, &outputs.command));
        }
    }

    /// Looks at the feedback and the peers: how many cycles have gone by.
    fn check(&mut self, feedback: &Feedback, peers: Peers) -> Result<u64, Finding> {
        let seen = self.supervision.feedback(feedback);
        if self.state.mode() == CommandMode::Disabled {
            // Unpowered, nothing that drives says is a fault; enabling looks again.
            return Ok(seen.unwrap_or(1));
        }
        let lost = |peer: Presence, code: FaultCode, tracking: Tracking| match peer {
            Presence::Present => Ok(()),
            Presence::Lost => Err(Finding::new(code, 0.0, 0.0, tracking)),
        };
        lost(peers.drives, FaultCode::DrivesLost, Tracking::Lost)?;
        lost(peers.supervisor, FaultCode::SupervisorLost, Tracking::Sound)?;
        if self.playing != 0 {
            lost(peers.planner, FaultCode::PlannerLost, Tracking::Sound)?;
        }
        let cycles = seen?;
        if self.state.follows() {
            self.supervision.drives(feedback)?;
        }
        if self.playing != 0 && feedback.has(status::GATE_INHIBITED) {
            // Drives keeps the gate closed: going on would leave marks out.
            return Err(Finding::new(FaultCode::DriveFault, 0.0, 0.0, Tracking::Sound));
        }
        Ok(cycles)
    }

    /// Carries a request out, or refuses it.
    fn request(&mut self, request: &OperatorRequest) -> OperatorReply {
        let met = self.state.to_wire();
        let accepted =
            OperatorVerb::from_wire(request.verb).is_some_and(|verb| self.obey(verb, request));
        OperatorReply {
            ticket: request.ticket,
            accepted: u32::from(accepted),
            state: met as u32,
            reserved: 0,
            value: self.player.wanted_rate(),
        }
    }

    fn obey(&mut self, verb: OperatorVerb, request: &OperatorRequest) -> bool {
        match (verb, self.state) {
            (OperatorVerb::Enable, State::Disabled) => {
                self.state = State::Enabling { waited: 0, held: 0 };
            }
            (OperatorVerb::Disable, State::Idle | State::Enabling { .. }) => {
                self.state = State::Disabled;
            }
            (OperatorVerb::Hold, State::Running | State::Holding(_)) => {
                self.player.hold();
                self.state = State::Holding(AfterRest::Wait);
            }
            (OperatorVerb::Resume, State::Holding(_)) => {
                self.state = State::Holding(AfterRest::Resume);
            }
            (OperatorVerb::Stop, State::Running | State::Holding(_)) => {
                self.player.hold();
                self.state = State::Stopping;
            }
            (OperatorVerb::Stop, State::Idle | State::Disabled) if self.intake.started() != 0 => {
                self.intake.finish();
                self.completed = false;
            }
            (OperatorVerb::Reset, State::Faulted) => {
                self.state = State::Disabled;
                self.fault = Fault::default();
                self.reset_ticket = u64::from(request.ticket);
                self.supervision.reset();
            }
            (OperatorVerb::Override, _) => return self.player.set_rate(request.value),
            (OperatorVerb::Start, State::Disabled | State::Enabling { .. } | State::Idle) => {
                let stream = request.value as u64;
                return stream as f64 == request.value && self.intake.start(stream);
            }
            _ => return false,
        }
        true
    }

    /// Changes the state where time or the feedback asks for it.
    fn transition(&mut self, now: Nanoseconds, feedback: &Feedback, outputs: &mut Outputs) {
        match self.state {
            State::Enabling { waited, held } => self.enable(now, feedback, waited, held),
            State::Idle if self.intake.is_ready() => self.begin(now, feedback.cycle),
            State::Running if self.is_at_end() && self.player.is_at_rest() => {
                outputs.report = Some(self.finish(true));
                self.state = State::Idle;
            }
            State::Running if !self.is_at_end() && self.alignment.is_done() => {
                self.player.resume(self.intake.lookahead());
            }
            State::Holding(AfterRest::Resume) if self.player.is_at_rest() => {
                self.state = State::Running;
            }
            State::Stopping if self.player.is_at_rest() && self.alignment.is_done() => {
                outputs.report = Some(self.finish(false));
                self.state = State::Idle;
            }
            State::Failing { tracking, waited } => {
                let at_rest = match tracking {
                    Tracking::Sound => self.player.is_at_rest() && self.alignment.is_done(),
                    Tracking::Lost => self.supervision.standing() >= STANDING,
                };
                self.state = State::Failing { tracking, waited: waited + 1 };
                if at_rest || waited >= PATIENCE {
                    if self.playing != 0 {
                        outputs.report = Some(self.finish(false));
                    }
                    self.intake.finish();
                    self.state = State::Faulted;
                }
            }
            _ => {}
        }
    }

    /// Waits for the power and for standstill, then holds for a moment where the axes stand.
    fn enable(&mut self, now: Nanoseconds, feedback: &Feedback, waited: u32, held: u32) {
        let ready = held > 0
            || feedback.has(status::POWERED)
                && !feedback.has(status::STOPPED_ALONE)
                && !feedback.fault.is_some()
                && self.supervision.standing() > 0;
        self.state = if held >= STANDING {
            State::Idle
        } else {
            State::Enabling { waited: waited + 1, held: if ready { held + 1 } else { 0 } }
        };
        if waited >= PATIENCE {
            let (value, limit) = (f64::from(waited), f64::from(PATIENCE));
            let finding = Finding::new(FaultCode::DriveFault, value, limit, Tracking::Lost);
            self.fail(finding.at(now));
        }
    }

    /// Begins the stream in hand, from where the axes stand.
    fn begin(&mut self, now: Nanoseconds, cycle: Cycle) {
        self.player.rewind();
        let lookahead = self.intake.lookahead();
        let start = self.feedforward.plan(lookahead, self.player.after());
        match Alignment::new(&self.machine, self.feedforward.after(), &start) {
            Ok(alignment) => {
                self.alignment = alignment;
                self.playing = self.intake.started();
                self.statistics.begin(self.playing, cycle);
                self.state = State::Running;
                if alignment.is_done() {
                    self.player.resume(lookahead);
                }
            }
            Err(finding) => self.fail(finding.at(now)),
        }
    }

    /// The stream is over; what was counted.
    fn finish(&mut self, completed: bool) -> signals::ControllerReport {
        self.playing = 0;
        self.completed = completed;
        self.intake.finish();
        self.player.rewind();
        self.statistics.finish(completed, self.fault)
    }

    /// Laser off and axes to rest; the first finding is the fault.
    fn fail(&mut self, finding: Finding) {
        if !self.fault.is_some() {
            self.fault = finding.fault;
        }
        self.player.hold();
        self.state = match self.state {
            State::Disabled | State::Faulted => {
                self.intake.finish();
                State::Faulted
            }
            State::Failing { tracking: Tracking::Sound, .. }
                if finding.tracking == Tracking::Lost =>
            {
                State::Failing { tracking: Tracking::Lost, waited: 0 }
            }
            failing @ State::Failing { .. } => failing,
            _ => State::Failing { tracking: finding.tracking, waited: 0 },
        };
    }

    /// Goes on by one cycle along the stream, or stands.
    fn advance(&mut self, now: Nanoseconds, feedback: &Feedback) {
        if !self.state.follows() {
            let tool = self.tool_measured(feedback);
            if feedback.position.iter().all(|position| position.is_finite()) {
                self.feedforward.rest_at(&feedback.position, tool);
            }
            for cascade in &mut self.cascades {
                cascade.reset();
            }
            return;
        }
        if self.playing == 0 {
            self.feedforward.advance(*self.feedforward.after());
            return;
        }
        let event = self.player.advance(self.intake.lookahead());
        let lookahead = self.intake.lookahead_mut();
        lookahead.pass(self.player.now().time);
        let mut planned = self.feedforward.plan(lookahead, self.player.after());
        let setpoint = lookahead.setpoint(self.player.after().time.sequence());
        self.statistics.setpoint(setpoint, self.player.after());
        self.alignment.apply(&mut planned);
        self.feedforward.advance(planned);
        match event {
            Event::Paused => self.state = State::Holding(AfterRest::Wait),
            Event::Starved => {
                let time = self.player.next().time.seconds();
                let code = FaultCode::StreamStarved;
                self.fail(Finding::new(code, time, 0.0, Tracking::Sound).at(now));
            }
            Event::None | Event::Ended => {}
        }
    }

    /// Writes the command.
    fn command(&mut self, now: Nanoseconds, inputs: &Inputs<'_>, command: &mut Command) {
        let feedback = inputs.feedback;
        let lookahead = self.intake.lookahead();
        let (laser, outputs, newest) = if self.playing == 0 {
            (LaserCycle::OFF, 0, (Nanoseconds(0), Nanoseconds(0)))
        } else {
            let sequence = self.player.after().time.sequence();
            let newest = (lookahead.setpoint(sequence).published, lookahead.received(sequence));
            let outputs = lookahead.setpoint(self.player.outputs_at().sequence()).outputs;
            (self.player.laser(lookahead), outputs, newest)
        };
        // The player is dark unless it plays; a fault found after it went on makes it dark too.
        let laser = match self.state {
            State::Running | State::Holding(_) => laser,
            _ => LaserCycle::OFF,
        };
        *command = Command {
            epoch: feedback.epoch,
            cycle: feedback.cycle,
            reset: self.reset_ticket,
            stream: self.playing,
            stroke: u64::from(stroke(&laser)),
            received: inputs.received,
            published: now,
            setpoint_published: newest.0,
            setpoint_received: newest.1,
            mode: self.state.mode() as u32,
            state: self.state.to_wire() as u32,
            outputs,
            stream_time: self.player.now().time.seconds(),
            rate: self.player.now().rate,
            tool: self.feedforward.now().tool,
            laser,
            fault: self.fault,
            ..Command::default()
        };
        let follows = self.state.follows();
        let axes = self.machine.axes.iter().zip(&mut self.cascades).enumerate();
        for (index, (axis, cascade)) in axes {
            let reference = self.feedforward.reference(index, axis);
            let target = self.feedforward.target(index, axis);
            let measured = Measurement {
                position: feedback.position[index],
                velocity: feedback.velocity[index],
                current: feedback.current[index],
            };
            let error = reference.position - measured.position;
            command.reference[index] = reference.position;
            command.position[index] = target.position;
            command.velocity[index] = target.velocity;
            command.effort[index] = target.effort;
            if !follows {
                continue;
            }
            command.following_error[index] = error;
            let held_by_friction =
                self.feedforward.stands(index) && error.abs() <= axis.encoder.resolution();
            let drive = cascade.step(&reference, &measured, !held_by_friction);
            command.voltage[index] = drive.voltage;
            if self.playing != 0 {
                self.statistics.drive(index, &drive);
            }
        }
    }

    fn progress(&self, now: Nanoseconds, command: &Command) -> Progress {
        let lookahead = self.intake.lookahead();
        let mut position = [0.0; MAX_AXES];
        let angles = self.feedforward.now().angle;
        for (position, (axis, angle)) in
            position.iter_mut().zip(self.machine.axes.iter().zip(&angles))
        {
            *position = angle * axis.ratio;
        }
        Progress {
            published: now,
            stream: lookahead.stream(),
            accepted: lookahead.accepted(),
            played: lookahead.played(),
            room: lookahead.room() as u64,
            stroke: command.stroke,
            cycles: self.cycles,
            finished_stream: self.intake.finished(),
            rate: command.rate,
            tool: command.tool,
            position,
            state: command.state,
            completed: u32::from(self.completed),
            fault: self.fault,
        }
    }

    /// Whether the stream in hand has been played to its last setpoint.
    fn is_at_end(&self) -> bool {
        let lookahead = self.intake.lookahead();
        lookahead.is_complete() && self.player.after().time >= lookahead.end()
    }

    /// Where the tool is while no plan holds it.
    fn tool_measured(&self, feedback: &Feedback) -> [f64; 3] {
        if feedback.has(status::TOOL_KNOWN) { feedback.tool } else { self.feedforward.now().tool }
    }
}

/// The first stroke that is marked in the cycle, 0 for none.
fn stroke(laser: &LaserCycle) -> u32 {
    let edges = laser.edges().iter().map(|edge| edge.gate);
    core::iter::once(laser.gate).chain(edges).find(|gate| *gate != 0).unwrap_or(0)
}
