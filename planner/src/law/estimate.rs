//! An upper estimate of the speed along a stretch, from the limits of the second order.
//!
//! Stages along the stretch; between two the acceleration ü is constant. A pass backwards finds
//! the largest u̇² from which the end can be met, a pass forwards what can be reached from the
//! start. Stages are put closer together until an interval takes no more than a cell's time.

use super::{
    end_speed::EndSpeed,
    row::{Limits, Row, Side, site},
};

/// How much the estimate is raised above what was found, as it is found on a grid.
pub(super) const MARGIN: f64 = 1.02;
/// The first grid: the pieces of a whole stretch.
const PIECES: usize = 24;
/// How often the grid is made finer.
const PASSES: usize = 9;
/// The most stages.
const MOST_STAGES: usize = 40_000;
/// The least number of cells in which a stretch is run through.
const LEAST_CELLS: f64 = 60.0;
/// The most cells that are made for their time alone.
const MOST_CELLS: f64 = 20_000.0;
/// The least u̇² [m²/s²].
const LEAST_SQUARE: f64 = 1e-18;

/// A place at which the limits were looked at.
#[derive(Debug, Clone, Copy)]
struct Stage {
    /// From the start of the stretch [m].
    place: f64,
    /// The largest u̇² of the speed limits [m²/s²].
    top: f64,
    /// Its rows, start and end.
    rows: (u32, u32),
    /// The largest u̇² found [m²/s²].
    square: f64,
}

/// The estimate of one stretch; its buffers are used again for the next.
#[derive(Debug, Default)]
pub(super) struct Estimate {
    stages: Vec<Stage>,
    finer: Vec<Stage>,
    /// (weight of ü, weight of u̇², top).
    rows: Vec<[f64; 3]>,
    looked: Vec<Row>,
    /// The time from the start to each stage [s].
    times: Vec<f64>,
    ends: [EndSpeed; 2],
    length: f64,
    /// The time of a cell [s].
    pub(super) cell_time: f64,
}

impl Estimate {
    /// Makes the estimate of the stretch from `from` over `length` [m] with the given `ends`;
    /// `borders` are those inside the stretch, from its start.
    pub(super) fn make(
        &mut self,
        limits: &mut impl Limits,
        from: f64,
        length: f64,
        borders: &[f64],
        ends: [EndSpeed; 2],
        cell_time: f64,
    ) {
        self.stages.clear();
        self.rows.clear();
        self.ends = ends;
        self.length = length;
        self.first_stages(limits, from, borders);
        for _ in 0..PASSES {
            self.sweep();
            self.clock();
            let total = self.times.last().copied().unwrap_or(0.0);
            self.cell_time = cell_time.min(total / LEAST_CELLS).max(total / MOST_CELLS);
            if !self.refine(limits, from) {
                return;
            }
        }
        self.sweep();
        self.clock();
    }

    /// Stages at the borders and at least one between.
    fn first_stages(&mut self, limits: &mut impl Limits, from: f64, borders: &[f64]) {
        let length = self.length;
        let mut low = 0.0;
        let first = self.look(limits, from, 0.0, &[Side::After]);
        self.stages.push(first);
        for &high in borders.iter().chain([&length]) {
            let pieces = 2.0 * (0.5 + (high - low) / length * PIECES as f64 / 2.0).round().max(1.0);
            for piece in 1..pieces as usize {
                let place = low + (high - low) * piece as f64 / pieces;
                let stage = self.look(limits, from, place, &[Side::At]);
                self.stages.push(stage);
            }
            let sides: &[Side] =
                if high < length { &[Side::Before, Side::After] } else { &[Side::Before] };
            let stage = self.look(limits, from, high, sides);
            self.stages.push(stage);
            low = high;
        }
    }

