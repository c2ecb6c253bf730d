#![allow(clippy::unwrap_used)]

use core::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use machine::analysis::Place;
use machine::mechanisms::MechanismKind;
use machine::{Machine, Motor};
use messages::math;
use messages::time::SETPOINT_TIME;
use nalgebra::Vector2;
use serde_json::Value;

use super::speed::Strokes;
use super::*;
use crate::thesis::data::LETTERS;

#[track_caller]
fn near(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{found} for {expected}");
}

fn subject(stem: &str) -> Subject {
    source_machines().unwrap().into_iter().find(|subject| subject.stem == stem).unwrap()
}

/// What `add` draws of a machine of the source.
fn drawn(stem: &str, add: fn(&Subject, &mut Figures) -> Result<(), FigureError>) -> Figures {
    let mut figures = Figures::default();
    add(&subject(stem), &mut figures).unwrap();
    figures
}

fn table<'a>(figures: &'a Figures, stem: &str) -> &'a Table {
    let found = figures.figures.iter().find(|figure| figure.table.stem == stem);
    &found.unwrap_or_else(|| panic!("no {stem}")).table
}

/// The numbers of a column, read back from the file that is written.
fn column(table: &Table, name: &str) -> Vec<f64> {
    let text = table.text();
    let mut lines = text.lines();
    let index = lines.next().unwrap().split(',').position(|column| column == name).unwrap();
    lines.map(|line| line.split(',').nth(index).unwrap().parse().unwrap_or(f64::NAN)).collect()
}

#[test]
fn every_figure_has_a_picture_with_named_axes_and_numbers_of_its_own() {
    let mut subjects = source_machines().unwrap();
    for subject in &mut subjects {
        subject.jobs.truncate(1);
    }
    let figures = draw_all(&Name::ALL, &subjects, true).unwrap();
    let mut stems: Vec<&str> = Vec::new();
    for figure in &figures.figures {
        let stem = &figure.table.stem;
        assert!(
            figure.svg.starts_with("<svg") && figure.svg.trim_end().ends_with("</svg>"),
            "{stem}"
        );
        for axis in &figure.axes {
            assert!(axis.contains(" [") && axis.ends_with(']'), "{stem}: {axis}");
            assert!(figure.svg.contains(axis.as_str()), "{stem}: {axis} is not in the picture");
        }
        assert!(!figure.svg.contains("NaN") && !figure.svg.contains("inf"), "{stem}");
        assert!(!figure.title.is_empty() && !figure.caption.is_empty(), "{stem}");
        for table in [&figure.table].into_iter().chain(&figure.more) {
            assert!(!table.rows.is_empty(), "{}", table.stem);
            assert!(
                table.rows.iter().all(|row| row.len() == table.columns.len()),
                "{}",
                table.stem
            );
            stems.push(&table.stem);
        }
    }
    let count = stems.len();
    stems.sort_unstable();
    stems.dedup();
    assert_eq!(stems.len(), count, "two files have one name");
    for name in Name::ALL {
        assert!(figures.figures.iter().any(|figure| figure.name == name), "{}", name.word());
    }
    let page = index::page(&figures);
    for figure in &figures.figures {
        assert!(page.contains(&format!("{}.svg", figure.table.stem)));
    }
    // Two machines of straight axes have no singularity, and say so.
    let unknown = figures.skipped.iter().filter(|skipped| skipped.name == Name::Singular);
    assert_eq!(
        unknown.map(|skipped| skipped.of.as_str()).collect::<Vec<_>>(),
        ["cartesian", "corexy"]
    );
}

