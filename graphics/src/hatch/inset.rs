//! Areas made smaller by a distance from their edge, and rings along the edge.
//!
//! Here edges are polygons within 1e-6 m of the curves: what is left of an area whose contours cross, cover
//! each other or merge is decided by booleans of polygons.

use i_overlay::core::fill_rule::FillRule as Rule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::simplify::SimplifyShape;
use i_overlay::float::single::SingleFloatOverlay;
use i_overlay::mesh::float::outline::offset::OutlineOffset;
use i_overlay::mesh::float::style::{LineJoin, OutlineStyle};
use kurbo::Point;

use super::{Area, HatchError, MOST_LINES, MOST_ROWS, check_areas, check_setting};
use crate::{Contour, FillRule, Segment};

/// Farthest that chords leave a curve [m].
const TOLERANCE: f64 = 5e-7;
/// Chords of the arcs around inner corners, as angles [rad]: off by 1.3e-4 of the distance.
const STEP: f64 = 0.032;

/// Farther from the origin than this [m] the grid that the booleans are made on would be too coarse.
const FARTHEST: f64 = 1e4;

/// Shapes of the library: each of its outer contour, counterclockwise, and its holes, clockwise.
type Shapes = Vec<Vec<Vec<[f64; 2]>>>;

/// What is left of areas at least `distance` [m] from their edge: closed contours, outer ones
/// counterclockwise and holes clockwise, to be filled by the non-zero rule.
///
/// # Errors
///
/// Where the distance is negative, or a coordinate is not finite or too far from the origin.
pub fn inset(areas: &[Area<'_>], distance: f64) -> Result<Vec<Contour>, HatchError> {
    let is_right = (0.0..=FARTHEST).contains(&distance);
    check_setting("inset", distance, is_right, "from 0 m to 10000 m")?;
    Ok(contours(shrunk(&region(areas)?, distance)))
}

/// Fills areas with rings along their edge: the first lies half a spacing [m] inside, each further one a
/// spacing inside of that, the outermost first.
///
/// # Errors
///
/// Where the spacing is not positive, a coordinate is not finite or too far from the origin, or the rings are
/// too many.
pub fn rings(areas: &[Area<'_>], spacing: f64) -> Result<Vec<Contour>, HatchError> {
    let is_right = spacing > 0.0 && spacing <= FARTHEST;
    check_setting("spacing", spacing, is_right, "more than 0 m and at most 10000 m")?;
    let region = region(areas)?;
    let heights = || region.iter().flatten().flatten().map(|[_, y]| *y);
    let height =
        heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min);
    let rows = height / spacing;
    if rows.is_nan() || rows > MOST_ROWS as f64 {
        return Err(HatchError::TooManyRows { spacing, height, rows });
    }
    let mut rings = Vec::new();
    // Each from the edge itself: errors do not add up from ring to ring.
    for number in 0..MOST_ROWS {
        let ring = contours(shrunk(&region, (number as f64 + 0.5) * spacing));
        if ring.is_empty() {
            break;
        }
        if rings.len() + ring.len() > MOST_LINES {
            return Err(HatchError::TooManyLines);
        }
        rings.extend(ring);
    }
    Ok(rings)
}

/// What is filled, without overlaps.
fn region(areas: &[Area<'_>]) -> Result<Shapes, HatchError> {
    check_areas(areas)?;
    let mut region = Shapes::new();
    for (index, area) in areas.iter().enumerate() {
        let is_near = |contour: &Contour| {
            let rect = contour.bounds();
            [rect.x0, rect.y0, rect.x1, rect.y1].iter().all(|at| at.abs() <= FARTHEST)
        };
        if let Some(contour) = area.contours.iter().position(|contour| !is_near(contour)) {
            return Err(HatchError::TooFar { area: index, contour, farthest: FARTHEST });
        }
        let outlines = area.contours.iter().filter(|contour| !contour.segments.is_empty());
        let outlines: Vec<Vec<[f64; 2]>> = outlines
            .map(|contour| contour.flattened(TOLERANCE).iter().map(|at| [at.x, at.y]).collect())
            .collect();
        let rule = match area.rule {
            FillRule::NonZero => Rule::NonZero,
            FillRule::EvenOdd => Rule::EvenOdd,
        };
        let area_shapes = outlines.simplify_shape_as::<i64>(rule);
        let overlay = match (area.is_dark, region.is_empty()) {
            (true, true) => {
                region = area_shapes;
                continue;
            }
            (true, false) => OverlayRule::Union,
            (false, _) => OverlayRule::Difference,
        };
        region = region.overlay_as::<i64>(&area_shapes, overlay, Rule::NonZero);
    }
    Ok(region)
}

fn shrunk(region: &Shapes, distance: f64) -> Shapes {
    if distance == 0.0 {
        return region.clone();
    }
    let style = OutlineStyle::new(-distance).line_join(LineJoin::Round(STEP));
    region.outline_as::<i64>(&style)
}

fn contours(shapes: Shapes) -> Vec<Contour> {
    let contour = |points: Vec<[f64; 2]>| {
        let start = Point::from((points.first()?[0], points.first()?[1]));
        let others = points.iter().skip(1).chain(points.first());
        let segments = others.map(|[x, y]| Segment::Line(Point::new(*x, *y))).collect();
        Some(Contour { start, segments, is_closed: true })
    };
    shapes.into_iter().flatten().filter_map(contour).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::samples::{circle, polygon};
    use crate::curve::signed_area;
    use crate::hatch::{Hatch, hatch};
    use messages::math;

    fn dark(contours: &[Contour]) -> Area<'_> {
        Area { contours, rule: FillRule::EvenOdd, is_dark: true }
    }

    fn area(contours: &[Contour]) -> f64 {
        contours.iter().map(|contour| signed_area(&contour.flattened(1e-9))).sum()
    }

    fn square(low: f64, high: f64) -> Contour {
        polygon(&[(low, low), (high, low), (high, high), (low, high)])
    }

    #[test]
    fn a_frame_gets_thinner_on_both_sides() {
        let frame = [square(0.0, 0.010), square(0.004, 0.006)];
        let left = inset(&[dark(&frame)], 0.001).expect("valid areas");
        assert_eq!(left.len(), 2);
        // 8 mm square less a hole of 4 mm with corners of 1 mm radius.
        let expected = 64.0 - (16.0 - (4.0 - math::TURN / 2.0));
        assert!((area(&left) * 1e6 - expected).abs() < 1e-3, "{}", area(&left) * 1e6);
        assert_eq!(inset(&[dark(&frame)], 0.003), Ok(Vec::new()));
    }

    #[test]
    fn areas_that_overlap_have_one_edge() {
        let (one, other) = ([square(0.0, 0.002)], [square(0.001, 0.003).reversed()]);
        let left = inset(&[dark(&one), dark(&other)], 0.0).expect("valid areas");
        assert_eq!(left.len(), 1);
        assert!((area(&left) - 7e-6).abs() < 1e-12);
        let light = Area { is_dark: false, ..dark(&other) };
        let left = inset(&[dark(&one), light], 0.0).expect("valid areas");
        assert!((area(&left) - 3e-6).abs() < 1e-12);
    }

    #[test]
    fn lines_in_an_inset_area_keep_their_distance() {
        let disc = [circle(Point::new(0.01, 0.02), 0.005)];
        let left = inset(&[dark(&disc)], 0.0005).expect("valid areas");
        let how = Hatch { angle: 0.4, spacing: 1e-4, is_cross: false, travel: Default::default() };
        let lines = hatch(&[dark(&left)], &how).expect("valid areas");
        assert_eq!(lines.len(), 90);
        for end in lines.iter().flat_map(|line| [line.start, line.end()]) {
            let radius = (end - Point::new(0.01, 0.02)).hypot();
            assert!((radius - 0.0045).abs() < 1e-6, "{radius}");
        }
    }

    #[test]
    fn rings_lie_a_spacing_apart() {
        let disc = [circle(Point::new(0.01, 0.02), 0.005), circle(Point::new(0.01, 0.02), 0.001)];
        let rings = rings(&[dark(&disc)], 0.0005).expect("valid areas");
        // Eight spacings: four from each side.
        assert_eq!(rings.len(), 8);
        for (number, ring) in rings.iter().enumerate() {
            let from_edge = (number / 2) as f64 * 0.0005 + 0.00025;
            let expected = [0.005 - from_edge, 0.001 + from_edge][number % 2];
            for point in ring.flattened(1e-6) {
                let radius = (point - Point::new(0.01, 0.02)).hypot();
                assert!((radius - expected).abs() < 1e-6, "{radius} for {expected}");
            }
        }
    }

    #[test]
    fn random_scribbles_of_any_size_do_no_harm() {
        let mut random = crate::random::Random::new(12);
        for size in [1e-9, 0.01, 1.0, 9e3] {
            for _ in 0..100 {
                let mut point = || Point::new(random.unit() * size, random.unit().round() * size);
                let start = point();
                let mut segments: Vec<Segment> = (0..6).map(|_| Segment::Line(point())).collect();
                segments.push(Segment::Line(start));
                let scribble = [Contour { start, segments, is_closed: true }];
                let left = inset(&[dark(&scribble)], size * 0.01).expect("valid areas");
                let whole = area(&inset(&[dark(&scribble)], 0.0).expect("valid areas"));
                assert!(area(&left) <= whole, "{} of {whole}", area(&left));
            }
        }
    }

    #[test]
    fn settings_out_of_range_are_named() {
        let square = [square(0.0, 1.0)];
        let error = inset(&[dark(&square)], -0.1).expect_err("refused");
        assert_eq!(error.to_string(), "inset is -0.1; it must be from 0 m to 10000 m");
        let far = [polygon(&[(0.0, 0.0), (1e300, 0.0), (0.0, 1.0)])];
        let error = inset(&[dark(&square), dark(&far)], 0.1).expect_err("refused");
        let expected = "area 1, contour 0 (from 0) is farther than 10000 m from the origin";
        assert_eq!(error.to_string(), expected);
        let error = rings(&[dark(&square)], 1e-8).expect_err("refused");
        assert!(error.to_string().starts_with("lines 0.00000001 m apart would be 100000000 in"));
    }
}
