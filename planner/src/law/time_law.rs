//! The time law of a path: where along it is when.

use core::ops::Range;

use super::{
    cell::{Along, Cell, Motion},
    spline::Spline,
};
use crate::search::partition_near;

/// What binds a part of a law.
#[derive(Debug, Clone, PartialEq)]
pub struct Binding {
    /// Where along the path [m].
    pub places: Range<f64>,
    /// How long the part takes [s].
    pub duration: f64,
    /// Which limit is the nearest, as the caller named it.
    pub limit: u16,
}

/// Where along a path it is at which time. The place never goes back.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TimeLaw {
    cells: Vec<Cell>,
}

/// A cell in which √ü′ times the time is larger is cut in two: its series would lose digits.
const LONGEST_SERIES: f64 = 1.5;
/// How often a cell is cut in two.
const MOST_CUTS: usize = 40;

impl TimeLaw {
    /// A law of constant speed [m/s] between two places [m], bound by `limit`.
    pub fn even(from: f64, to: f64, speed: f64, limit: u16) -> Self {
        let mut law = Self::default();
        if to > from && speed > 0.0 {
            let motion = Motion::Jerk(0.0);
            law.add(from, to - from, [speed, 0.0], motion, (to - from) / speed, limit);
        }
        law
    }

    /// A law that begins at `from` [m] with a speed [m/s] and an acceleration [m/s²] and goes
    /// through phases of constant jerk: jerk [m/s³], duration [s] and the limit that binds. The
    /// speed must stay 0 or more.
    pub fn phases(
        from: f64,
        speed: f64,
        acceleration: f64,
        phases: impl IntoIterator<Item = (f64, f64, u16)>,
    ) -> Self {
        let mut law = Self::default();
        let mut state = [speed, acceleration];
        let mut place = from;
        for (jerk, duration, limit) in phases {
            if duration > 0.0 {
                law.add(place, 0.0, state, Motion::Jerk(jerk), duration, limit);
                let last = law.cells.len() - 1;
                let end = law.cells[last].at(duration);
                law.cells[last].length = end.position.max(0.0);
                place += end.position;
                // Rounding leaves a little speed where the phases end at rest.
                let small = 1e-13 * (speed.abs() + jerk.abs() * duration * duration);
                let rest = if end.velocity.abs() <= small { 0.0 } else { end.velocity };
                state = [rest, end.acceleration];
            }
        }
        law
    }

    /// How long the law takes [s].
    pub fn duration(&self) -> f64 {
        self.cells.last().map_or(0.0, |cell| cell.time + cell.duration)
    }

    /// Whether it is at `speed` all along [m/s].
    pub(crate) fn is_even_at(&self, speed: f64) -> bool {
        let is_even = |cell: &Cell| {
            cell.motion == Motion::Jerk(0.0) && cell.speed == speed && cell.acceleration == 0.0
        };
        self.cells.iter().all(is_even)
    }

    /// Whether the law goes nowhere.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// The places from where to where the law goes [m].
    pub fn places(&self) -> Range<f64> {
        match (self.cells.first(), self.cells.last()) {
            (Some(first), Some(last)) => first.place..last.place + last.length,
            _ => 0.0..0.0,
        }
    }

    /// Where along the path it is at `time` [s] after the start; before the start and after the
    /// end the law stands at its ends.
    pub fn at(&self, time: f64) -> Along {
        self.at_near(time, &mut 0)
    }

    /// The same, with the number of the cell looked for from `near` on.
    #[inline]
    pub(crate) fn at_near(&self, time: f64, near: &mut usize) -> Along {
        let above = partition_near(&self.cells, near, |cell| cell.time <= time);
        let Some(cell) = self.cells.get(above.saturating_sub(1)) else {
            return Along::default();
        };
        let inside = (time - cell.time).clamp(0.0, cell.duration);
        let along = cell.at(inside);
        let position = cell.place + along.position.clamp(0.0, cell.length);
        Along { position, velocity: along.velocity.max(0.0), ..along }
    }

    /// When `place` [m] is reached [s]; the inverse of [`Self::at`].
    pub fn time_at(&self, place: f64) -> f64 {
        let above = self.cells.partition_point(|cell| cell.place <= place);
        let Some(cell) = self.cells.get(above.saturating_sub(1)) else {
            return 0.0;
        };
        let distance = place - cell.place;
        if distance >= cell.length {
            return cell.time + cell.duration;
        }
        cell.time + cell.time_at(distance, cell.duration)
    }

    /// The speed at `place` [m/s], looked for near the cell `near`.
    pub(super) fn speed_at(&self, place: f64, near: &mut usize) -> f64 {
        let above = partition_near(&self.cells, near, |cell| cell.place <= place);
        let Some(cell) = self.cells.get(above.saturating_sub(1)) else { return 0.0 };
        let distance = (place - cell.place).clamp(0.0, cell.length);
        match cell.motion {
            Motion::Slope(slope) => {
                let change = distance * (2.0 * cell.acceleration + slope * distance);
                (cell.speed * cell.speed + change).max(0.0).sqrt()
            }
            Motion::Jerk(_) => cell.at(cell.time_at(distance, cell.duration)).velocity,
        }
    }

