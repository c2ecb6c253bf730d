//! The machine file: what its tables are (`tables`), and how they become a [`Machine`]
//! (`validate`, `axes`), with errors and warnings about single values (`bounds`), values that do not fit
//! each other (`relations`), and motors, speeds and springs that the machine cannot make use of (`warnings`).

mod axes;
pub mod bounds;
mod drive_homing;
pub mod drives;
pub mod frame;
mod laser;
mod loops;
pub mod mechanism;
pub mod motors;
pub mod operating;
mod relations;
pub mod tables;
mod unused;
mod validate;
mod warnings;

use std::path::Path;

use crate::document::{Document, DocumentError, Override, schema_text};
use crate::machine::Machine;

/// What stands before a machine's keys in `--set machine.KEY=VALUE`.
const PREFIX: &str = "machine.";

/// What stands before the keys that are other in the simulated plant, `--set plant.KEY=VALUE`.
const PLANT_PREFIX: &str = "plant.";

impl Machine {
    /// Reads the machine file at `path`, with `overrides` laid over it.
    ///
    /// # Errors
    /// Everything in the file or the overrides that is not sound, with its place.
    pub fn load(path: &Path, overrides: &[Override]) -> Result<Self, DocumentError> {
        validate::machine(Document::read(path)?.override_with(overrides, PREFIX)?)
    }

    /// The machine that is simulated where it differs from the one that is controlled: the machine
    /// file of this name and text, or the built-in one, with `overrides` and then those of the
    /// `plant` alone laid over it.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn simulated(
        file: Option<(&str, &str)>,
        overrides: &[Override],
        plant: &[Override],
    ) -> Result<Self, DocumentError> {
        let (name, text) = file.unwrap_or((crate::machine::BUILTIN_NAME, crate::machine::BUILTIN));
        let document = Document::parse(name, text)?.override_with(overrides, PREFIX)?;
        validate::machine(document.override_with(plant, PLANT_PREFIX)?)
    }

    /// Reads a machine file from `text`; `file` is its name in errors.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(file: &str, text: &str, overrides: &[Override]) -> Result<Self, DocumentError> {
        validate::machine(Document::parse(file, text)?.override_with(overrides, PREFIX)?)
    }
}

/// The JSON schema of machine files, as `machines/schema.json` holds it.
pub fn schema() -> String {
    schema_text::<tables::MachineTable>("Graver machine file")
}
