//! O words: subroutines, conditions and loops, as LinuxCNC has them, and the programs that M98 calls.

mod statement;

use std::collections::HashMap;
use std::io::Read;
use std::ops::Range;

use super::error::Refusal;
use super::interpreter::Interpreter;
use super::lines::{Lines, NoLine, Place};
pub(super) use statement::{Statement, statement};
use statement::{Word, of_line};

/// Subroutines within subroutines.
const DEEPEST: usize = 10;

/// Conditions and loops within each other.
const MOST_FRAMES: usize = 1000;

/// Arguments of a subroutine.
const MOST_ARGUMENTS: usize = 30;

/// Why the flow stops.
pub(super) enum Stop {
    /// The present line is at fault.
    Refused(Box<Refusal>),
    /// The line after it cannot be read.
    NoLine(NoLine),
}

impl From<Box<Refusal>> for Stop {
    fn from(refusal: Box<Refusal>) -> Self {
        Self::Refused(refusal)
    }
}

/// What is being run.
#[derive(Debug)]
enum Frame {
    /// A condition, one of whose branches is being run.
    If(String),
    While(String, Place),
    Do(String, Place),
    /// With how many rounds are left after this one.
    Repeat(String, Place, u64),
    /// A subroutine or program.
    Call(Call),
}

/// A subroutine or program that is being run.
#[derive(Debug)]
struct Call {
    label: String,
    start: Place,
    /// What comes after it.
    back: Place,
    /// How often it is still to be run.
    left: u64,
    /// Whether M98 has called it.
    is_program: bool,
}

/// Where a program is in its subroutines, conditions and loops.
#[derive(Debug)]
pub(super) struct Flow {
    /// The places after the heads of subroutines.
    subs: HashMap<String, Place>,
    /// And of programs that M98 has called.
    programs: HashMap<String, Place>,
    frames: Vec<Frame>,
    /// Line from which on text is held, 0 where none is.
    held: u64,
    /// Lines gone through since, and how many may be.
    passed: u64,
    most: u64,
}

impl Flow {
    /// Of a program that goes through no more than `most` lines.
    pub(super) fn new(most: u64) -> Self {
        let (subs, programs) = (HashMap::new(), HashMap::new());
        Self { subs, programs, frames: Vec::new(), held: 0, passed: 0, most }
    }

    /// Whether earlier lines may come again.
    pub(super) fn is_holding(&self) -> bool {
        self.held > 0
    }

    /// Counts a line that is gone through.
    pub(super) fn pass(&mut self) -> Result<(), Box<Refusal>> {
        self.passed += 1;
        if self.passed <= self.most {
            return Ok(());
        }
        Err(Refusal::new(
            0..1,
            format!("the program has gone through {} lines here: a loop has no end", self.most),
            "here it was stopped",
            "see that the loop's condition becomes 0",
        ))
    }

    fn hold<R: Read>(&mut self, lines: &mut Lines<R>) {
        if self.held == 0 {
            self.held = lines.number();
            lines.hold();
        }
    }

    fn push(&mut self, frame: Frame, statement: &Statement) -> Result<(), Stop> {
        if self.frames.len() >= MOST_FRAMES {
            let message = format!("more than {MOST_FRAMES} conditions and loops are open");
            return Err(statement.refuse(message, "is an endif or an endwhile missing?").into());
        }
        self.frames.push(frame);
        Ok(())
    }

