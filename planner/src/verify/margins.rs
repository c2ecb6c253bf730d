//! How near a plan comes to the singularities and collisions of its mechanism.

use machine::kinematics::Joints;
use machine::{Mechanism, MechanismVisitor};
use messages::time::SETPOINT_TIME;

use crate::error::{Place, PlanError};
use crate::plan::{Plan, sampler};
use crate::trajectory::Trajectory;

/// Cycles between two looks; at a rapid's speed the tool goes about a millimetre meanwhile.
const EVERY: u64 = 5;

/// A margin where it is least in a plan.
#[derive(Debug, Clone, PartialEq, serde::Serialize, schemars::JsonSchema)]
pub struct LeastMargin {
    /// Its name, such as `type_2` or `center`.
    pub name: String,
    /// Its least value; 0 is the singularity or the collision.
    pub value: f64,
    /// What it should not fall below. Joints may pass where only the inverse kinematics asks for it.
    pub limit: f64,
    /// Stream time [s].
    pub time: f64,
    /// The stroke that is marked, approached or left, from 1; 0 for none.
    pub stroke: u64,
    /// Where the tool is, machine frame [m].
    pub position: [f64; 3],
}

impl Plan {
    /// Every margin of the mechanism where it is least, looked at each few milliseconds.
    ///
    /// # Errors
    /// A place that the tool cannot reach, as in a plan for ideal motors.
    pub fn least_margins(&self) -> Result<Vec<LeastMargin>, PlanError> {
        self.visit(Walk { plan: self })
    }
}

struct Walk<'a> {
    plan: &'a Plan,
}

/// Line and place in the job at `time` [s].
fn place(trajectory: &Trajectory, time: f64) -> (u64, Place) {
    let piece = trajectory.piece_at(time);
    let stroke = piece.map_or(0, |piece| piece.stroke);
    (piece.map_or(0, |piece| piece.line), Place { stroke, time })
}

impl MechanismVisitor for Walk<'_> {
    type Output = Result<Vec<LeastMargin>, PlanError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let trajectory = &self.plan.trajectory;
        let Some(mut sampler) = sampler(self.plan, mechanism.clone(), 1) else {
            return Ok(Vec::new());
        };
        let mut least = Vec::new();
        while let Some(setpoint) = sampler.next() {
            if !setpoint.sequence.is_multiple_of(EVERY) {
                continue;
            }
            let joints = Joints::<N>::from_fn(|axis, _| setpoint.position[axis]);
            let time = setpoint.sequence as f64 * SETPOINT_TIME;
            let assembly = sampler.solve(&joints).map_err(|cause| {
                let (line, place) = place(trajectory, time);
                PlanError::Unreachable { line, place, cause }
            })?;
            for margin in mechanism.margins(&assembly) {
                keep(&mut least, margin.name, margin.value, || LeastMargin {
                    name: margin.name.to_owned(),
                    value: margin.value,
                    limit: margin.limit,
                    time,
                    stroke: place(trajectory, time).1.stroke,
                    position: mechanism.pose(&assembly).position.into(),
                });
            }
        }
        match sampler.broken() {
            Some(found) => {
                let (line, place) = place(trajectory, found.time);
                Err(PlanError::Unreachable { line, place, cause: found.cause })
            }
            None => Ok(least),
        }
    }
}

/// Puts the margin of this name in, or in place of a larger one.
fn keep(least: &mut Vec<LeastMargin>, name: &str, value: f64, make: impl FnOnce() -> LeastMargin) {
    match least.iter_mut().find(|kept| kept.name == name) {
        None => least.push(make()),
        Some(kept) if value < kept.value => *kept = make(),
        Some(_) => {}
    }
}
