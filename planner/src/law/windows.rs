//! The time law of a path or a move: in closed form where it is straight and every limit the same
//! all along, else by the programme of [`Planner`](super::Planner).

use super::profile::Move;
use super::row::{Limits, Row, Side, Site};
use super::time_law::TimeLaw;
use super::{End, Infeasible, Planner, Settings};

/// The times of cells [s], one after the other where a programme finds no answer with those before.
const CELL_TIMES: [f64; 4] = [3e-3, 2e-3, 4.5e-3, 1e-3];

/// How much of a limit a closed form may use at the ends of its phases.
const ROUNDING: f64 = 1.0 + 1e-9;

/// Weights below this share of the largest are nothing.
const NOTHING: f64 = 1e-9;

/// The law from rest at the start to rest at `length`.
pub(crate) fn time_law(limits: &mut impl Limits, length: f64) -> TimeLaw {
    if let Some(law) = straight(limits, length) {
        return law;
    }
    between(limits, 0.0, length, [End::Rest; 2], None).unwrap_or_default()
}

/// The law between two places, at rest or in motion. `way` is a law within the limits that begins as it
/// does, where one is known.
///
/// # Errors
/// Where an end in motion cannot be met.
pub(crate) fn between(
    limits: &mut impl Limits,
    from: f64,
    to: f64,
    ends: [End; 2],
    way: Option<&TimeLaw>,
) -> Result<TimeLaw, Infeasible> {
    let mut planner = Planner::along(way);
    let mut best: Option<TimeLaw> = None;
    for cell_time in CELL_TIMES {
        let settings = Settings { cell_time, ..Settings::default() };
        let law = planner.plan(limits, from, to, ends, &settings)?;
        if best.as_ref().is_none_or(|best| law.duration() < best.duration()) {
            best = Some(law);
        }
        if !planner.has_failed() {
            break;
        }
    }
    Ok(best.unwrap_or_default())
}

/// Seven phases where limits are the same everywhere and nothing bends.
pub(crate) fn straight(limits: &mut impl Limits, length: f64) -> Option<TimeLaw> {
    let mut borders = Vec::new();
    limits.borders(0.0, length, &mut borders);
    if borders.iter().any(|border| *border > 0.0 && *border < length) {
        return None;
    }
    let mut rows = Vec::new();
    let places = [(0.0, Side::After), (length / 2.0, Side::At), (length, Side::Before)];
    let sites = places.map(|(place, side)| limits.site(place, side, &mut rows));
    let [first, middle, last] = &sites;
    let rows_of = |site: &Site| rows[site.rows.clone()].to_vec();
    let here = rows_of(first);
    let alike = [middle, last].iter().all(|site| {
        // A free move may have no speed of its own to keep to: infinity less infinity is no number.
        let is_as_fast =
            site.speed == first.speed || (site.speed - first.speed).abs() <= NOTHING * first.speed;
        is_as_fast && alike(&here, &rows_of(site))
    });
    if !alike || !here.iter().all(is_straight) || first.speed <= 0.0 || first.speed.is_nan() {
        return None;
    }
    let acceleration = here.iter().map(most_acceleration).fold(f64::INFINITY, f64::min);
    let jerk = here.iter().map(most_jerk).fold(first.launch, f64::min);
    if !(acceleration.is_finite() && jerk.is_finite() && acceleration > 0.0 && jerk > 0.0) {
        return None;
    }
    let profile = Move::new(length, first.speed, acceleration, jerk);
    let fits = keeps(&profile, &here);
    fits.then(|| {
        law_of(
            &profile,
            first.speed_limit,
            nearest(&here, most_acceleration),
            nearest(&here, most_jerk),
        )
    })
}

fn alike(one: &[Row], other: &[Row]) -> bool {
    let near = |a: f64, b: f64, scale: f64| (a - b).abs() <= NOTHING * scale;
    one.len() == other.len()
        && one.iter().zip(other).all(|(one, other)| {
            let scale = one.base.iter().chain(&one.by_speed).fold(0.0_f64, |a, b| a.max(b.abs()));
            near(one.top, other.top, one.top.abs())
                && near(one.top_by_speed, other.top_by_speed, one.top_by_speed.abs())
                && one.base.iter().zip(&other.base).all(|(a, b)| near(*a, *b, scale))
                && one.by_speed.iter().zip(&other.by_speed).all(|(a, b)| near(*a, *b, scale))
        })
}

