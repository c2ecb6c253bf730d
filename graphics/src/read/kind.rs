//! What a file is, by its name and by its content.

use crate::ReadError;
use crate::shape::Graphic;

/// How much of a file is looked at.
const HEAD: usize = 4096;

/// A format, or one that is known and not read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Svg,
    Dxf,
    LightBurn,
    Hpgl,
    Image,
    /// Another format, by its name.
    Other(&'static str),
}

impl Kind {
    /// By the end of a file's name, without its dot.
    pub(super) fn of_extension(extension: &str) -> Option<Self> {
        Some(match extension.to_ascii_lowercase().as_str() {
            "svg" | "svgz" => Self::Svg,
            "dxf" => Self::Dxf,
            "lbrn" | "lbrn2" => Self::LightBurn,
            "plt" | "hpgl" | "hpg" | "hgl" => Self::Hpgl,
            "png" | "jpg" | "jpeg" | "bmp" | "gif" | "webp" | "tif" | "tiff" => Self::Image,
            _ => return None,
        })
    }

    /// By what a file begins with; `None` where that tells nothing.
    pub(super) fn of_content(bytes: &[u8]) -> Option<Self> {
        for (start, kind) in [
            (&b"\x1f\x8b"[..], Self::Svg),
            (b"AutoCAD Binary DXF", Self::Dxf),
            (b"%PDF", Self::Other("a PDF document")),
            (b"%!PS", Self::Other("a PostScript document")),
            (b"\xc5\xd0\xd3\xc6", Self::Other("a PostScript document")),
            (b"AC10", Self::Other("a DWG drawing")),
            (b"PK\x03\x04", Self::Other("a zip archive")),
            (b"\x89PNG", Self::Image),
            (b"\xff\xd8\xff", Self::Image),
            (b"GIF8", Self::Image),
            (b"BM", Self::Image),
            (b"RIFF", Self::Image),
            (b"II*\0", Self::Image),
            (b"MM\0*", Self::Image),
        ] {
            if bytes.starts_with(start) {
                return Some(kind);
            }
        }
        let head = &bytes[..bytes.len().min(HEAD)];
        // UTF-16 has every other byte 0.
        let head: Vec<u8> = head.iter().copied().filter(|&byte| byte != 0).collect();
        let head = String::from_utf8_lossy(&head).into_owned();
        let head = head.trim_start_matches(|sign: char| {
            sign.is_whitespace() || sign == '\u{feff}' || sign == '\u{fffd}'
        });
        if head.starts_with('<') {
            return of_root(head);
        }
        let mut lines = head.lines().map(str::trim);
        let (first, second) = (lines.next().unwrap_or(""), lines.next().unwrap_or(""));
        if first == "999" || first == "0" && second == "SECTION" {
            return Some(Self::Dxf);
        }
        let is_plot = head.starts_with('\u{1b}')
            || ["IN", "DF", "PU", "PD", "PA", "SP"].iter().any(|name| head.starts_with(name));
        let has_moves = ["PU", "PD", "PA", "PR"].iter().any(|name| head.contains(name));
        (is_plot && has_moves).then_some(Self::Hpgl)
    }

    /// As it is said in a sentence.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Svg => "an SVG drawing",
            Self::Dxf => "a DXF drawing",
            Self::LightBurn => "a LightBurn project",
            Self::Hpgl => "an HPGL plot",
            Self::Image => "an image",
            Self::Other(name) => name,
        }
    }

    /// Reads a file of this kind.
    pub(super) fn read(self, bytes: &[u8]) -> Result<Graphic, ReadError> {
        match self {
            #[cfg(feature = "svg")]
            Self::Svg => crate::svg::read(bytes),
            #[cfg(feature = "dxf")]
            Self::Dxf => crate::dxf::read(bytes),
            #[cfg(feature = "lightburn")]
            Self::LightBurn => crate::lightburn::read(bytes),
            Self::Hpgl => crate::hpgl::read(bytes),
            #[cfg(feature = "image")]
            Self::Image => crate::image::read(bytes),
            other => {
                let message =
                    format!("the file is {}, which is not read as a drawing", other.name());
                Err(ReadError::new(message, "save the drawing as SVG or DXF"))
            }
        }
    }
}

/// By the name of an XML document's first element: what comes before it are comments and declarations.
fn of_root(head: &str) -> Option<Kind> {
    let mut rest = head;
    loop {
        let open = rest.find('<')?;
        rest = &rest[open..];
        let end = match rest.as_bytes().get(1)? {
            b'!' if rest.starts_with("<!--") => "-->",
            b'!' if rest[..rest.find('>')?].contains('[') => "]",
            b'!' => ">",
            b'?' => "?>",
            _ => break,
        };
        rest = &rest[rest.find(end)? + end.len()..];
    }
    let name = rest[1..].split(|sign: char| sign.is_whitespace() || "/>".contains(sign)).next()?;
    match name.rsplit(':').next()? {
        "svg" => Some(Kind::Svg),
        "LightBurnProject" => Some(Kind::LightBurn),
        _ => None,
    }
}
