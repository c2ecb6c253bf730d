//! What the plan asks of the motors, before any feedback.
//!
//! References belong to the instant of the measurement. The velocity reference is the difference
//! of two position references, because the measured velocity is the difference of two encoder
//! positions: any other pair costs 95–250 µm at the tool (source 003, the pilot).
//!
//! The voltage belongs to the cycle in which it acts. The mean of `R·i + L·i′ + k·ω` over that
//! cycle is `R·ī + L·(i₂ − i₁)/T + k·(θ₂ − θ₁)/T`. One cycle late costs 43 µm, half a cycle 26 µm.
//!
//! Coulomb friction has the sign of the planned motion. Where a motor turns round inside a cycle,
//! its mean over the cycle is weighted by how long either direction lasts.

use crate::cascade::Reference;
use crate::catch_up::CatchUp;
use crate::lookahead::Lookahead;
use crate::player::Instant;
use crate::winding::Winding;
use machine::{Actuator, ActuatorMode, Machine};
use messages::time::{Period, SETPOINT_TIME};
use messages::{ActuatorArray, MAX_ACTUATORS, Nanoseconds};

/// Planned speed below which a motor counts as standing [rad/s]: less than a count of any usual
/// encoder in a minute. However slowly it creeps above that, friction is against it.
const STANDING: f64 = machine::Friction::STANDING;

/// What the plan asks of the motors at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Planned {
    /// Angle [rad].
    pub angle: ActuatorArray,
    /// Speed, the exact derivative [rad/s].
    pub speed: ActuatorArray,
    /// Torque without Coulomb friction [N·m].
    pub torque: ActuatorArray,
    /// Where the tool shall be, machine frame [m].
    pub tool: [f64; 3],
}

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

/// Turns the stream into references and voltages, keeping the last four instants.
#[derive(Debug, Clone)]
pub struct Feedforward {
    period: Period,
    /// Its time [s].
    cycle_time: f64,
    actuators: Vec<Actuator>,
    windings: Vec<Option<Winding>>,
    before: Planned,
    now: Planned,
    next: Planned,
    after: Planned,
}

impl Feedforward {
    /// For this machine, with the motors at zero.
    pub fn new(machine: &Machine) -> Self {
        let resting = Planned { tool: machine.home, ..Planned::default() };
        let period = machine.realtime.period;
        Self {
            period,
            cycle_time: period.seconds(),
            actuators: machine.actuators.clone(),
            windings: (machine.actuators.iter())
                .map(|actuator| actuator.motor.dc().map(|motor| Winding::new(motor, period)))
                .collect(),
            before: resting,
            now: resting,
            next: resting,
            after: resting,
        }
    }

    /// What the plan has for the instant of the feedback.
    pub fn now(&self) -> &Planned {
        &self.now
    }

    /// What the plan has for the start of the cycle in which the command acts.
    pub fn next(&self) -> &Planned {
        &self.next
    }

    /// What the plan has for the end of the cycle in which the command acts.
    pub fn after(&self) -> &Planned {
        &self.after
    }

    /// The way back to the plan for axes that went on from `last` by themselves, for `cycles`, to the
    /// end of the newest command.
    pub fn coasted(&self, last: &Planned, cycles: u64) -> CatchUp {
        CatchUp::new(&last.coasted(self.period.of(cycles)), &self.after, self.period)
    }

    /// Has the axes where such a coasting left them, and where they were a cycle before.
    pub fn put_coasted(&mut self, last: &Planned, cycles: u64) {
        let put = |planned: &mut Planned, coasted: &Planned| {
            (planned.angle, planned.speed) = (coasted.angle, coasted.speed);
        };
        put(&mut self.next, &last.coasted(self.period.of(cycles.saturating_sub(1))));
        put(&mut self.after, &last.coasted(self.period.of(cycles)));
    }

    /// Rests where `resting` is from now on, as if it always had. The voltage that this takes is given
    /// as soon as the motors are powered: `current` is what flows then [A], `None` before.
    pub fn rest_at(&mut self, resting: Planned, current: Option<&ActuatorArray>) {
        (self.before, self.now, self.next, self.after) = (resting, resting, resting, resting);
        for (index, actuator) in self.actuators.iter().enumerate() {
            let voltage = self.voltage(index, actuator);
            let Some(winding) = &mut self.windings[index] else { continue };
            match current {
                Some(current) => winding.rest(current[index], Some(voltage)),
                None => winding.rest(0.0, None),
            }
        }
    }

    /// The motors' places are told otherwise by `shift` [rad] from now on: nothing moves.
    pub fn shift(&mut self, shift: &ActuatorArray) {
        for planned in [&mut self.before, &mut self.now, &mut self.next, &mut self.after] {
            planned.angle.iter_mut().zip(shift).for_each(|(angle, shift)| *angle += shift);
        }
    }

