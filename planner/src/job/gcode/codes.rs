//! The G and M codes that are understood, by modal group, and what to say of the others.

use std::ops::Range;

use machine::gcode_settings::WordMeanings;

use super::error::Refusal;
use super::lexer::Word;

/// Group 1: what coordinates mean from here on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Motion {
    /// G0.
    Rapid,
    /// G1.
    Line,
    /// G2.
    Clockwise,
    /// G3.
    Counterclockwise,
}

/// Group 0: in force on its own line only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Once {
    /// G4.
    Dwell,
    /// G10.
    SetOrigin,
    /// G28, G30: to the first or the second place that is kept.
    Kept(usize),
    /// G28.1, G30.1: keeps the present place as that.
    Keep(usize),
    /// G53.
    MachineFrame,
    /// G92.
    Shift,
    /// G92.1.
    ClearShift,
    /// G92.2.
    SuspendShift,
    /// G92.3.
    RestoreShift,
}

/// Group 2: the plane of arcs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Plane {
    /// G17.
    Xy,
    /// G18.
    Zx,
    /// G19.
    Yz,
}

/// Groups 3 and 4: what coordinates, and centres of arcs, are measured from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reference {
    /// Program zero (G90, G90.1).
    Absolute,
    /// Where the tool is (G91, G91.1).
    Incremental,
}

/// Group 5: what F means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FeedMode {
    /// G93, one over the minutes of the move.
    InverseTime,
    /// G94, units per minute.
    PerMinute,
}

/// Group 13.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PathControl {
    /// G61 and G61.1.
    Exact,
    /// G64.
    Blend,
}

/// Group 7 of the M codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Laser {
    /// M5, and M107 where the fan is the laser.
    Off,
    /// M3.
    Clockwise,
    /// M4.
    Counterclockwise,
    /// M106 where the fan is the laser.
    Fan,
}

/// G43 and G43.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ToolLength {
    /// G49.
    Cancelled,
    /// G43: from a table, which is empty.
    FromTable,
    /// G43.1: from the line.
    Given,
}

/// M98 and M99.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Call {
    /// M98.
    Program,
    /// M99.
    Return,
}

/// Codes that do nothing here, each with a note.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Idle {
    /// M6.
    ToolChange,
    /// M17, M18 and M84.
    Motors,
    /// M48 and M49.
    Override,
    /// M82, M83 and M400 of a 3D printer.
    Printer,
}

/// Group 4 of the M codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stop {
    /// M0.
    Pause,
    /// M1.
    Optional,
    /// M2, M30.
    End,
}

/// A code of a line and where it stands.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chosen<T> {
    pub(super) code: T,
    pub(super) span: Range<usize>,
}

/// The codes of one line, at most one of each modal group.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Codes {
    pub(super) motion: Option<Chosen<Motion>>,
    pub(super) once: Option<Chosen<Once>>,
    pub(super) plane: Option<Chosen<Plane>>,
    pub(super) distance: Option<Chosen<Reference>>,
    pub(super) arc_distance: Option<Chosen<Reference>>,
    pub(super) feed_mode: Option<Chosen<FeedMode>>,
    /// Metres per unit.
    pub(super) unit: Option<Chosen<f64>>,
    /// Index into the machine file's origins.
    pub(super) origin: Option<Chosen<usize>>,
    pub(super) path_control: Option<Chosen<PathControl>>,
    pub(super) laser: Option<Chosen<Laser>>,
    /// M67 and M68.
    pub(super) analog_output: Option<Chosen<()>>,
    pub(super) air_assist: Option<Chosen<bool>>,
    pub(super) stop: Option<Chosen<Stop>>,
    /// M98 and M99.
    pub(super) call: Option<Chosen<Call>>,
    /// G80. RS-274 has it in group 1, but preambles write it beside G0, and LinuxCNC allows that.
    pub(super) cancelled: Option<Chosen<()>>,
    /// M62 to M65.
    pub(super) digital_output: Option<Chosen<bool>>,
    pub(super) tool_length: Option<Chosen<ToolLength>>,
    /// G50 or G50.1, which other dialects give coordinates.
    pub(super) scaling_cancelled: bool,
    /// Which [`Idle`] codes the line has, a bit for each.
    idle: u8,
    cutter_radius: Option<Chosen<()>>,
    cycle_return: Option<Chosen<()>>,
    spindle_mode: Option<Chosen<()>>,
}

