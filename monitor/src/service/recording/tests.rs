//! Recordings that end, that a successor goes on with, and that cannot be written.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::conclusion::RecordingState;
use crate::recording::continuity::Gap;
use crate::recording::file::Description;
use crate::recording::file::parts::PartsReader;
use messages::time::Period;
use messages::{Command, Cycle, Feedback, Nanoseconds};
use std::fs::File;
use std::io;

const STREAM: u64 = 5;

/// Cycles `from..to`, answered for `stream`.
fn taken(recording: &mut Recording, from: u64, to: u64, stream: u64) -> Result<(), FileError> {
    let feedback = |cycle: u64| Feedback {
        cycle: Cycle(cycle),
        command_cycle: Cycle(cycle.saturating_sub(1)),
        command_published: Nanoseconds(1),
        ..Feedback::default()
    };
    let command =
        |cycle: u64| Command { cycle: Cycle(cycle), stream, mode: 4, ..Command::default() };
    let feedbacks: Vec<_> = (from..to).map(feedback).collect();
    let commands: Vec<_> = (from..to).map(command).collect();
    recording.take(&Came { feedbacks: &feedbacks, commands: &commands, setpoints: &[] })
}

fn take(recording: &mut Recording, from: u64, to: u64, stream: u64) {
    taken(recording, from, to, stream).unwrap();
}

fn final_report(stream: u64, last: u64) -> ControllerReport {
    let last_cycle = Cycle(last);
    ControllerReport { stream, is_final: 1, last_cycle, ..ControllerReport::default() }
}

fn folder(below: &tempfile::TempDir) -> RunFolder {
    RunFolder::create_at(below.path()).unwrap()
}

/// With a spare place below a folder.
fn setup(below: &tempfile::TempDir) -> Setup {
    let description = Description::of(Period::OF_SETPOINTS);
    Setup { description, quota: None, spare: below.path().join("spare") }
}

fn begin(below: &tempfile::TempDir) -> Recording {
    begun(below, folder(below), STREAM, 0).unwrap()
}

fn begun(
    below: &tempfile::TempDir,
    folder: RunFolder,
    stream: u64,
    overruns_before: u64,
) -> Result<Recording, FileError> {
    Recording::begin(stream, folder, overruns_before, &setup(below), Beginning::default())
}

fn cycles(folder: &RunFolder) -> Vec<u64> {
    let reader = PartsReader::open(folder.path()).unwrap();
    reader.map_while(|record| Some(record.ok()?.feedback.cycle.0)).collect()
}

#[test]
fn a_recording_is_over_when_its_last_light_is_told() {
    let below = tempfile::tempdir().unwrap();
    let mut recording = begin(&below);
    take(&mut recording, 100, 202, STREAM);
    // The newest cycle is 201.
    assert!(!recording.is_over(&ControllerReport::default(), true));
    assert!(!recording.is_over(&final_report(STREAM - 1, 150), true));
    assert!(!recording.is_over(&final_report(STREAM, 200), true));
    assert!(recording.is_over(&final_report(STREAM, 199), true));
    // With drives dead, the cycles that are missing will not come.
    assert!(recording.is_over(&final_report(STREAM, 200), false));
    assert!(!recording.is_over(&ControllerReport::default(), false));
}

#[test]
fn a_job_taken_back_is_recorded_until_its_axes_rest() {
    let below = tempfile::tempdir().unwrap();
    let mut recording = begin(&below);
    take(&mut recording, 0, 10, 0);
    recording.withdrawn = true;
    // Nothing of it was played.
    assert!(recording.is_over(&ControllerReport::default(), true));
    take(&mut recording, 10, 20, STREAM);
    assert!(!recording.is_over(&ControllerReport::default(), true));
    assert!(!recording.is_over(&final_report(STREAM, 18), true));
    take(&mut recording, 20, 21, 0);
    assert!(recording.is_over(&final_report(STREAM, 18), true));
    assert!(recording.is_over(&ControllerReport::default(), false));
}

