//! Clouds of points: the vertices of PLY files, text or binary, and tables of numbers.

use std::io::Cursor;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};

use crate::ReadError;

/// The most points of a file, and the most elements of any other kind before them.
pub const MOST_POINTS: usize = 10_000_000;

/// One vertex; whatever has no such coordinates stays no number.
#[derive(Debug, Clone, Copy)]
struct Vertex([f64; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([f64::NAN; 3])
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let row = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            _ => return PropertyAccessResult::Ignored,
        };
        self.0[row] = match property {
            Property::Char(value) => value.into(),
            Property::UChar(value) => value.into(),
            Property::Short(value) => value.into(),
            Property::UShort(value) => value.into(),
            Property::Int(value) => value.into(),
            Property::UInt(value) => value.into(),
            Property::Float(value) => value.into(),
            Property::Double(value) => value,
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// The vertices of a PLY file with these bytes, in its own unit, which it does not say.
///
/// # Errors
/// What is no PLY file, has no `vertex` with `x`, `y` and `z`, or more than [`MOST_POINTS`] of them.
pub fn ply(bytes: &[u8]) -> Result<Vec<[f64; 3]>, ReadError> {
    const HELP: &str = "give a PLY file whose `vertex` elements have x, y and z";
    let unreadable =
        |error: ply_rs_bw::parser::ParseError| ReadError::new(first_line(&error.to_string()), HELP);
    let parser = Parser::<Vertex>::new();
    let mut reader = Reader::new(Cursor::new(bytes));
    let header = parser.read_header(&mut reader).map_err(unreadable)?;
    for (name, element) in &header.elements {
        if element.count > MOST_POINTS {
            let text = format!("{} elements `{name}` are more than {MOST_POINTS}", element.count);
            return Err(ReadError::new(text, "divide the cloud"));
        }
        if element.properties.is_empty() {
            let text = format!("the element `{name}` has no property");
            return Err(ReadError::new(text, HELP));
        }
        let vertices =
            parser.read_payload_for_element(&mut reader, element, &header).map_err(unreadable)?;
        if name != "vertex" {
            continue;
        }
        let is_place = |vertex: &Vertex| vertex.0.iter().all(|value| value.is_finite());
        if let Some(index) = vertices.iter().position(|vertex| !is_place(vertex)) {
            let text = format!("vertex {index} (from 0) has no finite x, y and z");
            return Err(ReadError::new(text, HELP));
        }
        return Ok(vertices.into_iter().map(|vertex| vertex.0).collect());
    }
    Err(ReadError::new("there is no element `vertex`", HELP))
}

/// What an error says before it quotes the file.
fn first_line(text: &str) -> String {
    text.lines().next().unwrap_or_default().trim_end_matches(['.', ':']).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    const TEXT: &str = "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 2\nproperty float x\n\
                        property float y\nproperty float z\nproperty uchar red\nelement face 1\n\
                        property list uchar int vertex_indices\nend_header\n1 2.5 -3 255\n0 1e-3 4 0\n\
                        3 0 1 0\n";

    fn binary(is_big: bool) -> Vec<u8> {
        let order = if is_big { "big" } else { "little" };
        let mut bytes = format!(
            "ply\nformat binary_{order}_endian 1.0\nelement vertex 2\nproperty double x\n\
             property float y\nproperty short z\nend_header\n"
        )
        .into_bytes();
        for (x, y, z) in [(1.0_f64, 2.5_f32, -3_i16), (0.0, 1e-3, 4)] {
            if is_big {
                bytes.extend(x.to_be_bytes());
                bytes.extend(y.to_be_bytes());
                bytes.extend(z.to_be_bytes());
            } else {
                bytes.extend(x.to_le_bytes());
                bytes.extend(y.to_le_bytes());
                bytes.extend(z.to_le_bytes());
            }
        }
        bytes
    }

    #[test]
    fn vertices_are_read_from_text_and_from_bytes() {
        let right = [[1.0, 2.5, -3.0], [0.0, f64::from(1e-3_f32), 4.0]];
        for file in [TEXT.as_bytes().to_vec(), binary(true), binary(false)] {
            assert_eq!(ply(&file).expect("a sound file"), right);
        }
    }

    #[test]
    fn what_is_no_cloud_is_refused() {
        let refused = |text: &str| ply(text.as_bytes()).expect_err("refused").message;
        assert!(refused(&TEXT.replace("float z", "float w")).contains("no finite"));
        assert!(refused(&TEXT.replace("vertex 2", "vertex 20000000")).contains("more than"));
        assert!(refused(&TEXT.replace("element vertex", "element node")).contains("`vertex`"));
        let empty = "ply\nformat ascii 1.0\nelement vertex 9\nend_header\n";
        assert!(refused(empty).contains("no property"));
        refused("");
        refused("solid cube");
        refused(&TEXT.replace("2.5", "two"));
    }

    #[test]
    fn no_bytes_make_it_panic_or_hang() {
        let mut random = Random::new(5);
        let files = [TEXT.as_bytes().to_vec(), binary(true), binary(false)];
        for _ in 0..10_000 {
            let mut file = files[random.below(files.len())].clone();
            for _ in 0..1 + random.below(4) {
                let at = random.below(file.len());
                file[at] = random.below(256) as u8;
            }
            file.truncate(random.below(file.len() * 4));
            let _ = ply(&file);
        }
    }
}
