//! Job files: what they mean, and that every way of breaking one is an error at its place.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use machine::{Machine, Override};
use planner::drawing::Action;
use planner::job::JobError;
use planner::{Job, MarkingSpeed, PlanError, plan, plan_ideal};

/// A folder of its own for one test, removed in the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("graver-jobs-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn set(key: &str, value: &str) -> Override {
    Override { key: key.to_owned(), value: value.to_owned() }
}

const POINTS: &str = "[points]\npoints = [[\"10 mm\", \"5 mm\"], [\"-10 mm\", \"0 mm\"]]\n\
                      dwell = \"20 ms\"\n\n[marking]\npower = 0.5\ntolerance = \"20 um\"\n\
                      max_speed = \"0.2 m/s\"\nspeed = \"0.1 m/s\"\n";

const GCODE: &str = "[gcode]\nfile = \"square.ngc\"\n\n[marking]\nspeed = \"optimum\"\n";

const SQUARE: &str = "G21 G90\nM3 S500 F3000\nG0 X0 Y0\nG1 X10\nG1 Y10\nM5\nM2\n";

#[test]
fn the_builtin_job_is_naso_at_20_mm() {
    let machine = Machine::builtin();
    let job = Job::builtin(&[], &machine).unwrap();
    assert_eq!(job.drawing.name, "NASO");
    assert_eq!(job.marking.speed, Some(MarkingSpeed::Optimum));
    let facts = plan(&machine, &job).unwrap().facts;
    assert_eq!(facts.strokes, 8);
    // N 3.345, A 2.634 heights; S two three-quarter ellipses of 0.5 by 0.25, O a circle.
    let ellipse = 2.422_112_055_136_947_5;
    let heights =
        3.345_362_404_707_371 + 2.634_065_922_853_802 + 1.5 * ellipse + core::f64::consts::PI;
    assert!((facts.length - 0.02 * heights).abs() < 1e-9, "{}", facts.length / 0.02 - heights);
}

#[test]
fn overrides_reach_every_table() {
    let machine = Machine::builtin();
    let settings = [
        set("letters.text", "S"),
        set("letters.height", "10 mm"),
        set("letters.style", "h1"),
        set("marking.speed", "0.04 m/s"),
    ];
    let job = Job::builtin(&settings, &machine).unwrap();
    assert_eq!(job.marking.speed, Some(MarkingSpeed::Constant(0.04)));
    assert_eq!(job.rapid, Some(0.25));
    assert_eq!(plan(&machine, &job).unwrap().facts.strokes, 19);

    let error = Job::builtin(&[set("letters.hight", "10 mm")], &machine).unwrap_err();
    assert!(error.to_string().contains("letters.hight"), "{error}");
    assert_eq!(error.position(), None);
    let error = Job::builtin(&[set("letters.text", "NAXO")], &machine).unwrap_err();
    assert!(error.to_string().contains("there is no letter `X`"), "{error}");
}

#[test]
fn style_h2_is_planned_but_not_run() {
    let machine = Machine::builtin();
    let job = Job::builtin(&[set("letters.style", "h2"), set("letters.text", "N")], &machine);
    let job = job.unwrap();
    assert!(matches!(plan(&machine, &job), Err(PlanError::IdealOnly(_))));
    let facts = plan_ideal(&machine, &job).unwrap().facts;
    assert_eq!(facts.strokes, 3);
}

#[test]
fn points_are_seen_from_home() {
    let machine = Machine::builtin();
    let folder = Folder::new("points");
    let job = Job::read(&folder.write("holes.toml", POINTS), &[], &machine).unwrap();
    assert_eq!(job.drawing.name, "holes");
    assert_eq!(job.marking.max_speed, Some(0.2));
    assert_eq!(job.marking.tolerance, Some(20e-6));
    let planned = plan(&machine, &job).unwrap();
    let places: Vec<_> = planned.artwork.strokes.iter().map(|stroke| stroke.points[0]).collect();
    assert_eq!(places.len(), 2);
    for (found, expected) in places.iter().zip([[0.11, 0.105, 0.0], [0.09, 0.1, 0.0]]) {
        assert!(messages::artwork::distance(found, &expected) < 1e-12, "{found:?}");
    }
    assert_eq!(planned.artwork.strokes[0].line, 1);
    assert!(matches!(
        job.drawing.steps[1].action,
        Action::Dwell { time, lit: Some(power) } if time == 0.02 && power == 0.5
    ));
}

