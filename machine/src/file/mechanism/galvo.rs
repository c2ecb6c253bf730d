//! The table of a scan head.

use super::linear::{self, Part};
use super::{BuildContext, Built, chain};
use crate::document::{Diagnostics, NonNegative, Number, Positive, ProblemKind, Quantity};
use crate::file::axes::JointUnit;
use crate::file::frame;
use crate::mechanisms::galvo::{Galvo, Optics};
use crate::quantity as unit;
use crate::table;

type Above<K> = Quantity<K, Positive>;

table! {
    /// A scan head: two mirrors that turn the beam over a flat field. Its axes are the mirrors, `m1`, which
    /// turns the beam towards x, and `m2` after it; their joints are mechanical angles. What brings the beam
    /// to the field is an f-theta lens, or its `distance` alone.
    pub struct GalvoTable {
        /// Focal length of the f-theta lens.
        pub focal_length: Option<Above<unit::Length>>,
        /// Distortion of the lens, k₃ and k₅ of h = f·θ·(1 + k₃·θ² + k₅·θ⁴), θ in radians; 0 of an ideal
        /// lens.
        pub distortion: Option<[Number; 2]>,
        /// Instead of a lens: from the second mirror to the field.
        pub distance: Option<Above<unit::Length>>,
        /// From the first mirror to the second one, where there is no lens.
        pub mirror_distance: Option<Quantity<unit::Length, NonNegative>>,
        /// Moments of inertia of the two mirrors with their mounts about their axes.
        pub mirror_inertia: [Above<unit::Inertia>; 2],
    }
}

pub(super) fn build(
    table: &GalvoTable,
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let optics = optics(table, diagnostics)?;
    let part = |(name, inertia): (&'static str, &Above<unit::Inertia>)| {
        let axis = chain::axis(context.table, name);
        let output =
            axis.and_then(|axis| chain::transmission(name, JointUnit::Angle, axis, diagnostics));
        Part { name, unit: JointUnit::Angle, load: inertia.value, output }
    };
    let [first, second] = &table.mirror_inertia;
    let parts = [("m1", first), ("m2", second)].map(part);
    let mechanism = Galvo {
        inertia: [first.value, second.value],
        optics,
        elasticity: linear::elasticity(&parts, diagnostics),
        frame: frame::build(context.table, false, context.area, diagnostics),
    };
    let joints = linear::joints(&mechanism, &parts, context, diagnostics)?;
    Some(Built { mechanism: mechanism.into(), joints, home: context.home })
}

fn optics(table: &GalvoTable, diagnostics: &mut Diagnostics) -> Option<Optics> {
    let mut no_effect = |span, key: &str, why: &str| {
        diagnostics.contradict(span, format!("`{key}` has no effect: {why}"), "remove it");
    };
    match (&table.focal_length, &table.distance) {
        (Some(focal_length), None) => {
            if let Some(distance) = &table.mirror_distance {
                let why = "a lens brings beams of one direction to one place, wherever they enter";
                no_effect(distance.span, "mirror_distance", why);
            }
            let given = table.distortion.as_ref();
            let distortion =
                given.map_or([0.0; 2], |terms| terms.each_ref().map(|term| term.value));
            if let (Some([third, _]), false) = (given, grows(distortion)) {
                diagnostics.contradict(
                    third.span,
                    "with this distortion beams of two directions come to one place".to_owned(),
                    "give k₃ and k₅, each some hundredths, for θ in radians",
                );
            }
            Some(Optics::FTheta { focal_length: focal_length.value, distortion })
        }
        (None, Some(distance)) => {
            if let Some([third, _]) = &table.distortion {
                no_effect(third.span, "distortion", "there is no lens");
            }
            let mirrors = table.mirror_distance.map_or(0.0, |mirrors| mirrors.value);
            Some(Optics::Open { distance: distance.value, mirrors })
        }
        (Some(_), Some(distance)) => {
            no_effect(distance.span, "distance", "the lens with its `focal_length` says it");
            None
        }
        (None, None) => {
            diagnostics.refuse(
                ProblemKind::MissingKey,
                table.span,
                "`focal_length` is missing: nothing says how far the field is".to_owned(),
                Some(
                    "add the `focal_length` of the lens, or the `distance` of the field without one"
                        .to_owned(),
                ),
            );
            None
        }
    }
}

/// Whether the height of the image grows with the angle, up to where the head may point.
fn grows([third, fifth]: [f64; 2]) -> bool {
    /// The least slope, as a share of that in the middle.
    const LEAST: f64 = 0.2;
    (0..=100).all(|step| {
        let square = f64::from(step) / 100.0;
        1.0 + 3.0 * third * square + 5.0 * fifth * square * square >= LEAST
    })
}
