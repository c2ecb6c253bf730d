//! The tables of inputs, outputs, homing and safety, and what they become.

use super::axes::Joint;
use super::drive_homing;
use super::tables::AxisTable;
use crate::actuator::Actuator;
use crate::axis::Axis;
use crate::document::{
    Diagnostics, Fraction, Named, NonNegative, Number, Positive, ProblemKind, Quantity, Span,
    Spanned,
};
use crate::operating::{
    DoorAction, Homing, HomingMethod, Input, InputFunction, MAX_INPUTS, Operating, Output,
    OutputFunction, Safety, Side, SimulatedSwitch, StopCategory,
};
use crate::quantity as unit;
use crate::table;
use messages::ControllerState;

/// Share of an axis' largest speed at which it looks for its reference where the file does not say.
const SEARCH_SHARE: f64 = 0.1;

/// The same of that speed, at which the reference is taken.
const LATCH_SHARE: f64 = 0.1;

/// Share of a motor's largest current that counts as a stop where the file does not say.
const STOP_SHARE: f64 = 0.5;

/// In which an axis that was found to stand against its stop is brought to rest, pressing on meanwhile [s].
const STOP_TIME: f64 = 0.1;

/// How long an extraction goes on after a job where the file does not say [s].
const EXTRACTION_AFTER: f64 = 10.0;

/// The most places in the order of homing.
const MOST_ORDERS: f64 = 100.0;

table! {
    /// A digital input.
    pub struct InputTable {
        /// What it says when it is active: `home`, `index` or `limit` of an axis, `estop` pressed, `door` open,
        /// `interlock` missing, `probe` touching, or `general`.
        pub function: Spanned<InputKind>,
        /// The axis of a `home`, `index` or `limit`, and of a simulated `probe`.
        pub axis: Option<Spanned<String>>,
        /// The actuator of a `home` or `index`, on an axis with several.
        pub actuator: Option<Spanned<String>>,
        /// Which end of the axis a `limit` is at; of the others, towards which end the simulated switch is
        /// active, the lower one when left out.
        pub side: Option<Spanned<Side>>,
        /// Which level is active.
        pub active: Spanned<Level> = "high",
        /// Where the simulated switch is on its axis: beyond it, towards its side, it is active.
        pub at: Option<Quantity<unit::Travel>>,
    }
}

table! {
    /// A digital output.
    pub struct OutputTable {
        /// What it switches: the `air` assist, the `extraction`, the `brake`s, a `signal` to people, or `general`.
        pub function: Spanned<OutputKind>,
        /// The states of the machine in which a `signal` is on.
        pub states: Option<Vec<Spanned<SignalState>>>,
        /// How long an `extraction` goes on after a job; 10 s when left out.
        pub after: Option<Quantity<unit::Duration, NonNegative>>,
        /// Which level is on.
        pub active: Spanned<Level> = "high",
    }
}

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

/// The function of an input as the file says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputKind {
    /// A reference switch.
    Home,
    /// An index pulse.
    Index,
    /// A hard limit switch.
    Limit,
    /// The emergency stop.
    EmergencyStop,
    /// The door.
    Door,
    /// An interlock.
    Interlock,
    /// A probe.
    Probe,
    /// Anything else.
    General,
}

/// The function of an output as the file says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputKind {
    /// The air assist.
    Air,
    /// The extraction.
    Extraction,
    /// The brakes.
    Brake,
    /// A lamp, a horn, a relay.
    Signal,
    /// Anything else.
    General,
}

/// A state in which a signal is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SignalState(ControllerState);

/// A level of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// Voltage.
    High,
    /// None.
    Low,
}

crate::keyword! {
    InputKind, "a function of an input",
    "home" => Self::Home,
    "index" => Self::Index,
    "limit" => Self::Limit,
    "estop" => Self::EmergencyStop,
    "door" => Self::Door,
    "interlock" => Self::Interlock,
    "probe" => Self::Probe,
    "general" => Self::General,
}

crate::keyword! {
    OutputKind, "a function of an output",
    "air" => Self::Air,
    "extraction" => Self::Extraction,
    "brake" => Self::Brake,
    "signal" => Self::Signal,
    "general" => Self::General,
}

crate::keyword! {
    SignalState, "a state of the machine",
    "disabled" => Self(ControllerState::Disabled),
    "enabling" => Self(ControllerState::Enabling),
    "idle" => Self(ControllerState::Idle),
    "running" => Self(ControllerState::Running),
    "holding" => Self(ControllerState::Holding),
    "stopping" => Self(ControllerState::Stopping),
    "faulted" => Self(ControllerState::Faulted),
    "homing" => Self(ControllerState::Homing),
    "jogging" => Self(ControllerState::Jogging),
    "probing" => Self(ControllerState::Probing),
    "pulsing" => Self(ControllerState::Pulsing),
    "halted" => Self(ControllerState::Halted),
}

