//! The pulse repetition rate that a job asks for, held to what the machine's source can do.

use machine::LaserSource;
use machine::document::{Diagnostics, Positive, Quantity, Span};
use machine::quantity::PulseRate;

/// How a job writes it.
pub(super) type Written = Quantity<PulseRate, Positive>;

/// The frequency that is `written` [pulses/s]; notes one that the `source` cannot do.
pub(super) fn asked(
    written: Option<&Written>,
    source: &LaserSource,
    diagnostics: &mut Diagnostics,
) -> Option<f64> {
    let written = written?;
    let frequency = of(written);
    if source.frequency.is_none() {
        diagnostics.contradict(
            written.span,
            "the frequency of this machine's pulses cannot be set".to_owned(),
            "leave it out, or give the source's range as `laser.frequency` of the machine file",
        );
        return None;
    }
    held(frequency, written.span, "it", source, diagnostics)
}

/// Pulses a second.
pub(super) fn of(written: &Written) -> f64 {
    LaserSource::pulses(written.value)
}

/// `frequency` [pulses/s], for which `who` asks at `span`, if the `source` can do it; else notes what it
/// can.
pub(super) fn held(
    frequency: f64,
    span: Span,
    who: &str,
    source: &LaserSource,
    diagnostics: &mut Diagnostics,
) -> Option<f64> {
    if source.pulses_at(frequency) {
        return Some(frequency);
    }
    let [least, most] = source.frequency.unwrap_or_default().map(|end| end / 1e3);
    diagnostics.contradict(
        span,
        format!("{who} asks for {} kHz, which this laser cannot do", frequency / 1e3),
        &format!("write {least} to {most} kHz, the range of `laser.frequency` of the machine file"),
    );
    None
}
