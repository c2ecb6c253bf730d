//! What a drive is told that finds its reference by itself.

use super::operating::HomingTable;
use crate::actuator::Actuator;
use crate::axis::{Axis, JointUnit};
use crate::document::{Diagnostics, ProblemKind, Span};
use crate::drives::{ActuatorMode, DrivesKind};
use crate::operating::{DriveHoming, HomingMethod, Operating};

/// In which a drive comes to its speed where the file does not say [s].
const RISE: f64 = 0.1;

/// What the drive of `axis`, with its `actuators`, is told by `table`; `None` where it does not look for the reference,
/// or cannot. It looks at `speed`, in units of the joint.
pub(super) fn drive_homing(
    table: &HomingTable,
    axis: &Axis,
    actuators: &[Actuator],
    (unit, speed): (JointUnit, f64),
    diagnostics: &mut Diagnostics,
) -> Option<DriveHoming> {
    if table.method.value != HomingMethod::Drive {
        let message = |key: &str| format!("`{key}` has no effect: the method is no `drive`");
        if let Some(number) = &table.drive_method {
            diagnostics.contradict(number.span, message("drive_method"), "remove `drive_method`");
        }
        if let Some(own) = &table.acceleration {
            diagnostics.contradict(own.span, message("acceleration"), "remove `acceleration`");
        }
        return None;
    }
    let (span, name) = (table.method.span, &axis.name);
    if actuators.iter().any(|actuator| actuator.mode == ActuatorMode::Voltage) {
        diagnostics.contradict(
            span,
            format!("axis `{name}` is driven by voltage: its drive closes no loop, and finds nothing by itself"),
            "give the axis another `mode`, or home it by a `switch`",
        );
    }
    let Some(number) = &table.drive_method else {
        diagnostics.refuse(
            ProblemKind::MissingKey,
            table.span,
            format!("nothing is said of how the drive of axis `{name}` finds its reference"),
            Some(
                "add `drive_method`, by CiA 402: 17 or 18 by a limit switch, 19 to 22 by the home switch, 33 or 34 by \
                 the index pulse, 37 where it stands"
                    .to_owned(),
            ),
        );
        return None;
    };
    if number.value.fract() != 0.0 || number.value == 0.0 {
        diagnostics.contradict(
            number.span,
            format!("{} is no method of homing", number.value),
            "write a whole number, as 17 or 37",
        );
    }
    let method = number.value as i8;
    if DriveHoming::mirrored(method).is_none()
        && let Some(actuator) = actuators.iter().find(|actuator| actuator.ratio < 0.0)
    {
        diagnostics.contradict(
            number.span,
            format!(
                "`{}` is mirrored, and nothing is known of what the method {method} is the other way round",
                actuator.name
            ),
            "write a method of CiA 402 from 1 to 37, or turn the drive's direction round in the drive and leave \
             `mirrored` out",
        );
    }
    let acceleration = match &table.acceleration {
        Some(own) => unit.expect(own, name, diagnostics).then_some(own.value)?,
        None => speed / RISE,
    };
    Some(DriveHoming { method, acceleration })
}

/// Refuses axes that a drive shall home, of drives that cannot.
pub(super) fn refuse(
    kind: &DrivesKind,
    operating: &Operating,
    span: Span,
    diagnostics: &mut Diagnostics,
) {
    let by_drive = operating.homing.iter().flatten().any(|it| it.method == HomingMethod::Drive);
    if by_drive && matches!(kind, DrivesKind::Hostmot2(_)) {
        diagnostics.contradict(
            span,
            "a HostMot2 board does not look for references by itself".to_owned(),
            "home by a `switch` in place of the `drive`",
        );
    }
}
