//! A scan head: two mirrors that turn the beam, and a lens, or none, that brings it to a flat field.
//!
//! ```text
//!   laser ─►╱ mirror 1 (x)
//!           │ e
//!           ╲ mirror 2 (y)
//!           │ d, or the lens
//!   ────────┴──────── field, z = 0
//! ```
//!
//! The joints are the mirrors' mechanical angles [rad]; the beam turns by twice as much, α = 2·q₁ and
//! β = 2·q₂ (SCANLAB, *SCANpedia*, "Angle Terms"). Mirror 1 turns the beam towards x, mirror 2, which comes
//! after it, all of that towards y.
//!
//! **Without a lens** the beam meets the field where it is pointed: `y = d·tan β`,
//! `x = (√(d² + y²) + e)·tan α`. The root is what a person sees as a pincushion: a line of one α bows
//! outwards, for its way to the field grows with y (G. F. Marshall and G. E. Stutz (eds.), *Handbook
//! of Optical and Laser Scanning*, 2nd ed., 2012, chapter on galvanometric scanning, two-mirror flat-field
//! scanner; the same equations drive open-source machines, such as `GalvoSolution.cpp` for Smoothieware).
//!
//! **With an f-theta lens** the place depends on the direction of the beam alone, not on where it enters:
//! the beam leaves with the direction `(sin α, cos α·sin β, cos α·cos β)`, which is θ off the axis of the
//! lens, and comes to the field `h(θ) = f·θ·(1 + k₃·θ² + k₅·θ⁴)` from its middle, in the direction of the
//! first two (SCANLAB prints such a polynomial in the notes of each correction file; only its odd
//! terms are of a lens that is round). The two mirrors make this a barrel in one direction and a
//! pincushion in the other.
//!
//! Both inverses are exact. A field that is off by more than this has its `[frame.mesh]`.

use std::sync::Arc;

use messages::math;
use nalgebra::{Matrix2, SMatrix, Vector2, Vector3};

use super::scaled::{self, Scale};
use crate::analysis::Bodies;
use crate::frame::Frame;
use crate::kinematics::{
    Jacobian, JointMotion, Joints, KinematicsError, Margin, Mechanism, Pose, TaskSpace, ToolMotion,
    in_plane,
};
use crate::taylor::{Scalar, Taylor};
use crate::transmission::{self, Elasticity};

/// What brings the beam to the field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Optics {
    /// Nothing: the field is `distance` from mirror 2, and mirror 1 `mirrors` before that [m].
    Open {
        /// From mirror 2 to the field [m]. // d
        distance: f64,
        /// From mirror 1 to mirror 2 [m]. // e
        mirrors: f64,
    },
    /// An f-theta lens.
    FTheta {
        /// Focal length [m]. // f
        focal_length: f64,
        /// k₃ and k₅, 0 of an ideal lens.
        distortion: [f64; 2],
    },
}

/// Two mirrors over a field.
#[derive(Debug, Clone, PartialEq)]
pub struct Galvo {
    /// Moments of inertia of the mirrors about their axes, without the rotors [kg·m²].
    pub inertia: [f64; 2],
    /// What brings the beam to the field.
    pub optics: Optics,
    /// Spring and damper between rotor and mirror; `None` when they are taken as rigid.
    pub elasticity: Option<[Elasticity; 2]>,
    /// How the machine frame lies over the field; `None` where they are one.
    pub frame: Option<Arc<Frame>>,
}

/// The farthest that a beam may leave the axis [rad]; no scan lens takes more, and no mirror is so wide.
const WIDEST: f64 = 1.0;

/// Terms of the series of sine and cosine up to [`WIDEST`], to the last bit.
const TERMS: usize = 11;

impl Galvo {
    /// The mirrors' angles for a place of the field, which must be within reach.
    fn mirrors<S: Scalar>(&self, [x, y]: [S; 2]) -> [S; 2] {
        match self.optics {
            Optics::Open { distance, mirrors } => {
                let d = S::from(distance);
                let slant = (y * y + distance * distance).sqrt();
                [x.atan2(slant + mirrors) / 2.0, y.atan2(d) / 2.0]
            }
            Optics::FTheta { focal_length, distortion } => {
                let square = lens_angle(x * x + y * y, focal_length, distortion);
                let (sinc, cosine) = circle(square);
                // Way of the direction per way in the field, sin θ/h(θ).
                let share = sinc / (stretch(square, distortion) * focal_length);
                let (across, along) = (x * share, y * share);
                [across.asin() / 2.0, along.atan2(cosine) / 2.0]
            }
        }
    }

