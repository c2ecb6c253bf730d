//! Where the cells of a stretch begin and end.

use super::{end_speed::EndSpeed, estimate::Estimate};

/// The times of launch cells to try, in times of a cell; the last is always taken.
pub(super) const LAUNCHES: [f64; 3] = [8.0, 5.0, 3.0];
/// The least time of a launch cell, in times of a cell.
const LEAST_LAUNCH: f64 = 0.03;
/// The longest launch cell, in parts of the stretch.
const LONGEST_LAUNCH: f64 = 1.0 / 8.0;
/// A border nearer to another than this part of a cell's usual length is left out.
const SLIVER: f64 = 1e-3;
/// The first cell of a moving end, in parts of the way to a stop.
const BRAKING: f64 = 0.3;
/// A cell in which the speed changes by more than this factor is cut in two, this often, unless it
/// takes less than this part of a cell's time.
const STEEP: f64 = 1.3;
const CUTS: usize = 3;
const LEAST_CUT: f64 = 0.1;
/// The fewest cells a spline is worth.
const FEWEST: usize = 8;

/// The length of the launch cell at a rest [m]: from there the third derivative of u is constant
/// for `time` [s], but no longer than until ü comes to `most`, the largest from rest [m/s²]. `span` is the length of the
/// span at the end, which is left whole to the launch when not much remains of it.
pub(super) fn launch(
    end: &EndSpeed,
    most: f64,
    [time, cell_time]: [f64; 2],
    [span, length]: [f64; 2],
) -> f64 {
    let time = time.min((most / end.jerk).max(LEAST_LAUNCH * cell_time));
    let wanted = (end.jerk * time * time * time / 6.0).min(LONGEST_LAUNCH * length);
    if wanted > 0.8 * span { span.min(LONGEST_LAUNCH * length) } else { wanted }
}

/// The length of the first cell of a moving end [m], short enough for the speed not to come to
/// nothing on it.
pub(super) fn moving(end: &EndSpeed, usual: f64) -> f64 {
    if end.acceleration < 0.0 {
        usual.min(BRAKING * end.speed * end.speed / -end.acceleration)
    } else {
        usual
    }
}

/// Fills `cells` with the borders of the cells from `low` to `high` [m]: at all `borders`
/// between, and so close that each cell takes about a cell's time. `first` are the lengths the
/// first and the last cell must not exceed.
pub(super) fn choose(
    estimate: &Estimate,
    borders: &[f64],
    low: f64,
    high: f64,
    first: [f64; 2],
    cells: &mut Vec<f64>,
) {
    let usual = |place: f64| estimate.speed(place) * estimate.cell_time;
    cells.clear();
    cells.push(low);
    for &border in borders {
        let near = SLIVER * usual(border).min(high - low);
        let last = cells.last().copied().unwrap_or(low);
        if border > last + near && border < high - near {
            fill(estimate, border, cells);
        }
    }
    fill(estimate, high, cells);
    for _ in 0..CUTS {
        cut_slopes(estimate, cells);
    }
    shorten(cells, first);
    while cells.len() < FEWEST + 1 {
        halve(cells);
    }
}

/// Adds borders up to `high`, evenly in time.
fn fill(estimate: &Estimate, high: f64, cells: &mut Vec<f64>) {
    let low = cells.last().copied().unwrap_or(0.0);
    let (start, end) = (estimate.time(low), estimate.time(high));
    let count = ((end - start) / estimate.cell_time).round().max(1.0);
    for index in 1..count as usize {
        let place = estimate.place(start + (end - start) * index as f64 / count);
        let last = cells.last().copied().unwrap_or(low);
        let near = 1e-3 * (high - low) / count;
        if place > last + near && place < high - near {
            cells.push(place);
        }
    }
    cells.push(high);
}

/// Cuts the first and the last cell where they are too long.
fn shorten(cells: &mut Vec<f64>, first: [f64; 2]) {
    if first[0] < 0.7 * (cells[1] - cells[0]) {
        cells.insert(1, cells[0] + first[0]);
    }
    let last = cells.len() - 1;
    if first[1] < 0.7 * (cells[last] - cells[last - 1]) {
        cells.insert(last, cells[last] - first[1]);
    }
}

/// Cuts in two each cell in which the speed changes much: ü′ is constant in a cell, so that the third
/// derivative u̇·ü′ comes to its limit at one end of it only.
fn cut_slopes(estimate: &Estimate, cells: &mut Vec<f64>) {
    let before = core::mem::take(cells);
    for pair in before.windows(2) {
        let (low, high) = (pair[0], pair[1]);
        cells.push(low);
        let middle = (low + high) / 2.0;
        let speeds = [low, middle, high].map(|place| estimate.speed(place));
        let least = speeds.into_iter().fold(f64::INFINITY, f64::min);
        let most = speeds.into_iter().fold(0.0, f64::max);
        let time = (high - low) / most;
        if most > STEEP * least && time > LEAST_CUT * estimate.cell_time {
            cells.push(middle);
        }
    }
    cells.extend(before.last());
}

/// Cuts every cell in two.
fn halve(cells: &mut Vec<f64>) {
    for index in (1..cells.len()).rev() {
        let middle = (cells[index - 1] + cells[index]) / 2.0;
        cells.insert(index, middle);
    }
}