    /// Goes on by one cycle, to `planned` at its end.
    pub fn advance(&mut self, planned: Planned) {
        for (index, actuator) in self.actuators.iter().enumerate() {
            let voltage = self.voltage(index, actuator);
            let Self { next, after, windings, .. } = self;
            let Some(winding) = &mut windings[index] else { continue };
            winding.advance(
                voltage,
                (after.angle[index] - next.angle[index]) / self.cycle_time,
                after.speed[index] - next.speed[index],
            );
        }
        (self.before, self.now, self.next, self.after) = (self.now, self.next, self.after, planned);
    }

    /// What the stream asks of the motors at `instant`: the setpoint itself where there is one,
    /// else between two by cubic Hermite interpolation of position and lead, linear for torques.
    pub fn plan(&self, lookahead: &Lookahead, instant: Instant) -> Planned {
        let sequence = instant.time.sequence();
        let fraction = instant.time.fraction();
        let from = lookahead.setpoint(sequence);
        let to = lookahead.setpoint(sequence + 1);
        let earlier = lookahead.setpoint(sequence.saturating_sub(1));
        let (rate, change) = (instant.rate, instant.rate_change);
        let mut planned = Planned { tool: from.tool, ..Planned::default() };
        if fraction == 0.0 {
            for (index, actuator) in self.actuators.iter().enumerate().take(MAX_ACTUATORS) {
                let slope = |from: f64, to: f64| (to - from) / (2.0 * SETPOINT_TIME);
                let lead_speed = slope(earlier.lead[index], to.lead[index]);
                let static_speed = slope(earlier.static_lead[index], to.static_lead[index]);
                let demand = Demand {
                    position: from.position[actuator.axis],
                    velocity: from.velocity[actuator.axis],
                    lead: from.lead[index],
                    lead_speed,
                    static_lead: from.static_lead[index],
                    static_speed,
                    lead_momentum: from.lead_momentum[index],
                    effort: from.effort[index],
                    standing: from.static_effort[index],
                    momentum: from.momentum[index],
                };
                planned.put(index, actuator, &demand, rate, change);
            }
            return planned;
        }
        let later = lookahead.setpoint(sequence + 2);
        let linear = |from: f64, to: f64| from + (to - from) * fraction;
        for (index, actuator) in self.actuators.iter().enumerate().take(MAX_ACTUATORS) {
            let (position, velocity) = hermite(
                from.position[actuator.axis],
                from.velocity[actuator.axis] * SETPOINT_TIME,
                to.position[actuator.axis],
                to.velocity[actuator.axis] * SETPOINT_TIME,
                fraction,
            );
            let (lead, lead_speed) = hermite(
                from.lead[index],
                (to.lead[index] - earlier.lead[index]) / 2.0,
                to.lead[index],
                (later.lead[index] - from.lead[index]) / 2.0,
                fraction,
            );
            let (static_lead, static_speed) = hermite(
                from.static_lead[index],
                (to.static_lead[index] - earlier.static_lead[index]) / 2.0,
                to.static_lead[index],
                (later.static_lead[index] - from.static_lead[index]) / 2.0,
                fraction,
            );
            let demand = Demand {
                position,
                velocity: velocity / SETPOINT_TIME,
                lead,
                lead_speed: lead_speed / SETPOINT_TIME,
                static_lead,
                static_speed: static_speed / SETPOINT_TIME,
                lead_momentum: linear(from.lead_momentum[index], to.lead_momentum[index]),
                effort: linear(from.effort[index], to.effort[index]),
                standing: linear(from.static_effort[index], to.static_effort[index]),
                momentum: linear(from.momentum[index], to.momentum[index]),
            };
            planned.put(index, actuator, &demand, rate, change);
        }
        let around: [&[f64; 3]; 8] = core::array::from_fn(|index| {
            &lookahead.setpoint((sequence + index as u64).saturating_sub(3)).tool
        });
        for (index, tool) in planned.tool.iter_mut().enumerate() {
            let tool_at = around.map(|tool| tool[index]);
            let [from_slope, to_slope] = [slope(&tool_at[..7]), slope(&tool_at[1..])];
            (*tool, _) = hermite(tool_at[3], from_slope, tool_at[4], to_slope, fraction);
        }
        planned
    }

    /// References and voltage for the actuator with this index.
    pub fn reference(&self, index: usize, actuator: &Actuator) -> Reference {
        Reference {
            position: self.now.angle[index],
            velocity: (self.now.angle[index] - self.before.angle[index]) / self.cycle_time,
            current: self.windings[index].as_ref().map_or(0.0, Winding::now),
            voltage: self.voltage(index, actuator),
        }
    }

