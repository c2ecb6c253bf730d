//! The limits of a flight as cones: linear in the coefficients of its velocity.

use super::direction::Side;
use super::grid::{Grid, INTERVALS};

/// Coefficients of the velocity that are free.
pub(super) const FREE: usize = INTERVALS - 2;

/// Accelerations at inner breaks, jerks in intervals, free coefficients: the cones of one limit of
/// all three.
const CONES: usize = 3 * INTERVALS - 3;

/// How much of the share the speed takes: little, as a line's own speed may be the limit.
const SHARE: f64 = 0.1;

/// The ends and limits of a flight in its own plane (`D` = 2) or space (3).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Task<const D: usize> {
    /// At start and end [m/s].
    pub velocity: [[f64; D]; 2],
    /// At start and end [m/s²].
    pub acceleration: [[f64; D]; 2],
    /// From start to end [m]; `None` where it is free.
    pub displacement: Option<[f64; D]>,
    /// [m/s], [m/s²], [m/s³].
    pub limits: [f64; 3],
    /// What else there is along single directions.
    pub sides: Vec<Side<D>>,
}

/// A vector whose norm is to stay below a radius, and what the step does to it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cone<const D: usize> {
    /// Parts of its limit.
    pub at: [f64; D],
    /// The change by one Newton step.
    pub step: [f64; D],
    /// First coefficient it depends on, and the factors of that and the two after it.
    pub first: usize,
    pub factors: [f64; 3],
    /// What the end acceleration adds.
    pub constant: [f64; D],
    /// Growth of its radius with the share: 1 or [`SHARE`].
    pub slope: f64,
    /// The direction along which alone it holds, of length 1.
    pub direction: Option<[f64; D]>,
}

/// The scalar product.
pub(super) fn dot<const D: usize>(left: &[f64; D], right: &[f64; D]) -> f64 {
    let mut sum = 0.0;
    for axis in 0..D {
        sum += left[axis] * right[axis];
    }
    sum
}

impl<const D: usize> Cone<D> {
    fn new(first: usize, factors: [f64; 3], constant: [f64; D], slope: f64) -> Self {
        let (at, step) = ([0.0; D], [0.0; D]);
        Self { at, step, first, factors, constant, slope, direction: None }
    }

    /// `vector` as far as the cone holds it.
    fn held(&self, vector: [f64; D]) -> [f64; D] {
        match &self.direction {
            Some(direction) => {
                let part = dot(direction, &vector);
                direction.map(|axis| axis * part)
            }
            None => vector,
        }
    }

    /// The matrix that does the same.
    pub(super) fn holds(&self, row: usize, column: usize) -> f64 {
        match &self.direction {
            Some(direction) => direction[row] * direction[column],
            None if row == column => 1.0,
            None => 0.0,
        }
    }

    /// The linear part for `coefficients`.
    pub(super) fn apply(&self, coefficients: &[[f64; D]; INTERVALS]) -> [f64; D] {
        let mut sum = [0.0; D];
        for (index, factor) in self.factors.iter().enumerate() {
            // Factors beyond the last coefficient are 0.
            let coefficient = &coefficients[(self.first + index).min(INTERVALS - 1)];
            for axis in 0..D {
                sum[axis] += factor * coefficient[axis];
            }
        }
        self.held(sum)
    }

    /// What the norm is to stay below at `share`.
    pub(super) fn radius(&self, share: f64) -> f64 {
        1.0 + self.slope * (share - 1.0)
    }
}

/// The cones of `task` over `grid`.
pub(super) fn cones<const D: usize>(task: &Task<D>, grid: &Grid) -> Vec<Cone<D>> {
    let mut cones = Vec::with_capacity(CONES * (1 + task.sides.len()));
    add(task, grid, None, &task.limits, &mut cones);
    for side in &task.sides {
        let of = |(limit, all): (f64, f64)| if limit < all { limit } else { f64::INFINITY };
        let [speed, acceleration, jerk] = side.limits;
        let [all_speed, all_acceleration, all_jerk] = task.limits;
        let limits =
            [(speed, all_speed), (acceleration, all_acceleration), (jerk, all_jerk)].map(of);
        add(task, grid, Some(side.direction), &limits, &mut cones);
    }
    cones
}

/// Adds the cones of those of `limits` that are finite.
fn add<const D: usize>(
    task: &Task<D>,
    grid: &Grid,
    direction: Option<[f64; D]>,
    [speed, acceleration, jerk]: &[f64; 3],
    cones: &mut Vec<Cone<D>>,
) {
    let zero = [0.0; D];
    let mut push = |cone: Cone<D>| {
        let cone = Cone { direction, ..cone };
        cones.push(Cone { constant: cone.held(cone.constant), ..cone });
    };
    if acceleration.is_finite() {
        for index in 0..INTERVALS - 1 {
            let factor = 1.0 / (acceleration * grid.gap(index + 1));
            push(Cone::new(index, [-factor, factor, 0.0], zero, 1.0));
        }
    }
    if jerk.is_finite() {
        for index in 0..INTERVALS {
            let scale = 1.0 / (jerk * grid.steps[index]);
            let end = |value: [f64; D], sign: f64| value.map(|part| sign * scale * part);
            push(if index == 0 {
                let factor = scale / grid.gap(1);
                Cone::new(0, [-factor, factor, 0.0], end(task.acceleration[0], -1.0), 1.0)
            } else if index == INTERVALS - 1 {
                let factor = scale / grid.gap(index);
                Cone::new(index - 1, [factor, -factor, 0.0], end(task.acceleration[1], 1.0), 1.0)
            } else {
                let (before, after) = (scale / grid.gap(index), scale / grid.gap(index + 1));
                Cone::new(index - 1, [before, -before - after, after], zero, 1.0)
            });
        }
    }
    if speed.is_finite() {
        for index in 1..=FREE {
            push(Cone::new(index, [1.0 / speed, 0.0, 0.0], zero, SHARE));
        }
    }
}
