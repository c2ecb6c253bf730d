//! `graver figures`: pictures of machines, motors and jobs, with the numbers that they show.

use crate::arguments::{FiguresArguments, MachineArguments};
use crate::exit::{Exit, Failure};
use crate::files::Sources;
use crate::inputs::{self, MachineInput};
use crate::output::{self, say};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};
use workbench::figures::{
    Figure, Figures, Name, Subject, SubjectJob, Table, draw_all, index, source_machines,
};

/// What `figures --json` prints.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct FiguresReport {
    /// The folder that the files are in.
    pub folder: PathBuf,
    /// The page of all figures, in that folder.
    pub page: String,
    /// The figures, in order.
    pub figures: Vec<FigureReport>,
    /// What could not be drawn.
    pub skipped: Vec<SkippedReport>,
}

/// A figure and its files.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct FigureReport {
    /// What it shows, by the name on the command line.
    pub name: String,
    /// The figure of source 003, such as `3-11`; null where it has none.
    pub source: Option<String>,
    /// What it is.
    pub title: String,
    /// The picture, in the folder.
    pub svg: String,
    /// What it shows, in the folder; SI units and radians.
    pub csv: String,
    /// Rows of that file, its line of names apart.
    pub rows: usize,
    /// Further numbers that belong to it, in the folder.
    pub more: Vec<String>,
    /// The picture's axes.
    pub axes: AxesReport,
}

/// What the axes of a picture are.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct AxesReport {
    /// Across, with the unit.
    pub x: String,
    /// Up, with the unit.
    pub y: String,
}

/// A figure that could not be drawn.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct SkippedReport {
    /// What it would show.
    pub name: String,
    /// Of which machine and job.
    pub of: String,
    /// Why not.
    pub why: String,
}

/// Runs the command.
///
/// # Errors
/// A machine or job that does not read, files that cannot be written, or nothing that could be drawn.
pub fn run(arguments: &FiguresArguments) -> Result<Exit, Failure> {
    let (names, job) = asked(&arguments.what)?;
    let read: Vec<PathBuf> = job.map(Path::to_owned).into_iter().collect();
    let mut sources = Sources::new(None, &read);
    let subjects = subjects(arguments, job, &mut sources)?;
    let of_source = arguments.machine.is_empty();
    let figures = draw_all(&names, &subjects, of_source).map_err(Failure::bad_input)?;
    if figures.figures.is_empty() {
        let why = figures.skipped.iter().map(|one| format!("{}: {}", one.of, one.why));
        let why: Vec<String> = why.collect();
        return Err(Failure::bad_input(format!("nothing could be drawn\n{}", why.join("\n"))));
    }
    write(&figures, "--out", &arguments.out, &mut sources)?;
    if arguments.json {
        output::json(&report(&figures, &arguments.out))?;
    } else {
        for one in &figures.skipped {
            say!("not drawn: {} of {}: {}", one.name.word(), one.of, one.why);
        }
        let page = arguments.out.join(PAGE);
        say!("{} figures, listed in {}", figures.figures.len(), page.display());
    }
    Ok(Exit::Done)
}

/// The page of all figures.
pub(super) const PAGE: &str = "index.html";

/// The names of figures, all where none is given, and the job.
fn asked(what: &[String]) -> Result<(Vec<Name>, Option<&Path>), Failure> {
    let mut names = Vec::new();
    let mut job = None;
    for word in what {
        if let Some(name) = Name::ALL.into_iter().find(|name| name.word() == word) {
            names.push(name);
        } else if job.is_some() || !Path::new(word).exists() {
            let known = Name::ALL.map(Name::word).join(", ");
            return Err(Failure::bad_input(format!(
                "{word} is neither a figure nor a job that is there, or a second job; the figures are \
                 {known}"
            )));
        } else {
            job = Some(Path::new(word));
        }
    }
    if names.is_empty() {
        names = Name::ALL.to_vec();
    }
    Ok((names, job))
}