#[test]
fn programs_are_read_beside_their_job_file_or_alone() {
    let machine = Machine::builtin();
    let folder = Folder::new("gcode");
    let program = folder.write("square.ngc", SQUARE);
    let file = folder.write("square.toml", GCODE);

    let alone = plan(&machine, &Job::read(&program, &[], &machine).unwrap()).unwrap().facts;
    assert_eq!((alone.strokes, alone.speed), (2, 0.05));
    assert!((alone.length - 0.02).abs() < 1e-12);
    let settings = [set("marking.speed", "0.02 m/s")];
    let slow = plan(&machine, &Job::read(&program, &settings, &machine).unwrap()).unwrap().facts;
    assert_eq!(slow.speed, 0.02);
    let best = plan(&machine, &Job::read(&file, &[], &machine).unwrap()).unwrap().facts;
    assert!(best.duration < alone.duration && best.speed > 0.05);

    let error = Job::read(&program, &[set("marking.power", "80 %")], &machine).unwrap_err();
    assert!(error.to_string().contains("S words"), "{error}");
    let broken = folder.write("broken.ngc", "G21\nG1 X10 F100\nG41 X5\n");
    let error = Job::read(&broken, &[], &machine).unwrap_err();
    assert_eq!(error.position().unwrap().0, 3, "{error}");
    assert!(error.file().ends_with("broken.ngc"));
}

#[test]
fn what_is_no_job_is_named() {
    let machine = Machine::builtin();
    let error = Job::read(Path::new("/nowhere/job.toml"), &[], &machine).unwrap_err();
    assert!(matches!(error, JobError::Unreadable { .. }));
    assert!(error.to_string().starts_with("/nowhere/job.toml: cannot be read"), "{error}");
    let error = Job::read(Path::new("job.gcod"), &[], &machine).unwrap_err();
    let JobError::UnknownExtension { help, .. } = error else { panic!("{error}") };
    assert_eq!(help, "did you mean `.gcode`?");
    let error = Job::read(Path::new("job"), &[], &machine).unwrap_err();
    assert!(matches!(error, JobError::UnknownExtension { .. }));
}

/// A program is one by its extension in either case, and else by its first lines.
#[test]
fn a_program_has_many_names() {
    let machine = Machine::builtin();
    let folder = Folder::new("names");
    let text = "G21 G90\nG0 X1\nM3 S100\nG1 X2 F600\n";
    let marked = |path: &Path| Job::read(path, &[], &machine).unwrap().program.unwrap().mark_length;
    for extension in
        ["ngc", "nc", "gcode", "tap", "gc", "cnc", "g", "GC", "Nc", "txt", "out", "TXT"]
    {
        let path = folder.write(&format!("program.{extension}"), text);
        assert!((marked(&path) - 1e-3).abs() < 1e-12, "{extension}");
    }
    assert!((marked(&folder.write("program", text)) - 1e-3).abs() < 1e-12);
    let letter = folder.write("letter.txt", "Dear Sir,\nplease mark this.\n");
    let error = Job::read(&letter, &[], &machine).unwrap_err();
    assert!(matches!(error, JobError::UnknownExtension { .. }), "{error}");
    // Editors on Windows save UTF-16.
    for (name, order) in [("le", u16::to_le_bytes as fn(u16) -> [u8; 2]), ("be", u16::to_be_bytes)]
    {
        let wide: Vec<u8> = format!("\u{feff}{text}").encode_utf16().flat_map(order).collect();
        let path = folder.write(&format!("wide_{name}.nc"), wide);

        assert!((marked(&path) - 1e-3).abs() < 1e-12, "{name}");
    }
}

