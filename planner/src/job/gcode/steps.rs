//! A program as a stream: a block is read, done and forgotten, so that memory does not depend on the
//! program's length.

mod errors;

use std::io::Read;

use self::errors::Errors;
use super::block::Block;
use super::error::{GcodeError, Refusal};
use super::flow::{self, Flow, Statement, Stop};
use super::interpreter::{Interpreter, Next, Remark};
use super::lexer::{Token, Words};
use super::lines::{Around, LONGEST_LINE, Lines, MOST_HELD, NoLine};
use super::settings::ReaderSettings;
use super::survey::Survey;
use crate::drawing::{Note, Step};

/// Steps that are read ahead.
const BATCH: usize = 256;

/// The steps of a program, in order, read as they are asked for.
///
/// An error ends them. Its place, and what it says, are those of a reading of the whole program.
#[derive(Debug)]
pub struct Steps<R> {
    name: String,
    lines: Lines<R>,
    block: Block,
    interpreter: Interpreter,
    flow: Flow,
    /// Lines that have been read, each as often as it was run.
    read: u64,
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
    /// The line to begin with, as long as it has not come.
    awaited: Option<u64>,
}

/// What a line turned out to be.
pub(super) enum Gathered {
    /// Words, or nothing.
    Block,
    /// Left out by `/`.
    Deleted,
    /// An O word.
    Statement(Statement),
    /// A tape mark, `%`.
    Mark,
}

/// Why a line is refused.
pub(super) enum Fault {
    /// It is not made of words.
    Illegible(Box<Refusal>),
    /// A word of it is not known here, or contradicts another.
    Word(Box<Refusal>),
}

impl From<Fault> for Stop {
    fn from(fault: Fault) -> Self {
        let (Fault::Illegible(refusal) | Fault::Word(refusal)) = fault;
        Self::Refused(refusal)
    }
}

