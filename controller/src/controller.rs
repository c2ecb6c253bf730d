//! The controller: one feedback in, one command out.
//!
//! # Duties
//!
//! - Play the stream: references, voltages and gate edges for the cycle in which they act.
//! - Close the loops on each motor: position, velocity, current.
//! - Supervise: setpoints, feedback, following error, limits, peers. Any error leads to the safe
//!   state: laser off with this command, then the axes to rest.
//! - Answer people: enable, disable, start, hold, resume, stop, reset, override.
//!
//! # Modes
//!
//! | state | drives | references | laser |
//! |---|---|---|---|
//! | `Disabled`, `Faulted` | off | follow the feedback | off |
//! | `Enabling` | driven, against the weight | follow the feedback until the power is on, then stand | off |
//! | `Squaring` | driven | to where the actuators of each axis are together | off |
//! | `Idle` | driven | stand | off |
//! | `Homing`, `Jogging`, `Probing` | driven | motions of single joints, limited in jerk | off |
//! | `Pulsing` | driven | stand | a test pulse |
//! | `Halted` | driven | stand | off |
//! | `Running` | driven | the stream, at a rate | as the stream says |
//! | `Holding` | driven | along the stream to rest | off, with what was on its way given |
//! | `Stopping` | driven | along the stream to rest | off |
//! | `Stopping` after a fault | driven while the axes follow, else quick stop | the same | off |
//!
//! Where the table says driven, each actuator follows the target of its own mode
//! ([`machine::ActuatorMode`]). Steppers get positions: their drivers close the current
//! loops, and what they are counted by are the pulses that they were sent. There is no loop to close.
//!
//! A hold that nobody asked for ends by itself, and the mark is taken up where it was left:
//!
//! - light was lost, because a command came too late and drives kept its cycle dark;
//! - light is due before the axes have come back from where a stall left them;
//! - setpoints ran out, and a planner that lives has sent more.
//!
//! # Glossary
//!
//! - *Stream time*: the planner's time, in setpoints; see [`player`](crate::player).
//! - *Rate*: stream time per time; 1 as planned, negative when going back.
//! - *now*, *next*, *after*: the deadline of the feedback, the one at which the command takes
//!   effect, and the one at which it ends.
//! - *Finding*: something wrong, not yet a fault. The first finding becomes the latched fault.

mod answer;
mod by_hand;
mod operating;
mod requests;
mod transitions;

use crate::alignment::Alignment;
use crate::cascade::Cascade;
use crate::catch_up::CatchUp;
use crate::exchange::{Inputs, Outputs, Peers, Presence};
use crate::feedforward::Feedforward;
use crate::homing::Homing;
use crate::intake::Intake;
use crate::latency::Latencies;
use crate::light::Light;
use crate::outputs::Switching;
use crate::planned::Planned;
use crate::player::{Event, Player};
use crate::prediction::Prediction;
use crate::reference::Reference;
use crate::safety::Safety;
use crate::squaring::Squaring;
use crate::standing::Standing;
use crate::state::{AfterRest, State};
use crate::statistics::Statistics;
use crate::stream_time::{ONE, StreamTime};
use crate::supervision::{Elapsed, Finding, Supervision, Tracking};
use crate::test_pulse::TestPulse;
use crate::travel::{MOVERS, Travel};
use answer::PROGRESS_INTERVAL;
use machine::{Actuator, ActuatorMode, Machine};
use messages::feedback::status;
use messages::{
    ActuatorArray, Command, CommandMode, ControllerReport, Fault, FaultCode, FaultQuantity,
    Feedback, LaserCycle, MAX_ACTUATORS, MotionEnd, Nanoseconds, RealtimeFacts,
};
use transitions::Waits;

/// Time between two reports.
const REPORT_INTERVAL: Nanoseconds = Nanoseconds(1_000_000_000);

/// Times that light may be lost at one place before the machine is stopped.
const MOST_LOSSES: u32 = 3;

/// Light lost this soon after the place where it was lost first counts as lost at one place: about the length of a ramp
/// [setpoints]. Counted from the first loss and not from the one before, a job that gets on by less than that each time
/// gets on all the same.
const ONE_PLACE: StreamTime = StreamTime(128 * ONE);

