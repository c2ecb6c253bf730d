//! Shorter ways by 2-opt and Or-opt moves (J. L. Bentley, "Fast algorithms for geometric traveling
//! salesman problems", 1992; I. Or, 1976), among near neighbours and within the order of containment.

use std::collections::VecDeque;

use kurbo::Point;

use super::nearest::Nearest;

/// Near ends that are tried for each end of a stroke.
const NEIGHBOURS: usize = 8;
/// The longest part of a sequence that Or-opt moves.
const LONGEST_MOVED: usize = 3;
/// The longest part of a sequence that 2-opt turns round.
const LONGEST_TURNED: usize = 5_000;
/// A gain below this [m] is rounding.
const LEAST_GAIN: f64 = 1e-9;
/// Steps for each stroke, a step being one stroke looked at or moved: the bound on the work.
const STEPS: usize = 20_000;

/// A sequence of strokes from a point on.
pub(super) struct Tour<'a> {
    /// Where the first stroke is approached from.
    pub(super) from: Point,
    /// Strokes in their sequence.
    pub(super) sequence: Vec<u32>,
    /// First end of each stroke as it is gone along now, by stroke.
    pub(super) heads: Vec<Point>,
    /// Its other end.
    pub(super) tails: Vec<Point>,
    /// Whether it is gone along from its end to its start.
    pub(super) is_reversed: Vec<bool>,
    /// Whether it may be.
    pub(super) may_reverse: &'a [bool],
    /// Strokes that must come after it.
    pub(super) containers: &'a [Vec<u32>],
}

impl Tour<'_> {
    /// Length of the ways between strokes, that to the first among them [m].
    pub(super) fn travel(&self) -> f64 {
        let mut at = self.from;
        let mut travel = 0.0;
        for stroke in &self.sequence {
            travel += distance(at, self.heads[*stroke as usize]);
            at = self.tails[*stroke as usize];
        }
        travel
    }

    /// Makes it shorter until no move helps or the bound on the work is met.
    pub(super) fn improve(&mut self) {
        let neighbours = self.neighbours();
        let mut search = Search::new(self);
        while let Some(stroke) = search.waiting.pop_front() {
            search.is_waiting[stroke as usize] = false;
            while search.steps > 0 && search.improve_at(stroke, &neighbours[stroke as usize]) {}
        }
    }

    /// Strokes with an end near an end of a stroke, by stroke, nearest first, the stroke itself not.
    fn neighbours(&self) -> Vec<Vec<u32>> {
        let count = self.heads.len();
        let mut tree = Nearest::new(self.heads.iter().chain(&self.tails).copied().collect());
        (0..2 * count).for_each(|end| tree.set(end, true));
        let mut found = Vec::with_capacity(NEIGHBOURS + 1);
        let mut of = |stroke: usize| {
            let mut near = Vec::with_capacity(2 * NEIGHBOURS);
            for end in [self.heads[stroke], self.tails[stroke]] {
                tree.nearest_few(end, NEIGHBOURS, |end| end % count != stroke, &mut found);
                for (_, end) in &found {
                    let other = *end % count as u32;
                    if !near.contains(&other) {
                        near.push(other);
                    }
                }
            }
            near
        };
        (0..count).map(&mut of).collect()
    }
}

/// A change of a sequence: the part `first..=last` turned round where it is or put elsewhere.
#[derive(Clone, Copy)]
struct Move {
    first: usize,
    last: usize,
    /// Put before the stroke at this place of the old sequence; `None`: turned where it is.
    before: Option<usize>,
    turned: bool,
}

struct Search<'t, 'a> {
    tour: &'t mut Tour<'a>,
    places: Vec<usize>,
    waiting: VecDeque<u32>,
    is_waiting: Vec<bool>,
    steps: usize,
}

impl<'t, 'a> Search<'t, 'a> {
    fn new(tour: &'t mut Tour<'a>) -> Self {
        let count = tour.sequence.len();
        let mut places = vec![0; tour.heads.len()];
        for (place, stroke) in tour.sequence.iter().enumerate() {
            places[*stroke as usize] = place;
        }
        let waiting = tour.sequence.iter().copied().collect();
        let is_waiting = vec![true; tour.heads.len()];
        Self { tour, places, waiting, is_waiting, steps: STEPS.saturating_mul(count) }
    }

    /// Makes one move that helps at a stroke; `false` where none does.
    fn improve_at(&mut self, stroke: u32, neighbours: &[u32]) -> bool {
        let place = self.places[stroke as usize];
        for neighbour in neighbours {
            let other = self.places[*neighbour as usize];
            let (low, high) = (place.min(other), place.max(other));
            let turn = |first, last| Move { first, last, before: None, turned: true };
            if self.try_move(turn(low + 1, high)) || self.try_move(turn(low, high - 1)) {
                return true;
            }
            for length in 1..=LONGEST_MOVED {
                for (first, last) in
                    [(place, place + length - 1), (place + 1 - length.min(place + 1), place)]
                {
                    if last - first + 1 != length || (first..=last).contains(&other) {
                        continue;
                    }
                    for before in [other, other + 1] {
                        for turned in [false, true] {
                            let put = Move { first, last, before: Some(before), turned };
                            if self.try_move(put) {
                                return true;
                            }
                        }
                    }
                }
            }
        }
        // The last stroke turned, the first one, or one by itself.
        self.try_move(Move { first: place, last: place, before: None, turned: true })
    }

