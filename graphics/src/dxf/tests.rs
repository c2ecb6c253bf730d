//! Objects whose places are known by hand, and files of ezdxf with points that it computed on their curves.

use kurbo::{Affine, CubicBez, ParamCurveNearest as _, Point};

use super::{drawn, read, shapes};
use crate::read::arcs::holds;
use crate::read::bounds;
use crate::read::notes::Notes;
use crate::shape::{Contour, Graphic, Segment};

/// A file with a header, tables and blocks, given as words: each pair is `code value`, separated by `|`.
fn drawing(before: &str, entities: &str) -> Graphic {
    let text = format!("{before}|0 SECTION|2 ENTITIES|{entities}|0 ENDSEC|0 EOF");
    let pairs = text.split('|').filter(|pair| !pair.trim().is_empty());
    let text: String = pairs
        .map(|pair| {
            let (code, value) = pair.trim().split_once(' ').expect("a pair");
            format!("{code}\n{value}\n")
        })
        .collect();
    read(text.as_bytes()).unwrap_or_else(|error| panic!("{error} in {text}"))
}

const MILLIMETRES: &str = "0 SECTION|2 HEADER|9 $INSUNITS|70 4|0 ENDSEC";

fn blocks(content: &str) -> String {
    format!("{MILLIMETRES}|0 SECTION|2 BLOCKS|{content}|0 ENDSEC")
}

/// The rectangle around all shapes, in millimetres, to 1 nm.
fn around(graphic: &Graphic) -> [f64; 4] {
    let all = graphic.shapes.iter().filter_map(|shape| bounds(&shape.contours));
    let all = all.reduce(|one, other| one.union(other)).expect("a shape");
    [all.x0, all.y0, all.x1, all.y1].map(|value| (value * 1e9).round() / 1e6 + 0.0)
}

fn notes(graphic: &Graphic) -> Vec<&str> {
    graphic.notes.iter().map(|note| note.text.as_str()).collect()
}

#[test]
fn units_are_those_of_the_header() {
    for (unit, width) in [(1, 25.4), (4, 1.0), (5, 10.0), (6, 1000.0), (2, 304.8), (13, 0.001)] {
        let header = format!("0 SECTION|2 HEADER|9 $INSUNITS|70 {unit}|0 ENDSEC");
        let graphic = drawing(&header, "0 LINE|10 0|20 0|11 1|21 0");
        assert_eq!(around(&graphic)[2], width);
        assert!(graphic.notes.is_empty());
    }
    let unitless = drawing("", "0 LINE|10 0|20 0|11 1|21 0");
    assert_eq!(around(&unitless)[2], 1.0);
    assert!(notes(&unitless)[0].contains("taken as millimetres"));
    let header = "0 SECTION|2 HEADER|9 $INSUNITS|70 0|9 $MEASUREMENT|70 0|0 ENDSEC";
    let english = drawing(header, "0 LINE|10 0|20 0|11 1|21 0");
    assert!(notes(&english)[0].contains("25.4"), "{english:?}");
}

#[test]
fn sections_that_a_file_has_more_than_once_count_together() {
    let line = |to: u32| format!("0 LINE|10 0|20 0|11 {to}|21 1");
    let section = |content: &str| format!("0 SECTION|2 ENTITIES|{content}|0 ENDSEC");
    let before = [MILLIMETRES, &section(&line(30)), &section("")].join("|");
    assert_eq!(around(&drawing(&before, &line(4))), [0.0, 0.0, 30.0, 1.0]);
}

#[test]
fn arcs_circles_and_ellipses_are_true() {
    let graphic = drawing(MILLIMETRES, "0 CIRCLE|8 A|10 50|20 40|40 100");
    assert_eq!(around(&graphic), [-50.0, -60.0, 150.0, 140.0]);
    let contour = &graphic.shapes[0].contours[0];
    assert!(contour.is_closed && contour.segments.len() == 1);
    // From 270 to 90 degrees, through 0.
    let graphic = drawing(MILLIMETRES, "0 ARC|10 0|20 0|40 10|50 270|51 90");
    assert_eq!(around(&graphic), [0.0, -10.0, 10.0, 10.0]);
    let graphic =
        drawing(MILLIMETRES, "0 ELLIPSE|10 0|20 0|11 0|21 20|40 0.5|41 0|42 6.283185307179586");
    assert_eq!(around(&graphic), [-10.0, -20.0, 10.0, 20.0]);
    assert!(graphic.shapes[0].contours[0].is_closed);
}

