//! A program as a stream: a block is read, done and forgotten, so that memory does not depend on the
//! program's length.

use std::io::Read;
use std::ops::Range;

use super::block::Block;
use super::error::{GcodeError, Refusal};
use super::interpreter::{Interpreter, Remark};
use super::lexer::{Token, Words};
use super::lines::{Around, LONGEST_LINE, Lines, MOST_HELD, NoLine};
use super::settings::ReaderSettings;
use super::survey::Survey;
use crate::drawing::{Note, Step};

/// Steps that are read ahead.
const BATCH: usize = 256;

/// How many errors of one file are worth reading at once.
const MOST_ERRORS: usize = 10;

/// The steps of a program, in order, read as they are asked for.
///
/// An error ends them. Its place, and what it says, are those of a reading of the whole program.
#[derive(Debug)]
pub struct Steps<R> {
    name: String,
    lines: Lines<R>,
    block: Block,
    interpreter: Interpreter,
    /// How many of the steps that have been read are handed out.
    taken: usize,
    /// Whether the program has ended, by itself or by an error.
    ended: bool,
    /// An error behind the steps that have been read.
    error: Option<Box<GcodeError>>,
    /// Whether a tape mark has begun the program.
    tape: bool,
    /// A tape mark inside a program that none has begun, before any words after it.
    stray_mark: Option<u64>,
}

/// What a line turned out to be.
enum Gathered {
    /// Words, or nothing.
    Block,
    /// A tape mark, `%`.
    Mark,
}

/// Why a line is refused.
enum Fault {
    /// It is not made of words.
    Illegible(Box<Refusal>),
    /// A word of it is not known here, or contradicts another.
    Word(Box<Refusal>),
}

impl<R: Read> Steps<R> {
    /// Of the program that `source` gives; `name` is its name in errors.
    pub(super) fn new(name: &str, source: R, settings: &ReaderSettings) -> Self {
        Self {
            name: name.to_owned(),
            lines: Lines::new(source),
            block: Block::new(),
            interpreter: Interpreter::new(settings),
            taken: 0,
            ended: false,
            error: None,
            tape: false,
            stray_mark: None,
        }
    }

    /// Reads the whole program. Gives back what it comes to and its steps, unless these are of more
    /// than `most` lines: then they are counted alone.
    pub(super) fn read_through(
        mut self,
        most: u64,
    ) -> Result<(Survey, Option<Vec<Step>>), Box<GcodeError>> {
        let mut dropped = 0;
        while !self.ended {
            if let Err(error) = self.read_block() {
                return Err(self.with_others(error));
            }
            let tracer = &mut self.interpreter.tracer;
            if tracer.line > most {
                dropped += tracer.steps.len();
                tracer.steps.clear();
                tracer.steps.shrink_to(BATCH);
            }
        }
        self.note_rest();
        let Interpreter { tracer, notes, zeros, .. } = self.interpreter;
        let survey = Survey {
            facts: tracer.facts,
            zero: zeros.only(),
            notes,
            lines: tracer.line,
            steps: (dropped + tracer.steps.len()) as u64,
            time: tracer.time,
            tolerance: tracer.tolerance,
        };
        Ok((survey, (tracer.line <= most).then_some(tracer.steps)))
    }

    /// Reads the next line and does what it says.
    fn read_block(&mut self) -> Result<(), Box<GcodeError>> {
        match self.lines.advance() {
            Ok(true) => self.interpreter.tracer.line += 1,
            Ok(false) => {
                self.end();
                return Ok(());
            }
            Err(fault) => return Err(self.no_line(fault)),
        }
        let done = match self.gather() {
            Ok(Gathered::Mark) => Ok(self.is_end_mark()),
            Ok(Gathered::Block) if self.block.begun => {
                if let Some(line) = self.stray_mark.take() {
                    self.interpreter.remark_at(line, Remark::TapeMark);
                }
                self.interpreter.execute(self.lines.line(), &mut self.block)
            }
            Ok(Gathered::Block) => Ok(false),
            Err(Fault::Illegible(refusal) | Fault::Word(refusal)) => Err(refusal),
        };
        match done {
            Ok(true) => self.end(),
            Ok(false) => {}
            Err(refusal) => return Err(self.refuse(*refusal)),
        }
        Ok(())
    }

    /// Reads the present line into the block.
    fn gather(&mut self) -> Result<Gathered, Fault> {
        let Self { lines, block, interpreter, .. } = self;
        block.clear();
        let line = lines.line();
        let is_first = interpreter.tracer.line == 1;
        let meanings = &interpreter.words;
        let mut words =
            if is_first { Words::first(line, meanings) } else { Words::new(line, meanings) };
        while let Some(token) = words.next().map_err(Fault::Illegible)? {
            match token {
                Token::Word(word) => block.take(line, word, meanings).map_err(Fault::Word)?,
                Token::Further(number, span) => block.cluster.push((number, span)),
                Token::Program(at) => {
                    program_number(line, at, words.rest()).map_err(Fault::Word)?;
                    return Ok(Gathered::Block);
                }
                Token::Delete => {
                    interpreter.remark(Remark::BlockDelete);
                    return Ok(Gathered::Block);
                }
                Token::Tape(at) => {
                    if !block.begun && words.next().map_err(Fault::Illegible)?.is_none() {
                        return Ok(Gathered::Mark);
                    }
                    return Err(Fault::Illegible(Refusal::new(
                        at..at + 1,
                        "% is not alone on its line",
                        "tape mark",
                        "% on a line of its own begins or ends a program",
                    )));
                }
            }
        }
        block.check_gathered().map_err(Fault::Word)?;
        Ok(Gathered::Block)
    }

