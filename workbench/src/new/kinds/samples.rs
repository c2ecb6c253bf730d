//! The sample jobs.

use crate::new::SAMPLE_TOLERANCE;
use crate::new::text::{line, mm, quantity};

/// The part of the smaller side that a letter is high.
const SHARE: f64 = 0.15;

/// Time that a letter's height takes at full speed [s]: larger letters would only take longer.
const HEIGHT_TIME: f64 = 0.08;

/// The lowest letters [m].
const LOWEST: f64 = 1e-3;

/// How the sample is marked.
pub(super) fn marking(speed: &str, more: &str) -> String {
    let tolerance = quantity(SAMPLE_TOLERANCE * 1e6, "um");
    format!("\n[marking]\nspeed = {speed}\n{more}power = \"80 %\"\n")
        + &line("tolerance", &tolerance, "half of the machine file's")
}

/// Height of letters in an area with this smaller side [m], marked at `speed` [m/s].
pub(super) fn letter_height(side: f64, speed: f64) -> f64 {
    (SHARE * side).min((HEIGHT_TIME * speed).max(LOWEST))
}

/// The letters of the thesis, `height` [m].
pub(super) fn letters(height: f64) -> String {
    let text = line("text", "\"NASO\"", "any of N, A, S, O");
    let height = line("height", &mm(height), "");
    format!(
        "# The letters of the thesis around the machine's home.\n\n[letters]\n{text}{height}style = \"curves\"\n"
    )
}

/// Letters in an area of this size [m].
pub(super) fn letters_in(area: [f64; 2], speed: f64) -> String {
    let height = letter_height(area[0].min(area[1]), speed);
    letters(height) + &marking("\"optimum\"", "")
}