#[test]
fn an_extrusion_downwards_mirrors_flat_objects_only() {
    let graphic = drawing(MILLIMETRES, "0 CIRCLE|10 30|20 5|40 2|210 0|220 0|230 -1");
    assert_eq!(around(&graphic), [-32.0, 3.0, -28.0, 7.0]);
    let graphic = drawing(MILLIMETRES, "0 ARC|10 0|20 0|40 10|50 0|51 90|210 0|220 0|230 -1");
    assert_eq!(around(&graphic), [-10.0, 0.0, 0.0, 10.0]);
    let graphic = drawing(MILLIMETRES, "0 LINE|10 3|20 0|11 4|21 1|210 0|220 0|230 -1");
    assert_eq!(around(&graphic), [3.0, 0.0, 4.0, 1.0]);
}

#[test]
fn polylines_have_their_bulges() {
    // Half a circle to the right of the first side, of radius 5.
    let light = "0 LWPOLYLINE|90 3|70 1|10 0|20 0|42 1|10 10|20 0|10 10|20 10";
    let graphic = drawing(MILLIMETRES, light);
    assert_eq!(around(&graphic), [0.0, -5.0, 10.0, 10.0]);
    assert!(graphic.shapes[0].contours[0].is_closed);
    let heavy = "0 POLYLINE|66 1|70 1|0 VERTEX|10 0|20 0|42 1|0 VERTEX|10 10|20 0\
                 |0 VERTEX|10 10|20 10|0 SEQEND|0 LINE|10 0|20 0|11 1|21 -9";
    let graphic = drawing(MILLIMETRES, heavy);
    assert_eq!(around(&graphic), [0.0, -9.0, 10.0, 10.0]);
    // Without the mark of its end.
    let heavy = heavy.replace("|0 SEQEND", "");
    assert_eq!(drawing(MILLIMETRES, &heavy).shapes.len(), 2);
}

#[test]
fn blocks_are_scaled_turned_repeated_and_nested() {
    let block = "0 BLOCK|2 B|10 1|20 1|0 LINE|8 0|62 0|10 1|20 1|11 3|21 2|0 ENDBLK\
                 |0 BLOCK|2 N|10 0|20 0|0 INSERT|2 B|10 5|20 0|50 90|0 ENDBLK\
                 |0 BLOCK|2 S|10 0|20 0|0 INSERT|2 B|10 0|20 0|50 45|0 ENDBLK";
    let before = blocks(block);
    let graphic = drawing(&before, "0 INSERT|8 CUT|62 1|2 b|10 100|20 50|41 2|42 -3");
    assert_eq!(around(&graphic), [100.0, 47.0, 104.0, 50.0]);
    let shape = &graphic.shapes[0];
    assert_eq!(shape.layer.as_deref(), Some("CUT"));
    assert_eq!(shape.stroke.map(|colour| colour.to_string()).as_deref(), Some("#ff0000"));
    // Turned by 90 degrees: (2, 1) becomes (-1, 2), at (5, 0).
    let graphic = drawing(&before, "0 INSERT|2 N|10 0|20 0|41 10");
    assert_eq!(around(&graphic), [40.0, 0.0, 50.0, 2.0]);
    // Sheared: turned by 45 degrees, then twenty times as wide.
    let graphic = drawing(&before, "0 INSERT|2 S|10 0|20 0|41 20");
    assert_eq!(around(&graphic), [0.0, 0.0, 14.142136, 2.12132]);
    let graphic = drawing(&before, "0 INSERT|2 B|10 0|20 0|70 3|71 2|44 10|45 20");
    assert_eq!(graphic.shapes.len(), 6);
    assert_eq!(around(&graphic), [0.0, 0.0, 22.0, 21.0]);
    let graphic = drawing(&before, "0 INSERT|2 B|10 7|20 0|210 0|220 0|230 -1");
    assert_eq!(around(&graphic), [-9.0, 0.0, -7.0, 1.0]);
}

