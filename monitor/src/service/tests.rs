//! The service in a domain of its own, with the test as everybody else.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::conclusion::RecordingState;
use crate::recording::file::parts::PartsReader;
use crate::recording::info::RecordingInfo;
use crate::run_folder::{FileError, RunFolder};
use crate::summary::{Outcome, Summary};
use messages::{
    Command, ControllerReport, Cycle, Fault, FaultCode, Feedback, JobOffer, Nanoseconds, run_folder,
};
use runtime::{Instance, Publisher};
use std::fs;
use std::sync::atomic::{AtomicU32, Ordering};

const STREAM: u64 = 3;

struct Bench {
    offers: Publisher<JobOffer>,
    feedbacks: Publisher<Feedback>,
    commands: Publisher<Command>,
    reports: Publisher<ControllerReport>,
    folder: tempfile::TempDir,
    cycle: u64,
    monitor: Domain,
    // Last, so that all else has let go of the domain.
    _holder: Domain,
}

impl Bench {
    fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!("monitor-test-{}-{number}", std::process::id());
        let instance = Instance::new(&name).unwrap();
        let holder = Domain::create(&instance).unwrap();
        Self {
            offers: holder.publisher().unwrap(),
            feedbacks: holder.publisher().unwrap(),
            commands: holder.publisher().unwrap(),
            reports: holder.publisher().unwrap(),
            folder: tempfile::tempdir().unwrap(),
            cycle: 100,
            monitor: Domain::join(&instance, Role::Monitor).unwrap(),
            _holder: holder,
        }
    }

    /// A monitor, as one that was just started.
    fn service(&self) -> Service {
        Service::open(&self.monitor, &Machine::builtin(), &RecordingOptions::default()).unwrap()
    }

    fn folder(&self) -> RunFolder {
        RunFolder::open(self.folder.path()).unwrap()
    }

    fn offer(&mut self) {
        let path = self.folder.path().to_str().unwrap();
        self.offers.publish(&JobOffer::new(STREAM, path).unwrap()).unwrap();
    }

    fn withdraw(&mut self) {
        self.offers.publish(&JobOffer { stream: STREAM, ..JobOffer::default() }).unwrap();
    }

    /// So many cycles in which this stream is played.
    fn play(&mut self, cycles: u64, stream: u64) {
        for _ in 0..cycles {
            let feedback = Feedback {
                cycle: Cycle(self.cycle),
                command_cycle: Cycle(self.cycle - 1),
                command_published: Nanoseconds(1),
                ..Feedback::default()
            };
            let cycle = Cycle(self.cycle);
            let command = Command { cycle, stream, mode: 4, ..Command::default() };
            self.feedbacks.publish(&feedback).unwrap();
            self.commands.publish(&command).unwrap();
            self.cycle += 1;
        }
    }

    /// The stream has ended with the cycle before the newest two.
    fn end(&mut self, completed: u32, fault: Fault) {
        let last_cycle = Cycle(self.cycle - 1 - crate::conclusion::LIGHT_LAG);
        let report =
            ControllerReport { stream: STREAM, is_final: 1, ..ControllerReport::default() };
        self.reports.publish(&ControllerReport { completed, fault, last_cycle, ..report }).unwrap();
    }

    fn state(&self) -> RecordingState {
        RecordingState::of(&self.folder(), STREAM)
    }

    fn cycles(&self) -> Vec<u64> {
        let reader = PartsReader::open(self.folder.path()).unwrap();
        reader.map_while(|record| Some(record.ok()?.feedback.cycle.0)).collect()
    }

    /// A service that was offered a job, has seen it begin, and half of it.
    fn playing(&mut self) -> Service {
        let mut service = self.service();
        self.offer();
        self.play(5, 0);
        service.poll(&mut []).unwrap();
        self.play(40, STREAM);
        service.poll(&mut []).unwrap();
        service
    }

    /// The summary that a monitor writes which was left alone.
    fn concluded(&self, service: &mut Service) -> Summary {
        service.conclude_alone(&Machine::builtin()).unwrap();
        serde_json::from_slice(&fs::read(self.folder().file(run_folder::SUMMARY)).unwrap()).unwrap()
    }
}

