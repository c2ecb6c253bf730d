//! What a machine file says without effect, beside what a mechanism does not read (`mechanism`): each is an
//! error that says what it would need.

use super::tables::{FrictionTable, MachineTable};
use crate::document::Diagnostics;

/// Refuses keys that have no effect without another one.
pub(super) fn check(table: &MachineTable, diagnostics: &mut Diagnostics) {
    for (_, axis) in &table.axis.entries {
        let FrictionTable { brake, brake_release, span, .. } = &axis.friction;
        // The place of a default is that of its table.
        if brake_release.span != *span && brake.span == *span {
            diagnostics.contradict(
                brake_release.span,
                "`brake_release` has no effect: there is no `brake`".to_owned(),
                "give the `brake` its torque, or remove its release",
            );
        }
    }
}
