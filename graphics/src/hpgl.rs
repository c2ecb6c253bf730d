//! Plotter files, HPGL (`.plt`, `.hpgl`): lines, arcs, rectangles and wedges, each pen on a layer of its own.
//!
//! A plotter unit is 1/40 mm; the origin is that of the plotter, with y up.

mod commands;
mod plotter;
#[cfg(test)]
mod tests;

use crate::ReadError;
use crate::read::notes::Notes;
use crate::shape::Graphic;
use commands::Commands;
use plotter::Plotter;

/// Reads a plotter file.
///
/// # Errors
///
/// Where it has no command of a plotter, a number is at fault, with line and column, or a bound of [`crate::read`] is
/// exceeded.
pub fn read(bytes: &[u8]) -> Result<Graphic, ReadError> {
    let mut notes = Notes::default();
    let mut plotter = Plotter::default();
    let mut commands = Commands::new(bytes);
    let mut is_known = false;
    while let Some(command) = commands.next(&mut notes)? {
        is_known |= plotter.run(&command, &mut notes)?;
    }
    if !is_known {
        return Err(ReadError::new(
            "the file has no command of a plotter",
            "an HPGL file has commands such as PU, PD and PA",
        ));
    }
    let shapes = plotter.finish()?;
    Ok(Graphic { shapes, notes: notes.finish(), ..Graphic::default() })
}
