//! What a drawing does, as the profiles take it: strokes, free moves and rests.

use nalgebra::Vector3;

use crate::drawing::{Action, Curve};
use crate::error::PlanError;
use crate::geometry::bezier;
use crate::geometry::contour::{CORNER, GAP};
use crate::geometry::jet::Jet;
use crate::geometry::track::Track;
use crate::job::Job;

/// Shorter moves are not made [m].
pub(super) const NOTHING: f64 = 1e-12;

/// How far the chords of a Bézier curve may be from it [m].
const CHORD_ERROR: f64 = 1e-6;

/// One thing to do.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Item {
    Stroke(Stroke),
    /// Straight in the dark to a place [m].
    Go(Vector3<f64>),
    /// Stand still [s].
    Rest {
        time: f64,
        is_lit: bool,
    },
}

/// Curves that go on into each other.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stroke {
    /// Where each begins [m], and it.
    tracks: Vec<(f64, Track)>,
    /// [m].
    pub(super) length: f64,
    /// The speed that the job asks for along it [m/s].
    pub(super) asked: Option<f64>,
    pub(super) is_lit: bool,
    /// Line of the job file where it begins, 0 for none.
    pub(super) line: u64,
    /// The largest [1/m].
    pub(super) curvature: f64,
}

impl Stroke {
    fn new(track: Track, asked: Option<f64>, is_lit: bool, line: u64) -> Self {
        let (length, curvature) = (track.length(), track.bend().curvature);
        Self { tracks: vec![(0.0, track)], length, asked, is_lit, line, curvature }
    }

    /// The stroke at `place` along it [m]; before its start and behind its end straight on.
    pub(super) fn at(&self, place: f64) -> Jet {
        let inside = place.clamp(0.0, self.length);
        let after = self.tracks.partition_point(|(start, _)| *start <= inside);
        let (start, track) = &self.tracks[after.max(1) - 1];
        let jet = track.at((inside - start).min(track.length()));
        if inside == place {
            return jet;
        }
        let straight = Vector3::zeros();
        let point = jet.point + jet.first * (place - inside);
        Jet { point, second: straight, third: straight, ..jet }
    }

    /// Takes `other`, if it goes on from the end of this one at the same speed.
    fn goes_on(&mut self, other: &Self) -> bool {
        let (end, start) = (self.at(self.length), other.at(0.0));
        let is_smooth = (start.point - end.point).norm() <= GAP
            && end.first.normalize().dot(&start.first.normalize()) > CORNER;
        if !is_smooth || self.is_lit != other.is_lit || self.asked != other.asked {
            return false;
        }
        let from = self.length;
        self.tracks.extend(other.tracks.iter().map(|(start, track)| (from + start, track.clone())));
        self.length += other.length;
        self.curvature = self.curvature.max(other.curvature);
        true
    }
}

/// What the drawing of `job` does in order. A free move that only leads to where a stroke begins is left
/// out: it goes to where the run-in begins.
pub(super) fn items(job: &Job) -> Result<Vec<Item>, PlanError> {
    let unreadable = |error: crate::job::JobError| PlanError::Unreadable {
        line: error.position().map_or(0, |(line, _)| line),
        message: error.to_string(),
    };
    let mut items: Vec<Item> = Vec::new();
    for step in job.steps().map_err(unreadable)? {
        let step = step.map_err(unreadable)?;
        match &step.action {
            Action::Mark { curve, speed, .. } => {
                add(&mut items, Stroke::new(Track::new(curve), *speed, true, step.line));
            }
            Action::Feed { curve, speed } => {
                add(&mut items, Stroke::new(Track::new(curve), Some(*speed), false, step.line));
            }
            Action::Trace { points, speed, .. } => {
                let mut from = points[0];
                for to in bezier::samples(points, bezier::chords(points, CHORD_ERROR)) {
                    let chord = Track::new(&Curve::Line { from, to });
                    add(&mut items, Stroke::new(chord, *speed, true, step.line));
                    from = to;
                }
            }
            Action::Follow { path, .. } => {
                for (track, line) in &path.tracks {
                    add(&mut items, Stroke::new(track.clone(), None, true, *line));
                }
            }
            Action::Rapid { to } => items.push(Item::Go(*to)),
            Action::Dwell { time, lit } => {
                let is_lit = lit.is_some_and(|power| power > 0.0);
                items.push(Item::Rest { time: *time, is_lit });
            }
            Action::Output { .. } | Action::Frequency { .. } | Action::Pause => {
                items.push(Item::Rest { time: 0.0, is_lit: false });
            }
            Action::Corners(_) => {}
        }
    }
    Ok(items)
}

/// Puts `stroke` behind `items`, to the one that it goes on from where there is one.
fn add(items: &mut Vec<Item>, stroke: Stroke) {
    if stroke.length <= NOTHING {
        return;
    }
    if let Some(Item::Stroke(before)) = items.last_mut()
        && before.goes_on(&stroke)
    {
        return;
    }
    let begins = stroke.at(0.0).point;
    items.pop_if(|item| matches!(item, Item::Go(to) if (*to - begins).norm() <= GAP));
    items.push(Item::Stroke(stroke));
}
