//! Drawings whose sizes are known by hand.

use kurbo::{Point, Rect};
use messages::random::SplitMix64;

use super::read;
use super::read_text;
use crate::read::bounds;
use crate::shape::{Colour, FillRule, Graphic, Segment};
use crate::text::Installed;

const HEAD: &str = "xmlns='http://www.w3.org/2000/svg' \
                    xmlns:xlink='http://www.w3.org/1999/xlink' \
                    xmlns:inkscape='http://www.inkscape.org/namespaces/inkscape'";

fn drawing(root: &str, content: &str) -> Graphic {
    let text = format!("<svg {HEAD} {root}>{content}</svg>");
    read(text.as_bytes()).unwrap_or_else(|error| panic!("{error} in {text}"))
}

/// The rectangle around all shapes, in millimetres.
fn around(graphic: &Graphic) -> Rect {
    let all = graphic.shapes.iter().filter_map(|shape| bounds(&shape.contours));
    let all = all.reduce(|one, other| one.union(other)).expect("a shape");
    Rect::new(all.x0 * 1e3, all.y0 * 1e3, all.x1 * 1e3, all.y1 * 1e3)
}

/// Within 0.1 µm, an order below what a machine resolves.
fn check(root: &str, content: &str, expected: [f64; 4]) {
    let found = around(&drawing(root, content));
    for (found, expected) in [found.x0, found.y0, found.x1, found.y1].into_iter().zip(expected) {
        assert!((found - expected).abs() < 1e-4, "{found} and not {expected} in {content}");
    }
}

fn notes(graphic: &Graphic) -> Vec<&str> {
    graphic.notes.iter().map(|note| note.text.as_str()).collect()
}

const A4: &str = "width='210mm' height='297mm' viewBox='0 0 210 297'";

#[test]
fn a_rectangle_lies_where_the_file_has_it_with_y_up() {
    let content = "<rect x='10' y='20' width='80' height='40' fill='none' stroke='#f00'/>";
    check(A4, content, [10.0, 297.0 - 60.0, 90.0, 297.0 - 20.0]);
    let graphic = drawing(A4, content);
    let page = graphic.page.expect("a page");
    assert!((page.x1 - 0.210).abs() < 1e-7 && (page.y1 - 0.297).abs() < 1e-7);
    let [shape] = graphic.shapes.as_slice() else { panic!("{graphic:?}") };
    assert_eq!(shape.stroke, Some(Colour { red: 255, green: 0, blue: 0 }));
    assert_eq!(shape.fill, None);
    assert_eq!(shape.contours[0].segments.len(), 4);
    assert!(shape.contours[0].is_closed);
    assert_eq!(notes(&graphic), Vec::<&str>::new());
}

#[test]
fn every_unit_has_its_length() {
    let line = "<line x1='0' y1='0' x2='1' y2='1' stroke='#000' ";
    for (unit, millimetres) in [
        ("in", 25.4),
        ("cm", 10.0),
        ("mm", 1.0),
        ("pt", 25.4 / 72.0),
        ("pc", 25.4 / 6.0),
        ("px", 25.4 / 96.0),
        ("", 25.4 / 96.0),
    ] {
        let content = format!("<rect x='2{unit}' y='1{unit}' width='3{unit}' height='4{unit}'/>");
        let page = 10.0 * millimetres;
        let expected = [2.0, 5.0, 5.0, 9.0].map(|number| number * millimetres);
        check(&format!("width='10{unit}' height='10{unit}'"), &content, expected);
        let scaled = format!("width='10{unit}' height='10{unit}' viewBox='0 0 5 5'");
        check(&scaled, &format!("{line}/>"), [0.0, 0.8 * page, 0.2 * page, page]);
    }
    // Percentages are of the viewBox.
    check(A4, "<rect x='10%' y='0' width='50%' height='100%'/>", [21.0, 0.0, 126.0, 297.0]);
}

