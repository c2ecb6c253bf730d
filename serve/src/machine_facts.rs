//! What of the machine a page or a program has to know.

use machine::{DrivesKind, Machine};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The machine, as `/api/v1/machine` tells it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MachineFacts {
    /// Its name.
    pub name: String,
    /// Its mechanism.
    pub mechanism: String,
    /// Its axes, in order.
    pub axes: Vec<AxisFacts>,
    /// Where the tool may go.
    pub area: Box3,
    /// Whether the tool moves in z too.
    pub is_spatial: bool,
    /// Its digital inputs by name.
    pub inputs: Vec<String>,
    /// Its digital outputs by name.
    pub outputs: Vec<String>,
    /// Whether its drives are the simulated plant.
    pub simulated: bool,
    /// Where the tool rests [m].
    pub home: [f64; 3],
    /// The largest speed at which the tool is moved in the dark [m/s].
    pub speed: f64,
    /// What people may do by hand.
    pub safety: SafetyFacts,
    /// The period of its control cycle [s].
    pub period: f64,
}

/// What people may do by hand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct SafetyFacts {
    /// The most power of a test pulse, 0 to 1.
    pub test_power: f64,
    /// The longest test pulse [s].
    pub test_time: f64,
    /// How long a jog goes on without being asked for [s].
    pub dead_man: f64,
}

/// An axis.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct AxisFacts {
    /// Its name.
    pub name: String,
    /// `m` where it slides, `rad` where it turns.
    pub unit: String,
    /// Its lower and its upper soft limit; null at an end that it does not have.
    pub limits: [Option<f64>; 2],
}

/// A box in the machine frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Box3 {
    /// Its lower corner [m].
    pub lower: [f64; 3],
    /// Its upper corner [m].
    pub upper: [f64; 3],
}

impl MachineFacts {
    /// Those of `machine`.
    pub fn of(machine: &Machine) -> Self {
        let axes = machine.axes.iter().map(|axis| AxisFacts {
            name: axis.name.clone(),
            unit: axis.unit.name().to_owned(),
            limits: axis.limits.position.map(|limit| limit.is_finite().then_some(limit)),
        });
        let operating = &machine.operating;
        Self {
            name: machine.name.clone(),
            mechanism: machine.mechanism.name().to_owned(),
            axes: axes.collect(),
            area: Box3 { lower: machine.area.lower, upper: machine.area.upper },
            is_spatial: machine.mechanism.moves_in_z(),
            inputs: operating.inputs.iter().map(|input| input.name.clone()).collect(),
            outputs: operating.outputs.iter().map(|output| output.name.clone()).collect(),
            simulated: machine.drives.kind == DrivesKind::Simulated,
            home: machine.home,
            speed: machine.path.rapid,
            safety: SafetyFacts {
                test_power: operating.safety.test_power,
                test_time: operating.safety.test_time,
                dead_man: operating.safety.dead_man,
            },
            period: machine.realtime.period.seconds(),
        }
    }
}