#[test]
fn torques_are_those_of_masses_rotors_and_friction() {
    // Without springs, which the rotors lead.
    let mut subject = subject("corexy");
    let MechanismKind::CoreXy(belts) = &mut subject.machine.mechanism else { panic!() };
    belts.elasticity = None;
    let job = &subject.jobs[0];
    let plan = planner::plan(&subject.machine, &job.job).unwrap();
    let courses = crate::operating::courses(&subject.machine, &plan);
    let figure = torque::figure(&subject, job, &courses).unwrap();
    assert_eq!((figure.source.as_str(), figure.table.stem.as_str()), ("4-7", "torque_4-7_N1"));
    let setpoints: Vec<_> = plan.setpoints(1).collect();
    let of = |name: &str| column(&figure.table, name);
    let [time, speed, rpm, all, load, rotor, friction, power] =
        ["t", "a_speed", "a_speed_rpm", "a_torque", "a_load", "a_rotor", "a_friction", "a_power"]
            .map(of);
    assert_eq!(time.len(), setpoints.len());
    let axis = &subject.machine.actuators[0];
    // τ = r·(m_x·ẍ + m_y·ÿ)/2, the joints being x + y and x − y.
    let mut even = 0;
    let (same, cross) = ((0.33 + 1.06) / 4.0, (0.33 - 1.06) / 4.0);
    for (index, setpoint) in setpoints.iter().enumerate() {
        let acceleration = [setpoint.acceleration[0], setpoint.acceleration[1]];
        let force = same * acceleration[0] + cross * acceleration[1];
        // A plan's torque is the mean over the cycle about the instant: the torque at the instant while the
        // jerk stays as it is.
        let around = &setpoints[index.saturating_sub(1)..(index + 2).min(setpoints.len())];
        if around.len() == 3 && around.iter().all(|one| one.jerk == setpoint.jerk) {
            let turning = 2e-6 * acceleration[0] / axis.ratio;
            assert!((rotor[index] - turning).abs() < 1e-9, "{index}: {}", rotor[index]);
            assert!((load[index] - axis.ratio * force).abs() < 1e-9, "{index}: {}", load[index]);
            even += 1;
        } else {
            assert!((load[index] - axis.ratio * force).abs() < 4e-4, "{index}: {}", load[index]);
        }
        assert!((all[index] - load[index] - rotor[index] - friction[index]).abs() < 1e-12);
        assert!((power[index] - all[index] * speed[index]).abs() < 1e-9);
        assert!((rpm[index] - speed[index] * 60.0 / TAU).abs() < 1e-9);
        assert!((time[index] - setpoint.sequence as f64 * SETPOINT_TIME).abs() < 1e-12);
        let expected = 5e-3 * if speed[index].abs() < 1e-6 { 0.0 } else { speed[index].signum() };
        assert!((friction[index] - expected - 1e-6 * speed[index]).abs() < 1e-12);
    }
    assert!(even > setpoints.len() / 2, "{even} of {}", setpoints.len());
    // Table 4-1: 1729 rpm at 0.16 m/s on the diagonal, here on N's slanted line.
    let fastest = rpm.iter().fold(0.0, |most: f64, speed| most.max(speed.abs()));
    assert!(fastest > 1600.0 && fastest < 2800.0, "{fastest}");
}

/// The motor leads the load through its spring, and takes torque for that: it is the rotor's.
#[test]
fn a_load_is_the_same_behind_a_spring() {
    let elastic = subject("corexy");
    let mut rigid = elastic.clone();
    let MechanismKind::CoreXy(belts) = &mut rigid.machine.mechanism else { panic!() };
    belts.elasticity = None;
    let loads = [&elastic, &rigid].map(|subject| {
        let plan = planner::plan(&subject.machine, &subject.jobs[0].job).unwrap();
        let courses = crate::operating::courses(&subject.machine, &plan);
        courses[0].points.iter().map(|point| point.load).collect::<Vec<_>>()
    });
    let most = loads[1].iter().fold(0.0, |most: f64, load| most.max(load.abs()));
    for (index, (elastic, rigid)) in loads[0].iter().zip(&loads[1]).enumerate() {
        assert!((elastic - rigid).abs() < 0.1 * most, "{index}: {elastic} {rigid}");
    }
}

#[test]
fn numbers_of_figures_are_those_of_the_source() {
    let subjects = source_machines().unwrap();
    for (stem, first, last) in [
        ("cartesian", "3-11", "3-22"),
        ("corexy", "4-7", "4-18"),
        ("five_bar", "5-11", "5-22"),
        ("prrrp", "6-8", "6-19"),
    ] {
        let subject = subjects.iter().find(|subject| subject.stem == stem).unwrap();
        assert_eq!(subject.jobs.len(), 12);
        assert_eq!((subject.jobs[0].stem.as_str(), subject.jobs[0].source.as_str()), ("N1", first));
        assert_eq!(
            (subject.jobs[11].stem.as_str(), subject.jobs[11].source.as_str()),
            ("O5", last)
        );
    }
}

