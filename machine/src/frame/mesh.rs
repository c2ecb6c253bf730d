//! What a measurement of the tool found beyond the alignment of the axes: a grid of deviations in x and
//! y, and a smooth surface through them.
//!
//! The surface is a tensor product of quintic B-splines through every value of the grid (C. de Boor, *A
//! Practical Guide to Splines*, 1978, ch. IX; M. Unser, A. Aldroubi, M. Eden, "B-spline signal processing:
//! part I", IEEE Trans. Signal Process. 41(2), 1993): it is four times continuously differentiable, so that
//! the jerk of the axes has no steps where the tool passes a grid line. At its edges it has no third and no
//! fourth derivative (natural ends); beyond them it levels out within four cells, and is constant from
//! there on.

use nalgebra::{DMatrix, Matrix2, Vector2};

use crate::kinematics::KinematicsError;
use crate::taylor::{Scalar, Taylor};

/// Deviations of the tool over a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    x: Lines,
    y: Lines,
    /// Coefficients of the splines, row by row, two columns and rows more on each side than the grid
    /// has [m].
    coefficients: Vec<[f64; 2]>,
}

/// The grid lines in one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Lines {
    /// The first one [m].
    from: f64,
    /// From one to the next [m].
    step: f64,
    count: usize,
}

/// Why there is no surface through a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MeshError {
    /// A direction has fewer than [`Mesh::FEWEST`] lines, or more than [`Mesh::MOST`].
    Lines(usize),
    /// Between two lines the deviation changes by this share of their distance, and may change by
    /// [`Mesh::STEEPEST`].
    Steep(f64),
}

impl Mesh {
    /// Lines in one direction, at least: through two, parabolas of any height would be as smooth.
    pub const FEWEST: usize = 3;

    /// Lines in one direction, at most.
    pub const MOST: usize = 200;

    /// The most that the deviation may change per way: up to there the way back is unique, and found
    /// by Newton's method from anywhere. A tenth would be 100 µm in a millimetre.
    pub const STEEPEST: f64 = 0.1;

    /// The surface through `deviations` [m], in x and y, of a grid whose lines stand evenly over `x` and
    /// over `y` [m], first to last; a row of `deviations` lies along x, the first one at the first y.
    ///
    /// # Errors
    /// Too few or too many lines, or a change too steep for a correction. All rows must be of one
    /// length, and the ranges not empty.
    pub fn new(x: [f64; 2], y: [f64; 2], deviations: &[Vec<[f64; 2]>]) -> Result<Self, MeshError> {
        let (rows, columns) = (deviations.len(), deviations.first().map_or(0, Vec::len));
        for count in [rows, columns] {
            if !(Self::FEWEST..=Self::MOST).contains(&count) {
                return Err(MeshError::Lines(count));
            }
        }
        let along = |range: [f64; 2], count: usize| Lines {
            from: range[0],
            step: (range[1] - range[0]) / (count - 1) as f64,
            count,
        };
        let splines = |count: usize| interpolating(count).ok_or(MeshError::Lines(count));
        let (across, up) = (splines(columns)?, splines(rows)?);
        let mut coefficients = vec![[0.0; 2]; (rows + 4) * (columns + 4)];
        for part in 0..2 {
            let values = DMatrix::from_fn(rows, columns, |row, column| {
                deviations[row].get(column).map_or(0.0, |deviation| deviation[part])
            });
            let found = &up * values * across.transpose();
            for row in 0..rows + 4 {
                for column in 0..columns + 4 {
                    coefficients[row * (columns + 4) + column][part] = found[(row, column)];
                }
            }
        }
        let mesh = Self { x: along(x, columns), y: along(y, rows), coefficients };
        let steepest = mesh.steepest();
        // Put this way a change that is no number is too steep.
        if steepest <= Self::STEEPEST { Ok(mesh) } else { Err(MeshError::Steep(steepest)) }
    }

