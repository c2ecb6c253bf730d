//! Homing, jogging, probing, and what the inputs do to them.

use super::Controller;
use crate::homing::{GroupOutcome, Seen};
use crate::planned::Planned;
use crate::reference::bit;
use crate::squaring::Squaring;
use crate::state::{AfterRest, HomingStage, State};
use crate::supervision::Finding;
use crate::travel::{Bounds, MOVERS};
use machine::operating::{DoorAction, Side, StopCategory};
use messages::{
    CommandMode, Cycle, Fault, FaultCode, FaultQuantity, Feedback, HoldCause, MAX_ACTUATORS,
    MAX_AXES, MotionEnd, Nanoseconds,
};

/// A way until the probe touches, and where it did.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Probing {
    mover: usize,
    /// How far it may go [m or rad].
    bounds: [f64; 2],
    /// What is added to the ways of the joints: where the tool is with them at zero.
    offset: f64,
    /// Where it was in the measurement before [m or rad].
    before: f64,
    found: Option<f64>,
}

impl Probing {
    pub(super) fn new(mover: usize, bounds: [f64; 2], place: f64, offset: f64) -> Self {
        Self { mover, bounds, offset, before: place, found: None }
    }

    /// What was moved to probe last, from 1; 0 for none.
    pub(super) fn found_axis(&self) -> u32 {
        if self.found.is_some() { self.mover as u32 + 1 } else { 0 }
    }

    /// Where the joint was when the probe touched [m or rad].
    pub(super) fn found(&self) -> f64 {
        self.found.unwrap_or_default()
    }
}

/// An axis that is jogged for as long as somebody says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Jog {
    /// The number of the request that began it.
    number: u32,
    /// For how many cycles it goes on without another word.
    left: u32,
}

impl Jog {
    pub(super) fn new(number: u32, left: u32) -> Self {
        Self { number, left }
    }

    /// Goes on for so many cycles, if it is the jog with this number.
    pub(super) fn go_on(&mut self, number: f64, left: u32) -> bool {
        let is_meant = f64::from(self.number) == number;
        self.left = if is_meant { left } else { self.left };
        is_meant
    }
}

impl Controller {
    /// Takes the references that were found in the cycle before: the same places have other numbers.
    pub(super) fn refer(&mut self) {
        if let Some(shift) = self.reference.apply() {
            self.feedforward.shift(&shift);
            self.travel.shift(&shift);
        }
    }

    /// Axes whose soft limits hold: those that know their place, and do not look for it.
    pub(super) fn bounded(&self) -> u32 {
        if matches!(self.state, State::Homing(_)) { 0 } else { self.reference.homed() }
    }

    /// Whether what moves without a stream rests, as far as drives have been told.
    pub(super) fn travel_rests(&self) -> bool {
        let rests = self.travel.is_at_rest() && self.away == 0;
        rests && (self.playing != 0 || self.feedforward.rests())
    }

    /// Actuators whose drives shall look for their references by themselves, one bit each.
    pub(super) fn asks(&self) -> u16 {
        if self.state == State::Homing(HomingStage::Searching) { self.homing.asks() } else { 0 }
    }

    /// The plan goes where drives are that look for their references by themselves.
    pub(super) fn go_along(&mut self, feedback: &Feedback) {
        self.away = if self.state.follows() { feedback.homing | self.asks() } else { 0 };
        for index in 0..self.machine.actuators.len().min(MAX_ACTUATORS) {
            let place = feedback.position[index];
            if self.away >> index & 1 == 0 || !place.is_finite() {
                continue;
            }
            self.feedforward.put(index, place);
            self.travel.put(index, place);
            if let Some(cascade) = &mut self.cascades[index] {
                cascade.reset();
            }
            if let Some(prediction) = self.predictions.get_mut(index) {
                prediction.reset();
            }
        }
    }

    /// Goes on by one cycle where axes are moved without a stream, or stands.
    pub(super) fn travel_on(&mut self) -> Planned {
        let standing = *self.feedforward.newest();
        if self.travel.is_at_rest() {
            return standing;
        }
        self.watch_dead_man();
        self.keep_within_limits(&standing);
        let mut is_reached = true;
        let weight = |planned: &mut Planned| is_reached = self.standing.bear(planned);
        let planned = self.travel.advance(weight).unwrap_or(standing);
        if !is_reached {
            self.give_up_travel(MotionEnd::OutOfReach);
        }
        planned
    }

    /// Stops the axes that nobody has spoken for.
    fn watch_dead_man(&mut self) {
        for axis in 0..MOVERS {
            match &mut self.jogs[axis] {
                Some(Jog { left: 0, .. }) => {
                    self.travel.stop(axis);
                    self.jogs[axis] = None;
                    self.end_motion(MotionEnd::DeadMan);
                }
                Some(jog) => jog.left -= 1,
                None => {}
            }
        }
    }

