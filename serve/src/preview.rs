//! What a job would come to, read and planned by a process of its own: a file that a stranger sent has so much time and
//! memory, and takes nothing with it when it breaks its reader.

use crate::machine_facts::Box3;
use crate::outline::Strokes;
use crate::pipeline::Description;
use messages::plan::Note;
use runtime::bounded::{self, Bounds};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::VecDeque;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// What planning a job may take.
const BOUNDS: Bounds = Bounds { time: Duration::from_secs(120), memory: 4 << 30, output: 16 << 20 };

/// Results that are kept: a job is checked, looked at, and looked at again.
const KEPT: usize = 8;

/// The longest list of changes, and the longest change [bytes].
const MOST_CHANGES: usize = 64;
const LONGEST_CHANGE: usize = 1024;

/// What is wrong with a job, and where.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct JobError {
    /// The file at fault; null where it is none.
    pub file: Option<String>,
    /// Line from 1.
    pub line: Option<u64>,
    /// Column from 1.
    pub column: Option<u64>,
    /// What is wrong, and what would be right.
    pub message: String,
}

/// Whether the machine can do a job, and what it comes to.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CheckAnswer {
    /// Whether it can.
    pub ok: bool,
    /// Why it cannot; null where it can.
    pub error: Option<JobError>,
    /// From the first motion to the last [s]; null of one that it cannot do, as all that follows.
    pub time: Option<f64>,
    /// Strokes and dots that it marks.
    pub strokes: Option<u64>,
    /// Length that it marks [m].
    pub length: Option<f64>,
    /// The least and the greatest power while it is lit, 0 to 1.
    pub power: Option<[f64; 2]>,
    /// The box around what it marks.
    pub bounds: Option<Box3>,
    /// How far from home it was put where it says no place of its own and has no room there, in x and y [m]; null of
    /// any other.
    pub placed: Option<[f64; 2]>,
    /// Warnings about the machine that bear on it.
    pub warnings: Vec<String>,
    /// Remarks on the job.
    pub notes: Vec<Note>,
}

