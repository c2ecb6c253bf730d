//! Images from PNG, JPEG, BMP, GIF, WebP and TIFF files, of GIF and TIFF the first picture.
//!
//! Grey is the luminance of Rec. 709, summed in linear light and encoded again by the transfer function
//! of sRGB: a grey pixel keeps its value. Transparency is laid on white in encoded values, as browsers do
//! it. Embedded colour profiles are not applied. The orientation that a camera wrote is.

mod resolution;

use std::io::Cursor;
use std::sync::{Arc as Shared, LazyLock};

use ::image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};
use kurbo::Affine;
use messages::math;

use crate::{FileNote, Graphic, Raster, ReadError};

/// Larger images are refused, before their pixels are unpacked.
pub const MOST_PIXELS: u64 = 100_000_000;
/// Most memory that a decoder may take [bytes]: 16 bits for each of four channels.
const MOST_BYTES: u64 = 8 * MOST_PIXELS;
/// Pitch of pixels where the file has none, that of 96 to the inch [m].
const USUAL_PITCH: f64 = 0.0254 / 96.0;

/// Pixels of an image file.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Grey values row by row from the top, 0 black and 255 white.
    pub pixels: Shared<[u8]>,
    /// Pixels in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Width and height of a pixel [m], where the file says so.
    pub pitch: Option<(f64, f64)>,
}

/// Reads an image file; its lower left corner is the origin.
///
/// # Errors
///
/// Where the bytes are no image of a known format, are damaged, or hold more than [`MOST_PIXELS`].
pub fn read(bytes: &[u8]) -> Result<Graphic, ReadError> {
    let image = decode(bytes)?;
    let mut notes = Vec::new();
    if image.pitch.is_none() {
        let text = "the image has no resolution: 96 dots per inch are taken".into();
        notes.push(FileNote { line: 0, text });
    }
    let (width, height) = image.pitch.unwrap_or((USUAL_PITCH, USUAL_PITCH));
    let raster = Raster {
        pixels: image.pixels,
        columns: image.columns,
        rows: image.rows,
        placement: Affine::scale_non_uniform(width, height),
        layer: None,
        recipe: None,
        line: 0,
    };
    Ok(Graphic { images: vec![raster], notes, ..Graphic::default() })
}

/// Unpacks an image file, such as one within a drawing.
///
/// # Errors
///
/// As [`read`].
pub fn decode(bytes: &[u8]) -> Result<Image, ReadError> {
    let mut reader = ImageReader::new(Cursor::new(bytes));
    let format = ::image::guess_format(bytes).map_err(|_| {
        ReadError::new(
            "the file is not an image of a known kind",
            "PNG, JPEG, BMP, GIF, WebP or TIFF",
        )
    })?;
    reader.set_format(format);
    let limits = || {
        let mut limits = Limits::default();
        limits.max_alloc = Some(MOST_BYTES);
        limits
    };
    reader.limits(limits());
    let named = |error: ImageError| refusal(format, &error);
    let mut decoder = reader.into_decoder().map_err(named)?;
    let (columns, rows) = decoder.dimensions();
    let pixels = u64::from(columns) * u64::from(rows);
    if pixels == 0 || pixels > MOST_PIXELS {
        return Err(ReadError::new(
            format!("the image has {columns} x {rows} pixels"),
            format!("1 to {MOST_PIXELS} pixels in all"),
        ));
    }
    decoder.set_limits(limits()).map_err(named)?;
    // Damaged notes of a camera leave the image as it lies.
    let orientation = decoder.orientation().unwrap_or(::image::metadata::Orientation::NoTransforms);
    let mut image = DynamicImage::from_decoder(decoder).map_err(named)?;
    image.apply_orientation(orientation);
    let is_turned = matches!(orientation.to_exif(), 5..=8);
    let pitch = resolution::pitch(format, bytes)
        .map(|(width, height)| if is_turned { (height, width) } else { (width, height) });
    let (columns, rows) = (image.width() as usize, image.height() as usize);
    Ok(Image { pixels: grey(image).into(), columns, rows, pitch })
}

fn refusal(format: ImageFormat, error: &ImageError) -> ReadError {
    let name = format!("{format:?}").to_uppercase();
    match error {
        ImageError::Limits(_) => ReadError::new(
            format!("the {name} image takes too much memory to unpack"),
            format!("at most {} MB, {MOST_PIXELS} pixels", MOST_BYTES / 1_000_000),
        ),
        ImageError::Unsupported(_) => ReadError::new(
            format!("this kind of {name} image is not supported: {error}"),
            "8 or 16 bits in each channel, grey or RGB",
        ),
        _ => ReadError::new(
            format!("the {name} image is damaged: {error}"),
            "a file that other programs show",
        ),
    }
}

/// Grey values, transparency on white.
fn grey(image: DynamicImage) -> Vec<u8> {
    match image {
        DynamicImage::ImageLuma8(image) => image.into_raw(),
        DynamicImage::ImageLuma16(_) => image.into_luma8().into_raw(),
        _ => image.into_rgba8().pixels().map(|pixel| LUMINANCE.of(pixel.0)).collect(),
    }
}

static LUMINANCE: LazyLock<Luminance> = LazyLock::new(Luminance::new);

/// Tables of the transfer function of sRGB (IEC 61966-2-1).
struct Luminance {
    linear: Vec<f64>,
    encoded: Vec<u8>,
}

impl Luminance {
    fn new() -> Self {
        let linear = |value: usize| {
            let value = value as f64 / 255.0;
            if value <= 0.040_45 { value / 12.92 } else { math::pow((value + 0.055) / 1.055, 2.4) }
        };
        let encoded = |value: usize| {
            let value = value as f64 / 65_535.0;
            let encoded = if value <= 0.003_130_8 {
                value * 12.92
            } else {
                1.055 * math::pow(value, 1.0 / 2.4) - 0.055
            };
            (encoded * 255.0).round() as u8
        };
        Self { linear: (0..256).map(linear).collect(), encoded: (0..65_536).map(encoded).collect() }
    }

    fn of(&self, [red, green, blue, opacity]: [u8; 4]) -> u8 {
        let on_white = |value: u8| {
            let (value, opacity) = (u32::from(value), u32::from(opacity));
            ((value * opacity + 255 * (255 - opacity) + 127) / 255) as usize
        };
        let (red, green, blue) = (on_white(red), on_white(green), on_white(blue));
        if red == green && green == blue {
            return red as u8;
        }
        let light =
            0.2126 * self.linear[red] + 0.7152 * self.linear[green] + 0.0722 * self.linear[blue];
        self.encoded[((light * 65_535.0).round() as usize).min(65_535)]
    }
}

#[cfg(test)]
mod tests;
