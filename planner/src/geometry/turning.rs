//! How the tool is turned along a path: exactly as asked for at some of its places, the knots, and
//! smoothly between them.
//!
//! Near a knot R(s) = R_i·exp(ω_i·x + α_i·x²/2), x being the way from it. From one knot to the next,
//!
//! ```text
//! R(s) = R_i · exp((1 − σ)·(ω_i·x + α_i·x²/2)) · exp(σ·D) · exp(σ·(ω_j·y + α_j·y²/2))
//! D = log(R_iᵀ·R_j), y the way from the next knot, σ = 35λ⁴ − 84λ⁵ + 70λ⁶ − 20λ⁷, λ the share of the way
//! ```
//!
//! σ and its first three derivatives are 0 at one end, and those of σ − 1 at the other: the rotation is
//! three times continuously differentiable by the place. Turning on evenly about one axis stays that.

use machine::kinematics::Attitude;
use machine::taylor::Taylor;
use messages::math;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::geometry::attitude::{exponential, moving, product, rows};
use crate::search::partition_near;

/// How much longer than the other a neighbouring stretch may be for the parabola through three knots to
/// say how the middle one is passed.
const UNEVEN: f64 = 3.0;

/// A knot next to a larger turn than this is passed with the turning at rest [rad].
const LARGE: f64 = 1.6;

/// A place of a path and how the tool is turned there.
#[derive(Debug, Clone, PartialEq)]
struct Knot {
    /// Along the path [m].
    place: f64,
    rotation: Matrix3<f64>,
    /// Rate of the turning in the tool's own frame, and its change [rad/m, rad/m²].
    rate: Vector3<f64>,
    change: Vector3<f64>,
    /// The turn to the next knot in the tool's own frame [rad].
    turn: Vector3<f64>,
}

/// A rotation by the place on a path.
#[derive(Debug, Clone, PartialEq)]
pub struct Turning {
    knots: Vec<Knot>,
}

impl Turning {
    /// Turned by `rotations` at `places` [m], growing, two at least; at the ends, and at each that is said
    /// to `rest`, the turning comes to rest.
    pub(crate) fn new(places: &[f64], rotations: &[Matrix3<f64>], rests: &[bool]) -> Self {
        let count = places.len();
        let turns: Vec<Vector3<f64>> =
            rotations.windows(2).map(|pair| logarithm(&pair[0].tr_mul(&pair[1]))).collect();
        let knot = |index: usize| {
            let is_end = index == 0 || index + 1 == count;
            let (rate, change) = if is_end || rests[index] {
                (Vector3::zeros(), Vector3::zeros())
            } else {
                let ways = [places[index] - places[index - 1], places[index + 1] - places[index]];
                through([&turns[index - 1], &turns[index]], ways)
            };
            let turn = turns.get(index).copied().unwrap_or_else(Vector3::zeros);
            Knot { place: places[index], rotation: rotations[index], rate, change, turn }
        };
        Self { knots: (0..count).map(knot).collect() }
    }

    /// The attitude at a place that changes like `place` [m], up to angular jerk.
    pub(crate) fn attitude(&self, place: Taylor, near: &mut usize) -> Attitude {
        let after = partition_near(&self.knots, near, |knot| knot.place <= place.value);
        let index = after.max(1).min(self.knots.len() - 1) - 1;
        let [from, to] = [&self.knots[index], &self.knots[index + 1]];
        let (x, y) = (place - from.place, place - to.place);
        let share = step(x / (to.place - from.place));
        let left = -share + 1.0;
        let leaving = along(from, x).map(|part| part * left);
        let between = [0, 1, 2].map(|row| share * from.turn[row]);
        let coming = along(to, y).map(|part| part * share);
        let turn = product(&exponential(between), &exponential(coming));
        moving(&product(&rows(&from.rotation), &product(&exponential(leaving), &turn)))
    }

