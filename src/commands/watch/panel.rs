//! What is said in words, line by line; the gravest first, because a small terminal shows the first only.

use monitor::latency::HopLatency;
use monitor::run_folder::local_time;
use monitor::summary::text::duration;
use operator::{Queue, Status};
use std::collections::BTreeMap;

/// Past faults that are shown.
const FAULTS: usize = 3;

/// The colour that a line would have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tone {
    Plain,
    Good,
    Busy,
    Bad,
}

/// A line: what it is about, and what is said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Line {
    pub(super) name: &'static str,
    pub(super) text: String,
    pub(super) tone: Tone,
}

fn line(name: &'static str, text: impl Into<String>, tone: Tone) -> Line {
    Line { name, text: text.into(), tone }
}

/// The state, with its cause.
pub(super) fn state(status: &Status) -> Line {
    let tone = match status.state.as_str() {
        "running" | "homing" | "jogging" | "probing" | "pulsing" => Tone::Good,
        "holding" | "held" | "stopping" | "preparing" => Tone::Busy,
        "fault" | "faulted" => Tone::Bad,
        _ => Tone::Plain,
    };
    let text = match &status.cause {
        Some(cause) => format!("{}: {cause}", status.state),
        None => status.state.clone(),
    };
    line("state", text, tone)
}

/// A latency in three digits [ns].
fn short(latency: u64) -> String {
    let latency = latency as f64;
    let (value, unit) = match latency {
        ..999.5e3 => (latency / 1e3, "µs"),
        999.5e3..999.5e6 => (latency / 1e6, "ms"),
        _ => (latency / 1e9, "s"),
    };
    let digits = if value < 9.995 { 2 } else { usize::from(value < 99.95) };
    format!("{value:.digits$}{unit}")
}

/// Median, 99 of 100 and the longest of each hop.
fn latency_lines(latencies: &BTreeMap<String, HopLatency>) -> Vec<Line> {
    let row = |cells: [&str; 4]| {
        let [hop, p50, p99, max] = cells;
        line("latency", format!("{hop:<9}{p50:>7}{p99:>7}{max:>7}"), Tone::Plain)
    };
    let hops = latencies.iter().map(|(hop, it)| {
        let [p50, p99, max] = [it.p50, it.p99, it.max].map(short);
        row([hop, &p50, &p99, &max])
    });
    let hops: Vec<Line> = hops.collect();
    let head = (!hops.is_empty()).then(|| row(["", "p50", "p99", "max"]));
    head.into_iter().chain(hops).collect()
}

/// The rest.
pub(super) fn lines(
    status: &Status,
    jobs: &Queue,
    latencies: &BTreeMap<String, HopLatency>,
) -> Vec<Line> {
    let mut lines = Vec::new();
    if let Some(fault) = &status.fault {
        lines.push(line("fault", fault.clone(), Tone::Bad));
    }
    let dead: Vec<_> = status
        .services
        .iter()
        .filter(|(_, pid)| pid.is_none())
        .map(|(name, _)| name.as_str())
        .collect();
    if !dead.is_empty() {
        lines.push(line("missing", dead.join(", "), Tone::Bad));
    }
    if !status.unhomed.is_empty() {
        lines.push(line("not homed", status.unhomed.join(", "), Tone::Busy));
    }
    let [x, y, z] = status.tool.map(|it| it * 1e3);
    lines.push(line("tool", format!("{x:9.3} {y:9.3} {z:7.3} mm"), Tone::Plain));
    if let Some(job) = &status.job {
        lines.push(line("job", job.clone(), Tone::Plain));
        let of = if status.strokes > 0 { format!(" of {}", status.strokes) } else { String::new() };
        let at = status.line.map_or(String::new(), |line| format!(", line {line}"));
        lines.push(line("stroke", format!("{}{of}{at}", status.stroke), Tone::Plain));
    }
    let overridden = |share: f64| match (share * 100.0).round() {
        100.0 | 0.0 => String::new(),
        percent => format!(", override {percent} %"),
    };
    let rate = format!("{:.0} %{}", status.rate * 100.0, overridden(status.rate_override));
    lines.push(line("rate", rate, Tone::Plain));
    let light = if status.lit { "lit" } else { "dark" };
    let laser = format!(
        "{light}, {:.0} %{}, {:.1} mm/s",
        status.power * 100.0,
        overridden(status.power_override),
        status.speed * 1e3
    );
    lines.push(line("laser", laser, if status.lit { Tone::Busy } else { Tone::Plain }));
    if !jobs.waiting.is_empty() {
        let count = jobs.waiting.len();
        let names = jobs.waiting.iter().map(|job| job.name.as_str()).collect::<Vec<_>>().join(", ");
        let held = if jobs.held.is_some() { ", held" } else { "" };
        lines.push(line("queue", format!("{count}{held}: {names}"), Tone::Plain));
    }
    lines.push(line("planner", status.planner.clone(), Tone::Plain));
    for (name, axis) in &status.axes {
        let text = match axis.unit.as_str() {
            "rad" => format!("{name} {:9.3}°", axis.position.to_degrees()),
            _ => format!("{name} {:9.3} mm", axis.position * 1e3),
        };
        lines.push(line("axis", text, Tone::Plain));
    }
    let tone = if status.overruns > 0 { Tone::Busy } else { Tone::Plain };
    lines.push(line("cycles", format!("{}, {} overruns", status.cycles, status.overruns), tone));
    lines.extend(latency_lines(latencies));
    let pids = status.services.iter().filter_map(|(name, pid)| Some(format!("{name} {}", (*pid)?)));
    lines.extend(pids.map(|text| line("service", text, Tone::Plain)));
    for fault in status.faults.iter().rev().take(FAULTS) {
        let text = format!("{} {}", local_time(fault.time), fault.detail);
        lines.push(line("past", text, Tone::Plain));
    }
    lines
}

