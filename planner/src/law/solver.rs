//! The primal-dual interior point method for a [`Program`].
//!
//! Predictor and corrector after Mehrotra. As each row touches three neighbours the normal matrix
//! has two diagonals beside the main one, so a step takes time linear in the unknowns.

use super::{
    passes::{Predicted, Sums, max},
    program::{LANES, Lanes, Program},
};

/// How a programme ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Within all rows, and as good as asked.
    Solved,
    /// Within all rows, not as good as asked.
    Feasible,
    /// Nothing within the rows was found.
    Failed,
}

/// The most steps.
const MOST_STEPS: usize = 60;
/// How far a step goes towards the nearest bound.
const STRIDE: f64 = 0.995;
/// How much of the square of a speed may go in one step: beyond, its time is far from its series.
const MOST_FALL: f64 = 0.7;
/// A row may be broken by this part of its top.
const BROKEN: f64 = 1e-6;
/// A row broken by this part of its top is as good as kept where no better is found.
const NEARLY_KEPT: f64 = 1e-4;

/// The buffers of the method, used again for the next programme.
#[derive(Debug, Clone, Default)]
pub(super) struct Solver {
    /// Steps of all programmes so far.
    pub(super) steps: usize,
    /// What makes the first time 1 for each unknown [1/s].
    unit: f64,
    /// The price of y ≥ 0, its step and the second order of it.
    price: Vec<f64>,
    price_step: Vec<f64>,
    cross: Vec<f64>,
    step: Vec<f64>,
    side: Vec<f64>,
    centre: Vec<f64>,
    slope: Vec<f64>,
    diagonal: Vec<f64>,
    beside: Vec<f64>,
    beyond: Vec<f64>,
    /// What the rows cost of each unknown at their prices.
    priced: Vec<f64>,
    /// The most that the rows let each unknown be; empty where that was not asked yet.
    most: Vec<f64>,
}

/// What a pass over the rows found.
#[derive(Debug, Clone, Copy, Default)]
struct Found {
    /// Σ room · price.
    complement: f64,
    /// The largest `off`.
    off: f64,
    /// The time, in units of its first.
    time: f64,
    /// The largest slope of the time, and what is left of it against the prices.
    steepest: f64,
    slope: f64,
    /// Σ price, and Σ price · top of the rows.
    prices: f64,
    worth: f64,
}

impl Solver {
    /// Solves `program` from `unknowns`, all positive, and leaves the best found in them.
    /// `weight` is the first price of a unit of room; the objective is met within `precision`.
    pub(super) fn solve(
        &mut self,
        program: &mut Program,
        unknowns: &mut [f64],
        weight: f64,
        precision: f64,
    ) -> Outcome {
        self.start(program, unknowns, weight);
        let count = (program.groups.len() * LANES + unknowns.len()) as f64;
        let mut stride = (0.0, 0.0);
        let mut found = Found::default();
        for _ in 0..MOST_STEPS {
            found = self.gather(program, unknowns, stride);
            let close = found.complement <= precision * found.time;
            if close && found.off <= BROKEN && found.slope <= 1e-4 * found.steepest {
                return Outcome::Solved;
            }
            if !(found.complement.is_finite() && found.off.is_finite()) {
                return Outcome::Failed;
            }
            if self.is_empty(program, &found) {
                return Outcome::Failed;
            }
            self.steps += 1;
            self.factor();
            self.step.copy_from_slice(&self.side);
            self.back();
            let mean = found.complement / count;
            let predicted = self.predict(program, unknowns) / count;
            let ratio = (predicted / mean).clamp(0.0, 1.0);
            let centring = (ratio * ratio * ratio).max(1e-6) * mean;
            for index in 0..unknowns.len() {
                self.step[index] = self.side[index] + centring * self.centre[index];
            }
            self.back();
            stride = self.strides(program, unknowns, centring);
            if stride.0 < 1e-9 && stride.1 < 1e-9 {
                break;
            }
        }
        if found.off <= NEARLY_KEPT { Outcome::Feasible } else { Outcome::Failed }
    }