    /// The places of the knots and half way between them [m], growing, from the last knot up to `start` on.
    pub(crate) fn places(&self, start: f64) -> impl Iterator<Item = f64> + '_ {
        let first = self.knots.partition_point(|knot| knot.place <= start).max(1) - 1;
        let knots = &self.knots[first..];
        let between = knots.windows(2).map(|pair| (pair[0].place + pair[1].place) / 2.0);
        let ends = knots.iter().map(|knot| knot.place);
        let last = knots.last().map(|knot| knot.place);
        ends.zip(between).flat_map(|(knot, middle)| [knot, middle]).chain(last)
    }
}

/// The rotation vector from a knot on, `way` from it.
fn along(knot: &Knot, way: Taylor) -> [Taylor; 3] {
    [0, 1, 2].map(|row| way * (way * (knot.change[row] / 2.0) + knot.rate[row]))
}

/// Rate and change at the middle of three knots, with the turns to it and from it and the ways: those of
/// the parabola through the three where the ways are alike, else a rate that goes too far in neither.
fn through(
    [before, after]: [&Vector3<f64>; 2],
    [way, next]: [f64; 2],
) -> (Vector3<f64>, Vector3<f64>) {
    /// The middle rate is at most so many times the lesser of both sides.
    const STEEPEST: f64 = 2.0;
    if before.norm() > LARGE || after.norm() > LARGE {
        return (Vector3::zeros(), Vector3::zeros());
    }
    let (left, right) = (before / way, after / next);
    let rate = (left * next + right * way) / (way + next);
    if way.max(next) <= UNEVEN * way.min(next) {
        return (rate, (right - left) * (2.0 / (way + next)));
    }
    let most = STEEPEST * left.norm().min(right.norm());
    let length = rate.norm();
    (if length > most { rate * (most / length) } else { rate }, Vector3::zeros())
}

/// σ of the share of the way.
fn step(share: Taylor) -> Taylor {
    let square = share * share;
    square * square * (share * (share * (share * -20.0 + 70.0) - 84.0) + 35.0)
}

