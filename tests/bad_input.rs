//! Every way in which a person can break a machine file, a job or a command line: each gets an
//! error that names file, line and cause, or is still sound. Nothing panics.
//!
//! Most cases run in this process, through the functions that the commands call; a seeded choice
//! of those that are refused runs through the binary.

#![allow(clippy::unwrap_used)]

mod support;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use graver::arguments::MachineArguments;
use graver::exit::{Exit, Failure};
use graver::inputs;
use messages::random::SplitMix64;
use messages::time::SETPOINT_TIME;
use support::{Place, assert_valid, source};

/// What becomes of an input.
enum Verdict {
    Sound,
    Refused { stage: Stage, failure: Box<Failure> },
}

/// Who refused it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Machine,
    Job,
    Plan,
}

/// How much of a plan is made [s]: a dwell or a speed may be wrong by so much that it takes days.
const LONGEST: f64 = 60.0;

/// Reads a machine and a job and plans the beginning of it, as `check`, `plan`, `run` and `simulate` begin.
fn judge(machine: Option<&Path>, job: &Path, set: &[&str]) -> Verdict {
    let refused = |stage| move |failure| Verdict::Refused { stage, failure: Box::new(failure) };
    let arguments = MachineArguments {
        machine: machine.map(Path::to_owned),
        set: set.iter().map(|change| (*change).to_owned()).collect(),
    };
    let input = match inputs::machine(&arguments) {
        Ok(input) => input,
        Err(failure) => return refused(Stage::Machine)(failure),
    };
    let request = inputs::job_request(Some(job), &input.machine, None, &input.job_overrides);
    let read = match request.read(&input.machine) {
        Ok(read) => read,
        Err(refusal) => return refused(Stage::Job)(refusal.into()),
    };
    let mut setpoints = 0;
    let planned = planner::plan_while(&input.machine, &read, |window| {
        setpoints += window.setpoints.len();
        setpoints as f64 * SETPOINT_TIME <= LONGEST
    });
    match planned {
        Ok(_) => Verdict::Sound,
        Err(error) => refused(Stage::Plan)(request.refuse(&error).into()),
    }
}

/// Judges a broken file, and asserts that a refusal says where and what; whether it was refused.
fn assert_told(
    broken: &Path,
    machine: Option<&Path>,
    job: &Path,
    set: &[&str],
    what: &str,
) -> bool {
    let verdict = catch_unwind(AssertUnwindSafe(|| judge(machine, job, set)));
    let verdict = verdict.unwrap_or_else(|_| panic!("panicked: {what}"));
    let Verdict::Refused { stage, failure } = verdict else { return false };
    let refusal = &failure.refusal;
    assert_eq!(failure.exit(), Exit::BadInput, "{what}");
    assert!(!refusal.message.trim().is_empty() && !refusal.text.trim().is_empty(), "{what}");
    let file = refusal.file.as_deref().unwrap_or_else(|| panic!("{what}: no file: {refusal:?}"));
    if stage == Stage::Plan {
        // A plan breaks at a stroke of the job, which letters have no line for.
        assert_eq!(Path::new(file), job, "{what}: {refusal:?}");
    } else {
        assert_eq!(Path::new(file), broken, "{what}: {refusal:?}");
        let text = String::from_utf8_lossy(&std::fs::read(broken).unwrap()).into_owned();
        let most = text.lines().count().max(1) as u64;
        let line = refusal.line.unwrap_or_else(|| panic!("{what}: no line: {refusal:?}"));
        assert!((1..=most + 1).contains(&line), "{what}: line {line} of {most}");
    }
    true
}

/// A file with one of its lines replaced.
fn replaced(text: &str, index: usize, line: &str) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    lines[index] = line;
    lines.join("\n") + "\n"
}

/// Values that are wrong nearly everywhere.
const VALUES: [&str; 19] = [
    "\"banana\"",
    "\"1 furlong\"",
    "\"\"",
    "\"nan m\"",
    "\"-1 mm\"",
    "\"1e308 m/s\"",
    "\"1e999 mm\"",
    "\"1e15 s\"",
    "\"1 mm 2\"",
    "\"ü µ\"",
    "0",
    "-1",
    "nan",
    "inf",
    "true",
    "[]",
    "[1, 2, 3, 4, 5, 6, 7, 8, 9]",
    "{}",
    "1979-05-27",
];

