//! `graver verify-summary`: holds a summary to its schema; for scripts and continuous integration.

use crate::exit::{Exit, Failure};
use crate::output::say;
use monitor::summary::{Outcome, Summary};
use std::path::Path;

/// Reads the summary and checks what must be true of every one.
///
/// # Errors
/// A file that is no summary, or one that contradicts itself.
pub fn run(path: &Path) -> Result<Exit, Failure> {
    let named =
        |error: &dyn std::fmt::Display| Failure::bad_input(format!("{}: {error}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| named(&error))?;
    let summary: Summary = serde_json::from_str(&text).map_err(|error| named(&error))?;
    if summary.outcome == Outcome::Completed {
        let marks = summary.marks.as_ref().ok_or_else(|| named(&"completed without marks"))?;
        let sound = marks.error_max.is_finite() && marks.length > 0.0 && summary.time > 0.0;
        if !sound {
            return Err(named(
                &"completed, but time, marked length or contour error is zero or not a number",
            ));
        }
    }
    say!("{}: {}", path.display(), summary.outcome.name());
    Ok(Exit::from(summary.outcome))
}