    fn head(&self, place: usize) -> Point {
        self.tour.heads[self.tour.sequence[place] as usize]
    }

    fn tail(&self, place: usize) -> Point {
        self.tour.tails[self.tour.sequence[place] as usize]
    }

    /// Way from before a place to a point [m].
    fn way_to(&self, place: usize, to: Point) -> f64 {
        distance(if place == 0 { self.tour.from } else { self.tail(place - 1) }, to)
    }

    /// Way from a point to the stroke at a place, none after the last one [m].
    fn way_from(&self, from: Point, place: usize) -> f64 {
        if place < self.tour.sequence.len() { distance(from, self.head(place)) } else { 0.0 }
    }

    /// Makes a move if it shortens the way and breaks no order.
    fn try_move(&mut self, change: Move) -> bool {
        let Move { first, last, before, turned } = change;
        if first > last || last >= self.tour.sequence.len() || last - first >= LONGEST_TURNED {
            return false;
        }
        self.steps = self.steps.saturating_sub(1);
        let (head, tail) = (self.head(first), self.tail(last));
        let (new_head, new_tail) = if turned { (tail, head) } else { (head, tail) };
        let old = self.way_to(first, head) + self.way_from(tail, last + 1);
        let gain = match before {
            None => old - self.way_to(first, new_head) - self.way_from(new_tail, last + 1),
            Some(before) => {
                if (first..=last + 1).contains(&before) {
                    return false;
                }
                let closed = if first == 0 {
                    self.way_from(self.tour.from, last + 1)
                } else {
                    self.way_from(self.tail(first - 1), last + 1)
                };
                let opened = if before == self.tour.sequence.len() {
                    0.0
                } else {
                    self.way_to(before, self.head(before))
                };
                let joined = self.way_to(before, new_head) + self.way_from(new_tail, before);
                old + opened - closed - joined
            }
        };
        if gain <= LEAST_GAIN || !self.is_allowed(change) {
            return false;
        }
        self.apply(change);
        true
    }

    /// Whether strokes may be turned and what lies inside still comes first.
    fn is_allowed(&mut self, change: Move) -> bool {
        let Move { first, last, before, turned } = change;
        let tour = &*self.tour;
        let part = &tour.sequence[first..=last];
        self.steps = self.steps.saturating_sub(part.len());
        if turned && !part.iter().all(|stroke| tour.may_reverse[*stroke as usize]) {
            return false;
        }
        let within = |strokes: &[u32], from: usize, to: usize| {
            strokes.iter().any(|stroke| {
                tour.containers[*stroke as usize]
                    .iter()
                    .any(|outer| (from..=to).contains(&self.places[*outer as usize]))
            })
        };
        // What is turned holds no two strokes of which one lies in the other; what is put later
        // passes nothing around it; what is put earlier passes nothing inside of it.
        if turned && within(part, first, last) {
            return false;
        }
        match before {
            None => true,
            Some(before) if before > last => !within(part, last + 1, before - 1),
            Some(before) => {
                self.steps = self.steps.saturating_sub(first - before);
                !within(&tour.sequence[before..first], first, last)
            }
        }
    }

    fn apply(&mut self, change: Move) {
        let Move { first, last, before, turned } = change;
        let length = last - first + 1;
        let tour = &mut *self.tour;
        if turned {
            tour.sequence[first..=last].reverse();
            for stroke in &tour.sequence[first..=last] {
                let stroke = *stroke as usize;
                (tour.heads[stroke], tour.tails[stroke]) = (tour.tails[stroke], tour.heads[stroke]);
                tour.is_reversed[stroke] ^= true;
            }
        }
        let (low, high) = match before {
            None => (first, last),
            Some(before) if before > last => {
                tour.sequence[first..before].rotate_left(length);
                (first, before - 1)
            }
            Some(before) => {
                tour.sequence[before..=last].rotate_right(length);
                (before, last)
            }
        };
        for place in low..=high {
            self.places[tour.sequence[place] as usize] = place;
        }
        self.steps = self.steps.saturating_sub(high - low + 1);
        // Strokes at the ways that changed.
        let ends = match before {
            None => [low, high, low, high],
            Some(before) if before > last => [low, high, high - length, high - length + 1],
            Some(_) => [low, high, low + length - 1, low + length],
        };
        for end in ends {
            for place in [end.checked_sub(1), Some(end), Some(end + 1)].into_iter().flatten() {
                if let Some(stroke) = self.tour.sequence.get(place)
                    && !core::mem::replace(&mut self.is_waiting[*stroke as usize], true)
                {
                    self.waiting.push_back(*stroke);
                }
            }
        }
    }
}

/// Distance of two points [m]. The square root is exact to the last bit everywhere.
pub(super) fn distance(from: Point, to: Point) -> f64 {
    (to - from).hypot2().sqrt()
}
