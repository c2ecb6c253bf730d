//! Paths in the plane, thinned to a bounded number of points.

use messages::math;

/// A point of a path, seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutlinePoint {
    /// Where the tool was [m].
    pub tool: [f64; 2],
    /// Tool minus plan [m].
    pub deviation: [f64; 2],
}

/// Several paths, each a run of points.
#[derive(Debug, Clone)]
pub struct Outline {
    paths: Vec<Vec<OutlinePoint>>,
    open: bool,
    held: Option<OutlinePoint>,
    spacing: f64,
    count: usize,
}

impl Default for Outline {
    fn default() -> Self {
        Self { paths: Vec::new(), open: false, held: None, spacing: SPACING, count: 0 }
    }
}

/// Distance of points kept at first [m].
const SPACING: f64 = 2e-5;

impl Outline {
    /// The most points kept.
    pub const CAPACITY: usize = 40_000;

    /// Appends a point to the path being drawn, or begins one.
    pub fn add(&mut self, point: OutlinePoint) {
        if !self.open {
            self.open = true;
            self.paths.push(Vec::new());
        }
        let spacing = self.spacing;
        if let Some(path) = self.paths.last_mut() {
            if path.last().is_some_and(|last| apart(last, &point) < spacing) {
                self.held = Some(point);
                return;
            }
            path.push(point);
            self.held = None;
            self.count += 1;
        }
        if self.count > Self::CAPACITY {
            self.thin();
        }
    }

    /// Ends the path being drawn, at the last point added.
    pub fn end(&mut self) {
        if let (Some(point), Some(path)) = (self.held.take(), self.paths.last_mut()) {
            path.push(point);
            self.count += 1;
        }
        self.open = false;
    }

    /// The paths drawn.
    pub fn paths(&self) -> &[Vec<OutlinePoint>] {
        &self.paths
    }

    /// Doubles the spacing; of the paths that are shorter, every second one goes.
    fn thin(&mut self) {
        self.spacing *= 2.0;
        let spacing = self.spacing;
        let mut short = 0_usize;
        let open = self.paths.len().saturating_sub(1);
        let paths = std::mem::take(&mut self.paths);
        for (index, path) in paths.into_iter().enumerate() {
            let thinned = thinned(&path, spacing);
            if thinned.len() <= 2 && index != open {
                short += 1;
                if short.is_multiple_of(2) {
                    continue;
                }
            }
            self.paths.push(thinned);
        }
        self.count = self.paths.iter().map(Vec::len).sum();
    }
}

/// The path with its inner points at least `spacing` apart, both ends kept.
fn thinned(path: &[OutlinePoint], spacing: f64) -> Vec<OutlinePoint> {
    let mut kept: Vec<OutlinePoint> = Vec::with_capacity(path.len() / 2 + 2);
    for (index, point) in path.iter().enumerate() {
        let far = kept.last().is_none_or(|last| apart(last, point) >= spacing);
        if far || index + 1 == path.len() {
            kept.push(*point);
        }
    }
    kept
}

fn apart(a: &OutlinePoint, b: &OutlinePoint) -> f64 {
    math::hypot(b.tool[0] - a.tool[0], b.tool[1] - a.tool[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64) -> OutlinePoint {
        OutlinePoint { tool: [x, 0.0], deviation: [0.0; 2] }
    }

    #[test]
    fn a_path_keeps_its_ends() {
        let mut outline = Outline::default();
        (0..=1000).for_each(|index| outline.add(point(f64::from(index) * 1e-6)));
        outline.end();
        outline.add(point(5.0));
        outline.end();
        let paths = outline.paths();
        assert_eq!(paths.len(), 2);
        assert_eq!((paths[0][0], paths[0].last().copied()), (point(0.0), Some(point(1e-3))));
        assert!((48..=52).contains(&paths[0].len()), "{}", paths[0].len());
    }

    #[test]
    fn memory_is_bounded() {
        let mut outline = Outline::default();
        for index in 0..400_000 {
            outline.add(point(f64::from(index) * 1e-4));
            if index % 7 == 6 {
                outline.end();
            }
        }
        outline.end();
        let count: usize = outline.paths().iter().map(Vec::len).sum();
        assert!(count <= Outline::CAPACITY + 1, "{count}");
        let last = outline.paths().last().and_then(|path| path.last()).map(|point| point.tool[0]);
        assert_eq!(last, Some(399_999.0 * 1e-4));
    }
}
