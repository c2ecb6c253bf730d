//! A font of single strokes for engraving: its letters are lines and arcs that a laser follows once.

mod glyphs;

use kurbo::{Point, Vec2};
use messages::math;

use crate::text::layout::{Glyph, check, lines, missing, set};
use crate::text::{Height, Text};
use crate::{Arc, Colour, Contour, ReadError, Segment, Shape};
use glyphs::{CAP, EM, GAP, SPACE, strokes};

/// A text as open and closed strokes. It has ASCII, German umlauts and ß, and ° µ Ø ø ± ⌀; capitals are
/// seven tenths of the em high.
///
/// # Errors
///
/// Where there is no glyph for a character, which is named, or a setting is out of its range; the error's
/// line is that of the text.
pub fn set_text(text: &Text<'_>) -> Result<Shape, ReadError> {
    check(text)?;
    let em = match text.height {
        Height::Em(em) => em,
        Height::Cap(height) => height * EM / CAP,
    };
    let line = |(number, line): (usize, &str)| {
        line.chars()
            .map(|character| {
                let help = "printable ASCII, German umlauts, or one of ° µ Ø ø ± ⌀";
                glyph(character).ok_or_else(|| missing(number, character, help))
            })
            .collect::<Result<Vec<Glyph>, ReadError>>()
    };
    let glyphs = lines(text.text).enumerate().map(line).collect::<Result<_, _>>()?;
    let contours = set(text, em, glyphs)?;
    Ok(Shape { contours, stroke: Some(Colour::BLACK), ..Shape::default() })
}

/// A glyph in em; `None` where the font has none.
fn glyph(character: char) -> Option<Glyph> {
    if character == ' ' {
        return Some(Glyph { advance: SPACE / EM, contours: Vec::new() });
    }
    let contours: Vec<Contour> = strokes(character)?.split(';').filter_map(stroke).collect();
    let right = contours.iter().map(|contour| contour.bounds().x1).fold(0.0, f64::max);
    Some(Glyph { advance: right + GAP / EM, contours })
}

/// A stroke from its points; see [`strokes`].
fn stroke(points: &str) -> Option<Contour> {
    let mut points = points.split_whitespace().filter_map(point);
    let (start, _) = points.next()?;
    let mut contour = Contour { start, segments: Vec::new(), is_closed: false };
    for (end, quarters) in points {
        let from = contour.end();
        contour.segments.push(if quarters == 0.0 {
            Segment::Line(end)
        } else {
            arc(from, end, quarters)
        });
    }
    contour.is_closed = (contour.end() - start).hypot() < 1e-9;
    Some(contour)
}

/// A point in em, and how many quarter turns counterclockwise an arc takes to it; 0 is a line.
fn point(token: &str) -> Option<(Point, f64)> {
    let quarters = match token.as_bytes().last()? {
        b'l' => 1.0,
        b'r' => -1.0,
        b'L' => 2.0,
        b'R' => -2.0,
        _ => 0.0,
    };
    let (x, y) = token.trim_end_matches(['l', 'r', 'L', 'R']).split_once(',')?;
    let number = |text: &str| Some(text.parse::<f64>().ok()? / EM);
    Some((Point::new(number(x)?, number(y)?), quarters))
}

/// An arc between points by quarter turns.
fn arc(from: Point, to: Point, quarters: f64) -> Segment {
    let sweep = quarters * math::TURN / 4.0;
    let chord = to - from;
    let left = Vec2::new(-chord.y, chord.x);
    // Half the chord over the tangent of half the sweep, to the left: none for half a turn.
    let away = if quarters.abs() == 1.0 { 0.5 * quarters } else { 0.0 };
    let centre = from.midpoint(to) + left * away;
    let major = from - centre;
    Segment::Arc(Arc { centre, major, minor: Vec2::new(-major.y, major.x), start: 0.0, sweep })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text::Align;

    const PLAIN: Text<'_> = Text {
        text: "H",
        height: Height::Cap(0.007),
        letter_spacing: 0.0,
        line_spacing: 1.5,
        align: Align::Left,
        radius: None,
    };

    #[test]
    fn every_promised_character_has_strokes_in_its_box() {
        for character in ('!'..='~').chain("°µμØø±⌀ÄÖÜäöüß".chars()) {
            let strokes = strokes(character).unwrap_or_else(|| panic!("no {character}"));
            let glyph = glyph(character).expect("a glyph");
            assert_eq!(glyph.contours.len(), strokes.split(';').count(), "{character}");
            for (contour, stroke) in glyph.contours.iter().zip(strokes.split(';')) {
                let points = stroke.split_whitespace().count();
                assert_eq!(contour.segments.len() + 1, points, "{character}: {stroke}");
                let bounds = contour.bounds();
                assert!(bounds.x0 > -1e-9 && bounds.x1 < 0.61, "{character}: {bounds}");
                assert!(bounds.y0 > -0.21 && bounds.y1 < 0.87, "{character}: {bounds}");
                for (start, segment) in contour.pieces() {
                    let off = segment.point(start, 0.0) - start;
                    assert!(off.hypot() < 1e-12, "{character}: {off:?}");
                }
            }
        }
    }

    #[test]
    fn arcs_end_where_they_are_said_to() {
        for (quarters, middle) in [(1.0, (1.0, -0.414_213_562)), (-2.0, (1.0, 1.0))] {
            let (from, to) = (Point::ORIGIN, Point::new(2.0, 0.0));
            let arc = arc(from, to, quarters);
            assert!((arc.end() - to).hypot() < 1e-12);
            assert!((arc.point(from, 0.5) - Point::from(middle)).hypot() < 1e-8, "{quarters}");
        }
    }

    #[test]
    fn capitals_are_as_high_as_asked_and_letters_follow() {
        let shape = set_text(&Text { text: "HI", ..PLAIN }).expect("a valid text");
        let ends: Vec<(Point, Point)> =
            shape.contours.iter().map(|contour| (contour.start, contour.end())).collect();
        let at = |x: f64, y: f64| Point::new(x * 1e-3, y * 1e-3);
        let expected = [
            (at(0.0, 0.0), at(0.0, 7.0)),
            (at(4.0, 0.0), at(4.0, 7.0)),
            (at(0.0, 3.5), at(4.0, 3.5)),
            (at(6.0, 0.0), at(6.0, 7.0)),
        ];
        for (one, other) in ends.iter().zip(expected) {
            assert!((one.0 - other.0).hypot() + (one.1 - other.1).hypot() < 1e-12, "{one:?}");
        }
        assert!(shape.fill.is_none() && shape.contours.iter().all(|one| !one.is_closed));
    }

    #[test]
    fn a_character_without_strokes_is_named() {
        let error = set_text(&Text { text: "A\nЖ", ..PLAIN }).expect_err("refused");
        assert_eq!(error.message, "the font has no glyph for 'Ж' (U+0416)");
        assert_eq!(error.line, Some(2));
    }
}
