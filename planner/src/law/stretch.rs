//! A stretch to plan and what its ends allow.

use super::{
    build::square,
    check::{LAUNCH_TIMES, along, nearest},
    end_speed::EndSpeed,
    ends::Tie,
    row::{Limits, Row, Side, site},
};

/// How much of a limit of the third order the bends of the path may take in a long launch.
const MOST_BENT: f64 = 0.05;

/// How a stretch begins or ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum End {
    /// At rest.
    Rest,
    /// In motion.
    Moving {
        /// u̇ [m/s], positive.
        speed: f64,
        /// ü [m/s²].
        acceleration: f64,
    },
}

/// An end in motion that cannot be met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Infeasible {
    /// Whether it is the end of the stretch, and not its start.
    pub at_end: bool,
    /// Near which place no law is within the limits [m].
    pub place: f64,
}

/// A stretch to plan.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    pub(super) from: f64,
    pub(super) length: f64,
    pub(super) ties: [Tie; 2],
}

impl Stretch {
    /// Whether an end is in motion.
    pub(super) fn fixed(&self) -> bool {
        self.ties.iter().any(|tie| matches!(tie, Tie::Fixed(..)))
    }
}

/// What can be reached from both ends, and the largest ü from rest there [m/s²].
pub(super) fn reaches(
    limits: &mut impl Limits,
    from: f64,
    length: f64,
    ends: [End; 2],
    rows: &mut Vec<Row>,
) -> ([EndSpeed; 2], [f64; 2]) {
    let (mut reaches, mut most) = ([EndSpeed::default(); 2], [1e9_f64; 2]);
    let places = [(0.0, Side::After, 1.0), (length, Side::Before, -1.0)];
    for (end, (place, side, sign)) in places.into_iter().enumerate() {
        rows.clear();
        let site = site(limits, from + place, side, rows);
        for row in rows.iter().filter(|row| sign * row.base[1] > 0.0) {
            most[end] = most[end].min(row.top.max(1e-9) / row.base[1].abs());
        }
        reaches[end].jerk = site.launch;
        if let End::Moving { speed, acceleration } = ends[end]
            && speed > 1e-9
        {
            reaches[end].speed = speed;
            reaches[end].acceleration = sign * acceleration;
            reaches[end].jerk *= 1.2;
        }
    }
    (reaches, most)
}

/// Whether a launch of the largest third derivative over `launch` [m] is within all limits.
pub(super) fn launches(
    limits: &mut impl Limits,
    [from, length]: [f64; 2],
    jerk: f64,
    launch: f64,
    end: usize,
    rows: &mut Vec<Row>,
) -> bool {
    LAUNCH_TIMES.into_iter().all(|time| {
        let distance = launch * time * time * time;
        let place = if end == 0 { distance } else { length - distance };
        rows.clear();
        let site = site(limits, from + place, Side::At, rows);
        let state = along(launch, square(jerk, launch), time, end);
        // Where the bends of the path take much of the third order, constant is not the best.
        let bends = [0.0, state[1], state[2]];
        let speed = state[2].sqrt();
        let bent = |row: &Row| row.third_order() && row.used(bends, speed) > MOST_BENT;
        nearest(rows, site.speed, site.speed_limit, state).0 <= 1.0 + 1e-6 && !rows.iter().any(bent)
    })
}
