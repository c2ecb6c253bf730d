//! Drawings by the speed profiles of the sources: the golden times of the letters (source 003), and the
//! golden paths of the twin actuator with their pulses (source 004).

#![allow(clippy::unwrap_used)]

use machine::kinematics::Joints;
use machine::pulses::{nearest, quantisation_bound};
use machine::{Machine, Mechanism, MechanismVisitor, Override};
use nalgebra::{Vector2, Vector3};
use planner::drawing::{Action, Curve, Drawing, Power, Step};
use planner::paper::{Paper, Profile, on_paper};
use planner::{Job, MarkingSpeed, PlanError};
use serde_json::Value;

fn golden(name: &str) -> Value {
    let path = format!("{}/../tests/golden/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn set(settings: &[(&str, String)]) -> Vec<Override> {
    settings
        .iter()
        .map(|(key, value)| Override { key: (*key).to_owned(), value: value.clone() })
        .collect()
}

#[track_caller]
fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    let error = (found - expected).abs();
    assert!(error <= tolerance, "{what}: {found} against {expected}, off by {error:e}");
}

fn letter(machine: &Machine, name: &str, height: f64, style: &str, speed: f64) -> Paper {
    let settings = set(&[
        ("letters.text", name.to_owned()),
        ("letters.height", format!("{height} m")),
        ("letters.style", style.to_owned()),
        ("marking.speed", format!("{speed} m/s")),
    ]);
    let job = Job::builtin(&settings, machine).unwrap();
    on_paper(machine, &job, Profile::Trapezoid).unwrap()
}

/// Both readings of the source's table: the time at the printed speed, the least of all speeds that are
/// multiples of 10 mm/s, and the strokes of which they are made.
#[test]
fn letters_take_the_golden_times_by_trapezoids_of_acceleration() {
    let file = golden("letters");
    let mut machine = Machine::builtin();
    for (style, convention, jerk, model) in [
        ("h1", "H1_literal_J500", 500.0, "path_limited"),
        ("h2", "H2_table_replica", 500.0, "J500_ret"),
        ("h2", "H2_table_replica", 5000.0, "J5000_ret"),
    ] {
        machine.path.jerk = jerk;
        for name in ["N", "A", "S", "O"] {
            let of = &file[convention]["letters"][name];
            for result in of["results"].as_array().unwrap() {
                let height = number(&result["scale_m"]);
                let speed = number(&result["thesis"]["V"]);
                let golden = &result["model"][model];
                let case = format!("{style} {name} at {height} m, {model}");
                let facts = letter(&machine, name, height, style, speed).facts;
                near(&case, facts.time, number(&golden["T_at_table_V"]), 1e-9);
                near(&case, facts.speed, speed, 1e-15);
                assert_eq!(facts.strokes.len() as u64, of["n_strokes"].as_u64().unwrap());
                let length: f64 = facts.strokes.iter().map(|stroke| stroke.length).sum();
                let expected = height * number(&of["polyline_length_over_height"]);
                near(&case, length, expected, 1e-12);
                // The machine's 0.25 m/s in 25 steps.
                let best = facts.times.iter().min_by(|one, other| one.time.total_cmp(&other.time));
                let best = best.unwrap();
                near(&case, best.speed, number(&golden["V_opt"]), 1e-12);
                near(&case, best.time, number(&golden["T_opt"]), 1e-9);
                let least = facts.least.unwrap();
                assert!(least.time <= best.time, "{case}");
                near(&case, least.speed, best.speed, 0.0101);
            }
        }
    }
}

