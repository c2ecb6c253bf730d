//! What the domain's holder tells the services: one file in the domain's root, so that all of
//! them are built from the same machine.

use crate::arguments::{DrivesArguments, DrivesKind, MachineArguments};
use crate::exit::Failure;
use crate::inputs::Overrides;
use drives::Deadlines;
use machine::Machine;
use runtime::Instance;
use runtime::thread::{Placement, RealtimeOptions, last_core};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const FILE: &str = "configuration.json";

/// The machine file as it was read, and how the services shall run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Configuration {
    /// The machine file with its text; `None` for the built-in machine.
    pub machine: Option<MachineText>,
    /// The values of `--set`.
    pub set: Vec<String>,
    /// What is driven.
    pub drives: Driven,
    /// Whether no deadline may slip.
    pub strict: bool,
    /// CPU of controller and drives.
    pub core: Option<usize>,
    /// Whether to ask for real-time scheduling.
    pub realtime: bool,
}

/// A machine file.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct MachineText {
    /// Where it is.
    pub file: PathBuf,
    /// What it says.
    pub text: String,
}

/// What is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Driven {
    /// The simulated plant.
    Simulated,
}

impl Configuration {
    /// The configuration that the command line asks for.
    ///
    /// # Errors
    /// A machine file that cannot be read, or a CPU that is not there.
    pub fn new(machine: &MachineArguments, drives: &DrivesArguments) -> Result<Self, Failure> {
        if let Some(core) = drives.core
            && core > last_core()
        {
            return Err(Failure::bad_input(format!(
                "--core {core}: the CPUs that this process may use end at {}",
                last_core()
            )));
        }
        let machine_text = match &machine.machine {
            None => None,
            Some(path) => {
                let text = std::fs::read_to_string(path)
                    .map_err(|error| Failure::bad_input(format!("{}: {error}", path.display())))?;
                let file = std::path::absolute(path).unwrap_or_else(|_| path.clone());
                Some(MachineText { file, text })
            }
        };
        Ok(Self {
            machine: machine_text,
            set: machine.set.clone(),
            drives: match drives.drives {
                DrivesKind::Sim => Driven::Simulated,
            },
            strict: drives.strict,
            core: drives.core,
            realtime: !drives.no_realtime,
        })
    }

    /// Writes it into the domain's root.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn write(&self, instance: &Instance) -> std::io::Result<()> {
        std::fs::write(path(instance), serde_json::to_vec(self)?)
    }

    /// Reads what the domain's holder wrote.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn read(instance: &Instance) -> std::io::Result<Self> {
        Ok(serde_json::from_slice(&std::fs::read(path(instance))?)?)
    }

    /// The machine that is planned for and controlled.
    ///
    /// # Errors
    /// A machine file or an override that does not hold.
    pub fn machine(&self) -> Result<Machine, Failure> {
        self.parse(&Overrides::sort(&self.set)?.machine)
    }

    /// The machine that is simulated.
    ///
    /// # Errors
    /// A machine file or an override that does not hold.
    pub fn plant(&self) -> Result<Machine, Failure> {
        let sorted = Overrides::sort(&self.set)?;
        let both: Vec<_> = sorted.machine.into_iter().chain(sorted.plant).collect();
        self.parse(&both)
    }

    fn parse(&self, overrides: &[machine::document::Override]) -> Result<Machine, Failure> {
        match &self.machine {
            Some(MachineText { file, text }) => {
                Machine::parse(&file.to_string_lossy(), text, overrides)
            }
            None => Machine::builtin_with(overrides),
        }
        .map_err(Failure::from)
    }

    /// Whether the clock may slip.
    pub fn deadlines(&self) -> Deadlines {
        if self.strict { Deadlines::Strict } else { Deadlines::Slipping }
    }

    /// The real-time set-up of a cyclic thread.
    pub fn realtime_options(&self, priority: i32) -> RealtimeOptions {
        RealtimeOptions {
            priority: self.realtime.then_some(priority),
            placement: self.core.map_or(Placement::Automatic, Placement::Core),
            lock_memory: self.realtime,
        }
    }
}

fn path(instance: &Instance) -> PathBuf {
    instance.root().join(FILE)
}