/// Everything that this test does to a TOML file, with a name for each.
fn toml_mutations(text: &str, random: &mut SplitMix64) -> Vec<(String, String)> {
    let mut mutations = Vec::new();
    let lines: Vec<&str> = text.lines().collect();
    let settings: Vec<usize> = (0..lines.len())
        .filter(|index| !lines[*index].starts_with('#') && lines[*index].contains('='))
        .collect();
    for index in settings.iter().copied() {
        let line = lines[index];
        let (key, value) = line.split_once('=').unwrap();
        let (key, value) = (key.trim(), value.trim());
        let mut change = |what: &str, line: &str| {
            let name = format!("line {} {what}: {line}", index + 1);
            mutations.push((name, replaced(text, index, line)));
        };
        change("deleted", "");
        change("mistyped", &format!("{key}x = {value}"));
        change("twice", &format!("{line}\n{line}"));
        change("unquoted", &line.replace('"', ""));
        change("cut", &line[..line.floor_char_boundary(line.len() / 2)]);
        for value in VALUES {
            change("value", &format!("{key} = {value}"));
        }
        let other = lines[settings[random.below(settings.len() as u64) as usize]];
        change("swapped", &format!("{key} = {}", other.split_once('=').unwrap().1));
        let at = line.floor_char_boundary(random.below(line.len() as u64) as usize);
        let noise = ["\"", "[", "\u{0}", "é", "#", "=", "."][random.below(7) as usize];
        change("noise", &format!("{}{noise}{}", &line[..at], &line[at..]));
    }
    for (index, line) in lines.iter().enumerate().filter(|(_, line)| line.starts_with('[')) {
        for header in ["", "[", "[nonsense]", &line.replace(']', ""), &line.replace('.', "..")] {
            let name = format!("line {}: header {header}", index + 1);
            mutations.push((name, replaced(text, index, header)));
        }
    }
    mutations
}

/// Everything that this test does to a program: each word broken in turn.
fn gcode_mutations(text: &str, random: &mut SplitMix64) -> Vec<(String, String)> {
    let mut mutations = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let code = line.split(['(', ';']).next().unwrap();
        for (start, word) in words(code) {
            let (letter, number) = word.split_at(1);
            let other = ["G", "M", "X", "F", "S", "R", "I", "P", "Q", "$", "ä"];
            let other = other[random.below(other.len() as u64) as usize];
            let broken = [
                String::new(),
                letter.to_owned(),
                number.to_owned(),
                format!("{word}{word}"),
                format!("{word} {word}"),
                format!("{letter}-{number}"),
                format!("{letter}-99999"),
                format!("{letter}{number}.5"),
                format!("{letter}99999999"),
                format!("{letter}1e400"),
                format!("{letter}nan"),
                format!("{letter}0"),
                format!("{letter}#1"),
                format!("{letter}[1+"),
                format!("{other}{number}"),
                format!("({word}"),
                format!("\u{0}{word}"),
            ];
            for broken in broken {
                let changed = format!("{}{broken}{}", &line[..start], &line[start + word.len()..]);
                let name = format!("line {}: {word} is {broken:?}", index + 1);
                mutations.push((name, replaced(text, index, &changed)));
            }
        }
    }
    mutations
}

/// The words of a line with where they start.
fn words(code: &str) -> Vec<(usize, &str)> {
    let starts: Vec<usize> = code
        .char_indices()
        .filter(|(_, character)| character.is_ascii_alphabetic())
        .map(|(index, _)| index)
        .collect();
    let ends = starts.iter().skip(1).copied().chain([code.len()]);
    starts.iter().zip(ends).map(|(from, to)| (*from, code[*from..to].trim_end())).collect()
}