    /// The place in the field for the mirrors' angles.
    fn field(&self, q: &Joints<2>) -> Vector3<f64> {
        let [(sin_a, cos_a), (sin_b, cos_b)] = [q[0], q[1]].map(|angle| math::sin_cos(2.0 * angle));
        match self.optics {
            Optics::Open { distance, mirrors } => {
                let y = distance * sin_b / cos_b;
                let slant = (distance * distance + y * y).sqrt();
                Vector3::new((slant + mirrors) * sin_a / cos_a, y, 0.0)
            }
            Optics::FTheta { focal_length, distortion } => {
                let (across, along) = (sin_a, cos_a * sin_b);
                let sine = (across * across + along * along).sqrt();
                let angle = math::atan2(sine, cos_a * cos_b);
                let square = angle * angle;
                let share = stretch(square, distortion) * focal_length / circle(square).0;
                Vector3::new(across * share, along * share, 0.0)
            }
        }
    }

    /// Refuses a place of the field that no beam comes to.
    fn check(&self, place: &Vector3<f64>) -> Result<(), KinematicsError> {
        in_plane(place)?;
        let reach = self.reach();
        let off = math::hypot(place.x, place.y);
        if off <= reach {
            return Ok(());
        }
        Err(KinematicsError {
            code: "unreachable_field",
            axis: None,
            value: off,
            limit: reach,
            detail: "the beam would leave the head too far from its axis",
        })
    }

    /// How far from its middle the field ends [m].
    pub fn reach(&self) -> f64 {
        match self.optics {
            Optics::Open { distance, .. } => {
                let (sine, cosine) = math::sin_cos(WIDEST);
                distance * sine / cosine
            }
            Optics::FTheta { focal_length, distortion } => {
                focal_length * WIDEST * stretch(WIDEST * WIDEST, distortion)
            }
        }
    }

    /// Refuses angles that point beyond the field.
    fn check_angles(q: &Joints<2>) -> Result<(), KinematicsError> {
        for (axis, angle) in q.iter().enumerate() {
            // Put this way an angle that is no number is refused.
            let is_possible = angle.abs() <= WIDEST;
            if !is_possible {
                return Err(KinematicsError {
                    code: "unreachable_field",
                    axis: Some(axis),
                    value: *angle,
                    limit: WIDEST,
                    detail: "the mirror points the beam away from the field",
                });
            }
        }
        Ok(())
    }

    /// Way of the mirrors per way in the field, at `place`.
    fn slopes(&self, place: &Vector3<f64>) -> Matrix2<f64> {
        let along = |direction: usize| {
            let series = |row: usize| {
                Taylor::new(place[row], if row == direction { 1.0 } else { 0.0 }, 0.0, 0.0)
            };
            self.mirrors([series(0), series(1)])
        };
        let [of_x, of_y] = [along(0), along(1)];
        Matrix2::new(of_x[0].first, of_y[0].first, of_x[1].first, of_y[1].first)
    }
}

/// `1 + k₃·T + k₅·T²`.
fn stretch<S: Scalar>(square: S, [third, fifth]: [f64; 2]) -> S {
    (square * fifth + third) * square + 1.0
}

/// The square T of the angle off the axis for the square of the way from the middle of the field:
/// `f²·T·(1 + k₃·T + k₅·T²)²`. A function of squares is smooth through the middle, where the angle
/// itself has no direction.
fn lens_angle<S: Scalar>(square_way: S, focal_length: f64, distortion: [f64; 2]) -> S {
    /// Steps of Newton's method to the value; five are usual.
    const STEPS: usize = 30;
    let scaled = square_way / (focal_length * focal_length);
    let [third, fifth] = distortion;
    // T·g² = s: its slope is g·(g + 2·T·g′).
    let slope = |t: f64| {
        let g = stretch(t, distortion);
        g * (g + 2.0 * t * (third + 2.0 * fifth * t))
    };
    let wanted = scaled.value();
    let mut value = wanted;
    for _ in 0..STEPS {
        let g = stretch(value, distortion);
        let change = (value * g * g - wanted) / slope(value);
        value -= change;
        if change.abs() <= f64::EPSILON * value.abs() {
            break;
        }
    }
    // Each step with the slope of the value makes one derivative more exact.
    let mut square = S::from(value);
    for _ in 0..3 {
        let g = stretch(square, distortion);
        square = square - (square * g * g - scaled) / slope(value);
    }
    square
}

