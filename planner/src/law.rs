//! The speed along a stroke: one speed where the axes can follow it, else plateaus that stay below
//! what they can, with jerk-limited ramps between.
//!
//! A ramp lies on the faster plateau's ground, so that nothing is ever faster than the axes allow
//! where it is.

use crate::profile::{Motion, Ramp};

/// Ratio of two neighbouring plateaus.
const LEVEL: f64 = 0.84;

/// A stretch of a stroke on which the tool may have this speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cell {
    /// Where it ends along the path [m].
    pub(crate) end: f64,
    /// Largest steady speed [m/s].
    pub(crate) speed: f64,
    /// Largest acceleration [m/s²] and jerk [m/s³] of a ramp.
    pub(crate) ramp: [f64; 2],
}

/// Speed as a function of time along one stroke.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedLaw {
    phases: Vec<Phase>,
    length: f64,
    duration: f64,
}

/// A plateau, or a ramp from one to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Phase {
    /// When it starts [s] and where [m].
    start: f64,
    from: f64,
    duration: f64,
    /// Speed of a plateau, and at the start of a ramp [m/s].
    speed: f64,
    /// The change of speed, up or down, without change on a plateau.
    ramp: Option<(Ramp, bool)>,
}

/// A stretch at one speed.
#[derive(Debug, Clone, Copy)]
struct Plateau {
    from: f64,
    to: f64,
    speed: f64,
    ramp: [f64; 2],
}

impl SpeedLaw {
    /// Below the speeds of `cells`, which lie end to end from 0, and at most at `top`. The first
    /// speed is at most `ends[0]`, the last at most `ends[1]`.
    pub(crate) fn below(cells: &[Cell], top: f64, ends: [f64; 2]) -> Self {
        let mut plateaus = plateaus(cells, top, ends);
        while let Some((index, speed)) = too_short(&plateaus) {
            plateaus[index].speed = speed;
            plateaus = merged(plateaus);
        }
        let mut law = Self { phases: Vec::new(), length: 0.0, duration: 0.0 };
        for (index, plateau) in plateaus.iter().enumerate() {
            let before = index.checked_sub(1).map(|index| plateaus[index]);
            let mut room = plateau.to - plateau.from;
            if let Some(before) = before.filter(|before| before.speed < plateau.speed) {
                let ramp = ramp_between(&before, plateau);
                room -= way(&ramp, before.speed);
                law.push(before.speed, ramp.duration(), Some((ramp, true)));
            }
            let after = plateaus.get(index + 1).filter(|after| after.speed < plateau.speed);
            let down = after.map(|after| (after, ramp_between(after, plateau)));
            let down_way = down.as_ref().map_or(0.0, |(after, ramp)| way(ramp, after.speed));
            law.push(plateau.speed, (room - down_way).max(0.0) / plateau.speed, None);
            if let Some((_, ramp)) = down {
                law.push(plateau.speed, ramp.duration(), Some((ramp, false)));
            }
        }
        law
    }

    fn push(&mut self, speed: f64, duration: f64, ramp: Option<(Ramp, bool)>) {
        if duration <= 0.0 {
            return;
        }
        let phase = Phase { start: self.duration, from: self.length, duration, speed, ramp };
        self.length = phase.at(duration).position;
        self.duration += duration;
        self.phases.push(phase);
    }

    /// [s].
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// The motion along the path at `time` since the start [s].
    pub fn at(&self, time: f64) -> Motion {
        let after = self.phases.partition_point(|phase| phase.start <= time);
        let phase = &self.phases[after.max(1) - 1];
        phase.at(time - phase.start)
    }

    /// The speed at the start [m/s].
    pub fn first(&self) -> f64 {
        self.phases.first().map_or(0.0, |phase| phase.speed)
    }

    /// The speed at the end [m/s].
    pub fn last(&self) -> f64 {
        self.at(self.duration).velocity
    }

    /// The slowest plateau [m/s] and the middle of it [m].
    pub(crate) fn slowest(&self) -> (f64, f64) {
        let plateaus = self.phases.iter().filter(|phase| phase.ramp.is_none());
        plateaus
            .min_by(|one, other| one.speed.total_cmp(&other.speed))
            .map_or((0.0, 0.0), |phase| {
                (phase.speed, phase.from + phase.speed * phase.duration / 2.0)
            })
    }

