//! From sites and speed bounds to a linear programme.

use core::ops::Range;

use messages::math::cbrt;

use super::{
    ends::{Tie, Ties},
    program::{Program, Term},
    row::{Row, Site, dot},
    spline::Spline,
};

/// The places in a cell at which its limits are held.
pub(super) const PARTS: [f64; 3] = [0.0, 0.5, 1.0];
/// What these places weigh in an integral over the cell.
const SHARES: [f64; 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];

/// The cells near an end in motion, and how much of the limits may be used there: an end may be
/// at a limit, and the programme needs a little room.
const NEAR: usize = 4;
const ROOM: f64 = 1.002;
/// The same for the square of the speed, which is asked for and must be met closely.
const SPEED_ROOM: f64 = 1.000_02;

/// A place at which the limits are held.
#[derive(Debug, Clone)]
pub(super) struct Held {
    /// The largest u̇ [m/s].
    pub(super) speed: f64,
    pub(super) speed_limit: u16,
    /// The rows in the pool.
    pub(super) rows: Range<usize>,
    /// The bound of the speed known before any programme [m/s].
    pub(super) estimate: f64,
    /// The bound of the speed of this programme, which rows of mixed orders need [m/s].
    pub(super) bound: f64,
    /// The speed about which limits of the third order are exact in this programme [m/s].
    pub(super) about: f64,
}

/// A launch cell.
#[derive(Debug, Clone)]
pub(super) struct Launch {
    /// Its limits at the inner border.
    pub(super) site: Site,
    /// The third derivative of u [m/s³] at most, and which limit this is.
    pub(super) jerk: (f64, u16),
    /// How much of its limits may be used.
    pub(super) part: f64,
}

impl Launch {
    /// (ü′, ü, u̇²) at the inner border for each unit of u̇²; `sign` is 1 at the start of the
    /// stretch and −1 at its end.
    pub(super) fn shape(length: f64, sign: f64) -> [f64; 3] {
        [1.0 / (4.5 * length * length), sign * 2.0 / (3.0 * length), 1.0]
    }

    /// The largest u̇² at the inner border [m²/s²] within the limits there, of which the rows in
    /// `pool` are some.
    pub(super) fn square(&self, length: f64, sign: f64, pool: &[Row]) -> f64 {
        let root = square(self.part * self.jerk.0, length).sqrt();
        let most = root.min(self.site.speed * self.part);
        let rows = &pool[self.site.rows.clone()];
        let shape = Self::shape(length, sign);
        let within = |speed: f64| {
            let state = shape.map(|order| order * speed * speed);
            rows.iter().all(|row| row.used(state, speed) <= self.part)
        };
        if within(most) {
            return most * most;
        }
        let (mut low, mut high) = (0.0, most);
        for _ in 0..60 {
            let middle = if low > 0.0 { (low + high) / 2.0 } else { high / 16.0 };
            if within(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low.max(1e-12) * low.max(1e-12)
    }
}

/// u̇² after a launch of constant `jerk` [m/s³] over `length` [m], [m²/s²].
pub(super) fn square(jerk: f64, length: f64) -> f64 {
    let root = cbrt(4.5 * jerk * length * length);
    root * root
}

/// Less room for one limit near a cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tightening {
    pub(super) cell: usize,
    pub(super) limit: u16,
    /// The part of the limit left, below 1.
    pub(super) part: f64,
}

/// All a programme is made from.
#[derive(Debug, Clone, Default)]
pub(super) struct Problem {
    pub(super) spline: Spline,
    /// Three for each cell.
    pub(super) held: Vec<Held>,
    pub(super) rows: Vec<Row>,
    pub(super) launches: [Option<Launch>; 2],
    /// Whether a row of the pool is in the programme: most are far from what they allow.
    pub(super) is_held: Vec<bool>,
    pub(super) tightenings: Vec<Tightening>,
    /// How much the limits of the third order are loosened; 1 is not at all.
    pub(super) loosened: f64,
}

impl Problem {
    /// Makes the programme for the speed bounds as they are.
    pub(super) fn build(&self, ties: &Ties, ends: [Tie; 2], program: &mut Program) {
        program.begin(ties.count);
        let cells = self.spline.cells();
        for cell in 0..cells {
            let first = ties.unknowns[cell].min(ties.count - 3);
            program.block(first);
            for (part, site) in PARTS.iter().enumerate() {
                let room = self.room(ends, cell);
                self.hold(ties, cell, [*site, SHARES[part], room], part, first, program);
            }
            for (end, at) in [(0, 0), (1, cells - 1)] {
                if at == cell {
                    self.launch(ties, ends, end, first, program);
                }
            }
        }
    }

