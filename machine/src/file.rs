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
pub mod mesh;
mod mesh_file;
pub mod modbus;
pub mod motors;
pub mod operating;
mod relations;
pub mod tables;
mod unused;
mod validate;
mod warnings;

use std::path::Path;

use crate::document::{Attachments, Document, DocumentError, Override, schema_text};
use crate::machine::Machine;

/// What stands before a machine's keys in `--set machine.KEY=VALUE`.
const PREFIX: &str = "machine.";

/// What stands before the keys that are other in the simulated plant, `--set plant.KEY=VALUE`.
const PLANT_PREFIX: &str = "plant.";

impl Machine {
    /// The keys that name a file beside the machine file which is a part of it.
    pub const FILES: [&str; 1] = ["frame.mesh.file"];

    /// The key that names the sample job.
    pub const SAMPLE: &str = "job.sample";

    /// Reads the machine file at `path` and the files that it names, with `overrides` laid over it.
    ///
    /// # Errors
    /// Everything in the files or the overrides that is not sound, with its place.
    pub fn load(path: &Path, overrides: &[Override]) -> Result<Self, DocumentError> {
        let document = Document::read(path)?.override_with(overrides, PREFIX)?;
        validate::machine(document.attach(Attachments::beside(path)))
    }

    /// The machine that is simulated where it differs from the one that is controlled: the machine
    /// file of this name and text, or the built-in one, with `overrides` and then those of the
    /// `plant` alone laid over it. The files that it names are found in `attachments`.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn simulated(
        file: Option<(&str, &str)>,
        attachments: Attachments,
        overrides: &[Override],
        plant: &[Override],
    ) -> Result<Self, DocumentError> {
        validate::machine(laid_over(file, overrides, plant)?.attach(attachments))
    }

    /// The names of the files that the machine file with this `text`, or the built-in one, names under these
    /// overrides; none of a file that is no TOML.
    pub fn files_named(
        text: Option<&str>,
        overrides: &[Override],
        plant: &[Override],
    ) -> Vec<String> {
        let file = text.map(|text| ("", text));
        let Ok(document) = laid_over(file, overrides, plant) else { return Vec::new() };
        Self::FILES.iter().filter_map(|key| document.text_at(key)).map(str::to_owned).collect()
    }

    /// The name that the machine file with this `text` has at the dotted `key`; `None` of one that is no TOML.
    pub fn file_at(text: &str, key: &str) -> Option<String> {
        Document::parse("", text).ok()?.text_at(key).map(str::to_owned)
    }

    /// Reads a machine file from `text`; `file` is its path, beside which the files that it names are read, and its
    /// name in errors.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(file: &str, text: &str, overrides: &[Override]) -> Result<Self, DocumentError> {
        let document = Document::parse(file, text)?.override_with(overrides, PREFIX)?;
        validate::machine(document.attach(Attachments::beside(Path::new(file))))
    }
}

/// The machine file of this name and text, or the built-in one, under both kinds of overrides.
fn laid_over(
    file: Option<(&str, &str)>,
    overrides: &[Override],
    plant: &[Override],
) -> Result<Document, DocumentError> {
    let (name, text) = file.unwrap_or((crate::machine::BUILTIN_NAME, crate::machine::BUILTIN));
    Document::parse(name, text)?
        .override_with(overrides, PREFIX)?
        .override_with(plant, PLANT_PREFIX)
}

/// The JSON schema of machine files, as `machines/schema.json` holds it.
pub fn schema() -> String {
    schema_text::<tables::MachineTable>("Graver machine file")
}
