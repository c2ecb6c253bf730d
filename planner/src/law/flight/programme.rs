//! The flight of a given duration that uses the least part of its limits.
//!
//! Over fixed breaks velocity, acceleration and jerk are linear in the coefficients d of the
//! velocity, and so is the displacement. The least share s with
//!
//! ```text
//! |a| ≤ s·A at all breaks   |j| ≤ s·J in all intervals   |d| ≤ (1 + κ·(s − 1))·V
//! ```
//!
//! is a second-order cone programme. Its barrier is minimised by Newton steps with an exact search
//! along each; the matrix is a band, so a step costs as much as there are intervals.

use super::along::{along, leave};
use super::band::small;
use super::cone::{Cone, Task, cones, dot};
use super::grid::{Grid, INTERVALS};
use super::model::Model;

/// The share from which on a duration is much too short.
const EXCESS: f64 = 1.15;

/// Half the square of Newton's decrement below which a step has come near enough to the centre.
const CENTRED: f64 = 1.0;

/// The same below which the gap is narrowed.
const PURSUIT: f64 = 20.0;

/// How much the gap is narrowed at once.
const FASTER: f64 = 15.0;

/// What a programme found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Answer<const D: usize> {
    /// Largest part of a limit in use.
    pub share: f64,
    /// The part of `share` by which the least may be below it.
    pub gap: f64,
    /// Coefficients of the velocity [m/s].
    pub coefficients: [[f64; D]; INTERVALS],
}

/// The programme at one duration. `W` = 3·`D`, `R` = `D`·[`FREE`], `C` = `D` + 2.
struct Programme<const D: usize, const W: usize, const R: usize, const C: usize> {
    cones: Vec<Cone<D>>,
    /// The terms of its barrier along a step.
    squares: Vec<[f64; 3]>,
    weights: [f64; INTERVALS],
    share: f64,
    coefficients: [[f64; D]; INTERVALS],
    placed: bool,
}

impl<const D: usize, const W: usize, const R: usize, const C: usize> Programme<D, W, R, C> {
    /// Starts from `guess`, with the ends of `task` and its displacement.
    fn new(task: &Task<D>, grid: &Grid, guess: &[[f64; D]; INTERVALS], off: f64) -> Self {
        let weights = core::array::from_fn(|index| grid.weight(index));
        let mut coefficients = *guess;
        let last = INTERVALS - 1;
        coefficients[0] = core::array::from_fn(|axis| {
            task.velocity[0][axis] + task.acceleration[0][axis] * grid.steps[0] / 2.0
        });
        coefficients[last] = core::array::from_fn(|axis| {
            task.velocity[1][axis] - task.acceleration[1][axis] * grid.steps[last] / 2.0
        });
        let mut programme = Self {
            cones: cones(task, grid),
            squares: Vec::new(),
            weights,
            share: 0.0,
            coefficients,
            placed: task.displacement.is_some(),
        };
        if let Some(displacement) = &task.displacement {
            programme.place(task, grid, displacement);
        }
        programme.begin(off);
        programme
    }

    /// Adds a bump to the velocity so that the way is `displacement`.
    fn place(&mut self, task: &Task<D>, grid: &Grid, displacement: &[f64; D]) {
        let duration: f64 = grid.steps.iter().sum();
        let flank = duration.min(6.0 * grid.steps[..INTERVALS / 2 - 1].iter().sum::<f64>()) / 6.0;
        let mut bump = [0.0; INTERVALS];
        let (mut time, mut area) = (0.0, 0.0);
        for (index, part) in bump.iter_mut().enumerate().take(INTERVALS - 1).skip(1) {
            time += grid.gap(index);
            let middle = time + grid.steps[0] / 2.0;
            *part = (middle.min(duration - middle) / flank).min(1.0);
            area += *part * self.weights[index];
        }
        let ends = grid.ends();
        for axis in 0..D {
            let mut lacking = displacement[axis]
                - ends[0] * task.velocity[0][axis]
                - ends[1] * task.velocity[1][axis];
            for (weight, coefficient) in self.weights.iter().zip(&self.coefficients) {
                lacking -= weight * coefficient[axis];
            }
            for (part, coefficient) in bump.iter().zip(&mut self.coefficients) {
                coefficient[axis] += lacking / area * part;
            }
        }
    }

    /// A share at which all cones hold.
    fn begin(&mut self, off: f64) {
        let mut share = 0.0_f64;
        for cone in &mut self.cones {
            cone.at = cone.apply(&self.coefficients);
            for axis in 0..D {
                cone.at[axis] += cone.constant[axis];
            }
            let norm = dot(&cone.at, &cone.at).sqrt();
            share = share.max(1.0 + (norm - 1.0) / cone.slope);
        }
        self.share = share.max(1e-3) * (1.0 + 0.1 * off.min(1.0));
    }