    /// The voltage over the cycle in which the command acts; 0 for a stepper, whose driver has its
    /// own current loop.
    fn voltage(&self, index: usize, actuator: &Actuator) -> f64 {
        let Some(motor) = actuator.motor.dc() else { return 0.0 };
        let friction = actuator.friction.coulomb / motor.torque_constant;
        let current = |planned: &Planned| planned.torque[index] / motor.torque_constant;
        let (first, last) = (current(&self.next), current(&self.after));
        let [from, mean, to] = self.directions(index);
        let mean_current = (first + last) / 2.0 + friction * mean;
        let current_change = last - first + friction * (to - from);
        let angle_change = self.after.angle[index] - self.next.angle[index];
        motor.voltage(
            mean_current,
            current_change / self.cycle_time,
            angle_change / self.cycle_time,
        )
    }

    /// Targets for the actuator with this index.
    pub fn target(&self, index: usize, actuator: &Actuator) -> Target {
        let [_, mean, _] = self.directions(index);
        let torque = (self.next.torque[index] + self.after.torque[index]) / 2.0;
        Target {
            position: self.after.angle[index],
            velocity: match actuator.mode {
                ActuatorMode::Position => self.after.speed[index],
                _ => (self.after.angle[index] - self.next.angle[index]) / self.cycle_time,
            },
            effort: torque + actuator.friction.coulomb * mean,
        }
    }

    /// The fastest that the plan has this motor turn between the measurement and the end of the
    /// command [rad/s].
    pub fn fastest(&self, index: usize) -> f64 {
        let instants = [&self.now, &self.next, &self.after];
        instants.iter().map(|planned| planned.speed[index].abs()).fold(0.0, f64::max)
    }

    /// Direction of the planned motion at the start of the cycle in which the command acts, its
    /// mean over the cycle, and at the end; −1..=1.
    fn directions(&self, index: usize) -> [f64; 3] {
        let moving = |speed: f64| if speed.abs() < STANDING { 0.0 } else { speed };
        let (from, to) = (moving(self.next.speed[index]), moving(self.after.speed[index]));
        let size = from.abs() + to.abs();
        // Speed taken as linear in the cycle: each direction lasts in proportion to its speed.
        let mean = if size > 0.0 { (from + to) / size } else { 0.0 };
        [direction(from), mean, direction(to)]
    }
}

/// The stream's demands on one actuator at one instant, at the planned rate: the motion of its joint, and what is
/// its own.
struct Demand {
    position: f64,
    velocity: f64,
    lead: f64,
    lead_speed: f64,
    static_lead: f64,
    static_speed: f64,
    lead_momentum: f64,
    effort: f64,
    standing: f64,
    momentum: f64,
}

impl Planned {
    /// This, `time` later at an even speed.
    fn coasted(&self, time: Nanoseconds) -> Self {
        let time = time.seconds();
        Self {
            angle: core::array::from_fn(|index| self.angle[index] + self.speed[index] * time),
            ..*self
        }
    }

    /// Joint to motor, at `rate` and its `change`.
    fn put(&mut self, index: usize, actuator: &Actuator, demand: &Demand, rate: f64, change: f64) {
        let square = rate * rate;
        let lead = demand.static_lead
            + (demand.lead - demand.static_lead) * square
            + demand.lead_momentum * change;
        let lead_speed = demand.static_speed + (demand.lead_speed - demand.static_speed) * square;
        let speed = (demand.velocity + lead_speed) * rate / actuator.ratio;
        self.angle[index] = (demand.position + lead) / actuator.ratio;
        self.speed[index] = speed;
        self.torque[index] = demand.standing
            + (demand.effort - demand.standing) * square
            + demand.momentum * change
            + actuator.friction.viscous * speed;
    }
}

fn direction(speed: f64) -> f64 {
    if speed.abs() < STANDING { 0.0 } else { speed.signum() }
}

/// Slope at the middle one of seven values: exact to the sixth order, so that the cubics between them are
/// the motion itself but for the cycles about a jump of its jerk.
fn slope(values: &[f64]) -> f64 {
    let rise = |distance: usize| values[3 + distance] - values[3 - distance];
    (45.0 * rise(1) - 9.0 * rise(2) + rise(3)) / 60.0
}

/// Value and slope at `at` in 0..1 of the cubic with these values and slopes at 0 and 1.
fn hermite(from: f64, from_slope: f64, to: f64, to_slope: f64, at: f64) -> (f64, f64) {
    let rise = to - from;
    let square = 3.0 * rise - 2.0 * from_slope - to_slope;
    let cube = from_slope + to_slope - 2.0 * rise;
    (
        from + at * (from_slope + at * (square + at * cube)),
        from_slope + at * (2.0 * square + at * 3.0 * cube),
    )
}