    /// What jogged and probing movers may go to: joints to their soft limits, where they know their place; and the
    /// tool to the ends of its area, where several joints move it and all know their place.
    pub(super) fn bounds(&self) -> Bounds {
        let bounded = self.bounded();
        let axes = self.machine.axes.len().min(MAX_AXES);
        let is_known = (0..axes).all(|axis| bounded & bit(axis) != 0);
        core::array::from_fn(|mover| match mover.checked_sub(MAX_AXES) {
            None => {
                let axis = self.machine.axes.get(mover).filter(|_| bounded & bit(mover) != 0);
                axis.map(|axis| axis.limits.position)
            }
            Some(direction) => {
                let is_bounded = is_known && self.travel.directions().is_crossed(direction);
                let area = &self.machine.area;
                is_bounded.then(|| [area.lower[direction], area.upper[direction]])
            }
        })
    }

    /// Keeps jogged and probing movers within what they may go to.
    fn keep_within_limits(&mut self, standing: &Planned) {
        let bounds = self.bounds();
        for mover in 0..MOVERS {
            if self.travel.keep_within(mover, &bounds, standing).is_some() {
                self.jogs[mover] = None;
                self.end_motion(MotionEnd::SoftLimit);
            }
        }
        if self.state == State::Probing {
            let mover = self.probing.mover;
            let mut own = [None; MOVERS];
            own[mover] = Some(self.probing.bounds);
            if self.travel.keep_within(mover, &own, standing).is_some() {
                self.end_motion(MotionEnd::NotTouched);
            }
        }
    }

    /// A motion by hand begins.
    pub(super) fn begin_motion(&mut self, state: State) {
        (self.state, self.motion_end) = (state, MotionEnd::None);
    }

    /// A motion by hand comes to its end, for this reason unless there was one before.
    fn end_motion(&mut self, end: MotionEnd) {
        if self.state.is_by_hand() && self.motion_end == MotionEnd::None {
            self.motion_end = end;
        }
    }

    /// A motion by hand has ended.
    pub(super) fn rest_by_hand(&mut self, end: MotionEnd) {
        self.end_motion(end);
        self.state = State::Idle;
    }

    /// Whatever moves without a stream comes to rest for this reason, and light is out.
    pub(super) fn give_up_travel(&mut self, end: MotionEnd) {
        self.end_motion(end);
        self.travel.stop_all();
        self.jogs = [None; MOVERS];
        self.pulse = Default::default();
    }

    /// Reacts to what the inputs say.
    pub(super) fn heed_inputs(&mut self, now: Nanoseconds, feedback: &Feedback) {
        if self.state.mode() == CommandMode::Disabled {
            return;
        }
        if self.safety.is_stopped() && !matches!(self.state, State::Failing { .. } | State::Halted)
        {
            self.fail(Finding::sound(Fault::new(FaultCode::EmergencyStop)), now);
        }
        if self.safety.is_stopped() && self.safety.category() == StopCategory::Zero {
            self.end_in_fault(feedback.cycle);
            return;
        }
        self.heed_limits(now);
        if self.safety.is_open() {
            self.heed_door(now);
        }
        if self.safety.is_dark() {
            match self.state {
                State::Running | State::Holding(_) => {
                    self.player.hold();
                    let is_open = self.safety.is_open();
                    let cause = if is_open { HoldCause::Door } else { HoldCause::Interlock };
                    self.state = State::Holding(AfterRest::Wait(cause));
                }
                State::Pulsing => {
                    let is_open = self.safety.is_open();
                    self.give_up_travel(if is_open {
                        MotionEnd::DoorOpen
                    } else {
                        MotionEnd::Interlock
                    });
                    self.state = State::Idle;
                }
                _ => {}
            }
        }
    }

    fn heed_door(&mut self, now: Nanoseconds) {
        let plays = matches!(self.state, State::Running | State::Holding(_));
        if plays && self.safety.action() == DoorAction::Stop {
            self.fail(Finding::sound(Fault::new(FaultCode::DoorOpened)), now);
        }
        if matches!(self.state, State::Homing(_) | State::Probing | State::Jogging) {
            self.give_up_travel(MotionEnd::DoorOpen);
            self.state = State::Jogging;
        }
    }

    /// An axis that moves on towards the limit switch that it is on must be stopped by its drive.
    fn heed_limits(&mut self, now: Nanoseconds) {
        if self.safety.limited().is_none() || !self.state.follows() {
            return;
        }
        for index in 0..self.machine.axes.len().min(MAX_AXES) {
            let speed = self.joint_speed(index);
            let side = if speed < 0.0 { Side::Lower } else { Side::Upper };
            if speed != 0.0 && self.safety.is_at_limit(index, side) {
                let fault = Fault::new(FaultCode::HardLimit).on_axis(index);
                let place = self.travel.place(index, self.feedforward.now());
                self.fail(Finding::lost(fault.with(FaultQuantity::Position, place)), now);
                return;
            }
        }
    }