#[test]
fn a_motor_gives_what_its_data_sheet_says() {
    let figures = drawn("cartesian", motor::add);
    let found = table(&figures, "motor_cartesian_x");
    assert_eq!(figures.figures[0].source, "3-23");
    let [speed, rpm, voltage, current, power, efficiency] =
        ["speed", "speed_rpm", "torque_voltage", "current", "power", "efficiency"]
            .map(|name| column(found, name));
    // EC035.120: 12 V, 2.3 Ω, 21 mN·m/A.
    let (volts, ohms, constant) = (12.0, 2.3, 0.021);
    assert_eq!(speed.len(), 201);
    near(voltage[0], constant * volts / ohms, 1e-12);
    near(rpm[200], volts / constant * 60.0 / TAU, 1e-12);
    for index in 0..speed.len() {
        let amperes = (volts - constant * speed[index]) / ohms;
        assert!((current[index] - amperes).abs() < 1e-9);
        assert!((voltage[index] - constant * amperes).abs() < 1e-9);
        assert!((power[index] - constant * amperes * speed[index]).abs() < 1e-9);
        // Of V·i, what is left after R·i².
        if amperes > 1e-6 {
            let kept = 1.0 - ohms * amperes * amperes / (volts * amperes);
            assert!((efficiency[index] - kept).abs() < 1e-9);
        }
    }
    // Half way: V²/4R.
    near(power[100], volts * volts / (4.0 * ohms), 1e-12);
    let points = &figures.figures[0].more[0];
    assert!(points.rows.len() > 1000, "{}", points.rows.len());
}

#[test]
fn accelerations_and_forces_lie_in_the_sources_sectors() {
    let figures = drawn("cartesian", acceleration::add);
    let found = table(&figures, "acceleration_3-2");
    let [angle, without, force] =
        ["angle", "acceleration_without_rotors", "force"].map(|name| column(found, name));
    let lead = 15e-3 / (TAU * 3.0);
    for (index, angle) in angle.iter().enumerate() {
        let (sine, cosine) = math::sin_cos(*angle);
        // Sectors in which one motor or the other sets the limit.
        let forces = [0.015_358 / lead / cosine.abs(), 0.002_626_1 / lead / sine.abs()];
        near(force[index], forces[0].min(forces[1]), 1e-9);
        near(without[index], (forces[0] / 1.93).min(forces[1] / 0.33), 1e-9);
    }
    near(without[0], 10.0, 1e-3);

    let figures = drawn("corexy", acceleration::add);
    let found = table(&figures, "acceleration_4-2");
    let [angle, force] = ["angle", "force"].map(|name| column(found, name));
    for (index, angle) in angle.iter().enumerate() {
        // With F1 = C/r and F2 = F1·(1 − t)/(1 + t): |F| = 2·C/(r·(cos + sin)), alike in all four.
        let (sine, cosine) = math::sin_cos(*angle);
        let most = 2.0 * 0.008_687_5 / 1.25e-3 / (sine.abs() + cosine.abs());
        near(force[index], most, 1e-9);
    }
    near(column(found, "acceleration_without_rotors")[0], 42.121_212, 1e-7);
    near(column(found, "acceleration_without_rotors")[180], 13.113_208, 1e-7);
    // With its own motors and rotors: two rotors of 2e-6 kg·m² beside the masses.
    let own = table(&figures, "acceleration_corexy");
    let Motor::Dc(motor) = subject("corexy").machine.actuators[0].motor else { panic!() };
    let rotors = 2.0 * 2e-6 / (1.25e-3 * 1.25e-3);
    let stall = motor.stall_torque();
    near(column(own, "acceleration")[0], 2.0 * stall / 1.25e-3 / (0.33 + rotors), 1e-9);
}

