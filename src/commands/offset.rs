//! Offsets that people set at the machine, in a file beside the machine file.

use super::motion::place;
use super::operator::{connect, send_checked};
use crate::arguments::{OffsetArguments, OffsetClearArguments, OffsetCommand, OffsetPlace};
use crate::exit::{Exit, Failure};
use crate::output::{self, say};
use machine::Machine;
use machine::offsets::{Offsets, SYSTEMS};
use machine::quantity::{self, Length};
use operator::Request;
use runtime::socket::ANSWER_PATIENCE;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

/// What is called `tool` beside the systems.
const TOOL: &str = "tool";

/// The offsets of a machine, as `graver offset --json` prints them.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct OffsetsReport {
    /// Where they are kept.
    pub file: String,
    /// Origins of the work coordinate systems, machine frame.
    pub origins: BTreeMap<String, Origin>,
    /// By how much a program that asks for it with G43 goes elsewhere [m]; null for none.
    pub tool: Option<[f64; 3]>,
}

/// The origin of a work coordinate system.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct Origin {
    /// Where it is [m].
    pub place: [f64; 3],
    /// Whether it was set by a person; else the machine file says so.
    pub is_set: bool,
}

/// What an offset is called.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Name {
    System(usize),
    Tool,
}

/// Carries a subcommand out.
///
/// # Errors
/// No machine file, a file that is damaged or cannot be written, no such system, no pipeline.
pub fn run(command: &OffsetCommand) -> Result<Exit, Failure> {
    match command {
        OffsetCommand::List(arguments) => {
            let kept = Kept::open(arguments)?;
            kept.tell(None, arguments.instance.json)
        }
        OffsetCommand::Set(arguments) => set(arguments),
        OffsetCommand::Here(arguments) => here(arguments),
        OffsetCommand::Clear(arguments) => clear(arguments),
    }
}

fn set(arguments: &OffsetArguments) -> Result<Exit, Failure> {
    let mut kept = Kept::open(&arguments.place)?;
    let name = Name::read(&arguments.system)?;
    let given = given(arguments)?;
    if given == [None; 3] {
        return Err(Failure::bad_input(
            "say where, with --x, --y or --z; `graver offset here` takes the place of the tool",
        ));
    }
    let before = kept.value(name);
    let value = core::array::from_fn(|axis| given[axis].unwrap_or(before[axis]));
    kept.put(name, Some(value))?;
    kept.tell(Some(name), arguments.place.instance.json)
}

/// The place of the tool gets the coordinates that are given, 0 for all where none is.
fn here(arguments: &OffsetArguments) -> Result<Exit, Failure> {
    let name = Name::read(&arguments.system)?;
    let Name::System(_) = name else {
        return Err(Failure::bad_input(
            "where the tool is says nothing of its offset: `graver offset set tool --x …`",
        ));
    };
    let given = given(arguments)?;
    let mut kept = Kept::open(&arguments.place)?;
    let status = status(&arguments.place)?;
    let tool = tool(&status)?;
    let before = kept.value(name);
    let value = core::array::from_fn(|axis| match given[axis] {
        Some(coordinate) => tool[axis] - coordinate,
        None if given == [None; 3] => tool[axis],
        None => before[axis],
    });
    kept.put(name, Some(value))?;
    kept.tell(Some(name), arguments.place.instance.json)
}

fn clear(arguments: &OffsetClearArguments) -> Result<Exit, Failure> {
    let mut kept = Kept::open(&arguments.place)?;
    if arguments.system == "all" {
        kept.offsets = Offsets::default();
        kept.write()?;
        return kept.tell(None, arguments.place.instance.json);
    }
    let name = Name::read(&arguments.system)?;
    kept.put(name, None)?;
    kept.tell(Some(name), arguments.place.instance.json)
}

impl Name {
    fn read(text: &str) -> Result<Self, Failure> {
        if text.eq_ignore_ascii_case(TOOL) {
            return Ok(Self::Tool);
        }
        Offsets::system(text).map(Self::System).ok_or_else(|| {
            let known = SYSTEMS.join(", ");
            Failure::bad_input(format!("there is no system {text:?}: write {known} or {TOOL}"))
        })
    }
}

/// The coordinates that the arguments give [m].
fn given(arguments: &OffsetArguments) -> Result<[Option<f64>; 3], Failure> {
    let mut values = [None; 3];
    let texts = [("--x", &arguments.x), ("--y", &arguments.y), ("--z", &arguments.z)];
    for (value, (name, text)) in values.iter_mut().zip(texts) {
        if let Some(text) = text {
            let read = quantity::read::<Length>(text);
            *value = Some(
                read.map_err(|error| Failure::bad_input(format!("{name} {text:?}: {error}")))?,
            );
        }
    }
    Ok(values)
}

