//! Two linear axes, a rotary table, and a head that tilts and turns (source 002).
//!
//! Joints: the carriage X [m], the slide Z [m] downwards, the table d [rad], the tilt a [rad] and
//! the turn r [rad] of the head. Positions and directions of the tool are in the workpiece's frame,
//! which the table carries; z is the table's axis. With
//! `w = x₀ + l·sin a·sin r` and `v = X + l·sin a·cos r` (eq. 6 and 7) the tool is at
//! `(x, y) = Rz(d)·(w, v)`, `z = z₀ − l·cos a − Z` (eq. 1 to 4), and its beam shines along
//! `t = Rz(d)·(sin a·sin r, sin a·cos r, −cos a)`: the head's rotation is `Rz(d − r)·Rx(a)`.
//!
//! Both inverses are closed. The source iterates its eq. 10 with secants, but the residual of that
//! equation is `cos γ·(ρ − s(X))/cos(γ + δ)`: zero for every X where y = 0.

mod dynamics;

use core::f64::consts::{FRAC_PI_2, PI};

use messages::math;
use nalgebra::{Matrix3, SMatrix, Vector3};

use super::polar::center;
use super::scaled::{self, Scale};
use crate::analysis::Bodies;
use crate::kinematics::{
    Attitude, Branch, Jacobian, JointMotion, Joints, KinematicsError, Margin, MarginKind,
    Mechanism, Pose, TaskSpace, ToolMotion, finite,
};
use crate::taylor::{Scalar, Taylor};
use crate::transmission::{self, Elasticity};

pub use dynamics::McmLoad;

/// Up to this sine of the tilt the tool is upright, and its turn has no effect.
const UPRIGHT: f64 = 1e-9;

/// How fast an upright tool may seem to tilt and still be taken as staying upright [rad/s and its
/// derivatives]: rounding of a path's attitude.
const UPRIGHT_RATE: f64 = 1e-9;

/// Up to this sine of the tilt a beam may be taken as passing the vertical: farther away the direction
/// that it leans to is known well enough without.
const PASSING: f64 = 1e-4;

/// How far the head may be turned from the direction in which its beam passes the vertical [rad].
const ALIGNED: f64 = 0.3;

/// X and Z carry the head over the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mcm {
    /// Length of the tool from the tilting axis to the focus, l [m].
    pub tool: f64,
    /// Distance of the head's turning axis from the plane of the table's axis, x₀ [m].
    pub offset: f64,
    /// Height of the tilting axis over the table with Z = 0, z₀ [m].
    pub height: f64,
    /// Where the carriage may be, lower then upper X [m]: chooses the branch if nothing else does.
    pub reach: [f64; 2],
    /// Below this distance of X, or v, from the table's axis the table's angle is not well
    /// determined, v_sing [m].
    pub singular_distance: f64,
    /// The branch in which the machine works.
    pub branch: McmBranch,
    /// Masses and inertias.
    pub load: McmLoad,
    /// Spring and damper of each joint; `None` when they are taken as rigid.
    pub elasticity: Option<[Elasticity; 5]>,
}

/// On which side of the table's axis the head is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct McmBranch {
    /// Sign of X, or of v where tilt and turn are given: 1 or −1. `None` keeps the side of the
    /// previous joints.
    pub side: Option<i32>,
    /// Sign of the tilt a: 1 or −1. `None` is 1, except right where a path passes through a = 0.
    pub lean: Option<i32>,
}

impl Branch for McmBranch {
    fn choices(&self) -> Vec<(&'static str, Vec<i32>)> {
        [("side", self.side), ("lean", self.lean)]
            .into_iter()
            .filter_map(|(name, sign)| Some((name, vec![sign?])))
            .collect()
    }

    /// No values leave the choice to the previous joints. `sign` is another name for `side`, the one
    /// that the golden vectors of source 002 have.
    fn choose(self, name: &str, values: &[i32]) -> Option<Self> {
        match (name, values) {
            ("side" | "sign", []) => Some(Self { side: None, ..self }),
            ("side" | "sign", &[side @ (1 | -1)]) => Some(Self { side: Some(side), ..self }),
            ("lean", []) => Some(Self { lean: None, ..self }),
            ("lean", &[lean @ (1 | -1)]) => Some(Self { lean: Some(lean), ..self }),
            _ => None,
        }
    }
}

/// The angle on the turn nearest to `reference` [rad].
fn near<S: Scalar>(angle: S, reference: f64) -> S {
    angle + (math::nearest_turn(angle.value(), reference) - angle.value())
}

