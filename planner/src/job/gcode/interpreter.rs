//! What the words of a line do, in the order that RS-274 gives them, and what stays in force.

mod arc_words;
mod laser_words;
mod origin_words;
mod predefined;
mod remarks;

use std::ops::Range;

use machine::gcode_settings::{LaserMode, WordMeanings, ZMeaning};
use nalgebra::Vector3;

use super::block::Block;
use super::codes::{
    Call, Chosen, FeedMode, MILLIMETRE, Motion, Once, PathControl, Plane, Reference, Stop, spell,
};
use super::error::{Needs, Refusal};
use super::parameters::Store;
use super::settings::ReaderSettings;
use super::tracer::{Feed, Pace, Tracer};
use crate::drawing::{Action, Corners, Note};

pub(super) use self::remarks::Remark;

/// Seconds in a minute.
const MINUTE: f64 = 60.0;
/// The output bit of the air assist.
const AIR_ASSIST: u32 = 0;

/// What stays in force from line to line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Modal {
    pub(super) motion: Option<Motion>,
    pub(super) plane: Plane,
    pub(super) distance: Reference,
    pub(super) arc_distance: Reference,
    pub(super) feed_mode: FeedMode,
    /// Metres per unit.
    pub(super) unit: f64,
    /// Index of the work coordinate system.
    pub(super) system: usize,
    /// Program zeros of all of them, machine frame [m].
    pub(super) origins: [[f64; 3]; 9],
    /// That of the one in force [m].
    pub(super) origin: Vector3<f64>,
    /// The tool's offset that is in force, and that of the machine.
    pub(super) tool: Vector3<f64>,
    /// What G92 adds to it [m].
    pub(super) shift: Vector3<f64>,
    /// What G92.3 brings back [m].
    pub(super) kept_shift: Vector3<f64>,
    /// Feed of G94 [m/s], `None` before any.
    pub(super) feed: Option<f64>,
    /// `None` while it is off.
    pub(super) laser: Option<LaserMode>,
    /// Fraction of full scale, `None` before any S.
    pub(super) level: Option<f64>,
    /// Outputs that are on, a bit for each.
    pub(super) outputs: u64,
    pub(super) corners: Corners,
    /// Places of G28 and G30, machine frame [m].
    pub(super) kept: [[f64; 3]; 2],
}

impl Modal {
    /// Where the program zero is, machine frame [m].
    pub(super) fn zero(&self) -> Vector3<f64> {
        self.origin + self.shift + self.tool
    }
}

/// Where the program zero was at its moves, machine frame [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Zeros {
    None,
    One(Vector3<f64>),
    Several,
}

impl Zeros {
    fn add(&mut self, zero: Vector3<f64>) {
        *self = match *self {
            Self::None => Self::One(zero),
            Self::One(first) if first == zero => return,
            Self::One(_) | Self::Several => Self::Several,
        };
    }

    /// The one place, if it is one.
    pub(super) fn only(self) -> Option<[f64; 3]> {
        match self {
            Self::One(zero) => Some(zero.into()),
            Self::None | Self::Several => None,
        }
    }
}

/// How a program goes on after a line.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Next {
    /// With the next line.
    Line,
    /// Not at all.
    End,
    /// With a program that M98 calls, so many times.
    Program { number: u64, times: u64, span: Range<usize> },
    /// Where the program was called that M99 ends.
    Return(Range<usize>),
}

/// Runs a program line by line.
#[derive(Debug)]
pub(super) struct Interpreter {
    /// What words mean.
    pub(super) words: WordMeanings,
    z: ZMeaning,
    has_air_assist: bool,
    /// The tool's offset of the machine.
    tool_offset: Vector3<f64>,
    /// Digital outputs that there are; `None` where nobody has said.
    digital_outputs: Option<usize>,
    modal: Modal,
    said: u32,
    /// What the program has set.
    pub(super) parameters: Store,
    pub(super) zeros: Zeros,
    pub(super) notes: Vec<Note>,
    pub(super) tracer: Tracer,
}

