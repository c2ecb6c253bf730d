//! `graver plan --pulses`: every step pulse of a plan, with the instant at which it is due.

use drives::pulses::{Direction, Segment};
use machine::{Axis, Machine};
use messages::Setpoint;
use messages::time::CYCLE_TIME;
use planner::Plan;
use std::fs::File;
use std::io::{self, BufWriter, Write};

/// One stepper, counted from where it stands at the start of the plan.
struct Train {
    /// Its axis among all of them.
    index: usize,
    name: String,
    /// Joint units per radian.
    ratio: f64,
    per_radian: f64,
    /// Commanded angle at the start [rad].
    origin: f64,
    segment: Segment,
    count: i64,
}

/// A pulse that is due `offset` nanoseconds into the cycle, and the count from then on.
struct Due<'a> {
    offset: i64,
    name: &'a str,
    count: i64,
}

/// Whether any axis of `machine` has a stepper.
pub fn has_steppers(machine: &Machine) -> bool {
    machine.axes.iter().any(|axis| axis.motor.stepper().is_some())
}

/// One row a pulse in order of time: `t` [s], the axis, and the count from then on, 0 at the start.
///
/// The course between two setpoints is the cubic that the drives follow at the planned rate.
///
/// # Errors
/// Whatever the file system reports.
pub fn write(file: File, machine: &Machine, plan: &Plan) -> io::Result<()> {
    let mut file = BufWriter::new(file);
    writeln!(file, "t,axis,count")?;
    let mut setpoints = plan.setpoints(1);
    let Some(first) = setpoints.next() else { return file.flush() };
    let axes = machine.axes.iter().enumerate();
    let mut trains: Vec<Train> =
        axes.filter_map(|(index, axis)| Train::new(index, axis, &first)).collect();
    // The rate of the lead is the difference across both neighbours, as in the controller.
    let mut before = first;
    let mut next = setpoints.next();
    while let Some(now) = next {
        next = setpoints.next();
        let after = next.as_ref().unwrap_or(&now);
        let start = now.sequence.saturating_sub(1) as f64 * CYCLE_TIME;
        let mut due: Vec<Due<'_>> = Vec::new();
        for train in &mut trains {
            train.follow(&before, &now, after, &mut due);
        }
        due.sort_by_key(|pulse| pulse.offset);
        for Due { offset, name, count } in due {
            writeln!(file, "{:.9},{name},{count}", start + offset as f64 * 1e-9)?;
        }
        before = now;
    }
    file.flush()
}

impl Train {
    fn new(index: usize, axis: &Axis, start: &Setpoint) -> Option<Self> {
        let motor = axis.motor.stepper()?;
        Some(Self {
            index,
            name: axis.name.clone(),
            ratio: axis.ratio,
            per_radian: motor.pulses_per_radian(),
            origin: (start.position[index] + start.lead[index]) / axis.ratio,
            segment: Segment::rest(0.0),
            count: 0,
        })
    }

    /// Goes on to `now`, and adds the pulses of the cycle that ends there.
    fn follow<'a>(
        &'a mut self,
        before: &Setpoint,
        now: &Setpoint,
        after: &Setpoint,
        due: &mut Vec<Due<'a>>,
    ) {
        let Self { index, name, ratio, per_radian, origin, segment, count } = self;
        let lead_speed = (after.lead[*index] - before.lead[*index]) / (2.0 * CYCLE_TIME);
        let angle = (now.position[*index] + now.lead[*index]) / *ratio - *origin;
        *segment = segment.then(angle, (now.velocity[*index] + lead_speed) / *ratio);
        segment.pulses(*per_radian, |pulse| {
            *count += match pulse.direction {
                Direction::Up => 1,
                Direction::Down => -1,
            };
            due.push(Due { offset: pulse.offset.0, name, count: *count });
        });
    }
}