crate::keyword! { Level, "a level", "high" => Self::High, "low" => Self::Low }

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

/// The parts of the machine file that say how it is operated.
pub(super) struct Tables<'a> {
    pub(super) inputs: Option<&'a Named<InputTable>>,
    pub(super) outputs: Option<&'a Named<OutputTable>>,
    pub(super) safety: &'a SafetyTable,
    /// In the order of the axes.
    pub(super) axes: &'a [&'a AxisTable],
    pub(super) joints: &'a [Joint],
}

/// How the machine of `tables` with these axes and actuators is operated.
pub(super) fn operating(
    tables: &Tables<'_>,
    axes: &[Axis],
    actuators: &[Actuator],
    diagnostics: &mut Diagnostics,
) -> Operating {
    let known = Known { axes, actuators, joints: tables.joints };
    let mut inputs = Vec::new();
    for (name, table) in tables.inputs.iter().flat_map(|named| &named.entries) {
        if let Some(input) = known.input(name, table, diagnostics) {
            inputs.push(input);
        }
    }
    let outputs = tables.outputs.iter().flat_map(|named| &named.entries);
    let outputs: Vec<Output> =
        outputs.filter_map(|(name, table)| output(name, table, diagnostics)).collect();
    let counts = [
        (tables.inputs.map(|named| named.span), inputs.len(), "inputs"),
        (tables.outputs.map(|named| named.span), outputs.len(), "outputs"),
    ];
    for (span, count, what) in counts {
        if let Some(span) = span.filter(|_| count > MAX_INPUTS) {
            let help = format!("a machine can have {MAX_INPUTS} of them");
            diagnostics.contradict(span, format!("the machine has {count} {what}"), &help);
        }
    }
    let each = axes.iter().zip(tables.axes).zip(tables.joints).enumerate();
    let homing = each.map(|(index, ((axis, table), joint))| {
        let table = table.homing.as_ref()?;
        let homing = known.homing(table, axis, joint, diagnostics)?;
        known.refuse_blind(index, &homing, &inputs, table, diagnostics);
        Some(homing)
    });
    Operating {
        homing: homing.collect(),
        inputs,
        outputs,
        devices: Vec::new(),
        safety: safety(tables.safety, diagnostics),
    }
}

/// The output of this table.
fn output(
    name: &Spanned<String>,
    table: &OutputTable,
    diagnostics: &mut Diagnostics,
) -> Option<Output> {
    let kind = table.function.value;
    if let Some(after) = table.after.as_ref().filter(|_| kind != OutputKind::Extraction) {
        let message = "`after` has no effect: this output is no `extraction`".to_owned();
        diagnostics.contradict(after.span, message, "remove `after`");
    }
    let states = table.states.as_deref().unwrap_or_default();
    if let Some(state) = states.first().filter(|_| kind != OutputKind::Signal) {
        let message = "`states` has no effect: this output is no `signal`".to_owned();
        diagnostics.contradict(state.span, message, "remove `states`");
    }
    let function = match kind {
        OutputKind::Air => OutputFunction::Air,
        OutputKind::Brake => OutputFunction::Brake,
        OutputKind::General => OutputFunction::General,
        OutputKind::Extraction => {
            let after = table.after.as_ref().map_or(EXTRACTION_AFTER, |after| after.value);
            OutputFunction::Extraction { after }
        }
        OutputKind::Signal if states.is_empty() => {
            diagnostics.refuse(
                ProblemKind::MissingKey,
                name.span,
                format!("`states` is missing in the output `{}`", name.value),
                Some("add `states = [\"running\"]`".to_owned()),
            );
            return None;
        }
        OutputKind::Signal => {
            let states = states.iter().fold(0, |bits, state| bits | 1 << state.value.0 as u32);
            OutputFunction::Signal { states }
        }
    };
    let is_active_low = table.active.value == Level::Low;
    Some(Output { name: name.value.clone(), function, is_active_low })
}

fn safety(table: &SafetyTable, diagnostics: &mut Diagnostics) -> Safety {
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

/// What inputs and homing refer to.
struct Known<'a> {
    axes: &'a [Axis],
    actuators: &'a [Actuator],
    joints: &'a [Joint],
}

