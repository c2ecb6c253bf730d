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
    assert_eq!(machine.axes[0].efficiency, Efficiency { dynamic: 0.5, at_start: 0.8 });
    assert_eq!(machine.axes[1].efficiency, Efficiency { dynamic: 0.5, at_start: 1.0 });
}