/// The machines that are asked for with what they mark, and what is read for them.
fn subjects(
    arguments: &FiguresArguments,
    job: Option<&Path>,
    sources: &mut Sources,
) -> Result<Vec<Subject>, Failure> {
    let mut subjects = Vec::new();
    if arguments.machine.is_empty() {
        if let Some(change) = arguments.set.iter().find(|change| change.starts_with("machine.")) {
            let text = format!("--set {change}: name the machine that it changes by --machine");
            return Err(Failure::bad_input(text));
        }
        subjects = source_machines()?;
        if let Some(path) = job {
            for subject in &mut subjects {
                let request = planner::request::JobRequest {
                    job: Some(path.to_owned()),
                    set: arguments.set.clone(),
                    offsets: None,
                    confined: false,
                };
                subject.jobs = vec![subject_job(&request, &subject.machine, sources)?];
            }
        }
    }
    for path in &arguments.machine {
        let one = MachineArguments { machine: Some(path.clone()), set: arguments.set.clone() };
        let MachineInput { machine, folder, job_overrides, .. } = inputs::machine(&one)?;
        *sources = std::mem::take(sources).and_machine(path);
        let request = inputs::job_request(job, &machine, folder.as_deref(), &job_overrides);
        let jobs = match request.job {
            Some(_) => vec![subject_job(&request, &machine, sources)?],
            None => Vec::new(),
        };
        let stem = stem(path, &subjects);
        subjects.push(Subject { stem, machine, chapter: None, jobs });
    }
    Ok(subjects)
}

fn subject_job(
    request: &planner::request::JobRequest,
    machine: &machine::Machine,
    sources: &mut Sources,
) -> Result<SubjectJob, Failure> {
    let job = request.read(machine)?;
    sources.add_job(&job.files);
    let path = request.job.clone().unwrap_or_default();
    let title = path.display().to_string();
    Ok(SubjectJob { stem: file_stem(&path), title, source: String::new(), job })
}

/// The name of a file without its ending, of letters, digits, `_` and `-`.
fn file_stem(path: &Path) -> String {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let plain =
        |letter: char| if letter.is_ascii_alphanumeric() || letter == '-' { letter } else { '_' };
    stem.unwrap_or_default().chars().map(plain).collect()
}

/// A name for the files of a machine that none of `others` has.
fn stem(path: &Path, others: &[Subject]) -> String {
    let stem = file_stem(path);
    let taken = |name: &str| others.iter().any(|other| other.stem == name);
    let numbered = (2..).map(|number| format!("{stem}_{number}"));
    [stem.clone()].into_iter().chain(numbered).find(|name| !taken(name)).unwrap_or(stem)
}

/// Writes pictures, numbers and page into `folder`, which `option` names.
///
/// # Errors
/// A folder or file that cannot be written.
pub(super) fn write(
    figures: &Figures,
    option: &str,
    folder: &Path,
    sources: &mut Sources,
) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::bad_input(format!("{option} {}: {error}", folder.display())))?;
    let mut save = |name: String, content: &str| {
        let path = folder.join(name);
        let mut file = sources.create(option, &path)?;
        file.write_all(content.as_bytes())
            .map_err(|error| Failure::output(format!("{}: {error}", path.display())))
    };
    for figure in &figures.figures {
        save(svg(figure), &figure.svg)?;
        for table in [&figure.table].into_iter().chain(&figure.more) {
            save(csv(table), &table.text())?;
        }
    }
    save(PAGE.to_owned(), &index::page(figures))
}

fn svg(figure: &Figure) -> String {
    format!("{}.svg", figure.table.stem)
}

fn csv(table: &Table) -> String {
    format!("{}.csv", table.stem)
}

fn report(figures: &Figures, folder: &Path) -> FiguresReport {
    let figure = |figure: &Figure| {
        let [x, y] = figure.axes.clone();
        FigureReport {
            name: figure.name.word().to_owned(),
            source: Some(figure.source.clone()).filter(|source| !source.is_empty()),
            title: figure.title.clone(),
            svg: svg(figure),
            csv: csv(&figure.table),
            rows: figure.table.rows.len(),
            more: figure.more.iter().map(csv).collect(),
            axes: AxesReport { x, y },
        }
    };
    let skipped = figures.skipped.iter().map(|one| SkippedReport {
        name: one.name.word().to_owned(),
        of: one.of.clone(),
        why: one.why.clone(),
    });
    FiguresReport {
        folder: folder.to_owned(),
        page: PAGE.to_owned(),
        figures: figures.figures.iter().map(figure).collect(),
        skipped: skipped.collect(),
    }
}
