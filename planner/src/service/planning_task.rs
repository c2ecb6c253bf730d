//! The slow part of the service, away from its loop: files, reading, planning.

use crate::Plan;
use crate::job::Job;
use crate::plan::plan_unless;
use crate::request::{JobRequest, Refusal};
use machine::kinematics::{Joints, KinematicsError};
use machine::transmission::equilibrium;
use machine::{Axis, Machine, Mechanism, MechanismVisitor, Pose, WorkArea};
use messages::axis::axis_array;
use messages::finite::first_not_finite;
use messages::{AxisArray, run_folder};
use nalgebra::Vector3;
use runtime::{ServiceError, message};
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

/// Lets the job begin where the axes stand: it goes from there straight to where it begins to mark.
fn approach(job: &mut Job, machine: &Machine, standing: &AxisArray) -> Result<(), KinematicsError> {
    let wanted = job.drawing.start;
    let standing = machine.mechanism.visit(Standing { motors: standing, machine, wanted })?;
    job.standing = Some(standing);
    Ok(())
}

/// Where the joints stand behind motors at rest: short of them by what gravity makes of springs,
/// gaps and steppers' fields. Home itself where that is within what rounding
/// makes of it, so that a job plans alike from every start there.
struct Standing<'a> {
    motors: &'a AxisArray,
    machine: &'a Machine,
    /// Where the drawing begins [m].
    wanted: Vector3<f64>,
}

impl MechanismVisitor for Standing<'_> {
    type Output = Result<AxisArray, KinematicsError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self { motors, machine, wanted } = self;
        let Machine { axes, home_joints, .. } = machine;
        if mechanism.is_linear() {
            let departure = Departure { standing: motors, axes, area: &machine.area, wanted };
            return departure.joints(&mechanism);
        }
        let sag = |joints: &Joints<N>| -> Result<Joints<N>, KinematicsError> {
            let assembly = mechanism.solve(joints, mechanism.branch(), None)?;
            let gravity = mechanism.gravity(&assembly);
            let fields = Joints::from_fn(|index, _| {
                equilibrium::field_ahead(&axes[index], gravity[index]).unwrap_or(0.0)
            });
            Ok(equilibrium::rotors_ahead(&mechanism, axes, &gravity) + fields)
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

/// Where a job departs from on a machine whose joints go straight with the tool: where the drawing
/// begins, if the encoders cannot tell that from where the axes stand.
struct Departure<'a> {
    standing: &'a AxisArray,
    axes: &'a [Axis],
    area: &'a WorkArea,
    wanted: Vector3<f64>,
}

impl Departure<'_> {
    fn joints<const N: usize, M: Mechanism<N>>(
        self,
        mechanism: &M,
    ) -> Result<AxisArray, KinematicsError> {
        let point = self.point(mechanism)?;
        let near = Joints::<N>::from_fn(|axis, _| self.standing[axis]);
        let joints = mechanism.inverse(&Pose::at(point), mechanism.branch(), &near)?;
        Ok(axis_array(joints.as_slice()))
    }

    fn point<const N: usize, M: Mechanism<N>>(
        &self,
        mechanism: &M,
    ) -> Result<Vector3<f64>, KinematicsError> {
        let Self { standing, axes, area, wanted } = *self;
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
            return Ok(wanted);
        }
        // An encoder's rounding at the edge of the area does not put the tool outside.
        let tool = mechanism.forward(&joints, branch)?.position;
        let inside = Vector3::from_fn(|row, _| tool[row].clamp(area.lower[row], area.upper[row]));
        Ok(if is_here(&inside) { inside } else { tool })
    }
}
