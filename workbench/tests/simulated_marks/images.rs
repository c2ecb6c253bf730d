//! Images: every dot of the dithered image is marked, and nothing else.

use graphics::Raster;
use graphics::dither::{Dither, Method, Tone};
use kurbo::Line;
use messages::random::SplitMix64;

const COLUMNS: usize = 40;
const ROWS: usize = 12;

/// How much of a dot may be lit that is white, or dark that is black: 20 µm of 0.1 mm.
const TOLERANCE: f64 = 0.2;

/// Half of it a ramp, the other half noise.
fn picture() -> Vec<u8> {
    let mut random = SplitMix64::new(12);
    let mut grey = |row: usize, column: usize| {
        if column < COLUMNS / 2 { (8 * column + 4 * row) as u8 } else { random.bits() as u8 }
    };
    let places = (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column)));
    places.map(|(row, column)| grey(row, column)).collect()
}

/// 8-bit grey values from the top as a BMP file of 254 dots per inch: 0.1 mm a pixel.
fn bmp(pixels: &[u8]) -> Vec<u8> {
    let start = 14 + 40 + 4 * 256;
    let words = |values: &[usize]| -> Vec<u8> {
        values.iter().flat_map(|value| u32::try_from(*value).unwrap().to_le_bytes()).collect()
    };
    let mut file = b"BM".to_vec();
    file.extend(words(&[start + pixels.len(), 0, start, 40, COLUMNS, ROWS]));
    file.extend([1, 0, 8, 0]);
    file.extend(words(&[0, 0, 10_000, 10_000, 256, 0]));
    file.extend((0..=255_u8).flat_map(|grey| [grey, grey, grey, 0]));
    pixels.chunks(COLUMNS).rev().for_each(|row| file.extend(row));
    file
}

/// 1 for each dot of the dithered image, else 0, row by row from the top.
fn dithered(raster: &Raster, dither: &Dither) -> Vec<f64> {
    let mut dots = vec![0.0; COLUMNS * ROWS];
    for row in dither.rows(raster).unwrap() {
        for run in row.runs {
            dots[row.number * COLUMNS + run.from..row.number * COLUMNS + run.to].fill(1.0);
        }
    }
    dots
}

/// How much of each dot is lit, by lines of light from the lower left corner of the image [m].
fn levels(lines: &[Line], pitch: f64) -> Vec<f64> {
    let mut levels = vec![0.0; COLUMNS * ROWS];
    for line in lines {
        let [from, to] = [line.p0, line.p1].map(|point| (point.to_vec2() / pitch).to_point());
        let row = ROWS as f64 - (from.y + to.y) / 2.0;
        assert!((row - row.floor() - 0.5).abs() < TOLERANCE, "{line:?} is beside its row");
        let (left, right) = (from.x.min(to.x), from.x.max(to.x));
        assert!(left > -TOLERANCE && right < COLUMNS as f64 + TOLERANCE, "{line:?} is beside it");
        for column in 0..COLUMNS {
            let (begin, end) = (left.max(column as f64), right.min(column as f64 + 1.0));
            levels[row as usize * COLUMNS + column] += (end - begin).max(0.0);
        }
    }
    levels
}

#[test]
fn the_light_of_a_simulation_is_the_dithered_image_dot_by_dot() {
    let pitch = 1e-4;
    let file = bmp(&picture());
    let raster = graphics::image::read(&file).unwrap().images.remove(0);
    let delays = ["laser.on_delay=120 us", "laser.off_delay=40 us"];
    let methods = [
        ("threshold", Method::Threshold(128)),
        ("ordered", Method::Ordered),
        ("floyd_steinberg", Method::FloydSteinberg),
    ];
    for (index, (name, method)) in methods.into_iter().enumerate() {
        let dither = Dither { pitch, interval: pitch, tone: Tone::default(), method };
        let mode = format!("layers.all.image.mode={name}");
        let way = format!("layers.all.image.bidirectional={}", index != 1);
        let placed = ["drawing.anchor=page", "drawing.layer=all", "layers.all.speed=100 mm/s"];
        let job = [&placed[..], &[&mode, &way]].concat();
        let lines = super::marked("picture.bmp", &file, &delays, &job);
        let right = dithered(&raster, &dither);
        for (dot, (found, right)) in levels(&lines, pitch).iter().zip(&right).enumerate() {
            assert!((found - right).abs() < TOLERANCE, "{name}, dot {dot}: {found}, not {right}");
        }
        assert!(right.contains(&0.0) && right.contains(&1.0));
    }
}