fn status(place: &OffsetPlace) -> Result<Value, Failure> {
    send_checked(&Request::Status, &mut connect(&place.instance)?, ANSWER_PATIENCE)
}

/// Where the tool of the machine with this status is [m]: known where its axes stand and know their place.
fn tool(status: &Value) -> Result<[f64; 3], Failure> {
    let state = status["state"].as_str().unwrap_or_default();
    if state != "idle" {
        let advice = if state == "disabled" { ": `graver enable`" } else { "" };
        return Err(Failure::stopped(format!(
            "where the tool is is not known while the machine is {state}{advice}"
        )));
    }
    if let Some(axis) = status["unhomed"].as_array().and_then(|axes| axes.first()?.as_str()) {
        return Err(Failure::stopped(format!("axis {axis} is not homed: `graver home`")));
    }
    serde_json::from_value(status["tool"].clone()).map_err(Failure::service)
}

/// The offsets of a machine file, and where they are kept.
struct Kept {
    machine: Machine,
    path: PathBuf,
    offsets: Offsets,
}

impl Kept {
    fn open(place: &OffsetPlace) -> Result<Self, Failure> {
        let file = match &place.machine {
            Some(file) => file.clone(),
            None => {
                let status = status(place)?;
                let file = status["machine_file"].as_str().map(PathBuf::from);
                file.ok_or_else(|| {
                    Failure::bad_input(
                        "the pipeline drives the built-in machine, which has no file to keep offsets \
                         beside: start it with --machine FILE",
                    )
                })?
            }
        };
        let machine = Machine::load(&file, &[])?;
        let path = Offsets::path(&file);
        let offsets = Offsets::read(&path)?;
        Ok(Self { machine, path, offsets })
    }

    /// What is in force under a name [m].
    fn value(&self, name: Name) -> [f64; 3] {
        let applied = self.offsets.applied(&self.machine);
        match name {
            Name::System(index) => applied.gcode.origins[index],
            Name::Tool => applied.gcode.tool_offset,
        }
    }

    fn put(&mut self, name: Name, value: Option<[f64; 3]>) -> Result<(), Failure> {
        match name {
            Name::System(index) => self.offsets.origins[index] = value,
            Name::Tool => self.offsets.tool = value,
        }
        self.write()
    }

    /// Writes the file as a whole: whoever reads it finds the old one or the new one.
    fn write(&self) -> Result<(), Failure> {
        let text = self.offsets.text();
        // What cannot be read again is not written.
        let name = self.path.display().to_string();
        Offsets::parse(&name, &text)?;
        replace(&self.path, text.as_bytes())
            .map_err(|error| Failure::output(format!("{name}: cannot be written: {error}")))
    }

    fn tell(&self, name: Option<Name>, json: bool) -> Result<Exit, Failure> {
        let report = self.report();
        if json {
            output::json(&report)?;
            return Ok(Exit::Done);
        }
        let point = |point: &[f64; 3]| {
            let [x, y, z] = point.map(|value| place(value, "m"));
            format!("x {x}, y {y}, z {z}")
        };
        for (index, system) in SYSTEMS.iter().enumerate() {
            let origin = &report.origins[*system];
            if name.is_none_or(|name| name == Name::System(index)) {
                let source = if origin.is_set { "" } else { " (machine file)" };
                say!("{system:<6} {}{source}", point(&origin.place));
            }
        }
        if name.is_none_or(|name| name == Name::Tool) {
            say!("{TOOL:<6} {}", report.tool.as_ref().map_or("none".to_owned(), point));
        }
        say!("{:<6} {}", "file", report.file);
        Ok(Exit::Done)
    }

    fn report(&self) -> OffsetsReport {
        let origins = SYSTEMS.iter().enumerate().map(|(index, system)| {
            let is_set = self.offsets.origins[index].is_some();
            ((*system).to_owned(), Origin { place: self.value(Name::System(index)), is_set })
        });
        OffsetsReport {
            file: self.path.display().to_string(),
            origins: origins.collect(),
            tool: self.offsets.tool,
        }
    }
}

/// Puts a file with this content in the place of the one at `path`.
fn replace(path: &Path, content: &[u8]) -> std::io::Result<()> {
    let unfinished = path.with_extension("toml.new");
    let mut file = File::create(&unfinished)?;
    file.write_all(content)?;
    file.sync_all()?;
    fs::rename(&unfinished, path)
}
