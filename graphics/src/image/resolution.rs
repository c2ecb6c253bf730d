//! How large a pixel is, by what image files say about it.

use ::image::ImageFormat;

/// Smaller and larger pixels are a slip of the program that wrote the file [m].
const SENSIBLE: core::ops::RangeInclusive<f64> = 1e-7..=0.1;

/// Width and height of a pixel [m].
pub(super) fn pitch(format: ImageFormat, bytes: &[u8]) -> Option<(f64, f64)> {
    let (across, up) = match format {
        ImageFormat::Png => png(bytes),
        ImageFormat::Jpeg => jpeg(bytes),
        ImageFormat::Bmp => bmp(bytes),
        ImageFormat::Tiff => tiff(bytes),
        _ => None,
    }?;
    // Both are pixels per metre.
    let (width, height) = (1.0 / across, 1.0 / up);
    (SENSIBLE.contains(&width) && SENSIBLE.contains(&height)).then_some((width, height))
}

/// The chunk pHYs (PNG third edition, 11.3.4.3).
fn png(bytes: &[u8]) -> Option<(f64, f64)> {
    let mut at = 8_usize;
    loop {
        let length = u32::from_be_bytes(*bytes.get(at..)?.first_chunk()?) as usize;
        let kind = bytes.get(at + 4..at + 8)?;
        let data = bytes.get(at + 8..)?.get(..length)?;
        match kind {
            b"pHYs" => {
                let number = |from: usize| {
                    Some(f64::from(u32::from_be_bytes(*data.get(from..)?.first_chunk()?)))
                };
                let is_metre = *data.get(8)? == 1;
                return is_metre.then_some((number(0)?, number(4)?));
            }
            b"IDAT" => return None,
            _ => at = at.checked_add(length)?.checked_add(12)?,
        }
    }
}

/// The density of the JFIF header (ITU-T T.871, 10.1).
fn jpeg(bytes: &[u8]) -> Option<(f64, f64)> {
    let mut at = 2_usize;
    loop {
        let [0xff, marker, high, low] = *bytes.get(at..)?.first_chunk()? else { return None };
        let data = bytes.get(at + 4..)?;
        if marker == 0xe0 && data.starts_with(b"JFIF\0") {
            let number = |from: usize| {
                Some(f64::from(u16::from_be_bytes(*data.get(from..)?.first_chunk()?)))
            };
            let per_metre = match *data.get(7)? {
                1 => 1.0 / 0.0254,
                2 => 100.0,
                _ => return None,
            };
            return Some((number(8)? * per_metre, number(10)? * per_metre));
        }
        // Start of scan: no more headers.
        if marker == 0xda {
            return None;
        }
        at = at.checked_add(2 + usize::from(u16::from_be_bytes([high, low])))?;
    }
}

/// The fields of BITMAPINFOHEADER, in pixels per metre.
fn bmp(bytes: &[u8]) -> Option<(f64, f64)> {
    let number = |from: usize| Some(i32::from_le_bytes(*bytes.get(from..)?.first_chunk()?));
    let has_them = number(14)? >= 40;
    has_them.then_some((f64::from(number(38)?), f64::from(number(42)?)))
}

/// The fields XResolution, YResolution and ResolutionUnit of the first picture (TIFF 6.0, section 3).
fn tiff(bytes: &[u8]) -> Option<(f64, f64)> {
    let is_little = bytes.starts_with(b"II");
    let short = |at: usize| {
        let word = *bytes.get(at..)?.first_chunk()?;
        Some(if is_little { u16::from_le_bytes(word) } else { u16::from_be_bytes(word) })
    };
    let long = |at: usize| {
        let word = *bytes.get(at..)?.first_chunk()?;
        Some(if is_little { u32::from_le_bytes(word) } else { u32::from_be_bytes(word) })
    };
    let directory = long(4)? as usize;
    let count = usize::from(short(directory)?);
    let entries = (0..count).map(|index| directory.saturating_add(2 + 12 * index));
    let find = |tag: u16| entries.clone().find(|at| short(*at) == Some(tag));
    let ratio = |tag: u16| {
        let at = long(find(tag)?.checked_add(8)?)? as usize;
        Some(f64::from(long(at)?) / f64::from(long(at.checked_add(4)?)?))
    };
    let unit = find(296).map_or(Some(2), |at| short(at.checked_add(8)?));
    let per_metre = match unit? {
        2 => 1.0 / 0.0254,
        3 => 100.0,
        _ => return None,
    };
    Some((ratio(282)? * per_metre, ratio(283)? * per_metre))
}
