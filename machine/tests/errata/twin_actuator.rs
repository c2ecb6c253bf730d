//! Source 004.

use core::f64::consts::PI;

use machine::pulses::{PulseScale, nearest};
use messages::math;
use nalgebra::Vector2;

use super::only_corrected;

fn unit(angle: f64) -> Vector2<f64> {
    let (s, c) = math::sin_cos(angle);
    Vector2::new(c, s)
}

/// Two actuators with the tool `offset` from their joint, at the signed angle from actuator a.
const OFFSET: f64 = 0.07;

fn tool(length: f64, angle: f64, offset_angle: f64) -> Vector2<f64> {
    unit(angle) * length + unit(angle + PI - offset_angle) * OFFSET
}

/// Eq. 4.11, 4.12, 4.31 and 4.32: pulses of one turn of the screw, and back.
#[test]
fn pulses_count_microsteps_and_come_back() {
    let (steps, microsteps, gear, lead) = (200.0, 16.0, 3.0, 4e-3);
    let scale = PulseScale::of_screw(steps, microsteps, gear, lead, 0.0);
    // One lead is one turn of the screw, three of the motor.
    let pulses = (0..3).map(|_| 200 * 16).sum::<i32>();
    let printed = steps * gear / lead * lead;
    only_corrected("4.11", f64::from(pulses), scale.course(lead), printed, 1e-12);
    let back = scale.length(i64::from(pulses));
    // Without brackets the quotient of eq. 4.31 is multiplied by R and n again.
    only_corrected("4.31", lead, back, f64::from(pulses) / 200.0 * gear / lead, 1e-12);
}

/// Eq. 4.17 and the sums after 4.18: the way must end at the whole length.
#[test]
fn braking_starts_behind_both_stretches_before() {
    let (total, speed, acceleration) = (0.25, 0.15, 1.5);
    let first_time = speed / acceleration;
    let first = 0.5 * speed * first_time;
    let second = total - 2.0 * first;
    let braked = speed * first_time - 0.5 * acceleration * first_time * first_time;
    only_corrected("4.17", total, first + second + braked, second + braked, 1e-12);
    only_corrected("4.18", total, first + second + first, 3.0 * second, 1e-12);
    // A path shorter than both ramps: printed, its middle would take a negative time.
    let short = 0.01;
    assert!((short - 2.0 * first) / speed < 0.0);
    let peak = (short * acceleration).sqrt();
    only_corrected("triangular", short, peak * peak / acceleration, 2.0 * first, 1e-12);
}

/// Eq. 4.22, 4.25 and 4.38: a direction back from the vector that it made.
#[test]
fn a_direction_needs_both_coordinates() {
    let mut lost = [0, 0, 0];
    for step in 0..12 {
        let angle = 0.2 + f64::from(step) * PI / 6.0;
        let way = unit(angle) * 0.3;
        let off = |found: f64| (math::nearest_turn(found, angle) - angle).abs();
        assert!(off(math::atan2(way.y, way.x)) < 1e-14);
        lost[0] += i32::from(off(math::atan(way.y / way.x)) > 1e-9);
        // Eq. 4.25 has the quotient upside down besides.
        lost[1] += i32::from(off(math::atan(way.x / way.y)) > 1e-9);
        // Eq. 4.38 sees the centre from the start; as a quotient that is no difference.
        lost[2] += i32::from(off(math::atan2(-way.y, -way.x)) > 1e-9);
    }
    assert_eq!(lost, [6, 12, 12]);
}

