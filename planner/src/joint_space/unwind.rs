//! Strokes that wind a table up farther than it can turn: they are marked in parts, and the table is
//! unwound in the dark between them. Each part begins exactly where the one before ends.

use machine::Mechanism;
use machine::kinematics::{Joints, KinematicsError};

use crate::geometry::contour::{Contour, GAP};
use crate::joint_space::configuration::{Configuration, periodic, walk};
use crate::limits::motion_limits::MotionLimits;

/// Share of a table's travel that one part winds up; the rest is for the ways into it and out of it.
const TRAVEL: f64 = 0.85;

/// A part that winds up less than this share of the travel is not divided any more.
const LEAST: f64 = 0.5;

/// What one part has at most of a stroke that is divided.
const LARGEST: f64 = 0.6;

/// Pieces of a stroke that are looked at one by one: it is divided between two of them.
const PIECES: usize = 512;

/// `contour` in parts such that the axis that is `axis` can turn as far as each asks. `near` is where
/// the joints stand.
///
/// `None` where the path says how the tool is turned, the axis does not come round to the same place, or the contour winds it up too little
/// for a division to help.
pub(crate) fn divide<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    near: &Joints<N>,
    contour: &Contour,
    axis: usize,
) -> Option<Vec<Contour>> {
    let [lower, upper] = limits.axes.get(axis)?.limits.position;
    let travel = upper - lower;
    // A part may end in the midst of a turn of the tool, which a flight from there does not go on with.
    if !travel.is_finite() || contour.is_turned() {
        return None;
    }
    let cuts = (0..limits.branches.len())
        .find_map(|branch| cuts(limits, near, contour, (axis, branch), travel).ok().flatten())?;
    let mut cuts: Vec<f64> = cuts.iter().map(|cut| contour.beside_joints(*cut)).collect();
    cuts.dedup();
    cuts.retain(|cut| (GAP..contour.length() - GAP).contains(cut));
    let starts = core::iter::once(0.0).chain(cuts.iter().copied());
    let ends = cuts.iter().copied().chain([contour.length()]);
    let parts: Vec<Contour> =
        starts.zip(ends).filter_map(|(from, to)| contour.part(from, to, &limits.path)).collect();
    (parts.len() > 1).then_some(parts)
}

/// Distances at which `contour` must be divided [m]; `None` where it winds `axis` up too little.
fn cuts<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    near: &Joints<N>,
    contour: &Contour,
    (axis, branch): (usize, usize),
    travel: f64,
) -> Result<Option<Vec<f64>>, KinematicsError> {
    let length = contour.length();
    let at = |distance: f64| contour.at(distance).motion([1.0, 0.0, 0.0]);
    let mut now = Configuration { joints: *near, branch };
    let start = limits.follow(&at(0.0), &mut now.branch, near)?;
    now.joints = start.position;
    if !periodic(limits, &now)[axis] {
        return Ok(None);
    }
    // Where the axis is at the end of each piece, and between which angles it was in it.
    let mut looks = Vec::with_capacity(PIECES);
    for index in 0..PIECES {
        let [from, to] = [index, index + 1].map(|end| length * end as f64 / PIECES as f64);
        let piece = |share: f64| at(from + (to - from) * share);
        let walked = walk(limits, now, &[&piece])?;
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
