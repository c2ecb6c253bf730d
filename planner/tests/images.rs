//! Images: the light of a plan, made pixels again, is the dithered image, pixel by pixel.

#![allow(clippy::unwrap_used)]

mod support;

use graphics::Raster;
use graphics::dither::{Dither, Method, Tone};
use kurbo::Point;
use machine::Machine;
use messages::random::SplitMix64;
use planner::job::Job;

use support::{lit, overrides};

/// From the gate to light, and to darkness [s].
const DELAYS: [f64; 2] = [120e-6, 40e-6];

/// A picture of soft and hard edges, noise and fine lines.
const COLUMNS: usize = 48;
const ROWS: usize = 24;

fn picture() -> Vec<u8> {
    let mut random = SplitMix64::new(12);
    let mut pixels = Vec::new();
    for (row, column) in (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column))) {
        pixels.push(match (4 * column / COLUMNS, 2 * row / ROWS) {
            (0, 0) => (column * 255 / (COLUMNS / 4)) as u8,
            (1, 0) => 255 * ((row + column) % 2) as u8,
            (2, 0) => 255 * (column % 3).min(1) as u8,
            (3, 0) => random.bits() as u8,
            (0 | 1, _) => (row * 255 / ROWS) as u8,
            (2, _) => 40,
            _ => 255,
        });
    }
    pixels
}

/// 8-bit grey values from the top as a BMP file of 254 dots per inch: 0.1 mm a pixel.
fn bmp(pixels: &[u8]) -> Vec<u8> {
    let start = 14 + 40 + 4 * 256;
    let word = |value: usize| u32::try_from(value).unwrap().to_le_bytes();
    let mut file = b"BM".to_vec();
    file.extend([word(start + pixels.len()), word(0), word(start), word(40)].concat());
    file.extend([word(COLUMNS), word(ROWS)].concat());
    file.extend([1, 0, 8, 0]);
    file.extend([word(0), word(0), word(10_000), word(10_000), word(256), word(0)].concat());
    file.extend((0..=255_u8).flat_map(|grey| [grey, grey, grey, 0]));
    pixels.chunks(COLUMNS).rev().for_each(|row| file.extend(row));
    file
}

/// How much of each dot is marked, 0 or 1 of the dithered image, row by row from the top.
fn dithered(raster: &Raster, dither: &Dither) -> Vec<f64> {
    let rows = dither.rows(raster).unwrap();
    let columns = rows.columns();
    let mut levels = vec![0.0; columns * rows.rows()];
    for row in rows {
        for run in row.runs {
            levels[row.number * columns + run.from..row.number * columns + run.to].fill(1.0);
        }
    }
    levels
}

/// How much of each dot is lit by straight `lines` of light, from home [m].
fn marked(lines: &[[Point; 2]], raster: &Raster, dither: &Dither) -> Vec<f64> {
    let rows = dither.rows(raster).unwrap();
    let (columns, count) = (rows.columns(), rows.rows());
    let to_dots = rows.placement().inverse();
    let mut levels = vec![0.0; columns * count];
    for line in lines {
        let [from, to] = line.map(|point| to_dots * point);
        let row = count as f64 - from.y;
        assert!((from.y - to.y).abs() < 1e-3, "{line:?} is in no row");
        assert!((row - row.floor() - 0.5).abs() < 1e-2, "{line:?} is beside its row");
        let (left, right) = (from.x.min(to.x), from.x.max(to.x));
        assert!(left > -0.02 && right < columns as f64 + 0.02, "{line:?} is beyond the image");
        for column in 0..columns {
            let (begin, end) = (left.max(column as f64), right.min(column as f64 + 1.0));
            levels[row as usize * columns + column] += (end - begin).max(0.0);
        }
    }
    levels
}

/// Plans the picture with what `settings` say of images, and holds every dot against `dither`.
fn check(settings: &[String], dither: &Dither) {
    let delays =
        [format!("laser.on_delay={} s", DELAYS[0]), format!("laser.off_delay={} s", DELAYS[1])];
    let machine =
        Machine::builtin_with(&overrides(&delays.each_ref().map(String::as_str))).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("picture.bmp");
    std::fs::write(&file, bmp(&picture())).unwrap();
    let raster = graphics::read::read_file(&file).unwrap().images.remove(0);
    let placed = ["drawing.anchor=page", "drawing.layer=all", "layers.all.speed=150 mm/s"];
    let image = settings.iter().map(|text| format!("layers.all.image.{text}"));
    let all: Vec<String> = placed.iter().map(|text| (*text).to_owned()).chain(image).collect();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    let job = Job::read(&file, &overrides(&all), &machine).unwrap();
    let plan = planner::plan(&machine, &job).unwrap();
    let home = Point::new(machine.home[0], machine.home[1]);
    let lines: Vec<[Point; 2]> = lit(&plan, DELAYS)
        .iter()
        .map(|line| line.map(|at| (Point::new(at.x, at.y) - home).to_point()))
        .collect();
    let right = dithered(&raster, dither);
    for (index, (found, right)) in marked(&lines, &raster, dither).iter().zip(&right).enumerate() {
        assert!((found - right).abs() < 0.02, "{settings:?}, dot {index}: {found}, not {right}");
    }
    assert!(right.contains(&0.0) && right.contains(&1.0));
}

const METHODS: [(&str, Method); 5] = [
    ("threshold", Method::Threshold(128)),
    ("ordered", Method::Ordered),
    ("floyd_steinberg", Method::FloydSteinberg),
    ("jarvis", Method::Jarvis),
    ("stucki", Method::Stucki),
];

#[test]
fn every_method_is_marked_dot_by_dot_in_one_direction_and_in_both() {
    for (name, method) in METHODS {
        let dither = Dither { pitch: 1e-4, interval: 1e-4, tone: Tone::default(), method };
        for way in ["bidirectional=true", "bidirectional=false"] {
            check(&[format!("mode={name}"), way.to_owned()], &dither);
        }
    }
}

#[test]
fn dots_of_any_size_are_marked_where_they_are() {
    // 300 dots per inch; rows farther apart than dots are wide; and fewer dots than pixels.
    for (pitch, interval) in [(0.0847, 0.0847), (0.09, 0.2), (0.31, 0.17)] {
        let tone = Tone { is_inverted: true, gamma: 1.5, contrast: 0.2, brightness: 0.1 };
        let (pitch_metres, interval_metres) = (pitch * 1e-3, interval * 1e-3);
        let method = Method::Stucki;
        let dither = Dither { pitch: pitch_metres, interval: interval_metres, tone, method };
        let settings = [
            "mode=stucki".to_owned(),
            "inverted=true".to_owned(),
            "gamma=1.5".to_owned(),
            "contrast=0.2".to_owned(),
            "brightness=0.1".to_owned(),
            format!("pitch={pitch} mm"),
            format!("interval={interval} mm"),
        ];
        check(&settings, &dither);
    }
}