#[test]
fn a_monitor_started_in_the_middle_of_a_job_goes_on_with_its_recording() {
    let mut bench = Bench::new();
    drop(bench.playing());
    let first = bench.cycles().len() as u64;
    // More than the channels keep for a successor.
    bench.play(600, STREAM);
    let mut second = bench.service();
    bench.offers.greet().unwrap();
    bench.play(10, STREAM);
    second.poll(&mut []).unwrap();
    assert_eq!(bench.state(), RecordingState::Open);
    bench.end(1, Fault::default());
    second.poll(&mut []).unwrap();
    let RecordingState::Complete(info) = bench.state() else { panic!("{:?}", bench.state()) };
    let cycles = bench.cycles();
    assert_eq!((info.records, info.gap_count), (cycles.len() as u64, 1));
    assert_eq!((cycles[0], *cycles.last().unwrap()), (100, bench.cycle - 1));
    let whole = bench.cycle - 100;
    assert!(info.lost > 50 && whole - info.records > 50, "{info:?} of {whole}");
    assert!(info.records > first);
}

#[test]
fn a_monitor_started_soon_after_its_predecessor_lacks_no_cycle() {
    let mut bench = Bench::new();
    drop(bench.playing());
    bench.play(60, STREAM);
    let mut second = bench.service();
    // It hears of the cycles before it hears of the job.
    bench.play(10, STREAM);
    second.poll(&mut []).unwrap();
    bench.offers.greet().unwrap();
    second.poll(&mut []).unwrap();
    bench.end(1, Fault::default());
    second.poll(&mut []).unwrap();
    let RecordingState::Complete(info) = bench.state() else { panic!("{:?}", bench.state()) };
    assert_eq!((info.records, info.gap_count, info.lost), (bench.cycle - 100, 0, 0));
    assert_eq!(bench.cycles(), (100..bench.cycle).collect::<Vec<_>>());
}

#[test]
fn a_monitor_started_after_the_job_completes_the_recording_that_was_left_open() {
    for heard in [true, false] {
        let mut bench = Bench::new();
        drop(bench.playing());
        bench.play(20, STREAM);
        bench.end(1, Fault::default());
        let mut second = bench.service();
        bench.offers.greet().unwrap();
        if heard {
            bench.reports.greet().unwrap();
        }
        bench.play(3, 0);
        second.poll(&mut []).unwrap();
        if !heard {
            // The controller says it again every second.
            assert_eq!(bench.state(), RecordingState::Open);
            bench.reports.greet().unwrap();
            second.poll(&mut []).unwrap();
        }
        assert!(matches!(bench.state(), RecordingState::Complete(_)), "{:?}", bench.state());
    }
}

#[test]
fn an_old_job_is_not_recorded_again() {
    // Concluded; over as the controller says; complete; broken off.
    for case in 0..4 {
        let mut bench = Bench::new();
        let info = RecordingInfo { stream: STREAM, ..RecordingInfo::default() };
        let failed = crate::recording::info::Progress::Failed;
        match case {
            0 => bench.folder().write(run_folder::SUMMARY, "{}").unwrap(),
            1 => bench.end(1, Fault::default()),
            2 => info.write(&bench.folder()).unwrap(),
            _ => RecordingInfo { progress: failed, ..info }.write(&bench.folder()).unwrap(),
        }
        bench.offer();
        let before = fs::read_dir(bench.folder.path()).unwrap().count();
        let mut service = bench.service();
        bench.offers.greet().unwrap();
        bench.reports.greet().unwrap();
        bench.play(5, 0);
        service.poll(&mut []).unwrap();
        assert!(service.recorder.recording.is_none(), "{case}");
        assert_eq!(fs::read_dir(bench.folder.path()).unwrap().count(), before, "{case}");
    }
}

#[test]
fn a_job_whose_folder_is_gone_costs_no_more_than_its_recording() {
    let mut bench = Bench::new();
    let mut service = bench.service();
    let gone = bench.folder.path().join("gone");
    let offer = JobOffer::new(STREAM - 1, gone.to_str().unwrap()).unwrap();
    bench.offers.publish(&offer).unwrap();
    bench.play(5, STREAM - 1);
    service.poll(&mut []).unwrap();
    assert!(service.recorder.recording.is_none() && !gone.exists());
    // Gone while it is recorded.
    fs::create_dir(&gone).unwrap();
    let offer = JobOffer::new(STREAM - 2, gone.to_str().unwrap()).unwrap();
    bench.offers.publish(&offer).unwrap();
    bench.play(5, STREAM - 2);
    service.poll(&mut []).unwrap();
    assert!(service.recorder.recording.is_some());
    fs::remove_dir_all(&gone).unwrap();
    bench.offer();
    service.poll(&mut []).unwrap();
    assert!(!gone.exists());
    bench.play(5, STREAM);
    bench.end(1, Fault::default());
    service.poll(&mut []).unwrap();
    assert!(matches!(bench.state(), RecordingState::Complete(_)));
}

