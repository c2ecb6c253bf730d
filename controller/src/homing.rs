//! How axes find their references.
//!
//! By a switch: to it, away from it until it is released, and slowly back to its edge; with an index, on to the
//! first pulse after that. An axis that stands on its switch begins with the way back. Of an axis with
//! several actuators each has its own edge, and so its own reference, by which the axis is squared afterwards. By
//! a hard stop: on until the motor's current says that it stands against it. By the drive: it is asked to, and moves by
//! itself; the plan goes where it is until it has come back with its reference.
//!
//! An edge lies between two measurements: it is taken to be in the middle, right to half of what the axis moves
//! in a cycle at its latch speed.

use core::ops::Range;

use crate::planned::Planned;
use crate::travel::Travel;
use machine::operating::{Homing as Method, HomingMethod, InputFunction};
use machine::{JointUnit, Machine};
use messages::{ActuatorArray, MAX_ACTUATORS, MAX_AXES};

/// For how long a motor's current must say that it stands against its stop [s]: longer than it takes to speed up.
const PRESSING: f64 = 0.02;

/// What of the range between its soft limits an axis may go to find its reference.
const MOST_SHARE: f64 = 1.2;

/// For how long a drive may look for its reference at least [s].
const LEAST_PATIENCE: f64 = 10.0;

/// What is measured of the motors.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// Inputs, one bit each.
    pub inputs: u64,
    /// Actuators whose drives look for their references by themselves, one bit each.
    pub away: u16,
    /// Places of the motors [rad].
    pub angle: &'a ActuatorArray,
    /// Their currents [A].
    pub current: &'a ActuatorArray,
    /// Where the plan has them.
    pub standing: &'a Planned,
}

/// For how long a drive may look for the reference of an axis with such a `range` [m or rad]: twice there and back,
/// and slowly once [s].
fn patience(method: &Method, range: f64) -> f64 {
    let way = MOST_SHARE * range;
    LEAST_PATIENCE + 4.0 * way / method.speed + way / method.latch_speed
}

/// How far the search for one axis has come.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Begin,
    Approach,
    Retreat,
    Latch,
    /// The drive has been asked to look by itself, does so, and has come back.
    Asked,
    Away,
    Back,
    /// Coming to rest, before this.
    Stopping(Next),
    Found,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Next {
    Retreat,
    Latch,
    Found,
}

/// The search for one axis' reference.
#[derive(Debug, Clone)]
pub struct Search {
    axis: usize,
    own: Range<usize>,
    ratio: ActuatorArray,
    method: Method,
    /// Bits of the switch and the index of each actuator.
    switch: [u64; MAX_ACTUATORS],
    index: [u64; MAX_ACTUATORS],
    /// How far it may go [m or rad].
    most: f64,
    phase: Phase,
    /// Where the phase began.
    from: f64,
    /// Whether each actuator has passed its switch, and where its reference is [joint units].
    passed: [bool; MAX_ACTUATORS],
    found: [Option<f64>; MAX_ACTUATORS],
    before: ActuatorArray,
    /// For how many cycles a motor has pressed, and how many it must.
    pressed: u32,
    pressing: u32,
    /// For how many cycles the drive has looked, and how many it may.
    looked: u64,
    patience: u64,
}

/// How a search goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// It goes on.
    Searching,
    /// The axis rests, and its motors' places are to be shifted by so much [rad].
    Found(ActuatorArray),
    /// The axis rests, and its drive tells places in the machine.
    Told,
    /// It went so far, as far as it may, and found nothing [m or rad].
    Lost(f64),
    /// Its drive has looked for so many cycles, as many as it may.
    Late(u64),
}

impl Search {
    fn new(machine: &Machine, axis: usize, method: Method, period: f64) -> Self {
        let own = machine.axes.get(axis).map_or(0..0, |axis| axis.actuators.clone());
        let own = own.start..own.end.min(MAX_ACTUATORS);
        let (mut switch, mut index) = ([0; MAX_ACTUATORS], [0; MAX_ACTUATORS]);
        for (bit, input) in machine.operating.bits() {
            let (of, actuator, bits) = match input.function {
                InputFunction::Home { axis, actuator } => (axis, actuator, &mut switch),
                InputFunction::Index { axis, actuator } => (axis, actuator, &mut index),
                _ => continue,
            };
            for number in
                own.clone().filter(|own| of == axis && actuator.is_none_or(|it| it == *own))
            {
                bits[number] |= bit;
            }
        }
        let range = machine.axes.get(axis).map_or(0.0, |axis| {
            let [lower, upper] = axis.limits.position;
            let turn = if axis.unit == JointUnit::Angle { core::f64::consts::TAU } else { 1.0 };
            if (upper - lower).is_finite() { upper - lower } else { turn }
        });
        Self {
            axis,
            own,
            ratio: core::array::from_fn(|index| {
                machine.actuators.get(index).map_or(1.0, |it| it.ratio)
            }),
            method,
            switch,
            index,
            most: MOST_SHARE * range,
            phase: Phase::Begin,
            from: 0.0,
            passed: [false; MAX_ACTUATORS],
            found: [None; MAX_ACTUATORS],
            before: [0.0; MAX_ACTUATORS],
            pressed: 0,
            pressing: (PRESSING / period).ceil() as u32,
            looked: 0,
            patience: (patience(&method, range) / period).ceil() as u64,
        }
    }