    /// Does what the O word of the present line says.
    pub(super) fn run<R: Read>(
        &mut self,
        statement: &Statement,
        lines: &mut Lines<R>,
        interpreter: &mut Interpreter,
    ) -> Result<(), Stop> {
        let label = &statement.label;
        match statement.word {
            Word::Number => self.number(statement),
            Word::Sub => {
                self.hold(lines);
                self.subs.insert(label.clone(), lines.place());
                self.skip(statement, &[Word::EndSub], lines).map(|_| ())
            }
            Word::Call => {
                let arguments = statement.values(lines.line(), MOST_ARGUMENTS, interpreter)?;
                let Some(start) = self.find(statement, Word::Sub, lines)? else {
                    let message = format!("there is no {} sub in this file", statement.name());
                    let help = "a subroutine that is called is in the same file";
                    return Err(statement.refuse(message, help).into());
                };
                self.check_depth(statement, interpreter)?;
                interpreter.parameters.enter(&arguments);
                interpreter.parameters.returned = None;
                self.call(statement, start, 1, false, lines)
            }
            Word::Return | Word::EndSub => {
                let value = statement.values(lines.line(), 1, interpreter)?.first().copied();
                let called = self.frames.iter().rev().find_map(|frame| match frame {
                    Frame::Call(call) if !call.is_program => Some(&call.label),
                    _ => None,
                });
                if called != Some(label) {
                    let message = format!("{} is not being run here", statement.name());
                    return Err(statement.refuse(message, "is its sub or call missing?").into());
                }
                interpreter.parameters.returned = value;
                self.come_back(lines, interpreter);
                Ok(())
            }
            Word::If => {
                let mut is = statement.condition(lines.line(), interpreter)? != 0.0;
                while !is {
                    let ends = [Word::ElseIf, Word::Else, Word::EndIf];
                    let next = self.skip(statement, &ends, lines)?;
                    interpreter.tracer.line = lines.number();
                    is = match next.word {
                        Word::ElseIf => next.condition(lines.line(), interpreter)? != 0.0,
                        Word::Else => true,
                        _ => return Ok(()),
                    };
                }
                self.push(Frame::If(label.clone()), statement)
            }
            // A branch was run before: the others are not.
            Word::ElseIf | Word::Else | Word::EndIf => {
                self.leave(statement, |frame| matches!(frame, Frame::If(of) if of == label))?;
                if statement.word != Word::EndIf {
                    self.skip(statement, &[Word::EndIf], lines)?;
                }
                Ok(())
            }
            Word::While => self.while_(statement, lines, interpreter),
            Word::EndWhile => {
                let is_it = |frame: &Frame| matches!(frame, Frame::While(of, _) if of == label);
                if let Frame::While(_, start) = self.leave(statement, is_it)? {
                    lines.go_to(start);
                }
                Ok(())
            }
            Word::Do => {
                self.hold(lines);
                let start = lines.place();
                self.push(Frame::Do(label.clone(), start), statement)
            }
            Word::Repeat => {
                let rounds = statement.condition(lines.line(), interpreter)?.round();
                if rounds < 1.0 {
                    return self.skip(statement, &[Word::EndRepeat], lines).map(|_| ());
                }
                self.hold(lines);
                let frame = Frame::Repeat(label.clone(), lines.place(), rounds as u64 - 1);
                self.push(frame, statement)
            }
            Word::EndRepeat => {
                let is_it = |frame: &Frame| matches!(frame, Frame::Repeat(of, ..) if of == label);
                if let Frame::Repeat(of, start, left) = self.leave(statement, is_it)?
                    && left > 0
                {
                    self.frames.push(Frame::Repeat(of, start, left - 1));
                    lines.go_to(start);
                }
                Ok(())
            }
            Word::Break | Word::Continue => self.leave_round(statement, lines),
        }
    }

    /// A program's number: the main program's says nothing.
    fn number(&self, statement: &Statement) -> Result<(), Stop> {
        if self.frames.is_empty() && !self.programs.contains_key(&statement.label) {
            return Ok(());
        }
        let message = format!("the program runs into O{}", statement.label);
        let help = "end the main program with M30 before it, and a program that M98 calls with M99";
        Err(statement.refuse(message, help).into())
    }

