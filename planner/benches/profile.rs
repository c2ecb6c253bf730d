//! What a motion with limited jerk costs to work out, beside rsruckig's: `cargo bench -p planner --bench
//! profile -- --quick`.
//!
//! Three axes from rest to rest: ours one after the other, as the planner has no use for three that end
//! together, rsruckig's once so and once to end together. From any state to any other the planner has no
//! profile of single axes: there a tool flies, within limits of its vectors. rsruckig's is here for scale.

// A benchmark stops where a test would.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use planner::law::profile::Move;
use rsruckig::prelude::*;

/// Ways [m], and limits of each axis [m/s, m/s², m/s³].
const WAYS: [f64; 3] = [0.1, 0.25, 0.04];
const SPEED: f64 = 0.5;
const ACCELERATION: f64 = 10.0;
const JERK: f64 = 500.0;

fn rest_to_rest() -> InputParameter<3> {
    let mut input = InputParameter::new(None);
    for (axis, way) in WAYS.into_iter().enumerate() {
        input.target_position[axis] = way;
        input.max_velocity[axis] = SPEED;
        input.max_acceleration[axis] = ACCELERATION;
        input.max_jerk[axis] = JERK;
    }
    input
}

fn any_state() -> InputParameter<3> {
    let mut input = rest_to_rest();
    for (axis, part) in [0.6, -0.3, 0.2].into_iter().enumerate() {
        input.current_velocity[axis] = SPEED * part;
        input.current_acceleration[axis] = -ACCELERATION * part / 2.0;
        input.target_velocity[axis] = -SPEED * part / 2.0;
    }
    input
}

fn profiles(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("profile");
    group.bench_function("three axes, rest to rest", |bencher| {
        bencher.iter(|| {
            WAYS.map(|way| Move::new(black_box(way), SPEED, ACCELERATION, JERK).duration())
        });
    });
    let cases = [
        ("rsruckig, rest to rest", rest_to_rest(), Synchronization::None),
        ("rsruckig, rest to rest, together", rest_to_rest(), Synchronization::Time),
        ("rsruckig, any state, together", any_state(), Synchronization::Time),
    ];
    for (name, mut input, synchronization) in cases {
        input.synchronization = synchronization;
        let mut generator = Ruckig::<3, ThrowErrorHandler>::new(None, 1e-3);
        let mut trajectory = Trajectory::new(None);
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                generator.calculate(black_box(&input), &mut trajectory).unwrap();
                trajectory.get_duration()
            });
        });
    }
    group.finish();
}

/// Both find the same time, or the comparison says nothing.
fn agree(_: &mut Criterion) {
    let longest = WAYS.map(|way| Move::new(way, SPEED, ACCELERATION, JERK).duration());
    let longest = longest.into_iter().fold(0.0, f64::max);
    let mut generator = Ruckig::<3, ThrowErrorHandler>::new(None, 1e-3);
    let mut trajectory = Trajectory::new(None);
    generator.calculate(&rest_to_rest(), &mut trajectory).unwrap();
    assert!((trajectory.get_duration() - longest).abs() < 1e-9);
}

criterion_group!(benches, agree, profiles);
criterion_main!(benches);