    /// The deviation at `place` [m].
    pub fn at<S: Scalar>(&self, [x, y]: [S; 2]) -> [S; 2] {
        let (column, across) = self.x.weights(x);
        let (row, up) = self.y.weights(y);
        let mut sum = [S::from(0.0); 2];
        for (below, high) in up.into_iter().enumerate() {
            let mut line = [S::from(0.0); 2];
            for (beside, wide) in across.into_iter().enumerate() {
                let index = row[below] * (self.x.count + 4) + column[beside];
                let coefficient = self.coefficients[index];
                line = core::array::from_fn(|part| line[part] + wide * coefficient[part]);
            }
            sum = core::array::from_fn(|part| sum[part] + high * line[part]);
        }
        sum
    }

    /// Way of the tool per way of the aligned place, at `place` [m]: `1 + ∂δ/∂n`.
    pub fn stretch(&self, [x, y]: [f64; 2]) -> Matrix2<f64> {
        let along = |value, first| Taylor::new(value, first, 0.0, 0.0);
        let [xx, yx] = self.at([along(x, 1.0), along(y, 0.0)]);
        let [xy, yy] = self.at([along(x, 0.0), along(y, 1.0)]);
        Matrix2::new(1.0 + xx.first, xy.first, yx.first, 1.0 + yy.first)
    }

    /// The place that with its deviation is `tool` [m].
    ///
    /// # Errors
    /// Where the iteration does not end, which no place does that is a number.
    pub fn before(&self, tool: [f64; 2]) -> Result<[f64; 2], KinematicsError> {
        /// Steps of Newton's method; four are usual.
        const STEPS: usize = 40;
        /// Rounding that a step may be of, per metre.
        const ROUNDING: f64 = 4.0 * f64::EPSILON;
        let tool = Vector2::from(tool);
        let mut place = tool - Vector2::from(self.at(tool.into()));
        let mut step = f64::INFINITY;
        for _ in 0..STEPS {
            let left = place + Vector2::from(self.at(place.into())) - tool;
            let Some(back) = self.stretch(place.into()).try_inverse() else { break };
            let change = back * left;
            place -= change;
            step = change.amax();
            if step <= ROUNDING * (1.0 + tool.amax()) {
                return Ok(place.into());
            }
        }
        Err(KinematicsError {
            code: "not_a_number",
            axis: None,
            value: step,
            limit: ROUNDING,
            detail: "the way back through the frame's mesh does not end",
        })
    }

    /// The same of a motion.
    ///
    /// # Errors
    /// Where the iteration does not end.
    pub fn series_before(&self, tool: [Taylor; 2]) -> Result<[Taylor; 2], KinematicsError> {
        let start = self.before(tool.map(Scalar::value))?;
        let back = self.stretch(start).try_inverse().unwrap_or_else(Matrix2::identity);
        let mut place = start.map(Taylor::from);
        // Each step of Newton's method with the slope of the start makes one derivative more exact.
        for _ in 0..3 {
            let off = self.at(place);
            let left: [Taylor; 2] =
                core::array::from_fn(|part| place[part] + off[part] - tool[part]);
            place = core::array::from_fn(|part| {
                place[part] - left[0] * back[(part, 0)] - left[1] * back[(part, 1)]
            });
        }
        // The value was exact already.
        for (series, value) in place.iter_mut().zip(start) {
            series.value = value;
        }
        Ok(place)
    }

    /// The largest change of the deviation per way, looked for four times a cell in each direction.
    fn steepest(&self) -> f64 {
        let ticks = |lines: Lines| {
            (0..=4 * (lines.count + 5))
                .map(move |tick| lines.from + lines.step * (tick as f64 / 4.0 - 3.0))
        };
        let slope = |x, y| (self.stretch([x, y]) - Matrix2::identity()).norm();
        ticks(self.y)
            .flat_map(|y| ticks(self.x).map(move |x| (x, y)))
            .map(|(x, y)| slope(x, y))
            .fold(0.0, |most, slope| if slope <= most { most } else { slope })
    }
}