impl Interpreter {
    pub(super) fn new(settings: &ReaderSettings) -> Self {
        Self {
            words: settings.gcode.words,
            z: settings.gcode.z,
            has_air_assist: settings.gcode.air_assist,
            tool_offset: Vector3::from(settings.gcode.tool_offset),
            digital_outputs: settings.gcode.digital_outputs,
            modal: Modal {
                motion: None,
                plane: Plane::Xy,
                distance: Reference::Absolute,
                arc_distance: Reference::Incremental,
                feed_mode: FeedMode::PerMinute,
                unit: MILLIMETRE,
                system: 0,
                origins: settings.gcode.origins,
                origin: Vector3::from(settings.gcode.origins[0]),
                tool: Vector3::zeros(),
                shift: Vector3::zeros(),
                kept_shift: Vector3::zeros(),
                feed: None,
                laser: None,
                level: None,
                outputs: 0,
                corners: Corners::AsMachine,
                kept: [settings.home.into(); 2],
            },
            said: 0,
            parameters: Store::new(),
            zeros: Zeros::None,
            notes: Vec::new(),
            tracer: Tracer::new(settings),
        }
    }

    /// Does what `block` says, which was gathered from `line`. Gives back what comes next.
    pub(super) fn execute(&mut self, line: &[u8], block: &mut Block) -> Result<Next, Box<Refusal>> {
        self.tracer.facts.blocks += 1;
        self.settle_feed(block)?;
        self.settle_laser(block)?;
        self.without_effect(line, block)?;
        let codes = &block.codes;
        self.modal.plane = codes.plane.as_ref().map_or(self.modal.plane, |chosen| chosen.code);
        if let Some(chosen) = &codes.origin {
            self.modal.system = chosen.code;
            self.modal.origin = Vector3::from(self.modal.origins[chosen.code]);
        }
        let once = codes.once.clone();
        if let Some(Chosen { code: Once::Dwell, span }) = &once {
            self.dwell(block, span.clone())?;
        }
        self.path_control(block)?;
        let codes = &block.codes;
        if let Some(chosen) = &codes.distance {
            self.modal.distance = chosen.code;
        }
        if let Some(chosen) = &codes.arc_distance {
            self.modal.arc_distance = chosen.code;
        }
        let motion = codes.motion.clone();
        if motion.is_some() || codes.cancelled.is_some() {
            self.modal.motion = motion.as_ref().map(|chosen| chosen.code);
        }
        self.shift_or_home(line, block, once.as_ref(), motion.as_ref())?;
        let call = block.codes.call.clone();
        let call = call.map(|call| self.call(block, call)).transpose()?;
        self.motion(block, once.as_ref(), motion.as_ref())?;
        block.check_used()?;
        if self.stop(block) {
            return Ok(Next::End);
        }
        Ok(call.unwrap_or(Next::Line))
    }

    /// What is in force.
    pub(super) fn modal(&self) -> &Modal {
        &self.modal
    }

    /// What is in force, to be put back.
    pub(super) fn modal_mut(&mut self) -> &mut Modal {
        &mut self.modal
    }

    /// Begins the drawing here, where the lines before have led to, with all that they have left in force: in
    /// the dark, by a free move to this place.
    pub(super) fn begin_here(&mut self) {
        let Self { modal, tracer, .. } = self;
        self.zeros = Zeros::None;
        tracer.begin_here(|tracer| {
            if modal.corners != Corners::AsMachine {
                tracer.push(Action::Corners(modal.corners));
            }
            if let Corners::Blend(Some(tolerance)) = modal.corners {
                tracer.tolerance = tolerance;
            }
            for bit in (0..u64::BITS).filter(|bit| modal.outputs >> bit & 1 == 1) {
                tracer.push(Action::Output { bit, on: true });
            }
        });
    }

    /// Whether coordinates are absolute.
    pub(super) fn is_absolute(&self) -> bool {
        self.modal.distance == Reference::Absolute
    }

