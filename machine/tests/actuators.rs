//! Several motors on one axis: how a machine file says it, and what cannot be.

#![allow(clippy::unwrap_used)]

use machine::document::{DocumentError, ProblemKind};
use machine::{Actuator, Machine, Override};

const CARTESIAN: &str = include_str!("../../machines/cartesian.toml");

const PAIR: &str = "[axis.y.actuator.left]\n[axis.y.actuator.right]\nmirrored = true\n";

fn parse(more: &str, settings: &[&str]) -> Result<Machine, DocumentError> {
    let overrides: Vec<Override> = settings.iter().map(|text| text.parse().unwrap()).collect();
    Machine::parse("gantry.toml", &format!("{CARTESIAN}{more}"), &overrides)
}

fn gantry(more: &str) -> Machine {
    parse(&format!("{PAIR}{more}"), &[]).unwrap()
}

/// The message of the only problem, what it is, and the text of its line in the file.
fn refused(more: &str, settings: &[&str]) -> (String, ProblemKind, String) {
    let error = parse(more, settings).unwrap_err();
    let problems: Vec<_> = error.problems().collect();
    let [problem] = problems.as_slice() else { panic!("{error}") };
    let text = format!("{CARTESIAN}{more}");
    let line = problem.line().and_then(|line| text.lines().nth(line - 1)).unwrap_or_default();
    (problem.message().to_owned(), problem.kind, line.to_owned())
}

#[test]
fn a_file_of_single_motors_has_an_actuator_for_each_axis_with_its_name() {
    let machine = parse("", &[]).unwrap();
    assert_eq!(machine.actuators.len(), 2);
    for (index, (axis, own)) in machine.driven().enumerate() {
        let [Actuator { name, axis: driven, ratio, share, square, .. }] = own else { panic!() };
        assert_eq!((name, *driven, *share, *square), (&axis.name, index, 1.0, 0.0));
        assert!(*ratio > 0.0);
    }
}

#[test]
fn two_alike_take_two_lines_and_share_the_axis() {
    let (alone, machine) = (parse("", &[]).unwrap(), gantry(""));
    let names: Vec<&str> = machine.actuators.iter().map(|it| it.name.as_str()).collect();
    assert_eq!(names, ["x", "y.left", "y.right"]);
    assert_eq!(
        (machine.axes[0].actuators.clone(), machine.axes[1].actuators.clone()),
        (0..1, 1..3)
    );
    let [left, right] = machine.axes[1].driven_by(&machine.actuators) else { panic!() };
    assert_eq!((left.ratio, right.ratio), (alone.actuators[1].ratio, -left.ratio));
    assert_eq!((left.share, right.share), (0.5, 0.5));
    assert!(left.is_like(right));
    // Each turns its own screw, and moves half of the carriage.
    let single = &alone.actuators[1];
    assert_eq!(left.motor, single.motor);
    let halves = left.gains.inertia + right.gains.inertia - left.motor.rotor_inertia();
    assert!((halves - single.gains.inertia).abs() < 1e-18);
    assert_eq!(machine.axes[1].limits.racking, machine.axes[1].limits.following_error);
    assert_eq!(machine.warnings.len(), alone.warnings.len(), "{:#?}", machine.warnings);
}

#[test]
fn what_an_actuator_says_itself_goes_before_what_its_axis_says() {
    let machine = gantry(
        "gear = 1.5\nsquare = \"-0.12 mm\"\n\
         friction = { coulomb = \"9 mN m\", viscous = \"2e-6 N m s/rad\" }\n\
         encoder = { resolution = \"8192 counts/rev\" }\n",
    );
    let [left, right] = machine.axes[1].driven_by(&machine.actuators) else { panic!() };
    assert!((right.ratio / left.ratio + 2.0).abs() < 1e-12);
    assert_eq!((left.friction.coulomb, right.friction.coulomb), (5e-3, 9e-3));
    assert_eq!((left.encoder.counts, right.encoder.counts), (4096.0, 8192.0));
    assert!(left.square == 0.0 && (right.square + 0.12e-3).abs() < 1e-15, "{}", right.square);
    // Half the gear gives the same motor half the force.
    assert!((left.share - 2.0 / 3.0).abs() < 1e-12 && (right.share - 1.0 / 3.0).abs() < 1e-12);
    // The slower one sets the speed of the axis.
    let slowest = left.motor.largest_speed() * left.ratio;
    assert!((machine.axes[1].limits.velocity - 0.9 * slowest).abs() < 1e-12);
}

