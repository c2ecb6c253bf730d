//! The way from rest into a state, with a free start.
//!
//! Into a straight line it is the ramp to the line's speed, exactly. Into a curve, with the lateral
//! acceleration V²κ at once, it is the shorter of two: the one over the breaks of a grid, and a ramp
//! with a swing across it,
//!
//! ```text
//! along   rest ───────► V           jerk ±J·cos α, acceleration ≤ A_t
//! across  rest ─(back)─ V²κ         jerk −J·sin α for τ, then +J·sin α for (1 + √2)·τ
//! ```
//!
//! which end at the same instant. The split α is the one where both take the same time.

use core::f64::consts::{FRAC_PI_2, SQRT_2};

use messages::math;
use nalgebra::Vector3;

use super::{DirectionLimit, Flight, FlightLimits, ROUNDING, State, search};
use crate::law::profile::Ramp;

/// Lateral acceleration below which a line starts straight [m/s²].
const STRAIGHT: f64 = 1e-12;

/// From rest to an acceleration without velocity, by going back first.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Swing {
    jerk: f64,
    /// Duration of the first phase, with −jerk [s].
    back: f64,
}

/// A ramp and a swing that end together.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pair {
    ramp: Ramp,
    swing: Swing,
}

/// The shortest found from rest into `to`; `None` where there is none.
pub(super) fn into(
    to: &State,
    limits: &FlightLimits,
    directions: &[DirectionLimit],
) -> Option<Flight> {
    let speed = to.velocity.norm();
    let wanted = to.acceleration.norm();
    if !to.is_finite() {
        return None;
    }
    if speed <= ROUNDING && wanted <= STRAIGHT {
        return Some(Flight::nothing(to));
    }
    // The state itself is never in question.
    let limits = FlightLimits {
        speed: limits.speed.max(speed),
        acceleration: limits.acceleration.max(wanted),
        jerk: limits.jerk,
    };
    if wanted <= STRAIGHT {
        return Some(paired(to, &limits.along(&to.velocity, directions)));
    }
    let gridded = search::free(to, &limits, directions);
    if !directions.is_empty() {
        return gridded;
    }
    let across = to.velocity.dot(&to.acceleration).abs() <= 1e-9 * speed * wanted;
    let paired = across.then(|| paired(to, &limits));
    search::shorter(gridded, paired)
}

/// Into `to`, whose acceleration is across its velocity, by a ramp and a swing.
pub(super) fn paired(to: &State, limits: &FlightLimits) -> Flight {
    let (speed, wanted) = (to.velocity.norm(), to.acceleration.norm());
    if wanted <= STRAIGHT {
        let ramp = Ramp::to_speed(speed, limits.acceleration, limits.jerk);
        return Pair { ramp, swing: Swing::default() }.flight(to);
    }
    Pair::new(speed, wanted, limits).flight(to)
}

impl Swing {
    /// To `acceleration` with `jerk`.
    fn new(acceleration: f64, jerk: f64) -> Self {
        // −J·τ₁ + J·τ₂ = a and ∫a = 0 give τ₂ = (1 + √2)·τ₁, a = √2·J·τ₁.
        Self { jerk, back: acceleration / (SQRT_2 * jerk) }
    }

    fn duration(&self) -> f64 {
        (2.0 + SQRT_2) * self.back
    }

    /// The acceleration `left` before the end [m/s²].
    fn acceleration(&self, left: f64) -> f64 {
        let back = -self.jerk * (self.duration() - left).max(0.0);
        back.max(self.jerk * (SQRT_2 * self.back - left))
    }
}

impl Pair {
    /// To `speed` and the lateral acceleration `wanted`.
    fn new(speed: f64, wanted: f64, limits: &FlightLimits) -> Self {
        let split = |angle: f64| {
            let (sine, cosine) = math::sin_cos(angle);
            let swing = Swing::new(wanted, limits.jerk * sine);
            Self::beside(swing, speed, limits.acceleration, limits.jerk * cosine)
        };
        let (mut low, mut high) = (1e-6, FRAC_PI_2 - 1e-6);
        for _ in 0..40 {
            let middle = (low + high) / 2.0;
            let pair = split(middle);
            if pair.swing.duration() > pair.ramp.duration() {
                low = middle;
            } else {
                high = middle;
            }
        }
        split(high)
    }

    /// The quickest ramp that leaves `swing` its share of `acceleration`.
    fn beside(swing: Swing, speed: f64, acceleration: f64, jerk: f64) -> Self {
        let with = |part: f64| Self { ramp: Ramp::to_speed(speed, part, jerk), swing };
        let full = with(acceleration);
        if full.keeps(acceleration) {
            return full;
        }
        let (mut low, mut high) = (0.0, full.ramp.acceleration());
        for _ in 0..30 {
            let middle = (low + high) / 2.0;
            if with(middle).keeps(acceleration) {
                low = middle;
            } else {
                high = middle;
            }
        }
        with(low.max(acceleration * 1e-6))
    }

    /// Acceleration along and across, `left` before the end [m/s²].
    fn accelerations(&self, left: f64) -> [f64; 2] {
        let along = self.ramp.at(self.ramp.duration() - left).acceleration;
        [along, self.swing.acceleration(left)]
    }

    /// The breaks, counted back from the end, in no order [s].
    fn breaks(&self) -> [f64; 6] {
        let Ramp { rise, hold, .. } = self.ramp;
        let swing = self.swing.duration();
        [rise, rise + hold, self.ramp.duration(), swing - self.swing.back, swing, 0.0]
    }

    /// Whether |a| stays within `acceleration`: convex between breaks, so it is enough to look there.
    fn keeps(&self, acceleration: f64) -> bool {
        let limit = acceleration * acceleration * (1.0 + 1e-9);
        self.breaks().into_iter().all(|left| {
            let [along, across] = self.accelerations(left);
            along * along + across * across <= limit
        })
    }

    /// Into `to`.
    fn flight(&self, to: &State) -> Flight {
        let tangent = to.velocity.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        let normal = to.acceleration.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        let mut breaks = self.breaks();
        breaks.sort_by(|one, other| other.total_cmp(one));
        let mut left = breaks[0];
        let least = 1e-12 * left;
        let (mut steps, mut accelerations) = (Vec::new(), Vec::new());
        for next in breaks {
            if left - next > least {
                let [along, across] = self.accelerations(next);
                steps.push(left - next);
                accelerations.push(tangent * along + normal * across);
                left = next;
            }
        }
        if let Some(last) = accelerations.last_mut() {
            *last = to.acceleration;
        }
        let from = State::rest(to.position);
        let mut flight = Flight::through(&from, to, &steps, accelerations.into_iter());
        flight.end_at(to);
        flight
    }
}
