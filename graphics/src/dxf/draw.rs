//! Draws the objects of a DXF file.

use core::f64::consts::TAU;
use std::sync::Arc as Shared;

use kurbo::{Affine, Point};
use messages::math;

use super::areas::Looks;
use super::colours::{indexed, true_colour};
use super::file::{File, is_dashed, key};
use super::frame::{Frame, cross};
use super::record::Record;
use super::spline::{Spline, through};
use super::{Area, Piece};
use crate::ReadError;
use crate::read::arcs::{bulged, circular};
use crate::read::notes::Notes;
use crate::read::pen::{Budget, Pen};
use crate::read::{MOST_DEPTH, is_finite};
use crate::shape::{Arc, Colour, Contour};

/// The contours of all objects that are seen, and what is filled or written.
///
/// # Errors
///
/// Where blocks are nested too deep or in a circle, or there are too many objects.
pub(super) fn pieces(
    file: &File<'_, '_>,
    notes: &mut Notes,
) -> Result<(Vec<Piece>, Vec<Area>), ReadError> {
    let mut drawing =
        Drawing { file, notes, budget: Budget::default(), pieces: Vec::new(), areas: Vec::new() };
    let within =
        Within { frame: Frame::scale(file.unit), layer: None, colour: Colour::BLACK, depth: 0 };
    drawing.records(&file.entities, &within)?;
    Ok((drawing.pieces, drawing.areas))
}

/// What the objects of a block get from where it is inserted.
#[derive(Debug, Clone)]
pub(super) struct Within {
    frame: Frame,
    /// The layer of what is on layer 0 in a block.
    layer: Option<Shared<str>>,
    colour: Colour,
    depth: usize,
}

pub(super) struct Drawing<'f, 'p, 'a> {
    pub(super) file: &'f File<'p, 'a>,
    pub(super) notes: &'f mut Notes,
    pub(super) budget: Budget,
    pub(super) pieces: Vec<Piece>,
    pub(super) areas: Vec<Area>,
}