    fn while_<R: Read>(
        &mut self,
        statement: &Statement,
        lines: &mut Lines<R>,
        interpreter: &mut Interpreter,
    ) -> Result<(), Stop> {
        let label = &statement.label;
        let is = statement.condition(lines.line(), interpreter)? != 0.0;
        if let Some(Frame::Do(of, start)) = self.frames.last()
            && of == label
        {
            let start = *start;
            if is {
                lines.go_to(start);
            } else {
                self.frames.pop();
            }
            return Ok(());
        }
        if !is {
            return self.skip(statement, &[Word::EndWhile], lines).map(|_| ());
        }
        self.hold(lines);
        let start = lines.start();
        self.push(Frame::While(label.clone(), start), statement)
    }

    /// `break` and `continue`.
    fn leave_round<R: Read>(
        &mut self,
        statement: &Statement,
        lines: &mut Lines<R>,
    ) -> Result<(), Stop> {
        let label = &statement.label;
        let goes_on = statement.word == Word::Continue;
        loop {
            match self.frames.pop() {
                Some(Frame::If(_)) => {}
                Some(Frame::While(of, start)) if of == *label => {
                    if goes_on {
                        lines.go_to(start);
                    } else {
                        self.skip(statement, &[Word::EndWhile], lines)?;
                    }
                    return Ok(());
                }
                Some(Frame::Do(of, start)) if of == *label => {
                    self.skip(statement, &[Word::While], lines)?;
                    if goes_on {
                        self.frames.push(Frame::Do(of, start));
                        lines.go_to(lines.start());
                    }
                    return Ok(());
                }
                Some(Frame::While(..) | Frame::Do(..)) => {}
                Some(Frame::Repeat(..) | Frame::Call(_)) | None => {
                    let message = format!("no loop {} is being run here", statement.name());
                    let help = "break and continue have the number of their loop, of while or do";
                    return Err(statement.refuse(message, help).into());
                }
            }
        }
    }

    /// Takes the innermost frame, which must be the one that `is_it` knows.
    fn leave(
        &mut self,
        statement: &Statement,
        is_it: impl Fn(&Frame) -> bool,
    ) -> Result<Frame, Stop> {
        match self.frames.pop() {
            Some(frame) if is_it(&frame) => Ok(frame),
            _ => {
                let message = format!("nothing that {} ends is open here", statement.name());
                let help = "conditions, loops and subroutines have the same number at their beginning and \
                            end, and do not overlap";
                Err(statement.refuse(message, help).into())
            }
        }
    }

    /// Passes over lines up to the next with the label of `statement` and one of `words`.
    fn skip<R: Read>(
        &mut self,
        statement: &Statement,
        words: &[Word],
        lines: &mut Lines<R>,
    ) -> Result<Statement, Stop> {
        let from = lines.number();
        loop {
            match lines.advance() {
                Ok(true) => {}
                Ok(false) => {
                    let name = statement.name();
                    let message = format!("{name} of line {from} has no end in this file");
                    let help = "sub ends with endsub, if with endif, while with endwhile, repeat with \
                                endrepeat, all with the same number";
                    return Err(Refusal::new(0..0, message, "end of the file", help).into());
                }
                Err(fault) => return Err(Stop::NoLine(fault)),
            }
            if self.is_holding() {
                self.pass()?;
            }
            let Some(found) = of_line(lines.line()) else { continue };
            if found.label == statement.label && words.contains(&found.word) {
                return Ok(found);
            }
        }
    }

    /// Where the subroutine or program begins that `statement` names, before this line or after it.
    fn find<R: Read>(
        &mut self,
        statement: &Statement,
        word: Word,
        lines: &mut Lines<R>,
    ) -> Result<Option<Place>, Stop> {
        self.hold(lines);
        let known = if word == Word::Sub { &mut self.subs } else { &mut self.programs };
        if let Some(place) = known.get(&statement.label) {
            return Ok(Some(*place));
        }
        let here = lines.start();
        let mut place = None;
        while place.is_none() && lines.advance().map_err(Stop::NoLine)? {
            let Some(found) = of_line(lines.line()) else { continue };
            if found.word == word && found.label == statement.label {
                place = Some(lines.place());
                known.insert(found.label, lines.place());
            }
        }
        lines.go_to(here);
        lines.advance().map_err(Stop::NoLine)?;
        Ok(place)
    }

