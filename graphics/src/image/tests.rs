use ::image::codecs::{bmp::BmpEncoder, jpeg::JpegEncoder, png::PngEncoder};
use ::image::{ExtendedColorType, ImageEncoder};

use super::*;
use crate::random::Random;

fn png(pixels: &[u8], columns: u32, rows: u32, colours: ExtendedColorType) -> Vec<u8> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes).write_image(pixels, columns, rows, colours).expect("encodes");
    bytes
}

/// A chunk after the header of a PNG, with its check sum.
fn with_chunk(png: &[u8], kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let mut sum = u32::MAX;
    for byte in kind.iter().chain(data) {
        sum ^= u32::from(*byte);
        for _ in 0..8 {
            sum = if sum & 1 == 1 { (sum >> 1) ^ 0xedb8_8320 } else { sum >> 1 };
        }
    }
    let mut bytes = png[..33].to_vec();
    bytes.extend((data.len() as u32).to_be_bytes());
    bytes.extend(kind);
    bytes.extend(data);
    bytes.extend((!sum).to_be_bytes());
    bytes.extend(&png[33..]);
    bytes
}

fn jpeg(pixels: &[u8], columns: u32, rows: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, 100);
    encoder.write_image(pixels, columns, rows, ExtendedColorType::L8).expect("encodes");
    bytes
}

fn bmp(pixels: &[u8], columns: u32, rows: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    BmpEncoder::new(&mut bytes)
        .write_image(pixels, columns, rows, ExtendedColorType::Rgb8)
        .expect("encodes");
    bytes
}

#[test]
fn grey_pixels_keep_their_values() {
    let ramp: Vec<u8> = (0..=255).collect();
    let image = decode(&png(&ramp, 64, 4, ExtendedColorType::L8)).expect("an image");
    assert_eq!((&image.pixels[..], image.columns, image.rows), (&ramp[..], 64, 4));
    let colours: Vec<u8> = ramp.iter().flat_map(|value| [*value; 3]).collect();
    let image = decode(&bmp(&colours, 64, 4)).expect("an image");
    assert_eq!(&image.pixels[..], &ramp[..]);
    let image = decode(&jpeg(&[200; 64], 8, 8)).expect("an image");
    assert!(image.pixels.iter().all(|value| value.abs_diff(200) < 2));
}

#[test]
fn colours_are_as_bright_as_they_look_and_transparency_is_white() {
    // Red, green, blue, clear black, half black.
    let pixels =
        [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [0, 0, 0, 0], [0, 0, 0, 128]];
    let image = decode(&png(pixels.as_flattened(), 5, 1, ExtendedColorType::Rgba8)).expect("one");
    // 0.2126, 0.7152 and 0.0722 by the transfer function of sRGB.
    assert_eq!(&image.pixels[..], [127, 220, 76, 255, 127]);
}

#[test]
fn the_size_of_pixels_is_read() {
    let plain = png(&[0; 6], 3, 2, ExtendedColorType::L8);
    assert_eq!(decode(&plain).expect("an image").pitch, None);
    let mut data = [10_000_u32.to_be_bytes(), 5_000_u32.to_be_bytes()].concat();
    data.push(1);
    let graphic = read(&with_chunk(&plain, b"pHYs", &data)).expect("an image");
    assert_eq!(graphic.images[0].placement, Affine::scale_non_uniform(1e-4, 2e-4));
    assert_eq!(graphic.notes, []);
    // JFIF: 254 dots to the inch.
    let mut file = jpeg(&[0; 64], 8, 8);
    file[13..18].copy_from_slice(&[1, 0, 254, 0, 254]);
    let (width, height) = decode(&file).expect("an image").pitch.expect("a pitch");
    assert!((width - 1e-4).abs() < 1e-12 && (height - 1e-4).abs() < 1e-12);
    let mut file = bmp(&[0; 12], 2, 2);
    file[38..46].copy_from_slice(&[0x10, 0x27, 0, 0, 0x20, 0x4e, 0, 0]);
    assert_eq!(decode(&file).expect("an image").pitch, Some((1e-4, 5e-5)));
}

#[test]
fn an_image_without_a_resolution_is_noted() {
    let graphic = read(&png(&[0; 4], 2, 2, ExtendedColorType::L8)).expect("an image");
    assert_eq!(graphic.notes[0].text, "the image has no resolution: 96 dots per inch are taken");
    assert_eq!(graphic.images[0].placement, Affine::scale(0.0254 / 96.0));
}

#[test]
fn the_orientation_of_a_camera_is_applied() {
    // Exif with one entry, orientation 6: the first row is the right side.
    let exif = b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
    let lying = png(&[10, 20, 30, 40, 50, 60], 3, 2, ExtendedColorType::L8);
    let image = decode(&with_chunk(&lying, b"eXIf", exif)).expect("an image");
    assert_eq!(
        (&image.pixels[..], image.columns, image.rows),
        (&[40, 10, 50, 20, 60, 30][..], 2, 3)
    );
}

