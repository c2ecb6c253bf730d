//! G-code programs in files: held, or read again as they are marked.

#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use machine::Machine;
use planner::drawing::{Action, Step};
use planner::job::{JobError, gcode};
use planner::request::JobRequest;
use planner::{Job, Plan};

/// A program of so many moves to and fro, in a file of its own folder.
fn program(moves: u64) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("program.nc");
    let mut text = String::from("G21 G90 T1\nM4 S100 F6000\n");
    for index in 0..moves {
        writeln!(text, "G1 X{} Y{}", index % 7, index % 5).unwrap();
    }
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

fn steps(job: &Job) -> Vec<Step> {
    job.steps().unwrap().collect::<Result<_, _>>().unwrap()
}

fn open(path: &Path) -> Job {
    Job::open(path, &[], &Machine::builtin()).unwrap()
}

#[test]
fn a_long_program_stays_in_its_file_and_has_the_same_steps() {
    let machine = Machine::builtin();
    let (_folder, path) = program(Job::HELD);
    let (whole, long) = (Job::read(&path, &[], &machine).unwrap(), open(&path));
    assert!(whole.rest.is_none());
    assert!(long.rest.is_some() && long.drawing.steps.is_empty());
    assert_eq!(steps(&long), whole.drawing.steps);
    assert_eq!(steps(&long), steps(&whole));
    assert_eq!((&long.survey, &long.program), (&whole.survey, &whole.program));
    assert_eq!(
        (&long.drawing.name, &long.drawing.notes),
        (&whole.drawing.name, &whole.drawing.notes)
    );
    assert_eq!(long.drawing.notes.len(), 1);
    assert_eq!(gcode::survey(&path, &machine).unwrap(), whole.survey.unwrap());

    // What is put before the drawing comes before the steps of the file.
    let approach = Action::Rapid { to: long.drawing.start };
    let mut moved = long.clone();
    moved.drawing.steps.insert(0, Step { action: approach.clone(), line: 0 });
    let steps = steps(&moved);
    assert_eq!(steps[0].action, approach);
    assert_eq!(steps[1..], whole.drawing.steps);
}

#[test]
fn a_short_program_is_held() {
    let (_folder, path) = program(100);
    let job = open(&path);
    assert!(job.rest.is_none());
    assert_eq!(job.drawing.steps.len() as u64, job.survey.unwrap().steps);
}

#[test]
fn a_job_file_opens_its_long_program_from_its_own_home() {
    let (folder, path) = program(Job::HELD);
    let file = folder.path().join("job.toml");
    let text = "[gcode]\nfile = \"program.nc\"\n[surface.cylinder]\nradius = \"50 mm\"\n\
                height = \"80 mm\"\n";
    std::fs::write(&file, text).unwrap();
    let machine = Machine::builtin();
    let (whole, long) = (Job::read(&file, &[], &machine).unwrap(), open(&file));
    assert!(long.rest.is_some());
    assert_eq!(long.files, [path, file]);
    assert_eq!(steps(&long), whole.drawing.steps);
}

#[test]
fn a_file_that_changes_after_it_was_read_ends_the_steps_with_an_error() {
    let (_folder, path) = program(Job::HELD);
    let job = open(&path);
    let mut steps = job.steps().unwrap();
    steps.next().unwrap().unwrap();
    let mut text = std::fs::read_to_string(&path).unwrap();
    text.push_str("G1 X9\n");
    std::fs::write(&path, &text).unwrap();
    let error = steps.find_map(Result::err).unwrap();
    assert!(error.to_string().contains("was changed after it was read first"), "{error}");
    assert!(error.position().unwrap().0 > 1);
    assert!(steps.next().is_none());
    // Nor is another file read in its place.
    let error = job.steps().unwrap().next().unwrap().unwrap_err();
    assert!(error.to_string().contains("was changed"), "{error}");
    std::fs::remove_file(&path).unwrap();
    assert!(matches!(job.steps().err(), Some(JobError::Unreadable { .. })));
}

#[test]
fn a_folder_is_no_program() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("program.nc");
    std::fs::create_dir(&path).unwrap();
    let error = Job::open(&path, &[], &Machine::builtin()).unwrap_err();
    assert!(matches!(error, JobError::Unreadable { .. }), "{error}");
}