    /// How fast the plan has the joint of an axis go on [joint units/s].
    fn joint_speed(&self, axis: usize) -> f64 {
        let speed = &self.feedforward.newest().speed;
        let own = self.machine.actuators.iter().zip(speed).filter(|(it, _)| it.axis == axis);
        own.map(|(it, speed)| it.share * (speed * it.ratio)).sum()
    }

    /// Whether the latched fault leaves the axes powered at rest.
    pub(super) fn halts(&self) -> bool {
        self.fault.code() == FaultCode::EmergencyStop && self.safety.category() == StopCategory::Two
    }

    /// At rest and powered, with the fault latched; a stream in hand is given up.
    pub(super) fn halt(&mut self, cycle: Cycle) {
        self.state = State::Halted;
        if self.intake.started() != 0 {
            self.give_up(cycle);
        }
    }

    /// Goes on with homing.
    pub(super) fn home(&mut self, now: Nanoseconds, feedback: &Feedback, stage: HomingStage) {
        match stage {
            HomingStage::Searching => {
                let seen = Seen {
                    inputs: feedback.inputs,
                    away: feedback.homing,
                    angle: &feedback.position,
                    current: &feedback.current,
                    standing: self.feedforward.newest(),
                };
                match self.homing.step(&seen, &mut self.travel) {
                    GroupOutcome::Searching => {}
                    GroupOutcome::Found(axis, shift) => {
                        self.reference.shift(&shift);
                        self.reference.found(axis);
                    }
                    GroupOutcome::Told(axis, actuators) => {
                        self.reference.shift(&self.reference.told(actuators));
                        self.reference.found(axis);
                    }
                    GroupOutcome::Late(axis, cycles, most) => {
                        let fault = Fault::new(FaultCode::HomingFailed).on_axis(axis);
                        let (cycles, most) = (cycles as f64, most as f64);
                        let fault = fault.beyond(FaultQuantity::Cycles, cycles, most);
                        self.fail(Finding::sound(fault), now);
                    }
                    GroupOutcome::Group => {
                        self.state = State::Homing(HomingStage::Squaring { begun: false });
                    }
                    GroupOutcome::Lost(axis, way, most) => {
                        let fault = Fault::new(FaultCode::HomingFailed).on_axis(axis);
                        let fault = fault.beyond(FaultQuantity::SearchDistance, way, most);
                        self.fail(Finding::sound(fault), now);
                    }
                }
            }
            HomingStage::Squaring { begun: false } => {
                self.squaring = Squaring::new(&self.machine, self.feedforward.newest());
                self.state = State::Homing(HomingStage::Squaring { begun: true });
            }
            HomingStage::Squaring { begun: true } if self.squaring.is_done() => {
                if self.homing.next_group() {
                    self.state = State::Homing(HomingStage::Searching);
                } else {
                    self.go_home();
                    self.state = State::Homing(HomingStage::Returning);
                }
            }
            HomingStage::Returning if self.travel_rests() => {
                self.rest_by_hand(MotionEnd::Reached);
            }
            HomingStage::Squaring { .. } | HomingStage::Returning => {}
        }
    }

    /// Sends the axes that were homed to where they stand at home.
    fn go_home(&mut self) {
        let standing = *self.feedforward.newest();
        for axis in 0..self.machine.axes.len().min(MAX_AXES) {
            if !self.homing.took_part(axis) {
                continue;
            }
            let home = self.machine.home_joints.get(axis).copied().unwrap_or_default();
            let way = home - self.travel.place(axis, &standing);
            if way != 0.0 {
                self.travel.go(axis, way, self.homing.speed(axis), &standing);
            }
        }
    }

    /// Goes on with probing.
    pub(super) fn probe(&mut self, feedback: &Feedback) {
        let Probing { mover, offset, before, found, .. } = self.probing;
        let actuators = self.machine.actuators.iter().zip(&feedback.position);
        let place = actuators.fold(offset, |place, (it, angle)| {
            place + self.travel.share(mover, it.axis) * (it.share * (angle * it.ratio))
        });
        if found.is_none() && self.safety.probe() == Some(true) {
            self.probing.found = Some((before + place) / 2.0);
            self.travel.stop(mover);
        }
        self.probing.before = place;
        if self.travel_rests() {
            let is_found = self.probing.found.is_some();
            self.rest_by_hand(if is_found { MotionEnd::Reached } else { MotionEnd::NotTouched });
        }
    }
}
