//! What a person reads: places, suggestions, overrides, warnings.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use machine::document::{Attachments, Document, Override, Position};
use machine::{CornerMode, Machine, MechanismKind, Timing};

const COREXY: &str = include_str!("../../machines/corexy.toml");

fn set(settings: &[&str]) -> Vec<Override> {
    settings.iter().map(|setting| setting.parse().unwrap()).collect()
}

#[track_caller]
fn refused(from: &str, to: &str, expected: &[&str]) {
    let text = COREXY.replacen(from, to, 1);
    assert_ne!(text, COREXY, "`{from}` is not in the file");
    let error = Machine::parse("corexy.toml", &text, &[]).unwrap_err();
    let messages: Vec<String> = error
        .problems()
        .map(|problem| {
            let place = format!("{}:{}", problem.line().unwrap(), problem.column().unwrap());
            format!("{place}: {}", problem.message())
        })
        .collect();
    assert_eq!(messages, expected);
}

/// One missing bracket makes hundreds of errors further down, which only follow from it.
#[test]
fn of_malformed_toml_the_first_error_is_told() {
    let text = COREXY.replacen("y = [\"0 mm\", \"200 mm\"]", "y = [\"0 mm\", \"200 mm\"", 1);
    assert_ne!(text, COREXY);
    let error = Machine::parse("corexy.toml", &text, &[]).unwrap_err();
    let lines: Vec<usize> = error.problems().map(|problem| problem.line().unwrap()).collect();
    let missing = COREXY.lines().position(|line| line.starts_with("y = [")).unwrap() + 1;
    assert!(lines.len() == 1 && (missing..=missing + 3).contains(&lines[0]), "{lines:?}");
    // Keys that stand there twice are errors of their own.
    let twice = COREXY.replacen("[path]\n", "[path]\nspeed = \"1 m/s\"\nspeed = \"2 m/s\"\n", 1);
    let error = Machine::parse("corexy.toml", &twice, &[]).unwrap_err();
    assert_eq!(error.problems().count(), 2, "{error}");
}