#[test]
fn screw_and_belt_are_as_stiff_as_a_hand_computes() {
    let mut figures = Figures::default();
    stiffness::add_source(&mut figures).unwrap();
    let axial = table(&figures, "screw_axial");
    let middle = column(axial, "stroke").iter().position(|at| (at - 0.125).abs() < 1e-9).unwrap();
    let area = PI * 0.014 * 0.014 / 4.0;
    for (stroke, shaft) in column(axial, "stroke").iter().zip(column(axial, "shaft")) {
        near(shaft, 22e10 * area / stroke, 1e-9);
    }
    near(column(axial, "shaft")[middle], 2.709e8, 1e-3);
    let torsional = table(&figures, "screw_torsional");
    near(column(torsional, "axial_in_rotation")[middle], 1544.1, 5e-5);
    near(column(torsional, "torsional")[middle], 2553.0, 5e-5);
    near(column(torsional, "series")[middle], 962.2, 5e-5);

    let span = table(&figures, "belt_span");
    let at = |length: f64| {
        let index =
            column(span, "length").iter().position(|at| (at - length).abs() < 1e-9).unwrap();
        column(span, "stiffness")[index]
    };
    for (length, stiffness) in [(0.1, 75e3), (0.25, 30e3), (0.475, 15.789_473_68e3), (0.5, 15e3)] {
        near(at(length), stiffness, 1e-9);
    }
    near(at(0.7), 10.714_285_71e3, 1e-9);

    let belts = table(&figures, "belts");
    let [x, y, first, second] = ["x", "y", "belt_1", "belt_2"].map(|name| column(belts, name));
    assert_eq!(x.len(), 21 * 21);
    for index in 0..x.len() {
        for (found, out) in
            [(first[index], y[index] + x[index]), (second[index], y[index] - x[index])]
        {
            let expected = 7500.0 / (0.475 - out) + 7500.0 / (0.475 + out);
            near(found, expected, 1e-9);
        }
    }
}

#[test]
fn a_push_at_the_tool_is_met_by_belts_and_links() {
    let figures = drawn("corexy", stiffness::add);
    let found = table(&figures, "stiffness_corexy");
    assert_eq!(found.rows.len(), 21 * 21);
    for least in column(found, "least").into_iter().chain(column(found, "most")) {
        near(least, 60e3, 1e-9);
    }
    // Each arm of the five-bar yields by its own: K_t⁻¹ = J·Jᵀ/K.
    let figures = drawn("five_bar", stiffness::add);
    let found = table(&figures, "stiffness_five_bar");
    let machine = subject("five_bar").machine;
    let [x, y, least, most] = ["x", "y", "least", "most"].map(|name| column(found, name));
    for index in 0..x.len() {
        let place = Place::with_tool_at(&machine, [x[index], y[index], 0.0]).unwrap();
        let velocity = place.manipulability().unwrap().velocity;
        near(least[index], 2750.0 / (velocity[0].value * velocity[0].value), 1e-6);
        near(most[index], 2750.0 / (velocity[1].value * velocity[1].value), 1e-6);
    }
}

/// Where a five-bar's elbow is, outwards, with the tool at `tool`; by the cosine rule.
fn elbow(tool: Vector2<f64>, side: f64) -> Vector2<f64> {
    let motor = Vector2::new(-0.05 * side, 0.0);
    let out = tool - motor;
    let length = out.norm();
    let open = math::acos((0.04 + length * length - 0.0625) / (0.4 * length));
    let angle = math::atan2(out.y, out.x) + side * open;
    let (sine, cosine) = math::sin_cos(angle);
    motor + Vector2::new(cosine, sine) * 0.2
}

#[test]
fn ellipses_of_the_five_bar_follow_from_its_forearms() {
    let figures = drawn("five_bar", ellipses::add);
    let line = table(&figures, "ellipses_y_five_bar");
    assert_eq!(figures.figures[0].source, "5-8");
    let [x, y, major, minor, det] =
        ["x", "y", "major", "minor", "det"].map(|name| column(line, name));
    assert_eq!(x.len(), 13);
    near(y[6], 0.33, 1e-12);
    near(major[6], 0.200_116, 5e-6);
    near(minor[6], 0.198_309, 5e-6);
    near(major[0], 0.237_375, 5e-6);
    for index in 0..x.len() {
        // Each forearm keeps its length: dᵢ·Ṗ = θ̇ᵢ·(dᵢ × pᵢ) with d from elbow to tool, p from the motor.
        let tool = Vector2::new(x[index], y[index]);
        let rows = [1.0, -1.0].map(|side| {
            let elbow = elbow(tool, side);
            let (d, p) = (tool - elbow, elbow - Vector2::new(-0.05 * side, 0.0));
            d / (d.y * p.x - d.x * p.y)
        });
        let inverse = rows[0].x * rows[1].y - rows[0].y * rows[1].x;
        near(det[index], 1.0 / inverse, 1e-9);
        near(major[index] * minor[index], 1.0 / inverse.abs(), 1e-9);
        let squares = rows[0].norm_squared() + rows[1].norm_squared();
        let found = 1.0 / (major[index] * major[index]) + 1.0 / (minor[index] * minor[index]);
        near(found, squares, 1e-9);
    }
    let force = column(line, "force_major");
    near(force[0], 1.0 / minor[0], 1e-9);
}

