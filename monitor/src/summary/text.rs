//! The summary as a person reads it: aligned lines, in millimetres, micrometres and microseconds.

use super::{Realtime, Summary};
use crate::marks::Marks;
use crate::recording::continuity::RecordingSummary;
use messages::plan::Binding;
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

/// A duration as a person says it [s].
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..60 => format!("{seconds:.0} s"),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole / 60 % 60),
    }
}

/// A latency in microseconds [ns].
pub fn latency(nanoseconds: u64) -> String {
    format!("{:.1} µs", nanoseconds as f64 * 1e-3)
}

/// The rows of the summary, name and value, those without a value left out; the report shows the
/// same.
pub fn rows(summary: &Summary) -> Vec<(String, String)> {
    let mut rows = Rows::default();
    rows.run_outcome(summary);
    rows.job(summary);
    rows.times(summary);
    rows.power_override(summary.power_override);
    rows.binding(&summary.binding);
    rows.marks(summary.marks.as_ref());
    rows.add("left", summary.left.map(|left| left.to_string()).unwrap_or_default());
    rows.axes(summary);
    rows.cycles(summary);
    rows.realtime(&summary.realtime);
    rows.rest(summary);
    rows.0
}

/// Rows by section, in the order in which they are read.
#[derive(Default)]
struct Rows(Vec<(String, String)>);

impl Rows {
    fn add(&mut self, name: &str, value: impl Into<String>) {
        let value = value.into();
        if !value.is_empty() {
            self.0.push((name.to_owned(), value));
        }
    }

    fn run_outcome(&mut self, summary: &Summary) {
        self.add("outcome", summary.outcome.name());
        if let Some(fault) = &summary.fault {
            self.add("fault", fault.to_string());
        }
        if let Some(error) = &summary.error {
            self.add("error", error.to_string());
        }
        if let Some(place) = &summary.place {
            self.add("ended at", place.to_string());
        }
    }

    fn job(&mut self, summary: &Summary) {
        let Summary { job, machine, .. } = summary;
        let what = if job.dry_run {
            "dry run, nothing lit".to_owned()
        } else {
            format!("{} strokes, {}", job.strokes, length(job.length))
        };
        self.add("job", format!("{}, {what}", job.name));
        let axes = machine.axes.join(", ");
        let actuators = match &machine.actuators {
            alone if *alone == machine.axes || alone.is_empty() => String::new(),
            several => format!(", actuators {}", several.join(", ")),
        };
        let what = format!("{} ({}), axes {axes}{actuators}", machine.name, machine.mechanism);
        self.add("machine", what);
        self.add("drives", summary.drives.text(&machine.actuators));
        if let Some(link) = &summary.drives.link {
            self.add("link", link.to_string());
        }
    }

    fn times(&mut self, summary: &Summary) {
        let factor = summary
            .realtime_factor
            .map(|factor| format!(", {factor:.0} × real time"))
            .unwrap_or_default();
        let left = match summary.time_left {
            left if left > 0.0 => format!(", {} left", duration(left)),
            _ => String::new(),
        };
        self.add("time", format!("{:.3} s{factor}{left}", summary.time));
        let Summary { wall, plan_time, report_time, .. } = summary;
        self.add(
            "wall time",
            format!("{wall:.3} s, planning {plan_time:.3} s, report {report_time:.3} s"),
        );
    }

    fn power_override(&mut self, [least, most]: [f64; 2]) {
        let [least, most] = [least, most].map(|share| (share * 100.0).round());
        let range = if least == most { format!("{least}") } else { format!("{least} to {most}") };
        if [least, most] != [100.0; 2] {
            self.add("power override", format!("{range} %, 100 % again after the job"));
        }
    }

    fn marks(&mut self, marks: Option<&Marks>) {
        let Some(marks) = marks else {
            self.add("marks", "not judged");
            return;
        };
        let Marks { speed_min, speed_max, .. } = marks;
        let marked = length(marks.length);
        self.add("marked", format!("{marked}, speed {speed_min:.4} to {speed_max:.4} m/s"));
        let pair = |first: &str, one: f64, second: &str, other: f64| {
            format!("{first}{}, {second} {}", length(one), length(other))
        };
        self.add("contour error", pair("max ", marks.error_max, "rms", marks.error_rms));
        self.add("tracking error", pair("max ", marks.tracking_max, "rms", marks.tracking_rms));
        self.add("missing", pair("", marks.missing, "worst end", marks.missing_end_max));
        self.add("double", pair("", marks.double, "worst end", marks.double_end_max));
        if marks.unrecorded > 0.0 {
            self.add(
                "unrecorded",
                format!("{} of what is missing: it may be marked", length(marks.unrecorded)),
            );
        }
        if marks.strokes_lost > 0 {
            self.add("strokes lost", marks.strokes_lost.to_string());
        }
    }

    /// What the job was bound by most of its time.
    fn binding(&mut self, binding: &[Binding]) {
        /// How many limits are told, and the least share of the time of one.
        const MOST: usize = 3;
        const LEAST: f64 = 0.01;
        let told = binding.iter().take(MOST).filter(|limit| limit.share >= LEAST).map(|limit| {
            let axis = limit.axis.as_ref().map(|axis| format!(" of {axis}")).unwrap_or_default();
            format!("{}{axis} {:.0} %", limit.limit, limit.share * 100.0)
        });
        self.add("bound by", told.collect::<Vec<_>>().join(", "));
    }

