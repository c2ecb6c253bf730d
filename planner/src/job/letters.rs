//! The letters N, A, S and O of source 003 at any height, in three styles.
//!
//! Coordinates are in letter heights from the lower left corner, x to the right. The lines are
//! those of `machines/thesis.md`: S is two elliptic arcs that meet with a jump of curvature, O one
//! ellipse counter-clockwise from the right.

use core::f64::consts::{FRAC_PI_2, PI, TAU};

use kurbo::{Point, Rect};
use nalgebra::Vector3;

use crate::drawing::{Action, Curve, Drawing, Power, Step};

/// Space between two letters, in heights. The source has single letters only.
const SPACING: f64 = 0.25;

/// Height of the bar of A, and how far it is inset on either side, in heights and in widths.
const BAR: (f64, f64) = (0.4, 0.2);

/// How far to the left of the letters the tool rests in style h2, in heights.
const REST: f64 = 2.0;

/// How letters are drawn. Both conventions reproduce source 003 table 3-1; neither is proven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// The shapes of h1 as true curves, without a stop on them.
    Curves,
    /// Chord by chord, 19 for S and 20 for O, from the centre and without return.
    H1,
    /// Chord by chord, 61 for S and 63 for O, from two heights to the left and back again.
    H2,
}

machine::keyword! {
    Style, "a style",
    "curves" => Self::Curves,
    "h1" => Self::H1,
    "h2" => Self::H2,
}

/// One of the letters that the source draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Letter {
    /// Three lines.
    N,
    /// Two lines and a bar.
    A,
    /// Two arcs.
    S,
    /// An ellipse.
    O,
}

impl Letter {
    /// The letter of a character, in either case.
    pub fn from_character(character: char) -> Option<Self> {
        match character.to_ascii_uppercase() {
            'N' => Some(Self::N),
            'A' => Some(Self::A),
            'S' => Some(Self::S),
            'O' => Some(Self::O),
            _ => None,
        }
    }

    /// Width over height.
    fn width(self, style: Style) -> f64 {
        match (style, self) {
            (Style::Curves | Style::H1, Self::N) | (Style::H2, Self::A) => 0.9,
            (Style::Curves | Style::H1, Self::A) | (Style::H2, Self::N) => 0.8,
            (Style::Curves | Style::H1, Self::S | Self::O) => 1.0,
            (Style::H2, Self::S) => 0.6,
            (Style::H2, Self::O) => 0.4,
        }
    }

    /// Chords that a curved letter is drawn with; `None` for true curves.
    fn chords(self, style: Style) -> Option<usize> {
        match (style, self) {
            (Style::Curves, _) => None,
            (Style::H1, Self::S) => Some(19),
            (Style::H1, _) => Some(20),
            (Style::H2, Self::S) => Some(61),
            (Style::H2, _) => Some(63),
        }
    }

    /// Its lines, in heights.
    fn curves(self, style: Style) -> Vec<Curve> {
        let width = self.width(style);
        let chords = self.chords(style);
        let arc = |height: f64, half: f64, start: f64, sweep: f64| Curve::Arc {
            centre: Vector3::new(width / 2.0, height, 0.0),
            major: Vector3::new(width / 2.0, 0.0, 0.0),
            minor: Vector3::new(0.0, half, 0.0),
            start,
            sweep,
            rise: Vector3::zeros(),
        };
        match self {
            Self::N => lines(&[(0.0, 0.0), (0.0, 1.0), (width, 0.0), (width, 1.0)]),
            Self::A => {
                let (height, inset) = BAR;
                let mut curves = lines(&[(0.0, 0.0), (width / 2.0, 1.0), (width, 0.0)]);
                curves.extend(lines(&[(inset * width, height), ((1.0 - inset) * width, height)]));
                curves
            }
            Self::S => {
                let upper = arc(0.75, 0.25, 0.0, 1.5 * PI);
                let lower = arc(0.25, 0.25, FRAC_PI_2, -1.5 * PI);
                match chords {
                    None => vec![upper, lower],
                    Some(count) => {
                        let mut curves = chord_lines(&upper, count / 2);
                        curves.extend(chord_lines(&lower, count - count / 2));
                        curves
                    }
                }
            }
            Self::O => {
                let whole = arc(0.5, 0.5, 0.0, TAU);
                chords.map_or_else(|| vec![whole], |count| chord_lines(&whole, count))
            }
        }
    }
}

/// The lines through `points`.
fn lines(points: &[(f64, f64)]) -> Vec<Curve> {
    let point = |&(x, y): &(f64, f64)| Vector3::new(x, y, 0.0);
    points
        .windows(2)
        .map(|pair| Curve::Line { from: point(&pair[0]), to: point(&pair[1]) })
        .collect()
}

/// `count` chords of `curve`.
fn chord_lines(curve: &Curve, count: usize) -> Vec<Curve> {
    let point = |index: usize| curve.point(index as f64 / count as f64);
    (0..count).map(|index| Curve::Line { from: point(index), to: point(index + 1) }).collect()
}

