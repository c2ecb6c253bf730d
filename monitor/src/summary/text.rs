//! The summary as a person reads it: aligned lines, in millimetres, micrometres and microseconds.

use super::Summary;
use std::fmt::Write;

/// Width of the column of names.
const NAMES: usize = 18;

/// A length in the unit that reads best [m].
pub fn length(metres: f64) -> String {
    if metres.abs() < 1e-3 {
        format!("{:.1} µm", metres * 1e6)
    } else {
        format!("{:.3} mm", metres * 1e3)
    }
}

/// A latency in microseconds [ns].
pub fn latency(nanoseconds: u64) -> String {
    format!("{:.1} µs", nanoseconds as f64 * 1e-3)
}

/// The rows of the summary, name and value, those without a value left out; the report shows the
/// same.
pub fn rows(summary: &Summary) -> Vec<(String, String)> {
    let mut rows = Vec::new();
    let mut row = |name: &str, value: String| {
        if !value.is_empty() {
            rows.push((name.to_owned(), value));
        }
    };
    let Summary { job, machine, limits, realtime, .. } = summary;
    row("outcome", summary.outcome.name().to_owned());
    if let Some(fault) = &summary.fault {
        let axis = fault.axis.as_ref().map(|axis| format!(" of axis {axis}")).unwrap_or_default();
        row("fault", format!("{}{axis}: {}", fault.code, fault.detail));
    }
    if let Some(error) = &summary.error {
        row("error", error.message.clone());
    }
    row("job", format!("{}, {} strokes, {}", job.name, job.strokes, length(job.length)));
    row(
        "machine",
        format!("{} ({}), axes {}", machine.name, machine.mechanism, machine.axes.join(", ")),
    );
    let factor = summary
        .realtime_factor
        .map(|factor| format!(", {factor:.0} × real time"))
        .unwrap_or_default();
    row("time", format!("{:.3} s{factor}", summary.time));
    row(
        "wall time",
        format!(
            "{:.3} s, planning {:.3} s, report {:.3} s",
            summary.wall, summary.plan_time, summary.report_time
        ),
    );
    match &summary.marks {
        Some(marks) => {
            row(
                "marked",
                format!(
                    "{}, speed {:.4} to {:.4} m/s",
                    length(marks.length),
                    marks.speed_min,
                    marks.speed_max
                ),
            );
            row(
                "contour error",
                format!("max {}, rms {}", length(marks.error_max), length(marks.error_rms)),
            );
            row(
                "tracking error",
                format!("max {}, rms {}", length(marks.tracking_max), length(marks.tracking_rms)),
            );
            row(
                "missing",
                format!("{}, worst end {}", length(marks.missing), length(marks.missing_end_max)),
            );
            row(
                "double",
                format!("{}, worst end {}", length(marks.double), length(marks.double_end_max)),
            );
            if marks.strokes_lost > 0 {
                row("strokes lost", marks.strokes_lost.to_string());
            }
        }
        None => row("marks", "not judged".to_owned()),
    }
    let list = |values: &[f64], scale: f64, digits: usize| -> String {
        values
            .iter()
            .map(|value| format!("{:.digits$}", value * scale))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let following = &summary.following_error;
    if !following.max.is_empty() {
        row(
            "following error",
            format!(
                "max {} mrad, rms {} mrad",
                list(&following.max, 1e3, 2),
                list(&following.rms, 1e3, 2)
            ),
        );
    }
    if !limits.velocity.is_empty() {
        row(
            "limits used",
            format!(
                "velocity {} %, acceleration {} %, jerk {} %, current {} %, path {:.0} % and {:.0} %",
                list(&limits.velocity, 100.0, 0),
                list(&limits.acceleration, 100.0, 0),
                list(&limits.jerk, 100.0, 0),
                list(&limits.effort, 100.0, 0),
                limits.path_acceleration * 100.0,
                limits.path_jerk * 100.0,
            ),
        );
    }
    row("cycles", format!("{}, {} overruns", summary.cycles, summary.overruns));
    for (hop, figures) in &summary.latency {
        row(
            &format!("latency {hop}"),
            format!(
                "p50 {}, p99 {}, p99.9 {}, max {}",
                latency(figures.p50),
                latency(figures.p99),
                latency(figures.p999),
                latency(figures.max),
            ),
        );
    }
    let cores: Vec<String> =
        realtime.cores.iter().map(|(name, core)| format!("{name} on CPU {core}")).collect();
    let mut set_up = vec![match realtime.priority {
        0 => realtime.scheduler.clone(),
        priority => format!("{} priority {priority}", realtime.scheduler),
    }];
    set_up.extend(cores);
    if realtime.locked {
        set_up.push("memory locked".to_owned());
    }
    row("real time", set_up.join(", "));
    row("digest", summary.digest.clone());
    if let Some(out) = &summary.out {
        row("run folder", out.clone());
    }
    for warning in summary.warnings.iter().chain(&realtime.warnings) {
        row("warning", warning.clone());
    }
    rows
}

impl Summary {
    /// The summary as aligned lines, one fact each, ending with a line break.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for (name, value) in rows(self) {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{name:NAMES$}{value}");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::super::{JobSummary, MachineSummary, Outcome};
    use super::*;

    #[test]
    fn lines_are_aligned() {
        let job = JobSummary { name: "letters NASO".into(), strokes: 5, length: 0.2345 };
        let mut summary = Summary::new(Outcome::Stopped, job, MachineSummary::default());
        summary.warnings.push("no SCHED_FIFO".into());
        let text = summary.text();
        assert!(text.starts_with("outcome           stopped\n"), "{text}");
        assert!(text.contains("job               letters NASO, 5 strokes, 234.500 mm\n"), "{text}");
        assert!(text.ends_with("warning           no SCHED_FIFO\n"), "{text}");
    }

    #[test]
    fn lengths_take_the_unit_that_reads_best() {
        assert_eq!(length(4.24e-6), "4.2 µm");
        assert_eq!(length(0.0123456), "12.346 mm");
    }
}
