//! Machine, job and their overrides, as the command line names them.

use crate::arguments::{JobOptions, MachineArguments};
use crate::exit::Failure;
use machine::Machine;
use machine::document::{Attachment, Attachments, Document, Override};
use machine::machine::{BUILTIN, BUILTIN_NAME};
use planner::request::{JobRequest, OffsetsFile};
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// What machine and plant are built from: read once, and the same for every process.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct MachineSource {
    /// The machine file; `None` for the built-in machine.
    file: Option<MachineText>,
    /// The values of `--set`.
    set: Vec<String>,
    /// The files that the machine file names.
    #[serde(default)]
    files: Vec<NamedText>,
}

/// A machine file as it was read.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct MachineText {
    path: PathBuf,
    text: String,
}

/// A file that the machine file names, as it was read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct NamedText {
    /// As the machine file names it.
    name: String,
    path: PathBuf,
    /// Why there is none, where it could not be read.
    text: Result<String, String>,
}

impl NamedText {
    /// Reads the file called `name` in `folder`.
    fn read(name: String, folder: &Path) -> Self {
        let Attachment { path, text } = Attachment::read(folder.join(&name));
        Self { name, path, text }
    }
}

impl MachineSource {
    /// Reads the machine file, if one is named, and the files that it names.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read(arguments: &MachineArguments) -> Result<Self, Failure> {
        let read = |path: &PathBuf| {
            Ok::<_, Failure>(MachineText { path: path.clone(), text: Document::text(path)? })
        };
        let file = arguments.machine.as_ref().map(read).transpose()?;
        let mut source = Self { file, set: arguments.set.clone(), files: Vec::new() };
        source.files = source.files_now();
        Ok(source)
    }

    /// The files that the machine file names, for the machine and for the plant, as they are now.
    fn files_now(&self) -> Vec<NamedText> {
        // Settings that cannot be read are refused where the machine is built.
        let Ok(sorted) = Overrides::sort(&self.set) else { return Vec::new() };
        let text = self.file.as_ref().map(|file| file.text.as_str());
        let mut names = Machine::files_named(text, &sorted.machine, &[]);
        names.extend(Machine::files_named(text, &sorted.machine, &sorted.plant));
        names.sort();
        names.dedup();
        let folder = self.file.as_ref().and_then(|file| file.path.parent());
        let folder = folder.unwrap_or_else(|| Path::new(""));
        names.into_iter().map(|name| NamedText::read(name, folder)).collect()
    }

    /// The machine that is planned for and controlled.
    ///
    /// # Errors
    /// A machine file or an override that does not hold.
    pub fn machine(&self) -> Result<Machine, Failure> {
        self.build(&Overrides::sort(&self.set)?.machine, &[])
    }

    /// The machine that is simulated: the same, but for `--set plant.…`.
    ///
    /// # Errors
    /// A machine file or an override that does not hold.
    pub fn plant(&self) -> Result<Machine, Failure> {
        let sorted = Overrides::sort(&self.set)?;
        self.build(&sorted.machine, &sorted.plant)
    }

    /// The name and the text of the machine file, the built-in one where none was named.
    pub fn file(&self) -> (String, &str) {
        match &self.file {
            Some(file) => (file.path.display().to_string(), &file.text),
            None => (BUILTIN_NAME.to_owned(), BUILTIN),
        }
    }

    /// The name of the file that the machine file has at the dotted `key`, without the changes of `--set`.
    pub fn file_at(&self, key: &str) -> Option<String> {
        Machine::file_at(self.file().1, key)
    }

    /// The path of the machine file, as it holds from anywhere; `None` for the built-in machine.
    pub fn path(&self) -> Option<PathBuf> {
        let path = &self.file.as_ref()?.path;
        Some(std::path::absolute(path).unwrap_or_else(|_| path.clone()))
    }

    /// Arguments with which another `graver` has the same machine.
    ///
    /// # Errors
    /// A machine file that is not what it was when it was read.
    pub fn arguments(&self) -> Result<Vec<OsString>, Failure> {
        let mut arguments = Vec::new();
        if let (Some(file), Some(path)) = (&self.file, self.path()) {
            if Document::text(&path)? != file.text || self.files_now() != self.files {
                return Err(Failure::bad_input(format!(
                    "{} or a file that it names was changed after the pipeline had been started: start it again",
                    path.display()
                )));
            }
            arguments.extend(["--machine".into(), path.into_os_string()]);
        }
        let own = self.set.iter().filter(|change| change.starts_with("machine."));
        arguments.extend(own.map(|change| format!("--set={change}").into()));
        Ok(arguments)
    }

    /// The offsets that people have set beside the machine file, as they are now.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn offsets(&self) -> Result<Option<OffsetsFile>, Failure> {
        match &self.file {
            Some(file) => Ok(OffsetsFile::beside(&file.path)?),
            None => Ok(None),
        }
    }

    fn build(&self, machine: &[Override], plant: &[Override]) -> Result<Machine, Failure> {
        let name = self.file.as_ref().map(|file| file.path.display().to_string());
        let text = self.file.as_ref().map(|file| file.text.as_str());
        let files = self.files.iter().map(|file| {
            let attachment = Attachment { path: file.path.clone(), text: file.text.clone() };
            (file.name.clone(), attachment)
        });
        let files = Attachments::Read(files.collect());
        Ok(Machine::simulated(name.as_deref().zip(text), files, machine, plant)?)
    }
}