    /// The stage at `place`.
    fn look(&mut self, limits: &mut impl Limits, from: f64, place: f64, sides: &[Side]) -> Stage {
        let start = self.rows.len() as u32;
        let mut speed = f64::INFINITY;
        for side in sides {
            self.looked.clear();
            let site = site(limits, from + place, *side, &mut self.looked);
            speed = speed.min(site.speed);
            let rows = self.looked.iter().filter(|row| row.second_order());
            self.rows.extend(rows.map(|row| [row.base[1], row.base[2], row.top.max(1e-9)]));
        }
        Stage { place, top: speed * speed, rows: (start, self.rows.len() as u32), square: 0.0 }
    }

    /// The largest u̇² at every stage.
    fn sweep(&mut self) {
        let last = self.stages.len() - 1;
        self.stages[last].square = self.ends[1].speed * self.ends[1].speed;
        for index in (0..last).rev() {
            let next = self.stages[index + 1];
            let stage = self.stages[index];
            let length = next.place - stage.place;
            let rows = &self.rows[stage.rows.0 as usize..stage.rows.1 as usize];
            self.stages[index].square = largest(rows, stage.top, length, next.square);
        }
        let mut square = self.ends[0].speed * self.ends[0].speed;
        self.stages[0].square = square;
        for index in 0..last {
            let stage = self.stages[index];
            let next = self.stages[index + 1];
            let rows = &self.rows[stage.rows.0 as usize..stage.rows.1 as usize];
            let gain = 2.0 * (next.place - stage.place) * accelerations(rows, square).1;
            square = (square + gain).min(next.square).max(0.0);
            if index + 1 < last {
                square = square.max(LEAST_SQUARE);
                self.stages[index + 1].square = square;
            }
        }
    }

    /// The time from the start to each stage.
    fn clock(&mut self) {
        self.times.clear();
        self.times.push(0.0);
        let mut time = 0.0;
        let mut before = self.ends[0].speed;
        for index in 1..self.stages.len() {
            let [low, high] = [self.stages[index - 1], self.stages[index]];
            let speed = self.bounded(high.place, high.square);
            time += 2.0 * (high.place - low.place) / (before + speed).max(1e-9);
            self.times.push(time);
            before = speed;
        }
    }

    /// Puts stages into intervals that take too long; says whether there were any.
    fn refine(&mut self, limits: &mut impl Limits, from: f64) -> bool {
        let mut finer = core::mem::take(&mut self.finer);
        finer.clear();
        let last = self.stages.len() - 1;
        let room = MOST_STAGES.saturating_sub(self.stages.len());
        let mut added = 0;
        for index in 0..last {
            let (low, high) = (self.stages[index], self.stages[index + 1]);
            finer.push(low);
            let time = self.times[index + 1] - self.times[index];
            let pieces = ((time / self.cell_time).ceil() as usize).clamp(1, 6);
            if time <= 1.2 * self.cell_time || added + pieces > room {
                continue;
            }
            added += pieces;
            for piece in 1..pieces {
                let mut part = piece as f64 / pieces as f64;
                if index == 0 && self.ends[0].speed == 0.0 {
                    part = part * part * part;
                } else if index + 1 == last && self.ends[1].speed == 0.0 {
                    part = 1.0 - (1.0 - part) * (1.0 - part) * (1.0 - part);
                }
                let place = low.place + part * (high.place - low.place);
                if place > low.place && place < high.place {
                    finer.push(self.look(limits, from, place, &[Side::At]));
                }
            }
        }
        finer.push(self.stages[last]);
        self.finer = core::mem::replace(&mut self.stages, finer);
        added > 0
    }

    /// The speed of `square` at `place` within what the ends allow [m/s].
    fn bounded(&self, place: f64, square: f64) -> f64 {
        let near = self.ends[0].at(place).min(self.ends[1].at(self.length - place));
        square.max(0.0).sqrt().min(near)
    }

    /// An upper estimate of the speed at `place` from the start [m/s].
    pub(super) fn speed(&self, place: f64) -> f64 {
        let above = self.stages.partition_point(|stage| stage.place <= place);
        let high = above.clamp(1, self.stages.len() - 1);
        let (low, high) = (self.stages[high - 1], self.stages[high]);
        let part = ((place - low.place) / (high.place - low.place)).clamp(0.0, 1.0);
        let square = low.square + part * (high.square - low.square);
        MARGIN * self.bounded(place, square.max(LEAST_SQUARE))
    }