#[test]
fn errors_say_what_is_wrong_and_what_would_be_right() {
    refused(
        "pulley_radius =",
        "puley_radius =",
        &["29:1: unknown key `puley_radius`; did you mean `pulley_radius`?"],
    );
    refused(
        "\"10 m/s^2\"",
        "10",
        &[
            "21:16: `10` has no unit, but an acceleration is needed; write it with its unit, such as \
           \"10 m/s^2\"",
        ],
    );
    refused(
        "\"10 m/s^2\"",
        "\"10 m/s\"",
        &[
            "21:16: `10 m/s` is a speed, but an acceleration is needed; write an acceleration such as \
           \"10 m/s^2\"",
        ],
    );
    refused("\"2.3 ohm\"", "\"2.3 Ohm\"", &["47:14: `Ohm` is not a unit; did you mean `ohm`?"]);
    refused(
        "mass_x = \"0.33 kg\"",
        "",
        &["26:12: `mass_x` is missing in the table `corexy`; add `mass_x = \"0.33 kg\"` to the \
           table `corexy`"],
    );
    refused(
        "z = \"ignored\"",
        "z = \"focused\"",
        &["106:5: `focused` is not a meaning of Z; did you mean \"focus\"?"],
    );
    refused(
        "tolerance = \"5 um\"",
        "corners = \"blended\"",
        &["23:11: `blended` is not a way to pass corners; did you mean \"blend\"?"],
    );
    refused(
        "tolerance = \"5 um\"",
        "corners = true",
        &[
            "23:11: this is true or false, but a way to pass corners (\"blend\", \"exact\") is needed",
        ],
    );
    refused(
        "z = \"ignored\"",
        "z = \"focus\"",
        &[
            "106:5: Z cannot move the focus: the mechanism has no z axis; write \"ignored\", or add \
           the z axis",
        ],
    );
    refused(
        "following_error = \"1 mm\"",
        "velocity = \"0.8 m/s\"",
        &["62:12: the motor reaches 0.7143 m/s without load, not 0.8 m/s; lower the limit, or \
           leave it out to use 90 % of what the motor can do"],
    );
    refused(
        "following_error = \"1 mm\"",
        "velocity = \"400 rad/s\"",
        &[
            "62:12: axis `a` moves along a line: this unit does not fit; write it with a length, such \
           as \"1 mm\"",
        ],
    );
    refused(
        "velocity = \"160 rad/s\"",
        "velocity = \"400 rad/s\"",
        &["67:12: the current loop (349 rad/s) must be faster than the velocity loop around it \
           (400 rad/s); raise `loops.current` or lower \
           `loops.velocity`"],
    );
    refused(
        "on_delay = \"0 us\"",
        "on_delay = \"1e15 s\"",
        &[
            "101:12: an `on_delay` of 1000000000000000 s is too long; a laser source answers within \
           1 s",
        ],
    );
    refused(
        "off_delay = \"0 us\"",
        "off_delay = \"1001 ms\"",
        &["102:13: an `off_delay` of 1.001 s is too long; a laser source answers within 1 s"],
    );
    refused(
        "on_delay = \"0 us\"",
        "frequency = [\"80 kHz\", \"20 kHz\"]",
        &["101:14: the lowest frequency is above the highest one; write the lower one first: \
           frequency = [\"20 kHz\", \"80 kHz\"]"],
    );
    refused(
        "[laser]",
        "[drives.hostmot2]\naddress = \"10.0.0.1\"\nactuators.a.stepgen = 0\n\
         actuators.b.stepgen = 1\n[laser]\nfrequency = [\"20 kHz\", \"80 kHz\"]",
        &[
            "105:14: [drives.hostmot2] cannot set the frequency of the pulses; leave `frequency` out: \
           the source keeps the one that it is set to",
        ],
    );
    refused(
        "[laser]",
        "[drives.ethercat]\nudp = \"127.0.0.1:34980\"\nactuators.a.slave = 0\nactuators.b.slave = 1\n\
         [inputs.stop]\nfunction = \"estop\"\n[laser]",
        &[
            "100:9: nothing is said of where the input `stop` is; add [drives.ethercat.inputs.stop] with its \
           `slave` and `bit`",
        ],
    );
    for (stall, found) in [("0.9 ms", "0.0009"), ("51 ms", "0.051"), ("1e15 s", "1000000000000000")]
    {
        refused(
            "[laser]",
            &format!("[realtime]\nstall = \"{stall}\"\n[laser]"),
            &[&format!(
                "101:9: a `stall` of {found} s cannot be tolerated; write a time from 1 ms, one cycle, \
                 to 50 ms"
            )],
        );
    }
}

#[test]
fn a_tolerated_stall_is_a_time_of_which_whole_cycles_count() {
    let read = |table: &str| {
        let text = COREXY.replacen("[laser]", &format!("[realtime]\n{table}\n[laser]"), 1);
        Machine::parse("machine.toml", &text, &[]).unwrap().realtime
    };
    for (stall, cycles) in [("1 ms", 1), ("2.999 ms", 2), ("0.01 s", 10), ("50 ms", 50)] {
        let timing = read(&format!("stall = \"{stall}\""));
        let found = (timing.stalled_cycles(), timing.feedback_gap());
        assert_eq!(found, (cycles, cycles + 1), "{stall}");
    }
    for (period, cycles) in [("125 us", 80), ("0.25 ms", 40), ("1.5 ms", 6), ("2 ms", 5)] {
        let timing = read(&format!("period = \"{period}\"\nstall = \"10 ms\""));
        assert_eq!(timing.stalled_cycles(), cycles, "{period}");
    }
    assert_eq!(Machine::builtin().realtime, Timing::DEFAULT);
    assert_eq!(read("period = \"1 ms\"\nstall = \"10 ms\""), Timing::DEFAULT);
}

