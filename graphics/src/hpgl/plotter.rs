//! The state of a plotter, and what it draws.

use std::sync::Arc as Shared;

use core::f64::consts::TAU;

use kurbo::{Affine, Point, Vec2};
use messages::math;

use super::commands::Command;
use crate::ReadError;
use crate::read::arcs::circular;
use crate::read::is_finite;
use crate::read::notes::Notes;
use crate::read::pen::{Budget, Pen};
use crate::shape::{Arc, Colour, Contour, Fill, FillRule, Segment, Shape};

/// Metres in a plotter unit.
const UNIT: f64 = 0.025e-3;

/// Plotter units from the origin to the second of the points that scaling is about, where the file gives none:
/// those of an A4 sheet.
const SECOND: Point = Point::new(10_870.0, 7_600.0);

/// The colours of the pens 1 to 8; then they begin again.
const PENS: [Colour; 8] = [
    Colour { red: 0, green: 0, blue: 0 },
    Colour { red: 255, green: 0, blue: 0 },
    Colour { red: 0, green: 255, blue: 0 },
    Colour { red: 255, green: 255, blue: 0 },
    Colour { red: 0, green: 0, blue: 255 },
    Colour { red: 255, green: 0, blue: 255 },
    Colour { red: 0, green: 255, blue: 255 },
    Colour { red: 128, green: 128, blue: 128 },
];

/// A plotter.
#[derive(Debug)]
pub(super) struct Plotter {
    /// In plotter units.
    at: Point,
    is_down: bool,
    is_relative: bool,
    pen: u32,
    /// The rectangle that scaling is about, in plotter units.
    corners: [Point; 2],
    /// From units of the file to plotter units, before they are turned.
    scale: Affine,
    /// By quarters of a turn about the origin.
    turn: Affine,
    /// What is being drawn: it goes on until the pen is raised or changed.
    path: Pen,
    path_line: u64,
    /// Between the commands for a polygon.
    polygon: Option<Vec<Contour>>,
    shapes: Vec<Shape>,
    budget: Budget,
}

impl Default for Plotter {
    fn default() -> Self {
        Self {
            at: Point::ORIGIN,
            is_down: false,
            is_relative: false,
            pen: 1,
            corners: [Point::ORIGIN, SECOND],
            scale: Affine::IDENTITY,
            turn: Affine::IDENTITY,
            path: Pen::default(),
            path_line: 0,
            polygon: None,
            shapes: Vec::new(),
            budget: Budget::default(),
        }
    }
}

