//! Error of a circle drawn in chords (source 003 eq. 2.6).

use core::f64::consts::PI;

use messages::math;
use monitor::report::chart::{Chart, Curve, colour};

use super::{Figure, FigureError, Figures, Name, Table};

/// The source's largest error by the radius.
const ALLOWED: f64 = 0.02;

/// Chords of a circle: from a triangle on.
const CHORDS: core::ops::RangeInclusive<u32> = 3..=128;

/// The largest distance of `chords` chords of a circle from it, by its radius: 1 − cos(β/2).
pub(super) fn error(chords: u32) -> f64 {
    // 2·sin²(β/4), which keeps its digits.
    let sine = math::sin(PI / f64::from(chords) / 2.0);
    2.0 * sine * sine
}

pub(super) fn add(figures: &mut Figures) -> Result<(), FigureError> {
    let mut table = Table::new("chords", ["chords", "angle", "error", "within"]);
    let mut line = Vec::new();
    for chords in CHORDS {
        let within = error(chords) <= ALLOWED;
        let angle = 2.0 * PI / f64::from(chords);
        table.numbers([f64::from(chords), angle, error(chords), f64::from(u8::from(within))]);
        // The first few are so far off that the rest could not be told apart.
        if (8..=64).contains(&chords) {
            line.push((f64::from(chords), 100.0 * error(chords)));
        }
    }
    let allowed = vec![(8.0, 100.0 * ALLOWED), (64.0, 100.0 * ALLOWED)];
    let dots = line.iter().map(|point| vec![*point]);
    let lines = [line.clone()].into_iter().chain(dots).collect();
    let axes = ["chords of a circle [1]", "error by the radius [%]"];
    let chart = Chart {
        title: "chords",
        across: axes[0],
        up: axes[1],
        height: 380,
        at_least: Some((0.0, 0.0)),
        curves: vec![
            Curve { name: "error".to_owned(), colour: colour(0), lines },
            Curve { name: "2 %".to_owned(), colour: colour(1), lines: vec![allowed] },
        ],
    };
    figures.figures.push(Figure {
        name: Name::Chords,
        source: "2-6".to_owned(),
        title: "Error of a circle drawn in chords".to_owned(),
        caption: "1 − cos(β/2) of the chord's angle β: 2 % from 16 chords on, β ≤ 22.96°. The source prints \
                  5.73°, which is 0.1 rad and 0.125 %."
            .to_owned(),
        axes: axes.map(str::to_owned),
        svg: chart.draw()?,
        table,
        more: Vec::new(),
    });
    Ok(())
}