    /// Which limit is the nearest, part by part.
    pub fn binding(&self) -> impl Iterator<Item = Binding> + '_ {
        self.cells.iter().map(|cell| Binding {
            places: cell.place..cell.place + cell.length,
            duration: cell.duration,
            limit: cell.limit,
        })
    }

    /// Appends a law that goes on where this one ends.
    pub fn append(&mut self, next: &Self) {
        let time = self.duration();
        self.cells.extend(next.cells.iter().map(|cell| Cell { time: time + cell.time, ..*cell }));
    }

    /// The part of the law up to the last border of its cells that is not behind `place` [m].
    pub fn up_to(&self, place: f64) -> Self {
        let end = |cell: &Cell| cell.place + cell.length;
        let count = self.cells.partition_point(|cell| end(cell) <= place);
        Self { cells: self.cells[..count].to_vec() }
    }

    /// The law up to the last border of its cells that is not behind `place` [m], and the rest of it
    /// from there on, each with its own time from 0.
    pub fn split(&self, place: f64) -> (Self, Self) {
        let first = self.up_to(place);
        let time = first.duration();
        let rest = self.cells[first.cells.len()..].iter();
        let rest = rest.map(|cell| Cell { time: cell.time - time, ..*cell }).collect();
        (first, Self { cells: rest })
    }

    /// The same law along a path that begins `distance` later [m].
    pub fn moved_back(&self, distance: f64) -> Self {
        let moved = |cell: &Cell| Cell { place: cell.place - distance, ..*cell };
        Self { cells: self.cells.iter().map(moved).collect() }
    }

    /// Adds a launch from rest at `place` over `length` [m] to the speed of `square` [m²/s²].
    pub(super) fn launch(&mut self, place: f64, length: f64, square: f64, limit: u16) {
        let speed = square.sqrt();
        let jerk = square * speed / (4.5 * length * length);
        self.add(place, length, [0.0, 0.0], Motion::Jerk(jerk), 3.0 * length / speed, limit);
    }

    /// Adds the launch seen backwards: from the speed of `square` [m²/s²] to rest.
    pub(super) fn land(&mut self, place: f64, length: f64, square: f64, limit: u16) {
        let speed = square.sqrt();
        let jerk = square * speed / (4.5 * length * length);
        let state = [speed, -2.0 / 3.0 * square / length];
        self.add(place, length, state, Motion::Jerk(jerk), 3.0 * length / speed, limit);
    }

    /// Adds the cells of a spline of u̇² that begins at `from` [m]; `limits` are those that bind.
    pub(super) fn spline(
        &mut self,
        from: f64,
        spline: &Spline,
        coefficients: &[f64],
        limits: &[u16],
    ) {
        for (cell, limit) in (0..spline.cells()).zip(limits) {
            let length = spline.length(cell);
            let [slope, acceleration, square] = spline.state(coefficients, cell, 0.0);
            let place = from + spline.borders[cell];
            self.parabola(place, length, [acceleration, square], slope, *limit, MOST_CUTS);
        }
    }

    /// Adds a cell of constant ü′, in parts where its series would be long.
    fn parabola(
        &mut self,
        place: f64,
        length: f64,
        [acceleration, square]: [f64; 2],
        slope: f64,
        limit: u16,
        cuts: usize,
    ) {
        let half = length / 2.0;
        let middle = square + half * (2.0 * acceleration + slope * half);
        let end = square + length * (2.0 * acceleration + slope * length);
        // The time is at most what the least control value of the parabola would take.
        let least = square.min(end).min(square + acceleration * length);
        let about = length / least.max(1e-4 * square.max(end)).sqrt();
        if cuts > 0 && slope.abs().sqrt() * about > LONGEST_SERIES {
            self.parabola(place, half, [acceleration, square], slope, limit, cuts - 1);
            let there = [acceleration + slope * half, middle.max(0.0)];
            self.parabola(place + half, half, there, slope, limit, cuts - 1);
            return;
        }
        let speed = square.max(1e-24).sqrt();
        self.add(place, length, [speed, acceleration], Motion::Slope(slope), 0.0, limit);
        if let Some(cell) = self.cells.last_mut() {
            cell.duration = cell.time_at(length, 4.0 * length / least.max(1e-24).sqrt());
        }
    }

    /// Adds a cell.
    fn add(
        &mut self,
        place: f64,
        length: f64,
        [speed, acceleration]: [f64; 2],
        motion: Motion,
        duration: f64,
        limit: u16,
    ) {
        let time = self.duration();
        self.cells.push(Cell { time, duration, place, length, speed, acceleration, motion, limit });
    }
}