impl CheckAnswer {
    fn refused(error: JobError) -> Self {
        Self {
            ok: false,
            error: Some(error),
            time: None,
            strokes: None,
            length: None,
            power: None,
            bounds: None,
            placed: None,
            warnings: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// What `graver plan --json` and its words for people say.
    fn planned(told: &Value, said: &str) -> Self {
        let list = |key: &str| serde_json::from_value(told[key].clone()).unwrap_or_default();
        let warnings = said.lines().filter_map(|line| line.strip_prefix("warning: "));
        Self {
            ok: true,
            error: None,
            time: told["time"].as_f64(),
            strokes: told["strokes"].as_u64(),
            length: told["length"].as_f64(),
            power: serde_json::from_value(told["power"].clone()).unwrap_or_default(),
            bounds: serde_json::from_value(told["bounds"].clone()).unwrap_or_default(),
            placed: serde_json::from_value(told["placed"].clone()).unwrap_or_default(),
            warnings: warnings.map(str::to_owned).collect(),
            notes: list("notes"),
        }
    }
}

/// What a job would mark, or why that cannot be told.
pub type Drawn = Result<Strokes, JobError>;

/// What a result is known by: file, changes, machine.
type Key = (PathBuf, Vec<String>, Vec<OsString>);

/// The newest results.
type Kept<T> = Mutex<VecDeque<(Key, Arc<T>)>>;

/// Checks and draws jobs, one at a time each: planning takes a whole core, and the machine has others to do.
#[derive(Debug)]
pub struct Previewer {
    program: PathBuf,
    checks: Kept<CheckAnswer>,
    drawings: Kept<Drawn>,
}

impl Previewer {
    /// One that has `program` do it.
    pub fn new(program: PathBuf) -> Self {
        Self { program, checks: Mutex::default(), drawings: Mutex::default() }
    }

    /// What the job at `path` with these changes would come to on the machine that is described.
    pub fn check(&self, path: &Path, set: &[String], machine: &Description) -> Arc<CheckAnswer> {
        known(&self.checks, (path.to_owned(), set.to_vec(), machine.arguments.clone()), |key| {
            self.run(key, &["--json".into()], &|| false)
                .map_or_else(CheckAnswer::refused, |(told, said)| {
                    CheckAnswer::planned(&told, &said)
                })
        })
    }

    /// As [`Self::check`], until `is_given_up` says that nobody waits for it any more; kept is nothing.
    pub fn check_unless(
        &self,
        path: &Path,
        set: &[String],
        machine: &Description,
        is_given_up: &dyn Fn() -> bool,
    ) -> CheckAnswer {
        let key = (path.to_owned(), set.to_vec(), machine.arguments.clone());
        let planned = self.run(&key, &["--json".into()], is_given_up);
        planned.map_or_else(CheckAnswer::refused, |(told, said)| CheckAnswer::planned(&told, &said))
    }

    /// What the job at `path` with these changes would mark.
    pub fn draw(&self, path: &Path, set: &[String], machine: &Description) -> Arc<Drawn> {
        known(&self.drawings, (path.to_owned(), set.to_vec(), machine.arguments.clone()), |key| {
            let folder = tempfile::tempdir().map_err(|error| failed(error.to_string()))?;
            let file = folder.path().join("preview.json");
            let arguments =
                ["--json".into(), "--preview-only".into(), "--preview".into(), file.clone().into()];
            self.run(key, &arguments, &|| false)?;
            let drawn = std::fs::read(&file).map_err(|error| failed(error.to_string()))?;
            serde_json::from_slice(&drawn).map_err(|error| failed(error.to_string()))
        })
    }

    /// What `graver plan` says on standard output, as JSON, and on standard error.
    fn run(
        &self,
        (path, set, machine): &Key,
        arguments: &[OsString],
        is_given_up: &dyn Fn() -> bool,
    ) -> Result<(Value, String), JobError> {
        let mut command = Command::new(&self.program);
        command.arg("plan").args(arguments).args(machine).arg("--confined");
        set.iter().for_each(|change| {
            command.arg(format!("--set={change}"));
        });
        command.arg("--").arg(path);
        let ended = bounded::run(command, &BOUNDS, is_given_up)
            .map_err(|error| failed(format!("the job could not be planned: {error}")))?;
        let said = String::from_utf8_lossy(&ended.error).into_owned();
        let told: Value = serde_json::from_slice(&ended.output).unwrap_or_default();
        if told["error"].is_object() {
            let mut error: JobError = serde_json::from_value(told["error"].clone())
                .map_err(|error| failed(error.to_string()))?;
            // Where the server keeps it is of no use to whoever sent it.
            error.file = error.file.map(|file| file_name(&file));
            if let Some(folder) = path.parent() {
                error.message = error.message.replace(&format!("{}/", folder.display()), "");
            }
            return Err(error);
        }
        if !ended.status.success() {
            let said: String = said.trim().chars().take(500).collect();
            return Err(failed(format!("the job could not be planned: {said}")));
        }
        Ok((told, said))
    }
}

fn failed(message: String) -> JobError {
    JobError { file: None, line: None, column: None, message }
}

/// The result for `key`, kept from before or made now. Whoever asks while another is made waits for his turn.
fn known<T>(kept: &Kept<T>, key: Key, make: impl FnOnce(&Key) -> T) -> Arc<T> {
    let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, result)) = kept.iter().find(|(known, _)| *known == key) {
        return result.clone();
    }
    let result = Arc::new(make(&key));
    if kept.len() == KEPT {
        kept.pop_front();
    }
    kept.push_back((key, result.clone()));
    result
}

/// The last part of a path.
fn file_name(path: &str) -> String {
    Path::new(path).file_name().map_or(path.to_owned(), |name| name.to_string_lossy().into_owned())
}

