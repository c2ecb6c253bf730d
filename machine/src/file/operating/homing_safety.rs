//! The tables of homing and safety, and what they become.

use super::Known;
use crate::axis::Axis;
use crate::document::{
    Diagnostics, Fraction, NonNegative, Number, Positive, ProblemKind, Quantity, Spanned,
};
use crate::file::axes::Joint;
use crate::file::drive_homing;
use crate::operating::{
    DoorAction, Homing, HomingMethod, Input, InputFunction, Safety, Side, StopCategory,
};
use crate::quantity as unit;
use crate::table;

/// Share of an axis' largest speed at which it looks for its reference where the file does not say.
const SEARCH_SHARE: f64 = 0.1;

/// The same of that speed, at which the reference is taken.
const LATCH_SHARE: f64 = 0.1;

/// Share of a motor's largest current that counts as a stop where the file does not say.
const STOP_SHARE: f64 = 0.5;

/// In which an axis that was found to stand against its stop is brought to rest, pressing on meanwhile [s].
const STOP_TIME: f64 = 0.1;

/// The most places in the order of homing.
const MOST_ORDERS: f64 = 100.0;

table! {
    /// How an axis finds its reference. Without this table it knows its place from the start.
    pub struct HomingTable {
        /// By the edge of its `switch`, by the first `index` pulse after that, by a `hard_stop`, by its
        /// `absolute` encoder, or by its `drive`, which looks for it by itself.
        pub method: Spanned<HomingMethod> = "switch",
        /// Towards which end it looks.
        pub direction: Spanned<Side> = "lower",
        /// Speed of the search; when left out, a tenth of the axis' largest speed.
        pub speed: Option<Quantity<unit::TravelSpeed, Positive>>,
        /// Speed at which the reference is taken; when left out, a tenth of the `speed`.
        pub latch_speed: Option<Quantity<unit::TravelSpeed, Positive>>,
        /// Where the axis is at its reference; when left out, the soft limit on that side. Of an absolute
        /// encoder, where the axis is when it reads 0; when left out, 0.
        pub position: Option<Quantity<unit::Travel>>,
        /// Axes with a lower number go first, those with the same number together.
        pub order: Number<NonNegative> = 0.0,
        /// Motor current at which a `hard_stop` is found; when left out, half of the largest one.
        pub current: Option<Quantity<unit::Current, Positive>>,
        /// The number of the method, by CiA 402, of a `drive` that looks for it by itself.
        pub drive_method: Option<Number>,
        /// Acceleration of that `drive`; when left out, it takes 0.1 s to the `speed`.
        pub acceleration: Option<Quantity<unit::TravelAcceleration, Positive>>,
    }
}

table! {
    /// What is done for safety. None of it is a safety function: those are wired.
    pub struct SafetyTable {
        /// Stop category of the emergency stop: 0, the power goes at once; 1, after the axes have come to rest;
        /// 2, it stays.
        pub estop: Number<NonNegative> = 1.0,
        /// What opening the door does to a job: `hold` it, or `stop` it with a fault.
        pub door: Spanned<DoorAction> = "hold",
        /// The most power of a test pulse.
        pub test_power: Fraction<Positive> = 0.1,
        /// The longest test pulse.
        pub test_time: Quantity<unit::Duration, Positive> = "100 ms",
        /// The most power with which the frame around a job is shown.
        pub frame_power: Fraction<Positive> = 0.05,
        /// How long a jog goes on without another word from whoever asked for it.
        pub dead_man: Quantity<unit::Duration, Positive> = "200 ms",
    }
}

crate::keyword! { Side, "an end of an axis", "lower" => Self::Lower, "upper" => Self::Upper }

crate::keyword! {
    HomingMethod, "a method of homing",
    "switch" => Self::Switch,
    "index" => Self::Index,
    "hard_stop" => Self::HardStop,
    "absolute" => Self::Absolute,
    "drive" => Self::Drive,
}

crate::keyword! { DoorAction, "what a door does", "hold" => Self::Hold, "stop" => Self::Stop }

pub(super) fn safety(table: &SafetyTable, diagnostics: &mut Diagnostics) -> Safety {
    let estop = match table.estop.value {
        0.0 => StopCategory::Zero,
        1.0 => StopCategory::One,
        2.0 => StopCategory::Two,
        other => {
            let message = format!("there is no stop category {other}");
            diagnostics.contradict(table.estop.span, message, "write 0, 1 or 2");
            StopCategory::One
        }
    };
    Safety {
        estop,
        door: table.door.value,
        test_power: table.test_power.value,
        test_time: table.test_time.value,
        frame_power: table.frame_power.value,
        dead_man: table.dead_man.value,
    }
}

