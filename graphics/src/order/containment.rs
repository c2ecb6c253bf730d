//! Which closed strokes lie around a stroke.

use core::cmp::Reverse;
use std::collections::BinaryHeap;

use kurbo::{Point, Rect};

use super::Stroke;
use crate::curve::{bounds, signed_area};

/// A point is on a contour, neither inside nor outside, within this distance [m]: somewhat more than
/// the chords of [`Stroke::of_contour`] leave the curve, and far less than any laser's spot.
const ON: f64 = 4e-6;

/// How many points of a stroke are asked whether they lie inside of another.
const PROBES: usize = 8;

/// For each stroke the closed ones around it that no other one around it implies. The relation has no
/// circles: what lies around encloses more area or, of equals, comes later.
pub(super) fn containers(strokes: &[&Stroke]) -> Vec<Vec<u32>> {
    let mut loops: Vec<Loop> = Vec::new();
    let mut loop_of = vec![None; strokes.len()];
    for (index, stroke) in strokes.iter().enumerate() {
        let area = signed_area(&stroke.outline).abs();
        if let (true, Some(bounds)) = (stroke.is_closed(), bounds(&stroke.outline)) {
            loop_of[index] = Some(area);
            loops.push(Loop { stroke: index as u32, area, bounds, slabs: None });
        }
    }
    loops.sort_by(|a, b| a.area.total_cmp(&b.area).then(a.stroke.cmp(&b.stroke)));
    let tree = BoxTree::new(loops.iter().map(|one| one.bounds).collect());

    // From the largest loop down, open strokes last: what is around a container is known before it.
    let mut sequence: Vec<u32> = loops.iter().rev().map(|one| one.stroke).collect();
    sequence.extend((0..strokes.len() as u32).filter(|one| loop_of[*one as usize].is_none()));

    let mut containers: Vec<Vec<u32>> = vec![Vec::new(); strokes.len()];
    let mut implied = vec![u32::MAX; strokes.len()];
    let mut around = Vec::new();
    for inner in sequence {
        let stroke = strokes[inner as usize];
        let Some(rect) = bounds(&stroke.outline) else { continue };
        let probes = probes(stroke);
        tree.around(rect, &mut around);
        // By index in `loops`, so the smallest first; what one that is found implies is dropped at once.
        let mut candidates: BinaryHeap<Reverse<u32>> =
            around.drain(..).map(Reverse).collect::<Vec<_>>().into();
        while let Some(Reverse(candidate)) = candidates.pop() {
            let outer = &mut loops[candidate as usize];
            let is_larger = loop_of[inner as usize].is_none_or(|area| {
                outer.area.total_cmp(&area).then(outer.stroke.cmp(&inner)).is_gt()
            });
            if !is_larger || outer.stroke == inner {
                continue;
            }
            let outline = &strokes[outer.stroke as usize].outline;
            let slabs = outer.slabs.get_or_insert_with(|| Slabs::new(outline, outer.bounds));
            if !contains(outline, slabs, &probes) {
                continue;
            }
            let outer = outer.stroke;
            containers[inner as usize].push(outer);
            let mut open = vec![outer];
            while let Some(one) = open.pop() {
                if core::mem::replace(&mut implied[one as usize], inner) != inner {
                    open.extend(&containers[one as usize]);
                }
            }
            candidates
                .retain(|Reverse(one)| implied[loops[*one as usize].stroke as usize] != inner);
        }
    }
    containers
}

/// A closed stroke.
struct Loop {
    stroke: u32,
    area: f64,
    bounds: Rect,
    /// Made when it is first asked for.
    slabs: Option<Slabs>,
}

/// Corners and middles of edges, evenly along the outline.
fn probes(stroke: &Stroke) -> Vec<Point> {
    let outline = &stroke.outline;
    let count = PROBES.min(2 * outline.len());
    let probe = |number: usize| {
        let edge = number * outline.len() / count;
        let next = if edge + 1 < outline.len() { edge + 1 } else { 0 };
        if number.is_multiple_of(2) || (next == 0 && !stroke.is_closed()) {
            outline[edge]
        } else {
            outline[edge].midpoint(outline[next])
        }
    };
    (0..count).map(probe).collect()
}

/// Whether more of the probes lie inside than outside; those on the outline do not count.
fn contains(outline: &[Point], slabs: &Slabs, probes: &[Point]) -> bool {
    let places = probes.iter().filter_map(|probe| slabs.is_inside(outline, *probe));
    places.map(|is_inside| if is_inside { 1 } else { -1 }).sum::<i32>() > 0
}

/// The edges of a loop by the horizontal slabs that they pass through.
struct Slabs {
    bottom: f64,
    height: f64,
    edges: Vec<Vec<u32>>,
}

impl Slabs {
    fn new(outline: &[Point], bounds: Rect) -> Self {
        let count = outline.len();
        let climbed: f64 =
            (0..count).map(|edge| (outline[edge].y - outline[(edge + 1) % count].y).abs()).sum();
        // As high as an edge is on average: twice as many entries as edges at most.
        let height = (climbed / count as f64).max(bounds.height() / count as f64).max(4.0 * ON);
        let slabs = ((bounds.height() / height).ceil() as usize).clamp(1, count);
        let mut result = Self { bottom: bounds.y0, height, edges: vec![Vec::new(); slabs] };
        for edge in 0..count {
            let (from, to) = (outline[edge].y, outline[(edge + 1) % count].y);
            let (first, last) = (result.slab(from.min(to) - ON), result.slab(from.max(to) + ON));
            (first..=last).for_each(|slab| result.edges[slab].push(edge as u32));
        }
        result
    }

