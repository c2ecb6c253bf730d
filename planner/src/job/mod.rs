//! Job readers: each turns one kind of file into a drawing.

pub mod gcode;

use crate::drawing::Drawing;

/// A job, read and understood, but not planned.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// What to mark.
    pub drawing: Drawing,
    /// How to mark it.
    pub marking: Marking,
    /// Largest speed of free moves that the job's convention has [m/s]; `None` leaves it to the
    /// machine file.
    pub rapid: Option<f64>,
    /// Why this job can be planned but not run on a machine, if so.
    pub ideal_only: Option<&'static str>,
}

/// How a job wants its lines marked; what is `None` the machine file's `[path]` table rules.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Marking {
    /// Speed while the laser is on; `None` leaves it to each line of the job, then to
    /// [`MarkingSpeed::Optimum`].
    pub speed: Option<MarkingSpeed>,
    /// Largest speed while the laser is on [m/s].
    pub max_speed: Option<f64>,
    /// How far a smoothed join may lie from the drawn line [m].
    pub tolerance: Option<f64>,
}

/// The policy for the speed while the laser is on, constant along each stroke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MarkingSpeed {
    /// The speed that minimises the drawing's time.
    Optimum,
    /// This speed [m/s].
    Constant(f64),
}
