//! Words whose meaning depends on the controller that a program is for, and codes without effect.

use super::words::moves;
use super::*;
use crate::drawing::Power;
use machine::gcode_settings::Dialect;

fn read_as(dialect: Dialect, text: &str) -> Result<Program, Box<GcodeError>> {
    let mut machine = machine(ZMeaning::Ignored);
    machine.gcode.words = dialect.meanings();
    read("job.ngc", text, &machine)
}

fn notes(program: &Program) -> Vec<(u64, &str)> {
    program.drawing.notes.iter().map(|note| (note.line, note.text.as_str())).collect()
}

/// Ends [mm] and powers of all marks.
fn marks(program: &Program) -> Vec<(f64, f64, Power)> {
    let round = |value: f64| (value * 1e12).round() / 1e9;
    let marks = program.drawing.steps.iter().filter_map(|step| match step.action {
        Action::Mark { curve, power, .. } => {
            Some((round(curve.to().x), round(curve.to().y), power))
        }
        _ => None,
    });
    marks.collect()
}

fn dwells(program: &Program) -> Vec<f64> {
    let dwells = program.drawing.steps.iter().filter_map(|step| match step.action {
        Action::Dwell { time, .. } => Some(time),
        _ => None,
    });
    dwells.collect()
}

#[test]
fn codes_that_only_cancel_pass_without_a_note() {
    for preamble in [
        "G00 G49 G40 G17 G80 G50 G90",
        "G0 G17 G21 G40 G49 G80 G69 G15 G90 G94 G54",
        "G21 G40.1 G90 G61.1",
        "G50.1 G97 G98 G64",
        "%\nO1001 (PLATE)\nG90",
        ":1001\nG90",
        "N5 o 7 ; name\nG90",
    ] {
        let program = flat(&format!("{preamble}\nM3 S500\nG0 X10 Y10\nG1 X60 F1200\nM5\nM30\n"));
        assert_eq!(notes(&program), [], "{preamble}");
        assert!((program.facts.mark_length - 0.050).abs() < 1e-15, "{preamble}");
    }
    let program = flat("G50 G0 X5");
    assert!((program.facts.rapid_length - 0.005).abs() < 1e-15);
}

#[test]
fn codes_without_effect_have_one_note_each() {
    let program = flat("T1 M6\nG43 H1\nM17\nM84\nM18\nM48\nM49\nM6 T2\nG43.1 Z0\nG49\nG0 X1");
    let lines: Vec<u64> = notes(&program).iter().map(|note| note.0).collect();
    assert_eq!(lines, [1, 1, 2, 3, 6]);
    assert_eq!(program.drawing.steps.len(), 1);
    // Z beside G43 is a coordinate, as G0 is in force.
    let program = flat("G0 X1\nG43 H1 Z120.");
    assert_eq!(program.facts.upper[2], 0.120);
}

#[test]
fn g10_sets_origins() {
    // What `rs274` of LinuxCNC 2.9 does.
    let text = "G21 G90\nG92 X5\nG10 L2 P1 X15 Y15\nG0 X1 Y1\nG10 L20 P0 X0\nG10 L20 P2 X7\nG55\n\
                G0 X1\nG54\nG0 X1 Y0\nG20\nG10 L2 P0 X1\nG92.1\nG0 X1";
    assert_eq!(
        moves(text),
        [('r', 11.0, 16.0), ('r', 5.0, 16.0), ('r', 12.0, 15.0), ('r', 50.8, 15.0)]
    );
    assert_eq!(
        moves("G10 L20 P1 X0 Y0\nM4 S0\nG0 X10 Y10\nG1 X20 S500 F1000"),
        [('r', 10.0, 10.0), ('m', 20.0, 10.0)]
    );
}

#[test]
fn digital_outputs_are_the_bits_after_the_air_assist() {
    let program = flat("M64 P0\nM62 P3\nM64 P0\nM8\nG0 X1\nM63 P3\nM65 P7");
    let actions: Vec<_> = program.drawing.steps.iter().map(|step| step.action.clone()).collect();
    let output = |bit, on| Action::Output { bit, on };
    assert_eq!(actions[..3], [output(1, true), output(4, true), output(0, true)]);
    // What a program leaves on goes off at its end.
    assert_eq!(actions[4..], [output(4, false), output(0, false), output(1, false)]);
}

#[test]
fn a_digital_output_that_the_machine_file_does_not_have_is_refused() {
    let mut machine = machine(ZMeaning::Ignored);
    machine.gcode.digital_outputs = Some(2);
    assert!(read("job.ngc", "M64 P0\nM62 P1", &machine).is_ok());
    let error = read("job.ngc", "M64 P2", &machine).unwrap_err().to_string();
    assert!(error.contains("P2: the machine file has 2"), "{error}");
}