#[test]
fn layers_give_colours_and_hide() {
    let tables = "0 SECTION|2 TABLES|0 TABLE|2 LAYER|0 LAYER|2 Cut|62 3|70 0|6 CONTINUOUS\
                  |0 LAYER|2 OFF|62 -1|70 0|0 LAYER|2 ICE|62 1|70 1|0 LAYER|2 GAPS|62 5|6 DASHED\
                  |0 ENDTAB|0 ENDSEC";
    let line = "10 0|20 0|11 1|21 0";
    let graphic = drawing(
        &format!("{MILLIMETRES}|{tables}"),
        &format!(
            "0 LINE|8 CUT|{line}|0 LINE|8 OFF|{line}|0 LINE|8 ICE|{line}|0 LINE|8 ICE|{line}\
                  |0 LINE|8 GAPS|{line}|0 LINE|8 cut|420 1193046|{line}|0 LINE|8 cut|60 1|{line}\
                  |0 LINE|67 1|{line}"
        ),
    );
    let colours: Vec<String> =
        graphic.shapes.iter().filter_map(|shape| shape.stroke).map(|it| it.to_string()).collect();
    assert_eq!(colours, ["#00ff00", "#0000ff", "#123456"]);
    assert_eq!(
        notes(&graphic),
        [
            "layer \"OFF\" is off: its objects are left out",
            "layer \"ICE\" is frozen: its objects are left out (2 times)",
            "a dashed line is drawn without gaps",
            "an object that is invisible is left out",
            "what is in the paper space (a page layout) is left out",
        ]
    );
}

#[test]
fn pieces_are_joined_within_their_layer_and_lines_are_told() {
    let entities = "0 LINE|8 A|10 0|20 0|11 10|21 0|0 LINE|8 B|10 10|20 0|11 10|21 10\
                    |0 LINE|8 A|10 10|20 10|11 10|21 0|0 LINE|8 A|10 0|20 0|11 10|21 10";
    let graphic = drawing(MILLIMETRES, entities);
    assert_eq!(graphic.shapes.len(), 2);
    assert!(graphic.shapes[0].contours[0].is_closed);
    assert_eq!(graphic.shapes[0].contours[0].segments.len(), 3);
    assert_eq!(graphic.shapes[0].line, 15);
}

#[test]
fn what_is_left_out_is_named() {
    for (entities, note) in [
        ("0 TEXT|10 0|20 0|1 hello", "TEXT with numbers that do not fit is left out"),
        (
            "0 POINT|10 0|20 0|0 POINT|10 1|20 0",
            "POINT (a point without a size) is left out (2 times)",
        ),
        ("0 TEXT|10 0|20 0|40 2|1 \u{4e2d}", "TEXT is left out: the font has no glyph"),
        ("0 TEXT|10 0|20 0|40 2|1 hello", "text is drawn in single strokes"),
        ("0 HATCH|70 1", "HATCH without an outline"),
        ("0 HATCH|91 1|92 0|93 1|72 9|75 0", "HATCH without an outline"),
        ("0 3DFACE|10 0|20 0", "3DFACE (a filled face)"),
        ("0 FLUX|1 x", "FLUX is left out"),
        ("0 LINE|10 0|20 0|30 0|11 1|21 1|31 5", "seen from above"),
        ("0 LINE|10 0|20 0|11 0|21 0", "LINE without a length"),
        ("0 CIRCLE|10 0|20 0", "CIRCLE with numbers that do not fit"),
        ("0 SPLINE|71 3|10 0|20 0|10 1|20 1", "SPLINE with numbers that do not fit"),
        ("0 SPLINE|71 3|11 0|21 0|11 1|21 1|11 3|21 0", "through its points"),
        ("0 POLYLINE|70 64|0 VERTEX|10 0|20 0|0 SEQEND", "a mesh is left out"),
        ("0 INSERT|2 GONE|10 0|20 0", "block \"GONE\" is not in the file"),
    ] {
        let graphic = drawing(MILLIMETRES, entities);
        let notes = notes(&graphic);
        assert!(notes.iter().any(|found| found.contains(note)), "{notes:?} lacks {note}");
    }
}