/// Whether the speed itself takes nothing of the row but for friction and back-EMF.
fn is_straight(row: &Row) -> bool {
    let scale = row.base[1].abs() + row.by_speed[0].abs();
    let bends = row.base[2].abs() + row.by_speed[1].abs() + row.by_speed[2].abs();
    bends <= NOTHING * scale
}

fn most_acceleration(row: &Row) -> f64 {
    if row.by_speed[0] == 0.0 && row.base[1] != 0.0 {
        row.top / row.base[1].abs()
    } else {
        f64::INFINITY
    }
}

fn most_jerk(row: &Row) -> f64 {
    let pure = row.base[1] == 0.0 && row.by_speed[0] != 0.0;
    if pure { row.top / row.by_speed[0].abs() } else { f64::INFINITY }
}

fn nearest(rows: &[Row], of: fn(&Row) -> f64) -> u16 {
    rows.iter().min_by(|one, other| of(one).total_cmp(&of(other))).map_or(0, |row| row.limit)
}

/// Whether the profile keeps the rows that mix orders, at the ends of its phases.
fn keeps(profile: &Move, rows: &[Row]) -> bool {
    let mixed =
        |row: &&Row| row.base[1] != 0.0 && (row.by_speed[0] != 0.0 || row.top_by_speed != 0.0);
    let rows: Vec<&Row> = rows.iter().filter(mixed).collect();
    if rows.is_empty() {
        return true;
    }
    let mut time = 0.0;
    for (duration, jerk) in profile.phases() {
        if duration <= 0.0 {
            continue;
        }
        for at in [time, time + duration / 2.0, time + duration] {
            let along = profile.at(at);
            let (speed, acceleration) = (along.velocity, along.acceleration);
            let fits = |row: &&&Row| {
                let used = row.base[1] * acceleration + row.by_speed[0] * jerk;
                used <= (row.top + row.top_by_speed * speed) * ROUNDING
            };
            if !rows.iter().all(|row| fits(&row)) {
                return false;
            }
        }
        time += duration;
    }
    true
}

fn law_of(profile: &Move, speed: u16, acceleration: u16, jerk: u16) -> TimeLaw {
    let limits = [jerk, acceleration, jerk, speed, jerk, acceleration, jerk];
    let phases = profile.phases().into_iter().zip(limits);
    TimeLaw::phases(0.0, 0.0, 0.0, phases.map(|((time, rate), limit)| (rate, time, limit)))
}

/// Whether an even `speed` [m/s] keeps every limit from `from` to `to`, looked at each few
/// milliseconds of it, or each micrometre where that is farther: a path of days is no longer than another.
pub(crate) fn keeps_even(limits: &mut impl Limits, from: f64, to: f64, speed: f64) -> bool {
    /// Time between two places [s].
    const APART: f64 = 2e-3;
    /// The same of a slow path [m].
    const LEAST: f64 = 1e-6;
    let mut rows = Vec::new();
    let count = ((to - from) / (speed * APART).max(LEAST)).ceil().max(1.0) as usize;
    let inside = (0..=count).map(|index| from + (to - from) * index as f64 / count as f64);
    let mut borders = Vec::new();
    limits.borders(from, to, &mut borders);
    let mut fits = |place: f64, side: Side| {
        rows.clear();
        let site = limits.site(place, side, &mut rows);
        let square = speed * speed;
        site.speed >= speed * (1.0 - 1e-12)
            && rows.iter().all(|row| {
                let used = row.base[2] * square + row.by_speed[2] * square * speed;
                used <= (row.top + row.top_by_speed * speed) * (1.0 + 1e-6)
            })
    };
    let mut sides = borders.iter();
    inside.into_iter().all(|place| fits(place, Side::At))
        && sides.all(|border| fits(*border, Side::Before) && fits(*border, Side::After))
}

/// The largest even speed that the limits allow at `place` [m/s], at most `speed`.
pub(crate) fn even_speed(limits: &mut impl Limits, place: f64, side: Side, speed: f64) -> f64 {
    let mut rows = Vec::new();
    let site = limits.site(place, side, &mut rows);
    let mut most = site.speed.min(speed);
    for row in &rows {
        // (base₂ + v·by₂)·v² ≤ top + v·slope grows with v where it matters: bisection.
        let keeps =
            |v: f64| (row.base[2] + v * row.by_speed[2]) * v * v <= row.top + v * row.top_by_speed;
        if keeps(most) {
            continue;
        }
        let (mut low, mut high) = (0.0, most);
        for _ in 0..50 {
            let middle = (low + high) / 2.0;
            if keeps(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        most = low;
    }
    most
}
