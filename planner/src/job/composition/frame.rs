//! The polygon that shows where a job lies.

use graphics::Contour;
use kurbo::{Point, Rect};

use super::tables::FrameShape;

/// How far the hull's corners may lie inside of a curve [m].
const CHORD: f64 = 1e-5;

/// The frame around all that is drawn, its first corner last again; empty where nothing is.
pub(super) fn around<'a>(
    shape: FrameShape,
    contours: impl Iterator<Item = &'a Contour>,
    images: impl Iterator<Item = Rect>,
) -> Vec<Point> {
    let corners_of = |rect: Rect| {
        let Rect { x0, y0, x1, y1 } = rect;
        [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(Point::from)
    };
    let mut corners = match shape {
        FrameShape::Rectangle => {
            let bounds = contours.map(Contour::bounds).chain(images);
            let all = bounds.reduce(|one, other| one.union(other));
            all.map(corners_of).into_iter().flatten().collect()
        }
        FrameShape::Hull => {
            let points = contours.flat_map(|contour| contour.flattened(CHORD));
            hull(points.chain(images.flat_map(corners_of)).collect())
        }
    };
    corners.extend(corners.first().copied());
    corners
}

/// The convex hull of points, counterclockwise, by Andrew's monotone chain.
fn hull(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_by(|one, other| one.x.total_cmp(&other.x).then(one.y.total_cmp(&other.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut corners = chain(points.iter());
    corners.extend(chain(points.iter().rev()));
    corners
}

/// One side of the hull, without its last point.
fn chain<'a>(points: impl Iterator<Item = &'a Point>) -> Vec<Point> {
    let mut side: Vec<Point> = Vec::new();
    for point in points {
        while let [.., before, last] = side.as_slice()
            && (*last - *before).cross(*point - *last) <= 0.0
        {
            side.pop();
        }
        side.push(*point);
    }
    side.pop();
    side
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hull_has_the_outermost_points_alone() {
        let points =
            [(0.0, 0.0), (2.0, 0.0), (1.0, 0.0), (1.0, 0.5), (2.0, 2.0), (0.0, 2.0), (0.0, 0.0)];
        let found = hull(points.into_iter().map(Point::from).collect());
        let right = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(Point::from);
        assert_eq!(found, right);
        let line = [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)].map(Point::from);
        assert_eq!(hull(line.to_vec()), [line[0], line[2]]);
        assert!(hull(Vec::new()).is_empty());
    }
}