impl Lines {
    /// Which coefficients bear on `place`, and by how much.
    fn weights<S: Scalar>(&self, place: S) -> ([usize; 6], [S; 6]) {
        let at = (place - self.from) / self.step;
        let last = self.count as f64 + 3.0;
        let cell = at.value().floor();
        // Beyond all coefficients they are the same: where in the cell no longer matters.
        let (cell, share) = if (-4.0..=last).contains(&cell) {
            (cell, at - cell)
        } else {
            (cell.clamp(-4.0, last), S::from(0.0))
        };
        let indices = core::array::from_fn(|index| {
            // The first coefficient is of the line two before the first.
            let line = cell as i64 + index as i64;
            line.clamp(0, self.count as i64 + 3) as usize
        });
        (indices, quintic(share))
    }
}

/// The six quintic B-splines that are not 0 at `share` of a cell, 0 to 1.
fn quintic<S: Scalar>(share: S) -> [S; 6] {
    let f = share;
    let rest = -f + 1.0;
    let [square, other] = [f * f, rest * rest];
    let (fifth, fourth) = (square * square * f, square * square);
    let cube = square * f;
    [
        other * other * rest,
        fifth * 5.0 - fourth * 20.0 + cube * 20.0 + square * 20.0 - f * 50.0 + 26.0,
        fifth * -10.0 + fourth * 30.0 - square * 60.0 + 66.0,
        fifth * 10.0 - fourth * 20.0 - cube * 20.0 + square * 20.0 + f * 50.0 + 26.0,
        fifth * -5.0 + fourth * 5.0 + cube * 10.0 + square * 10.0 + f * 5.0 + 1.0,
        fifth,
    ]
    .map(|weight| weight / 120.0)
}

