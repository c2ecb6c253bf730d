//! `graver machine export`: profiles of a machine for programs that draw jobs and send them as grbl.

use super::profile::Profile;
use crate::arguments::ProfileArguments;
use crate::exit::{Exit, Failure};
use crate::files::Sources;
use crate::inputs;
use crate::output::{self, say};
use serde::Serialize;
use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};

/// What `machine export --json` prints.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct ProfileReport {
    /// The files that were written.
    pub files: Vec<String>,
    /// What they say.
    pub profile: Profile,
    /// What to know before the profile is used.
    pub notes: Vec<String>,
}

/// Runs the command.
///
/// # Errors
/// A machine file that does not hold, or a file that cannot be written.
pub fn export(arguments: &ProfileArguments) -> Result<Exit, Failure> {
    let input = inputs::machine(&arguments.machine)?;
    let profile = Profile::of(&input.machine, &arguments.host, arguments.port);
    let mut sources = Sources::new(arguments.machine.machine.as_deref(), &[]);
    let mut write = |path: PathBuf, value: &Value| write(&mut sources, &path, value);
    let named = |suffix: &str| PathBuf::from(format!("{}{suffix}", file_name(&profile.name)));
    let files = if arguments.lbdev {
        let out = arguments.out.clone().unwrap_or_else(|| named(".lbdev"));
        vec![write(out, &profile.lightburn())?]
    } else {
        let folder = arguments.out.clone().unwrap_or_else(|| named("-rayforge"));
        std::fs::create_dir_all(&folder).map_err(|error| {
            Failure::bad_input(format!("--out: cannot create {}: {error}", folder.display()))
        })?;
        vec![
            write(folder.join("device.yaml"), &profile.rayforge())?,
            write(folder.join("dialect.yaml"), &Profile::rayforge_dialect())?,
        ]
    };
    let report = ProfileReport { files, notes: notes(arguments, &profile), profile };
    if arguments.json {
        output::json(&report)?;
    } else {
        say!("written   {}", report.files.join(" and "));
        for note in &report.notes {
            say!("note      {note}");
        }
    }
    Ok(Exit::Done)
}

fn notes(arguments: &ProfileArguments, profile: &Profile) -> Vec<String> {
    let mut notes = Vec::new();
    if !profile.begins_in_the_corner() {
        let [x, y] = profile.origin.map(|place| place * 1e3);
        let machine = arguments.machine.machine.as_deref();
        let machine =
            machine.map_or(String::new(), |file| format!(" --machine {}", file.display()));
        notes.push(format!(
            "such programs draw from the lower left corner of the area, and G54 is at {x:.3}, {y:.3} mm from it: \
             set it there in gcode.origins of the machine file, or with graver offset set g54{machine}"
        ));
    }
    if arguments.lbdev {
        let (host, port) = (&profile.host, profile.port);
        notes.push(format!(
            "in LightBurn: Devices, Import; for a network connection choose it there and enter {host}; LightBurn takes \
             port 23 and not {port}: listen there too, or use graver serve --grbl-tty"
        ));
    }
    notes
}

fn write(sources: &mut Sources, path: &Path, value: &Value) -> Result<String, Failure> {
    let failed =
        |error: &dyn std::fmt::Display| Failure::output(format!("{}: {error}", path.display()));
    let mut text = serde_json::to_string_pretty(value).map_err(|error| failed(&error))?;
    text.push('\n');
    let mut file = sources.create("--out", path)?;
    file.write_all(text.as_bytes()).map_err(|error| failed(&error))?;
    Ok(path.display().to_string())
}

/// A name as a file's: what is not plain becomes a hyphen.
fn file_name(name: &str) -> String {
    let plain = |it: char| if it.is_alphanumeric() || "-_.".contains(it) { it } else { '-' };
    let name: String = name.chars().map(plain).collect();
    let name = name.trim_matches(['-', '.']);
    if name.is_empty() { "machine".to_owned() } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_machines_become_names_of_files() {
        assert_eq!(file_name("CoreXY"), "CoreXY");
        assert_eq!(file_name("../my laser/2"), "my-laser-2");
        assert_eq!(file_name("  "), "machine");
    }
}
