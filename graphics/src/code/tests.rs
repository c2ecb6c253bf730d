use super::*;
use crate::curve::signed_area;
use crate::hatch::{Area, Hatch, hatch};
use crate::random::Random;

const QR: Code<'_> = Code {
    text: "https://example.org/part/0815?batch=42",
    symbology: Symbology::Qr(Correction::Medium),
    module: 1e-3,
    quiet: 4,
    is_inverted: false,
    modules: Modules::Merged,
};

/// Pixels of a symbol that is filled with lines, `fine` to a module, row by row from the top; true is marked.
fn marked(symbol: &Symbol, module: f64, fine: usize) -> Vec<bool> {
    let (columns, rows) = (symbol.size.0 * fine, symbol.size.1 * fine);
    let pitch = module / fine as f64;
    let area = Area { contours: &symbol.shape.contours, rule: FillRule::NonZero, is_dark: true };
    let how = Hatch { angle: 0.0, spacing: pitch, is_cross: false, travel: Default::default() };
    let mut pixels = vec![false; columns * rows];
    for line in hatch(&[area], &how).expect("a valid area") {
        let (from, to) = (line.start.x.min(line.end().x), line.start.x.max(line.end().x));
        let row = rows - 1 - (line.start.y / pitch) as usize;
        for column in (from / pitch).round() as usize..(to / pitch).round() as usize {
            pixels[row * columns + column] = true;
        }
    }
    pixels
}

/// The text of a QR code as another program reads it from the marks, seen by a camera with four pixels to a
/// module.
fn read_qr(code: Code<'_>) -> String {
    const FINE: usize = 5;
    let symbol = code.symbol().expect("a valid code");
    let pixels = marked(&symbol, code.module, 4 * FINE);
    let (columns, rows) = (symbol.size.0 * 4, symbol.size.1 * 4);
    let mut image = rqrr::PreparedImage::prepare_from_greyscale(columns, rows, |x, y| {
        let within = (0..FINE * FINE).filter(|place| {
            let (x, y) = (x * FINE + place % FINE, y * FINE + place / FINE);
            pixels[y * columns * FINE + x] == code.is_inverted
        });
        (within.count() * 255 / (FINE * FINE)) as u8
    });
    let grids = image.detect_grids();
    assert_eq!(grids.len(), 1, "{code:?}");
    grids[0].decode().expect("readable").1
}

#[test]
fn another_program_reads_the_qr_codes() {
    use Correction::{High, Low, Medium, Quartile};
    for correction in [Low, Medium, Quartile, High] {
        let code = Code { symbology: Symbology::Qr(correction), ..QR };
        assert_eq!(read_qr(code), QR.text);
        assert_eq!(read_qr(Code { is_inverted: true, ..code }), QR.text);
        assert_eq!(read_qr(Code { modules: Modules::Squares(0.9), ..code }), QR.text);
        assert_eq!(read_qr(Code { modules: Modules::Dots(1.0), ..code }), QR.text);
    }
    for text in ["1", "0123456789", "ABC-123", "Grüße, 20 °C", &"x".repeat(700)] {
        assert_eq!(read_qr(Code { text, ..QR }), text);
    }
}

/// The bits of a Data Matrix code in the marks, row by row from the top.
fn bits(code: Code<'_>) -> (Vec<bool>, usize) {
    let symbol = code.symbol().expect("a valid code");
    let pixels = marked(&symbol, code.module, 1);
    let (columns, rows) = symbol.size;
    let quiet = code.quiet;
    let is_edge = |at: usize, size: usize| at < quiet || at >= size - quiet;
    let mut bits = Vec::new();
    for (index, pixel) in pixels.iter().enumerate() {
        let is_dark = *pixel != code.is_inverted;
        if is_edge(index % columns, columns) || is_edge(index / columns, rows) {
            assert!(!is_dark, "the quiet zone is light");
        } else {
            bits.push(is_dark);
        }
    }
    (bits, columns - 2 * quiet)
}

