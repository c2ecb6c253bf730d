//! What people ask of the controller.

use super::Controller;
use super::operating::{Jog, Probing};
use crate::feedforward::Planned;
use crate::state::{AfterRest, HomingStage, State};
use crate::test_pulse::TestPulse;
use crate::travel::{Beyond, MOVERS};
use machine::operating::Side;
use messages::feedback::status;
use messages::{
    Fault, Feedback, MAX_AXES, MotionEnd, Nanoseconds, OperatorReply, OperatorRequest,
    OperatorVerb, Refusal,
};

/// Why a request is refused.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Refused {
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
    fn on(refusal: Refusal, axis: usize) -> Self {
        Self { axis: axis as u32 + 1, ..refusal.into() }
    }

    fn beyond(self, found: f64, limit: f64) -> Self {
        Self { found, limit, ..self }
    }
}

impl From<Beyond> for Refused {
    fn from(beyond: Beyond) -> Self {
        Self::on(Refusal::SoftLimit, beyond.mover).beyond(beyond.end, beyond.limit)
    }
}

/// The end of the range above 0 up to `most` that `value` is beyond, if it is; refused if it is no number.
fn outside(value: f64, most: f64) -> Result<Option<f64>, Refused> {
    match value {
        value if !value.is_finite() => Err(Refusal::NotANumber.into()),
        value if value > most => Ok(Some(most)),
        value if value <= 0.0 => Ok(Some(0.0)),
        _ => Ok(None),
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
                self.state = State::Holding(AfterRest::Wait);
            }
            // Already on its way, as soon as there is something to play.
            (OperatorVerb::Resume, State::Holding(AfterRest::Supply { .. })) => {}
            (OperatorVerb::Resume, State::Holding(_)) => {
                self.may_light()?;
                self.state = State::Holding(AfterRest::Resume);
            }
            (OperatorVerb::Stop, State::Running | State::Holding(_)) => {
                self.player.hold();
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

    fn begin_homing(&mut self, axes: u32) -> Result<(), Refused> {
        self.may_move()?;
        if self.homing.axes(axes).next().is_none() {
            return Err(Refusal::NothingToFind.into());
        }
        for axis in 0..self.machine.axes.len().min(MAX_AXES) {
            if self.homing.axes(axes).any(|it| it == axis) {
                self.reference.forget(axis);
            }
        }
        self.homing.begin(axes);
        self.begin_motion(State::Homing(HomingStage::Searching));
        Ok(())
    }

    /// Moves an axis for as long as it is asked to.
    fn jog(&mut self, request: &OperatorRequest) -> Result<(), Refused> {
        let axis = self.mover(request.axis)?;
        let speed = request.value;
        if speed == 0.0 {
            self.travel.stop(axis);
            self.jogs[axis] = None;
            return Ok(());
        }
        self.may_go(axis, speed, speed)?;
        // One that comes to rest does so before it hears the next word: it would need more room.
        if self.travel.comes_to_rest(axis) || self.is_given_up() {
            return Err(Refusal::State.into());
        }
        let standing = self.stood();
        let beyond = self.travel.lacks_room(axis, speed, &self.bounds(), &standing);
        beyond.map_or(Ok(()), |beyond| Err(Refused::from(beyond)))?;
        self.travel.run(axis, speed, &standing);
        self.jogs[axis] = Some(Jog::new(self.requests, self.dead_man()));
        self.begin_motion(State::Jogging);
        Ok(())
    }

    /// Goes on with a jog that has not ended.
    fn jog_on(&mut self, request: &OperatorRequest) -> Result<(), Refused> {
        let axis = self.mover(request.axis)?;
        let left = self.dead_man();
        let jog = self.jogs[axis].as_mut();
        if jog.is_some_and(|jog| jog.go_on(request.value, left)) {
            Ok(())
        } else {
            Err(Refused::on(Refusal::Ended, axis))
        }
    }

    /// For how many cycles a jog goes on without another word.
    fn dead_man(&self) -> u32 {
        let dead_man = Nanoseconds::from_seconds(self.machine.operating.safety.dead_man);
        let cycles = self.machine.realtime.period.cycles_in(dead_man);
        u32::try_from(cycles).unwrap_or(u32::MAX)
    }

    /// Whether what moves by hand was told to stop, and does so.
    fn is_given_up(&self) -> bool {
        self.state == State::Jogging && self.motion_end != MotionEnd::None
    }

    /// Moves an axis on by a distance.
    fn step_axis(&mut self, request: &OperatorRequest) -> Result<(), Refused> {
        let axis = self.mover(request.axis)?;
        let distance = request.value;
        self.may_go(axis, request.second, distance)?;
        if !self.travel.rests(axis) || self.is_given_up() {
            return Err(Refusal::State.into());
        }
        let standing = self.stood();
        self.may_reach(axis, distance, &standing)?;
        self.jogs[axis] = None;
        self.travel.go(axis, distance, request.second, &standing);
        self.begin_motion(State::Jogging);
        Ok(())
    }

    fn begin_probing(&mut self, request: &OperatorRequest) -> Result<(), Refused> {
        let axis = self.mover(request.axis)?;
        let (distance, speed) = (request.value, request.second);
        self.may_go(axis, speed, distance)?;
        match self.safety.probe() {
            None => return Err(Refusal::NothingToFind.into()),
            Some(true) => return Err(Refusal::Touching.into()),
            Some(false) => {}
        }
        let standing = self.stood();
        self.may_reach(axis, distance, &standing)?;
        let place = self.travel.place(axis, &standing);
        let bounds = [place.min(place + distance), place.max(place + distance)];
        let joints = (0..MAX_AXES)
            .map(|joint| self.travel.share(axis, joint) * self.travel.place(joint, &standing));
        let offset = place - joints.sum::<f64>();
        self.probing = Probing::new(axis, bounds, place, offset);
        self.travel.run(axis, speed.abs() * distance.signum(), &standing);
        self.begin_motion(State::Probing);
        Ok(())
    }

    fn begin_pulse(
        &mut self,
        request: &OperatorRequest,
        feedback: &Feedback,
    ) -> Result<(), Refused> {
        self.may_move()?;
        self.may_light()?;
        if feedback.has(status::GATE_INHIBITED) {
            return Err(Refusal::State.into());
        }
        let (power, time) = (request.value, request.second);
        let safety = &self.machine.operating.safety;
        let least = self.machine.laser.min_power;
        let beyond =
            |refusal: Refusal, found, limit| Err(Refused::from(refusal).beyond(found, limit));
        if let Some(limit) = outside(power, safety.test_power)? {
            return beyond(Refusal::Power, power, limit);
        }
        if power < least {
            return beyond(Refusal::Power, power, least);
        }
        if let Some(limit) = outside(time, safety.test_time)? {
            return beyond(Refusal::Time, time, limit);
        }
        self.pulse = TestPulse::new(power, Nanoseconds::from_seconds(time));
        self.begin_motion(State::Pulsing);
        Ok(())
    }

    /// Switches an output on, where no job does and no fault is latched, or off, at any time.
    fn switch_output(&mut self, request: &OperatorRequest) -> Result<(), Refused> {
        let is_on = request.value != 0.0;
        if is_on {
            self.may_move()?;
            if self.fault.is_some() {
                return Err(Refusal::State.into());
            }
        }
        let index = (request.axis as usize).checked_sub(1);
        let is_switched = |index| self.switching.switch(index, is_on);
        if index.is_some_and(is_switched) { Ok(()) } else { Err(Refusal::NotByHand.into()) }
    }

    /// Whether axes may be moved, or the laser tested, without a stream.
    fn may_move(&self) -> Result<(), Refused> {
        self.is_closed()?;
        if self.intake.started() != 0 { Err(Refusal::State.into()) } else { Ok(()) }
    }

    /// Whether an axis may go in the direction of `way`, at `speed`.
    fn may_go(&self, axis: usize, speed: f64, way: f64) -> Result<(), Refused> {
        self.may_move()?;
        let most = self.travel.pace(axis).map_or(0.0, |pace| pace.velocity);
        if !way.is_finite() || way == 0.0 {
            return Err(Refused::on(Refusal::NotANumber, axis));
        }
        match outside(speed.abs(), most)? {
            Some(limit) if limit > 0.0 => {
                return Err(Refused::on(Refusal::TooLarge, axis).beyond(speed.abs(), limit));
            }
            Some(_) => return Err(Refused::on(Refusal::TooSmall, axis).beyond(speed.abs(), 0.0)),
            None => {}
        }
        for joint in 0..self.machine.axes.len().min(MAX_AXES) {
            let way = self.travel.share(joint, axis) * way;
            let side = if way < 0.0 { Side::Lower } else { Side::Upper };
            if way != 0.0 && self.safety.is_at_limit(joint, side) {
                return Err(Refused::on(Refusal::LimitSwitch, joint));
            }
            // Two that move one joint would go beyond its speed together.
            let others = (0..MOVERS).filter(|it| *it != axis && !self.travel.rests(*it));
            if way != 0.0 && others.into_iter().any(|it| self.travel.share(joint, it) != 0.0) {
                return Err(Refusal::State.into());
            }
        }
        Ok(())
    }

    /// Whether another `distance` of a mover leads beyond nothing.
    fn may_reach(&self, mover: usize, distance: f64, standing: &Planned) -> Result<(), Refused> {
        let beyond = self.travel.beyond(mover, distance, &self.bounds(), standing);
        beyond.map_or(Ok(()), |beyond| Err(beyond.into()))
    }

    /// Where the plan has the axes rest or move now, and the tool with them.
    fn stood(&mut self) -> Planned {
        let mut standing = *self.feedforward.after();
        let mut borne = standing;
        if self.standing.bear(&mut borne) {
            standing.tool = borne.tool;
        }
        standing
    }

    /// The index of the mover that is number `number` from 1: an axis, or the tool along x, y or z.
    fn mover(&self, number: u32) -> Result<usize, Refused> {
        let axes = self.machine.axes.len().min(MAX_AXES);
        let mover = (number as usize).checked_sub(1);
        match mover {
            Some(axis) if axis < axes => Ok(axis),
            Some(mover @ MAX_AXES..MOVERS) if self.travel.pace(mover).is_some() => Ok(mover),
            Some(mover @ MAX_AXES..MOVERS) => Err(Refused::on(Refusal::NoDirection, mover)),
            _ => Err(Refused::from(Refusal::NoAxis).beyond(f64::from(number), axes as f64)),
        }
    }

    fn is_not_stopped(&self) -> Result<(), Refused> {
        if self.safety.is_stopped() { Err(Refusal::EmergencyStop.into()) } else { Ok(()) }
    }

    /// Whether neither emergency stop nor door nor an interlock is in the way of light.
    fn may_light(&self) -> Result<(), Refused> {
        self.is_closed()?;
        if self.safety.is_interlocked() { Err(Refusal::Interlock.into()) } else { Ok(()) }
    }

    /// Whether neither emergency stop nor door is in the way of motion.
    fn is_closed(&self) -> Result<(), Refused> {
        self.is_not_stopped()?;
        if self.safety.is_open() {
            return Err(Refusal::DoorOpen.into());
        }
        Ok(())
    }
}