/// `sin √T/√T` and `cos √T` by their series.
fn circle<S: Scalar>(square: S) -> (S, S) {
    let (mut sinc, mut cosine) = (S::from(1.0), S::from(1.0));
    for term in (1..TERMS).rev() {
        let n = 2.0 * term as f64;
        sinc = -(sinc * square / (n * (n + 1.0))) + 1.0;
        cosine = -(cosine * square / (n * (n - 1.0))) + 1.0;
    }
    (sinc, cosine)
}

impl Scale for Galvo {
    fn scale(&mut self, mass: f64, stiffness: f64) {
        scaled::all(&mut self.inertia, mass);
        scaled::soften(&mut self.elasticity, stiffness);
    }
}

impl Mechanism<2> for Galvo {
    type Branch = ();
    type ChainState = Joints<2>;

    fn name(&self) -> &'static str {
        "galvo"
    }

    fn task_space(&self) -> TaskSpace {
        TaskSpace::Plane
    }

    fn branch(&self) {}

    fn branch_of(&self, _q: &Joints<2>) {}

    fn solve(
        &self,
        q: &Joints<2>,
        _branch: (),
        _near: Option<&Joints<2>>,
    ) -> Result<Joints<2>, KinematicsError> {
        Self::check_angles(q)?;
        Ok(*q)
    }

    fn pose(&self, q: &Joints<2>) -> Pose {
        let place = self.field(q);
        Pose::at(self.frame.as_ref().map_or(place, |frame| frame.tool(&place)))
    }

    fn margins(&self, _q: &Joints<2>) -> Vec<Margin> {
        Vec::new()
    }

    fn has_constant_mass(&self) -> bool {
        true
    }

    fn inverse(
        &self,
        pose: &Pose,
        _branch: (),
        _previous: &Joints<2>,
    ) -> Result<Joints<2>, KinematicsError> {
        in_plane(&pose.position)?;
        let place = match &self.frame {
            None => pose.position,
            Some(frame) => frame.axes(&pose.position)?,
        };
        self.check(&place)?;
        Ok(Joints::from(self.mirrors([place.x, place.y])))
    }

    fn jacobian(&self, q: &Joints<2>) -> Jacobian<2> {
        let place = self.field(q);
        let slopes = self.slopes(&place);
        let field = slopes.try_inverse().unwrap_or_else(|| Matrix2::from_element(f64::NAN));
        let plane = match &self.frame {
            None => field,
            Some(frame) => frame.jacobian(&place).fixed_view::<2, 2>(0, 0) * field,
        };
        let mut jacobian = Jacobian::<2>::zeros();
        jacobian.fixed_view_mut::<2, 2>(0, 0).copy_from(&plane);
        jacobian
    }

    fn joint_motion(
        &self,
        tool: &ToolMotion,
        _branch: (),
        _previous: &Joints<2>,
    ) -> Result<JointMotion<2>, KinematicsError> {
        in_plane(&tool.position)?;
        let along_field;
        let field = match &self.frame {
            None => tool,
            Some(frame) => {
                along_field = frame.axes_motion(tool)?;
                &along_field
            }
        };
        self.check(&field.position)?;
        let [x, y, _] = field.series();
        Ok(JointMotion::of_series(&self.mirrors([x, y])))
    }

    fn mass_matrix(&self, _q: &Joints<2>) -> SMatrix<f64, 2, 2> {
        SMatrix::from_diagonal(&Vector2::from(self.inertia))
    }

    fn bias(&self, q: &Joints<2>, _velocity: &Joints<2>) -> Joints<2> {
        self.gravity(q)
    }

    fn gravity(&self, _q: &Joints<2>) -> Joints<2> {
        // A mirror turns about its centre of mass.
        Joints::zeros()
    }

    fn bodies(&self, q: &Joints<2>) -> Bodies {
        Bodies { moving_mass: 0.0, points: vec![self.pose(q).position] }
    }

    fn stiffness(&self) -> Option<SMatrix<f64, 2, 2>> {
        transmission::stiffness(self.elasticity)
    }

    fn damping(&self) -> SMatrix<f64, 2, 2> {
        transmission::damping(self.elasticity)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use messages::math;
    use nalgebra::{Matrix3, Vector3};

    use super::{Galvo, Optics, circle};
    use crate::kinematics::Joints;
    use crate::{Mechanism, Pose};

    fn head(optics: Optics) -> Galvo {
        Galvo { inertia: [1e-8; 2], optics, elasticity: None, frame: None }
    }

    #[test]
    fn the_series_are_sine_and_cosine() {
        for step in 0..=100 {
            let angle = f64::from(step) / 100.0;
            let (sinc, cosine) = circle(angle * angle);
            assert!((sinc * angle - math::sin(angle)).abs() < 3e-16, "{angle}");
            assert!((cosine - math::cos(angle)).abs() < 3e-16, "{angle}");
        }
    }

    /// The lenses of three SCANLAB correction files for two axes with their printed polynomials
    /// `h = f1·θ + f2·θ² + f3·θ³ + f4·θ⁴` [mm], the printed size of the square field [mm] and the largest
    /// angles of the mirrors in it [deg]: mirror 1 at the middle of a side, mirror 2 in the corner. From
    /// the notes of D2_721.ct5, D2_1251.ct5 and D2_1075.ct5; the first is in the public repository
    /// `labspiral/sirius2`, bin/correction.
    const LENSES: [([f64; 4], f64, [f64; 2]); 3] = [
        ([255.059, -1.365, 1.493, -18.087], 202.271, [11.425, 12.163]),
        ([340.896, -8.414, 11.270, -71.802], 262.144, [11.208, 12.132]),
        ([503.441, 2.082, 48.261, 7.106], 420.102, [11.733, 12.179]),
    ];

    /// f, k₃ and k₅ that come nearest to a printed polynomial up to 0.6 rad.
    fn fitted(printed: [f64; 4]) -> Optics {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for step in 1..=600 {
            let angle = f64::from(step) * 1e-3;
            let square = angle * angle;
            let row = Vector3::new(angle, square * angle, square * square * angle);
            let height = printed.iter().rev().fold(0.0, |sum, term| (sum + term) * angle);
            normal += row * row.transpose();
            right += row * height;
        }
        let found = normal.try_inverse().unwrap() * right;
        let distortion = [found[1] / found[0], found[2] / found[0]];
        Optics::FTheta { focal_length: found[0] * 1e-3, distortion }
    }

    #[test]
    fn the_mirrors_of_real_heads_turn_as_far_as_is_printed() {
        for (printed, size, expected) in LENSES {
            let head = head(fitted(printed));
            let half = size * 0.5e-3;
            let turn = |x: f64, y: f64| {
                let place = Pose::at(Vector3::new(x, y, 0.0));
                head.inverse(&place, (), &Joints::zeros()).unwrap().map(f64::to_degrees)
            };
            let (side, corner) = (turn(half, 0.0), turn(half, half));
            assert!((side[0] - expected[0]).abs() < 0.03, "{side} {expected:?}");
            assert!((corner[1] - expected[1]).abs() < 0.03, "{corner} {expected:?}");
            // The other mirror, and the other places, need less.
            assert!(corner[0] < side[0] && turn(0.0, half)[1] < corner[1]);
        }
    }

    /// Without a lens the beam is a ray, which is reflected twice and cut by the field.
    #[test]
    fn without_a_lens_the_place_is_that_of_the_reflected_ray() {
        let (distance, mirrors) = (0.3, 0.015);
        let head = head(Optics::Open { distance, mirrors });
        let reflect =
            |ray: Vector3<f64>, normal: Vector3<f64>| ray - normal * (2.0 * ray.dot(&normal));
        for (first, second) in [(0.0, 0.0), (0.1, -0.07), (-0.15, 0.12), (0.18, 0.18)] {
            // The beam comes along −x to mirror 1, which turns about z. At rest it goes on along y to mirror
            // 2, which turns about the line along x at y = e, and from there down.
            let half = core::f64::consts::FRAC_PI_4;
            let normal = Vector3::new(math::cos(half - first), math::sin(half - first), 0.0);
            let across = reflect(-Vector3::x(), normal);
            let normal = Vector3::new(0.0, -math::sin(half - second), -math::cos(half - second));
            let hit = across * (mirrors * normal.y / across.dot(&normal));
            let down = reflect(across, normal);
            let field = hit + down * ((-distance - hit.z) / down.z);
            // The middle of the field is below mirror 2.
            let expected = Vector3::new(field.x, field.y - mirrors, 0.0);
            let found = head.forward(&Joints::from([first, second]), ()).unwrap().position;
            assert!((found - expected).norm() < 1e-14, "{found} {expected}");
        }
    }

    #[test]
    fn a_place_beyond_the_lens_is_refused() {
        let head = head(Optics::FTheta { focal_length: 0.16, distortion: [0.0; 2] });
        let far = Pose::at(Vector3::new(0.17, 0.0, 0.0));
        let error = head.inverse(&far, (), &Joints::zeros()).unwrap_err();
        assert_eq!((error.code, error.value, error.limit), ("unreachable_field", 0.17, 0.16));
        let turned = Joints::from([0.0, 1.2]);
        assert_eq!(head.forward(&turned, ()).unwrap_err().axis, Some(1));
    }
}