    /// Adds the rows of one place of a cell and its part of the gain.
    fn hold(
        &self,
        ties: &Ties,
        cell: usize,
        [part, share, room]: [f64; 3],
        which: usize,
        first: usize,
        program: &mut Program,
    ) {
        let held = &self.held[3 * cell + which];
        let weights = self.spline.weights(cell, part);
        let mut local = Local::new(ties, cell, first, weights);
        let mut top = held.speed;
        for index in held.rows.clone() {
            let row = &self.rows[index];
            if row.mixed() {
                top = top.min(held.bound);
            }
            if self.is_held[index] {
                let part = room * self.part(cell, row.limit);
                for (weights, top) in self.lines(held, row, part).into_iter().flatten() {
                    local.add(weights, top, program);
                }
            }
        }
        let square = top * top * room.min(SPEED_ROOM) * self.part(cell, held.speed_limit);
        local.add([0.0, 0.0, 1.0], square, program);
        program.term(local.term(share * self.spline.length(cell)));
    }

    /// What a row of `held` is in the programme, `part` of it being there to be used: one or two rows of
    /// weights of (ü′, ü, u̇²), and their tops.
    fn lines(&self, held: &Held, row: &Row, part: f64) -> [Option<([f64; 3], f64)>; 2] {
        if row.third_order() {
            [Some(row.about(held.about, self.loosened * part)), None]
        } else if row.mixed() {
            let (weights, top) = row.at(held.bound.min(held.speed));
            let slow = (row.base, part * row.at(0.0).1);
            [Some((weights, self.loosened * part * top)), Some(slow)]
        } else {
            [Some((row.base, part * row.top)), None]
        }
    }

    /// Holds all rows.
    pub(super) fn hold_all(&mut self) {
        self.is_held.clear();
        self.is_held.resize(self.rows.len(), true);
    }

    /// Holds the rows that a law about the estimate may come near, and leaves out the others.
    pub(super) fn hold_likely(&mut self) {
        /// The part of a limit from which on it is held.
        const NEAR: f64 = 0.85;
        self.is_held.clear();
        self.is_held.resize(self.rows.len(), false);
        for held in &self.held {
            let rows = &self.rows[held.rows.clone()];
            let speed = held.about;
            let square = speed * speed;
            let most = |of: fn(&Row) -> f64| {
                let rows = rows.iter().filter(|row| of(row) != 0.0);
                rows.map(|row| row.top / of(row).abs()).fold(f64::INFINITY, f64::min)
            };
            let acceleration = most(|row| row.base[1]);
            let third = most(|row| row.by_speed[0]);
            for (index, row) in held.rows.clone().zip(rows) {
                let used = row.base[1].abs() * acceleration
                    + (row.base[2] * square).max(0.0)
                    + row.by_speed[0].abs() * third
                    + speed * (row.by_speed[2] * square).max(0.0);
                self.is_held[index] = used > NEAR * (row.top + row.top_by_speed * speed);
            }
        }
    }

    /// Holds the rows of which the law of `coefficients` uses more than a part, and leaves out the others.
    pub(super) fn hold_near(&mut self, coefficients: &[f64]) {
        /// The part of a limit from which on it is held.
        const NEAR: f64 = 0.6;
        for cell in 0..self.spline.cells() {
            for (which, part) in PARTS.iter().enumerate() {
                let state = self.spline.state(coefficients, cell, *part);
                let speed = state[2].max(0.0).sqrt();
                for index in self.held[3 * cell + which].rows.clone() {
                    self.is_held[index] = self.rows[index].used(state, speed) > NEAR;
                }
            }
        }
    }

