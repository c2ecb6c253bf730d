//! What single words mean.

use machine::gcode_settings::Dialect;

use super::*;
use crate::drawing::{Corners, Power};
use crate::job::gcode::read_by;
use crate::job::gcode::settings::ReaderSettings;

/// The ends of all moves [mm], a letter for each: rapid, mark or feed in the dark.
pub(super) fn moves(text: &str) -> Vec<(char, f64, f64)> {
    let program = flat(text);
    check_sound(&program, text);
    let millimetres = |value: f64| (value * 1e12).round() / 1e9;
    program
        .drawing
        .steps
        .iter()
        .filter_map(|step| match step.action {
            Action::Rapid { to } => Some(('r', to)),
            Action::Mark { curve, .. } => Some(('m', curve.to())),
            Action::Feed { curve, .. } => Some(('f', curve.to())),
            _ => None,
        })
        .map(|(kind, to)| (kind, millimetres(to.x), millimetres(to.y)))
        .collect()
}

#[test]
fn the_laser_marks_only_while_on_and_powered() {
    assert_eq!(
        moves("M3 S10 G0 X1\nG1 X2 F60\nS0 X3\nS10 X4\nM5 X5\nM4 X6\nG0 X7"),
        [
            ('r', 1.0, 0.0),
            ('m', 2.0, 0.0),
            ('f', 3.0, 0.0),
            ('m', 4.0, 0.0),
            ('f', 5.0, 0.0),
            ('m', 6.0, 0.0),
            ('r', 7.0, 0.0)
        ]
    );
    let program = flat("G1 F60 M3 X1\nX2");
    assert_eq!(program.drawing.notes.len(), 1);
    assert_eq!(program.facts.mark_length, 0.0);
}

#[test]
fn power_is_a_fraction_of_full_scale() {
    let program = flat("M4 S250 G1 X1 F60\nM3 S1000 X2");
    let powers: Vec<_> = program
        .drawing
        .steps
        .iter()
        .map(|step| match step.action {
            Action::Mark { power, .. } => power,
            _ => panic!("{step:?}"),
        })
        .collect();
    assert_eq!(
        powers,
        [Power { level: 0.25, follows_speed: true }, Power { level: 1.0, follows_speed: false }]
    );
}

#[test]
fn coordinates_are_absolute_or_incremental_in_either_unit() {
    assert_eq!(
        moves("g90 g0 x10 y5\ng91 x-1 y.5\ny1\ng90 y0"),
        [('r', 10.0, 5.0), ('r', 9.0, 5.5), ('r', 9.0, 6.5), ('r', 9.0, 0.0)]
    );
    assert_eq!(
        moves("G20 G0 X1\nG21 X1\nG20 G91 Y1"),
        [('r', 25.4, 0.0), ('r', 1.0, 0.0), ('r', 1.0, 25.4)]
    );
}

#[test]
fn origins_shift_and_machine_frame() {
    let mut machine = machine(ZMeaning::Ignored);
    machine.home = [0.1, 0.1, 0.0];
    machine.gcode.origins[0] = [0.1, 0.1, 0.0];
    machine.gcode.origins[8] = [0.02, 0.0, 0.0];
    let text = "G0 X1\nG59.3 X1 Y2\nG53 G0 X5 Y6\nG92 X0 Y0\nX1 Y1\nG92.2 X1\nG92.3 X1\nG92.1 Y0\n\
                G54 G28 X3\nG28";
    let program = read("job.ngc", text, &machine).unwrap();
    check_sound(&program, text);
    let expected = [
        [0.101, 0.1],
        [0.021, 0.002],
        [0.005, 0.006],
        [0.006, 0.007],
        [0.021, 0.007],
        [0.006, 0.007],
        [0.006, 0.0],
        [0.103, 0.0],
        [0.1, 0.0],
        [0.1, 0.1],
    ];
    assert_eq!(program.drawing.steps.len(), expected.len());
    for (step, [x, y]) in program.drawing.steps.iter().zip(expected) {
        let Action::Rapid { to } = step.action else { panic!("{step:?}") };
        assert!((to - Vector3::new(x, y, 0.0)).norm() < 1e-15, "{step:?}");
    }
    assert!(program.facts.end.iter().all(|end| end.abs() < 1e-15), "{:?}", program.facts);
}

