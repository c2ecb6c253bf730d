//! What a person should know of a program that is not wrong, each thing said once.

use super::Interpreter;
use crate::drawing::Note;

/// Notes, each made once.
#[derive(Debug, Clone, Copy)]
pub(in crate::job::gcode) enum Remark {
    BlockDelete,
    Tool,
    ToolChange,
    ToolLength,
    Motors,
    Override,
    Printer,
    OptionalStop,
    NoAirAssist,
    Height,
    Folded,
    NoPower,
    LongDwell,
    TapeMark,
}

impl Remark {
    fn text(self) -> &'static str {
        match self {
            Self::BlockDelete => "lines that begin with / are left out (block delete)",
            Self::Tool => "T has no effect: a marking head has no tools",
            Self::ToolChange => {
                "M6 has no effect: a marking head has no tool to change; M0 waits for a person"
            }
            Self::ToolLength => {
                "G43 has no effect: the tool has no offset (`graver offset set tool`)"
            }
            Self::Motors => {
                "M17, M18 and M84 have no effect: the motors stay on until the job ends"
            }
            Self::Override => {
                "M48 and M49 have no effect: the operator can always hold a job and override its speed"
            }
            Self::Printer => "M82, M83 and M400 have no effect: they are a 3D printer's",
            Self::OptionalStop => "M1 has no effect: there is no optional stop; M0 waits",
            Self::NoAirAssist => "M7 and M8 have no effect: this machine has no air assist",
            Self::Height => "moves along Z are left out: this machine ignores Z",
            Self::Folded => "an arc in an upright plane is marked as seen along Z, to and fro",
            Self::NoPower => "the laser is on without S: it stays dark until S says its power",
            Self::LongDwell => {
                "a dwell of more than 10 s with the laser on: if its time is in milliseconds, set \
                 gcode.dwell_unit = \"ms\""
            }
            Self::TapeMark => "% is passed over: no % has begun the program, so none ends it",
        }
    }
}

impl Interpreter {
    /// Makes a note of the present line unless it was made before.
    pub(in crate::job::gcode) fn remark(&mut self, remark: Remark) {
        self.remark_at(self.tracer.line, remark);
    }

    /// Makes a note of `line` unless it was made before.
    pub(in crate::job::gcode) fn remark_at(&mut self, line: u64, remark: Remark) {
        let bit = 1 << remark as u32;
        if self.said & bit == 0 {
            self.said |= bit;
            self.notes.push(Note { line, text: remark.text().to_owned() });
        }
    }

    /// Notes that all light is less than a source gives: a full scale that is not the program's.
    pub(super) fn note_powers(&mut self) {
        /// Fraction of full power.
        const LITTLE: f64 = 0.01;
        let Some([_, most]) = self.tracer.facts.power else { return };
        if most < LITTLE {
            let full_scale = self.words.full_scale;
            let text = format!(
                "the largest power is S{} of {full_scale}, {:.2} %: is gcode.full_scale that of the \
                 program?",
                most * full_scale,
                most * 100.0
            );
            self.notes.push(Note { line: 0, text });
        }
    }
}