impl Plotter {
    /// Runs a command; `false` where it is not known.
    ///
    /// # Errors
    ///
    /// Where there is too much to draw.
    pub(super) fn run(&mut self, command: &Command, notes: &mut Notes) -> Result<bool, ReadError> {
        let (numbers, line) = (command.numbers.as_slice(), command.line);
        if self.path_line == 0 {
            self.path_line = line;
        }
        match &command.name {
            b"IN" | b"DF" => {
                self.flush()?;
                self.is_relative = false;
                self.scale = Affine::IDENTITY;
                self.turn = Affine::IDENTITY;
                if &command.name == b"IN" {
                    self.is_down = false;
                    self.at = Point::ORIGIN;
                    self.corners = [Point::ORIGIN, SECOND];
                }
            }
            b"SP" => {
                self.flush()?;
                self.pen = numbers.first().map_or(0.0, |pen| pen.clamp(0.0, 1e6)) as u32;
            }
            b"PU" | b"PD" | b"PA" | b"PR" => {
                match &command.name {
                    b"PU" => self.is_down = false,
                    b"PD" => self.is_down = true,
                    b"PA" => self.is_relative = false,
                    _ => self.is_relative = true,
                }
                if !self.is_down {
                    self.flush()?;
                }
                self.lines(numbers, line, notes)?;
            }
            b"AA" | b"AR" => self.arc(command, notes)?,
            b"CI" => self.circle(numbers, line, notes)?,
            b"EA" | b"ER" | b"RA" | b"RR" => self.rectangle(command, notes)?,
            b"EW" | b"WG" => self.wedge(command, notes)?,
            b"PM" => self.polygon_mode(numbers, line)?,
            b"EP" | b"FP" => self.polygon_drawn(&command.name == b"FP", line)?,
            b"IP" => self.corners_given(numbers, line, notes),
            b"SC" => self.scaled(numbers, line, notes),
            b"RO" => self.turned(numbers, line, notes),
            b"LB" => notes.add("LB (text) is left out", line),
            b"PE" => notes.add("PE (packed lines) is left out: save as plain HPGL", line),
            b"LT" if !numbers.is_empty() => {
                notes.add("LT: a dashed line is drawn without gaps", line);
            }
            b"VS" => notes.add("VS: the speed of the pen is left out", line),
            b"LT" | b"DT" | b"CO" | b"CT" | b"PW" | b"PG" | b"FT" | b"FS" | b"AC" | b"AS"
            | b"NR" | b"PS" | b"TR" | b"WU" | b"QL" | b"SI" | b"SR" | b"DI" | b"DR" | b"CS"
            | b"SS" => {}
            b"IW" if !numbers.is_empty() => {
                notes.add("IW: a window is not applied: what it hides is drawn", line);
            }
            b"IW" => {}
            name => {
                let name = String::from_utf8_lossy(name).into_owned();
                notes.add(format!("{name} is left out"), line);
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// All that has been drawn.
    ///
    /// # Errors
    ///
    /// Where it is too much.
    pub(super) fn finish(mut self) -> Result<Vec<Shape>, ReadError> {
        self.flush()?;
        Ok(self.shapes)
    }

    /// Ends what is being drawn.
    fn flush(&mut self) -> Result<(), ReadError> {
        let contours = self.path.take();
        let line = core::mem::take(&mut self.path_line);
        match contours.is_empty() {
            true => Ok(()),
            false => self.add(contours, false, line),
        }
    }

    /// Adds a shape; contours are in plotter units.
    fn add(&mut self, contours: Vec<Contour>, is_filled: bool, line: u64) -> Result<(), ReadError> {
        self.budget.spend(&contours)?;
        let contours: Vec<Contour> = contours
            .into_iter()
            .map(closed)
            .map(|contour| contour.transformed(Affine::scale(UNIT)))
            .filter(is_finite)
            .collect();
        if let Some(polygon) = &mut self.polygon {
            polygon.extend(contours);
            return Ok(());
        }
        // Without a pen nothing is drawn.
        if contours.is_empty() || self.pen == 0 {
            return Ok(());
        }
        let colour = PENS[(self.pen as usize - 1) % PENS.len()];
        self.shapes.push(Shape {
            contours,
            stroke: Some(colour),
            fill: is_filled.then_some(Fill { colour, rule: FillRule::EvenOdd }),
            layer: Some(Shared::from(format!("pen {}", self.pen))),
            recipe: None,
            line,
        });
        Ok(())
    }

    /// From units of the file to plotter units.
    fn to_units(&self) -> Affine {
        self.turn * self.scale
    }

    /// A place, or a way from the pen, in plotter units.
    fn place(&self, x: f64, y: f64, is_relative: bool) -> Point {
        match is_relative {
            true => self.at + self.way(x, y),
            false => self.to_units() * Point::new(x, y),
        }
    }

    fn way(&self, x: f64, y: f64) -> Vec2 {
        self.to_units() * Point::new(x, y) - self.to_units() * Point::ORIGIN
    }

    fn lines(&mut self, numbers: &[f64], line: u64, notes: &mut Notes) -> Result<(), ReadError> {
        if !numbers.len().is_multiple_of(2) {
            notes.add("a place without its y is left out", line);
        }
        for pair in numbers.chunks_exact(2) {
            let to = self.place(pair[0], pair[1], self.is_relative);
            if self.is_down {
                self.begin(line);
                self.path.line_to(to);
            }
            self.at = to;
        }
        self.budget.spend_count(1)
    }

    /// Begins a contour at the pen where none goes on there.
    fn begin(&mut self, line: u64) {
        if self.path.at() != self.at {
            self.path.move_to(self.at);
        }
        if self.path_line == 0 {
            self.path_line = line;
        }
    }

    fn arc(&mut self, command: &Command, notes: &mut Notes) -> Result<(), ReadError> {
        let &[x, y, degrees, ..] = command.numbers.as_slice() else {
            notes.add("an arc with numbers that do not fit is left out", command.line);
            return Ok(());
        };
        let centre = self.place(x, y, &command.name == b"AR");
        let sweep = degrees.clamp(-360.0, 360.0).to_radians();
        let out = self.scale_linear().inverse() * (self.at - centre).to_point();
        let out = out.to_vec2();
        if out.hypot() <= 0.0 || sweep == 0.0 || !out.is_finite() {
            notes.add("an arc without a length is left out", command.line);
            return Ok(());
        }
        // A circle in the units of the file, whose scales may differ.
        let arc = circular(Point::ORIGIN, out.hypot(), math::atan2(out.y, out.x), sweep);
        let arc = arc.transformed(Affine::translate(centre.to_vec2()) * self.scale_linear());
        let to = arc.point(arc.start + arc.sweep);
        if self.is_down {
            self.begin(command.line);
            self.path.arc_to(arc, to);
        }
        self.at = to;
        self.budget.spend_count(1)
    }

    /// The scale without its origin.
    fn scale_linear(&self) -> Affine {
        let [a, b, c, d, ..] = self.to_units().as_coeffs();
        Affine::new([a, b, c, d, 0.0, 0.0])
    }

    fn circle(&mut self, numbers: &[f64], line: u64, notes: &mut Notes) -> Result<(), ReadError> {
        let Some(&radius) = numbers.first().filter(|radius| **radius != 0.0) else {
            notes.add("a circle without a radius is left out", line);
            return Ok(());
        };
        let arc = circular(Point::ORIGIN, radius.abs(), 0.0, TAU);
        let arc = arc.transformed(Affine::translate(self.at.to_vec2()) * self.scale_linear());
        self.whole(arc, false, line)
    }

    /// A closed arc of its own.
    fn whole(&mut self, arc: Arc, is_filled: bool, line: u64) -> Result<(), ReadError> {
        let start = arc.point(arc.start);
        let contour = Contour { start, segments: vec![Segment::Arc(arc)], is_closed: true };
        self.flush()?;
        self.add(vec![contour], is_filled, line)
    }

    fn rectangle(&mut self, command: &Command, notes: &mut Notes) -> Result<(), ReadError> {
        let &[x, y, ..] = command.numbers.as_slice() else {
            notes.add("a rectangle with numbers that do not fit is left out", command.line);
            return Ok(());
        };
        let is_relative = command.name[1] == b'R';
        let way = match is_relative {
            true => Vec2::new(x, y),
            false => {
                let to = self.to_units() * Point::new(x, y) - self.at;
                (self.scale_linear().inverse() * to.to_point()).to_vec2()
            }
        };
        let mut pen = Pen::default();
        pen.move_to(self.at);
        for (x, y) in [(way.x, 0.0), (way.x, way.y), (0.0, way.y)] {
            pen.line_to(self.at + self.way(x, y));
        }
        pen.close();
        self.flush()?;
        self.add(pen.take(), command.name[0] == b'R', command.line)
    }

    fn wedge(&mut self, command: &Command, notes: &mut Notes) -> Result<(), ReadError> {
        let &[radius, start, sweep, ..] = command.numbers.as_slice() else {
            notes.add("a wedge with numbers that do not fit is left out", command.line);
            return Ok(());
        };
        let is_filled = &command.name == b"WG";
        let (start, sweep) = (start.to_radians(), sweep.clamp(-360.0, 360.0).to_radians());
        // A negative radius turns the start by half a turn: so does the circle's point.
        let arc = circular(Point::ORIGIN, radius, start, sweep);
        let arc = arc.transformed(Affine::translate(self.at.to_vec2()) * self.scale_linear());
        if radius == 0.0 || sweep == 0.0 {
            notes.add("a wedge without a size is left out", command.line);
            return Ok(());
        }
        if sweep.abs() >= TAU {
            return self.whole(arc, is_filled, command.line);
        }
        let mut pen = Pen::default();
        pen.move_to(self.at);
        pen.line_to(arc.point(arc.start));
        pen.arc_to(arc, arc.point(arc.start + arc.sweep));
        pen.close();
        self.flush()?;
        self.add(pen.take(), is_filled, command.line)
    }

    fn polygon_mode(&mut self, numbers: &[f64], line: u64) -> Result<(), ReadError> {
        match numbers.first().copied().unwrap_or(0.0) as i64 {
            0 => {
                self.flush()?;
                self.polygon = Some(Vec::new());
            }
            1 | 2 if self.polygon.is_some() => {
                self.path.close();
                self.flush()?;
            }
            _ => {}
        }
        self.path_line = line;
        Ok(())
    }

    fn polygon_drawn(&mut self, is_filled: bool, line: u64) -> Result<(), ReadError> {
        self.flush()?;
        if let Some(contours) = self.polygon.take() {
            // They are in metres already.
            let back = Affine::scale(1.0 / UNIT);
            let contours: Vec<Contour> = contours.iter().map(|it| it.transformed(back)).collect();
            self.add(contours, is_filled, line)?;
        }
        Ok(())
    }

    fn corners_given(&mut self, numbers: &[f64], line: u64, notes: &mut Notes) {
        self.corners = match *numbers {
            [x1, y1, x2, y2, ..] => [Point::new(x1, y1), Point::new(x2, y2)],
            [x, y] => [Point::new(x, y), Point::new(x, y) + (self.corners[1] - self.corners[0])],
            [] => [Point::ORIGIN, SECOND],
            _ => {
                notes.add("IP with numbers that do not fit is left out", line);
                self.corners
            }
        };
    }

    fn scaled(&mut self, numbers: &[f64], line: u64, notes: &mut Notes) {
        let kind = numbers.get(4).copied().unwrap_or(0.0);
        let [p1, p2] = self.corners;
        let scale = match *numbers {
            [] => Some(Affine::IDENTITY),
            // The factors themselves: plotter units in a unit of the file.
            [x0, fx, y0, fy, ..] if kind == 2.0 => {
                let by = Affine::scale_non_uniform(fx, fy);
                Some(Affine::translate(p1.to_vec2()) * by * Affine::translate((-x0, -y0)))
            }
            [x0, x1, y0, y1, ..] => {
                let (mut fx, mut fy) = ((p2.x - p1.x) / (x1 - x0), (p2.y - p1.y) / (y1 - y0));
                let mut origin = p1;
                if kind == 1.0 {
                    // Both alike, in the middle of the rectangle where the file does not say else.
                    let least = fx.abs().min(fy.abs());
                    let share = |place: usize| numbers.get(place).map_or(0.5, |it| it / 100.0);
                    let spare = Vec2::new(
                        (p2.x - p1.x).abs() - least * (x1 - x0).abs(),
                        (p2.y - p1.y).abs() - least * (y1 - y0).abs(),
                    );
                    origin += Vec2::new(
                        spare.x * share(5) * (p2.x - p1.x).signum(),
                        spare.y * share(6) * (p2.y - p1.y).signum(),
                    );
                    (fx, fy) = (least.copysign(fx), least.copysign(fy));
                }
                let by = Affine::scale_non_uniform(fx, fy);
                Some(Affine::translate(origin.to_vec2()) * by * Affine::translate((-x0, -y0)))
            }
            _ => None,
        };
        match scale {
            Some(scale) if scale.is_finite() && scale.determinant() != 0.0 => self.scale = scale,
            _ => notes.add("SC with numbers that do not fit is left out", line),
        }
        if self.corners == [Point::ORIGIN, SECOND] && !numbers.is_empty() && kind != 2.0 {
            notes.add("SC without IP: the size is that of an A4 plotter, check it", line);
        }
    }

    /// Turns what follows about the origin, by quarters.
    fn turned(&mut self, numbers: &[f64], line: u64, notes: &mut Notes) {
        self.turn = match numbers.first().copied().unwrap_or(0.0) {
            0.0 => Affine::IDENTITY,
            90.0 => Affine::new([0.0, 1.0, -1.0, 0.0, 0.0, 0.0]),
            180.0 => Affine::new([-1.0, 0.0, 0.0, -1.0, 0.0, 0.0]),
            270.0 => Affine::new([0.0, -1.0, 1.0, 0.0, 0.0, 0.0]),
            _ => {
                notes.add("RO by other than quarters of a turn is left out", line);
                return;
            }
        };
    }
}

/// A contour that ends where it began is a loop.
fn closed(contour: Contour) -> Contour {
    let is_closed = contour.is_closed || contour.end() == contour.start;
    Contour { is_closed, ..contour }
}
