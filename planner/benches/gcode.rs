//! How fast G-code is read, on one core: `cargo bench -p planner --bench gcode -- --quick`.
//!
//! The program is a drawing of short straight moves, as tracing programs write them. It is read into
//! memory, from its file without keeping it, and from its file as a stream of steps.

// A benchmark stops where a test would.
#![allow(missing_docs, clippy::unwrap_used)]

use std::fmt::Write as _;
use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use machine::Machine;
use planner::Job;
use planner::job::gcode;

/// Lines of the program.
const LINES: u64 = 1_000_000;

/// `lines` moves of 0.1 mm round and round a circle of 20 mm.
fn chords(lines: u64) -> String {
    let mut text = String::from("G21 G90\nM4 S800\nG0 X20 Y0\nG1 F18000\n");
    for index in 1..=lines {
        let angle = 0.005 * index as f64;
        let (sine, cosine) = messages::math::sin_cos(angle);
        writeln!(text, "G1 X{:.3} Y{:.3}", 20.0 * cosine, 20.0 * sine).unwrap();
    }
    text
}

fn reading(criterion: &mut Criterion) {
    let machine = Machine::builtin();
    let text = chords(LINES);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("chords.nc");
    std::fs::write(&path, &text).unwrap();
    let job = Job::open(&path, &[], &machine).unwrap();

    let mut group = criterion.benchmark_group("gcode");
    group.throughput(Throughput::Elements(LINES)).sample_size(10);
    group.bench_function("held", |bencher| {
        bencher.iter(|| black_box(gcode::read("chords.nc", &text, &machine).unwrap()));
    });
    group.bench_function("survey", |bencher| {
        bencher.iter(|| black_box(gcode::survey(&path, &machine).unwrap()));
    });
    group.bench_function("stream", |bencher| {
        bencher.iter(|| {
            job.steps().unwrap().for_each(|step| {
                black_box(step.unwrap());
            })
        });
    });
    group.finish();
}

criterion_group!(benches, reading);
criterion_main!(benches);
