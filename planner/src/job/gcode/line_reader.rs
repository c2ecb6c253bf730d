//! A program whose lines come one by one, as a person or a sender types them: each is read and done at once, or
//! refused and changes nothing.
//!
//! What needs the rest of a program is refused: subroutines, conditions and loops.

use machine::Machine;
use machine::gcode_settings::LaserMode;
use nalgebra::Vector3;

use super::block::Block;
use super::codes::{FeedMode, INCH, Motion, Once, Plane, Reference};
use super::error::Refusal;
use super::interpreter::{Interpreter, Modal, Next};
use super::settings::ReaderSettings;
use super::steps::{Fault, Gathered, gather};
use crate::drawing::{Action, Corners};

/// Seconds in a minute.
const MINUTE: f64 = 60.0;

/// What stays in force from line to line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modals {
    /// 0 to 3 for G0 to G3, `None` before any.
    pub motion: Option<u8>,
    /// 54 to 59 for G54 to G59; 59.1 to 59.3 count on as 60 to 62.
    pub system: u8,
    /// 17, 18 or 19.
    pub plane: u8,
    /// Whether lengths are inches (G20).
    pub is_inch: bool,
    /// Whether coordinates are from where the tool is (G91).
    pub is_incremental: bool,
    /// Whether F is one over the minutes of a move (G93).
    pub is_inverse_time: bool,
    /// What M3 or M4 have switched on, `None` while it is off.
    pub laser: Option<LaserMode>,
    /// Fraction of full power that S asks for, `None` before any S.
    pub level: Option<f64>,
    /// [m/s], `None` before any F.
    pub feed: Option<f64>,
    /// Whether the air assist is on.
    pub air: bool,
}

/// What a line asks for.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LineEffect {
    /// Whether it moves, waits, pauses or switches: more than what stays in force.
    pub acts: bool,
    /// Whether it lights the laser.
    pub is_lit: bool,
    /// How long it waits in the dark without a move [s].
    pub dwell: Option<f64>,
    /// Whether it waits for a person.
    pub pauses: bool,
    /// Whether it ends the program.
    pub ends: bool,
    /// Whether it has any word.
    pub has_words: bool,
    /// Lower and upper corner of the box around its moves, machine frame [m]; `None` where it does not move.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// What a person should know of it.
    pub notes: Vec<String>,
}

/// Why a line is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineError {
    /// Column in bytes, from 1.
    pub column: usize,
    /// What is wrong.
    pub message: String,
    /// What stands at the place.
    pub found: String,
    /// What would be right.
    pub help: String,
}

/// Reads lines as they come.
#[derive(Debug)]
pub struct LineReader {
    settings: ReaderSettings,
    interpreter: Interpreter,
    block: Block,
}

impl LineReader {
    /// For `machine`, with the tool at its home.
    pub fn new(machine: &Machine) -> Self {
        let settings = ReaderSettings::of(machine);
        Self { interpreter: Interpreter::new(&settings), settings, block: Block::new() }
    }

    /// Reads a line and does it.
    ///
    /// # Errors
    /// What a program would be refused for on this line, and lines that need the rest of a program. Nothing has changed
    /// then.
    pub fn read(&mut self, line: &[u8]) -> Result<LineEffect, LineError> {
        let Self { interpreter, block, .. } = self;
        let before = *interpreter.modal();
        let position = interpreter.tracer.position;
        let facts = &mut interpreter.tracer.facts;
        (facts.lower, facts.upper) = (position.into(), position.into());
        interpreter.tracer.steps.clear();
        interpreter.notes.clear();
        interpreter.tracer.line += 1;
        match Self::execute(line, block, interpreter) {
            Ok(ends) => Ok(self.effect(ends)),
            Err(refusal) => {
                *interpreter.modal_mut() = before;
                interpreter.tracer.jump(position);
                interpreter.tracer.steps.clear();
                let Refusal { span, message, found, help, .. } = *refusal;
                Err(LineError { column: span.start + 1, message, found, help })
            }
        }
    }

    /// Whether the program ends with this line.
    fn execute(
        line: &[u8],
        block: &mut Block,
        interpreter: &mut Interpreter,
    ) -> Result<bool, Box<Refusal>> {
        let whole = || 0..line.len();
        let alone = "hand the program over as a file: `graver submit FILE`";
        match gather(line, false, block, interpreter) {
            Ok(Gathered::Block) if block.begun => {}
            Ok(Gathered::Block | Gathered::Deleted | Gathered::Mark) => return Ok(false),
            Ok(Gathered::Statement(_)) => {
                let message = "subroutines, conditions and loops need the whole program";
                return Err(Refusal::new(whole(), message, "O word", alone));
            }
            Err(Fault::Illegible(refusal) | Fault::Word(refusal)) => return Err(refusal),
        }
        match interpreter.execute(line, block)? {
            Next::Line => Ok(false),
            Next::End => Ok(true),
            Next::Program { span, .. } | Next::Return(span) => {
                Err(Refusal::new(span, "M98 and M99 need the whole program", "subroutine", alone))
            }
        }
    }