    fn slab(&self, y: f64) -> usize {
        (((y - self.bottom) / self.height).max(0.0) as usize).min(self.edges.len() - 1)
    }

    /// Whether a point is inside by the even–odd rule; `None` on the outline.
    fn is_inside(&self, outline: &[Point], point: Point) -> Option<bool> {
        let mut is_inside = false;
        for edge in &self.edges[self.slab(point.y)] {
            let (from, to) =
                (outline[*edge as usize], outline[(*edge as usize + 1) % outline.len()]);
            if distance(from, to, point) < ON {
                return None;
            }
            if (from.y > point.y) != (to.y > point.y) {
                let x = from.x + (to.x - from.x) * ((point.y - from.y) / (to.y - from.y));
                is_inside ^= x > point.x;
            }
        }
        Some(is_inside)
    }
}

/// Distance of a point from an edge [m].
fn distance(from: Point, to: Point, point: Point) -> f64 {
    let (edge, off) = (to - from, point - from);
    let length = edge.hypot2();
    let t = if length > 0.0 { (edge.dot(off) / length).clamp(0.0, 1.0) } else { 0.0 };
    (off - edge * t).hypot2().sqrt()
}

/// Boxes side by side in a tree of boxes around eight each.
struct BoxTree {
    order: Vec<u32>,
    /// The boxes in that order, then the boxes around eight of them, up to one box around all.
    levels: Vec<Vec<Rect>>,
}

/// Children of a node.
const FAN: usize = 8;

impl BoxTree {
    fn new(boxes: Vec<Rect>) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut open = vec![(0, order.len(), false)];
        while let Some((from, to, by_y)) = open.pop() {
            if to - from <= FAN {
                continue;
            }
            // Halves at whole nodes.
            let middle = ((to - from) / 2).next_multiple_of(FAN);
            let along = |index: &u32| {
                let centre = boxes[*index as usize].center();
                if by_y { centre.y } else { centre.x }
            };
            if middle < to - from {
                order[from..to].select_nth_unstable_by(middle, |a, b| {
                    along(a).total_cmp(&along(b)).then(a.cmp(b))
                });
                open.push((from, from + middle, !by_y));
                open.push((from + middle, to, !by_y));
            }
        }
        let mut levels: Vec<Vec<Rect>> =
            vec![order.iter().map(|index| boxes[*index as usize]).collect()];
        while let Some(last) = levels.last().filter(|last| last.len() > 1) {
            let union = |part: &[Rect]| part.iter().skip(1).fold(part[0], |a, b| a.union(*b));
            let next = last.chunks(FAN).map(union).collect();
            levels.push(next);
        }
        Self { order, levels }
    }

    /// All boxes around a box, in no order.
    fn around(&self, inner: Rect, found: &mut Vec<u32>) {
        found.clear();
        let mut open = vec![(self.levels.len() - 1, 0)];
        while let Some((level, node)) = open.pop() {
            let Some(rect) = self.levels[level].get(node) else { continue };
            if !rect.contains_rect(inner) {
                continue;
            }
            if level == 0 {
                found.push(self.order[node]);
            } else {
                open.extend((0..FAN).map(|child| (level - 1, node * FAN + child)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::samples::{circle, polygon};
    use crate::random::Random;

    fn check(strokes: &[Stroke], expected: &[&[u32]]) {
        let strokes: Vec<&Stroke> = strokes.iter().collect();
        assert_eq!(containers(&strokes), expected);
    }

    fn ring(x: f64, radius: f64) -> Stroke {
        Stroke::of_contour(&circle(Point::new(x, 0.0), radius), 0)
    }

    #[test]
    fn only_the_nearest_loop_around_is_named() {
        check(
            &[ring(0.0, 3.0), ring(0.0, 1.0), ring(0.0, 2.0), ring(9.0, 1.0)],
            &[&[], &[2], &[0], &[]],
        );
    }

    #[test]
    fn a_stroke_within_two_loops_that_cross_is_within_both() {
        check(&[ring(-1.0, 3.0), ring(1.0, 3.0), ring(0.0, 0.5)], &[&[], &[], &[0, 1]]);
    }

    #[test]
    fn a_loop_that_shares_an_edge_from_outside_is_not_inside() {
        let l_shape =
            polygon(&[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]);
        let in_the_corner = polygon(&[(1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0)]);
        let in_the_foot = polygon(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]);
        let of = |contour| Stroke::of_contour(contour, 0);
        check(&[of(&l_shape), of(&in_the_corner), of(&in_the_foot)], &[&[], &[], &[0]]);
    }

    #[test]
    fn the_same_loop_twice_is_not_within_itself() {
        check(&[ring(0.0, 1.0), ring(0.0, 1.0)], &[&[], &[]]);
    }

    #[test]
    fn boxes_around_a_box_are_those_of_a_search_through_all() {
        let mut random = Random::new(2);
        for count in [0, 1, 8, 9, 500] {
            let boxes: Vec<Rect> = (0..count)
                .map(|_| {
                    let (x, y) = (random.unit(), random.unit());
                    Rect::new(x, y, x + random.unit() * 0.5, y + random.unit() * 0.5)
                })
                .collect();
            let tree = BoxTree::new(boxes.clone());
            for _ in 0..100 {
                let (x, y) = (random.unit(), random.unit());
                let inner = Rect::new(x, y, x + 0.05, y + 0.05);
                let mut found = Vec::new();
                tree.around(inner, &mut found);
                found.sort_unstable();
                let among = 0..count as u32;
                let expected: Vec<u32> =
                    among.filter(|one| boxes[*one as usize].contains_rect(inner)).collect();
                assert_eq!(found, expected);
            }
        }
    }
}
