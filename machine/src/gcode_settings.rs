//! How a machine reads G-code: the meaning of words that differ from machine to machine.

/// What Z means in a G-code program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ZMeaning {
    /// Nothing: the machine has no such axis; said once in a note.
    Ignored,
    /// The height of the focus, an axis of the machine.
    Focus,
}

/// How this machine reads G-code.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GcodeSettings {
    /// The S word that means full power, positive.
    pub full_scale: f64,
    /// What Z means.
    pub z: ZMeaning,
    /// Origins of the work coordinate systems G54 to G59, then G59.1 to G59.3, in the machine
    /// frame [m].
    pub origins: [[f64; 3]; 9],
    /// Whether M7 and M8 switch an air assist (bit 0 of the outputs).
    pub air_assist: bool,
}
