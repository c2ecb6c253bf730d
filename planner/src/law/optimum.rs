//! The speed that a job leaves open: the one that minimises the drawing's time (source 003 fig.
//! 2-12), with lines marked at one speed, entered and left at it.

mod line;
mod search;
mod travel;
mod turn;

use machine::PathLimits;

use crate::drawing::Note;
use crate::job::{Marking, MarkingSpeed};
use crate::law::flight::DirectionLimit;

pub(crate) use search::fastest;
pub(crate) use travel::{Best, Travel};

use nalgebra::Vector3;

/// What the joints leave of the tool's motion near a place [m].
pub(crate) type Near<'a> = dyn Fn(&Vector3<f64>) -> Vec<DirectionLimit> + 'a;

/// The speeds of a job's lines.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Speeds {
    /// The largest while the laser is on [m/s].
    pub(crate) most: f64,
    /// What the job sets for all lines.
    fixed: Option<MarkingSpeed>,
    /// Where neither the job nor a line says anything, and of a job that asks for the optimum [m/s].
    pub(crate) open: f64,
}

impl Speeds {
    /// For a job that is marked as `marking` says; what it leaves open is marked as fast as the machine may.
    pub(crate) fn new(limits: &PathLimits, marking: &Marking, notes: &mut Vec<Note>) -> Self {
        let most = match marking.max_speed {
            Some(most) if most > limits.speed => {
                let text = format!(
                    "max_speed of {most} m/s is above the machine's {} m/s, which rules",
                    limits.speed
                );
                notes.push(Note { line: 0, text });
                limits.speed
            }
            Some(most) => most,
            None => limits.speed,
        };
        Self { most, fixed: marking.speed, open: most }
    }

    /// The speed that the job has for a lit stretch that asks for `asked` [m/s], however fast the machine
    /// is: the measure of power that follows the speed.
    pub(crate) fn asked(&self, asked: Option<f64>) -> f64 {
        self.named(asked).unwrap_or(self.open)
    }

    /// The speed that is named for a lit stretch whose line asks for `asked` [m/s]; `None` where it is left
    /// to the planner.
    pub(crate) fn named(&self, asked: Option<f64>) -> Option<f64> {
        match self.fixed {
            Some(MarkingSpeed::Constant(speed)) => Some(speed),
            Some(MarkingSpeed::Optimum) => None,
            None => asked,
        }
    }

    /// The speed of a lit stretch that asks for `asked` [m/s].
    pub(crate) fn of(&self, asked: Option<f64>) -> f64 {
        self.asked(asked).min(self.most)
    }
}
