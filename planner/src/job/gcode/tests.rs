//! Programs with expected numbers, and programs broken in every way.

#![allow(clippy::unwrap_used)]

mod arcs;
mod dialects;
mod files;
mod mutations;
mod parameters;
mod refusals;
mod samples;
mod streams;
mod words;

use machine::Machine;
use machine::gcode_settings::ZMeaning;
use nalgebra::Vector3;

use super::{GcodeError, Program, read};
use crate::drawing::{Action, Curve};

/// The built-in machine with every origin and the home at zero, so that machine and program
/// coordinates are one.
fn machine(z: ZMeaning) -> Machine {
    let mut machine = Machine::builtin();
    machine.home = [0.0; 3];
    machine.gcode.origins = [[0.0; 3]; 9];
    machine.gcode.words.full_scale = 1000.0;
    machine.gcode.z = z;
    machine.gcode.air_assist = true;
    machine
}

fn flat(text: &str) -> Program {
    read("job.ngc", text, &machine(ZMeaning::Ignored)).unwrap()
}

fn refused(text: &str) -> GcodeError {
    *read("job.ngc", text, &machine(ZMeaning::Ignored)).unwrap_err()
}

/// Checks that a drawing is finite, and that every step starts where the one before ended.
fn check_sound(program: &Program, input: &str) {
    let mut tool = program.drawing.start;
    let mut largest = program.facts.lower.iter().chain(&program.facts.upper).fold(0.0, furthest);
    for step in &program.drawing.steps {
        let curve = match step.action {
            Action::Mark { curve, speed, power } => {
                assert!(power.level > 0.0 && power.level <= 1.0, "{step:?}\n{input}");
                assert!(speed.is_some_and(|speed| speed > 0.0), "{step:?}\n{input}");
                curve
            }
            Action::Feed { curve, speed } => {
                assert!(speed > 0.0 && speed.is_finite(), "{step:?}\n{input}");
                curve
            }
            Action::Rapid { to } => Curve::Line { from: tool, to },
            Action::Dwell { time, .. } => {
                assert!(time > 0.0, "{step:?}\n{input}");
                continue;
            }
            Action::Follow { .. } | Action::Trace { .. } => {
                panic!("no program has poses or curves")
            }
            Action::Output { .. }
            | Action::Frequency { .. }
            | Action::Pause
            | Action::Corners(_) => continue,
        };
        if let Curve::Arc { centre, major, .. } = curve {
            largest = centre.iter().chain(&major).fold(largest, furthest);
        }
        // A double has 16 digits, so far coordinates and large radii have coarser ends.
        let gap = (curve.from() - tool).norm();
        assert!(gap <= 1e-12 + 1e-15 * largest, "gap of {gap:e} m before {step:?}\n{input}");
        tool = curve.to();
        assert!(tool.iter().all(|value| value.is_finite()), "{step:?}\n{input}");
    }
}

fn furthest(largest: f64, coordinate: &f64) -> f64 {
    largest.max(coordinate.abs())
}
