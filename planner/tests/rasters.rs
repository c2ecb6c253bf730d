//! Rasters as programs write them: every way to say that a pixel is dark is the same raster.

#![allow(clippy::unwrap_used)]

mod support;

use std::fmt::Write as _;

use support::{lit, machine, planned};

/// How a program says that a stretch of a row is dark.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    /// `G1 S0`, one move a stretch.
    White,
    /// `G1 S…`, one move a pixel.
    Pixels,
    /// `G0`.
    Rapid,
    /// `M5`, and `M3` or `M4` where it is lit again.
    Gate,
    /// `M67 E0 Q0`.
    Analog,
}

const FORMS: [Form; 5] = [Form::White, Form::Pixels, Form::Rapid, Form::Gate, Form::Analog];

/// Pixels of a row and of a block of one shade, and their size [mm].
const PIXELS: usize = 500;
const BLOCK: usize = 20;
const PIXEL: f64 = 0.1;

/// A raster of 50 mm by `rows` lines, 0.1 mm apart, to and fro at 300 mm/s: blocks of 2 mm, lit and dark,
/// with `overscan` [mm] of `G1 S0` beyond both ends of each row.
fn raster(form: Form, mode: &str, rows: usize, overscan: f64) -> String {
    let mut text = format!("G21 G90\nF18000\n{mode} S0\n");
    for row in 0..rows {
        let sign = if row % 2 == 0 { 1.0 } else { -1.0 };
        let mut x = -25.0 * sign;
        writeln!(text, "G0 X{:.4} Y{:.4}", x - sign * overscan, row as f64 * PIXEL).unwrap();
        if overscan > 0.0 {
            writeln!(text, "G1 X{x:.4} S0").unwrap();
        }
        for block in 0..PIXELS / BLOCK {
            let is_lit = block % 2 == 0;
            let power = if is_lit { 500 } else { 0 };
            let moves = if form == Form::Pixels { BLOCK } else { 1 };
            for _ in 0..moves {
                x += sign * PIXEL * (BLOCK / moves) as f64;
                match (form, is_lit) {
                    (Form::White | Form::Pixels, _) => writeln!(text, "G1 X{x:.4} S{power}"),
                    (Form::Rapid, true) => writeln!(text, "G1 X{x:.4} S500"),
                    (Form::Rapid, false) => writeln!(text, "G0 X{x:.4}"),
                    (Form::Gate, true) => writeln!(text, "{mode} S500\nG1 X{x:.4}"),
                    (Form::Gate, false) => writeln!(text, "M5\nG1 X{x:.4}"),
                    (Form::Analog, _) => writeln!(text, "M67 E0 Q{power}\nG1 X{x:.4}"),
                }
                .unwrap();
            }
        }
        if overscan > 0.0 {
            writeln!(text, "G1 X{:.4} S0", x + sign * overscan).unwrap();
        }
    }
    text + "M5\n"
}

#[test]
fn every_form_of_a_raster_takes_the_same_time() {
    let machine = machine(false, &[]);
    // Rows of 50 mm at 300 mm/s are 6.83 s of light. A dark overscan of the file is left to the run-in
    // and run-out of M3; under M4 it is part of the path, from rest to rest.
    for (mode, overscan, expected) in
        [("M3", 0.0, 10.27), ("M3", 5.0, 10.27), ("M4", 0.0, 9.76), ("M4", 5.0, 11.13)]
    {
        for form in FORMS {
            let plan = planned(&raster(form, mode, 41, overscan), &[], &machine);
            let facts = &plan.facts;
            let name = format!("{form:?}, {mode}, overscan of {overscan} mm");
            assert!(
                (facts.duration / expected - 1.0).abs() < 0.01,
                "{name}: {} s instead of {expected} s",
                facts.duration
            );
            assert_eq!(facts.strokes, 41 * 13, "{name}");
            assert!((facts.length - 41.0 * 13.0 * 2e-3).abs() < 1e-6, "{name}");
            assert!(facts.notes.is_empty(), "{name}: {:?}", facts.notes);
        }
    }
}

/// A row that is led to the next by a dark step at feed rather than by a free move.
#[test]
fn dark_steps_between_rows_with_overscan_cost_no_stop() {
    let machine = machine(false, &[]);
    let text = raster(Form::White, "M3", 11, 5.0);
    let (free, fed) =
        (text.clone(), text.replace("G0 X-30", "G1 S0 X-30").replace("G0 X30", "G1 S0 X30"));
    let [free, fed] = [free, fed].map(|text| planned(&text, &[], &machine).facts.duration);
    assert!((fed / free - 1.0).abs() < 0.05, "{fed} s, {free} s");
}

