//! The report of a synthetic run: a circle and a cross, with the faults a person should see.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::latency::IntervalLog;
use crate::marks::StreamEnd;
use crate::run_analysis::{Clock, RunAnalysis};
use crate::stage::{Inputs, MonitorStage, Outputs};
use crate::summary::{JobSummary, MachineSummary, Outcome};
use messages::artwork::Stroke;
use messages::feedback::status;
use messages::time::{Period, SETPOINT_TIME as CYCLE_TIME};
use messages::{Command, Cycle, Feedback, LaserCycle, Nanoseconds, math};
use std::time::{Duration, SystemTime};

const SPEED: f64 = 0.1;
const RADIUS: f64 = 0.01;

/// The tool at a time [s], and its stroke: round a circle, then a dark way, then a line across.
fn plan(time: f64) -> ([f64; 3], u64) {
    let turn = math::TURN * RADIUS / SPEED;
    match time {
        t if t < turn => {
            let (sine, cosine) = math::sin_cos(SPEED * t / RADIUS);
            ([0.1 + RADIUS * cosine, 0.1 + RADIUS * sine, 0.0], 1)
        }
        t if t < turn + 0.1 => ([0.1 + RADIUS - SPEED * (t - turn), 0.1, 0.0], 0),
        t => ([0.1 - SPEED * (t - turn - 0.1), 0.1, 0.0], u64::from(t < turn + 0.2) * 2),
    }
}

fn artwork() -> Artwork {
    let circle = (0..=1000).map(|index| {
        let (sine, cosine) = math::sin_cos(math::TURN * f64::from(index) / 1000.0);
        [0.1 + RADIUS * cosine, 0.1 + RADIUS * sine, 0.0]
    });
    let line = vec![[0.1, 0.1, 0.0], [0.1 - RADIUS, 0.1, 0.0]];
    Artwork {
        strokes: vec![
            Stroke { points: circle.collect(), line: 1 },
            Stroke { points: line, line: 2 },
        ],
    }
}

fn samples(cycles: u64) -> (Vec<Feedback>, Vec<Command>) {
    (0..cycles)
        .map(|cycle| {
            let time = cycle as f64 * CYCLE_TIME;
            let at = |offset: i64| Nanoseconds(1_000_000_000 + cycle as i64 * 1_000_000 + offset);
            let noise = |seed: f64| math::sin(time * seed) * math::sin(time * 1.7 * seed + 1.0);
            let (planned, _) = plan(time);
            let stroke = if cycle > 0 { plan(time - 0.5 * CYCLE_TIME).1 } else { 0 };
            let laser = LaserCycle { gate: stroke as u32, power: 0.8, ..LaserCycle::OFF };
            let late = (30_000.0 * noise(777.0).abs()) as i64;
            let mut feedback = Feedback {
                cycle: Cycle(cycle),
                deadline: at(0),
                measured: at(2_000),
                published: at(4_000 + late / 4),
                exchange: Nanoseconds(2_500),
                command_cycle: Cycle(cycle.saturating_sub(1)),
                command_received: at(70_000 + late - 1_000_000),
                command_published: at(61_000 + late - 1_000_000),
                command_applied: at(1_000),
                status: status::TOOL_KNOWN,
                tool: [planned[0] + 6e-6 * noise(90.0), planned[1] + 5e-6 * noise(71.0), 0.0],
                laser,
                ..Feedback::default()
            };
            let mut command = Command {
                cycle: Cycle(cycle),
                stream: 1,
                stroke: plan(time + 1.5 * CYCLE_TIME).1,
                received: at(15_000 + late / 2),
                published: at(40_000 + late / 2),
                setpoint_published: at(-80_000_000),
                mode: 4,
                tool: planned,
                ..Command::default()
            };
            for axis in 0..2 {
                command.following_error[axis] = 2e-3 * noise(90.0 + 20.0 * axis as f64);
                command.voltage[axis] = 12.0 * math::sin(10.0 * time + axis as f64);
                feedback.current[axis] = 0.6 * noise(20.0 + 3.0 * axis as f64);
            }
            (feedback, command)
        })
        .unzip()
}

