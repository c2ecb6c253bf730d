//! What people ask of the controller.

use super::Controller;
use crate::state::{AfterRest, State};
use messages::{
    Fault, Feedback, HoldCause, MotionEnd, OperatorReply, OperatorRequest, OperatorVerb, Refusal,
};

/// Why a request is refused.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Refused {
    refusal: Refusal,
    /// The axis from 1, 0 for none.
    axis: u32,
    found: f64,
    limit: f64,
}

impl From<Refusal> for Refused {
    fn from(refusal: Refusal) -> Self {
        Self { refusal, ..Self::default() }
    }
}

impl Refused {
    pub(super) fn on(refusal: Refusal, axis: usize) -> Self {
        Self { axis: axis as u32 + 1, ..refusal.into() }
    }

    pub(super) fn beyond(self, found: f64, limit: f64) -> Self {
        Self { found, limit, ..self }
    }
}

impl Controller {
    /// Carries a request out, or refuses it.
    pub(super) fn request(
        &mut self,
        request: &OperatorRequest,
        feedback: &Feedback,
    ) -> OperatorReply {
        let met = self.state.to_wire();
        // The number that the request will have if it is accepted.
        let before = self.requests;
        self.requests = before.wrapping_add(1);
        let outcome = match OperatorVerb::from_wire(request.verb) {
            Some(verb) => self.obey(verb, request, feedback),
            None => Err(Refusal::Unknown.into()),
        };
        if outcome.is_err() {
            self.requests = before;
        }
        let Refused { refusal, axis, found, limit } = outcome.err().unwrap_or_default();
        OperatorReply {
            ticket: request.ticket,
            accepted: u32::from(outcome.is_ok()),
            state: met as u32,
            refusal: refusal as u32,
            axis,
            number: self.requests,
            found,
            limit,
            value: self.player.asked_rate(),
            power: self.player.power_override(),
        }
    }

    fn obey(
        &mut self,
        verb: OperatorVerb,
        request: &OperatorRequest,
        feedback: &Feedback,
    ) -> Result<(), Refused> {
        match (verb, self.state) {
            (OperatorVerb::Enable, State::Disabled) => {
                self.is_not_stopped()?;
                self.state = State::Enabling { waited: 0, held: 0, settled: 0 };
            }
            (
                OperatorVerb::Disable,
                State::Idle | State::Enabling { .. } | State::Squaring { .. },
            ) => {
                self.state = State::Disabled;
            }
            (OperatorVerb::Hold, State::Running | State::Holding(_)) => {
                self.player.hold();
                self.state = State::Holding(AfterRest::Wait(HoldCause::Person));
            }
            // Already on its way, as soon as there is something to play.
            (OperatorVerb::Resume, State::Holding(AfterRest::Supply { .. })) => {}
            (OperatorVerb::Resume, State::Holding(_)) => {
                self.may_light()?;
                self.state = State::Holding(AfterRest::Resume);
            }
            (OperatorVerb::Stop, State::Running | State::Holding(_)) => {
                self.player.hold();
                self.light.put_out();
                self.state = State::Stopping;
            }
            (
                OperatorVerb::Stop | OperatorVerb::Hold,
                State::Homing(_) | State::Jogging | State::Probing | State::Pulsing,
            ) => {
                self.give_up_travel(MotionEnd::Stopped);
                self.state = State::Jogging;
            }
            (
                OperatorVerb::Stop,
                State::Idle | State::Disabled | State::Enabling { .. } | State::Squaring { .. },
            ) if self.intake.started() != 0 => {
                self.give_up(feedback.cycle);
            }
            (OperatorVerb::Reset, State::Faulted | State::Halted) => self.reset(request.ticket)?,
            (OperatorVerb::Override, _) => {
                if !self.player.ask_rate(request.value) {
                    return Err(Refused::from(Refusal::TooLarge).beyond(request.value, 2.0));
                }
            }
            (OperatorVerb::Power, _) => {
                if !self.player.ask_power(request.value) {
                    return Err(Refused::from(Refusal::TooLarge).beyond(request.value, 2.0));
                }
            }
            (OperatorVerb::Rapid, _) => {
                if !self.player.ask_rapids(request.value) {
                    return Err(Refused::from(Refusal::TooLarge).beyond(request.value, 1.0));
                }
            }
            (
                OperatorVerb::Start,
                State::Disabled | State::Enabling { .. } | State::Squaring { .. } | State::Idle,
            ) => self.start(request.value)?,
            (OperatorVerb::Home, State::Idle) => self.begin_homing(request.axis)?,
            (OperatorVerb::Jog, State::Idle | State::Jogging) => self.jog(request)?,
            (OperatorVerb::JogOn, _) => self.jog_on(request)?,
            (OperatorVerb::Output, _) => self.switch_output(request)?,
            (OperatorVerb::Step, State::Idle | State::Jogging) => self.step_axis(request)?,
            (OperatorVerb::Probe, State::Idle) => self.begin_probing(request)?,
            (OperatorVerb::TestPulse, State::Idle) => self.begin_pulse(request, feedback)?,
            _ => return Err(Refusal::State.into()),
        }
        Ok(())
    }

    /// Clears the fault, unless what caused it is still there.
    fn reset(&mut self, ticket: u32) -> Result<(), Refused> {
        if self.safety.is_stopped() {
            return Err(Refusal::EmergencyStop.into());
        }
        self.state = if self.state == State::Halted { State::Idle } else { State::Disabled };
        self.fault = Fault::default();
        self.reset_ticket = u64::from(ticket);
        self.supervision.reset();
        Ok(())
    }

    fn start(&mut self, value: f64) -> Result<(), Refused> {
        self.may_light()?;
        if let Some(axis) = self.reference.unknown(self.machine.axes.len()) {
            return Err(Refused::on(Refusal::NotHomed, axis));
        }
        if let Some(axis) = self.safety.limited() {
            return Err(Refused::on(Refusal::LimitSwitch, axis));
        }
        let stream = value as u64;
        if stream as f64 == value && self.intake.start(stream) {
            Ok(())
        } else {
            Err(Refusal::Stream.into())
        }
    }

    fn is_not_stopped(&self) -> Result<(), Refused> {
        if self.safety.is_stopped() { Err(Refusal::EmergencyStop.into()) } else { Ok(()) }
    }

    /// Whether neither emergency stop nor door nor an interlock is in the way of light.
    pub(super) fn may_light(&self) -> Result<(), Refused> {
        self.is_closed()?;
        if self.safety.is_interlocked() { Err(Refusal::Interlock.into()) } else { Ok(()) }
    }

    /// Whether neither emergency stop nor door is in the way of motion.
    pub(super) fn is_closed(&self) -> Result<(), Refused> {
        self.is_not_stopped()?;
        if self.safety.is_open() {
            return Err(Refusal::DoorOpen.into());
        }
        Ok(())
    }
}
