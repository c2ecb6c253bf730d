//! The lengths and the mounting of a tri-planar platform, identified from measured poses.
//!
//! Every measured pose gives six equations: with the feet where the motors say, each strut from a foot to
//! a corner of the platform is as long as its leg. Least squares over all of them by Gauss and Newton; what
//! the poses do not determine keeps the machine file's value, and is named.

mod measurements;
mod model;
mod report;
mod solve;
mod start;
pub mod write;

use machine::mechanisms::tri_planar::TriPlanar;
use machine::{Machine, MechanismKind};

pub use measurements::{Measurement, read};
pub use model::Part;
pub use report::{CalibrationReport, Fit, Identified, Share};

/// A leg that seems so much longer or shorter than the file has it belongs to no such machine, in sides.
const MOST_OFF: f64 = 0.1;

/// Residuals beyond this are no noise of an instrument: root of their mean square, in sides.
const MOST_LEFT: f64 = 1e-3;

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
    /// The numbers that agree best with the measurements do not agree with them, or none are the best.
    #[error(
        "{file}: the poses do not fit this machine: {reason}; the residual is {rms:.4} mm rms, and \
         {max:.4} mm at most, in line {line}: look at the order and the sense of the quaternion \
         (qw,qx,qy,qz, from the tool to the frame of the measurements), at the units (metres), at \
         the file's `tool`, and whether feet and pose are of the same moment"
    )]
    Misfit {
        /// The file.
        file: String,
        /// What shows it.
        reason: String,
        /// Root of the mean square of what is left [mm].
        rms: f64,
        /// The largest that is left [mm].
        max: f64,
        /// The line where it is.
        line: usize,
    },
    /// The machine file cannot be changed.
    #[error("the machine file cannot be written: {0}")]
    Write(String),
}

/// Identifies the `free` parts of `machine` from the `measurements` of `file`.
///
/// # Errors
/// Another mechanism, too few measurements, or such that no numbers agree with.
pub fn calibrate(
    machine: &Machine,
    file: &str,
    measurements: &[Measurement],
    free: &[Part],
) -> Result<CalibrationReport, CalibrationError> {
    let MechanismKind::TriPlanar(mechanism) = &machine.mechanism else {
        return Err(CalibrationError::Mechanism(machine.mechanism.name()));
    };
    if !free.contains(&Part::Base) && !free.contains(&Part::Tool) {
        check_legs(mechanism, file, measurements)?;
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
    let report = report::of(machine, mechanism, measurements, free, &solution);
    match misfit(file, mechanism.side, &report.after, solution.is_settled) {
        Some(error) => Err(error),
        None => Ok(report),
    }
}

/// What is wrong with numbers that leave `fit` on a platform of this `side` [m]; `None` where they fit.
fn misfit(file: &str, side: f64, fit: &Fit, is_settled: bool) -> Option<CalibrationError> {
    let Fit { rms, max, line } = *fit;
    let reason = if rms > MOST_LEFT * side {
        format!("more than {MOST_LEFT} of the side is left")
    } else if max > MOST_OFF * side {
        format!("more than {MOST_OFF} of the side is left at one leg")
    } else if !is_settled {
        "no numbers were found that agree best".to_owned()
    } else {
        return None;
    };
    let file = file.to_owned();
    Some(CalibrationError::Misfit { file, reason, rms: rms * 1e3, max: max * 1e3, line })
}

/// That each leg is about as long as the file has it, with the file's mounting.
fn check_legs(
    mechanism: &TriPlanar,
    file: &str,
    measurements: &[Measurement],
) -> Result<(), CalibrationError> {
    for measurement in measurements {
        let Some(length) = start::strange_leg(mechanism, measurement) else { continue };
        return Err(CalibrationError::Measurements {
            file: file.to_owned(),
            line: measurement.line,
            text: format!(
                "a leg would be {length:.4} m long here, and the platform's side is {} m: feet and \
                 pose must be in metres, of this machine, in the machine file's frame, and of the \
                 same moment",
                mechanism.side
            ),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
