//! The job file's tables of the surface that is marked and of how the tool is turned.

use std::borrow::Cow;

use machine::Machine;
use machine::document::{Diagnostics, Point, Positive, Quantity, Spanned};
use machine::quantity::{Angle, Length};
use machine::surface::{Cone, Placement, Projection, Shape, Surface};
use machine::table;
use nalgebra::Vector3;

use super::Job;
use crate::geometry::attitude::{AttitudeLaw, turned};

table! {
    /// The surface that the flat drawing is put on; the beam is against its normal. Exactly one of
    /// `cone` and `cylinder`.
    pub struct SurfaceTable {
        /// A frustum of a cone about its own y.
        pub cone: Option<ConeTable>,
        /// A cylinder about its own y.
        pub cylinder: Option<CylinderTable>,
        /// Where its own origin lies, the middle of the bottom.
        pub position: Option<Point>,
        /// How its own frame is turned: about x, then y, then z.
        pub rotation: Option<[Quantity<Angle>; 3]>,
    }
}

table! {
    /// A frustum of a cone.
    pub struct ConeTable {
        /// Radius at the bottom, where y is 0.
        pub bottom_radius: Quantity<Length, Positive>,
        /// Radius at the top.
        pub top_radius: Quantity<Length, Positive>,
        /// From the bottom to the top along the axis.
        pub height: Quantity<Length, Positive>,
        /// develop: unrolled, lengths stay; arc: x along the circle; central: seen from the axis;
        /// ortho: seen from above.
        pub projection: Spanned<ProjectionWord> = "develop",
    }
}

table! {
    /// A cylinder.
    pub struct CylinderTable {
        /// Its radius.
        pub radius: Quantity<Length, Positive>,
        /// Its length along its axis.
        pub height: Quantity<Length, Positive>,
        /// As for a cone.
        pub projection: Spanned<ProjectionWord> = "develop",
    }
}

table! {
    /// How the tool is turned: about x, then y, then z of the machine.
    pub struct AttitudeTable {
        /// About x.
        pub roll: Quantity<Angle> = "0 deg",
        /// About y.
        pub pitch: Quantity<Angle> = "0 deg",
        /// About z.
        pub yaw: Quantity<Angle> = "0 deg",
        /// A lean besides, which follows the tool's position.
        pub follow: Option<FollowTable>,
    }
}

table! {
    /// A lean in proportion to the distance from a centre, across z: `tilt` at `radius`, twice that
    /// at twice the radius.
    pub struct FollowTable {
        /// Where there is no lean, as seen from the machine's home.
        pub center: Option<Point>,
        /// The lean at `radius`: the tool's z away from the centre, towards it where negative.
        pub tilt: Quantity<Angle>,
        /// Where the lean is `tilt`.
        pub radius: Quantity<Length, Positive>,
    }
}

/// How a drawing is put on a cone, as a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProjectionWord(Projection);

machine::keyword! {
    ProjectionWord, "a projection",
    "develop" => Self(Projection::Developed),
    "arc" => Self(Projection::Arc),
    "central" => Self(Projection::Central),
    "ortho" => Self(Projection::Orthographic),
}

/// The surface of a table; what is wrong with it goes to `diagnostics`.
pub(super) fn surface(table: &SurfaceTable, diagnostics: &mut Diagnostics) -> Option<Surface> {
    let cone = match (&table.cone, &table.cylinder) {
        (Some(cone), None) => Cone {
            bottom: cone.bottom_radius.value,
            top: cone.top_radius.value,
            length: cone.height.value,
            projection: cone.projection.value.0,
        },
        (None, Some(cylinder)) => Cone {
            bottom: cylinder.radius.value,
            top: cylinder.radius.value,
            length: cylinder.height.value,
            projection: cylinder.projection.value.0,
        },
        _ => {
            let help = "write one table [surface.cone] or [surface.cylinder]";
            diagnostics.contradict(table.span, "which surface is not clear".to_owned(), help);
            return None;
        }
    };
    let [roll, pitch, yaw] =
        table.rotation.as_ref().map_or([0.0; 3], |angles| angles.each_ref().map(|a| a.value));
    let translation = table.position.as_ref().map_or(Vector3::zeros(), |at| at.value.into());
    let placement = Placement { rotation: turned(roll, pitch, yaw), translation };
    Some(Surface { shape: Shape::Cone(cone), placement })
}

/// `machine` as the flat drawing on a `surface` sees it: its home is the middle of the surface.
pub(super) fn flat<'a>(machine: &'a Machine, surface: Option<&Surface>) -> Cow<'a, Machine> {
    match surface {
        Some(surface) => Cow::Owned(Machine { home: middle(surface), ..machine.clone() }),
        None => Cow::Borrowed(machine),
    }
}

/// The flat point in the middle of a surface, around which a drawing lies [m].
fn middle(surface: &Surface) -> [f64; 3] {
    match surface.shape {
        Shape::Cone(cone) => [0.0, cone.length / 2.0, 0.0],
        Shape::Plane | Shape::Sphere(_) => [0.0; 3],
    }
}

/// Puts the job on its surface and turns its tool, on a machine with this `home` [m].
pub(super) fn place(
    job: Job,
    surface: Option<Surface>,
    attitude: Option<&AttitudeTable>,
    home: Vector3<f64>,
) -> Job {
    let law = match (attitude, surface) {
        (Some(table), _) => {
            let base = turned(table.roll.value, table.pitch.value, table.yaw.value);
            table.follow.as_ref().map_or(AttitudeLaw::Fixed(base), |follow| {
                let center = follow.center.as_ref().map_or([0.0; 3], |center| center.value);
                AttitudeLaw::Following {
                    center: home + Vector3::from(center),
                    gradient: follow.tilt.value / follow.radius.value,
                    base,
                }
            })
        }
        (None, Some(surface)) => AttitudeLaw::Normal(surface),
        (None, None) => job.attitude,
    };
    Job { surface, attitude: law, ..job }
}