#[test]
fn a_period_that_no_cycle_can_have_is_refused_and_a_stall_is_at_least_one() {
    for (period, found) in [("200 us", "0.0002"), ("0.1 ms", "0.0001"), ("5 ms", "0.005")] {
        refused(
            "[laser]",
            &format!("[realtime]\nperiod = \"{period}\"\n[laser]"),
            &[&format!(
                "101:10: a control cycle cannot have a `period` of {found} s; write a whole multiple of \
                 125 us, from 125 us (8 kHz) to 4000 us (250 Hz)"
            )],
        );
    }
    refused(
        "[laser]",
        "[realtime]\nperiod = \"2 ms\"\nstall = \"1 ms\"\n[laser]",
        &[
            "102:9: a `stall` of 0.001 s cannot be tolerated; write a time from 2 ms, one cycle, to 50 ms",
        ],
    );
}

#[test]
fn loops_that_would_swing_in_a_long_cycle_are_slower_and_so_are_defaults() {
    // Written: as they are where the cycle bears them, and told of where they are slower.
    for (period, slower) in [("1 ms", 1.0), ("1.25 ms", 1.0), ("2 ms", 2.0), ("4 ms", 4.0)] {
        let table = format!("[realtime]\nperiod = \"{period}\"\n[laser]");
        let text = COREXY.replacen("[laser]", &table, 1);
        let machine = Machine::parse("machine.toml", &text, &[]).unwrap();
        let gains = machine.actuators[0].gains;
        let found = [gains.position, gains.velocity, gains.current].map(|it| it * slower);
        assert_eq!(found, [40.0, 160.0, 349.0], "{period}");
        let told = machine.warnings.iter().filter(|it| it.text.contains("would swing in one of"));
        let lines: Vec<usize> = told.map(|warning| warning.line).collect();
        assert_eq!(lines, if slower > 1.0 { vec![66, 95] } else { vec![] }, "{period}");
    }
    let long = "current = \"1000 rad/s\"";
    refused(
        "current = \"349 rad/s\"",
        long,
        &[
            "68:11: a current loop of 1000 rad/s swings without end in a control cycle of 1 ms; lower \
           `loops.current`: 333 rad/s is safe; or shorten the period",
        ],
    );
    let written =
        ["position = \"40 1/s\"\n", "velocity = \"160 rad/s\"\n", "current = \"349 rad/s\"\n"];
    let silent = written.iter().fold(COREXY.to_owned(), |text, line| text.replace(line, ""));
    for (period, slower) in [("0.25 ms", 1.0), ("1 ms", 1.0), ("2 ms", 2.0), ("4 ms", 4.0)] {
        let table = format!("[realtime]\nperiod = \"{period}\"\n[laser]");
        let text = silent.replacen("[laser]", &table, 1);
        let gains = Machine::parse("machine.toml", &text, &[]).unwrap().actuators[0].gains;
        let found = [gains.position, gains.velocity, gains.current].map(|it| it * slower);
        assert_eq!(found, [40.0, 160.0, 349.0], "{period}");
    }
}

#[test]
fn independent_errors_are_reported_together() {
    let text = COREXY.replacen("0.33 kg", "0.33 lb", 1).replacen("jerk =", "jerky =", 1).replacen(
        "gear = 8",
        "gear = -8",
        1,
    );
    let error = Machine::parse("corexy.toml", &text, &[]).unwrap_err();
    let lines: Vec<_> = error.problems().map(|problem| problem.line().unwrap()).collect();
    assert_eq!(lines, [22, 27, 39]);
}

