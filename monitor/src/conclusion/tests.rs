//! Summaries from made-up outcomes and recordings, with numbers worked out by hand.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::recording::CycleRecord;
use crate::recording::file::Description;
use crate::recording::file::writer::RecordingWriter;
use messages::artwork::{ArtworkLine, Stroke};
use messages::feedback::status;
use messages::plan::Note;
use messages::report::refused;
use messages::time::SETPOINT_TIME as CYCLE_TIME;
use messages::{
    Command, ControllerState, Cycle, Fault, FaultCode, Feedback, LaserCycle, Nanoseconds,
};

/// The first cycle that is played, and the last.
const FIRST: u64 = 500;
const LAST: u64 = 599;

/// 20 mm along x at 0.25 m/s from cycle `FIRST + 1` on: lit in 80 cycles.
const LENGTH: f64 = 0.02;
const LIT: u64 = 80;

fn artwork() -> Artwork {
    Artwork { strokes: vec![Stroke { points: vec![[0.0; 3], [LENGTH, 0.0, 0.0]], line: 1 }] }
}

fn record(cycle: u64) -> CycleRecord {
    let along = |cycle: u64| 0.25 * CYCLE_TIME * (cycle as f64 - (FIRST + 1) as f64);
    let tool = [along(cycle), 0.0, 0.0];
    // Feedback tells the light of the cycle before it.
    let laser = |cycle: u64| {
        let lit = (FIRST + 2..FIRST + 2 + LIT).contains(&cycle);
        LaserCycle { gate: u32::from(lit), power: 0.5, ..LaserCycle::OFF }
    };
    CycleRecord {
        feedback: Feedback {
            cycle: Cycle(cycle),
            command_cycle: Cycle(cycle - 1),
            command_received: Nanoseconds(1),
            command_published: Nanoseconds(1),
            status: status::TOOL_KNOWN,
            tool,
            laser: laser(cycle),
            ..Feedback::default()
        },
        command: Command {
            cycle: Cycle(cycle),
            stream: 1,
            stream_time: CYCLE_TIME * cycle.saturating_sub(FIRST) as f64,
            state: ControllerState::Running as u32,
            // A command acts one cycle later; it asks for light one cycle before that is told.
            laser: laser(cycle + 2),
            mode: 4,
            tool,
            ..Command::default()
        },
    }
}

fn examined(cycles: impl Iterator<Item = u64>) -> RunResults {
    let artwork = artwork();
    let mut analysis =
        RunAnalysis::new(&artwork, Clock::Virtual, Period::OF_SETPOINTS).with_fastest(0.25);
    cycles.for_each(|cycle| analysis.push(&record(cycle)));
    analysis.finish(StreamEnd::Reported(&report()))
}

fn report() -> ControllerReport {
    ControllerReport {
        stream: 1,
        is_final: 1,
        completed: 1,
        cycles: LAST - FIRST + 1,
        first_cycle: Cycle(FIRST),
        last_cycle: Cycle(LAST),
        ..ControllerReport::default()
    }
}

fn plan() -> PlanFacts {
    PlanFacts {
        name: "line".into(),
        strokes: 1,
        length: LENGTH,
        duration: 0.08,
        samples: 99,
        notes: vec![
            Note { line: 0, text: "everywhere".into() },
            Note { line: 7, text: "here".into() },
        ],
        ..PlanFacts::default()
    }
}

fn ended(controller: ControllerReport) -> RunOutcome {
    RunOutcome { controller: Some(controller), ..RunOutcome::default() }
}

fn summary_of(run_outcome: &RunOutcome, results: Option<&RunResults>) -> Summary {
    summarise(&Machine::builtin(), &plan(), run_outcome, results, Clock::Virtual)
}

fn fault() -> Fault {
    let code = FaultCode::FollowingError as u32;
    Fault { code, axis: 1, value: 0.3, limit: 0.2, ..Fault::default() }
}

#[test]
fn what_happens_after_a_completed_job_is_none_of_its_faults() {
    let drives = Some(DrivesReport { fault: fault(), ..DrivesReport::default() });
    let message = "the supervisor died".to_owned();
    let error = Some(ErrorSummary { file: None, line: None, column: None, message });
    let outcome = Some(Outcome::Aborted);
    let late = RunOutcome { drives, outcome, error: error.clone(), ..ended(report()) };
    let summary = summary_of(&late, None);
    assert_eq!(
        (summary.outcome, &summary.fault, &summary.error),
        (Outcome::Completed, &None, &None)
    );
    let told = &summary.warnings[2..];
    assert!(told[0].starts_with("after the job: following_error of axis"), "{told:?}");
    assert_eq!(told[1], "after the job: the supervisor died");

    let early = RunOutcome { drives, outcome, error, ..RunOutcome::default() };
    let summary = summary_of(&early, None);
    assert_eq!(summary.outcome, Outcome::Faulted);
    assert!(summary.fault.is_some() && summary.error.is_some());
    let latched = RunOutcome { latched: fault(), ..RunOutcome::default() };
    assert!(summary_of(&latched, None).fault.is_some());
}

