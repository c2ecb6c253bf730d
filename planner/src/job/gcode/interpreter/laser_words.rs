//! What the words of the laser do: power, gate, air, and a dwell, which may be lit.

use std::ops::Range;

use machine::gcode_settings::{DwellUnit, LaserMode};
use nalgebra::Vector3;

use super::{AIR_ASSIST, Interpreter, Remark, claim};
use crate::drawing::{Action, Power};
use crate::job::gcode::block::Block;
use crate::job::gcode::codes::{Laser, Motion, Once};
use crate::job::gcode::error::{Needs, Refusal};
use crate::job::gcode::tracer::{Feed, Pace};

/// The output bit of digital output 0.
const FIRST_OUTPUT: u32 = AIR_ASSIST + 1;

/// The last digital output.
const MOST_OUTPUT: u32 = u64::BITS - 1 - FIRST_OUTPUT;

/// Most powers of a cluster: what its writers have room for.
const MOST_PARTS: usize = 16;

/// A lit dwell that is longer is rather one in milliseconds [s].
const LONG_DWELL: f64 = 10.0;

/// Longest dwell of one G4 [s]: a day.
const LONGEST_DWELL: f64 = 86_400.0;

impl Interpreter {
    /// S, M67, M68, T, M3, M4, M5, M7, M8, M9, M62 to M65.
    pub(super) fn settle_laser(&mut self, block: &mut Block) -> Result<(), Box<Refusal>> {
        let has_dwell = block.codes.once.as_ref().is_some_and(|once| once.code == Once::Dwell);
        let is_time = has_dwell && self.words.dwell_seconds == Some(b'S') && !block.has(b'P');
        if block.has(b'S') && !is_time {
            self.modal.level = Some(self.level(block, b'S')?);
        }
        self.analog_output(block)?;
        if block.number(b'T').is_some() {
            self.remark(Remark::Tool);
        }
        self.laser(block)?;
        self.check_cluster(block)?;
        self.digital_output(block)?;
        let Some(on) = block.codes.air_assist.as_ref().map(|chosen| chosen.code) else {
            return Ok(());
        };
        if on && !self.has_air_assist {
            self.remark(Remark::NoAirAssist);
        } else {
            self.switch(AIR_ASSIST, on);
        }
        Ok(())
    }

    /// M3, M4 and M5; M106 and M107 where the fan is the laser.
    fn laser(&mut self, block: &mut Block) -> Result<(), Box<Refusal>> {
        let Some(chosen) = &block.codes.laser else { return Ok(()) };
        let (code, motion) = (chosen.code, &block.codes.motion);
        self.modal.laser = match code {
            Laser::Off => None,
            Laser::Clockwise => Some(self.words.m3),
            Laser::Counterclockwise => Some(self.words.m4),
            Laser::Fan => Some(LaserMode::Constant),
        };
        if code == Laser::Fan && !block.has(b'S') {
            self.modal.level = Some(1.0);
        }
        // I of Marlin's inline mode: the power changes with the moves, as it always does here.
        let is_arc = motion.as_ref().is_some_and(|motion| {
            matches!(motion.code, Motion::Clockwise | Motion::Counterclockwise)
        });
        if self.words.printer_words && !is_arc {
            block.number(b'I');
        }
        Ok(())
    }

    /// M62 to M65: digital output P is bit P + 1 of what a job switches; the first bit is the air assist.
    fn digital_output(&mut self, block: &mut Block) -> Result<(), Box<Refusal>> {
        let Some(chosen) = &block.codes.digital_output else { return Ok(()) };
        let (on, span) = (chosen.code, chosen.span.clone());
        let help = format!("M64 P0 switches output 0 on, M65 P0 off; there are 0 to {MOST_OUTPUT}");
        let Some(number) = block.number(b'P') else {
            return Err(Refusal::new(span, "the digital output has no P", "no output", help));
        };
        if number.floor() != number || !(0.0..=f64::from(MOST_OUTPUT)).contains(&number) {
            return Err(Refusal::new(
                block.span(b'P'),
                format!("there is no digital output P{number}"),
                "output",
                help,
            ));
        }
        if let Some(count) = self.digital_outputs.filter(|count| number >= *count as f64) {
            return Err(Refusal::new(
                block.span(b'P'),
                format!("there is no digital output P{number}: the machine file has {count}"),
                "output",
                "P counts the outputs with the function `general` of the machine file, from 0",
            ));
        }
        self.switch(FIRST_OUTPUT + number as u32, on);
        Ok(())
    }

    /// Switches an output unless it is so already.
    pub(super) fn switch(&mut self, bit: u32, on: bool) {
        if (self.modal.outputs >> bit & 1 == 1) != on {
            self.modal.outputs ^= 1 << bit;
            self.tracer.push(Action::Output { bit, on });
        }
    }

