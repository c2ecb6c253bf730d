//! A look at a law between the places at which its limits were held.

use super::{
    build::{Launch, PARTS, Problem, Tightening},
    ends::Tie,
    row::{Limits, Row, Side, site},
    spline::Spline,
};

/// The part of a limit that is left where it was found broken, beside what it was broken by.
const SAFETY: f64 = 0.999;

/// The parts of the time of a launch at which it is looked at.
pub(super) const LAUNCH_TIMES: [f64; 5] = [0.3, 0.5, 0.7, 0.85, 1.0];
/// At how many places at least the outer cells are looked at, in which the speed changes most.
const OUTER_CHECKS: usize = 12;
/// A law of few cells is looked at in at least this many places.
const FEWEST_CHECKS: usize = 200;

/// What a look at a law found.
#[derive(Debug, Clone, Default)]
pub(super) struct Look {
    /// Where limits are used beyond the whole.
    pub(super) broken: Vec<Tightening>,
    /// By launch: how much of a limit is used at most.
    pub(super) launches: [f64; 2],
    /// The largest part of a limit used anywhere.
    pub(super) most: f64,
    rows: Vec<Row>,
}

impl Look {
    /// Looks at `checks` places of each cell and of both launches; `from` is where the stretch
    /// begins [m] and `length` its length. Limits used by more than `most` are noted.
    pub(super) fn look(
        &mut self,
        limits: &mut impl Limits,
        [from, length]: [f64; 2],
        spline: &Spline,
        coefficients: &[f64],
        ends: [Tie; 2],
        (checks, most): (usize, f64),
    ) {
        self.broken.clear();
        self.most = 0.0;
        let checks = checks.max(FEWEST_CHECKS / spline.cells().max(1));
        for cell in 0..spline.cells() {
            let outer = cell < 2 || cell + 2 >= spline.cells();
            let checks = if outer { checks.max(OUTER_CHECKS) } else { checks };
            for check in 0..checks {
                let part = (check as f64 + 0.5) / checks as f64;
                let state = spline.state(coefficients, cell, part);
                let place = from + spline.place(cell, part);
                let (used, limit) = self.used(limits, place, state);
                if used > most {
                    self.note(cell, limit, used);
                }
            }
        }
        self.launches = [0.0; 2];
        for (end, tie) in ends.into_iter().enumerate() {
            let Tie::Launch(launch) = tie else { continue };
            let square = coefficients[if end == 0 { 0 } else { coefficients.len() - 1 }];
            for time in LAUNCH_TIMES {
                let distance = launch * time * time * time;
                let state = along(launch, square, time, end);
                let place = if end == 0 { distance } else { length - distance };
                let (used, _) = self.used(limits, from + place, state);
                self.launches[end] = self.launches[end].max(used);
            }
        }
    }

    /// The largest part of a limit used in a state, and which.
    fn used(&mut self, limits: &mut impl Limits, place: f64, state: [f64; 3]) -> (f64, u16) {
        self.rows.clear();
        let site = site(limits, place, Side::At, &mut self.rows);
        let found = nearest(&self.rows, site.speed, site.speed_limit, state);
        self.most = self.most.max(found.0);
        found
    }

    fn note(&mut self, cell: usize, limit: u16, used: f64) {
        let part = SAFETY / used;
        let same = |note: &&mut Tightening| note.cell == cell && note.limit == limit;
        match self.broken.iter_mut().find(same) {
            Some(note) => note.part = note.part.min(part),
            None => self.broken.push(Tightening { cell, limit, part }),
        }
    }
}

/// The state in a launch at a part of its time, seen forwards.
pub(super) fn along(length: f64, square: f64, time: f64, end: usize) -> [f64; 3] {
    let [slope, acceleration, unit] = Launch::shape(length, if end == 0 { 1.0 } else { -1.0 });
    let here = time * time;
    // The third derivative of u is constant: ü′ is it by the speed.
    [square * slope / here, square * acceleration * time, square * unit * here * here]
}

/// The largest part of a limit used, and which: the speed's by its square or one of the rows.
pub(super) fn nearest(rows: &[Row], top: f64, limit: u16, state: [f64; 3]) -> (f64, u16) {
    let speed = state[2].max(0.0).sqrt();
    let mut nearest = (state[2] / (top * top), limit);
    for row in rows {
        let used = row.used(state, speed);
        if used > nearest.0 {
            nearest = (used, row.limit);
        }
    }
    nearest
}

/// Which limit is the nearest in each cell.
pub(super) fn binding(problem: &Problem, coefficients: &[f64], limits: &mut Vec<u16>) {
    limits.clear();
    for cell in 0..problem.spline.cells() {
        let mut most = (f64::NEG_INFINITY, 0);
        for (which, part) in PARTS.iter().enumerate() {
            let held = &problem.held[3 * cell + which];
            let state = problem.spline.state(coefficients, cell, *part);
            let rows = &problem.rows[held.rows.clone()];
            let found = nearest(rows, held.speed, held.speed_limit, state);
            if found.0 > most.0 {
                most = found;
            }
        }
        limits.push(most.1);
    }
}