/// The dialect of a job holds before its machine's, and what is chosen beside it before that.
#[test]
fn a_dialect_is_chosen_for_a_machine_or_for_a_job() {
    let folder = Folder::new("dialects");
    let program = folder.write("fan.nc", "G90\nM106 S51\nG1 X5 F600\nM107\n");
    let job = folder.write("job.toml", "[gcode]\nfile = \"fan.nc\"\ndialect = \"marlin\"\n");
    let power = |path: &Path, settings: &[&str], machine: &Machine| {
        let settings: Vec<Override> = settings.iter().map(|text| text.parse().unwrap()).collect();
        Job::read(path, &settings, machine).map(|job| job.program.unwrap().power.unwrap()[1])
    };
    let builtin = Machine::builtin();
    assert!(power(&program, &[], &builtin).is_err());
    assert_eq!(power(&program, &["gcode.dialect=marlin"], &builtin).unwrap(), 0.2);
    assert_eq!(power(&job, &[], &builtin).unwrap(), 0.2);
    assert_eq!(power(&job, &["gcode.full_scale=102"], &builtin).unwrap(), 0.5);
    assert_eq!(power(&program, &["gcode.fan_is_laser=true"], &builtin).unwrap(), 0.051);
    let mut machine = builtin.clone();
    machine.gcode.words = machine::gcode_settings::Dialect::Marlin.meanings();
    assert_eq!(power(&program, &[], &machine).unwrap(), 0.2);
    assert!(power(&program, &["gcode.dialect=grbl"], &machine).is_err());
}

/// Every key of every kind of job file deleted, misspelt, given another unit, type, no number, too
/// much or nothing: an error at that line, or a job that plans or is refused by the checker.
#[test]
fn every_mutation_is_an_error_at_its_line_or_still_a_job() {
    let machine = Machine::builtin();
    let folder = Folder::new("mutations");
    folder.write("square.ngc", SQUARE);
    let letters = include_str!("../../jobs/letters.toml");
    let values = [
        "\"nan mm\"",
        "\"inf m/s\"",
        "\"1e400 mm\"",
        "\"-5 mm\"",
        "\"0 m/s\"",
        "\"5 kg\"",
        "\"5 furlong\"",
        "\"\"",
        "5",
        "0",
        "-1",
        "nan",
        "inf",
        "true",
        "[]",
        "{}",
        "\"1e9 m\"",
        "\"1e9 s\"",
        "\"1e-9 m/s\"",
        "\"1 nm\"",
        "[[\"1 mm\"]]",
        "\"200 %\"",
        "\"OOO\"",
        "1979-05-27",
        "[[\"1e9 m\", \"0 m\"]]",
    ];
    let mut refused = 0;
    for (name, text) in [("letters", letters), ("points", POINTS), ("program", GCODE)] {
        let lines: Vec<&str> = text.lines().collect();
        for (index, line) in lines.iter().enumerate() {
            let code = line.split('#').next().unwrap();
            let Some((key, _)) = code.split_once('=') else { continue };
            let key = key.trim();
            let mut mutations: Vec<String> =
                values.iter().map(|value| format!("{key} = {value}")).collect();
            mutations.push(String::new());
            mutations.push(format!("{key}x = \"5 mm\""));
            mutations.push(format!("{key} \"5 mm\""));
            mutations.push(format!("{key} ="));
            mutations.push(format!("{line}\n{key} = \"5 mm\""));
            for mutation in mutations {
                let mut mutated = lines.clone();
                mutated[index] = &mutation;
                let path = folder.write(&format!("{name}.toml"), mutated.join("\n"));
                let case = format!("{name}.toml, line {}: `{mutation}`", index + 1);
                match Job::read(&path, &[], &machine) {
                    Ok(job) => {
                        // Planned or refused, in words.
                        if let Err(error) = plan(&machine, &job) {
                            assert!(!error.to_string().is_empty(), "{case}");
                        }
                    }
                    Err(error) => {
                        refused += 1;
                        let (line, column) = match (&error, error.position()) {
                            (JobError::Unreadable { .. }, _) => continue,
                            (_, Some(position)) => position,
                            (_, None) => panic!("{case}: no place in {error}"),
                        };
                        // What is missing, or a list without entries, is missed in its table,
                        // above; a duplicate shows below.
                        let expected = index as u64 + 1;
                        let near = if mutation.is_empty() || mutation.ends_with("[]") {
                            line <= expected
                        } else {
                            line == expected || line == expected + 1
                        };
                        assert!(near && column >= 1, "{case}: {error}");
                    }
                }
            }
        }
    }
    assert!(refused > 150, "only {refused} mutations were refused");
}

