//! What a job wants marked, in the machine frame: the measure of what was marked.
//!
//! Not a fixed-size sample, like [`plan`](crate::plan): the planner writes it as `artwork.jsonl`
//! into the run folder, and whoever judges the marks reads it there.

use serde::{Deserialize, Serialize};

/// All strokes of a job, in the order they are marked.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Artwork {
    /// The strokes; stroke `n` of a sample is `strokes[n − 1]`.
    pub strokes: Vec<Stroke>,
}

/// A line of `artwork.jsonl`: a stroke, or a part of one. The file grows while the job is planned, and
/// what of it has been written can be read whenever that ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ArtworkLine {
    /// Whether it goes on with the stroke before, from that one's last point.
    #[serde(default)]
    pub goes_on: bool,
    /// The stroke.
    #[serde(flatten)]
    pub stroke: Stroke,
}

/// One continuous run of laser-on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stroke {
    /// The line to mark, in order [m]: true points of the curve, dense enough that a chord is
    /// never farther than [`Artwork::CHORD_ERROR`] from it. A dot is a single point.
    pub points: Vec<[f64; 3]>,
    /// Line of the job file it comes from, from 1; 0 when it has none.
    pub line: u64,
}

impl Artwork {
    /// Farthest a chord of [`Stroke::points`] may lie from the curve [m].
    pub const CHORD_ERROR: f64 = 5e-8;

    /// Adds the next stroke, or what comes next of the last one.
    pub fn add(&mut self, ArtworkLine { goes_on, stroke }: ArtworkLine) {
        match self.strokes.last_mut() {
            Some(last) if goes_on => last.points.extend(stroke.points.iter().skip(1)),
            _ => self.strokes.push(stroke),
        }
    }

    /// Length of all strokes [m].
    pub fn length(&self) -> f64 {
        self.strokes.iter().map(Stroke::length).sum()
    }
}

impl Stroke {
    /// Length of the line [m].
    pub fn length(&self) -> f64 {
        self.points.windows(2).map(|pair| distance(&pair[0], &pair[1])).sum()
    }
}

/// Distance of two points [m].
pub fn distance(from: &[f64; 3], to: &[f64; 3]) -> f64 {
    let squares: f64 = from.iter().zip(to).map(|(a, b)| (b - a) * (b - a)).sum();
    squares.sqrt()
}
