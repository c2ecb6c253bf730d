//! The G-code reader: RS-274 as laser users write it, to a drawing.
//!
//! What the words mean on a laser: G0 never marks; G1, G2 and G3 mark while M3 or M4 is on and S is
//! above zero, and are followed in the dark otherwise. Under M4 the power follows the speed. What a
//! program does not say itself (full scale of S, work origins, what Z means) stands in the machine
//! file.
//!
//! Nothing is skipped in silence: a code, word or form that is not known here is a [`GcodeError`]
//! with its place, and what is accepted without effect leaves a note in the drawing. Only the codes
//! that cancel what this reader does not have anyway (G40, G49, G80, G97, G98, G99) pass unremarked.

mod error;

pub use error::GcodeError;

use crate::drawing::Drawing;

/// What a program asks for, and its extent for comparison with other interpreters.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// The program as geometry.
    pub drawing: Drawing,
    /// Its extent.
    pub facts: ProgramFacts,
}

/// Extent of a program in all three axes, before an ignored Z is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProgramFacts {
    /// Lines with at least one word that were read up to the end of the program.
    pub blocks: u64,
    /// Length of all G1, G2 and G3 moves [m].
    pub feed_length: f64,
    /// Length of all G0 and G28 moves [m].
    pub rapid_length: f64,
    /// The part of `feed_length` with the laser on [m].
    pub mark_length: f64,
    /// The last point, in the work coordinates in force at the end [m].
    pub end: [f64; 3],
    /// Lower corner of the box around start and all moves, machine frame [m].
    pub lower: [f64; 3],
    /// Upper corner of that box [m].
    pub upper: [f64; 3],
}