impl Mcm {
    /// Joints for tilt and turn given in the machine's frame [rad]: `position` [m] is in the
    /// workpiece's frame. `side` is the sign of v; the table's angle is the nearest to `previous`.
    ///
    /// # Errors
    /// `unreachable_radius` nearer to the table's axis than w, `singular` at v = 0.
    pub fn inverse_machine_angles(
        &self,
        position: &Vector3<f64>,
        tilt: f64,
        turn: f64,
        side: Option<i32>,
        previous: &Joints<5>,
    ) -> Result<Joints<5>, KinematicsError> {
        let lean = self.tool * math::sin(tilt);
        let (across, along) = (lean * math::sin(turn), lean * math::cos(turn));
        let w = self.offset + across;
        let radius = math::hypot(position.x, position.y);
        let reach = self.leg(radius, w)?;
        let before = previous[0] + self.tool * math::sin(previous[3]) * math::cos(previous[4]);
        let v = reach * self.side(side, before, [reach - along, -reach - along]);
        // Source 002 eq. 5, 8 and 9 with arctan2; eq. 10 needs no iteration.
        let table = math::atan2(position.y, position.x) - math::atan2(v, w);
        let slide = self.height - position.z - self.tool * math::cos(tilt);
        Ok(Joints::from([v - along, slide, near(table, previous[2]), tilt, turn]))
    }

    /// The length of the leg that `other` and the hypotenuse `radius` leave [m].
    fn leg<S: Scalar>(&self, radius: S, other: f64) -> Result<S, KinematicsError> {
        let distance = radius.value();
        // False for a radius that is not a number too.
        let reached = distance >= other.abs() && distance.is_finite();
        if !reached {
            return Err(KinematicsError {
                code: "unreachable_radius",
                axis: Some(0),
                value: distance,
                limit: other.abs(),
                detail: "the head does not come so near to the table's axis",
            });
        }
        let square = (radius - other) * (radius + other);
        if square.value() <= self.singular_distance * self.singular_distance {
            return Err(KinematicsError {
                code: "singular",
                axis: Some(2),
                value: square.value().sqrt(),
                limit: self.singular_distance,
                detail: "beside the table's axis the table's angle is not determined",
            });
        }
        Ok(square.sqrt())
    }

    /// The sign of a solution: as asked, else as it was `before` [m], else the one whose `carriage`
    /// positions [m], for + and for −, is in reach.
    fn side(&self, asked: Option<i32>, before: f64, carriage: [f64; 2]) -> f64 {
        let [lower, upper] = self.reach;
        let reached = carriage.map(|x| lower <= x && x <= upper);
        match asked {
            Some(side) => f64::from(side.signum()),
            None if before.abs() > self.singular_distance => before.signum(),
            None if reached == [false, true] => -1.0,
            None => 1.0,
        }
    }

    /// Joints that bring the focus to `position` with the beam along the unit vector `axis`, both
    /// in the workpiece's frame. `upright` says that the tool is, and stays so; `passing` gives signed
    /// lean and turn of a beam that passes the vertical, by its x and y in the machine's frame.
    fn solve_inverse<S: Scalar>(
        &self,
        [position, axis]: [[S; 3]; 2],
        upright: bool,
        passing: impl Fn([S; 2]) -> Option<[S; 2]>,
        branch: McmBranch,
        previous: &Joints<5>,
    ) -> Result<[S; 5], KinematicsError> {
        let axis =
            if upright { [0.0.into(), 0.0.into(), axis[2].value().signum().into()] } else { axis };
        // The tilting axis, l behind the focus: W = p − l·t.
        let wrist: [S; 3] = core::array::from_fn(|row| position[row] - axis[row] * self.tool);
        let reach = self.leg(planar(wrist), self.offset)?;
        let value = reach.value();
        let carriage = reach * self.side(branch.side, previous[0], [value, -value]);
        let table = wrist[1].atan2(wrist[0]) - carriage.atan2(self.offset.into());
        let slide = -wrist[2] + self.height;
        let table = near(table, previous[2]);
        let (tilt, turn) = if upright {
            (math::atan2(0.0, -axis[2].value()).into(), previous[4].into())
        } else {
            // The beam in the machine's frame, t_m = Rz(−d)·t.
            let (sine, cosine) = table.sin_cos();
            let x = axis[0] * cosine + axis[1] * sine;
            let y = axis[1] * cosine - axis[0] * sine;
            let (lean, turn) = match passing([x, y]) {
                Some([lean, turn]) => (lean, turn),
                None => ((axis[0] * axis[0] + axis[1] * axis[1]).sqrt(), x.atan2(y)),
            };
            // Leaning the other way is the same with the head turned by half a turn.
            let across = math::nearest_turn(turn.value(), previous[4]) - previous[4];
            let keeps = match branch.lean {
                Some(sign) if lean.value() != 0.0 => (lean.value() < 0.0) == (sign < 0),
                // On the way through a = 0 the turn goes on, and the tilt changes its sign.
                _ if lean.value() <= PASSING => across.abs() <= FRAC_PI_2,
                _ => true,
            };
            let (lean, turn) = if keeps { (lean, turn) } else { (-lean, turn + PI) };
            (lean.atan2(-axis[2]), near(turn, previous[4]))
        };
        Ok([carriage, slide, table, tilt, turn])
    }
}

