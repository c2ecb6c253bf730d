//! Reads drawings of every format, within bounds that no file exceeds by mistake.

#[cfg_attr(not(all(feature = "svg", feature = "dxf", feature = "lightburn")), allow(dead_code))]
pub(crate) mod arcs;
#[cfg(any(feature = "svg", feature = "lightburn"))]
pub(crate) mod images;
#[cfg(feature = "dxf")]
pub(crate) mod join;
mod kind;
#[cfg(test)]
pub(crate) mod mutations;
pub(crate) mod notes;
#[cfg_attr(not(all(feature = "svg", feature = "dxf", feature = "lightburn")), allow(dead_code))]
pub(crate) mod pen;
#[cfg(any(feature = "svg", feature = "dxf", feature = "lightburn"))]
pub(crate) mod text;
#[cfg(any(feature = "svg", feature = "lightburn"))]
pub(crate) mod xml;

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

use crate::ReadError;
use kurbo::Rect;

use crate::shape::{Contour, FileNote, Graphic, Segment};
use kind::Kind;
#[cfg(any(feature = "svg", feature = "dxf", feature = "lightburn"))]
pub(crate) use text::text;

/// Bytes of a file, and of what a compressed one holds: 64 MiB. A drawing of this size has some two million
/// curves.
pub const MOST_BYTES: usize = 64 << 20;

/// Curves and lines of a drawing, with each symbol or block counted wherever it is drawn: they take some
/// 160 MB.
pub const MOST_SEGMENTS: usize = 2_000_000;

/// Elements of a drawing, with each symbol or block counted wherever it is drawn.
pub const MOST_ELEMENTS: usize = 300_000;

/// How deep elements may be in each other, through symbols and blocks. Deeper ones would need more stack than
/// a thread has.
pub const MOST_DEPTH: usize = 100;

/// Extensions of files that are read here, without their dots.
pub const EXTENSIONS: [&str; 17] = [
    "svg", "svgz", "dxf", "lbrn2", "lbrn", "plt", "hpgl", "hpg", "hgl", "png", "jpg", "jpeg",
    "bmp", "gif", "webp", "tif", "tiff",
];

/// Reads a drawing. Its content says what it is; `extension`, of its name and without a dot, counts where the
/// content does not, and a note is made where the two differ.
///
/// # Errors
///
/// Where the format is not known, the file is at fault, or it exceeds a bound of this module.
pub fn read(bytes: &[u8], extension: &str) -> Result<Graphic, ReadError> {
    if bytes.len() > MOST_BYTES {
        return Err(too_large());
    }
    let named = Kind::of_extension(extension);
    let found = Kind::of_content(bytes);
    let kind = match (found, named) {
        (Some(kind), _) | (None, Some(kind)) => kind,
        (None, None) => return Err(unknown(extension)),
    };
    let mut graphic = kind.read(bytes)?;
    if named != Some(kind) && !extension.is_empty() {
        let text = format!("the file is named .{extension} and is {}", kind.name());
        graphic.notes.insert(0, FileNote { line: 0, text });
    }
    Ok(graphic)
}

/// Reads the drawing in a file; see [`read`].
///
/// # Errors
///
/// Those of [`read`], and where the file cannot be read.
pub fn read_file(path: &Path) -> Result<Graphic, ReadError> {
    read_opened(File::open(path), path)
}

/// Reads the drawing in a file that was `opened`, or could not be, and is called `name`; see [`read`].
///
/// # Errors
///
/// As of [`read_file`].
pub fn read_opened(opened: io::Result<File>, name: &Path) -> Result<Graphic, ReadError> {
    let mut bytes = Vec::new();
    let limit = MOST_BYTES as u64 + 1;
    opened.and_then(|file| file.take(limit).read_to_end(&mut bytes)).map_err(|error| {
        ReadError::new(
            format!("cannot be read: {error}"),
            "give a file that exists and may be read",
        )
    })?;
    let extension = name.extension().unwrap_or_default();
    read(&bytes, &extension.to_string_lossy())
}

fn unknown(extension: &str) -> ReadError {
    let message = match extension {
        "" => "the file is no drawing that is known".to_owned(),
        extension => format!("the file, .{extension}, is no drawing that is known"),
    };
    ReadError::new(
        message,
        "give an SVG, DXF, LightBurn (.lbrn2, .lbrn) or HPGL (.plt) file, or an image",
    )
}

/// The smallest upright rectangle around contours [m]; `None` around none.
pub(crate) fn bounds(contours: &[Contour]) -> Option<Rect> {
    contours.iter().map(Contour::bounds).reduce(|one, other| one.union(other))
}