#[test]
fn the_page_shows_the_run_and_needs_no_network() {
    let (feedbacks, commands) = samples(1000);
    let mut stage = MonitorStage::new();
    let mut outputs = Outputs::default();
    let artwork = artwork();
    let mut analysis = RunAnalysis::new(&artwork, Clock::Real, Period::OF_SETPOINTS);
    let mut count = 0;
    for (feedbacks, commands) in feedbacks.chunks(100).zip(commands.chunks(100)) {
        stage.step(&Inputs { feedbacks, commands }, &mut outputs);
        count += outputs.records.len();
        outputs.records.iter().for_each(|record| analysis.push(record));
    }
    stage.finish(&mut outputs);
    assert_eq!((count, outputs.records.len(), stage.continuity().missing), (1000, 0, 0));

    let results = analysis.finish(StreamEnd::Unknown);
    let machine = MachineSummary {
        name: "sample <machine>".into(),
        mechanism: "corexy".into(),
        axes: vec!["a".into(), "b".into()],
        actuators: vec!["a".into(), "b".into()],
    };
    let job = JobSummary { name: "circle & cross".into(), strokes: 2, length: artwork.length() };
    let mut summary = Summary::new(Outcome::Completed, job, machine);
    summary.marks = Some(results.marks.unwrap().marks);
    summary.latency = results.histograms.summary();
    assert_eq!(stage.histograms().summary(), summary.latency);
    summary.warnings.push("memory is not locked".into());
    let report = Report {
        summary: &summary,
        artwork: &artwork,
        trace: &results.trace,
        torque_constants: &[0.0136, 0.0136],
        histograms: &results.histograms,
    };
    // To look at the files: GRAVER_KEEP_REPORT=folder cargo test -p monitor
    let temporary = tempfile::tempdir().unwrap();
    let kept = std::env::var_os("GRAVER_KEEP_REPORT");
    let folder =
        RunFolder::create_at(kept.as_ref().map_or(temporary.path(), |kept| kept.as_ref())).unwrap();
    report.write(&folder).unwrap();
    let mut log = IntervalLog::new(Vec::new(), SystemTime::UNIX_EPOCH).unwrap();
    let second = Duration::from_secs(1);
    stage.histograms_mut().write_interval(&mut log, Duration::ZERO, second).unwrap();
    folder.write(run_folder::LATENCY, log.finish().unwrap()).unwrap();
    let page = std::fs::read_to_string(folder.file(run_folder::REPORT)).unwrap();
    let picture = std::fs::read_to_string(folder.file(run_folder::PICTURE)).unwrap();

    assert!(picture.starts_with("<svg") && picture.contains("planned"));
    assert_eq!(page.matches("<svg").count(), 10);
    assert!(page.contains("circle &amp; cross on sample &lt;machine&gt;"));
    for text in
        ["x [mm]", "time [s]", "following error [mrad]", "motor torque [mN·m]", "latency [µs]"]
    {
        assert!(page.contains(text), "{text}");
    }
    // The one address is the name of the SVG language, which nobody fetches.
    let addresses = page.replace("http://www.w3.org/2000/svg", "");
    for reference in ["http:", "https:", "src=", "href=", "url(", "@import"] {
        assert!(!addresses.contains(reference), "{reference}");
    }
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
}

#[test]
fn a_run_without_marks_has_a_report_too() {
    let summary = Summary::new(Outcome::Aborted, JobSummary::default(), MachineSummary::default());
    let artwork = Artwork::default();
    let results =
        RunAnalysis::new(&artwork, Clock::Virtual, Period::OF_SETPOINTS).finish(StreamEnd::Unknown);
    let report = Report {
        summary: &summary,
        artwork: &artwork,
        trace: &results.trace,
        torque_constants: &[],
        histograms: &results.histograms,
    };
    assert!(report.picture().unwrap().contains("nothing was marked"));
    assert!(report.page().unwrap().contains("aborted"));
}