impl<R: Read> Steps<R> {
    /// Of the program that `source` gives; `name` is its name in errors.
    pub(super) fn new(name: &str, source: R, settings: &ReaderSettings) -> Self {
        Self {
            name: name.to_owned(),
            lines: Lines::new(source),
            block: Block::new(),
            interpreter: Interpreter::new(settings),
            flow: Flow::new(settings.most_lines),
            read: 0,
            taken: 0,
            ended: false,
            error: None,
            tape: false,
            stray_mark: None,
            awaited: settings.from_line,
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
            if let Err(stop) = self.read_line() {
                return Err(Errors::find(self, stop));
            }
            self.pass_over_before()?;
            let tracer = &mut self.interpreter.tracer;
            if self.read > most {
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
            lines: self.read,
            steps: (dropped + tracer.steps.len()) as u64,
            time: tracer.time,
            tolerance: tracer.tolerance,
        };
        Ok((survey, (self.read <= most).then_some(tracer.steps)))
    }

    /// Goes to the next line. Gives back whether there is one.
    fn advance(&mut self) -> Result<bool, NoLine> {
        let is_there = self.lines.advance()?;
        self.read += u64::from(is_there);
        self.interpreter.tracer.line = self.lines.number();
        Ok(is_there)
    }

    /// Reads the next line and does what it says.
    fn read_line(&mut self) -> Result<(), Stop> {
        if !self.advance().map_err(Stop::NoLine)? {
            self.flow.check_end()?;
            self.end();
            return Ok(());
        }
        if self.flow.is_holding() {
            self.flow.pass()?;
        }
        if self.awaited == Some(self.lines.number()) {
            self.awaited = None;
            self.interpreter.begin_here();
        }
        match self.gather()? {
            Gathered::Block if self.block.begun => self.execute(),
            Gathered::Block => Ok(()),
            Gathered::Deleted => {
                self.interpreter.remark(Remark::BlockDelete);
                Ok(())
            }
            Gathered::Statement(statement) => {
                self.flow.run(&statement, &mut self.lines, &mut self.interpreter)
            }
            Gathered::Mark => {
                if self.is_end_mark() {
                    self.end();
                }
                Ok(())
            }
        }
    }

    /// Does what the block says.
    fn execute(&mut self) -> Result<(), Stop> {
        if let Some(line) = self.stray_mark.take() {
            self.interpreter.remark_at(line, Remark::TapeMark);
        }
        let Self { lines, interpreter, flow, block, .. } = self;
        match interpreter.execute(lines.line(), block)? {
            Next::Line => {}
            Next::End => self.end(),
            Next::Program { number, times, span } => {
                flow.call_program(number, times, span, lines, interpreter)?;
            }
            Next::Return(span) => flow.end_program(span, lines, interpreter)?,
        }
        Ok(())
    }

    /// Reads the present line into the block.
    fn gather(&mut self) -> Result<Gathered, Fault> {
        let Self { lines, block, interpreter, .. } = self;
        let is_first = interpreter.tracer.line == 1;
        gather(lines.line(), is_first, block, interpreter)
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
        // What follows may be the programs that M98 calls.
        if self.flow.is_holding() {
            return;
        }
        let mut rest = 0_u64;
        let line = self.interpreter.tracer.line;
        while let Ok(true) = self.lines.advance() {
            let first = self.lines.line().trim_ascii_start().first();
            rest += u64::from(first.is_some_and(u8::is_ascii_alphabetic));
        }
        if rest > 0 {
            let lines = if rest == 1 { "one line" } else { &format!("{rest} lines") };
            let text = format!("the program ends here: {lines} with words after it, not read");
            self.interpreter.notes.push(Note { line, text });
        }
    }

    fn end(&mut self) {
        self.ended = true;
        self.interpreter.finish();
    }

    /// Lets go of what is drawn before the line to begin with.
    fn pass_over_before(&mut self) -> Result<(), Box<GcodeError>> {
        let Some(awaited) = self.awaited else { return Ok(()) };
        self.interpreter.tracer.steps.clear();
        if !self.ended {
            return Ok(());
        }
        let last = self.lines.number();
        let message = if awaited > last {
            format!("there is no line {awaited} to begin with: the program ends at line {last}")
        } else {
            format!(
                "line {awaited} to begin with is not run: the program passes over it and ends at line \
                 {last}"
            )
        };
        let help = format!("give `from_line` as a whole number from 1 to {last}");
        Err(self.refuse(*Refusal::new(0..0, message, "the last line", help)))
    }

    /// The error of a stop.
    fn error(&mut self, stop: Stop) -> Box<GcodeError> {
        match stop {
            Stop::Refused(refusal) => self.refuse(*refusal),
            Stop::NoLine(fault) => self.no_line(fault),
        }
    }

    /// The error of a refusal in the present line.
    fn refuse(&mut self, refusal: Refusal) -> Box<GcodeError> {
        self.ended = true;
        let number = self.lines.number();
        let around = self.lines.around();
        Box::new(GcodeError::new(&self.name, number, self.lines.line(), &around, refusal))
    }

    /// The error of a line that cannot be read.
    fn no_line(&mut self, fault: NoLine) -> Box<GcodeError> {
        self.ended = true;
        let number = self.lines.number() + 1;
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

/// Reads `line` into the block, and sets the parameters that it sets; the first line of a file may begin with a byte order
/// mark.
pub(super) fn gather(
    line: &[u8],
    is_first: bool,
    block: &mut Block,
    interpreter: &mut Interpreter,
) -> Result<Gathered, Fault> {
    block.clear();
    let meanings = &interpreter.words;
    let mut words = if is_first {
        Words::first(line, meanings, interpreter)
    } else {
        Words::new(line, meanings, interpreter)
    };
    while let Some(token) = words.next().map_err(Fault::Illegible)? {
        match token {
            Token::Word(word) => block.take(line, word, meanings).map_err(Fault::Word)?,
            Token::Further(number, span) => block.cluster.push((number, span)),
            Token::Setting(target, value) => {
                block.begun = true;
                block.settings.push((target, value));
            }
            Token::Program(at) => {
                return flow::statement(line, at).map(Gathered::Statement).map_err(Fault::Word);
            }
            Token::Delete => return Ok(Gathered::Deleted),
            Token::Tape(at) => {
                if !block.begun && matches!(words.next(), Ok(None)) {
                    return Ok(Gathered::Mark);
                }
                return Err(Fault::Illegible(Refusal::new(
                    at..at + 1,
                    "% is not alone on its line",
                    "tape mark",
                    "% on a line of its own begins or ends a program; a comment begins with ; or \
                     stands in ( )",
                )));
            }
        }
    }
    block.check_gathered().map_err(Fault::Word)?;
    for (target, value) in block.settings.drain(..) {
        if !interpreter.set(target, value) {
            return Err(Fault::Word(Refusal::new(
                0..line.len(),
                "the program has too many parameters",
                "one too many",
                "set those again that are no longer needed",
            )));
        }
    }
    Ok(Gathered::Block)
}

impl<R: Read> Iterator for Steps<R> {
    type Item = Result<Step, Box<GcodeError>>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.taken == self.interpreter.tracer.steps.len() {
            self.taken = 0;
            self.interpreter.tracer.steps.clear();
            while !self.ended && self.interpreter.tracer.steps.len() < BATCH {
                let read = self.read_line().map_err(|stop| self.error(stop));
                self.error = read.and_then(|()| self.pass_over_before()).err();
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
