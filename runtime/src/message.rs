//! What a process says on standard error, whether or not anybody still reads it.

use std::io::Write;

/// Writes one line, `graver: TEXT`, to standard error. One that is closed or full is no reason for
/// anything else to fail, so errors are ignored: whoever cannot be told cannot be told that either.
pub fn tell(text: &str) {
    // In one call: lines of several processes on one terminal stay whole.
    let _ = std::io::stderr().write_all(format!("graver: {text}\n").as_bytes());
}
