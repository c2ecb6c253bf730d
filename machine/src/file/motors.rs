//! From the motors' tables to [`Motor`], and what their positions are counted in.

use core::f64::consts::TAU;

use super::axes::{Drive, Joint};
use super::tables::{AxisTable, DcMotorTable, StepperMotorTable};
use crate::actuator::{Actuator, Encoder};
use crate::document::{Diagnostics, Number, Positive, ProblemKind};
use crate::drives::ActuatorMode;
use crate::motor::{DcMotor, Motor, StepperMotor};

/// Rounding of a whole number that was computed from other units.
const WHOLE: f64 = 1e-6;

/// The motor of `drive`, which drives `joint`; `None` where there is not exactly one.
pub(super) fn motor(drive: &Drive, joint: &Joint, diagnostics: &mut Diagnostics) -> Option<Motor> {
    let Drive { table, name, key, .. } = drive;
    let stiff = joint.stiff_inertia / (table.gear.value * table.gear.value);
    match (&table.motor.dc, &table.motor.stepper) {
        (Some(data), None) => Some(Motor::Dc(dc(data, stiff, diagnostics))),
        (None, Some(data)) => Some(Motor::Stepper(stepper(data, stiff, diagnostics))),
        (None, None) => {
            diagnostics.refuse(
                ProblemKind::MissingKey,
                table.motor.span,
                format!("axis `{name}` has no motor"),
                Some(format!("add [axis.{key}.motor.dc] or [axis.{key}.motor.stepper]")),
            );
            None
        }
        (Some(dc), Some(stepper)) => {
            diagnostics.contradict(
                dc.span.max(stepper.span),
                format!("axis `{name}` has two motors"),
                "keep either the table `dc` or the table `stepper`",
            );
            None
        }
    }
}

/// The DC motor of `data`, with which `stiff_inertia` [kg·m² at its shaft] turns stiffly; what contradicts
/// itself in it is noted.
pub fn dc(data: &DcMotorTable, stiff_inertia: f64, diagnostics: &mut Diagnostics) -> DcMotor {
    if let Some(continuous) = data.continuous_current
        && continuous.value > data.current.value
    {
        diagnostics.contradict(
            continuous.span,
            format!(
                "the continuous current of {:.3} A is above the power stage's {:.3} A",
                continuous.value, data.current.value
            ),
            "lower `continuous_current`, or raise `current`",
        );
    }
    if data.nominal_torque.is_some() != data.nominal_speed.is_some() {
        diagnostics.contradict(
            data.span,
            "`nominal_torque` and `nominal_speed` only say something together".to_owned(),
            "give both or none",
        );
    }
    DcMotor {
        resistance: data.resistance.value,
        inductance: data.inductance.value,
        torque_constant: data.torque_constant.value,
        rotor_inertia: data.rotor_inertia.value + stiff_inertia,
        voltage: data.voltage.value,
        current: data.current.value,
        continuous_current: data.continuous_current.map(|current| current.value),
    }
}

