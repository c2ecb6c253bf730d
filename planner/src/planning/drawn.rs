//! What a path draws, told with its first window.

use machine::Mechanism;
use messages::artwork::{Artwork, ArtworkLine, Stroke};
use nalgebra::Vector3;

use super::account::widen;
use super::{Draft, Planning};
use crate::geometry::contour::{Contour, Light};

/// How far a chord may lie from the curve in the artwork [m]: a little less than promised, for
/// rounding.
const CHORD: f64 = Artwork::CHORD_ERROR * 0.8;

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Notes what a contour draws, of which the first line goes on from the contour before if that
    /// `was_lit` at its end.
    pub(super) fn note_drawn(&self, contour: &Contour, was_lit: bool, draft: &mut Draft<'_>) {
        draft.strokes.extend(strokes(contour, was_lit));
        draft.length += contour.lit_length();
        for demand in contour.demands().iter().filter(|demand| demand.power > 0.0) {
            draft.asked.add(self.task.speeds.asked(demand.speed), demand.line);
            widen(&mut draft.power, demand.power);
        }
    }
}

/// A dot of the artwork.
pub(super) fn dot(at: &Vector3<f64>, line: u64) -> ArtworkLine {
    ArtworkLine { goes_on: false, stroke: Stroke { points: vec![(*at).into()], line } }
}

/// The lines that a contour marks, each from light to dark; the first goes on from the contour before if
/// that `was_lit` at its end.
fn strokes(contour: &Contour, was_lit: bool) -> Vec<ArtworkLine> {
    let line = |Light { from, to, line }: Light| {
        let stroke = Stroke { points: contour.points(from, to, CHORD), line };
        ArtworkLine { goes_on: was_lit && from == 0.0, stroke }
    };
    contour.lights().into_iter().map(line).collect()
}