impl<'p, 'a> Drawing<'_, 'p, 'a> {
    fn records(&mut self, records: &[Record<'p, 'a>], within: &Within) -> Result<(), ReadError> {
        let mut rest = records;
        while let Some((record, after)) = rest.split_first() {
            self.budget.spend_count(1).map_err(|error| match record.line {
                0 => error,
                line => error.at_line(line),
            })?;
            // What belongs to an object follows it.
            let part = match record.kind {
                "POLYLINE" => "VERTEX",
                "INSERT" if record.flags(66) == 1 => "ATTRIB",
                _ => "",
            };
            let count = after.iter().take_while(|it| it.kind == part).count();
            let (parts, after) = after.split_at(count);
            rest = after;
            self.record(record, parts, within)?;
        }
        Ok(())
    }

    fn record(
        &mut self,
        record: &Record<'p, 'a>,
        parts: &[Record<'p, 'a>],
        within: &Within,
    ) -> Result<(), ReadError> {
        if matches!(record.kind, "SEQEND" | "VIEWPORT" | "ATTDEF" | "ENDSEC") {
            return Ok(());
        }
        let line = record.line;
        if record.flags(67) == 1 {
            self.notes.add("what is in the paper space (a page layout) is left out", line);
            return Ok(());
        }
        if record.flags(60) == 1 {
            self.notes.add("an object that is invisible is left out", line);
            return Ok(());
        }
        let name = record.text(8).unwrap_or("0");
        let layer = match &within.layer {
            Some(layer) if name == "0" => Shared::clone(layer),
            _ => name.into(),
        };
        let known = self.file.layers.get(&key(&layer));
        if known.is_some_and(|known| known.is_frozen) {
            self.notes.add(format!("layer \"{layer}\" is frozen: its objects are left out"), line);
            return Ok(());
        }
        if record.kind != "INSERT" && known.is_some_and(|known| known.is_off) {
            self.notes.add(format!("layer \"{layer}\" is off: its objects are left out"), line);
            return Ok(());
        }
        let colour = match (record.whole(420), record.whole(62)) {
            (Some(value), _) => true_colour(value),
            (None, Some(0)) => within.colour,
            (None, Some(index @ 1..=255)) => indexed(index as u8),
            _ => known.map_or(Colour::BLACK, |known| known.colour),
        };
        if record.kind == "INSERT" {
            parts.iter().try_for_each(|part| self.record(part, &[], within))?;
            return self.insert(record, layer, colour, within);
        }
        let looks = Looks { layer, colour };
        if self.area(record, within, &looks)? {
            return Ok(());
        }
        let Looks { layer, colour } = looks;
        let contours = self.contours(record, parts, within);
        self.budget.spend(&contours)?;
        let type_name = record.text(6).unwrap_or("BYLAYER");
        let by_layer = key(type_name) == "BYLAYER" && known.is_some_and(|known| known.is_dashed);
        if !contours.is_empty() && (by_layer || is_dashed(type_name)) {
            self.notes.add("a dashed line is drawn without gaps", line);
        }
        for contour in contours.into_iter().filter(is_finite) {
            self.pieces.push(Piece { contour, layer: Shared::clone(&layer), colour, line });
        }
        Ok(())
    }

    fn insert(
        &mut self,
        record: &Record<'p, 'a>,
        layer: Shared<str>,
        colour: Colour,
        within: &Within,
    ) -> Result<(), ReadError> {
        let name = record.text(2).unwrap_or("");
        let Some(block) = self.file.blocks.get(&key(name)) else {
            self.notes.add(format!("block \"{name}\" is not in the file"), record.line);
            return Ok(());
        };
        if within.depth >= MOST_DEPTH {
            return Err(ReadError::new(
                format!("blocks are nested more than {MOST_DEPTH} deep, or in a circle"),
                "explode the blocks",
            )
            .at_line(record.line));
        }
        let scale = [41, 42, 43].map(|code| record.real(code).unwrap_or(1.0));
        let (sine, cosine) = math::sin_cos(record.real(50).unwrap_or(0.0).to_radians());
        let place = record.space(10).unwrap_or_default();
        let count = |code| record.whole(code).unwrap_or(1).clamp(1, 32_767);
        let step = |code| record.real(code).unwrap_or(0.0);
        let frame = within.frame.then(&extruded(record));
        for row in 0..count(71) {
            for column in 0..count(70) {
                self.budget.spend_count(1)?;
                let (x, y) = (column as f64 * step(44), row as f64 * step(45));
                let origin =
                    [place[0] + cosine * x - sine * y, place[1] + sine * x + cosine * y, place[2]];
                let placed = Frame::placed(scale, sine, cosine, origin);
                let base = Frame::moved(block.base.map(|part| -part));
                let within = Within {
                    frame: frame.then(&placed).then(&base),
                    layer: Some(Shared::clone(&layer)),
                    colour,
                    depth: within.depth + 1,
                };
                self.records(&block.entities, &within)?;
            }
        }
        Ok(())
    }

    /// The contours of an object in the drawing [m].
    fn contours(
        &mut self,
        record: &Record<'p, 'a>,
        parts: &[Record<'p, 'a>],
        within: &Within,
    ) -> Vec<Contour> {
        let mut pen = Pen::default();
        let drawn = match record.kind {
            "LINE" => self.line(record, within, &mut pen),
            "ARC" | "CIRCLE" => self.circle(record, within, &mut pen),
            "ELLIPSE" => self.ellipse(record, within, &mut pen),
            "LWPOLYLINE" => self.light_polyline(record, within, &mut pen),
            "POLYLINE" => self.polyline(record, parts, within, &mut pen),
            "SPLINE" => self.spline(record, within, &mut pen),
            kind => {
                self.notes.add(format!("{} is left out", kind_name(kind)), record.line);
                return Vec::new();
            }
        };
        if drawn.is_none() {
            let text = format!("{} with numbers that do not fit is left out", record.kind);
            self.notes.add(text, record.line);
        }
        let contours = pen.take();
        if pen.points > 0 {
            self.notes.add(format!("{} without a length is left out", record.kind), record.line);
        }
        contours
    }

    fn tell_depth(&mut self, is_deep: bool, line: u64) {
        if is_deep {
            self.notes.add("an object in space is drawn as it is seen from above", line);
        }
    }

    /// The coordinates of a flat object.
    pub(super) fn plane(
        &mut self,
        record: &Record<'p, 'a>,
        within: &Within,
        height: f64,
    ) -> Affine {
        let frame = within.frame.then(&extruded(record));
        self.tell_depth(frame.is_tilted(), record.line);
        frame.plane(height)
    }

    fn line(&mut self, record: &Record<'_, '_>, within: &Within, pen: &mut Pen) -> Option<()> {
        let (from, to) = (record.space(10)?, record.space(11)?);
        self.tell_depth(within.frame.is_tilted() || from[2] != to[2], record.line);
        pen.move_to(within.frame.point(from));
        pen.line_to(within.frame.point(to));
        Some(())
    }

    fn circle(&mut self, record: &Record<'p, 'a>, within: &Within, pen: &mut Pen) -> Option<()> {
        let centre = record.space(10)?;
        let radius = record.real(40)?;
        let by = self.plane(record, within, centre[2]);
        let (start, sweep) = match record.kind {
            "CIRCLE" => (0.0, TAU),
            _ => {
                let (start, end) = (record.real(50)?, record.real(51)?);
                (start.to_radians(), turn(end - start, 360.0).to_radians())
            }
        };
        let arc = circular(Point::new(centre[0], centre[1]), radius, start, sweep);
        (radius > 0.0).then(|| draw_arc(arc.transformed(by), pen))
    }

    fn ellipse(&mut self, record: &Record<'_, '_>, within: &Within, pen: &mut Pen) -> Option<()> {
        let (centre, major) = (record.space(10)?, record.space(11)?);
        let ratio = record.real(40)?;
        let normal = record.space(210).unwrap_or([0.0, 0.0, 1.0]);
        let length = (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
        let minor = cross(normal, major).map(|part| part * ratio / length);
        let start = record.real(41).unwrap_or(0.0);
        let sweep = turn(record.real(42).unwrap_or(TAU) - start, TAU);
        self.tell_depth(
            within.frame.is_tilted() || major[2] != 0.0 || minor[2] != 0.0,
            record.line,
        );
        let arc = Arc {
            centre: within.frame.point(centre),
            major: within.frame.vector(major),
            minor: within.frame.vector(minor),
            start,
            sweep,
        };
        (ratio > 0.0 && length > 0.0).then(|| draw_arc(arc, pen))
    }

    fn light_polyline(
        &mut self,
        record: &Record<'p, 'a>,
        within: &Within,
        pen: &mut Pen,
    ) -> Option<()> {
        let mut vertices: Vec<(Point, f64)> = Vec::new();
        for pair in record.pairs {
            match (pair.code, pair.real()) {
                (10, Some(x)) => vertices.push((Point::new(x, 0.0), 0.0)),
                (20, Some(y)) => vertices.last_mut()?.0.y = y,
                (42, Some(bulge)) => vertices.last_mut()?.1 = bulge,
                _ => {}
            }
        }
        let by = self.plane(record, within, record.real(38).unwrap_or(0.0));
        draw_bulged(&vertices, record.flags(70) & 1 != 0, by, pen)
    }

    fn polyline(
        &mut self,
        record: &Record<'p, 'a>,
        parts: &[Record<'p, 'a>],
        within: &Within,
        pen: &mut Pen,
    ) -> Option<()> {
        let flags = record.flags(70);
        if flags & (16 | 64) != 0 {
            self.notes.add("a mesh is left out", record.line);
            return Some(());
        }
        let is_closed = flags & 1 != 0;
        // Control points of a curve that is already drawn by its other vertices.
        let vertices = parts.iter().filter(|vertex| vertex.flags(70) & 16 == 0);
        if flags & 8 != 0 {
            let places: Option<Vec<_>> = vertices.map(|vertex| vertex.space(10)).collect();
            let places = places?;
            let first = places.first()?;
            let is_deep = places.iter().any(|place| place[2] != first[2]);
            self.tell_depth(within.frame.is_tilted() || is_deep, record.line);
            let points = places.iter().map(|&place| (within.frame.point(place), 0.0));
            let points: Vec<(Point, f64)> = points.collect();
            return draw_bulged(&points, is_closed, Affine::IDENTITY, pen);
        }
        let vertices: Option<Vec<(Point, f64)>> = vertices
            .map(|vertex| {
                let place = vertex.space(10)?;
                Some((Point::new(place[0], place[1]), vertex.real(42).unwrap_or(0.0)))
            })
            .collect();
        let by = self.plane(record, within, record.real(30).unwrap_or(0.0));
        draw_bulged(&vertices?, is_closed, by, pen)
    }

    fn spline(&mut self, record: &Record<'_, '_>, within: &Within, pen: &mut Pen) -> Option<()> {
        let controls = record.spaces(10);
        let fits = record.spaces(11);
        let places = if controls.is_empty() { &fits } else { &controls };
        let first = places.first()?;
        let is_deep = places.iter().any(|place| place[2] != first[2]);
        self.tell_depth(within.frame.is_tilted() || is_deep, record.line);
        if controls.is_empty() {
            let points: Vec<Point> = fits.iter().map(|&place| within.frame.point(place)).collect();
            let tangents = [12, 13].map(|code| {
                let tangent = within.frame.vector(record.space(code)?);
                (tangent.hypot() > 0.0).then(|| tangent.normalize())
            });
            through(&points, tangents, pen);
            self.notes
                .add("a SPLINE without control points is drawn through its points", record.line);
            return Some(());
        }
        let weights = record.reals(41);
        let weight = |index: usize| weights.get(index).copied().unwrap_or(1.0);
        let spline = Spline {
            degree: usize::try_from(record.whole(71)?).ok()?,
            knots: record.reals(40),
            controls: controls
                .iter()
                .enumerate()
                .map(|(index, &place)| (within.frame.point(place), weight(index)))
                .collect(),
        };
        spline.draw(pen).then_some(())
    }
}

