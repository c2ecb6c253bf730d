//! How long the tool takes from one line to the next.

use nalgebra::Vector3;

use super::line::{Line, LineEnd, in_the_dark};
use crate::law::flight::{Flight, FlightLimits, State};
use crate::law::profile::Move;
use machine::PathLimits;

/// The part of the acceleration that the bend at an end may take in a run-in: the rest changes the speed.
const BENT: f64 = 0.99;

/// How much of the largest speed of its bends a line is entered and left at.
const END_SHARE: f64 = 0.995;

/// Where the tool is.
#[derive(Debug, Clone, Copy)]
pub(super) enum Spot {
    /// At rest [m].
    Rest(Vector3<f64>),
    /// At an end of this line, at its speed.
    Line(usize),
    /// At rest behind the end of this line.
    Behind(usize),
}

/// What the tool does between two lines.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    pub(super) from: Spot,
    pub(super) to: Spot,
}

/// What turns are made between, and within.
pub(super) struct Turns<'a> {
    pub(super) lines: &'a [Line],
    pub(super) limits: &'a PathLimits,
    /// The largest marking speed [m/s].
    pub(super) most: f64,
}

impl Turns<'_> {
    /// The time of `turn` by way of a rest, lines whose speed is open being at `open` [m/s], [s].
    pub(super) fn by_rest(&self, turn: &Turn, open: f64) -> f64 {
        let run = |end: &LineEnd| {
            let run = run_in_of(end, end.speed(open, self.most));
            (run.at(0.0).position, run.duration())
        };
        let (from, out) = match turn.from {
            Spot::Rest(place) => (place, 0.0),
            Spot::Line(index) => run(&self.lines[index].ends[1]),
            Spot::Behind(index) => (run(&self.lines[index].ends[1]).0, 0.0),
        };
        let (to, into) = match turn.to {
            Spot::Rest(place) => (place, 0.0),
            Spot::Line(index) => run(&self.lines[index].ends[0]),
            Spot::Behind(_) => return out,
        };
        let PathLimits { rapid, acceleration, jerk, .. } = *self.limits;
        out + into + Move::new((to - from).norm(), rapid, acceleration, jerk).duration()
    }

    /// The same in a flight, where it leads into a line and there is one.
    pub(super) fn flown(&self, turn: &Turn, open: f64) -> f64 {
        self.flight(turn, open).unwrap_or_else(|| self.by_rest(turn, open))
    }

    fn flight(&self, turn: &Turn, open: f64) -> Option<f64> {
        let Spot::Line(to) = turn.to else { return None };
        let to = &self.lines[to].ends[0];
        let (from, near) = match turn.from {
            Spot::Rest(place) => (State::rest(place), None),
            Spot::Line(index) => {
                let end = &self.lines[index].ends[1];
                let state = end.state(self.speed(end, open));
                (State { velocity: -state.velocity, ..state }, Some(end))
            }
            Spot::Behind(index) => {
                let end = &self.lines[index].ends[1];
                let place = run_in_of(end, end.speed(open, self.most)).at(0.0).position;
                (State::rest(place), Some(end))
            }
        };
        let mut directions = to.directions.clone();
        let others = near.map(|end| &end.directions).filter(|others| **others != directions);
        directions.extend(others.into_iter().flatten());
        let state = to.state(self.speed(to, open));
        let flight = Flight::within(&from, &state, &in_the_dark(self.limits), &directions)?;
        Some(flight.duration())
    }

    /// The speed at which an end is passed in a flight [m/s].
    fn speed(&self, end: &LineEnd, open: f64) -> f64 {
        let speed = end.speed(open, self.most);
        let is_bent = end.jet.second.norm() > 0.0;
        if is_bent { speed.min(END_SHARE * end.top) } else { speed }
    }
}

/// From rest into an end of a line at `speed` [m/s]. At the largest speed of its bend, or beyond what the
/// joints leave along it, nothing would be left for the run-in, which then takes hours: it is told as at
/// a bend that leaves a little.
fn run_in_of(end: &LineEnd, speed: f64) -> Flight {
    let to = end.state(speed);
    let acceleration = end.limits.acceleration.max(to.acceleration.norm() / BENT);
    Flight::ramp_in(&to, &FlightLimits { speed, acceleration, ..end.limits })
}
