//! What the plan asks of the motors, before any feedback.
//!
//! References belong to the instant of the measurement, which may be before the deadline at which it is told. The velocity reference is the difference
//! of two position references, because the measured velocity is the difference of two encoder
//! positions: any other pair costs 95–250 µm at the tool (source 003, the pilot).
//!
//! The voltage belongs to the cycle in which it acts, which is the latency of its actuator after the deadline
//! at which it is sent. The mean of `R·i + L·i′ + k·ω` over that cycle is
//! `R·ī + L·(i₂ − i₁)/T + k·(θ₂ − θ₁)/T`. One cycle late costs 43 µm, half a cycle 26 µm.
//!
//! Coulomb friction has the sign of the planned motion. Where a motor turns round inside a cycle,
//! its mean over the cycle is weighted by how long either direction lasts.

use crate::cascade::Reference;
use crate::catch_up::CatchUp;
use crate::latency::{Latencies, Latency};
use crate::lookahead::Lookahead;
use crate::planned::{Planned, Point};
use crate::player::Instant;
use crate::winding::Winding;
use machine::{Actuator, ActuatorMode, Machine};
use messages::delay::{Delay, Recent};
use messages::time::Period;
use messages::{ActuatorArray, MAX_ACTUATORS};

/// Planned speed below which a motor counts as standing [rad/s]: less than a count of any usual
/// encoder in a minute. However slowly it creeps above that, friction is against it.
const STANDING: f64 = machine::Friction::STANDING;

/// Cycles from the start of the newest command's cycle back to the feedback that it answers.
const ANSWER: usize = 1;

/// Targets for the cycle in which the command acts.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Target {
    /// Motor angle at its end [rad].
    pub position: f64,
    /// Mean motor speed; that at the end of the cycle for a drive that follows the position, so that it can
    /// follow a curve inside the cycle [rad/s].
    pub velocity: f64,
    /// Mean motor torque, friction included [N·m].
    pub effort: f64,
}

/// Turns the stream into references and voltages.
///
/// It keeps what the player has come to in the newest cycles, and for each of them how far the targets were
/// off it, where axes are brought back to the plan. *Back* counts cycles: in the plan from the player's
/// newest instant, in targets from the end of the cycle of the newest command.
#[derive(Debug, Clone)]
pub struct Feedforward {
    period: Period,
    /// Its time [s].
    cycle_time: f64,
    actuators: Vec<Actuator>,
    latencies: Latencies,
    windings: Vec<Option<Winding>>,
    plan: Recent<Planned>,
    off: Recent<Off>,
    /// What the motors have been told for the instant of the feedback.
    now: Planned,
}

/// How far targets are off the plan.
#[derive(Debug, Clone, Copy, Default)]
struct Off {
    /// [rad].
    angle: ActuatorArray,
    /// [rad/s].
    speed: ActuatorArray,
}

impl Feedforward {
    /// For this machine, with the motors at zero.
    pub fn new(machine: &Machine) -> Self {
        let resting = Planned { tool: machine.home, ..Planned::default() };
        let period = machine.realtime.period;
        let latencies = Latencies::of(machine);
        // The end and the start of the command's cycle, the instant of the feedback, and the one before that.
        let kept = 2 + ANSWER + 1;
        let windings = machine.actuators.iter().zip(&latencies.actuators);
        Self {
            period,
            cycle_time: period.seconds(),
            actuators: machine.actuators.clone(),
            windings: windings
                .map(|(actuator, latency)| {
                    let motor = actuator.motor.dc()?;
                    Some(Winding::new(motor, period, latency.acts))
                })
                .collect(),
            plan: Recent::of(resting, latencies.ahead + latencies.oldest() + kept),
            off: Recent::of(Off::default(), latencies.longest_answered() + kept),
            now: resting,
            latencies,
        }
    }

    /// What the motors have been told for the instant of the feedback.
    pub fn now(&self) -> &Planned {
        &self.now
    }

    /// What the plan has for the newest instant that the player has come to.
    pub fn newest(&self) -> &Planned {
        self.plan.back(0)
    }

    /// Whether the plan stands from the end of the cycle of the newest command, of the actuator with the longest
    /// latency, to the newest instant.
    pub fn rests(&self) -> bool {
        let mut told = (0..=self.latencies.ahead).map(|back| self.plan.back(back));
        told.all(|planned| planned.speed.iter().all(|speed| *speed == 0.0))
    }

