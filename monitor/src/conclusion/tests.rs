//! Summaries from made-up endings and recordings, with numbers worked out by hand.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::recording::CycleRecord;
use crate::recording::file::RecordingWriter;
use signals::artwork::Stroke;
use signals::feedback::status;
use signals::plan::Note;
use signals::report::refused;
use signals::{Command, Cycle, Fault, FaultCode, Feedback, LaserCycle, Nanoseconds};

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
    let lit = (FIRST + 2..FIRST + 2 + LIT).contains(&cycle);
    CycleRecord {
        feedback: Feedback {
            cycle: Cycle(cycle),
            command_cycle: Cycle(cycle - 1),
            command_received: Nanoseconds(1),
            command_published: Nanoseconds(1),
            status: status::TOOL_KNOWN,
            tool,
            laser: LaserCycle { gate: u32::from(lit), power: 0.5, ..LaserCycle::OFF },
            ..Feedback::default()
        },
        command: Command { cycle: Cycle(cycle), stream: 1, mode: 4, tool, ..Command::default() },
    }
}

fn examined(cycles: std::ops::RangeInclusive<u64>) -> Findings {
    let artwork = artwork();
    let mut examination = Examination::new(&artwork, Clock::Virtual);
    cycles.for_each(|cycle| examination.push(&record(cycle)));
    examination.finish()
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

fn ended(controller: ControllerReport) -> Ending {
    Ending { controller: Some(controller), ..Ending::default() }
}

fn summary_of(ending: &Ending, findings: Option<&Findings>) -> Summary {
    summarise(&Machine::builtin(), &plan(), ending, findings, Clock::Virtual)
}

fn fault() -> Fault {
    let code = FaultCode::FollowingError as u32;
    Fault { code, axis: 1, value: 0.3, limit: 0.2, ..Fault::default() }
}

#[test]
fn the_outcome_follows_from_the_reports_unless_it_is_known_better() {
    let drives = |fault: Fault| Some(DrivesReport { fault, ..DrivesReport::default() });
    let completed = report();
    let broken_off = ControllerReport { completed: 0, ..report() };
    let faulted = ControllerReport { fault: fault(), ..broken_off };
    let cases = [
        (ended(completed), Outcome::Completed, false),
        (ended(broken_off), Outcome::Stopped, false),
        (ended(faulted), Outcome::Faulted, true),
        (Ending { drives: drives(fault()), ..ended(broken_off) }, Outcome::Faulted, true),
        (Ending { drives: drives(Fault::default()), ..ended(broken_off) }, Outcome::Stopped, false),
        // The job was whole before drives failed.
        (Ending { drives: drives(fault()), ..ended(completed) }, Outcome::Completed, true),
        (Ending::default(), Outcome::Aborted, false),
        (Ending { drives: drives(fault()), ..Ending::default() }, Outcome::Aborted, true),
        (Ending { outcome: Some(Outcome::Stopped), ..ended(completed) }, Outcome::Stopped, false),
        (Ending { outcome: Some(Outcome::Refused), ..Ending::default() }, Outcome::Refused, false),
    ];
    for (ending, outcome, has_fault) in cases {
        let summary = summary_of(&ending, None);
        assert_eq!((summary.outcome, summary.fault.is_some()), (outcome, has_fault), "{ending:?}");
    }
}

#[test]
fn a_fault_names_its_axis() {
    let summary = summary_of(&ended(ControllerReport { fault: fault(), ..report() }), None);
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

#[test]
fn marks_are_judged_only_over_the_whole_stream() {
    let end = LAST + LIGHT_LAG;
    let whole = summary_of(&ended(report()), Some(&examined(FIRST..=end)));
    let marks = whole.marks.unwrap();
    assert!((marks.length - LENGTH).abs() < 1e-12, "{}", marks.length);
    assert!(marks.missing < 1e-12 && marks.double < 1e-12, "{marks:?}");
    assert_eq!(whole.warnings, ["everywhere", "line 7: here"]);

    let lacking = "the marks are not judged: the recording lacks its beginning or its end";
    for cycles in [FIRST + 1..=end, FIRST..=end - 1, FIRST + 1..=end - 1] {
        let summary = summary_of(&ended(report()), Some(&examined(cycles.clone())));
        assert_eq!(summary.marks, None, "{cycles:?}");
        assert_eq!(summary.warnings, ["everywhere", "line 7: here", lacking], "{cycles:?}");
    }
    let empty = Examination::new(&Artwork::default(), Clock::Virtual).finish();
    let summary = summary_of(&ended(report()), Some(&empty));
    assert_eq!((summary.marks, summary.warnings[2].as_str()), (None, lacking));

    let summary = summary_of(&Ending::default(), Some(&examined(FIRST..=end)));
    assert_eq!(summary.marks, None);
    assert!(summary.warnings[2].contains("the controller did not say"), "{:?}", summary.warnings);
}

#[test]
fn a_gap_is_a_warning_of_its_own() {
    let artwork = artwork();
    let mut examination = Examination::new(&artwork, Clock::Virtual);
    let kept = (FIRST..=LAST + LIGHT_LAG).filter(|cycle| *cycle != FIRST + 30);
    kept.for_each(|cycle| examination.push(&record(cycle)));
    let mut ending = ended(report());
    ending.warnings.push("first".into());
    let summary = summary_of(&ending, Some(&examination.finish()));
    assert_eq!(summary.marks, None);
    let lost = "the marks are not judged: 1 samples were lost on the way to the monitor";
    assert_eq!(summary.warnings, ["first", "everywhere", "line 7: here", lost]);
}

#[test]
fn overruns_are_those_of_the_run() {
    let overruns = |before: u64| {
        let drives = Some(DrivesReport { overruns: 12, ..DrivesReport::default() });
        summary_of(&Ending { drives, overruns_before: before, ..ended(report()) }, None).overruns
    };
    // Drives that were restarted count from 0 again.
    assert_eq!([overruns(0), overruns(5), overruns(20)], [12, 7, 0]);
}

#[test]
fn real_time_is_claimed_and_missed_only_as_reported() {
    let machine = Machine::builtin();
    let silent = RealtimeFacts::default();
    let of = |controller: Option<RealtimeFacts>, drives: Option<RealtimeFacts>| {
        let ending = Ending {
            controller: controller.map(|realtime| ControllerReport { realtime, ..report() }),
            drives: drives.map(|realtime| {
                let cycle = Cycle(if realtime == silent { 0 } else { LAST });
                DrivesReport { realtime, cycle, ..DrivesReport::default() }
            }),
            ..Ending::default()
        };
        summarise(&machine, &plan(), &ending, None, Clock::Real).realtime
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
    folder.write(run_folder::ARTWORK, serde_json::to_vec(&artwork()).unwrap()).unwrap();
    let notes = vec![Note { line: 7, text: "here".into() }];
    let plan = serde_json::to_vec(&PlanFacts { notes, ..plan() }).unwrap();
    folder.write(run_folder::PLAN, plan).unwrap();
    let mut writer = RecordingWriter::new(Vec::new()).unwrap();
    writer.write(records).unwrap();
    folder.write(run_folder::SAMPLES, writer.finish().unwrap()).unwrap();
    folder
}

fn records() -> Vec<CycleRecord> {
    (FIRST..=LAST + LIGHT_LAG).map(record).collect()
}

fn concluded(folder: &RunFolder, ending: &Ending) -> Summary {
    conclude(folder, &Machine::builtin(), ending, Instant::now())
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
fn a_torn_last_record_costs_the_judgement_when_it_was_needed() {
    for (more, judged) in [(0, false), (1, true)] {
        let below = tempfile::tempdir().unwrap();
        let records: Vec<_> = (FIRST..=LAST + LIGHT_LAG + more).map(record).collect();
        let folder = folder(&below, &records);
        let whole = fs::read(folder.file(run_folder::SAMPLES)).unwrap();
        folder.write(run_folder::SAMPLES, &whole[..whole.len() - 10]).unwrap();
        let summary = concluded(&folder, &ended(report()));
        assert_eq!(summary.marks.is_some(), judged);
    }
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
    assert_eq!(check(run_folder::ARTWORK, "{", "cannot read artwork.json: EOF").marks, None);
    let summary = check(run_folder::SAMPLES, "GRAVE", "there is no recording: not a recording");
    assert_eq!(summary.marks, None);
    // The marks need no plan.
    assert!(check(run_folder::PLAN, "[]", "cannot read plan.json: ").marks.is_some());
}

#[test]
fn a_job_that_was_never_planned_has_no_marks_and_no_warnings() {
    let below = tempfile::tempdir().unwrap();
    let empty = RunFolder::create_at(below.path()).unwrap();
    let stopped = Outcome::Stopped;
    let ending = Ending { outcome: Some(stopped), job: "mine".into(), ..Ending::default() };
    let summary = concluded(&empty, &ending);
    assert_eq!((summary.job.name.as_str(), summary.marks), ("mine", None));
    assert!(summary.warnings.is_empty(), "{:?}", summary.warnings);

    // A refused job finds what an earlier one left in its folder.
    let folder = folder(&below, &records());
    let ending = Ending { outcome: Some(Outcome::Refused), ..ending };
    let summary = concluded(&folder, &ending);
    assert_eq!((summary.job.name.as_str(), summary.job.length), ("mine", 0.0));
    assert_eq!((summary.marks, summary.warnings.len()), (None, 0));
    assert!(!folder.file(run_folder::REPORT).exists());
}

#[test]
fn the_note_of_a_recording_is_read_as_it_was_written() {
    let below = tempfile::tempdir().unwrap();
    let folder = RunFolder::create_at(below.path()).unwrap();
    assert_eq!(WatchNote::read(&folder), None);
    let note = WatchNote { stream: 3, records: 4711, lost: 2 };
    note.write(&folder).unwrap();
    assert_eq!(WatchNote::read(&folder), Some(note));
    folder.write(run_folder::WATCH, "{\"stream\": 3").unwrap();
    assert_eq!(WatchNote::read(&folder), None);
}
