//! A path that is gone without a stop: the curves of a job that go on into each other, their
//! joints, and what the job asks for along them.

mod parts;

use std::sync::Arc;

use machine::PathLimits;
use nalgebra::Vector3;

use crate::geometry::blend::{Blend, BlendSegment};
use crate::geometry::jet::Jet;
use crate::geometry::path::Path;
use crate::geometry::track::{Bend, Track};
use crate::geometry::turning::Turning;
use crate::light::Policy;

/// A corner that is rounded more than its speed requires stays within this fraction of the tolerance.
const GENTLE: f64 = 0.2;

/// Curves that meet within this distance are taken to meet [m].
pub(crate) const GAP: f64 = 1e-8;

/// Two directions that differ by 1° or more form a corner; its cosine.
pub(crate) const CORNER: f64 = 0.999_847_695_156_391_3;

/// Cosine of the sharpest turn that is passed on the way: 150°. Beyond, the rounded path would turn
/// almost on the spot.
const REVERSAL: f64 = -0.866_025_403_784_438_6;

/// However sharp a corner is, the rounded path passes it within twice the tolerance.
const LEAST_NEARER: f64 = 0.5;

/// What a job asks for along a stretch of a contour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Demand {
    /// Where it begins, by the contour's parameter [m].
    pub(crate) from: f64,
    /// Power of the laser [fraction of full scale], 0 in the dark.
    pub(crate) power: f64,
    /// The speed asked for [m/s]; `None` leaves it to the job's policy, or in the dark to the
    /// machine's rapids.
    pub(crate) speed: Option<f64>,
    /// Line of the job file, 0 for none.
    pub(crate) line: u64,
}

/// A stretch of a contour that is lit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Light {
    /// Where it begins, by the contour's parameter [m].
    pub(crate) from: f64,
    /// Where it ends [m].
    pub(crate) to: f64,
    /// Line of the job file where it begins, 0 for none.
    pub(crate) line: u64,
}

/// How the next curve may be joined to a contour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Joining {
    /// Whether corners beyond 1° may be rounded.
    pub(crate) rounds: bool,
    /// How far the rounded path may be from the drawn one [m].
    pub(crate) tolerance: f64,
    /// The limits that a constant speed must keep in a rounded corner.
    pub(crate) limits: PathLimits,
    /// The speed that is asked for before and after the joint, where it is [m/s].
    pub(crate) asked: Option<f64>,
    /// The speed that a corner of lines that leave it open must allow [m/s].
    pub(crate) open: f64,
}

/// How a curve goes on from a contour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Joint {
    /// Without a stop: it is part of the contour now.
    Passed,
    /// It does not.
    Ends,
    /// It would at this speed, which is less than open lines have [m/s].
    Slower(f64),
}

/// Curves that are gone in one go.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Contour {
    tracks: Vec<Track>,
    /// Where each track begins [m].
    starts: Vec<f64>,
    blends: Vec<Blend>,
    /// How it goes on from the contour before, of which it is the next part.
    joint: Option<Blend>,
    demands: Vec<Demand>,
    /// How its light goes with its speed.
    pub(crate) policy: Policy,
    /// Line of the job file where it begins.
    pub(crate) line: u64,
    length: f64,
    bend: Bend,
    /// What its tracks weigh.
    weight: usize,
    is_lit: bool,
    /// Whether it is entered and left at speed although its power goes with the speed.
    is_flown: bool,
    /// How the tool is turned along it, and where on that it begins [m]; `None` where it says nothing.
    turning: Option<(Arc<Turning>, f64)>,
}

impl Joining {
    /// Whether the corner that `blend` rounds can be passed at the one speed of both sides.
    fn at_one_speed(&self, blend: &Blend) -> Joint {
        let PathLimits { speed, acceleration, jerk, .. } = self.limits;
        let most = blend.sharpest(blend.room).speed(acceleration, jerk);
        match self.asked {
            Some(asked) if most >= asked.min(speed) => Joint::Passed,
            Some(_) => Joint::Ends,
            None if most >= self.open.min(speed) => Joint::Passed,
            None => Joint::Slower(most),
        }
    }
}

