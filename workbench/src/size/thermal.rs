//! How warm a winding gets: two bodies, winding and housing, with a resistance that grows with warmth.

use crate::catalogue::Thermal;
use messages::time::SETPOINT_TIME;

/// How much copper's resistance grows per kelvin, as a share of that at 25 °C.
pub const COPPER: f64 = 0.00393;

/// Temperature at which data sheets give a winding's resistance [°C].
pub const COLD: f64 = 25.0;

/// The temperature at which a winding settles under a steady current [°C]; `None` where it settles nowhere:
/// it warms, its resistance grows, and it warms the more.
///
/// `T = T_a + R_th·I²·R·(1 + α·(T − 25))`, solved for T: `square` is I² [A²], `resistance` R at 25 °C [Ω].
pub fn steady(thermal: &Thermal, square: f64, resistance: f64, ambient: f64) -> Option<f64> {
    let rise = (thermal.winding_housing + thermal.housing_ambient) * square * resistance;
    let growth = COPPER * rise;
    (growth < 1.0).then(|| (ambient + rise * (1.0 - COPPER * COLD)) / (1.0 - growth))
}

/// The largest temperature of a winding over a job that is done again and again, from cold [°C]; `None`
/// where the catalogue has no time constants.
///
/// `squares` are the squares of the current [A²], one a cycle.
pub fn warmest(thermal: &Thermal, squares: &[f64], resistance: f64, ambient: f64) -> Option<f64> {
    /// Steps to a time constant of the winding.
    const STEPS: f64 = 200.0;
    /// Time constants of the motor after which it is as warm as it gets, its resistance growing too.
    const LONG: f64 = 10.0;
    let [winding_time, motor_time] = thermal.times?;
    if squares.is_empty() {
        return Some(ambient);
    }
    let cycles = ((winding_time / STEPS / SETPOINT_TIME) as usize).clamp(1, squares.len());
    let means: Vec<(f64, f64)> = squares
        .chunks(cycles)
        .map(|part| {
            (part.iter().sum::<f64>() / part.len() as f64, part.len() as f64 * SETPOINT_TIME)
        })
        .collect();
    let mut bodies = Bodies::new(thermal, [winding_time, motor_time], ambient);
    let mut time = 0.0;
    let mut most = ambient;
    while time < LONG * motor_time {
        for (square, step) in &means {
            bodies.warm(square * resistance, *step);
            most = f64::max(most, bodies.winding);
            time += step;
        }
    }
    Some(most)
}

/// Winding and housing.
#[derive(Debug, Clone, Copy)]
struct Bodies {
    thermal: Thermal,
    /// Heat that each takes [J/K].
    capacity: [f64; 2],
    ambient: f64,
    /// [°C].
    winding: f64,
    housing: f64,
}

impl Bodies {
    fn new(thermal: &Thermal, times: [f64; 2], ambient: f64) -> Self {
        let capacity = [times[0] / thermal.winding_housing, times[1] / thermal.housing_ambient];
        Self { thermal: *thermal, capacity, ambient, winding: ambient, housing: ambient }
    }

    /// Goes on by `step` [s] with `loss` [W] in the winding at 25 °C, by the midpoint rule.
    fn warm(&mut self, loss: f64, step: f64) {
        let slope = |winding: f64, housing: f64| {
            let across = (winding - housing) / self.thermal.winding_housing;
            let away = (housing - self.ambient) / self.thermal.housing_ambient;
            let heat = loss * (1.0 + COPPER * (winding - COLD));
            [(heat - across) / self.capacity[0], (across - away) / self.capacity[1]]
        };
        let [first, second] = slope(self.winding, self.housing);
        let half = step / 2.0;
        let [winding, housing] = slope(self.winding + half * first, self.housing + half * second);
        self.winding += step * winding;
        self.housing += step * housing;
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use messages::math;

    const RE40: Thermal = Thermal {
        winding_housing: 1.93,
        housing_ambient: 4.65,
        times: Some([41.5, 809.0]),
        max_winding: Some(155.0),
    };

    #[test]
    fn a_winding_settles_where_heat_in_is_heat_out() {
        // 2 A through 1.13 Ω: 6.58 K/W·4.52 W = 29.74 K at 25 °C, and 0.1169 of it again and again.
        let settled = steady(&RE40, 4.0, 1.13, 25.0).unwrap();
        assert!((settled - (25.0 + 29.7416 / (1.0 - 0.00393 * 29.7416))).abs() < 1e-3, "{settled}");
        let heat = 4.0 * 1.13 * (1.0 + COPPER * (settled - COLD));
        assert!((settled - 25.0 - heat * 6.58).abs() < 1e-9);
        // 6.58·1.13·0.00393·I² is 1 at 5.85 A.
        assert!(steady(&RE40, 5.8 * 5.8, 1.13, 25.0).is_some());
        assert_eq!(steady(&RE40, 5.9 * 5.9, 1.13, 25.0), None);
    }

    /// Against the closed form of two linear equations, from their eigenvalues.
    #[test]
    fn a_winding_warms_by_two_exponentials() {
        let (square, resistance, ambient) = (4.0, 1.13, 25.0);
        let loss: f64 = square * resistance;
        let [c1, c2] = [41.5 / 1.93, 809.0 / 4.65];
        // x' = A·x with x the temperatures off their settled values.
        let a = [
            [(loss * COPPER - 1.0 / 1.93) / c1, 1.0 / 1.93 / c1],
            [1.0 / 1.93 / c2, -(1.0 / 1.93 + 1.0 / 4.65) / c2],
        ];
        let settled = steady(&RE40, square, resistance, ambient).unwrap();
        let housing = ambient + 4.65 * (settled - ambient) / 6.58;
        let (trace, determinant): (f64, f64) =
            (a[0][0] + a[1][1], a[0][0] * a[1][1] - a[0][1] * a[1][0]);
        let root = (trace * trace / 4.0 - determinant).sqrt();
        let [fast, slow] = [trace / 2.0 - root, trace / 2.0 + root];
        let start = [ambient - settled, ambient - housing];
        let slope = a[0][0] * start[0] + a[0][1] * start[1];
        let [p, q] =
            [(slope - slow * start[0]) / (fast - slow), (slope - fast * start[0]) / (slow - fast)];
        let mut bodies = Bodies::new(&RE40, [41.5, 809.0], ambient);
        let mut time = 0.0;
        for _ in 0..4000 {
            bodies.warm(loss, 0.2);
            time += 0.2;
            let exact = settled + p * math::exp(fast * time) + q * math::exp(slow * time);
            assert!((bodies.winding - exact).abs() < 1e-3, "{time} s: {} {exact}", bodies.winding);
        }
        let warmest = warmest(&RE40, &vec![square; 100], resistance, ambient).unwrap();
        assert!((warmest - settled).abs() < 0.01 * (settled - ambient), "{warmest} {settled}");
    }
}
