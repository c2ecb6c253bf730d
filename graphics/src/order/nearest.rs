//! The nearest of many points that come and go: a kd tree over all of them, with counts of those present
//! in every node (J. L. Bentley, "K-d trees for semidynamic point sets", 1990).

use kurbo::{Point, Rect};

/// Points in a leaf.
const LEAF: usize = 8;

/// A node: its points are `from..to` of the tree's order.
struct Node {
    bounds: Rect,
    from: usize,
    to: usize,
    present: usize,
    /// First of two children that lie side by side; 0 for a leaf.
    children: usize,
    parent: usize,
}

/// Points, each present or not; all absent at first.
pub(super) struct Nearest {
    points: Vec<Point>,
    present: Vec<bool>,
    order: Vec<u32>,
    leaf_of: Vec<u32>,
    nodes: Vec<Node>,
}

impl Nearest {
    /// Over points whose coordinates are finite.
    pub(super) fn new(points: Vec<Point>) -> Self {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let mut nodes = vec![Node {
            bounds: Rect::ZERO,
            from: 0,
            to: points.len(),
            present: 0,
            children: 0,
            parent: 0,
        }];
        let mut leaf_of = vec![0; points.len()];
        let mut next = 0;
        while next < nodes.len() {
            let (from, to) = (nodes[next].from, nodes[next].to);
            let part = &mut order[from..to];
            let bounds = around(&points, part);
            nodes[next].bounds = bounds;
            if part.len() <= LEAF {
                part.iter().for_each(|point| leaf_of[*point as usize] = next as u32);
            } else {
                let middle = part.len() / 2;
                let is_wide = bounds.width() >= bounds.height();
                let along = |point: &u32| {
                    let point = points[*point as usize];
                    if is_wide { point.x } else { point.y }
                };
                part.select_nth_unstable_by(middle, |a, b| {
                    along(a).total_cmp(&along(b)).then(a.cmp(b))
                });
                nodes[next].children = nodes.len();
                for (from, to) in [(from, from + middle), (from + middle, to)] {
                    let node = Node { bounds, from, to, present: 0, children: 0, parent: next };
                    nodes.push(node);
                }
            }
            next += 1;
        }
        Self { present: vec![false; points.len()], points, order, leaf_of, nodes }
    }

    /// Makes a point present or absent.
    pub(super) fn set(&mut self, point: usize, present: bool) {
        if self.present[point] == present {
            return;
        }
        self.present[point] = present;
        let mut node = self.leaf_of[point] as usize;
        loop {
            let count = &mut self.nodes[node].present;
            *count = if present { *count + 1 } else { *count - 1 };
            if node == 0 {
                return;
            }
            node = self.nodes[node].parent;
        }
    }

    /// A nearest present point; `None` where none is present.
    pub(super) fn nearest(&self, to: Point) -> Option<usize> {
        let mut found = Vec::with_capacity(2);
        self.nearest_few(to, 1, |_| true, &mut found);
        found.first().map(|(_, point)| *point as usize)
    }

    /// The `count` nearest present points that are wanted, nearest first, with their squared distances [m²].
    pub(super) fn nearest_few(
        &self,
        to: Point,
        count: usize,
        wanted: impl Fn(usize) -> bool,
        found: &mut Vec<(f64, u32)>,
    ) {
        found.clear();
        let mut open = vec![(0.0, 0_usize)];
        while let Some((distance, index)) = open.pop() {
            let node = &self.nodes[index];
            if node.present == 0 || (found.len() == count && distance >= found[count - 1].0) {
                continue;
            }
            if node.children == 0 {
                for point in &self.order[node.from..node.to] {
                    let at = *point as usize;
                    if !self.present[at] || !wanted(at) {
                        continue;
                    }
                    let entry = ((self.points[at] - to).hypot2(), *point);
                    let place = found.partition_point(|one| one.0 <= entry.0);
                    if place < count {
                        found.insert(place, entry);
                        found.truncate(count);
                    }
                }
            } else {
                let child = |index: usize| (outside(self.nodes[index].bounds, to), index);
                let (one, other) = (child(node.children), child(node.children + 1));
                let (near, far) = if one.0 <= other.0 { (one, other) } else { (other, one) };
                open.push(far);
                open.push(near);
            }
        }
    }
}

/// The smallest rectangle around some of the points.
fn around(points: &[Point], part: &[u32]) -> Rect {
    let mut part = part.iter().map(|point| points[*point as usize]);
    let Some(first) = part.next() else { return Rect::ZERO };
    part.fold(Rect::from_points(first, first), |rect, point| rect.union_pt(point))
}

/// Squared distance of a point from a rectangle [m²].
fn outside(rect: Rect, point: Point) -> f64 {
    let x = (rect.x0 - point.x).max(point.x - rect.x1).max(0.0);
    let y = (rect.y0 - point.y).max(point.y - rect.y1).max(0.0);
    x * x + y * y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn the_nearest_is_that_of_a_search_through_all() {
        let mut random = Random::new(1);
        for count in [0, 1, 7, 9, 200] {
            let points: Vec<Point> =
                (0..count).map(|_| Point::new(random.unit().round(), random.unit())).collect();
            let mut tree = Nearest::new(points.clone());
            let mut present = vec![false; count];
            for _ in 0..400 {
                let to = Point::new(random.unit(), random.unit());
                let away = |point: usize| (points[point] - to).hypot2();
                let among = (0..count).filter(|point| present[*point]).map(away);
                assert_eq!(tree.nearest(to).map(away), among.min_by(f64::total_cmp));
                if count > 0 {
                    let changed = random.below(count);
                    present[changed] = !present[changed];
                    tree.set(changed, present[changed]);
                }
            }
        }
    }
}
