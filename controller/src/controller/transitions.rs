//! How the controller goes from state to state, where time or the feedback asks for it.

use super::Controller;
use crate::alignment::Alignment;
use crate::squaring::Squaring;
use crate::standing::Strayed;
use crate::state::{AfterRest, State};
use crate::supervision::{Finding, Tracking};
use crate::travel::MOVERS;
use messages::feedback::status;
use messages::time::Period;
use messages::{
    Cycle, Fault, FaultCode, FaultQuantity, Feedback, HoldCause, MotionEnd, Nanoseconds,
};

/// How long an axis stands still before it counts as at rest without a plan, and as enabled.
const STANDING: Nanoseconds = Nanoseconds(20_000_000);

/// How long enabling, brakes left out, or a quick stop may take.
const PATIENCE: Nanoseconds = Nanoseconds(1_000_000_000);

/// How long a planner that lives may send nothing: a minute, longer than any computer is merely busy.
const SUPPLY_PATIENCE: Nanoseconds = Nanoseconds(60_000_000_000);

/// These times in cycles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Waits {
    standing: u64,
    patience: u64,
    supply: u64,
}

impl Waits {
    /// At this period of the cycle.
    pub(super) fn new(period: Period) -> Self {
        let [standing, patience, supply] =
            [STANDING, PATIENCE, SUPPLY_PATIENCE].map(|time| period.cycles_for(time));
        Self { standing, patience, supply }
    }
}

impl Controller {
    /// Changes the state where time or the feedback asks for it.
    pub(super) fn transition(&mut self, now: Nanoseconds, feedback: &Feedback) {
        match self.state {
            State::Enabling { waited, held, settled } => {
                self.enable(now, feedback, [waited, held, settled]);
            }
            State::Squaring { waited, settled } => self.square(now, feedback, [waited, settled]),
            // Drives may not have found all peers yet.
            State::Idle if feedback.has(status::GATE_INHIBITED) => {}
            State::Idle if self.intake.is_ready() => self.begin(now, feedback.cycle),
            State::Running if self.is_over() && self.stands_on_plan() => {
                self.finish(true);
                self.state = State::Idle;
            }
            State::Running if !self.is_over() && self.alignment.is_done() => {
                self.player.resume(self.intake.lookahead());
            }
            State::Holding(AfterRest::Pause) if self.player.is_at_rest() => {
                self.state = State::Holding(AfterRest::Wait(HoldCause::Program));
            }
            // Whatever it was held for, it needs the way to stop again.
            State::Holding(AfterRest::Resume) if self.player.is_at_rest() => {
                self.await_supply(now, 0);
            }
            State::Holding(AfterRest::Supply { waited }) if self.player.is_at_rest() => {
                self.await_supply(now, waited);
            }
            State::Stopping if self.stands_on_plan() && self.alignment.is_done() => {
                self.finish(false);
                self.state = State::Idle;
            }
            State::Homing(stage) => self.home(now, feedback, stage),
            State::Jogging if self.travel_rests() => {
                // Nobody has to speak for an axis that rests.
                self.jogs = [None; MOVERS];
                self.rest_by_hand(MotionEnd::Reached);
            }
            State::Probing => self.probe(feedback),
            State::Pulsing if self.pulse.is_over() => self.rest_by_hand(MotionEnd::Reached),
            State::Failing { tracking, waited } => {
                let at_rest = match tracking {
                    Tracking::Sound => self.stands_on_plan() && self.alignment.is_done(),
                    Tracking::Lost => self.supervision.standing() >= self.waits.standing,
                };
                self.state = State::Failing { tracking, waited: waited + 1 };
                if at_rest && tracking == Tracking::Sound && self.halts() {
                    self.halt(feedback.cycle);
                } else if at_rest || waited >= self.waits.patience {
                    self.end_in_fault(feedback.cycle);
                }
            }
            State::Faulted if self.intake.started() != 0 => self.end_in_fault(feedback.cycle),
            _ => {}
        }
    }

    /// Waits for the power and for standstill, while what nothing holds must not sink; then holds the axes
    /// where they stand, against their weight, until the brakes are open and all have stood there for a
    /// moment.
    fn enable(&mut self, now: Nanoseconds, feedback: &Feedback, cycles: [u64; 3]) {
        let [waited, held, settled] = cycles;
        if waited == 0 {
            self.enabled_at = feedback.position;
        }
        let (strayed, sinks) = if held > 0 {
            let place = &self.feedforward.now().angle;
            (self.standing.strayed(place, &feedback.position), false)
        } else {
            let sunk = self.standing.sunk(&self.enabled_at, &feedback.position);
            (sunk, sunk.is_some())
        };
        let stands = self.supervision.standing() > 0;
        let is_sound = !feedback.has(status::WATCHDOG_TRIPPED) && !feedback.fault.is_some();
        // Before the controller has been asked once more, it has given no voltage for the weight.
        let is_borne = waited > 0;
        let ready = held > 0 || is_borne && feedback.has(status::POWERED) && is_sound && stands;
        let rests = held > self.standing.release() && stands && strayed.is_none();
        let settled = if rests { settled + 1 } else { 0 };
        if settled >= self.waits.standing {
            self.squaring = Squaring::new(&self.machine, self.feedforward.newest());
            self.state = if self.squaring.is_done() {
                State::Idle
            } else {
                State::Squaring { waited: 0, settled: 0 }
            };
            return;
        }
        self.state =
            State::Enabling { waited: waited + 1, held: if ready { held + 1 } else { 0 }, settled };
        if sinks || waited >= self.waits.patience + self.standing.release() {
            self.fail(Finding::lost(self.restless(feedback, strayed, waited)), now);
            // A quick stop would power what is not powered yet.
            if !feedback.has(status::POWERED) {
                self.end_in_fault(feedback.cycle);
            }
        }
    }

