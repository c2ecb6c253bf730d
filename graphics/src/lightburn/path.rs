//! Vertices and the lines and curves between them, in both spellings of LightBurn.

use kurbo::Point;
use roxmltree::Node;

use crate::read::pen::Pen;
use crate::shape::Contour;

/// A corner with its handles, which are places of their own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Vertex {
    at: Point,
    /// The handle of the curve that begins here.
    leaving: Option<Point>,
    /// The handle of the curve that ends here.
    arriving: Option<Point>,
}

/// What is between two vertices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Primitive {
    is_curve: bool,
    from: usize,
    to: usize,
}

/// How vertices are connected.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Primitives {
    /// One after the other, and the last with the first.
    Closed,
    /// One after the other.
    Open,
    List(Vec<Primitive>),
}

/// `V0 0c0x1c1x2c1y3V10 0…`: a letter or a name before each number. `None` where it is something else.
pub(super) fn packed_vertices(text: &str) -> Option<Vec<Vertex>> {
    let mut vertices: Vec<([Option<f64>; 6], usize)> = Vec::new();
    let mut rest = text.trim_start();
    let mut field = 0;
    while let Some(first) = rest.chars().next() {
        if first == 'V' {
            vertices.push(([None; 6], 0));
            field = 0;
            rest = &rest[1..];
        } else if first == 'S' {
            // A smooth corner.
            rest = &rest[1..];
        } else if first == 'c' {
            let names = ["c0x", "c0y", "c1x", "c1y"];
            let name = names.iter().position(|name| rest.starts_with(name))?;
            field = name + 2;
            rest = &rest[3..];
        } else {
            let length = number_length(rest);
            let value: f64 = rest.get(..length)?.parse().ok()?;
            let (fields, _) = vertices.last_mut()?;
            *fields.get_mut(field)? = Some(value);
            field += 1;
            rest = &rest[length..];
        }
        rest = rest.trim_start_matches([' ', '\t', '\r', '\n', ',']);
    }
    vertices.into_iter().map(|(fields, _)| vertex(fields)).collect()
}

/// The length of the number that a text begins with.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let is_part = |place: usize| match bytes[place] {
        b'0'..=b'9' | b'.' => true,
        b'e' | b'E' => place > 0,
        b'+' | b'-' => place == 0 || matches!(bytes[place - 1], b'e' | b'E'),
        _ => false,
    };
    (0..bytes.len()).find(|&place| !is_part(place)).unwrap_or(bytes.len())
}

/// A handle without a y is none: LightBurn writes `c0x1` for one that is not used.
fn vertex([x, y, c0x, c0y, c1x, c1y]: [Option<f64>; 6]) -> Option<Vertex> {
    let place = |x: Option<f64>, y: Option<f64>| {
        let point = Point::new(x?, y?);
        point.is_finite().then_some(point)
    };
    Some(Vertex { at: place(x, y)?, leaving: place(c0x, c0y), arriving: place(c1x, c1y) })
}

/// `LineClosed`, `LineOpen`, or `L0 1B1 2…`.
pub(super) fn packed_primitives(text: &str) -> Option<Primitives> {
    match text.trim() {
        "LineClosed" => return Some(Primitives::Closed),
        "LineOpen" | "" => return Some(Primitives::Open),
        _ => {}
    }
    let mut list = Vec::new();
    for part in text.trim().split_inclusive(['L', 'B']).collect::<Vec<_>>().windows(2) {
        let is_curve = match part[0].chars().next_back() {
            Some('L') => false,
            Some('B') => true,
            _ => return None,
        };
        let numbers = part[1].trim_end_matches(['L', 'B']);
        let mut numbers = numbers.split_whitespace().map(str::parse);
        let (from, to) = (numbers.next()?.ok()?, numbers.next()?.ok()?);
        list.push(Primitive { is_curve, from, to });
    }
    Some(Primitives::List(list))
}

/// The elements `V` of older files.
pub(super) fn vertices(shape: Node<'_, '_>) -> Option<Vec<Vertex>> {
    let vertices = shape.children().filter(|node| node.has_tag_name("V"));
    vertices
        .map(|node| {
            let names = ["vx", "vy", "c0x", "c0y", "c1x", "c1y"];
            vertex(names.map(|name| crate::read::xml::number(node, name)))
        })
        .collect()
}

