//! Images as rows of marks: resampled to the marking grid, their tone set, and their grey made of dots.
//!
//! Rows come one by one from the top; besides the image only a few rows are held, so that the first row
//! is there at once. Values are taken as the image encodes them: averages and errors are not of light.
//! Errors are diffused in serpentines, rows alternately to the right and to the left, whatever the
//! direction of marking.

mod diffusion;
mod resample;

use kurbo::Affine;
use messages::math;

use crate::Raster;
use diffusion::{Diffusion, Kernel};
use resample::Resample;

/// How an image becomes marks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dither {
    /// Distance of dots in a row [m].
    pub pitch: f64,
    /// Distance of rows [m].
    pub interval: f64,
    /// Its tone.
    pub tone: Tone,
    /// How grey is made.
    pub method: Method,
}

/// What is done with grey values before they are marked, in this order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tone {
    /// Whether white is marked instead of black.
    pub is_inverted: bool,
    /// Stretches values around the middle, -1 (all grey) to 1 (black and white alone).
    pub contrast: f64,
    /// Added to the values, -1 (black) to 1 (white).
    pub brightness: f64,
    /// Values are raised to its reciprocal: above 1 lightens the middle. 0.1 to 10.
    pub gamma: f64,
}

/// How grey is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Levels of power, this many with none and full, 2 to 256.
    Grey(u16),
    /// Dots where the image is darker than this value.
    Threshold(u8),
    /// Dots by a Bayer matrix of 8 by 8 (B. E. Bayer, 1973).
    Ordered,
    /// Dots by error diffusion (R. W. Floyd and L. Steinberg, 1976).
    FloydSteinberg,
    /// Dots by error diffusion over three rows (J. F. Jarvis, C. N. Judice and W. H. Ninke, 1976).
    Jarvis,
    /// Dots by error diffusion over three rows, sharper (P. Stucki, 1981).
    Stucki,
}

/// A row of marks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// From the top, from 0.
    pub number: usize,
    /// Its marks from left to right, without overlaps; what is not marked is left out.
    pub runs: Vec<Run>,
}

/// Neighbouring dots of one level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// First column.
    pub from: usize,
    /// The column after the last one.
    pub to: usize,
    /// Share of the power, 1 to 255.
    pub level: u8,
}

/// The rows of an image, from the top.
#[derive(Debug, Clone)]
pub struct Rows<'a> {
    /// Dots in a row.
    columns: usize,
    rows: usize,
    placement: Affine,
    source: Resample<'a>,
    tone: Tone,
    method: Method,
    diffusion: Option<Diffusion>,
    next: usize,
    values: Vec<f64>,
    levels: Vec<u8>,
}

/// Why an image is not marked.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum DitherError {
    /// A setting is out of its range.
    #[error("{name} is {value}; it must be {range}")]
    Setting {
        /// Which one.
        name: &'static str,
        /// Its value in SI units.
        value: f64,
        /// What would be right.
        range: &'static str,
    },
    /// More dots than memory should hold.
    #[error("{count:.0} {what} of dots would be marked; at most {MOST} are")]
    TooMany {
        /// Rows or columns.
        what: &'static str,
        /// How many.
        count: f64,
    },
    /// The image contradicts itself.
    #[error("the image has {pixels} pixels where {columns} x {rows} are said")]
    Pixels {
        /// Pixels that it has.
        pixels: usize,
        /// Its columns.
        columns: usize,
        /// Its rows.
        rows: usize,
    },
    /// The image has no size or is placed nowhere.
    #[error("the image is {width} m x {height} m large; both must be finite and more than 0")]
    Size {
        /// Its width [m].
        width: f64,
        /// Its height [m].
        height: f64,
    },
}

/// More rows, or columns, of dots are not made.
pub const MOST: usize = 1_000_000;

impl Default for Tone {
    /// As the image is.
    fn default() -> Self {
        Self { is_inverted: false, contrast: 0.0, brightness: 0.0, gamma: 1.0 }
    }
}

