//! How a machine reads G-code: the meaning of words that differ from machine to machine.

/// What Z means in a G-code program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ZMeaning {
    /// Nothing: the machine has no such axis; said once in a note.
    Ignored,
    /// The height of the focus, an axis of the machine.
    Focus,
}

/// For which controller a program is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dialect {
    /// RS-274 as laser users write it.
    Standard,
    /// LinuxCNC.
    Linuxcnc,
    /// Grbl in its laser mode, and what follows it.
    Grbl,
    /// Marlin.
    Marlin,
    /// Smoothieware.
    Smoothie,
    /// Mach3.
    Mach3,
    /// Fanuc.
    Fanuc,
}

/// In what P of G4 is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DwellUnit {
    /// Seconds.
    Seconds,
    /// Milliseconds.
    Milliseconds,
}

/// How the power goes with the speed after M3 or M4.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LaserMode {
    /// The power of S, whatever the speed.
    Constant,
    /// In proportion to the speed.
    Proportional,
}

/// What the words of a program mean where dialects differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WordMeanings {
    /// The S word that means full power, positive.
    pub full_scale: f64,
    /// In what P of G4 is.
    pub dwell_unit: DwellUnit,
    /// The letter that gives G4 a time in seconds instead of P, if any.
    pub dwell_seconds: Option<u8>,
    /// What M3 is.
    pub m3: LaserMode,
    /// What M4 is.
    pub m4: LaserMode,
    /// Whether a comment in parentheses may have others in it.
    pub nested_comments: bool,
    /// Whether M106 and M107 switch the laser.
    pub fan_is_laser: bool,
    /// Whether G70 and G71 are inch and millimetre.
    pub inch_by_g70: bool,
    /// Whether the words of 3D printers are known: I of M3, M4 and M5, M82, M83, M400.
    pub printer_words: bool,
    /// How far a degree of A leads around the workpiece [m], on a machine with a chuck in the place of y.
    pub way_per_degree: Option<f64>,
}

impl Dialect {
    /// What words mean in it.
    pub fn meanings(self) -> WordMeanings {
        use LaserMode::{Constant, Proportional};
        let standard = WordMeanings {
            full_scale: 1000.0,
            dwell_unit: DwellUnit::Seconds,
            dwell_seconds: None,
            m3: Constant,
            m4: Proportional,
            nested_comments: false,
            fan_is_laser: false,
            inch_by_g70: false,
            printer_words: false,
            way_per_degree: None,
        };
        match self {
            Self::Standard | Self::Grbl => standard,
            // M3 and M4 are the directions of a spindle.
            Self::Linuxcnc => WordMeanings { m4: Constant, ..standard },
            Self::Mach3 => WordMeanings { m4: Constant, inch_by_g70: true, ..standard },
            Self::Fanuc => WordMeanings {
                m4: Constant,
                dwell_unit: DwellUnit::Milliseconds,
                dwell_seconds: Some(b'X'),
                ..standard
            },
            Self::Marlin => WordMeanings {
                full_scale: 255.0,
                dwell_unit: DwellUnit::Milliseconds,
                dwell_seconds: Some(b'S'),
                fan_is_laser: true,
                printer_words: true,
                ..standard
            },
            // Its power always follows the speed.
            Self::Smoothie => WordMeanings {
                full_scale: 1.0,
                dwell_unit: DwellUnit::Milliseconds,
                dwell_seconds: Some(b'S'),
                m3: Proportional,
                ..standard
            },
        }
    }
}

/// A table of a document, as [`table!`](crate::table!) declares them, with the keys of a dialect before its
/// own. What the file leaves out stays as it was.
#[macro_export]
macro_rules! dialect_table {
    ($(#[doc = $about:expr])* pub struct $name:ident { $($rest:tt)* }) => {
        $crate::table! {
            $(#[doc = $about])*
            pub struct $name {
                /// For which controller programs are written: all of the following at once.
                pub dialect: Option<$crate::document::Spanned<$crate::gcode_settings::Dialect>>,
                /// The S word that means full power; left out, the dialect says it, 1000 by default.
                pub full_scale: Option<$crate::document::Number<$crate::document::Positive>>,
                /// In what P of G4 is: `s` or `ms`.
                pub dwell_unit: Option<$crate::document::Spanned<$crate::gcode_settings::DwellUnit>>,
                /// What M3 is: `constant` power, or `proportional` to the speed.
                pub m3: Option<$crate::document::Spanned<$crate::gcode_settings::LaserMode>>,
                /// What M4 is, likewise.
                pub m4: Option<$crate::document::Spanned<$crate::gcode_settings::LaserMode>>,
                /// Whether a comment in parentheses may have others in it.
                pub nested_comments: Option<$crate::document::Spanned<bool>>,
                /// Whether M106 and M107 switch the laser.
                pub fan_is_laser: Option<$crate::document::Spanned<bool>>,
                $($rest)*
            }
        }

        impl $name {
            /// What the table says instead of `meanings`: a dialect replaces all of them, and what is
            /// said beside it holds before it.
            pub fn over(
                &self,
                meanings: $crate::gcode_settings::WordMeanings,
            ) -> $crate::gcode_settings::WordMeanings {
                let base = self.dialect.map_or(meanings, |dialect| dialect.value.meanings());
                $crate::gcode_settings::WordMeanings {
                    full_scale: self.full_scale.map_or(base.full_scale, |number| number.value),
                    dwell_unit: self.dwell_unit.map_or(base.dwell_unit, |unit| unit.value),
                    m3: self.m3.map_or(base.m3, |mode| mode.value),
                    m4: self.m4.map_or(base.m4, |mode| mode.value),
                    nested_comments: self
                        .nested_comments
                        .map_or(base.nested_comments, |is| is.value),
                    fan_is_laser: self.fan_is_laser.map_or(base.fan_is_laser, |is| is.value),
                    ..base
                }
            }
        }
    };
}

/// How this machine reads G-code.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GcodeSettings {
    /// What words mean.
    pub words: WordMeanings,
    /// What Z means.
    pub z: ZMeaning,
    /// Origins of the work coordinate systems G54 to G59, then G59.1 to G59.3, in the machine
    /// frame [m].
    pub origins: [[f64; 3]; 9],
    /// By how much a program goes elsewhere that asks for the tool's offset with G43 [m]: see [`crate::offsets`].
    pub tool_offset: [f64; 3],
    /// Whether M7 and M8 switch an air assist.
    pub air_assist: bool,
    /// How many digital outputs M62 to M65 switch; `None` where the machine file has no outputs, and it is not known.
    pub digital_outputs: Option<usize>,
}

crate::keyword! {
    Dialect, "a dialect",
    "standard" => Self::Standard,
    "linuxcnc" => Self::Linuxcnc,
    "grbl" => Self::Grbl,
    "marlin" => Self::Marlin,
    "smoothie" => Self::Smoothie,
    "mach3" => Self::Mach3,
    "fanuc" => Self::Fanuc,
}

crate::keyword! {
    DwellUnit, "a unit of dwells",
    "s" => Self::Seconds,
    "ms" => Self::Milliseconds,
}

crate::keyword! {
    LaserMode, "a mode of the laser",
    "constant" => Self::Constant,
    "proportional" => Self::Proportional,
}
