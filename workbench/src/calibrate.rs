//! The lengths and the mounting of a tri-planar platform, identified from measured poses.
//!
//! Every measured pose gives six equations: with the feet where the motors say, each strut from a foot to
//! a corner of the platform is as long as its leg. Least squares over all of them by Gauss and Newton; what
//! the poses do not tell keeps the machine file's value, and is named.

mod measurements;
mod model;
mod report;
mod solve;
pub mod write;

use machine::{Machine, MechanismKind};

pub use measurements::{Measurement, read};
pub use model::Part;
pub use report::{CalibrationReport, Fit, Identified, Share};

/// A leg that seems so much longer or shorter than the file has it belongs to no such machine [1].
const MOST_OFF: f64 = 0.1;

/// Why nothing was identified.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// A line of the measurements.
    #[error("{file}:{line}: {text}")]
    Measurements {
        /// The file.
        file: String,
        /// The line, from 1.
        line: usize,
        /// What is wrong, and what would be right.
        text: String,
    },
    /// A machine that is calibrated otherwise.
    #[error(
        "the machine has the mechanism `{0}`: only `tri_planar` is calibrated from measured poses"
    )]
    Mechanism(&'static str),
    /// Too few measurements.
    #[error(
        "{file}: {found} poses are too few for {unknowns} unknowns: measure {needed} at least, spread \
         over the area and turned differently"
    )]
    TooFew {
        /// The file.
        file: String,
        /// How many there are.
        found: usize,
        /// How many numbers are sought.
        unknowns: usize,
        /// How many poses are needed.
        needed: usize,
    },
    /// No lengths were found that agree with the measurements.
    #[error(
        "{file}: no lengths agree with these poses: the feet or the poses are of another machine"
    )]
    Diverged {
        /// The file.
        file: String,
    },
    /// The machine file cannot be changed.
    #[error("the machine file cannot be written: {0}")]
    Write(String),
}

/// Identifies the `free` parts of `machine` from the `measurements` of `file`.
///
/// # Errors
/// Another mechanism, measurements that are of another machine, or too few of them.
pub fn calibrate(
    machine: &Machine,
    file: &str,
    measurements: &[Measurement],
    free: &[Part],
) -> Result<CalibrationReport, CalibrationError> {
    let MechanismKind::TriPlanar(mechanism) = &machine.mechanism else {
        return Err(CalibrationError::Mechanism(machine.mechanism.name()));
    };
    for measurement in measurements {
        let found = mechanism.measured_struts(&measurement.pose, &measurement.feet);
        for length in found.iter().flatten() {
            let is_near = (length - mechanism.side).abs() <= MOST_OFF * mechanism.side;
            if !is_near {
                return Err(CalibrationError::Measurements {
                    file: file.to_owned(),
                    line: measurement.line,
                    text: format!(
                        "a leg would be {length:.4} m long here, and the platform's side is {} m: feet and \
                         pose must be in metres, of this machine, and of the same moment",
                        mechanism.side
                    ),
                });
            }
        }
    }
    let unknowns = model::count(free);
    // One equation more than unknowns, so that there are residuals.
    let needed = unknowns / 6 + 1;
    if measurements.len() < needed {
        let (file, found) = (file.to_owned(), measurements.len());
        return Err(CalibrationError::TooFew { file, found, unknowns, needed });
    }
    let solution = solve::solve(mechanism, measurements, free)
        .ok_or_else(|| CalibrationError::Diverged { file: file.to_owned() })?;
    Ok(report::of(machine, mechanism, measurements, free, &solution))
}

#[cfg(test)]
mod tests;
