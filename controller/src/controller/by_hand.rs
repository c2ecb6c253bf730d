//! What people ask for that moves, lights or switches without a stream: whether it may be, and how it begins.

use super::Controller;
use super::operating::{Jog, Probing};
use super::requests::Refused;
use crate::planned::Planned;
use crate::state::{HomingStage, State};
use crate::test_pulse::TestPulse;
use crate::travel::{Beyond, MOVERS};
use machine::operating::Side;
use messages::feedback::status;
use messages::{Feedback, MAX_AXES, MotionEnd, Nanoseconds, OperatorRequest, Refusal};

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
    pub(super) fn begin_homing(&mut self, axes: u32) -> Result<(), Refused> {
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
    pub(super) fn jog(&mut self, request: &OperatorRequest) -> Result<(), Refused> {
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
    pub(super) fn jog_on(&mut self, request: &OperatorRequest) -> Result<(), Refused> {
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
    pub(super) fn step_axis(&mut self, request: &OperatorRequest) -> Result<(), Refused> {
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

    pub(super) fn begin_probing(&mut self, request: &OperatorRequest) -> Result<(), Refused> {
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

    pub(super) fn begin_pulse(
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
    pub(super) fn switch_output(&mut self, request: &OperatorRequest) -> Result<(), Refused> {
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
        let mut standing = *self.feedforward.newest();
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
}