/// Turns `count` values on a line into the coefficients of the spline through them, two more on each
/// side; [coefficient, value]. There is such a matrix for three values and more.
fn interpolating(count: usize) -> Option<DMatrix<f64>> {
    let size = count + 4;
    let mut rows = DMatrix::zeros(size, size);
    let mut put = |row: usize, from: usize, weights: [f64; 5]| {
        for (index, weight) in weights.into_iter().enumerate() {
            rows[(row, from + index)] = weight;
        }
    };
    for line in 0..count {
        put(line, line, [1.0, 26.0, 66.0, 26.0, 1.0].map(|weight| weight / 120.0));
    }
    for (row, from) in [(count, 0), (count + 2, count - 1)] {
        // Third and fourth derivative at the first and the last line.
        put(row, from, [-0.5, 1.0, 0.0, -1.0, 0.5]);
        put(row + 1, from, [1.0, -4.0, 6.0, -4.0, 1.0]);
    }
    Some(rows.try_inverse()?.columns(0, count).into_owned())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::{Lines, Mesh, MeshError};
    use crate::taylor::Taylor;
    use messages::math;

    /// A measured field that no polynomial is: 40 µm in x, 25 µm in y.
    fn deviations(rows: usize, columns: usize) -> Vec<Vec<[f64; 2]>> {
        let at = |row: usize, column: usize| {
            let (r, c) = (row as f64, column as f64);
            [40e-6 * math::sin(0.7 * c + 0.3 * r), 25e-6 * math::cos(0.5 * r - 0.9 * c)]
        };
        (0..rows).map(|row| (0..columns).map(|column| at(row, column)).collect()).collect()
    }

    fn mesh() -> Mesh {
        Mesh::new([-0.1, 0.5], [0.0, 0.4], &deviations(5, 7)).unwrap()
    }

    #[test]
    fn the_surface_passes_through_every_measured_value() {
        let (mesh, deviations) = (mesh(), deviations(5, 7));
        for (row, line) in deviations.iter().enumerate() {
            for (column, expected) in line.iter().enumerate() {
                let found = mesh.at([-0.1 + 0.1 * column as f64, 0.1 * row as f64]);
                for (found, expected) in found.iter().zip(expected) {
                    assert!((found - expected).abs() < 1e-18, "{row} {column}");
                }
            }
        }
    }

    /// A plane, and a parabola away from the natural ends, are themselves.
    #[test]
    fn what_is_linear_between_lines_stays_so() {
        let plane = |x: f64, y: f64| [1e-4 * x - 2e-4 * y + 3e-5, -1e-4 * y];
        let values: Vec<Vec<[f64; 2]>> = (0..4)
            .map(|row| (0..6).map(|column| plane(0.1 * column as f64, 0.2 * row as f64)).collect())
            .collect();
        let mesh = Mesh::new([0.0, 0.5], [0.0, 0.6], &values).unwrap();
        for (x, y) in [(0.0, 0.0), (0.013, 0.57), (0.25, 0.31), (0.49, 0.01), (0.5, 0.6)] {
            let (found, expected) = (mesh.at([x, y]), plane(x, y));
            for part in 0..2 {
                assert!((found[part] - expected[part]).abs() < 1e-18, "{x} {y}");
            }
        }
    }

    /// Value, slope, bend and jerk of the surface have no step at a grid line, an edge, or where it
    /// becomes constant.
    #[test]
    fn the_jerk_has_no_steps() {
        let mesh = mesh();
        let moving = |x: f64, y: f64| {
            let [x, y] = mesh.at([Taylor::new(x, 1.0, 0.0, 0.0), Taylor::new(y, 0.6, 0.0, 0.0)]);
            [x, y]
        };
        for line in -4..12 {
            let x = -0.1 + 0.1 * f64::from(line);
            let (before, after) = (moving(x - 1e-12, 0.17), moving(x + 1e-12, 0.17));
            for (one, other) in before.iter().zip(&after) {
                assert!((one.value - other.value).abs() < 1e-15);
                assert!((one.first - other.first).abs() < 1e-12);
                assert!((one.second - other.second).abs() < 1e-10);
                assert!((one.third - other.third).abs() < 1e-8, "{line}: {one:?} {other:?}");
            }
        }
        let far = [mesh.at([2.0, 0.2]), mesh.at([1e9, 0.2]), mesh.at([f64::MAX, 0.2])];
        assert_eq!([far[0], far[0]], [far[1], far[2]]);
    }

    #[test]
    fn the_way_back_is_exact_up_to_jerk() {
        let mesh = mesh();
        for (x, y) in [(0.0, 0.0), (-0.1, 0.4), (0.333, 0.123), (0.9, -0.3), (50.0, -70.0)] {
            let tool = [Taylor::new(x, 0.7, -3.0, 90.0), Taylor::new(y, -0.4, 5.0, -60.0)];
            let place = mesh.series_before(tool).unwrap();
            let off = mesh.at(place);
            for part in 0..2 {
                let (found, wanted) = (place[part] + off[part], tool[part]);
                assert!((found.value - wanted.value).abs() <= 2e-16 * (1.0 + wanted.value.abs()));
                assert!((found.first - wanted.first).abs() < 1e-15);
                assert!((found.second - wanted.second).abs() < 1e-14);
                assert!((found.third - wanted.third).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_grid_that_corrects_nothing_is_refused() {
        let steep = |height: f64| {
            let rows = vec![vec![[0.0; 2], [height, 0.0], [0.0; 2]]; 3];
            Mesh::new([0.0, 0.02], [0.0, 0.02], &rows)
        };
        assert!(steep(1e-4).is_ok());
        assert!(matches!(steep(2e-3), Err(MeshError::Steep(slope)) if slope > 0.1));
        assert!(matches!(steep(f64::NAN), Err(MeshError::Steep(_))));
        let two = Mesh::new([0.0, 1.0], [0.0, 1.0], &[vec![[0.0; 2]; 3], vec![[0.0; 2]; 3]]);
        assert_eq!(two, Err(MeshError::Lines(2)));
        assert_eq!(Lines { from: 0.0, step: 1.0, count: 3 }.weights(1.0).0, [1, 2, 3, 4, 5, 6]);
    }
}
