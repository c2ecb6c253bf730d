//! Hatches: the outlines that they fill.

use core::f64::consts::TAU;

use kurbo::{Affine, Point, Vec2};
use messages::math;

use super::codes::Pair;
use super::record::Record;
use super::spline::Spline;
use crate::read::arcs::{bulged, circular};
use crate::read::pen::Pen;
use crate::shape::{Arc, Contour};

/// Edges that are no farther apart meet [m].
const TOUCHING: f64 = 1e-9;

/// Bit of a path's kind: it has vertices instead of edges.
const IS_POLYLINE: i64 = 2;

/// The codes that follow the last path.
const AFTER_PATHS: [i32; 2] = [75, 76];

/// The outlines of a hatch, each closed; `None` where its numbers do not fit each other.
pub(super) fn outlines(record: &Record<'_, '_>, by: Affine) -> Option<Vec<Contour>> {
    let begin = record.pairs.iter().position(|pair| pair.code == 91)?;
    let pairs = record.pairs.get(begin + 1..)?;
    let end = pairs.iter().position(|pair| AFTER_PATHS.contains(&pair.code));
    let pairs = pairs.get(..end.unwrap_or(pairs.len()))?;
    let mut pen = Pen::default();
    let mut rest = pairs;
    while let Some(begin) = rest.iter().position(|pair| pair.code == 92) {
        let (head, after) = rest.get(begin..)?.split_first()?;
        let end = after.iter().position(|pair| pair.code == 92).unwrap_or(after.len());
        let (own, next) = after.split_at(end);
        rest = next;
        if head.whole()? & IS_POLYLINE != 0 {
            polyline(own, by, &mut pen)?;
        } else {
            edges(own, by, &mut pen)?;
        }
    }
    Some(pen.take())
}

/// The first value of a code.
fn real(pairs: &[Pair<'_>], code: i32) -> Option<f64> {
    pairs.iter().find(|pair| pair.code == code)?.real()
}

fn whole(pairs: &[Pair<'_>], code: i32) -> Option<i64> {
    pairs.iter().find(|pair| pair.code == code)?.whole()
}

fn point(pairs: &[Pair<'_>], code: i32) -> Option<Point> {
    Some(Point::new(real(pairs, code)?, real(pairs, code + 10)?))
}

/// Vertices with bulges, closed.
fn polyline(pairs: &[Pair<'_>], by: Affine, pen: &mut Pen) -> Option<()> {
    let mut vertices: Vec<(Point, f64)> = Vec::new();
    for pair in pairs {
        match (pair.code, pair.real()) {
            (10, Some(x)) => vertices.push((Point::new(x, 0.0), 0.0)),
            (20, Some(y)) => vertices.last_mut()?.0.y = y,
            (42, Some(bulge)) => vertices.last_mut()?.1 = bulge,
            _ => {}
        }
    }
    let first = vertices.first()?.0;
    pen.move_to(by * first);
    let ends = vertices.iter().skip(1).map(|&(at, _)| at).chain([first]);
    for (&(from, bulge), to) in vertices.iter().zip(ends) {
        match bulged(from, to, bulge) {
            Some(arc) => pen.arc_to(arc.transformed(by), by * to),
            None => pen.line_to(by * to),
        }
    }
    pen.close_here();
    Some(())
}

/// Edges, each from its code 72 to the next one.
fn edges(pairs: &[Pair<'_>], by: Affine, pen: &mut Pen) -> Option<()> {
    let mut rest = pairs;
    let mut start: Option<Point> = None;
    let meets = |one: Point, other: Point| (one - other).hypot() <= TOUCHING;
    while let Some(begin) = rest.iter().position(|pair| pair.code == 72) {
        let (head, after) = rest.get(begin..)?.split_first()?;
        let end = after.iter().position(|pair| pair.code == 72).unwrap_or(after.len());
        let (own, next) = after.split_at(end);
        rest = next;
        let mut edge = Pen::default();
        match head.whole()? {
            1 => {
                edge.move_to(by * point(own, 10)?);
                edge.line_to(by * point(own, 11)?);
            }
            2 => {
                let radius = real(own, 40).filter(|radius| *radius > 0.0)?;
                let (start, sweep) = angles(own)?;
                arc(circular(point(own, 10)?, radius, start, sweep), by, &mut edge);
            }
            3 => {
                let ratio = real(own, 40).filter(|ratio| *ratio > 0.0)?;
                let major = point(own, 11)?.to_vec2();
                let minor = Vec2::new(-major.y, major.x) * ratio;
                let (start, sweep) = angles(own)?;
                // The file gives true angles, of which the ellipse's own are within the same quarter.
                let own_angle = |angle: f64| {
                    let (sine, cosine) = math::sin_cos(angle);
                    let turns = ((angle + TAU / 2.0) / TAU).floor();
                    math::atan2(sine / ratio, cosine) + turns * TAU
                };
                let from = own_angle(start);
                let sweep =
                    if sweep.abs() >= TAU { sweep } else { own_angle(start + sweep) - from };
                let whole = Arc { centre: point(own, 10)?, major, minor, start: from, sweep };
                arc(whole, by, &mut edge);
            }
            4 => spline(own, by, &mut edge)?,
            _ => return None,
        }
        for contour in edge.take() {
            if start.is_none() {
                pen.move_to(contour.start);
                start = Some(contour.start);
            }
            // Edges meet to rounding; what is apart is joined by a line.
            if !meets(pen.at(), contour.start) {
                pen.line_to(contour.start);
            }
            pen.extend(&contour);
        }
    }
    if meets(pen.at(), start?) {
        pen.close_here()
    } else {
        pen.close()
    }
    Some(())
}

/// Start and sweep of an arc: angles of one that runs clockwise are counted clockwise as well.
fn angles(pairs: &[Pair<'_>]) -> Option<(f64, f64)> {
    let (start, end) = (real(pairs, 50)?, real(pairs, 51)?);
    let sweep = super::draw::turn(end - start, 360.0).to_radians();
    let sign = if whole(pairs, 73) == Some(0) { -1.0 } else { 1.0 };
    Some((sign * start.to_radians(), sign * sweep))
}

fn arc(arc: Arc, by: Affine, pen: &mut Pen) {
    let arc = arc.transformed(by);
    pen.move_to(arc.point(arc.start));
    pen.arc_to(arc, arc.point(arc.start + arc.sweep));
}

fn spline(pairs: &[Pair<'_>], by: Affine, pen: &mut Pen) -> Option<()> {
    let reals = |code: i32| -> Vec<f64> {
        pairs.iter().filter(|pair| pair.code == code).filter_map(Pair::real).collect()
    };
    // The points that it was made through follow code 97.
    let (xs, ys, weights) = (reals(10), reals(20), reals(42));
    let weight = |index: usize| weights.get(index).copied().unwrap_or(1.0);
    let controls = xs.iter().zip(&ys).enumerate();
    let spline = Spline {
        degree: usize::try_from(whole(pairs, 94)?).ok()?,
        knots: reals(40),
        controls: controls
            .map(|(index, (&x, &y))| (by * Point::new(x, y), weight(index)))
            .collect(),
    };
    spline.draw(pen).then_some(())
}
