//! Transmissions in machine files: stiffness given or built, backlash, efficiencies.

#![allow(clippy::unwrap_used)]

use core::f64::consts::TAU;

use machine::transmission::{belt::Belt, gear::Efficiency, screw, screw::ScrewShaft};
use machine::{Machine, MechanismKind};

const CARTESIAN: &str = include_str!("../../machines/cartesian.toml");
const COREXY: &str = include_str!("../../machines/corexy.toml");
const POLAR: &str = include_str!("../../machines/polar.toml");

fn with(text: &str, from: &str, to: &str) -> String {
    let other = text.replacen(from, to, 1);
    assert_ne!(other, text, "`{from}` is not in the file");
    other
}

/// The first refusal of `text`.
fn refusal(text: &str) -> String {
    let error = Machine::parse("m.toml", text, &[]).unwrap_err();
    error.problems().next().unwrap().message()
}

#[test]
fn a_screw_built_from_its_shaft_is_as_stiff_as_its_formulas_say() {
    let shaft = "shaft = { core_diameter = \"8 mm\", length = \"250 mm\", \
                 nut_stiffness = \"120 N/um\", nut_accuracy = \"60 %\" }";
    let text = with(CARTESIAN, "stiffness = \"600 N m/rad\"", shaft);
    let machine = Machine::parse("m.toml", &text, &[]).unwrap();
    let MechanismKind::Cartesian(built) = machine.mechanism else { panic!("not cartesian") };
    let lead = 15e-3 / TAU;
    let expected = ScrewShaft {
        core_diameter: 8e-3,
        bore: 0.0,
        length: 0.25,
        modulus: 210e9,
        shear_modulus: 80e9,
        nut_stiffness: 120e6,
        nut_accuracy: 0.6,
    };
    let [x, y] = built.elasticity.unwrap().map(|spring| spring.stiffness);
    assert!((x / screw::at_nut(expected.stiffness(lead), lead) - 1.0).abs() < 1e-12, "{x}");
    assert!((y / (600.0 / (lead * lead)) - 1.0).abs() < 1e-12, "{y}");
}

#[test]
fn crossed_belts_built_from_their_section_are_the_sources() {
    let section = "section = { modulus = \"150e6 N/m^2\", area = \"50 mm^2\", \
                   spans = [\"500 mm\", \"500 mm\"] }";
    let text = with(COREXY, "stiffness = \"60 N/mm\"", section);
    let machine = Machine::parse("m.toml", &text, &[]).unwrap();
    let MechanismKind::CoreXy(built) = machine.mechanism else { panic!("not a corexy") };
    let belt = Belt { modulus: 150e6, section: 50e-6 }.stiffness([0.5, 0.5]);
    for spring in built.elasticity.unwrap() {
        assert!((spring.stiffness - 2.0 * belt).abs() < 1e-6);
        assert!((spring.stiffness / 60e3 - 1.0).abs() < 1e-9, "{}", spring.stiffness);
    }
}

#[test]
fn a_stiffness_is_said_once() {
    let given = "stiffness = \"600 N m/rad\"";
    let shaft = "shaft = { core_diameter = \"8 mm\", length = \"250 mm\" }";
    assert_eq!(
        refusal(&with(CARTESIAN, given, &format!("{given}\n{shaft}"))),
        "the stiffness is given twice, by `stiffness` and by `shaft`; keep one of them"
    );
    let hollow = "shaft = { core_diameter = \"8 mm\", bore = \"8 mm\", length = \"250 mm\" }";
    assert_eq!(
        refusal(&with(CARTESIAN, given, hollow)),
        "a bore of 0.008 m leaves nothing of 0.008 m; make the bore smaller than the core"
    );
    assert_eq!(
        refusal(&with(COREXY, "stiffness = \"60 N/mm\"", "")),
        "nothing says how stiff the belts are; add `stiffness`, or a `section`; leave `belt` out \
         to make them rigid"
    );
}

#[test]
fn backlash_is_of_the_joint_and_needs_a_spring() {
    let text = with(CARTESIAN, "efficiency = 0.5", "backlash = \"20 um\"\nefficiency = 0.5");
    let machine = Machine::parse("m.toml", &text, &[]).unwrap();
    assert_eq!(machine.axes[0].backlash, 20e-6);
    assert_eq!(machine.axes[1].backlash, 0.0);
    let angle = with(CARTESIAN, "efficiency = 0.5", "backlash = \"1 deg\"\nefficiency = 0.5");
    assert!(refusal(&angle).starts_with("axis `x` moves along a line"), "{}", refusal(&angle));
    let rigid = with(POLAR, "efficiency = 0.8", "backlash = \"0.1 deg\"\nefficiency = 0.8");
    assert_eq!(
        refusal(&rigid),
        "axis `th1` has backlash, and its transmission is rigid; give its transmission a \
         stiffness, or leave the backlash out"
    );
}