    /// Rooms and prices to begin with.
    fn start(&mut self, program: &mut Program, unknowns: &[f64], weight: f64) {
        let count = unknowns.len();
        for buffer in [
            &mut self.price,
            &mut self.price_step,
            &mut self.cross,
            &mut self.step,
            &mut self.side,
            &mut self.centre,
            &mut self.slope,
            &mut self.diagonal,
            &mut self.beside,
            &mut self.beyond,
            &mut self.priced,
        ] {
            buffer.clear();
            buffer.resize(count, 0.0);
        }
        self.most.clear();
        self.unit = 1.0;
        self.unit = unknowns.len() as f64 / self.time(program, unknowns).max(1e-300);
        for (price, y) in self.price.iter_mut().zip(unknowns) {
            *price = weight / y;
        }
        for block in &program.blocks {
            let y = &unknowns[block.first..block.first + 3];
            for group in &mut program.groups[block.groups.0..block.groups.1] {
                for lane in 0..LANES {
                    let used: f64 = (0..3).map(|k| group.weights[k][lane] * y[k]).sum();
                    group.room[lane] = (group.top[lane] - used).max(0.02);
                    group.price[lane] = weight / group.room[lane];
                    group.room_step[lane] = 0.0;
                    group.price_step[lane] = 0.0;
                }
            }
        }
    }

    /// Takes the last step by the strides, and makes the normal matrix and the right side there.
    fn gather(&mut self, program: &mut Program, unknowns: &mut [f64], stride: (f64, f64)) -> Found {
        let mut found = Found::default();
        for (index, y) in unknowns.iter_mut().enumerate() {
            *y += stride.0 * self.step[index];
            self.price[index] += stride.1 * self.price_step[index];
            let (y, price) = (*y, self.price[index]);
            found.complement += y * price;
            self.diagonal[index] = price / y;
            self.beside[index] = 0.0;
            self.beyond[index] = 0.0;
            self.side[index] = 0.0;
            self.slope[index] = price;
            self.priced[index] = 0.0;
        }
        found.time = self.time(program, unknowns);
        found.steepest = self.side.iter().fold(1e-300, |most, gain| gain.abs().max(most));
        for block in &program.blocks {
            let first = block.first;
            let y = [unknowns[first], unknowns[first + 1], unknowns[first + 2]];
            let mut sums = Sums::default();
            for group in &mut program.groups[block.groups.0..block.groups.1] {
                sums.take(group, y, stride);
            }
            let total = |lanes: Lanes| lanes.iter().sum::<f64>();
            found.complement += total(sums.complement);
            found.off = sums.off.iter().fold(found.off, |most, off| most.max(*off));
            found.prices += total(sums.prices);
            found.worth += total(sums.worth);
            for k in 0..3 {
                self.diagonal[first + k] += total(sums.squares[k]);
                self.side[first + k] += total(sums.side[k]);
                let priced = total(sums.priced[k]);
                self.slope[first + k] -= priced;
                self.priced[first + k] += priced;
            }
            self.beside[first] += total(sums.beside[0]);
            self.beside[first + 1] += total(sums.beside[1]);
            self.beyond[first] += total(sums.beyond);
        }
        found.slope = self.slope.iter().fold(0.0, |most, slope| slope.abs().max(most));
        found
    }

    /// Whether the prices prove that nothing is within the rows, not even within those broken by what an answer
    /// may break them by (Farkas): of all y ≥ 0 within the rows the prices z make zᵀA·y ≤ zᵀb, and where zᵀA is
    /// nowhere below 0 and zᵀb is, there is none. Where zᵀA is below 0, by a little, y is at its largest.
    fn is_empty(&mut self, program: &Program, found: &Found) -> bool {
        let mut worth = found.worth + NEARLY_KEPT * found.prices;
        if worth >= 0.0 {
            return false;
        }
        if self.most.is_empty() {
            self.most.resize(self.priced.len(), f64::INFINITY);
            program.largest(NEARLY_KEPT, &mut self.most);
        }
        for (priced, most) in self.priced.iter().zip(&self.most) {
            if *priced < 0.0 {
                worth -= priced * most;
            }
        }
        // Rounding of the sums: a proof by less is none. Put this way neither is one that is no number.
        worth < -1e-9 * found.prices
    }

