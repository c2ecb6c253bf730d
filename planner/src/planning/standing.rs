//! Where the joints stand before a job.

use machine::kinematics::Joints;
use machine::{Machine, Mechanism, MechanismVisitor, Pose};
use messages::AxisArray;
use messages::axis::axis_array;
use nalgebra::Vector3;

/// Where the joints stand when nobody says: at home, or where the drawing begins on a machine whose
/// joints follow from that.
pub(super) struct Start<'a> {
    pub(super) machine: &'a Machine,
    pub(super) start: Vector3<f64>,
}

impl MechanismVisitor for Start<'_> {
    type Output = AxisArray;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> AxisArray {
        let home = axis_array(self.machine.home_joints.as_slice());
        if !mechanism.is_linear() {
            return home;
        }
        let near = Joints::<N>::from_fn(|axis, _| home[axis]);
        let joints = mechanism.inverse(&Pose::at(self.start), mechanism.branch(), &near);
        joints.map_or(home, |joints| axis_array(joints.as_slice()))
    }
}
