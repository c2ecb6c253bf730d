//! Outlines of TrueType and OpenType fonts, shaped with kerning and ligatures.

use std::sync::{Arc as Shared, LazyLock};

use harfrust::{Buffer, Feature, ShapeOptions, ShaperFont, Tag};
use kurbo::{Point, Rect};
use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, GlyphId, MetadataProvider};

use super::layout::{Glyph, check, lines, missing, set};
use super::{Height, Text};
use crate::{Colour, Contour, Fill, FillRule, ReadError, Segment, Shape};

/// An outline font.
#[derive(Clone)]
pub struct Font {
    bytes: Shared<[u8]>,
    /// Which font of a collection.
    index: u32,
    shaped: harfrust::Font,
    units: f64,
    /// Height of a capital letter in em, where the font says or shows it.
    cap: Option<f64>,
}

static BUILT_IN: LazyLock<Result<Font, ReadError>> =
    LazyLock::new(|| Font::new(epaint_default_fonts::UBUNTU_LIGHT));

impl Font {
    /// From the bytes of a TTF or OTF file, or the first font of a collection. A variable font is taken at
    /// its default.
    ///
    /// # Errors
    ///
    /// Where the bytes are no such font.
    pub fn new(bytes: &[u8]) -> Result<Self, ReadError> {
        Self::of_collection(bytes, 0)
    }

    /// The font with this `index` in the bytes of a file.
    pub(super) fn of_collection(bytes: &[u8], index: u32) -> Result<Self, ReadError> {
        let refuse = |reason: &str| {
            let message = format!("the font cannot be read: {reason}");
            ReadError::new(message, "a TrueType or OpenType font, .ttf or .otf")
        };
        let font = FontRef::from_index(bytes, index).map_err(|error| refuse(&error.to_string()))?;
        let shaped = harfrust::Font::new(bytes.to_vec(), index);
        let shaped = shaped.ok_or_else(|| refuse("it has no characters"))?;
        let metrics = font.metrics(Size::unscaled(), LocationRef::default());
        let units = f64::from(metrics.units_per_em);
        if !(16.0..=16_384.0).contains(&units) {
            return Err(refuse(&format!("its em has {units} units, not 16 to 16384")));
        }
        let mut font = Self { bytes: bytes.into(), index, shaped, units, cap: None };
        let said = metrics.cap_height.map(|cap| f64::from(cap) / units);
        font.cap = said.filter(|cap| *cap > 0.05 && *cap < 10.0).or_else(|| font.shown_cap());
        Ok(font)
    }

    /// The font that is always there: Ubuntu Light, under the Ubuntu Font Licence 1.0.
    ///
    /// # Errors
    ///
    /// Never, as a test shows.
    pub fn built_in() -> Result<Self, ReadError> {
        BUILT_IN.clone()
    }

    /// A text as a filled shape of closed contours.
    ///
    /// # Errors
    ///
    /// Where the font has no glyph for a character, which is named, or a setting is out of its range; the
    /// error's line is that of the text.
    pub fn set(&self, text: &Text<'_>) -> Result<Shape, ReadError> {
        check(text)?;
        let em = match text.height {
            Height::Em(em) => em,
            Height::Cap(height) => {
                let help = "the height of the em";
                let none = || ReadError::new("the font does not say how high capitals are", help);
                height / self.cap.ok_or_else(none)?
            }
        };
        let is_spaced = text.letter_spacing != 0.0;
        let glyphs =
            lines(text.text).enumerate().map(|(number, line)| self.line(number, line, is_spaced));
        let contours = set(text, em, glyphs.collect::<Result<_, _>>()?)?;
        let fill = Some(Fill { colour: Colour::BLACK, rule: FillRule::NonZero });
        Ok(Shape { contours, fill, ..Shape::default() })
    }

