//! Jobs of which not all is done, or not lit: from a stroke or a line on, dry, and the frame around them.

#![allow(clippy::unwrap_used)]

mod support;

use machine::Machine;
use nalgebra::Vector3;
use planner::drawing::{Action, Step};
use planner::trajectory::Cursor;
use planner::{Job, Plan, plan};
use support::{job, lit, machine, overrides, planned, tool};

/// Three lines on one straight path, and one around a corner.
const LINES: &str =
    "G1 X10 S500\nG1 X20 S0\nG1 X30 S500\nG1 X40 S0\nG1 X50 S500\nG0 X60 Y10\nG1 X70\n";

fn program(mode: &str) -> String {
    format!("G21 G90 G64\n{mode} S500 F6000\n{LINES}")
}

/// What is wrong with a program.
fn refused(program: &str, settings: &[&str], machine: &Machine) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("program.nc");
    std::fs::write(&path, program).unwrap();
    let error = Job::read(&path, &overrides(settings), machine).unwrap_err();
    format!(
        "{error} {}",
        miette::Diagnostic::help(&error).map(|it| it.to_string()).unwrap_or_default()
    )
}

fn are_same(one: &[[Vector3<f64>; 2]], other: &[[Vector3<f64>; 2]]) -> bool {
    let near = |(one, other): (&Vector3<f64>, &Vector3<f64>)| (one - other).norm() < 1e-8;
    one.len() == other.len() && one.iter().flatten().zip(other.iter().flatten()).all(near)
}

#[test]
fn what_is_marked_up_to_a_stroke_and_from_it_on_is_the_whole_job_once() {
    let machine = machine(false, &[]);
    for mode in ["M3", "M4"] {
        let program = program(mode);
        let whole = lit(&planned(&program, &[], &machine), [0.0; 2]);
        assert_eq!(whole.len(), 4);
        for first in 1..=4_usize {
            let setting = format!("marking.from_stroke={first}");
            let rest = planned(&program, &[&setting], &machine);
            assert!(are_same(&lit(&rest, [0.0; 2]), &whole[first - 1..]), "{mode} from {first}");
            assert_eq!((rest.facts.strokes, rest.artwork.strokes.len()), (5 - first, 5 - first));
            let told = rest.facts.notes.iter().any(|note| note.text.contains("begins with stroke"));
            assert_eq!(told, first > 1);
        }
    }
}

/// Of two runs, one up to a place in a stroke and one from there on, everything is marked once.
#[test]
fn a_job_goes_on_from_a_place_within_a_stroke() {
    let machine = machine(false, &[]);
    for mode in ["M3", "M4"] {
        let program = program(mode);
        let whole = lit(&planned(&program, &[], &machine), [0.0; 2]);
        // In the first, in one on the same path as others, and in the last.
        for (stroke, along) in [(1, 0.004), (2, 0.0025), (4, 0.009)] {
            let settings = [
                format!("marking.from_stroke={stroke}"),
                format!("marking.from_along=\"{} mm\"", along * 1e3),
            ];
            let rest = planned(&program, &settings.each_ref().map(String::as_str), &machine);
            let mut expected = whole[stroke - 1..].to_vec();
            let [from, to] = expected[0];
            expected[0][0] = from + (to - from).normalize() * along;
            assert!(are_same(&lit(&rest, [0.0; 2]), &expected), "{mode} {stroke} {along}");
            let facts = &rest.facts;
            assert_eq!((facts.strokes, facts.passed_over), (5 - stroke, stroke as u64 - 1));
            assert_eq!(facts.passed_along, along);
            let length: f64 = expected.iter().map(|[from, to]| (to - from).norm()).sum();
            assert!((facts.length - length).abs() < 1e-9, "{facts:?}");
            let text = format!("begins with stroke {stroke}, {:.4} mm along it", along * 1e3);
            assert!(facts.notes.iter().any(|note| note.text.contains(&text)), "{:?}", facts.notes);
        }
    }
}