/// What is written of a drawing on paper is where its closed forms have it: sampled once more, speed and
/// acceleration are differences of place and speed, and within the limits.
#[test]
fn the_samples_of_a_letter_move_as_the_profile_says() {
    let machine = Machine::builtin();
    let paper = letter(&machine, "A", 0.02, "h1", 0.18);
    let samples: Vec<_> = paper.setpoints(&machine, 7).unwrap().collect();
    assert_eq!(samples.len(), (paper.facts.time * 1e3).ceil() as usize + 1);
    assert_eq!(samples[0].tool, machine.home);
    let mut lit = 0;
    for trio in samples[..samples.len() - 1].windows(3) {
        let place = |index: usize| Vector3::from(trio[index].tool);
        let now = &trio[1];
        let speed = (place(2) - place(0)).norm() / 2e-3;
        // The jerk steps: a·T/2 at a corner of the course, j·T²/6 elsewhere.
        near("speed", now.path_velocity, speed, 5e-4);
        assert!(now.path_acceleration <= 10.0 * (1.0 + 1e-9));
        assert!(now.path_jerk <= 500.0 * (1.0 + 1e-9));
        if now.laser.is_lit() {
            lit += 1;
            near("marked at one speed", now.path_velocity, 0.18, 1e-12);
        }
    }
    let length: f64 = paper.facts.strokes.iter().map(|stroke| stroke.length).sum();
    near("lit", f64::from(lit) * 1e-3, length / 0.18, 5e-3);
}

fn pair(value: &Value) -> Vector3<f64> {
    Vector3::new(number(&value[0]), number(&value[1]), 0.0)
}

fn curve(input: &Value) -> Curve {
    let (first, second) = (pair(&input["args"][0]), pair(&input["args"][1]));
    if input["kind"] == "line" {
        return Curve::Line { from: first, to: second };
    }
    let major = second - first;
    Curve::Arc {
        centre: first,
        major,
        minor: Vector3::z().cross(&major),
        start: 0.0,
        sweep: number(&input["args"][2]),
        rise: Vector3::zeros(),
    }
}

/// A golden path of source 004 on paper, counted in whole pulses each millisecond.
struct Counted<'a> {
    path: &'a Value,
    machine: &'a Machine,
    paper: &'a Paper,
}

impl MechanismVisitor for Counted<'_> {
    type Output = ();

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) {
        let Self { path, machine, paper } = self;
        let (input, output) = (&path["input"], &path["output"]);
        let rule = &output["round_rule"];
        let samples: Vec<_> = paper.setpoints(machine, 1).unwrap().collect();
        assert_eq!(samples.len() as u64, rule["steps"].as_u64().unwrap() + 1);
        let per_length: [f64; N] = core::array::from_fn(|axis| {
            let of = &machine.actuators[axis];
            of.motor.stepper().unwrap().pulses_per_radian() / of.ratio
        });
        let first = samples[0].position;
        let (mut pos_err, mut path_err, mut bound) = (0.0_f64, 0.0_f64, 0.0_f64);
        let mut counts = [0; N];
        for sample in &samples {
            counts = core::array::from_fn(|axis| {
                nearest(per_length[axis] * (sample.position[axis] - first[axis]))
            });
            let q = Joints::from_fn(|axis, _| first[axis] + counts[axis] as f64 / per_length[axis]);
            let tool = mechanism.forward(&q, mechanism.branch()).unwrap().position;
            pos_err = pos_err.max((tool - Vector3::from(sample.tool)).norm());
            path_err = path_err.max(miss(&curve(input), &tool));
            let exact = Joints::from_fn(|axis, _| sample.position[axis]);
            let chain = mechanism.solve(&exact, mechanism.branch(), None).unwrap();
            bound = bound.max(quantisation_bound(&mechanism.jacobian(&chain), &per_length));
        }
        let expected: Vec<i64> =
            rule["N"].as_array().unwrap().iter().map(|count| number(count) as i64).collect();
        assert_eq!(counts.as_slice(), expected, "{input}");
        near("position", pos_err, number(&rule["pos_err"]), 1e-12);
        near("path", path_err, number(&rule["path_err"]), 1e-12);
        near("bound", bound, number(&rule["bound"]), 1e-4 * bound);
    }
}

/// Distance of `point` from a curve.
fn miss(curve: &Curve, point: &Vector3<f64>) -> f64 {
    match *curve {
        Curve::Line { from, to } => {
            let (along, off) = ((to - from).normalize(), point - from);
            (off - along * off.dot(&along).clamp(0.0, (to - from).norm())).norm()
        }
        Curve::Arc { centre, major, .. } => ((point - centre).norm() - major.norm()).abs(),
    }
}

