//! The order in which strokes are marked: what lies inside before what lies around it, and little dark
//! travel between them.
//!
//! Groups come one after the other. In each of them a nearest-neighbour sequence is made, which takes a
//! loop only when all inside of it has been taken; then it is made shorter by 2-opt and Or-opt moves among
//! near neighbours that keep that order. The work is bounded by a count of steps and never by a clock: the
//! same strokes give the same order.

mod containment;
mod improve;
mod nearest;

use core::ops::Range;

use kurbo::Point;

use crate::Contour;
use improve::{Tour, distance};
use nearest::Nearest;

/// Farthest that chords of an outline leave its curve [m].
const OUTLINE: f64 = 2e-6;
/// Of a loop with more starts than this, as many evenly chosen ones guide the search; all of them are
/// tried in the end.
const SEARCHED_STARTS: usize = 12;
/// How often a sequence is improved with the starts of its loops chosen anew.
const ROUNDS: usize = 2;

/// Something that is marked in one go.
#[derive(Debug, Clone, PartialEq)]
pub struct Stroke {
    /// Points along it [m], at least one: they tell what lies inside of what.
    pub outline: Vec<Point>,
    /// Where it may be begun.
    pub ends: Ends,
    /// Groups are marked one after the other, the lowest first.
    pub group: usize,
}

/// Where a stroke may be begun.
#[derive(Debug, Clone, PartialEq)]
pub enum Ends {
    /// At an end.
    Open {
        /// Its start [m].
        start: Point,
        /// Its end [m].
        end: Point,
        /// Whether it may be marked from its end to its start.
        may_reverse: bool,
    },
    /// A loop, at any of these points of it [m], at least one.
    Closed(Vec<Point>),
}

/// How the strokes are marked.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrangement {
    /// Each stroke once, in the order of marking.
    pub visits: Vec<Visit>,
    /// Dark travel in the given order and directions, loops from their first start [m].
    pub travel_before: f64,
    /// Dark travel as arranged [m].
    pub travel_after: f64,
}

/// One stroke of an arrangement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Visit {
    /// Index of the stroke.
    pub stroke: usize,
    /// How it is gone along.
    pub entry: Entry,
}

/// How a stroke is gone along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Entry {
    /// An open one from its start.
    Forwards,
    /// An open one from its end.
    Backwards,
    /// A loop from one of its starts, by index.
    At(usize),
}

/// Why strokes are not arranged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum OrderError {
    /// A coordinate is infinite or not a number.
    #[error("stroke {0} (from 0) has a coordinate that is not a finite number")]
    NotFinite(usize),
    /// No outline, or a loop without a start.
    #[error("stroke {0} (from 0) has no point: an outline and a loop's starts need at least one")]
    NoPoint(usize),
    /// More than can be counted.
    #[error("{0} strokes are more than {MOST_STROKES}")]
    TooMany(usize),
}

/// More strokes are not arranged.
pub const MOST_STROKES: usize = 10_000_000;

impl Stroke {
    /// The stroke that marks a contour; a loop may begin with any of its segments, in their order.
    pub fn of_contour(contour: &Contour, group: usize) -> Self {
        let mut outline = contour.flattened(OUTLINE);
        let ends = if contour.is_closed {
            if outline.len() > 1 {
                outline.pop();
            }
            let mut starts: Vec<Point> = contour.pieces().map(|(start, _)| start).collect();
            if starts.is_empty() {
                starts.push(contour.start);
            }
            Ends::Closed(starts)
        } else {
            Ends::Open { start: contour.start, end: contour.end(), may_reverse: true }
        };
        Self { outline, ends, group }
    }

    fn is_closed(&self) -> bool {
        matches!(self.ends, Ends::Closed(_))
    }

    /// Where it begins and ends, gone along in a way [m].
    fn ends_of(&self, entry: Entry) -> (Point, Point) {
        match (&self.ends, entry) {
            (Ends::Open { start, end, .. }, Entry::Backwards) => (*end, *start),
            (Ends::Open { start, end, .. }, _) => (*start, *end),
            (Ends::Closed(starts), Entry::At(index)) => (starts[index], starts[index]),
            (Ends::Closed(starts), _) => (starts[0], starts[0]),
        }
    }

