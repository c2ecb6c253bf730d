//! Cubic B-splines over uneven knots, clamped at both ends.

use nalgebra::Vector3;

use crate::geometry::jet::Jet;

/// The value and the first three derivatives, by row, of the four B-splines (by column) of one interval
/// between knots, at its start.
pub(crate) type Local = [[f64; 4]; 4];

/// Fills `locals` with the B-splines of every interval between the `knots` [m], which rise strictly.
/// The B-splines of interval `j` are those numbered `j` to `j + 3`.
pub(crate) fn locals(knots: &[f64], locals: &mut Vec<Local>) {
    locals.clear();
    locals.extend((0..knots.len().saturating_sub(1)).map(|j| local(knots, j)));
}

/// The B-splines of interval `j`.
fn local(knots: &[f64], j: usize) -> Local {
    let last = knots.len() - 1;
    // The knots about the interval's start: three before it, itself, three after it.
    let near: [f64; 7] =
        std::array::from_fn(|i| knots[(j + i).saturating_sub(3).min(last)] - knots[j]);
    let knot = |i: usize| if i < 7 { near[i] } else { knots[(j + 4).min(last)] - knots[j] };
    // Polynomials by the distance from the interval's start, lowest power first.
    let mut splines = [[0.0; 4]; 4];
    splines[3][0] = 1.0;
    for degree in 1..4 {
        for i in (3 - degree)..4 {
            let mut sum = [0.0; 4];
            if i > 3 - degree {
                let (from, to) = (knot(i), knot(i + degree));
                add_product(&mut sum, &splines[i], -from, 1.0, to - from);
            }
            if i < 3 {
                let (from, to) = (knot(i + 1), knot(i + degree + 1));
                add_product(&mut sum, &splines[i + 1], to, -1.0, to - from);
            }
            splines[i] = sum;
        }
    }
    std::array::from_fn(|order| {
        let factor = [1.0, 1.0, 2.0, 6.0][order];
        std::array::from_fn(|k| splines[k][order] * factor)
    })
}

/// Adds polynomial·(constant + slope·x)/width to `sum`.
fn add_product(sum: &mut [f64; 4], polynomial: &[f64; 4], constant: f64, slope: f64, width: f64) {
    if width <= 0.0 {
        return;
    }
    for power in 0..4 {
        sum[power] += polynomial[power] * constant / width;
        if power < 3 {
            sum[power + 1] += polynomial[power] * slope / width;
        }
    }
}

/// The values of the four B-splines at `distance` [m] from the start of their interval.
#[inline]
pub(crate) fn values(local: &Local, distance: f64) -> [f64; 4] {
    let (half, third) = (distance / 2.0, distance / 3.0);
    std::array::from_fn(|k| {
        local[0][k] + distance * (local[1][k] + half * (local[2][k] + third * local[3][k]))
    })
}

/// The jet at the start of an interval of the spline with these four coefficients.
pub(crate) fn jet(local: &Local, coefficients: &[Vector3<f64>]) -> Jet {
    let row = |order: usize| {
        (0..4).fold(Vector3::zeros(), |sum, k| sum + coefficients[k] * local[order][k])
    };
    Jet { point: row(0), first: row(1), second: row(2), third: row(3) }
}

/// The jet of a cubic at `distance` [m] from where it has the jet `start`.
#[inline]
pub(crate) fn taylor(start: &Jet, distance: f64) -> Jet {
    let half = distance / 2.0;
    Jet {
        point: start.point
            + (start.first + (start.second + start.third * (distance / 3.0)) * half) * distance,
        first: start.first + (start.second + start.third * half) * distance,
        second: start.second + start.third * distance,
        third: start.third,
    }
}

/// The first three coefficients of a spline over `knots` that starts with the value and the first two
/// derivatives of `jet`.
pub(crate) fn leading(knots: &[f64], jet: &Jet) -> [Vector3<f64>; 3] {
    let one = knots[1] - knots[0];
    let two = knots[2.min(knots.len() - 1)] - knots[0];
    let second = jet.point + jet.first * (one / 3.0);
    // p″(0) = 6/h₁·((c₂ − c₁)/h₂ − (c₁ − c₀)/h₁), h₂ from the start to the second knot.
    let third = second + (jet.second * (one / 6.0) + (second - jet.point) / one) * two;
    [jet.point, second, third]
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOTS: [f64; 7] = [0.0, 0.5, 0.7, 1.7, 2.0, 2.1, 3.0];

    fn coefficients() -> Vec<Vector3<f64>> {
        (0..KNOTS.len() + 2)
            .map(|i| Vector3::new((i * i % 7) as f64, i as f64, (i * 3 % 5) as f64))
            .collect()
    }

    #[test]
    fn the_b_splines_add_up_to_one() {
        let mut all = Vec::new();
        locals(&KNOTS, &mut all);
        for (j, local) in all.iter().enumerate() {
            for part in [0.0, 0.3, 1.0] {
                let sum: f64 = values(local, part * (KNOTS[j + 1] - KNOTS[j])).iter().sum();
                assert!((sum - 1.0).abs() < 1e-12, "{j} {part} {sum}");
            }
        }
    }

    #[test]
    fn the_pieces_join_with_two_derivatives() {
        let (mut all, coefficients) = (Vec::new(), coefficients());
        locals(&KNOTS, &mut all);
        for j in 1..all.len() {
            let before = jet(&all[j - 1], &coefficients[j - 1..]);
            let end = taylor(&before, KNOTS[j] - KNOTS[j - 1]);
            let start = jet(&all[j], &coefficients[j..]);
            assert!((end.point - start.point).norm() < 1e-11);
            assert!((end.first - start.first).norm() < 1e-10);
            assert!((end.second - start.second).norm() < 1e-9);
        }
    }

    #[test]
    fn the_leading_coefficients_give_the_start() {
        let wanted = Jet {
            point: Vector3::new(1.0, 2.0, 3.0),
            first: Vector3::new(0.6, 0.8, 0.1),
            second: Vector3::new(-5.0, 2.0, 0.5),
            third: Vector3::zeros(),
        };
        let (mut all, mut coefficients) = (Vec::new(), coefficients());
        locals(&KNOTS, &mut all);
        coefficients[..3].copy_from_slice(&leading(&KNOTS, &wanted));
        let start = jet(&all[0], &coefficients);
        assert!((start.point - wanted.point).norm() < 1e-12);
        assert!((start.first - wanted.first).norm() < 1e-12);
        assert!((start.second - wanted.second).norm() < 1e-11);
    }
}