#[test]
fn the_golden_paths_are_made_by_trapezoids_of_velocity() {
    let file = golden("twin_actuator");
    let paths = file["paths"].as_array().unwrap();
    assert_eq!(paths.len(), 5);
    for path in paths {
        let input = &path["input"];
        let microsteps = input["micro"].to_string();
        let text = include_str!("../../machines/twin_actuator.toml");
        let settings = set(&[
            ("path.acceleration", format!("{} m/s^2", number(&input["a_max"]))),
            ("path.speed", "0.05 m/s".to_owned()),
            ("axis.la.motor.stepper.microsteps", microsteps.clone()),
            ("axis.lb.motor.stepper.microsteps", microsteps),
        ]);
        let machine = Machine::parse("twin_actuator.toml", text, &settings).unwrap();
        let curve = curve(input);
        let power = Power { level: 1.0, follows_speed: false };
        let mark = Action::Mark { curve, speed: None, power };
        let mut job = Job::of(Drawing {
            name: "golden".to_owned(),
            start: curve.from(),
            steps: vec![Step { action: mark, line: 3 }],
            notes: Vec::new(),
        });
        job.marking.speed = Some(MarkingSpeed::Constant(number(&input["v_max"])));
        let paper = on_paper(&machine, &job, Profile::Velocity).unwrap();
        near("T", paper.facts.time, number(&path["output"]["T"]), 1e-12);
        assert_eq!((paper.facts.strokes.len(), paper.facts.strokes[0].line), (1, 3));
        for sample in path["output"]["samples"].as_array().unwrap() {
            let planner::trajectory::Reference::Tool(tool) = paper.reference(number(&sample["t"]))
            else {
                panic!("the tool leads")
            };
            let expected: Vector2<f64> = pair(&sample["P"]).xy();
            near("P", (tool.position.xy() - expected).norm(), 0.0, 1e-12);
        }
        let counted = Counted { path, machine: &machine, paper: &paper };
        machine.mechanism.visit(counted);
    }
}

/// Moves that go on into each other at one speed are a stroke; a corner, a change of speed and the dark
/// end one. A bend that asks for more than the machine gives is told.
#[test]
fn strokes_end_where_the_path_or_what_is_asked_of_it_changes() {
    let machine = Machine::builtin();
    let program = "G21 G90 G17\nM3 S1000 F600\nG1 X10\nG1 X20\nG2 X30 Y-10 J-10\nF1200\nG1 Y-20\n\
                   G1 X40\nM5\nG0 X0 Y0\nM2\n";
    let read = planner::job::gcode::read("strokes.ngc", program, &machine).unwrap();
    let job = Job::of(read.drawing);
    let facts = on_paper(&machine, &job, Profile::Trapezoid).unwrap().facts;
    assert_eq!(facts.strokes.len(), 3);
    for (stroke, (line, speed)) in facts.strokes.iter().zip([(3, 0.01), (7, 0.02), (8, 0.02)]) {
        assert_eq!(stroke.line, line);
        near("speed", stroke.speed, speed, 1e-15);
    }
    near("length", facts.strokes[0].length, 0.02 + 0.01 * core::f64::consts::FRAC_PI_2, 1e-12);
    let slow = on_paper(&machine, &job, Profile::Velocity).unwrap();
    assert!(slow.facts.time < facts.time && slow.notes.is_empty());
    let mut job = job;
    job.marking.speed = Some(MarkingSpeed::Constant(machine.path.speed));
    let mut tight = machine.clone();
    tight.path.acceleration = 1.0;
    let notes = on_paper(&tight, &job, Profile::Velocity).unwrap().notes;
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(notes[0].text.contains("across the path"), "{notes:?}");
    job.surface = Some(machine::surface::Surface {
        shape: machine::surface::Shape::Plane,
        placement: machine::surface::Placement::HERE,
    });
    assert_eq!(on_paper(&machine, &job, Profile::Velocity), Err(PlanError::NotOnPaper));
}
