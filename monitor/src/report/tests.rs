//! The report of a synthetic run: a circle and a cross, with the faults a person should see.
#![allow(clippy::unwrap_used)]

use super::column::Layout;
use super::*;
use crate::latency::IntervalLog;
use crate::marks::StreamEnd;
use crate::recording::CycleRecord;
use crate::run_analysis::{Clock, RunAnalysis};
use crate::stage::{Inputs, MonitorStage, Outputs};
use crate::summary::{JobSummary, MachineSummary, Outcome};
use messages::artwork::Stroke;
use messages::feedback::status;
use messages::time::{Period, SETPOINT_TIME as CYCLE_TIME};
use messages::{Command, Cycle, Feedback, LaserCycle, Nanoseconds, math};
use serde_json::Value;
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
    let job = JobSummary {
        name: "circle & cross".into(),
        strokes: 2,
        length: artwork.length(),
        ..JobSummary::default()
    };
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

    // What the script reads.
    let header = header(&page);
    assert_eq!((&header["stride"], &header["strokes"]), (&1.into(), &2.into()));
    let curve = |chart: &str, name: &str| {
        let curves = header["curves"].as_array().unwrap();
        let of = |curve: &&Value| curve["chart"] == chart && curve["name"] == name;
        let curve = curves.iter().find(of).unwrap();
        let [low, step] = ["low", "step"].map(|key| curve[key].as_f64().unwrap());
        let value = |steps: i64| (steps > 0).then_some(low + (steps - 1) as f64 * step);
        columns(&page, curve).remove(0).into_iter().map(value).collect::<Vec<_>>()
    };
    let speeds = curve("speed", "tool");
    assert_eq!(speeds.len(), 999);
    assert!((speeds[300].unwrap() - SPEED).abs() < 0.01 * SPEED, "{:?}", speeds[300]);
    let voltages = curve("voltage", "b");
    assert!((voltages[100].unwrap() - 12.0 * math::sin(2.0)).abs() < 1e-3, "{:?}", voltages[100]);
    let lit = |time: usize| curve("deviation", "lit")[time].is_some();
    assert!(lit(300) && !lit(680) && lit(760) && !lit(900));

    let track = columns(&page, &header["track"]);
    let [times, x, y, light, strokes] = [0, 1, 2, 7, 8].map(|column| &track[column]);
    let at = times.iter().position(|time| *time == 300_000).unwrap();
    let (planned, _) = plan(0.3);
    for (steps, planned) in [(x[at], planned[0]), (y[at], planned[1])] {
        assert!((steps as f64 * 1e-7 - planned).abs() < 1e-5, "{steps} {planned}");
    }
    assert_eq!((light[at], strokes[at]), (2 + 200, 1));
    assert_eq!(light.last(), Some(&0), "nobody knows what comes after the end");

    let planned = columns(&page, &header["plan"]);
    assert_eq!(planned[4], [1, 2], "lines of the strokes");
    // The circle, and the line, each with its last point of no stroke.
    assert_eq!(planned[3].iter().filter(|stroke| **stroke == 0).count(), 2);
    assert_eq!(planned[0].last(), Some(&900_000));
}

