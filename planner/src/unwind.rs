//! Strokes that wind a table up farther than it can turn: they are marked in parts, and the table is
//! unwound in the dark between them. Each part begins exactly where the one before ends.

use machine::kinematics::{Joints, KinematicsError};
use machine::{Mechanism, PathLimits};

use crate::demand::Demands;
use crate::itinerary::{Item, Stop};
use crate::outline::Outline;
use crate::posture::{Posture, periodic, walk};
use crate::route::Speeds;

/// Share of a table's travel that one part winds up; the rest is for the ways into it and out of it.
const TRAVEL: f64 = 0.85;

/// A part that winds up less than this share of the travel is not divided any more.
const LEAST: f64 = 0.5;

/// What one part has at most of a stroke that is divided.
const LARGEST: f64 = 0.6;

/// Pieces of a stroke that are looked at one by one: it is divided between two of them.
const PIECES: usize = 512;

/// `stops` with the stroke that is stop `index` divided so that the axis that is `axis` can turn as
/// far as each part asks, and `speeds` to go with them. `near` is where the joints stand.
///
/// `None` where the axis does not come round to the same place, or the stroke winds it up too little
/// for a division to help.
pub(crate) fn divide<const N: usize, M: Mechanism<N>>(
    demands: &Demands<'_, N, M>,
    near: &Joints<N>,
    (stops, index): (&[Stop], usize),
    speeds: &Speeds,
    axis: usize,
) -> Option<(Vec<Stop>, Speeds)> {
    let Item::Stroke(outline) = &stops.get(index)?.item else { return None };
    let [lower, upper] = demands.axes.get(axis)?.limits.position;
    let travel = upper - lower;
    if !travel.is_finite() {
        return None;
    }
    let cuts = (0..demands.branches.len())
        .find_map(|branch| cuts(demands, near, outline, (axis, branch), travel).ok().flatten())?;
    let parts = outline.divided(&cuts, &demands.path);
    let strokes_before =
        stops[..index].iter().filter(|stop| matches!(stop.item, Item::Stroke(_))).count();
    let line = stops[index].line;
    let speed = speeds.strokes.get(strokes_before).copied()?;
    let most = |part: &Outline, limits: &PathLimits| part.top_speed(limits).min(speed.0);
    let new_speeds: Vec<(f64, f64)> =
        parts.iter().map(|part| (most(part, &demands.path), speed.1)).collect();
    let mut speeds = speeds.clone();
    let move_share = speeds.moves.get(index).copied()?;
    speeds.moves.splice(index..=index, vec![move_share; parts.len()]);
    speeds.strokes.splice(strokes_before..=strokes_before, new_speeds);
    let mut stops = stops.to_vec();
    let parts = parts.into_iter().map(|part| Stop { item: Item::Stroke(part), line });
    stops.splice(index..=index, parts);
    Some((stops, speeds))
}

/// Distances at which `outline` must be divided [m]; `None` where it winds `axis` up too little.
fn cuts<const N: usize, M: Mechanism<N>>(
    demands: &Demands<'_, N, M>,
    near: &Joints<N>,
    outline: &Outline,
    (axis, branch): (usize, usize),
    travel: f64,
) -> Result<Option<Vec<f64>>, KinematicsError> {
    let length = outline.length();
    let at = |distance: f64| outline.at(distance).motion(1.0, 0.0, 0.0);
    let mut now = Posture { joints: *near, branch };
    let start = demands.follow(&at(0.0), &mut now.branch, near)?;
    now.joints = start.position;
    if !periodic(demands, &now)[axis] {
        return Ok(None);
    }
    // Where the axis is at the end of each piece, and between which angles it was in it.
    let mut looks = Vec::with_capacity(PIECES);
    for index in 0..PIECES {
        let [from, to] = [index, index + 1].map(|end| length * end as f64 / PIECES as f64);
        let piece = |share: f64| at(from + (to - from) * share);
        let walked = walk(demands, now, &[&piece])?;
        looks.push((from, walked.lower[axis], walked.upper[axis]));
        now = walked.end;
    }
    let range = |looks: &[(f64, f64, f64)]| {
        let lower = looks.iter().map(|look| look.1).fold(f64::INFINITY, f64::min);
        let upper = looks.iter().map(|look| look.2).fold(f64::NEG_INFINITY, f64::max);
        upper - lower
    };
    let whole = range(&looks);
    if whole < LEAST * travel {
        return Ok(None);
    }
    let parts = (whole / (TRAVEL * travel).min(LARGEST * whole)).ceil();
    // A little more than an even share, so that rounding makes no part more.
    let usable = whole / parts * (1.0 + 2.0 / PIECES as f64);
    let mut cuts = Vec::new();
    let (mut lower, mut upper) = (f64::INFINITY, f64::NEG_INFINITY);
    for (from, least, most) in looks {
        let (wider_lower, wider_upper) = (lower.min(least), upper.max(most));
        if wider_upper - wider_lower > usable && lower.is_finite() {
            cuts.push(from);
            (lower, upper) = (least, most);
        } else {
            (lower, upper) = (wider_lower, wider_upper);
        }
    }
    Ok((!cuts.is_empty()).then_some(cuts))
}
