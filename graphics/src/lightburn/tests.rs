//! Projects whose sizes are known by hand.

use super::read;
use crate::read::bounds;
use crate::shape::{FileMode, Graphic, Segment};

fn project(attributes: &str, content: &str) -> Graphic {
    let text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <LightBurnProject AppVersion=\"1.7.08\" FormatVersion=\"1\" {attributes}>\n{content}\n\
         </LightBurnProject>"
    );
    read(text.as_bytes()).unwrap_or_else(|error| panic!("{error} in {text}"))
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
fn shapes_lie_about_their_middle_in_millimetres_with_y_up() {
    for (shape, expected) in [
        ("Type='Rect' W='20' H='10' Cr='0'><XForm>1 0 0 1 50 60</XForm>", [40.0, 55.0, 60.0, 65.0]),
        ("Type='Rect' W='20' H='10' Cr='2'><XForm>1 0 0 1 50 60</XForm>", [40.0, 55.0, 60.0, 65.0]),
        ("Type='Rect' W='20' H='10' Cr='50'><XForm>0 1 -1 0 0 0</XForm>", [-5.0, -10.0, 5.0, 10.0]),
        ("Type='Ellipse' Rx='100' Ry='3'><XForm>2 0 0 1 10 10</XForm>", [-190.0, 7.0, 210.0, 13.0]),
        ("Type='Polygon' N='4' Rx='5' Ry='7'><XForm>1 0 0 1 5 7</XForm>", [0.0, 0.0, 10.0, 14.0]),
        (
            "Type='Path'><XForm>1 0 0 1 1 2</XForm><VertList>V0 0V5 0V5 4</VertList>\
          <PrimList>LineClosed</PrimList>",
            [1.0, 2.0, 6.0, 6.0],
        ),
        (
            "Type='Path'><XForm>1 0 0 1 1 2</XForm><V vx='0' vy='0'/><V vx='5' vy='4'/>\
          <P T='L' p0='0' p1='1'/>",
            [1.0, 2.0, 6.0, 6.0],
        ),
        (
            "Type='Group'><XForm>2 0 0 2 100 0</XForm><Children><Shape Type='Rect' W='2' H='2'>\
          <XForm>1 0 0 1 5 0</XForm></Shape></Children>",
            [108.0, -2.0, 112.0, 2.0],
        ),
    ] {
        let graphic = project("", &format!("<Shape CutIndex='0' {shape}</Shape>"));
        assert_eq!(around(&graphic), expected, "{shape}");
    }
}

#[test]
fn a_circle_is_one_true_arc_and_its_line_is_told() {
    let graphic =
        project("", "<Shape Type='Ellipse' Rx='100' Ry='100'><XForm>1 0 0 1 0 0</XForm></Shape>");
    let [segment] = graphic.shapes[0].contours[0].segments.as_slice() else { panic!() };
    let Segment::Arc(arc) = segment else { panic!("{segment:?}") };
    assert!((arc.major.hypot() - 0.1).abs() < 1e-15);
    assert_eq!(graphic.shapes[0].line, 3);
}

#[test]
fn settings_become_recipes_and_sub_layers_further_shapes() {
    let settings = "<CutSetting type='Scan'><index Value='3'/><name Value='Engrave'/>\
                    <speed Value='250'/><maxPower Value='35'/><minPower Value='5'/><numPasses Value='2'/>\
                    <interval Value='0.08'/><angle Value='90'/><crossHatch Value='1'/>\
                    <frequency Value='30000'/><kerf Value='0.1'/><zOffset Value='-1.5'/>\
                    <runBlower Value='1'/>\
                    <SubLayer type='Cut' index='1'><speed Value='10'/><maxPower Value='80'/></SubLayer>\
                    </CutSetting>\
                    <CutSetting_Img type='Image'><index Value='4'/><dpi Value='254'/></CutSetting_Img>\
                    <CutSetting type='Cut'><index Value='5'/><doOutput Value='0'/></CutSetting>";
    let shapes = "<Shape Type='Rect' W='1' H='1' CutIndex='3'/><Shape Type='Rect' W='1' H='1' CutIndex='5'/>\
                  <Shape Type='Rect' W='1' H='1' CutIndex='9'/>";
    let graphic = project("", &format!("{settings}{shapes}"));
    let recipe = &graphic.recipes[0];
    assert_eq!((recipe.name.as_str(), recipe.mode), ("Engrave", FileMode::Fill));
    let is =
        |found: Option<f64>, expected: f64| (found.unwrap_or(f64::NAN) - expected).abs() < 1e-12;
    assert!(is(recipe.speed, 0.25) && is(recipe.power, 0.35) && is(recipe.least_power, 0.05));
    assert!(is(recipe.interval, 0.08e-3) && is(recipe.angle, core::f64::consts::FRAC_PI_2));
    assert!(is(recipe.frequency, 30e3) && is(recipe.kerf, 0.1e-3) && is(recipe.focus, -1.5e-3));
    assert_eq!((recipe.passes, recipe.is_cross, recipe.air), (Some(2), true, Some(true)));
    assert_eq!(
        (graphic.recipes[1].name.as_str(), graphic.recipes[1].mode),
        ("Engrave (2)", FileMode::Line)
    );
    assert_eq!(graphic.recipes[2].mode, FileMode::Image);
    assert!(is(graphic.recipes[2].interval, 0.1e-3));
    assert!(graphic.recipes[3].is_hidden);
    let found: Vec<(Option<usize>, Option<&str>, bool)> = graphic
        .shapes
        .iter()
        .map(|shape| (shape.recipe, shape.layer.as_deref(), shape.fill.is_some()))
        .collect();
    let expected = [
        (Some(0), Some("Engrave"), true),
        (Some(1), Some("Engrave"), false),
        (Some(3), Some("C05"), false),
        (None, Some("C09"), false),
    ];
    assert_eq!(found, expected);
    assert_eq!(notes(&graphic), ["layer \"C05\" is not for output"]);
    assert_eq!(graphic.shapes[2].stroke.map(|it| it.to_string()).as_deref(), Some("#ff8000"));
}