/// How much of the job under way has been played, 0 to 1; `None` without one.
fn share(status: &Status) -> Option<f64> {
    status.job.as_ref()?;
    // The number of setpoints grows for as long as the job is planned; the time that it takes is estimated.
    let share = match (status.elapsed, status.time_left) {
        (Some(elapsed), Some(left)) if elapsed + left > 0.0 => elapsed / (elapsed + left),
        _ if status.samples > 0 => status.played as f64 / status.samples as f64,
        _ => 0.0,
    };
    Some(share.clamp(0.0, 1.0))
}

/// The bar of a job, `width` characters long, with its times.
pub(super) fn progress(status: &Status, width: usize) -> Option<String> {
    let share = share(status)?;
    let mut times = format!(" {:3.0} %", share * 100.0);
    if let Some(elapsed) = status.elapsed {
        times += &format!("  {}", duration(elapsed));
    }
    if let Some(left) = status.time_left {
        times += &format!("  {} left", duration(left));
    }
    let room = width.saturating_sub(times.chars().count());
    let filled = ((share * room as f64) as usize).min(room);
    Some("█".repeat(filled) + &"░".repeat(room - filled) + &times)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use operator::QueuedJob;

    #[test]
    fn what_is_wrong_comes_first() {
        let status = Status {
            fault: Some("following error of x".to_owned()),
            services: [("drives".to_owned(), None), ("planner".to_owned(), Some(7))].into(),
            unhomed: vec!["x".to_owned()],
            power_override: 0.8,
            ..Status::default()
        };
        let jobs = Queue {
            waiting: vec![QueuedJob { name: "badge".to_owned(), ..QueuedJob::default() }],
            ..Queue::default()
        };
        let lines = lines(&status, &jobs, &BTreeMap::new());
        assert!(lines.iter().any(|line| line.text == "1: badge"));
        assert!(lines.iter().any(|line| line.text == "dark, 0 %, override 80 %, 0.0 mm/s"));
        let names: Vec<_> = lines.iter().map(|line| line.name).collect();
        assert_eq!(names[..3], ["fault", "missing", "not homed"]);
        assert_eq!((lines[1].text.as_str(), lines[1].tone), ("drives", Tone::Bad));
        assert!(lines.iter().any(|line| line.text == "planner 7"));
    }

    #[test]
    fn latencies_are_told_hop_by_hop_in_the_width_that_there_is() {
        let of = |p50, p99, max| HopLatency { count: 9, min: 1, p50, p99, p999: p99, max };
        let latencies = BTreeMap::from([
            ("loop".to_owned(), of(1_000_400, 1_002_000, 12_345_678)),
            ("setpoint".to_owned(), of(1_400_897_500, 999_499, 99_950)),
            ("wake".to_owned(), of(3, 18_340, 129_600)),
        ]);
        let lines = lines(&Status::default(), &Queue::default(), &latencies);
        let told: Vec<_> =
            lines.iter().filter(|line| line.name == "latency").map(|line| &line.text).collect();
        let expected = [
            "             p50    p99    max",
            "loop      1.00ms 1.00ms 12.3ms",
            "setpoint   1.40s  999µs  100µs",
            "wake      0.00µs 18.3µs  130µs",
        ];
        assert_eq!(told, expected);
        assert!(told.iter().all(|text| text.chars().count() <= 30));
    }

    #[test]
    fn a_cause_is_told_with_the_state() {
        let status = Status {
            state: "held".to_owned(),
            cause: Some("programmed pause (M0), line 12".to_owned()),
            ..Status::default()
        };
        assert_eq!(state(&status).text, "held: programmed pause (M0), line 12");
    }

    #[test]
    fn the_share_is_one_of_time_where_that_is_known() {
        let mut status = Status { job: Some("a".to_owned()), ..Status::default() };
        assert_eq!(share(&status), Some(0.0));
        (status.played, status.samples) = (1, 4);
        assert_eq!(share(&status), Some(0.25));
        (status.elapsed, status.time_left) = (Some(30.0), Some(10.0));
        assert_eq!(share(&status), Some(0.75));
        status.job = None;
        assert_eq!(share(&status), None);
    }

    #[test]
    fn the_bar_fits_its_width() {
        let status = Status {
            job: Some("a".to_owned()),
            played: 500,
            samples: 1000,
            time_left: Some(12.0),
            ..Status::default()
        };
        for width in [60, 30, 3, 0] {
            let bar = progress(&status, width).unwrap();
            assert!(bar.contains(" 50 %"), "{bar}");
            assert!(
                bar.chars().count()
                    <= width.max(bar.trim_start_matches(['█', '░']).chars().count())
            );
        }
        assert_eq!(progress(&Status::default(), 60), None);
    }
}