    /// The bits of its actuators.
    fn bits(&self) -> u16 {
        self.own.clone().fold(0, |bits, index| bits | 1 << index)
    }

    /// The bits of the actuators whose drives shall look.
    fn asks(&self) -> u16 {
        if matches!(self.phase, Phase::Asked | Phase::Away) { self.bits() } else { 0 }
    }

    /// Goes on by one cycle where the drive looks by itself.
    fn look(&mut self, away: u16) -> Outcome {
        let is_away = away & self.bits() != 0;
        self.looked += 1;
        self.phase = match self.phase {
            Phase::Begin => Phase::Asked,
            Phase::Asked if is_away => Phase::Away,
            Phase::Away if !is_away => Phase::Back,
            phase => phase,
        };
        match self.phase {
            Phase::Back => Outcome::Told,
            _ if self.looked > self.patience => Outcome::Late(self.looked),
            _ => Outcome::Searching,
        }
    }

    fn begin(&mut self) {
        (self.phase, self.pressed, self.looked) = (Phase::Begin, 0, 0);
        (self.passed, self.found) = ([false; MAX_ACTUATORS], [None; MAX_ACTUATORS]);
    }

    /// Goes on by one cycle.
    fn step(&mut self, seen: &Seen<'_>, travel: &mut Travel) -> Outcome {
        if self.method.method == HomingMethod::Drive {
            return self.look(seen.away);
        }
        let joint: ActuatorArray =
            core::array::from_fn(|index| seen.angle[index] * self.ratio[index]);
        let towards = self.method.side.sign();
        let is_active = self.own.clone().any(|index| seen.inputs & self.switch[index] != 0);
        let way = travel.motion(self.axis).position - self.from;
        match self.phase {
            Phase::Begin if is_active => {
                self.go(Phase::Retreat, -towards * self.method.speed, seen, travel)
            }
            Phase::Begin => self.go(Phase::Approach, towards * self.method.speed, seen, travel),
            Phase::Approach if self.method.method == HomingMethod::HardStop => {
                let presses = |index: usize| seen.current[index].abs() >= self.method.current;
                self.pressed = if self.own.clone().any(presses) { self.pressed + 1 } else { 0 };
                if self.pressed >= self.pressing {
                    self.own.clone().for_each(|index| self.found[index] = Some(joint[index]));
                    self.halt(Next::Found, travel);
                }
            }
            Phase::Approach if is_active => self.halt(Next::Retreat, travel),
            Phase::Retreat if !is_active => self.halt(Next::Latch, travel),
            Phase::Latch => {
                self.latch(seen.inputs, &joint);
                if self.own.clone().all(|index| self.found[index].is_some()) {
                    self.halt(Next::Found, travel);
                }
            }
            Phase::Stopping(next) if travel.rests(self.axis) => match next {
                Next::Retreat => {
                    self.go(Phase::Retreat, -towards * self.method.speed, seen, travel)
                }
                Next::Latch => {
                    self.go(Phase::Latch, towards * self.method.latch_speed, seen, travel)
                }
                Next::Found => self.phase = Phase::Found,
            },
            Phase::Approach | Phase::Retreat | Phase::Stopping(_) | Phase::Found => {}
            Phase::Asked | Phase::Away | Phase::Back => {}
        }
        self.before = joint;
        if self.phase == Phase::Found {
            let mut shift = [0.0; MAX_ACTUATORS];
            for index in self.own.clone() {
                let found = self.found[index].unwrap_or(self.method.position);
                shift[index] = (self.method.position - found) / self.ratio[index];
            }
            return Outcome::Found(shift);
        }
        if way.abs() > self.most { Outcome::Lost(way.abs()) } else { Outcome::Searching }
    }

    /// Takes the edges that lie between the measurement before and this one.
    fn latch(&mut self, inputs: u64, joint: &ActuatorArray) {
        for index in self.own.clone() {
            let middle = (self.before[index] + joint[index]) / 2.0;
            let was_passed = self.passed[index];
            self.passed[index] |= inputs & self.switch[index] != 0;
            let is_here = match self.method.method {
                HomingMethod::Index => was_passed && inputs & self.index[index] != 0,
                _ => self.passed[index],
            };
            if is_here && self.found[index].is_none() {
                self.found[index] = Some(middle);
            }
        }
    }

