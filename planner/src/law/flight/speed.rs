//! The largest speed of a flight between its breaks.

use super::{Flight, Motion3};

/// Halvings of an interval until nothing is left of it.
const HALVINGS: usize = 50;

impl Flight {
    /// Whether it is nowhere faster than `speed` [m/s].
    pub(super) fn keeps_speed(&self, speed: f64) -> bool {
        let limit = speed * (1.0 + 1e-10);
        self.phases.iter().enumerate().all(|(index, phase)| {
            let end = self.phases.get(index + 1).map_or(self.duration, |next| next.start);
            let step = end - phase.start;
            let motion = &phase.motion;
            // The middle control point, and the two ends, hold the velocity between them.
            let middle = motion.velocity + motion.acceleration * (step / 2.0);
            let last = motion.after(step).velocity;
            let safe = [motion.velocity, middle, last].iter().all(|point| point.norm() <= limit);
            safe || fastest(motion, step) <= limit
        })
    }
}

/// The largest speed within `step` [s] of the start of `motion` [m/s].
fn fastest(motion: &Motion3, step: f64) -> f64 {
    // The power v·a is a cubic of time, monotone between the zeros of its derivative a² + v·j.
    let power = |time: f64| {
        let motion = motion.after(time);
        motion.velocity.dot(&motion.acceleration)
    };
    let [first, second] = turning(motion);
    let borders = [0.0, first.clamp(0.0, step), second.clamp(0.0, step), step];
    let mut top = motion.velocity.norm();
    for pair in borders.windows(2) {
        let (mut low, mut high) = (pair[0], pair[1]);
        top = top.max(motion.after(high).velocity.norm());
        if power(low) > 0.0 && power(high) < 0.0 {
            for _ in 0..HALVINGS {
                let middle = (low + high) / 2.0;
                if power(middle) > 0.0 { low = middle } else { high = middle }
            }
            top = top.max(motion.after(low).velocity.norm());
        }
    }
    top
}

/// Where a² + v·j is 0, in order, counted from the start of `motion`; 0 for nowhere [s].
fn turning(motion: &Motion3) -> [f64; 2] {
    // (3/2)·j²·t² + 3·(a·j)·t + (a² + v·j).
    let square = 1.5 * motion.jerk.norm_squared();
    let half = 1.5 * motion.acceleration.dot(&motion.jerk);
    let constant = motion.acceleration.norm_squared() + motion.velocity.dot(&motion.jerk);
    let discriminant = half * half - square * constant;
    if discriminant <= 0.0 || square == 0.0 {
        return [0.0; 2];
    }
    let root = discriminant.sqrt();
    [(-half - root) / square, (-half + root) / square]
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::random::SplitMix64;
    use nalgebra::Vector3;

    #[test]
    fn the_largest_speed_is_that_of_a_fine_grid() {
        let mut random = SplitMix64::new(1);
        let mut vector = |size: f64| Vector3::from_fn(|_, _| random.between(-size, size));
        for _ in 0..1000 {
            let motion = Motion3 {
                position: Vector3::zeros(),
                velocity: vector(1.0),
                acceleration: vector(10.0),
                jerk: vector(500.0),
            };
            let speeds =
                (0..=5000).map(|index| motion.after(f64::from(index) * 2e-5).velocity.norm());
            let sampled = speeds.fold(0.0, f64::max);
            let found = fastest(&motion, 0.1);
            assert!(found >= sampled - 1e-12 && found <= sampled + 1e-6, "{found} {sampled}");
        }
    }
}
