//! Equations that the sources print wrongly: as printed and as corrected, against a route that uses
//! neither. `docs/errata.md` lists them all.

#![allow(clippy::unwrap_used)]

mod five_bar;
mod listed;
#[path = "../support/loads.rs"]
mod loads;
mod mcm;
mod polar;
mod prrrp;
mod thesis;
mod tri_planar;
mod twin_actuator;

/// `right` is what the independent route gives, and `printed` is not.
#[track_caller]
fn only_corrected(what: &str, truth: f64, right: f64, printed: f64, tolerance: f64) {
    let scale = truth.abs().max(1e-3);
    assert!((right - truth).abs() <= tolerance * scale, "{what}: {right} against {truth}");
    // Far beyond what the tolerance could blur; what is not a number is no answer either.
    let off = (printed - truth).abs();
    assert!(off.is_nan() || off > 100.0 * tolerance * scale, "{what}: {printed} is {truth} too");
}

/// Derivative at 0 by a central difference of fourth order.
fn slope(function: impl Fn(f64) -> f64) -> f64 {
    let step = 1e-4;
    let pair = |times: f64| function(times * step) - function(-times * step);
    (8.0 * pair(1.0) - pair(2.0)) / (12.0 * step)
}