#[test]
fn a_fault_names_its_axis() {
    let broken_off = ControllerReport { fault: fault(), completed: 0, ..report() };
    let summary = summary_of(&ended(broken_off), None);
    let machine = Machine::builtin();
    assert_eq!(summary.fault.unwrap().axis, Some(machine.axes[0].name.clone()));
    assert_eq!(summary.machine.axes.len(), machine.axes.len());
}

#[test]
fn time_is_that_of_the_motion_with_its_holds() {
    // Of the 100 setpoints, 80 are motion.
    for (cycles, completed, time) in [
        (100, 1, 0.08),
        // Held for 250 cycles.
        (350, 1, 0.33),
        // Played faster.
        (60, 1, 0.04),
        // More saved at rest than the motion takes.
        (15, 1, 0.0),
        // Broken off: the rest before the motion cannot be told from it.
        (42, 0, 0.042),
    ] {
        let summary = summary_of(&ended(ControllerReport { cycles, completed, ..report() }), None);
        assert!((summary.time - time).abs() < 1e-12, "{cycles}: {}", summary.time);
        assert_eq!(summary.cycles, cycles);
    }
}

/// Cycles of 1 ms at 0.25 m/s.
const STEP: f64 = 2.5e-4;

#[test]
fn what_was_not_recorded_is_told_and_the_rest_is_judged() {
    let end = LAST + LIGHT_LAG;
    let check = |cycles: &dyn Fn(u64) -> bool, unrecorded: f64, warning: Option<&str>| {
        let results = examined((FIRST..=end).filter(|cycle| cycles(*cycle)));
        let summary = summary_of(&ended(report()), Some(&results));
        let marks = summary.marks.unwrap();
        assert!((marks.length + unrecorded - LENGTH).abs() < 1e-12, "{marks:?}");
        assert!((marks.unrecorded - unrecorded).abs() < 1e-12, "{marks:?}");
        let certain = marks.missing - marks.unrecorded;
        assert!(certain < 1e-12 && marks.double < 1e-12, "{marks:?}");
        assert_eq!((marks.strokes_lost, marks.missing_end_max), (0, 0.0), "{marks:?}");
        assert_eq!(summary.warnings[..2], ["everywhere", "line 7: here"]);
        assert_eq!(summary.warnings.get(2).map(String::as_str), warning);
        summary.recording.unwrap()
    };
    let told =
        "not all was recorded: 5.000 mm of stroke 1 may be marked or missing and are not judged";
    let whole = check(&|_| true, 0.0, None);
    assert_eq!((whole.cycles, whole.gaps, whole.missing), (102, 0, 0));
    // In the middle of the stroke: 19 cycles are gone, and with them 20 ways between two.
    let gap = check(&|cycle| !(520..539).contains(&cycle), 20.0 * STEP, Some(told));
    assert_eq!((gap.cycles, gap.gaps, gap.missing, gap.longest), (83, 1, 19, 0.019));
    // Its beginning and its end, where the first and the last of 80 lit cycles are 501 and 580.
    check(&|cycle| cycle >= 521, 20.0 * STEP, Some(told));
    check(&|cycle| cycle <= 561, 20.0 * STEP, Some(told));
    // In the dark nothing is hidden.
    let dark = check(&|cycle| !(585..595).contains(&cycle), 0.0, None);
    assert_eq!((dark.gaps, dark.missing), (1, 10));
    check(&|cycle| cycle <= 590, 0.0, None);
}