impl Contour {
    /// Starts with one curve.
    pub(crate) fn new(track: Track, demands: &[Demand], policy: Policy) -> Self {
        let (length, bend, weight) = (track.length(), track.bend(), track.weight());
        let line = demands.first().map_or(0, |demand| demand.line);
        Self {
            tracks: vec![track],
            starts: vec![0.0],
            blends: Vec::new(),
            joint: None,
            demands: demands.to_vec(),
            policy,
            line,
            length,
            bend,
            weight,
            is_lit: demands.iter().any(|demand| demand.power > 0.0),
            is_flown: false,
            turning: None,
        }
    }

    /// Entered and left at speed, though its power goes with the speed.
    pub(crate) fn flown(self) -> Self {
        Self { is_flown: true, ..self }
    }

    /// Whether the tool comes to it, and leaves it, at the speed of what is lit.
    pub(crate) fn is_entered_at_speed(&self) -> bool {
        self.is_lit && (self.is_flown || self.policy == Policy::Constant)
    }

    /// With the tool turned as `turning` has it from the place `from` on [m].
    pub(crate) fn turned(self, turning: Option<Arc<Turning>>, from: f64) -> Self {
        Self { turning: turning.map(|turning| (turning, from)), ..self }
    }

    /// Whether it says how the tool is turned.
    pub(crate) fn is_turned(&self) -> bool {
        self.turning.is_some()
    }

    /// Whether it is the next part of the contour before it, which is gone on with without a stop.
    pub(crate) fn goes_on_from_before(&self) -> bool {
        self.joint.is_some()
    }

    /// Goes on with `track` and its `demands`, counted from its start, if it starts where the contour
    /// ends and the corner between them may be passed without a stop.
    pub(crate) fn extend(&mut self, track: &Track, demands: &[Demand], joining: &Joining) -> Joint {
        let (before, after) = (self.end(), track.at(0.0));
        if (after.point - before.point).norm() > GAP {
            return Joint::Ends;
        }
        let cosine = before.first.normalize().dot(&after.first.normalize());
        // The first and last curve of a contour have no other joint to leave room for, but may get
        // one later; half of each keeps joints apart in every case.
        let room = self.last().length().min(track.length()) / 2.0;
        // In the middle of a turn by φ the rounded path is cos ½φ as far from both lines as from their
        // corner.
        let nearer = ((1.0 + cosine.max(REVERSAL)) / 2.0).sqrt().max(LEAST_NEARER);
        let blend = Blend::new(&before, &after, room, joining.tolerance / nearer, &joining.limits);
        // A direction that is no number goes on into nothing.
        if cosine < CORNER || cosine.is_nan() {
            if !joining.rounds || cosine <= REVERSAL || cosine.is_nan() {
                return Joint::Ends;
            }
            let found = match self.policy {
                Policy::Proportional => Joint::Passed,
                Policy::Constant => joining.at_one_speed(&blend),
            };
            if found != Joint::Passed {
                return found;
            }
        }
        self.append(track, blend, demands);
        Joint::Passed
    }

    fn append(&mut self, track: &Track, blend: Blend, demands: &[Demand]) {
        self.blends.push(blend);
        for demand in demands {
            self.ask(Demand { from: self.length + demand.from, ..*demand });
        }
        self.starts.push(self.length);
        self.length += track.length();
        self.bend = self.bend.or(track.bend());
        self.weight += track.weight();
        self.tracks.push(track.clone());
    }

    /// Notes what is asked for from a place on, unless that is what was asked for before.
    fn ask(&mut self, demand: Demand) {
        let same = |last: &Demand| last.power == demand.power && last.speed == demand.speed;
        if !self.demands.last().is_some_and(same) {
            self.is_lit |= demand.power > 0.0;
            self.demands.push(demand);
        }
    }

    /// The range of the parameter [m]: the length of the drawn line, or near it.
    pub(crate) fn length(&self) -> f64 {
        self.length
    }

