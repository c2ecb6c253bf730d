//! Where the least squares begin.

use machine::mechanisms::tri_planar::{Mounting, TriPlanar};
use machine::{Mechanism, Pose};
use nalgebra::{Matrix3, SVD, Vector3};

use super::model::{Part, mounting};
use super::{MOST_OFF, Measurement};

/// The length of a leg that is far from the side with this measurement [m]; `None` where none is.
pub(super) fn strange_leg(mechanism: &TriPlanar, measurement: &Measurement) -> Option<f64> {
    let found = mechanism.measured_struts(&measurement.pose, &measurement.feet);
    let is_near = |length: &f64| (length - mechanism.side).abs() <= MOST_OFF * mechanism.side;
    found.into_iter().flatten().find(|length| !is_near(length))
}

/// The machine as the file has it, if its legs are about as long as measured. If not, a free base, or else
/// a free tool, is put where the measured poses lie best on those that the file's legs have on these feet,
/// so that an instrument may stand and be turned in any way.
pub(super) fn start(
    mechanism: &TriPlanar,
    measurements: &[Measurement],
    free: &[Part],
) -> TriPlanar {
    let is_near = measurements.iter().all(|found| strange_leg(mechanism, found).is_none());
    if is_near {
        return *mechanism;
    }
    let located: Vec<(Pose, Pose)> = measurements
        .iter()
        .filter_map(|found| {
            let due = mechanism.locate(&found.feet, mechanism.branch(), None).ok()?;
            Some((due, found.pose))
        })
        .collect();
    let Mounting { mut base, mut tool } = mounting(mechanism);
    if free.contains(&Part::Base) {
        // found = by · due
        let turn = |(due, found): &(Pose, Pose)| found.rotation * due.rotation.transpose();
        let Some(rotation) = mean_turn(located.iter().map(turn)) else { return *mechanism };
        let shift = |(due, found): &(Pose, Pose)| found.position - rotation * due.position;
        let position = mean(located.iter().map(shift));
        base = chained(&Pose { position, rotation }, &base);
    } else if free.contains(&Part::Tool) {
        // found = due · by
        let turn = |(due, found): &(Pose, Pose)| due.rotation.tr_mul(&found.rotation);
        let Some(rotation) = mean_turn(located.iter().map(turn)) else { return *mechanism };
        let shift =
            |(due, found): &(Pose, Pose)| due.rotation.tr_mul(&(found.position - due.position));
        let position = mean(located.iter().map(shift));
        tool = chained(&tool, &Pose { position, rotation });
    }
    TriPlanar { mounting: Some(Mounting { base, tool }), ..*mechanism }
}

/// The frame `inner` of `outer` in that of `outer`.
fn chained(outer: &Pose, inner: &Pose) -> Pose {
    Pose {
        position: outer.position + outer.rotation * inner.position,
        rotation: outer.rotation * inner.rotation,
    }
}

/// The mean of some vectors.
fn mean(vectors: impl ExactSizeIterator<Item = Vector3<f64>>) -> Vector3<f64> {
    let count = vectors.len().max(1) as f64;
    vectors.sum::<Vector3<f64>>() / count
}

/// The rotation that is nearest to all of `turns` together; `None` of none.
fn mean_turn(turns: impl ExactSizeIterator<Item = Matrix3<f64>>) -> Option<Matrix3<f64>> {
    if turns.len() == 0 {
        return None;
    }
    /// Turns of the iteration before it is given up.
    const MOST_TURNS: usize = 1000;
    let sum: Matrix3<f64> = turns.sum();
    let split = SVD::try_new(sum, true, true, 5.0 * f64::EPSILON, MOST_TURNS)?;
    let (u, mut v_t) = (split.u?, split.v_t?);
    // A mirror image is no rotation: what matters least is turned back.
    if (u * v_t).determinant() < 0.0 {
        let least = split.singular_values.imin();
        v_t.row_mut(least).neg_mut();
    }
    Some(u * v_t)
}