/// The controller of one machine. Everything is allocated in [`Controller::new`].
#[derive(Debug)]
pub struct Controller {
    machine: Machine,
    waits: Waits,
    /// Cycles between two reports, and between two progress samples.
    report_interval: u64,
    progress_interval: u64,
    state: State,
    fault: Fault,
    intake: Intake,
    player: Player,
    light: Light,
    alignment: Alignment,
    catch_up: CatchUp,
    feedforward: Feedforward,
    /// None for steppers. A drive closes those loops that its mode leaves to it.
    cascades: [Option<Cascade>; MAX_ACTUATORS],
    /// What drives that follow torques have been told beside the plan.
    predictions: Vec<Prediction>,
    /// Whether drives follow positions, which know no step.
    follows_positions: bool,
    supervision: Supervision,
    standing: Standing,
    squaring: Squaring,
    reference: Reference,
    safety: Safety,
    switching: Switching,
    /// What moves without a stream.
    travel: Travel,
    homing: Homing,
    /// Actuators that follow no target, because their drives look for their references by themselves or shall, one bit
    /// each: the plan goes where they are.
    away: u16,
    /// Of each mover that is jogged for as long as it is asked for.
    jogs: [Option<operating::Jog>; MOVERS],
    /// Requests of people that were accepted, and how the newest motion by hand ended.
    requests: u32,
    motion_end: MotionEnd,
    probing: operating::Probing,
    pulse: TestPulse,
    /// Where the motors stood when they were to be enabled [rad].
    enabled_at: ActuatorArray,
    statistics: Statistics,
    /// The stream being played, from its first setpoint until it is over; 0 for none.
    playing: u64,
    completed: bool,
    /// The final report of a stream that ended in this step.
    ended: Option<ControllerReport>,
    /// Where light was lost first, and how often about there.
    lost_at: StreamTime,
    losses: u32,
    cycles: u64,
    reset_ticket: u64,
}