#[test]
fn a_program_with_latin_1_comments_is_read_with_the_right_columns() {
    let machine = Machine::builtin();
    let folder = Folder::new("latin-1");
    let sound = folder.write(
        "sound.ngc",
        b"G21 (Gr\xf6\xdfe \xe9\xe9\x80) G90\nM3 S5 F600\nG1 X1 ; \xfcber\nM2\n",
    );
    let job = Job::read(&sound, &[], &machine).unwrap();
    assert!(matches!(job.drawing.steps.as_slice(), [step] if step.line == 3));

    let broken = folder.write("broken.ngc", b"G21\n(Gr\xf6\xdfe) G1 Y1 X\xb5\nM2\n");
    let error = Job::read(&broken, &[], &machine).unwrap_err();
    // X is the 15th character; in bytes of UTF-8 it would be the 17th.
    assert_eq!(error.position(), Some((2, 16)), "{error}");
}

#[test]
fn long_curves_in_the_dark_keep_the_limits_at_every_instant() {
    let machine = Machine::builtin();
    let folder = Folder::new("dark");
    // Many turns, so that the ramps are a small part of the whole; and a wave of many tips.
    for (index, program) in [
        "G0 X3 Y0\nG2 I-3 P30 F15000\nM2\n",
        "G0 X10 Y0\nG2 I-10 P20 F15000\nM2\n",
        "G0 X0.05 Y0\nG3 I-0.05 P400 F15000\nM2\n",
        "G18 G0 X0 Y0 Z0\nG2 X0 Z0 Y20 I5 K0 P3 F1000\nM2\n",
    ]
    .into_iter()
    .enumerate()
    {
        let path = folder.write(&format!("dark{index}.ngc"), program);
        let facts = plan(&machine, &Job::read(&path, &[], &machine).unwrap()).unwrap().facts;
        let used = facts.uses.path_jerk.max(facts.uses.path_acceleration);
        assert!((0.7..=1.0 + 1e-9).contains(&used), "{program}: {used}");
    }
}

/// Of a cloud's numbers that count something no part is cut off: a seed of 1.5 is not the seed 1.
#[test]
fn a_count_that_is_not_whole_is_refused() {
    let machine = Machine::builtin();
    let folder = Folder::new("whole");
    let text = "[cloud]\ndwell = \"2 ms\"\n[cloud.sphere]\n\
                center = [\"100 mm\", \"100 mm\", \"0 mm\"]\nradius = \"5 mm\"\n";
    let path = folder.write("cloud.toml", text);
    let read = |key: &str, value: &str| Job::read(&path, &[set(key, value)], &machine);
    for (key, name) in
        [("cloud.sphere.seed", "seed"), ("cloud.sphere.count", "count"), ("cloud.from", "from")]
    {
        for wrong in ["1.5", "-1", "-0.5"] {
            let error = read(key, wrong).unwrap_err().to_string();
            assert!(error.contains(key), "{error}");
            if !wrong.starts_with('-') {
                assert!(error.contains(&format!("`{name}` cannot be {wrong}")), "{error}");
            }
        }
        read(key, "7").unwrap();
    }
}
