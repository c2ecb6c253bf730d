use super::*;
use crate::random::Random;
use crate::text::Align;

const PLAIN: Text<'_> = Text {
    text: "H",
    height: Height::Cap(0.01),
    letter_spacing: 0.0,
    line_spacing: 1.2,
    align: Align::Left,
    radius: None,
};

fn shape(text: Text<'_>) -> Shape {
    Font::built_in().expect("a font").set(&text).expect("a valid text")
}

fn bounds(shape: &Shape) -> Rect {
    let bounds = shape.contours.iter().map(Contour::bounds);
    bounds.reduce(|one, other| one.union(other)).expect("contours")
}

#[test]
fn capitals_are_as_high_as_asked() {
    let shape = shape(PLAIN);
    assert_eq!(shape.contours.len(), 1);
    let bounds = bounds(&shape);
    assert!(bounds.y0.abs() < 1e-12 && (bounds.y1 - 0.01).abs() < 2e-5, "{bounds}");
}

#[test]
fn the_em_is_the_size_of_drawing_programs() {
    let cap = bounds(&shape(Text { height: Height::Em(0.01), ..PLAIN })).height();
    // Ubuntu's capitals are 693 units of 1000 high.
    assert!((cap - 0.00693).abs() < 1e-8, "{cap}");
}

#[test]
fn counters_are_holes_and_curves_are_cubics() {
    let shape = shape(Text { text: "O", ..PLAIN });
    assert_eq!(shape.contours.len(), 2);
    let areas: Vec<f64> = shape
        .contours
        .iter()
        .map(|contour| crate::curve::signed_area(&contour.flattened(1e-7)))
        .collect();
    assert!(areas[0] * areas[1] < 0.0, "{areas:?}");
    let segments = shape.contours.iter().flat_map(|contour| &contour.segments);
    assert!(segments.into_iter().all(|segment| matches!(segment, Segment::Cubic(..))));
    assert!(shape.contours.iter().all(|contour| contour.end() == contour.start));
}

#[test]
fn pairs_are_kerned() {
    let width = |text| bounds(&shape(Text { text, ..PLAIN })).width();
    let apart = bounds(&shape(Text { text: "A", ..PLAIN })).width()
        + bounds(&shape(Text { text: "V", ..PLAIN })).width();
    assert!(width("AV") < apart - 1e-4, "{} of {apart}", width("AV"));
}

#[test]
fn letters_are_spaced() {
    let width =
        |letter_spacing| bounds(&shape(Text { text: "HHH", letter_spacing, ..PLAIN })).width();
    assert!((width(0.001) - width(0.0) - 0.002).abs() < 1e-12);
}

#[test]
fn lines_are_aligned_and_lie_below_each_other() {
    let text = Text { text: "HH\r\nH", height: Height::Em(0.01), ..PLAIN };
    for (align, place) in [(Align::Left, 0.0), (Align::Centre, 0.5), (Align::Right, 1.0)] {
        let shape = shape(Text { align, ..text });
        let (first, second) = (shape.contours[..2].to_vec(), &shape.contours[2]);
        let first = bounds(&Shape { contours: first, ..Shape::default() });
        let second = second.bounds();
        assert!((first.y0 - second.y0 - 0.012).abs() < 1e-12);
        let at = |rect: Rect| rect.x0 + rect.width() * place;
        assert!((at(first) - at(second)).abs() < 1e-9, "{first} and {second}");
    }
}

#[test]
fn text_on_an_arc_stands_on_it() {
    for radius in [0.05, -0.05] {
        let text = Text { text: "IIIII", align: Align::Centre, radius: Some(radius), ..PLAIN };
        let shape = shape(text);
        let centre = Point::new(0.0, -radius);
        // The feet of the strokes are chords that touch the circle.
        for contour in &shape.contours {
            let away: Vec<f64> =
                contour.pieces().map(|(start, _)| (start - centre).hypot()).collect();
            let (near, far) = (
                away.iter().copied().fold(f64::INFINITY, f64::min),
                away.iter().copied().fold(0.0, f64::max),
            );
            let foot = if radius > 0.0 { near } else { far };
            assert!((foot - 0.05).abs() < 5e-5, "{foot}");
            assert!((far - near - 0.01).abs() < 1e-4, "{near} to {far}");
        }
        let middle = bounds(&shape).center().x;
        assert!(middle.abs() < 1e-5, "{middle}");
    }
}

#[test]
fn what_cannot_be_set_is_named() {
    let check = |text: Text<'_>, line: Option<u64>, expected: &str| {
        let error = Font::built_in().expect("a font").set(&text).expect_err("refused");
        assert_eq!((error.line, error.message.as_str()), (line, expected));
    };
    check(Text { text: "a\nb中", ..PLAIN }, Some(2), "the font has no glyph for '中' (U+4E2D)");
    check(Text { height: Height::Cap(0.0), ..PLAIN }, None, "the height of the text is 0");
    check(
        Text { text: "HHHHHHHH", radius: Some(0.005), ..PLAIN },
        Some(1),
        "the line is 0.079885 m long and its circle 0.031416 m around",
    );
    let error = Font::new(b"no font").expect_err("refused");
    assert!(error.message.starts_with("the font cannot be read: "), "{error}");
}

#[test]
fn ten_thousand_damaged_fonts_do_no_harm() {
    let mut random = Random::new(16);
    let mut bytes = epaint_default_fonts::UBUNTU_LIGHT.to_vec();
    let tables = 12 + 16 * usize::from(u16::from_be_bytes([bytes[4], bytes[5]]));
    let text = Text { text: "AVfi Ö", ..PLAIN };
    let mut set = 0;
    for round in 0..10_000 {
        let mut undo = Vec::new();
        for _ in 0..1 + random.below(20) {
            // The table directory, the head of a table, or anything.
            let at = match round % 3 {
                0 => random.below(tables),
                1 => {
                    let entry = 12 + 16 * random.below((tables - 12) / 16);
                    let word = [entry + 8, entry + 9, entry + 10, entry + 11].map(|at| bytes[at]);
                    (u32::from_be_bytes(word) as usize).saturating_add(random.below(200))
                }
                _ => random.below(bytes.len()),
            };
            if let Some(byte) = bytes.get_mut(at) {
                undo.push((at, *byte));
                *byte = random.bits() as u8;
            }
        }
        if let Ok(font) = Font::new(&bytes) {
            set += usize::from(font.set(&text).is_ok());
        }
        undo.into_iter().rev().for_each(|(at, byte)| bytes[at] = byte);
    }
    assert!(set > 1_000, "{set}");
}