#[test]
fn eigenvalues_of_the_prrrp_follow_from_its_triangle() {
    let figures = drawn("prrrp", ellipses::add);
    let found = table(&figures, "eigenvalues_prrrp");
    let [x, across, up, force_x, force_y] =
        ["x", "velocity_x", "velocity_y", "force_x", "force_y"].map(|name| column(found, name));
    near(x[0], 0.03, 1e-12);
    near(x[160], 0.27, 1e-12);
    for index in 0..x.len() {
        let square = x[index] * x[index];
        near(across[index], (0.09 - square) / (2.0 * square), 1e-9);
        near(up[index], 0.5, 1e-9);
        near(force_x[index], 2.0 * square / (0.09 - square), 1e-9);
        near(force_y[index], 2.0, 1e-9);
    }
}

#[test]
fn singular_curves_of_the_five_bar_are_arms_and_forearms_in_line() {
    let figures = drawn("five_bar", singular::add);
    let found = table(&figures, "singular_five_bar");
    let mut seen = [0; 3];
    for row in &found.rows {
        let [Cell::Text(kind), _, Cell::Number(x), Cell::Number(y)] = row.as_slice() else {
            panic!()
        };
        let tool = Vector2::new(*x, *y);
        let from = |motor: f64| (tool - Vector2::new(motor, 0.0)).norm();
        match kind.as_str() {
            "unreachable_leg_1" | "unreachable_leg_2" => {
                let leg = usize::from(kind.ends_with('2'));
                let length = from([-0.05, 0.05][leg]);
                let off = (length - 0.45).abs().min((length - 0.05).abs());
                assert!(off < 1e-9, "{kind}: {length}");
                seen[leg] += 1;
            }
            "wrong_assembly_mode" => {
                // Forearms in line: the tool half way between elbows two forearms apart, or both forearms
                // on one line from elbows in one place.
                let [one, two] = [1.0, -1.0].map(|side| tool - elbow(tool, side));
                let sine = (one.x * two.y - one.y * two.x) / 0.0625;
                assert!(sine.abs() < 1e-5, "{x} {y}: {sine}");
                seen[2] += 1;
            }
            other => panic!("{other}"),
        }
    }
    assert!(seen.iter().all(|count| *count > 20), "{seen:?}");
}

#[test]
fn times_of_letters_are_the_golden_ones() {
    let text = include_str!("../../../tests/golden/letters.json");
    let golden: Value = serde_json::from_str(text).unwrap();
    for letter in LETTERS {
        let name = format!("{letter:?}");
        let results = &golden["H1_literal_J500"]["letters"][name]["results"];
        for result in results.as_array().unwrap() {
            let strokes = Strokes::of_letter(letter, result["scale_m"].as_f64().unwrap());
            let speed = result["thesis"]["V"].as_f64().unwrap();
            let model = &result["model"]["path_limited"];
            let expected = model["T_at_table_V"].as_f64().unwrap();
            assert!((strokes.time(speed, 10.0, 500.0) - expected).abs() < 1e-9);
            // The golden optimum is the best of speeds 10 mm/s apart.
            let speed = model["V_opt"].as_f64().unwrap();
            let expected = model["T_opt"].as_f64().unwrap();
            assert!((strokes.time(speed, 10.0, 500.0) - expected).abs() < 1e-9);
            let (fastest, least) = strokes.optimum(10.0, 500.0);
            assert!(least <= expected + 1e-9, "{least} {expected}");
            assert!(fastest > 0.25 || least > 0.99 * expected, "{least} {expected}");
            // … and none is above 0.25 m/s.
            assert!((fastest.min(0.25) - speed).abs() < 0.01, "{fastest} {speed}");
        }
    }
}