#[test]
fn a_place_is_found_along_curves_and_corners_as_they_are_drawn() {
    let machine = machine(false, &[]);
    let program = "G21 G90 G64\nM4 S500 F3000\nG1 X10\nG1 Y10\nG3 X0 Y20 I-10\nG1 X-10\n";
    let whole = planned(program, &[], &machine);
    assert_eq!(whole.facts.strokes, 1);
    // 10 mm, 10 mm, a quarter of a circle with a radius of 10 mm; then 3 mm more.
    let along = 20.0 + 5.0 * std::f64::consts::PI + 3.0;
    let setting = format!("marking.from_along=\"{along} mm\"");
    let rest = planned(program, &[&setting], &machine);
    let [from, to] = lit(&rest, [0.0; 2])[0];
    let end = lit(&whole, [0.0; 2])[0][1];
    assert!((from - (end + Vector3::new(7e-3, 0.0, 0.0))).norm() < 1e-6, "{from} {end}");
    assert!((to - end).norm() < 1e-8);
    assert!((rest.facts.length - 7e-3).abs() < 1e-6);
}

#[test]
fn the_end_of_a_stroke_is_the_beginning_of_the_next_and_beyond_it_is_refused() {
    let machine = machine(false, &[]);
    let program = program("M4") + "M3 S200\nG4 P0.1\n";
    let settings = ["marking.from_stroke=2", "marking.from_along=\"10 mm\""];
    let rest = planned(&program, &settings, &machine);
    assert_eq!((rest.facts.passed_over, rest.facts.passed_along, rest.facts.strokes), (2, 0.0, 3));
    // The dot is the fifth.
    let dot = planned(&program, &["marking.from_stroke=5"], &machine);
    assert_eq!((dot.facts.passed_over, dot.facts.strokes), (4, 1));
    for (stroke, along, length) in
        [(2, "10.1", "10.0000"), (4, "11", "10.0000"), (5, "1", "0.0000")]
    {
        let settings =
            [format!("marking.from_stroke={stroke}"), format!("marking.from_along=\"{along} mm\"")];
        let job = job("program.nc", &program, &settings.each_ref().map(String::as_str), &machine);
        let error = plan(&machine, &job).unwrap_err().to_string();
        let expect = format!("stroke {stroke} is {length} mm long");
        assert!(error.contains(&expect) && error.contains("marking.from_along"), "{error}");
    }
    let both = refused(&program, &["marking.from_line=4", "marking.from_along=\"1 mm\""], &machine);
    assert!(both.contains("both say where to begin"), "{both}");
}

#[test]
fn a_stroke_beyond_the_last_is_refused_with_their_number() {
    let machine = machine(false, &[]);
    let job = job("program.nc", &program("M4"), &["marking.from_stroke=5"], &machine);
    let text = plan(&machine, &job).unwrap_err().to_string();
    assert!(text.contains("no stroke 5") && text.contains("has 4"), "{text}");
}

/// The steps that lines from `line` on ask for.
fn steps_from(job: &Job, line: u64) -> Vec<Step> {
    job.drawing.steps.iter().filter(|step| step.line >= line).cloned().collect()
}

#[test]
fn a_program_begins_with_a_line_as_if_those_before_it_had_been_read() {
    let machine = machine(true, &["gcode.air_assist=true"]);
    let program = "G20 G90 G64 P0.001\nG10 L2 P2 X1 Y1\nG55\nG92 X0.5\n#1 = 0.25\nM3 S300 M7\n\
                   G0 X1 Y1 Z0.2\nG91\nG1 X0.5 F100\nG18 G1 Y#1\nG2 X0.2 Z0 I0.1 K0\nG90 G1 X0 S900\n\
                   M5 M9\nM2\n";
    let whole = job("program.nc", program, &[], &machine);
    for line in 9..=12 {
        let setting = format!("marking.from_line={line}");
        let rest = job("program.nc", program, &[&setting], &machine);
        let steps = rest.drawing.steps.clone();
        let before: Vec<&Action> = steps[..3].iter().map(|step| &step.action).collect();
        assert!(matches!(before[0], Action::Corners(_)), "{before:?}");
        assert_eq!(*before[1], Action::Output { bit: 0, on: true });
        let Action::Rapid { to } = before[2] else { panic!("{before:?}") };
        let right = steps_from(&whole, line);
        let begins = match &right[0].action {
            Action::Mark { curve, .. } => curve.from(),
            other => panic!("{other:?}"),
        };
        assert!((to - begins).norm() < 1e-12, "line {line}: {to} {begins}");
        assert_eq!(steps[3..], right, "line {line}");
        assert!(
            rest.drawing.notes.iter().any(|note| note.line == line),
            "{:?}",
            rest.drawing.notes
        );
        assert_eq!(rest.program.unwrap().end, whole.program.unwrap().end);
        let [marked, all] = [&rest, &whole].map(|job| job.program.unwrap().mark_length);
        assert_eq!(line == 9, marked == all);
    }
    // The first line is the whole program.
    let first = job("program.nc", program, &["marking.from_line=1"], &machine);
    assert_eq!(first.drawing, whole.drawing);
}

