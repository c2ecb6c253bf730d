//! What people ask of the controller.

use super::Controller;
use crate::state::{AfterRest, State};
use messages::{Cycle, Fault, OperatorReply, OperatorRequest, OperatorVerb, Refusal};

impl Controller {
    /// Carries a request out in `cycle`, or refuses it.
    pub(super) fn request(&mut self, request: &OperatorRequest, cycle: Cycle) -> OperatorReply {
        let met = self.state.to_wire();
        let accepted = OperatorVerb::from_wire(request.verb)
            .is_some_and(|verb| self.obey(verb, request, cycle));
        OperatorReply {
            ticket: request.ticket,
            accepted: u32::from(accepted),
            state: met as u32,
            refusal: if accepted { Refusal::None } else { Refusal::State } as u32,
            axis: 0,
            reserved: 0,
            found: 0.0,
            limit: 0.0,
            value: self.player.asked_rate(),
        }
    }

    fn obey(&mut self, verb: OperatorVerb, request: &OperatorRequest, cycle: Cycle) -> bool {
        match (verb, self.state) {
            (OperatorVerb::Enable, State::Disabled) => {
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
                self.state = State::Holding(AfterRest::Wait);
            }
            // Already on its way, as soon as there is something to play.
            (OperatorVerb::Resume, State::Holding(AfterRest::Supply { .. })) => {}
            (OperatorVerb::Resume, State::Holding(_)) => {
                self.state = State::Holding(AfterRest::Resume);
            }
            (OperatorVerb::Stop, State::Running | State::Holding(_)) => {
                self.player.hold();
                self.state = State::Stopping;
            }
            (
                OperatorVerb::Stop,
                State::Idle | State::Disabled | State::Enabling { .. } | State::Squaring { .. },
            ) if self.intake.started() != 0 => {
                self.give_up(cycle);
            }
            (OperatorVerb::Reset, State::Faulted) => {
                self.state = State::Disabled;
                self.fault = Fault::default();
                self.reset_ticket = u64::from(request.ticket);
                self.supervision.reset();
            }
            (OperatorVerb::Override, _) => return self.player.ask_rate(request.value),
            (
                OperatorVerb::Start,
                State::Disabled | State::Enabling { .. } | State::Squaring { .. } | State::Idle,
            ) => {
                let stream = request.value as u64;
                return stream as f64 == request.value && self.intake.start(stream);
            }
            _ => return false,
        }
        true
    }
}
