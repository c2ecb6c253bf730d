#![no_main]

use graphics::text::{Align, Font, Height, Text};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(font) = Font::new(bytes) {
        let _ = font.set(&Text {
            text: "AVfi Ö",
            height: Height::Cap(0.01),
            letter_spacing: 0.0,
            line_spacing: 1.2,
            align: Align::Left,
            radius: None,
        });
    }
});
