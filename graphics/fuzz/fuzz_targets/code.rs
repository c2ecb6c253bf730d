#![no_main]

use graphics::code::{Code, Correction, Modules, Symbology};

libfuzzer_sys::fuzz_target!(|text: &str| {
    for symbology in [
        Symbology::Qr(Correction::Medium),
        Symbology::SquareDataMatrix,
        Symbology::RectangularDataMatrix,
    ] {
        let _ = Code {
            text,
            symbology,
            module: 1e-3,
            quiet: 4,
            is_inverted: false,
            modules: Modules::Merged,
        }
        .symbol();
    }
});
