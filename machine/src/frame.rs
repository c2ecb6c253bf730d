//! How the frame that jobs speak in lies over the axes that are really there: mirrored, exchanged,
//! shifted, turned, skew, longer or shorter than they say, and off by what was measured.
//!
//! Axes at `c` bring the tool to `p = n + δ(n)` with `n = L·c + o`: `n` is the place that their
//! alignment gives, and `δ` what a measurement found beyond it ([`Mesh`]). The way back is exact:
//! Newton's method on `δ`, which is small, and the matrix.

pub mod mesh;

pub use mesh::Mesh;

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::kinematics::{KinematicsError, ToolMotion, finite};
use crate::taylor::Taylor;

/// Where the machine frame is, seen from the axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Way of the tool in x and y per way of the first and the second axis, L.
    linear: Matrix2<f64>,
    inverse: Matrix2<f64>,
    /// Way of the tool in z per way of the third axis: 1 or −1, times its scale.
    lift: f64,
    /// The tool with all axes at zero, o [m].
    origin: Vector3<f64>,
    mesh: Option<Mesh>,
}

/// What an alignment consists of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alignment {
    /// Whether each axis runs against its direction of the frame.
    pub mirrored: [bool; 3],
    /// Whether the first axis moves the tool in y and the second in x.
    pub swapped: bool,
    /// The tool with all axes at zero [m].
    pub origin: [f64; 3],
    /// By how much the axis along x is turned against x of the frame, counter-clockwise [rad].
    pub rotation: f64,
    /// By how much the axis along y leans beyond a right angle from the one along x [rad].
    pub skew: f64,
    /// What each axis really moves per what it says.
    pub scale: [f64; 3],
}

impl Alignment {
    /// The frame is the axes'.
    pub const NONE: Self = Self {
        mirrored: [false; 3],
        swapped: false,
        origin: [0.0; 3],
        rotation: 0.0,
        skew: 0.0,
        scale: [1.0; 3],
    };
}

impl Frame {
    /// The frame over axes that are aligned so and off by `mesh`; `None` where two axes move the tool
    /// the same way.
    pub fn new(alignment: &Alignment, mesh: Option<Mesh>) -> Option<Self> {
        let Alignment { mirrored, swapped, origin, rotation, skew, scale } = *alignment;
        let run = |axis: usize| if mirrored[axis] { -scale[axis] } else { scale[axis] };
        let own = Matrix2::new(run(0), 0.0, 0.0, run(1));
        let exchanged =
            if swapped { Matrix2::new(0.0, 1.0, 1.0, 0.0) } else { Matrix2::identity() };
        let (lean, upright) = messages::math::sin_cos(skew);
        let (sine, cosine) = messages::math::sin_cos(rotation);
        let linear = Matrix2::new(cosine, -sine, sine, cosine)
            * Matrix2::new(1.0, -lean, 0.0, upright)
            * exchanged
            * own;
        let inverse = linear.try_inverse()?;
        Some(Self { linear, inverse, lift: run(2), origin: Vector3::from(origin), mesh })
    }

    /// Whether straight lines of the tool are straight lines of the axes.
    pub fn is_linear(&self) -> bool {
        self.mesh.is_none()
    }

    /// Way of the tool in z per way of the third axis.
    pub fn lift(&self) -> f64 {
        self.lift
    }

    /// The tool with the axes at `axes` [m].
    pub fn tool(&self, axes: &Vector3<f64>) -> Vector3<f64> {
        let aligned = self.aligned(axes);
        let off = self.mesh.as_ref().map_or([0.0; 2], |mesh| mesh.at([aligned.x, aligned.y]));
        aligned + Vector3::new(off[0], off[1], 0.0)
    }

    /// Way of the tool per way of the axes, with these at `axes` [m].
    pub fn jacobian(&self, axes: &Vector3<f64>) -> Matrix3<f64> {
        let aligned = self.aligned(axes);
        let plane = match &self.mesh {
            None => self.linear,
            Some(mesh) => mesh.stretch([aligned.x, aligned.y]) * self.linear,
        };
        let mut jacobian = Matrix3::zeros();
        jacobian.fixed_view_mut::<2, 2>(0, 0).copy_from(&plane);
        jacobian[(2, 2)] = self.lift;
        jacobian
    }

    /// The axes that bring the tool to `tool` [m].
    ///
    /// # Errors
    /// A place that is not a number.
    pub fn axes(&self, tool: &Vector3<f64>) -> Result<Vector3<f64>, KinematicsError> {
        finite(tool)?;
        let aligned = match &self.mesh {
            None => *tool,
            Some(mesh) => {
                let [x, y] = mesh.before([tool.x, tool.y])?;
                Vector3::new(x, y, tool.z)
            }
        };
        Ok(self.back(&(aligned - self.origin)))
    }

    /// The motion of the axes, in the place of the tool's, that moves the tool so.
    ///
    /// # Errors
    /// A place that is not a number.
    pub fn axes_motion(&self, tool: &ToolMotion) -> Result<ToolMotion, KinematicsError> {
        finite(&tool.position)?;
        let mut aligned = *tool;
        if let Some(mesh) = &self.mesh {
            let [x, y, _] = tool.series();
            let found: [Taylor; 2] = mesh.series_before([x, y])?;
            for (row, series) in found.into_iter().enumerate() {
                aligned.position[row] = series.value;
                aligned.velocity[row] = series.first;
                aligned.acceleration[row] = series.second;
                aligned.jerk[row] = series.third;
            }
        }
        Ok(ToolMotion {
            position: self.back(&(aligned.position - self.origin)),
            velocity: self.back(&aligned.velocity),
            acceleration: self.back(&aligned.acceleration),
            jerk: self.back(&aligned.jerk),
            attitude: tool.attitude,
        })
    }

    fn aligned(&self, axes: &Vector3<f64>) -> Vector3<f64> {
        let plane = self.linear * Vector2::new(axes.x, axes.y);
        Vector3::new(plane.x, plane.y, self.lift * axes.z) + self.origin
    }

    /// L⁻¹, and z.
    fn back(&self, way: &Vector3<f64>) -> Vector3<f64> {
        let plane = self.inverse * Vector2::new(way.x, way.y);
        Vector3::new(plane.x, plane.y, way.z / self.lift)
    }
}