/// Metres in an inch.
pub(super) const INCH: f64 = 0.0254;
/// Metres in a millimetre.
pub(super) const MILLIMETRE: f64 = 1e-3;

const SUPPORTED_G: &str = "G0 G1 G2 G3 G4 G10 G17 G18 G19 G20 G21 G28 G28.1 G30 G30.1 G53 G54-G59 G59.1-G59.3 G61 \
                           G61.1 G64 G90 G91 G90.1 G91.1 G92 G92.1-G92.3 G93 G94, and without effect \
                           G15 G40 G40.1 G43 G49 G50 G50.1 G69 G80 G97 G98 G99";
const SUPPORTED_M: &str = "M0 M1 M2 M3 M4 M5 M7 M8 M9 M30 M62-M65 M67 M68 M98 M99, and without effect M6 M17 M18 \
                           M48 M49 M84";

impl Codes {
    /// Takes the G or M `word` into its group.
    pub(super) fn take(
        &mut self,
        line: &[u8],
        word: Word,
        words: &WordMeanings,
    ) -> Result<(), Box<Refusal>> {
        let tenths = word.number * 10.0;
        let code = tenths.round();
        // Codes have one decimal at most; ten times a decimal is off by rounding alone.
        let known = (tenths - code).abs() < 1e-9 && (0.0..65_536.0).contains(&code);
        if !known {
            return Err(unsupported(line, &word, 65_535));
        }
        if word.letter == b'G' {
            self.general(line, word, code as u16, words)
        } else {
            self.miscellaneous(line, word, code as u16, words)
        }
    }

    /// Whether the line has the code that does nothing here.
    pub(super) fn has(&self, idle: Idle) -> bool {
        self.idle & 1 << idle as u8 != 0
    }

    /// Whether the line has any code that does nothing here.
    pub(super) fn has_idle(&self) -> bool {
        self.idle != 0
    }

    fn pass(&mut self, idle: Idle) -> Result<(), Box<Refusal>> {
        self.idle |= 1 << idle as u8;
        Ok(())
    }

