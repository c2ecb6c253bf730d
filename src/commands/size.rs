//! `graver size`: what motor and gear each axis needs, and which of a catalogue do it.

mod text;

use crate::arguments::{SizeArguments, SizeGears, SizeOrder};
use crate::exit::{Exit, Failure};
use crate::files::Sources;
use crate::inputs::{MachineInput, Overrides};
use crate::{commands::figures, inputs, output};
use machine::Machine;
use std::io::Write;
use std::path::{Component, Path, PathBuf};
use workbench::catalogue::{self, Catalogue};
use workbench::size::report::SizeReport;
use workbench::size::{self, Gears, MachineFile, Options, Order, SizeError, write};

/// Runs the command.
///
/// # Errors
/// A machine, job or catalogue that does not hold, or a machine file that cannot be written.
pub fn run(arguments: &SizeArguments) -> Result<Exit, Failure> {
    let input = inputs::machine(&arguments.machine)?;
    let overrides = Overrides::sort(&arguments.machine.set)?.machine;
    if arguments.out.is_some() && !overrides.is_empty() {
        return Err(Failure::bad_input(
            "--out does not write the changes that --set makes to the machine: change the machine file \
             instead",
        ));
    }
    let request = inputs::job_request(
        arguments.job.as_deref(),
        &input.machine,
        input.folder.as_deref(),
        &input.job_overrides,
    );
    let job = request.read(&input.machine)?;
    let (catalogue, files) = catalogue(&arguments.motors)?;
    let (name, text) = input.source.file();
    let file = MachineFile { name: &name, text, overrides: &overrides };
    let options = options(arguments, &catalogue);
    let sized = size::size(file, &input.machine, &job, &catalogue, &options);
    let (mut report, machine) = sized.map_err(|error| match error {
        SizeError::Plan(error) => request.refuse(&error).into(),
        SizeError::Machine(error) => error.into(),
        error => Failure::bad_input(error),
    })?;
    let machine = machine.filter(|_| is_right(&report));
    let read: Vec<PathBuf> = job.files.iter().cloned().chain(files).collect();
    let mut sources = Sources::new(arguments.machine.machine.as_deref(), &read);
    if let Some(folder) = &arguments.figures {
        let figures = workbench::figures::sized(&report).map_err(Failure::bad_input)?;
        figures::write(&figures, "--figures", folder, &mut sources)?;
        report.pictures = Some(folder.join(figures::PAGE).display().to_string());
    }
    if let (Some(out), Some(machine)) = (&arguments.out, machine) {
        write_machine(&input, &machine, out, &mut sources)?;
        report.written = Some(out.display().to_string());
    }
    if arguments.json {
        output::json(&report)?;
    } else {
        text::print(&report, arguments.out.is_some());
    }
    Ok(if is_right(&report) { Exit::Done } else { Exit::Stopped })
}

/// Whether every axis has a motor that was confirmed.
fn is_right(report: &SizeReport) -> bool {
    report.is_complete()
        && report.confirmation.as_ref().is_none_or(|confirmation| confirmation.is_right)
}

fn options(arguments: &SizeArguments, catalogue: &Catalogue) -> Options {
    let gears = match arguments.gears {
        Some(SizeGears::Keep) => Gears::Keep,
        Some(SizeGears::Catalogue) => Gears::Catalogue,
        Some(SizeGears::Any) => Gears::Any,
        None if catalogue.gears.is_empty() => Gears::Keep,
        None => Gears::Catalogue,
    };
    Options {
        margin: arguments.margin,
        ambient: arguments.ambient,
        axes: arguments.axis.clone(),
        order: match arguments.by {
            SizeOrder::Mass => Order::Mass,
            SizeOrder::Power => Order::Power,
        },
        gears,
    }
}

/// The catalogues that are named, or all that are built in, and the files that were read.
pub(crate) fn catalogue(names: &[String]) -> Result<(Catalogue, Vec<PathBuf>), Failure> {
    let builtin = |name: &str| catalogue::BUILTIN.iter().find(|(known, _)| *known == name);
    let mut all = Catalogue::default();
    let mut files = Vec::new();
    if names.is_empty() {
        for (name, text) in catalogue::BUILTIN {
            all = all.and(Catalogue::parse(&format!("catalogues/{name}.toml"), text)?);
        }
    }
    for name in names {
        let path = Path::new(name);
        // A file of that name goes first.
        let read = match builtin(name).filter(|_| !path.is_file()) {
            Some((name, text)) => Catalogue::parse(&format!("catalogues/{name}.toml"), text)?,
            None => {
                files.push(path.to_owned());
                Catalogue::load(path)?
            }
        };
        all = all.and(read);
    }
    Ok((all, files))
}

/// Writes the machine file with what was found to `out`.
pub(super) fn write_machine(
    input: &MachineInput,
    machine: &str,
    out: &Path,
    sources: &mut Sources,
) -> Result<(), Failure> {
    let text = moved(input, machine, out)?;
    let mut file = sources.create("--out", out)?;
    file.write_all(text.as_bytes())
        .map_err(|error| Failure::output(format!("{}: {error}", out.display())))
}

/// `machine`, the text of a machine file in the folder of `input`, as it stands at `out`: it names the same files. A
/// sample job that cannot be found is left out.
pub(super) fn moved(input: &MachineInput, machine: &str, out: &Path) -> Result<String, Failure> {
    let sample = input.machine.sample_job.as_ref().map(|sample| sample.display().to_string());
    let sample = sample.map(|name| (Machine::SAMPLE, name_from(input, &name, out)));
    // What cannot be found would have been refused.
    let files = Machine::FILES.into_iter().filter_map(|key| {
        let name = input.source.file_at(key)?;
        Some((key, Some(name_from(input, &name, out).unwrap_or(name))))
    });
    let names: Vec<(&str, Option<String>)> = files.chain(sample).collect();
    write::with_files(machine, &names).map_err(Failure::bad_input)
}

/// The file that the machine file calls `name`, by its path from the folder of `out`.
fn name_from(input: &MachineInput, name: &str, out: &Path) -> Option<String> {
    if Path::new(name).is_absolute() {
        return Some(name.to_owned());
    }
    let path = input.folder.as_ref()?.join(name).canonicalize().ok()?;
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
    Some(relative(&folder, &path).display().to_string())
}

/// `path` as it is called from `folder`, both absolute.
fn relative(folder: &Path, path: &Path) -> PathBuf {
    let common =
        folder.components().zip(path.components()).take_while(|(one, other)| one == other).count();
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    up.chain(path.components().skip(common)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_called_from_where_the_file_is() {
        let from = |folder: &str, path: &str| relative(Path::new(folder), Path::new(path));
        assert_eq!(from("/a/b", "/a/c/d.toml"), Path::new("../c/d.toml"));
        assert_eq!(from("/a", "/a/d.toml"), Path::new("d.toml"));
        assert_eq!(from("/x/y", "/a/d.toml"), Path::new("../../a/d.toml"));
    }
}
