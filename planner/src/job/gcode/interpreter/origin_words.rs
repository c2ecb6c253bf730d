//! G10, which sets the origins of work coordinate systems, and codes that only cancel or do nothing.

use std::ops::Range;

use nalgebra::Vector3;

use super::{Interpreter, Remark, claim};
use crate::job::gcode::block::Block;
use crate::job::gcode::codes::{Idle, Once, ToolLength, spell};
use crate::job::gcode::error::Refusal;

const HELP: &str = "G10 L2 P1 X0 Y0 puts the origin of G54 at a place of the machine; G10 L20 P1 X0 Y0 makes \
                    the present point 0, 0 of G54; P0 is the system in force";

impl Interpreter {
    /// G10 L2 and L20, as LinuxCNC documents them, until the program ends.
    pub(super) fn set_origin(
        &mut self,
        block: &mut Block,
        span: Range<usize>,
    ) -> Result<(), Box<Refusal>> {
        let refuse = |span, message: String| Err(Refusal::new(span, message, "origin", HELP));
        let from_here = match block.number(b'L') {
            Some(2.0) => false,
            Some(20.0) => true,
            None => return refuse(span, "G10 has no L".to_owned()),
            Some(number) => {
                return refuse(block.span(b'L'), format!("G10 L{number} is not supported"));
            }
        };
        if block.has(b'R') {
            let message = "a rotation of the coordinates (R of G10) is not supported";
            return refuse(block.span(b'R'), message.to_owned());
        }
        claim(block, b'P')?;
        let system = match block.number(b'P') {
            None => return refuse(span, "G10 has no P".to_owned()),
            Some(0.0) => self.modal.system,
            Some(number) if number.floor() == number && (1.0..=9.0).contains(&number) => {
                number as usize - 1
            }
            Some(number) => {
                let message = format!("there is no work coordinate system P{number}");
                return refuse(block.span(b'P'), message);
            }
        };
        for (axis, letter) in [b'X', b'Y', b'Z'].into_iter().enumerate() {
            let Some(length) = block.coordinate(letter, self.modal.unit) else { continue };
            self.modal.origins[system][axis] = if from_here {
                self.tracer.position[axis] - self.modal.shift[axis] - self.modal.tool[axis] - length
            } else {
                length
            };
        }
        self.modal.origin = Vector3::from(self.modal.origins[self.modal.system]);
        Ok(())
    }

    /// Codes that do nothing, and what they may not be given.
    pub(super) fn without_effect(
        &mut self,
        line: &[u8],
        block: &mut Block,
    ) -> Result<(), Box<Refusal>> {
        if block.codes.has_idle() {
            let idle = [
                (Idle::ToolChange, Remark::ToolChange),
                (Idle::Motors, Remark::Motors),
                (Idle::Override, Remark::Override),
                (Idle::Printer, Remark::Printer),
            ];
            for (_, remark) in idle.into_iter().filter(|(idle, _)| block.codes.has(*idle)) {
                self.remark(remark);
            }
        }
        let codes = &block.codes;
        let takes_axes = codes.motion.is_some() || codes.once.is_some();
        if codes.scaling_cancelled && !takes_axes && block.has_axes() {
            return Err(Refusal::new(
                block.first_axis(),
                "G50 with coordinates is not supported",
                "coordinates",
                "alone it cancels scaling; shift the origin with G92 or G10",
            ));
        }
        let Some(chosen) = &codes.tool_length else { return Ok(()) };
        let (code, span) = (chosen.code, chosen.span.clone());
        match code {
            ToolLength::Cancelled => {
                self.modal.tool = Vector3::zeros();
                return Ok(());
            }
            ToolLength::FromTable => {
                block.number(b'H');
                self.modal.tool = self.tool_offset;
                if self.tool_offset != Vector3::zeros() {
                    return Ok(());
                }
            }
            ToolLength::Given => {
                if block.has_axes()
                    && (codes.motion.is_some()
                        || codes.once.as_ref().is_some_and(|once| once.code != Once::Dwell))
                {
                    return Err(Refusal::new(
                        span,
                        "G43.1 takes the coordinates of this line from its motion",
                        "second code with coordinates",
                        "write them on lines of their own",
                    ));
                }
                block.axes_taken = true;
                for letter in [b'X', b'Y', b'Z'] {
                    if block.number(letter).is_some_and(|number| number != 0.0) {
                        return Err(Refusal::new(
                            block.span(letter),
                            format!(
                                "{} of G43.1 is not 0: a tool length would move the path",
                                spell(line, &block.span(letter))
                            ),
                            "tool length",
                            "a marking head has no tool lengths: shift the origin with G92 or G10",
                        ));
                    }
                }
            }
        }
        self.remark(Remark::ToolLength);
        Ok(())
    }
}