    /// M98 and M99.
    fn call(&self, block: &mut Block, call: Chosen<Call>) -> Result<Next, Box<Refusal>> {
        /// Rounds of one call.
        const MOST: f64 = 1e6;
        if call.code == Call::Return {
            return Ok(Next::Return(call.span));
        }
        claim(block, b'P')?;
        let help = "M98 P1000 L3 runs the program that begins with O1000 three times";
        let whole = |number: f64| number.floor() == number && (0.0..=1e9).contains(&number);
        let Some(number) = block.number(b'P').filter(|&number| whole(number)) else {
            return Err(Refusal::new(call.span, "M98 has no P of a program", "M98", help));
        };
        let times = block.number(b'L').unwrap_or(1.0);
        if times > MOST {
            return Err(Refusal::new(
                block.span(b'L'),
                format!("M98 with L{times} is more than {MOST} rounds"),
                "rounds",
                help,
            ));
        }
        Ok(Next::Program { number: number as u64, times: times as u64, span: call.span })
    }

    /// Puts what a program left on out, and completes its facts.
    pub(super) fn finish(&mut self) {
        for bit in 0..u64::BITS {
            self.switch(bit, false);
        }
        self.note_powers();
        let end = self.tracer.position - self.modal.zero();
        self.tracer.facts.end = end.into();
    }

    /// G93, G94, G20, G21 and F: as in Grbl the units of a line hold for all its numbers, where
    /// LinuxCNC still reads an F beside G20 or G21 in the old ones.
    fn settle_feed(&mut self, block: &mut Block) -> Result<(), Box<Refusal>> {
        if let Some(chosen) = &block.codes.unit {
            self.modal.unit = chosen.code;
        }
        if let Some(chosen) = &block.codes.feed_mode
            && chosen.code != self.modal.feed_mode
        {
            self.modal.feed_mode = chosen.code;
            self.modal.feed = None;
        }
        let Some(number) = block.number(b'F') else { return Ok(()) };
        if number < 0.0 {
            return Err(Refusal::new(
                block.span(b'F'),
                format!("F{number} is negative"),
                "negative feed rate",
                "a feed rate is above 0",
            ));
        }
        if self.modal.feed_mode == FeedMode::PerMinute {
            self.modal.feed = (number > 0.0).then_some(number * self.modal.unit / MINUTE);
        }
        Ok(())
    }

    /// G61, G61.1 and G64: how corners are passed from here on.
    fn path_control(&mut self, block: &mut Block) -> Result<(), Box<Refusal>> {
        let Some(chosen) = &block.codes.path_control else { return Ok(()) };
        let corners = match chosen.code {
            PathControl::Exact => Corners::Exact,
            PathControl::Blend => self.blend(block)?,
        };
        if corners != self.modal.corners {
            self.modal.corners = corners;
            if let Corners::Blend(Some(tolerance)) = corners {
                self.tracer.tolerance = self.tracer.tolerance.max(tolerance);
            }
            self.tracer.push(Action::Corners(corners));
        }
        Ok(())
    }

    /// G64 with its tolerance P. Q, up to which LinuxCNC joins short lines, changes nothing: lines are
    /// joined within the tolerance anyway.
    fn blend(&self, block: &mut Block) -> Result<Corners, Box<Refusal>> {
        for letter in [b'P', b'Q'] {
            if !block.has(letter) {
                continue;
            }
            claim(block, letter)?;
            if block.number(letter).is_some_and(|tolerance| tolerance < 0.0) {
                return Err(Refusal::new(
                    block.span(letter),
                    format!("the tolerance {} of G64 is negative", char::from(letter)),
                    "tolerance",
                    "a tolerance is 0 or above",
                ));
            }
        }
        let tolerance = block.number(b'P').map(|number| number * self.modal.unit);
        Ok(match tolerance {
            // No deviation at all is an exact corner.
            Some(0.0) => Corners::Exact,
            tolerance => Corners::Blend(tolerance),
        })
    }