#[test]
fn a_bomb_is_refused_before_it_is_unpacked() {
    let mut file = png(&[0; 4], 2, 2, ExtendedColorType::L8);
    file[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
    // The check sum of the header.
    let header = with_chunk(&file[..33], b"IHDR", &file[16..29]);
    let sum = header[33 + 8 + 13..33 + 8 + 17].to_vec();
    file[29..33].copy_from_slice(&sum);
    let error = decode(&file).expect_err("refused");
    assert_eq!(error.message, "the image has 65536 x 65536 pixels");
    assert_eq!(error.help, "1 to 100000000 pixels in all");
}

#[test]
fn what_is_no_image_is_named() {
    let error = decode(b"<svg/>").expect_err("refused");
    assert_eq!(error.message, "the file is not an image of a known kind");
    let file = png(&[0; 64], 8, 8, ExtendedColorType::L8);
    let error = decode(&file[..50]).expect_err("refused");
    assert!(error.message.starts_with("the PNG image is damaged: "), "{error}");
}

#[test]
fn ten_thousand_damaged_files_do_no_harm() {
    let mut random = Random::new(13);
    let picture: Vec<u8> = (0..24 * 24).map(|_| random.bits() as u8).collect();
    let colours: Vec<u8> = (0..24 * 24 * 3).map(|_| random.bits() as u8).collect();
    let mut gif = Vec::new();
    ::image::codecs::gif::GifEncoder::new(&mut gif)
        .encode(&colours, 24, 24, ExtendedColorType::Rgb8)
        .expect("encodes");
    let mut webp = Vec::new();
    ::image::codecs::webp::WebPEncoder::new_lossless(&mut webp)
        .encode(&colours, 24, 24, ExtendedColorType::Rgb8)
        .expect("encodes");
    let files = [
        png(&picture, 24, 24, ExtendedColorType::L8),
        jpeg(&picture, 24, 24),
        bmp(&colours, 24, 24),
        gif,
        webp,
    ];
    for round in 0..10_000 {
        let mut file = files[round % files.len()].clone();
        for _ in 0..=random.below(4) {
            let within = if random.below(2) == 0 { file.len() } else { 64 };
            let at = random.below(within);
            match random.below(4) {
                0 => file[at] = random.bits() as u8,
                1 => file[at] ^= 1 << random.below(8),
                2 => file.truncate(at.max(64)),
                _ => file[at] = [0, 0xff, 0x7f, 0x80][random.below(4)],
            }
        }
        if let Ok(image) = decode(&file) {
            assert_eq!(image.pixels.len(), image.columns * image.rows);
        }
    }
}

/// A grey picture as a TIFF file of 100 by 50 pixels to `unit`, the tags in either order of bytes.
fn tiff(pixels: &[u8], [columns, rows]: [u16; 2], unit: u16, is_little: bool) -> Vec<u8> {
    let short = |value: u16| if is_little { value.to_le_bytes() } else { value.to_be_bytes() };
    let long = |value: u32| if is_little { value.to_le_bytes() } else { value.to_be_bytes() };
    let whole = |tag: u16, value: u16| {
        [&short(tag)[..], &short(3), &long(1), &short(value), &short(0)].concat()
    };
    let far = |tag: u16, kind: u16, value: u32| {
        [&short(tag)[..], &short(kind), &long(1), &long(value)].concat()
    };
    let entries = 11_u16;
    let behind = 8 + 2 + 12 * u32::from(entries) + 4;
    [
        if is_little { b"II" } else { b"MM" }.to_vec(),
        short(42).to_vec(),
        long(8).to_vec(),
        short(entries).to_vec(),
        whole(256, columns),
        whole(257, rows),
        whole(258, 8),
        whole(259, 1),
        // 0 is black.
        whole(262, 1),
        far(273, 4, behind + 16),
        whole(277, 1),
        far(279, 4, pixels.len() as u32),
        far(282, 5, behind),
        far(283, 5, behind + 8),
        whole(296, unit),
        long(0).to_vec(),
        [long(200), long(2), long(50), long(1)].concat(),
        pixels.to_vec(),
    ]
    .concat()
}

#[test]
fn a_tiff_is_read_with_its_resolution() {
    let ramp: Vec<u8> = (0..=255).collect();
    for is_little in [true, false] {
        for (unit, pitch) in
            [(1, None), (2, Some((0.0254 / 100.0, 0.0254 / 50.0))), (3, Some((1e-4, 2e-4)))]
        {
            let image = decode(&tiff(&ramp, [64, 4], unit, is_little)).expect("an image");
            assert_eq!((&image.pixels[..], image.columns, image.rows), (&ramp[..], 64, 4));
            match (image.pitch, pitch) {
                (Some(found), Some(right)) => {
                    assert!((found.0 - right.0).abs() < 1e-12 && (found.1 - right.1).abs() < 1e-12);
                }
                (found, right) => assert_eq!(found, right),
            }
        }
    }
    let file = tiff(&ramp, [64, 4], 2, true);
    for length in 0..file.len() {
        assert!(decode(&file[..length]).is_err(), "{length} bytes");
    }
}