#[test]
fn the_report_shows_the_line_with_its_label() {
    let text = COREXY.replacen("10 m/s^2", "10 mps", 1);
    let error = Machine::parse("machines/corexy.toml", &text, &[]).unwrap_err();
    let mut report = String::new();
    miette::GraphicalReportHandler::new_themed(miette::GraphicalTheme::unicode_nocolor())
        .render_report(&mut report, &error)
        .unwrap();
    for part in [
        "machines/corexy.toml:21:16",
        "21 │ acceleration = \"10 mps\"",
        "`mps` is not a unit",
        "help: did you mean",
    ] {
        assert!(report.contains(part), "`{part}` is not in\n{report}");
    }
}

#[test]
fn overrides_change_values_and_the_last_one_counts() {
    let settings = set(&[
        "path.jerk=5000 m/s^3",
        "path.acceleration=\"20 m/s^2\"",
        "path.acceleration=12 m/s^2",
        "axis.a.gear=10",
        "gcode.origins.g59_3=[\"1 mm\", \"2 mm\"]",
        "name=Other",
    ]);
    let machine = Machine::parse("corexy.toml", COREXY, &settings).unwrap();
    assert_eq!(machine.path.jerk, 5000.0);
    assert_eq!(machine.path.acceleration, 12.0);
    assert_eq!(machine.actuators[0].ratio, 0.001);
    assert_eq!(machine.actuators[1].ratio, 0.00125);
    assert_eq!(machine.gcode.origins[8], [0.001, 0.002, 0.0]);
    assert_eq!(machine.name, "Other");
}

#[track_caller]
fn override_refused(setting: &str, expected: &str) {
    let error = Machine::parse("corexy.toml", COREXY, &set(&[setting])).unwrap_err();
    assert_eq!((error.line(), error.column()), (None, None));
    assert_eq!(Position::of(&error), Position::default());
    assert_eq!(error.to_string(), expected);
}

#[test]
fn what_is_other_in_the_plant_alone_is_laid_over_last_and_named_as_it_was_written() {
    let both = set(&["path.jerk=400 m/s^3"]);
    let plant = set(&["mechanism.corexy.mass_x=0.4 kg", "path.jerk=300 m/s^3"]);
    let simulated = Machine::simulated(None, Attachments::default(), &both, &plant).unwrap();
    assert_eq!(simulated.path.jerk, 300.0);
    let error =
        Machine::simulated(None, Attachments::default(), &both, &set(&["path.jrk=3"])).unwrap_err();
    assert!(error.to_string().contains("--set plant.path.jrk=3: unknown key `jrk`"), "{error}");
    let error = Machine::simulated(None, Attachments::default(), &set(&["path.jrk=3"]), &plant)
        .unwrap_err();
    assert!(error.to_string().contains("--set machine.path.jrk=3"), "{error}");
}

#[test]
fn an_error_in_an_override_names_the_override() {
    override_refused(
        "path.jerk=500 m/s^2",
        "--set machine.path.jerk=500 m/s^2: `500 m/s^2` is an acceleration, but a jerk is needed",
    );
    override_refused("path.jrk=3", "--set machine.path.jrk=3: unknown key `jrk`");
    override_refused(
        "name.first=x",
        "--set machine.name.first=x: `first` is looked for in a text, not in a table",
    );
    override_refused("path..jerk=1", "--set machine.path..jerk=1: `path..jerk` has an empty part");
    override_refused("path.jerk=", "--set machine.path.jerk=: `` does not start with a number");
    override_refused("path=3", "--set machine.path=3: this is a number, but a table is needed");
    assert_eq!(
        "path.jerk".parse::<Override>().unwrap_err().to_string(),
        "`path.jerk` is not KEY=VALUE, such as path.jerk=\"500 m/s^3\"",
    );
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let error = Machine::load(Path::new("/nowhere/machine.toml"), &[]).unwrap_err();
    assert!(error.to_string().starts_with("/nowhere/machine.toml cannot be read: "), "{error}");
    assert_eq!(error.line(), None);
}

