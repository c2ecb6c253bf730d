//! What the stream asks of the motors at one instant.

use crate::lookahead::Lookahead;
use crate::player::Instant;
use machine::Actuator;
use messages::math::hermite;
use messages::time::SETPOINT_TIME;
use messages::{ActuatorArray, MAX_ACTUATORS, Nanoseconds};

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

impl Planned {
    /// What the stream asks of the motors at `instant`: the setpoint itself where there is one,
    /// else between two by cubic Hermite interpolation of position and lead, linear for torques.
    pub fn at(actuators: &[Actuator], lookahead: &Lookahead, instant: Instant) -> Self {
        let sequence = instant.time.sequence();
        let fraction = instant.time.fraction();
        let from = lookahead.setpoint(sequence);
        let to = lookahead.setpoint(sequence + 1);
        let earlier = lookahead.setpoint(sequence.saturating_sub(1));
        let (rate, change) = (instant.rate, instant.rate_change);
        let mut planned = Self { tool: from.tool, ..Self::default() };
        if fraction == 0.0 {
            for (index, actuator) in actuators.iter().enumerate().take(MAX_ACTUATORS) {
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
        for (index, actuator) in actuators.iter().enumerate().take(MAX_ACTUATORS) {
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

    /// This, and what is planned a cycle of `cycle_time` [s] `later`, at a `share` of that cycle: by cubic
    /// Hermite interpolation of angles, and evenly for torques.
    pub fn between(&self, later: &Self, share: f64, cycle_time: f64, index: usize) -> Point {
        let (angle, speed) = hermite(
            self.angle[index],
            self.speed[index] * cycle_time,
            later.angle[index],
            later.speed[index] * cycle_time,
            share,
        );
        let (from, to) = (self.torque[index], later.torque[index]);
        Point { angle, speed: speed / cycle_time, torque: from + (to - from) * share }
    }

    /// Has `point` planned for the motor with this index.
    pub(crate) fn set(&mut self, index: usize, point: Point) {
        let Point { angle, speed, torque } = point;
        (self.angle[index], self.speed[index], self.torque[index]) = (angle, speed, torque);
    }

    /// What is planned for the motor with this index.
    pub fn point(&self, index: usize) -> Point {
        Point { angle: self.angle[index], speed: self.speed[index], torque: self.torque[index] }
    }

    /// This, `time` later at an even speed.
    pub fn coasted(&self, time: Nanoseconds) -> Self {
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

/// What is planned for one motor at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Point {
    /// Angle [rad].
    pub angle: f64,
    /// Speed [rad/s].
    pub speed: f64,
    /// Torque without Coulomb friction [N·m].
    pub torque: f64,
}

impl Point {
    /// This, off by `angle` [rad] and `speed` [rad/s].
    pub(crate) fn off(self, angle: f64, speed: f64) -> Self {
        Self { angle: self.angle + angle, speed: self.speed + speed, ..self }
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

/// Slope at the middle one of seven values: exact to the sixth order, so that the cubics between them are
/// the motion itself but for the cycles about a jump of its jerk.
fn slope(values: &[f64]) -> f64 {
    let rise = |distance: usize| values[3 + distance] - values[3 - distance];
    (45.0 * rise(1) - 9.0 * rise(2) + rise(3)) / 60.0
}
