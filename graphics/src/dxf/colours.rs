//! Colours by their number in AutoCAD's list.

use crate::shape::Colour;

/// The colour of a number from 1 to 255. 7, white on a dark screen, is black on paper.
pub(super) fn indexed(index: u8) -> Colour {
    let rgb = |red, green, blue| Colour { red, green, blue };
    let grey = |value| rgb(value, value, value);
    match index {
        1 => rgb(255, 0, 0),
        2 => rgb(255, 255, 0),
        3 => rgb(0, 255, 0),
        4 => rgb(0, 255, 255),
        5 => rgb(0, 0, 255),
        6 => rgb(255, 0, 255),
        8 => grey(128),
        9 => grey(192),
        10..=249 => wheel(index),
        250 => grey(51),
        251 => grey(80),
        252 => grey(105),
        253 => grey(130),
        254 => grey(190),
        255 => grey(255),
        0 | 7 => Colour::BLACK,
    }
}

/// A colour of the wheel: 24 hues of 15 degrees, five values each, full and half saturated.
fn wheel(index: u8) -> Colour {
    const VALUES: [u16; 5] = [255, 165, 127, 76, 38];
    let hue = u16::from(index / 10 - 1);
    let value = VALUES[usize::from(index % 10 / 2)];
    let least = if index.is_multiple_of(2) { 0 } else { value / 2 };
    // Quarters of a sixth of the wheel; every other sixth goes down.
    let (sixth, step) = (hue / 4, hue % 4);
    let step = if sixth.is_multiple_of(2) { step } else { 4 - step };
    let between = least + (value - least) * step / 4;
    let (red, green, blue) = match sixth {
        0 => (value, between, least),
        1 => (between, value, least),
        2 => (least, value, between),
        3 => (least, between, value),
        4 => (between, least, value),
        _ => (value, least, between),
    };
    let [red, green, blue] = [red, green, blue].map(|part| u8::try_from(part).unwrap_or(u8::MAX));
    Colour { red, green, blue }
}

/// The colour of a number with 8 bits for each of red, green and blue.
pub(super) fn true_colour(value: i64) -> Colour {
    let part = |shift: u32| ((value >> shift) & 0xff) as u8;
    Colour { red: part(16), green: part(8), blue: part(0) }
}

#[cfg(test)]
mod tests {
    use super::{indexed, true_colour};

    #[test]
    fn colours_are_those_of_the_list() {
        for (index, colour) in [
            (1, "#ff0000"),
            (5, "#0000ff"),
            (7, "#000000"),
            (10, "#ff0000"),
            (11, "#ff7f7f"),
            (30, "#ff7f00"),
            (42, "#a57b00"),
            (90, "#00ff00"),
            (154, "#003f7f"),
            (170, "#0000ff"),
            (210, "#ff00ff"),
            (240, "#ff003f"),
            (255, "#ffffff"),
        ] {
            assert_eq!(indexed(index).to_string(), colour, "{index}");
        }
        assert_eq!(true_colour(0x12_34_56).to_string(), "#123456");
    }
}
