//! The job file's table of how to mark, whatever is marked.

use machine::document::{Diagnostics, Either, Fraction, Number, Positive, Quantity, Spanned};
use machine::quantity::{Length, PulseRate, Speed};
use machine::{LaserSource, table};

use super::whole::whole;
use super::{Marking, MarkingSpeed, frequency};
use crate::drawing::Turns;
use crate::light::Policy;

table! {
    /// How to mark.
    pub struct MarkingTable {
        /// "optimum", or a speed: constant while the laser is on.
        pub speed: Option<Either<Optimum, Quantity<Speed, Positive>>>,
        /// Largest speed while the laser is on.
        pub max_speed: Option<Quantity<Speed, Positive>>,
        /// How far a smoothed join may lie from the drawn line, and the tool from its path between two
        /// setpoints.
        pub tolerance: Option<Quantity<Length, Positive>>,
        /// Power of the laser, full power when left out.
        pub power: Option<Fraction<Positive>>,
        /// Pulse repetition rate of the laser, within `laser.frequency` of the machine; as the source is
        /// set when left out.
        pub frequency: Option<Quantity<PulseRate, Positive>>,
        /// How the light goes with the speed along lines: `constant` marks at one speed and comes to it
        /// in the dark, `proportional` lights from rest to rest with power in proportion to the speed.
        /// When left out, a G-code program's M3 and M4 say it, and other jobs are `constant`.
        pub policy: Option<Spanned<Policy>>,
        /// The stroke to begin with, from 1, as after a job that was stopped; a path is not cut, so
        /// those of its path that come before it are marked again.
        pub from_stroke: Number<Positive> = 1.0,
    }
}

/// The word for the speed with the least time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Optimum {
    /// The speed that minimises the drawing's time.
    Optimum,
}

machine::keyword! {
    Optimum, "a speed",
    "optimum" => Self::Optimum,
}

/// The most strokes of a job.
const MOST_STROKES: u64 = 1 << 53;

impl MarkingTable {
    /// Notes what is wrong with it on a machine with this laser `source`.
    pub(super) fn check(&self, source: &LaserSource, diagnostics: &mut Diagnostics) {
        frequency::asked(self.frequency.as_ref(), source, diagnostics);
        whole(&self.from_stroke, 1..=MOST_STROKES, "from_stroke", diagnostics);
    }

    /// How a job is marked that has no say of its own.
    pub(super) fn marking(&self) -> Marking {
        Marking {
            speed: self.speed.as_ref().map(|speed| match speed {
                Either::Word(_) => MarkingSpeed::Optimum,
                Either::Value(speed) => MarkingSpeed::Constant(speed.value),
            }),
            max_speed: self.max_speed.as_ref().map(|speed| speed.value),
            tolerance: self.tolerance.as_ref().map(|tolerance| tolerance.value),
            policy: self.policy.as_ref().map(|policy| policy.value),
            turns: Turns::default(),
            frequency: self.frequency.as_ref().map(frequency::of),
            from_stroke: self.from_stroke.value as u64,
        }
    }

    /// Fraction of full scale.
    pub(super) fn level(&self) -> f64 {
        self.power.as_ref().map_or(1.0, |power| power.value)
    }
}
