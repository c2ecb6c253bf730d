//! What `graver check` calls sound without a new warning is simulated without a fault, and marks what
//! it should: single numbers of every machine file changed, by little and by much.
//!
//! `GRAVER_CASES=20000 cargo test --release --test plausible -- --nocapture` tries more of them, and
//! `GRAVER_SAMPLE=1` at the machine's sample job in place of a few short lines.

#![allow(clippy::unwrap_used)]

mod support;

use std::path::{Path, PathBuf};

use drives::{PlantOptions, SimulatedPlant};
use machine::Machine;
use messages::finite::first_not_finite;
use messages::random::SplitMix64;
use messages::time::SETPOINT_TIME;
use monitor::conclusion::{self, RunOutcome};
use monitor::marks::StreamEnd;
use monitor::run_analysis::{Clock, RunAnalysis};
use monitor::summary::Outcome;
use planner::Job;
use planner::request::JobRequest;
use support::Place;
use workbench::simulation::simulate;

/// What a mark may be off its line beyond the path's tolerance [m]: what the sample jobs of the files
/// as they are come to (docs/accuracy.md), and as much again.
const ACCURACY: f64 = 10e-6;

/// The longest job that is worth simulating here [s].
const LONGEST: f64 = 60.0;

/// Short lines at home, which is where G55 has its origin in all machine files.
const LINES: &str = "G21 G90 G55\nG0 X1 Y0\nM3 S500 F1200\nG1 X3 Y1\nG1 X2 Y2\nM5\nM2\n";

/// Changes that slips of a digit, a prefix or a sign come to.
const FACTORS: [f64; 22] = [
    0.0, -1.0, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 0.01, 0.05, 0.1, 0.3, 0.7, 1.5, 3.0, 10.0, 20.0,
    100.0, 1e3, 1e4, 1e6, 1e9, 1e12,
];

/// A machine file, and where its numbers stand.
struct File {
    path: PathBuf,
    text: String,
    /// Byte ranges of the numbers.
    numbers: Vec<(usize, usize)>,
}

fn files() -> Vec<File> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(support::source("machines"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    paths.sort();
    assert_eq!(paths.len(), 18);
    paths
        .into_iter()
        .map(|path| {
            let text = std::fs::read_to_string(&path).unwrap();
            let numbers = numbers(&text);
            assert!(numbers.len() > 40, "{}: {}", path.display(), numbers.len());
            File { path, text, numbers }
        })
        .collect()
}

/// The numbers that values of `text` begin with.
fn numbers(text: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let code = line.split('#').next().unwrap();
        if let Some((key, _)) = code.split_once('=')
            && !["name", "description", "sample"].contains(&key.trim())
        {
            let value = key.len() + 1;
            let mut at = value;
            while at < code.len() {
                let rest = &code[at..];
                let digits = |letter: char| letter.is_ascii_digit() || "+-.eE".contains(letter);
                let length = rest.find(|letter| !digits(letter)).unwrap_or(rest.len());
                let before = code[value..at].trim_end().chars().next_back();
                let begins = before.is_none_or(|letter| "\"[,".contains(letter));
                if begins && rest[..length].parse::<f64>().is_ok() {
                    found.push((start + at, start + at + length));
                }
                at += length.max(rest.chars().next().unwrap().len_utf8());
            }
        }
        start += line.len();
    }
    found
}

/// What became of a changed file.
#[derive(Debug, PartialEq)]
enum Verdict {
    /// An error, or a warning that the file as it is does not have.
    Told,
    /// The planner refuses the job, or it takes too long to be simulated here.
    NoJob,
    /// It marks as it should.
    Sound,
    /// Nobody said that its marks would be so far off [m].
    Off(f64),
    /// Nobody said that it would not.
    Wrong(String),
}

/// Whether `job` takes longer than is worth simulating here: a plan in memory is as long as its job, so it is planned
/// window by window first, no further than that.
fn is_long(machine: &Machine, job: &Job) -> bool {
    let mut setpoints = 0;
    let planned = planner::plan_while(machine, job, |window| {
        setpoints += window.setpoints.len();
        setpoints as f64 * SETPOINT_TIME <= LONGEST
    });
    planned.is_ok_and(|facts| facts.is_none())
}