impl Known<'_> {
    fn input(
        &self,
        name: &Spanned<String>,
        table: &InputTable,
        diagnostics: &mut Diagnostics,
    ) -> Option<Input> {
        use InputKind as Kind;
        let kind = table.function.value;
        let of_axis = matches!(kind, Kind::Home | Kind::Index | Kind::Limit);
        self.refuse_useless(table, of_axis, diagnostics);
        let axis = if of_axis || kind == Kind::Probe && table.axis.is_some() {
            Some(self.axis(name, table.axis.as_ref(), diagnostics)?)
        } else {
            None
        };
        let side = table.side.as_ref().map_or(Side::Lower, |side| side.value);
        let simulated = match (&table.at, axis) {
            (Some(at), Some(axis)) => {
                let fits = self.joints[axis].unit.expect(at, &self.axes[axis].name, diagnostics);
                fits.then_some(SimulatedSwitch { axis, side, at: at.value })
            }
            _ => None,
        };
        let function = match (kind, axis) {
            (Kind::Home, Some(axis)) => {
                InputFunction::Home { axis, actuator: self.actuator(axis, table, diagnostics)? }
            }
            (Kind::Index, Some(axis)) => {
                InputFunction::Index { axis, actuator: self.actuator(axis, table, diagnostics)? }
            }
            (Kind::Limit, Some(axis)) => {
                let Some(side) = &table.side else {
                    missing(name, "side", "\"lower\"", diagnostics);
                    return None;
                };
                InputFunction::Limit { axis, side: side.value }
            }
            (Kind::EmergencyStop, _) => InputFunction::EmergencyStop,
            (Kind::Door, _) => InputFunction::Door,
            (Kind::Interlock, _) => InputFunction::Interlock,
            (Kind::Probe, _) => InputFunction::Probe,
            _ => InputFunction::General,
        };
        let is_active_low = table.active.value == Level::Low;
        Some(Input { name: name.value.clone(), function, is_active_low, simulated })
    }

    /// Refuses what has no effect on an input of this function.
    fn refuse_useless(&self, table: &InputTable, of_axis: bool, diagnostics: &mut Diagnostics) {
        let mut refuse = |span: Span, key: &str, function: &str| {
            let message = format!("`{key}` has no effect: this input is no {function}");
            diagnostics.contradict(span, message, &format!("remove `{key}`"));
        };
        let kind = table.function.value;
        let at_place = of_axis || kind == InputKind::Probe;
        if let Some(axis) = table.axis.as_ref().filter(|_| !at_place) {
            refuse(axis.span, "axis", "`home`, `index`, `limit` or `probe`");
        }
        if let Some(at) = table.at.as_ref().filter(|_| !at_place) {
            refuse(at.span, "at", "`home`, `index`, `limit` or `probe`");
        }
        if let Some(side) = table.side.as_ref().filter(|_| !at_place) {
            refuse(side.span, "side", "`home`, `index`, `limit` or `probe`");
        }
        let of_actuator = matches!(kind, InputKind::Home | InputKind::Index);
        if let Some(actuator) = table.actuator.as_ref().filter(|_| !of_actuator) {
            refuse(actuator.span, "actuator", "`home` or `index`");
        }
    }

    fn axis(
        &self,
        name: &Spanned<String>,
        axis: Option<&Spanned<String>>,
        diagnostics: &mut Diagnostics,
    ) -> Option<usize> {
        let Some(axis) = axis else {
            missing(name, "axis", "\"x\"", diagnostics);
            return None;
        };
        let found = self.axes.iter().position(|known| known.name == axis.value);
        if found.is_none() {
            let names: Vec<String> =
                self.axes.iter().map(|axis| format!("`{}`", axis.name)).collect();
            diagnostics.contradict(
                axis.span,
                format!("there is no axis `{}`", axis.value),
                &format!("the axes of this machine are {}", names.join(", ")),
            );
        }
        found
    }

    /// The actuator of a switch on `axis`: none where the axis has one only. `None` where it is wrong.
    #[allow(clippy::option_option)]
    fn actuator(
        &self,
        axis: usize,
        table: &InputTable,
        diagnostics: &mut Diagnostics,
    ) -> Option<Option<usize>> {
        let own = self.axes[axis].actuators.clone();
        let Some(named) = &table.actuator else { return Some(None) };
        let full = format!("{}.{}", self.axes[axis].name, named.value);
        let found = own.clone().find(|index| self.actuators[*index].name == full);
        if found.is_none() {
            diagnostics.contradict(
                named.span,
                format!("axis `{}` has no actuator `{}`", self.axes[axis].name, named.value),
                "name one of the axis' actuators, or leave it out on an axis with one only",
            );
            return None;
        }
        Some(found)
    }

    fn homing(
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
    fn refuse_blind(
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

fn missing(name: &Spanned<String>, key: &str, example: &str, diagnostics: &mut Diagnostics) {
    diagnostics.refuse(
        ProblemKind::MissingKey,
        name.span,
        format!("`{key}` is missing in the input `{}`", name.value),
        Some(format!("add `{key} = {example}`")),
    );
}