#[test]
fn the_view_box_is_placed_as_its_aspect_ratio_says() {
    let square = "<rect width='10' height='10'/>";
    let root = |aspect: &str| {
        format!("width='40mm' height='20mm' viewBox='0 0 10 10' preserveAspectRatio='{aspect}'")
    };
    check(&root("xMidYMid"), square, [10.0, 0.0, 30.0, 20.0]);
    check(&root("xMinYMid meet"), square, [0.0, 0.0, 20.0, 20.0]);
    check(&root("xMaxYMax meet"), square, [20.0, 0.0, 40.0, 20.0]);
    check(&root("none"), square, [0.0, 0.0, 40.0, 20.0]);
    check(&root("xMidYMid slice"), square, [0.0, -10.0, 40.0, 30.0]);
    check("width='20mm' height='20mm' viewBox='-5 -5 10 10'", square, [10.0, -10.0, 30.0, 10.0]);
}

#[test]
fn a_file_without_a_size_says_so() {
    let pixel = 25.4 / 96.0;
    let content = "<rect x='96' y='96' width='96' height='192'/>";
    let graphic = drawing("", content);
    assert_eq!(graphic.page, None);
    check("", content, [25.4, 0.0, 50.8, 50.8]);
    assert!(notes(&graphic)[0].contains("no size of its page"), "{graphic:?}");
    check(
        "viewBox='0 0 960 960'",
        content,
        [25.4, 960.0 * pixel - 76.2, 50.8, 960.0 * pixel - 25.4],
    );
    check("width='100%' height='100%'", content, [25.4, 0.0, 50.8, 50.8]);
    // One of the two is enough with a viewBox.
    check(
        "width='20mm' viewBox='0 0 10 10'",
        "<rect width='10' height='10'/>",
        [0.0, 0.0, 20.0, 20.0],
    );
}

#[test]
fn transforms_of_groups_and_clones_multiply() {
    let shape = "<path id='it' d='M0 0H10V5H0Z'/>";
    let grouped =
        format!("<g transform='translate(20 30)'><g transform='scale(2)'>{shape}</g></g>");
    check(A4, &grouped, [20.0, 297.0 - 40.0, 40.0, 297.0 - 30.0]);
    let turned = format!("<g transform='translate(100,100) rotate(90)'>{shape}</g>");
    check(A4, &turned, [95.0, 297.0 - 110.0, 100.0, 297.0 - 100.0]);
    let skewed = format!("<g transform='skewX(45)'>{shape}</g>");
    check(A4, &skewed, [0.0, 292.0, 15.0, 297.0]);
    let clone = format!("<defs>{shape}</defs><use xlink:href='#it' x='7' transform='scale(3)'/>");
    check(A4, &clone, [21.0, 297.0 - 15.0, 51.0, 297.0]);
    let symbol = "<symbol id='s' viewBox='0 0 10 10'><circle cx='5' cy='5' r='5'/></symbol>\
                  <use href='#s' x='50' y='60' width='20' height='20'/>";
    check(A4, symbol, [50.0, 297.0 - 80.0, 70.0, 297.0 - 60.0]);
    let nested = "<svg x='10' y='10' width='50' height='50' viewBox='0 0 100 100'>\
                  <rect x='10' y='10' width='80' height='80'/></svg>";
    check(A4, nested, [15.0, 297.0 - 55.0, 55.0, 297.0 - 15.0]);
}