    fn general(
        &mut self,
        line: &[u8],
        word: Word,
        tenths: u16,
        words: &WordMeanings,
    ) -> Result<(), Box<Refusal>> {
        let span = word.span.clone();
        match tenths {
            0 => choose(&mut self.motion, Motion::Rapid, span, line, "motion"),
            10 => choose(&mut self.motion, Motion::Line, span, line, "motion"),
            20 => choose(&mut self.motion, Motion::Clockwise, span, line, "motion"),
            30 => choose(&mut self.motion, Motion::Counterclockwise, span, line, "motion"),
            800 => choose(&mut self.cancelled, (), span, line, "canned cycle"),
            40 => choose(&mut self.once, Once::Dwell, span, line, "non-modal"),
            100 => choose(&mut self.once, Once::SetOrigin, span, line, "non-modal"),
            280 => choose(&mut self.once, Once::Kept(0), span, line, "non-modal"),
            281 => choose(&mut self.once, Once::Keep(0), span, line, "non-modal"),
            300 => choose(&mut self.once, Once::Kept(1), span, line, "non-modal"),
            301 => choose(&mut self.once, Once::Keep(1), span, line, "non-modal"),
            530 => choose(&mut self.once, Once::MachineFrame, span, line, "non-modal"),
            920 => choose(&mut self.once, Once::Shift, span, line, "non-modal"),
            921 => choose(&mut self.once, Once::ClearShift, span, line, "non-modal"),
            922 => choose(&mut self.once, Once::SuspendShift, span, line, "non-modal"),
            923 => choose(&mut self.once, Once::RestoreShift, span, line, "non-modal"),
            170 => choose(&mut self.plane, Plane::Xy, span, line, "plane"),
            180 => choose(&mut self.plane, Plane::Zx, span, line, "plane"),
            190 => choose(&mut self.plane, Plane::Yz, span, line, "plane"),
            200 => choose(&mut self.unit, INCH, span, line, "units"),
            210 => choose(&mut self.unit, MILLIMETRE, span, line, "units"),
            700 if words.inch_by_g70 => choose(&mut self.unit, INCH, span, line, "units"),
            710 if words.inch_by_g70 => choose(&mut self.unit, MILLIMETRE, span, line, "units"),
            400 | 401 => choose(&mut self.cutter_radius, (), span, line, "cutter radius"),
            430 => choose(&mut self.tool_length, ToolLength::FromTable, span, line, "tool length"),
            431 => choose(&mut self.tool_length, ToolLength::Given, span, line, "tool length"),
            490 => choose(&mut self.tool_length, ToolLength::Cancelled, span, line, "tool length"),
            500 | 501 => {
                self.scaling_cancelled = true;
                Ok(())
            }
            150 | 690 => Ok(()),
            540 | 550 | 560 | 570 | 580 | 590 => {
                let origin = usize::from((tenths - 540) / 10);
                choose(&mut self.origin, origin, span, line, "work coordinate system")
            }
            591..=593 => {
                let origin = usize::from(tenths - 591) + 6;
                choose(&mut self.origin, origin, span, line, "work coordinate system")
            }
            610 | 611 => {
                choose(&mut self.path_control, PathControl::Exact, span, line, "path control")
            }
            640 => choose(&mut self.path_control, PathControl::Blend, span, line, "path control"),
            900 => choose(&mut self.distance, Reference::Absolute, span, line, "distance"),
            910 => choose(&mut self.distance, Reference::Incremental, span, line, "distance"),
            901 => choose(&mut self.arc_distance, Reference::Absolute, span, line, "arc distance"),
            911 => {
                choose(&mut self.arc_distance, Reference::Incremental, span, line, "arc distance")
            }
            930 => choose(&mut self.feed_mode, FeedMode::InverseTime, span, line, "feed"),
            940 => choose(&mut self.feed_mode, FeedMode::PerMinute, span, line, "feed"),
            970 => choose(&mut self.spindle_mode, (), span, line, "spindle speed"),
            980 | 990 => choose(&mut self.cycle_return, (), span, line, "cycle return"),
            _ => Err(unsupported(line, &word, tenths)),
        }
    }

    fn miscellaneous(
        &mut self,
        line: &[u8],
        word: Word,
        tenths: u16,
        words: &WordMeanings,
    ) -> Result<(), Box<Refusal>> {
        let span = word.span.clone();
        match tenths {
            0 => choose(&mut self.stop, Stop::Pause, span, line, "stopping"),
            10 => choose(&mut self.stop, Stop::Optional, span, line, "stopping"),
            20 | 300 => choose(&mut self.stop, Stop::End, span, line, "stopping"),
            30 => choose(&mut self.laser, Laser::Clockwise, span, line, "laser"),
            40 => choose(&mut self.laser, Laser::Counterclockwise, span, line, "laser"),
            1060 if words.fan_is_laser => choose(&mut self.laser, Laser::Fan, span, line, "laser"),
            1070 if words.fan_is_laser => choose(&mut self.laser, Laser::Off, span, line, "laser"),
            60 => self.pass(Idle::ToolChange),
            170 | 180 | 840 => self.pass(Idle::Motors),
            480 | 490 => self.pass(Idle::Override),
            820 | 830 | 4000 if words.printer_words => self.pass(Idle::Printer),
            620 | 640 => choose(&mut self.digital_output, true, span, line, "digital output"),
            630 | 650 => choose(&mut self.digital_output, false, span, line, "digital output"),
            50 => choose(&mut self.laser, Laser::Off, span, line, "laser"),
            70 | 80 => choose(&mut self.air_assist, true, span, line, "air assist"),
            90 => choose(&mut self.air_assist, false, span, line, "air assist"),
            980 => choose(&mut self.call, Call::Program, span, line, "subroutine"),
            990 => choose(&mut self.call, Call::Return, span, line, "subroutine"),
            670 | 680 => choose(&mut self.analog_output, (), span, line, "analog output"),
            _ => Err(unsupported(line, &word, tenths)),
        }
    }
}