/// What `graver check` and `graver simulate` say of a machine file with this text.
fn judge(file: &File, text: &str, job: &Path, known: usize) -> Verdict {
    let Ok(machine) = Machine::parse("machine.toml", text, &[]) else { return Verdict::Told };
    let options = PlantOptions::default();
    if machine.warnings.len() > known || SimulatedPlant::new(&machine, options).is_err() {
        return Verdict::Told;
    }
    let request =
        JobRequest { job: Some(job.to_owned()), set: Vec::new(), offsets: None, confined: false };
    let Ok(job) = request.read(&machine) else { return Verdict::NoJob };
    if is_long(&machine, &job) {
        return Verdict::NoJob;
    }
    let Ok(plan) = planner::plan(&machine, &job) else { return Verdict::NoJob };
    assert!(plan.facts.duration <= LONGEST, "{} s", plan.facts.duration);
    let mut analysis = RunAnalysis::new(&plan.artwork, Clock::Virtual, machine.realtime.period);
    let simulated = simulate(&machine, &machine, &plan, options, |records| {
        records.iter().for_each(|record| analysis.push(record));
    });
    let simulated = match simulated {
        Ok(simulated) => simulated,
        Err(error) => return Verdict::Wrong(error.to_string()),
    };
    let run_outcome = RunOutcome {
        controller: Some(simulated.controller),
        drives: Some(simulated.drives),
        ..RunOutcome::default()
    };
    let results = analysis.finish(StreamEnd::Reported(&simulated.controller));
    let summary =
        conclusion::summarise(&machine, &plan.facts, &run_outcome, Some(&results), Clock::Virtual);
    if let Some(place) = first_not_finite(&summary) {
        return Verdict::Wrong(format!("the summary has no finite number at {place}"));
    }
    if summary.outcome != Outcome::Completed {
        return Verdict::Wrong(format!("{:?}", summary.fault));
    }
    let name = file.path.display();
    let error = summary.marks.unwrap_or_else(|| panic!("{name}: no marks")).error_max;
    if error <= machine.path.tolerance + ACCURACY {
        return Verdict::Sound;
    }
    Verdict::Off(error)
}

#[test]
fn what_check_calls_sound_is_simulated_without_fault_and_to_the_tolerance() {
    let place = Place::new();
    let lines = place.file("lines.ngc", LINES);
    let count = std::env::var("GRAVER_CASES").map_or(300, |count| count.parse().unwrap());
    let seed = std::env::var("GRAVER_SEED").map_or(9, |seed| seed.parse().unwrap());
    let of_machine = std::env::var_os("GRAVER_SAMPLE").is_some();
    let mut random = SplitMix64::new(seed);
    let files = files();
    let job = |file: &File, machine: &Machine| match (of_machine, &machine.sample_job) {
        (true, Some(sample)) => file.path.parent().unwrap().join(sample),
        _ => lines.clone(),
    };
    let shipped: Vec<(PathBuf, usize)> = files
        .iter()
        .map(|file| {
            let machine = Machine::parse("machine.toml", &file.text, &[]).unwrap();
            let (job, known) = (job(file, &machine), machine.warnings.len());
            assert_eq!(judge(file, &file.text, &job, known), Verdict::Sound, "{:?}", file.path);
            (job, known)
        })
        .collect();
    let (mut tally, mut wrong) = ([0; 3], Vec::new());
    for case in 0..count {
        let file = &files[case % files.len()];
        let (job, known) = &shipped[case % files.len()];
        let below = |random: &mut SplitMix64, end: usize| (random.bits() % end as u64) as usize;
        let (from, to) = file.numbers[below(&mut random, file.numbers.len())];
        let factor = FACTORS[below(&mut random, FACTORS.len())];
        let written = &file.text[from..to];
        let changed = written.parse::<f64>().unwrap() * factor;
        let text = format!("{}{changed:?}{}", &file.text[..from], &file.text[to..]);
        match judge(file, &text, job, *known) {
            Verdict::Told => tally[0] += 1,
            Verdict::NoJob => tally[1] += 1,
            Verdict::Sound => tally[2] += 1,
            verdict @ (Verdict::Off(_) | Verdict::Wrong(_)) => {
                let why = match verdict {
                    Verdict::Off(error) => format!("marks are off by {:.1} µm", error * 1e6),
                    Verdict::Wrong(why) => why,
                    _ => String::new(),
                };
                let line = file.text[..from].matches('\n').count() + 1;
                let name = file.path.file_name().unwrap().display();
                wrong.push(format!("{name}:{line}: {written} is {changed:e}: {why}"));
            }
        }
    }
    println!(
        "told of {}, no job {}, sound {}, wrong {}",
        tally[0],
        tally[1],
        tally[2],
        wrong.len()
    );
    assert!(wrong.is_empty(), "{wrong:#?}");
    // Every class is really tried.
    assert!(tally[0] * 10 > count && tally[2] * 10 > count, "{tally:?}");
}