#[test]
fn a_circle_of_200_mm_is_a_true_circle_to_less_than_a_micrometre() {
    let shapes = [
        "<circle cx='105' cy='120' r='100'/>",
        "<path d='M205 120A100 100 0 0 1 5 120A100 100 0 0 1 205 120Z'/>",
        "<ellipse cx='105' cy='120' rx='100' ry='100'/>",
        "<g transform='translate(105 120) scale(2)'><circle r='50'/></g>",
        "<defs><circle id='c' r='100'/></defs><use href='#c' x='105' y='120'/>",
    ];
    for content in shapes {
        let graphic = drawing(A4, content);
        let centre = Point::new(0.105, 0.297 - 0.120);
        let contour = &graphic.shapes[0].contours[0];
        assert!(contour.is_closed);
        for segment in &contour.segments {
            let Segment::Arc(arc) = segment else { panic!("{segment:?} in {content}") };
            for step in 0..=100 {
                let at = arc.point(arc.start + arc.sweep * f64::from(step) / 100.0);
                let off = ((at - centre).hypot() - 0.1).abs();
                assert!(off < 0.1e-6, "{off} m off in {content}");
            }
        }
    }
}

#[test]
fn a_rounded_rectangle_has_true_corners() {
    let content = "<rect x='10' y='10' width='60' height='40' rx='5'/>";
    check(A4, content, [10.0, 247.0, 70.0, 287.0]);
    let graphic = drawing(A4, content);
    let arcs = graphic.shapes[0].contours[0].segments.iter().filter_map(|segment| match segment {
        Segment::Arc(arc) => Some(arc.major.hypot()),
        _ => None,
    });
    let radii: Vec<f64> = arcs.collect();
    assert_eq!(radii.len(), 4);
    assert!(radii.iter().all(|radius| (radius - 0.005).abs() < 1e-7), "{radii:?}");
    // A stadium, and a radius that is larger than fits.
    check(
        A4,
        "<rect x='1' y='2' width='60' height='40' rx='30' ry='500'/>",
        [1.0, 255.0, 61.0, 295.0],
    );
}

#[test]
fn styles_classes_and_inheritance_give_the_colours() {
    let content = "<style>.cut{fill:none;stroke:#00ff00} rect.cut{stroke:blue}</style>\
                   <g stroke='red' fill='none'><rect width='1' height='1'/>\
                   <path class='cut' d='M0 0L1 1'/><rect class='cut' width='1' height='1'/>\
                   <path style='stroke:#123456;fill:#abc;fill-rule:evenodd' d='M0 0H1V1z'/></g>";
    let graphic = drawing(A4, content);
    let strokes: Vec<String> =
        graphic.shapes.iter().map(|shape| shape.stroke.expect("a stroke").to_string()).collect();
    assert_eq!(strokes, ["#ff0000", "#00ff00", "#0000ff", "#123456"]);
    let fill = graphic.shapes[3].fill.expect("a fill");
    assert_eq!((fill.colour.to_string().as_str(), fill.rule), ("#aabbcc", FillRule::EvenOdd));
}

#[test]
fn layers_of_inkscape_and_lines_are_kept() {
    let content = "\n<g inkscape:groupmode='layer' inkscape:label='Cut' id='l1'>\n\
                   <rect width='1' height='1'/>\n<g><path d='M0 0L1 1' stroke='red'/></g></g>\n\
                   <circle r='1'/>";
    let graphic = drawing(A4, content);
    let found: Vec<(Option<&str>, u64)> =
        graphic.shapes.iter().map(|shape| (shape.layer.as_deref(), shape.line)).collect();
    assert_eq!(found, [(Some("Cut"), 3), (Some("Cut"), 4), (None, 5)]);
}