/// Runs a few of the refused inputs through the binary.
fn assert_refused_by_binary(
    place: &Place,
    refused: &[(String, Vec<String>)],
    random: &mut SplitMix64,
) {
    const SPAWNS: usize = 8;
    assert!(refused.len() > SPAWNS, "only {} were refused", refused.len());
    for _ in 0..SPAWNS {
        let (what, arguments) = &refused[random.below(refused.len() as u64) as usize];
        // Files are written anew: all mutations share one name.
        let (path, text) = what.split_once('\n').unwrap();
        std::fs::write(path, text).unwrap();
        for command in ["check", "plan", "simulate", "run"] {
            let mut all = vec![command, "--json"];
            all.extend(arguments.iter().map(String::as_str));
            let ended = place.graver(&all);
            let summary = ended.json(2);
            assert_valid("summary", &summary);
            assert_eq!(summary["outcome"], "refused", "{command} {text}");
            let error = &summary["error"];
            assert!(error["file"].is_string() && error["message"].is_string(), "{error}\n{text}");
            assert!(ended.error.starts_with("graver: "), "{}", ended.error);
        }
    }
}

#[test]
fn broken_machine_files_are_refused_at_their_line() {
    let place = Place::new();
    let mut random = SplitMix64::new(71);
    let set = ["letters.text=N", "letters.height=10 mm"];
    let job = source("jobs/letters.toml");
    let path = place.path("machine.toml");
    for name in ["cartesian", "corexy"] {
        let text =
            std::fs::read_to_string(source("machines").join(format!("{name}.toml"))).unwrap();
        let mut refused = Vec::new();
        let mutations = toml_mutations(&text, &mut random);
        let count = mutations.len();
        for (what, broken) in mutations {
            std::fs::write(&path, &broken).unwrap();
            let what = format!("{name}, {what}");
            if assert_told(&path, Some(&path), &job, &set, &what) {
                let arguments = ["--machine", path.to_str().unwrap(), job.to_str().unwrap()];
                let kept = format!("{}\n{broken}", path.display());
                refused.push((kept, arguments.map(String::from).into()));
            }
        }
        // Some values are right for some keys, and a few keys have defaults.
        assert!(refused.len() * 10 > count * 8, "{name}: {} of {count} refused", refused.len());
        let machine_refused: Vec<_> = refused;
        assert_refused_by_binary(&place, &machine_refused, &mut random);
    }
}