/// Whether a list of changes may be handed on.
///
/// # Errors
/// Which of them may not, and why.
pub fn check_changes(set: &[String]) -> Result<(), String> {
    if set.len() > MOST_CHANGES {
        return Err(format!("set: {} changes are too many: at most {MOST_CHANGES}", set.len()));
    }
    for change in set {
        let Some((key, _)) = change.split_once('=') else {
            return Err(format!("set: {change:?} is not KEY=VALUE"));
        };
        if change.len() > LONGEST_CHANGE || change.contains('\0') {
            return Err(format!("set: the value of {key:?} is too long or has a zero in it"));
        }
        let key = key.trim();
        // The machine that runs is what it is.
        if key.starts_with("machine.") || key.starts_with("plant.") {
            return Err(format!(
                "set: {key} is the machine's; a job can change its own values only"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use machine::Machine;
    use std::os::unix::fs::PermissionsExt;

    /// A program that notes its arguments, says `answer`, and draws `drawing` where it shall.
    fn program(folder: &Path, answer: &str, drawing: &str) -> PathBuf {
        let path = folder.join("graver");
        let script = format!(
            "#!/bin/sh\nprintf '%s\\n' \"$@\" >> {0}/arguments\n[ \"$4\" = --preview ] || echo 'warning: hot' >&2\n\
             [ \"$4\" = --preview ] && echo '{drawing}' > \"$5\"\ncat <<'END'\n{answer}\nEND\n",
            folder.display()
        );
        std::fs::write(&path, script).unwrap();
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o700)).unwrap();
        path
    }

    fn description() -> Description {
        let arguments = vec!["--machine".into(), "mine.toml".into()];
        Description { machine: Machine::builtin(), arguments }
    }

    #[test]
    fn a_job_is_planned_once_with_its_changes_and_its_machine() {
        let folder = tempfile::tempdir().unwrap();
        let answer = r#"{"name":"a","time":1.5,"strokes":2,"length":0.1,"power":[0.2,0.8],
            "bounds":{"lower":[0,0,0],"upper":[1,1,0]},"notes":[{"line":3,"text":"n"}]}"#;
        let previewer = Previewer::new(program(folder.path(), answer, ""));
        let set = ["letters.text=--json".to_owned()];
        let job = folder.path().join("-a.svg");
        let check = previewer.check(&job, &set, &description());
        assert_eq!((check.ok, check.time, check.strokes), (true, Some(1.5), Some(2)), "{check:?}");
        assert_eq!(check.bounds.unwrap().upper, [1.0, 1.0, 0.0]);
        assert_eq!((check.power, check.notes[0].line), (Some([0.2, 0.8]), 3));
        assert_eq!(check.warnings, ["hot"]);
        assert!(Arc::ptr_eq(&check, &previewer.check(&job, &set, &description())));
        let given = std::fs::read_to_string(folder.path().join("arguments")).unwrap();
        let job = job.display();
        let expected = format!(
            "plan\n--json\n--machine\nmine.toml\n--confined\n--set=letters.text=--json\n--\n{job}\n"
        );
        assert_eq!(given, expected);
    }

    #[test]
    fn a_job_is_drawn_without_being_planned() {
        let folder = tempfile::tempdir().unwrap();
        let drawing = r#"{"strokes":[[[0,0,0],[1,1,0]]],"bounds":{"lower":[0,0,0],"upper":[1,1,0]},"tolerance":1e-5}"#;
        let previewer = Previewer::new(program(folder.path(), "", drawing));
        let drawn = previewer.draw(&folder.path().join("a.svg"), &[], &description());
        let drawn = drawn.as_ref().as_ref().unwrap();
        assert_eq!(drawn.strokes, [vec![[0.0; 3], [1.0, 1.0, 0.0]]]);
    }

    #[test]
    fn what_is_wrong_with_a_job_is_told_without_the_servers_paths() {
        let folder = tempfile::tempdir().unwrap();
        let job = folder.path().join("a.ngc");
        let answer = format!(
            r#"{{"outcome":"refused","error":{{"file":"{0}","line":2,"column":5,"message":"{0}: no"}}}}"#,
            job.display()
        );
        let previewer = Previewer::new(program(folder.path(), &answer, ""));
        let check = previewer.check(&job, &[], &description());
        let error = check.error.as_ref().unwrap();
        assert_eq!((error.file.as_deref(), error.line), (Some("a.ngc"), Some(2)));
        assert!(!check.ok && check.time.is_none());
        let drawn = previewer.draw(&job, &[], &description());
        assert_eq!(drawn.as_ref().as_ref().unwrap_err().message, "a.ngc: no");
        let none = Previewer::new(folder.path().join("none")).check(&job, &[], &description());
        assert!(none.error.as_ref().unwrap().message.contains("could not be planned"), "{none:?}");
    }

    #[test]
    fn changes_that_are_none_or_not_the_jobs_are_refused() {
        let change = |text: &str| check_changes(&[text.to_owned()]);
        assert_eq!(change("letters.text=S"), Ok(()));
        for (text, word) in [
            ("letters.text", "KEY=VALUE"),
            ("machine.path.jerk=1", "machine's"),
            ("plant.axis=1", "machine's"),
            (&format!("a={}", "x".repeat(2000)), "too long"),
        ] {
            assert!(change(text).unwrap_err().contains(word), "{text}");
        }
        assert!(check_changes(&vec!["a=1".to_owned(); 65]).unwrap_err().contains("64"));
    }
}
