//! What commands print: JSON for scripts on standard output, text for people on standard error.

pub mod progress;

use crate::exit::{Exit, Failure};
use messages::finite::first_not_finite;
use monitor::summary::Summary;
use runtime::message;
use serde::Serialize;
use std::io::{self, ErrorKind, Write};

/// Writes one line for people on standard error, as `eprintln!` would; what cannot be written there
/// is dropped.
macro_rules! say {
    ($($text:tt)*) => {
        runtime::message::write(format_args!("{}\n", format_args!($($text)*)))
    };
}
pub(crate) use say;

/// Prints one JSON object.
///
/// # Errors
/// When standard output cannot be written, or a number is not finite, for which JSON has no word.
pub fn json(value: &impl Serialize) -> Result<(), Failure> {
    if let Some(place) = first_not_finite(value) {
        return Err(Failure::bad_input(format!(
            "the answer has no finite number at {place}: machine or job has values that cannot be \
             computed with"
        )));
    }
    let mut text = serde_json::to_string_pretty(value).map_err(Failure::output)?;
    text.push('\n');
    printed(io::stdout().lock().write_all(text.as_bytes()))
}

/// Prints one JSON object in a line of its own, for a stream of them; whether anybody still reads.
///
/// # Errors
/// When standard output cannot be written.
pub fn json_line(value: &impl Serialize) -> Result<bool, Failure> {
    let mut text = serde_json::to_string(value).map_err(Failure::output)?;
    text.push('\n');
    let mut output = io::stdout().lock();
    match output.write_all(text.as_bytes()).and_then(|()| output.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        written => printed(written).map(|()| true),
    }
}

/// Judges what became of writing to standard output. Whoever reads there and leaves has read
/// enough, as `head` does.
///
/// # Errors
/// When it could not be written for another reason.
pub fn printed(written: io::Result<()>) -> Result<(), Failure> {
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.map_err(|error| Failure::output(format!("standard output: {error}"))),
    }
}

/// Prints a summary, as JSON or as text, and gives the exit code of its outcome: what happened on
/// the machine, whether or not the summary could be printed.
pub fn summary(summary: &Summary, as_json: bool) -> Exit {
    if as_json {
        for warning in summary.warnings.iter().chain(&summary.realtime.warnings) {
            message::tell(&format!("warning: {warning}"));
        }
        if let Err(failure) = json(summary) {
            message::tell(failure.refusal.text.trim());
            message::write(format_args!("{}", summary.text()));
        }
    } else {
        message::write(format_args!("{}", summary.text()));
    }
    summary.outcome.into()
}

/// Prints a failure. With `as_json` the object is a summary too, so that scripts read one kind.
pub fn failure(failure: &Failure, as_json: bool) {
    message::tell(failure.refusal.text.trim());
    if as_json {
        // Where standard output cannot be written there is nobody to tell.
        let _ = json(&failure.summary());
    }
}