    /// One Newton step at `price`; gives half the decrement's square.
    fn step(&mut self, price: f64) -> f64 {
        let mut model = Model::<D, W, R>::new(&self.cones, self.share, price);
        model.matrix.factor();
        let mut columns = self.columns(&model);
        model.matrix.solve(&mut columns);
        let [mut above, mut below] = [-model.share[0], model.share[1]];
        for (mixed, column) in model.mixed.iter().zip(&columns) {
            above -= mixed * column[0];
            below -= mixed * column[1];
        }
        let mut multipliers = [[0.0; D]; 2];
        if self.placed {
            let ways = self.ways(&columns);
            let matrix = core::array::from_fn(|axis| ways[axis + 2]);
            multipliers = [small(matrix, ways[0]), small(matrix, ways[1])];
            above += dot(&ways[1], &multipliers[0]);
            below += dot(&ways[1], &multipliers[1]);
        }
        let change = if below > 0.0 { above / below } else { 0.0 };
        let mut step = [[0.0; D]; INTERVALS];
        let mut decrement = -model.share[0] * change;
        for (row, column) in columns.iter().enumerate() {
            let mut part = column[0] - change * column[1];
            for axis in 0..D {
                part -= column[axis + 2] * (multipliers[0][axis] - change * multipliers[1][axis]);
            }
            step[row / D + 1][row % D] = part;
            decrement -= model.gradient[row] * part;
        }
        self.advance(&step, change, price);
        decrement / 2.0
    }

    /// What the matrix is solved for: descent, share, and the displacement by its axes.
    fn columns(&self, model: &Model<D, W, R>) -> [[f64; C]; R] {
        let mut columns = [[0.0; C]; R];
        for (row, column) in columns.iter_mut().enumerate() {
            column[0] = -model.gradient[row];
            column[1] = model.mixed[row];
            column[2 + row % D] = self.weights[row / D + 1];
        }
        columns
    }

    /// The displacement that each of `columns` makes.
    fn ways(&self, columns: &[[f64; C]; R]) -> [[f64; D]; C] {
        let mut ways = [[0.0; D]; C];
        for (row, column) in columns.iter().enumerate() {
            for (way, part) in ways.iter_mut().zip(column) {
                way[row % D] += self.weights[row / D + 1] * part;
            }
        }
        ways
    }

    /// Goes along `step` and `change` to the least of the barrier.
    fn advance(&mut self, step: &[[f64; D]; INTERVALS], change: f64, price: f64) {
        self.squares.clear();
        let mut top = f64::INFINITY;
        for cone in &mut self.cones {
            cone.step = cone.apply(step);
            let (radius, growth) = (cone.radius(self.share), cone.slope * change);
            let square = [
                radius * radius - dot(&cone.at, &cone.at),
                2.0 * (radius * growth - dot(&cone.at, &cone.step)),
                growth * growth - dot(&cone.step, &cone.step),
            ];
            top = top.min(leave(&square));
            self.squares.push(square);
        }
        let length = along(&self.squares, price * change, top);
        for cone in &mut self.cones {
            for axis in 0..D {
                cone.at[axis] += length * cone.step[axis];
            }
        }
        for (coefficient, step) in self.coefficients.iter_mut().zip(step) {
            for axis in 0..D {
                coefficient[axis] += length * step[axis];
            }
        }
        self.share += length * change;
    }
}

/// The least share for `task` over `grid`, to `goal`, from a `guess` that is off by about `off`.
///
/// `goal` and `off` are parts of the share. Where it is sure to be more than [`EXCESS`], the goal is
/// not pursued.
pub(super) fn solve<const D: usize, const W: usize, const R: usize, const C: usize>(
    task: &Task<D>,
    grid: &Grid,
    guess: &[[f64; D]; INTERVALS],
    off: f64,
    goal: f64,
) -> Answer<D> {
    let mut programme = Programme::<D, W, R, C>::new(task, grid, guess, off);
    let weight = 2.0 * programme.cones.len() as f64;
    let mut gap = off.max(goal);
    for _ in 0..40 {
        let share = programme.share;
        let decrement = programme.step(weight / (gap * share));
        let near = decrement < CENTRED;
        if near && (gap <= goal || programme.share * (1.0 - gap) > EXCESS) {
            break;
        }
        if decrement < PURSUIT {
            gap = (gap / FASTER).max(goal);
        }
    }
    Answer { share: programme.share, gap, coefficients: programme.coefficients }
}