/// Areas of the shapes that are filled, by Green's theorem over fine chords [mm²], holes counted as what is
/// left when they are taken out of the largest outline.
fn filled_area(graphic: &Graphic) -> f64 {
    let area = |contour: &Contour| {
        let points = contour.flattened(1e-8);
        let ring = points.iter().zip(points.iter().cycle().skip(1));
        (ring.map(|(one, other)| one.to_vec2().cross(other.to_vec2())).sum::<f64>() / 2.0).abs()
    };
    let shapes = graphic.shapes.iter().filter(|shape| shape.fill.is_some());
    let areas = shapes.map(|shape| {
        let mut areas: Vec<f64> = shape.contours.iter().map(area).collect();
        areas.sort_by(|one, other| other.total_cmp(one));
        areas.first().copied().unwrap_or(0.0) - areas.iter().skip(1).sum::<f64>()
    });
    areas.sum::<f64>() * 1e6
}

#[test]
fn hatches_are_filled_with_their_holes() {
    let pi = core::f64::consts::PI;
    let outer = "0 HATCH|8 A|62 1|10 0|20 0|30 0|2 SOLID|70 1|71 0";
    let square = "92 3|72 0|73 1|93 4|10 0|20 0|10 10|20 0|10 10|20 10|10 0|20 10|97 0";
    // A circle as two arcs: one of them clockwise, whose angles are counted clockwise.
    let circle = "92 16|93 2|72 2|10 5|20 5|40 2|50 0|51 180|73 1|72 2|10 5|20 5|40 2|50 180|51 360|73 1|97 0";
    let clockwise = "92 16|93 2|72 2|10 5|20 5|40 2|50 180|51 360|73 0|72 2|10 5|20 5|40 2|50 0|51 180|73 0|97 0";
    let ellipse = "92 16|93 1|72 3|10 5|20 5|11 0|21 4|40 0.5|50 0|51 360|73 1|97 0";
    let segment = "92 1|93 2|72 2|10 0|20 0|40 2|50 90|51 180|73 1|72 1|10 -2|20 0|11 0|21 2|97 0";
    let spline = "92 1|93 2|72 4|94 2|73 0|74 0|95 6|96 3|40 0|40 0|40 0|40 1|40 1|40 1|10 0|20 0|10 3|20 6|10 6|20 0|72 1|10 6|20 0|11 0|21 0|97 0";
    for (paths, area) in [
        (format!("91 1|{square}"), 100.0),
        (format!("91 2|{square}|{circle}"), 100.0 - 4.0 * pi),
        (format!("91 2|{square}|{clockwise}"), 100.0 - 4.0 * pi),
        (format!("91 1|{ellipse}"), 8.0 * pi),
        // A quarter of a disc less its triangle.
        (format!("91 1|{segment}"), pi - 2.0),
        (format!("91 1|{spline}"), 12.0),
    ] {
        let graphic = drawing(MILLIMETRES, &format!("{outer}|{paths}|75 0|76 1|98 1|10 5|20 5"));
        let found = filled_area(&graphic);
        assert!((found - area).abs() < 1e-3, "{found} instead of {area} mm² of {paths}");
        assert!(notes(&graphic).is_empty(), "{:?}", notes(&graphic));
        let shape = &graphic.shapes[0];
        assert!(shape.stroke.is_none() && shape.contours.iter().all(|one| one.is_closed));
        assert_eq!(shape.fill.map(|fill| fill.colour.to_string()).as_deref(), Some("#ff0000"));
    }
    let face = "0 SOLID|10 0|20 0|11 4|21 0|12 0|22 3|13 4|23 3";
    assert!((filled_area(&drawing(MILLIMETRES, face)) - 12.0).abs() < 1e-6);
    // Each outline by itself: what overlaps is filled all the same.
    let apart = format!("{outer}|70 0|91 2|{square}|{circle}|75 2|76 1");
    assert_eq!(drawing(MILLIMETRES, &apart).shapes.len(), 2);
}

