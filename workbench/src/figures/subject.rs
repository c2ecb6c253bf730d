//! What figures are drawn of: machines, each with its jobs; by default those of source 003.

use machine::Machine;
use planner::Job;
use planner::request::Refusal;

use crate::thesis::machines::{Manner, SeriesLetter, ThesisMachine, series};

/// A machine, and what it marks.
#[derive(Debug, Clone)]
pub struct Subject {
    /// Short name, part of files' names.
    pub stem: String,
    /// The machine.
    pub machine: Machine,
    /// Where the source shows it; `None` for any other machine.
    pub chapter: Option<Chapter>,
    /// Its jobs.
    pub jobs: Vec<SubjectJob>,
}

/// A job of a machine.
#[derive(Debug, Clone)]
pub struct SubjectJob {
    /// Short name, part of files' names.
    pub stem: String,
    /// What it marks, in words.
    pub title: String,
    /// The source's figure of the torques that it takes; empty where it has none.
    pub source: String,
    /// The job.
    pub job: Job,
}

/// A chapter of source 003.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Chapter {
    /// Its number.
    pub number: u32,
    /// The number of its first figure of torques.
    pub first: u32,
}

/// The four machines of source 003 with the twelve letters that they mark there.
///
/// # Errors
/// Never: files and letters are part of the build, and a test holds them to be sound.
pub fn source_machines() -> Result<Vec<Subject>, Refusal> {
    ThesisMachine::ALL.into_iter().map(source_machine).collect()
}

fn source_machine(of: ThesisMachine) -> Result<Subject, Refusal> {
    let (stem, number, first) = match of {
        ThesisMachine::Cartesian => ("cartesian", 3, 11),
        ThesisMachine::CoreXy => ("corexy", 4, 7),
        ThesisMachine::FiveBar => ("five_bar", 5, 11),
        ThesisMachine::Prrrp => ("prrrp", 6, 8),
    };
    let machine = of.machine().map_err(|error| Refusal::of_document(&error))?;
    let jobs = (first..).zip(series()).map(|(figure, letter)| {
        let SeriesLetter { letter: name, height, speed } = letter;
        let cm = height * 1e2;
        Ok(SubjectJob {
            stem: format!("{name:?}{cm:.0}"),
            title: format!("{name:?}, {cm:.0} cm, at {speed} m/s"),
            source: format!("{number}-{figure}"),
            job: letter.request(Manner::Printed).read(&machine)?,
        })
    });
    let jobs = jobs.collect::<Result<_, Refusal>>()?;
    let chapter = Some(Chapter { number, first });
    Ok(Subject { stem: stem.to_owned(), machine, chapter, jobs })
}
