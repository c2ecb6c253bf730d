//! What the words of G2 and G3 say: centre or radius, end, turns.

use std::ops::Range;

use machine::gcode_settings::ZMeaning;

use super::{Interpreter, Modal, Remark, claim, place};
use crate::job::gcode::arc::{Arc, Form, NoArc, axes, rounding};
use crate::job::gcode::block::Block;
use crate::job::gcode::codes::{Chosen, Motion, Plane, Reference};
use crate::job::gcode::error::{Needs, Refusal};

/// Most turns of one arc.
const MOST_TURNS: f64 = 10_000.0;

impl Interpreter {
    /// G2 and G3.
    pub(super) fn arc(
        &mut self,
        block: &mut Block,
        motion: Option<&Chosen<Motion>>,
        counterclockwise: bool,
    ) -> Result<(), Box<Refusal>> {
        let feed = self.feed(block, motion)?;
        let place = place(block, motion);
        let to = self.target(block, false);
        let form = self.form(block, place.clone())?;
        let turns = self.turns(block)?;
        let start = self.tracer.arc_start();
        let refuse = |fault: NoArc| {
            let (message, help) = fault.explain();
            Refusal::new(place, message, "this arc", help).needing(Needs::Place)
        };
        let Modal { plane, unit, .. } = self.modal;
        let arc = Arc::new(plane, counterclockwise, start, to, form, turns, rounding(unit));
        let arc = match arc {
            Ok(arc) => arc,
            Err(fault) => {
                // What follows is read from where the arc should have ended.
                self.tracer.jump(to);
                return Err(refuse(fault));
            }
        };
        self.note_height(to);
        if self.modal.plane != Plane::Xy && self.z == ZMeaning::Ignored {
            self.remark(Remark::Height);
        }
        if self.tracer.arc(&arc, to, feed) {
            self.remark(Remark::Folded);
        }
        Ok(())
    }

    /// Centre or radius of an arc.
    fn form(&mut self, block: &mut Block, place: Range<usize>) -> Result<Form, Box<Refusal>> {
        let [u, v, w] = axes(self.modal.plane);
        let letters = [b'I', b'J', b'K'];
        let (first, second) = (char::from(letters[u]), char::from(letters[v]));
        if let Some(radius) = block.number(b'R') {
            if block.has_offsets() {
                return Err(Refusal::new(
                    block.span(b'R'),
                    "the arc has R and a centre",
                    "radius",
                    "write either R, or I, J and K",
                ));
            }
            return Ok(Form::Radius(radius * self.modal.unit));
        }
        // Some post-processors write a zero offset along the normal; another is a wrong plane.
        if block.number(letters[w]).is_some_and(|number| number != 0.0) {
            return Err(Refusal::new(
                block.span(letters[w]),
                format!("{} is not in the plane of the arc", char::from(letters[w])),
                "offset out of the plane",
                format!(
                    "this plane's centre is {first} and {second}; G17 is XY, G18 is ZX, G19 is YZ"
                ),
            )
            .needing(Needs::Motion));
        }
        let absolute = self.modal.arc_distance == Reference::Absolute;
        let mut centre = self.tracer.position;
        let mut given = 0;
        for axis in [u, v] {
            let Some(number) = block.number(letters[axis]) else { continue };
            given += 1;
            let length = number * self.modal.unit;
            centre[axis] =
                if absolute { self.modal.zero()[axis] + length } else { centre[axis] + length };
        }
        if given == 0 || absolute && given < 2 {
            let wanted = if absolute { "and" } else { "or" };
            return Err(Refusal::new(
                place,
                "the arc has no centre",
                "no centre or radius",
                format!("an arc in this plane needs {first} {wanted} {second}, or R"),
            )
            .needing(Needs::Motion));
        }
        Ok(Form::Centre(centre))
    }

    /// How often an arc passes its end: P of G2 and G3.
    fn turns(&self, block: &mut Block) -> Result<f64, Box<Refusal>> {
        if !block.has(b'P') {
            return Ok(1.0);
        }
        claim(block, b'P')?;
        let turns = block.number(b'P').unwrap_or(1.0);
        if turns.floor() == turns && (1.0..=MOST_TURNS).contains(&turns) {
            return Ok(turns);
        }
        Err(Refusal::new(
            block.span(b'P'),
            format!("P{turns} is not a number of turns"),
            "turns of the arc",
            format!("P of G2 and G3 is a whole number from 1 to {MOST_TURNS}"),
        ))
    }
}