    /// The time; adds its slope and its curvature.
    fn time(&mut self, program: &Program, unknowns: &[f64]) -> f64 {
        let mut time = 0.0;
        for block in &program.blocks {
            let first = block.first;
            let y = [unknowns[first], unknowns[first + 1], unknowns[first + 2]];
            for term in &program.terms[block.terms.0..block.terms.1] {
                let square = term.square(y).max(1e-300);
                let inverse = 1.0 / square;
                let part = self.unit * term.length * square.sqrt() * inverse;
                let slope = 0.5 * part * inverse;
                let curvature = 1.5 * slope * inverse;
                let weights = term.weights;
                time += part;
                for (k, weight) in weights.into_iter().enumerate() {
                    self.side[first + k] += slope * weight;
                    self.slope[first + k] += slope * weight;
                    self.diagonal[first + k] += curvature * weight * weight;
                }
                self.beside[first] += curvature * weights[0] * weights[1];
                self.beside[first + 1] += curvature * weights[1] * weights[2];
                self.beyond[first] += curvature * weights[0] * weights[2];
            }
        }
        time
    }

    /// Factors the normal matrix in place: L, then D in the diagonal.
    fn factor(&mut self) {
        let count = self.diagonal.len();
        for index in 0..count {
            let pivot = self.diagonal[index].max(1e-200);
            self.diagonal[index] = pivot;
            if index + 1 < count {
                let beside = self.beside[index];
                let lower = beside / pivot;
                self.diagonal[index + 1] -= lower * beside;
                self.beside[index] = lower;
                if index + 2 < count {
                    let beyond = self.beyond[index];
                    self.beside[index + 1] -= lower * beyond;
                    self.diagonal[index + 2] -= beyond * beyond / pivot;
                    self.beyond[index] = beyond / pivot;
                }
            }
        }
    }

    /// Solves for `step`, the right side in it.
    fn back(&mut self) {
        let count = self.step.len();
        let (mut last, mut second) = (0.0, 0.0);
        for index in 0..count {
            let mut value = self.step[index];
            if index > 0 {
                value -= self.beside[index - 1] * last;
            }
            if index > 1 {
                value -= self.beyond[index - 2] * second;
            }
            (second, last) = (last, value);
            self.step[index] = value;
        }
        (last, second) = (0.0, 0.0);
        for index in (0..count).rev() {
            let mut value = self.step[index] / self.diagonal[index];
            if index + 1 < count {
                value -= self.beside[index] * last;
            }
            if index + 2 < count {
                value -= self.beyond[index] * second;
            }
            (second, last) = (last, value);
            self.step[index] = value;
        }
    }

    /// The complement after the step without centring; adds the second order of that step to the
    /// right side and makes what centring adds.
    fn predict(&mut self, program: &mut Program, unknowns: &[f64]) -> f64 {
        let mut sums = Predicted::default();
        for (index, &y) in unknowns.iter().enumerate() {
            let (price, step) = (self.price[index], self.step[index]);
            let price_step = -price - price / y * step;
            sums.scalar(y, price, step, price_step);
            self.cross[index] = step * price_step;
            self.side[index] -= self.cross[index] / y;
            self.centre[index] = 1.0 / y;
        }
        for block in &program.blocks {
            let first = block.first;
            let step = [self.step[first], self.step[first + 1], self.step[first + 2]];
            let mut side = [[0.0; LANES]; 3];
            let mut centre = [[0.0; LANES]; 3];
            for group in &mut program.groups[block.groups.0..block.groups.1] {
                sums.take(group, step, &mut side, &mut centre);
            }
            for k in 0..3 {
                self.side[first + k] += side[k].iter().sum::<f64>();
                self.centre[first + k] -= centre[k].iter().sum::<f64>();
            }
        }
        sums.after()
    }