#[test]
fn a_line_in_a_loop_begins_with_its_first_round() {
    let machine = machine(false, &[]);
    let program = "G21 G91\nM4 S500 F3000\no1 repeat [3]\nG1 X1\nG1 Y1\no1 endrepeat\nM2\n";
    let whole = job("program.nc", program, &[], &machine);
    let rest = job("program.nc", program, &["marking.from_line=5"], &machine);
    let marks = |job: &Job| {
        let marks = job.drawing.steps.iter();
        marks.filter(|step| matches!(step.action, Action::Mark { .. })).cloned().collect::<Vec<_>>()
    };
    assert_eq!(marks(&rest), marks(&whole)[1..]);
}

#[test]
fn a_line_that_is_not_there_is_refused_with_the_last_one() {
    let machine = machine(false, &[]);
    let ends = "G21\nG0 X1\nM2\nG0 X2\n";
    for (program, line, what) in [
        ("G21\nG0 X1\n", 3, "no line 3 to begin with: the program ends at line 2"),
        (ends, 4, "no line 4 to begin with: the program ends at line 3"),
        ("G21\no1 if [0]\nG0 X1\no1 endif\nG0 X2\n", 3, "passes over it and ends at line 5"),
        (ends, 0, "from_line"),
    ] {
        let text = refused(program, &[&format!("marking.from_line={line}")], &machine);
        assert!(text.contains(what), "{text}");
    }
    let text = refused(ends, &["marking.from_line=2", "marking.from_stroke=2"], &machine);
    assert!(text.contains("both say where to begin"), "{text}");
    let letters = Job::builtin(&overrides(&["marking.from_line=2"]), &machine).unwrap_err();
    assert!(letters.to_string().contains("for G-code programs"), "{letters}");
}

