//! Images within drawings.

use std::sync::Arc as Shared;

use kurbo::Affine;

use super::notes::Notes;
use crate::shape::Raster;

/// Pixels of all images of a drawing, each counted wherever it is drawn.
const MOST_PIXELS: usize = 200_000_000;

/// Images of a drawing.
const MOST_IMAGES: usize = 1000;

/// What a drawing says of an image beside its file.
#[derive(Debug, Clone, Default)]
pub(crate) struct Placed {
    pub(crate) layer: Option<Shared<str>>,
    pub(crate) recipe: Option<usize>,
    pub(crate) line: u64,
}

/// Collects the images of a drawing.
#[derive(Debug, Default)]
pub(crate) struct Images {
    pub(crate) all: Vec<Raster>,
    pixels: usize,
}

impl Images {
    /// Unpacks an image file; `by` is from the unit square, y up, to the drawing [m].
    #[cfg(feature = "image")]
    pub(crate) fn add(&mut self, file: &[u8], by: Affine, placed: Placed, notes: &mut Notes) {
        if self.all.len() >= MOST_IMAGES || self.pixels >= MOST_PIXELS {
            notes.add("images too many or too large are left out", placed.line);
            return;
        }
        if !by.is_finite() {
            return;
        }
        match crate::image::decode(file) {
            Ok(image) => {
                let (columns, rows) = (image.columns, image.rows);
                self.pixels = self.pixels.saturating_add(columns.saturating_mul(rows));
                let square = Affine::scale_non_uniform(1.0 / columns as f64, 1.0 / rows as f64);
                self.all.push(Raster {
                    pixels: image.pixels,
                    columns,
                    rows,
                    placement: by * square,
                    layer: placed.layer,
                    recipe: placed.recipe,
                    line: placed.line,
                });
            }
            Err(error) => notes.add(format!("an image is left out: {error}"), placed.line),
        }
    }

    /// Names an image: this build has no decoder.
    #[cfg(not(feature = "image"))]
    pub(crate) fn add(&mut self, _: &[u8], _: Affine, placed: Placed, notes: &mut Notes) {
        let _ = (self.pixels, MOST_PIXELS, MOST_IMAGES, placed.layer, placed.recipe);
        notes.add("an image is left out", placed.line);
    }
}