    /// G28, G30 and G92 to G92.3, which take the coordinates of their line.
    fn shift_or_home(
        &mut self,
        line: &[u8],
        block: &mut Block,
        once: Option<&Chosen<Once>>,
        motion: Option<&Chosen<Motion>>,
    ) -> Result<(), Box<Refusal>> {
        let Some(Chosen { code, span }) = once else { return Ok(()) };
        if !matches!(code, Once::Kept(_) | Once::Shift | Once::SetOrigin) {
            match code {
                Once::ClearShift => {
                    self.modal.shift = Vector3::zeros();
                    self.modal.kept_shift = Vector3::zeros();
                }
                Once::SuspendShift => self.modal.shift = Vector3::zeros(),
                Once::RestoreShift => self.modal.shift = self.modal.kept_shift,
                Once::Keep(place) => self.modal.kept[*place] = self.tracer.position.into(),
                _ => {}
            }
            return Ok(());
        }
        if let Some(motion) = motion
            && block.has_axes()
        {
            return Err(Refusal::new(
                motion.span.clone(),
                format!(
                    "{} and {} both take the coordinates of this line",
                    spell(line, span),
                    spell(line, &motion.span)
                ),
                "second code with coordinates",
                "write them on lines of their own",
            ));
        }
        let given = [b'X', b'Y', b'Z'].map(|letter| block.has(letter));
        if *code == Once::SetOrigin {
            return self.set_origin(block, span.clone());
        }
        if let Once::Kept(place) = *code {
            let through = self.target(block, false);
            let mut kept = Vector3::from(self.modal.kept[place]);
            if given.contains(&true) {
                for axis in (0..3).filter(|&axis| !given[axis]) {
                    kept[axis] = through[axis];
                }
            }
            self.note_height(through);
            self.tracer.rapid(through);
            self.note_height(kept);
            self.tracer.rapid(kept);
            return Ok(());
        }
        if !given.contains(&true) {
            return Err(Refusal::new(
                span.clone(),
                "G92 has no coordinates",
                "no X, Y or Z",
                "G92 X0 Y0 makes the present point the origin of X and Y",
            ));
        }
        for (axis, letter) in [b'X', b'Y', b'Z'].into_iter().enumerate() {
            if let Some(length) = block.coordinate(letter, self.modal.unit) {
                self.modal.shift[axis] = self.tracer.position[axis]
                    - self.modal.origin[axis]
                    - self.modal.tool[axis]
                    - length;
            }
        }
        self.modal.kept_shift = self.modal.shift;
        Ok(())
    }

    /// G0 to G3, new or still in force.
    fn motion(
        &mut self,
        block: &mut Block,
        once: Option<&Chosen<Once>>,
        motion: Option<&Chosen<Motion>>,
    ) -> Result<(), Box<Refusal>> {
        let frame = once.filter(|once| once.code == Once::MachineFrame);
        let taken = once
            .is_some_and(|once| matches!(once.code, Once::Kept(_) | Once::Shift | Once::SetOrigin))
            || block.axes_taken;
        let now = self.modal.motion;
        if let Some(frame) = frame {
            let straight = matches!(now, Some(Motion::Rapid | Motion::Line));
            if !straight || !block.has_axes() || self.modal.distance == Reference::Incremental {
                return Err(Refusal::new(
                    frame.span.clone(),
                    "G53 needs G0 or G1, a coordinate, and G90",
                    "machine coordinates",
                    "G53 G0 X0 Y0 moves to the machine's zero; arcs and G91 cannot be combined with it",
                )
                .needing(Needs::Motion));
            }
        }
        let arc = matches!(now, Some(Motion::Clockwise | Motion::Counterclockwise));
        let moves = block.has_axes() || arc && (block.has_offsets() || block.has(b'R'));
        if taken || !moves {
            return Ok(());
        }
        if frame.is_none() && now.is_some() {
            self.zeros.add(self.modal.zero());
        }
        match now {
            None => Ok(()),
            Some(Motion::Rapid) => {
                let to = self.target(block, frame.is_some());
                self.note_height(to);
                self.tracer.rapid(to);
                Ok(())
            }
            Some(Motion::Line) => {
                let feed = self.feed(block, motion)?;
                let to = self.target(block, frame.is_some());
                self.note_height(to);
                if block.cluster.is_empty() {
                    self.tracer.line(to, feed);
                    return Ok(());
                }
                self.cluster(block, to, feed)
            }
            Some(Motion::Clockwise) => self.arc(block, motion, false),
            Some(Motion::Counterclockwise) => self.arc(block, motion, true),
        }
    }

