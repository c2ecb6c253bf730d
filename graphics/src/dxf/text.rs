//! Texts: what is written, and how it is set.

use kurbo::{Affine, Vec2};
use messages::math;

use super::record::Record;
use crate::read::bounds;
use crate::shape::{Contour, Fill, FillRule};
use crate::single_line;
use crate::text::{Align, Height, Text};

/// Distance of baselines in heights of a capital letter (DXF reference, MTEXT).
const LINE: f64 = 5.0 / 3.0;

/// How far a letter reaches below the baseline, in heights of a capital letter.
const DESCENT: f64 = 0.3;

/// The curves of a text in the plane that it is written on, and whether they are filled.
#[derive(Debug)]
pub(super) struct Lettering {
    pub(super) contours: Vec<Contour>,
    pub(super) fill: Option<FillRule>,
}

/// How far up from the baseline a text is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Level {
    Baseline,
    Bottom,
    Middle,
    Top,
}

/// A text of one line, TEXT or ATTRIB; `None` where it has no place or height.
///
/// # Errors
/// Where a font lacks a character, with the words that say so.
pub(super) fn single(
    record: &Record<'_, '_>,
    is_outlined: bool,
) -> Option<Result<Lettering, String>> {
    let first = record.space(10)?;
    let height = record.real(40).filter(|height| *height > 0.0)?;
    let written = plain(record.text(1).unwrap_or(""));
    let (across, up) = (record.flags(72), record.flags(73));
    let second = record.space(11).filter(|_| across != 0 || up != 0);
    let place = second.unwrap_or(first);
    let mut wide = record.real(41).filter(|wide| *wide > 0.0).unwrap_or(1.0);
    let mut angle = record.real(50).unwrap_or(0.0).to_radians();
    let (align, level) = match across {
        1 => (Align::Centre, level(up)),
        2 => (Align::Right, level(up)),
        4 => (Align::Centre, Level::Middle),
        _ => (Align::Left, level(up)),
    };
    let lettering = match set(&written, height, align, is_outlined) {
        Ok(lettering) => lettering,
        Err(error) => return Some(Err(error)),
    };
    let mut high = 1.0;
    let mut place = Vec2::new(place[0], place[1]);
    if let (3 | 5, Some(second)) = (across, second) {
        // Between two points: as large, or as wide, as fits.
        let first = Vec2::new(first[0], first[1]);
        let way = Vec2::new(second[0], second[1]) - first;
        let width = bounds(&lettering.contours).map_or(0.0, |bounds| bounds.x1.max(0.0));
        if width > 0.0 && way.hypot() > 0.0 {
            wide = way.hypot() / width;
            high = if across == 3 { wide } else { 1.0 };
            angle = math::atan2(way.y, way.x);
        }
        place = first;
    }
    let lift = Affine::translate((0.0, -height * lift(level)));
    let slant = math::tan(record.real(51).unwrap_or(0.0).clamp(-85.0, 85.0).to_radians());
    let flags = record.flags(71);
    let mirror = |bit: i64| if flags & bit != 0 { -1.0 } else { 1.0 };
    let shape = Affine::scale_non_uniform(wide * mirror(2), high * mirror(4))
        * Affine::new([1.0, 0.0, slant, 1.0, 0.0, 0.0]);
    Some(Ok(lettering.placed(Affine::translate(place) * turn(angle) * shape * lift)))
}

