//! Where a drawing that says no place of its own finds room on a machine: around its home, or else in the
//! middle of its area.

use kurbo::{Point, Rect, Vec2};
use machine::{Machine, Mechanism, MechanismVisitor};
use nalgebra::Vector3;

use super::within_reach::Reach;

/// Rounding allowed at an edge of the area and at a soft limit [m or rad].
const ROUNDING: f64 = 1e-9;

/// Where there is room for a drawing around home.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Room {
    /// Where it is, or nowhere that is better.
    AtHome,
    /// In the middle of the area, this far from where it is [m].
    Middle(Vec2),
    /// Nowhere: the area is smaller.
    None(TooLarge),
}

/// What is larger than the area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TooLarge {
    /// Width and height of what is drawn [m].
    pub drawing: [f64; 2],
    /// Width and height of the area [m].
    pub area: [f64; 2],
}

impl Room {
    /// How far from home it was moved [m].
    pub(super) fn shift(self) -> Option<[f64; 2]> {
        match self {
            Self::Middle(shift) => Some([shift.x, shift.y]),
            Self::AtHome | Self::None(_) => None,
        }
    }

    /// What has no room anywhere.
    pub(super) fn too_large(self) -> Option<TooLarge> {
        match self {
            Self::None(found) => Some(found),
            Self::AtHome | Self::Middle(_) => None,
        }
    }
}

impl TooLarge {
    /// What is drawn within `bounds` [m]; `None` where the area of `machine` is as large.
    pub(super) fn find(machine: &Machine, bounds: Rect) -> Option<Self> {
        let area = area(machine);
        let fits = bounds.width() <= area.width() + ROUNDING
            && bounds.height() <= area.height() + ROUNDING;
        let size = |rect: Rect| [rect.width(), rect.height()];
        (!fits).then(|| Self { drawing: size(bounds), area: size(area) })
    }

    /// Whether the area would hold it turned by a quarter turn.
    pub(crate) fn fits_turned(&self) -> bool {
        let Self { drawing: [width, height], area } = self;
        *width <= area[1] + ROUNDING && *height <= area[0] + ROUNDING
    }
}

/// Where `machine` has room for what is drawn around its home with a level tool: within `bounds`, along `points` [m].
/// Only of a mechanism whose joints do not go straight with the tool the points are asked for.
pub(super) fn room<'a>(
    machine: &Machine,
    bounds: Rect,
    points: &dyn Fn() -> Box<dyn Iterator<Item = Point> + 'a>,
) -> Room {
    if let Some(found) = TooLarge::find(machine, bounds) {
        return Room::None(found);
    }
    let area = area(machine);
    let is_inside = area.inflate(ROUNDING, ROUNDING).contains_rect(bounds);
    let shift = area.center() - bounds.center();
    let holds = |shift: Vec2| machine.mechanism.visit(Holds { machine, bounds, points, shift });
    if is_inside && holds(Vec2::ZERO) {
        return Room::AtHome;
    }
    // Where neither is reached, planning tells why.
    if !is_inside || holds(shift) { Room::Middle(shift) } else { Room::AtHome }
}

/// The area of `machine`, seen from above [m].
fn area(machine: &Machine) -> Rect {
    let (lower, upper) = (&machine.area.lower, &machine.area.upper);
    Rect::new(lower[0], lower[1], upper[0], upper[1])
}

/// Whether the tool reaches all of a drawing that was moved.
struct Holds<'a, 'b> {
    machine: &'a Machine,
    bounds: Rect,
    points: &'a dyn Fn() -> Box<dyn Iterator<Item = Point> + 'b>,
    shift: Vec2,
}

impl MechanismVisitor for Holds<'_, '_> {
    type Output = bool;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> bool {
        let Self { machine, bounds, points, shift } = self;
        let is_linear = mechanism.is_linear();
        let mut reach = Reach::new(mechanism, machine).rounding(ROUNDING);
        let mut holds = |point: Point| {
            let Point { x, y } = point + shift;
            reach.holds_from_home(&Vector3::new(x, y, machine.home[2]))
        };
        if is_linear {
            let Rect { x0, y0, x1, y1 } = bounds;
            return [(x0, y0), (x1, y0), (x0, y1), (x1, y1)]
                .map(Point::from)
                .into_iter()
                .all(holds);
        }
        points().all(&mut holds)
    }
}
