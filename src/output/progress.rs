//! How far a job has come, in one line: drawn again in place on a terminal, told now and then without one.

use monitor::summary::text::duration;
use operator::Status;
use runtime::{message, terminal};
use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};
use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};

/// How often the line is drawn on a terminal.
const REDRAWN: Duration = Duration::from_millis(100);

/// How often it is told where there is none.
const TOLD: Duration = Duration::from_secs(10);

/// Columns of a terminal that does not say how many it has.
const COLUMNS: usize = 80;

/// The widest bar, and the one for a narrower terminal.
const BARS: [usize; 2] = [30, 10];

/// A line of progress.
#[derive(Debug)]
pub struct ProgressLine {
    on_terminal: bool,
    /// When it was drawn or told last; at first when it was begun.
    drawn: Cell<Instant>,
    told: RefCell<String>,
}

/// How far a job has come.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JobProgress {
    /// 0 to 1.
    pub share: f64,
    /// The job.
    pub name: String,
    /// What goes on, or why it does not.
    pub state: String,
    /// What else there is to say where there is room.
    pub details: Vec<String>,
    /// How long it has run [s].
    pub elapsed: Option<f64>,
    /// How long it still takes [s].
    pub left: Option<f64>,
}

impl JobProgress {
    /// Of the job under way.
    pub fn of(status: &Status) -> Self {
        let mut details = Vec::new();
        if status.stroke > 0 && status.strokes > 0 {
            details.push(format!("stroke {} of {}", status.stroke, status.strokes));
        } else if status.stroke > 0 {
            details.push(format!("stroke {}", status.stroke));
        }
        if status.state == "running" {
            details.push(format!("rate {:.0} %", status.rate * 100.0));
            if ![0.0, 1.0].contains(&status.power_override) {
                details.push(format!("power override {:.0} %", status.power_override * 100.0));
            }
        }
        Self {
            share: status.share,
            name: status.job.clone().unwrap_or_default(),
            state: status.cause.clone().unwrap_or_else(|| status.state.clone()),
            details,
            elapsed: status.elapsed,
            left: status.time_left,
        }
    }

    /// In one line of at most `width` columns, with as much as there is room for; without a bar where there is no limit.
    pub fn line(&self, width: usize) -> String {
        let share = self.share.clamp(0.0, 1.0);
        let percent = format!("{:3.0} %", (share * 100.0).floor());
        let left = self.left.map(|left| format!("{} left", duration(left)));
        let elapsed = self.elapsed.map(|elapsed| format!("{} elapsed", duration(elapsed)));
        let named = match self.name.as_str() {
            "" => self.state.clone(),
            name => format!("{name}: {}", self.state),
        };
        let joined = |parts: &[&String]| {
            parts.iter().map(|part| part.as_str()).collect::<Vec<_>>().join(", ")
        };
        let times: Vec<&String> = elapsed.iter().chain(&left).collect();
        let all: Vec<&String> = std::iter::once(&named).chain(&self.details).chain(times).collect();
        let all = joined(&all);
        let timed = joined(&std::iter::once(&named).chain(&left).collect::<Vec<_>>());
        let short = joined(&std::iter::once(&self.state).chain(&left).collect::<Vec<_>>());
        let bar = |width: usize| {
            let filled = (share * width as f64) as usize;
            "█".repeat(filled) + &"░".repeat(width - filled)
        };
        let bars = BARS.map(|bar_width| format!("{} {percent} {all}", bar(bar_width)));
        let bars = bars.into_iter().filter(|_| width < usize::MAX);
        let candidates = bars
            .chain([all, timed, short].map(|text| format!("{percent} {text}")))
            .chain([format!("{percent} {}", self.state)]);
        let mut narrowest = String::new();
        for candidate in candidates {
            let candidate = plain(&candidate);
            if candidate.width() <= width {
                return candidate;
            }
            narrowest = candidate;
        }
        cut(&narrowest, width)
    }
}

