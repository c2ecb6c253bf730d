//! Plots whose sizes are known by hand.

use super::read;
use crate::read::bounds;
use crate::shape::{Graphic, Segment};

fn plot(text: &str) -> Graphic {
    read(text.as_bytes()).unwrap_or_else(|error| panic!("{error} in {text}"))
}

/// The rectangle around all shapes, in millimetres, to 1 nm.
fn around(graphic: &Graphic) -> [f64; 4] {
    let all = graphic.shapes.iter().filter_map(|shape| bounds(&shape.contours));
    let all = all.reduce(|one, other| one.union(other)).expect("a shape");
    [all.x0, all.y0, all.x1, all.y1].map(|value| (value * 1e9).round() / 1e6 + 0.0)
}

fn check(text: &str, expected: [f64; 4]) {
    assert_eq!(around(&plot(text)), expected, "{text}");
}

#[test]
fn forty_units_are_a_millimetre() {
    check("IN;SP1;PU400,800;PD800,800,800,1200;PU;", [10.0, 20.0, 20.0, 30.0]);
    check("IN;PU400,800PR;PD400,0,0,400;PU", [10.0, 20.0, 20.0, 30.0]);
    check("IN;PA400,800;PD;PR400,400;PA0,0", [0.0, 0.0, 20.0, 30.0]);
}

#[test]
fn the_pen_ends_contours_and_names_layers() {
    let graphic = plot("IN;SP1;PU0,0;PD40,0,40,40,0,0;PU100,0;PD200,0;SP2;PD200,200;SP0;PD0,0;");
    let found: Vec<(Option<&str>, bool)> = graphic
        .shapes
        .iter()
        .map(|shape| (shape.layer.as_deref(), shape.contours[0].is_closed))
        .collect();
    assert_eq!(found, [(Some("pen 1"), true), (Some("pen 1"), false), (Some("pen 2"), false)]);
    assert_eq!(graphic.shapes[2].stroke.map(|it| it.to_string()).as_deref(), Some("#ff0000"));
}

#[test]
fn arcs_circles_rectangles_and_wedges_are_true() {
    check("IN;PU4000,4000;CI4000;", [0.0, 0.0, 200.0, 200.0]);
    let graphic = plot("IN;PU4000,4000;CI4000,5;");
    assert!(matches!(graphic.shapes[0].contours[0].segments.as_slice(), [Segment::Arc(_)]));
    // From (80, 0) about the origin, counterclockwise by a quarter.
    check("IN;PU80,0;PD;AA0,0,90;PU", [0.0, 0.0, 2.0, 2.0]);
    check("IN;PU80,0;PD;AR-80,0,-90;PU", [0.0, -2.0, 2.0, 0.0]);
    check("IN;PU40,40;EA120,80;", [1.0, 1.0, 3.0, 2.0]);
    check("IN;PU40,40;ER-40,80;", [0.0, 1.0, 1.0, 3.0]);
    check("IN;PU0,0;EW40,0,180;", [-1.0, 0.0, 1.0, 1.0]);
    let graphic = plot("IN;PU0,0;RA40,40;WG40,0,90");
    assert!(graphic.shapes.iter().all(|shape| shape.fill.is_some()));
    assert_eq!(around(&graphic), [0.0, 0.0, 1.0, 1.0]);
}

#[test]
fn polygons_are_filled_as_one_shape() {
    let graphic = plot("IN;PU0,0;PM0;PD40,0,40,40,0,40;PM1;PU10,10;PD20,10,20,20;PM2;FP;");
    assert_eq!(graphic.shapes.len(), 1, "{graphic:?}");
    assert_eq!(graphic.shapes[0].contours.len(), 2);
    assert!(graphic.shapes[0].fill.is_some() && graphic.shapes[0].contours[0].is_closed);
    assert_eq!(around(&graphic), [0.0, 0.0, 1.0, 1.0]);
}

#[test]
fn scales_and_turns_are_applied() {
    check("IN;IP0,0,4000,4000;SC0,100,0,100;PU0,0;PD50,25;", [0.0, 0.0, 50.0, 25.0]);
    check("IN;IP400,400,4400,4400;SC-1,1,-1,1;PU-1,-1;PD0,0;", [10.0, 10.0, 60.0, 60.0]);
    check("IN;IP0,0,4000,8000;SC0,100,0,100,1;PU0,0;PD100,100;", [0.0, 50.0, 100.0, 150.0]);
    check("IN;SC0,40,0,40,2;PU0,0;PD1,2;", [0.0, 0.0, 1.0, 2.0]);
    check("IN;RO90;PU0,0;PD40,0,40,80;", [-2.0, 0.0, 0.0, 1.0]);
    check("IN;IP0,0,4000,8000;SC0,100,0,100;PU50,50;CI10;", [40.0, 80.0, 60.0, 120.0]);
}

#[test]
fn what_is_left_out_is_named() {
    for (text, note) in [
        ("IN;LBhello\x03PD1,1", "LB (text)"),
        ("IN;VS10", "speed"),
        ("IN;LT2,4", "without gaps"),
        ("IN;ZZ3", "ZZ is left out"),
        ("IN;PD1", "without its y"),
        ("IN;PE<=>;", "packed"),
        ("IN;AA1,2", "numbers that do not fit"),
        ("IN;SC0,1,0,1", "check it"),
        ("IN;SC0,0,0,1", "SC with numbers"),
    ] {
        let graphic = plot(text);
        let notes: Vec<&str> = graphic.notes.iter().map(|note| note.text.as_str()).collect();
        assert!(notes.iter().any(|found| found.contains(note)), "{notes:?} lacks {note}");
    }
    assert!(read(b"").is_err());
    assert!(read(b"hello world").is_err());
}

#[test]
fn mutated_files_neither_panic_nor_hang() {
    let sample = include_bytes!("../../tests/files/plot.plt");
    assert!(!read(sample).expect("a plot").shapes.is_empty());
    crate::read::mutations::check(&[sample], 10_000, |bytes| {
        let _ = read(bytes);
    });
}