#[test]
fn the_data_matrix_codes_are_read_from_the_marks() {
    for symbology in [Symbology::SquareDataMatrix, Symbology::RectangularDataMatrix] {
        for is_inverted in [false, true] {
            let code =
                Code { text: "PN 4711-08 SN 000123", symbology, quiet: 2, is_inverted, ..QR };
            let (bits, width) = bits(code);
            assert_eq!(width * width == bits.len(), symbology == Symbology::SquareDataMatrix);
            // The finder: the left column and the lowest row are dark (ISO/IEC 16022, 7.1).
            assert!(bits.iter().step_by(width).all(|bit| *bit));
            assert!(bits[bits.len() - width..].iter().all(|bit| *bit));
            let data = DataMatrix::decode(&bits, width).expect("readable");
            assert_eq!(data, code.text.as_bytes());
        }
    }
}

#[test]
fn the_example_of_the_standard_is_met() {
    // ISO/IEC 16022, annex O: "123456" in a symbol of 10 by 10.
    let code = Code { text: "123456", symbology: Symbology::SquareDataMatrix, quiet: 0, ..QR };
    let (bits, width) = bits(code);
    let rows: Vec<String> = bits
        .chunks(width)
        .map(|row| row.iter().map(|bit| if *bit { '1' } else { '0' }).collect())
        .collect();
    let expected = [
        "1010101010",
        "1100101101",
        "1100000100",
        "1100011101",
        "1100001000",
        "1000001111",
        "1110110000",
        "1111011001",
        "1001110100",
        "1111111111",
    ];
    assert_eq!(rows, expected);
}

#[test]
fn neighbouring_modules_have_no_edge_between_them() {
    let at = |cells: &[&str]| {
        let cells: Vec<Vec<bool>> =
            cells.iter().rev().map(|row| row.chars().map(|cell| cell == '#').collect()).collect();
        outline::merged(cells[0].len(), cells.len(), 1.0, |column, row| cells[row][column])
    };
    let ring = at(&["###", "#.#", "###"]);
    assert_eq!(ring.len(), 2);
    assert!(ring.iter().all(|contour| contour.segments.len() == 4));
    let areas: Vec<f64> = ring.iter().map(|one| signed_area(&one.flattened(1.0))).collect();
    assert_eq!(areas, [9.0, -1.0]);
    // Cells at a corner stay apart, and so do holes and what lies around them.
    assert_eq!(at(&["#.", ".#"]).len(), 2);
    assert_eq!(at(&["####", "#.##", "##.#", "####"]).len(), 2);
    assert_eq!(at(&["...", "..."]), []);
    for contour in at(&["#.#.", "####", ".##.", "#..#"]) {
        assert!(contour.end() == contour.start && contour.segments.len() >= 4);
    }
}

#[test]
fn what_cannot_be_encoded_is_named() {
    let check = |code: Code<'_>, expected: &str| {
        assert_eq!(code.symbol().expect_err("refused").to_string(), expected);
    };
    check(Code { text: "", ..QR }, "the code has no text; it needs at least one character");
    check(
        Code { text: &"x".repeat(8_000), ..QR },
        "the text of 8000 bytes does not fit into a QR code of correction M, which holds at most 5596 digits",
    );
    check(
        Code { text: &"x".repeat(5_000), ..QR },
        "the text of 5000 bytes does not fit into a QR code of correction M, which holds at most 5596 digits",
    );
    check(Code { module: 0.0, ..QR }, "module is 0; it must be from 0.000001 m to 1 m");
    check(Code { quiet: 101, ..QR }, "quiet zone is 101; it must be at most 100 modules");
    check(
        Code { modules: Modules::Dots(1.5), ..QR },
        "share of a module is 1.5; it must be more than 0 and at most 1",
    );
}

#[test]
fn ten_thousand_texts_do_no_harm() {
    let mut random = Random::new(15);
    for round in 0..10_000 {
        let length = random.below(if round % 100 == 0 { 1_500 } else { 40 });
        let text: String = (0..length)
            .filter_map(|_| {
                let range = [128, 256, 0x11_0000][round % 3];
                char::from_u32(random.below(range) as u32)
            })
            .collect();
        let symbology = match round % 4 {
            0 => Symbology::Qr(Correction::Low),
            1 => Symbology::Qr(Correction::High),
            2 => Symbology::SquareDataMatrix,
            _ => Symbology::RectangularDataMatrix,
        };
        let code = Code { text: &text, symbology, is_inverted: round % 5 == 0, ..QR };
        if let Ok(symbol) = code.symbol() {
            assert!(!symbol.shape.contours.is_empty());
        }
    }
}