#[test]
fn a_line_of_a_program_that_stays_in_its_file_is_begun_with_too() {
    let machine = machine(false, &[]);
    let count = Job::HELD + 100;
    let mut text = "G21 G90 M4 S500 F3000\n".to_owned();
    for line in 2..=count {
        text += &format!("G1 X{} Y{}\n", line % 2, line % 3);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.nc");
    std::fs::write(&path, text).unwrap();
    let setting = overrides(&[&format!("marking.from_line={}", count - 9)]);
    let job = Job::open(&path, &setting, &machine).unwrap();
    assert!(job.rest.is_some());
    let steps: Vec<Step> = job.steps().unwrap().map(Result::unwrap).collect();
    assert!(matches!(steps[0].action, Action::Rapid { .. }));
    assert_eq!(
        steps.iter().map(|step| step.line).collect::<Vec<_>>()[1..],
        [
            count - 9,
            count - 8,
            count - 7,
            count - 6,
            count - 5,
            count - 4,
            count - 3,
            count - 2,
            count - 1,
            count
        ]
    );
    assert_eq!(job.survey.unwrap().steps, 11);
}

/// The places of the tool at each millisecond.
fn places(plan: &Plan) -> Vec<Vector3<f64>> {
    let mut cursor = Cursor::default();
    let count = (plan.facts.duration * 1e3) as u64;
    (0..=count).map(|time| tool(plan, time as f64 * 1e-3, &mut cursor)).collect()
}

#[test]
fn a_dry_run_is_the_same_motion_without_light() {
    let machine = machine(false, &[]);
    let program = program("M3") + "M3 S200\nG4 P0.1\n";
    let lit = planned(&program, &[], &machine);
    let dry = planned(&program, &["marking.dry_run=true"], &machine);
    assert_eq!(places(&lit), places(&dry));
    assert_eq!((lit.facts.duration, lit.facts.samples), (dry.facts.duration, dry.facts.samples));
    assert!(lit.setpoints(1).any(|setpoint| setpoint.laser.is_lit()));
    assert!(dry.trajectory.laser.is_empty() && dry.artwork.strokes.is_empty());
    assert!(
        dry.setpoints(1).all(|it| !it.laser.is_lit() && it.laser.edge_count == 0 && it.stroke == 0)
    );
    assert_eq!((dry.facts.strokes, dry.facts.length, dry.facts.power), (0, 0.0, None));
    assert!(dry.facts.dry_run && !lit.facts.dry_run);
    let notes: Vec<&str> = dry.facts.notes.iter().map(|note| note.text.as_str()).collect();
    assert_eq!(notes, ["dry run: the whole motion, and nothing lit"]);
}

/// The box around the places of the tool from when it is first at the box on.
fn extent(places: &[Vector3<f64>]) -> [Vector3<f64>; 2] {
    let one = [places[0]; 2];
    places.iter().fold(one, |[lower, upper], place| [lower.inf(place), upper.sup(place)])
}

#[test]
fn a_frame_goes_round_what_would_be_marked_and_stays_in_the_area() {
    let machine = machine(false, &[]);
    // As far as the area goes, on one side, so that there is no room for a run-in.
    let program =
        "G21 G90\nM3 S500 F6000\nG0 X-20 Y-300\nG1 X10\nG3 X10 Y-200 I0 J50\nG0 X200 Y250\n";
    let framed = planned(program, &["marking.frame=true", "marking.frame_passes=2"], &machine);
    assert!(framed.trajectory.laser.is_empty());
    assert_eq!(framed.facts.strokes, 0);
    let notes: Vec<&str> = framed.facts.notes.iter().map(|note| note.text.as_str()).collect();
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(notes[0].contains("80.000 mm × 100.000 mm, 2 times, in the dark"), "{notes:?}");
    let places = places(&framed);
    let first = places.iter().position(|at| at.y < -0.3 + 1e-9).unwrap();
    let [lower, upper] = extent(&places[first..]);
    assert!((lower - Vector3::new(-0.02, -0.3, 0.0)).norm() < 1e-6, "{lower}");
    assert!((upper - Vector3::new(0.06, -0.2, 0.0)).norm() < 2e-6, "{upper}");
    // Along the edges alone.
    let on = |at: &Vector3<f64>| {
        [(at.x + 0.02), (at.x - upper.x), (at.y + 0.3), (at.y - upper.y)]
            .iter()
            .any(|off| off.abs() < 1e-6)
    };
    assert!(places[first..].iter().all(on));
}

#[test]
fn a_lit_frame_keeps_to_its_power_and_the_machine_bounds_it() {
    let machine = machine(false, &[]);
    let program = program("M3");
    let settings = ["marking.frame=true", "marking.frame_power=\"1 %\""];
    let framed = planned(&program, &settings, &machine);
    assert!(framed.trajectory.laser.iter().all(|change| change.power <= 0.01 + 1e-12));
    assert_eq!(framed.facts.power, Some([0.01; 2]));
    let bounds = framed.facts.bounds.unwrap();
    assert!((bounds.upper[0] - 0.07).abs() < 1e-9 && (bounds.upper[1] - 0.01).abs() < 1e-9);
    for (settings, what) in [
        (
            &["marking.frame=true", "marking.frame_power=0.2"][..],
            "5 % of full power at most, not 20 %",
        ),
        (&["marking.frame_power=0.01"], "frame = true"),
        (&["marking.frame=true", "marking.frame_passes=0.5"], "frame_passes"),
    ] {
        let text = refused(&program, settings, &machine);
        assert!(text.contains(what), "{text}");
    }
    let stronger = support::machine(false, &["safety.frame_power=0.3", "laser.min_power=0.1"]);
    planned(&program, &["marking.frame=true", "marking.frame_power=0.2"], &stronger);
    let text = refused(&program, &["marking.frame=true", "marking.frame_power=0.01"], &stronger);
    assert!(text.contains("no less than 10 %"), "{text}");
}

#[test]
fn every_kind_of_job_has_a_frame_or_says_why_not() {
    let machine = machine(true, &[]);
    let frame = "[marking]\nframe = true\n";
    for (kind, wide) in [
        ("[letters]\ntext = \"N\"\nheight = \"20 mm\"\n", None),
        ("[points]\npoints = [[\"1 mm\", \"2 mm\"], [\"5 mm\", \"9 mm\"]]\n", Some([4e-3, 7e-3])),
        ("[points]\npoints = [[\"1 mm\", \"2 mm\"]]\n", Some([0.0, 0.0])),
        (
            "[path]\npoints = [[\"0 mm\", \"0 mm\", \"1 mm\"], [\"9 mm\", \"0 mm\", \"4 mm\"]]\n",
            Some([9e-3, 0.0]),
        ),
        ("[drawing]\ntext.content = \"ab\"\n", None),
    ] {
        let job = job("job.toml", &format!("{kind}{frame}"), &[], &machine);
        let planned = plan(&machine, &job).unwrap_or_else(|error| panic!("{kind}: {error}"));
        let places = places(&planned);
        let end = places.last().unwrap();
        let from = places.iter().position(|at| (at - end).norm() < 1e-7).unwrap();
        let [lower, upper] = extent(&places[from..]);
        if let Some(wide) = wide {
            let off = [0, 1].map(|row: usize| (upper[row] - lower[row] - wide[row]).abs());
            assert!(off.iter().all(|off| *off < 1e-6), "{kind} {lower} {upper}");
        }
        assert!((upper.z - lower.z).abs() < 1e-9, "{kind}");
    }
    let text = refused("G21 G0 X5\n", &["marking.frame=true"], &machine);
    assert!(text.contains("nothing is marked"), "{text}");
    let both = "[drawing]\ntext.content = \"a\"\n[frame]\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("job.toml");
    std::fs::write(&path, format!("{both}{frame}")).unwrap();
    let text = Job::read(&path, &[], &machine).unwrap_err().to_string();
    assert!(text.contains("both show"), "{text}");
}

#[test]
fn a_path_that_turns_the_tool_has_no_frame() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let machine =
        Machine::load(format!("{folder}/machines/tri_planar.toml").as_ref(), &[]).unwrap();
    let path = format!("{folder}/jobs/tri_planar_poses.toml");
    let error =
        Job::read(path.as_ref(), &overrides(&["marking.frame=true"]), &machine).unwrap_err();
    assert!(error.to_string().contains("turns the tool"), "{error}");
}