/// The stepper of `data`, with which `stiff_inertia` [kg·m² at its shaft] turns stiffly; what contradicts
/// itself in it is noted.
pub fn stepper(
    data: &StepperMotorTable,
    stiff_inertia: f64,
    diagnostics: &mut Diagnostics,
) -> StepperMotor {
    let mut whole = |number: &Number<Positive>, of: f64, due: &str| {
        let rounded = (number.value / of).round();
        if rounded < 1.0 || (number.value / of - rounded).abs() > WHOLE {
            diagnostics.refuse(
                ProblemKind::OutOfRange,
                number.span,
                format!("{} is not possible here: it must be a multiple of {of}", number.value),
                Some(due.to_owned()),
            );
        }
        rounded * of
    };
    let full_steps =
        whole(&data.full_steps, 4.0, "a two-phase motor has 4 full steps a period, such as 200");
    let microsteps = whole(&data.microsteps, 1.0, "a driver divides into whole parts, such as 16");
    let driven = data.voltage.value / data.resistance.value;
    if driven < data.current.value {
        diagnostics.contradict(
            data.current.span,
            format!(
                "{:.1} V across {:.3} Ω drive at most {driven:.2} A, not {:.2} A",
                data.voltage.value, data.resistance.value, data.current.value
            ),
            "raise `voltage`, or give `current` and `holding_torque` as the supply can drive them",
        );
    }
    StepperMotor {
        full_steps,
        microsteps,
        holding_torque: data.holding_torque.value,
        detent_torque: data.detent_torque.value,
        rotor_inertia: data.rotor_inertia.value + stiff_inertia,
        current: data.current.value,
        resistance: data.resistance.value,
        inductance: data.inductance.value,
        voltage: data.voltage.value,
        damping: data.damping.value,
        pulse_rate: data.pulse_rate.value / TAU,
    }
}

/// What the position of `motor` is counted in; `None` where that is not said.
pub(super) fn counts(
    table: &AxisTable,
    motor: &Motor,
    diagnostics: &mut Diagnostics,
) -> Option<Encoder> {
    if let Motor::Stepper(motor) = motor {
        let extra = [
            table.encoder.as_ref().map(|encoder| (encoder.span, "encoder")),
            table.loops.as_ref().map(|loops| (loops.span, "loops")),
        ];
        for (span, key) in extra.into_iter().flatten() {
            diagnostics.contradict(
                span,
                format!("an axis with a stepper has no `{key}`"),
                "remove the table: a stepper counts its pulses, and no loop is closed",
            );
        }
        return Some(Encoder { counts: motor.pulses_per_turn() });
    }
    let Some(encoder) = &table.encoder else {
        let axis = diagnostics.text(table.span).to_owned();
        diagnostics.refuse(
            ProblemKind::MissingKey,
            table.span,
            format!("`encoder` is missing in the table `{axis}`"),
            Some(format!("add the table `encoder` to the table `{axis}`")),
        );
        return None;
    };
    let resolution = encoder.resolution;
    let counts = (resolution.value * TAU).round();
    if counts < 1.0 || (resolution.value * TAU - counts).abs() > WHOLE * counts {
        diagnostics.refuse(
            ProblemKind::OutOfRange,
            resolution.span,
            format!("{} counts per revolution are no whole number", resolution.value * TAU),
            Some("an encoder has a whole number of counts, such as \"4096 counts/rev\"".to_owned()),
        );
    }
    Some(Encoder { counts })
}

/// Which target the drive of `motor` follows; notes one that the motor cannot follow.
pub(super) fn mode(
    table: &AxisTable,
    motor: &Motor,
    diagnostics: &mut Diagnostics,
) -> ActuatorMode {
    let usual = match motor {
        Motor::Dc(_) => ActuatorMode::Voltage,
        Motor::Stepper(_) => ActuatorMode::Position,
    };
    let Some(mode) = table.mode else { return usual };
    if usual == ActuatorMode::Position && mode.value != usual {
        diagnostics.contradict(
            mode.span,
            format!("a stepper does not follow a {}", mode.value.name()),
            "leave `mode` out: a stepper follows a position, by its pulses",
        );
    }
    mode.value
}

/// Refuses axes whose motors are not all of one kind: one command drives them all, by voltage or by
/// position.
pub(super) fn of_one_kind(actuators: &[(Drive, Actuator)], diagnostics: &mut Diagnostics) {
    let Some(((_, first), others)) = actuators.split_first() else { return };
    for (drive, other) in others {
        if other.motor.dc().is_some() != first.motor.dc().is_some() {
            diagnostics.contradict(
                drive.table.motor.span,
                format!(
                    "axes `{}` and `{}` have motors of different kinds",
                    first.name, other.name
                ),
                "give all axes DC motors, or all of them steppers",
            );
        }
    }
}
