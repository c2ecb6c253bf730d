//! The drawn lines as the measure of what gets marked: before smoothing, dense and exact.

use signals::artwork::{Artwork, Stroke};

use crate::itinerary::{Item, Stop};

/// How far a chord may lie from the curve [m]: a little less than promised, for rounding.
const CHORD: f64 = Artwork::CHORD_ERROR * 0.8;

/// The strokes and dots of a job in the order in which they are marked.
pub(crate) fn artwork(stops: &[Stop]) -> Artwork {
    let mut strokes = Vec::new();
    for Stop { item, line } in stops {
        let points = match item {
            Item::Stroke(outline) => {
                let mut points = vec![outline.start().point.into()];
                for track in outline.tracks() {
                    track.sample(CHORD, &mut points);
                }
                points
            }
            Item::Dot(dot) => vec![dot.at.into()],
            _ => continue,
        };
        strokes.push(Stroke { points, line: *line });
    }
    Artwork { strokes }
}