    /// A cluster, `S1:2:3`, is the power of equal parts of a line.
    fn check_cluster(&self, block: &Block) -> Result<(), Box<Refusal>> {
        let Some((_, span)) = block.cluster.first() else { return Ok(()) };
        let motion = block.codes.motion.as_ref().map(|motion| motion.code).or(self.modal.motion);
        if motion != Some(Motion::Line) || !block.has_axes() || block.codes.once.is_some() {
            return Err(Refusal::new(
                span.clone(),
                "a cluster of powers needs a G1 move on its line",
                "cluster",
                "G1 X10 S1:2:3 marks three equal parts of the line with these powers",
            )
            .needing(Needs::Motion));
        }
        if let Some((_, span)) = block.cluster.get(MOST_PARTS - 1) {
            return Err(Refusal::new(
                span.clone(),
                format!("a cluster has more than {MOST_PARTS} powers"),
                "cluster",
                "write the rest on a line of its own",
            ));
        }
        Ok(())
    }

    /// The line to `to` in as many equal parts as it has powers.
    pub(super) fn cluster(
        &mut self,
        block: &Block,
        to: Vector3<f64>,
        feed: Feed,
    ) -> Result<(), Box<Refusal>> {
        let from = self.tracer.position;
        let parts = 1 + block.cluster.len();
        let pace = match feed.pace {
            Pace::Time(time) => Pace::Time(time / parts as f64),
            pace @ Pace::Speed(_) => pace,
        };
        for part in 1..=parts {
            if let Some((number, span)) =
                part.checked_sub(2).and_then(|part| block.cluster.get(part))
            {
                self.modal.level = Some(self.fraction('S', *number, span)?);
            }
            let end =
                if part == parts { to } else { from + (to - from) * (part as f64 / parts as f64) };
            self.tracer.line(end, Feed { pace, power: self.power() });
        }
        Ok(())
    }

    /// The number of `letter` as a fraction of full power.
    fn level(&self, block: &mut Block, letter: u8) -> Result<f64, Box<Refusal>> {
        let number = block.number(letter).unwrap_or(0.0);
        self.fraction(char::from(letter), number, &block.span(letter))
    }

    /// The `number` of the word `name` at `span` as a fraction of full power.
    fn fraction(&self, name: char, number: f64, span: &Range<usize>) -> Result<f64, Box<Refusal>> {
        let full_scale = self.words.full_scale;
        if (0.0..=full_scale).contains(&number) {
            return Ok(number / full_scale);
        }
        Err(Refusal::new(
            span.clone(),
            format!("{name}{number} is outside 0 to {full_scale}"),
            "laser power",
            format!("full power is {name}{full_scale} (gcode.full_scale of the machine file)"),
        ))
    }

    /// M67 and M68: output 0 is the laser's power, in the scale of S, from the next move on. Neither
    /// ends a move: where M68 acts at once elsewhere, power changes here where the next move begins.
    fn analog_output(&mut self, block: &mut Block) -> Result<(), Box<Refusal>> {
        let Some(chosen) = &block.codes.analog_output else { return Ok(()) };
        let span = chosen.span.clone();
        let help = "the laser's power is M67 E0 Q50, with Q in the scale of S";
        let refuse = |span, message: String| Err(Refusal::new(span, message, "laser power", help));
        match block.number(b'E') {
            None => return refuse(span, "the analog output has no E".to_owned()),
            Some(0.0) => {}
            Some(number) => {
                let message = format!("there is no analog output E{number}");
                return refuse(block.span(b'E'), message);
            }
        }
        if !block.has(b'Q') {
            return refuse(span, "the analog output has no Q".to_owned());
        }
        self.modal.level = Some(self.level(block, b'Q')?);
        Ok(())
    }

    /// The laser along a mark, `None` in the dark.
    pub(super) fn power(&self) -> Option<Power> {
        let level = self.modal.level.filter(|&level| level > 0.0)?;
        let mode = self.modal.laser?;
        Some(Power { level, follows_speed: mode == LaserMode::Proportional })
    }

    /// G4.
    pub(super) fn dwell(
        &mut self,
        block: &mut Block,
        span: Range<usize>,
    ) -> Result<(), Box<Refusal>> {
        let (unit, help) = match self.words.dwell_unit {
            DwellUnit::Seconds => (1.0, "G4 waits for P seconds: G4 P0.5"),
            DwellUnit::Milliseconds => (1e-3, "G4 waits for P milliseconds: G4 P500"),
        };
        let seconds = self.words.dwell_seconds.filter(|&letter| block.has(letter));
        let (letter, unit) = match seconds {
            Some(letter) if !block.has(b'P') => (letter, 1.0),
            _ => (b'P', unit),
        };
        claim(block, letter)?;
        block.axes_taken |= letter == b'X';
        let Some(time) = block.number(letter).map(|number| number * unit) else {
            return Err(Refusal::new(span, "G4 has no P", "dwell without a time", help));
        };
        if !(0.0..=LONGEST_DWELL).contains(&time) {
            return Err(Refusal::new(
                block.span(letter),
                format!("a dwell of {time} s is outside 0 to {LONGEST_DWELL} s"),
                "dwell",
                help,
            ));
        }
        // Power that follows the speed is none at rest.
        let lit = self.power().filter(|power| !power.follows_speed).map(|power| power.level);
        if lit.is_some() && time > LONG_DWELL {
            self.remark(Remark::LongDwell);
        }
        self.tracer.dwell(time, lit);
        Ok(())
    }
}