    /// When the tool is at `distance` from the start [s].
    pub(crate) fn time_at(&self, distance: f64) -> f64 {
        let after = self.phases.partition_point(|phase| phase.from <= distance);
        let Some(phase) = self.phases.get(after.max(1) - 1) else { return 0.0 };
        if phase.ramp.is_none() {
            return (phase.start + (distance - phase.from) / phase.speed).min(self.duration);
        }
        // The position only grows: bisection to rounding.
        let (mut low, mut high) = (0.0, phase.duration);
        for _ in 0..60 {
            let middle = (low + high) / 2.0;
            if phase.at(middle).position < distance {
                low = middle;
            } else {
                high = middle;
            }
        }
        phase.start + high
    }

    /// Instants at which the jerk or, on ramps, the speed has changed by a share of `top` [m/s]: what
    /// a power that follows the speed is told at [s].
    pub(crate) fn instants(&self, top: f64) -> Vec<f64> {
        /// Change of speed that one step of power stands for, as a share of the top speed.
        const SHARE: f64 = 0.02;
        let mut instants = Vec::new();
        for phase in &self.phases {
            let change = phase.ramp.map_or(0.0, |(ramp, _)| ramp.speed());
            let steps = (change / (SHARE * top)).ceil().max(1.0) as u32;
            for step in 0..steps {
                instants.push(phase.start + phase.duration * f64::from(step) / f64::from(steps));
            }
        }
        instants
    }
}

impl Phase {
    fn at(&self, time: f64) -> Motion {
        let Self { from, speed, .. } = *self;
        let (change, sign) = match &self.ramp {
            None => (Motion::default(), 1.0),
            Some((ramp, up)) => (ramp.at(time), if *up { 1.0 } else { -1.0 }),
        };
        Motion {
            position: from + speed * time + sign * change.position,
            velocity: speed + sign * change.velocity,
            acceleration: sign * change.acceleration,
            jerk: sign * change.jerk,
        }
    }
}

/// The ramp between a slower plateau and a faster one, on the ground of the latter.
fn ramp_between(slower: &Plateau, faster: &Plateau) -> Ramp {
    Ramp::to_speed(faster.speed - slower.speed, faster.ramp[0], faster.ramp[1])
}

/// The way of a ramp that starts at `slower` [m].
fn way(ramp: &Ramp, slower: f64) -> f64 {
    slower * ramp.duration() + ramp.length()
}

/// Cells of the same level as plateaus.
fn plateaus(cells: &[Cell], top: f64, ends: [f64; 2]) -> Vec<Plateau> {
    let last = cells.len().saturating_sub(1);
    let mut from = 0.0;
    let mut found = Vec::with_capacity(cells.len());
    for (index, cell) in cells.iter().enumerate() {
        let mut most = cell.speed;
        if index == 0 {
            most = most.min(ends[0]);
        }
        if index == last {
            most = most.min(ends[1]);
        }
        let speed = if most >= top {
            top
        } else {
            let level = (signals::math::ln(most / top) / signals::math::ln(LEVEL)).ceil();
            top * signals::math::exp(level * signals::math::ln(LEVEL))
        };
        found.push(Plateau { from, to: cell.end, speed, ramp: cell.ramp });
        from = cell.end;
    }
    merged(found)
}

/// Neighbours of the same speed become one.
fn merged(plateaus: Vec<Plateau>) -> Vec<Plateau> {
    let mut merged: Vec<Plateau> = Vec::with_capacity(plateaus.len());
    for plateau in plateaus {
        match merged.last_mut() {
            Some(last) if last.speed == plateau.speed => {
                last.to = plateau.to;
                last.ramp = std::array::from_fn(|order| last.ramp[order].min(plateau.ramp[order]));
            }
            _ => merged.push(plateau),
        }
    }
    merged
}

/// The first plateau that has no room for its ramps, and the speed of the faster of its slower
/// neighbours, which it must take on.
fn too_short(plateaus: &[Plateau]) -> Option<(usize, f64)> {
    for (index, plateau) in plateaus.iter().enumerate() {
        let before = index.checked_sub(1).map(|index| plateaus[index]);
        let after = plateaus.get(index + 1).copied();
        let slower = |other: &Plateau| other.speed < plateau.speed;
        let slower = [before, after].map(|other| other.filter(slower));
        let needed: f64 = slower
            .iter()
            .flatten()
            .map(|other| way(&ramp_between(other, plateau), other.speed))
            .sum();
        if needed > plateau.to - plateau.from {
            let speed = slower.iter().flatten().map(|other| other.speed).fold(0.0, f64::max);
            return Some((index, speed));
        }
    }
    None
}
