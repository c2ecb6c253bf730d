//! A stroke before its speed is known: the curves that are marked in one go, and their joins.

use machine::PathLimits;

use crate::blend::{Join, Quarter};
use crate::drawing::Power;
use crate::jet::Jet;
use crate::stroke::StrokePath;
use crate::track::{Bend, Track};

/// A smoothed join that stays within this share of the tolerance is made gentler than it must be.
const GENTLE: f64 = 0.2;

/// Curves that meet within this distance are taken to meet [m].
pub(crate) const GAP: f64 = 1e-8;

/// Share of a curve that is not left as a part of its own where a line is divided.
const SLIVER: f64 = 0.1;

/// Curves that are marked in one go, with the same speed asked for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outline {
    tracks: Vec<Track>,
    joins: Vec<Join>,
    /// What the laser does from each track on.
    pub(crate) powers: Vec<Power>,
    /// The speed that the job asks for [m/s].
    pub(crate) speed: Option<f64>,
    /// Line of the job file.
    pub(crate) line: u64,
    length: f64,
    bend: Bend,
}

impl Outline {
    /// Starts with one curve.
    pub(crate) fn new(track: Track, speed: Option<f64>, power: Power, line: u64) -> Self {
        let (length, bend) = (track.length(), track.bend());
        Self {
            tracks: vec![track],
            joins: Vec::new(),
            powers: vec![power],
            speed,
            line,
            length,
            bend,
        }
    }

    /// Goes on with `track` if it continues the stroke: it starts at its end, with a tangent within
    /// the angle whose cosine is `cosine`. Says whether it does.
    pub(crate) fn extend(
        &mut self,
        track: Track,
        power: Power,
        cosine: f64,
        tolerance: f64,
    ) -> bool {
        let (before, after) = (self.end(), track.at(0.0));
        if (after.point - before.point).norm() > GAP || before.first.dot(&after.first) < cosine {
            return false;
        }
        // The first and last curve of a stroke have no other join to leave room for, but may get
        // one later; half of each keeps joins apart in every case.
        let room = self.last().length().min(track.length()) / 2.0;
        self.joins.push(Join::new(&before, &after, room, tolerance));
        self.length += track.length();
        self.bend = self.bend.or(track.bend());
        self.tracks.push(track);
        self.powers.push(power);
        true
    }

    /// Length of the drawn line [m].
    pub(crate) fn length(&self) -> f64 {
        self.length
    }

    /// The first point.
    pub(crate) fn start(&self) -> Jet {
        self.tracks[0].at(0.0)
    }

    /// The last point.
    pub(crate) fn end(&self) -> Jet {
        let last = self.last();
        last.at(last.length())
    }

    fn last(&self) -> &Track {
        &self.tracks[self.tracks.len() - 1]
    }

    /// The point of the drawn line at `distance` from the start [m].
    pub(crate) fn at(&self, distance: f64) -> Jet {
        let mut from = 0.0;
        for track in &self.tracks {
            if distance < from + track.length() {
                return track.at(distance - from);
            }
            from += track.length();
        }
        self.end()
    }

    /// `cut`, or the end of its curve where that is nearer than a tenth of the curve: a short rest of
    /// one would leave no room to smooth the join at it, and slow all of its part.
    fn beside_joins(&self, cut: f64) -> f64 {
        let mut from = 0.0;
        for track in &self.tracks {
            let end = from + track.length();
            if cut < end {
                let near = SLIVER * track.length();
                return match (cut - from < near, end - cut < near) {
                    (true, _) => from,
                    (false, true) => end,
                    (false, false) => cut,
                };
            }
            from = end;
        }
        cut
    }