/// The rotation vector of `rotation`, of half a turn at most [rad].
pub(crate) fn logarithm(rotation: &Matrix3<f64>) -> Vector3<f64> {
    let rotation = Rotation3::from_matrix_unchecked(*rotation);
    let quaternion = UnitQuaternion::from_rotation_matrix(&rotation).into_inner();
    let sign = if quaternion.w < 0.0 { -1.0 } else { 1.0 };
    let (vector, scalar) = (quaternion.imag() * sign, quaternion.w * sign);
    let length = vector.norm();
    if length > 0.0 { vector * (2.0 * math::atan2(length, scalar) / length) } else { vector }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::PI;

    use super::*;
    use crate::geometry::attitude::turned;

    /// A turning with knots near and far, a rest, a large turn and one that stays.
    fn turning() -> (Vec<f64>, Vec<Matrix3<f64>>, Turning) {
        let places = vec![0.0, 0.01, 0.03, 0.035, 0.055, 0.08, 0.1, 0.12];
        let rotations: Vec<Matrix3<f64>> = [
            [0.0, 0.0, 0.0],
            [0.1, 0.05, -0.2],
            [0.2, -0.1, 0.3],
            [0.1, 0.1, 0.2],
            [0.1, 0.1, 0.2],
            [-0.2, 0.2, 2.4],
            [-0.2, 0.1, 2.2],
            [0.0, 0.2, 2.0],
        ]
        .into_iter()
        .map(|[roll, pitch, yaw]| turned(roll, pitch, yaw))
        .collect();
        let rests = [2].iter().fold(vec![false; 8], |mut rests, index| {
            rests[*index] = true;
            rests
        });
        let turning = Turning::new(&places, &rotations, &rests);
        (places, rotations, turning)
    }

    #[test]
    fn the_tool_is_turned_as_asked_at_every_knot() {
        let (places, rotations, turning) = turning();
        for (place, rotation) in places.iter().zip(&rotations) {
            for beside in [-1e-15, 0.0, 1e-15] {
                assert!(
                    (turning.attitude(Taylor::from(place + beside), &mut 0).rotation - rotation)
                        .amax()
                        < 1e-13,
                    "{place}"
                );
            }
        }
        let rest = |place: f64| turning.attitude(Taylor::new(place, 1.0, 0.0, 0.0), &mut 0);
        for place in [places[0], places[2], places[7]] {
            let found = rest(place);
            let most = found.velocity.amax().max(found.acceleration.amax()).max(found.jerk.amax());
            assert!(most < 1e-6, "{place}: {most}");
        }
        assert!(rest(places[1]).velocity.norm() > 1.0);
    }

    #[test]
    fn rates_are_the_differences_of_rotations_and_go_on_through_the_knots() {
        let (places, _, turning) = turning();
        // A motion along the path, with all derivatives.
        let at = |place: f64, time: f64| {
            let (v, a, j) = (0.05, 0.3, -4.0);
            Taylor::new(
                place + time * (v + time * (a / 2.0 + time * j / 6.0)),
                v + time * (a + time * j / 2.0),
                a + time * j,
                j,
            )
        };
        let step = 2e-7;
        let all = (0..240).map(|index| 0.12 * (f64::from(index) + 0.5) / 240.0);
        for place in all.chain(places[1..7].iter().copied()) {
            let look = |time: f64| turning.attitude(at(place, time), &mut 0);
            let (behind, here, ahead) = (look(-step), look(0.0), look(step));
            let rotation = here.rotation;
            assert!((rotation * rotation.transpose() - Matrix3::identity()).amax() < 1e-13);
            let spin = (ahead.rotation - behind.rotation) / (2.0 * step) * rotation.transpose();
            let expected = Vector3::new(spin[(2, 1)], spin[(0, 2)], spin[(1, 0)]);
            // At a knot the jerk's own rate jumps, which the difference shows by a step of it.
            let most = if places.contains(&place) { 0.2 } else { 1e-3 };
            let near = |found: &Vector3<f64>, expected: &Vector3<f64>, what: &str| {
                let off = (found - expected).amax() / (1.0 + 0.1 * found.amax());
                assert!(off < most, "{what} at {place}: {found} {expected}");
            };
            near(&here.velocity, &expected, "rate");
            let expected = (ahead.velocity - behind.velocity) / (2.0 * step);
            near(&here.acceleration, &expected, "acceleration");
            let expected = (ahead.acceleration - behind.acceleration) / (2.0 * step);
            near(&here.jerk, &expected, "jerk");
        }
    }

    #[test]
    fn turning_on_evenly_stays_even() {
        let places: Vec<f64> = (0..6).map(|index| 0.01 * f64::from(index)).collect();
        let rotations: Vec<_> =
            (0..6).map(|index| turned(0.0, 0.0, 0.1 * f64::from(index))).collect();
        let turning = Turning::new(&places, &rotations, &[false; 6]);
        for index in 0..=60 {
            let place = 0.01 + 0.03 * f64::from(index) / 60.0;
            let found = turning.attitude(Taylor::new(place, 1.0, 0.0, 0.0), &mut 0);
            assert!((found.velocity - Vector3::z() * 10.0).amax() < 1e-9, "{}", found.velocity);
            assert!(found.acceleration.amax() < 1e-6, "{}", found.acceleration);
        }
    }

    #[test]
    fn places_are_looked_at_from_the_knot_before_on() {
        let (knots, _, turning) = turning();
        let all: Vec<f64> = turning.places(-1.0).collect();
        assert_eq!(all.len(), 2 * knots.len() - 1);
        assert!(all.windows(2).all(|pair| pair[0] < pair[1]));
        for (index, knot) in knots.iter().enumerate() {
            for start in [*knot, knot + 1e-3] {
                let found: Vec<f64> = turning.places(start).collect();
                assert_eq!(found, all[2 * index..], "{start}");
            }
        }
    }

    #[test]
    fn a_logarithm_is_exact_up_to_half_a_turn() {
        for angle in [1e-9, 0.3, 1.7, 3.1, PI - 1e-6] {
            let axis = Vector3::new(0.6, -0.48, 0.64);
            let back = logarithm(&{
                let rows = exponential((axis * angle).into());
                Matrix3::from_fn(|row, column| rows[row][column])
            });
            assert!((back - axis * angle).amax() < 1e-12, "{angle}: {back}");
        }
    }
}
