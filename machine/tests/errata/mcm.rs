//! Source 002; its eq. 10 and 14 are in `machine/tests/mcm.rs` and `machine/tests/surfaces/main.rs`.

use machine::surface::{Cone, Placement, Projection, Shape, Surface};
use messages::math;

use super::only_corrected;

/// Eq. 5 and 8: the table's angle back from eq. 1 to 3, all round.
#[test]
fn a_quotient_loses_half_of_the_turns() {
    let (x0, tool, tilt, turn) = (0.02, 0.12, 0.6, 0.4);
    let (w, reach) =
        (x0 + tool * math::sin(tilt) * math::sin(turn), tool * math::sin(tilt) * math::cos(turn));
    let mut lost = 0;
    for carriage in [0.3, -0.3] {
        let v = carriage + reach;
        for step in 0..12 {
            let d = -3.0 + 0.5 * f64::from(step);
            let (s, c) = math::sin_cos(d);
            let (x, y) = (w * c - v * s, w * s + v * c);
            let apart = |angle: f64| (math::nearest_turn(angle, d) - d).abs();
            assert!(apart(math::atan2(-x, y) + math::atan2(w, v)) < 1e-14);
            let printed = apart(math::atan(-x / y) + math::atan(w / v));
            // Right, or half a turn off.
            lost += i32::from(printed > 1.0);
            assert!(printed < 1e-13 || (printed - core::f64::consts::PI).abs() < 1e-13);
        }
    }
    assert!((8..=16).contains(&lost), "{lost}");
}

/// Eq. 15 to 18: the generator of a frustum from its two circles alone.
#[test]
fn a_cone_narrows_upwards_by_the_difference_of_its_radii() {
    let (bottom, top, length) = (0.05, 0.035, 0.1);
    let cone = Cone { bottom, top, length, projection: Projection::Arc };
    let truth = math::atan2(bottom - top, length);
    let printed = math::atan((bottom - top) / 2.0 / length);
    only_corrected("15, 16", truth, cone.half_angle(), printed, 1e-12);

    let surface = Surface { shape: Shape::Cone(cone), placement: Placement::HERE };
    for (x, y) in [(0.01, 0.02), (-0.02, 0.07)] {
        let [across, _, up] = surface.point(x, y).unwrap();
        // On the straight line between the circles.
        let radius = bottom + (top - bottom) * (y / length);
        let printed = bottom + 2.0 * y * math::tan(printed);
        only_corrected("17", radius, math::hypot(across, up), printed, 1e-12);
        // Eq. 18 is but a long form of r·cos α, the height over the axis, and not the drop.
        let alpha = x / radius;
        let height = bottom - (bottom - radius * math::cos(alpha));
        let drop = bottom - radius * math::cos(alpha);
        only_corrected("18", up, height, drop, 1e-12);
    }
}