    fn effect(&mut self, ends: bool) -> LineEffect {
        let Self { interpreter, block, .. } = self;
        let mut effect = LineEffect { ends, has_words: block.begun, ..LineEffect::default() };
        let mut moves = false;
        for step in interpreter.tracer.steps.drain(..) {
            effect.acts |= !matches!(step.action, Action::Corners(_));
            match step.action {
                Action::Mark { .. } => (effect.is_lit, moves) = (true, true),
                Action::Feed { .. } | Action::Rapid { .. } => moves = true,
                Action::Dwell { time, lit: None } => effect.dwell = Some(time),
                Action::Dwell { .. } => effect.is_lit = true,
                Action::Pause => effect.pauses = true,
                _ => {}
            }
        }
        let facts = &interpreter.tracer.facts;
        effect.bounds = moves.then_some([facts.lower, facts.upper]);
        // One of no time still waits for what goes before it.
        let waits = block.codes.once.as_ref().is_some_and(|once| once.code == Once::Dwell);
        let dwell = effect.dwell.or((waits && !effect.is_lit).then_some(0.0));
        effect.dwell = dwell.filter(|_| !moves);
        effect.notes = interpreter.notes.drain(..).map(|note| note.text).collect();
        if ends {
            self.end_program();
        }
        effect
    }

    /// What M2 and M30 put back: G1, G17, G54, G90, G94, M5, M9.
    fn end_program(&mut self) {
        let (origins, shift, kept) = {
            let modal = self.interpreter.modal();
            (modal.origins, modal.shift, modal.kept)
        };
        let (unit, feed) = (self.interpreter.modal().unit, self.interpreter.modal().feed);
        let position = self.interpreter.tracer.position;
        self.interpreter = Interpreter::new(&self.settings);
        let modal = self.interpreter.modal_mut();
        modal.motion = Some(Motion::Line);
        (modal.unit, modal.feed) = (unit, feed);
        (modal.origins, modal.shift, modal.kept_shift) = (origins, shift, shift);
        (modal.origin, modal.kept) = (Vector3::from(origins[0]), kept);
        self.interpreter.tracer.jump(position);
    }

    /// Begins anew, as after a reset: what stays in force, but for the origins and the places of G28 and G30.
    pub fn reset(&mut self) {
        let (origins, kept) = (self.interpreter.modal().origins, self.interpreter.modal().kept);
        let position = self.interpreter.tracer.position;
        self.interpreter = Interpreter::new(&self.settings);
        let modal = self.interpreter.modal_mut();
        (modal.origins, modal.origin) = (origins, Vector3::from(origins[0]));
        (modal.motion, modal.kept) = (Some(Motion::Rapid), kept);
        self.interpreter.tracer.jump(position);
    }

    /// Where a jog that is written so leads from `from`, machine frame [m], and how fast [m/s]: a G1 in the dark that
    /// changes nothing of what is in force.
    ///
    /// # Errors
    /// Words that a straight move does not have, or no feed.
    pub fn jog(&mut self, words: &[u8], from: [f64; 3]) -> Result<([f64; 3], f64), LineError> {
        let before = *self.interpreter.modal();
        let position = self.interpreter.tracer.position;
        let modal = self.interpreter.modal_mut();
        (modal.feed, modal.laser, modal.feed_mode) = (None, None, FeedMode::PerMinute);
        self.interpreter.tracer.jump(from.into());
        let line = [b"G1 ", words].concat();
        let read = self.read(&line);
        let (to, feed) = (self.position(), self.interpreter.modal().feed);
        *self.interpreter.modal_mut() = before;
        self.interpreter.tracer.jump(position);
        read?;
        feed.map(|feed| (to, feed)).ok_or_else(|| LineError {
            column: 1,
            message: "the move has no feed rate".to_owned(),
            found: "no F".to_owned(),
            help: "write F in units per minute: F600".to_owned(),
        })
    }

    /// Another S word is full power from now on; S stays what it is worth.
    pub fn set_full_scale(&mut self, full_scale: f64) {
        self.settings.gcode.words.full_scale = full_scale;
        self.interpreter.words.full_scale = full_scale;
    }

    /// Takes back what G92 has set.
    pub fn clear_shift(&mut self) {
        let modal = self.interpreter.modal_mut();
        (modal.shift, modal.kept_shift) = (Vector3::zeros(), Vector3::zeros());
    }