impl ProgressLine {
    /// A line on standard error.
    pub fn begin() -> Self {
        Self {
            on_terminal: terminal::can_redraw(),
            drawn: Cell::new(Instant::now()),
            told: RefCell::default(),
        }
    }

    /// Shows how far a job has come, unless it was done just now; nothing where that is not known.
    pub fn draw(&self, progress: impl FnOnce() -> Option<JobProgress>) {
        let interval = if self.on_terminal { REDRAWN } else { TOLD };
        if self.drawn.get().elapsed() < interval {
            return;
        }
        self.drawn.set(Instant::now());
        let Some(progress) = progress() else { return };
        if self.on_terminal {
            // The last column stays free, and the cursor in the first one: where the terminal becomes narrower and
            // breaks the line, the next one begins where this one did.
            let width = terminal::columns().unwrap_or(COLUMNS).saturating_sub(1);
            let line = progress.line(width);
            message::write(format_args!("\r\x1b[?7l{line}\x1b[?7h\x1b[J\r"));
            return;
        }
        let line = progress.line(usize::MAX);
        if *self.told.borrow() != line {
            message::tell(line.trim_start());
            self.told.replace(line);
        }
    }

    /// Clears the line.
    pub fn clear(&self) {
        if self.on_terminal {
            message::write(format_args!("\r\x1b[J"));
        }
    }
}

/// Without what would move the cursor.
fn plain(text: &str) -> String {
    text.chars().map(|it| if it.is_control() { '?' } else { it }).collect()
}

/// What fits into `width` columns.
fn cut(text: &str, width: usize) -> String {
    let mut cut = String::new();
    let mut columns = 0;
    for character in text.chars() {
        let wide = character.width().unwrap_or(0);
        // One column is for the mark that something lacks.
        if columns + wide + 1 > width {
            break;
        }
        columns += wide;
        cut.push(character);
    }
    if width > 0 {
        cut.push('…');
    }
    cut
}

#[cfg(test)]
mod tests {
    use super::*;

    fn progress(name: &str, state: &str) -> JobProgress {
        JobProgress {
            share: 0.427,
            name: name.to_owned(),
            state: state.to_owned(),
            details: vec!["stroke 3 of 12".to_owned(), "rate 100 %".to_owned()],
            elapsed: Some(31.0),
            left: Some(80.0),
        }
    }

    #[test]
    fn a_wide_terminal_shows_all_of_it() {
        let line = progress("NASO", "running").line(120);
        let bar = "████████████░░░░░░░░░░░░░░░░░░";
        let all = "NASO: running, stroke 3 of 12, rate 100 %, 31 s elapsed, 1 min 20 s left";
        assert_eq!(line, format!("{bar}  42 % {all}"));
    }

    #[test]
    fn a_narrow_one_shows_what_matters_most() {
        let shown = |width| progress("NASO", "running").line(width);
        assert_eq!(shown(50), " 42 % NASO: running, 1 min 20 s left");
        assert_eq!(shown(30), " 42 % running, 1 min 20 s left");
        assert_eq!(shown(20), " 42 % running");
        assert_eq!(
            progress("NASO", "programmed pause (M0), line 12").line(19),
            " 42 % programmed p…"
        );
    }

    #[test]
    fn no_line_is_wider_than_the_terminal_whatever_the_job_is_called() {
        let names = [
            "",
            "NASO",
            "彫刻の看板と文字",
            "e\u{301}te\u{301}",
            "a\nb\x1b[2Jc\t",
            &"長".repeat(90),
        ];
        for name in names {
            for state in ["running", "waiting for setpoints", "門が開いている"] {
                for width in 0..200 {
                    let line = progress(name, state).line(width);
                    assert!(line.width() <= width, "{width}: {line:?}");
                    assert!(!line.chars().any(char::is_control), "{line:?}");
                }
            }
        }
    }

    #[test]
    fn a_job_is_done_at_its_end_only() {
        let line = |share| JobProgress { share, ..progress("a", "running") }.line(20);
        assert_eq!((line(0.999), line(1.0)), (" 99 % running".into(), "100 % running".into()));
    }
}