#[test]
fn broken_job_files_are_refused_at_their_line() {
    let place = Place::new();
    let mut random = SplitMix64::new(72);
    let path = place.path("job.toml");
    let points = "[points]\nat = [[\"0 mm\", \"0 mm\"], [\"5 mm\", \"2 mm\"]]\ndwell = \"5 ms\"\n";
    let jobs: Vec<(PathBuf, String)> = std::fs::read_dir(source("jobs"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| (path.clone(), std::fs::read_to_string(path).unwrap()))
        .chain([(PathBuf::from("points"), points.to_owned())])
        .collect();
    for (name, text) in jobs {
        let mut refused = Vec::new();
        for (what, broken) in toml_mutations(&text, &mut random) {
            std::fs::write(&path, &broken).unwrap();
            let what = format!("{}, {what}", name.display());
            if assert_told(&path, None, &path, &[], &what) {
                let kept = format!("{}\n{broken}", path.display());
                refused.push((kept, vec![path.display().to_string()]));
            }
        }
        assert_refused_by_binary(&place, &refused, &mut random);
    }
}

/// The machine file that has `job` as its sample; `None` for the built-in machine.
fn machine_of(job: &Path) -> Option<PathBuf> {
    let name = job.file_name().unwrap().to_string_lossy().into_owned();
    let files = std::fs::read_dir(source("machines")).unwrap();
    let mut files = files.map(|entry| entry.unwrap().path()).filter(|path| {
        path.extension().is_some_and(|extension| extension == "toml")
            && std::fs::read_to_string(path).unwrap().contains(&format!("\"../jobs/{name}\""))
    });
    files.next()
}

#[test]
fn broken_programs_are_refused_at_their_line() {
    let jobs: Vec<PathBuf> = std::fs::read_dir(source("jobs"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "ngc"))
        .collect();
    assert!(jobs.len() >= 3, "{jobs:?}");
    std::thread::scope(|scope| {
        for (number, job) in jobs.iter().enumerate() {
            scope.spawn(move || broken_program_is_refused(job, 73 + number as u64));
        }
    });
}

/// Breaks the program in `job` in many ways.
fn broken_program_is_refused(job: &Path, seed: u64) {
    let place = Place::new();
    let mut random = SplitMix64::new(seed);
    let path = place.path("job.ngc");
    let text = std::fs::read_to_string(job).unwrap();
    let machine = machine_of(job);
    let machine = machine.as_deref();
    assert!(matches!(judge(machine, job, &[]), Verdict::Sound), "{job:?}");
    let mut refused = Vec::new();
    // Samples of other machines are longer: of their mutations, of the same kinds, every twelfth.
    let every = if machine.is_some() { 12 } else { 1 };
    for (what, broken) in gcode_mutations(&text, &mut random).into_iter().step_by(every) {
        std::fs::write(&path, &broken).unwrap();
        let what = format!("{}, {what}", job.display());
        if assert_told(&path, machine, &path, &[], &what) {
            let kept = format!("{}\n{broken}", path.display());
            let named = |file: &Path| ["--machine".to_owned(), file.display().to_string()];
            let mut arguments = vec![path.display().to_string()];
            arguments.extend(machine.map(named).into_iter().flatten());
            refused.push((kept, arguments));
        }
    }
    assert_refused_by_binary(&place, &refused, &mut random);
}

#[test]
fn files_that_are_no_text_or_no_files_are_refused() {
    let place = Place::new();
    let job = place.path("job.ngc");
    let machine = place.path("machine.toml");
    let contents: [&[u8]; 6] =
        [b"", b"\n\n", b"\xff\xfe\x00G1", b"G1 X1 F100", &[0; 300], &[b'('; 5000]];
    for content in contents {
        std::fs::write(&job, content).unwrap();
        std::fs::write(&machine, content).unwrap();
        let what = format!("{:?}", &content[..content.len().min(12)]);
        for arguments in [
            vec!["plan", job.to_str().unwrap(), "--json"],
            vec!["check", "--machine", machine.to_str().unwrap(), "--json"],
        ] {
            let ended = place.graver(&arguments);
            assert!(matches!(ended.code, Some(0 | 2)), "{what}: {:?} {}", ended.code, ended.error);
            if ended.code == Some(2) {
                let summary = ended.json(2);
                assert_valid("summary", &summary);
                assert!(summary["error"]["file"].is_string(), "{what}: {summary:#}");
            }
        }
    }
    let folder = place.path("");
    for path in [folder.to_str().unwrap(), "absent.ngc", "absent.toml", "absent.svg", "absent"] {
        let summary = place.graver(&["plan", path, "--json"]).json(2);
        assert!(summary["error"]["message"].is_string(), "{summary:#}");
        let ended = place.graver(&["check", "--machine", path, "--json"]);
        assert!(ended.json(2)["error"]["message"].is_string());
    }
}

#[test]
fn broken_arguments_are_refused_with_what_would_be_right() {
    let place = Place::new();
    for (arguments, told) in [
        (vec!["plan", "--set", "letters.text"], "KEY=VALUE"),
        (vec!["plan", "--set", "letters.txt=S"], "text"),
        (vec!["plan", "--set", "letters.text=Q"], "N, A, S"),
        (vec!["plan", "--set", "letters.height=20"], "20 mm"),
        (vec!["plan", "--set", "machine.path.jerk=5 m"], "m/s^3"),
        (vec!["plan", "--set", "machine.path.jrek=500 m/s^3"], "jerk"),
        (vec!["simulate", "--set", "plant.axis.a.gear=0"], "gear"),
        (vec!["override", "300 %"], "200 %"),
        (vec!["override", "fast"], "fast"),
        (vec!["override", "50 %", "--power", "5 %"], "power 5 %"),
        (vec!["override"], "RATE"),
        (vec!["status", "--instance", "No Name"], "instance"),
        (vec!["run", "--instance", "../up"], "instance"),
        (vec!["simulate", "--seed", "x"], "seed"),
        (vec!["bench", "latency", "--seconds", "x"], "seconds"),
        (vec!["nonsense"], "nonsense"),
    ] {
        let ended = place.graver(&arguments);
        assert_eq!(ended.code, Some(2), "{arguments:?}: {}", ended.error);
        assert!(ended.error.contains(told), "{arguments:?}: {}", ended.error);
    }
}
