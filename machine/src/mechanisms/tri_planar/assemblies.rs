//! All poses in which the platform can stand on one set of feet.
//!
//! Each corner is a strut, as drawn a side, away from two feet, so it lies on a circle about the line between them,
//! upright on the stator. Corner A anywhere on its circle leaves two places each for B and for C on
//! theirs, and closes the platform where these two are a side apart. A scan along A's circle finds
//! where that is so, and Newton's method ends there.

use core::cmp::Ordering;

use messages::math;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};

use super::chain_state::{Feet, Stance, stand};
use super::struts::{State, Struts};
use super::{HINGES, Legs};

/// More than ever stand above the stator: the equations have sixteen solutions, in mirrored pairs.
const MOST: usize = 8;

/// Steps of the scan along A's half circle above the stator.
const STEPS: usize = 120;

/// All stances on one set of feet whose legs lean in one way, the most level ones first.
pub(super) struct Assemblies {
    /// The side of the platform [m].
    side: f64,
    /// The first of them are there.
    found: [Option<Stance>; MOST],
}

impl Assemblies {
    pub(super) fn of(feet: &Feet<'_>, legs: Legs) -> Self {
        let mut all = Self { side: feet.equations.mechanism.side, found: [const { None }; MOST] };
        each(&feet.equations, |state| {
            if all.place_of(state).is_none()
                && let Some(stance) = stand(feet, state, legs)
                && let Some(place) = all.found.iter_mut().find(|place| place.is_none())
            {
                *place = Some(stance);
            }
        });
        let (side, count) = (all.side, all.count());
        all.found[..count].sort_unstable_by(|one, other| match (one, other) {
            (Some(one), Some(other)) => order(one, other, side),
            _ => Ordering::Equal,
        });
        all
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.found.iter().flatten().count()
    }

    /// The one in this place, from 0.
    pub(super) fn get(&self, place: usize) -> Option<Stance> {
        self.found.get(place).copied().flatten()
    }

    /// The place of the stance that is `state` to rounding, from 0.
    pub(super) fn place_of(&self, state: &State) -> Option<usize> {
        /// How far the same solution may be off, in sides and in the entries of a quaternion: far
        /// above rounding, far below what lies between two solutions that keep the margins.
        const SAME: f64 = 1e-6;
        self.found.iter().flatten().position(|stance| {
            let apart = (stance.state.position - state.position).amax();
            let [one, other] = [stance.state.attitude.coords, state.attitude.coords];
            let turned = (one - other).amax().min((one + other).amax());
            apart < SAME * self.side && turned < SAME
        })
    }
}

/// By tilt, then height, then direction; what differs by rounding alone does not count.
fn order(one: &Stance, other: &Stance, side: f64) -> Ordering {
    const ROUNDING: f64 = 1e-9;
    let keys = |of: &Stance| {
        let turned = &of.rotation;
        [-turned[(2, 2)], of.state.position.z / side, turned[(0, 0)], turned[(1, 0)]]
    };
    let (own, others) = (keys(one), keys(other));
    let differs = own.iter().zip(&others).find(|(one, other)| (*one - *other).abs() > ROUNDING);
    differs.map_or(Ordering::Equal, |(one, other)| one.total_cmp(other))
}

/// The feet, D, E and F from 0, a side away from the corners A, B and C.
const FEET: [[usize; 2]; 3] = [[0, 2], [1, 2], [0, 1]];

/// Where a corner can be.
struct Circle {
    centre: Vector3<f64>,
    /// Level unit vector across the line between the feet.
    across: Vector3<f64>,
    radius: f64,
}

impl Circle {
    /// That of `corner`; `None` where its feet are too far apart, or on each other.
    fn of(struts: &Struts<'_>, corner: usize) -> Option<Self> {
        let foot = |index: usize| Vector2::new(struts.feet[2 * index], struts.feet[2 * index + 1]);
        let [one, other] = FEET[corner].map(foot);
        let [near, far] = FEET[corner].map(|index| {
            let end = usize::from(HINGES[index][1] == corner);
            struts.mechanism.struts[index][end]
        });
        let apart = other - one;
        let distance = apart.norm();
        // From the first foot along the line, in lines: half of it where both struts are alike.
        let share = 0.5 + (near - far) * (near + far) / (2.0 * distance * distance);
        let middle = one + apart * share;
        let square = near * near - share * share * distance * distance;
        // Written so that what is not a number fails too.
        let crosses = distance > 0.0 && square > 0.0;
        crosses.then(|| Self {
            centre: Vector3::new(middle.x, middle.y, 0.0),
            across: Vector3::new(-apart.y, apart.x, 0.0) / distance,
            radius: square.sqrt(),
        })
    }

