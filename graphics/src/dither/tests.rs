use super::*;
use crate::random::Random;

/// An image whose pixels are 1 mm wide and high.
fn raster(pixels: &[u8], columns: usize) -> Raster {
    Raster {
        pixels: pixels.into(),
        columns,
        rows: pixels.len() / columns,
        placement: Affine::scale(1e-3),
        layer: None,
        recipe: None,
        line: 0,
    }
}

fn plain(method: Method) -> Dither {
    Dither { pitch: 1e-3, interval: 1e-3, tone: Tone::default(), method }
}

/// Rows made pixels again, 255 where the power is full.
fn levels(how: Dither, raster: &Raster) -> Vec<u8> {
    let rows = how.rows(raster).expect("a valid image");
    let (columns, count) = (rows.columns(), rows.rows());
    let mut levels = vec![0; columns * count];
    for row in rows {
        let mut end = 0;
        for run in row.runs {
            assert!(run.from >= end && run.from < run.to && run.to <= columns, "{run:?}");
            end = run.to;
            levels[row.number * columns + run.from..row.number * columns + run.to].fill(run.level);
        }
    }
    levels
}

/// A portrait of a kind: slopes, noise, black and white.
fn picture(columns: usize, rows: usize) -> Raster {
    let mut random = Random::new(14);
    let pixel = |index: usize| {
        let (x, y) = (index % columns, index / columns);
        match (x / 16 + y / 16) % 4 {
            0 => (x * 255 / columns) as u8,
            1 => random.bits() as u8,
            2 => 255,
            _ => (y * 255 / rows) as u8,
        }
    };
    raster(&(0..columns * rows).map(pixel).collect::<Vec<u8>>(), columns)
}

#[test]
fn rows_are_the_dots_of_a_diffusion_of_the_whole_image() {
    let image = picture(97, 61);
    // Floyd and Steinberg's weights to the right, below left, below, below right, over the whole image.
    let mut values: Vec<f64> = image.pixels.iter().map(|pixel| f64::from(*pixel) / 255.0).collect();
    let mut expected = vec![0; values.len()];
    for y in 0..61_isize {
        let back = if y % 2 == 1 { -1 } else { 1 };
        for step in 0..97_isize {
            let x = if back < 0 { 96 - step } else { step };
            let at = (y * 97 + x) as usize;
            let dark = values[at] < 0.5;
            expected[at] = if dark { 255 } else { 0 };
            let error = values[at] - if dark { 0.0 } else { 1.0 };
            for (dx, dy, share) in [(back, 0, 7.0), (-back, 1, 3.0), (0, 1, 5.0), (back, 1, 1.0)] {
                if (0..97).contains(&(x + dx)) && y + dy < 61 {
                    values[((y + dy) * 97 + x + dx) as usize] += error * share / 16.0;
                }
            }
        }
    }
    let differ = levels(plain(Method::FloydSteinberg), &image)
        .iter()
        .zip(&expected)
        .filter(|(one, other)| one != other)
        .count();
    assert_eq!(differ, 0);
}

#[test]
fn every_method_keeps_the_grey_of_even_areas() {
    for method in [Method::Ordered, Method::FloydSteinberg, Method::Jarvis, Method::Stucki] {
        for grey in [0, 10, 64, 100, 128, 200, 250, 255] {
            let image = raster(&vec![grey; 128 * 128], 128);
            let marked = levels(plain(method), &image);
            let dark =
                marked.iter().filter(|level| **level > 0).count() as f64 / marked.len() as f64;
            let expected = 1.0 - f64::from(grey) / 255.0;
            assert!((dark - expected).abs() < 0.015, "{method:?} of {grey}: {dark}");
        }
    }
}

#[test]
fn grey_levels_are_the_darkness() {
    let image = raster(&[0, 64, 127, 128, 255, 255], 6);
    assert_eq!(levels(plain(Method::Grey(256)), &image), [255, 191, 128, 127, 0, 0]);
    assert_eq!(levels(plain(Method::Grey(3)), &image), [255, 128, 128, 128, 0, 0]);
    assert_eq!(levels(plain(Method::Threshold(128)), &image), [255, 255, 255, 0, 0, 0]);
    let row = plain(Method::Grey(3)).rows(&image).expect("valid").next();
    let run = |from, to, level| Run { from, to, level };
    assert_eq!(row, Some(Row { number: 0, runs: vec![run(0, 1, 255), run(1, 4, 128)] }));
}