#[test]
fn nothing_recorded_or_an_end_that_nobody_knows_is_said() {
    let summary = |run_outcome: &RunOutcome, cycles: std::ops::Range<u64>| {
        let artwork = artwork();
        let mut analysis = RunAnalysis::new(&artwork, Clock::Virtual, Period::OF_SETPOINTS);
        cycles.for_each(|cycle| analysis.push(&record(cycle)));
        summary_of(
            run_outcome,
            Some(&analysis.finish(StreamEnd::of(run_outcome.controller.as_ref()))),
        )
    };
    let nothing = summary(&ended(report()), 0..0);
    assert_eq!(nothing.marks, None);
    assert_eq!(nothing.warnings[2], "the marks are not judged: nothing of the job was recorded");
    assert_eq!(nothing.recording.unwrap().missing, LAST + LIGHT_LAG - FIRST + 1);
    // The controller did not say where the job ends, and the last record is lit.
    let open = summary(&RunOutcome::default(), FIRST..FIRST + 41);
    let marks = open.marks.unwrap();
    assert!((marks.unrecorded - 41.0 * STEP).abs() < 1e-12, "{marks:?}");
    assert!(open.warnings[2].contains("10.250 mm of stroke 1"), "{:?}", open.warnings);
    assert!(open.warnings[3].contains("nobody can tell how far it went on"), "{:?}", open.warnings);
}

#[test]
fn a_job_that_was_stopped_is_judged_by_what_it_had_come_to_and_says_where_to_go_on() {
    // Stopped after 41 lit cycles; the same line a second time was never begun.
    let line = artwork().strokes.remove(0);
    let artwork = Artwork { strokes: vec![line.clone(), Stroke { line: 2, ..line }] };
    let last = FIRST + 1 + 41;
    let mut analysis = RunAnalysis::new(&artwork, Clock::Virtual, Period::OF_SETPOINTS);
    for cycle in FIRST..=last + LIGHT_LAG {
        let mut record = record(cycle);
        if cycle > last {
            record.command.state = ControllerState::Stopping as u32;
            record.command.laser = LaserCycle::OFF;
            record.command.stroke = 0;
        }
        if cycle > last + 1 {
            record.feedback.laser = LaserCycle::OFF;
        }
        analysis.push(&record);
    }
    let stopped = ControllerReport { last_cycle: Cycle(last), completed: 0, ..report() };
    let results = analysis.finish(StreamEnd::Reported(&stopped));
    let plan = PlanFacts { strokes: 2, passed_over: 6, is_whole: true, ..plan() };
    let outcome = ended(stopped);
    let summary = summarise(&Machine::builtin(), &plan, &outcome, Some(&results), Clock::Virtual);
    let (marks, left) = (summary.marks.as_ref().unwrap(), summary.left.unwrap());
    assert_eq!((marks.missing, marks.strokes_lost, marks.double), (0.0, 0, 0.0), "{marks:?}");
    assert!((marks.length + left.length - 2.0 * LENGTH).abs() < 1e-12, "{left:?}");
    assert_eq!((left.strokes_done, left.strokes, left.from_stroke), (6, 8, 7));
    assert!((left.along - marks.length).abs() < 1e-9 && left.along > 0.01, "{left:?}");
    let place = summary.place.as_ref().unwrap();
    assert_eq!((place.stroke, place.line), (7, Some(1)));
    assert_eq!(place.bounds, Some([[0.0; 3], [LENGTH, 0.0, 0.0]]));
    assert!((place.tool.unwrap()[0] - left.along).abs() < 1e-12, "{place:?}");
    let text = summary.text();
    assert!(text.contains("left              6 of 8 strokes done, 10."), "{text}");
    assert!(
        text.contains("go on with --set marking.from_stroke=7 --set marking.from_along=\"10."),
        "{text}"
    );
    assert!(text.contains("ended at          line 1, stroke 7, drawn in x 0.0 µm to"), "{text}");
    // One that was played to its end has nothing left.
    let whole = examined(FIRST..=LAST + LIGHT_LAG);
    assert_eq!(summary_of(&ended(report()), Some(&whole)).left, None);
}

#[test]
fn overruns_are_those_of_the_run() {
    let overruns = |before: u64| {
        let drives = Some(DrivesReport { overruns: 12, ..DrivesReport::default() });
        summary_of(&RunOutcome { drives, overruns_before: before, ..ended(report()) }, None)
            .overruns
    };
    // Drives that were restarted count from 0 again.
    assert_eq!([overruns(0), overruns(5), overruns(20)], [12, 7, 0]);
}

