//! Offsets that people set at the machine: origins of work coordinate systems, and of the tool.
//!
//! They are kept in a file beside the machine file, `cell1.offsets.toml` of `cell1.toml`, and come before what
//! that says under `[gcode.origins]`.

use std::path::{Path, PathBuf};

use crate::document::{Document, DocumentError, Point};
use crate::file::tables::OriginsTable;
use crate::machine::Machine;
use crate::table;

/// The work coordinate systems, in their order.
pub const SYSTEMS: [&str; 9] =
    ["g54", "g55", "g56", "g57", "g58", "g59", "g59.1", "g59.2", "g59.3"];

table! {
    /// A file of offsets.
    pub struct OffsetsTable {
        /// Origins of work coordinate systems, machine frame.
        pub origins: OriginsTable,
        /// By how much a program that asks for it with G43 goes elsewhere.
        pub tool: Option<Point>,
    }
}

/// Offsets that people have set.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Offsets {
    /// Origin of each of [`SYSTEMS`], machine frame [m]; `None` where the machine file decides.
    pub origins: [Option<[f64; 3]>; 9],
    /// By how much a program that asks for the tool's offset goes elsewhere [m].
    pub tool: Option<[f64; 3]>,
}

impl Offsets {
    /// The file beside the machine file at `path`.
    pub fn path(machine: &Path) -> PathBuf {
        machine.with_extension("offsets.toml")
    }

    /// Those of the file at `path`; none where there is no such file.
    ///
    /// # Errors
    /// A file that cannot be read, or is damaged, with the place.
    pub fn read(path: &Path) -> Result<Self, DocumentError> {
        if !path.exists() {
            return Ok(Self::default());
        }
        Self::parse(&path.display().to_string(), &Document::text(path)?)
    }

    /// Those of a file with this name and text.
    ///
    /// # Errors
    /// A file that is damaged, with the place.
    pub fn parse(file: &str, text: &str) -> Result<Self, DocumentError> {
        let document = Document::parse(file, text)?;
        let (table, diagnostics) =
            document.decode_within::<OffsetsTable>(crate::file::bounds::BOUNDS)?;
        let origins = table.origins.each().map(|origin| origin.map(|point| point.value));
        diagnostics.finish(Self { origins, tool: table.tool.map(|point| point.value) })
    }

    /// The text of the file that says this.
    pub fn text(&self) -> String {
        let point =
            |place: &[f64; 3]| place.map(|value| format!("\"{} mm\"", value * 1e3)).join(", ");
        let mut text =
            "# Offsets of the machine file beside it, as `graver offset` sets them.\n".to_owned();
        if let Some(tool) = &self.tool {
            text += &format!("tool = [{}]\n", point(tool));
        }
        text += "\n[origins]\n";
        for (name, origin) in SYSTEMS.iter().zip(&self.origins) {
            if let Some(origin) = origin {
                text += &format!("{} = [{}]\n", name.replace('.', "_"), point(origin));
            }
        }
        text
    }

    /// The index of a work coordinate system by its name, in upper or lower case.
    pub fn system(name: &str) -> Option<usize> {
        let name = name.to_lowercase().replace('_', ".");
        SYSTEMS.iter().position(|system| *system == name)
    }

    /// `machine` with these offsets.
    #[must_use]
    pub fn applied(&self, machine: &Machine) -> Machine {
        let mut machine = machine.clone();
        for (origin, own) in machine.gcode.origins.iter_mut().zip(&self.origins) {
            *origin = own.unwrap_or(*origin);
        }
        machine.gcode.tool_offset = self.tool.unwrap_or_default();
        machine
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn what_is_written_is_read_again_to_the_bit() {
        let mut offsets = Offsets { tool: Some([0.1 + 0.2, -1e-7, 0.0]), ..Offsets::default() };
        offsets.origins[0] = Some([0.123_456_789, 1.0 / 3.0, 0.0]);
        offsets.origins[8] = Some([-0.05, 0.0, 0.01]);
        let read = Offsets::parse("a.offsets.toml", &offsets.text()).unwrap();
        let near = |one: [f64; 3], other: [f64; 3]| {
            one.iter().zip(&other).all(|(one, other)| (one - other).abs() < 1e-15)
        };
        for (one, other) in read.origins.iter().zip(&offsets.origins) {
            assert!(one.is_some() == other.is_some());
            assert!(near(one.unwrap_or_default(), other.unwrap_or_default()), "{read:?}");
        }
        assert!(near(read.tool.unwrap(), offsets.tool.unwrap()));
        assert_eq!(Offsets::parse("a", &Offsets::default().text()).unwrap(), Offsets::default());
    }

    #[test]
    fn a_damaged_file_says_where() {
        for (text, line, words) in [
            ("[origins]\ng54 = [\"1 mm\", \"2 kg\"]\n", 2, "2 kg"),
            ("[origins]\ng60 = [\"1 mm\", \"2 mm\"]\n", 2, "g60"),
            ("[origins]\ng54 = [\"1 mm\", \"2 m", 2, ""),
            ("tool = [\"900 m\", \"0 mm\"]\n[origins]\ng55 = [\"900 m\", \"0 mm\"]\n", 3, "900 m"),
        ] {
            let error = Offsets::parse("cell.offsets.toml", text).unwrap_err();
            assert_eq!((error.file(), error.line()), ("cell.offsets.toml", Some(line)), "{text}");
            assert!(error.message().contains(words), "{}", error.message());
        }
        let absent = Offsets::read(Path::new("/nowhere/cell.offsets.toml")).unwrap();
        assert_eq!(absent, Offsets::default());
    }

    #[test]
    fn offsets_come_before_the_machine_file_and_only_where_they_are_set() {
        let machine = Machine::builtin();
        let mut offsets = Offsets::default();
        assert_eq!(offsets.applied(&machine), machine);
        offsets.origins[Offsets::system("G55").unwrap()] = Some([0.01, 0.02, 0.0]);
        let applied = offsets.applied(&machine);
        assert_eq!(applied.gcode.origins[1], [0.01, 0.02, 0.0]);
        assert_eq!(applied.gcode.origins[0], machine.gcode.origins[0]);
        assert_eq!(Offsets::system("g59_3"), Some(8));
        assert_eq!(Offsets::system("g60"), None);
        assert_eq!(
            Offsets::path(Path::new("/etc/cell1.toml")),
            Path::new("/etc/cell1.offsets.toml")
        );
    }
}