/// With room to come to speed in the dark that is drawn, power in proportion marks a row as constant power does, and
/// what is dark between two rows is flown; without it the tool goes along what is drawn.
#[test]
fn rows_in_proportion_are_entered_at_speed_where_the_overscan_has_room() {
    let machine = machine(false, &[]);
    for form in FORMS {
        // 300 mm/s are reached within 7.5 mm.
        for (overscan, expected) in [(7.0, None), (8.0, Some(10.27))] {
            let text = raster(form, "M4", 41, overscan).replace("G0 X", "G1 S0 X");
            let plan = planned(&text, &[], &machine);
            let name = format!("{form:?}, overscan of {overscan} mm: {} s", plan.facts.duration);
            let is_close = |expected: f64| (plan.facts.duration / expected - 1.0).abs() < 0.01;
            assert!(expected.map_or(plan.facts.duration > 11.0, is_close), "{name}");
            let reach = (25.0 + overscan) * 1e-3 + 1e-9;
            assert!(plan.setpoints(1).all(|it| it.position[0].abs() < reach), "{name}");
            assert_eq!(plan.facts.strokes, 41 * 13, "{name}");
            let lines = lit(&plan, [0.0; 2]);
            for (index, [from, to]) in lines.iter().enumerate() {
                let (row, block) = (index / 13, index % 13);
                let sign = if row % 2 == 0 { 1.0 } else { -1.0 };
                let start = sign * (-0.025 + 4e-3 * block as f64);
                let off = (from.x - start).abs().max((to.x - start - sign * 2e-3).abs());
                let beside = (from.y - row as f64 * PIXEL * 1e-3).abs();
                assert!(off.max(beside) < 1e-6, "{name}: row {row}, block {block}: {off} m");
            }
            let power = plan.trajectory.laser.iter().map(|change| change.power);
            let full = power.filter(|power| *power > 0.0 && (power - 0.5).abs() > 1e-6).count();
            assert_eq!(full > 0, expected.is_none(), "{name}");
        }
    }
}

#[test]
fn free_moves_one_after_the_other_keep_their_corner() {
    let machine = machine(false, &[]);
    let text = "G21 G90\nM3 S500 F6000\nG1 X20\nG1 X25 S0\nG0 X100\nG0 Y50\nG1 X0 S500\n";
    let plan = planned(text, &[], &machine);
    let passes =
        |it: messages::Setpoint| (it.position[0] - 0.1).abs() < 2e-3 && it.position[1].abs() < 1e-3;
    assert!(plan.setpoints(1).any(passes));
}

#[test]
fn lit_steps_are_left_out_of_rasters_and_not_of_slots() {
    let machine = machine(false, &[]);
    let slot = "G21 G90\nF3000\nM3 S500\nG1 X10\nG1 Y0.3\nG1 X0\n";
    let raster = format!("{slot}G1 Y0.6\nG1 X10\nG1 Y0.9\nG1 X0\n");
    let comb = "G21 G90\nF3000\nM3 S500\nG1 X10\nG1 Y0.3\nG1 X0\nG1 Y2\nG1 X10\nG1 Y2.3\nG1 X0\n";
    for (text, length, is_told) in
        [(slot, 20.3, false), (raster.as_str(), 40.0, true), (comb, 42.3, false)]
    {
        let facts = planned(text, &[], &machine).facts;
        assert!((facts.length - length * 1e-3).abs() < 1e-5, "{} m of {text}", facts.length);
        let told = facts.notes.iter().any(|note| note.text.contains("rows of this raster"));
        assert_eq!(told, is_told, "{text}");
    }
}

/// What other controllers call scan offset: the delays shift light in time, so in the direction of each
/// row, and what makes up for them does so at every speed.
#[test]
fn rows_to_and_fro_line_up_whatever_the_delays_of_the_laser() {
    for delays in [[0.0, 0.0], [150e-6, 150e-6], [400e-6, 50e-6], [20e-6, 300e-6]] {
        let settings = delays.map(|delay| format!("{delay} s"));
        let on = format!("laser.on_delay={}", settings[0]);
        let off = format!("laser.off_delay={}", settings[1]);
        let machine = machine(false, &[&on, &off]);
        for (mode, feed) in [("M3", "F18000"), ("M4", "F18000"), ("M3", "F3000")] {
            let text = raster(Form::White, mode, 4, 0.0).replace("F18000", feed);
            let lines = lit(&planned(&text, &[], &machine), delays);
            assert_eq!(lines.len(), 4 * 13);
            for (index, [from, to]) in lines.iter().enumerate() {
                let (row, block) = (index / 13, index % 13);
                let sign = if row % 2 == 0 { 1.0 } else { -1.0 };
                let start = sign * (-0.025 + 4e-3 * block as f64);
                let end = start + sign * 2e-3;
                let off = (from.x - start).abs().max((to.x - end).abs());
                assert!(off < 1e-6, "{delays:?} {mode} {feed}: row {row}, block {block}: {off} m");
            }
        }
    }
}
