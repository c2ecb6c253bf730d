//! The slow part of the service, away from its loop: files, reading, planning.

use crate::Plan;
use crate::job::Job;
use crate::joint_plan::IsLinear;
use crate::plan::plan_unless;
use crate::request::{JobRequest, Refusal};
use machine::kinematics::{Joints, KinematicsError};
use machine::transmission::rest;
use machine::{Axis, Machine, Mechanism, MechanismVisitor, Pose, WorkArea};
use nalgebra::Vector3;
use runtime::{ServiceError, message};
use signals::axis::axis_array;
use signals::finite::first_not_finite;
use signals::{AxisArray, run_folder};
use std::fmt::Display;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Encoder counts that an axis may stand away from where the drawing begins without a move of its
/// own there: rounding when the motors were powered, well below what the controller fades out.
const COUNTS: f64 = 4.0;

/// Says, once dropped, that nobody waits for a plan any more.
#[derive(Debug, Default)]
pub(super) struct Abandoned(Arc<AtomicBool>);

impl Abandoned {
    /// What becomes true when this is dropped.
    pub(super) fn watch(&self) -> Arc<AtomicBool> {
        self.0.clone()
    }
}

impl Drop for Abandoned {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Reads and plans the job of a run folder from where the joints stand, load side [m or rad], and
/// writes what others read of the plan. Gives up once `abandoned`.
pub(super) fn plan_request(
    folder: &Path,
    machine: &Machine,
    standing: &AxisArray,
    abandoned: &AtomicBool,
) -> Result<Plan, Refusal> {
    let file = folder.join(run_folder::REQUEST);
    let failed = |error: &dyn Display| Refusal::internal(format!("{}: {error}", file.display()));
    let text = std::fs::read(&file).map_err(|error| failed(&error))?;
    let request: JobRequest = serde_json::from_slice(&text).map_err(|error| failed(&error))?;
    let mut job = request.read(machine)?;
    approach(&mut job, machine, standing).map_err(Refusal::internal)?;
    let plan = plan_unless(machine, &job, &|| abandoned.load(Ordering::Relaxed))
        .map_err(|error| request.refuse(&error))?;
    write_plan(folder, &plan)?;
    Ok(plan)
}

/// Says in the run folder why the job was refused. Where that cannot be written, such as on a full
/// disk, it is said in `spare`, and where that cannot be written either, on standard error.
pub(super) fn write_refusal(folder: &Path, spare: &Path, refusal: &Refusal) {
    let text = serde_json::to_vec_pretty(refusal).unwrap_or_default();
    let places = [folder.join(run_folder::REFUSAL), spare.join(run_folder::REFUSAL)];
    if !places.iter().any(|place| std::fs::write(place, &text).is_ok()) {
        message::tell(refusal.text.trim());
    }
}

fn write_plan(folder: &Path, plan: &Plan) -> Result<(), Refusal> {
    // Whoever reads the plan would find null where a number is due.
    if let Some(place) = first_not_finite(&(&plan.artwork, &plan.facts)) {
        return Err(Refusal::internal(format!("the plan has no finite number at {place}")));
    }
    let write = |name: &str, content: serde_json::Result<Vec<u8>>| {
        let path = folder.join(name);
        let content = content.map_err(std::io::Error::other);
        content
            .and_then(|content| std::fs::write(&path, content))
            .map_err(|source| Refusal::internal(ServiceError::io(path, source)))
    };
    write(run_folder::ARTWORK, serde_json::to_vec(&plan.artwork))?;
    write(run_folder::PLAN, serde_json::to_vec_pretty(&plan.facts))
}

/// Lets the job begin where the axes stand, with a rapid to where it wants to begin. A machine that
/// is planned by its joints goes from there straight to where the job begins to mark.
fn approach(job: &mut Job, machine: &Machine, standing: &AxisArray) -> Result<(), KinematicsError> {
    if !machine.mechanism.visit(IsLinear) {
        job.standing = Some(machine.mechanism.visit(Standing { motors: standing, machine })?);
        return Ok(());
    }
    let wanted = job.drawing.start;
    let Machine { mechanism, axes, area, .. } = machine;
    if let Some(from) = mechanism.visit(Departure { standing, axes, area, wanted })? {
        job.approach_from(from);
    }
    Ok(())
}

/// Where the joints stand behind motors at rest: short of them by what gravity makes of springs,
/// gaps and steppers' fields. Home itself where that is within what rounding
/// makes of it, so that a job plans alike from every start there.
struct Standing<'a> {
    motors: &'a AxisArray,
    machine: &'a Machine,
}

impl MechanismVisitor for Standing<'_> {
    type Output = Result<AxisArray, KinematicsError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self { motors, machine: Machine { axes, home_joints, .. } } = self;
        let sag = |joints: &Joints<N>| -> Result<Joints<N>, KinematicsError> {
            let assembly = mechanism.assemble(joints, mechanism.branch(), None)?;
            let gravity = mechanism.gravity(&assembly);
            let fields = Joints::from_fn(|index, _| {
                rest::field_ahead(&axes[index], gravity[index]).unwrap_or(0.0)
            });
            Ok(rest::rotors_ahead(&mechanism, axes, &gravity) + fields)
        };
        let motors = Joints::<N>::from_fn(|axis, _| motors[axis]);
        let home = Joints::<N>::from_fn(|axis, _| home_joints[axis]);
        let near = |off: Joints<N>| {
            axes.iter().enumerate().take(N).all(|(index, axis)| {
                off[index].abs() <= COUNTS * axis.encoder.resolution() * axis.ratio.abs()
            })
        };
        // Steppers that were powered at home stand there: their rotors sag, their fields do not.
        let is_home = near(motors - home) || near(motors - home - sag(&home)?);
        let joints = if is_home { home } else { motors - sag(&motors)? };
        Ok(axis_array(joints.as_slice()))
    }
}

/// Where a job departs from; `None` where the drawing's own start is as good.
struct Departure<'a> {
    standing: &'a AxisArray,
    axes: &'a [Axis],
    area: &'a WorkArea,
    wanted: Vector3<f64>,
}

impl MechanismVisitor for Departure<'_> {
    type Output = Result<Option<Vector3<f64>>, KinematicsError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self { standing, axes, area, wanted } = self;
        let branch = mechanism.branch();
        let joints = Joints::<N>::from_fn(|axis, _| standing[axis]);
        let is_here = |point: &Vector3<f64>| {
            let there = mechanism.inverse(&Pose::at(*point), branch, &joints);
            there.is_ok_and(|there| {
                axes.iter().enumerate().take(N).all(|(index, axis)| {
                    let count = axis.encoder.resolution() * axis.ratio.abs();
                    (there[index] - joints[index]).abs() <= COUNTS * count
                })
            })
        };
        if is_here(&wanted) {
            return Ok(None);
        }
        // An encoder's rounding at the edge of the area does not put the tool outside.
        let tool = mechanism.forward(&joints, branch)?.position;
        let inside = Vector3::from_fn(|row, _| tool[row].clamp(area.lower[row], area.upper[row]));
        Ok(Some(if is_here(&inside) { inside } else { tool }))
    }
}
