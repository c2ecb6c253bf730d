//! What figures are drawn of: machines, each with its jobs; by default those of source 003.

use machine::{Machine, Override};
use planner::Job;
use planner::job::JobError;

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

/// The letters of the source, each with its marking speeds for 1, 2 and 5 cm [m/s]. Table 3-1 prints 0.05
/// for the S of 2 cm; tables 3-2 and 4-1 follow from 0.06.
pub(super) const LETTERS: [(&str, [f64; 3]); 4] = [
    ("N", [0.16, 0.22, 0.24]),
    ("A", [0.16, 0.23, 0.24]),
    ("S", [0.04, 0.06, 0.08]),
    ("O", [0.03, 0.05, 0.07]),
];

/// The heights of the letters [cm].
pub(super) const HEIGHTS: [u32; 3] = [1, 2, 5];

/// A machine of the source: stem, file, what the chapter says beside it, chapter, first figure of torques.
type SourceMachine =
    (&'static str, &'static str, &'static [(&'static str, &'static str)], u32, u32);

/// The links of the five-bar bend (table 5-4), and its gear is the built one.
const FIVE_BAR: &[(&str, &str)] = &[
    ("axis.th1.gear", "236.09"),
    ("axis.th2.gear", "236.09"),
    ("axis.th1.transmission.link.length", "200 mm"),
    ("axis.th1.transmission.link.modulus", "22e10 N/m^2"),
    ("axis.th1.transmission.link.second_moment", "8.333333333333e-10 m^4"),
    ("axis.th2.transmission.link.length", "200 mm"),
    ("axis.th2.transmission.link.modulus", "22e10 N/m^2"),
    ("axis.th2.transmission.link.second_moment", "8.333333333333e-10 m^4"),
];

/// The screw of table 6-5, its stiffness read with a dot for thousands.
const PRRRP: &[(&str, &str)] = &[
    ("axis.p1.efficiency", "0.5"),
    ("axis.p2.efficiency", "0.5"),
    ("axis.p1.transmission.screw.stiffness", "2673 N m/rad"),
    ("axis.p2.transmission.screw.stiffness", "2673 N m/rad"),
];

const MACHINES: [SourceMachine; 4] = [
    ("cartesian", include_str!("../../../machines/cartesian.toml"), &[], 3, 11),
    ("corexy", include_str!("../../../machines/corexy.toml"), &[], 4, 7),
    ("five_bar", include_str!("../../../machines/five_bar.toml"), FIVE_BAR, 5, 11),
    ("prrrp", include_str!("../../../machines/prrrp.toml"), PRRRP, 6, 8),
];

/// The four machines of source 003 with the twelve letters that they mark there.
///
/// # Errors
/// Never: files and letters are part of the build, and a test holds them to be sound.
pub fn source_machines() -> Result<Vec<Subject>, JobError> {
    MACHINES.iter().map(source_machine).collect()
}

fn source_machine(
    &(stem, text, changes, number, first): &SourceMachine,
) -> Result<Subject, JobError> {
    let machine = Machine::parse(stem, text, &overrides(changes))?;
    let mut jobs = Vec::new();
    for (letter, (name, speeds)) in (0..).zip(LETTERS) {
        for (size, (cm, speed)) in (0..).zip(HEIGHTS.into_iter().zip(speeds)) {
            jobs.push(SubjectJob {
                stem: format!("{name}{cm}"),
                title: format!("{name}, {cm} cm, at {speed} m/s"),
                source: format!("{number}-{}", first + 3 * letter + size),
                job: letter_job(name, cm, speed, &machine)?,
            });
        }
    }
    let chapter = Some(Chapter { number, first });
    Ok(Subject { stem: stem.to_owned(), machine, chapter, jobs })
}

fn letter_job(name: &str, cm: u32, speed: f64, machine: &Machine) -> Result<Job, JobError> {
    let settings = [
        ("letters.text", name),
        ("letters.height", &format!("{} mm", 10 * cm)),
        ("letters.style", "h1"),
        ("marking.speed", &format!("{speed} m/s")),
    ];
    Job::builtin(&overrides(&settings), machine)
}

fn overrides(settings: &[(&str, &str)]) -> Vec<Override> {
    let change = |(key, value): &(&str, &str)| Override {
        key: (*key).to_owned(),
        value: (*value).to_owned(),
    };
    settings.iter().map(change).collect()
}