/// A free move that goes straight on belongs to the path only if the next mark does: else that begins where
/// the move ended.
#[test]
fn a_mark_back_after_a_free_move_straight_on_is_marked_whole() {
    let machine = Machine::builtin();
    for policy in ["M3", "M4"] {
        let text = format!(
            "G21 G90\n{policy} S500 F3000\nG0 X10\nG1 X20\nG0 X30\nG1 X5\nG0 X0\nG1 X15 Y5\n"
        );
        let program = gcode::read("back.nc", &text, &machine).unwrap();
        let plan = planner::plan(&machine, &Job::of(program.drawing)).unwrap();
        let ends: Vec<[f64; 2]> = plan
            .artwork
            .strokes
            .iter()
            .map(|stroke| {
                let at = |point: &[f64; 3]| ((point[0] - machine.home[0]) * 1e6).round() / 1e3;
                [at(&stroke.points[0]), at(stroke.points.last().unwrap())]
            })
            .collect();
        assert_eq!(ends, [[10.0, 20.0], [30.0, 5.0], [0.0, 15.0]], "{policy}");
        let length = 0.01 + 0.025 + messages::math::hypot(0.015, 0.005);
        assert!((plan.facts.length - length).abs() < 1e-9, "{policy}: {} m", plan.facts.length);
    }
}

/// The plan of a program, or the message with which it is refused.
fn planned(text: &str) -> Result<Plan, (Option<u64>, String)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("program.nc");
    std::fs::write(&path, text).unwrap();
    let request = JobRequest { job: Some(path), set: Vec::new(), offsets: None, confined: false };
    let plan = request.plan(&Machine::builtin());
    plan.map_err(|refusal| (refusal.line, refusal.message))
}

/// Machine coordinates alone say nothing to somebody who wrote others.
#[test]
fn a_place_outside_the_area_is_told_in_both_coordinates() {
    let x = "X150.000 is outside the area: X can be at most 100.000 mm, it is 50.000 mm too far; x of the \
             tool would be 250.000 mm in machine coordinates, where the area ends at 200.000 mm and X0 of the \
             program is at 100.000 mm";
    let lit = planned("G21 G90 F600\nM3 S500\nG1 X50\nG1 X150\n").unwrap_err();
    assert_eq!(lit, (Some(4), format!("stroke 1: {x}")));
    // A free move: its end, and not where it passes the edge.
    let (line, message) = planned("G21 G90\nG0 X50\nG0 X150\n").unwrap_err();
    assert_eq!((line, message.contains(x)), (Some(3), true), "{message}");
    let below = planned("G21 G90 F600\nG92 X20 Y0\nM3 S500\nG1 Y-101\n").unwrap_err().1;
    let told =
        "Y-101.000 is outside the area: Y can be no less than -100.000 mm, it is 1.000 mm too far";
    assert!(below.contains(told), "{below}");
    // Two origins: neither is meant more than the other.
    let several = planned("G21 G90 F600\nM3 S500\nG1 X1\nG92 X0\nG1 X150\n").unwrap_err().1;
    assert!(several.ends_with("which ends at 200.000 mm"), "{several}");
}

#[test]
fn a_program_that_marks_nothing_says_so() {
    let notes = |text: &str| planned(text).unwrap().facts.notes;
    for text in ["", "G21 G90 F600\nG1 X5\nG0 X0\n", "G21 G90 F600\nM3 S0\nG1 X5\n"] {
        let found = notes(text);
        let told = |note: &planner::drawing::Note| note.text.starts_with("nothing is marked: ");
        assert_eq!(found.iter().filter(|note| told(note)).count(), 1, "{text:?}: {found:?}");
    }
    assert_eq!(notes("G21 G90 F600\nM3 S500\nG1 X5\n"), []);
}

#[test]
fn a_feed_beyond_the_largest_marking_speed_is_noted() {
    for laser in ["M3", "M4"] {
        let plan = planned(&format!("G21 G90\n{laser} S500\nG1 X5 F60000000\n")).unwrap();
        let notes = &plan.facts.notes;
        assert_eq!((notes.len(), notes[0].line), (1, 3), "{laser}: {notes:?}");
        assert!(notes[0].text.starts_with("asks for 1000.0000 m/s, marked at 0.2500"), "{notes:?}");
    }
}

/// One cell of the law may lie over many dashes, and its middle in a gap between two.
#[test]
fn the_speed_of_dashes_is_told_wherever_the_gaps_lie() {
    for (name, on, off) in [("M3", "M3 S500\n", "M5\n"), ("M4", "S500\n", "S0\n")] {
        let mut text = String::from("G21 G90 F6000\nG0 X10 Y10\nM4 S0\n");
        if name == "M3" {
            text = String::from("G21 G90 F6000\nG0 X10 Y10\n");
        }
        for dash in 0..40 {
            let gate = if dash % 2 == 0 { on } else { off };
            writeln!(text, "{gate}G1 X{:.1}", 10.5 + f64::from(dash) * 0.5).unwrap();
        }
        text.push_str("M5\n");
        let facts = planned(&text).unwrap().facts;
        assert_eq!(facts.strokes, 20, "{name}");
        assert!((facts.speed - 0.1).abs() < 1e-9, "{name}: {} m/s", facts.speed);
    }
}