#[test]
fn efficiency_is_dynamic_and_static() {
    let text =
        with(CARTESIAN, "efficiency = 0.5", "efficiency = 0.5\nstatic_efficiency = \"80 %\"");
    let machine = Machine::parse("m.toml", &text, &[]).unwrap();
    assert_eq!(machine.actuators[0].efficiency, Efficiency { dynamic: 0.5, at_start: 0.8 });
    assert_eq!(machine.actuators[1].efficiency, Efficiency { dynamic: 0.5, at_start: 1.0 });
}

/// cartesian.toml with nothing but masses in its mechanism, and this transmission of both axes.
fn driven(transmission: &str) -> String {
    let screw = "lead = \"15 mm/rev\"\ninertia = \"6.468e-6 kg m^2\"\nstiffness = \"600 N m/rad\"\n\
                 damping_ratio = 0.9\n";
    assert_eq!(CARTESIAN.matches(screw).count(), 2);
    let mut text = CARTESIAN.replace(screw, "");
    for axis in ["x", "y"] {
        text += &format!("\n[axis.{axis}.transmission.{transmission}\n");
    }
    text
}

#[test]
fn a_carriage_runs_on_a_screw_a_belt_or_a_rack() {
    let read = |transmission: &str| {
        let machine = Machine::parse("m.toml", &driven(transmission), &[]).unwrap();
        let MechanismKind::Cartesian(built) = machine.mechanism else { panic!("not cartesian") };
        let springs = built.elasticity.map(|springs| springs.map(|spring| spring.stiffness));
        (machine.actuators[0].ratio, machine.actuators[0].motor.rotor_inertia(), springs)
    };
    let gear = 3.0;
    // The rotor of cartesian.toml, and what turns with the gear.
    let rotor = |inertia: f64| 2e-6 + inertia / (gear * gear);
    let belt =
        "belt]\npulley_radius = \"12 mm\"\ninertia = \"9e-6 kg m^2\"\nstiffness = \"80 N/mm\"";
    assert_eq!(read(belt), (0.012 / gear, rotor(9e-6), Some([80e3; 2])));
    let rack = "rack]\npinion_radius = \"15 mm\"\nstiffness = \"30 N/um\"\ndamping_ratio = 0.5";
    assert_eq!(read(rack), (0.015 / gear, rotor(0.0), Some([30e6; 2])));
    assert_eq!(read("rack]\npinion_radius = \"15 mm\""), (0.015 / gear, rotor(0.0), None));
    // The same screw in either place is the same machine.
    let screw = "screw]\nlead = \"15 mm/rev\"\ninertia = \"6.468e-6 kg m^2\"\n\
                 stiffness = \"600 N m/rad\"";
    let there = Machine::parse("m.toml", &driven(screw), &[]).unwrap();
    let here = Machine::parse("m.toml", CARTESIAN, &[]).unwrap();
    assert_eq!((there.mechanism, there.axes), (here.mechanism, here.axes));
}

#[test]
fn a_carriage_has_one_drive() {
    let mut text = CARTESIAN.to_owned();
    text += "\n[axis.x.transmission.belt]\npulley_radius = \"12 mm\"\n";
    assert_eq!(
        refusal(&text),
        "this transmission of axis `x` has no effect: [mechanism.cartesian.x] gives its screw by \
         `lead`; remove this table, or there `lead` and all that is of the screw"
    );
    let bare = driven("belt]\npulley_radius = \"12 mm\"");
    let two = bare.clone() + "[axis.x.transmission.rack]\npinion_radius = \"12 mm\"\n";
    assert_eq!(refusal(&two), "axis `x` has two transmissions; keep one");
    for (line, key) in [
        ("stiffness = \"600 N m/rad\"", "stiffness"),
        ("inertia = \"1e-6 kg m^2\"", "inertia"),
        ("damping_ratio = 0.5", "damping_ratio"),
        ("shaft = { core_diameter = \"8 mm\", length = \"250 mm\" }", "shaft"),
    ] {
        let text = with(&bare, "mass = \"1.93 kg\"", &format!("mass = \"1.93 kg\"\n{line}"));
        assert_eq!(
            refusal(&text),
            format!(
                "`{key}` has no effect here: it is of a screw, and there is no `lead`; add `lead`, or \
                 write it in [axis.x.transmission]"
            )
        );
    }
    let none = bare.split("\n[axis.x.transmission").next().unwrap();
    assert_eq!(
        refusal(none),
        "axis `x` moves along a line, and nothing says how far in a turn; add \
         [axis.x.transmission.screw], `.belt`, `.rack` or `.planar`"
    );
    let half = with(
        &driven("belt]\npulley_radius = \"12 mm\""),
        "[axis.y.transmission.belt]",
        "[axis.y.transmission.belt]\nstiffness = \"80 N/mm\"",
    );
    assert!(refusal(&half).starts_with("this transmission is rigid, another one is not"));
}