    /// What is asked for, stretch by stretch, in order.
    pub(crate) fn demands(&self) -> &[Demand] {
        &self.demands
    }

    /// Each stretch with where it ends [m].
    pub(crate) fn stretches(&self) -> impl Iterator<Item = (Demand, f64)> + '_ {
        let ends = self.demands.iter().skip(1).map(|demand| demand.from).chain([self.length]);
        self.demands.iter().copied().zip(ends)
    }

    /// The stretches that `places` [m] have a part in.
    pub(crate) fn stretches_in(
        &self,
        places: &core::ops::Range<f64>,
    ) -> impl Iterator<Item = (Demand, f64)> + '_ {
        let first = self.demands.partition_point(|demand| demand.from <= places.start).max(1) - 1;
        let end = places.end;
        let ends = self.demands.iter().skip(first + 1).map(|demand| demand.from);
        let stretches = self.demands.iter().skip(first).copied().zip(ends.chain([self.length]));
        stretches.take_while(move |(demand, _)| demand.from < end)
    }

    /// Whether anything of it is marked.
    pub(crate) fn is_lit(&self) -> bool {
        self.is_lit
    }

    /// Its stretches of light, each from dark to dark, in order.
    pub(crate) fn lights(&self) -> Vec<Light> {
        let mut lights: Vec<Light> = Vec::new();
        let mut was_lit = false;
        for (demand, to) in self.stretches() {
            let is_lit = demand.power > 0.0;
            match lights.last_mut() {
                Some(last) if is_lit && was_lit => last.to = to,
                _ if is_lit => lights.push(Light { from: demand.from, to, line: demand.line }),
                _ => {}
            }
            was_lit = is_lit;
        }
        lights
    }

    /// Whether it is lit at its end.
    pub(crate) fn ends_lit(&self) -> bool {
        self.demands.last().is_some_and(|demand| demand.power > 0.0)
    }

    /// Length that is marked [m].
    pub(crate) fn lit_length(&self) -> f64 {
        self.stretches()
            .filter(|(demand, _)| demand.power > 0.0)
            .map(|(demand, to)| to - demand.from)
            .sum()
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
        let index = self.track_at(distance);
        let (track, from) = (&self.tracks[index], self.starts[index]);
        track.at((distance - from).min(track.length()))
    }

    /// The number of joints between two places [m].
    pub(crate) fn joints_between(&self, from: f64, to: f64) -> usize {
        self.track_at(to) - self.track_at(from)
    }

    /// The number of the track at `distance` from the start [m].
    fn track_at(&self, distance: f64) -> usize {
        self.starts.partition_point(|start| *start <= distance).max(1) - 1
    }

    /// True points of the drawn line from `from` to `to` [m], no chord farther than `chord_error`
    /// from it [m].
    pub(crate) fn points(&self, from: f64, to: f64, chord_error: f64) -> Vec<[f64; 3]> {
        let mut points = Vec::new();
        self.visit(from, to, chord_error, &mut |point| {
            points.push(point);
            true
        });
        points
    }

    /// Hands the points of [`Self::points`] to `take` as long as it wants more: of a curve that bends much there
    /// may be more than memory should hold.
    pub(crate) fn visit(
        &self,
        from: f64,
        to: f64,
        chord_error: f64,
        take: &mut dyn FnMut([f64; 3]) -> bool,
    ) {
        if !take(self.at(from).point.into()) {
            return;
        }
        let index = self.track_at(from);
        for (track, &start) in self.tracks.iter().zip(&self.starts).skip(index) {
            if start >= to - GAP {
                break;
            }
            if start + track.length() > from + GAP {
                let (first, last) = ((from - start).max(0.0), (to - start).min(track.length()));
                if !track.part(first, last).visit(chord_error, take) {
                    return;
                }
            }
        }
    }

    /// The largest constant speed [m/s]: V²κ ≤ A, V³|p‴| ≤ J, smoothed joints included.
    pub(crate) fn top_speed(&self, limits: &PathLimits) -> f64 {
        let (acceleration, jerk) = (limits.acceleration, limits.jerk);
        let mut speed = self.bend.speed(acceleration, jerk);
        for blend in self.blends.iter().filter(|blend| !blend.is_smooth()) {
            speed = speed.min(blend.sharpest(blend.room).speed(acceleration, jerk));
        }
        // That takes the curves' bend at the joints alone; the smoothed joints are measured and have
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
        for index in 0..self.blends.len() {
            if let Some((_, segments)) = self.smoothed(index, Some(speed), limits) {
                bend =
                    segments.iter().fold(bend, |bend, (part, length)| bend.or(part.bend(*length)));
            }
        }
        bend
    }

    /// The reach and the segments of the joint after track `index`, as a constant `speed` needs it or
    /// as wide as the tolerance lets it be; `None` where the curves go over into each other as they
    /// are.
    fn smoothed(
        &self,
        index: usize,
        speed: Option<f64>,
        limits: &PathLimits,
    ) -> Option<(f64, Vec<(BlendSegment, f64)>)> {
        /// Each lengthening of a joint that turns out too sharp.
        const LONGER: f64 = 1.05;
        let blend = self.blends.get(index).filter(|blend| !blend.is_smooth())?;
        let (before, after) = (&self.tracks[index], &self.tracks[index + 1]);
        let Some(speed) = speed else {
            return Some((blend.room, blend.segments(before, after, blend.room)));
        };
        let (acceleration, jerk) = (limits.acceleration, limits.jerk);
        let shortest = blend.shortest(speed, acceleration, jerk);
        let gentle = blend.gentle(limits.tolerance * GENTLE);
        let mut reach = shortest.max(gentle).min(blend.room);
        loop {
            let segments = blend.segments(before, after, reach);
            let fits = |(part, length): &(BlendSegment, f64)| {
                part.bend(*length).speed(acceleration, jerk) >= speed
            };
            if reach >= blend.room || segments.iter().all(fits) {
                return Some((reach, segments));
            }
            reach = (reach * LONGER).min(blend.room);
        }
    }

    /// The path, its joints smoothed as a constant `speed` needs [m/s], or as wide as they may be.
    pub(crate) fn trace(&self, speed: Option<f64>, limits: &PathLimits) -> Path {
        let mut path = Path::default();
        let mut from = 0.0;
        for (index, track) in self.tracks.iter().enumerate() {
            let Some((reach, segments)) = self.smoothed(index, speed, limits) else {
                path.push_track(track, from, track.length() - from);
                from = 0.0;
                continue;
            };
            path.push_track(track, from, track.length() - reach - from);
            for (segment, length) in segments {
                path.push_segment(segment, length);
            }
            from = reach;
        }
        match &self.turning {
            Some((turning, from)) => path.turning(turning.clone(), *from),
            None => path,
        }
    }

    /// The direction in which it ends.
    pub(crate) fn heading(&self) -> Vector3<f64> {
        self.end().first.normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::arc_length::ByArcLength;
    use crate::geometry::cubic::through;

    #[test]
    fn a_curve_without_a_direction_at_its_start_does_not_go_on_from_the_one_before() {
        let there_and_back = [Vector3::zeros(), Vector3::x() * 0.01, Vector3::zeros()];
        let tracks: Vec<Track> = through(&there_and_back)
            .into_iter()
            .map(|cubic| Track::Cubic(Arc::new(ByArcLength::new(cubic, 8))))
            .collect();
        let demand = Demand { from: 0.0, power: 1.0, speed: None, line: 1 };
        let tolerance = 5e-6;
        let limits =
            PathLimits { speed: 0.1, rapid: 0.2, acceleration: 5.0, jerk: 500.0, tolerance };
        let joining = Joining { rounds: true, tolerance, limits, asked: None, open: limits.speed };
        let mut contour = Contour::new(tracks[0].clone(), &[demand], Policy::Proportional);
        assert_eq!(contour.extend(&tracks[1], &[demand], &joining), Joint::Ends);
    }
}
