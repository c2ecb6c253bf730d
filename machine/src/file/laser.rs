//! From the table of the laser to [`LaserSource`].

use super::tables::LaserTable;
use crate::document::{Diagnostics, ProblemKind};
use crate::drives::DrivesKind;
use crate::laser::LaserSource;

/// The source of `table` on drives of this `kind`; notes delays that no source has, a range of
/// frequencies that is none, and one that the drives cannot set.
pub(super) fn source(
    table: &LaserTable,
    kind: &DrivesKind,
    diagnostics: &mut Diagnostics,
) -> LaserSource {
    for (key, delay) in [("on_delay", table.on_delay), ("off_delay", table.off_delay)] {
        if delay.value > LaserSource::LONGEST_DELAY {
            diagnostics.refuse(
                ProblemKind::OutOfRange,
                delay.span,
                format!("an `{key}` of {} s is too long", delay.value),
                Some(format!("a laser source answers within {} s", LaserSource::LONGEST_DELAY)),
            );
        }
    }
    LaserSource {
        on_delay: table.on_delay.value,
        off_delay: table.off_delay.value,
        min_power: table.min_power.value,
        proportional_floor: table.proportional_floor.value,
        frequency: frequency(table, kind, diagnostics),
    }
}

/// The range of pulse repetition rates [pulses/s].
fn frequency(
    table: &LaserTable,
    kind: &DrivesKind,
    diagnostics: &mut Diagnostics,
) -> Option<[f64; 2]> {
    let [least, most] = table.frequency?;
    if least.value > most.value {
        diagnostics.contradict(
            least.span,
            "the lowest frequency is above the highest one".to_owned(),
            "write the lower one first: frequency = [\"20 kHz\", \"80 kHz\"]",
        );
    }
    if *kind != DrivesKind::Simulated {
        diagnostics.contradict(
            least.span,
            format!("[drives.{}] cannot set the frequency of the pulses", kind.name()),
            "leave `frequency` out: the source keeps the one that it is set to",
        );
    }
    Some([least, most].map(|end| LaserSource::pulses(end.value)))
}
