//! A path through poses: where the tool goes, and how it is turned on the way.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use crate::drawing::Curve;
use crate::geometry::arc_length::ByArcLength;
use crate::geometry::contour::CORNER;
use crate::geometry::cubic::{reversals, through};
use crate::geometry::track::Track;
use crate::geometry::turning::Turning;

/// Steps of the table of a cubic, before it is refined.
const STEPS: usize = 8;

/// A pose to pass, and where the job asks for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPose {
    /// Where the tool is [m].
    pub position: Vector3<f64>,
    /// How it is turned.
    pub rotation: Matrix3<f64>,
    /// Line of the job file, 0 for none.
    pub line: u64,
}

/// What goes between two poses that follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Between {
    /// A straight line. At a corner the turning comes to rest too.
    Lines,
    /// A cubic that goes over into the next with the same direction and curvature.
    Curves,
}

/// Curves through poses, in order, and the turning along them.
#[derive(Debug, Clone, PartialEq)]
pub struct PosedPath {
    /// Each with the line of the pose that it leads to.
    pub(crate) tracks: Vec<(Track, u64)>,
    /// By the way along all of them; `None` where the tool stays level.
    pub(crate) turning: Option<Arc<Turning>>,
}

impl PosedPath {
    /// Through `poses`, two at least, each at another place than the one before and turned by less than
    /// half a turn against it.
    ///
    /// # Errors
    /// The indices of the poses at which a smooth curve turns back on itself, growing.
    pub(crate) fn new(poses: &[PathPose], between: Between) -> Result<Self, Vec<usize>> {
        let places: Vec<Vector3<f64>> = poses.iter().map(|pose| pose.position).collect();
        let tracks: Vec<Track> = match between {
            Between::Lines => places
                .windows(2)
                .map(|pair| Track::new(&Curve::Line { from: pair[0], to: pair[1] }))
                .collect(),
            Between::Curves => {
                let cubics = through(&places);
                let reversals = reversals(&cubics);
                if !reversals.is_empty() {
                    return Err(reversals);
                }
                cubics
                    .into_iter()
                    .map(|cubic| Track::Cubic(Arc::new(ByArcLength::new(cubic, STEPS))))
                    .collect()
            }
        };
        let mut way = 0.0;
        let ends = tracks.iter().map(|track| {
            way += track.length();
            way
        });
        let knots: Vec<f64> = core::iter::once(0.0).chain(ends).collect();
        let rests: Vec<bool> = (0..poses.len())
            .map(|index| {
                let sides = index.checked_sub(1).map(|before| (&tracks[before], tracks.get(index)));
                let Some((before, Some(after))) = sides else { return true };
                let [end, start] = [before.at(before.length()), after.at(0.0)];
                end.first.normalize().dot(&start.first.normalize()) < CORNER
            })
            .collect();
        let rotations: Vec<Matrix3<f64>> = poses.iter().map(|pose| pose.rotation).collect();
        let turns = rotations.iter().any(|rotation| *rotation != Matrix3::identity());
        let turning = turns.then(|| Arc::new(Turning::new(&knots, &rotations, &rests)));
        let lines = poses.iter().skip(1).map(|pose| pose.line);
        Ok(Self { tracks: tracks.into_iter().zip(lines).collect(), turning })
    }

    /// [m].
    pub(crate) fn length(&self) -> f64 {
        self.tracks.iter().map(|(track, _)| track.length()).sum()
    }

    /// Where it ends [m].
    pub(crate) fn end(&self) -> Option<Vector3<f64>> {
        self.tracks.last().map(|(track, _)| track.at(track.length()).point)
    }

    /// Points along it such that no chord is farther than `chord_error` from it [m].
    pub(crate) fn points(&self, chord_error: f64) -> Vec<[f64; 3]> {
        let mut points = Vec::new();
        for (track, _) in &self.tracks {
            points.push(track.at(0.0).point.into());
            track.sample(chord_error, &mut points);
        }
        points
    }

    /// Whether the tool is turned on it.
    pub(crate) fn is_turned(&self) -> bool {
        self.turning.is_some()
    }
}