    /// The feed of a move on this line.
    fn feed(
        &mut self,
        block: &mut Block,
        motion: Option<&Chosen<Motion>>,
    ) -> Result<Feed, Box<Refusal>> {
        let pace = match self.modal.feed_mode {
            FeedMode::PerMinute => self.modal.feed.map(Pace::Speed),
            FeedMode::InverseTime => block
                .number(b'F')
                .filter(|&number| number > 0.0)
                .map(|number| Pace::Time(MINUTE / number)),
        };
        let Some(pace) = pace else {
            let help = match self.modal.feed_mode {
                FeedMode::PerMinute => "write F in units per minute here or before: F600",
                FeedMode::InverseTime => {
                    "under G93 every G1, G2 and G3 line needs an F above 0: one over its minutes"
                }
            };
            return Err(Refusal::new(
                place(block, motion),
                "the move has no feed rate",
                "no F",
                help,
            )
            .needing(Needs::Feed));
        };
        if self.modal.level.is_none() && self.modal.laser.is_some() {
            self.remark(Remark::NoPower);
        }
        Ok(Feed { pace, power: self.power() })
    }

    /// Where the coordinates of a line lead, machine frame [m].
    fn target(&self, block: &mut Block, machine_frame: bool) -> Vector3<f64> {
        let mut to = self.tracer.position;
        for (axis, letter) in [b'X', b'Y', b'Z'].into_iter().enumerate() {
            let Some(length) = block.coordinate(letter, self.modal.unit) else { continue };
            to[axis] = if machine_frame {
                length
            } else if self.modal.distance == Reference::Incremental {
                to[axis] + length
            } else {
                self.modal.zero()[axis] + length
            };
        }
        to
    }

    /// Notes the first move along an ignored Z.
    fn note_height(&mut self, to: Vector3<f64>) {
        if self.z == ZMeaning::Ignored && to.z != self.tracer.position.z {
            self.remark(Remark::Height);
        }
    }

    /// M0, M1, M2, M30. Gives back whether the program ends.
    fn stop(&mut self, block: &Block) -> bool {
        match block.codes.stop.as_ref().map(|chosen| chosen.code) {
            None => {}
            Some(Stop::Pause) => self.tracer.push(Action::Pause),
            Some(Stop::Optional) => self.remark(Remark::OptionalStop),
            Some(Stop::End) => return true,
        }
        false
    }
}

/// Refuses a second user of one word.
fn claim(block: &Block, letter: u8) -> Result<(), Box<Refusal>> {
    if !block.is_used(letter) {
        return Ok(());
    }
    let name = char::from(letter);
    Err(Refusal::new(
        block.span(letter),
        format!("two codes of this line use {name}"),
        "used twice",
        "write the codes on lines of their own",
    ))
}

/// Where a move is written: its code, or else its first coordinate.
fn place(block: &Block, motion: Option<&Chosen<Motion>>) -> Range<usize> {
    if let Some(motion) = motion {
        return motion.span.clone();
    }
    [b'X', b'Y', b'Z', b'I', b'J', b'K', b'R']
        .into_iter()
        .filter(|&letter| block.has(letter))
        .map(|letter| block.span(letter))
        .min_by_key(|span| span.start)
        .unwrap_or(0..0)
}