    /// How it is marked as it was given.
    fn as_given(&self) -> Entry {
        if self.is_closed() { Entry::At(0) } else { Entry::Forwards }
    }

    fn check(&self, index: usize) -> Result<(), OrderError> {
        let (starts, more) = match &self.ends {
            Ends::Open { start, end, .. } => (&[*start][..], Some(end)),
            Ends::Closed(starts) => (&starts[..], None),
        };
        if starts.is_empty() || self.outline.is_empty() {
            return Err(OrderError::NoPoint(index));
        }
        let is_finite = self.outline.iter().chain(starts).chain(more).all(|one| one.is_finite());
        if is_finite { Ok(()) } else { Err(OrderError::NotFinite(index)) }
    }
}

impl Entry {
    /// The contour of [`Stroke::of_contour`] as it is gone along.
    pub fn apply(self, contour: &Contour) -> Contour {
        match self {
            Self::Forwards => contour.clone(),
            Self::Backwards => contour.reversed(),
            Self::At(first) => contour.begun_at(first),
        }
    }
}

/// Arranges strokes that are approached from a point [m].
///
/// A stroke inside of a loop of its own group comes before that loop. Loops that cross are not inside of
/// each other.
///
/// # Errors
///
/// Where a stroke has no point or a coordinate is not finite.
pub fn arrange(strokes: &[Stroke], from: Point) -> Result<Arrangement, OrderError> {
    if strokes.len() > MOST_STROKES {
        return Err(OrderError::TooMany(strokes.len()));
    }
    strokes.iter().enumerate().try_for_each(|(index, stroke)| stroke.check(index))?;

    let given = |(stroke, one): (usize, &Stroke)| Visit { stroke, entry: one.as_given() };
    let given: Vec<Visit> = strokes.iter().enumerate().map(given).collect();
    let travel_before = travel(strokes, &given, from);

    let mut indices: Vec<usize> = (0..strokes.len()).collect();
    indices.sort_by_key(|index| (strokes[*index].group, *index));
    let mut visits = Vec::with_capacity(strokes.len());
    let mut at = from;
    for group in indices.chunk_by(|a, b| strokes[*a].group == strokes[*b].group) {
        let members: Vec<&Stroke> = group.iter().map(|index| &strokes[*index]).collect();
        for visit in arrange_group(&members, at) {
            visits.push(Visit { stroke: group[visit.stroke], entry: visit.entry });
            at = members[visit.stroke].ends_of(visit.entry).1;
        }
    }
    let travel_after = travel(strokes, &visits, from);
    Ok(Arrangement { visits, travel_before, travel_after })
}

/// How many closed contours lie around each contour.
pub(crate) fn depths(contours: &[Contour]) -> Vec<usize> {
    let strokes: Vec<Stroke> =
        contours.iter().map(|contour| Stroke::of_contour(contour, 0)).collect();
    let containers = containment::containers(&strokes.iter().collect::<Vec<_>>());
    let mut met = vec![usize::MAX; contours.len()];
    let mut depth = |index: usize| {
        let mut open: Vec<u32> = containers[index].clone();
        let mut depth = 0;
        while let Some(outer) = open.pop() {
            if core::mem::replace(&mut met[outer as usize], index) != index {
                depth += 1;
                open.extend(&containers[outer as usize]);
            }
        }
        depth
    };
    (0..contours.len()).map(&mut depth).collect()
}

/// Dark travel of a sequence from a point on [m].
fn travel(strokes: &[Stroke], visits: &[Visit], from: Point) -> f64 {
    let mut at = from;
    let mut travel = 0.0;
    for visit in visits {
        let (start, end) = strokes[visit.stroke].ends_of(visit.entry);
        travel += distance(at, start);
        at = end;
    }
    travel
}

