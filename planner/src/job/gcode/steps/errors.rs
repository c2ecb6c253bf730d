//! All that is wrong with a program at once, so that a person need not find one thing at a time.

use std::io::Read;

use super::super::error::Needs;
use super::{Fault, Gathered, GcodeError, Refusal, Steps, Stop};

/// Errors of one file that are shown.
const MOST: usize = 20;

/// What a line before, which could not be done, leaves in doubt.
#[derive(Debug, Clone, Copy, Default)]
struct Doubts {
    motion: bool,
    feed: bool,
    place: bool,
    values: bool,
}

impl Doubts {
    const ALL: Self = Self { motion: true, feed: true, place: true, values: true };

    fn add(&mut self, other: Self) {
        self.motion |= other.motion;
        self.feed |= other.feed;
        self.place |= other.place;
        self.values |= other.values;
    }

    /// Whether a refusal may be a mere consequence.
    fn cover(self, refusal: &Refusal) -> bool {
        match refusal.needs {
            Needs::Nothing => false,
            Needs::Motion => self.motion,
            Needs::Feed => self.feed || self.motion,
            Needs::Place => self.place || self.motion,
            Needs::Values => self.values,
        }
    }
}

/// The errors of a program, from the first on.
pub(super) struct Errors {
    shown: Vec<GcodeError>,
    /// Lines that are refused for something else and not shown.
    more: u64,
    doubts: Doubts,
    /// Whether lines are only read, and not done: where a program has subroutines, conditions and
    /// loops, one that was refused leaves open which lines come next.
    only_reads: bool,
}

impl Errors {
    /// Looks at the rest of the program after the first `stop`.
    pub(super) fn find<R: Read>(mut steps: Steps<R>, stop: Stop) -> Box<GcodeError> {
        let only_reads = steps.flow.is_holding();
        let mut errors = Self { shown: Vec::new(), more: 0, doubts: Doubts::default(), only_reads };
        errors.take(&mut steps, stop);
        while !steps.ended {
            steps.interpreter.tracer.steps.clear();
            if let Err(stop) = errors.read_line(&mut steps) {
                errors.take(&mut steps, stop);
            }
        }
        errors.finish()
    }

    fn finish(self) -> Box<GcodeError> {
        let Self { shown, more, .. } = self;
        let mut shown = shown.into_iter();
        // There is the first stop at least.
        let mut first = Box::new(shown.next().unwrap_or_else(GcodeError::unknown));
        first.others = shown.collect();
        if more > 0 {
            let lines =
                if more == 1 { "one more line is" } else { &format!("{more} more lines are") };
            let last = first.others.last_mut().map_or(&mut first.help, |last| &mut last.help);
            last.push_str(&format!("\n{lines} refused, not shown"));
        }
        first
    }

    /// Takes what the present line is refused for, unless it may follow from another, and makes the
    /// best of the line.
    fn take<R: Read>(&mut self, steps: &mut Steps<R>, stop: Stop) {
        match stop {
            Stop::NoLine(fault) => {
                if self.shown.is_empty() {
                    self.shown.push(*steps.no_line(fault));
                }
                steps.ended = true;
            }
            Stop::Refused(refusal) => {
                self.clear(steps);
                let is_said = |error: &GcodeError| error.message == refusal.message;
                if !self.doubts.cover(&refusal) && !self.shown.iter().any(is_said) {
                    if self.shown.len() < MOST {
                        let error = *steps.refuse((*refusal).clone());
                        self.shown.push(error);
                    } else {
                        self.more += 1;
                    }
                }
                steps.ended = false;
                let doubts = self.recover(steps, &refusal);
                self.doubts.add(doubts);
            }
        }
    }

    /// Does of a refused line what it says soundly; gives back what it leaves in doubt.
    fn recover<R: Read>(&mut self, steps: &mut Steps<R>, refusal: &Refusal) -> Doubts {
        let unsure = Doubts { motion: true, place: true, ..Doubts::default() };
        if self.only_reads {
            return Doubts::ALL;
        }
        match steps.gather() {
            // The line was read soundly, so it was doing it that failed.
            Ok(_) => match refusal.needs {
                // An arc ends where it says.
                Needs::Place => Doubts::default(),
                Needs::Feed => Doubts { feed: true, place: true, ..Doubts::default() },
                _ => Doubts { feed: steps.block.has(b'F'), ..unsure },
            },
            Err(Fault::Illegible(_)) => Doubts::ALL,
            Err(Fault::Word(_)) => {
                let (code, soundly) = steps.gather_rest();
                if !soundly {
                    return Doubts::ALL;
                }
                if code == Some(b'G') {
                    steps.block.axes_taken = true;
                }
                // What else is wrong with the line is told when this is mended.
                let is_done = steps.execute().is_ok();
                steps.ended = false;
                match code {
                    Some(b'M') if is_done => Doubts::default(),
                    Some(b'G') | Some(b'M') => unsure,
                    _ => Doubts { values: true, ..unsure },
                }
            }
        }
    }

    /// Lets go of doubts of what the present line says itself.
    fn clear<R: Read>(&mut self, steps: &Steps<R>) {
        self.doubts.motion &= steps.block.codes.motion.is_none();
        self.doubts.feed &= !steps.block.has(b'F');
    }

    /// Goes on with the next line.
    fn read_line<R: Read>(&mut self, steps: &mut Steps<R>) -> Result<(), Stop> {
        if !self.only_reads {
            steps.read_line()?;
            self.only_reads = steps.flow.is_holding();
            self.clear(steps);
            let block = &steps.block;
            if !self.doubts.motion && block.has(b'X') && block.has(b'Y') {
                self.doubts.place &= !steps.interpreter.is_absolute();
            }
            return Ok(());
        }
        self.doubts = Doubts::ALL;
        if !steps.advance().map_err(Stop::NoLine)? {
            steps.ended = true;
            return Ok(());
        }
        match steps.gather()? {
            Gathered::Mark => steps.ended = steps.is_end_mark(),
            Gathered::Block if steps.block.ends_program() => steps.ended = true,
            Gathered::Block if steps.block.begun => steps.interpreter.tracer.facts.blocks += 1,
            Gathered::Block | Gathered::Deleted | Gathered::Statement(_) => {}
        }
        Ok(())
    }
}

impl<R: Read> Steps<R> {
    /// Reads the words of the present line that are sound into the block. Gives back the letter of the
    /// first that is not, and whether the line is made of words.
    fn gather_rest(&mut self) -> (Option<u8>, bool) {
        use super::{Token, Words};
        let Self { lines, block, interpreter, .. } = self;
        block.clear();
        let line = lines.line();
        let mut words = Words::new(line, &interpreter.words, interpreter);
        let mut first = None;
        loop {
            match words.next() {
                Ok(Some(Token::Word(word))) => {
                    let letter = word.letter;
                    if block.take(line, word, &interpreter.words).is_err() && first.is_none() {
                        first = Some(letter);
                    }
                }
                Ok(Some(_)) => {}
                Ok(None) => return (first, true),
                Err(_) => return (first, false),
            }
        }
    }
}
