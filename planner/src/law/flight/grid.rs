//! The breaks of a flight, and what the coefficients of its velocity mean on them.
//!
//! Velocity is a quadratic B-spline of time with one coefficient to each interval: the middle
//! control point of the interval's Bézier form. The first and the last are known from the ends.

/// Number of intervals of constant jerk.
pub(super) const INTERVALS: usize = 14;

/// Part of all intervals that either end gets where the middle is a cruise.
const CLUSTER: usize = (INTERVALS - 2) / 2;

/// Lengths that the layout of a grid follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spacing {
    /// Time in which the acceleration reaches its limit [s].
    pub rise: f64,
    /// Time in which any speed is reached from either end [s].
    pub reach: [f64; 2],
}

/// Breaks of a flight by their distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grid {
    /// Lengths of the intervals, all positive [s].
    pub steps: [f64; INTERVALS],
}

/// Fills `steps` up to `width`, with breaks where the acceleration has risen by either end.
fn fill(steps: &mut [f64], width: f64, rise: f64) {
    let count = steps.len();
    let rising = (rise * count as f64 / width).round().max(1.0);
    if rise > 0.47 * width || 2.0 * rising >= count as f64 {
        steps.fill(width / count as f64);
        return;
    }
    let each = rise / rising;
    let rising = rising as usize;
    let inner = (width - 2.0 * rise) / (count - 2 * rising) as f64;
    steps.fill(inner);
    steps[..rising].fill(each);
    steps[count - rising..].fill(each);
}

impl Grid {
    /// Over `duration` [s], positive.
    pub(super) fn new(duration: f64, spacing: &Spacing) -> Self {
        let mut steps = [0.0; INTERVALS];
        let [first, last] = spacing.reach;
        let cruise = duration - first - last;
        if cruise > 0.2 * duration {
            fill(&mut steps[..CLUSTER], first, spacing.rise);
            fill(&mut steps[INTERVALS - CLUSTER..], last, spacing.rise);
            let between = INTERVALS - 2 * CLUSTER;
            steps[CLUSTER..INTERVALS - CLUSTER].fill(cruise / between as f64);
        } else {
            fill(&mut steps, duration, spacing.rise);
        }
        Self { steps }
    }

    /// Distance in time of coefficient `index` from the one before it [s]; `index` from 1.
    pub(super) fn gap(&self, index: usize) -> f64 {
        (self.steps[index - 1] + self.steps[index]) / 2.0
    }

    /// What the displacement takes of coefficient `index` [s].
    pub(super) fn weight(&self, index: usize) -> f64 {
        let before = if index > 0 { self.steps[index - 1] } else { 0.0 };
        let after = self.steps.get(index + 1).copied().unwrap_or(0.0);
        (before + self.steps[index] + after) / 3.0
    }

    /// What the displacement takes of the velocities at the two ends [s].
    pub(super) fn ends(&self) -> [f64; 2] {
        [self.steps[0] / 3.0, self.steps[INTERVALS - 1] / 3.0]
    }
}
