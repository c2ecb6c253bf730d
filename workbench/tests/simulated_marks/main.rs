//! Marks of the whole simulation, from file to planner, controller and plant, made pixels again: images
//! against their dots, drawings against what another program paints.

#![allow(clippy::unwrap_used)]

mod drawings;
mod images;

use std::path::Path;

use drives::PlantOptions;
use kurbo::{Line, Point};
use machine::{Machine, Override};
use messages::feedback::status;
use monitor::recording::CycleRecord;
use planner::Job;
use workbench::simulation::simulate;

fn overrides(texts: &[&str]) -> Vec<Override> {
    texts.iter().map(|text| text.parse().unwrap()).collect()
}

/// Simulates the drawing `name` with these `bytes`, and gives where light fell, seen from home [m].
fn marked(name: &str, bytes: &[u8], machine: &[&str], job: &[&str]) -> Vec<Line> {
    let machine = Machine::builtin_with(&overrides(machine)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let job = Job::read(Path::new(&path), &overrides(job), &machine).unwrap();
    let plan = planner::plan(&machine, &job).unwrap();
    let home = Point::new(machine.home[0], machine.home[1]).to_vec2();
    let period = machine.realtime.period;
    let mut lines = Vec::new();
    let mut before: Option<Point> = None;
    let simulated = simulate(&machine, &machine, &plan, PlantOptions::default(), |records| {
        for CycleRecord { feedback, .. } in records {
            assert!(feedback.has(status::TOOL_KNOWN));
            let tool = Point::new(feedback.tool[0], feedback.tool[1]) - home;
            let from = before.replace(tool).unwrap_or(tool);
            let time = period.of(feedback.elapsed()).0 as f64;
            lines.extend(
                lit(&feedback.laser, time)
                    .map(|[begin, end]| Line::new(from.lerp(tool, begin), from.lerp(tool, end))),
            );
        }
    })
    .unwrap();
    assert_eq!(simulated.controller.completed, 1, "{:?}", simulated.controller);
    lines
}

/// The lit parts of what the laser did in `time` [ns], as parts of it, 0 to 1.
fn lit(laser: &messages::LaserCycle, time: f64) -> impl Iterator<Item = [f64; 2]> {
    let edges = laser.edges().iter().map(|edge| (f64::from(edge.offset) / time, edge.gate));
    let changes: Vec<(f64, u32)> = [(0.0, laser.gate)].into_iter().chain(edges).collect();
    let ends: Vec<f64> = changes.iter().skip(1).map(|change| change.0).chain([1.0]).collect();
    let parts = changes.into_iter().zip(ends);
    parts.filter(|((from, gate), to)| *gate != 0 && to > from).map(|((from, _), to)| [from, to])
}
