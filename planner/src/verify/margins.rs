//! How near a plan comes to the singularities and collisions of its mechanism.

use machine::kinematics::Joints;
use machine::{Machine, Mechanism, MechanismVisitor};
use messages::time::SETPOINT_TIME;

use crate::error::{Place, PlanError};
use crate::job::Job;
use crate::limits::motion_limits::Scope;
use crate::plan::PlanFacts;
use crate::planning::Window;
use crate::planning::outlet::Outlet;
use crate::planning::run::plan_windows;
use crate::sampling::sampler::Sampler;
use crate::trajectory::{Motion, Trajectory};

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

/// Plans `job` for `machine` and checks it as [`plan`](crate::plan()), window by window and without keeping them,
/// and finds every margin of the mechanism where it is least, looked at each few milliseconds.
///
/// # Errors
/// As [`plan`](crate::plan()), and a place that the tool cannot reach.
pub fn plan_with_margins(
    machine: &Machine,
    job: &Job,
) -> Result<(PlanFacts, Vec<LeastMargin>), PlanError> {
    machine.mechanism.visit(Survey { machine, job })
}

struct Survey<'a> {
    machine: &'a Machine,
    job: &'a Job,
}

impl MechanismVisitor for Survey<'_> {
    type Output = Result<(PlanFacts, Vec<LeastMargin>), PlanError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self { machine, job } = self;
        let mut walk = Walk { mechanism, machine, sampler: None, least: Vec::new(), failed: None };
        let facts = plan_windows(machine, job, Scope::Machine, 1, &mut walk);
        if let Some(error) = walk.failed {
            return Err(error);
        }
        let facts = facts?;
        walk.go_on(&Trajectory::default(), true)?;
        Ok((facts, walk.least))
    }
}

/// Goes along a plan behind its planning.
struct Walk<'a, const N: usize, M: Mechanism<N>> {
    mechanism: M,
    machine: &'a Machine,
    /// `None` before the first window.
    sampler: Option<Sampler<N, M>>,
    least: Vec<LeastMargin>,
    failed: Option<PlanError>,
}

impl<const N: usize, M: Mechanism<N>> Outlet for Walk<'_, N, M> {
    fn is_abandoned(&self) -> bool {
        self.failed.is_some()
    }

    fn take(&mut self, window: Box<Window>) -> Result<(), Box<Window>> {
        if self.failed.is_none() {
            self.failed = self.go_on(&window.trajectory, false).err();
        }
        Ok(())
    }
}

impl<const N: usize, M: Mechanism<N>> Walk<'_, N, M> {
    /// Goes along `more`, as far as that is known to the end of a sample; `is_last` says that nothing comes after it.
    fn go_on(&mut self, more: &Trajectory, is_last: bool) -> Result<(), PlanError> {
        if self.sampler.is_none() {
            let Some(Motion::Rest(rest)) = more.pieces.first().map(|piece| &piece.motion) else {
                return Ok(());
            };
            let (axes, actuators) = (&self.machine.axes, &self.machine.actuators);
            let (mechanism, attitude) = (self.mechanism.clone(), more.attitude);
            // Every sample of this plan has been made and checked.
            self.sampler = Sampler::new(mechanism, axes, actuators, rest.clone(), attitude, 1).ok();
        }
        let Some(sampler) = &mut self.sampler else { return Ok(()) };
        sampler.extend(more, is_last);
        while let Some(setpoint) = sampler.next() {
            if !setpoint.sequence.is_multiple_of(EVERY) {
                continue;
            }
            let joints = Joints::<N>::from_fn(|axis, _| setpoint.position[axis]);
            let time = setpoint.sequence as f64 * SETPOINT_TIME;
            let assembly = sampler.solve(&joints).map_err(|cause| {
                let (line, place) = place(sampler, time);
                PlanError::Unreachable { line, place, cause }
            })?;
            for margin in self.mechanism.margins(&assembly) {
                keep(&mut self.least, margin.name, margin.value, || LeastMargin {
                    name: margin.name.to_owned(),
                    value: margin.value,
                    limit: margin.limit,
                    time,
                    stroke: place(sampler, time).1.stroke,
                    position: self.mechanism.pose(&assembly).position.into(),
                });
            }
        }
        match sampler.broken() {
            Some(found) => {
                let (line, place) = place(sampler, found.time);
                Err(PlanError::Unreachable { line, place, cause: found.cause })
            }
            None => Ok(()),
        }
    }
}

/// Line and place in the job at `time` [s].
fn place<const N: usize, M: Mechanism<N>>(sampler: &Sampler<N, M>, time: f64) -> (u64, Place) {
    let piece = sampler.piece_at(time);
    let stroke = piece.map_or(0, |piece| piece.stroke);
    (piece.map_or(0, |piece| piece.line), Place { stroke, time })
}

/// Puts the margin of this name in, or in place of a larger one.
fn keep(least: &mut Vec<LeastMargin>, name: &str, value: f64, make: impl FnOnce() -> LeastMargin) {
    match least.iter_mut().find(|kept| kept.name == name) {
        None => least.push(make()),
        Some(kept) if value < kept.value => *kept = make(),
        Some(_) => {}
    }
}
