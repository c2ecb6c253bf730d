//! Where a job departs from: where the axes stand.

use crate::job::Job;
use machine::kinematics::{Joints, KinematicsError};
use machine::transmission::equilibrium;
use machine::{Actuator, Machine, Mechanism, MechanismVisitor, Pose};
use messages::AxisArray;
use messages::axis::axis_array;
use nalgebra::Vector3;

/// Encoder counts that an axis may stand away from where the drawing begins without a move of its
/// own there: rounding when the motors were powered, well below what the controller fades out.
const COUNTS: f64 = 4.0;

/// Lets the job begin where the axes stand: it goes from there straight to where it begins to mark.
pub(super) fn approach(
    job: &mut Job,
    machine: &Machine,
    standing: &AxisArray,
) -> Result<(), KinematicsError> {
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
        let Machine { axes, actuators, home_joints, .. } = machine;
        if mechanism.is_linear() {
            let departure = Departure { standing: motors, machine, wanted };
            return departure.joints(&mechanism);
        }
        let sag = |joints: &Joints<N>| -> Result<Joints<N>, KinematicsError> {
            let assembly = mechanism.solve(joints, mechanism.branch(), None)?;
            let gravity = mechanism.gravity(&assembly);
            let fields = Joints::from_fn(|index, _| {
                let of = |actuator: &Actuator| {
                    let field = equilibrium::field_ahead(actuator, gravity[index]);
                    actuator.share * field.unwrap_or(0.0)
                };
                axes[index].driven_by(actuators).iter().map(of).sum::<f64>()
            });
            Ok(equilibrium::rotors_ahead(&mechanism, axes, actuators, &gravity) + fields)
        };
        let motors = Joints::<N>::from_fn(|axis, _| motors[axis]);
        let home = Joints::<N>::from_fn(|axis, _| home_joints[axis]);
        let near =
            |off: Joints<N>| (0..N).all(|axis| off[axis].abs() <= COUNTS * count(machine, axis));
        // Steppers that were powered at home stand there: their rotors sag, their fields do not.
        let is_home = near(motors - home) || near(motors - home - sag(&home)?);
        let joints = if is_home { home } else { motors - sag(&motors)? };
        Ok(axis_array(joints.as_slice()))
    }
}

/// Joint travel of the coarsest count of an axis [m or rad].
fn count(machine: &Machine, axis: usize) -> f64 {
    let own = machine.axes[axis].driven_by(&machine.actuators);
    own.iter().map(Actuator::count).fold(0.0, f64::max)
}

/// Where a job departs from on a machine whose joints go straight with the tool: where the drawing
/// begins, if the encoders cannot tell that from where the axes stand.
struct Departure<'a> {
    standing: &'a AxisArray,
    machine: &'a Machine,
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
        let Self { standing, machine, wanted } = *self;
        let area = &machine.area;
        let branch = mechanism.branch();
        let joints = Joints::<N>::from_fn(|axis, _| standing[axis]);
        let is_here = |point: &Vector3<f64>| {
            let there = mechanism.inverse(&Pose::at(*point), branch, &joints);
            there.is_ok_and(|there| {
                (0..N)
                    .all(|axis| (there[axis] - joints[axis]).abs() <= COUNTS * count(machine, axis))
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
