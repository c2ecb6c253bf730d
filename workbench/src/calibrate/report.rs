//! What `graver calibrate` says.

use machine::Machine;
use machine::mechanisms::tri_planar::TriPlanar;
use schemars::JsonSchema;
use serde::Serialize;

use super::Measurement;
use super::model::{Part, count, numbers, turn};
use super::solve::Solution;

/// What was identified, and how well it agrees.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CalibrationReport {
    /// The machine.
    pub machine: String,
    /// How many poses were measured.
    pub poses: usize,
    /// How many numbers were sought.
    pub unknowns: usize,
    /// How many of them the poses determine.
    pub rank: usize,
    /// How much the struts are too long or too short with the machine file's numbers.
    pub before: Fit,
    /// The same with the identified numbers.
    pub after: Fit,
    /// The numbers.
    pub numbers: Vec<Identified>,
    /// Directions that the poses do not determine: along each, the machine file's values are kept.
    pub open: Vec<Vec<Share>>,
    /// Where the machine file was written.
    pub written: Option<String>,
}

/// How well lengths agree with the poses.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct Fit {
    /// Root of the mean square over all struts [m].
    pub rms: f64,
    /// The largest [m].
    pub max: f64,
    /// The line of the measurements where it is.
    pub line: usize,
}

/// One number.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Identified {
    /// Its name, such as `leg AD` or `base about x`.
    pub name: &'static str,
    /// What it is measured in, m or rad.
    pub unit: &'static str,
    /// What the machine file says.
    pub before: f64,
    /// What was identified.
    pub value: f64,
    /// Its standard deviation by the residuals; null where the poses do not determine it.
    pub deviation: Option<f64>,
}

impl Identified {
    /// How much it differs from what the machine file says [m or rad]; turns by half a turn at most.
    pub fn change(&self) -> f64 {
        let change = self.value - self.before;
        if self.unit == "rad" { turn(change) } else { change }
    }
}

/// The part of one number in a direction.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Share {
    /// The number.
    pub name: &'static str,
    /// Its part in a direction of unit length, turns as lengths at the side's distance.
    pub part: f64,
}

pub(super) fn of(
    machine: &Machine,
    before: &TriPlanar,
    measurements: &[Measurement],
    free: &[Part],
    solution: &Solution,
) -> CalibrationReport {
    /// What has a smaller part in a direction is not named.
    const NAMED: f64 = 0.05;
    let names: Vec<&'static str> = free.iter().flat_map(|part| part.unknowns()).collect();
    let open = solution.open.iter().map(|direction| {
        let mut shares: Vec<Share> = names
            .iter()
            .zip(direction)
            .filter(|(_, part)| part.abs() > NAMED)
            .map(|(name, part)| Share { name, part: *part })
            .collect();
        shares.sort_by(|one, other| other.part.abs().total_cmp(&one.part.abs()));
        shares
    });
    let values = |mechanism: &TriPlanar| -> Vec<f64> {
        free.iter().flat_map(|part| numbers(mechanism, *part)).collect()
    };
    let (old, new) = (values(before), values(&solution.mechanism));
    let identified = names.iter().enumerate().map(|(index, name)| {
        let is_turn = name.contains("about");
        let scale = if is_turn { before.side } else { 1.0 };
        Identified {
            name,
            unit: if is_turn { "rad" } else { "m" },
            before: old[index],
            value: new[index],
            deviation: solution.deviations[index].map(|deviation| deviation / scale),
        }
    });
    CalibrationReport {
        machine: machine.name.clone(),
        poses: measurements.len(),
        unknowns: count(free),
        rank: count(free) - solution.open.len(),
        before: fit(&solution.before, measurements),
        after: fit(&solution.after, measurements),
        numbers: identified.collect(),
        open: open.collect(),
        written: None,
    }
}

fn fit(residuals: &[f64], measurements: &[Measurement]) -> Fit {
    let square: f64 = residuals.iter().map(|residual| residual * residual).sum();
    let mut fit = Fit { rms: (square / residuals.len().max(1) as f64).sqrt(), max: 0.0, line: 0 };
    for (six, measurement) in residuals.chunks(6).zip(measurements) {
        let most = six.iter().fold(0.0, |most: f64, residual| most.max(residual.abs()));
        if most >= fit.max {
            (fit.max, fit.line) = (most, measurement.line);
        }
    }
    fit
}
