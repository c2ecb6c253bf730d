//! Which machine comes first, by weights.

use schemars::JsonSchema;
use serde::Serialize;

use super::MachineReport;

/// How much each figure counts, 0 or more.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Weights {
    /// Time of all jobs.
    pub time: f64,
    /// Largest error of the marks.
    pub error: f64,
    /// The same on plants that are other than the machine file says, the median.
    pub mismatch: f64,
    /// Largest mechanical power of all motors together.
    pub power: f64,
    /// Mass that moves.
    pub mass: f64,
    /// Ground that it covers.
    pub footprint: f64,
    /// Least stiffness at the tool.
    pub stiffness: f64,
    /// Largest use of a limit of a motor.
    pub utilisation: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            time: 3.0,
            error: 2.0,
            mismatch: 1.0,
            power: 1.0,
            mass: 1.0,
            footprint: 1.0,
            stiffness: 1.0,
            utilisation: 1.0,
        }
    }
}

/// What counts, in the order of [`Weights`].
pub const CRITERIA: [&str; 8] =
    ["time", "error", "mismatch", "power", "mass", "footprint", "stiffness", "utilisation"];

impl Weights {
    /// The weights in the order of [`CRITERIA`].
    pub fn all(&self) -> [f64; 8] {
        let Self { time, error, mismatch, power, mass, footprint, stiffness, utilisation } = *self;
        [time, error, mismatch, power, mass, footprint, stiffness, utilisation]
    }

    /// Takes over `NAME=NUMBER`.
    ///
    /// # Errors
    /// A name that is no criterion, or no number of 0 or more.
    pub fn set(&mut self, text: &str) -> Result<(), String> {
        let Some((name, value)) = text.split_once('=') else {
            return Err(format!("{text:?} is not NAME=NUMBER, such as time=5"));
        };
        let weight = match name {
            "time" => &mut self.time,
            "error" => &mut self.error,
            "mismatch" => &mut self.mismatch,
            "power" => &mut self.power,
            "mass" => &mut self.mass,
            "footprint" => &mut self.footprint,
            "stiffness" => &mut self.stiffness,
            "utilisation" => &mut self.utilisation,
            _ => return Err(format!("no weight {name:?}; there are {}", CRITERIA.join(", "))),
        };
        match value.parse::<f64>() {
            Ok(number) if (0.0..=1e6).contains(&number) => {
                *weight = number;
                Ok(())
            }
            _ => Err(format!("{name}: {value:?} is not a number from 0 to 1000000")),
        }
    }
}

/// What a machine has of each of [`CRITERIA`], the less the better but for stiffness.
fn figures(machine: &MachineReport) -> [Option<f64>; 8] {
    let power = machine.axes.iter().map(|axis| axis.demand.power_peak).sum();
    let mechanics = &machine.mechanics;
    [
        machine.time,
        machine.error_max,
        machine.mismatch.as_ref().and_then(|mismatch| mismatch.error_median),
        Some(power).filter(|power| *power > 0.0),
        Some(mechanics.moving_mass),
        mechanics.footprint.map(|[x, y]| x * y),
        mechanics.stiffness.as_ref().map(|stiffness| stiffness.least),
        machine.utilisation,
    ]
}

/// Gives each machine that was not refused its score, and what of it each criterion is, then its rank.
///
/// A machine gets `best/value` of each criterion, of the stiffness `value/best`, weighed; 1 is best in all.
/// A criterion of which a machine has no figure counts for none.
pub(super) fn rank(machines: &mut [MachineReport], weights: &Weights) {
    let mut shares: Vec<[Option<f64>; 8]> = machines
        .iter()
        .map(|machine| if machine.refused.is_some() { [None; 8] } else { figures(machine) })
        .collect();
    let counted: Vec<bool> = machines.iter().map(|machine| machine.refused.is_none()).collect();
    let mut weights = weights.all();
    for (criterion, name) in CRITERIA.into_iter().enumerate() {
        let column = || shares.iter().zip(&counted).filter(|(_, counted)| **counted);
        let is_known = column().all(|(row, _)| row[criterion].is_some());
        let values = column().filter_map(|(row, _)| row[criterion]);
        let larger = name == "stiffness";
        let best = values.reduce(|one, other| if larger { one.max(other) } else { one.min(other) });
        let share = |value: f64, best: f64| match (value, best) {
            // Nothing is better than none, and the same as none.
            (0.0, 0.0) => 1.0,
            _ if larger => value / best,
            _ => best / value,
        };
        if !is_known {
            weights[criterion] = 0.0;
        }
        for row in &mut shares {
            row[criterion] = row[criterion].zip(best).map(|(value, best)| share(value, best));
        }
    }
    let whole: f64 = weights.iter().sum();
    for ((machine, shares), counted) in machines.iter_mut().zip(&shares).zip(&counted) {
        let weighed =
            shares.iter().zip(weights).map(|(share, weight)| share.unwrap_or(0.0) * weight);
        machine.score =
            counted.then(|| if whole > 0.0 { weighed.sum::<f64>() / whole } else { 0.0 });
        machine.shares = *shares;
    }
    let mut order: Vec<usize> = (0..machines.len()).filter(|index| counted[*index]).collect();
    order.sort_by(|one, other| {
        let score = |index: usize| machines[index].score.unwrap_or_default();
        score(*other).total_cmp(&score(*one))
    });
    for (rank, index) in (1..).zip(order) {
        machines[index].rank = Some(rank);
    }
}
