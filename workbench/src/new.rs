//! A commented machine file to start from: a machine of one kind for an area, a head, a speed and an
//! acceleration, with motors and gears of the catalogues.
//!
//! The machine is like the shipped one of its kind, in another size. What its joints must do is found
//! over its whole area, motors are chosen for that, and the file is checked, planned with and simulated
//! before it is given out. Where no motor is enough, speed or acceleration is lowered, and the file says so.

mod choose;
mod draft;
mod drive;
pub mod kinds;
mod proof;
mod request;
mod text;
mod worst;

use crate::catalogue::Catalogue;
use draft::{Asked, Draft};
use drive::Drive;
use machine::Machine;
use machine::document::Document;
use machine::file::bounds::BOUNDS;
use machine::file::tables::MachineTable;

pub use kinds::Kind;
pub use proof::Proof;
pub use request::{Argument, OutOfRange, Request};

/// Tolerance of the path in every file [m]: a fifth of a line of 0.1 mm.
const TOLERANCE: f64 = 20e-6;

/// Tolerance with which the sample is marked [m]: half of it is left to motors and loops.
const SAMPLE_TOLERANCE: f64 = 10e-6;

/// What is asked for of what could not be had, where nothing says how much could.
const LESS: f64 = 0.75;

/// Times that a machine is drafted anew before it is given up.
const ROUNDS: usize = 80;

/// A machine file with its sample job.
#[derive(Debug, Clone, PartialEq)]
pub struct Created {
    /// The machine file.
    pub machine: String,
    /// The sample job that it names.
    pub sample: String,
    /// What was asked for and could not be met, a sentence each.
    pub lowered: Vec<String>,
    /// What the sample came to.
    pub proof: Proof,
}

/// Why there is no machine file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NewError {
    /// An argument is out of its range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// The kind takes no steppers.
    #[error("{kind} takes no --steppers: {because}")]
    NoSteppers {
        /// The kind.
        kind: &'static str,
        /// Why.
        because: &'static str,
    },
    /// Nothing was found that does it.
    #[error("no {kind} was found that does this: {because}")]
    NotMet {
        /// The kind.
        kind: &'static str,
        /// What the last try failed at.
        because: String,
    },
}

/// Why a draft does not do.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Short {
    /// With this part of the acceleration it might.
    Acceleration(f64, String),
    /// With stronger motors it might.
    Motor(String),
    /// With this speed [m/s] it might.
    Speed(f64, String),
    /// With this part of the speed it might.
    Slower(f64, String),
    /// With a load of fewer rotor inertias it might.
    Inertia(String),
    /// With planar motors of this force [N] it might.
    Force(f64),
}

/// A machine for `request` with motors of `catalogue`; its sample job will be in the file called `sample`
/// beside it.
///
/// # Errors
/// An argument out of range, or a machine that no motor of the catalogue can drive.
pub fn create(request: &Request, catalogue: &Catalogue, sample: &str) -> Result<Created, NewError> {
    request.check()?;
    let kind = request.kind.name();
    if request.steppers
        && let Some(because) = request.kind.refuses_steppers()
    {
        return Err(NewError::NoSteppers { kind, because });
    }
    let mut asked = Asked::new(request);
    let mut last = String::new();
    for _ in 0..ROUNDS {
        match attempt(request, &asked, catalogue, sample) {
            Ok(created) => return Ok(created),
            Err(short) => {
                last = asked.lower(short);
            }
        }
        if asked.is_hopeless() {
            break;
        }
    }
    Err(NewError::NotMet { kind, because: last })
}

fn attempt(
    request: &Request,
    asked: &Asked,
    catalogue: &Catalogue,
    sample: &str,
) -> Result<Created, Short> {
    let draft = kinds::draft(request, asked)?;
    let bare = draft.bare(request, asked, sample);
    let unsound = |what: String| Short::Acceleration(LESS, what);
    let machine =
        Machine::parse("draft", &bare, &[]).map_err(|error| unsound(error.to_string()))?;
    let worst = worst::over_area(&machine, &draft, [asked.rapid, asked.acceleration])
        .map_err(|error| unsound(error.to_string()))?;
    let drives = drives(&draft, asked, &bare, &machine, &worst, catalogue, request.steppers)?;
    let text = draft.file(request, asked, sample, &drives);
    let proof = proof::prove(&text, &draft.sample)?;
    let lowered = asked.lowered();
    Ok(Created { machine: text, sample: draft.sample, lowered, proof })
}

fn drives(
    draft: &Draft,
    asked: &Asked,
    bare: &str,
    machine: &Machine,
    worst: &[worst::Worst],
    catalogue: &Catalogue,
    steppers: bool,
) -> Result<Vec<Drive>, Short> {
    let unsound = |error: &dyn std::fmt::Display| Short::Acceleration(LESS, error.to_string());
    let document = Document::parse("draft", bare).map_err(|error| unsound(&error))?;
    let (table, _) =
        document.decode_within::<MachineTable>(BOUNDS).map_err(|error| unsound(&error))?;
    let needs = crate::size::need::axes(machine, &table);
    let axes = draft.axes.iter().zip(worst).zip(needs);
    axes.map(|((axis, worst), need)| match asked.planar {
        Some(force) => drive::planar(axis, worst, force),
        None => choose::choose(axis, worst, need, catalogue, steppers, asked),
    })
    .collect()
}
