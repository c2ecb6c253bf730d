//! What the reader of programs wants to know of a machine.

use machine::Machine;
use machine::gcode_settings::{GcodeSettings, WordMeanings};
use messages::math::TURN;
use nalgebra::Vector3;

/// How a machine reads programs, and how fast it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ReaderSettings {
    /// What words mean.
    pub(super) gcode: GcodeSettings,
    /// [`WordMeanings::way_per_degree`] of the machine.
    pub(super) way_per_degree: Option<f64>,
    /// Where programs start [m].
    pub(super) home: Vector3<f64>,
    /// Largest speed of a mark [m/s].
    pub(super) mark_speed: f64,
    /// Largest speed in the dark [m/s].
    pub(super) rapid: f64,
    /// Lines that a program with loops may go through: one that goes through more has no end.
    pub(super) most_lines: u64,
    /// The line to begin with, if it is not the first.
    pub(super) from_line: Option<u64>,
}

/// [`ReaderSettings::most_lines`].
const MOST_LINES: u64 = 10_000_000;

impl ReaderSettings {
    pub(super) fn of(machine: &Machine) -> Self {
        let settings = Self {
            gcode: machine.gcode,
            way_per_degree: machine.chuck_radius().map(|radius| radius * TURN / 360.0),
            home: Vector3::from(machine.home),
            mark_speed: machine.path.speed,
            rapid: machine.path.rapid,
            most_lines: MOST_LINES,
            from_line: None,
        };
        settings.with_words(machine.gcode.words)
    }

    /// With words that mean something else; what the machine is they do not change.
    pub(super) fn with_words(mut self, words: WordMeanings) -> Self {
        self.gcode.words = WordMeanings { way_per_degree: self.way_per_degree, ..words };
        self
    }
}