#[test]
fn chords_err_by_two_percent_from_sixteen_on() {
    let mut figures = Figures::default();
    chords::add(&mut figures).unwrap();
    let found = table(&figures, "chords");
    let [chords, angle, error, within] =
        ["chords", "angle", "error", "within"].map(|name| column(found, name));
    for index in 0..chords.len() {
        assert!((error[index] - (1.0 - math::cos(PI / chords[index]))).abs() < 1e-12);
        near(angle[index], TAU / chords[index], 1e-12);
        assert_eq!(within[index], f64::from(u8::from(chords[index] >= 16.0)));
    }
    near(error[12], 0.021_852_4, 2e-6);
    near(error[13], 0.019_214_7, 2e-6);
    // The largest angle within 2 %, and the printed one.
    near(2.0 * math::acos(0.98) * 180.0 / PI, 22.956_7, 1e-5);
    near(1.0 - math::cos(0.05), 0.001_249_739, 1e-6);
}

#[test]
fn modes_over_the_area_are_those_of_masses_on_springs() {
    let figures = drawn("corexy", modes::add);
    let found = table(&figures, "modes_corexy");
    for (name, mass) in [("mode_1", 1.06), ("mode_2", 0.33)] {
        for frequency in column(found, name) {
            near(frequency, (60e3_f64 / mass).sqrt() / TAU, 1e-9);
        }
    }
    let figures = drawn("five_bar", modes::add);
    let found = table(&figures, "modes_five_bar");
    let [x, y, first, second] = ["x", "y", "mode_1", "mode_2"].map(|name| column(found, name));
    assert_eq!(x.len(), 21 * 21);
    let home =
        (0..x.len()).find(|index| x[*index].abs() < 1e-12 && (y[*index] - 0.33).abs() < 1e-12);
    let home = home.unwrap();
    near(first[home], 46.016, 1e-5);
    near(second[home], 52.186, 1e-5);
}

#[test]
fn links_of_the_source_have_these_numbers() {
    let mut figures = Figures::default();
    beams::add_source(&mut figures).unwrap();
    let found = table(&figures, "beams");
    let numbers = |name: &str| column(found, name);
    // Arm, forearm, link of the PRRRP.
    let expected = [
        ("EJ_over_L", [916.667, 733.333, 611.111]),
        ("three_EJ_4L", [687.5, 550.0, 458.333]),
        ("two_EJ_L", [1833.333, 1466.667, 1222.222]),
        ("three_EJ_L", [2750.0, 2200.0, 1833.333]),
        ("pinned_1", [602.051_027, 385.312_657, 267.578_234]),
        ("clamped_1", [214.478_769, 137.266_412, 95.323_897]),
    ];
    for (name, expected) in expected {
        for (found, expected) in numbers(name).iter().zip(expected) {
            near(*found, expected, 1e-6);
        }
    }
    assert_eq!(numbers("printed_stiffness"), [366.0, 293.0, 440.0]);
}

#[test]
fn the_arm_of_a_polar_machine_is_the_beam_of_its_file() {
    let text = include_str!("../../../machines/polar_beam.toml");
    let machine = Machine::parse("polar_beam", text, &[]).unwrap();
    let MechanismKind::Polar(polar) = &machine.mechanism else { panic!() };
    let beam = beams::arm(polar).unwrap();
    near(beam.rigidity, 210e9 * 2e-8, 1e-12);
    let subject =
        Subject { stem: "polar_beam".to_owned(), machine, chapter: None, jobs: Vec::new() };
    let mut figures = Figures::default();
    beams::add(&subject, &mut figures).unwrap();
    let found = table(&figures, "beam_polar_beam");
    let [mass, first, sag] = ["head_mass", "mode_1", "sag"].map(|name| column(found, name));
    near(mass[50], 0.38, 1e-12);
    // A head alone on the spring 3EJ/L³ swings a little faster than with the beam's own mass.
    let spring = 3.0 * 4200.0 / (0.25 * 0.25 * 0.25);
    let alone = (spring / 0.38_f64).sqrt() / TAU;
    assert!(first[50] < alone && first[50] > FRAC_1_SQRT_2 * alone, "{} {alone}", first[50]);
    near(sag[50], 9.806_65 * (0.38 + 0.375 * 1.2) / spring, 1e-3);
    // Without a head it is the beam's own first mode.
    let own = 1.875_104_068_711_961_f64;
    let scale = (4200.0_f64 / (1.2 * 0.25 * 0.25 * 0.25)).sqrt() / TAU;
    near(first[0], own * own * scale, 1e-9);
}