fn arrange_group(strokes: &[&Stroke], from: Point) -> Vec<Visit> {
    let containers = containment::containers(strokes);
    let mut visits = nearest_first(strokes, &containers, from);
    let may_reverse: Vec<bool> = strokes
        .iter()
        .map(|stroke| !matches!(stroke.ends, Ends::Open { may_reverse: false, .. }))
        .collect();
    for _ in 0..ROUNDS {
        let mut tour = Tour {
            from,
            sequence: visits.iter().map(|visit| visit.stroke as u32).collect(),
            heads: vec![Point::ORIGIN; strokes.len()],
            tails: vec![Point::ORIGIN; strokes.len()],
            is_reversed: vec![false; strokes.len()],
            may_reverse: &may_reverse,
            containers: &containers,
        };
        let mut entries = vec![Entry::Forwards; strokes.len()];
        for visit in &visits {
            let ends = strokes[visit.stroke].ends_of(visit.entry);
            (tour.heads[visit.stroke], tour.tails[visit.stroke]) = ends;
            entries[visit.stroke] = visit.entry;
        }
        let before = tour.travel();
        tour.improve();
        for (stroke, entry) in entries.iter_mut().enumerate() {
            *entry = match *entry {
                Entry::Forwards if tour.is_reversed[stroke] => Entry::Backwards,
                Entry::Backwards if tour.is_reversed[stroke] => Entry::Forwards,
                other => other,
            };
        }
        for (visit, stroke) in visits.iter_mut().zip(&tour.sequence) {
            *visit = Visit { stroke: *stroke as usize, entry: entries[*stroke as usize] };
        }
        let chosen = choose_starts(strokes, &mut visits, from);
        if !chosen && tour.travel() >= before {
            break;
        }
    }
    visits
}

/// Always the nearest stroke whose inside has been taken.
fn nearest_first(strokes: &[&Stroke], containers: &[Vec<u32>], from: Point) -> Vec<Visit> {
    let mut points = Vec::new();
    let mut entries: Vec<Visit> = Vec::new();
    let mut ranges: Vec<Range<usize>> = Vec::with_capacity(strokes.len());
    for (index, stroke) in strokes.iter().enumerate() {
        let first = points.len();
        let mut add = |entry| {
            points.push(stroke.ends_of(entry).0);
            entries.push(Visit { stroke: index, entry });
        };
        match &stroke.ends {
            Ends::Open { may_reverse, .. } => {
                add(Entry::Forwards);
                may_reverse.then(|| add(Entry::Backwards));
            }
            Ends::Closed(starts) => {
                let count = starts.len().min(SEARCHED_STARTS);
                (0..count).for_each(|start| add(Entry::At(start * starts.len() / count)));
            }
        }
        ranges.push(first..points.len());
    }
    let mut tree = Nearest::new(points);
    let mut inside = vec![0_u32; strokes.len()];
    containers.iter().flatten().for_each(|outer| inside[*outer as usize] += 1);
    for (range, inside) in ranges.iter().zip(&inside) {
        if *inside == 0 {
            range.clone().for_each(|point| tree.set(point, true));
        }
    }
    let mut at = from;
    let mut visits = Vec::with_capacity(strokes.len());
    while let Some(point) = tree.nearest(at) {
        let visit = entries[point];
        visits.push(visit);
        at = strokes[visit.stroke].ends_of(visit.entry).1;
        ranges[visit.stroke].clone().for_each(|point| tree.set(point, false));
        for outer in &containers[visit.stroke] {
            let inside = &mut inside[*outer as usize];
            *inside -= 1;
            if *inside == 0 {
                ranges[*outer as usize].clone().for_each(|point| tree.set(point, true));
            }
        }
    }
    visits
}

/// Begins each loop where the ways to it and from it are shortest; whether that changed anything.
fn choose_starts(strokes: &[&Stroke], visits: &mut [Visit], from: Point) -> bool {
    let mut changed = false;
    let mut at = from;
    for place in 0..visits.len() {
        let Visit { stroke, entry } = visits[place];
        if let (Ends::Closed(starts), Entry::At(now)) = (&strokes[stroke].ends, entry) {
            let next = visits.get(place + 1).map(|next| strokes[next.stroke].ends_of(next.entry).0);
            let way = |start: usize| {
                distance(at, starts[start]) + next.map_or(0.0, |next| distance(starts[start], next))
            };
            let best = (0..starts.len()).min_by(|a, b| way(*a).total_cmp(&way(*b)));
            if let Some(best) = best.filter(|best| way(*best) < way(now)) {
                visits[place].entry = Entry::At(best);
                changed = true;
            }
        }
        at = strokes[stroke].ends_of(visits[place].entry).1;
    }
    changed
}

#[cfg(test)]
mod tests;