#[test]
fn text_has_the_place_of_its_outline_or_its_own() {
    let outline = |inner: &str, own: &str| {
        let text = format!(
            "<Shape Type='Text' Str='Hi' HasBackupPath='1' CutIndex='0'><BackupPath Type='Path'>\
             <XForm>{inner}</XForm><VertList>V0 0V10 0V10 10</VertList><PrimList>L0 1L1 2</PrimList>\
             </BackupPath><XForm>{own}</XForm></Shape>"
        );
        around(&project("", &text))
    };
    assert_eq!(outline("1 0 0 1 5 5", "1 0 0 1 5 5"), [5.0, 5.0, 15.0, 15.0]);
    assert_eq!(outline("1 0 0 1 0 0", "1 0 0 1 100 0"), [100.0, 0.0, 110.0, 10.0]);
    let graphic = project("", "<Shape Type='Text' Str='Hi'/>");
    assert!(notes(&graphic)[0].contains("text without an outline"));
}

#[cfg(feature = "image")]
#[test]
fn an_image_lies_about_its_middle() {
    let file = "iVBORw0KGgoAAAANSUhEUgAAAAQAAAACCAAAAABawyK/AAAADElEQVR4nGNg+A+FABP2A/1SO5xNAAAAAElFTkSuQmCC";
    let content = format!(
        "<Shape Type='Bitmap' CutIndex='4' W='40' H='20' Data='{file}'><XForm>1 0 0 1 50 60</XForm>\
         </Shape>"
    );
    let graphic = project("", &content);
    let [image] = graphic.images.as_slice() else { panic!("{graphic:?}") };
    assert_eq!((image.columns, image.rows), (4, 2));
    let all = image.bounds();
    for (found, expected) in [(all.x0, 0.030), (all.x1, 0.070), (all.y0, 0.050), (all.y1, 0.070)] {
        assert!((found - expected).abs() < 1e-12, "{all:?}");
    }
}

#[test]
fn shapes_share_lists_by_number() {
    let content = "<Shape Type='Path' VertID='7' PrimID='8'><XForm>1 0 0 1 0 0</XForm>\
                   <VertList>V0 0V5 0V5 5</VertList><PrimList>LineClosed</PrimList></Shape>\
                   <Shape Type='Path' VertID='7' PrimID='8'><XForm>1 0 0 1 20 0</XForm></Shape>";
    let graphic = project("", content);
    assert_eq!(graphic.shapes.len(), 2);
    assert_eq!(around(&graphic), [0.0, 0.0, 25.0, 5.0]);
    assert!(graphic.shapes[1].contours[0].is_closed);
}

#[test]
fn a_project_from_another_corner_is_mirrored_back() {
    let content = "<Shape Type='Rect' W='2' H='2'><XForm>1 0 0 1 10 20</XForm></Shape>";
    let graphic = project("MirrorX='True' MirrorY='True'", content);
    assert_eq!(around(&graphic), [-11.0, -21.0, -9.0, -19.0]);
    assert!(notes(&graphic)[0].contains("another corner"));
    assert!(notes(&project("MirrorX='False' MirrorY='False'", content)).is_empty());
}

#[test]
fn what_is_left_out_is_named() {
    for (content, note) in [
        ("<Shape Type='Bitmap' W='1' H='1' Data='AAAA'/>", "an image is left out"),
        ("<Shape Type='Bitmap' W='1' H='1' Data='?'/>", "is at fault"),
        ("<Shape Type='Flux'/>", "of the type \"Flux\""),
        ("<Shape Type='Rect' W='-1' H='1'/>", "numbers that do not fit"),
        ("<Shape Type='Path' VertID='3'/>", "numbers that do not fit"),
        (
            "<Shape Type='Path'><VertList>V0 0V1 1</VertList><PrimList>L0 9</PrimList></Shape>",
            "numbers that do not fit",
        ),
        ("<Shape Type='Path'><VertList>V0 0V1 1</VertList></Shape>", "drawn open"),
        ("<Shape Type='Rect' W='1' H='1'><XForm>1 0 0</XForm></Shape>", "transform at fault"),
        ("<Shape Type='Rect' W='1' H='1' PowerScale='50'/>", "power scale"),
        ("<Shape Type='Polygon' N='5' Rx='1' Ry='1'/>", "check its direction"),
    ] {
        let graphic = project("", content);
        let notes = notes(&graphic);
        assert!(notes.iter().any(|found| found.contains(note)), "{notes:?} lacks {note}");
    }
    assert!(read(b"<svg/>").is_err());
    assert_eq!(read(b"<LightBurnProject>\n<a></b>").expect_err("mismatched").line, Some(2));
}

#[test]
fn mutated_files_neither_panic_nor_hang() {
    let samples: [&[u8]; 2] = [
        include_bytes!("../../tests/files/project.lbrn2"),
        include_bytes!("../../tests/files/project.lbrn"),
    ];
    for sample in samples {
        assert!(!read(sample).expect("a project").shapes.is_empty());
    }
    crate::read::mutations::check(&samples, 10_000, |bytes| {
        let _ = read(bytes);
    });
}
