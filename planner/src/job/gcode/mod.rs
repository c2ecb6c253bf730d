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

mod arc;
mod block;
mod codes;
mod error;
mod interpreter;
mod lexer;
#[cfg(test)]
mod tests;
mod tracer;

use std::ops::Range;

use machine::Machine;
use nalgebra::Vector3;

pub use error::GcodeError;

use self::block::Block;
use self::error::Refusal;
use self::interpreter::{Interpreter, Remark};
use self::lexer::{Token, Words};
use self::tracer::Tracer;
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
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, schemars::JsonSchema)]
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

/// Reads the program `text`; `file` is its name in errors and of the drawing.
///
/// # Errors
/// The first thing that is not G-code, not supported here, or contradicts itself.
pub fn read(file: &str, text: &str, machine: &Machine) -> Result<Program, Box<GcodeError>> {
    interpret(text, machine)
        .map(|(interpreter, start)| {
            let Tracer { steps, facts, .. } = interpreter.tracer;
            let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
            let name = name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_owned();
            Program { drawing: Drawing { name, start, steps, notes: interpreter.notes }, facts }
        })
        .map_err(|refusal| Box::new(GcodeError::new(file, text, *refusal)))
}

/// Runs `text` line by line to its end.
fn interpret<'a>(
    text: &'a str,
    machine: &'a Machine,
) -> Result<(Interpreter<'a>, Vector3<f64>), Box<Refusal>> {
    let mut interpreter = Interpreter::new(text, machine);
    let mut block = Block::new();
    // Some editors begin a file with a byte order mark.
    let mut from = text.len() - text.trim_start_matches('\u{feff}').len();
    let mut tape = false;
    while from < text.len() {
        let to = text.as_bytes()[from..]
            .iter()
            .position(|&byte| byte == b'\n')
            .map_or(text.len(), |length| from + length);
        interpreter.tracer.line += 1;
        let mark = gather(text, from..to, &mut block, &mut interpreter)?;
        from = to + 1;
        if mark {
            if std::mem::replace(&mut tape, true) || interpreter.tracer.facts.blocks > 0 {
                break;
            }
        } else if block.begun && interpreter.execute(&mut block)? {
            break;
        }
    }
    interpreter.finish();
    Ok((interpreter, Vector3::from(machine.home)))
}

/// Reads one line into `block`. Gives back whether it is a tape mark instead.
fn gather(
    text: &str,
    line: Range<usize>,
    block: &mut Block,
    interpreter: &mut Interpreter<'_>,
) -> Result<bool, Box<Refusal>> {
    block.clear();
    let mut words = Words::new(text, line);
    while let Some(token) = words.next()? {
        match token {
            Token::Word(word) => block.take(text, word)?,
            Token::Delete => {
                interpreter.remark(Remark::BlockDelete);
                return Ok(false);
            }
            Token::Tape(at) => {
                if !block.begun && words.next()?.is_none() {
                    return Ok(true);
                }
                return Err(Refusal::new(
                    at..at + 1,
                    "% is not alone on its line",
                    "tape mark",
                    "% on a line of its own begins or ends a program",
                ));
            }
        }
    }
    Ok(false)
}