#[test]
fn overrides_reach_one_actuator() {
    let setting =
        "axis.y.actuator.right.friction={ coulomb = \"7 mN m\", viscous = \"0 N m s/rad\" }";
    let machine = parse(PAIR, &[setting]).unwrap();
    assert_eq!(machine.actuators[1].friction.coulomb, 5e-3);
    assert_eq!(machine.actuators[2].friction.coulomb, 7e-3);
}

#[test]
fn what_several_motors_cannot_have_is_refused_where_it_stands() {
    let pair = |more: &str| format!("{PAIR}{more}");
    let (message, kind, line) = refused(&pair(""), &["axis.y.backlash=\"10 um\""]);
    assert!(message.starts_with("axis `y` has backlash and 2 actuators"), "{message}");
    assert_eq!((kind, line.as_str()), (ProblemKind::Contradiction, ""));
    let (message, _, line) = refused(&pair("square = \"0.6 mm\"\n"), &[]);
    assert!(message.starts_with("`square` is 0.0006 m"), "{message}");
    assert_eq!(line, "square = \"0.6 mm\"");
    let (message, kind, line) = refused(&pair("square = \"1 deg\"\n"), &[]);
    assert_eq!((kind, line.as_str()), (ProblemKind::WrongUnit, "square = \"1 deg\""), "{message}");
    let (message, _, _) = refused("", &["axis.x.limits.racking=\"1 mm\""]);
    assert!(message.starts_with("axis `x` has one actuator, which cannot rack"), "{message}");
    let (message, kind, line) = refused(&pair("mirored = true\n"), &[]);
    assert!(message.starts_with("unknown key `mirored`"), "{message}");
    assert_eq!(kind, ProblemKind::UnknownKey);
    assert_eq!(line, "mirored = true");
    let (message, _, line) = refused("[axis.y.actuator.\"on the left\"]\n", &[]);
    assert!(message.starts_with("an actuator cannot be called `on the left`"), "{message}");
    assert_eq!(line, "[axis.y.actuator.\"on the left\"]");
    let (message, kind, line) = refused("[axis.y.actuator]\n", &[]);
    assert!(message.starts_with("axis `y` has a table of actuators, and none in it"), "{message}");
    assert_eq!((kind, line.as_str()), (ProblemKind::MissingKey, "[axis.y.actuator]"));
    let (message, kind, _) = refused(&pair("motor = {}\n"), &[]);
    assert!(message.starts_with("axis `y.right` has no motor"), "{message}");
    assert_eq!(kind, ProblemKind::MissingKey);
}

#[test]
fn a_rigid_pair_is_refused() {
    let rigid: String = CARTESIAN
        .lines()
        .filter(|line| !line.starts_with("stiffness") && !line.starts_with("damping_ratio"))
        .fold(String::new(), |text, line| text + line + "\n");
    let error = Machine::parse("rigid.toml", &format!("{rigid}{PAIR}"), &[]).unwrap_err();
    let problem = error.problems().next().unwrap();
    let message = problem.message();
    assert!(message.contains("`y` has 2 actuators, and its transmission is rigid"), "{message}");
    assert_eq!(problem.line(), Some(rigid.lines().count() + 2), "the second of them");
}

#[test]
fn motors_of_two_kinds_are_refused_on_one_axis_too() {
    let stepper = "[axis.y.actuator.right.motor.stepper]\nholding_torque = \"0.4 N m\"\n\
                   rotor_inertia = \"3.8e-6 kg m^2\"\ncurrent = \"1.68 A\"\nresistance = \"1.65 ohm\"\n\
                   inductance = \"2.8 mH\"\nvoltage = \"48 V\"\n";
    let error = parse(&format!("[axis.y.actuator.left]\n{stepper}"), &[]).unwrap_err();
    assert!(error.to_string().contains("an axis with a stepper has no `encoder`"), "{error}");
}

#[test]
fn a_machine_has_16_actuators_at_most() {
    let many = |count: usize| -> String {
        (0..count).map(|index| format!("[axis.y.actuator.m{index}]\n")).collect()
    };
    assert_eq!(parse(&many(15), &[]).unwrap().actuators.len(), messages::MAX_ACTUATORS);
    let (message, _, line) = refused(&many(16), &[]);
    assert!(
        message.starts_with("the machine has 17 actuators; a machine can have 16"),
        "{message}"
    );
    assert_eq!(line, "[axis.y.actuator.m15]");
}
