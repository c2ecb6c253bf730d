//! Cubic Bézier curves of a drawing.

use nalgebra::Vector3;

/// Start, two control points and end [m].
pub(crate) type Points = [Vector3<f64>; 4];

/// The most chords that one curve is taken by.
const MOST_CHORDS: f64 = 100_000.0;

/// The point at `parameter`, 0 at the start and 1 at the end [m].
pub(crate) fn point(points: &Points, parameter: f64) -> Vector3<f64> {
    let rest = 1.0 - parameter;
    let [first, second, third, fourth] = points;
    first * (rest * rest * rest)
        + second * (3.0 * rest * rest * parameter)
        + third * (3.0 * rest * parameter * parameter)
        + fourth * (parameter * parameter * parameter)
}

/// The direction in which it sets out, not of length 1; zero where all its points are one.
pub(crate) fn heading(points: &Points) -> Vector3<f64> {
    let ways = points[1..].iter().map(|point| point - points[0]);
    ways.into_iter().find(|way| way.norm_squared() > 0.0).unwrap_or_default()
}

/// How many even steps of the parameter have chords within `error` of the curve [m].
pub(crate) fn chords(points: &Points, error: f64) -> usize {
    // A curve that is nowhere has one chord, which is refused.
    (beyond_chords(points, 1).norm() / error).sqrt().ceil().clamp(1.0, MOST_CHORDS) as usize
}

/// How far the curve may be from the chords of so many even steps of the parameter, by coordinate [m].
pub(crate) fn beyond_chords(points: &Points, count: usize) -> Vector3<f64> {
    let [first, second, third, fourth] = points;
    // The second derivative is linear in the parameter. A chord over a step h is off by |p″|·h²/8.
    let bends = [first - second * 2.0 + third, second - third * 2.0 + fourth];
    let step = 1.0 / count as f64;
    bends[0].abs().sup(&bends[1].abs()) * (6.0 * step * step / 8.0)
}

/// The points at even steps of the parameter after the start, the end the last one.
pub(crate) fn samples(points: &Points, count: usize) -> impl Iterator<Item = Vector3<f64>> {
    let points = *points;
    (1..=count).map(move |index| match index {
        _ if index == count => points[3],
        _ => point(&points, index as f64 / count as f64),
    })
}

/// Its length to a thousandth [m].
pub(crate) fn length(points: &Points) -> f64 {
    let size = (points[3] - points[0]).norm()
        + (points[1] - points[0]).norm()
        + (points[2] - points[3]).norm();
    if size <= 0.0 {
        return 0.0;
    }
    let mut place = points[0];
    // A chord that is off by a share e of its length is shorter by 8/3·e².
    samples(points, chords(points, 1e-4 * size).max(16))
        .map(|next| (next - core::mem::replace(&mut place, next)).norm())
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quarter(radius: f64) -> Points {
        let out = 0.552_284_749_830_793_6 * radius;
        [
            Vector3::new(radius, 0.0, 0.0),
            Vector3::new(radius, out, 0.0),
            Vector3::new(out, radius, 0.0),
            Vector3::new(0.0, radius, 0.0),
        ]
    }

    #[test]
    fn chords_are_within_their_error() {
        let points = quarter(0.01);
        for error in [1e-5, 1e-7] {
            let count = chords(&points, error);
            let mut place = points[0];
            for (index, next) in samples(&points, count).enumerate() {
                let middle = point(&points, (index as f64 + 0.5) / count as f64);
                assert!((middle - (place + next) / 2.0).norm() <= error);
                place = next;
            }
            assert_eq!(place, points[3]);
        }
    }

    #[test]
    fn a_quarter_of_a_circle_is_as_long_as_one() {
        let (long, right) = (length(&quarter(0.02)), 0.02 * core::f64::consts::FRAC_PI_2);
        assert!((long / right - 1.0).abs() < 1e-3, "{long} {right}");
        assert_eq!(length(&[Vector3::zeros(); 4]), 0.0);
    }

    #[test]
    fn a_handle_that_is_drawn_in_gives_no_direction() {
        let [first, _, third, fourth] = quarter(1.0);
        let drawn_in = [first, first, third, fourth];
        assert_eq!(heading(&drawn_in), third - first);
        assert_eq!(heading(&[first; 4]), Vector3::zeros());
    }
}
