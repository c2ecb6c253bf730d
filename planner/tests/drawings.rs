//! Drawings become jobs: in their places, by layers, in order.

#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use machine::{Machine, Override};
use nalgebra::Vector3;
use planner::drawing::{Action, Curve, Step};
use planner::job::{Job, JobError};

/// A page of 100 mm by 80 mm with a rectangle, a hole in it, and a line beside them.
const DRAWING: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="80mm" viewBox="0 0 100 80">
<rect x="10" y="20" width="40" height="30" fill="none" stroke="red"/>
<circle cx="30" cy="35" r="5" fill="none" stroke="red"/>
<path d="M60 20 H 90" fill="none" stroke="#00f"/>
</svg>"##;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new(files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
}

fn read(drawing: &str, settings: &[&str]) -> Result<Job, JobError> {
    let folder = Folder::new(&[("drawing.svg", drawing)]);
    let settings: Vec<Override> = settings.iter().map(|text| text.parse().unwrap()).collect();
    Job::read(&folder.path("drawing.svg"), &settings, &Machine::builtin())
}

fn steps(job: &Job) -> Vec<Step> {
    job.steps().unwrap().map(Result::unwrap).collect()
}

/// Lit curves as straight lines between their ends, with their middles.
fn marks(job: &Job) -> Vec<[Vector3<f64>; 3]> {
    let home = Vector3::from(Machine::builtin().home);
    let of = |step: &Step| match &step.action {
        Action::Mark { curve, .. } => Some([0.0, 0.5, 1.0].map(|at| curve.point(at) - home)),
        Action::Trace { points, .. } => Some([points[0], points[1], points[3]].map(|at| at - home)),
        _ => None,
    };
    steps(job).iter().filter_map(of).collect()
}

/// The rectangle around all that is lit, seen from home [mm].
fn extent(job: &Job) -> [f64; 4] {
    let points = marks(job).into_iter().flatten();
    points.fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |[left, low, right, high], point| {
        let (x, y) = (point.x * 1e3, point.y * 1e3);
        [left.min(x), low.min(y), right.max(x), high.max(y)]
    })
}

fn is_near(found: [f64; 4], right: [f64; 4]) {
    for (one, other) in found.iter().zip(right) {
        assert!((one - other).abs() < 2e-5, "{found:?} instead of {right:?}");
    }
}

#[test]
fn a_drawing_lies_around_home_as_large_as_it_is_drawn() {
    is_near(extent(&read(DRAWING, &[]).unwrap()), [-40.0, -15.0, 40.0, 15.0]);
}

