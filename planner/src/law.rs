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
    /// Largest speed that leaves room for a ramp [m/s].
    pub(crate) speed: f64,
    /// Largest speed where there is no ramp [m/s], at least `speed`.
    pub(crate) steady: f64,
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
    steady: f64,
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
        let plateaus = raised(plateaus, top, ends);
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

    /// The motion along the path at `time` since the start [s]; at rest at the start where the stroke
    /// has no length.
    pub fn at(&self, time: f64) -> Motion {
        let after = self.phases.partition_point(|phase| phase.start <= time);
        let phase = self.phases.get(after.max(1) - 1);
        phase.map_or_else(Motion::default, |phase| phase.at(time - phase.start))
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

/// Lets plateaus between faster ones go as fast as the axes can without a ramp: the ramps lie on the
/// faster ones' ground. One that comes up to a neighbour becomes a wider one with it, if that lies
/// between faster ones again.
fn raised(mut plateaus: Vec<Plateau>, top: f64, ends: [f64; 2]) -> Vec<Plateau> {
    loop {
        let mut rises = false;
        for index in 0..plateaus.len() {
            let speed = plateaus[index].speed;
            let before = index.checked_sub(1).map_or(ends[0], |index| plateaus[index].speed);
            let after = plateaus.get(index + 1).map_or(ends[1], |after| after.speed);
            let most = plateaus[index].steady.min(before).min(after).min(top);
            if most <= speed {
                continue;
            }
            plateaus[index].speed = most;
            // A shorter ramp at a higher speed may need more room.
            let beside = [index.wrapping_sub(1), index + 1];
            if beside.into_iter().any(|index| lacks_room(&plateaus, index).is_some()) {
                plateaus[index].speed = speed;
            } else {
                rises = true;
            }
        }
        let count = plateaus.len();
        plateaus = widened(&plateaus);
        if !rises && plateaus.len() == count {
            return plateaus;
        }
    }
}

/// Neighbours of the same speed become one where both beside them are faster.
fn widened(plateaus: &[Plateau]) -> Vec<Plateau> {
    let mut wider: Vec<Plateau> = Vec::with_capacity(plateaus.len());
    let mut rest = plateaus;
    while let Some(first) = rest.first() {
        let same = rest.iter().take_while(|other| other.speed == first.speed).count();
        let slower = |other: Option<&Plateau>| other.is_some_and(|o| o.speed < first.speed);
        let (group, left) = rest.split_at(same);
        if slower(wider.last()) || slower(left.first()) {
            wider.extend_from_slice(group);
        } else {
            wider.extend(merged(group.to_vec()));
        }
        rest = left;
    }
    wider
}

/// Cells of the same level as plateaus.
fn plateaus(cells: &[Cell], top: f64, ends: [f64; 2]) -> Vec<Plateau> {
    let last = cells.len().saturating_sub(1);
    let mut from = 0.0;
    let mut found = Vec::with_capacity(cells.len());
    for (index, cell) in cells.iter().enumerate() {
        let first = if index == 0 { ends[0] } else { f64::INFINITY };
        let end = first.min(if index == last { ends[1] } else { f64::INFINITY });
        let (most, steady) = (cell.speed.min(end), cell.steady.min(end));
        let speed = if most >= top {
            top
        } else {
            let level = (signals::math::ln(most / top) / signals::math::ln(LEVEL)).ceil();
            top * signals::math::exp(level * signals::math::ln(LEVEL))
        };
        found.push(Plateau { from, to: cell.end, speed, steady, ramp: cell.ramp });
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
                last.steady = last.steady.min(plateau.steady);
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
    (0..plateaus.len()).find_map(|index| Some((index, lacks_room(plateaus, index)?)))
}

/// Whether the plateau `index` has no room for its ramps: then the speed of the faster of its slower
/// neighbours [m/s].
fn lacks_room(plateaus: &[Plateau], index: usize) -> Option<f64> {
    let plateau = plateaus.get(index)?;
    let before = index.checked_sub(1).map(|index| plateaus[index]);
    let after = plateaus.get(index + 1).copied();
    let slower = |other: &Plateau| other.speed < plateau.speed;
    let slower = [before, after].map(|other| other.filter(slower));
    let needed: f64 =
        slower.iter().flatten().map(|other| way(&ramp_between(other, plateau), other.speed)).sum();
    (needed > plateau.to - plateau.from)
        .then(|| slower.iter().flatten().map(|other| other.speed).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::logarithmic;
    use signals::random::SplitMix64;

    const RAMP: [f64; 2] = [2.0, 100.0];

    fn cell(end: f64, speed: f64) -> Cell {
        Cell { end, speed, steady: speed, ramp: RAMP }
    }

    /// The law looked at in small steps: time, motion.
    fn looks(law: &SpeedLaw) -> Vec<(f64, Motion)> {
        let count = 4000;
        let at = |index: i32| law.duration() * f64::from(index) / f64::from(count);
        (0..=count).map(|index| (at(index), law.at(at(index)))).collect()
    }

    /// That speed and place go on without a jump, forwards, within `cells`, from end to end.
    fn check(law: &SpeedLaw, cells: &[Cell], top: f64, ends: [f64; 2], case: &str) {
        let length = cells.last().map_or(0.0, |cell| cell.end);
        let looks = looks(law);
        for (_, now) in &looks {
            // On the edge between two cells rounding decides which one it is.
            let fits = |place: f64| {
                let here = cells.iter().find(|cell| place <= cell.end);
                let most = here.map_or(f64::INFINITY, |cell| cell.steady).min(top);
                now.velocity <= most * (1.0 + 1e-9)
            };
            assert!(
                now.velocity > 0.0 && (fits(now.position - 1e-9) || fits(now.position + 1e-9)),
                "{case}: {} m/s at {} m",
                now.velocity,
                now.position
            );
            assert!(now.acceleration.abs() <= RAMP[0] * (1.0 + 1e-9), "{case}");
            assert!(now.jerk.abs() <= RAMP[1] * (1.0 + 1e-9), "{case}");
        }
        for pair in looks.windows(2) {
            let step = pair[1].0 - pair[0].0;
            let moved = pair[1].1.position - pair[0].1.position;
            let mean = (pair[1].1.velocity + pair[0].1.velocity) / 2.0;
            let off = (moved - mean * step).abs();
            // The trapezoid's error, J·h³/12, and more where the jerk steps inside.
            assert!(off <= RAMP[1] * step * step * step + 1e-13, "{case}: place jumps by {off}");
            let change = pair[1].1.velocity - pair[0].1.velocity;
            assert!(change.abs() <= RAMP[0] * step + 1e-12, "{case}: speed jumps by {change}");
        }
        let last = law.at(law.duration());
        assert!((last.position - length).abs() < 1e-9 * length.max(1e-3), "{case}: {last:?}");
        assert!(law.first() <= ends[0] * (1.0 + 1e-12) && law.last() <= ends[1] * (1.0 + 1e-12));
    }

    #[test]
    fn one_speed_everywhere_is_kept() {
        let cells = [cell(0.01, 0.2), cell(0.03, 0.3)];
        let law = SpeedLaw::below(&cells, 0.1, [0.1, 0.1]);
        assert_eq!((law.first(), law.last()), (0.1, 0.1));
        assert!((law.duration() - 0.3).abs() < 1e-12);
        assert_eq!(law.slowest().0, 0.1);
        check(&law, &cells, 0.1, [0.1; 2], "even");
    }

    #[test]
    fn a_slow_place_is_passed_at_its_steady_speed_and_left_again() {
        let slow = Cell { steady: 0.019, ..cell(0.055, 0.0101) };
        let cells = [cell(0.05, 0.2), slow, cell(0.1, 0.2)];
        let law = SpeedLaw::below(&cells, 0.1, [0.1; 2]);
        check(&law, &cells, 0.1, [0.1; 2], "slow place");
        let (speed, at) = law.slowest();
        assert!((speed - 0.019).abs() < 1e-12 && (0.05..=0.055).contains(&at), "{speed} {at}");
        assert_eq!((law.first(), law.last()), (0.1, 0.1));
        // Slow only as long as it must be: 5 mm at 19 mm/s, and a ramp of 81 mm/s on either side.
        let ramp = Ramp::to_speed(0.081, RAMP[0], RAMP[1]);
        let ramps = 2.0 * ramp.duration();
        let even = (0.095 - 2.0 * way(&ramp, 0.019)) / 0.1;
        assert!((law.duration() - (0.005 / 0.019 + ramps + even)).abs() < 1e-9);
    }

    #[test]
    fn a_wide_slow_place_rises_as_one() {
        // The middle could be as fast as its neighbours with ramps, and all three faster without.
        let inner = Cell { steady: 0.03, ..cell(0.052, 0.012) };
        let outer = |end: f64| Cell { steady: 0.04, ..cell(end, 0.02) };
        let cells = [cell(0.05, 0.2), outer(0.051), inner, outer(0.053), cell(0.1, 0.2)];
        let law = SpeedLaw::below(&cells, 0.1, [0.1; 2]);
        check(&law, &cells, 0.1, [0.1; 2], "wide slow place");
        assert!((law.slowest().0 - 0.03).abs() < 1e-12, "{:?}", law.slowest());
    }

    #[test]
    fn a_rise_without_room_is_not_made() {
        // A hundredth of a millimetre between two slow places is no room to speed up in.
        let cells = [cell(0.01, 0.01), cell(0.010_01, 0.2), cell(0.02, 0.01)];
        let law = SpeedLaw::below(&cells, 0.1, [0.1; 2]);
        check(&law, &cells, 0.1, [0.1; 2], "no room");
        assert!((law.first() - law.slowest().0).abs() < 1e-15);
        assert!((law.duration() - 0.02 / law.first()).abs() < 1e-9);
    }

    #[test]
    fn the_ends_are_no_faster_than_the_ways_in_and_out() {
        let cells: Vec<Cell> = (1..=50).map(|index| cell(f64::from(index) * 1e-3, 0.3)).collect();
        let law = SpeedLaw::below(&cells, 0.1, [0.02, 0.03]);
        check(&law, &cells, 0.1, [0.02, 0.03], "ends");
        assert!((law.first() - 0.02).abs() < 1e-12 && (law.last() - 0.03).abs() < 1e-12);
        let most = looks(&law).iter().map(|(_, now)| now.velocity).fold(0.0, f64::max);
        assert!((most - 0.1).abs() < 1e-12, "{most}");
    }

    #[test]
    fn random_laws_stay_below_their_cells_and_times_turn_back_into_places() {
        let mut random = SplitMix64::new(5);
        for trial in 0..200 {
            let mut end = 0.0;
            let cells: Vec<Cell> = (0..40)
                .map(|_| {
                    end += logarithmic(&mut random, 1e-5, 5e-3);
                    let speed = logarithmic(&mut random, 2e-3, 0.3);
                    Cell { steady: speed * logarithmic(&mut random, 1.0, 2.0), ..cell(end, speed) }
                })
                .collect();
            let ends = [logarithmic(&mut random, 5e-3, 0.2), logarithmic(&mut random, 5e-3, 0.2)];
            let top = 0.15;
            let law = SpeedLaw::below(&cells, top, ends);
            check(&law, &cells, top, ends, &format!("trial {trial}"));
            for share in [0.0, 0.1, 0.37, 0.5, 0.93, 1.0] {
                let place = law.at(law.duration() * share).position;
                let back = law.time_at(place);
                assert!((law.at(back).position - place).abs() < 1e-12, "trial {trial}");
            }
            let instants = law.instants(top);
            assert!(instants.is_sorted() && instants[0] == 0.0, "trial {trial}");
        }
    }
}