/// What the arguments `--machine` and `--set` say together.
#[derive(Debug, Clone)]
pub struct MachineInput {
    /// What machine and plant are built from.
    pub source: MachineSource,
    /// The machine that is planned for and controlled.
    pub machine: Machine,
    /// The machine that is simulated: the same, but for `--set plant.…`.
    pub plant: Machine,
    /// Where the machine file is, `None` for the built-in one.
    pub folder: Option<PathBuf>,
    /// Changes of the job.
    pub job_overrides: Vec<Override>,
}

/// Reads the machine and sorts the overrides by what they change.
///
/// # Errors
/// A machine file or an override that does not hold.
pub fn machine(arguments: &MachineArguments) -> Result<MachineInput, Failure> {
    let source = MachineSource::read(arguments)?;
    Ok(MachineInput {
        machine: source.machine()?,
        plant: source.plant()?,
        folder: arguments.machine.as_deref().and_then(Path::parent).map(Path::to_owned),
        job_overrides: Overrides::sort(&arguments.set)?.job,
        source,
    })
}

impl MachineInput {
    /// With what `options` change of the job.
    #[must_use]
    pub fn with(mut self, options: &JobOptions) -> Self {
        self.job_overrides.extend(options.overrides());
        self
    }
}

/// The job that the command line names, or the machine's sample job, or the built-in one.
///
/// `machine_folder` is what the machine file's own paths are relative to.
pub fn job_request(
    job: Option<&Path>,
    machine: &Machine,
    machine_folder: Option<&Path>,
    set: &[Override],
) -> JobRequest {
    let sample = || {
        let sample = machine.sample_job.as_ref()?;
        Some(machine_folder?.join(sample))
    };
    JobRequest {
        job: job.map(Path::to_owned).or_else(sample),
        set: set.iter().map(|change| format!("{}={}", change.key, change.value)).collect(),
        offsets: None,
        confined: false,
    }
}

/// Overrides by what they change.
#[derive(Debug, Clone, Default)]
pub struct Overrides {
    /// `machine.…`, without the prefix.
    pub machine: Vec<Override>,
    /// `plant.…`, without the prefix.
    pub plant: Vec<Override>,
    /// Everything else.
    pub job: Vec<Override>,
}

