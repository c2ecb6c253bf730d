//! What the domain's holder tells the services: one file in the domain's root, so that all of
//! them are built from the same machine.

use crate::arguments::{DrivesArguments, DrivesKind, PublishArguments};
use crate::exit::Failure;
use crate::inputs::MachineSource;
use drives::Deadlines;
use machine::{DrivesKind as MachineDrives, Machine};
use monitor::recording::file::parts::Extent;
use monitor::service::RecordingOptions;
use runtime::thread::{Placement, RealtimeOptions, last_core};
use runtime::{Instance, ServiceError};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Write;
use std::os::unix::fs::OpenOptionsExt;
use std::path::PathBuf;

const FILE: &str = "configuration.json";

/// What the services are built from, and how they shall run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Configuration {
    /// What machine and plant are built from.
    pub source: MachineSource,
    /// What is driven.
    pub drives: Driven,
    /// Whether no deadline may slip.
    pub strict: bool,
    /// CPU of controller and drives.
    pub core: Option<usize>,
    /// Whether to ask for real-time scheduling.
    pub realtime: bool,
    /// What stays of a recording.
    pub record: Extent,
    /// The fleet that the monitor speaks with.
    pub publish: PublishArguments,
}

/// What is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Driven {
    /// What the machine file says.
    Machine,
    /// The simulated plant.
    Simulated,
}

impl Configuration {
    /// The configuration that the command line asks for.
    ///
    /// # Errors
    /// A CPU that is not there.
    pub fn new(
        source: MachineSource,
        drives: &DrivesArguments,
        record: Extent,
    ) -> Result<Self, Failure> {
        if let Some(core) = drives.core
            && core > last_core()
        {
            return Err(Failure::bad_input(format!(
                "--core {core}: the CPUs that this process may use end at {}",
                last_core()
            )));
        }
        Ok(Self {
            source,
            drives: match drives.drives {
                DrivesKind::Machine => Driven::Machine,
                DrivesKind::Sim => Driven::Simulated,
            },
            strict: drives.strict,
            core: drives.core,
            realtime: !drives.no_realtime,
            record,
            publish: PublishArguments::default(),
        })
    }

    /// The same, for a machine of a fleet.
    ///
    /// # Errors
    /// A path without a folder to start from.
    pub fn publishing(mut self, publish: &PublishArguments) -> Result<Self, Failure> {
        let whole = |path: &Option<PathBuf>| path.as_deref().map(std::path::absolute).transpose();
        self.publish = PublishArguments {
            publish_credentials: whole(&publish.publish_credentials).map_err(Failure::bad_input)?,
            publish_ca: whole(&publish.publish_ca).map_err(Failure::bad_input)?,
            ..publish.clone()
        };
        Ok(self)
    }

    /// Writes it into the domain's root.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, instance: &Instance) -> Result<(), Failure> {
        let path = path(instance);
        let text = serde_json::to_vec(self).map_err(std::io::Error::other);
        let create = |text: Vec<u8>| {
            let mut file = File::options();
            file.write(true).create(true).truncate(true).mode(0o600).open(&path)?.write_all(&text)
        };
        text.and_then(create).map_err(|source| Failure::service(ServiceError::io(path, source)))
    }

    /// Reads what the domain's holder wrote.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read(instance: &Instance) -> Result<Self, Failure> {
        let path = path(instance);
        let text = std::fs::read(&path);
        text.and_then(|text| Ok(serde_json::from_slice(&text)?))
            .map_err(|source| Failure::service(ServiceError::io(path, source)))
    }

    /// The machine that is controlled, with the drives that it is to have.
    ///
    /// # Errors
    /// A machine that is not sound.
    pub fn machine(&self) -> Result<Machine, Failure> {
        let mut machine = self.source.machine()?;
        if self.drives == Driven::Simulated {
            machine.drives.kind = MachineDrives::Simulated;
            machine.operating.disconnect();
        }
        Ok(machine)
    }

    /// Whether the clock may slip under the drives of `machine`.
    pub fn deadlines(&self, machine: &Machine) -> Deadlines {
        let simulated = machine.drives.kind == MachineDrives::Simulated;
        if self.strict || !simulated { Deadlines::Strict } else { Deadlines::Slipping }
    }

    /// How the monitor records.
    pub fn recording(&self) -> RecordingOptions {
        let Extent { level, quota } = self.record;
        // A machine that was read can be written: at worst a recording does not carry it.
        let machine = serde_json::to_string(&self.source).unwrap_or_default();
        RecordingOptions { machine, level, quota }
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