    /// What the motors have been told for the end of the cycle of the newest command, each by its own latency, or
    /// `back` cycles before that.
    pub fn told(&self, back: usize) -> Planned {
        let (mut told, off) = (self.sent(back), self.off.back(back));
        for index in 0..self.actuators.len().min(MAX_ACTUATORS) {
            told.set(index, told.point(index).off(off.angle[index], off.speed[index]));
        }
        told
    }

    /// What the plan has for that.
    fn sent(&self, back: usize) -> Planned {
        let mut sent = *self.plan.back(self.latencies.ahead + back);
        for index in 0..self.actuators.len().min(MAX_ACTUATORS) {
            sent.set(index, self.planned(index, back));
        }
        sent
    }

    /// The way back to the plan for axes that went on from `last` by themselves, for `cycles`, to the
    /// end of the newest command.
    pub fn coasted(&self, last: &Planned, cycles: u64) -> CatchUp {
        CatchUp::new(&last.coasted(self.period.of(cycles)), &self.sent(0), self.period)
    }

    /// Has the axes where such a coasting left them, and where they were in the cycles before.
    pub fn put_coasted(&mut self, last: &Planned, cycles: u64) {
        let told = usize::try_from(cycles).unwrap_or(usize::MAX).min(self.off.count() - 1);
        for back in 0..=told {
            let coasted = last.coasted(self.period.of(cycles - back as u64));
            let sent = self.sent(back);
            let off = self.off.back_mut(back);
            for index in 0..MAX_ACTUATORS {
                off.angle[index] = coasted.angle[index] - sent.angle[index];
                off.speed[index] = coasted.speed[index] - sent.speed[index];
            }
        }
        self.measure();
    }

    /// Rests where `resting` is from now on, as if it always had. The voltage that this takes is given
    /// as soon as the motors are powered: `current` is what flows then [A], `None` before.
    pub fn rest_at(&mut self, resting: Planned, current: Option<&ActuatorArray>) {
        self.plan.fill(resting);
        self.off.fill(Off::default());
        self.now = resting;
        for (index, actuator) in self.actuators.iter().enumerate() {
            let voltage = self.voltage(index, actuator);
            let Some(winding) = &mut self.windings[index] else { continue };
            match current {
                Some(current) => winding.rest(current[index], Some(voltage)),
                None => winding.rest(0.0, None),
            }
        }
    }

    /// The motor with this index rests at `angle` [rad], where somebody else has brought it, as if it always had.
    pub fn put(&mut self, index: usize, angle: f64) {
        for planned in self.plan.iter_mut().chain([&mut self.now]) {
            (planned.angle[index], planned.speed[index]) = (angle, 0.0);
        }
        for off in self.off.iter_mut() {
            (off.angle[index], off.speed[index]) = (0.0, 0.0);
        }
    }

    /// The motors' places are told otherwise by `shift` [rad] from now on: nothing moves.
    pub fn shift(&mut self, shift: &ActuatorArray) {
        for planned in self.plan.iter_mut().chain([&mut self.now]) {
            planned.angle.iter_mut().zip(shift).for_each(|(angle, shift)| *angle += shift);
        }
    }

    /// Goes on by one cycle, with the player at `planned`. The targets of the command are off it as much as
    /// `catch_up` says.
    pub fn advance(&mut self, planned: Planned, catch_up: &mut CatchUp) {
        for (index, actuator) in self.actuators.iter().enumerate() {
            let voltage = self.voltage(index, actuator);
            let [from, to] = self.ends(index);
            let Some(winding) = &mut self.windings[index] else { continue };
            let mean = (to.angle - from.angle) / self.cycle_time;
            winding.advance(voltage, mean, to.speed - from.speed);
        }
        self.plan.push(planned);
        let mut off = Off::default();
        catch_up.apply(&mut off.angle, &mut off.speed);
        self.off.push(off);
        self.measure();
    }

    /// What the stream asks of the motors at `instant`.
    pub fn plan(&self, lookahead: &Lookahead, instant: Instant) -> Planned {
        Planned::at(&self.actuators, lookahead, instant)
    }

    /// References and voltage for the actuator with this index.
    pub fn reference(&self, index: usize, actuator: &Actuator) -> Reference {
        Reference {
            position: self.now.angle[index],
            velocity: (self.now.angle[index] - self.at_feedback(index, 1).angle) / self.cycle_time,
            current: self.windings[index].as_ref().map_or(0.0, Winding::now),
            voltage: self.voltage(index, actuator),
        }
    }

