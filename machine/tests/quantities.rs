//! Quantities: units, powers, and what is said of those that are none.

#![allow(clippy::unwrap_used)]

use core::f64::consts::TAU;

use machine::quantity::*;
use messages::random::SplitMix64;

#[track_caller]
fn reads<K: Kind>(text: &str, expected: f64) {
    let value = read::<K>(text).unwrap_or_else(|error| panic!("`{text}`: {error}"));
    let error = (value - expected).abs();
    // One rounding of the product and one of the quotient.
    assert!(error <= 4e-16 * expected.abs(), "`{text}` is {value}, not {expected}");
}

#[track_caller]
fn refuses<K: Kind>(text: &str, kind: QuantityErrorKind, message: &str) {
    let error = read::<K>(text).expect_err(text);
    assert_eq!((error.kind, error.to_string()), (kind, message.to_owned()));
    assert!(text.get(error.span.clone()).is_some(), "{:?} is not in `{text}`", error.span);
}

#[test]
fn every_kind_reads_its_units() {
    for text in ["120 mm", "0.12 m", "12 cm", "120000 um", "120000 µm", "120000 μm", "120mm"] {
        reads::<Length>(text, 0.12);
    }
    reads::<Length>("1 in", 0.0254);
    reads::<Length>("-2.5e-1 mm", -0.00025);
    reads::<Length>(".5 mm", 0.0005);
    reads::<Length>("5. mm", 0.005);
    reads::<Length>("  +7 mm  ", 0.007);
    reads::<Mass>("330 g", 0.33);
    for text in ["20 us", "20 µs", "0.02 ms", "20000 ns", "2e-5 s"] {
        reads::<Duration>(text, 2e-5);
    }
    for text in ["0.25 m/s", "250 mm/s", "15 m/min", "15000 mm/min", "15000 mm min^-1"] {
        reads::<Speed>(text, 0.25);
    }
    for text in ["10 m/s^2", "10 m/s²", "10000 mm/s^2", "10 m s⁻²", "10 m s^-2", "10 m/s/s"] {
        reads::<Acceleration>(text, 10.0);
    }
    reads::<Jerk>("500 m/s³", 500.0);
    reads::<Jerk>("500 m/s^3", 500.0);
    for text in ["2e-6 kg m^2", "2e-6 kg*m^2", "2e-6 kg·m²", "20 g cm^2", "2e-6 kg m m"] {
        reads::<Inertia>(text, 2e-6);
    }
    for text in ["5 mN m", "0.005 N m", "0.005 N·m", "5 mNm", "0.5 Ncm", "0.005 kg m²/s²"] {
        reads::<Torque>(text, 0.005);
    }
    reads::<Stiffness>("60 N/mm", 6e4);
    reads::<TorsionalStiffness>("600 N m/rad", 600.0);
    reads::<Damping>("253 N s/m", 253.0);
    reads::<TorsionalDamping>("1e-6 N m s/rad", 1e-6);
    for text in ["2.3 ohm", "2.3 Ω", "2.3 \u{2126}", "2300 mohm", "2.3 V/A"] {
        reads::<Resistance>(text, 2.3);
    }
    reads::<Inductance>("2.3 mH", 2.3e-3);
    reads::<Voltage>("12 V", 12.0);
    reads::<Current>("5200 mA", 5.2);
    for text in ["0.021 N m/A", "21 mN m/A", "0.021 V s/rad", "0.021 V s"] {
        reads::<TorqueConstant>(text, 0.021);
    }
    reads::<AngularSpeed>("3000 rpm", 100.0 * TAU / 2.0);
    reads::<AngularSpeed>("1 rev/s", TAU);
    reads::<Bandwidth>("40 1/s", 40.0);
    reads::<Bandwidth>("40 /s", 40.0);
    reads::<Bandwidth>("160 rad/s", 160.0);
    reads::<Bandwidth>("10 Hz", 10.0 * TAU);
    reads::<Lead>("15 mm/rev", 0.015 / TAU);
    reads::<CountsPerTurn>("4096 counts/rev", 4096.0 / TAU);
}