    /// Takes `place` for where the tool is, machine frame [m].
    pub fn stand_at(&mut self, place: [f64; 3]) {
        self.interpreter.tracer.jump(place.into());
    }

    /// Where the program has the tool, machine frame [m].
    pub fn position(&self) -> [f64; 3] {
        self.interpreter.tracer.position.into()
    }

    /// Origins of the work coordinate systems G54 to G59, then G59.1 to G59.3, machine frame [m].
    pub fn origins(&self) -> [[f64; 3]; 9] {
        self.interpreter.modal().origins
    }

    /// Sets them [m].
    pub fn set_origins(&mut self, origins: [[f64; 3]; 9]) {
        let modal = self.interpreter.modal_mut();
        (modal.origins, modal.origin) = (origins, Vector3::from(origins[modal.system]));
    }

    /// Places of G28 and G30, machine frame [m].
    pub fn kept(&self) -> [[f64; 3]; 2] {
        self.interpreter.modal().kept
    }

    /// Puts the places of G28 and G30 back to the machine's home.
    pub fn forget_kept(&mut self) {
        self.interpreter.modal_mut().kept = [self.settings.home.into(); 2];
    }

    /// What G92 adds to the origin [m].
    pub fn shift(&self) -> [f64; 3] {
        self.interpreter.modal().shift.into()
    }

    /// Where the program zero is, machine frame [m].
    pub fn zero(&self) -> [f64; 3] {
        self.interpreter.modal().zero().into()
    }

    /// What is in force.
    pub fn modals(&self) -> Modals {
        let Modal {
            motion,
            plane,
            distance,
            feed_mode,
            unit,
            system,
            feed,
            laser,
            level,
            outputs,
            ..
        } = *self.interpreter.modal();
        Modals {
            motion: motion.map(|motion| match motion {
                Motion::Rapid => 0,
                Motion::Line => 1,
                Motion::Clockwise => 2,
                Motion::Counterclockwise => 3,
            }),
            system: 54 + system as u8,
            plane: match plane {
                Plane::Xy => 17,
                Plane::Zx => 18,
                Plane::Yz => 19,
            },
            is_inch: unit == INCH,
            is_incremental: distance == Reference::Incremental,
            is_inverse_time: feed_mode == FeedMode::InverseTime,
            laser,
            level,
            feed,
            air: outputs & 1 == 1,
        }
    }

    /// Lines that put in force what is in force here, and bring the tool in the dark to where it is: what a program
    /// begins with that goes on from here.
    pub fn preamble(&self) -> String {
        use std::fmt::Write;
        let modals = self.modals();
        let modal = self.interpreter.modal();
        let mut text = String::from("G21 G90 G94 M5\n");
        let mut line = |words: std::fmt::Arguments<'_>| {
            // Writing to a string does not fail.
            let _ = writeln!(text, "{words}");
        };
        let place = |place: &[f64]| {
            let words = ["X", "Y", "Z"].iter().zip(place);
            words.map(|(letter, value)| format!(" {letter}{:.6}", value * 1e3)).collect::<String>()
        };
        let position: [f64; 3] = self.position();
        let heights =
            if self.settings.gcode.z == machine::gcode_settings::ZMeaning::Focus { 3 } else { 2 };
        line(format_args!("G53 G0{}", place(&position[..heights])));
        let own = self.settings.gcode.origins;
        for (index, (origin, own)) in modal.origins.iter().zip(own).enumerate() {
            if *origin != own {
                line(format_args!("G10 L2 P{}{}", index + 1, place(origin)));
            }
        }
        for (number, kept) in [5161, 5181].into_iter().zip(modal.kept) {
            if Vector3::from(kept) != self.settings.home {
                let [x, y, z] = kept.map(|value| value * 1e3);
                let [second, third] = [number + 1, number + 2];
                line(format_args!("#{number}={x:.6} #{second}={y:.6} #{third}={z:.6}"));
            }
        }
        let system = match modals.system {
            system @ 54..=59 => format!("G{system}"),
            system => format!("G59.{}", system - 59),
        };
        line(format_args!("G{} {system}", modals.plane));
        if modal.shift != Vector3::zeros() {
            let here = self.interpreter.tracer.position - modal.origin - modal.shift - modal.tool;
            line(format_args!("G92{}", place(here.as_slice())));
        }
        if let Some(feed) = modals.feed.filter(|_| !modals.is_inverse_time) {
            line(format_args!("F{:.6}", feed * MINUTE * 1e3));
        }
        if let Some(level) = modals.level {
            line(format_args!("S{:.6}", level * self.settings.gcode.words.full_scale));
        }
        if let Some(laser) = modals.laser {
            let words = &self.settings.gcode.words;
            line(format_args!("{}", if words.m3 == laser { "M3" } else { "M4" }));
        }
        if modals.air {
            line(format_args!("M8"));
        }
        let units = if modals.is_inch { "G20" } else { "G21" };
        let distance = if modals.is_incremental { "G91" } else { "G90" };
        let feed = if modals.is_inverse_time { "G93" } else { "G94" };
        let motion = modals.motion.map_or(String::new(), |motion| format!(" G{motion}"));
        let arcs = match modal.arc_distance {
            Reference::Absolute => " G90.1",
            Reference::Incremental => "",
        };
        let corners = match modal.corners {
            Corners::AsMachine => String::new(),
            Corners::Exact => " G61".to_owned(),
            Corners::Blend(None) => " G64".to_owned(),
            Corners::Blend(Some(tolerance)) => format!(" G64 P{:.6}", tolerance / modal.unit),
        };
        line(format_args!("{units} {distance} {feed}{arcs}{corners}{motion}"));
        text
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::job::gcode::read;