/// The elements `P` of older files.
pub(super) fn primitives(shape: Node<'_, '_>) -> Option<Primitives> {
    let primitives = shape.children().filter(|node| node.has_tag_name("P"));
    let list: Option<Vec<Primitive>> = primitives
        .map(|node| {
            let index = |name| node.attribute(name)?.trim().parse().ok();
            let is_curve = node.attribute("T")? == "B";
            Some(Primitive { is_curve, from: index("p0")?, to: index("p1")? })
        })
        .collect();
    Some(Primitives::List(list?))
}

/// The contours; `None` where a primitive names a vertex that is not there.
pub(super) fn contours(vertices: &[Vertex], primitives: &Primitives) -> Option<Vec<Contour>> {
    let mut pen = Pen::default();
    let line = |pen: &mut Pen| {
        for (index, vertex) in vertices.iter().enumerate() {
            match index {
                0 => pen.move_to(vertex.at),
                _ => pen.line_to(vertex.at),
            }
        }
    };
    match primitives {
        Primitives::Closed => {
            line(&mut pen);
            pen.close();
        }
        Primitives::Open => line(&mut pen),
        Primitives::List(list) => {
            // Where the contour began, and where it is.
            let mut way: Option<(usize, usize)> = None;
            for primitive in list {
                let (from, to) = (vertices.get(primitive.from)?, vertices.get(primitive.to)?);
                let begin = match way {
                    Some((begin, at)) if at == primitive.from => begin,
                    _ => {
                        pen.move_to(from.at);
                        primitive.from
                    }
                };
                if primitive.is_curve {
                    let first = from.leaving.unwrap_or(from.at);
                    pen.cubic_to(first, to.arriving.unwrap_or(to.at), to.at);
                } else {
                    pen.line_to(to.at);
                }
                way = Some((begin, primitive.to));
                if begin == primitive.to {
                    pen.close();
                    way = None;
                }
            }
        }
    }
    Some(pen.take())
}

#[cfg(test)]
mod tests {
    use kurbo::Point;

    use super::{Primitives, contours, packed_primitives, packed_vertices};
    use crate::shape::Segment;

    #[test]
    fn packed_lists_are_read_as_lightburn_writes_them() {
        let vertices = packed_vertices("V49 48c0x1c1x49.5c1y47.5V-6.2e1 63c0x62.2c0y63.3c1x1SV0 0")
            .expect("three");
        assert_eq!(vertices.len(), 3);
        assert_eq!(vertices[0].at, Point::new(49.0, 48.0));
        assert_eq!(vertices[0].leaving, None);
        assert_eq!(vertices[0].arriving, Some(Point::new(49.5, 47.5)));
        assert_eq!(vertices[1].at, Point::new(-62.0, 63.0));
        assert_eq!(vertices[1].leaving, Some(Point::new(62.2, 63.3)));
        assert!(packed_vertices("V1").is_none());
        assert!(packed_vertices("V1 x").is_none());
        assert!(packed_vertices("1 2").is_none());
        assert!(packed_vertices("V1 2 3c").is_none());
    }

    #[test]
    fn primitives_make_contours_that_close_where_they_meet_their_start() {
        let vertices = packed_vertices("V0 0V10 0c0x12c0y0V10 10c1x12c1y10V5 5V6 6").expect("five");
        let list = packed_primitives("L0 1B1 2L2 0L3 4").expect("four");
        let contours = contours(&vertices, &list).expect("two");
        assert_eq!(contours.len(), 2);
        assert!(contours[0].is_closed && contours[0].segments.len() == 3);
        let curve = Segment::Cubic((12.0, 0.0).into(), (12.0, 10.0).into(), (10.0, 10.0).into());
        assert_eq!(contours[0].segments[1], curve);
        assert!(!contours[1].is_closed);
    }

    #[test]
    fn lines_and_faults_are_told_apart() {
        assert_eq!(packed_primitives("LineClosed"), Some(Primitives::Closed));
        assert_eq!(packed_primitives("LineOpen"), Some(Primitives::Open));
        assert_eq!(packed_primitives("L0"), None);
        assert_eq!(packed_primitives("L0 x"), None);
        let vertices = packed_vertices("V0 0V1 1").expect("two");
        assert!(contours(&vertices, &packed_primitives("L0 7").expect("one")).is_none());
    }
}
