//! `graver compare`: machines on the same jobs.

use crate::arguments::{CompareArguments, MachineArguments};
use crate::exit::{Exit, Failure};
use crate::files::Sources;
use crate::inputs;
use crate::output::{self, say};
use machine::Machine;
use planner::request::JobRequest;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use workbench::compare::{Comparison, Contender, Settings, Weights, compare};
use workbench::thesis::machines::{Manner, ThesisMachine, series};
use workbench::thesis::tables;

/// Runs the command.
///
/// # Errors
/// A machine file that does not hold, a weight that is none, or a folder that cannot be written.
pub fn run(arguments: &CompareArguments) -> Result<Exit, Failure> {
    let mut weights = Weights::default();
    for text in &arguments.weight {
        weights.set(text).map_err(|error| Failure::bad_input(format!("--weight: {error}")))?;
    }
    let is_thesis = arguments.machine.is_empty() && arguments.job.is_none();
    let mut sources = Sources::default();
    let contenders = if is_thesis { thesis(arguments)? } else { named(arguments, &mut sources)? };
    let settings = Settings { seeds: arguments.seeds, weights };
    let mut comparison = compare(&contenders, &settings).map_err(Failure::bad_input)?;
    if is_thesis {
        for (index, letter) in series().iter().enumerate() {
            comparison.name_job(index, &letter.name());
        }
        let report = tables(&["7-1".to_owned()]).map_err(Failure::bad_input)?;
        comparison.table_7_1 = report.tables.into_iter().next();
        comparison.errata = report.errata;
    }
    if let Some(folder) = &arguments.out {
        write(folder, &comparison, &mut sources)?;
    }
    if arguments.json {
        output::json(&comparison)?;
    } else {
        say!("{}", comparison.text().trim_end());
        if let Some(table) = &comparison.table_7_1 {
            say!("\n{}", table.text().trim_end());
        }
    }
    let all_refused = comparison.machines.iter().all(|machine| machine.refused.is_some());
    Ok(if all_refused { Exit::BadInput } else { Exit::Done })
}

/// The machines that the command line names, on its job or the sample job of the first.
fn named(arguments: &CompareArguments, sources: &mut Sources) -> Result<Vec<Contender>, Failure> {
    let files: Vec<Option<PathBuf>> = if arguments.machine.is_empty() {
        vec![None]
    } else {
        arguments.machine.iter().cloned().map(Some).collect()
    };
    let mut job: Option<JobRequest> = None;
    let mut contenders = Vec::with_capacity(files.len());
    for file in files {
        let of = MachineArguments { machine: file.clone(), set: arguments.set.clone() };
        let input = inputs::machine(&of)?;
        let job = job.get_or_insert_with(|| {
            let folder = input.folder.as_deref();
            let named = arguments.job.as_deref();
            inputs::job_request(named, &input.machine, folder, &input.job_overrides)
        });
        if let Some(path) = &file {
            *sources = std::mem::take(sources).and_machine(path);
        }
        // A job that cannot be read is refused for each machine.
        if let Ok(read) = job.open(&input.machine) {
            sources.add_job(&read.files);
        }
        contenders.push(Contender {
            file: file.map(|path| path.display().to_string()),
            machine: input.machine,
            plant: input.plant,
            jobs: vec![job.clone()],
        });
    }
    Ok(contenders)
}

/// The four machines of source 003 on its twelve letters.
fn thesis(arguments: &CompareArguments) -> Result<Vec<Contender>, Failure> {
    if !arguments.set.is_empty() {
        let message =
            "--set: the source's machines and letters are as they are; name a machine or a job";
        return Err(Failure::bad_input(message));
    }
    let jobs: Vec<JobRequest> =
        series().iter().map(|letter| letter.request(Manner::Printed)).collect();
    let contender = |which: ThesisMachine| {
        let machine: Machine = which.machine()?;
        let file = Some(which.file().to_owned());
        Ok::<_, Failure>(Contender { file, plant: machine.clone(), machine, jobs: jobs.clone() })
    };
    ThesisMachine::ALL.into_iter().map(contender).collect()
}

/// Writes the page, the figures and the pictures into `folder`.
fn write(folder: &Path, comparison: &Comparison, sources: &mut Sources) -> Result<(), Failure> {
    let failed = |path: &Path, error: &dyn std::fmt::Display| {
        Failure::bad_input(format!("--out: cannot write {}: {error}", path.display()))
    };
    fs::create_dir_all(folder).map_err(|error| failed(folder, &error))?;
    let mut files = comparison.pictures().map_err(Failure::output)?;
    files.push(("compare.html".to_owned(), comparison.page().map_err(Failure::output)?));
    let text = serde_json::to_string_pretty(comparison).map_err(Failure::output)?;
    files.push(("compare.json".to_owned(), text + "\n"));
    files.push(("compare.csv".to_owned(), comparison.csv()));
    if let Some(table) = &comparison.table_7_1 {
        files.push(("table_7-1.csv".to_owned(), table.csv()));
    }
    for (name, content) in files {
        let path = folder.join(name);
        let mut file = sources.create("--out", &path)?;
        file.write_all(content.as_bytes()).map_err(|error| failed(&path, &error))?;
    }
    Ok(())
}
