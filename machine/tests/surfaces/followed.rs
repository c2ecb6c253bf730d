//! A curve of a drawing, put onto a surface and followed by a machine with the beam across it.

use machine::kinematics::{Joints, KinematicsError, Mechanism, Pose};
use machine::path_check::{Aim, Curve};
use machine::surface::{Surface, facing};
use nalgebra::Vector3;

/// The curve, with the machine, its branch, the surface, and the drawing's point [m] at a parameter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SurfaceCurve<'a, const N: usize, M: Mechanism<N>, F> {
    pub(crate) mechanism: &'a M,
    pub(crate) branch: M::Branch,
    pub(crate) surface: &'a Surface,
    pub(crate) drawing: F,
}

impl<const N: usize, M: Mechanism<N>, F: Fn(f64) -> [f64; 2]> Curve<N>
    for SurfaceCurve<'_, N, M, F>
{
    fn wanted(&self, parameter: f64) -> Result<Aim, KinematicsError> {
        let [x, y] = (self.drawing)(parameter);
        let spot = self.surface.spot(x, y)?;
        Ok(Aim { position: spot.point.into(), axis: spot.normal.into() })
    }

    fn joints(&self, parameter: f64, previous: &Joints<N>) -> Result<Joints<N>, KinematicsError> {
        let Aim { position, axis } = self.wanted(parameter)?;
        let pose = Pose { position, rotation: facing(&axis) };
        self.mechanism.inverse(&pose, self.branch, previous)
    }

    fn reached(&self, _parameter: f64, q: &Joints<N>) -> Result<Aim, KinematicsError> {
        Ok(Aim::of(&self.mechanism.forward(q, self.branch)?))
    }

    fn height(&self, point: &Vector3<f64>) -> Result<f64, KinematicsError> {
        self.surface.height(<[f64; 3]>::from(*point))
    }
}
