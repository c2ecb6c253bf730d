//! Contours in parts: what lies between two places, and a long one piece by piece.

use std::sync::Arc;

use machine::PathLimits;

use super::{Contour, Demand, GAP};
use crate::geometry::blend::Blend;
use crate::geometry::track::Track;
use crate::geometry::turning::Turning;

/// Share of a curve that is not left as a part of its own where a line is divided.
const SLIVER: f64 = 0.1;

impl Contour {
    /// The part between two places, with the parts of the demands; joints as in the whole.
    pub(crate) fn part(&self, from: f64, to: f64, limits: &PathLimits) -> Option<Self> {
        let mut part: Option<Self> = None;
        for (track, &start) in self.tracks.iter().zip(&self.starts).skip(self.track_at(from)) {
            if start >= to {
                break;
            }
            let (first, last) = ((from - start).max(0.0), (to - start).min(track.length()));
            if last - first <= GAP {
                continue;
            }
            let piece = track.part(first, last);
            let demands = self.demands_between(start + first, start + last);
            match &mut part {
                None => part = Some(Self::new(piece, &demands, self.policy)),
                Some(part) => {
                    let (before, after) = (part.end(), piece.at(0.0));
                    let room = part.last().length().min(piece.length()) / 2.0;
                    let blend = Blend::new(&before, &after, room, limits.tolerance, limits);
                    part.append(&piece, blend, &demands);
                }
            }
        }
        // What begins where this does goes on as it does.
        let turning = self.turning_from(from);
        let joint = self.joint.clone().filter(|_| from <= GAP);
        part.map(|part| Self { joint, turning, is_flown: self.is_flown, ..part })
    }

    /// What is left of it from a place on [m], as a path that goes on from no other.
    pub(crate) fn rest_from(&self, place: f64, limits: &PathLimits) -> Option<Self> {
        let rest = self.part(place, self.length, limits)?;
        Some(Self { joint: None, ..rest })
    }

    fn turning_from(&self, place: f64) -> Option<(Arc<Turning>, f64)> {
        self.turning.as_ref().map(|(turning, from)| (turning.clone(), from + place))
    }

    fn demands_between(&self, from: f64, to: f64) -> Vec<Demand> {
        let ends = self.demands.get(1..).unwrap_or_default();
        let first = ends.partition_point(|next| next.from <= from + GAP);
        self.demands[first..]
            .iter()
            .take_while(|demand| demand.from < to - GAP)
            .map(|demand| Demand { from: (demand.from - from).max(0.0), ..*demand })
            .collect()
    }

    /// `cut`, or the end of its curve where that is nearer than a tenth of the curve: a short rest of
    /// one would leave no room to smooth the joint at it, and slow all of its part.
    pub(crate) fn beside_joints(&self, cut: f64) -> f64 {
        let index = self.track_at(cut);
        let (from, length) = (self.starts[index], self.tracks[index].length());
        let (end, near) = (from + length, SLIVER * length);
        match (cut - from < near, end - cut < near) {
            _ if cut >= end => cut,
            (true, _) => from,
            (false, true) => end,
            (false, false) => cut,
        }
    }

    /// How much memory it takes, about, in curves and vertices.
    pub(crate) fn weight(&self) -> usize {
        self.weight
    }

    /// Length of its last curve, within which another part changes it [m].
    pub(crate) fn last_length(&self) -> f64 {
        self.last().length()
    }

    /// Takes its last curve off as the next part, which goes on from this one as the two did together.
    pub(crate) fn split_last(&mut self) -> Option<Self> {
        let joint = self.blends.pop()?;
        let (track, start) = (self.tracks.pop()?, self.starts.pop()?);
        let demands = self.demands_between(start, self.length);
        let turning = self.turning_from(start);
        let is_flown = self.is_flown;
        let new = Self::new(track, &demands, self.policy);
        let next = Self { joint: Some(joint), turning, is_flown, ..new };
        let first = self.demands.partition_point(|demand| demand.from < start - GAP);
        self.demands.truncate(first);
        self.is_lit = self.demands.iter().any(|demand| demand.power > 0.0);
        self.length = start;
        self.weight -= next.weight;
        Some(next)
    }

    /// What is left of it around `place` and beyond [m], with `next` behind it, and how much has been
    /// left out before [m]. From the curve before `place` on it is the same path.
    pub(crate) fn followed_by(&self, place: f64, next: &Self) -> (Self, f64) {
        let first = self.track_at(place).saturating_sub(1);
        let left_out = self.starts[first];
        let mut whole = Self {
            tracks: self.tracks[first..].to_vec(),
            starts: self.starts[first..].iter().map(|start| start - left_out).collect(),
            blends: self.blends[first..].to_vec(),
            joint: None,
            demands: self.demands_between(left_out, self.length),
            length: self.length - left_out,
            policy: self.policy,
            line: self.line,
            bend: self.bend,
            weight: self.tracks[first..].iter().map(Track::weight).sum(),
            is_lit: self.is_lit,
            is_flown: self.is_flown,
            turning: self.turning_from(left_out),
        };
        for (index, track) in next.tracks.iter().enumerate() {
            let blend = match index.checked_sub(1) {
                Some(before) => next.blends.get(before),
                None => next.joint.as_ref(),
            };
            let Some(blend) = blend else { break };
            let end = next.starts.get(index + 1).copied().unwrap_or(next.length);
            whole.append(track, blend.clone(), &next.demands_within(next.starts[index], end));
        }
        (whole, left_out)
    }

    /// The demands that begin between two places, and at the start of the contour what is asked for
    /// there.
    fn demands_within(&self, from: f64, to: f64) -> Vec<Demand> {
        let first = self.demands.partition_point(|demand| demand.from < from);
        self.demands[first..]
            .iter()
            .take_while(|demand| demand.from < to)
            .map(|demand| Demand { from: demand.from - from, ..*demand })
            .collect()
    }
}
