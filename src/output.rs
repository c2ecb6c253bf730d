//! What commands print: JSON for scripts on standard output, text for people on standard error.

use crate::exit::{Exit, Failure};
use monitor::summary::{JobSummary, MachineSummary, Summary};
use serde::Serialize;
use signals::finite::first_not_finite;
use std::io::{ErrorKind, IsTerminal, Write};

/// Prints one JSON object.
///
/// # Errors
/// When standard output is closed, or a number is not finite, for which JSON has no word.
pub fn json(value: &impl Serialize) -> Result<(), Failure> {
    if let Some(place) = first_not_finite(value) {
        return Err(Failure::bad_input(format!(
            "the answer has no finite number at {place}: machine or job has values that cannot be \
             computed with"
        )));
    }
    let mut text = serde_json::to_string_pretty(value).map_err(Failure::service)?;
    text.push('\n');
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        // Whoever read has read enough, as `head` does.
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.map_err(Failure::service),
    }
}

/// Prints a summary, as JSON or as text, and gives the exit code of its outcome.
///
/// # Errors
/// When standard output is closed.
pub fn summary(summary: &Summary, as_json: bool) -> Result<Exit, Failure> {
    if as_json {
        for warning in summary.warnings.iter().chain(&summary.realtime.warnings) {
            eprintln!("graver: warning: {warning}");
        }
        json(summary)?;
    } else {
        eprint!("{}", summary.text());
    }
    Ok(summary.outcome.into())
}

/// Prints a failure. With `as_json` the object is a summary too, so that scripts read one kind.
pub fn failure(failure: &Failure, as_json: bool) {
    eprintln!("graver: {}", failure.refusal.text.trim());
    if as_json {
        let mut summary =
            Summary::new(failure.outcome, JobSummary::default(), MachineSummary::default());
        summary.error = Some(failure.summary());
        // With standard output closed there is nobody to tell.
        let _ = json(&summary);
    }
}

/// A line of progress on the terminal, drawn again in place; nothing where there is no terminal.
#[derive(Debug)]
pub struct ProgressLine {
    shown: bool,
}

impl ProgressLine {
    /// A line that is drawn if standard error is a terminal.
    pub fn on_terminal() -> Self {
        Self { shown: std::io::stderr().is_terminal() }
    }

    /// Draws `share` of the whole, 0 to 1, and what is going on.
    pub fn draw(&self, share: f64, text: &str) {
        const WIDTH: usize = 30;
        if !self.shown {
            return;
        }
        let filled = ((share.clamp(0.0, 1.0) * WIDTH as f64) as usize).min(WIDTH);
        let bar: String = "█".repeat(filled) + &"░".repeat(WIDTH - filled);
        eprint!("\r\x1b[K{bar} {:3.0} % {text}", share.clamp(0.0, 1.0) * 100.0);
    }

    /// Clears the line.
    pub fn clear(&self) {
        if self.shown {
            eprint!("\r\x1b[K");
        }
    }
}
