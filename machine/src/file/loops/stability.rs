//! Whether the cascade of an actuator comes to rest in a control cycle of a given length.

/// Cycles in which it must have come to rest.
const CYCLES: u32 = 2000;

/// Steps of the motor in a cycle.
const STEPS: u32 = 8;

/// Whether position, velocity and current loops of these bandwidths [rad/s] come to rest, in cycles of `period` [s] with a
/// command that acts one cycle after its measurement, on a motor whose winding has this `pole`, resistance over inductance
/// [rad/s], and that nothing elastic hangs on. The equations are those of the controller's cascade, in units in which
/// inertia, torque constant and inductance are 1: only their ratios matter.
pub(super) fn is_stable([position, velocity, current]: [f64; 3], pole: f64, period: f64) -> bool {
    let step = period / f64::from(STEPS);
    let decay = messages::math::exp(-pole * step);
    let (mut flows, mut speed, mut place, mut place_before) = (0.0_f64, 0.0_f64, 1.0_f64, 1.0_f64);
    let (mut velocity_integral, mut current_integral, mut voltage) = (0.0, 0.0, 0.0);
    // What is left of the motion, in places: the largest in the first quarter of the time, and in the last.
    let (mut first, mut last) = (0.0_f64, 0.0_f64);
    for cycle in 0..CYCLES {
        let measured = (place - place_before) / period;
        place_before = place;
        let velocity_error = -position * place - measured;
        let current_error = velocity * velocity_error + velocity_integral - flows;
        let next = current * current_error + current_integral;
        velocity_integral += velocity * velocity / 4.0 * period * velocity_error;
        current_integral += pole * current * period * current_error;
        for _ in 0..STEPS {
            let after = decay * flows + (1.0 - decay) / pole * voltage;
            let faster = speed + (flows + after) / 2.0 * step;
            place += (speed + faster) / 2.0 * step;
            (flows, speed) = (after, faster);
        }
        voltage = next;
        let left = place.abs() + speed.abs() * period;
        if !left.is_finite() {
            return false;
        }
        if cycle < CYCLES / 4 {
            first = first.max(left);
        } else if cycle >= CYCLES / 4 * 3 {
            last = last.max(left);
        }
    }
    last <= first
}

#[cfg(test)]
mod tests {
    use super::is_stable;

    #[test]
    fn the_loops_of_a_millisecond_swing_at_two_and_not_when_they_are_slower_by_as_much() {
        let loops = [40.0, 160.0, 349.0];
        // The largest eigenvalue of the same loops as a matrix: 0.972, 0.977 and 1.030 at 1, 1.75 and 2 ms.
        for (period, rests) in [(1e-3, true), (1.75e-3, true), (2e-3, false), (4e-3, false)] {
            assert_eq!(is_stable(loops, 349.0, period), rests, "{period} s");
            let slower = loops.map(|it| it * 1e-3 / period);
            assert!(is_stable(slower, 1000.0, period), "{period} s");
        }
        // A winding that is fast lets less: 1.020 at 1.5 ms.
        assert!(!is_stable(loops, 3000.0, 1.5e-3) && is_stable(loops, 100.0, 1.5e-3));
    }
}
