//! The machine file: what its tables are (`tables`), and how they become a [`Machine`]
//! (`validate`, `axes`), or are doubted (`doubts`).

mod axes;
mod doubts;
pub mod tables;
mod validate;

use std::path::Path;

use crate::document::{Document, DocumentError, Override, schema_text};
use crate::machine::Machine;

/// What stands before a machine's keys in `--set machine.KEY=VALUE`.
const PREFIX: &str = "machine.";

impl Machine {
    /// Reads the machine file at `path`, with `overrides` laid over it.
    ///
    /// # Errors
    /// Everything in the file or the overrides that is not sound, with its place.
    pub fn load(path: &Path, overrides: &[Override]) -> Result<Self, DocumentError> {
        validate::machine(Document::read(path)?.override_with(overrides, PREFIX)?)
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