#[test]
fn what_is_left_out_is_named() {
    let png = "data:image/png;base64,iVBORw0KGgo=";
    for (content, note) in [
        ("<g display='none'><rect width='1' height='1'/></g>", "display: none"),
        ("<rect width='1' height='1' visibility='hidden'/>", "hidden"),
        ("<g opacity='0'><rect width='1' height='1'/></g>", "hidden"),
        ("<rect width='1' height='1' fill='none'/>", "neither line nor fill"),
        ("<rect width='0' height='1'/>", "<rect> that draws nothing"),
        ("<path d='M1 1z'/>", "without a length"),
        ("<path d='M1 1L2 2 foo' stroke='red'/>", "up to its fault"),
        ("<image width='1' height='1' href='a.png'/>", "in another file is not followed"),
        (&format!("<image width='1' height='1' href='{png}'/>"), "image is left out"),
        ("<use href='other.svg#a'/>", "another file is not followed"),
        ("<foreignObject><p>text</p></foreignObject>", "foreign object"),
        ("<path d='M0 0L1 1' stroke='red' stroke-dasharray='1 2'/>", "without gaps"),
        ("<mask id='m'/><rect width='1' height='1' mask='url(#m)'/>", "a mask is not applied"),
        ("<filter id='f'/><rect width='1' height='1' style='filter:url(#f)'/>", "a filter is not"),
        ("<path d='M0 0L1 1' stroke='red' marker-end='url(#a)'/>", "arrow head"),
        ("<rect width='1' height='1' opacity='.5'/>", "transparency"),
        (
            "<linearGradient id='g'><stop stop-color='red'/><stop offset='1'/></linearGradient>\
          <rect width='1' height='1' fill='url(#g)'/>",
            "first colour",
        ),
        (
            "<pattern id='p' width='1' height='1'><rect width='1' height='1'/></pattern>\
          <rect width='9' height='9' fill='url(#p)'/>",
            "pattern",
        ),
        (
            "<clipPath id='c'><circle r='3'/></clipPath><rect clip-path='url(#c)' width='9' height='9'/>",
            "clip path is not applied",
        ),
    ] {
        let graphic = drawing(A4, content);
        let notes = notes(&graphic);
        assert!(notes.iter().any(|found| found.contains(note)), "{notes:?} lacks {note}");
    }
}

#[test]
fn shapes_with_effects_are_drawn_without_them() {
    for content in [
        "<filter id='f'><feGaussianBlur stdDeviation='1'/></filter>\
         <path d='M1 2H10V5Z' filter='url(#f)'/>",
        "<filter id='f'/><path d='M1 2H10V5Z' filter='url(#f)'/>",
        "<mask id='m'><circle r='1'/></mask><path d='M1 2H10V5Z' mask='url(#m)'/>",
        "<path d='M1 2H10V5Z' mask='url(#gone)' filter='url(#gone)' clip-path='url(#gone)'/>",
        "<pattern id='p' width='1' height='1'><path d='M0 0H1'/></pattern>\
         <path d='M1 2H10V5Z' fill='url(#p)'/>",
        "<clipPath id='c' clipPathUnits='objectBoundingBox'><circle r='.5'/></clipPath>\
         <path d='M1 2H10V5Z' clip-path='url(#c)'/>",
    ] {
        check(A4, content, [1.0, 292.0, 10.0, 295.0]);
        assert!(drawing(A4, content).shapes[0].fill.is_some());
    }
}

#[test]
fn a_rectangular_clip_path_is_honoured_where_nothing_crosses_it() {
    let clip = "<clipPath id='c'><path d='M0 0H50V50H0Z'/></clipPath>";
    let inside =
        format!("{clip}<g clip-path='url(#c)'><rect x='5' y='5' width='9' height='9'/></g>");
    assert_eq!(notes(&drawing(A4, &inside)), Vec::<&str>::new());
    let outside = format!("{clip}<g clip-path='url(#c)'><rect x='60' width='9' height='9'/></g>");
    let graphic = drawing(A4, &outside);
    assert!(graphic.shapes.is_empty());
    assert_eq!(notes(&graphic), ["what lies outside of its clip path is left out"]);
    let across = format!("{clip}<g clip-path='url(#c)'><rect x='45' width='9' height='9'/></g>");
    let graphic = drawing(A4, &across);
    assert_eq!(graphic.shapes.len(), 1);
    assert_eq!(notes(&graphic), ["a clip path is not applied: what it hides is drawn"]);
}

