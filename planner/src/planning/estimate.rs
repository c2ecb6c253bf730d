//! How long a job takes, told while it is planned.

use machine::Mechanism;
use nalgebra::Vector3;

use super::Planning;
use super::front::Front;
use crate::geometry::contour::{Contour, Demand};

/// The share of a job that counts as done as estimated when its time is told.
const LITTLE: f64 = 0.05;

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Stream time at the end of the job, as far as it can be told now [s].
    pub(super) fn estimate(&self) -> f64 {
        let Front { time, estimated, .. } = self.front;
        if self.front.sampler.has_ended() {
            return time;
        }
        let run = self.front.run.as_ref();
        let ahead = run.map_or(0.0, |run| {
            self.estimate_of(&run.contour) * (1.0 - run.at / run.contour.length())
        });
        let ahead = ahead + self.front.standing;
        let parts = self.front.parts.iter().map(|part| self.estimate_of(part));
        let ahead = parts.fold(ahead, |sum, part| sum + part);
        let done = (estimated - ahead).max(0.0);
        let left = (self.task.estimate - done).max(0.0);
        // What is still to come is slower than estimated in the same measure as what has been planned, of
        // which a little says little.
        let little = LITTLE * self.task.estimate + f64::MIN_POSITIVE;
        let slower = (self.duration() + little) / (done / self.rate + little);
        time + left / self.rate * slower
    }

    /// How long a path takes at the speeds asked for [s].
    pub(super) fn estimate_of(&self, contour: &Contour) -> f64 {
        let rapid = self.limits.path.rapid;
        let time = |(demand, end): (Demand, f64)| {
            let speed = match demand.speed {
                asked if demand.power > 0.0 => self.task.speeds.of(asked),
                asked => asked.map_or(rapid, |speed| speed.min(rapid)),
            };
            (end - demand.from) / speed
        };
        contour.stretches().map(time).sum()
    }

    /// Notes how long a free move to `to` is estimated to take.
    pub(super) fn note_rapid(&mut self, to: &Vector3<f64>) {
        let way = (to - self.front.place).norm();
        self.front.estimated += way / self.limits.path.rapid;
        self.front.place = *to;
    }
}
