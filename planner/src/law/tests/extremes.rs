//! Lengths and limits of all sizes, and many paths.

use messages::math::exp;

use super::path::{Path, five_bar};
use crate::law::{End, Planner, Settings};

fn duration(path: &mut Path) -> f64 {
    let length = path.length;
    let mut planner = Planner::default();
    let settings = Settings::default();
    let law = planner.plan(path, 0.0, length, [End::Rest; 2], &settings).unwrap();
    assert!(law.duration().is_finite() && law.duration() > 0.0);
    assert!((law.at(law.duration()).position - length).abs() <= 1e-12 * (1.0 + length));
    let step = (law.duration() / 3000.0).max(1e-6);
    let most = path.most(&law, step);
    assert!(most.iter().all(|used| *used < 1.01), "{most:?} {:?}", planner.effort());
    law.duration()
}

#[test]
fn lengths_from_a_nanometre_to_a_metre_are_planned() {
    for length in [1e-9, 1e-7, 1e-6, 1e-5, 1e-3, 0.1, 1.0] {
        let time = duration(&mut Path::line(length, [0.3, 10.0, 500.0]));
        let free = messages::math::cbrt(32.0 * length / 500.0);
        assert!(
            time >= 0.999 * free && time < 1.1 * free + length / 0.25,
            "{length} {time} {free}"
        );
    }
}

#[test]
fn limits_of_all_sizes_are_kept() {
    for jerk in [0.1, 10.0, 500.0, 1e4, 1e6] {
        for acceleration in [0.01, 1.0, 10.0, 100.0] {
            for speed in [0.01, 0.3, 2.0] {
                let tool = [speed, acceleration, jerk];
                duration(&mut Path::circle(0.005, 1.0, tool));
                duration(&mut Path::wave(1e-3, 7e-3, 0.03, tool));
            }
        }
    }
}

#[test]
fn a_tight_joint_rules_and_is_kept() {
    let wave = || {
        Path::new(
            |u| {
                let x = super::jets::Series::parameter(u - 0.05);
                [x, super::jets::Series::constant(0.3) + x.scaled(100.0).sine().scaled(0.01)]
            },
            0.1,
            [1.0, 10.0, 500.0],
        )
    };
    let loose = duration(&mut wave().with_joints(five_bar, [4.0; 2], [60.0; 2]));
    let slow = duration(&mut wave().with_joints(five_bar, [0.2; 2], [60.0; 2]));
    let weak = duration(&mut wave().with_joints(five_bar, [4.0; 2], [2.0; 2]));
    assert!(slow > 1.5 * loose && weak > 1.5 * loose, "{loose} {slow} {weak}");
}

#[test]
fn looser_limits_never_take_longer() {
    let tool = [0.3, 5.0, 200.0];
    for which in 0..3 {
        let mut last = f64::INFINITY;
        for step in 0..6 {
            let mut looser = tool;
            looser[which] *= 1.0 + 0.4 * f64::from(step);
            let time = duration(&mut Path::wave(1e-3, 8e-3, 0.04, looser));
            assert!(time < 1.005 * last, "{which} {step}: {time} {last}");
            last = time;
        }
    }
}

#[test]
fn many_borders_and_slivers_between_do_no_harm() {
    let tool = [0.3, 10.0, 500.0];
    let plain = duration(&mut Path::wave(1e-3, 8e-3, 0.04, tool));
    for count in [7, 100, 400] {
        let time = duration(&mut Path::wave(1e-3, 8e-3, 0.04, tool).with_borders(count));
        assert!(time < 1.03 * plain, "{count}: {time} {plain}");
    }
    let mut path = Path::wave(1e-3, 8e-3, 0.04, tool);
    path.borders = vec![1e-12, 1e-8, 0.01, 0.01 + 1e-9, 0.01 + 1e-7, 0.02, 0.04 - 1e-8];
    let time = duration(&mut path);
    assert!(time < 1.03 * plain, "{time} {plain}");
}

/// Numbers from 0 to 1, the same each time.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Between two positive numbers, evenly by their logarithm.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low * exp(self.roll() * messages::math::ln(high / low))
    }
}

#[test]
fn a_thousand_random_paths_are_planned_within_their_limits() {
    let mut dice = Dice(7);
    for index in 0..1000 {
        let tool = [dice.between(0.02, 2.0), dice.between(0.5, 50.0), dice.between(20.0, 1e4)];
        let period = dice.between(1e-3, 0.05);
        let height = period * dice.roll() * 0.4;
        let length = dice.between(1e-4, 0.1);
        let mut path = Path::wave(height, period, length, tool);
        if index % 2 == 0 {
            path = path.with_borders((length / period * 4.0) as usize + 1);
        }
        path.facets = if index % 3 == 0 { 8 } else { 12 };
        duration(&mut path);
    }
}
