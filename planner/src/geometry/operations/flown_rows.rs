//! Rows under power in proportion whose dark ends leave room to come to speed and to slow down: what is
//! dark between two of them is flown, and they are marked at the speed asked for from their first point to
//! their last, as they would be if all of it were gone along.

use core::ops::Range;

use machine::PathLimits;
use nalgebra::Vector3;

use crate::geometry::contour::{Contour, Demand, GAP};
use crate::light::Policy;

/// How far two rows may be from lying side by side: the cosine of the angle between the way along one and the
/// way back along the next.
const BACK: f64 = -0.999;

/// A line of a contour from its first light to its last, of one speed.
struct Row {
    /// Where it lies along the contour [m].
    lit: Range<f64>,
    /// Its first and last point.
    from: Vector3<f64>,
    to: Vector3<f64>,
    /// The way that it goes, of length 1.
    way: Vector3<f64>,
    /// What it needs before and behind it in the dark [m].
    room: f64,
}

/// The rows of which `contour` consists, each a path by itself, and where the contour ended in the dark; `None` where it is
/// anything else. `asked` is the speed that a demand asks for [m/s].
pub(super) fn flown_rows(
    contour: &Contour,
    asked: impl Fn(&Demand) -> Option<f64>,
    limits: &PathLimits,
) -> Option<(Vec<Contour>, Vector3<f64>)> {
    if contour.policy != Policy::Proportional || !contour.is_lit() || contour.is_turned() {
        return None;
    }
    let rows = rows(contour, asked, limits)?;
    let (first, last) = (rows.first()?, rows.last()?);
    let ends_have_room =
        first.lit.start >= first.room && contour.length() - last.lit.end >= last.room;
    let turns_back = |pair: &[Row]| matches!(pair, [one, next] if one.turns_back_to(next, contour));
    let have_room = rows.iter().all(|row| row.has_room(contour));
    if !ends_have_room || !have_room || !rows.windows(2).all(turns_back) {
        return None;
    }
    let row = |row: &Row| Some(contour.part(row.lit.start, row.lit.end, limits)?.flown());
    Some((rows.iter().map(row).collect::<Option<_>>()?, contour.end().point))
}

/// The lit stretches, those of one line together; `None` where one asks for more than one speed or bends.
fn rows(
    contour: &Contour,
    asked: impl Fn(&Demand) -> Option<f64>,
    limits: &PathLimits,
) -> Option<Vec<Row>> {
    let mut rows: Vec<(Range<f64>, f64)> = Vec::new();
    for (demand, end) in contour.stretches().filter(|(demand, _)| demand.power > 0.0) {
        let speed = asked(&demand)?;
        match rows.last_mut() {
            // What is dark on the same line is white of the same row.
            Some((lit, before)) if contour.joints_between(lit.start, demand.from) == 0 => {
                if speed != *before {
                    return None;
                }
                lit.end = end;
            }
            _ => rows.push((demand.from..end, speed)),
        }
    }
    rows.into_iter().map(|(lit, speed)| Row::new(contour, lit, speed, limits)).collect()
}

impl Row {
    fn new(contour: &Contour, lit: Range<f64>, speed: f64, limits: &PathLimits) -> Option<Self> {
        let (from, to) = (contour.at(lit.start).point, contour.at(lit.end).point);
        let way = to - from;
        let is_straight = lit.end - lit.start > GAP && (lit.end - lit.start) - way.norm() <= GAP;
        let room = to_speed(speed, limits);
        is_straight.then(|| Self { lit, from, to, way: way.normalize(), room })
    }

    /// Whether the contour goes straight into it and out of it for as long as it takes to come to speed.
    fn has_room(&self, contour: &Contour) -> bool {
        let Self { lit, from, to, way, room } = self;
        let before = contour.at((lit.start - room).max(0.0)).point;
        let behind = contour.at((lit.end + room).min(contour.length())).point;
        (before + way * *room - from).norm() <= GAP && (to + way * *room - behind).norm() <= GAP
    }

    /// Whether the dark way to the `next` one only goes out, across and back in.
    fn turns_back_to(&self, next: &Self, contour: &Contour) -> bool {
        let across = contour.joints_between(self.lit.end, next.lit.start);
        self.way.dot(&next.way) <= BACK && across <= 2
    }
}

/// How far the tool goes until it is at `speed` [m/s] from rest, or at rest from it [m].
fn to_speed(speed: f64, limits: &PathLimits) -> f64 {
    let PathLimits { acceleration, jerk, .. } = *limits;
    let time = if speed * jerk > acceleration * acceleration {
        speed / acceleration + acceleration / jerk
    } else {
        2.0 * (speed / jerk).sqrt()
    };
    0.5 * speed * time
}