    /// `cosine` and `sine` of the angle from the stator up.
    fn at(&self, cosine: f64, sine: f64) -> Vector3<f64> {
        self.centre + (self.across * cosine + Vector3::z() * sine) * self.radius
    }

    /// The two places that are `side` away from `point`; `None` where there is none. One of them
    /// may be below the stator.
    fn meets(&self, point: &Vector3<f64>, side: f64) -> Option<[Vector3<f64>; 2]> {
        // |centre − point + radius·(cos, sin)| = side is p·cos + q·sin = s.
        let way = self.centre - point;
        let (p, q) = (way.dot(&self.across), way.z);
        let s =
            (side * side - way.norm_squared() - self.radius * self.radius) / (2.0 * self.radius);
        let square = p * p + q * q;
        let left = square - s * s;
        let meets = left >= 0.0 && square > 0.0;
        meets.then(|| {
            let root = left.sqrt();
            [root, -root]
                .map(|root| self.at((p * s - q * root) / square, (q * s + p * root) / square))
        })
    }
}

/// A platform with A, B and C in these places, as a start of Newton's method.
fn standing([a, b, c]: [Vector3<f64>; 3]) -> Option<State> {
    let x = (a - b).try_normalize(f64::MIN_POSITIVE)?;
    let up = c - (a + b) / 2.0;
    let y = (up - x * x.dot(&up)).try_normalize(f64::MIN_POSITIVE)?;
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)]));
    let attitude = UnitQuaternion::from_rotation_matrix(&rotation);
    Some(State { position: (a + b + c) / 3.0, attitude })
}

/// One step of the scan: for each choice of B and C, how much too far they are apart, as a share,
/// and the platform. Not a number where they have no place above the stator.
struct Step([(f64, [Vector3<f64>; 3]); 4]);

impl Step {
    fn nowhere() -> Self {
        Self([(f64::NAN, [Vector3::zeros(); 3]); 4])
    }

    fn of([on_a, on_b, on_c]: &[Circle; 3], index: usize, side: f64) -> Self {
        let angle = core::f64::consts::PI * (index as f64 + 0.5) / STEPS as f64;
        let (sine, cosine) = math::sin_cos(angle);
        let a = on_a.at(cosine, sine);
        let mut step = Self::nowhere();
        if let (Some(places_b), Some(places_c)) = (on_b.meets(&a, side), on_c.meets(&a, side)) {
            for (choice, found) in step.0.iter_mut().enumerate() {
                let (b, c) = (places_b[choice % 2], places_c[choice / 2]);
                if b.z > 0.0 && c.z > 0.0 {
                    let off = (b - c).norm_squared() / (side * side) - 1.0;
                    *found = (off, [a, b, c]);
                }
            }
        }
        step
    }
}

/// Calls `found` with every pose that closes the struts, all corners above the stator. Some come
/// more than once, and some that Newton's method reaches may be others.
fn each(struts: &Struts<'_>, mut found: impl FnMut(&State)) {
    let circles = [Circle::of(struts, 0), Circle::of(struts, 1), Circle::of(struts, 2)];
    let [Some(a), Some(b), Some(c)] = circles else { return };
    let circles = [a, b, c];
    let side = struts.mechanism.side;
    let mut try_from = |corners: [Vector3<f64>; 3]| {
        if let Some(state) = standing(corners).and_then(|start| struts.solve(start)) {
            found(&state);
        }
    };
    let (mut before, mut here) = (Step::nowhere(), Step::nowhere());
    for index in 0..=STEPS {
        let next = if index < STEPS { Step::of(&circles, index, side) } else { Step::nowhere() };
        for choice in 0..4 {
            let [(left, _), (middle, corners), (right, _)] =
                [&before, &here, &next].map(|step| step.0[choice]);
            if middle.is_nan() {
                continue;
            }
            // A change of sign; the end of what this choice reaches; and a turn towards zero, near to
            // which two solutions may lie.
            let crosses = middle * right <= 0.0;
            let ends = left.is_nan() || right.is_nan();
            let turns = middle * left > 0.0
                && middle * right > 0.0
                && middle.abs() <= left.abs().min(right.abs());
            if crosses || ends || turns {
                try_from(corners);
            }
            if turns {
                try_from(before.0[choice].1);
                try_from(next.0[choice].1);
            }
        }
        before = here;
        here = next;
    }
}