#[test]
fn the_note_tells_how_the_recording_stands_and_counts_what_is_in_the_file() {
    let below = tempfile::tempdir().unwrap();
    let mut recording = begin(&below);
    let folder = folder(&below);
    assert!(cycles(&folder).is_empty(), "the empty recording is one already");
    // One poll after a second away, and one that comes too late for three samples.
    take(&mut recording, 0, 1000, STREAM);
    assert_eq!(RecordingState::of(&folder, STREAM), RecordingState::Open);
    take(&mut recording, 1003, 1500, STREAM);
    let gaps = vec![Gap { first: 1000, last: 1002 }];
    let open = RecordingInfo::read(&folder).unwrap();
    assert_eq!((open.progress, open.lost, &open.gaps), (Progress::Open, 3, &gaps));
    recording.finish().unwrap();
    let info = RecordingInfo {
        stream: STREAM,
        records: 1497,
        lost: 3,
        gap_count: 1,
        gaps,
        ..RecordingInfo::default()
    };
    assert_eq!(RecordingState::of(&folder, STREAM), RecordingState::Complete(info));
    assert_eq!(cycles(&folder).len(), 1497);
}

#[test]
fn a_successor_goes_on_with_the_recording_and_counts_the_gap() {
    // Killed before anything was written, between two records, and inside one.
    for torn in [0, 1, 30] {
        let below = tempfile::tempdir().unwrap();
        let folder = folder(&below);
        let mut first = begun(&below, folder.clone(), STREAM, 7).unwrap();
        take(&mut first, 0, 100, STREAM);
        take(&mut first, 110, 200, STREAM);
        // As one that is killed.
        std::mem::forget(first);
        let samples = File::options().write(true).open(folder.file(run_folder::SAMPLES)).unwrap();
        samples.set_len(samples.metadata().unwrap().len() - torn).unwrap();
        let kept = if torn == 0 { 200 } else { 199 };

        let mut second = begun(&below, folder.clone(), STREAM, 99).unwrap();
        assert_eq!((second.overruns_before, second.played), (7, true));
        take(&mut second, 300, 400, STREAM);
        second.finish().unwrap();
        let expect: Vec<u64> = (0..100).chain(110..kept).chain(300..400).collect();
        assert_eq!(cycles(&folder), expect);
        let RecordingState::Complete(info) = RecordingState::of(&folder, STREAM) else { panic!() };
        let gaps = vec![Gap { first: 100, last: 109 }, Gap { first: kept, last: 299 }];
        assert_eq!((info.records, info.gap_count), (expect.len() as u64, 2));
        assert_eq!((info.lost, info.gaps), (10 + 300 - kept, gaps));
        let log = std::fs::read_to_string(folder.file(run_folder::LATENCY)).unwrap();
        assert_eq!(log.matches("#[StartTime").count(), 1, "one log: {log}");
    }
}

#[test]
fn a_recording_of_another_job_is_not_gone_on_with() {
    let below = tempfile::tempdir().unwrap();
    let folder = folder(&below);
    let mut first = begun(&below, folder.clone(), STREAM - 1, 0).unwrap();
    take(&mut first, 0, 100, STREAM - 1);
    let mut second = begin(&below);
    take(&mut second, 300, 310, STREAM);
    second.finish().unwrap();
    assert_eq!(cycles(&folder), (300..310).collect::<Vec<_>>());
    assert_eq!(RecordingInfo::read(&folder).unwrap().gap_count, 0);
}

#[test]
fn a_note_whose_samples_are_gone_begins_them_anew() {
    let below = tempfile::tempdir().unwrap();
    drop(begin(&below));
    let folder = folder(&below);
    std::fs::remove_file(folder.file(run_folder::SAMPLES)).unwrap();
    let mut recording = begin(&below);
    take(&mut recording, 3, 5, STREAM);
    recording.finish().unwrap();
    assert_eq!(cycles(&folder), [3, 4]);
}

#[test]
fn a_file_that_is_no_recording_is_refused_by_its_name() {
    let below = tempfile::tempdir().unwrap();
    drop(begin(&below));
    let samples = folder(&below).file(run_folder::SAMPLES);
    std::fs::write(&samples, vec![7; 5000]).unwrap();
    let error = begun(&below, folder(&below), STREAM, 0).err().unwrap().to_string();
    assert!(error.contains("samples.mcap: not a recording"), "{error}");
}