    /// Goes to where the actuators of each axis are together, and waits until all have stood there for a
    /// moment.
    fn square(&mut self, now: Nanoseconds, feedback: &Feedback, [waited, settled]: [u64; 2]) {
        if !self.squaring.is_done() {
            return;
        }
        let strayed = self.standing.strayed(&self.feedforward.now().angle, &feedback.position);
        let rests = self.supervision.standing() > 0 && strayed.is_none();
        let settled = if rests { settled + 1 } else { 0 };
        if settled >= self.waits.standing {
            self.state = State::Idle;
            return;
        }
        self.state = State::Squaring { waited: waited + 1, settled };
        if waited >= self.waits.patience {
            self.fail(Finding::lost(self.restless(feedback, strayed, waited)), now);
        }
    }

    /// Why the axes cannot be enabled after `waited` cycles: one has `strayed` from its place by so much,
    /// or still moves, or the power does not come.
    fn restless(&self, feedback: &Feedback, strayed: Option<Strayed>, waited: u64) -> Fault {
        if feedback.fault.is_some() {
            return feedback.fault;
        }
        let fault = Fault::new(FaultCode::DriveFault);
        if let Some(Strayed { index, distance, limit }) = strayed {
            let ratio = self.machine.actuators[index].ratio.abs();
            let quantity = FaultQuantity::HoldDistance;
            return fault.on_actuator(index).beyond(quantity, distance * ratio, limit * ratio);
        }
        if let Some((index, speed, limit)) = self.supervision.moving() {
            return fault.on_actuator(index).beyond(FaultQuantity::Velocity, speed, limit);
        }
        let limit = self.waits.patience + self.standing.release();
        fault.beyond(FaultQuantity::Cycles, waited as f64, limit as f64)
    }

    /// Goes on as soon as there is enough to play, or gives up waiting.
    fn await_supply(&mut self, now: Nanoseconds, waited: u64) {
        self.state = if self.intake.is_supplied(self.player.after().time) {
            State::Running
        } else {
            State::Holding(AfterRest::Supply { waited: waited + 1 })
        };
        if waited >= self.waits.supply {
            let time = self.player.after().time.seconds();
            let fault = Fault::new(FaultCode::StreamStarved);
            self.fail(Finding::sound(fault.with(FaultQuantity::StreamTime, time)), now);
        }
    }

    /// Begins the stream in hand, from where the axes stand.
    fn begin(&mut self, now: Nanoseconds, cycle: Cycle) {
        self.player.rewind();
        self.light.rewind();
        let lookahead = self.intake.lookahead();
        let start = self.feedforward.plan(lookahead, self.player.after());
        match Alignment::new(&self.machine, self.feedforward.newest(), &start) {
            Ok(alignment) => {
                self.alignment = alignment;
                self.playing = self.intake.started();
                self.statistics.begin(self.playing, cycle);
                self.losses = 0;
                self.state = State::Running;
                if alignment.is_done() {
                    self.player.resume(lookahead);
                }
            }
            Err(finding) => self.fail(finding, now),
        }
    }

    /// Unpowered, with the fault latched; a stream in hand is given up.
    pub(super) fn end_in_fault(&mut self, cycle: Cycle) {
        self.state = State::Faulted;
        if self.intake.started() != 0 {
            self.give_up(cycle);
        }
    }

    /// Gives the started stream up, begun or not: whoever started it waits for the report.
    pub(super) fn give_up(&mut self, cycle: Cycle) {
        if self.playing == 0 {
            self.statistics.begin(self.intake.started(), cycle);
        }
        self.finish(false);
    }

    /// The stream is over; the report says what was counted.
    fn finish(&mut self, completed: bool) {
        self.playing = 0;
        self.completed = completed;
        self.intake.finish();
        self.player.rewind();
        self.player.end_power_override();
        self.light.rewind();
        self.ended = Some(self.statistics.finish(completed, self.fault));
    }

    /// Whether the stream rests, and what a stall left behind has been compensated: without that the next motion would jump by it.
    fn stands_on_plan(&self) -> bool {
        let rests = self.squaring.is_done() && self.travel_rests();
        self.player.is_at_rest() && self.catch_up.is_done() && rests
    }

    /// Whether the stream in hand has been played to its last setpoint, with no light left to make up for.
    fn is_over(&self) -> bool {
        let lookahead = self.intake.lookahead();
        let at_end = lookahead.is_complete() && self.player.after().time >= lookahead.end();
        at_end && !self.player.has_missed_light()
    }
}