/// A text of several lines, MTEXT; see [`single`].
pub(super) fn several(
    record: &Record<'_, '_>,
    is_outlined: bool,
) -> Option<Result<Lettering, String>> {
    let place = record.space(10)?;
    let height = record.real(40).filter(|height| *height > 0.0)?;
    // Long texts come in parts of 250 characters, the last one under code 1.
    let parts = record.pairs.iter().filter(|pair| matches!(pair.code, 1 | 3));
    let written = formatted(&parts.map(super::codes::Pair::text).collect::<String>());
    let attached = record.whole(71).filter(|at| (1..=9).contains(at)).unwrap_or(1) - 1;
    let align = [Align::Left, Align::Centre, Align::Right][(attached % 3) as usize];
    let width = record.real(41).filter(|width| *width > 0.0);
    let lines = match wrapped(&written, height, width, is_outlined) {
        Ok(lines) => lines,
        Err(error) => return Some(Err(error)),
    };
    let spacing =
        LINE * height * record.real(44).filter(|by| (0.25..=4.0).contains(by)).unwrap_or(1.0);
    let whole = height + spacing * (lines.len().max(1) - 1) as f64;
    let top = match attached / 3 {
        0 => 0.0,
        1 => whole / 2.0,
        _ => whole,
    };
    let mut contours = Vec::new();
    let mut fill = None;
    for (number, line) in lines.iter().enumerate() {
        let lettering = match set(line, height, align, is_outlined) {
            Ok(lettering) => lettering,
            Err(error) => return Some(Err(error)),
        };
        let baseline = top - height - spacing * number as f64;
        fill = fill.or(lettering.fill);
        contours.extend(lettering.placed(Affine::translate((0.0, baseline))).contours);
    }
    let angle = match record.space(11) {
        Some(way) if way[0] != 0.0 || way[1] != 0.0 => math::atan2(way[1], way[0]),
        _ => record.real(50).unwrap_or(0.0).to_radians(),
    };
    let by = Affine::translate((place[0], place[1])) * turn(angle);
    Some(Ok(Lettering { contours, fill }.placed(by)))
}

impl Lettering {
    /// The same in other coordinates.
    pub(super) fn placed(self, by: Affine) -> Self {
        let contours = self.contours.iter().map(|contour| contour.transformed(by)).collect();
        Self { contours, ..self }
    }
}

fn level(number: i64) -> Level {
    match number {
        1 => Level::Bottom,
        2 => Level::Middle,
        3 => Level::Top,
        _ => Level::Baseline,
    }
}

/// How far above the baseline a level is, in heights of a capital letter.
fn lift(level: Level) -> f64 {
    match level {
        Level::Baseline => 0.0,
        Level::Bottom => -DESCENT,
        Level::Middle => 0.5,
        Level::Top => 1.0,
    }
}

fn turn(angle: f64) -> Affine {
    let (sine, cosine) = math::sin_cos(angle);
    Affine::new([cosine, sine, -sine, cosine, 0.0, 0.0])
}

/// A line in the font of strokes, or in the outline font where that is asked for or the other lacks a
/// character.
fn set(written: &str, height: f64, align: Align, is_outlined: bool) -> Result<Lettering, String> {
    // The fonts set metres; lengths of the file may be of any size.
    let text = Text {
        text: written,
        height: Height::Cap(1.0),
        letter_spacing: 0.0,
        line_spacing: 1.0,
        align,
        radius: None,
    };
    let strokes = || single_line::set_text(&text);
    let shape = match (is_outlined, outlined(&text)) {
        (true, Some(outlines)) => outlines.or_else(|_| strokes()),
        (false, Some(outlines)) => strokes().or(outlines),
        (_, None) => strokes(),
    };
    let shape = shape.map_err(|error| error.message)?;
    let fill = shape.fill.map(|Fill { rule, .. }| rule);
    Ok(Lettering { contours: shape.contours, fill }.placed(Affine::scale(height)))
}

#[cfg(feature = "text")]
fn outlined(text: &Text<'_>) -> Option<Result<crate::Shape, crate::ReadError>> {
    Some(crate::text::Font::built_in().and_then(|font| font.set(text)))
}

#[cfg(not(feature = "text"))]
fn outlined(_: &Text<'_>) -> Option<Result<crate::Shape, crate::ReadError>> {
    None
}

/// Lines no wider than `width`, divided between words.
fn wrapped(
    written: &str,
    height: f64,
    width: Option<f64>,
    is_outlined: bool,
) -> Result<Vec<String>, String> {
    let Some(width) = width else { return Ok(written.split('\n').map(str::to_owned).collect()) };
    let measured = |text: &str| {
        let lettering = set(text, height, Align::Left, is_outlined)?;
        Ok::<f64, String>(bounds(&lettering.contours).map_or(0.0, |bounds| bounds.x1))
    };
    // The space between two letters is what the letters alone are narrower by.
    let space = measured("n n")? - measured("nn")?;
    let mut lines = Vec::new();
    for line in written.split('\n') {
        let mut own = String::new();
        let mut long = 0.0;
        for word in line.split(' ') {
            let word_long = measured(word)?;
            if !own.is_empty() && long + space + word_long > width {
                lines.push(core::mem::take(&mut own));
                long = 0.0;
            }
            if !own.is_empty() {
                own.push(' ');
                long += space;
            }
            own.push_str(word);
            long += word_long;
        }
        lines.push(own);
    }
    Ok(lines)
}