#[test]
fn texts_are_as_high_as_said_and_held_where_they_should_be() {
    let text = |codes: &str| around(&drawing(MILLIMETRES, &format!("0 TEXT|40 7|1 HH|{codes}")));
    // H is 4 mm wide at 7 mm, and 2 mm apart.
    assert_eq!(text("10 1|20 2"), [1.0, 2.0, 11.0, 9.0]);
    assert_eq!(text("10 0|20 0|11 1|21 2|72 4"), [-5.0, -1.5, 5.0, 5.5]);
    assert_eq!(text("10 1|20 2|41 2"), [1.0, 2.0, 21.0, 9.0]);
    assert_eq!(text("10 1|20 2|50 90"), [-6.0, 2.0, 1.0, 12.0]);
    assert_eq!(text("10 0|20 0|11 0|21 0|73 3"), [0.0, -7.0, 10.0, 0.0]);
    assert_eq!(text("10 0|20 0|11 20|21 0|72 5"), [0.0, 0.0, 20.0, 7.0]);
    assert_eq!(text("10 0|20 0|11 20|21 0|72 3"), [0.0, 0.0, 20.0, 14.0]);
    let lines = "0 MTEXT|10 0|20 0|40 7|71 1|1 {\\fArial;H}\\PH";
    // Baselines are 5/3 of the height apart.
    let found = around(&drawing(MILLIMETRES, lines));
    assert!(
        (found[3] - 0.0).abs() < 1e-6 && (found[1] + 7.0 + 35.0 / 3.0).abs() < 1e-5,
        "{found:?}"
    );
    let wrapped = around(&drawing(MILLIMETRES, "0 MTEXT|10 0|20 0|40 7|41 12|71 1|1 HH HH"));
    assert_eq!(wrapped[2], 10.0);
    // In a block, with the block's scale; hidden ones are not drawn.
    let before = blocks("0 BLOCK|2 B|10 0|20 0|0 LINE|10 0|20 0|11 1|21 0|0 ENDBLK");
    let insert = "0 INSERT|2 B|66 1|10 0|20 0|0 ATTRIB|10 3|20 0|40 7|1 H|70 0|0 ATTRIB|10 30|20 0|40 7|1 H|70 1|0 SEQEND";
    assert_eq!(around(&drawing(&before, insert)), [0.0, 0.0, 7.0, 7.0]);
}

#[cfg(feature = "text")]
#[test]
fn texts_of_outline_fonts_are_filled() {
    let style =
        "0 SECTION|2 TABLES|0 TABLE|2 STYLE|0 STYLE|2 Big|70 0|3 arial.ttf|0 ENDTAB|0 ENDSEC";
    let before = format!("{MILLIMETRES}|{style}");
    let graphic = drawing(&before, "0 TEXT|10 0|20 0|40 10|1 H|7 BIG");
    assert!(graphic.shapes[0].fill.is_some());
    assert!((around(&graphic)[3] - 10.0).abs() < 0.1, "{:?}", around(&graphic));
    assert!(notes(&graphic)[0].contains("Ubuntu Light instead of the font arial.ttf"));
}

#[test]
fn faults_and_bombs_are_refused_with_their_line() {
    assert!(read(b"").is_err());
    assert!(read(b"0\nSECTION\n2\nHEADER\n0\nENDSEC\n0\nEOF\n").is_err());
    assert_eq!(read(b"0\nSECTION\nx\n2\n").expect_err("no code").line, Some(3));
    let circle = "0 BLOCK|2 A|10 0|20 0|0 INSERT|2 B|10 0|20 0|0 ENDBLK\
                  |0 BLOCK|2 B|10 0|20 0|0 INSERT|2 A|10 0|20 0|0 ENDBLK";
    let mut laughs = "0 BLOCK|2 B0|0 LINE|10 0|20 0|11 1|21 1|0 ENDBLK".to_owned();
    for level in 1..30 {
        let insert = format!("|0 INSERT|2 B{}|10 0|20 0", level - 1).repeat(10);
        laughs += &format!("|0 BLOCK|2 B{level}{insert}|0 ENDBLK");
    }
    let array = "0 BLOCK|2 A|0 ENDBLK";
    for (content, insert) in [
        (circle, "0 INSERT|2 A|10 0|20 0"),
        (laughs.as_str(), "0 INSERT|2 B29|10 0|20 0"),
        (array, "0 INSERT|2 A|10 0|20 0|70 32000|71 32000"),
    ] {
        let text = format!("{}|0 SECTION|2 ENTITIES|{insert}|0 ENDSEC|0 EOF", blocks(content));
        let text = text.replace(['|', ' '], "\n");
        assert!(read(text.as_bytes()).is_err(), "{insert}");
    }
}

