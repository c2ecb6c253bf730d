//! How near laws come to the optimum.

use std::time::Instant;

use super::{
    jets::Series,
    path::{Path, five_bar, polar},
};
use crate::law::{End, Planner, Settings, plan};

const TOOL: [f64; 3] = [1.0, 10.0, 500.0];

fn spiral(pitch: f64, first: f64, last: f64, place: [f64; 2], tool: [f64; 3]) -> Path {
    // By about the arc length: c·angle²/2.
    let c = pitch / core::f64::consts::TAU;
    let start = c * first * first / 2.0;
    let curve = move |u: f64| {
        let angle = (Series::parameter(u + start).scaled(2.0 / c)).root();
        let radius = angle.scaled(c);
        [
            radius * angle.cosine() + Series::constant(place[0]),
            radius * angle.sine() + Series::constant(place[1]),
        ]
    };
    Path::new(curve, c * last * last / 2.0 - start, tool)
}

fn straight(from: [f64; 2], to: [f64; 2], tool: [f64; 3]) -> Path {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot_of(dy);
    let curve = move |u: f64| {
        let part = Series::parameter(u).scaled(1.0 / length);
        [part.scaled(dx) + Series::constant(from[0]), part.scaled(dy) + Series::constant(from[1])]
    };
    Path::new(curve, length, tool)
}

trait HypotOf {
    fn hypot_of(self, other: f64) -> f64;
}
impl HypotOf for f64 {
    fn hypot_of(self, other: f64) -> f64 {
        messages::math::hypot(self, other)
    }
}

/// A circle about a place.
fn ring(centre: [f64; 2], radius: f64, turns: f64, tool: [f64; 3]) -> Path {
    let path = Path::circle(radius, turns, tool);
    let curve = path.curve;
    let moved = move |u: f64| {
        let [x, y] = curve(u);
        [x + Series::constant(centre[0]), y + Series::constant(centre[1])]
    };
    Path::new(moved, path.length, tool)
}

fn rosette(tool: [f64; 3]) -> Path {
    let curve = |u: f64| {
        let angle = Series::parameter(u).scaled(1.0 / 0.05);
        let radius = Series::constant(0.05) + angle.scaled(5.0).cosine().scaled(0.012);
        [radius * angle.cosine(), radius * angle.sine()]
    };
    Path::new(curve, core::f64::consts::TAU * 0.05, tool)
}

/// Each with the best times by jerk and by acceleration alone.
fn cases(jerk: Option<f64>) -> Vec<(&'static str, Path, [f64; 2])> {
    let tool = |speed: f64| [speed, TOOL[1], jerk.unwrap_or(TOOL[2])];
    let turn = core::f64::consts::TAU;
    let five = |path: Path| path.with_joints(five_bar, [4.0; 2], [60.0; 2]);
    let arm = |path: Path| path.with_joints(polar, [6.0, 12.0], [60.0; 2]);
    vec![
        ("circle_arcs", Path::circle(0.02, 4.0, tool(0.3)), [1.72626, 1.70565]),
        ("spiral", spiral(2e-3, turn, 15.0 * turn, [0.0; 2], tool(0.5)), [3.48840, 3.45239]),
        ("five_line", five(straight([-0.1, 0.3], [0.1, 0.3], tool(1.0))), [0.322241, 0.301897]),
        (
            "five_spiral",
            five(spiral(4e-3, turn, 10.0 * turn, [0.0, 0.33], tool(0.5))),
            [2.82096, 2.79260],
        ),
        ("five_circle", five(ring([0.0, 0.33], 0.04, 2.0, tool(0.8))), [0.881204, 0.858846]),
        (
            "polar_line_3mm",
            arm(straight([-0.08, 0.003], [0.08, 0.003], tool(0.5))),
            [0.665785, 0.650219],
        ),
        ("polar_circle", arm(ring([0.04, 0.0], 0.03, 2.0, tool(0.5))), [1.516297, 1.508503]),
        ("polar_rosette", arm(rosette(tool(0.5))), [1.147538, 1.126853]),
        ("line_100", Path::line(0.1, tool(1.0)), [0.2209975, 0.2]),
        ("wave 0.5/2 mm", Path::wave(0.5e-3, 2e-3, 0.02, tool(0.5)), [0.6224, 0.4230]),
        ("wave 2/10 mm", Path::wave(2e-3, 10e-3, 0.1, tool(0.5)), [0.9848, 0.8395]),
    ]
}

#[test]
fn smooth_curves_take_little_more_than_the_least_time() {
    for (jerk, which) in [(None, 0), (Some(1e6), 1)] {
        for (name, mut path, best) in cases(jerk) {
            let length = path.length;
            let settings = Settings::default();
            let law = plan(&mut path, 0.0, length, [End::Rest; 2], &settings).unwrap();
            let ratio = law.duration() / best[which];
            assert!((0.99..1.012).contains(&ratio), "{name} {jerk:?}: {ratio}");
            let most = path.most(&law, 2e-4);
            assert!(most.iter().all(|used| *used < 1.005), "{name} {jerk:?}: {most:?}");
            let samples = path.by_differences(&law);
            assert!(samples.iter().all(|used| *used < 1.005), "{name} {jerk:?}: {samples:?}");
        }
    }
}

fn report(jerk: Option<f64>, rounds: usize) {
    let mut planner = Planner::default();
    for (name, mut path, best) in cases(jerk) {
        let settings = Settings { rounds, ..Settings::default() };
        let length = path.length;
        let start = Instant::now();
        let law = planner.plan(&mut path, 0.0, length, [End::Rest; 2], &settings).unwrap();
        let all = start.elapsed().as_secs_f64();
        let effort = planner.effort();
        let most = path.most(&law, 1e-4);
        let best = best[usize::from(jerk.is_some())];
        println!(
            "{name:16} cells {:5} rows/cell {:3} rounds {} steps {:3} most {:.4} T {:.4} /bound {:.4} \
             use {:.3?} {:.3?}  {:.1} us/cell",
            effort.cells,
            effort.rows / effort.cells,
            effort.rounds,
            effort.steps,
            effort.most,
            law.duration(),
            law.duration() / best,
            most,
            path.by_differences(&law),
            all / effort.cells as f64 * 1e6,
        );
    }
}

#[test]
#[ignore = "a report"]
fn the_time_over_the_optimum_is_reported() {
    for rounds in [1, 4] {
        println!("rounds {rounds}");
        report(None, rounds);
    }
    println!("no last look");
    let mut planner = Planner::default();
    for (name, mut path, _) in cases(None) {
        let settings = Settings { checks: 0, ..Settings::default() };
        let length = path.length;
        let mut least = f64::INFINITY;
        for _ in 0..5 {
            let start = Instant::now();
            planner.plan(&mut path, 0.0, length, [End::Rest; 2], &settings).unwrap();
            least = least.min(start.elapsed().as_secs_f64());
        }
        let effort = planner.effort();
        println!(
            "{name:16} {:.1} us a cell, {} rounds, {} steps, {} rows",
            least / effort.cells as f64 * 1e6,
            effort.rounds,
            effort.steps,
            effort.rows / effort.cells,
        );
    }
    println!("jerk lifted");
    report(Some(1e6), 4);
}