#[test]
fn a_cluster_is_the_power_of_equal_parts() {
    let program = flat("M4 F600 G1 X3 Y6 S100:0:300\nX4");
    let power = |level| Power { level, follows_speed: true };
    assert_eq!(
        marks(&program),
        [(1.0, 2.0, power(0.1)), (3.0, 6.0, power(0.3)), (4.0, 6.0, power(0.3))]
    );
    assert_eq!(program.facts.power, Some([0.1, 0.3]));
    let program = flat("M3 G93 G1 X4 F60 S100:200");
    for step in &program.drawing.steps {
        assert!(
            matches!(step.action, Action::Mark { speed: Some(speed), .. } if (speed - 4e-3).abs() < 1e-15)
        );
    }
}

#[test]
fn a_dwell_is_in_the_unit_of_its_dialect() {
    let times = |dialect, text| dwells(&read_as(dialect, text).unwrap());
    assert_eq!(times(Dialect::Standard, "G4 P0.4"), [0.4]);
    assert_eq!(times(Dialect::Grbl, "G4 P0.4"), [0.4]);
    assert_eq!(times(Dialect::Marlin, "M3 S5 G4 P400\nG4 S1"), [0.4, 1.0]);
    assert_eq!(times(Dialect::Smoothie, "G4 S2"), [2.0]);
    assert_eq!(times(Dialect::Fanuc, "G0 X5\nG4 X1.5\nG4 P250"), [1.5, 0.25]);
    // S of a dwell is no power there.
    let program = read_as(Dialect::Marlin, "M3 S51 F60\nG4 S1\nG1 X1").unwrap();
    assert_eq!(marks(&program), [(1.0, 0.0, Power { level: 0.2, follows_speed: false })]);
    let lit = flat("M3 S200\nG4 P400");
    assert!(notes(&lit)[0].1.contains("gcode.dwell_unit = \"ms\""));
    assert_eq!(notes(&flat("M3 S200\nG4 P9\nM5\nG4 P400")), []);
}

#[test]
fn the_laser_is_what_its_dialect_has() {
    let text = "M3 S0\nG0 X1\nG1 X2 F60 S1\nM4\nX3\nM5\nX4";
    let follows = |dialect| {
        let marks = marks(&read_as(dialect, text).unwrap());
        let modes: Vec<bool> = marks.iter().map(|mark| mark.2.follows_speed).collect();
        (marks[0].2.level, modes)
    };
    assert_eq!(follows(Dialect::Grbl), (0.001, vec![false, true]));
    assert_eq!(follows(Dialect::Linuxcnc), (0.001, vec![false, false]));
    assert_eq!(follows(Dialect::Smoothie), (1.0, vec![true, true]));
    assert_eq!(follows(Dialect::Marlin), (1.0 / 255.0, vec![false, true]));
    let fan =
        "G90\nM107\nG0 X38.9\nM106 S51\nG1 F360.0\nG1 X58.9\nM107\nG1 X60\nM106\nX61\nM400\nM82";
    let power = |level| Power { level, follows_speed: false };
    let program = read_as(Dialect::Marlin, fan).unwrap();
    assert_eq!(marks(&program), [(58.9, 0.0, power(0.2)), (61.0, 0.0, power(1.0))]);
    assert_eq!(notes(&program).len(), 1);
    let inline = "M3 I S0\nG1 X8.9 S0 F1500\nG1 X18.8 S51\nM5 I\nG1 X0";
    assert_eq!(marks(&read_as(Dialect::Marlin, inline).unwrap()), [(18.8, 0.0, power(0.2))]);
}

#[test]
fn g70_and_g71_are_units_where_the_dialect_has_them() {
    let end = |text| read_as(Dialect::Mach3, text).unwrap().facts.end[0];
    assert_eq!(end("G70 G0 X1"), 0.0254);
    assert_eq!(end("G20 G71\nG0 X1".replace("G20 ", "").as_str()), 0.001);
}

#[test]
fn comments_are_nested_by_a_setting() {
    let mut machine = machine(ZMeaning::Ignored);
    machine.gcode.words.nested_comments = true;
    let program = read("job.ngc", "(a (b) (c (d)) e) G0 X1 (f)", &machine).unwrap();
    assert_eq!(program.facts.end[0], 0.001);
    assert!(read("job.ngc", "(a (b c)\nG0 X1", &machine).is_err());
}

#[test]
fn little_light_is_noted() {
    let program = flat("M4 S0\nG0 X10\nG1 X20 S0.5 F1000\nG1 X30 S1");
    assert_eq!(program.facts.power, Some([0.0005, 0.001]));
    let said = "the largest power is S1 of 1000, 0.10 %: is gcode.full_scale that of the program?";
    assert_eq!(notes(&program), [(0, said)]);
    assert_eq!(notes(&flat("M4 S10 G1 X1 F60")), []);
    assert_eq!(flat("G0 X1").facts.power, None);
}