impl Known<'_> {
    pub(super) fn homing(
        &self,
        table: &HomingTable,
        axis: &Axis,
        joint: &Joint,
        diagnostics: &mut Diagnostics,
    ) -> Option<Homing> {
        let (unit, limits, side) = (joint.unit, axis.limits, table.direction.value);
        let mut fits = true;
        let mut speed = |given: &Option<Quantity<unit::TravelSpeed, Positive>>, otherwise: f64| {
            let Some(given) = given else { return otherwise };
            fits &= unit.expect(given, &axis.name, diagnostics);
            if fits && given.value > limits.velocity {
                diagnostics.contradict(
                    given.span,
                    format!(
                        "axis `{}` reaches {} {name}/s, not {} {name}/s",
                        axis.name,
                        limits.velocity,
                        given.value,
                        name = unit.name()
                    ),
                    "lower the speed",
                );
            }
            given.value
        };
        let is_hard_stop = table.method.value == HomingMethod::HardStop;
        let stoppable = limits.following_error / STOP_TIME;
        let mut otherwise = SEARCH_SHARE * limits.velocity;
        if is_hard_stop {
            otherwise = otherwise.min(stoppable);
        }
        let search = speed(&table.speed, otherwise);
        let latch_speed = speed(&table.latch_speed, LATCH_SHARE * search);
        let method = table.method.value;
        if let Some(given) =
            table.speed.as_ref().filter(|it| fits && is_hard_stop && it.value > stoppable)
        {
            let message = format!(
                "axis `{}` would press on against its stop for more than its following error",
                axis.name
            );
            let help =
                format!("{stoppable} {}/s at most: the following error in 0.1 s", unit.name());
            diagnostics.contradict(given.span, message, &help);
        }
        let end = match side {
            Side::Lower => limits.position[0],
            Side::Upper => limits.position[1],
        };
        let otherwise = if method == HomingMethod::Absolute { 0.0 } else { end };
        let position = table.position.as_ref().map_or(otherwise, |position| {
            fits &= unit.expect(position, &axis.name, diagnostics);
            position.value
        });
        if fits && !position.is_finite() {
            diagnostics.refuse(
                ProblemKind::MissingKey,
                table.span,
                format!("axis `{}` has no end, and its reference no place", axis.name),
                Some("add `position`".to_owned()),
            );
        }
        let order = table.order.value;
        if order.fract() != 0.0 || order > MOST_ORDERS {
            let help = format!("write a whole number up to {MOST_ORDERS}");
            diagnostics.contradict(
                table.order.span,
                format!("{order} is no place in an order"),
                &help,
            );
        }
        let largest = axis.driven_by(self.actuators).iter().filter_map(|it| it.motor.dc());
        let largest = largest.map(|motor| motor.current).fold(f64::INFINITY, f64::min);
        if method == HomingMethod::HardStop && !largest.is_finite() {
            diagnostics.contradict(
                table.method.span,
                format!("axis `{}` has a stepper, whose current nobody measures", axis.name),
                "home it by a switch",
            );
        }
        if let Some(current) = table.current.as_ref() {
            if method != HomingMethod::HardStop {
                let message = "`current` has no effect: the method is no hard stop".to_owned();
                diagnostics.contradict(current.span, message, "remove `current`");
            } else if current.value > largest {
                let message = format!("the power stage gives {largest} A");
                diagnostics.contradict(current.span, message, "lower the `current`");
            }
        }
        let own = axis.driven_by(self.actuators);
        let drive = drive_homing::drive_homing(table, axis, own, (unit, search), diagnostics);
        fits.then_some(Homing {
            method,
            drive: drive.unwrap_or_default(),
            side,
            speed: search,
            latch_speed,
            position,
            order: order as u32,
            current: table.current.as_ref().map_or(STOP_SHARE * largest, |current| current.value),
        })
    }

    /// Refuses an axis that looks for a switch or an index that no input tells of.
    pub(super) fn refuse_blind(
        &self,
        index: usize,
        homing: &Homing,
        inputs: &[Input],
        table: &HomingTable,
        diagnostics: &mut Diagnostics,
    ) {
        let axis = &self.axes[index];
        let switched = |wanted: usize| {
            inputs.iter().any(|input| match input.function {
                InputFunction::Home { axis, actuator } => {
                    axis == index && actuator.is_none_or(|own| own == wanted)
                }
                _ => false,
            })
        };
        let indexed = |wanted: usize| {
            inputs.iter().any(|input| match input.function {
                InputFunction::Index { axis, actuator } => {
                    axis == index && actuator.is_none_or(|own| own == wanted)
                }
                _ => false,
            })
        };
        let mut own = axis.actuators.clone();
        let (needs_switch, needs_index) = match homing.method {
            HomingMethod::Switch => (true, false),
            HomingMethod::Index => (true, true),
            HomingMethod::HardStop | HomingMethod::Absolute | HomingMethod::Drive => (false, false),
        };
        let lacks = if needs_switch && !own.clone().all(switched) {
            "home"
        } else if needs_index && !own.all(indexed) {
            "index"
        } else {
            return;
        };
        diagnostics.contradict(
            table.method.span,
            format!("axis `{}` has no input with the function `{lacks}`", axis.name),
            &format!("add one, such as [inputs.{}_{lacks}]", axis.name),
        );
    }
}