#[test]
fn a_withdrawn_job_that_was_never_played_is_complete_at_once() {
    let mut bench = Bench::new();
    let mut service = bench.service();
    bench.offer();
    service.poll(&mut []).unwrap();
    assert_eq!(bench.state(), RecordingState::Open);
    bench.withdraw();
    service.poll(&mut []).unwrap();
    assert!(matches!(bench.state(), RecordingState::Complete(_)));
}

#[test]
fn silence_ends_a_recording_that_waits_for_its_last_cycles() {
    let mut bench = Bench::new();
    let mut service = bench.playing();
    let report = ControllerReport { stream: STREAM, is_final: 1, ..ControllerReport::default() };
    let last_cycle = Cycle(bench.cycle + 50);
    bench.reports.publish(&ControllerReport { last_cycle, ..report }).unwrap();
    service.poll(&mut []).unwrap();
    service.hub.silence_for(SILENCE);
    service.poll(&mut []).unwrap();
    assert!(matches!(bench.state(), RecordingState::Complete(_)));
}

#[test]
fn a_supervisor_that_dies_leaves_no_job_without_a_summary() {
    let lost = Fault::new(FaultCode::SupervisorLost);
    // While it is played: the controller brings the axes to rest.
    let mut bench = Bench::new();
    let mut service = bench.playing();
    bench.play(20, STREAM);
    bench.end(0, lost);
    let summary = bench.concluded(&mut service);
    assert_eq!(summary.outcome, Outcome::Aborted);
    assert_eq!(summary.fault.unwrap().code, "supervisor_lost");
    assert!(summary.error.unwrap().message.contains("supervisor"));

    // When all was recorded, and nothing remained but to write it down.
    let mut bench = Bench::new();
    let mut service = bench.playing();
    bench.end(1, Fault::default());
    service.poll(&mut []).unwrap();
    assert!(service.recorder.recording.is_none());
    let summary = bench.concluded(&mut service);
    assert_eq!((summary.outcome, summary.error), (Outcome::Completed, None));
    let warnings = summary.warnings.join("; ");
    assert!(warnings.contains("the supervisor died after the job had ended"), "{warnings}");

    // When a person had stopped it.
    let mut bench = Bench::new();
    let mut service = bench.playing();
    bench.end(0, Fault::default());
    assert_eq!(bench.concluded(&mut service).outcome, Outcome::Stopped);

    // While it was planned.
    let mut bench = Bench::new();
    let mut service = bench.service();
    bench.offer();
    bench.play(5, 0);
    service.poll(&mut []).unwrap();
    let summary = bench.concluded(&mut service);
    assert_eq!((summary.outcome, summary.marks), (Outcome::Aborted, None));

    // When the planner had refused it.
    let mut bench = Bench::new();
    let mut service = bench.service();
    bench.offer();
    service.poll(&mut []).unwrap();
    let refusal = r#"{"file": "job.ngc", "line": 4, "column": 2, "message": "no", "text": "no"}"#;
    bench.folder().write(run_folder::REFUSAL, refusal).unwrap();
    let summary = bench.concluded(&mut service);
    assert_eq!((summary.outcome, summary.error.unwrap().line), (Outcome::Refused, Some(4)));

    // When its recording had failed.
    let mut bench = Bench::new();
    let mut service = bench.playing();
    let source = std::io::ErrorKind::StorageFull.into();
    service.recorder.drop_recording(&FileError { path: "samples.mcap".into(), source }).unwrap();
    bench.play(20, STREAM);
    bench.end(0, lost);
    let summary = bench.concluded(&mut service);
    let warnings = summary.warnings.join("; ");
    assert!(warnings.contains("the recording was broken off: samples.mcap"), "{warnings}");
}

#[test]
fn a_summary_that_the_supervisor_wrote_is_left_alone() {
    let mut bench = Bench::new();
    let mut service = bench.playing();
    bench.end(1, Fault::default());
    service.poll(&mut []).unwrap();
    bench.folder().write(run_folder::SUMMARY, "the supervisor's").unwrap();
    service.conclude_alone(&Machine::builtin()).unwrap();
    let text = fs::read_to_string(bench.folder().file(run_folder::SUMMARY)).unwrap();
    assert_eq!(text, "the supervisor's");
    // Nor is there anything to conclude without a job.
    Bench::new().service().conclude_alone(&Machine::builtin()).unwrap();
}