    fn check_depth(
        &self,
        statement: &Statement,
        interpreter: &Interpreter,
    ) -> Result<(), Box<Refusal>> {
        if interpreter.parameters.level() < DEEPEST {
            return Ok(());
        }
        let message = format!("subroutines are nested more than {DEEPEST} deep");
        Err(statement.refuse(message, "does one call itself?"))
    }

    fn call<R: Read>(
        &mut self,
        statement: &Statement,
        start: Place,
        times: u64,
        is_program: bool,
        lines: &mut Lines<R>,
    ) -> Result<(), Stop> {
        let (label, back) = (statement.label.clone(), lines.place());
        let call = Call { label, start, back, left: times - 1, is_program };
        self.push(Frame::Call(call), statement)?;
        lines.go_to(start);
        Ok(())
    }

    /// Ends the subroutine or program that is being run, or begins its next round.
    fn come_back<R: Read>(&mut self, lines: &mut Lines<R>, interpreter: &mut Interpreter) {
        while let Some(frame) = self.frames.pop() {
            let Frame::Call(mut call) = frame else { continue };
            if call.left > 0 {
                lines.go_to(call.start);
                call.left -= 1;
                self.frames.push(Frame::Call(call));
            } else {
                interpreter.parameters.leave(call.is_program);
                lines.go_to(call.back);
            }
            return;
        }
    }

    /// M98: runs the program `number`, which may stand anywhere after this line.
    pub(super) fn call_program<R: Read>(
        &mut self,
        number: u64,
        times: u64,
        span: Range<usize>,
        lines: &mut Lines<R>,
        interpreter: &mut Interpreter,
    ) -> Result<(), Stop> {
        let label = number.to_string();
        let statement = Statement { label, word: Word::Number, rest: span.end, span };
        let Some(start) = self.find(&statement, Word::Number, lines)? else {
            let message = format!("there is no program O{number} after this line");
            let help = "M98 P1000 calls the program that begins with O1000 and ends with M99, in this file";
            return Err(statement.refuse(message, help).into());
        };
        if times == 0 {
            return Ok(());
        }
        self.check_depth(&statement, interpreter)?;
        interpreter.parameters.enter_program();
        self.call(&statement, start, times, true, lines)
    }

    /// M99: ends a program that M98 has called.
    pub(super) fn end_program<R: Read>(
        &mut self,
        span: Range<usize>,
        lines: &mut Lines<R>,
        interpreter: &mut Interpreter,
    ) -> Result<(), Stop> {
        let called = self.frames.iter().rev().find_map(|frame| match frame {
            Frame::Call(call) => Some(call.is_program),
            _ => None,
        });
        if called == Some(true) {
            self.come_back(lines, interpreter);
            return Ok(());
        }
        Err(Refusal::new(
            span,
            "M99 in the main program would begin it again, for ever",
            "M99",
            "end the main program with M30; M99 ends a program that M98 calls",
        )
        .into())
    }

    /// Refuses the end of a file inside a subroutine, condition or loop.
    pub(super) fn check_end(&self) -> Result<(), Box<Refusal>> {
        let Some(frame) = self.frames.last() else { return Ok(()) };
        let label = match frame {
            // Lines that are run by chance, as LinuxCNC does where an endif is missing.
            Frame::If(_) => return Ok(()),
            Frame::While(label, _) | Frame::Do(label, _) | Frame::Repeat(label, ..) => label,
            Frame::Call(call) => &call.label,
        };
        Err(Refusal::new(
            0..0,
            format!("the file ends inside o{label}"),
            "end of the file",
            "end conditions and loops, and programs that M98 calls with M99",
        ))
    }
}
