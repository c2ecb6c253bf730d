//! The pulses of one stepper, cycle by cycle.

use drives::pulses::{Direction, Segment};
use machine::Actuator;
use messages::Setpoint;
use messages::time::SETPOINT_TIME;

/// One stepper, counted from where it stands at the start of the plan.
#[derive(Debug)]
pub(super) struct Train {
    /// Its actuator among all of them.
    pub(super) actuator: usize,
    /// Its axis among all of them, and its share of that.
    pub(super) axis: usize,
    pub(super) share: f64,
    pub(super) name: String,
    /// Joint units per radian.
    pub(super) ratio: f64,
    pub(super) per_radian: f64,
    /// Commanded angle at the start [rad].
    origin: f64,
    /// The commanded angle from there in this cycle.
    pub(super) segment: Segment,
    /// The count at the end of this cycle.
    count: i64,
    /// The largest rate of pulses so far [1/s].
    pub(super) largest_rate: f64,
}

/// A pulse that is due `offset` nanoseconds into the cycle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Due {
    pub(super) offset: i64,
    /// Whose it is, among the trains.
    pub(super) train: usize,
    /// The count from then on.
    pub(super) count: i64,
}

impl Train {
    pub(super) fn new(index: usize, actuator: &Actuator, start: &Setpoint) -> Option<Self> {
        let motor = actuator.motor.stepper()?;
        let Actuator { axis, ratio, share, .. } = *actuator;
        Some(Self {
            actuator: index,
            axis,
            share,
            name: actuator.name.clone(),
            ratio,
            per_radian: motor.pulses_per_radian(),
            origin: (start.position[axis] + start.lead[index]) / ratio,
            segment: Segment::rest(0.0, SETPOINT_TIME),
            count: 0,
            largest_rate: 0.0,
        })
    }

    /// Goes on to `now`, and adds the pulses of the cycle that ends there as those of `train`.
    pub(super) fn follow(
        &mut self,
        train: usize,
        before: &Setpoint,
        now: &Setpoint,
        after: &Setpoint,
        due: &mut Vec<Due>,
    ) {
        let (axis, index) = (self.axis, self.actuator);
        let lead_speed = (after.lead[index] - before.lead[index]) / (2.0 * SETPOINT_TIME);
        let angle = (now.position[axis] + now.lead[index]) / self.ratio - self.origin;
        self.segment = self.segment.then(angle, (now.velocity[axis] + lead_speed) / self.ratio);
        self.largest_rate = self.largest_rate.max(self.segment.fastest() * self.per_radian);
        let count = &mut self.count;
        self.segment.pulses(self.per_radian, |pulse| {
            *count += match pulse.direction {
                Direction::Up => 1,
                Direction::Down => -1,
            };
            due.push(Due { offset: pulse.offset.0, train, count: *count });
        });
    }

    /// How far a `count` is beyond the commanded angle at a `share` of the cycle [joint units].
    pub(super) fn beyond(&self, count: i64, share: f64) -> f64 {
        (count as f64 / self.per_radian - self.segment.at(share).0) * self.ratio
    }
}