    fn machine() -> Machine {
        let mut machine = Machine::builtin();
        machine.home = [0.0; 3];
        machine.gcode.origins = [[0.0; 3]; 9];
        machine
    }

    #[test]
    fn a_line_that_is_refused_changes_nothing() {
        let mut reader = LineReader::new(&machine());
        reader.read(b"G21 G90 G1 X10 F600").unwrap();
        let (modals, place) = (reader.modals(), reader.position());
        for line in ["G91 G20 X1 X2", "G91 S5000", "G2 X1 Y1", "G99.9", "o1 if [1]", "M98 P1"] {
            reader.read(line.as_bytes()).unwrap_err();
            assert_eq!((reader.modals(), reader.position()), (modals, place), "{line}");
        }
    }

    #[test]
    fn a_line_tells_what_it_asks_for() {
        let mut reader = LineReader::new(&machine());
        let mut read = |line: &str| reader.read(line.as_bytes()).unwrap();
        assert!(!read("G21 G90 M4 S100 F600").acts);
        assert_eq!(read("G0 X10").bounds, Some([[0.0; 3], [0.01, 0.0, 0.0]]));
        let mark = read("G1 Y5");
        assert!(mark.acts && mark.is_lit && !mark.ends);
        assert_eq!(mark.bounds, Some([[0.01, 0.0, 0.0], [0.01, 0.005, 0.0]]));
        assert_eq!(read("G4 P0.5").dwell, Some(0.5));
        assert!(read("M0").pauses);
        assert!(!read("(nothing)").has_words);
        assert!(read("M30").ends);
        assert_eq!(reader.modals().laser, None);
    }

    /// What a program comes to when it is cut in two and the second part begins with the preamble.
    #[test]
    fn a_program_goes_on_after_its_preamble_as_if_it_had_not_been_cut() {
        let first = "G20 G91 G55 G10 L2 P2 X1 Y1\nG1 X1 F10\nG28.1\nG1 Y1\nG30.1\nG92 X0 Y0\nM3 S200\nG93\n";
        let second = "G1 X0.5 Y0.25 F60\nG94 F20\nX0.25\nG90\nG2 X1 Y1 R2\nM5 G28\nG30 X1\n";
        let machine = machine();
        let mut reader = LineReader::new(&machine);
        first.lines().for_each(|line| drop(reader.read(line.as_bytes()).unwrap()));
        let whole = read("a.nc", &format!("{first}{second}"), &machine).unwrap();
        let rest = read("b.nc", &format!("{}{second}", reader.preamble()), &machine).unwrap();
        let marks = |program: &crate::job::gcode::Program| {
            let steps = program.drawing.steps.iter();
            steps
                .filter_map(|step| match step.action {
                    Action::Mark { curve, speed, power } => Some((curve.to(), speed, power.level)),
                    _ => None,
                })
                .collect::<Vec<_>>()
        };
        let ends = |program: &crate::job::gcode::Program| {
            let steps = program.drawing.steps.iter().rev();
            let places = steps.filter_map(|step| match step.action {
                Action::Rapid { to } => Some(to),
                _ => None,
            });
            places.take(3).collect::<Vec<_>>()
        };
        for (one, other) in ends(&whole).iter().zip(ends(&rest)) {
            assert!((one - other).norm() < 1e-8, "{one:?} {other:?}");
        }
        assert_eq!(ends(&whole).len(), 3);
        let (whole, rest) = (marks(&whole), marks(&rest));
        assert_eq!((whole.len(), rest.len()), (3, 3));
        for (one, other) in whole.iter().zip(&rest) {
            assert!((one.0 - other.0).norm() < 1e-8, "{one:?} {other:?}");
            assert!((one.1.unwrap() - other.1.unwrap()).abs() < 1e-8, "{one:?} {other:?}");
            assert!((one.2 - other.2).abs() < 1e-8);
        }
    }
}