/// Puts `code` into its group unless the line has one of that group already.
fn choose<T>(
    group: &mut Option<Chosen<T>>,
    code: T,
    span: Range<usize>,
    line: &[u8],
    name: &str,
) -> Result<(), Box<Refusal>> {
    if let Some(first) = group {
        let (one, other) = (spell(line, &first.span), spell(line, &span));
        return Err(Refusal::new(
            span,
            format!("{one} and {other} are both of the {name} group"),
            format!("second code of the {name} group"),
            "a line can have one code of each modal group: put them on lines of their own",
        ));
    }
    *group = Some(Chosen { code, span });
    Ok(())
}

/// The word at `span` as a person would write it.
pub(super) fn spell(line: &[u8], span: &Range<usize>) -> String {
    String::from_utf8_lossy(&line[span.clone()])
        .chars()
        .filter(|character| !character.is_whitespace())
        .collect::<String>()
        .to_ascii_uppercase()
}

/// Refuses a code, and says what to do about those that real files have.
fn unsupported(line: &[u8], word: &Word, tenths: u16) -> Box<Refusal> {
    let name = spell(line, &word.span);
    let advice = if word.letter == b'G' { general_advice(tenths) } else { tool_advice(tenths) };
    let supported = if word.letter == b'G' { SUPPORTED_G } else { SUPPORTED_M };
    let help = match advice {
        Some(advice) => format!("{advice}; supported are {supported}"),
        None => format!("supported are {supported}"),
    };
    Refusal::new(word.span.clone(), format!("{name} is not supported"), "unsupported code", help)
}

fn general_advice(tenths: u16) -> Option<&'static str> {
    Some(match tenths {
        50..=53 => "splines: let the post-processor write lines and arcs",
        70 | 80 => "a radius is R, and a diameter is no coordinate here: delete it",
        120..=139 => "circular pockets: let the post-processor write arcs",
        160 => "polar coordinates: let the post-processor write X and Y",
        330..=339 | 760 => "a marking machine does not cut threads",
        290..=292 | 382..=385 => "a marking machine has no probe",
        410..=421 => {
            "let the post-processor offset the path by the width of the line, and write G40"
        }
        432 => "a marking machine has no tool lengths: delete it or write G49",
        510..=521 => {
            "scaling and mirror images: let the post-processor write the moves as they are"
        }
        540..=549 => "write G54 to G59, or G59.1 to G59.3",
        680..=689 => "rotation: let the post-processor write the moves as they are",
        700 | 710 => {
            "G70 and G71 are inch and millimetre in some dialects: write G20 or G21, or set \
             gcode.dialect = \"mach3\""
        }
        730..=739 | 810..=899 => "canned cycles: let the post-processor write the moves out",
        950 => "a marking machine has no spindle: use G94",
        960 => "a marking machine has no spindle: delete it or write G97",
        _ => return None,
    })
}

fn tool_advice(tenths: u16) -> Option<&'static str> {
    Some(match tenths {
        100 | 110 => "switch outputs with M62 to M65, and the laser with M3, M4 and M5",
        190 => "a marking machine has no spindle to orient: delete it",
        500..=530 => "delete it: override and feed hold are always at hand",
        600 => "write M0 to wait for a person",
        660 => "a marking machine has no inputs to wait for: write M0 to wait for a person",
        700..=730 => "states are not saved: write the codes out",
        820 | 830 | 4000 => "delete it, or set gcode.dialect = \"marlin\"",
        1060 | 1070 => {
            "switch the laser with M3 or M4 and S, and off with M5; where the fan is the laser, set \
             gcode.fan_is_laser = true or gcode.dialect = \"marlin\""
        }
        1040 | 1090 | 1400 | 1900 => "a marking machine has nothing to heat: delete it",
        1000..=1990 => "user-defined commands do not exist here: delete it",
        _ => return None,
    })
}
