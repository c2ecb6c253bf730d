//! The pipeline of this computer as its fleet sees it.

use crate::commands::serve::page::{describe, program};
use crate::inputs::Overrides;
use ::fleet::{Pipeline, Verdict};
use ::operator::fleet::JobRefusal;
use ::operator::{Client, Queue, Request, Status, Submitted};
use planner::job::one_file::other_file;
use planner::request::JobRequest;
use runtime::{Instance, message};
use serve::preview::{Previewer, check_changes};
use std::path::Path;

/// A pipeline behind its operators' socket.
pub(super) struct LocalPipeline {
    client: Client,
}

impl LocalPipeline {
    pub(super) fn new(instance: Instance) -> Self {
        Self { client: Client::new(instance) }
    }

    /// Plans a job as `graver serve` does one that was uploaded.
    fn plan(
        &self,
        file: &Path,
        set: &[String],
        is_given_up: &dyn Fn() -> bool,
    ) -> Result<Verdict, String> {
        let machine = describe(self.client.instance())?;
        let program = program().map_err(|failure| failure.refusal.message)?;
        let answer = Previewer::new(program).check_unless(file, set, &machine, is_given_up);
        if is_given_up() {
            return Err("it was given up".to_owned());
        }
        Ok(match &answer.error {
            None => Verdict::Fit,
            Some(error) => Verdict::Refused(JobRefusal {
                file: error.file.clone(),
                line: error.line,
                column: error.column,
                message: error.message.clone(),
            }),
        })
    }
}

/// Whether a job is one file, with changes of the job alone.
fn is_alone(file: &Path, set: &[String]) -> Result<(), JobRefusal> {
    check_changes(set).map_err(JobRefusal::new)?;
    let overrides =
        Overrides::sort(set).map_err(|failure| JobRefusal::new(failure.refusal.message))?.job;
    let content = std::fs::read(file).map_err(|error| JobRefusal::new(error.to_string()))?;
    let name = || file.file_name().map(|name| name.to_string_lossy().into_owned());
    match other_file(file, &content, &overrides) {
        None => Ok(()),
        Some(other) => Err(JobRefusal {
            file: other.line.and_then(|_| name()),
            line: other.line,
            column: None,
            message: other.to_string(),
        }),
    }
}

impl Pipeline for LocalPipeline {
    fn status(&self) -> Result<Status, String> {
        self.client.status().map_err(|error| error.to_string())
    }

    fn queue(&self) -> Result<Queue, String> {
        self.client.ask_for(&Request::Queue).map_err(|error| error.to_string())
    }

    fn check(&self, file: &Path, set: &[String], is_given_up: &dyn Fn() -> bool) -> Verdict {
        match is_alone(file, set) {
            Err(refusal) => Verdict::Refused(refusal),
            Ok(()) => self.plan(file, set, is_given_up).unwrap_or_else(Verdict::Unknown),
        }
    }

    fn submit(&self, file: &Path, set: &[String]) -> Result<u64, String> {
        let (job, set) = (Some(file.to_owned()), set.to_vec());
        let job = JobRequest { job, set, offsets: None, confined: true };
        let request = Request::Submit { job, out: None, detached: true };
        let submitted = self.client.ask_for::<Submitted>(&request);
        submitted.map(|submitted| submitted.number).map_err(|error| error.to_string())
    }

    fn tell(&self, text: &str) {
        message::tell(text);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_job_that_would_open_another_file_is_refused_unread() {
        let folder = tempfile::tempdir().unwrap();
        let refusal = |name: &str, text: &str, set: &[&str]| {
            let file = folder.path().join(name);
            std::fs::write(&file, text).unwrap();
            let set: Vec<String> = set.iter().map(|change| (*change).to_owned()).collect();
            is_alone(&file, &set).map_err(|refusal| refusal.to_string())
        };
        assert_eq!(refusal("a.ngc", "M2\n", &["marking.tolerance=0.1 mm"]), Ok(()));
        for (name, text, set, words) in [
            (
                "a.toml",
                "[gcode]\nfile = \"/etc/passwd\"\n",
                &[][..],
                "a.toml:2: `file = \"/etc/passwd\"`",
            ),
            ("a.toml", "[gcode]\nfile = 'b.ngc'\n", &[], "one file"),
            ("a.svg", "<svg/>", &["drawing.serial.csv=/etc/passwd"], "`csv = \"/etc/passwd\"`"),
            ("a.ngc", "M2\n", &["machine.path.jerk=1"], "machine's"),
        ] {
            let said = refusal(name, text, set).unwrap_err();
            assert!(said.contains(words), "{said}");
        }
    }
}