#[test]
fn a_drawing_is_placed_by_its_anchor() {
    let placed = |settings: &[&str]| extent(&read(DRAWING, settings).unwrap());
    let at = r#"drawing.at=["10 mm", "-20 mm"]"#;
    is_near(placed(&[at, "drawing.anchor=lower_left"]), [10.0, -20.0, 90.0, 10.0]);
    is_near(placed(&[at, "drawing.anchor=upper"]), [-30.0, -50.0, 50.0, -20.0]);
    // The page's own corner: y points down in the file.
    is_near(
        placed(&["drawing.anchor=page", r#"drawing.at=["-50 mm", "-40 mm"]"#]),
        [-40.0, -10.0, 40.0, 20.0],
    );
}

#[test]
fn a_drawing_is_scaled_turned_and_mirrored() {
    let placed = |settings: &[&str]| extent(&read(DRAWING, settings).unwrap());
    is_near(placed(&["drawing.scale=0.5"]), [-20.0, -7.5, 20.0, 7.5]);
    is_near(placed(&["drawing.width=40 mm"]), [-20.0, -7.5, 20.0, 7.5]);
    is_near(placed(&["drawing.width=40 mm", "drawing.height=10 mm"]), [-20.0, -5.0, 20.0, 5.0]);
    is_near(placed(&["drawing.rotation=90 deg"]), [-15.0, -40.0, 15.0, 40.0]);
    // The line at the upper right comes to lie at the upper left, or at the lower right.
    let line = |settings: &[&str]| {
        let job = read(DRAWING, settings).unwrap();
        let blue = marks(&job).into_iter().find(|[from, _, to]| {
            (to - from).norm() > 0.029
                && (from.x.abs() - 0.04).abs().min((to.x.abs() - 0.04).abs()) < 1e-7
                && (to.x - from.x).abs() < 0.0301
                && (to.x - from.x).abs() > 0.0299
        });
        blue.unwrap()[1].map(|value| (value * 1e3).round())
    };
    let both = |mirror: &str| line(&[&format!("drawing.mirror={mirror}")]).xy();
    assert_eq!(both("none").as_slice(), [25.0, 15.0]);
    assert_eq!(both("x").as_slice(), [-25.0, 15.0]);
    assert_eq!(both("y").as_slice(), [25.0, -15.0]);
}

#[test]
fn an_array_repeats_a_drawing_and_a_ring_turns_it() {
    let job = read(
        DRAWING,
        &[
            "drawing.scale=0.1",
            "drawing.array.columns=3",
            "drawing.array.rows=2",
            r#"drawing.array.spacing=["10 mm", "20 mm"]"#,
        ],
    )
    .unwrap();
    is_near(extent(&job), [-4.0, -1.5, 24.0, 21.5]);
    assert_eq!(marks(&job).len(), 6 * 6);
    let ring =
        read(DRAWING, &["drawing.scale=0.1", "drawing.ring.count=4", "drawing.ring.radius=20 mm"]);
    is_near(extent(&ring.unwrap()), [-21.5, -21.5, 21.5, 21.5]);
}

#[test]
fn layers_say_how_their_colours_are_marked() {
    let job = read(
        DRAWING,
        &[
            "layers.engrave.colors=[\"blue\"]",
            "layers.engrave.speed=50 mm/s",
            "layers.engrave.power=30 %",
            "layers.engrave.passes=2",
            "layers.cut.colors=[\"#ff0000\"]",
            "layers.cut.policy=proportional",
        ],
    )
    .unwrap();
    let asked: Vec<(f64, f64, bool)> = steps(&job)
        .iter()
        .filter_map(|step| match step.action {
            Action::Mark { speed, power, .. } | Action::Trace { speed, power, .. } => {
                Some((speed.unwrap(), power.level, power.follows_speed))
            }
            _ => None,
        })
        .collect();
    assert_eq!(asked[..2], [(0.05, 0.3, false); 2]);
    assert_eq!(asked[2..], [(0.25, 1.0, true); 5]);
}

#[test]
fn the_optimum_is_for_layers_without_a_speed_of_their_own() {
    let job = read(DRAWING, &["layers.blue.speed=50 mm/s", "marking.speed=optimum"]).unwrap();
    let asked: Vec<Option<f64>> = steps(&job)
        .iter()
        .filter_map(|step| match step.action {
            Action::Mark { speed, .. } => Some(speed),
            _ => None,
        })
        .collect();
    assert_eq!(asked, [Some(0.05), None, None, None, None, None]);
    let facts = planner::plan(&Machine::builtin(), &job).unwrap().facts;
    assert!(facts.speed > 0.05 && facts.speed <= 0.25 + 1e-9, "{}", facts.speed);
}

#[test]
fn an_order_is_for_drawings_alone() {
    let text = "[letters]\ntext = \"N\"\n[order]\nrepeat = 2\n";
    let error = Job::parse("job.toml", text, &Machine::builtin()).unwrap_err();
    assert!(error.to_string().contains("[order] is for drawings"), "{error}");
}

#[test]
fn what_lies_inside_is_marked_first() {
    let is_circle =
        |step: &Step| matches!(step.action, Action::Mark { curve: Curve::Arc { .. }, .. });
    let is_line =
        |step: &Step| matches!(step.action, Action::Mark { curve: Curve::Line { .. }, .. });
    let job = read(DRAWING, &[]).unwrap();
    let red: Vec<Step> = steps(&job).into_iter().filter(|step| step.line != 4).collect();
    assert!(red.iter().position(is_circle) < red.iter().position(is_line));
    let job = read(DRAWING, &["order.by=file"]).unwrap();
    let all = steps(&job);
    assert!(all.iter().position(is_line) < all.iter().position(is_circle));
}

#[test]
fn a_fill_is_what_is_seen() {
    let filled = DRAWING.replace(r#"r="5" fill="none" stroke="red""#, r#"r="5" fill="white""#);
    let filled = filled.replacen(r#"fill="none" stroke="red""#, r#"fill="black""#, 1);
    let job = read(&filled, &["layers.black.hatch.spacing=1 mm", "layers.blue.mode=skip"]).unwrap();
    let lines = marks(&job);
    // Thirty rows, ten of them in two parts beside the hole.
    assert_eq!(lines.len(), 40);
    let length: f64 = lines.iter().map(|[from, _, to]| (to - from).norm()).sum();
    let half = |row: i32| (25.0 - (f64::from(row) - 4.5) * (f64::from(row) - 4.5)).sqrt();
    let hole: f64 = (0..10).map(|row| 2e-3 * half(row)).sum();
    assert!((length - (30.0 * 0.04 - hole)).abs() < 1e-6, "{length}");
}

#[test]
fn a_kerf_makes_parts_larger_and_holes_smaller() {
    let job = read(DRAWING, &["layers.red.kerf=0.2 mm", "layers.blue.mode=skip"]).unwrap();
    let [left, low, right, high] = extent(&job);
    is_near([right - left, high - low, 0.0, 0.0], [40.2, 30.2, 0.0, 0.0]);
    let radius = steps(&job).into_iter().find_map(|step| match step.action {
        Action::Mark { curve: Curve::Arc { major, .. }, .. } if major.norm() > 1e-3 => {
            Some(major.norm())
        }
        _ => None,
    });
    assert!((radius.unwrap() - 4.9e-3).abs() < 1e-8);
}

#[test]
fn a_frame_shows_the_outline_alone() {
    let dark = read(DRAWING, &["frame.shape=rectangle"]).unwrap();
    assert!(marks(&dark).is_empty());
    let feeds = steps(&dark).into_iter().filter(|step| matches!(step.action, Action::Feed { .. }));
    assert_eq!(feeds.count(), 4);
    let lit = read(DRAWING, &["frame.shape=hull", "frame.power=1 %"]).unwrap();
    let strong = read(DRAWING, &["frame.power=6 %"]).unwrap_err();
    assert!(strong.to_string().contains("5 % of full power at most, not 6 %"), "{strong}");
    is_near(extent(&lit), [-40.0, -15.0, 40.0, 15.0]);
    assert_eq!(marks(&lit).len(), 4);
}

#[test]
fn a_job_repeats_all_of_it() {
    let [once, thrice] = [1, 3]
        .map(|repeat| marks(&read(DRAWING, &[&format!("order.repeat={repeat}")]).unwrap()).len());
    assert_eq!(thrice, 3 * once);
}

#[test]
fn several_drawings_share_their_layers() {
    let job = r#"
        [drawings.front]
        file = "drawing.svg"
        [drawings.back]
        file = "drawing.svg"
        at = ["0 mm", "40 mm"]
        layer = "deep"
        [layers.deep]
        speed = "20 mm/s"
    "#;
    let folder = Folder::new(&[("drawing.svg", DRAWING), ("job.toml", job)]);
    let job = Job::read(&folder.path("job.toml"), &[], &Machine::builtin()).unwrap();
    is_near(extent(&job), [-40.0, -15.0, 40.0, 55.0]);
    assert_eq!(job.files.len(), 3);
    // Declared layers come first, and lines are those of the job file.
    let first =
        steps(&job).into_iter().find(|step| matches!(step.action, Action::Mark { .. })).unwrap();
    assert_eq!(first.line, 4);
    assert!(matches!(first.action, Action::Mark { speed: Some(speed), .. } if speed == 0.02));
}

#[test]
fn what_is_wrong_is_told_with_its_place() {
    let message = |settings: &[&str]| format!("{}", read(DRAWING, settings).unwrap_err());
    for (settings, expected) in [
        (&["drawing.width=40 mm", "drawing.scale=2"][..], "`scale` and `width` or `height`"),
        (&["drawing.layer=cut"], "there is no layer `cut`"),
        (&["layers.cut.colors=[\"blood\"]"], "`blood` is no colour"),
        (&["layers.cut.passes=0.5"], "`passes` cannot be 0.5"),
        (&["layers.red.focus_step=1 mm"], "the focus cannot be moved"),
        (&["drawing.anchor=middle"], "`middle`"),
        (&["drawing.file=other.svg"], "a drawing draws one thing"),
    ] {
        let text = message(settings);
        assert!(text.contains(expected), "{settings:?}: {text}");
    }
    let broken = read("<svg xmlns=\"http://www.w3.org/2000/svg\">\n<rect</svg>", &[]).unwrap_err();
    assert_eq!(broken.position().map(|(line, _)| line), Some(2));
    let text = "[letters]\ntext = \"N\"\n[layers.cut]\n";
    let error = Job::parse("job.toml", text, &Machine::builtin()).unwrap_err();
    assert!(error.to_string().contains("[layers] is for drawings"), "{error}");
}

#[test]
fn a_layer_with_nothing_on_it_is_noted() {
    let job = read(DRAWING, &["layers.cutt.speed=10 mm/s"]).unwrap();
    assert!(job.drawing.notes.iter().any(|note| note.text == "nothing is on the layer `cutt`"));
}

/// An image of 8-bit grey values from the top, as a BMP file of 254 dots per inch: 0.1 mm a pixel.
fn bmp(columns: usize, pixels: &[u8]) -> Vec<u8> {
    let rows = pixels.len() / columns;
    let padded = columns.next_multiple_of(4);
    let start = 14 + 40 + 4 * 256;
    let word = |value: usize| u32::try_from(value).unwrap().to_le_bytes();
    let mut file = b"BM".to_vec();
    file.extend([word(start + padded * rows), word(0), word(start), word(40)].concat());
    file.extend([word(columns), word(rows)].concat());
    file.extend([1, 0, 8, 0]);
    // Not packed; 10,000 pixels in a metre.
    file.extend([word(0), word(0), word(10_000), word(10_000), word(256), word(0)].concat());
    file.extend((0..=255_u8).flat_map(|grey| [grey, grey, grey, 0]));
    for row in pixels.chunks(columns).rev() {
        file.extend(row);
        file.extend(vec![0; padded - columns]);
    }
    file
}

#[test]
fn an_image_is_marked_pixel_by_pixel() {
    let columns = 12;
    let pixels: Vec<u8> = (0..columns * 9).map(|index| (index * 7 % 256) as u8).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.bmp");
    std::fs::write(&path, bmp(columns, &pixels)).unwrap();
    let read = |settings: &[&str]| {
        let settings: Vec<Override> = settings.iter().map(|text| text.parse().unwrap()).collect();
        Job::read(&path, &settings, &Machine::builtin()).unwrap()
    };
    let lower_left = ["drawing.anchor=lower_left", "drawing.layer=all"];
    for (settings, level) in [
        (["layers.all.image.mode=threshold"], &|grey: u8| f64::from(u8::from(grey < 128))),
        (["layers.all.image.mode=grey"], &(|grey: u8| f64::from(255 - grey) / 255.0)),
    ] as [([&str; 1], &dyn Fn(u8) -> f64); 2]
    {
        let job = read(&[&lower_left[..], &settings].concat());
        is_near_or_smaller(extent(&job), [0.0, 0.0, 1.2, 0.9]);
        let home = Vector3::from(Machine::builtin().home);
        let mut marked = vec![0.0; pixels.len()];
        for step in steps(&job) {
            let Action::Mark { curve: Curve::Line { from, to }, power, .. } = step.action else {
                continue;
            };
            let (from, to) = ((from - home) * 1e4, (to - home) * 1e4);
            let height = from.y - 0.5;
            assert!((from.y - to.y).abs() < 1e-9 && (height - height.round()).abs() < 1e-6);
            let row = 8 - height.round() as usize;
            let (left, right) = (from.x.min(to.x).round(), from.x.max(to.x).round());
            for column in left as usize..right as usize {
                marked[row * columns + column] += power.level;
            }
        }
        for (found, grey) in marked.iter().zip(&pixels) {
            assert!((found - level(*grey)).abs() < 1e-9, "{found} of {grey}");
        }
    }
    // To and fro: neighbouring rows run in opposite directions.
    let ways: Vec<f64> =
        marks(&read(&[])).iter().map(|[from, _, to]| (to - from).x.signum()).collect();
    assert!(ways.contains(&1.0) && ways.contains(&-1.0));
}

fn is_near_or_smaller(found: [f64; 4], most: [f64; 4]) {
    assert!(found[0] >= most[0] - 1e-6 && found[1] >= most[1] - 1e-6, "{found:?}");
    assert!(found[2] <= most[2] + 1e-6 && found[3] <= most[3] + 1e-6, "{found:?}");
}

#[test]
fn texts_and_codes_count_up_from_place_to_place() {
    let table = |body: &str| {
        let text = format!(
            "[drawing.array]\ncolumns = 2\nspacing = [\"50 mm\", \"0 mm\"]\n[drawing.serial]\nstart = 9\n{body}"
        );
        Job::parse("job.toml", &text, &Machine::builtin())
    };
    let both = |job: &Job| {
        let all = marks(job);
        let right: Vec<_> = all.iter().filter(|[from, ..]| from.x > 0.025).collect();
        (all.len() - right.len(), right.len())
    };
    for font in ["single_line", "outline"] {
        let body =
            format!("[drawing.text]\ncontent = \"{{n}}\"\nfont = \"{font}\"\nheight = \"10 mm\"\n");
        let job = table(&body).unwrap();
        let (left, right) = both(&job);
        assert!(left > 0 && right > left, "{font}: 9 has one digit and 10 has two: {left} {right}");
        if font == "single_line" {
            let [_, low, _, high] = extent(&job);
            assert!((high - low - 10.0).abs() < 0.5, "{low} {high}");
        }
    }
    let job = table("[drawing.code]\nqr = \"part {n}\"\nmodule = \"1 mm\"\n").unwrap();
    assert!(both(&job).1 > 100);
    let error = table("[drawing.text]\ncontent = \"{m}\"\n").unwrap_err().to_string();
    assert!(error.contains("`{m}` stands for nothing"), "{error}");
    let error = table("[drawing.text]\ncontent = \"\u{4e2d}\"\n").unwrap_err().to_string();
    assert!(error.contains('\u{4e2d}'), "{error}");
}

#[test]
fn columns_of_a_table_stand_for_their_names() {
    let job = "[drawing.text]\ncontent = \"{name}\"\n[drawing.array]\nrows = 2\nspacing = [\"0 mm\", \"9 mm\"]\n\
               [drawing.serial]\ncsv = \"parts.csv\"\nrow = 2\n";
    let folder = Folder::new(&[("parts.csv", "name,size\nA,1\nI,2\nMMMM,3\n"), ("job.toml", job)]);
    let read = || Job::read(&folder.path("job.toml"), &[], &Machine::builtin());
    let [left, _, right, _] = extent(&read().unwrap());
    assert!(right - left > 10.0, "the second place has four letters");
    std::fs::write(folder.path("parts.csv"), "name\nA\nB\n").unwrap();
    let error = read().unwrap_err().to_string();
    assert!(error.contains("2 places from row 2 on need 3 rows, parts.csv has 2"), "{error}");
}