#[cfg(feature = "image")]
#[test]
fn an_image_in_the_file_lies_where_the_file_has_it() {
    // 4 by 2 pixels, black and white by turns from the upper left corner.
    let file = "iVBORw0KGgoAAAANSUhEUgAAAAQAAAACCAAAAABawyK/AAAADElEQVR4nGNg+A+FABP2A/1SO5xNAAAAAElFTkSuQmCC";
    let content = format!(
        "<g inkscape:groupmode='layer' inkscape:label='Photo'><image x='10' y='20' width='40' \
         height='20' href='data:image/png;base64,{file}'/></g>"
    );
    let graphic = drawing(A4, &content);
    let [image] = graphic.images.as_slice() else { panic!("{graphic:?}") };
    assert_eq!((image.columns, image.rows, image.layer.as_deref()), (4, 2, Some("Photo")));
    assert_eq!(&image.pixels[..4], [0, 255, 0, 255]);
    let at = |x: f64, y: f64| image.placement * Point::new(x, y);
    assert!((at(0.0, 0.0) - Point::new(0.010, 0.297 - 0.040)).hypot() < 1e-7, "{image:?}");
    assert!((at(4.0, 2.0) - Point::new(0.050, 0.297 - 0.020)).hypot() < 1e-7, "{image:?}");
    assert!(notes(&graphic).is_empty());
}

#[test]
fn text_becomes_outlines_or_is_named() {
    let content = "<text x='10' y='50' font-size='20' font-family='No Such Font'>Hi</text>";
    let graphic = drawing(A4, content);
    let notes = notes(&graphic);
    assert!(notes.iter().any(|note| note.contains("No Such Font")), "{notes:?}");
    match graphic.shapes.is_empty() {
        true => assert!(notes.iter().any(|note| note.contains("<text> that draws nothing"))),
        false => {
            let all = around(&graphic);
            assert!(all.x0 > 9.0 && all.x1 < 60.0, "{all:?}");
            assert!(all.y0 > 297.0 - 51.0 && all.y1 < 297.0 - 30.0, "{all:?}");
        }
    }
}

#[test]
fn without_fonts_text_is_set_in_the_built_in_one() {
    let fonts = Installed::of(fontdb::Database::new());
    for family in ["", "font-family='Arial'", "font-family='serif'"] {
        let text = format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='50mm' height='50mm'>\
             <text x='10' y='50' font-size='20' {family}>Hi</text></svg>"
        );
        let graphic = read_text(&text, || &fonts).expect("a drawing");
        assert!(!graphic.shapes.is_empty(), "{family}");
        let told = notes(&graphic);
        let is_told =
            told.iter().any(|note| note.ends_with("is not installed: text is set in \"Ubuntu\""));
        assert!(is_told, "{family}: {told:?}");
    }
}

#[test]
fn text_on_a_path_keeps_its_path() {
    let content = "<path id='way' d='M10 10H100' stroke='red' fill='none'/>\
                   <text font-size='5'><textPath href='#way'>along</textPath></text>";
    let graphic = drawing(A4, content);
    let line = &graphic.shapes[0].contours[0];
    assert!((line.end() - Point::new(0.1, 0.287)).hypot() < 1e-7, "{line:?}");
}

#[test]
fn documents_of_other_writers_are_read() {
    // A prefix, entities for namespaces, a doctype, and elements in an entity.
    let text = "<?xml version='1.0'?><!DOCTYPE svg PUBLIC '-//W3C//DTD SVG 1.1//EN' 'svg11.dtd' [\
                <!ENTITY ns 'http://www.w3.org/2000/svg'> <!ENTITY it '<s:path d=\"M0 0H9V9z\"/>'>]>\
                <s:svg xmlns:s='&ns;' width='20mm' height='20mm' viewBox='0 0 20 20'>\
                <s:pattern id='p' width='1' height='1'/>&it;<s:path d='M1 1h5v5z'/>\
                <s:rect x='2' width='18' height='3' fill='url(#p)'/></s:svg>";
    let graphic = read(text.as_bytes()).expect("a drawing");
    assert_eq!(graphic.shapes.len(), 3);
    let all = around(&graphic);
    assert!((all.x0).abs() < 1e-6 && (all.x1 - 20.0).abs() < 1e-4, "{all:?}");
}

