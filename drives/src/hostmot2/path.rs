//! The angle that a motor is told, through one cycle.

use crate::port::{Actuation, Freshness};
use messages::CommandMode;

/// A commanded angle from home: a cubic by the angles and speeds at both ends of the cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// How long a cycle is [s].
    period: f64,
    /// Angles [rad] and speeds [rad/s] at its beginning and its end.
    pub from: [f64; 2],
    /// At its end.
    pub to: [f64; 2],
}

impl Path {
    /// At rest at home, in cycles of `period` [s].
    pub fn new(period: f64) -> Self {
        Self { period, from: [0.0; 2], to: [0.0; 2] }
    }

    /// At rest at `angle` [rad].
    pub fn rest(&mut self, angle: f64) {
        (self.from, self.to) = ([angle, 0.0], [angle, 0.0]);
    }

    /// The cycle after this one, at the speed that it ends with.
    pub fn coast(&mut self) {
        let [angle, speed] = self.to;
        (self.from, self.to) = (self.to, [angle + speed * self.period, speed]);
    }

    /// The cycle after this one, under `actuation` with `target` [rad, rad/s] and a braking by `deceleration`
    /// [rad/s²].
    pub fn engage(&mut self, actuation: &Actuation, target: [f64; 2], deceleration: f64) {
        self.from = self.to;
        let [angle, speed] = self.from;
        self.to = match (actuation.mode, actuation.freshness) {
            (CommandMode::Disabled, _) => [angle, 0.0],
            (CommandMode::QuickStop, _) => {
                let left = (speed.abs() - deceleration * self.period).max(0.0) * speed.signum();
                let stop = 0.5 * speed * speed.abs() / deceleration;
                let on = 0.5 * (speed + left) * self.period;
                [angle + if left == 0.0 { stop } else { on }, left]
            }
            (_, Freshness::Fresh) => target,
            // Nobody said where to: on as before, for the few cycles that the bridge allows.
            (_, Freshness::Stale) => [angle + speed * self.period, speed],
        };
    }

    /// The angle at the share `at` of the cycle [rad].
    pub fn at(&self, at: f64) -> f64 {
        if at >= 1.0 {
            return self.to[0];
        }
        let rise = self.to[0] - self.from[0];
        let (slope, last) = (self.from[1] * self.period, self.to[1] * self.period);
        let square = 3.0 * rise - 2.0 * slope - last;
        let cube = slope + last - 2.0 * rise;
        self.from[0] + at * (slope + at * (square + at * cube))
    }

    /// The mean acceleration that takes it from its first speed to its last angle [rad/s²].
    pub fn acceleration(&self) -> f64 {
        let coasted = self.from[0] + self.from[1] * self.period;
        2.0 * (self.to[0] - coasted) / (self.period * self.period)
    }

    /// The mean speed [rad/s].
    pub fn mean_speed(&self) -> f64 {
        (self.to[0] - self.from[0]) / self.period
    }
}

/// Whether the motors follow a target in this mode.
pub fn is_driven(mode: CommandMode) -> bool {
    !matches!(mode, CommandMode::Disabled | CommandMode::QuickStop)
}