    /// Whether the tape mark that was read ends the program: one that a tape mark has begun. Inside
    /// another program it is passed over, as Grbl does.
    fn is_end_mark(&mut self) -> bool {
        if self.tape {
            return true;
        }
        if self.interpreter.tracer.facts.blocks == 0 {
            self.tape = true;
        } else {
            self.stray_mark = Some(self.interpreter.tracer.line);
        }
        false
    }

    /// Notes how many lines after the program's end have words, which are not read.
    fn note_rest(&mut self) {
        let mut rest = 0_u64;
        while let Ok(true) = self.lines.advance() {
            let first = self.lines.line().trim_ascii_start().first();
            rest += u64::from(first.is_some_and(u8::is_ascii_alphabetic));
        }
        if rest > 0 {
            let lines = if rest == 1 { "one line" } else { &format!("{rest} lines") };
            let line = self.interpreter.tracer.line;
            let text = format!("the program ends here: {lines} with words after it, not read");
            self.interpreter.notes.push(Note { line, text });
        }
    }

    fn end(&mut self) {
        self.ended = true;
        self.interpreter.finish();
    }

    /// Looks at the rest of the program for what is not supported, so that a person need not find one
    /// thing at a time. What depends on the lines before is left out: it may be a mere consequence.
    fn with_others(mut self, mut first: Box<GcodeError>) -> Box<GcodeError> {
        while first.others.len() + 1 < MOST_ERRORS && matches!(self.lines.advance(), Ok(true)) {
            self.interpreter.tracer.line += 1;
            match self.gather() {
                Ok(Gathered::Mark) if self.is_end_mark() => break,
                Ok(Gathered::Block) if self.block.ends_program() => break,
                Ok(Gathered::Block) if self.block.begun => {
                    self.interpreter.tracer.facts.blocks += 1;
                }
                // What is not made of words at all may be no G-code.
                Ok(_) | Err(Fault::Illegible(_)) => {}
                Err(Fault::Word(refusal)) => {
                    let said = |error: &GcodeError| error.message == refusal.message;
                    if !said(&first) && !first.others.iter().any(said) {
                        let error = self.refuse(*refusal);
                        first.others.push(*error);
                    }
                }
            }
        }
        first
    }

    /// The error of a refusal in the present line.
    fn refuse(&mut self, refusal: Refusal) -> Box<GcodeError> {
        self.ended = true;
        let number = self.interpreter.tracer.line;
        let around = self.lines.around();
        Box::new(GcodeError::new(&self.name, number, self.lines.line(), &around, refusal))
    }

    /// The error of a line that cannot be read.
    fn no_line(&mut self, fault: NoLine) -> Box<GcodeError> {
        self.ended = true;
        let number = self.interpreter.tracer.line + 1;
        let refusal = match fault {
            NoLine::Unreadable(cause) => Refusal::new(
                0..0,
                format!("the program cannot be read on: {cause}"),
                "not read",
                "see that the file is there and stays as it is while it is read",
            ),
            NoLine::TooLong => Refusal::new(
                0..0,
                format!("the line is longer than {LONGEST_LINE} bytes"),
                "too long",
                "is this a G-code program? Its lines end with a line feed",
            ),
            NoLine::TooMuchHeld => Refusal::new(
                0..0,
                format!("the program goes on for more than {} MiB", MOST_HELD >> 20),
                "too long",
                "a program with subroutines or loops is held in memory: write it shorter, or write the \
                 moves out",
            ),
        };
        Box::new(GcodeError::new(&self.name, number, &[], &Around::default(), *refusal))
    }
}

/// Takes the number of a program, whose `O` or `:` is at `at` and whose digits stand in `rest`.
fn program_number(line: &[u8], at: usize, rest: Range<usize>) -> Result<(), Box<Refusal>> {
    let text = line[rest].trim_ascii_start();
    let digits = text.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let after = text[digits..].trim_ascii_start();
    if digits > 0 && matches!(after.first(), None | Some(b'(' | b';')) {
        return Ok(());
    }
    Err(Refusal::new(
        at..at + 1,
        "O words (subroutines, loops, conditions) are not supported",
        "O word",
        "write the moves out",
    ))
}

impl<R: Read> Iterator for Steps<R> {
    type Item = Result<Step, Box<GcodeError>>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.taken == self.interpreter.tracer.steps.len() {
            self.taken = 0;
            self.interpreter.tracer.steps.clear();
            while !self.ended && self.interpreter.tracer.steps.len() < BATCH {
                self.error = self.read_block().err();
            }
        }
        match self.interpreter.tracer.steps.get(self.taken) {
            Some(step) => {
                self.taken += 1;
                Some(Ok(step.clone()))
            }
            None => self.error.take().map(Err),
        }
    }
}
