//! Words for people on standard error.
//!
//! Whoever read there may have gone, and the disk behind it may be full: that is no reason for a
//! machine to stop. What cannot be written is dropped, where `eprintln!` would panic.

use crate::terminal;
use std::fmt::Arguments;
use std::io::Write;

/// Writes one line, `graver: TEXT`. On a terminal it is all that stands there afterwards: a line of progress, be it
/// another process's, is overwritten.
pub fn tell(text: &str) {
    if terminal::can_redraw() {
        write(format_args!("\r\x1b[Jgraver: {text}\n"));
    } else {
        write(format_args!("graver: {text}\n"));
    }
}

/// Writes `text` as it is, in one piece.
pub fn write(text: Arguments<'_>) {
    // In one piece, so that the lines of several processes do not mix.
    let _ = std::io::stderr().lock().write_all(text.to_string().as_bytes());
}
