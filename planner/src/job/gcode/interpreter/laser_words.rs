//! What the words of the laser do: power, gate, air, and a dwell, which may be lit.

use std::ops::Range;

use super::{AIR_ASSIST, Interpreter, Remark};
use crate::drawing::{Action, Power};
use crate::job::gcode::block::Block;
use crate::job::gcode::codes::Laser;
use crate::job::gcode::error::Refusal;

/// Longest dwell of one G4 [s]: a day.
const LONGEST_DWELL: f64 = 86_400.0;

impl Interpreter {
    /// S, M67, M68, T, M3, M4, M5, M7, M8, M9.
    pub(super) fn settle_laser(&mut self, block: &mut Block) -> Result<(), Box<Refusal>> {
        if block.has(b'S') {
            self.modal.level = Some(self.level(block, b'S')?);
        }
        self.analog_output(block)?;
        if block.number(b'T').is_some() {
            self.remark(Remark::Tool);
        }
        if let Some(chosen) = &block.codes.laser {
            self.modal.laser = chosen.code;
        }
        let Some(on) = block.codes.air_assist.as_ref().map(|chosen| chosen.code) else {
            return Ok(());
        };
        if on && !self.settings.air_assist {
            self.remark(Remark::NoAirAssist);
        } else if on != self.modal.air_assist {
            self.modal.air_assist = on;
            self.tracer.push(Action::Output { bit: AIR_ASSIST, on });
        }
        Ok(())
    }

    /// The number of `letter` as a fraction of full power.
    fn level(&self, block: &mut Block, letter: u8) -> Result<f64, Box<Refusal>> {
        let full_scale = self.settings.full_scale;
        let number = block.number(letter).unwrap_or(0.0);
        if (0.0..=full_scale).contains(&number) {
            return Ok(number / full_scale);
        }
        let name = char::from(letter);
        Err(Refusal::new(
            block.span(letter),
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
        match self.modal.laser {
            Laser::Off => None,
            Laser::Constant => Some(Power { level, follows_speed: false }),
            Laser::FollowsSpeed => Some(Power { level, follows_speed: true }),
        }
    }

    /// G4.
    pub(super) fn dwell(
        &mut self,
        block: &mut Block,
        span: Range<usize>,
    ) -> Result<(), Box<Refusal>> {
        let help = "G4 waits for P seconds: G4 P0.5";
        let Some(time) = block.number(b'P') else {
            return Err(Refusal::new(span, "G4 has no P", "dwell without a time", help));
        };
        if !(0.0..=LONGEST_DWELL).contains(&time) {
            return Err(Refusal::new(
                block.span(b'P'),
                format!("a dwell of {time} s is outside 0 to {LONGEST_DWELL} s"),
                "dwell in seconds",
                help,
            ));
        }
        // Power that follows the speed is none at rest.
        let lit = self.power().filter(|power| !power.follows_speed).map(|power| power.level);
        self.tracer.dwell(time, lit);
        Ok(())
    }
}