/// Decimal prefixes must not cost a bit: the same `f64` as the SI literal.
#[test]
fn decimal_units_are_exact() {
    for value in 1..2000 {
        let text = format!("{value} um");
        assert_eq!(read::<Length>(&text).unwrap(), f64::from(value) / 1e6, "{text}");
        let text = format!("{}.{} mm", value / 10, value % 10);
        let literal: f64 = format!("{}.{}e-3", value / 10, value % 10).parse().unwrap();
        assert!((read::<Length>(&text).unwrap() - literal).abs() <= literal * 2.3e-16, "{text}");
    }
}

#[test]
fn what_is_no_quantity_is_refused_with_advice() {
    use QuantityErrorKind::*;
    refuses::<Length>("20 mmm", UnknownUnit, "`mmm` is not a unit; did you mean `mm`?");
    refuses::<Length>("20 MM", UnknownUnit, "`MM` is not a unit; did you mean `mm`?");
    refuses::<Speed>(
        "3 kg",
        WrongDimension,
        "`3 kg` is a mass, but a speed is needed; write a speed such as \"0.25 m/s\"",
    );
    refuses::<Torque>(
        "3 N m/rad",
        WrongDimension,
        "`3 N m/rad` is a torsional stiffness, but a torque is needed; write a torque such as \"5 mN m\"",
    );
    refuses::<Length>(
        "20",
        NoUnit,
        "`20` has no unit, but a length is needed; write a length such as \"120 mm\"",
    );
    refuses::<Length>(
        "",
        NotANumber,
        "`` does not start with a number; write a length such as \"120 mm\"",
    );
    refuses::<Length>(
        "mm",
        NotANumber,
        "`mm` does not start with a number; write a length such as \"120 mm\"",
    );
    refuses::<Length>(
        "-inf mm",
        NotFinite,
        "`-inf mm` is not a finite number; write a length such as \"120 mm\"",
    );
    refuses::<Length>(
        "1e999 mm",
        NotFinite,
        "`1e999` is beyond any machine; write a length such as \"120 mm\"",
    );
    refuses::<Length>(
        "1e16 m",
        NotFinite,
        "`1e16 m` is beyond any machine; write a length such as \"120 mm\"",
    );
    refuses::<Speed>(
        "1 m//s",
        Malformed,
        "`/` has no place in a unit here; write a speed such as \"0.25 m/s\"",
    );
    refuses::<Speed>(
        "1 m/",
        Malformed,
        "the unit ends with an operator; write a speed such as \"0.25 m/s\"",
    );
    refuses::<Speed>(
        "1 m/s^0",
        Malformed,
        "`^` takes a power from 1 to 9; write a speed such as \"0.25 m/s\"",
    );
    refuses::<Length>(
        "1,5 mm",
        Malformed,
        "`,` has no place in a unit here; write a length such as \"120 mm\"",
    );
    refuses::<Length>(
        "1 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9",
        Malformed,
        "`m` has no place in a unit here; write a length such as \"120 mm\"",
    );
}

/// Any text at all: a value or an error whose span lies in the text.
#[test]
fn no_text_panics() {
    let mut random = SplitMix64::new(1);
    let parts = [
        "1", "9", ".", "e", "E", "-", "+", "m", "mm", "s", "N", "µ", "Ω", "²", "⁻", "^", "/", "*",
        "·", " ", "\t", "\u{a0}", "nan", "inf", "kg", "(", "%", "°", "😀", "\u{0}",
    ];
    for case in 0..200_000 {
        let mut text = String::new();
        for _ in 0..case % 9 {
            text.push_str(parts[(random.bits() % parts.len() as u64) as usize]);
        }
        match read::<Length>(&text) {
            Ok(value) => assert!(value.is_finite(), "`{text}`"),
            Err(error) => assert!(text.get(error.span.clone()).is_some(), "`{text}`: {error:?}"),
        }
    }
}