impl Dither {
    /// The rows of an image.
    ///
    /// The grid has a whole number of rows and columns in the image's own directions, so pitch and
    /// interval are met to half of one in all; [`Rows::placement`] is exact.
    ///
    /// # Errors
    ///
    /// Where a setting is out of its range, or the image has no size or too many dots.
    pub fn rows<'a>(&self, raster: &'a Raster) -> Result<Rows<'a>, DitherError> {
        self.check()?;
        let (columns, rows) = (raster.columns, raster.rows);
        let pixels = raster.pixels.len();
        if columns == 0 || columns.checked_mul(rows) != Some(pixels) || pixels == 0 {
            return Err(DitherError::Pixels { pixels, columns, rows });
        }
        let [a, b, c, d, ..] = raster.placement.as_coeffs();
        let width = math::hypot(a, b) * columns as f64;
        let height = math::hypot(c, d) * rows as f64;
        let is_size = |length: f64| length.is_finite() && length > 0.0;
        if !is_size(width) || !is_size(height) {
            return Err(DitherError::Size { width, height });
        }
        let count = |what, length: f64, distance: f64| {
            let count = (length / distance).round().max(1.0);
            if count > MOST as f64 {
                return Err(DitherError::TooMany { what, count });
            }
            Ok(count as usize)
        };
        let marked = (count("columns", width, self.pitch)?, count("rows", height, self.interval)?);
        let scale = Affine::scale_non_uniform(
            columns as f64 / marked.0 as f64,
            rows as f64 / marked.1 as f64,
        );
        let kernel = match self.method {
            Method::FloydSteinberg => Some(Kernel::FLOYD_STEINBERG),
            Method::Jarvis => Some(Kernel::JARVIS),
            Method::Stucki => Some(Kernel::STUCKI),
            Method::Grey(_) | Method::Threshold(_) | Method::Ordered => None,
        };
        Ok(Rows {
            columns: marked.0,
            rows: marked.1,
            placement: raster.placement * scale,
            source: Resample::new(&raster.pixels, (columns, rows), marked),
            tone: self.tone,
            method: self.method,
            diffusion: kernel.map(|kernel| Diffusion::new(kernel, marked.0)),
            next: 0,
            values: vec![0.0; marked.0],
            levels: vec![0; marked.0],
        })
    }

    fn check(&self) -> Result<(), DitherError> {
        let check = |name, value: f64, is_right: bool, range| {
            if is_right { Ok(()) } else { Err(DitherError::Setting { name, value, range }) }
        };
        let is_length = |length: f64| length.is_finite() && length > 0.0;
        let Tone { contrast, brightness, gamma, .. } = self.tone;
        check("pitch", self.pitch, is_length(self.pitch), "more than 0 m")?;
        check("interval", self.interval, is_length(self.interval), "more than 0 m")?;
        check("contrast", contrast, (-1.0..=1.0).contains(&contrast), "from -1 to 1")?;
        check("brightness", brightness, (-1.0..=1.0).contains(&brightness), "from -1 to 1")?;
        check("gamma", gamma, (0.1..=10.0).contains(&gamma), "from 0.1 to 10")?;
        match self.method {
            Method::Grey(levels) => {
                let is_right = (2..=256).contains(&levels);
                check("levels", f64::from(levels), is_right, "from 2 to 256")
            }
            _ => Ok(()),
        }
    }
}

impl Tone {
    /// A value from 0, black, to 1, white.
    fn of(&self, value: f64) -> f64 {
        let value = if self.is_inverted { 1.0 - value } else { value };
        // 0 at -1, 1 at 0, and at 1 far more than there are values.
        let slope = math::tan((self.contrast + 1.0) * math::TURN / 8.0).min(1e6);
        let value = ((value - 0.5) * slope + 0.5 + self.brightness).clamp(0.0, 1.0);
        if self.gamma == 1.0 { value } else { math::pow(value, 1.0 / self.gamma) }
    }
}

impl Rows<'_> {
    /// Dots in a row, marked or not.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// All rows, those that were given among them.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// From dots, x to the right and y up from the lower left corner of the image, to metres. A dot
    /// covers a square of 1; row `n` from the top covers y from `rows − n − 1` to `rows − n`.
    pub fn placement(&self) -> Affine {
        self.placement
    }
}

impl Iterator for Rows<'_> {
    type Item = Row;

    fn next(&mut self) -> Option<Row> {
        if self.next == self.rows {
            return None;
        }
        let number = self.next;
        self.next += 1;
        self.source.row(number, &mut self.values);
        if self.tone != Tone::default() {
            self.values.iter_mut().for_each(|value| *value = self.tone.of(*value));
        }
        let values = self.levels.iter_mut().zip(&self.values);
        let dot = |is_marked: bool| if is_marked { 255 } else { 0 };
        match (&mut self.diffusion, self.method) {
            (Some(diffusion), _) => diffusion.row(number, &self.values, &mut self.levels),
            (None, Method::Grey(levels)) => {
                let most = f64::from(levels.clamp(2, 256) - 1);
                values.for_each(|(level, value)| {
                    *level = ((((1.0 - value) * most).round() / most) * 255.0).round() as u8;
                });
            }
            (None, Method::Threshold(threshold)) => {
                let threshold = f64::from(threshold) / 255.0;
                values.for_each(|(level, value)| *level = dot(*value < threshold));
            }
            (None, _) => values.enumerate().for_each(|(column, (level, value))| {
                *level = dot(*value < bayer(column, number));
            }),
        }
        Some(Row { number, runs: runs(&self.levels) })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.rows - self.next, Some(self.rows - self.next))
    }
}

impl ExactSizeIterator for Rows<'_> {}

/// Threshold of the 8 by 8 Bayer matrix, more than 0 and less than 1.
fn bayer(column: usize, row: usize) -> f64 {
    // The bits of column ⊻ row and of row, interleaved from the lowest bit as the highest.
    let (mixed, row) = (column ^ row, row);
    let rank =
        (0..3).fold(0, |rank, bit| (rank << 2) | ((mixed >> bit & 1) << 1) | (row >> bit & 1));
    (rank as f64 + 0.5) / 64.0
}

/// Neighbours of one level that is not 0.
fn runs(levels: &[u8]) -> Vec<Run> {
    let mut runs = Vec::new();
    let mut from = 0;
    for part in levels.chunk_by(|a, b| a == b) {
        let to = from + part.len();
        if part[0] > 0 {
            runs.push(Run { from, to, level: part[0] });
        }
        from = to;
    }
    runs
}

#[cfg(test)]
mod tests;