#[test]
fn real_time_is_claimed_and_missed_only_as_reported() {
    let machine = Machine::builtin();
    let silent = RealtimeFacts::default();
    let of = |controller: Option<RealtimeFacts>, drives: Option<RealtimeFacts>| {
        let run_outcome = RunOutcome {
            controller: controller.map(|realtime| ControllerReport { realtime, ..report() }),
            drives: drives.map(|realtime| {
                let cycle = Cycle(if realtime == silent { 0 } else { LAST });
                DrivesReport { realtime, cycle, ..DrivesReport::default() }
            }),
            ..RunOutcome::default()
        };
        summarise(&machine, &plan(), &run_outcome, None, Clock::Real).realtime
    };
    let none = RealtimeFacts { core: -1, asked_priority: 80, ..RealtimeFacts::default() };
    let good = RealtimeFacts { fifo: 1, priority: 80, core: 1, locked: 1, ..none };
    let bare = RealtimeFacts {
        refused: refused::PRIORITY | refused::MEMORY | refused::CORE,
        priority_error: 1,
        memory_limit: 8 << 20,
        memory_needed: 300 << 20,
        asked_core: 3,
        ..none
    };

    let both = of(Some(good), Some(good));
    assert_eq!((both.scheduler.as_str(), both.priority, both.locked), ("fifo", 80, true));
    assert_eq!((both.cores.len(), both.warnings.len()), (2, 0));
    let one = of(Some(good), Some(bare));
    assert_eq!((one.scheduler.as_str(), one.priority, one.locked), ("other", 0, false));
    assert_eq!(one.cores.keys().collect::<Vec<_>>(), ["controller"]);
    let expect = [
        "no real-time priority for drives (SCHED_FIFO 80: Operation not permitted",
        "memory is not locked for drives (the limit is 8 MiB, 300 MiB are needed)",
        "not pinned: drives to CPU 3",
    ];
    assert_eq!(one.warnings.len(), expect.len(), "{:?}", one.warnings);
    for (warning, expect) in one.warnings.iter().zip(expect) {
        assert!(warning.starts_with(expect), "{warning}");
    }
    // A refused job: the controller had nothing to report.
    let refused = of(None, Some(good));
    assert_eq!(refused.cores.keys().collect::<Vec<_>>(), ["drives"]);
    assert_eq!((refused.scheduler.as_str(), refused.warnings.len()), ("other", 0));
    // Drives before its first cycle: nothing is said of it.
    let early = of(None, Some(silent));
    assert_eq!((early.cores.len(), early.warnings.len()), (0, 0), "{:?}", early.warnings);

    let summary = summary_of(&ended(report()), None);
    assert_eq!(summary.realtime, Realtime::in_virtual_time());
}

/// A run folder as planner and monitor leave it.
fn folder(below: &tempfile::TempDir, records: &[CycleRecord]) -> RunFolder {
    let folder = RunFolder::create_at(below.path()).unwrap();
    let mut writer = super::artwork::ArtworkWriter::create(&folder);
    for stroke in artwork().strokes {
        writer.add(&ArtworkLine { goes_on: false, stroke });
    }
    writer.finish().unwrap();
    let notes = vec![Note { line: 7, text: "here".into() }];
    let plan = serde_json::to_vec(&PlanFacts { notes, ..plan() }).unwrap();
    folder.write(run_folder::PLAN, plan).unwrap();
    let path = folder.file(run_folder::SAMPLES);
    let description = Description::of(Period::OF_SETPOINTS);
    let mut writer = RecordingWriter::create(&path, &description, Level::Full).unwrap();
    writer.write(records).unwrap();
    // As it is when it is not closed in order: cut anywhere it lacks the record that was cut.
    writer.flush().unwrap();
    std::mem::forget(writer);
    folder
}

fn records() -> Vec<CycleRecord> {
    (FIRST..=LAST + LIGHT_LAG).map(record).collect()
}

fn concluded(folder: &RunFolder, run_outcome: &RunOutcome) -> Summary {
    conclude(folder, &Machine::builtin(), run_outcome, Instant::now())
}

#[test]
fn a_run_is_concluded_from_its_folder() {
    let below = tempfile::tempdir().unwrap();
    let folder = folder(&below, &records());
    let summary = concluded(&folder, &ended(report()));
    assert_eq!((summary.outcome, summary.job.name.as_str()), (Outcome::Completed, "line"));
    assert!((summary.time - 0.08).abs() < 1e-12);
    assert!((summary.marks.as_ref().unwrap().length - LENGTH).abs() < 1e-12);
    assert_eq!(summary.warnings, ["line 7: here"]);
    assert_eq!(summary.out.as_deref(), folder.path().to_str());
    let written = fs::read(folder.file(run_folder::SUMMARY)).unwrap();
    let written: Summary = serde_json::from_slice(&written).unwrap();
    assert_eq!((written.outcome, written.warnings), (summary.outcome, summary.warnings));
    assert_eq!(written.marks.unwrap().strokes_lost, 0);
    assert!(folder.file(run_folder::REPORT).exists() && folder.file(run_folder::PICTURE).exists());
}