/// The character of a code that was written in hexadecimal digits, such as `00B0`.
fn of_code(digits: &str) -> Option<char> {
    u32::from_str_radix(digits, 16).ok().and_then(char::from_u32)
}

/// A text without its codes: `%%c` and the like, and `\U+00B0`.
fn plain(text: &str) -> String {
    let mut written = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let code = rest.strip_prefix("%%").and_then(|code| {
            let kind = code.chars().next()?;
            let after = code.get(kind.len_utf8()..)?;
            let character = match kind.to_ascii_lowercase() {
                'd' => '°',
                'p' => '±',
                'c' => '⌀',
                '%' => '%',
                // Lines above, below and through letters.
                'u' | 'o' | 'k' => '\0',
                _ => {
                    let number = code.get(..3)?.parse().ok()?;
                    return Some((char::from_u32(number)?, code.get(3..)?));
                }
            };
            Some((character, after))
        });
        let code = code.or_else(|| {
            let code = rest.strip_prefix("\\U+")?;
            Some((of_code(code.get(..4)?)?, code.get(4..)?))
        });
        let (character, after) =
            code.unwrap_or((first, rest.get(first.len_utf8()..).unwrap_or("")));
        if !character.is_control() {
            written.push(character);
        }
        rest = after;
    }
    written
}

/// A formatted text (MTEXT) without its formats, `\n` between its lines.
fn formatted(text: &str) -> String {
    let mut written = String::with_capacity(text.len());
    let mut rest = text.chars();
    while let Some(character) = rest.next() {
        match character {
            '{' | '}' => {}
            // A control character by its letter: ^I is a tabulator, ^J the next line.
            '^' => match rest.next() {
                Some('J') => written.push('\n'),
                Some(' ') => written.push('^'),
                _ => written.push(' '),
            },
            '\\' => match rest.next() {
                Some('P' | 'N' | 'X') => written.push('\n'),
                Some('~') => written.push(' '),
                Some(character @ ('\\' | '{' | '}')) => written.push(character),
                Some('L' | 'l' | 'O' | 'o' | 'K' | 'k') | None => {}
                // One above the other becomes one behind the other.
                Some('S') => {
                    let stacked = rest.by_ref().take_while(|character| *character != ';');
                    written.extend(stacked.filter(|it| *it != '\\').map(
                        |character| match character {
                            '^' | '#' => '/',
                            character => character,
                        },
                    ));
                }
                Some('U') => {
                    written.push_str("\\U");
                }
                // A format with a value up to a semicolon.
                Some('A' | 'C' | 'c' | 'F' | 'f' | 'H' | 'p' | 'Q' | 'T' | 'W') => {
                    rest.by_ref().find(|character| *character == ';');
                }
                Some(character) => written.push(character),
            },
            character => written.push(character),
        }
    }
    written.split('\n').map(plain).collect::<Vec<String>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::{formatted, plain};

    #[test]
    fn codes_of_a_text_are_the_characters_that_they_stand_for() {
        assert_eq!(plain("%%c20 %%p0.1 %%u45%%d%%u 100%%% %%065"), "⌀20 ±0.1 45° 100% A");
        assert_eq!(plain("\\U+00B0C %%"), "°C %%");
    }

    #[test]
    fn formats_are_left_out_of_a_text() {
        let text =
            "{\\fArial|b0|i0|c0|p34;\\H2.5x;Top}\\Pnext\\~one \\S1^2; \\C1;\\\\ \\{x\\} ^Jend%%d";
        assert_eq!(formatted(text), "Top\nnext one 1/2 \\ {x} \nend°");
        assert_eq!(formatted("\\A1;\\U+00D8 5\\"), "Ø 5");
    }
}
