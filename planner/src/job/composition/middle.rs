//! Drawings that say no place of their own, moved to where there is room for them.

use std::collections::BTreeMap;

use kurbo::{Affine, Point, Rect, Vec2};
use machine::Machine;

use super::layers::{Content, Layer};
use crate::drawing::Note;
use crate::job::TooLarge;
use crate::job::room::{Room, room};

/// How far apart points of what is drawn are looked at [m].
const STEP: f64 = 2e-3;

/// How far chords may be from curves of which that is done [m].
const CHORD: f64 = 1e-3;

/// Moves what is drawn around the home of `machine` to the middle of its area, where there is no room for it at
/// home; tells where it lies, and what is too large for the area. `outward` is how far the cuts of a layer lie outside of what is drawn [m].
pub(super) fn find_room(
    contents: &mut BTreeMap<Layer, Content>,
    outward: impl Fn(Layer) -> f64,
    machine: &Machine,
    notes: &mut Vec<Note>,
) -> Room {
    let Some(bounds) = bounds(contents, outward) else { return Room::AtHome };
    let room = room(machine, bounds, &|| points(contents));
    if let Room::Middle(shift) = room {
        contents.values_mut().for_each(|content| content.shift(shift));
        notes.push(Note { line: 0, text: moved(shift) });
    }
    room
}

/// Whether what says its place is too large for the area of `machine` wherever it lies.
pub(super) fn too_large(
    contents: &BTreeMap<Layer, Content>,
    outward: impl Fn(Layer) -> f64,
    machine: &Machine,
) -> Room {
    let found = bounds(contents, outward).and_then(|bounds| TooLarge::find(machine, bounds));
    found.map_or(Room::AtHome, Room::None)
}

/// That a drawing was moved.
pub(in crate::job) fn moved(shift: Vec2) -> String {
    let [x, y] = [shift.x, shift.y].map(|way| {
        let text = format!("{:.3}", way * 1e3);
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    });
    format!(
        "there is no room around home: it lies in the middle of the area, at [\"{x} mm\", \"{y} mm\"] from home; \
         `at` puts it elsewhere"
    )
}

/// The smallest upright rectangle around all of it [m].
fn bounds(contents: &BTreeMap<Layer, Content>, outward: impl Fn(Layer) -> f64) -> Option<Rect> {
    let bounds = contents.iter().flat_map(|(layer, content)| {
        let outward = outward(*layer);
        let lines = content.lines.iter().map(move |drawn| {
            let outward = if drawn.shape.is_closed { outward } else { 0.0 };
            drawn.shape.bounds().inflate(outward, outward)
        });
        let areas = content.areas.iter().filter(|drawn| drawn.shape.is_dark);
        let areas = areas.flat_map(|drawn| &drawn.shape.contours).map(|contour| contour.bounds());
        let images = content.images.iter().map(|drawn| drawn.shape.bounds());
        lines.chain(areas).chain(images)
    });
    bounds.reduce(|one, other| one.union(other))
}

/// Points along all of it [m].
fn points(contents: &BTreeMap<Layer, Content>) -> Box<dyn Iterator<Item = Point> + '_> {
    Box::new(contents.values().flat_map(|content| {
        let areas = content.areas.iter().filter(|drawn| drawn.shape.is_dark);
        let contours = content.lines.iter().map(|drawn| &drawn.shape);
        let contours = contours.chain(areas.flat_map(|drawn| &drawn.shape.contours));
        let contours = contours.flat_map(|contour| along(contour.flattened(CHORD)));
        let images = content.images.iter().flat_map(|drawn| {
            let Rect { x0, y0, x1, y1 } = drawn.shape.bounds();
            along([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)].map(Point::from).to_vec())
        });
        contours.chain(images)
    }))
}

/// Points along a polygon.
fn along(corners: Vec<Point>) -> impl Iterator<Item = Point> {
    let last = corners.last().copied();
    let firsts = corners.clone();
    let chords = firsts.into_iter().zip(corners.into_iter().skip(1)).flat_map(|(from, to)| {
        let count = ((to - from).hypot() / STEP).ceil().max(1.0) as usize;
        (0..count).map(move |index| from.lerp(to, index as f64 / count as f64))
    });
    chords.chain(last)
}

impl Content {
    fn shift(&mut self, by: Vec2) {
        let by = Affine::translate(by);
        for drawn in &mut self.lines {
            drawn.shape = drawn.shape.transformed(by);
        }
        let areas = self.areas.iter_mut().flat_map(|drawn| &mut drawn.shape.contours);
        areas.for_each(|contour| *contour = contour.transformed(by));
        for drawn in &mut self.images {
            drawn.shape.placement = by * drawn.shape.placement;
        }
    }
}