#[test]
fn places_are_kept_and_gone_back_to() {
    let mut machine = machine(ZMeaning::Ignored);
    machine.home = [0.1, 0.1, 0.0];
    let text = "G53 G0 X1 Y2\nG28.1\nG53 G0 X3 Y4\nG30.1\nG28\nG30\nG91 G28 X1\n\
                G20\n#5181=1 #5182=[#5161*25.4]\nG90 G30";
    let program = read("job.ngc", text, &machine).unwrap();
    check_sound(&program, text);
    let places: Vec<[f64; 2]> = program
        .drawing
        .steps
        .iter()
        .map(|step| {
            let Action::Rapid { to } = step.action else { panic!("{step:?}") };
            [to.x, to.y].map(|value| (value * 1e9).round() / 1e6)
        })
        .collect();
    let expected = [
        [1.0, 2.0],
        [3.0, 4.0],
        // G28, and G30, each from where the tool is.
        [1.0, 2.0],
        [3.0, 4.0],
        // Through a point along x; y stays where that is.
        [4.0, 4.0],
        [1.0, 4.0],
        // Set as parameters, in inches.
        [25.4, 25.4],
    ];
    assert_eq!(places, expected);
}

#[test]
fn a_line_without_motion_makes_no_step() {
    let program = flat("G0 X1\nX1\nG1 F60\nX1 Z5\nX1.0000000004\nZ0\nG4 P0\n\n(nothing)\nN7\n");
    assert_eq!(program.drawing.steps.len(), 1);
    assert_eq!(program.facts.blocks, 8);
    assert!((program.facts.feed_length - 0.010).abs() < 1e-12);
    // What is too short to draw is made up for by the next move.
    let program = flat("G1 F60 G91\nX.0000005\nX.0000004\nX.0000003\nX1");
    let ends: Vec<_> = program.drawing.steps.iter().map(|step| step.action.clone()).collect();
    let Action::Feed { curve: Curve::Line { from, to }, .. } = ends[1] else { panic!("{ends:?}") };
    assert_eq!(ends.len(), 2);
    assert!((from.x - 1.2e-9).abs() < 1e-18 && (to.x - 1.0000012e-3).abs() < 1e-15);
}

#[test]
fn a_dwell_is_lit_under_m3_alone() {
    let program = flat("S500 G4 P1\nM3 G4 P2\nM4 G4 P3\nM5 G4 P4");
    let dwells: Vec<_> = program.drawing.steps.iter().map(|step| step.action.clone()).collect();
    assert_eq!(
        dwells,
        [
            Action::Dwell { time: 1.0, lit: None },
            Action::Dwell { time: 2.0, lit: Some(0.5) },
            Action::Dwell { time: 3.0, lit: None },
            Action::Dwell { time: 4.0, lit: None },
        ]
    );
}

#[test]
fn a_program_stops_pauses_and_ends() {
    let program = flat("%\nG0 X1 M0\nM1\nM8\nX2 M30\nG99999 nonsense");
    let actions: Vec<_> = program.drawing.steps.iter().map(|step| step.action.clone()).collect();
    assert_eq!(actions.len(), 5);
    assert_eq!(actions[1], Action::Pause);
    assert_eq!(actions[2], Action::Output { bit: 0, on: true });
    assert_eq!(actions[4], Action::Output { bit: 0, on: false });
    assert_eq!(program.drawing.notes[0].line, 3);
    assert_eq!(moves("%\nG0 X1\n%\nG0 X2"), [('r', 1.0, 0.0)]);
    assert_eq!(moves("\u{feff}G0 X1\r\nX2\r\n"), [('r', 1.0, 0.0), ('r', 2.0, 0.0)]);
    assert_eq!(moves(""), []);
}

#[test]
fn a_machine_without_air_assist_says_so() {
    let mut machine = machine(ZMeaning::Ignored);
    machine.gcode.air_assist = false;
    let program = read("job.ngc", "M8\nG0 X1\nM9", &machine).unwrap();
    assert_eq!(program.drawing.steps.len(), 1);
    assert_eq!(program.drawing.notes.len(), 1);
}

/// The corners of a program, each with its line.
fn corners(text: &str) -> Vec<(u64, Corners)> {
    let steps = flat(text).drawing.steps;
    let corners = steps.iter().filter_map(|step| match step.action {
        Action::Corners(corners) => Some((step.line, corners)),
        _ => None,
    });
    corners.collect()
}

#[test]
fn corners_are_exact_or_blended_from_where_the_program_says_so() {
    assert_eq!(corners("G0 X1\nX2"), []);
    assert_eq!(
        corners("G61\nG0 X1 G61.1\nG64\nX2 G64 P0.05 Q0.1\nG64 P0.05\nG64 P0\nG61\nG20 G64 P0.01"),
        [
            (1, Corners::Exact),
            (3, Corners::Blend(None)),
            (4, Corners::Blend(Some(0.05e-3))),
            (6, Corners::Exact),
            (8, Corners::Blend(Some(0.01 * 0.0254))),
        ]
    );
    assert!(flat("G64 P0.1").drawing.notes.is_empty());
}