    fn axes(&mut self, summary: &Summary) {
        let Summary { following_error: following, limits, .. } = summary;
        if !following.max.is_empty() {
            let (max, rms) = (list(&following.max, 1e3, 2), list(&following.rms, 1e3, 2));
            self.add("following error", format!("max {max} mrad, rms {rms} mrad"));
        }
        if !limits.velocity.is_empty() {
            let share = |values: &[f64]| list(values, 100.0, 0);
            let path = [limits.path_acceleration, limits.path_jerk].map(|share| share * 100.0);
            self.add(
                "limits used",
                format!(
                    "velocity {} %, acceleration {} %, jerk {} %, current {} %, path {:.0} % and \
                     {:.0} %",
                    share(&limits.velocity),
                    share(&limits.acceleration),
                    share(&limits.jerk),
                    share(&limits.effort),
                    path[0],
                    path[1],
                ),
            );
        }
    }

    fn cycles(&mut self, summary: &Summary) {
        self.add("cycles", format!("{}, {} overruns", summary.cycles, summary.overruns));
        let stalls = &summary.stalls;
        if stalls.count > 0 {
            let total = stalls.total * 1e3;
            let at = stalls.longest_at.unwrap_or_default();
            let longest = stalls.longest_text();
            let count = stalls.count;
            self.add("stalls", format!("{count}, {total:.1} ms in all; at {at:.3} s {longest}"));
        }
        if let Some(recording) = summary.recording.filter(|recording| recording.gaps > 0) {
            let RecordingSummary { cycles, gaps, missing, longest } = recording;
            let stretches = if gaps == 1 { "1 gap".to_owned() } else { format!("{gaps} gaps") };
            let text = format!(
                "{cycles} cycles, {missing} missing in {stretches}, the longest {longest:.3} s"
            );
            self.add("recording", text);
        }
        for (hop, figures) in &summary.latency {
            let [p50, p99, p999, max] =
                [figures.p50, figures.p99, figures.p999, figures.max].map(latency);
            self.add(
                &format!("latency {hop}"),
                format!("p50 {p50}, p99 {p99}, p99.9 {p999}, max {max}"),
            );
        }
    }

    fn realtime(&mut self, realtime: &Realtime) {
        let scheduler = match realtime.priority {
            0 => realtime.scheduler.clone(),
            priority => format!("{} priority {priority}", realtime.scheduler),
        };
        let cores = realtime.cores.iter().map(|(name, core)| format!("{name} on CPU {core}"));
        let locked = realtime.locked.then(|| "memory locked".to_owned());
        let set_up: Vec<String> = std::iter::once(scheduler).chain(cores).chain(locked).collect();
        self.add("real time", set_up.join(", "));
    }

    fn rest(&mut self, summary: &Summary) {
        self.add("digest", summary.digest.as_str());
        self.add("run folder", summary.out.as_deref().unwrap_or_default());
        for warning in summary.warnings.iter().chain(&summary.realtime.warnings) {
            self.add("warning", warning.as_str());
        }
    }
}

/// Numbers times `scale` with this many decimals, separated by commas.
fn list(values: &[f64], scale: f64, digits: usize) -> String {
    let values: Vec<String> =
        values.iter().map(|value| format!("{:.digits$}", value * scale)).collect();
    values.join(", ")
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
        let job = JobSummary {
            name: "letters NASO".into(),
            strokes: 5,
            length: 0.2345,
            ..JobSummary::default()
        };
        let mut summary = Summary::new(Outcome::Stopped, job, MachineSummary::default());
        summary.warnings.push("no SCHED_FIFO".into());
        let text = summary.text();
        assert!(text.starts_with("outcome           stopped\n"), "{text}");
        assert!(text.contains("job               letters NASO, 5 strokes, 234.500 mm\n"), "{text}");
        assert!(text.ends_with("warning           no SCHED_FIFO\n"), "{text}");
    }

    #[test]
    fn stalls_have_a_line_when_there_are_any() {
        let job = JobSummary::default();
        let mut summary = Summary::new(Outcome::Completed, job, MachineSummary::default());
        assert!(!summary.text().contains("stalls"));
        summary.stalls.count = 2;
        (summary.stalls.total, summary.stalls.longest) = (9e-3, 8e-3);
        (summary.stalls.longest_at, summary.stalls.longest_causes) =
            (Some(1.25), vec!["steal".into()]);
        let line =
            "stalls            2, 9.0 ms in all; at 1.250 s 8.0 ms: the hypervisor took the CPU";
        assert!(summary.text().contains(line), "{}", summary.text());
    }

    #[test]
    fn lengths_take_the_unit_that_reads_best() {
        assert_eq!(length(4.24e-6), "4.2 µm");
        assert_eq!(length(0.0123456), "12.346 mm");
    }

    #[test]
    fn a_whole_recording_goes_without_saying() {
        let machine = MachineSummary::default();
        let mut summary = Summary::new(Outcome::Completed, JobSummary::default(), machine);
        summary.recording = Some(RecordingSummary { cycles: 9, ..RecordingSummary::default() });
        assert!(!summary.text().contains("recording"));
        let gaps = RecordingSummary { cycles: 9, gaps: 2, missing: 70, longest: 0.0612 };
        summary.recording = Some(gaps);
        let line = "recording         9 cycles, 70 missing in 2 gaps, the longest 0.061 s\n";
        assert!(summary.text().contains(line), "{}", summary.text());
    }
}