/// How far a point is from a segment that begins at `from` [m].
fn distance(point: Point, from: Point, segment: &Segment) -> f64 {
    match *segment {
        Segment::Line(end) => kurbo::Line::new(from, end).nearest(point, 1e-12).distance_sq.sqrt(),
        Segment::Cubic(first, second, end) => {
            CubicBez::new(from, first, second, end).nearest(point, 1e-10).distance_sq.sqrt()
        }
        Segment::Arc(arc) => {
            let [a, b] = [arc.major, arc.minor];
            let by = Affine::new([a.x, a.y, b.x, b.y, arc.centre.x, arc.centre.y]);
            let unit = by.inverse() * point;
            let angle = unit.to_vec2().atan2();
            let ends = (point - from).hypot().min((point - segment.end()).hypot());
            match holds(&arc, angle) {
                true => (point - arc.point(angle)).hypot().min(ends),
                false => ends,
            }
        }
    }
}

fn length(contour: &Contour) -> f64 {
    let mut at = contour.start;
    let mut total = 0.0;
    for segment in &contour.segments {
        let from = at;
        total += (1..=1000).fold(0.0, |sum, step| {
            let share = f64::from(step) / 1000.0;
            let to = match *segment {
                Segment::Line(end) => from.lerp(end, share),
                Segment::Cubic(first, second, end) => {
                    use kurbo::ParamCurve as _;
                    CubicBez::new(from, first, second, end).eval(share)
                }
                Segment::Arc(arc) => arc.point(arc.start + arc.sweep * share),
            };
            let step = (to - at).hypot();
            at = to;
            sum + step
        });
        at = segment.end();
    }
    total
}

/// Compares a file of ezdxf with what that computed: the total length, and points on the curves.
fn compare(bytes: &[u8], points: &str) {
    let (pieces, areas) = drawn(bytes, &mut Notes::default()).expect("a drawing");
    // Its texts and hatches are no curves of its own.
    assert!(!areas.is_empty());
    let shapes = shapes(pieces, Vec::new());
    let contours: Vec<&Contour> = shapes.iter().flat_map(|it| &it.contours).collect();
    let mut lines = points.lines();
    let expected: f64 = lines.next().and_then(|line| line.parse().ok()).expect("a length");
    let found: f64 = contours.iter().map(|contour| length(contour) * 1e3).sum();
    assert!((found - expected).abs() < 1e-4 * expected, "{found} mm and not {expected}");
    for line in lines {
        let numbers: Vec<f64> = line.split(' ').filter_map(|number| number.parse().ok()).collect();
        let point = Point::new(numbers[0] * 1e-3, numbers[1] * 1e-3);
        let mut nearest = f64::INFINITY;
        for contour in &contours {
            let mut at = contour.start;
            for segment in &contour.segments {
                nearest = nearest.min(distance(point, at, segment));
                at = segment.end();
            }
        }
        // What the other program rounds: its points have ten digits.
        assert!(nearest < 0.2e-6, "{point:?} is {nearest} m away");
    }
}

#[test]
fn files_of_another_program_have_its_curves() {
    let old = include_str!("../../tests/files/r12.points");
    let new = include_str!("../../tests/files/r2000.points");
    compare(include_bytes!("../../tests/files/r12.dxf"), old);
    compare(include_bytes!("../../tests/files/r12-binary.dxf"), old);
    compare(include_bytes!("../../tests/files/r2000.dxf"), new);
    compare(include_bytes!("../../tests/files/r2018-binary.dxf"), new);
}

#[test]
fn mutated_files_neither_panic_nor_hang() {
    let samples: [&[u8]; 4] = [
        include_bytes!("../../tests/files/r12.dxf"),
        include_bytes!("../../tests/files/r12-binary.dxf"),
        include_bytes!("../../tests/files/r2000.dxf"),
        include_bytes!("../../tests/files/r2018-binary.dxf"),
    ];
    crate::read::mutations::check(&samples, 10_000, |bytes| {
        let _ = read(bytes);
    });
}
