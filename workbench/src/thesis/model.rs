//! The letters of the series as Graver plans them on the source's machines.

use machine::kinematics::{Joints, KinematicsError};
use machine::{DocumentError, Machine, Mechanism, MechanismVisitor};
use messages::time::SETPOINT_TIME;
use planner::Plan;
use planner::law::profile::Ramp;

use super::data::{ACCELERATION, JERK};
use super::machines::{Manner, SeriesLetter, ThesisMachine, series};
use crate::operating::{AxisCourse, Demand, OperatingPoint, courses};
use crate::spread::spread;

/// What one motor does for one letter.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotorMarks {
    /// Largest speed over the marks with their run-ins and run-outs [rad/s].
    pub speed: f64,
    /// Largest torque of the load alone over the same [N·m].
    pub load: f64,
    /// What is asked of it over the whole job, free moves included.
    pub demand: Demand,
}

/// A letter as it is planned.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// From the first motion to the last [s].
    pub time: f64,
    /// Largest speed while the laser is on [m/s].
    pub speed: f64,
    /// In the order of the axes.
    pub motors: Vec<MotorMarks>,
}

/// Why there is no model.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// A machine file that is not sound.
    #[error(transparent)]
    Machine(#[from] Box<DocumentError>),
    /// A letter that cannot be marked.
    #[error("{machine}, {letter}: {reason}")]
    Refused {
        /// The machine.
        machine: &'static str,
        /// The letter.
        letter: String,
        /// Why not.
        reason: String,
    },
}

/// The series on one machine in one manner, in the order of [`series`].
#[derive(Debug, Clone, PartialEq)]
pub struct Modelled {
    /// The machine.
    pub machine: ThesisMachine,
    /// The manner.
    pub manner: Manner,
    /// The letters.
    pub letters: Vec<Planned>,
}

impl Modelled {
    /// The largest of `value` over the letters.
    pub fn largest(&self, motor: usize, value: impl Fn(&MotorMarks) -> f64) -> f64 {
        let of = self.letters.iter().filter_map(|letter| letter.motors.get(motor));
        of.map(value).fold(0.0, f64::max)
    }
}

/// Plans the series on each of `wanted`.
///
/// # Errors
/// The first letter that is refused.
pub fn model(wanted: &[(ThesisMachine, Manner)]) -> Result<Vec<Modelled>, ModelError> {
    let series = series();
    let items: Vec<(ThesisMachine, Manner, SeriesLetter)> = wanted
        .iter()
        .flat_map(|&(machine, manner)| series.iter().map(move |letter| (machine, manner, *letter)))
        .collect();
    let planned = spread(&items, |(machine, manner, letter)| plan(*machine, *manner, letter));
    let mut planned = planned.into_iter();
    wanted
        .iter()
        .map(|&(machine, manner)| {
            let letters = planned.by_ref().take(series.len()).collect::<Result<_, _>>()?;
            Ok(Modelled { machine, manner, letters })
        })
        .collect()
}

fn plan(
    which: ThesisMachine,
    manner: Manner,
    letter: &SeriesLetter,
) -> Result<Planned, ModelError> {
    let machine = which.machine().map_err(Box::new)?;
    let refused = |reason: String| ModelError::Refused {
        machine: which.name(),
        letter: letter.name(),
        reason,
    };
    let request = letter.request(manner);
    let plan = request.plan(&machine).map_err(|refusal| refused(refusal.message))?;
    let run_in = Ramp::to_speed(plan.facts.speed, ACCELERATION, JERK).duration();
    let courses = courses(&machine, &plan);
    let loads = machine
        .mechanism
        .visit(Loads { machine: &machine, plan: &plan })
        .map_err(|error| refused(error.to_string()))?;
    Ok(Planned {
        time: plan.facts.duration,
        speed: plan.facts.speed,
        motors: (courses.iter().zip(&loads)).map(|it| motor(it.0, it.1, run_in)).collect(),
    })
}

/// Torques that the load alone takes at each motor, setpoint by setpoint [N·m]: by the mechanism's own
/// dynamics, so that nothing of what rotors do behind their springs is in them.
struct Loads<'a> {
    machine: &'a Machine,
    plan: &'a Plan,
}

impl MechanismVisitor for Loads<'_> {
    type Output = Result<Vec<Vec<f64>>, KinematicsError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let mut loads = vec![Vec::new(); self.machine.actuators.len()];
        let (branch, mut near) = (mechanism.branch(), None);
        for setpoint in self.plan.setpoints(1) {
            let [position, velocity, acceleration] =
                [&setpoint.position, &setpoint.velocity, &setpoint.acceleration]
                    .map(|values| Joints::<N>::from_fn(|axis, _| values[axis]));
            let chain = mechanism.solve(&position, branch, near.as_ref())?;
            let efforts = mechanism.inverse_dynamics(&chain, &velocity, &acceleration);
            for (load, actuator) in loads.iter_mut().zip(&self.machine.actuators) {
                load.push(efforts[actuator.axis] * actuator.share * actuator.ratio);
            }
            near = Some(chain);
        }
        Ok(loads)
    }
}

/// `loads` are the load's torques [N·m], `run_in` is how long a run-in takes [s].
fn motor(course: &AxisCourse, loads: &[f64], run_in: f64) -> MotorMarks {
    let around = (run_in / SETPOINT_TIME).ceil() as usize;
    let mut marks = MotorMarks { demand: Demand::of(course), ..MotorMarks::default() };
    let is_lit = |point: Option<&OperatingPoint>| point.is_some_and(|point| point.is_lit);
    let (mut since, mut until) = (None, vec![usize::MAX; course.points.len()]);
    // Cycles to the next lit one, found from the end.
    let mut next = usize::MAX;
    for (index, distance) in until.iter_mut().enumerate().rev() {
        next = if is_lit(course.points.get(index)) { 0 } else { next.saturating_add(1) };
        *distance = next;
    }
    for ((point, load), until) in course.points.iter().zip(loads).zip(until) {
        since = if point.is_lit { Some(0) } else { since.map(|cycles: usize| cycles + 1) };
        if until <= around || since.is_some_and(|since| since <= around) {
            marks.speed = marks.speed.max(point.speed.abs());
            marks.load = marks.load.max(load.abs());
        }
    }
    marks
}
