//! Focus below the flat top of a transparent workpiece.
//!
//! A refracting face makes the beam converge later: for a focus at depth t, the lens goes down by
//! less than t. By how much depends on the ray, so a wide cone has no sharp focus there. It is needed
//! by the machine of source 000; the source does not treat it.

use messages::math;

/// Travel of the lens [m] that brings the focus of rays near the beam's axis to `depth` [m] below
/// the face of a glass with refractive `index`.
pub fn paraxial_travel(depth: f64, index: f64) -> f64 {
    depth / index
}

/// Depth [m] of a point below the face of a glass with refractive `index` that from straight above
/// seems to be `apparent` deep [m].
pub fn true_depth(apparent: f64, index: f64) -> f64 {
    apparent * index
}

/// The lens's travel as [`paraxial_travel`] for the rays of `half_angle` [rad, 0 to π/2] in air: `t·tan u′/tan u`, with
/// `sin u′ = sin u/n`. It becomes the paraxial travel as the angle goes to 0.
pub fn marginal_travel(depth: f64, index: f64, half_angle: f64) -> f64 {
    // tan u′/tan u = cos u/(n·cos u′), which has no 0/0.
    let (sine, cosine) = math::sin_cos(half_angle);
    let inside = sine / index;
    depth * cosine / (index * (1.0 - inside * inside).sqrt())
}
