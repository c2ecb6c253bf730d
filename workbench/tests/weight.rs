//! The first mark of a machine with a weight lies where the others do, however soon after enabling it is.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use drives::PlantOptions;
use machine::Machine;
use machine::document::Override;
use planner::request::JobRequest;
use workbench::simulation::{SimulationError, simulate};

/// Four lines, of which the first begins where the machine is enabled.
const LINES: &str =
    "G21 G90\nM4 S500\nG1 X4 F6000\nG0 Y4\nG1 X0\nG0 Y8\nG1 X4\nG0 Y12\nG1 X0\nM5\n";

/// How much further than the other marks the first one may be off [m].
const MORE: f64 = 0.3e-6;

fn machines() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../machines")
}

fn overrides(settings: &[&str]) -> Vec<Override> {
    settings.iter().map(|setting| setting.parse().unwrap()).collect()
}

fn shipped(name: &str, settings: &[&str]) -> Machine {
    Machine::load(&machines().join(format!("{name}.toml")), &overrides(settings)).unwrap()
}

/// The Cartesian machine of this file with a head of `mass` on a screw that moves it up and down, `brake`
/// holding it.
fn lift(name: &str, mass: &str, brake: &str) -> Machine {
    let text = std::fs::read_to_string(machines().join(format!("{name}.toml"))).unwrap();
    let axis = text.split_once("[axis.y]").unwrap().1.split_once("# From the gate").unwrap().0;
    let axis = axis
        .replace("axis.y", "axis.z")
        .replace("[axis.z.friction]", &format!("[axis.z.friction]\nbrake = \"{brake}\""));
    let text = text
        .replace(
            "y = [\"0 mm\", \"200 mm\"]",
            "y = [\"0 mm\", \"200 mm\"]\nz = [\"-10 mm\", \"10 mm\"]",
        )
        .replace("z = \"ignored\"", "z = \"focus\"");
    let screw = format!("mass = \"{mass}\"\nlead = \"15 mm/rev\"\nstiffness = \"600 N m/rad\"");
    let text = format!("{text}\n[axis.z]{axis}\n[mechanism.cartesian.z]\n{screw}\n");
    Machine::parse("lift.toml", &text, &[]).unwrap()
}

/// The largest distance of the tool from its plan by stroke, marking on `plant` [m].
fn errors(machine: &Machine, plant: &Machine) -> Result<BTreeMap<u64, f64>, SimulationError> {
    // Once for all tests: a program must stay as it is while it is read.
    static PROGRAM: LazyLock<PathBuf> = LazyLock::new(|| {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("weight.ngc");
        std::fs::write(&path, LINES).unwrap();
        path
    });
    let request =
        JobRequest { job: Some(PROGRAM.clone()), set: Vec::new(), offsets: None, confined: false };
    let plan = request.plan(machine).unwrap();
    let mut errors = BTreeMap::new();
    let simulated = simulate(machine, plant, &plan, PlantOptions::default(), |records| {
        for record in records.iter().filter(|record| record.command.stroke != 0) {
            let (tool, planned) = (record.feedback.tool, record.command.tool);
            let square: f64 = tool.iter().zip(&planned).map(|(a, b)| (a - b) * (a - b)).sum();
            let error: &mut f64 = errors.entry(record.command.stroke).or_default();
            *error = error.max(square.sqrt());
        }
    })?;
    assert_eq!(simulated.controller.completed, 1, "{:?}", simulated.controller.fault);
    Ok(errors)
}

#[track_caller]
fn first_as_the_others(what: &str, machine: &Machine, plant: &Machine) {
    let errors = errors(machine, plant).unwrap();
    assert_eq!(errors.keys().copied().collect::<Vec<_>>(), [1, 2, 3, 4], "{what}");
    let others = errors.range(2..).map(|(_, error)| *error).fold(0.0, f64::max);
    assert!(errors[&1] <= others + MORE, "{what}: {errors:?}");
    assert!(others < 3e-6, "{what}: {errors:?}");
}

#[test]
fn the_first_mark_lies_where_the_others_do() {
    let heavy = ["mechanism.polar.head_mass=3 kg", "axis.d.friction.coulomb=0.3 mN m"];
    let braked = [heavy[0], heavy[1], "axis.d.friction.brake=60 mN m"];
    for (what, machine) in [
        ("serial", shipped("serial", &[])),
        ("serial, slow brake", shipped("serial", &["axis.j3.friction.brake_release=200 ms"])),
        ("serial, quick brake", shipped("serial", &["axis.j3.friction.brake_release=0 s"])),
        ("serial, smooth", shipped("serial", &["axis.j3.friction.coulomb=0 N m"])),
        ("polar", shipped("polar", &braked)),
        ("tri_planar", shipped("tri_planar", &[])),
        ("mcm", shipped("mcm", &[])),
        ("lift", lift("cartesian", "3 kg", "60 mN m")),
        ("lift of steppers", lift("cartesian_steppers", "20 kg", "400 mN m")),
    ] {
        first_as_the_others(what, &machine, &machine);
    }
}

#[test]
fn the_first_mark_lies_where_the_others_do_on_another_plant() {
    for (what, settings) in [
        ("a motor of 20 % less torque", "axis.j3.motor.dc.torque_constant=0.024 N m/A"),
        ("a winding of 20 % more resistance", "axis.j3.motor.dc.resistance=0.72 ohm"),
        ("a quarter of the friction", "axis.j3.friction.coulomb=1 mN m"),
        ("a brake of three times the time", "axis.j3.friction.brake_release=60 ms"),
    ] {
        first_as_the_others(what, &shipped("serial", &[]), &shipped("serial", &[settings]));
    }
}

#[test]
fn a_slide_that_nothing_holds_is_named() {
    for settings in [
        &["axis.j3.friction.brake=0 N m"][..],
        &["axis.j3.friction.brake=0 N m", "axis.j3.friction.coulomb=0 N m"],
    ] {
        let machine = shipped("serial", settings);
        let text = errors(&machine, &machine).unwrap_err().to_string();
        let expected = "drive_fault of axis j3: distance from where it is to be held";
        assert!(text.contains(expected), "{settings:?}: {text}");
    }
}

#[test]
fn a_weight_beyond_the_motor_is_named() {
    let machine = shipped("serial", &[]);
    let mut weak = machine.clone();
    // 50 mV give 2.5 mN·m and friction 4, of the 7.8 that the slide asks for when its brake opens.
    weak.actuators[2].motor.dc_mut().unwrap().voltage = 0.05;
    let text = errors(&machine, &weak).unwrap_err().to_string();
    assert!(text.contains(" of axis j3: "), "{text}");
}
