//! Draws what is more than a line: hatches, filled faces and texts.

use std::sync::Arc as Shared;

use kurbo::Point;

use super::draw::{Drawing, Within};
use super::file::key;
use super::record::Record;
use super::text::{self, Lettering};
use super::{Area, hatch};
use crate::ReadError;
use crate::read::is_finite;
use crate::read::pen::Pen;
use crate::shape::{Colour, Contour, Fill, FillRule, Shape};

/// The style of a hatch whose outlines each are filled whatever lies inside (code 75).
const IGNORES_ISLANDS: i64 = 2;

/// What an object is on and drawn with.
#[derive(Debug, Clone)]
pub(super) struct Looks {
    pub(super) layer: Shared<str>,
    pub(super) colour: Colour,
}

impl<'p, 'a> Drawing<'_, 'p, 'a> {
    /// Draws the object if it is an area or a text, and tells whether it is one.
    ///
    /// # Errors
    ///
    /// Where the drawing becomes too large.
    pub(super) fn area(
        &mut self,
        record: &Record<'p, 'a>,
        within: &Within,
        looks: &Looks,
    ) -> Result<bool, ReadError> {
        match record.kind {
            "HATCH" => self.hatch(record, within, looks)?,
            "SOLID" | "TRACE" => self.face(record, within, looks)?,
            "TEXT" | "MTEXT" | "ATTRIB" => self.lettering(record, within, looks)?,
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn hatch(
        &mut self,
        record: &Record<'p, 'a>,
        within: &Within,
        looks: &Looks,
    ) -> Result<(), ReadError> {
        let by = self.plane(record, within, record.real(30).unwrap_or(0.0));
        let outlines = hatch::outlines(record, by);
        let Some(outlines) = outlines.filter(|outlines| !outlines.is_empty()) else {
            self.notes.add("a HATCH without an outline that can be read is left out", record.line);
            return Ok(());
        };
        if record.flags(70) & 1 == 0 {
            self.notes.add("a HATCH with a pattern is filled as a whole", record.line);
        }
        if record.flags(75) == IGNORES_ISLANDS {
            for outline in outlines {
                self.fill(vec![outline], FillRule::NonZero, record.line, looks)?;
            }
            return Ok(());
        }
        self.fill(outlines, FillRule::EvenOdd, record.line, looks)
    }

    /// A filled face of four corners, of which the last two are exchanged, or three.
    fn face(
        &mut self,
        record: &Record<'p, 'a>,
        within: &Within,
        looks: &Looks,
    ) -> Result<(), ReadError> {
        let corners = [10, 11, 13, 12].map(|code| record.space(code));
        let by = self.plane(record, within, corners[0].map_or(0.0, |corner| corner[2]));
        let mut pen = Pen::default();
        let mut corners =
            corners.into_iter().flatten().map(|corner| by * Point::new(corner[0], corner[1]));
        if let Some(first) = corners.next() {
            pen.move_to(first);
            corners.for_each(|corner| pen.line_to(corner));
            pen.close();
        }
        self.fill(pen.take(), FillRule::NonZero, record.line, looks)
    }

    fn lettering(
        &mut self,
        record: &Record<'p, 'a>,
        within: &Within,
        looks: &Looks,
    ) -> Result<(), ReadError> {
        /// Bit of an attribute that is not shown.
        const IS_HIDDEN: i64 = 1;
        let line = record.line;
        if record.kind == "ATTRIB" && record.flags(70) & IS_HIDDEN != 0 {
            self.notes.add("an ATTRIB (text of a block) that is hidden is left out", line);
            return Ok(());
        }
        let style = record.text(7).unwrap_or("STANDARD");
        let font = self.file.fonts.get(&key(style)).map_or("", String::as_str);
        let name = font.to_lowercase();
        let is_outlined = [".ttf", ".otf", ".ttc"].iter().any(|end| name.ends_with(end));
        let set = match record.kind {
            "MTEXT" => text::several(record, is_outlined),
            _ => text::single(record, is_outlined),
        };
        let Lettering { contours, fill } = match set {
            Some(Ok(lettering)) => lettering,
            Some(Err(reason)) => {
                self.notes.add(format!("{} is left out: {reason}", record.kind), line);
                return Ok(());
            }
            None => {
                let text = format!("{} with numbers that do not fit is left out", record.kind);
                self.notes.add(text, line);
                return Ok(());
            }
        };
        let own = match fill {
            Some(_) => "in Ubuntu Light",
            None => "in single strokes",
        };
        let text = match font {
            "" => format!("text is drawn {own}"),
            font => format!("text is drawn {own} instead of the font {font}"),
        };
        self.notes.add(text, line);
        let height = record.space(10).map_or(0.0, |place| place[2]);
        let by = self.plane(record, within, height);
        let contours = contours.iter().map(|contour| contour.transformed(by)).collect();
        match fill {
            Some(rule) => self.fill(contours, rule, line, looks),
            None => {
                let shape = Shape { stroke: Some(looks.colour), ..Shape::default() };
                self.shape(shape, contours, line, looks)
            }
        }
    }

    fn fill(
        &mut self,
        contours: Vec<Contour>,
        rule: FillRule,
        line: u64,
        looks: &Looks,
    ) -> Result<(), ReadError> {
        let fill = Some(Fill { colour: looks.colour, rule });
        self.shape(Shape { fill, ..Shape::default() }, contours, line, looks)
    }

    /// Adds a shape with these contours.
    fn shape(
        &mut self,
        shape: Shape,
        mut contours: Vec<Contour>,
        line: u64,
        looks: &Looks,
    ) -> Result<(), ReadError> {
        self.budget.spend(&contours)?;
        contours.retain(is_finite);
        if !contours.is_empty() {
            let layer = Some(Shared::clone(&looks.layer));
            let shape = Shape { contours, layer, line, ..shape };
            self.areas.push(Area { before: self.pieces.len(), shape });
        }
        Ok(())
    }
}