    /// The voltage over the cycle in which the command acts; 0 for a stepper, whose driver has its
    /// own current loop.
    fn voltage(&self, index: usize, actuator: &Actuator) -> f64 {
        let Some(motor) = actuator.motor.dc() else { return 0.0 };
        let friction = actuator.friction.coulomb / motor.torque_constant;
        let ends = self.ends(index);
        let [first, last] = ends.map(|end| end.torque / motor.torque_constant);
        let [from, mean, to] = directions(ends);
        let mean_current = (first + last) / 2.0 + friction * mean;
        let current_change = last - first + friction * (to - from);
        let angle_change = ends[1].angle - ends[0].angle;
        motor.voltage(
            mean_current,
            current_change / self.cycle_time,
            angle_change / self.cycle_time,
        )
    }

    /// Targets for the actuator with this index.
    pub fn target(&self, index: usize, actuator: &Actuator) -> Target {
        let [from, to] = self.ends(index);
        let torques = self.torque_ends(index);
        let [_, mean, _] = directions(torques);
        let [first, last] = torques.map(|end| end.torque);
        Target {
            position: to.angle,
            velocity: match actuator.mode {
                ActuatorMode::Position => to.speed,
                _ => (to.angle - from.angle) / self.cycle_time,
            },
            effort: (first + last) / 2.0 + actuator.friction.coulomb * mean,
        }
    }

    /// The fastest that the plan has this motor turn between the measurement and the end of the
    /// command [rad/s].
    pub fn fastest(&self, index: usize) -> f64 {
        let [from, to] = self.ends(index);
        let speeds = [self.now.speed[index], from.speed, to.speed];
        speeds.into_iter().map(f64::abs).fold(0.0, f64::max)
    }

    /// The motor with this index at the start and at the end of the cycle in which the command acts.
    fn ends(&self, index: usize) -> [Point; 2] {
        [1, 0].map(|back| {
            let off = self.off.back(back);
            self.planned(index, back).off(off.angle[index], off.speed[index])
        })
    }

    /// The motor with this index at the start and at the end of the cycle in which the torque of the command is
    /// there.
    fn torque_ends(&self, index: usize) -> [Point; 2] {
        let behind = self.latencies.actuators[index].torque;
        [1, 0].map(|back| {
            let off = self.off.back(back);
            self.plan_before(index, back, behind).off(off.angle[index], off.speed[index])
        })
    }

    /// Where the plan has the motor with this index at the end of the cycle of the command, or `back`
    /// cycles before that.
    fn planned(&self, index: usize, back: usize) -> Point {
        self.plan_before(index, back, self.latencies.actuators[index].behind)
    }

    /// What the motor with this index has been told for the instant of the measurement that the feedback tells, or
    /// `back` cycles before that.
    fn at_feedback(&self, index: usize, back: usize) -> Point {
        let Latency { measured, answered: Delay { cycles, part, .. }, .. } =
            self.latencies.actuators[index];
        let sent = 1 + ANSWER + back;
        let off = |values: fn(&Off) -> &ActuatorArray| {
            let value = |back: usize| values(self.off.back(back))[index];
            let later = value(sent + cycles);
            if part == 0.0 { later } else { later + (value(sent + cycles + 1) - later) * part }
        };
        let planned = self.plan_before(index, self.latencies.ahead + sent, measured);
        planned.off(off(|off| &off.angle), off(|off| &off.speed))
    }

    /// What the plan has for the motor with this index `back` cycles before the player's newest instant, and by `time`
    /// before that.
    fn plan_before(&self, index: usize, back: usize, time: Delay) -> Point {
        let later = self.plan.back(back + time.cycles);
        if time.part == 0.0 {
            return later.point(index);
        }
        let earlier = self.plan.back(back + time.cycles + 1);
        earlier.between(later, 1.0 - time.part, self.cycle_time, index)
    }

    /// Looks up what the motors have been told for the instant of the feedback.
    fn measure(&mut self) {
        let mut now = *self.plan.back(self.latencies.ahead + 1 + ANSWER);
        for index in 0..self.actuators.len().min(MAX_ACTUATORS) {
            now.set(index, self.at_feedback(index, 0));
        }
        self.now = now;
    }
}

/// Direction of the planned motion at the start of a cycle with these `ends`, its mean over the cycle, and at
/// the end; −1..=1.
fn directions(ends: [Point; 2]) -> [f64; 3] {
    let [from, to] = ends.map(|end| if end.speed.abs() < STANDING { 0.0 } else { end.speed });
    let size = from.abs() + to.abs();
    // Speed taken as linear in the cycle: each direction lasts in proportion to its speed.
    let mean = if size > 0.0 { (from + to) / size } else { 0.0 };
    let direction = |speed: f64| if speed == 0.0 { 0.0 } else { speed.signum() };
    [direction(from), mean, direction(to)]
}