#[test]
fn the_belts_of_a_corexy_stand_in_one_place() {
    let text = COREXY.to_owned() + "\n[axis.a.transmission.belt]\npulley_radius = \"12 mm\"\n";
    assert_eq!(
        refusal(&text),
        "this transmission of axis `a` has no effect: [mechanism.corexy] gives the belts; write \
         `pulley_radius` and `belt` there, and the gear in the axis"
    );
}

/// corexy.toml with a lift of this mechanism and axis.
fn lifted(carriage: &str, transmission: &str) -> String {
    let axis = COREXY.split_once("[axis.b]").unwrap().1.split_once("# From the gate").unwrap().0;
    let text = with(
        COREXY,
        "y = [\"0 mm\", \"200 mm\"]",
        "y = [\"0 mm\", \"200 mm\"]\nz = [\"-10 mm\", \"20 mm\"]",
    );
    format!(
        "{text}\n[mechanism.corexy.z]\nmass = \"0.2 kg\"\n{carriage}\n[axis.z]{}\n{transmission}\n",
        axis.replace("axis.b", "axis.z")
    )
}

#[test]
fn a_corexy_lifts_its_head() {
    let screw = "lead = \"4 mm/rev\"\nstiffness = \"20 N m/rad\"";
    let machine = Machine::parse("m.toml", &lifted(screw, ""), &[]).unwrap();
    let MechanismKind::CoreXyLift(built) = &machine.mechanism else { panic!("no lift") };
    let flat = Machine::parse("m.toml", COREXY, &[]).unwrap();
    let MechanismKind::CoreXy(belts) = flat.mechanism else { panic!("not a corexy") };
    assert_eq!(built.mass, [0.33, 1.06, 0.2]);
    let [x, y, z] = built.elasticity.unwrap();
    assert_eq!([x, y], belts.elasticity.unwrap());
    let lead = 4e-3 / TAU;
    assert!((z.stiffness / (20.0 / (lead * lead)) - 1.0).abs() < 1e-12);
    assert_eq!(machine.axes[..2], flat.axes[..]);
    let names: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
    assert_eq!(names, ["a", "b", "z"]);
    assert_eq!(machine.axes[2].limits.position, [-0.011, 0.021]);
    assert_eq!(machine.home_joints, [0.2, 0.0, 0.0]);
    let belt = "[axis.z.transmission.belt]\npulley_radius = \"6 mm\"\nstiffness = \"20 N/mm\"";
    let machine = Machine::parse("m.toml", &lifted("", belt), &[]).unwrap();
    assert_eq!(machine.actuators[2].ratio, 6e-3 / 8.0);
    let rigid = lifted("lead = \"4 mm/rev\"", "");
    assert_eq!(
        refusal(&rigid),
        "one of belts and lift is elastic, the other is rigid; give both their stiffness, or none"
    );
}

#[test]
fn a_chuck_turns_what_lies_across() {
    let text = with(
        CARTESIAN,
        "[mechanism.cartesian.y]\nmass = \"0.33 kg\"\nlead = \"15 mm/rev\"\n\
        inertia = \"6.468e-6 kg m^2\"\nstiffness = \"600 N m/rad\"\ndamping_ratio = 0.9\n",
        "[mechanism.cartesian.chuck]\ndiameter = \"50 mm\"\ninertia = \"2e-4 kg m^2\"\n\
         [axis.a.transmission.direct]\nstiffness = \"300 N m/rad\"\n",
    );
    let text = text.replace("axis.y", "axis.a").replace(
        "[axis.a.limits]\nfollowing_error = \"1 mm\"",
        "[axis.a.limits]\nposition = \"unlimited\"",
    );
    let machine = Machine::parse("m.toml", &text, &[]).unwrap();
    let MechanismKind::Cartesian(built) = &machine.mechanism else { panic!("not cartesian") };
    assert_eq!((built.mass, built.travel), ([1.93, 2e-4], [1.0, 0.025]));
    assert_eq!(built.elasticity.unwrap()[1].stiffness, 300.0);
    let axis = &machine.axes[1];
    assert_eq!(
        (axis.name.as_str(), axis.unit, machine.actuators[1].ratio),
        ("a", machine::JointUnit::Angle, 1.0 / 3.0)
    );
    // Half of y is 100 mm, four radii.
    assert_eq!(machine.home_joints, [0.1, 4.0]);
    let both = with(
        &text,
        "[mechanism.cartesian.chuck]",
        "[mechanism.cartesian.y]\nmass = \"1 kg\"\n[mechanism.cartesian.chuck]",
    );
    assert!(refusal(&both).starts_with("y is moved by a carriage and by a chuck"));
}