#[test]
fn a_torn_last_record_is_one_that_was_not_recorded() {
    let below = tempfile::tempdir().unwrap();
    let folder = folder(&below, &records());
    let whole = fs::read(folder.file(run_folder::SAMPLES)).unwrap();
    folder.write(run_folder::SAMPLES, &whole[..whole.len() - 10]).unwrap();
    let summary = concluded(&folder, &ended(report()));
    assert_eq!(summary.recording.unwrap().missing, 1);
    // Dark as it was, it hides nothing.
    assert_eq!(summary.marks.unwrap().unrecorded, 0.0);
}

#[test]
fn a_summary_that_cannot_be_written_is_given_back_and_says_so() {
    let below = tempfile::tempdir().unwrap();
    let folder = folder(&below, &records());
    for name in [run_folder::SUMMARY, run_folder::REPORT] {
        fs::create_dir(folder.file(name)).unwrap();
    }
    let summary = concluded(&folder, &ended(report()));
    assert_eq!((summary.outcome, summary.marks.is_some()), (Outcome::Completed, true));
    for name in [run_folder::SUMMARY, run_folder::REPORT] {
        let said =
            |warning: &&String| warning.starts_with("cannot write") && warning.contains(name);
        assert!(summary.warnings.iter().any(|it| said(&it)), "{name}: {:?}", summary.warnings);
    }
    fs::remove_dir_all(folder.path()).unwrap();
    let summary = concluded(&folder, &ended(report()));
    assert_eq!(summary.outcome, Outcome::Completed);
    let told = summary.warnings.last().unwrap();
    assert!(told.contains("summary.json: No such file"), "{told}");
}

#[test]
fn a_recording_that_was_broken_off_is_said_to_be() {
    let below = tempfile::tempdir().unwrap();
    let folder = folder(&below, &records()[..50]);
    let message = "samples.mcap: No space left on device".to_owned();
    let info = RecordingInfo { message: message.clone(), ..RecordingInfo::default() };
    info.write(&folder).unwrap();
    let summary = concluded(&folder, &ended(report()));
    assert_eq!(summary.warnings[0], format!("the recording was broken off: {message}"));
    let marks = summary.marks.unwrap();
    assert!((marks.length + marks.missing - LENGTH).abs() < 1e-12);
    assert!((marks.missing - marks.unrecorded).abs() < 1e-12);
}

#[test]
fn what_cannot_be_read_is_a_warning_and_not_a_figure() {
    let check = |name: &str, content: &str, expect: &str| {
        let below = tempfile::tempdir().unwrap();
        let folder = folder(&below, &records());
        folder.write(name, content).unwrap();
        let summary = concluded(&folder, &ended(report()));
        let said = summary.warnings.iter().any(|warning| warning.contains(expect));
        assert!(said, "{name}: {:?}", summary.warnings);
        summary
    };
    assert_eq!(check(run_folder::ARTWORK, "{\n", "artwork.jsonl: EOF").marks, None);
    let summary = check(run_folder::SAMPLES, "GRAVEREC", "samples.mcap: not a recording");
    assert_eq!(summary.marks, None);
    // The marks need no plan.
    assert!(check(run_folder::PLAN, "[]", "plan.json: ").marks.is_some());
}

#[test]
fn a_job_that_was_never_planned_has_no_marks_and_no_warnings() {
    let below = tempfile::tempdir().unwrap();
    let empty = RunFolder::create_at(below.path()).unwrap();
    let stopped = Outcome::Stopped;
    let run_outcome =
        RunOutcome { outcome: Some(stopped), job: "mine".into(), ..RunOutcome::default() };
    let summary = concluded(&empty, &run_outcome);
    assert_eq!((summary.job.name.as_str(), summary.marks), ("mine", None));
    assert!(summary.warnings.is_empty(), "{:?}", summary.warnings);

    // A refused job finds what an earlier one left in its folder.
    let folder = folder(&below, &records());
    let run_outcome = RunOutcome { outcome: Some(Outcome::Refused), ..run_outcome };
    let summary = concluded(&folder, &run_outcome);
    assert_eq!((summary.job.name.as_str(), summary.job.length), ("mine", 0.0));
    assert_eq!((summary.marks, summary.warnings.len()), (None, 0));
    assert!(!folder.file(run_folder::REPORT).exists());
}