#[test]
fn the_same_id_twice_draws_both_shapes() {
    let content = "<path id='a' d='M0 0H5'  stroke='red'/><path id='a' d='M0 0H9' stroke='red'/>\
                   <circle id='a' r='2'/><use href='#a' y='50'/>";
    let graphic = drawing(A4, content);
    let widths: Vec<f64> = graphic
        .shapes
        .iter()
        .filter_map(|shape| bounds(&shape.contours))
        .map(|all| (all.width() * 1e6).round() / 1e3)
        .collect();
    assert_eq!(widths, [5.0, 9.0, 4.0, 5.0]);
}

#[test]
fn bombs_are_refused_by_name() {
    let mut laughs = String::from("<defs><path id='a0' d='M0 0H1'/>");
    for level in 1..20 {
        let clones = format!("<use href='#a{}'/>", level - 1).repeat(10);
        laughs += &format!("<g id='a{level}'>{clones}</g>");
    }
    laughs += "</defs><use href='#a19'/>";
    let circle = "<g id='a'><use href='#b'/></g><g id='b'><use href='#c'/></g>\
                  <g id='c'><use href='#a'/></g>";
    let deep = format!("{}{}", "<g>".repeat(5000), "</g>".repeat(5000));
    let heavy = "<path id='p' d='M0 0".to_owned()
        + &"h1v1".repeat(20_000)
        + "' stroke='red'/>"
        + &"<use href='#p'/>".repeat(200);
    let text = format!("<text>{}</text>", "x".repeat(60_000));
    let rules = format!("<style>{}</style>{}", "a{} ".repeat(30_000), "<g/>".repeat(3000));
    for content in [&laughs, circle, &deep, &heavy, &text, &rules] {
        let file = format!("<svg {HEAD} {A4}>{content}</svg>");
        let error = read(file.as_bytes()).expect_err("a bomb");
        assert!(!error.message.is_empty() && !error.help.is_empty());
    }
    let lol = "<!DOCTYPE s [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;'>\
               <!ENTITY c '&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;'><!ENTITY d '&c;&c;&c;&c;&c;&c;&c;&c;&c;'>\
               <!ENTITY e '&d;&d;&d;&d;&d;&d;&d;&d;&d;&d;'><!ENTITY f '&e;&e;&e;&e;&e;&e;&e;&e;&e;'>]>\
               <svg>&f;&f;&f;&f;</svg>";
    assert!(read(lol.as_bytes()).is_err());
}

#[test]
fn a_compressed_file_is_read_within_its_bound() {
    use std::io::Write as _;
    let squeeze = |bytes: &[u8]| {
        let mut writer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        writer.write_all(bytes).expect("in memory");
        writer.finish().expect("in memory")
    };
    let text = format!("<svg {HEAD} {A4}><rect width='5' height='5'/></svg>");
    assert_eq!(read(&squeeze(text.as_bytes())).expect("a drawing").shapes.len(), 1);
    let bomb = squeeze(&vec![b' '; crate::read::MOST_BYTES + 1]);
    assert!(read(&bomb).expect_err("too large").message.contains("64 MiB"));
    assert!(read(&squeeze(text.as_bytes())[..40]).is_err());
}

#[test]
fn mutated_files_neither_panic_nor_hang() {
    let samples = [
        include_str!("../../tests/files/inkscape.svg"),
        include_str!("../../tests/files/clones.svg"),
    ];
    crate::read::mutations::check(&samples.map(str::as_bytes), 10_000, |bytes| {
        let _ = read(bytes);
    });
    let mut random = SplitMix64::new(3);
    for _ in 0..1000 {
        let bytes: Vec<u8> = (0..random.below(80)).map(|_| random.bits() as u8).collect();
        assert!(read(&bytes).is_err());
    }
}