#[test]
fn text_that_is_not_utf8_is_refused_at_its_place() {
    let folder = std::env::temp_dir().join(format!("graver-machine-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("latin1.toml");
    std::fs::write(&path, b"name = \"x\"\n# caf\xe9\n").unwrap();
    let error = Document::read(&path).unwrap_err();
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!((error.line(), error.column()), (Some(2), Some(6)));
}

/// Source 003 table 3-3: 0.2 N·m need 9.5 A, 22 V; at 12 V there are 0.049 N·m at 3000 rpm.
#[test]
fn the_contradiction_in_the_printed_motor_table_is_a_warning() {
    let machine = Machine::parse("corexy.toml", COREXY, &[]).unwrap();
    let [a, b] = machine.warnings.as_slice() else { panic!("{:?}", machine.warnings) };
    assert_eq!(
        a.text,
        "axis `a`: the nominal torque of 0.200 N·m at 3000 rpm needs 9.5 A and 28.5 V (21.9 V \
         even at standstill), the supply gives 12 V: at that speed it drives 0.049 N·m, at \
         standstill 0.110 N·m"
    );
    assert_eq!((a.line, a.column), (51, 18));
    assert!(b.text.starts_with("axis `b`") && b.line == 81, "{b:?}");

    // Table 3-4 of the EC020 is right to its rounding: 12.08 V for 12 V.
    let cartesian = include_str!("../../machines/cartesian.toml");
    let machine = Machine::parse("cartesian.toml", cartesian, &[]).unwrap();
    let texts: Vec<&str> = machine.warnings.iter().map(|w| w.text.as_str()).collect();
    assert!(matches!(texts[..], [x] if x.starts_with("axis `x`")), "{texts:?}");

    let settings = set(&["axis.a.motor.dc.current=6 A", "axis.a.motor.dc.nominal_torque=40 mN m"]);
    let machine = Machine::parse("corexy.toml", COREXY, &settings).unwrap();
    assert_eq!(
        machine.warnings[0].text,
        "--set machine.axis.a.motor.dc.current=6 A: axis `a`: 12.0 V across 2.300 Ω drive at most \
         5.22 A, so the current limit of 6.00 A is never reached"
    );
    assert_eq!((machine.warnings[0].line, machine.warnings[0].column), (0, 0));
}

#[test]
fn a_limit_switch_within_the_travel_is_a_warning() {
    let file = include_str!("../../machines/servo_gantry.toml");
    let texts = |settings: &[&str]| {
        let machine = Machine::parse("servo_gantry.toml", file, &set(settings)).unwrap();
        machine.warnings.iter().map(|warning| warning.text.clone()).collect::<Vec<_>>()
    };
    let shipped = texts(&[]);
    let changed = texts(&["inputs.x_max.at=41 um"]);
    assert_eq!(changed.len(), shipped.len() + 1, "{changed:?}");
    let told = changed.iter().find(|text| text.contains("limit switch")).unwrap();
    assert_eq!(
        told,
        "--set machine.inputs.x_max.at=41 um: axis `x` is on this limit switch from 0.041 mm, and its \
         `position` goes on to 401.000 mm: it stops with a fault there; move the switch beyond, or end \
         `position` before it"
    );
}

#[test]
fn a_path_speed_beyond_the_motors_is_a_warning() {
    let machine = Machine::parse("corexy.toml", COREXY, &set(&["path.rapid=0.5 m/s"])).unwrap();
    let texts: Vec<&str> = machine.warnings.iter().map(|w| w.text.as_str()).collect();
    assert_eq!(texts.len(), 4);
    assert_eq!(
        texts[1],
        "--set machine.path.rapid=0.5 m/s: axis `a` reaches 0.643 m/s, but a path at 0.5 m/s may \
         ask it for 0.707 m/s: jobs that do are slowed"
    );
}

#[test]
fn a_ringing_belt_is_a_warning() {
    let settings = set(&["mechanism.corexy.belt.damping_ratio=0.05"]);
    let machine = Machine::builtin_with(&settings).unwrap();
    assert_eq!(
        machine.warnings[2].text,
        "--set machine.mechanism.corexy.belt.damping_ratio=0.05: a damping ratio of 0.05 lets the \
         transmission ring: below 0.1 the feedforward at 1 kHz cannot lead it"
    );
}

/// A spring that follows from its shaft rings as one that is given does.
#[test]
fn a_ringing_screw_is_a_warning_however_its_stiffness_is_said() {
    let cartesian = include_str!("../../machines/cartesian.toml");
    let ringing = |text: &str| {
        let settings = set(&["mechanism.cartesian.x.damping_ratio=0.05"]);
        let machine = Machine::parse("cartesian.toml", text, &settings).unwrap();
        machine.warnings.iter().filter(|warning| warning.text.contains("ring")).count()
    };
    assert_eq!(ringing(cartesian), 1);
    let given = cartesian.lines().find(|line| line.starts_with("stiffness")).unwrap();
    let shaft = "shaft = { core_diameter = \"10 mm\", length = \"300 mm\" }";
    assert_eq!(ringing(&cartesian.replace(given, shaft)), 1);
}

#[test]
fn the_built_in_machine_is_the_shipped_corexy() {
    let machine = Machine::builtin();
    let parsed = Machine::parse("corexy.toml", COREXY, &[]).unwrap();
    assert_eq!(machine, parsed);
    assert_eq!(machine.mechanism.name(), "corexy");
    assert_eq!(machine.home, [0.1, 0.1, 0.0]);
    assert_eq!(machine.area.upper, [0.2, 0.2, 0.0]);
    let path = &machine.path;
    let limits = [path.speed, path.rapid, path.acceleration, path.jerk, path.tolerance];
    assert_eq!(limits, [0.25, 0.25, 10.0, 500.0, 5e-6]);
    assert_eq!(machine.gcode.origins, [[0.1, 0.1, 0.0]; 9]);
    // 0.9 of 12 V over 0.021 V·s/rad through the belt's ratio.
    let speed = 0.9 * 12.0 / 0.021 * 0.00125;
    assert!((machine.axes[0].limits.velocity - speed).abs() < 1e-15);
    assert_eq!(machine.axes[0].limits.position, [-0.001, 0.401]);
    assert_eq!(machine.axes[1].limits.position, [-0.201, 0.201]);
}

#[test]
fn a_cartesian_with_a_z_axis_focuses() {
    let axis_y: String = include_str!("../../machines/cartesian.toml").to_owned();
    let z_axis = axis_y
        .split_once("[axis.y]")
        .unwrap()
        .1
        .split_once("# From the gate")
        .unwrap()
        .0
        .replace("axis.y", "axis.z");
    let text = format!(
        "{}\n[axis.z]{z_axis}\n[mechanism.cartesian.z]\nmass = \"0.2 kg\"\nlead = \"5 mm/rev\"\n\
         stiffness = \"600 N m/rad\"\n",
        axis_y
            .replace(
                "y = [\"0 mm\", \"200 mm\"]",
                "y = [\"0 mm\", \"200 mm\"]\nz = [\"-10 mm\", \"10 mm\"]"
            )
            .replace("z = \"ignored\"", "z = \"focus\"")
    );
    let machine = Machine::parse("lift.toml", &text, &[]).unwrap();
    assert!(matches!(machine.mechanism, MechanismKind::CartesianLift(_)));
    let names: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
    assert_eq!(names, ["x", "y", "z"]);
    assert_eq!(machine.axes[2].limits.position, [-0.011, 0.011]);
}

#[test]
fn corners_are_blended_unless_the_file_has_them_exact() {
    assert_eq!(Machine::builtin().corners, CornerMode::Blend);
    let exact = Machine::builtin_with(&set(&["path.corners=\"exact\""])).unwrap();
    assert_eq!(exact.corners, CornerMode::Exact);
    let blend = Machine::builtin_with(&set(&["path.corners=blend"])).unwrap();
    assert_eq!(blend.corners, CornerMode::Blend);
}
