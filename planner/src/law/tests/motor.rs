//! Rows of mixed orders and rows with hardly any room.

use super::path::Path;
use crate::law::{End, Limits, Planner, Row, Settings, Side, Site, TimeLaw};

const VOLTAGE: u16 = 9;

/// A path whose motor has a resistance, an inductance and a back voltage.
struct Motor {
    path: Path,
    /// Voltage by ü, by the third derivative, by u̇, and the supply.
    by: [f64; 4],
    /// Where acceleration has hardly any room, and how much.
    weak: Option<(f64, f64, f64)>,
}

impl Limits for Motor {
    fn borders(&self, from: f64, to: f64, borders: &mut Vec<f64>) {
        self.path.borders(from, to, borders);
    }

    fn site(&mut self, place: f64, side: Side, rows: &mut Vec<Row>) -> Site {
        let mut site = self.path.site(place, side, rows);
        if let Some((_, _, top)) = self.weak.filter(|(a, b, _)| (*a..*b).contains(&place)) {
            let weak = rows[site.rows.clone()].iter_mut().filter(|row| row.base[1] != 0.0);
            weak.for_each(|row| row.top = top);
        }
        let [resistance, inductance, back, supply] = self.by;
        for sign in [1.0, -1.0] {
            rows.push(Row {
                base: [0.0, sign * resistance, 0.0],
                by_speed: [sign * inductance, 0.0, 0.0],
                top: supply,
                top_by_speed: -sign * back,
                limit: VOLTAGE,
            });
        }
        site.rows.end = rows.len();
        site
    }
}

fn law_of(motor: &mut Motor) -> (TimeLaw, Planner) {
    let (length, mut planner) = (motor.path.length, Planner::default());
    let law = planner.plan(motor, 0.0, length, [End::Rest; 2], &Settings::default()).unwrap();
    assert!(law.duration().is_finite());
    (law, planner)
}

#[test]
fn the_voltage_of_a_motor_is_kept() {
    let tool = [1.0, 20.0, 1000.0];
    for by in [[1.0, 0.002, 20.0, 24.0], [2.0, 0.03, 30.0, 24.0], [0.1, 0.05, 60.0, 24.0]] {
        let paths = [(Path::line(0.1, tool), 0.9), (Path::wave(2e-3, 20e-3, 0.1, tool), 0.0)];
        for (path, least) in paths {
            let mut motor = Motor { path, by, weak: None };
            let (law, planner) = law_of(&mut motor);
            let mut most = 0.0_f64;
            for index in 0..5000 {
                let along = law.at(law.duration() * f64::from(index) / 5000.0);
                let volts =
                    by[0] * along.acceleration + by[1] * along.jerk + by[2] * along.velocity;
                most = most.max(volts.abs() / by[3]);
            }
            println!("{by:?} {most:.4} {:.4} s {:?}", law.duration(), planner.effort());
            assert!(most < 1.01 && most > least, "{by:?} {most}");
            let used = motor.path.most(&law, 1e-4);
            assert!(used.iter().all(|used| *used < 1.01), "{used:?}");
        }
    }
}

#[test]
fn hardly_any_room_makes_a_law_slow_but_not_none() {
    for room in [1e-1, 1e-3, 1e-6, 1e-9] {
        for path in
            [Path::line(0.1, [0.3, 10.0, 500.0]), Path::circle(0.02, 1.0, [0.3, 10.0, 500.0])]
        {
            let by = [1.0, 0.0, 0.0, 100.0];
            let mut motor = Motor { path, by, weak: Some((0.04, 0.05, room)) };
            motor.path.borders = vec![0.04, 0.05];
            let (law, planner) = law_of(&mut motor);
            println!("{room} {:.4} s {:?}", law.duration(), planner.effort());
            assert!(law.duration() > 0.3);
        }
    }
}