    /// The steps of rooms and prices, and how far they may be gone.
    fn strides(&mut self, program: &mut Program, unknowns: &[f64], centring: f64) -> (f64, f64) {
        let (mut room, mut dear) = ([0.0_f64; LANES], [0.0_f64; LANES]);
        for (index, &y) in unknowns.iter().enumerate() {
            let (price, step) = (self.price[index], self.step[index]);
            let wanted = (centring - self.cross[index]) / y;
            let price_step = wanted - price - price / y * step;
            self.price_step[index] = price_step;
            room[0] = room[0].max(-step / y);
            dear[0] = dear[0].max(-price_step / price);
        }
        for block in &program.blocks {
            let first = block.first;
            let step = [self.step[first], self.step[first + 1], self.step[first + 2]];
            let y = [unknowns[first], unknowns[first + 1], unknowns[first + 2]];
            for term in &program.terms[block.terms.0..block.terms.1] {
                let change = term.change(step) / term.square(y).max(1e-300);
                room[0] = max(room[0], -change * STRIDE / MOST_FALL);
            }
            for group in &mut program.groups[block.groups.0..block.groups.1] {
                for lane in 0..LANES {
                    let used = group.weights[0][lane] * step[0]
                        + group.weights[1][lane] * step[1]
                        + group.weights[2][lane] * step[2];
                    let room_step = group.off[lane] - used;
                    let inverse = 1.0 / group.room[lane];
                    let wanted = (centring - group.cross[lane]) * inverse;
                    let price_step = wanted - group.price[lane] - group.ratio[lane] * room_step;
                    group.room_step[lane] = room_step;
                    group.price_step[lane] = price_step;
                    room[lane] = max(room[lane], -room_step * inverse);
                    dear[lane] = max(dear[lane], -price_step / group.price[lane]);
                }
            }
        }
        let stride = |most: Lanes| {
            let most = most.iter().fold(0.0_f64, |most, lane| most.max(*lane));
            (STRIDE / most.max(1e-300)).min(1.0)
        };
        (stride(room), stride(dear))
    }
}

#[cfg(test)]
mod tests {
    use super::{Outcome, Program, Solver};
    use crate::law::program::Term;

    fn program() -> Program {
        let mut program = Program::default();
        program.begin(3);
        program.block(0);
        for (place, length) in [1.0, 2.0, 1.0].into_iter().enumerate() {
            let mut weights = [0.0; 3];
            weights[place] = 1.0;
            program.term(Term { weights, fixed: 0.0, length });
        }
        program
    }

    #[test]
    fn a_small_programme_is_solved_at_its_best() {
        let mut program = program();
        program.row([1.0, 1.0, 0.0], 4.0);
        program.row([0.0, 1.0, 1.0], 3.0);
        let mut unknowns = vec![0.3; 3];
        let outcome = Solver::default().solve(&mut program, &mut unknowns, 0.1, 1e-8);
        assert_eq!(outcome, Outcome::Solved);
        let time = |y: f64| {
            let at = |length: f64, square: f64| length / square.sqrt();
            at(1.0, 4.0 - y) + at(2.0, y) + at(1.0, 3.0 - y)
        };
        let y = unknowns[1];
        assert!((unknowns[0] + y - 4.0).abs() < 1e-4, "{unknowns:?}");
        assert!(time(y) < time(y + 0.01) && time(y) < time(y - 0.01), "{unknowns:?}");
    }

    #[test]
    fn rows_that_exclude_each_other_fail_soon() {
        for excess in [1e-3, 0.1, 1.0, 1e3] {
            let mut program = program();
            program.row([1.0, 1.0, 1.0], 1.0);
            program.row([-1.0, 0.0, 0.0], -1.0 - excess);
            let mut unknowns = vec![0.3; 3];
            let mut solver = Solver::default();
            let outcome = solver.solve(&mut program, &mut unknowns, 0.1, 1e-8);
            assert_eq!(outcome, Outcome::Failed, "{excess}");
            assert!(solver.steps <= 20, "{excess}: {} steps", solver.steps);
        }
    }

    /// Rows that leave a sliver, or all but leave one, are not given up.
    #[test]
    fn rows_that_barely_hold_are_met() {
        for room in [1e-9, 1e-6, 1e-3] {
            let mut program = program();
            program.row([1.0, 1.0, 1.0], 1.0);
            program.row([0.0, -1.0, 0.0], -0.5);
            program.row([-1.0, 0.0, -1.0], -0.5 + room);
            let mut unknowns = vec![0.3; 3];
            let outcome = Solver::default().solve(&mut program, &mut unknowns, 0.1, 1e-8);
            assert_ne!(outcome, Outcome::Failed, "{room}");
        }
    }
}
