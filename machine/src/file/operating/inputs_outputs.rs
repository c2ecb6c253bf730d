//! The tables of inputs and outputs, and what they become.

use super::Known;
use crate::axis::{Axis, JointUnit};
use crate::document::{Diagnostics, NonNegative, ProblemKind, Quantity, Span, Spanned};
use crate::operating::{Input, InputFunction, Output, OutputFunction, Side, SimulatedSwitch};
use crate::quantity as unit;
use crate::table;
use messages::ControllerState;

/// How long an extraction goes on after a job where the file does not say [s].
const EXTRACTION_AFTER: f64 = 10.0;

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

/// The output of this table.
pub(super) fn output(
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

/// A place of an axis, for a person.
fn shown(unit: JointUnit, place: f64) -> String {
    match unit {
        JointUnit::Length => format!("{:.3} mm", place * 1e3),
        JointUnit::Angle => format!("{:.3} deg", place.to_degrees()),
    }
}

impl Known<'_> {
    pub(super) fn input(
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
                self.warn_of_travel(axis, table, side.value, simulated, diagnostics);
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

    /// Warns of a limit switch that the axis is on before it comes to its soft limit.
    fn warn_of_travel(
        &self,
        axis: usize,
        table: &InputTable,
        side: Side,
        switch: Option<SimulatedSwitch>,
        diagnostics: &mut Diagnostics,
    ) {
        let (Some(at), Some(switch)) = (&table.at, switch) else { return };
        let Axis { name, limits, .. } = &self.axes[axis];
        let [lower, upper] = limits.position;
        let (is_within, end) = match side {
            Side::Lower => (switch.at > lower, lower),
            Side::Upper => (switch.at < upper, upper),
        };
        if is_within {
            let unit = self.joints[axis].unit;
            diagnostics.warn(
                at.span,
                format!(
                    "axis `{name}` is on this limit switch from {}, and its `position` goes on to {}: it stops \
                     with a fault there; move the switch beyond, or end `position` before it",
                    shown(unit, switch.at),
                    shown(unit, end),
                ),
            );
        }
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
}

fn missing(name: &Spanned<String>, key: &str, example: &str, diagnostics: &mut Diagnostics) {
    diagnostics.refuse(
        ProblemKind::MissingKey,
        name.span,
        format!("`{key}` is missing in the input `{}`", name.value),
        Some(format!("add `{key} = {example}`")),
    );
}
