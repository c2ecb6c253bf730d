//! The lines of standard input, as requests.

use super::lines::{ErrorBody, Request};
use std::io::{self, BufRead, Read};

/// The longest line [bytes]; the longest sensible request has a few hundred.
const LONGEST: u64 = 1 << 20;

/// Why reading ends before the input does.
#[derive(Debug)]
pub(super) enum NotJson {
    /// The input cannot be read.
    Unreadable(io::Error),
    /// A line that is no request.
    Line {
        /// From 1.
        number: u64,
        /// What is wrong with it.
        detail: String,
    },
}

/// Reads requests, line by line.
pub(super) struct Input<I> {
    input: I,
    line: Vec<u8>,
    number: u64,
}

impl<I: BufRead> Input<I> {
    pub(super) fn new(input: I) -> Self {
        Self { input, line: Vec::new(), number: 0 }
    }

    /// The request of the next line that is not empty; `None` at the end. A request whose numbers no
    /// machine has is an error of its line.
    pub(super) fn next_request(&mut self) -> Result<Option<Result<Request, ErrorBody>>, NotJson> {
        loop {
            self.line.clear();
            let mut bounded = self.input.by_ref().take(LONGEST);
            let read = bounded.read_until(b'\n', &mut self.line).map_err(NotJson::Unreadable)?;
            if read == 0 {
                return Ok(None);
            }
            self.number += 1;
            if read as u64 == LONGEST && !self.line.ends_with(b"\n") {
                return Err(self.refuse(format!("the line has more than {LONGEST} bytes")));
            }
            let line = self.line.trim_ascii_end();
            let text = match core::str::from_utf8(line) {
                Ok(text) => text,
                Err(error) => {
                    let column = error.valid_up_to() + 1;
                    return Err(self.refuse(format!("column {column}: this is not UTF-8 text")));
                }
            };
            if text.is_empty() {
                continue;
            }
            return match serde_json::from_str::<Request>(text) {
                Ok(request) => Ok(Some(request.check().map(|()| request))),
                Err(error) => {
                    // Each line is a text of its own: its number is ours.
                    let full = error.to_string();
                    let ours = format!(" at line {} column {}", error.line(), error.column());
                    let what = full.strip_suffix(&ours).unwrap_or(&full);
                    Err(self.refuse(format!("column {}: {what}", error.column())))
                }
            };
        }
    }

    fn refuse(&self, detail: String) -> NotJson {
        NotJson::Line { number: self.number, detail }
    }
}
