//! What the motors give at the tool: acceleration and force by direction, and the mass that they feel.

use nalgebra::{Cholesky, DVector, Vector3};

use super::principal::{direction, principal_axes};
use super::{Place, Principal};

/// What the tool can do in one direction, and the axis that allows no more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capability {
    /// [m/s² or N]; 0 where the tool cannot move that way, or the motors cannot hold its weight.
    pub value: f64,
    /// The axis that sets the limit, from 0; `None` where no axis does.
    pub axis: Option<usize>,
}

/// How far from the direction that was asked for joint rates may lead the tool, of 1.
const OFF_COURSE: f64 = 1e-6;

impl Place {
    /// The torques that the motors give at standstill, one an axis [N·m]. Friction is left out.
    pub fn standstill_torques(&self) -> Vec<f64> {
        self.motors.iter().map(|motor| motor.torque).collect()
    }

    /// Principal masses that a push at the tool feels, rotors included [kg], the largest first; `None`
    /// where the tool cannot be moved in one direction.
    pub fn effective_mass(&self) -> Option<Vec<Principal>> {
        let mobility = Cholesky::new(self.inertia_with_rotors())?.inverse();
        let mut axes = principal_axes(&self.linear * mobility * self.linear.transpose())?;
        axes.reverse();
        for axis in &mut axes {
            axis.value = 1.0 / axis.value;
        }
        axes.iter().all(|axis| axis.value > 0.0 && axis.value.is_finite()).then_some(axes)
    }

    /// The largest acceleration of the tool [m/s²] from rest along `along`, of length 1, its attitude
    /// kept, with motors of `torques` [N·m] that turn their rotors or, with `rotors` false, need not.
    pub fn acceleration(&self, along: &Vector3<f64>, torques: &[f64], rotors: bool) -> Capability {
        let Some(joints) = self.rates(along) else { return Capability { value: 0.0, axis: None } };
        let inertia = if rotors { self.inertia_with_rotors() } else { self.mass.clone() };
        self.within(torques, &(inertia * joints))
    }

    /// The largest force that the tool exerts at rest along `along`, of length 1 [N], with motors of
    /// `torques` [N·m].
    pub fn force(&self, along: &Vector3<f64>, torques: &[f64]) -> Capability {
        let rows = self.linear.nrows();
        let along = DVector::from_fn(rows, |row, _| along[row]);
        self.within(torques, &(self.linear.transpose() * along))
    }

    /// Joint rates for the tool's unit velocity along `along` without turning; `None` where there are none.
    fn rates(&self, along: &Vector3<f64>) -> Option<DVector<f64>> {
        let linear = self.linear.nrows();
        let wanted =
            DVector::from_fn(
                self.task.nrows(),
                |row, _| {
                    if row < linear { along[row] } else { 0.0 }
                },
            );
        let inverse = self.task.clone().pseudo_inverse(1e-12 * self.task.amax()).ok()?;
        let rates = inverse * &wanted;
        let off = direction((&self.linear * &rates).iter()) - direction(wanted.iter());
        (off.norm() <= OFF_COURSE).then_some(rates)
    }

    /// How many times `efforts` [N or N·m] the motors give over what they hold at rest.
    fn within(&self, torques: &[f64], efforts: &DVector<f64>) -> Capability {
        let mut found = Capability { value: f64::INFINITY, axis: None };
        for (axis, ((motor, torque), effort)) in
            self.motors.iter().zip(torques).zip(efforts.iter()).enumerate()
        {
            let given = torque / motor.ratio;
            let room = given - self.gravity[axis] * effort.signum();
            let times = (room / effort.abs()).max(0.0);
            // An axis that has nothing to do sets no limit, unless it cannot even hold its weight.
            let times = if *effort == 0.0 { f64::INFINITY } else { times };
            let times = if self.gravity[axis].abs() > given { 0.0 } else { times };
            if times < found.value {
                found = Capability { value: times, axis: Some(axis) };
            }
        }
        if found.axis.is_none() { Capability { value: 0.0, axis: None } } else { found }
    }
}
