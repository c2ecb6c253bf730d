//! What is sound enough to run but should be looked at: warnings for a person, not errors.
//!
//! Foremost motor data that contradict themselves. Source 003's own table 3-3 promises a torque
//! that its supply cannot drive, so the voltage limit line `R·i + k·ω ≤ V` is what counts, and
//! nominal values are never used.

use core::f64::consts::TAU;

use super::axes::Joint;
use super::tables::DcMotorTable;
use crate::axis::Axis;
use crate::document::{self, Diagnostics, Number, Positive, Quantity};
use crate::machine::Warning;
use crate::quantity::Speed;

/// How far a data sheet's nominal point may lie beyond the limit line before there is a warning: the
/// rounding of two-digit data.
const ROUNDING: f64 = 0.02;

/// Warns about the motor of `axis`.
pub(super) fn of_motor(axis: &str, motor: &DcMotorTable, diagnostics: &mut Diagnostics) {
    let voltage = motor.voltage.value;
    let resistance = motor.resistance.value;
    let constant = motor.torque_constant.value;
    if let (Some(torque), Some(speed)) = (motor.nominal_torque, motor.nominal_speed) {
        let current = torque.value / constant;
        let needed = resistance * current + constant * speed.value;
        if needed > voltage * (1.0 + ROUNDING) {
            let available = (voltage - constant * speed.value).max(0.0) / resistance * constant;
            let stall = voltage / resistance * constant;
            diagnostics.remark(
                torque.span,
                format!(
                    "axis `{axis}`: the nominal torque of {:.3} N·m at {:.0} rpm needs {current:.1} \
                     A and {needed:.1} V ({:.1} V even at standstill), the supply gives \
                     {voltage:.0} V: at that speed it drives {available:.3} N·m, at standstill \
                     {stall:.3} N·m",
                    torque.value,
                    speed.value * 60.0 / TAU,
                    resistance * current,
                ),
            );
        }
    }
    let stall_current = voltage / resistance;
    if motor.current.value > stall_current {
        diagnostics.warn(
            motor.current.span,
            format!(
                "axis `{axis}`: {voltage:.1} V across {resistance:.3} Ω drive at most \
                 {stall_current:.2} A, so the current limit of {:.2} A is never reached",
                motor.current.value
            ),
        );
    }
}

/// Warns about path speeds that the motor of `axis` cannot follow in every direction; a limit that the file
/// sets for it is meant.
pub(super) fn of_speeds(
    speeds: [&Quantity<Speed, Positive>; 2],
    joint: &Joint,
    axis: &Axis,
    diagnostics: &mut Diagnostics,
) {
    let limit = axis.limits.velocity;
    for speed in speeds {
        let asked = speed.value * joint.worst_speed;
        if asked > limit {
            let text = format!(
                "axis `{}` reaches {limit:.3} m/s, but a path at {} m/s may ask it for {asked:.3} m/s: \
                 jobs that do are slowed",
                axis.name, speed.value
            );
            diagnostics.warn(speed.span, text);
        }
    }
}

/// Warns about the damping of a spring: a spring that rings cannot be led by inverting it
/// once a millisecond, as a pilot of both machines found.
pub(super) fn of_damping(ratio: &Number<Positive>, diagnostics: &mut Diagnostics) {
    /// Share of critical damping below which the inversion fails.
    const RINGING: f64 = 0.1;
    if ratio.value < RINGING {
        let text = format!(
            "a damping ratio of {} lets the transmission ring: below {RINGING} the feedforward \
             at 1 kHz cannot lead it",
            ratio.value
        );
        diagnostics.warn(ratio.span, text);
    }
}

/// All warnings, in the order in which it was noted.
pub(super) fn warnings(diagnostics: &mut Diagnostics) -> Vec<Warning> {
    let warnings = diagnostics.take_warnings();
    warnings
        .into_iter()
        .map(|document::Warning { span, text, concern }| {
            let (line, column) = diagnostics.position(span).unwrap_or((0, 0));
            let text = match (diagnostics.override_text(span), diagnostics.attachment(span)) {
                (Some(setting), _) => format!("--set {setting}: {text}"),
                (None, Some((file, line))) => format!("{file}:{line}: {text}"),
                (None, None) => text,
            };
            Warning { text, line, column, concern }
        })
        .collect()
}