impl Controller {
    /// For this machine, disabled.
    ///
    /// # Panics
    /// If the machine has no actuator; machine files without are refused when read.
    pub fn new(machine: &Machine) -> Self {
        let period = machine.realtime.period;
        let cascade = |actuator: &Actuator| {
            actuator.motor.dc().map(|motor| Cascade::new(motor, &actuator.gains, period))
        };
        Self {
            waits: Waits::new(period),
            report_interval: period.cycles_for(REPORT_INTERVAL),
            progress_interval: period.cycles_for(PROGRESS_INTERVAL),
            state: State::Disabled,
            fault: Fault::default(),
            intake: Intake::new(),
            player: Player::new(machine),
            light: Light::new(&Latencies::of(machine), period),
            alignment: Alignment::default(),
            catch_up: CatchUp::default(),
            feedforward: Feedforward::new(machine),
            cascades: core::array::from_fn(|index| machine.actuators.get(index).and_then(cascade)),
            predictions: (machine.actuators.iter().take(MAX_ACTUATORS))
                .map(|actuator| Prediction::new(actuator, period))
                .collect(),
            follows_positions: (machine.actuators.iter())
                .any(|actuator| actuator.mode == ActuatorMode::Position),
            supervision: Supervision::new(machine),
            standing: Standing::new(machine),
            squaring: Squaring::default(),
            reference: Reference::new(machine),
            safety: Safety::new(machine),
            switching: Switching::new(machine),
            travel: Travel::new(machine, period.seconds()),
            homing: Homing::new(machine, period.seconds()),
            away: 0,
            jogs: [None; MOVERS],
            requests: 0,
            motion_end: MotionEnd::None,
            probing: operating::Probing::default(),
            pulse: TestPulse::default(),
            enabled_at: ActuatorArray::default(),
            statistics: Statistics::new(machine),
            playing: 0,
            completed: false,
            ended: None,
            lost_at: StreamTime::default(),
            losses: 0,
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
        self.refer();
        // Everything here is in the machine's places.
        let located = *self.reference.locate(inputs.feedback);
        let inputs = &Inputs { feedback: &located, ..*inputs };
        let feedback = inputs.feedback;
        let state_before = self.state.to_wire();
        self.cycles += 1;
        (outputs.progress, outputs.report, outputs.reply) = (None, None, None);
        for setpoint in inputs.setpoints {
            if let Err(finding) = self.intake.take(setpoint, &self.supervision) {
                self.fail(finding, now);
            }
        }
        let (elapsed, finding) = self.check(feedback, inputs.peers);
        if let Some(finding) = finding {
            self.fail(finding, now);
        }
        let settling = self.pass_missed(elapsed, feedback, now);
        self.safety.see(feedback.inputs | inputs.slow);
        self.heed_inputs(now, feedback);
        outputs.reply = inputs.request.map(|request| self.request(&request, feedback));
        self.transition(now, feedback);
        self.advance(feedback);
        self.go_along(feedback);
        self.await_settled(settling, now);
        self.keep_dark();
        if self.state.follows()
            && let Err(finding) =
                self.supervision.motion(feedback, &self.feedforward.now().angle, self.bounded())
        {
            self.fail(finding, now);
        }
        self.command(now, inputs, &mut outputs.command);
        outputs.command.outputs = self.switch_outputs();
        if let Some((index, target)) = not_finite(&outputs.command) {
            let fault = Fault::new(FaultCode::NotFinite).on_actuator(index);
            self.fail(Finding::lost(fault.with(FaultQuantity::Number, target)), now);
            self.command(now, inputs, &mut outputs.command);
            outputs.command.outputs = self.switching.on();
        }
        if self.playing != 0 {
            let now = self.feedforward.now();
            let power = self.player.power_override();
            self.statistics.cycle(&outputs.command, feedback, now, power);
        }
        outputs.report = self.ended.take();
        if outputs.report.is_none() && self.cycles.is_multiple_of(self.report_interval) {
            // The final one too, again and again: who joins late must learn how the stream ended.
            outputs.report = Some(self.statistics.report()).filter(|report| report.stream != 0);
        }
        let changed = self.state.to_wire() != state_before || outputs.reply.is_some();
        if changed || outputs.report.is_some() || self.cycles.is_multiple_of(self.progress_interval)
        {
            outputs.progress = Some(self.progress(now, &outputs.command, feedback.laser.is_lit()));
        }
    }

    /// Drives has died, and no feedback will come any more: what is left to say. The axes are
    /// beyond reach; the drives' own watchdog has stopped them.
    pub fn abandon(&mut self, now: Nanoseconds, outputs: &mut Outputs) {
        (outputs.progress, outputs.report, outputs.reply) = (None, None, None);
        if self.state.mode() == CommandMode::Disabled {
            return;
        }
        self.fail(Finding::lost(Fault::new(FaultCode::DrivesLost)), now);
        self.end_in_fault(outputs.command.cycle);
        outputs.report = self.ended.take();
        outputs.command.laser = LaserCycle::OFF;
        outputs.command.stroke = 0;
        outputs.command.mode = self.state.mode() as u32;
        outputs.command.state = self.state.to_wire() as u32;
        outputs.command.fault = self.fault;
        outputs.command.outputs = self.switch_outputs();
        outputs.progress = Some(self.progress(now, &outputs.command, false));
    }

    /// Looks at the feedback and the peers: what went by, and the worst of what is wrong.
    fn check(&mut self, feedback: &Feedback, peers: Peers) -> (Elapsed, Option<Finding>) {
        let seen = self.supervision.feedback(feedback);
        let elapsed = seen.unwrap_or(Elapsed::ONE);
        if self.state.mode() == CommandMode::Disabled {
            // Unpowered, nothing that drives says is a fault; enabling checks again.
            return (elapsed, None);
        }
        let gone =
            |peer: Presence, code: FaultCode| (peer == Presence::Lost).then(|| Fault::new(code));
        let begun = self.intake.started() != 0;
        let told = self.state.follows().then(|| self.supervision.drives(feedback).err()).flatten();
        // Drives keeps the gate closed: going on would leave marks out.
        let inhibited = self.playing != 0 && feedback.has(status::GATE_INHIBITED);
        let findings = [
            gone(peers.drives, FaultCode::DrivesLost).map(Finding::lost),
            gone(peers.supervisor, FaultCode::SupervisorLost).map(Finding::sound),
            gone(peers.planner, FaultCode::PlannerLost).filter(|_| begun).map(Finding::sound),
            // What drives has found comes before the gap that it left.
            told.filter(|finding| finding.fault == feedback.fault),
            seen.err(),
            told,
            inhibited.then(|| Finding::sound(Fault::new(FaultCode::DriveFault))),
        ];
        // A lost peer is found again in every cycle. It must not hide a later loss of tracking, which needs the
        // quick stop.
        let worse = |finding: &Finding| finding.tracking == Tracking::Lost;
        let found = || findings.iter().flatten();
        (elapsed, found().find(|finding| worse(finding)).or_else(|| found().next()).copied())
    }

    /// Holds, because marks from `from` on were not lit; the resume goes back to mark them.
    fn go_back_for_light(&mut self, from: StreamTime, now: Nanoseconds) {
        let same_place = self.losses > 0 && from < self.lost_at + ONE_PLACE;
        (self.losses, self.lost_at) =
            if same_place { (self.losses + 1, self.lost_at) } else { (1, from) };
        if self.losses > MOST_LOSSES {
            let (value, limit) = (f64::from(self.losses), f64::from(MOST_LOSSES));
            let fault = Fault::new(FaultCode::StaleCommand);
            self.fail(Finding::sound(fault.beyond(FaultQuantity::Losses, value, limit)), now);
        } else if matches!(self.state, State::Running | State::Holding(AfterRest::Pause)) {
            self.state = State::Holding(AfterRest::Resume);
        }
    }

    /// Laser off and axes to rest; the first finding is the fault, found at `now` unless somebody
    /// found it before.
    fn fail(&mut self, finding: Finding, now: Nanoseconds) {
        if !self.fault.is_some() {
            self.fault = finding.fault.at(now);
        }
        self.player.hold();
        self.light.put_out();
        self.give_up_travel(MotionEnd::Fault);
        self.state = match self.state {
            State::Disabled | State::Faulted => State::Faulted,
            State::Failing { tracking: Tracking::Sound, .. }
                if finding.tracking == Tracking::Lost =>
            {
                State::Failing { tracking: Tracking::Lost, waited: 0 }
            }
            failing @ State::Failing { .. } => failing,
            _ => State::Failing { tracking: finding.tracking, waited: 0 },
        };
    }

    /// Goes on through the cycles for which drives had no command: references are a function of time, so
    /// that axes which kept their speed in a stall are about where they should be. Positions take the
    /// rest back without a step. Gives the cycles until the axes are on the plan again.
    fn pass_missed(&mut self, elapsed: Elapsed, feedback: &Feedback, now: Nanoseconds) -> u64 {
        if elapsed.missed == 0 {
            return 0;
        }
        let is_fading = !self.catch_up.is_done();
        self.catch_up = CatchUp::default();
        // The newest command may have come too late; for the cycles after its own there was none.
        let newest_missed = elapsed.missed >= elapsed.cycles;
        let last = self.feedforward.told(usize::from(newest_missed));
        if newest_missed {
            self.pass_in_the_dark(now);
        }
        for _ in 1..elapsed.cycles {
            // What stands where it is measured stands there after one cycle as after many.
            if self.state.follows() {
                self.advance(feedback);
            }
            self.pass_in_the_dark(now);
        }
        if !self.state.follows() {
            return 0;
        }
        let catch_up = self.feedforward.coasted(&last, elapsed.missed);
        // Squaring is so slow that what it goes on by matters nothing.
        let moves = self.playing != 0 || is_fading || !self.travel_rests();
        if self.follows_positions && moves {
            self.feedforward.put_coasted(&last, elapsed.missed);
            self.catch_up = catch_up;
        }
        catch_up.settling(&self.machine)
    }

    /// Drives kept the cycle of the newest command dark: light that was lost in it is gone back for.
    fn pass_in_the_dark(&mut self, now: Nanoseconds) {
        if self.playing != 0 && self.light.is_due() {
            self.lose_light(now);
        }
    }

    /// Light waits for axes that need so many cycles to be on the plan again.
    fn await_settled(&mut self, cycles: u64, now: Nanoseconds) {
        if cycles == 0 || self.playing == 0 {
            return;
        }
        let (from, lookahead) = (self.light.from(), self.intake.lookahead());
        if self.light.is_coming() || self.player.is_lit_soon(from, cycles, lookahead) {
            self.lose_light(now);
        }
    }

    /// Light that is on its way while there must be none is for after the resume.
    fn keep_dark(&mut self) {
        if self.playing != 0 && self.safety.is_dark() && self.light.is_coming() {
            self.player.lose(self.light.from());
            self.light.put_out();
        }
    }

    /// Light that was to be sent, and what follows it, is not: it is gone back for.
    fn lose_light(&mut self, now: Nanoseconds) {
        let from = self.light.from();
        self.light.put_out();
        self.player.lose(from);
        self.go_back_for_light(from, now);
    }

    /// Goes on by one cycle along the stream, or stands.
    fn advance(&mut self, feedback: &Feedback) {
        if !self.state.follows() {
            let is_known = |values: &ActuatorArray| values.iter().all(|value| value.is_finite());
            let resting = if is_known(&feedback.position) {
                let (angle, tool) = (feedback.position, self.tool_measured(feedback));
                // Known all the time, so that the weight is at hand when the power, and with it the load, comes.
                let weight = *self.standing.torque(&angle);
                let bears = matches!(self.state, State::Enabling { .. });
                let torque = if bears { weight } else { ActuatorArray::default() };
                Planned { angle, torque, tool, ..Planned::default() }
            } else {
                let Planned { angle, tool, .. } = *self.feedforward.now();
                Planned { angle, tool, ..Planned::default() }
            };
            let powered = feedback.has(status::POWERED) && is_known(&feedback.current);
            self.feedforward.rest_at(resting, powered.then_some(&feedback.current));
            for cascade in self.cascades.iter_mut().flatten() {
                cascade.reset();
            }
            self.predictions.iter_mut().for_each(Prediction::reset);
            (self.catch_up, self.squaring) = (CatchUp::default(), Squaring::default());
            self.travel.reset();
            return;
        }
        if self.playing == 0 {
            let next = match self.squaring.advance() {
                Some(next) => next,
                None => self.travel_on(),
            };
            self.feedforward.advance(next, &mut self.catch_up);
            return;
        }
        let event = self.player.advance(self.intake.lookahead());
        let lookahead = self.intake.lookahead_mut();
        lookahead.pass(self.player.now().time);
        self.light.advance(self.player.given(lookahead));
        let mut planned = self.feedforward.plan(lookahead, self.player.after());
        // A cycle may pass several setpoints, or none.
        let [from, to] = [self.player.next(), self.player.after()].map(|it| it.time.sequence());
        for sequence in (from + 1).min(to)..=to {
            self.statistics.setpoint(lookahead.setpoint(sequence), self.player.after());
        }
        self.alignment.apply(&mut planned);
        self.feedforward.advance(planned, &mut self.catch_up);
        // Whoever stops for good does not wait.
        if matches!(self.state, State::Running | State::Holding(_)) {
            match event {
                Event::Paused => self.state = State::Holding(AfterRest::Pause),
                Event::Starved => self.state = State::Holding(AfterRest::Supply { waited: 0 }),
                Event::None | Event::Ended => {}
            }
        }
    }

    /// Where the tool is while no plan holds it.
    fn tool_measured(&self, feedback: &Feedback) -> [f64; 3] {
        if feedback.has(status::TOOL_KNOWN) { feedback.tool } else { self.feedforward.now().tool }
    }
}

/// The first target that is not finite, with the index of its actuator.
fn not_finite(command: &Command) -> Option<(usize, f64)> {
    let targets = [&command.voltage, &command.effort, &command.velocity, &command.position];
    targets.into_iter().find_map(|targets| {
        let mut each = targets.iter().copied().enumerate();
        each.find(|(_, target)| !target.is_finite())
    })
}