#[test]
fn a_full_disk_costs_the_recording_and_no_record() {
    let below = tempfile::tempdir().unwrap();
    let folder = RunFolder::create_at(&below.path().join("run")).unwrap();
    let setup = setup(&below);
    let mut recording =
        Recording::begin(STREAM, folder.clone(), 0, &setup, Beginning::default()).unwrap();
    take(&mut recording, 0, 100, STREAM);
    // It fills up in the middle of the run.
    let source = io::Error::from_raw_os_error(28);
    recording.store.move_out(source).unwrap();
    take(&mut recording, 100, 200, STREAM);
    std::mem::forget(recording);
    // A successor finds where it went.
    let mut second =
        Recording::begin(STREAM, folder.clone(), 0, &setup, Beginning::default()).unwrap();
    take(&mut second, 190, 300, STREAM);
    second.finish().unwrap();
    let RecordingState::Complete(info) = RecordingState::of(&folder, STREAM) else { panic!() };
    assert!(info.message.contains("samples.mcap: "), "{}", info.message);
    assert_eq!((info.lost, info.gap_count), (0, 0));
    let reader = PartsReader::open_both(folder.path(), Some(&setup.spare)).unwrap();
    let all: Vec<u64> = reader.map_while(|record| Some(record.ok()?.feedback.cycle.0)).collect();
    assert_eq!(all, (0..300).collect::<Vec<_>>());
}

#[test]
fn where_there_is_no_spare_place_either_the_recording_ends_with_the_reason() {
    let below = tempfile::tempdir().unwrap();
    let folder = folder(&below);
    std::fs::write(below.path().join("spare"), "a file").unwrap();
    let mut recording = begin(&below);
    take(&mut recording, 0, 100, STREAM);
    let error = recording.store.move_out(io::Error::from_raw_os_error(28)).unwrap_err();
    assert!(error.to_string().contains("samples.mcap: No space left"), "{error}");
    give_up(&folder, STREAM, &error).unwrap();
    assert_eq!(RecordingState::of(&folder, STREAM), RecordingState::Failed(error.to_string()));
}

#[test]
fn a_vanished_folder_ends_the_recording_and_nobody_waits_for_it() {
    let below = tempfile::tempdir().unwrap();
    let place = RunFolder::create_at(&below.path().join("run")).unwrap();
    let mut recording = begun(&below, place.clone(), STREAM, 0).unwrap();
    take(&mut recording, 0, 100, STREAM);
    std::fs::remove_dir_all(place.path()).unwrap();
    let error = recording.finish().unwrap_err();
    assert!(error.to_string().contains("run/monitor.json: No such file"), "{error}");
    give_up(&place, STREAM, &error).unwrap();
    assert_eq!(RecordingState::of(&place, STREAM), RecordingState::Absent);
    assert!(!place.path().exists());
    let error = begun(&below, place, STREAM, 0).err().unwrap();
    assert!(error.to_string().contains("run/monitor.json: No such file"), "{error}");
}

#[test]
fn where_the_note_cannot_be_written_only_one_that_says_open_is_waited_for() {
    let below = tempfile::tempdir().unwrap();
    let folder = folder(&below);
    let source = io::ErrorKind::StorageFull.into();
    let reason = FileError { path: "samples.mcap".into(), source };
    // Over a folder of its name no file can be renamed, and it cannot be written into.
    std::fs::create_dir(folder.file(run_folder::WATCH)).unwrap();
    give_up(&folder, STREAM, &reason).unwrap();
    assert_eq!(RecordingState::of(&folder, STREAM), RecordingState::Absent);
    std::fs::remove_dir(folder.file(run_folder::WATCH)).unwrap();
    drop(begin(&below));
    give_up(&folder, STREAM, &reason).unwrap();
    assert!(matches!(RecordingState::of(&folder, STREAM), RecordingState::Failed(_)));
}