/// Eq. 4.24 and 4.27: actuator a back from where it put the tool.
#[test]
fn the_root_finds_what_the_law_of_sines_loses() {
    let length = 0.3;
    let root = |away: f64, offset_angle: f64| {
        let (s, c) = math::sin_cos(offset_angle);
        OFFSET * c + (away * away - OFFSET * OFFSET * s * s).sqrt()
    };
    let sines = |away: f64, offset_angle: f64| {
        let inner = math::asin(OFFSET * math::sin(offset_angle) / away);
        away * math::sin(PI - offset_angle - inner) / math::sin(offset_angle)
    };
    // An offset angle of 0 divides by nothing, one of half a turn by rounding.
    for offset_angle in [0.0, PI] {
        let away = tool(length, 0.4, offset_angle).norm();
        only_corrected("4.27", length, root(away, offset_angle), sines(away, offset_angle), 1e-13);
    }
    // Elsewhere both agree while the angle at the base is acute, which the arc sine takes for
    // granted; the joint nearer than the offset's foot makes it obtuse.
    let away = tool(length, 0.4, 0.7).norm();
    assert!((sines(away, 0.7) - length).abs() < 1e-14 && (root(away, 0.7) - length).abs() < 1e-14);
    let near = 0.02;
    let away = tool(near, 0.4, 0.7).norm();
    let (s, c) = math::sin_cos(0.7);
    let other = OFFSET * c - (away * away - OFFSET * OFFSET * s * s).sqrt();
    only_corrected("4.24", near, other, sines(away, 0.7), 1e-12);
}

/// Eq. 4.26 against 4.34 and 4.35: the forward equations must undo the inverse ones.
#[test]
fn forward_undoes_inverse_with_one_sign_of_the_offset() {
    let (offset_angle, place) = (0.7, Vector2::new(0.2, 0.31));
    let away: f64 = place.norm();
    let (s, c) = math::sin_cos(offset_angle);
    let length = OFFSET * c + (away * away - OFFSET * OFFSET * s * s).sqrt();
    // Eq. 4.26, with the angle of eq. 4.24.
    let angle = math::atan2(place.y, place.x) - math::asin(OFFSET * s / away);
    let joint = unit(angle) * length;
    let right = joint + unit(PI + angle - offset_angle) * OFFSET;
    let printed = joint + unit(PI + angle + offset_angle) * OFFSET;
    only_corrected("4.34", place.x, right.x, printed.x, 1e-12);
    // Eq. 4.35 has the cosine besides.
    let printed = joint.y + OFFSET * math::cos(PI + angle - offset_angle);
    only_corrected("4.35", place.y, right.y, printed, 1e-12);
}

/// Eq. 4.29 and 4.33: the second actuator's length, and the angle back from both lengths.
#[test]
fn the_base_line_goes_from_the_first_to_the_second() {
    let (base, length, angle) = (0.56, 0.4, 0.9);
    let joint = unit(angle) * length;
    let truth = (joint - Vector2::new(base, 0.0)).norm();
    let other = |q: f64| math::hypot(q - length * math::cos(angle), length * math::sin(angle));
    only_corrected("4.29", truth, other(base), other(-base), 1e-12);
    let stroke = 0.1;
    let (fixed_a, fixed_b) = (length - stroke, truth - stroke);
    let back = |fixed: f64| {
        let b = stroke + fixed;
        math::acos((base * base + length * length - b * b) / (2.0 * base * length))
    };
    only_corrected("4.33", angle, back(fixed_b), back(fixed_a), 1e-12);
}

/// Eq. 4.30: 12.2 pulses in a cycle, of which the printed rule sends one.
#[test]
fn one_pulse_a_cycle_is_left_behind() {
    let (scale, lead) = (PulseScale::of_screw(200.0, 16.0, 1.0, 5.25e-3, 0.0), 5.25e-3);
    let (mut printed, mut right) = (0_i64, 0_i64);
    let cycles = 1000;
    for cycle in 1..=cycles {
        let wanted = scale.course(0.02 * 1e-3 * f64::from(cycle));
        let off = wanted - printed as f64;
        if off.abs() > 0.5 {
            printed += off.signum() as i64;
        }
        right += nearest(wanted - right as f64);
        assert!((wanted - right as f64).abs() <= 0.5);
    }
    let way = 0.02;
    assert!((scale.length(right) - way).abs() <= lead / 3200.0 / 2.0 + 1e-12);
    assert!(way - scale.length(printed) > 0.9 * way, "{printed}");
}