    /// Holds the rows that were left out and are broken by the law of `coefficients`. Says whether there
    /// are any.
    pub(super) fn hold_broken(&mut self, ends: [Tie; 2], coefficients: &[f64]) -> bool {
        /// A row may be broken by this part of its top.
        const BROKEN: f64 = 1e-5;
        let mut any = false;
        for cell in 0..self.spline.cells() {
            let room = self.room(ends, cell);
            for (which, part) in PARTS.iter().enumerate() {
                let state = self.spline.state(coefficients, cell, *part);
                let held = &self.held[3 * cell + which];
                for index in held.rows.clone() {
                    if self.is_held[index] {
                        continue;
                    }
                    let row = &self.rows[index];
                    let part = room * self.part(cell, row.limit);
                    let lines = self.lines(held, row, part).into_iter().flatten();
                    let is_broken = |(weights, top): ([f64; 3], f64)| {
                        dot(weights, state) > top * (1.0 + BROKEN)
                    };
                    if lines.into_iter().any(is_broken) {
                        self.is_held[index] = true;
                        any = true;
                    }
                }
            }
        }
        any
    }

    /// Adds the rows of a launch.
    fn launch(&self, ties: &Ties, ends: [Tie; 2], end: usize, first: usize, program: &mut Program) {
        let (Some(launch), Tie::Launch(length)) = (&self.launches[end], ends[end]) else {
            return;
        };
        let coefficient = if end == 0 { 0 } else { self.spline.coefficients() - 1 };
        let unknown = ties.unknowns[coefficient];
        let factor = ties.factors[coefficient];
        let sign = if end == 0 { 1.0 } else { -1.0 };
        let mut weights = [0.0; 3];
        weights[unknown - first] = factor;
        program.row(weights, launch.square(length, sign, &self.rows));
        program.term(Term { weights, fixed: 0.0, length: 3.0 * length });
    }

    /// How much of all limits may be used at a cell for its nearness to an end in motion.
    fn room(&self, ends: [Tie; 2], cell: usize) -> f64 {
        let near = [cell, self.spline.cells() - 1 - cell];
        let close = |(tie, cells): (Tie, usize)| matches!(tie, Tie::Fixed(..)) && cells < NEAR;
        if ends.into_iter().zip(near).any(close) { ROOM } else { 1.0 }
    }

    /// How much of a limit may be used at a cell.
    fn part(&self, cell: usize, limit: u16) -> f64 {
        let near = |tight: &&Tightening| tight.limit == limit && tight.cell.abs_diff(cell) <= 1;
        let parts = self.tightenings.iter().filter(near).map(|tight| tight.part);
        parts.fold(1.0, f64::min)
    }
}

/// The weights of (ü′, ü, u̇²) at a place in the three unknowns of its cell.
struct Local {
    /// For each order.
    weights: [[f64; 3]; 3],
    fixed: [f64; 3],
}

impl Local {
    fn new(ties: &Ties, cell: usize, first: usize, of_coefficients: [[f64; 3]; 3]) -> Self {
        let (mut weights, mut fixed) = ([[0.0; 3]; 3], [0.0; 3]);
        for place in 0..3 {
            let index = cell + place;
            let unknown = ties.unknowns[index] - first;
            for (order, of_order) in of_coefficients.iter().enumerate() {
                let weight = of_order[place];
                weights[order][unknown.min(2)] += weight * ties.factors[index];
                fixed[order] += weight * ties.fixed[index];
            }
        }
        Self { weights, fixed }
    }

    /// Adds `row · (ü′, ü, u̇²) ≤ top`.
    fn add(&mut self, row: [f64; 3], top: f64, program: &mut Program) {
        let column =
            |k: usize| dot(row, [self.weights[0][k], self.weights[1][k], self.weights[2][k]]);
        program.row([column(0), column(1), column(2)], top - dot(row, self.fixed));
    }

    /// The time of a `length` [m] at the speed of the place.
    fn term(&self, length: f64) -> Term {
        Term { weights: self.weights[2], fixed: self.fixed[2], length }
    }
}