    /// The glyphs of a line, kerned; spaced letters are not joined to ligatures.
    fn line(&self, number: usize, line: &str, is_spaced: bool) -> Result<Vec<Glyph>, ReadError> {
        let mut buffer = Buffer::new();
        buffer.push_str(line);
        buffer.guess_segment_properties();
        let apart = [b"liga", b"clig"].map(|tag| Feature::new(Tag::new(tag), 0, ..));
        let features = if is_spaced { &apart[..] } else { &[] };
        let options = ShapeOptions::new().features(features);
        harfrust::shape(&ShaperFont::new(&self.shaped), &mut buffer, options)
            .map_err(|error| self.damaged(&error.to_string()))?;
        let font = FontRef::from_index(&self.bytes, self.index)
            .map_err(|error| self.damaged(&error.to_string()))?;
        let glyphs = buffer.glyph_infos().iter().zip(buffer.glyph_positions());
        let glyph = |(info, position): (&harfrust::GlyphInfo, &harfrust::GlyphPosition)| {
            if info.glyph_id == 0 {
                let rest = line.get(info.cluster as usize..).unwrap_or_default();
                let character = rest.chars().next().unwrap_or(char::REPLACEMENT_CHARACTER);
                return Err(missing(number, character, "another font or other text"));
            }
            let shift = Point::new(
                f64::from(position.x_offset) / self.units,
                f64::from(position.y_offset) / self.units,
            );
            let contours = self.outline(&font, info.glyph_id, shift)?;
            let advance = f64::from(position.x_advance) / self.units;
            Ok(Glyph { advance, contours })
        };
        glyphs.map(glyph).collect()
    }

    /// The curves of a glyph in em.
    fn outline(
        &self,
        font: &FontRef<'_>,
        glyph: u32,
        shift: Point,
    ) -> Result<Vec<Contour>, ReadError> {
        let mut outline = Outline { contours: Vec::new(), shift, scale: 1.0 / self.units };
        let settings = DrawSettings::unhinted(Size::unscaled(), LocationRef::default());
        if let Some(glyph) = font.outline_glyphs().get(GlyphId::new(glyph)) {
            glyph.draw(settings, &mut outline).map_err(|error| self.damaged(&error.to_string()))?;
        }
        outline.contours.retain(|contour| !contour.segments.is_empty());
        Ok(outline.contours)
    }

    /// Height of H in em.
    fn shown_cap(&self) -> Option<f64> {
        let glyphs = self.line(0, "H", false).ok()?;
        let bounds = glyphs.iter().flat_map(|glyph| &glyph.contours).map(Contour::bounds);
        let bounds = bounds.reduce(|one, other| Rect::union(&one, other))?;
        Some(bounds.y1).filter(|cap| *cap > 0.05 && *cap < 10.0)
    }

    fn damaged(&self, reason: &str) -> ReadError {
        ReadError::new(format!("the font is damaged: {reason}"), "another font")
    }
}

impl core::fmt::Debug for Font {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(formatter, "Font of {} bytes, {} units to the em", self.bytes.len(), self.units)
    }
}

/// Contours as a glyph draws them.
struct Outline {
    contours: Vec<Contour>,
    shift: Point,
    scale: f64,
}

impl Outline {
    fn point(&self, x: f32, y: f32) -> Point {
        let place = Point::new(f64::from(x) * self.scale, f64::from(y) * self.scale);
        place + self.shift.to_vec2()
    }

    fn add(&mut self, segment: impl FnOnce(Point) -> Option<Segment>) {
        if let Some(contour) = self.contours.last_mut() {
            let start = contour.end();
            contour.segments.extend(segment(start));
        }
    }
}

impl OutlinePen for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        let start = self.point(x, y);
        self.contours.push(Contour { start, segments: Vec::new(), is_closed: true });
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let end = self.point(x, y);
        self.add(|start| (end != start).then_some(Segment::Line(end)));
    }

    fn quad_to(&mut self, cx0: f32, cy0: f32, x: f32, y: f32) {
        let (control, end) = (self.point(cx0, cy0), self.point(x, y));
        // The same curve as a cubic: its control points lie at two thirds of the way to that of the parabola.
        let two_thirds = 2.0 / 3.0;
        self.add(|start| {
            let (first, second) = (start.lerp(control, two_thirds), end.lerp(control, two_thirds));
            (end != start || control != start).then_some(Segment::Cubic(first, second, end))
        });
    }

    fn curve_to(&mut self, cx0: f32, cy0: f32, cx1: f32, cy1: f32, x: f32, y: f32) {
        let (first, second) = (self.point(cx0, cy0), self.point(cx1, cy1));
        let end = self.point(x, y);
        self.add(|_| Some(Segment::Cubic(first, second, end)));
    }

    fn close(&mut self) {
        if let Some(contour) = self.contours.last_mut()
            && contour.end() != contour.start
        {
            contour.segments.push(Segment::Line(contour.start));
        }
    }
}

#[cfg(test)]
mod tests;