/// `curve` at `scale` from `origin`.
fn placed(curve: &Curve, scale: f64, origin: Vector3<f64>) -> Curve {
    match *curve {
        Curve::Line { from, to } => {
            Curve::Line { from: origin + from * scale, to: origin + to * scale }
        }
        Curve::Arc { centre, major, minor, start, sweep, rise } => Curve::Arc {
            centre: origin + centre * scale,
            major: major * scale,
            minor: minor * scale,
            start,
            sweep,
            rise: rise * scale,
        },
    }
}

/// Draws `text` in a row of `height` [m] around `home` [m], each line with `power`, as asked for in
/// `line` of the job.
pub fn draw(
    text: &[Letter],
    height: f64,
    style: Style,
    power: Power,
    home: Vector3<f64>,
    line: u64,
) -> Drawing {
    let spaces = text.len().saturating_sub(1) as f64;
    let width: f64 = text.iter().map(|letter| letter.width(style)).sum::<f64>() + SPACING * spaces;
    let left = if style == Style::H2 { -REST } else { 0.0 };
    // The middle of all that the tool passes over, letters and place of rest, goes to `home`.
    let middle = Vector3::new((left + width) / 2.0, 0.5, 0.0);
    let corner = home - middle * height;
    let start = if style == Style::H2 { corner + Vector3::x() * (left * height) } else { home };
    let mut steps = Vec::new();
    let mut origin = corner;
    for letter in text {
        for curve in letter.curves(style) {
            let curve = placed(&curve, height, origin);
            steps.push(Step { action: Action::Mark { curve, speed: None, power }, line });
            if style != Style::Curves {
                // The conventions stop after every chord, also where two of S are all but straight.
                steps.push(Step { action: Action::Dwell { time: 0.0, lit: None }, line });
            }
        }
        origin.x += (letter.width(style) + SPACING) * height;
    }
    if style == Style::H2 {
        steps.push(Step { action: Action::Rapid { to: start }, line });
    }
    let name = text.iter().map(|letter| format!("{letter:?}")).collect();
    Drawing { name, start, steps, notes: Vec::new() }
}

/// Points along the lines of `drawing` [m].
pub(super) fn points(drawing: &Drawing) -> impl Iterator<Item = Point> + '_ {
    /// Chords of a curve: as many to a quarter turn of every arc.
    const CHORDS: u8 = 96;
    let curves = drawing.steps.iter().filter_map(|step| match &step.action {
        Action::Mark { curve, .. } => Some(curve),
        _ => None,
    });
    curves.flat_map(|curve| {
        (0..=CHORDS).map(|chord| {
            let point = curve.point(f64::from(chord) / f64::from(CHORDS));
            Point::new(point.x, point.y)
        })
    })
}

/// The smallest upright rectangle around the lines of `drawing` [m]; `None` where it has none.
pub(super) fn bounds(drawing: &Drawing) -> Option<Rect> {
    points(drawing)
        .map(|point| Rect::from_points(point, point))
        .reduce(|one, other| one.union(other))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use serde_json::Value;

    const POWER: Power = Power { level: 1.0, follows_speed: false };

    /// Every chord of every letter against the golden strokes.
    fn check(style: Style, convention: &str, offset: f64) {
        let text =
            include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/golden/letters.json"));
        let golden: Value = serde_json::from_str(text).unwrap();
        for (name, letter) in
            [("N", Letter::N), ("A", Letter::A), ("S", Letter::S), ("O", Letter::O)]
        {
            let expected = &golden[convention]["letters"][name];
            assert_eq!(expected["width_over_height"].as_f64().unwrap(), letter.width(style));
            let strokes = expected["strokes"].as_array().unwrap();
            let curves = letter.curves(style);
            assert_eq!(curves.len(), strokes.len(), "{name}");
            for (curve, stroke) in curves.iter().zip(strokes) {
                for (found, expected) in [(curve.from(), &stroke[0]), (curve.to(), &stroke[1])] {
                    let x = expected[0].as_f64().unwrap() - offset;
                    let y = expected[1].as_f64().unwrap();
                    let off = (found - Vector3::new(x, y, 0.0)).norm();
                    assert!(off < 1e-12, "{name}: {found} instead of {x} {y}");
                }
            }
        }
    }

    #[test]
    fn h1_draws_the_golden_chords() {
        check(Style::H1, "H1_literal_J500", 0.0);
    }

    #[test]
    fn h2_draws_the_golden_chords() {
        check(Style::H2, "H2_table_replica", 2.0);
    }

    #[test]
    fn a_row_is_centred_at_home() {
        let home = Vector3::new(0.1, 0.1, 0.0);
        let text = [Letter::N, Letter::A, Letter::S, Letter::O];
        let drawing = draw(&text, 0.02, Style::Curves, POWER, home, 1);
        assert_eq!(drawing.start, home);
        assert_eq!(drawing.name, "NASO");
        let Action::Mark { curve, .. } = &drawing.steps[0].action else { panic!() };
        // 3.7 heights of letters and three spaces: half of 89 mm to the left, 10 mm down.
        assert!((curve.from() - Vector3::new(0.0555, 0.09, 0.0)).norm() < 1e-15);
        let last = drawing.steps.last().unwrap();
        let Action::Mark { curve, .. } = &last.action else { panic!() };
        assert!((curve.to() - Vector3::new(0.1445, 0.1, 0.0)).norm() < 1e-15);
    }
}