/// The header of the data in a page.
fn header(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"run\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

/// The columns that an entry of the header names.
fn columns(page: &str, entry: &Value) -> Vec<Vec<i64>> {
    let layouts: Vec<Layout> = serde_json::from_value(entry["layouts"].clone()).unwrap();
    let numbers = entry["columns"].as_array().unwrap();
    (numbers.iter().zip(layouts))
        .map(|(number, layout)| {
            let (_, rest) = page.split_once(&format!("id=\"column-{number}\">")).unwrap();
            column::tests::read(layout, rest.split_once("</script>").unwrap().0)
        })
        .collect()
}

#[test]
fn a_long_run_is_told_in_wider_buckets_and_no_extreme_is_lost() {
    let mut trace = Trace::new(false, Period::OF_SETPOINTS);
    for cycle in 0..200_000_u64 {
        let noise = math::sin(cycle as f64 * 0.7) * math::sin(cycle as f64 * 0.011);
        let spike = if cycle == 123_457 { 5.0 } else { 0.0 };
        trace.speed.push(Some(1.0 + 0.3 * noise + spike));
        trace.voltage[1].push(Some(noise));
    }
    let machine =
        MachineSummary { actuators: vec!["a".into(), "b".into()], ..MachineSummary::default() };
    let summary = Summary::new(Outcome::Completed, JobSummary::default(), machine);
    let report = Report {
        summary: &summary,
        artwork: &Artwork::default(),
        trace: &trace,
        torque_constants: &[],
        histograms: &HopHistograms::new(),
    };
    let whole = report.data(usize::MAX).unwrap();
    assert_eq!(header(&whole)["stride"], 1);
    let budget = 200_000;
    let small = report.data(budget).unwrap();
    assert!(small.len() < budget, "{} bytes", small.len());
    let header = header(&small);
    let stride = header["stride"].as_u64().unwrap();
    assert!((2..=64).contains(&stride), "{stride}");
    let curve = &header["curves"][0];
    let [lowest, above] = columns(&small, curve).try_into().unwrap();
    let spike = 123_457 / stride as usize;
    let [low, step] = ["low", "step"].map(|key| curve[key].as_f64().unwrap());
    let highest = low + (lowest[spike] + above[spike] - 1) as f64 * step;
    assert!((highest - 6.0).abs() < 0.4, "{highest}");
    assert_eq!(lowest.len(), 200_000_usize.div_ceil(stride as usize));
}

/// To look at: GRAVER_KEEP_REPORT=folder cargo test --workspace --lib -- --ignored an_hour
#[test]
#[ignore = "takes a minute"]
fn an_hour_fits_into_twenty_megabytes() {
    const CYCLES: u64 = 3_600_000;
    let circle = |turn: f64, radius: f64| {
        let (sine, cosine) = math::sin_cos(turn);
        [0.1 + radius * cosine, 0.1 + radius * sine, 0.0]
    };
    // Round and round, at 0.1 m/s, a little wider with each turn; every fifth turn in the dark.
    let place = |cycle: u64| {
        let radius = 0.002 + 2e-8 * cycle as f64;
        let turn = 0.1 * CYCLE_TIME / 2e-8 * math::ln(radius / 0.002);
        (circle(turn, radius), (turn / math::TURN) as u64)
    };
    let mut artwork = Artwork::default();
    for cycle in (0..CYCLES).step_by(5) {
        let (point, turn) = place(cycle);
        if turn as usize >= artwork.strokes.len() {
            artwork.strokes.push(Stroke { points: Vec::new(), line: turn + 1 });
        }
        if turn % 5 < 4 || artwork.strokes[turn as usize].points.is_empty() {
            artwork.strokes[turn as usize].points.push(point);
        }
    }
    let (feedbacks, commands) = samples(1000);
    let mut analysis =
        RunAnalysis::new(&artwork, Clock::Real, Period::OF_SETPOINTS).with_actuators(6);
    for cycle in 0..CYCLES {
        let (planned, turn) = place(cycle);
        let (mut feedback, mut command) =
            (feedbacks[(cycle % 1000) as usize], commands[(cycle % 1000) as usize]);
        let shift = Nanoseconds((cycle / 1000) as i64 * 1_000_000_000);
        for stamp in [
            &mut feedback.deadline,
            &mut feedback.measured,
            &mut feedback.published,
            &mut feedback.command_received,
            &mut feedback.command_published,
        ] {
            *stamp = Nanoseconds(stamp.0 + shift.0);
        }
        for stamp in [&mut command.received, &mut command.published] {
            *stamp = Nanoseconds(stamp.0 + shift.0);
        }
        // In the plane, the deviation of the short run.
        let places = feedback.tool.iter_mut().zip(command.tool).zip(planned).take(2);
        places.for_each(|((tool, before), planned)| *tool += planned - before);
        for axis in 2..6 {
            let wave = math::sin(0.01 * cycle as f64 + axis as f64);
            command.following_error[axis] = command.following_error[axis % 2] * wave;
            command.voltage[axis] = 9.0 * wave + command.following_error[0] * 100.0;
            feedback.current[axis] = 0.4 * wave + 0.1 * feedback.current[axis % 2];
        }
        (feedback.cycle, command.cycle) = (Cycle(cycle), Cycle(cycle));
        feedback.command_cycle = Cycle(cycle.saturating_sub(1));
        command.tool = planned;
        feedback.laser.gate = if turn % 5 < 4 { turn as u32 + 1 } else { 0 };
        (command.stroke, command.stream_time) = (0, cycle as f64 * CYCLE_TIME);
        analysis.push(&CycleRecord { feedback, command });
    }
    let results = analysis.finish(StreamEnd::Unknown);
    let names: Vec<String> = ["x", "y", "z", "a", "b", "c"].map(str::to_owned).into();
    let machine = MachineSummary {
        name: "hour".into(),
        mechanism: "serial".into(),
        axes: names.clone(),
        actuators: names,
    };
    let job = JobSummary {
        name: "spiral".into(),
        strokes: artwork.strokes.len() as u64,
        length: artwork.length(),
        ..JobSummary::default()
    };
    let summary = Summary::new(Outcome::Completed, job, machine);
    let report = Report {
        summary: &summary,
        artwork: &artwork,
        trace: &results.trace,
        torque_constants: &[0.0136; 6],
        histograms: &results.histograms,
    };
    let page = report.page().unwrap();
    if let Some(kept) = std::env::var_os("GRAVER_KEEP_REPORT") {
        let folder = RunFolder::create_at(kept.as_ref()).unwrap();
        folder.write(run_folder::REPORT, &page).unwrap();
    }
    assert!(page.len() < 20_000_000, "{} bytes", page.len());
    let header = header(&page);
    assert_eq!(header["time"], 3599.999);
    assert!(header["track"]["tolerance"].as_f64().unwrap() < 2e-5, "{}", header["track"]);
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