/// Signed lean, as a sine, and turn [rad] of a beam with x and y in the machine's frame that passes
/// the vertical as the head is turned, at `turned` [rad]; `None` where it does not.
fn passing([x, y]: [Taylor; 2], turned: f64) -> Option<[Taylor; 2]> {
    if math::hypot(x.value, y.value) > PASSING {
        return None;
    }
    // As a path passes the centre of a table: the turn is counted from y to x.
    let flat = |of: fn(&Taylor) -> f64| Vector3::new(of(&y), of(&x), 0.0);
    let [lean, turn] = center::through(&ToolMotion {
        position: flat(|series| series.value),
        velocity: flat(|series| series.first),
        acceleration: flat(|series| series.second),
        jerk: flat(|series| series.third),
        attitude: Attitude::LEVEL,
    })?;
    let off = turn.value - turned;
    let across = off - (off / PI).round() * PI;
    (across.abs() <= ALIGNED).then_some([lean, turn])
}

/// Distance from the table's axis [m]; in the axis without derivatives, which there do not exist.
fn planar<S: Scalar>(point: [S; 3]) -> S {
    let square = point[0] * point[0] + point[1] * point[1];
    if square.value() == 0.0 { 0.0.into() } else { square.sqrt() }
}

impl Scale for Mcm {
    fn scale(&mut self, mass: f64, stiffness: f64) {
        let load = &mut self.load;
        scaled::all(&mut load.head_inertia, mass);
        let others = [
            &mut load.carriage_mass,
            &mut load.slide_mass,
            &mut load.table_inertia,
            &mut load.yoke_inertia,
            &mut load.head_mass,
        ];
        scaled::all(others, mass);
        scaled::soften(&mut self.elasticity, stiffness);
    }
}

impl Mechanism<5> for Mcm {
    type Branch = McmBranch;
    type ChainState = Joints<5>;