    /// The same line in parts that begin at the start and at each of `cuts`, growing distances from
    /// it [m], and go on into each other.
    pub(crate) fn divided(&self, cuts: &[f64], limits: &PathLimits) -> Vec<Self> {
        let mut parts: Vec<Self> = Vec::with_capacity(cuts.len() + 1);
        let mut cuts: Vec<f64> = cuts.iter().map(|cut| self.beside_joins(*cut)).collect();
        cuts.dedup();
        let mut cuts = cuts.into_iter().filter(|cut| (GAP..self.length - GAP).contains(cut));
        let mut next = cuts.next();
        let mut begins = true;
        let mut from = 0.0;
        for (track, power) in self.tracks.iter().zip(&self.powers) {
            let end = from + track.length();
            let mut here = from;
            loop {
                let cut = next.filter(|cut| *cut < end - GAP);
                let to = cut.unwrap_or(end);
                // A cut at a join leaves nothing of the curve before it.
                if to - here > GAP {
                    let part = track.part(here - from, to - from);
                    // What went on into each other in the whole does so in a part.
                    let goes_on = parts.last_mut().filter(|_| !begins).is_some_and(|last| {
                        last.extend(part.clone(), *power, -1.0, limits.tolerance)
                    });
                    if !goes_on {
                        parts.push(Self::new(part, self.speed, *power, self.line));
                    }
                    begins = false;
                }
                here = to;
                if cut.is_none() {
                    break;
                }
                begins = true;
                next = cuts.next();
            }
            from = end;
        }
        parts
    }

    /// The curves in order.
    pub(crate) fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// The largest constant speed [m/s]: V²κ ≤ A, V³|p‴| ≤ J, smoothed joins included.
    pub(crate) fn top_speed(&self, limits: &PathLimits) -> f64 {
        let (acceleration, jerk) = (limits.acceleration, limits.jerk);
        let mut speed = self.bend.speed(acceleration, jerk);
        for join in self.joins.iter().filter(|join| !join.is_smooth()) {
            speed = speed.min(join.sharpest(join.room).speed(acceleration, jerk));
        }
        // That takes the curves' bend at the joins alone; the smoothed joins are measured and have
        // the last word. Each round shortens less than the one before.
        for _ in 0..8 {
            let measured = self.measured(speed, limits).speed(acceleration, jerk);
            if measured >= speed {
                break;
            }
            speed = measured * (1.0 - 1e-9);
        }
        speed
    }

    /// How sharply the path at `speed` bends at most.
    fn measured(&self, speed: f64, limits: &PathLimits) -> Bend {
        let mut bend = self.bend;
        for index in 0..self.joins.len() {
            if let Some((_, quarters)) = self.smoothed(index, speed, limits) {
                bend =
                    quarters.iter().fold(bend, |bend, (part, length)| bend.or(part.bend(*length)));
            }
        }
        bend
    }

    /// The reach and the quarters of the join after track `index`; `None` where the curves go over
    /// into each other as they are.
    fn smoothed(
        &self,
        index: usize,
        speed: f64,
        limits: &PathLimits,
    ) -> Option<(f64, [(Quarter, f64); 4])> {
        /// Each lengthening of a join that turns out too sharp.
        const LONGER: f64 = 1.05;
        let join = self.joins.get(index).filter(|join| !join.is_smooth())?;
        let (acceleration, jerk) = (limits.acceleration, limits.jerk);
        let shortest = join.shortest(speed, acceleration, jerk);
        let gentle = join.gentle(limits.tolerance * GENTLE);
        let mut reach = shortest.max(gentle).min(join.room);
        loop {
            let quarters = join.quarters(&self.tracks[index], &self.tracks[index + 1], reach);
            let fits = |(part, length): &(Quarter, f64)| {
                part.bend(*length).speed(acceleration, jerk) >= speed
            };
            if reach >= join.room || quarters.iter().all(fits) {
                return Some((reach, quarters));
            }
            reach = (reach * LONGER).min(join.room);
        }
    }

    /// The path of the stroke at `speed` [m/s], its joins smoothed as that speed needs.
    pub(crate) fn trace(&self, speed: f64, limits: &PathLimits) -> StrokePath {
        let mut path = StrokePath::default();
        let mut from = 0.0;
        for (index, track) in self.tracks.iter().enumerate() {
            let Some((reach, quarters)) = self.smoothed(index, speed, limits) else {
                path.push_track(track, from, track.length() - from);
                from = 0.0;
                continue;
            };
            path.push_track(track, from, track.length() - reach - from);
            for (quarter, length) in quarters {
                path.push_quarter(quarter, length);
            }
            from = reach;
        }
        path
    }
}