    /// The place reached at a time after the start [s], [m].
    pub(super) fn place(&self, time: f64) -> f64 {
        let above = self.times.partition_point(|reached| *reached <= time);
        let high = above.clamp(1, self.times.len() - 1);
        let (low, step) = (high - 1, self.times[high] - self.times[high - 1]);
        let part = ((time - self.times[low]) / step.max(1e-300)).clamp(0.0, 1.0);
        self.stages[low].place + part * (self.stages[high].place - self.stages[low].place)
    }

    /// The time at which a place is reached, after the start [s].
    pub(super) fn time(&self, place: f64) -> f64 {
        let above = self.stages.partition_point(|stage| stage.place <= place);
        let high = above.clamp(1, self.times.len() - 1);
        let (low, above) = (self.stages[high - 1].place, self.stages[high].place);
        let part = ((place - low) / (above - low)).clamp(0.0, 1.0);
        self.times[high - 1] + part * (self.times[high] - self.times[high - 1])
    }

    /// How much of the square of the speed at an end can be met at most: 1 and above is all.
    pub(super) fn met(&self) -> [f64; 2] {
        let last = self.stages.len() - 1;
        let mut met = [f64::INFINITY; 2];
        let first = self.stages[0];
        if self.ends[0].speed > 0.0 {
            let next = self.stages[1];
            let rows = &self.rows[first.rows.0 as usize..first.rows.1 as usize];
            let most = largest(rows, first.top, next.place - first.place, next.square);
            met[0] = most / first.square;
        }
        if self.ends[1].speed > 0.0 {
            let (before, end) = (self.stages[last - 1], self.stages[last]);
            let rows = &self.rows[before.rows.0 as usize..before.rows.1 as usize];
            let gain = 2.0 * (end.place - before.place) * accelerations(rows, before.square).1;
            met[1] = (before.square + gain).min(end.top) / end.square;
        }
        met
    }
}

/// The least and the largest ü the rows allow at `square` [m/s²].
fn accelerations(rows: &[[f64; 3]], square: f64) -> (f64, f64) {
    let (mut least, mut most) = (-1e12_f64, 1e12_f64);
    for [linear, constant, top] in rows {
        let room = top - constant * square;
        if *linear > 0.0 {
            most = most.min(room / linear);
        } else if *linear < 0.0 {
            least = least.max(room / linear);
        }
    }
    (least, most)
}

/// The largest u̇² up to `top` from which, within the rows, u̇² is at most `next` after `length`.
fn largest(rows: &[[f64; 3]], top: f64, length: f64, next: f64) -> f64 {
    let mut square = top;
    let ahead = [2.0 * length, 1.0, next];
    for _ in 0..20 {
        // The rows that leave the least room for ü from above and from below.
        let (mut above, mut below) = (ahead, None);
        let mut most = (ahead[2] - square) / ahead[0];
        let mut least = -1e12_f64;
        let mut cut = square;
        for row in rows {
            let room = row[2] - row[1] * square;
            if row[0] > 0.0 && room / row[0] < most {
                (most, above) = (room / row[0], *row);
            } else if row[0] < 0.0 && room / row[0] > least {
                (least, below) = (room / row[0], Some(*row));
            } else if row[0] == 0.0 && room < 0.0 {
                cut = cut.min(row[2] / row[1]);
            }
        }
        if let Some(below) = below.filter(|_| least > most) {
            // Where the two meet: (t − c·b)/l is the same of both.
            let slope = above[1] / above[0] - below[1] / below[0];
            let meet = (above[2] / above[0] - below[2] / below[0]) / slope;
            if meet.is_finite() && meet < square {
                cut = cut.min(meet);
            }
        }
        if cut >= square {
            break;
        }
        square = cut.max(0.0);
    }
    square
}