impl Overrides {
    /// Sorts the values of `--set`.
    ///
    /// # Errors
    /// A value that is not `KEY=VALUE`.
    pub fn sort(values: &[String]) -> Result<Self, Failure> {
        let mut sorted = Self::default();
        for value in values {
            let change: Override = value.parse().map_err(Failure::bad_input)?;
            if let Some(key) = change.key.strip_prefix("machine.") {
                sorted.machine.push(Override { key: key.to_owned(), ..change });
            } else if let Some(key) = change.key.strip_prefix("plant.") {
                sorted.plant.push(Override { key: key.to_owned(), ..change });
            } else {
                sorted.job.push(change);
            }
        }
        Ok(sorted)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn source(machine: Option<PathBuf>, set: &[&str]) -> MachineSource {
        let set = set.iter().map(|change| (*change).to_owned()).collect();
        MachineSource::read(&MachineArguments { machine, set }).unwrap()
    }

    #[test]
    fn a_file_edited_after_it_was_read_changes_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        let original = concat!(env!("CARGO_MANIFEST_DIR"), "/machines/cartesian.toml");
        std::fs::copy(original, &path).unwrap();
        let source = source(Some(path.clone()), &[]);
        let before = source.machine().unwrap();
        let arguments = source.arguments().unwrap();
        assert_eq!(arguments, ["--machine".into(), path.clone().into_os_string()]);
        std::fs::write(&path, "no machine any more").unwrap();
        let text = source.arguments().unwrap_err().refusal.text;
        assert!(text.contains("was changed"), "{text}");
        assert_eq!(source.machine().unwrap(), before);
        // As the services read it from the domain's holder.
        let sent: MachineSource =
            serde_json::from_slice(&serde_json::to_vec(&source).unwrap()).unwrap();
        assert_eq!((sent.machine().unwrap(), sent.plant().unwrap()), (before.clone(), before));
    }

    #[test]
    fn a_mesh_is_read_with_the_machine_file_and_only_then() {
        let folder = tempfile::tempdir().unwrap();
        let (path, mesh) = (folder.path().join("mine.toml"), folder.path().join("mesh.csv"));
        let text = std::fs::read_to_string(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/machines/cartesian.toml"
        ))
        .unwrap();
        std::fs::write(&path, format!("{text}\n[frame.mesh]\nfile = \"mesh.csv\"\n")).unwrap();
        let missing = source(Some(path.clone()), &[]).machine().unwrap_err().refusal;
        assert_eq!(missing.file.as_deref(), path.to_str());
        assert!(missing.message.contains("mesh.csv cannot be read"), "{missing:?}");
        let points = |middle: &str| {
            let at = |x: f64, y: f64| {
                format!("{x},{y},{}\n", if [x, y] == [0.0, 0.0] { middle } else { "0" })
            };
            let rows = [-200.0, 0.0, 200.0];
            let all: String = rows.iter().flat_map(|y| rows.map(|x| at(x, *y))).collect();
            format!("x [mm],y [mm],dx [um]\n{all}")
        };
        std::fs::write(&mesh, points("25")).unwrap();
        let source = source(Some(path.clone()), &[]);
        let before = source.machine().unwrap();
        assert!(source.arguments().is_ok());
        std::fs::write(&mesh, points("nothing")).unwrap();
        assert_eq!(source.machine().unwrap(), before);
        let text = source.arguments().unwrap_err().refusal.text;
        assert!(text.contains("was changed"), "{text}");
        let sent: MachineSource =
            serde_json::from_slice(&serde_json::to_vec(&source).unwrap()).unwrap();
        assert_eq!(sent.machine().unwrap(), before);
        let read = MachineSource::read(&MachineArguments { machine: Some(path), set: Vec::new() });
        let wrong = read.unwrap().machine().unwrap_err().refusal;
        assert_eq!((wrong.file.as_deref(), wrong.line), (mesh.to_str(), Some(6)), "{wrong:?}");
        assert!(wrong.message.starts_with("`nothing` is no number"), "{wrong:?}");
    }

    #[test]
    fn only_the_plant_has_the_plants_keys_and_names_them_as_they_were_written() {
        let both = source(None, &["machine.path.jerk=400 m/s^3", "plant.path.jerk=300 m/s^3"]);
        assert_eq!(both.machine().unwrap().path.jerk, 400.0);
        assert_eq!(both.plant().unwrap().path.jerk, 300.0);
        let wrong = source(None, &["plant.path.jrk=3"]);
        assert!(wrong.machine().is_ok());
        let text = wrong.plant().unwrap_err().refusal.text;
        assert!(text.contains("--set plant.path.jrk=3"), "{text}");
    }
}