/// Speed [m/s] and power of every feed, dark where it has none.
fn feeds(text: &str) -> Vec<(f64, Option<Power>)> {
    let steps = flat(text).drawing.steps;
    let feeds = steps.iter().filter_map(|step| match step.action {
        Action::Mark { speed, power, .. } => Some((speed.unwrap(), Some(power))),
        Action::Feed { speed, .. } => Some((speed, None)),
        _ => None,
    });
    feeds.collect()
}

#[test]
fn power_changes_alone_on_a_line_from_the_next_move_on() {
    let lit = |level| Some(Power { level, follows_speed: true });
    assert_eq!(
        feeds("M4 S500 F60\nG1 X1\nS250\nX2\nX3 S0\nX4\nS1000\nX5\nM5\nX6"),
        [0.5, 0.25, 0.0, 0.0, 1.0, 0.0].map(|level| (1e-3, lit(level).filter(|_| level > 0.0)))
    );
}

#[test]
fn an_analog_output_is_the_power_until_s_says_another() {
    let lit = |level| Some(Power { level, follows_speed: false });
    let text = "M3 S1000 F60\nM68 E0 Q0\nG1 X1\nM67 E0 Q370\nX2\nm67e0q740 X3\nM67 E0 Q0\nX4\n\
                S100\nX5\nM67 E0 Q20 S30\nX6\nM5\nX7\nM67 E0 Q500\nX8";
    assert_eq!(
        feeds(text),
        [0.0, 0.37, 0.74, 0.0, 0.1, 0.02, 0.0, 0.0]
            .map(|level| (1e-3, lit(level).filter(|_| level > 0.0)))
    );
    // Nothing but the power changes: the moves follow each other.
    assert_eq!(flat(text).drawing.steps.len(), 8);
    // It is a power, so there is none to miss.
    assert!(flat("M4 M67 E0 Q50\nG1 X1 F60").drawing.notes.is_empty());
}

#[test]
fn under_inverse_time_the_speed_is_the_length_by_the_time() {
    let speeds: Vec<f64> =
        feeds("G93 G1 X3 Y4 F60\nX3 Y0 F120\nG94 X0 F60").iter().map(|feed| feed.0).collect();
    let expected = [0.005, 0.008, 0.001];
    assert!(speeds.iter().zip(expected).all(|(speed, wanted)| (speed - wanted).abs() < 1e-15));
    assert_eq!(speeds.len(), expected.len());
}

#[test]
fn degrees_of_a_lead_around_a_workpiece_in_a_chuck() {
    let text = include_str!("../../../../../machines/rotary.toml");
    let machine = Machine::parse("rotary.toml", text, &[]).unwrap();
    let quarter = machine.chuck_radius().unwrap() * core::f64::consts::FRAC_PI_2;
    let ends = |program: &str| -> Vec<f64> {
        let steps = read("a.nc", program, &machine).unwrap().drawing.steps;
        let to = steps.iter().filter_map(|step| match step.action {
            Action::Rapid { to } => Some(to.y),
            Action::Mark { curve, .. } => Some(curve.to().y),
            _ => None,
        });
        to.map(|y| y - machine.gcode.origins[0][1]).collect()
    };
    let near = |found: Vec<f64>, right: &[f64]| {
        assert_eq!(found.len(), right.len());
        let are_near = found.iter().zip(right).all(|(one, other)| (one - other).abs() < 1e-12);
        assert!(are_near, "{found:?} {right:?}");
    };
    near(
        ends("G0 A90 X1\nM3 S500 G1 F600 A-90\nG91 G20 A45"),
        &[quarter, -quarter, -quarter / 2.0],
    );
    near(ends("G0 A90\nG92 A0\nG0 A90\nY0"), &[quarter, 2.0 * quarter, quarter]);
    // Another dialect leaves the chuck where it is.
    let settings = ReaderSettings::of(&machine).with_words(Dialect::Marlin.meanings());
    assert!(read_by("a.nc", "G0 A90", &settings).is_ok());
    assert!(read("a.nc", "G0 A90 Y1", &machine).unwrap_err().message.contains("twice"));
    let refused = read("a.nc", "G0 A90", &Machine::builtin()).unwrap_err();
    assert!(refused.message.contains("no rotary axis"), "{}", refused.message);
}