#[test]
fn the_bayer_matrix_has_each_threshold_once() {
    let mut ranks: Vec<usize> =
        (0..64).map(|place| (bayer(place % 8, place / 8) * 64.0) as usize).collect();
    // The first row of the matrix as it is printed.
    assert_eq!(ranks[..8], [0, 32, 8, 40, 2, 34, 10, 42]);
    ranks.sort_unstable();
    assert!(ranks.into_iter().eq(0..64));
}

#[test]
fn fewer_dots_are_averages_of_areas() {
    let image = raster(&[0, 30, 60, 90, 120, 150], 3);
    let how = Dither { pitch: 1.5e-3, interval: 2e-3, ..plain(Method::Grey(256)) };
    // Columns of one and a half pixels, both rows in one.
    let value = |left: f64, middle: f64| (left + middle / 2.0) / 1.5;
    let expected =
        [value(45.0, 75.0), value(105.0, 75.0)].map(|value| (255.0 - value).round() as u8);
    assert_eq!(levels(how, &image), expected);
}

#[test]
fn more_dots_lie_on_lines_between_pixels() {
    let image = raster(&[0, 200], 2);
    let how = Dither { pitch: 0.5e-3, ..plain(Method::Grey(256)) };
    assert_eq!(levels(how, &image), [255, 205, 105, 55]);
}

#[test]
fn dots_cover_the_image() {
    let image = Raster {
        placement: Affine::translate((3.0, 4.0)) * Affine::rotate(1.0) * Affine::scale(1e-3),
        ..picture(10, 7)
    };
    let how = Dither { pitch: 0.3e-3, interval: 0.7e-3, ..plain(Method::Ordered) };
    let rows = how.rows(&image).expect("a valid image");
    assert_eq!((rows.columns(), rows.rows()), (33, 10));
    let off = rows.placement() * kurbo::Point::new(33.0, 10.0)
        - image.placement * kurbo::Point::new(10.0, 7.0);
    assert!(off.hypot() < 1e-12);
}

#[test]
fn the_tone_is_set() {
    let image = raster(&[0, 51, 102, 153, 204, 255], 6);
    let check = |tone: Tone, expected: [u8; 6]| {
        assert_eq!(levels(Dither { tone, ..plain(Method::Grey(256)) }, &image), expected);
    };
    let tone = Tone::default();
    check(Tone { is_inverted: true, ..tone }, [0, 51, 102, 153, 204, 255]);
    check(Tone { brightness: 0.2, ..tone }, [204, 153, 102, 51, 0, 0]);
    check(Tone { contrast: 1.0, ..tone }, [255, 255, 255, 0, 0, 0]);
    check(Tone { contrast: -1.0, ..tone }, [128; 6]);
    // 255·(1 − (k/5)^(1/2)).
    check(Tone { gamma: 2.0, ..tone }, [255, 141, 94, 57, 27, 0]);
}

#[test]
fn a_row_is_given_without_those_after_it() {
    let image = picture(64, 64);
    let all: Vec<Row> = plain(Method::Stucki).rows(&image).expect("valid").collect();
    assert_eq!(all.len(), 64);
    let cut = raster(&image.pixels[..64 * 20], 64);
    let some: Vec<Row> = plain(Method::Stucki).rows(&cut).expect("valid").collect();
    assert_eq!(all[..20], some[..]);
}

#[test]
fn what_cannot_be_marked_is_named() {
    let image = raster(&[0; 4], 2);
    let check = |how: Dither, raster: &Raster, expected: &str| {
        let error = how.rows(raster).expect_err("refused");
        assert_eq!(error.to_string(), expected);
    };
    let good = plain(Method::Ordered);
    check(Dither { pitch: -1.0, ..good }, &image, "pitch is -1; it must be more than 0 m");
    let tone = Tone { gamma: 0.0, ..Tone::default() };
    check(Dither { tone, ..good }, &image, "gamma is 0; it must be from 0.1 to 10");
    check(plain(Method::Grey(1)), &image, "levels is 1; it must be from 2 to 256");
    check(
        Dither { interval: 1e-9, ..good },
        &image,
        "2000000 rows of dots would be marked; at most 1000000 are",
    );
    check(
        good,
        &Raster { rows: 3, ..image.clone() },
        "the image has 4 pixels where 2 x 3 are said",
    );
    check(
        good,
        &Raster { placement: Affine::scale(0.0), ..image.clone() },
        "the image is 0 m x 0 m large; both must be finite and more than 0",
    );
}
