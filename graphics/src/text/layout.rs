//! Glyphs side by side on lines, straight or on an arc.

use kurbo::{Affine, Vec2};
use messages::math;

use super::{Align, Height, MOST_BYTES, Text};
use crate::{Contour, ReadError};

/// A glyph of a line, in em.
pub(crate) struct Glyph {
    /// How far it leads on.
    pub(crate) advance: f64,
    /// Its curves, from the pen's place on the baseline.
    pub(crate) contours: Vec<Contour>,
}

/// The lines of a text; `\r` before `\n` is no part of them.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.split('\n').map(|line| line.strip_suffix('\r').unwrap_or(line))
}

/// That a text can be set.
pub(crate) fn check(text: &Text<'_>) -> Result<(), ReadError> {
    let refuse = |name: &str, value: f64, range: &str| {
        Err(ReadError::new(format!("the {name} of the text is {value}"), range))
    };
    let (Height::Cap(height) | Height::Em(height)) = text.height;
    if !(1e-6..=10.0).contains(&height) {
        return refuse("height", height, "from 0.000001 m to 10 m");
    }
    if text.letter_spacing.is_nan() || text.letter_spacing.abs() > 10.0 {
        return refuse("letter spacing", text.letter_spacing, "from -10 m to 10 m");
    }
    if !(0.1..=10.0).contains(&text.line_spacing) {
        return refuse("line spacing", text.line_spacing, "from 0.1 to 10 em");
    }
    if let Some(radius) = text.radius
        && !(1e-6..=1e4).contains(&radius.abs())
    {
        return refuse("radius", radius, "from 0.000001 m to 10000 m, or as much below 0");
    }
    if text.text.len() > MOST_BYTES {
        return refuse("length", text.text.len() as f64, "at most 100000 bytes");
    }
    Ok(())
}

/// No character may be left out.
pub(crate) fn missing(line: usize, character: char, help: &str) -> ReadError {
    let code = u32::from(character);
    let shown = if character.is_control() { ' ' } else { character };
    let message = format!("the font has no glyph for '{shown}' (U+{code:04X})");
    ReadError::new(message, help).at_line(line as u64 + 1)
}

/// Sets lines of glyphs, where an em is so long [m].
pub(crate) fn set(
    text: &Text<'_>,
    em: f64,
    lines: Vec<Vec<Glyph>>,
) -> Result<Vec<Contour>, ReadError> {
    let mut contours = Vec::new();
    for (number, line) in lines.into_iter().enumerate() {
        let gaps = line.len().saturating_sub(1) as f64;
        let width =
            line.iter().map(|glyph| glyph.advance * em).sum::<f64>() + gaps * text.letter_spacing;
        let y = -(number as f64) * text.line_spacing * em;
        let mut x = match text.align {
            Align::Left => 0.0,
            Align::Centre => -width / 2.0,
            Align::Right => -width,
        };
        if let Some(radius) = text.radius {
            check_arc(number, width, radius, y)?;
        }
        for glyph in line {
            let advance = glyph.advance * em;
            let place = match text.radius {
                None => Affine::translate((x, y)),
                Some(radius) => {
                    on_arc(x + advance / 2.0, y, radius) * Affine::translate((-advance / 2.0, 0.0))
                }
            } * Affine::scale(em);
            contours.extend(glyph.contours.iter().map(|contour| contour.transformed(place)));
            x += advance + text.letter_spacing;
        }
    }
    Ok(contours)
}

/// That a line has an arc of its own that it does not go around more than once.
fn check_arc(line: usize, width: f64, radius: f64, y: f64) -> Result<(), ReadError> {
    let own = radius + y;
    let round = math::TURN * own.abs();
    if own * radius <= 0.0 || width > round {
        let around = if own * radius <= 0.0 { 0.0 } else { round };
        let message = format!("the line is {width:.6} m long and its circle {around:.6} m around");
        return Err(
            ReadError::new(message, "a larger radius or a smaller text").at_line(line as u64 + 1)
        );
    }
    Ok(())
}

/// From the middle of a glyph on its baseline to its place on the arc, `x` along it.
fn on_arc(x: f64, y: f64, radius: f64) -> Affine {
    let own = radius + y;
    let angle = x / own;
    let (sine, cosine) = math::sin_cos(angle);
    let turn = Affine::new([cosine, -sine, sine, cosine, 0.0, 0.0]);
    Affine::translate(Vec2::new(own * sine, own * cosine - radius)) * turn
}
