//! A machine of two or three plain screws that only the path's limits slow, and what its plans do.

#![allow(clippy::unwrap_used, dead_code, unreachable_pub)]

use std::fmt::Write as _;

use machine::{Machine, Override};
use nalgebra::Vector3;
use planner::trajectory::{Cursor, Reference};
use planner::{Job, Plan, plan};

/// The machine: 600 mm by 600 mm, with a focus axis from -20 mm to 50 mm where it `has_z`.
pub fn machine(has_z: bool, settings: &[&str]) -> Machine {
    let names: &[&str] = if has_z { &["x", "y", "z"] } else { &["x", "y"] };
    let (home, range, z) = match has_z {
        true => ("[\"0 mm\", \"0 mm\", \"10 mm\"]", "z = [\"-20 mm\", \"50 mm\"]", "focus"),
        false => ("[\"0 mm\", \"0 mm\"]", "", "ignored"),
    };
    let mut text = format!(
        r#"name = "plain"
home = {home}
[area]
x = ["-300 mm", "300 mm"]
y = ["-300 mm", "300 mm"]
{range}
[path]
speed = "1 m/s"
rapid = "1 m/s"
acceleration = "10 m/s^2"
jerk = "500 m/s^3"
tolerance = "10 um"
[laser]
[gcode]
z = "{z}"
[gcode.origins]
g54 = ["0 mm", "0 mm"{}]
"#,
        if has_z { ", \"0 mm\"" } else { "" }
    );
    for name in names {
        write!(
            text,
            r#"[mechanism.cartesian.{name}]
mass = "1 kg"
lead = "10 mm/rev"
[axis.{name}.motor.dc]
voltage = "100 kV"
current = "100 kA"
resistance = "0.1 ohm"
inductance = "1 uH"
torque_constant = "1 N m/A"
rotor_inertia = "1e-9 kg m^2"
[axis.{name}.friction]
coulomb = "0 N m"
viscous = "0 N m s/rad"
[axis.{name}.encoder]
resolution = "1e6 counts/rev"
[axis.{name}.limits]
velocity = "1 m/s"
following_error = "1 mm"
"#
        )
        .unwrap();
    }
    let text = text.replace("100 kV", "1e5 V").replace("100 kA", "1e5 A");
    Machine::parse("plain.toml", &text, &overrides(settings)).unwrap()
}

pub fn overrides(settings: &[&str]) -> Vec<Override> {
    settings.iter().map(|setting| setting.parse().unwrap()).collect()
}

/// The job of a file with this text.
pub fn job(name: &str, text: &str, settings: &[&str], machine: &Machine) -> Job {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    Job::read(&path, &overrides(settings), machine).unwrap_or_else(|error| panic!("{error}"))
}

/// The plan of a G-code program.
pub fn planned(program: &str, settings: &[&str], machine: &Machine) -> Plan {
    let job = job("program.nc", program, settings, machine);
    plan(machine, &job).unwrap_or_else(|error| panic!("{error}"))
}

/// Where the tool is at `time` [s].
pub fn tool(plan: &Plan, time: f64, cursor: &mut Cursor) -> Vector3<f64> {
    match plan.trajectory.at(time, cursor) {
        Reference::Tool(tool) => tool.position,
        Reference::Joints(joints) => {
            Vector3::new(joints.position[0], joints.position[1], joints.position[2])
        }
    }
}

/// Where each light begins and ends, with a laser of these delays [s].
pub fn lit(plan: &Plan, [on_delay, off_delay]: [f64; 2]) -> Vec<[Vector3<f64>; 2]> {
    let mut cursor = Cursor::default();
    let mut lines = Vec::new();
    let mut begun = None;
    for change in &plan.trajectory.laser {
        let told = change.time.seconds();
        match (change.power > 0.0, begun) {
            (true, None) => begun = Some(tool(plan, told + on_delay, &mut cursor)),
            (false, Some(from)) => {
                lines.push([from, tool(plan, told + off_delay, &mut cursor)]);
                begun = None;
            }
            _ => {}
        }
    }
    assert_eq!(begun, None);
    lines
}
