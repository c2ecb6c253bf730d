//! Where a drawing comes to lie.

use graphics::Graphic;
use kurbo::{Affine, Point, Rect, Vec2};
use machine::document::Diagnostics;
use messages::math;
use nalgebra::Vector3;

use super::tables::{Anchor, DrawingTable, Mirror};
use crate::job::whole::whole;

/// The most places of one drawing.
const MOST_PLACES: u64 = 100_000;

/// The places of a drawing, in order.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Places {
    /// From the drawing's coordinates to the machine's, one for each place [m].
    pub(super) flat: Vec<Affine>,
    /// The height of all of them, machine frame [m].
    pub(super) height: f64,
}

/// How many places the drawing of `table` has.
pub(super) fn count(table: &DrawingTable, diagnostics: &mut Diagnostics) -> usize {
    offsets(table, diagnostics).len()
}

/// Where the drawing of `table` comes to lie on a machine with this `home` [m]. The first of its places
/// rules size and anchor: others hold other texts.
pub(super) fn places(
    table: &DrawingTable,
    graphic: &Graphic,
    home: Vector3<f64>,
    diagnostics: &mut Diagnostics,
) -> Option<Places> {
    let bounds = graphic.bounds()?;
    let scale = scale(table, bounds, diagnostics)?;
    let anchor = match table.anchor.value {
        Anchor::Page => Point::ORIGIN,
        Anchor::Box([x, y]) => {
            let at = |low: f64, high: f64, halves: u8| low + (high - low) * f64::from(halves) / 2.0;
            Point::new(at(bounds.x0, bounds.x1, x), at(bounds.y0, bounds.y1, y))
        }
    };
    let mirror = match table.mirror.value {
        Mirror::None => Vec2::new(1.0, 1.0),
        Mirror::X => Vec2::new(-1.0, 1.0),
        Mirror::Y => Vec2::new(1.0, -1.0),
    };
    let at = table.at.as_ref().map_or(Vector3::zeros(), |at| Vector3::from(at.value));
    let middle = home + at;
    let upright = Affine::scale_non_uniform(scale.x * mirror.x, scale.y * mirror.y)
        * Affine::translate(-anchor.to_vec2());
    let turned = turn(table.rotation.value) * upright;
    let flat = offsets(table, diagnostics)
        .into_iter()
        .map(|(offset, angle)| {
            Affine::translate(Vec2::new(middle.x, middle.y) + offset) * turn(angle) * turned
        })
        .collect();
    Some(Places { flat, height: middle.z })
}

/// A rotation, exact for quarters of a turn.
fn turn(angle: f64) -> Affine {
    let quarters = angle / (math::TURN / 4.0);
    let [sine, cosine] = if (quarters - quarters.round()).abs() < 1e-12 {
        match (quarters.round() as i64).rem_euclid(4) {
            0 => [0.0, 1.0],
            1 => [1.0, 0.0],
            2 => [0.0, -1.0],
            _ => [-1.0, 0.0],
        }
    } else {
        let (sine, cosine) = math::sin_cos(angle);
        [sine, cosine]
    };
    Affine::new([cosine, sine, -sine, cosine, 0.0, 0.0])
}

/// How much larger the drawing becomes in x and in y.
fn scale(table: &DrawingTable, bounds: Rect, diagnostics: &mut Diagnostics) -> Option<Vec2> {
    if let (Some(scale), true) = (&table.scale, table.width.is_some() || table.height.is_some()) {
        let text = "`scale` and `width` or `height` both say how large it is".to_owned();
        diagnostics.contradict(scale.span, text, "keep one of them");
        return None;
    }
    let factors = [
        (&table.width, bounds.width(), "width", "high"),
        (&table.height, bounds.height(), "height", "wide"),
    ]
    .map(|(wanted, drawn, name, other)| {
        let Some(wanted) = wanted else { return Ok(None) };
        if drawn > 0.0 { Ok(Some(wanted.value / drawn)) } else { Err((wanted.span, name, other)) }
    });
    for factor in &factors {
        if let Err((span, name, other)) = factor {
            let text = format!("the drawing is only {other}: it has no {name} to be scaled");
            diagnostics.contradict(
                *span,
                text,
                "write `scale`, or the other one of `width` and `height`",
            );
            return None;
        }
    }
    let even = table.scale.as_ref().map_or(1.0, |scale| scale.value);
    Some(match factors {
        [Ok(Some(x)), Ok(Some(y))] => Vec2::new(x, y),
        [Ok(Some(factor)), _] | [_, Ok(Some(factor))] => Vec2::new(factor, factor),
        _ => Vec2::new(even, even),
    })
}

/// How far each place is from the first [m], and how it is turned [rad].
fn offsets(table: &DrawingTable, diagnostics: &mut Diagnostics) -> Vec<(Vec2, f64)> {
    let mut places = vec![(Vec2::ZERO, 0.0)];
    if let Some(array) = &table.array {
        let columns = whole(&array.columns, 1..=MOST_PLACES, "columns", diagnostics).unwrap_or(1);
        let rows = whole(&array.rows, 1..=MOST_PLACES, "rows", diagnostics).unwrap_or(1);
        let [across, up] = &array.spacing;
        if columns * rows > MOST_PLACES {
            let text = format!("{columns} columns of {rows} are more than {MOST_PLACES} places");
            diagnostics.contradict(array.span, text, "make several jobs of them");
            return places;
        }
        places = (0..rows)
            .flat_map(|row| (0..columns).map(move |column| [column as f64, row as f64]))
            .map(|[column, row]| (Vec2::new(column * across.value, row * up.value), 0.0))
            .collect();
    }
    let Some(ring) = &table.ring else { return places };
    if table.array.is_some() {
        let text = "`array` and `ring` both say where it lies".to_owned();
        diagnostics.contradict(ring.span, text, "keep one of them");
        return places;
    }
    let count = whole(&ring.count, 1..=MOST_PLACES, "count", diagnostics).unwrap_or(1);
    let step = match &ring.angle {
        Some(angle) => angle.value / (count.max(2) - 1) as f64,
        None => math::TURN / count as f64,
    };
    (0..count)
        .map(|index| {
            let angle = ring.from.value + step * index as f64;
            let (sine, cosine) = math::sin_cos(angle);
            let turned = if ring.turn.value { angle - math::TURN / 4.0 } else { 0.0 };
            (Vec2::new(cosine, sine) * ring.radius.value, turned)
        })
        .collect()
}