/// The coordinates of an object in those that it is given in.
fn extruded(record: &Record<'_, '_>) -> Frame {
    Frame::of_extrusion(record.space(210).unwrap_or([0.0, 0.0, 1.0]))
}

/// An angle from above 0 to a whole turn.
pub(super) fn turn(angle: f64, whole: f64) -> f64 {
    let angle = angle.rem_euclid(whole);
    // What the file rounded to just below a turn or just above none is a turn.
    if angle < 1e-9 * whole { whole } else { angle }
}

fn draw_arc(arc: Arc, pen: &mut Pen) {
    let start = arc.point(arc.start);
    pen.move_to(start);
    if arc.sweep.abs() >= TAU {
        pen.arc_to(arc, start);
        pen.close_here();
    } else {
        pen.arc_to(arc, arc.point(arc.start + arc.sweep));
    }
}

/// Vertices, each with the bulge of what follows it.
fn draw_bulged(
    vertices: &[(Point, f64)],
    is_closed: bool,
    by: Affine,
    pen: &mut Pen,
) -> Option<()> {
    let (first, _) = *vertices.first()?;
    pen.move_to(by * first);
    let ends = vertices.iter().skip(1).map(|&(at, _)| at).chain(is_closed.then_some(first));
    for (&(from, bulge), to) in vertices.iter().zip(ends) {
        match bulged(from, to, bulge) {
            Some(arc) => pen.arc_to(arc.transformed(by), by * to),
            None => pen.line_to(by * to),
        }
    }
    if is_closed {
        pen.close_here();
    }
    Some(())
}

fn kind_name(kind: &str) -> String {
    match kind {
        "DIMENSION" | "LEADER" | "MULTILEADER" => format!("{kind} (a dimension or a leader)"),
        "3DFACE" => format!("{kind} (a filled face)"),
        "POINT" => "POINT (a point without a size)".to_owned(),
        kind => kind.chars().take(30).collect(),
    }
}
