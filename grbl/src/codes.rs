//! The numbers of grbl's errors and alarms.

use planner::job::gcode::LineError;

/// An `error:N` of grbl 1.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum ErrorCode {
    /// A word does not begin with a letter.
    NoLetter = 1,
    /// A number is missing or wrong.
    BadNumber = 2,
    /// A `$` line is not known.
    BadStatement = 3,
    /// A value is negative.
    Negative = 4,
    /// The machine must be idle.
    NotIdle = 8,
    /// The machine is locked by an alarm, or jogs.
    Locked = 9,
    /// The line is too long.
    TooLong = 11,
    /// The way leads beyond the machine.
    Travel = 15,
    /// A jog has no axis, or other words than a jog may have.
    BadJog = 16,
    /// The laser mode cannot be left.
    LaserMode = 17,
    /// A command is not supported.
    Unsupported = 20,
    /// Two commands of one modal group.
    ModalGroup = 21,
    /// There is no feed rate.
    NoFeed = 22,
    /// A value is not whole.
    NotWhole = 23,
    /// Two commands take the coordinates of the line.
    AxisConflict = 24,
    /// A word is there twice.
    Repeated = 25,
    /// A command lacks coordinates.
    NoAxis = 26,
    /// The line number is out of range.
    LineNumber = 27,
    /// A command lacks a value.
    NoValue = 28,
    /// The work coordinate system does not exist.
    NoSystem = 29,
    /// G53 stands beside another motion than G0 and G1.
    MachineFrame = 30,
    /// The arc has no way in its plane.
    ArcTarget = 33,
    /// The arc's radius does not fit.
    ArcRadius = 34,
    /// The arc has no centre in its plane.
    ArcCentre = 35,
    /// A word that nothing uses.
    Unused = 36,
    /// A tool length that is not supported.
    ToolLength = 37,
}

impl ErrorCode {
    /// The one that says best why the reader of programs refuses a line.
    pub fn of(error: &LineError) -> Self {
        let LineError { message, found, .. } = error;
        let says = |words: &str| message.contains(words);
        match found.as_str() {
            "not a word" => Self::NoLetter,
            "not a number" | "no number" | "second number" | "comma" | "expression"
            | "parameter" => Self::BadNumber,
            "not a whole number" => Self::NotWhole,
            "negative feed rate" => Self::Negative,
            "line number" => Self::LineNumber,
            "no F" => Self::NoFeed,
            "second code with coordinates" => Self::AxisConflict,
            "no X, Y or Z" => Self::NoAxis,
            "machine coordinates" => Self::MachineFrame,
            "unused word" | "used twice" | "offset out of the plane" => Self::Unused,
            "tool length" => Self::ToolLength,
            "no centre or radius" => Self::ArcCentre,
            "radius" => Self::ArcRadius,
            "this arc" if says("radius") || says("R") => Self::ArcRadius,
            "this arc" | "turns of the arc" => Self::ArcTarget,
            "dwell without a time" | "no output" => Self::NoValue,
            "origin" if says("no work coordinate system") => Self::NoSystem,
            "origin" if says("has no") => Self::NoValue,
            "tolerance" | "dwell" => Self::Negative,
            "laser power" if says("-") => Self::Negative,
            "laser power" => Self::BadNumber,
            found if found.starts_with("second code of the") => Self::ModalGroup,
            found if found.starts_with("second ") => Self::Repeated,
            found if found.starts_with("beyond ") => Self::BadNumber,
            _ => Self::Unsupported,
        }
    }
}

/// An `ALARM:N` of grbl 1.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Alarm {
    /// A limit switch.
    HardLimit = 1,
    /// A way beyond the machine: nothing has moved.
    Travel = 2,
    /// Stopped while moving.
    Abort = 3,
    /// The probe touches before it is moved.
    ProbeTouches = 4,
    /// The probe did not touch.
    NoTouch = 5,
    /// Homing was stopped.
    HomingReset = 6,
    /// The door was opened while homing.
    HomingDoor = 7,
    /// The switch was not found.
    NoSwitch = 9,
}

impl Alarm {
    /// The one for a fault of this name.
    pub fn of_fault(code: &str) -> Self {
        if code.contains("limit_switch") || code.contains("hard_limit") {
            Self::HardLimit
        } else {
            Self::Abort
        }
    }
}