    fn go(&mut self, phase: Phase, speed: f64, seen: &Seen<'_>, travel: &mut Travel) {
        travel.run(self.axis, speed, seen.standing);
        (self.phase, self.from) = (phase, travel.motion(self.axis).position);
    }

    fn halt(&mut self, next: Next, travel: &mut Travel) {
        travel.stop(self.axis);
        self.phase = Phase::Stopping(next);
    }
}

/// The search for the references of several axes, group by group.
#[derive(Debug, Clone)]
pub struct Homing {
    searches: Vec<Search>,
    wanted: [bool; MAX_AXES],
    /// Those that were wanted at first.
    asked: [bool; MAX_AXES],
    /// The place in the order that is being searched.
    order: u32,
}

/// How homing goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GroupOutcome {
    /// It goes on.
    Searching,
    /// An axis was found, and its motors' places are to be shifted by so much [rad].
    Found(usize, ActuatorArray),
    /// An axis was found by its drive, and places that are told of these actuators are those in the machine.
    Told(usize, u16),
    /// All axes of the group were found.
    Group,
    /// An axis went so far, as far as it may, and found nothing [m or rad].
    Lost(usize, f64, f64),
    /// The drive of an axis has looked for so many cycles, more than it may.
    Late(usize, u64, u64),
}

impl Homing {
    /// Of this machine, in cycles of `period` [s].
    pub fn new(machine: &Machine, period: f64) -> Self {
        let searches = (0..machine.axes.len()).filter_map(|axis| {
            let method = *machine.operating.homing(axis)?;
            let is_search = method.method != HomingMethod::Absolute;
            is_search.then(|| Search::new(machine, axis, method, period))
        });
        Self {
            searches: searches.collect(),
            wanted: [false; MAX_AXES],
            asked: [false; MAX_AXES],
            order: 0,
        }
    }

    /// The axes that have to look for their references, of those with a bit in `axes`, all for 0.
    pub fn axes(&self, axes: u32) -> impl Iterator<Item = usize> {
        let asked = move |axis: &usize| axes == 0 || axes & crate::reference::bit(*axis) != 0;
        self.searches.iter().map(|search| search.axis).filter(asked)
    }

    /// Begins with the first group of the axes with a bit in `axes`, all for 0.
    pub fn begin(&mut self, axes: u32) {
        let mut wanted = [false; MAX_AXES];
        self.axes(axes).filter(|axis| *axis < MAX_AXES).for_each(|axis| wanted[axis] = true);
        (self.wanted, self.asked) = (wanted, wanted);
        self.searches.iter_mut().for_each(Search::begin);
        self.next_group();
    }

    /// Goes on to the next group; whether there is one.
    pub fn next_group(&mut self) -> bool {
        let left = self.searches.iter().filter(|search| self.wanted[search.axis]);
        let next = left.map(|search| search.method.order).min();
        self.order = next.unwrap_or_default();
        next.is_some()
    }

    /// Whether the axis was to look for its reference since the newest [`Self::begin`].
    pub fn took_part(&self, axis: usize) -> bool {
        self.asked.get(axis).copied().unwrap_or_default()
    }

    /// Actuators whose drives shall look for their references by themselves, one bit each.
    pub fn asks(&self) -> u16 {
        let own =
            self.searches.iter().filter(|it| self.wanted[it.axis] && it.method.order == self.order);
        own.fold(0, |bits, search| bits | search.asks())
    }

    /// How fast the axis goes back home [m/s or rad/s].
    pub fn speed(&self, axis: usize) -> f64 {
        let own = self.searches.iter().find(|search| search.axis == axis);
        own.map_or(0.0, |search| search.method.speed)
    }

    /// Goes on by one cycle. Axes that are found are told one after the other, and only once.
    pub fn step(&mut self, seen: &Seen<'_>, travel: &mut Travel) -> GroupOutcome {
        let mut is_done = true;
        let mut told = GroupOutcome::Searching;
        for search in &mut self.searches {
            if !self.wanted[search.axis] || search.method.order != self.order {
                continue;
            }
            is_done = false;
            match search.step(seen, travel) {
                Outcome::Searching => {}
                Outcome::Found(shift) if told == GroupOutcome::Searching => {
                    self.wanted[search.axis] = false;
                    told = GroupOutcome::Found(search.axis, shift);
                }
                Outcome::Told if told == GroupOutcome::Searching => {
                    self.wanted[search.axis] = false;
                    told = GroupOutcome::Told(search.axis, search.bits());
                }
                Outcome::Found(_) | Outcome::Told => {}
                Outcome::Late(cycles) => {
                    return GroupOutcome::Late(search.axis, cycles, search.patience);
                }
                Outcome::Lost(way) => return GroupOutcome::Lost(search.axis, way, search.most),
            }
        }
        if is_done { GroupOutcome::Group } else { told }
    }
}