    fn name(&self) -> &'static str {
        "mcm"
    }

    fn task_space(&self) -> TaskSpace {
        TaskSpace::Axis
    }

    fn branch(&self) -> McmBranch {
        self.branch
    }

    fn branch_of(&self, q: &Joints<5>) -> McmBranch {
        let sign = |value: f64| Some(if value < 0.0 { -1 } else { 1 });
        McmBranch { side: sign(q[0]), lean: sign(q[3]) }
    }

    fn solve(
        &self,
        q: &Joints<5>,
        _branch: McmBranch,
        _near: Option<&Joints<5>>,
    ) -> Result<Joints<5>, KinematicsError> {
        Ok(*q)
    }

    // Source 002 eq. 1 to 4.
    fn pose(&self, q: &Joints<5>) -> Pose {
        let (sine, cosine) = math::sin_cos(q[2]);
        let (tilt_sine, tilt_cosine) = math::sin_cos(q[3]);
        let (turn_sine, turn_cosine) = math::sin_cos(q[4]);
        let w = self.offset + self.tool * tilt_sine * turn_sine;
        let v = q[0] + self.tool * tilt_sine * turn_cosine;
        let position = Vector3::new(
            cosine * w - sine * v,
            sine * w + cosine * v,
            self.height - self.tool * tilt_cosine - q[1],
        );
        let (s, c) = math::sin_cos(q[2] - q[4]);
        let rotation = Matrix3::new(
            c,
            -s * tilt_cosine,
            s * tilt_sine,
            s,
            c * tilt_cosine,
            -c * tilt_sine,
            0.0,
            tilt_sine,
            tilt_cosine,
        );
        Pose { position, rotation }
    }

    // In the workpiece's frame; the angular rows are those of the head against the workpiece.
    fn jacobian(&self, q: &Joints<5>) -> Jacobian<5> {
        let pose = self.pose(q);
        let (sine, cosine) = math::sin_cos(q[2]);
        let (s, c) = math::sin_cos(q[2] - q[4]);
        let up = Vector3::z();
        let tilting = Vector3::new(c, s, 0.0);
        let reach = -pose.rotation.column(2) * self.tool;
        let columns = [
            (Vector3::new(-sine, cosine, 0.0), Vector3::zeros()),
            (-up, Vector3::zeros()),
            (up.cross(&pose.position), up),
            (tilting.cross(&reach), tilting),
            (-up.cross(&reach), -up),
        ];
        Jacobian::from_fn(|row, column| {
            let (linear, angular) = columns[column];
            if row < 3 { linear[row] } else { angular[row - 3] }
        })
    }

    /// `distance` is |X| [m], which singles out the table's angle. `lean` is |sin a|, and with it
    /// the effect of r; upright, r is held.
    fn margins(&self, q: &Joints<5>) -> Vec<Margin> {
        vec![
            Margin {
                name: "distance",
                kind: MarginKind::Serial,
                value: q[0].abs(),
                limit: self.singular_distance,
            },
            Margin {
                name: "lean",
                kind: MarginKind::Serial,
                value: math::sin(q[3]).abs(),
                limit: 0.0,
            },
        ]
    }

    /// Takes from `pose.rotation` the tool's axis. Upright, r stays the previous one.
    ///
    /// # Errors
    /// `unreachable_radius` nearer to the table's axis than x₀, `singular` at X = 0.
    fn inverse(
        &self,
        pose: &Pose,
        branch: McmBranch,
        previous: &Joints<5>,
    ) -> Result<Joints<5>, KinematicsError> {
        let axis: [f64; 3] = (-pose.rotation.column(2)).into();
        let upright = math::hypot(axis[0], axis[1]) <= UPRIGHT;
        let target = [pose.position.into(), axis];
        let joints = self.solve_inverse(target, upright, |_| None, branch, previous)?;
        finite(&pose.position)?;
        finite(&pose.rotation.column(2).into_owned())?;
        Ok(Joints::from(joints))
    }

    /// # Errors
    /// As for [`Self::inverse`], and `singular_axis` where an upright tool begins to lean in a
    /// direction that the head is not turned to. A path that passes through a = 0 the way the head is
    /// turned goes on with a of the other sign.
    fn joint_motion(
        &self,
        tool: &ToolMotion,
        branch: McmBranch,
        previous: &Joints<5>,
    ) -> Result<JointMotion<5>, KinematicsError> {
        let axis = tool.attitude.series().map(|row| -row[2]);
        let lean = math::hypot(axis[0].value, axis[1].value);
        let upright = lean <= UPRIGHT;
        let rates = [axis[0], axis[1]].map(|row| row.first.abs().max(row.second.abs()));
        let rate = rates[0].max(rates[1]);
        let upright = upright && rate <= UPRIGHT_RATE;
        let passed = core::cell::Cell::new(false);
        let passing = |beam: [Taylor; 2]| {
            let found = passing(beam, previous[4]);
            passed.set(found.is_some());
            found
        };
        let joints =
            self.solve_inverse([tool.series(), axis], upright, passing, branch, previous)?;
        if lean <= UPRIGHT && !upright && !passed.get() {
            return Err(KinematicsError {
                code: "singular_axis",
                axis: Some(4),
                value: rate,
                limit: UPRIGHT_RATE,
                detail: "an upright tool begins to lean where its head is not turned to: it would have \
                         to turn at once; let the path pass there the way the head is turned, or keep \
                         a lean",
            });
        }
        finite(&tool.position)?;
        finite(&tool.attitude.rotation.column(2).into_owned())?;
        Ok(JointMotion::of_series(&joints))
    }

    fn mass_matrix(&self, q: &Joints<5>) -> SMatrix<f64, 5, 5> {
        self.load.mass_matrix(q)
    }

    fn bias(&self, q: &Joints<5>, velocity: &Joints<5>) -> Joints<5> {
        self.load.centrifugal(q, velocity) + self.load.weight(q)
    }

    fn gravity(&self, q: &Joints<5>) -> Joints<5> {
        self.load.weight(q)
    }

    fn inverse_machine_angles(
        &self,
        position: &Vector3<f64>,
        [tilt, turn]: [f64; 2],
        branch: McmBranch,
        previous: &Joints<5>,
    ) -> Option<Result<Joints<5>, KinematicsError>> {
        Some(Self::inverse_machine_angles(self, position, tilt, turn, branch.side, previous))
    }

    fn bodies(&self, q: &Joints<5>) -> Bodies {
        let (tilt_sine, tilt_cosine) = math::sin_cos(q[3]);
        let (turn_sine, turn_cosine) = math::sin_cos(q[4]);
        let head = Vector3::new(self.offset, q[0], self.height - q[1]);
        let tool = Vector3::new(tilt_sine * turn_sine, tilt_sine * turn_cosine, -tilt_cosine);
        Bodies {
            moving_mass: self.load.carriage_mass + self.load.slide_mass + self.load.head_mass,
            points: vec![Vector3::zeros(), head, head + tool * self.tool],
        }
    }

    fn stiffness(&self) -> Option<SMatrix<f64, 5, 5>> {
        transmission::stiffness(self.elasticity)
    }

    fn damping(&self) -> SMatrix<f64, 5, 5> {
        transmission::damping(self.elasticity)
    }
}
