//! How fast a program is planned and its setpoints are made, on one core: `cargo bench -p planner --bench
//! planning -- --quick`.
//!
//! `lines` is all from the program's steps to checked setpoints; `checked` is mostly the making and the
//! check of setpoints, as whole circles leave little to plan; `made` is their making alone.

// A benchmark stops where a test would.
#![allow(missing_docs, clippy::unwrap_used)]

use std::fmt::Write as _;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use machine::Machine;
use planner::Job;

/// Lines of the programs of chords.
const LINES: u32 = 200_000;

/// Whole circles of the program of arcs.
const CIRCLES: u32 = 100;

fn machine() -> Machine {
    let text = include_str!("../../machines/corexy.toml");
    Machine::parse("corexy.toml", text, &[]).unwrap()
}

fn job(text: &str, machine: &Machine) -> Job {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("program.nc");
    std::fs::write(&path, text).unwrap();
    Job::read(&path, &[], machine).unwrap()
}

/// Chords of about 0.1 mm at 300 mm/s along a circle of 50 mm, or along one with nine waves.
fn chords(light: &str, wave: f64) -> String {
    let mut text = format!("G21 G90 G64 P0.01\nG0 X50 Y0\n{light} S500\nG1 F18000\n");
    for index in 1..=LINES {
        let angle = 0.002 * f64::from(index);
        let radius = 50.0 + wave * messages::math::sin(9.0 * angle);
        let (sine, cosine) = messages::math::sin_cos(angle);
        writeln!(text, "G1 X{:.3} Y{:.3}", radius * cosine, radius * sine).unwrap();
    }
    text
}

fn lines(criterion: &mut Criterion) {
    let machine = machine();
    let mut group = criterion.benchmark_group("lines");
    group.throughput(Throughput::Elements(LINES.into())).sample_size(10);
    for (name, wave) in [("circle", 0.0), ("waves", 0.5)] {
        for light in ["M3", "M4"] {
            let job = job(&chords(light, wave), &machine);
            group.bench_function(BenchmarkId::new(name, light), |bencher| {
                bencher.iter(|| planner::plan(&machine, &job).unwrap().facts.samples);
            });
        }
    }
    group.finish();
}

fn setpoints(criterion: &mut Criterion) {
    let machine = machine();
    let mut text = "G21 G90\nG0 X50 Y0\nM3 S500\nF18000\n".to_owned();
    for _ in 0..CIRCLES {
        text.push_str("G3 X50 Y0 I-50 J0\n");
    }
    let job = job(&text, &machine);
    let plan = planner::plan(&machine, &job).unwrap();
    let mut group = criterion.benchmark_group("setpoints");
    group.throughput(Throughput::Elements(plan.facts.samples)).sample_size(10);
    group.bench_function("checked", |bencher| {
        bencher.iter(|| planner::plan(&machine, &job).unwrap().facts.samples);
    });
    group.bench_function("made", |bencher| {
        bencher.iter(|| plan.setpoints(1).count());
    });
    group.finish();
}

criterion_group!(benches, lines, setpoints);
criterion_main!(benches);
