//! Fills and cuts: lines that fill areas, and outlines moved by half the width of the cut.

use graphics::hatch::{Area, Hatch, HatchError, Travel, hatch, inset, rings};
use graphics::{Contour, FillRule, offset};

use super::compose::Maker;
use super::layers::{self, Drawn};
use super::recipe::Way;
use super::tables::HatchStyle;
use super::{Mark, MarkShape};
use crate::drawing::Note;

impl Maker {
    /// The lines that fill areas at one height.
    pub(super) fn fill(&mut self, areas: &[Drawn<layers::Area>], way: &Way) -> Vec<Mark> {
        let Some(&Drawn { height, line, .. }) = areas.first() else { return Vec::new() };
        let made = lines(areas, way).unwrap_or_else(|error| {
            self.note(line, format!("not filled: {error}"));
            Vec::new()
        });
        match way.hatch.style {
            HatchStyle::Lines => {
                let mark = |contour| Mark { shape: MarkShape::Contour(contour), height, line };
                made.into_iter().map(mark).collect()
            }
            HatchStyle::Contours => {
                let made: Vec<_> =
                    made.into_iter().map(|shape| Drawn { shape, height, line }).collect();
                self.arranged(&made)
            }
        }
    }

    /// Lines that are cut, moved by half the width of the cut: outlines outward, holes inward.
    pub(super) fn cut(&mut self, lines: Vec<Drawn<Contour>>, way: &Way) -> Vec<Drawn<Contour>> {
        if way.kerf == 0.0 {
            return lines;
        }
        let contours: Vec<Contour> = lines.iter().map(|drawn| drawn.shape.clone()).collect();
        match offset::compensate(&contours, way.kerf) {
            Ok(moved) => {
                for note in moved.notes {
                    self.note(note.line, note.text);
                }
                let sources = moved.sources.iter().map(|source| &lines[*source]);
                let moved = moved.contours.into_iter().zip(sources);
                moved.map(|(shape, source)| Drawn { shape, ..source.clone() }).collect()
            }
            Err(error) => {
                self.note(0, format!("the kerf is left out: {error}"));
                lines
            }
        }
    }

    fn note(&mut self, line: u64, text: String) {
        self.notes.push(Note { line, text });
    }
}

/// What fills areas, of which light ones cover those before them.
fn lines(areas: &[Drawn<layers::Area>], way: &Way) -> Result<Vec<Contour>, HatchError> {
    let areas: Vec<Area<'_>> = areas
        .iter()
        .map(|Drawn { shape, .. }| Area {
            contours: &shape.contours,
            rule: shape.rule,
            is_dark: shape.is_dark,
        })
        .collect();
    let kept;
    let (areas, within) = match way.hatch.inset {
        0.0 => (areas, None),
        distance => {
            kept = inset(&areas, distance)?;
            (Vec::new(), Some([Area { contours: &kept, rule: FillRule::NonZero, is_dark: true }]))
        }
    };
    let areas = within.as_ref().map_or(&areas[..], |within| &within[..]);
    match way.hatch.style {
        HatchStyle::Contours => rings(areas, way.hatch.spacing),
        HatchStyle::Lines => hatch(
            areas,
            &Hatch {
                angle: way.hatch.angle,
                spacing: way.hatch.spacing,
                is_cross: way.hatch.is_cross,
                travel: if way.hatch.is_bidirectional { Travel::BothWays } else { Travel::OneWay },
            },
        ),
    }
}