/// Whether all numbers of a contour are finite: products of large ones in a file may not be.
pub(crate) fn is_finite(contour: &Contour) -> bool {
    let is_finite = |segment: &Segment| match *segment {
        Segment::Line(end) => end.is_finite(),
        Segment::Cubic(first, second, end) => {
            first.is_finite() && second.is_finite() && end.is_finite()
        }
        Segment::Arc(arc) => {
            let (start, sweep) = (arc.start.is_finite(), arc.sweep.is_finite());
            let axes = arc.major.is_finite() && arc.minor.is_finite();
            start && sweep && axes && arc.centre.is_finite()
        }
    };
    contour.start.is_finite() && contour.segments.iter().all(is_finite)
}

pub(crate) fn too_large() -> ReadError {
    ReadError::new(
        format!("the file holds more than {} MiB", MOST_BYTES >> 20),
        "divide the drawing, or simplify its paths",
    )
}

#[cfg(test)]
mod tests {
    use super::{MOST_BYTES, read, read_file};

    const SVG: &[u8] = b"\xef\xbb\xbf <!-- LightBurn --><svg xmlns='http://www.w3.org/2000/svg' \
                         width='1mm' height='1mm'><rect width='1' height='1'/></svg>";
    const DXF: &[u8] = b"  0\r\nSECTION\r\n2\r\nENTITIES\r\n0\r\nLINE\r\n10\r\n0\r\n20\r\n0\r\n\
                         11\r\n1\r\n21\r\n1\r\n0\r\nENDSEC\r\n0\r\nEOF\r\n";
    const PROJECT: &[u8] =
        b"<?xml version='1.0'?><LightBurnProject><Shape Type='Rect' W='1' H='1'/></LightBurnProject>";
    const PLOT: &[u8] = b"IN;SP1;PU0,0;PD1,1;";

    #[cfg(all(feature = "svg", feature = "dxf", feature = "lightburn"))]
    #[test]
    fn content_counts_where_the_name_is_wrong() {
        for (bytes, extension, name) in [
            (SVG, "svg", "SVG"),
            (DXF, "dxf", "DXF"),
            (PROJECT, "lbrn2", "LightBurn"),
            (PLOT, "plt", "HPGL"),
        ] {
            let graphic = read(bytes, extension).expect("a drawing");
            assert_eq!(graphic.shapes.len(), 1, "{extension}");
            let capitals = read(bytes, &extension.to_uppercase()).expect("a drawing");
            assert_eq!(capitals, graphic);
            assert_eq!(read(bytes, "").expect("a drawing"), graphic);
            for wrong in ["svg", "dxf", "lbrn", "hpgl", "txt"] {
                let found = read(bytes, wrong).expect("a drawing");
                assert_eq!(found.shapes, graphic.shapes);
                let is_told = found.notes.iter().any(|note| note.text.contains("is named"));
                let is_right =
                    extension.starts_with(wrong) || (extension, wrong) == ("plt", "hpgl");
                assert_eq!(is_told, !is_right, "{wrong}");
                assert!(is_right || found.notes[0].text.contains(name));
            }
        }
    }

    #[test]
    fn other_files_are_named() {
        for (bytes, name) in [
            (&b"%PDF-1.7\n"[..], "PDF"),
            (b"%!PS-Adobe-3.0 EPSF-3.0", "PostScript"),
            (b"AC1032\0\0", "DWG"),
            (b"PK\x03\x04", "zip"),
            (b"\x89PNG\r\n\x1a\n", "PNG"),
        ] {
            let error = read(bytes, "svg").expect_err("another format");
            assert!(error.message.contains(name), "{error}");
        }
        assert!(read(b"\0\x01\x02", "bin").expect_err("nothing").message.contains(".bin"));
        assert!(read(b"", "").is_err());
        assert!(read(b"<html></html>", "").is_err());
    }

    #[test]
    fn a_file_is_read_by_its_path_and_within_the_bound() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("plot.plt");
        std::fs::write(&path, PLOT).expect("written");
        assert_eq!(read_file(&path).expect("a plot").shapes.len(), 1);
        assert!(read_file(folder.path()).is_err());
        // Who asks for it knows the path.
        let gone = read_file(&folder.path().join("gone.svg")).expect_err("gone");
        assert!(gone.message.starts_with("cannot be read"), "{}", gone.message);
        let huge = vec![b' '; MOST_BYTES + 1];
        assert!(read(&huge, "plt").expect_err("too large").message.contains("64 MiB"));
    }
}
