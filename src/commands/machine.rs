//! `graver machine new`: a commented machine file to start from, and a sample job.

pub mod export;
pub mod profile;
mod questions;

use self::questions::Questions;
use super::size::catalogue;
use crate::arguments::NewArguments;
use crate::exit::{Exit, Failure};
use crate::files::Sources;
use crate::output::{self, say};
use serde::Serialize;
use std::fs::File;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use workbench::new::{self, Argument, Created, Request};

/// What `machine new --json` prints.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct NewReport {
    /// The machine file.
    pub machine: String,
    /// The sample job, which it names.
    pub sample: String,
    /// What was asked for and could not be met, a sentence each.
    pub lowered: Vec<String>,
    /// Time of the sample [s].
    pub time: f64,
    /// Largest deviation of a mark of the sample from its line, as simulated [m].
    pub error_max: f64,
}

/// Runs the command.
///
/// # Errors
/// An argument out of range, a catalogue that does not hold, a machine that no motor can drive, or a file
/// that is there already or cannot be written.
pub fn new(arguments: &NewArguments) -> Result<Exit, Failure> {
    let out = match &arguments.out {
        Some(out) => out.clone(),
        None => PathBuf::from(format!("{}.toml", arguments.kind.name())),
    };
    let sample = sample_path(&out)?;
    if !arguments.force {
        // Before anything is asked.
        [&out, &sample]
            .into_iter()
            .filter(|path| path.exists())
            .try_for_each(|path| Err(there(path)))?;
    }
    let (catalogue, files) = catalogue(&arguments.motors)?;
    let request = request(arguments)?;
    let name =
        sample.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let created = new::create(&request, &catalogue, &name).map_err(Failure::bad_input)?;
    let mut sources = Sources::new(None, &files);
    write(&mut sources, &sample, &created.sample, arguments.force)?;
    write(&mut sources, &out, &created.machine, arguments.force)?;
    let report = NewReport {
        machine: out.display().to_string(),
        sample: sample.display().to_string(),
        lowered: created.lowered.clone(),
        time: created.proof.time,
        error_max: created.proof.error,
    };
    if arguments.json {
        output::json(&report)?;
    } else {
        print(&report, &created);
    }
    Ok(Exit::Done)
}

fn print(report: &NewReport, created: &Created) {
    say!("written   {}, and its sample job {}", report.machine, report.sample);
    for sentence in &created.lowered {
        say!("lowered   {sentence}");
    }
    say!(
        "proven    nothing to warn of; the sample takes {:.2} s, marks within {:.1} µm, in simulation",
        report.time,
        report.error_max * 1e6
    );
    say!(
        "try       graver check --machine {0}\n          graver simulate --machine {0}",
        report.machine
    );
}

/// Where the sample job of the machine file `out` is written.
fn sample_path(out: &Path) -> Result<PathBuf, Failure> {
    let wrong =
        || Failure::bad_input(format!("--out {}: name a file, such as mine.toml", out.display()));
    let stem = out.file_stem().filter(|_| !out.is_dir()).ok_or_else(wrong)?;
    let mut name = stem.to_os_string();
    name.push("-sample.toml");
    Ok(out.with_file_name(name))
}

fn there(path: &Path) -> Failure {
    Failure::bad_input(format!(
        "{} is there already: name another file with --out, or write over it with --force",
        path.display()
    ))
}

fn write(sources: &mut Sources, path: &Path, text: &str, force: bool) -> Result<(), Failure> {
    let mut file = if force {
        sources.create("--out", path)?
    } else {
        File::create_new(path).map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => there(path),
            _ => Failure::bad_input(format!("--out: cannot write {}: {error}", path.display())),
        })?
    };
    file.write_all(text.as_bytes())
        .map_err(|error| Failure::output(format!("{}: {error}", path.display())))
}

/// What the arguments ask for, and the answers to what they leave out.
fn request(arguments: &NewArguments) -> Result<Request, Failure> {
    let kind = arguments.kind;
    let usual = Request::usual(kind);
    if arguments.z.is_some() && !kind.has_z() {
        let name = kind.name();
        return Err(Failure::bad_input(format!(
            "--z: {name} does not move in z; cartesian_lift does"
        )));
    }
    let asks = !arguments.yes && !arguments.json && io::stdin().is_terminal();
    let mut answers = asks.then(|| Questions::new(io::stdin().lock(), io::stderr()));
    let mut number = |given: &Option<String>, argument: Argument, usual: f64, what: &str| match (
        given,
        &mut answers,
    ) {
        (Some(text), _) => argument.read(text).map_err(Failure::bad_input),
        (None, Some(questions)) => {
            Ok(questions.ask(what, usual, |it| argument.written(*it), |text| argument.read(text)))
        }
        (None, None) => Ok(usual),
    };
    let z = if kind.has_z() {
        number(&arguments.z, Argument::Z, usual.z, "travel in z")?
    } else {
        usual.z
    };
    let head = number(&arguments.head, Argument::HEAD, usual.head, "mass of the head")?;
    let speed = number(&arguments.speed, Argument::SPEED, usual.speed, "speed of the tool")?;
    let acceleration = number(
        &arguments.acceleration,
        Argument::ACCELERATION,
        usual.acceleration,
        "its acceleration",
    )?;
    let area = match (&arguments.area, &mut answers) {
        (Some(text), _) => Argument::AREA.read_two(text).map_err(Failure::bad_input)?,
        (None, Some(questions)) => {
            let written = |[width, depth]: &[f64; 2]| {
                format!("{} x {}", Argument::AREA.written(*width), Argument::AREA.written(*depth))
            };
            questions.ask("area, width x depth", usual.area, written, |text| {
                Argument::AREA.read_two(text)
            })
        }
        (None, None) => usual.area,
    };
    let steppers = match &mut answers {
        Some(questions) if !arguments.steppers && kind.refuses_steppers().is_none() => {
            let written = |_: &bool| "no".to_owned();
            questions.ask("steppers in place of DC motors", false, written, |text| match text {
                "y" | "yes" => Ok(true),
                "n" | "no" => Ok(false),
                _ => Err("answer yes or no".to_owned()),
            })
        }
        _ => arguments.steppers,
    };
    let name = arguments.name.clone().unwrap_or(usual.name);
    Ok(Request { kind, name, area, z, head, speed, acceleration, steppers })
}