#[test]
fn the_layers_of_a_drawing_are_told_by_name() {
    let machine = machine(false, &[]);
    let job = job(
        "job.toml",
        "[drawings.a]\ntext.content = \"a\"\nlayer = \"cut\"\n[drawings.b]\ntext.content = \"b\"\n\
         [layers.cut]\npower = \"40 %\"\nspeed = \"50 mm/s\"\npasses = 2\n",
        &[],
        &machine,
    );
    let layers = plan(&machine, &job).unwrap().facts.layers;
    let names: Vec<Option<&str>> = layers.iter().map(|layer| layer.name.as_deref()).collect();
    assert_eq!(names, [Some("cut"), None]);
    assert_eq!((layers[0].power, layers[0].speed, layers[0].passes), (0.4, Some(0.05), 2));
    assert!(layers.iter().all(|layer| layer.length > 1e-3 && layer.marks > 0));
}

/// The controller bounds the power of a frame after an override: each of its setpoints says that it is one.
#[test]
fn every_setpoint_of_a_frame_says_so_and_no_other_does() {
    let machine = machine(false, &[]);
    let program = program("M4");
    let are_frames = |settings: &[&str]| -> Vec<bool> {
        let plan = planned(&program, settings, &machine);
        plan.setpoints(1).map(|setpoint| setpoint.has(messages::setpoint::flags::FRAME)).collect()
    };
    let lit = are_frames(&["marking.frame=true", "marking.frame_power=\"1 %\""]);
    assert!(lit.len() > 100 && lit.iter().all(|is_frame| *is_frame));
    assert!(are_frames(&[]).iter().all(|is_frame| !is_frame));
}
