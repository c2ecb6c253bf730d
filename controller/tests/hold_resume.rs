//! A hold never jumps a reference or leaves the laser on; a resume loses and doubles no mark.

#![allow(clippy::unwrap_used)]

mod support;

use machine::Machine;
use messages::{ControllerState, OperatorVerb};
use support::{Move, Part, check_marks, job, reach, sharpest, started, two_marks};

#[test]
fn holds_anywhere_and_goes_on_without_losing_or_doubling_a_mark() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let (on, off) = job.lit[0];
    let (second_on, second_off) = job.lit[1];
    let moments = [
        0.001,
        0.03,
        on - 0.01,
        on - 0.0005,
        on + 0.0013,
        on + 0.08,
        off - 0.0007,
        off + 0.001,
        (off + second_on) / 2.0,
        second_on - 0.05,
        second_on + 0.02,
        second_off - 0.002,
        second_off + 0.03,
    ];
    for moment in moments {
        let mut bench = started(&machine, &job);
        reach(&mut bench, &job, moment);
        assert!(bench.ask(Some(&job), OperatorVerb::Hold, 0.0));
        let case = format!("hold at {moment} s");
        assert!(!bench.last().command.laser.is_lit(), "{case}: lit in the very next command");
        assert_eq!(bench.state(), ControllerState::Holding);
        for _ in 0..250 {
            bench.run(Some(&job), 1);
            assert!(!bench.last().command.laser.is_lit(), "{case}: lit while holding");
        }
        assert_eq!(bench.last().command.rate, 0.0, "{case}");
        let held = bench.last().command.reference;
        bench.run(Some(&job), 50);
        assert_eq!(bench.last().command.reference, held, "{case}: moved while holding");

        let resumed = bench.records.len();
        assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0));
        bench.until(Some(&job), ControllerState::Idle, 3000);
        check_marks(&bench, &job, 0.5, &case);
        // The rate is back before the light is.
        for window in bench.records[resumed..].windows(3) {
            if window[0].command.laser.is_lit() {
                let rates = [window[1].command.rate, window[2].command.rate];
                assert_eq!(rates, [1.0, 1.0], "{case}");
            }
        }
        // 10 m/s² planned; a hold and a resume stay within.
        let sharpest = sharpest(&bench.records, &machine);
        assert!(sharpest < 10.1, "{case}: a reference changed by {sharpest} m/s²");
        let lit = bench.played().filter(|record| record.command.laser.is_lit());
        let worst = lit.map(|record| record.tracking).fold(0.0, f64::max);
        assert!(worst < 10e-6, "{case}: {worst} m off while lit");
        let worst = bench.played().map(|record| record.tracking).fold(0.0, f64::max);
        assert!(worst < 20e-6, "{case}: {worst} m off in the dark");
    }
}

#[test]
fn any_sequence_of_holds_resumes_and_overrides_marks_once() {
    let machine = Machine::builtin();
    let path = Move::new(0.05, 0.1, 2.0, 100.0);
    let parts = [
        Part::Rest(0.0107),
        Part::Mark(path.clone(), [1.0, -0.5]),
        Part::Rest(0.02),
        Part::Mark(path, [0.3, 0.9]),
        Part::Rest(0.05),
    ];
    let job = job(&machine, 1, &parts, 0.4);
    for seed in 1..=12_u64 {
        let mut random = messages::random::SplitMix64::new(seed);
        let mut next = |below: u64| random.below(below);
        let mut bench = started(&machine, &job);
        let mut asked = Vec::new();
        for _ in 0..14 {
            bench.run(Some(&job), next(160) as usize);
            let (verb, value) = match next(5) {
                0 | 1 => (OperatorVerb::Hold, 0.0),
                2 | 3 => (OperatorVerb::Resume, 0.0),
                _ => (OperatorVerb::Override, 0.2 + next(19) as f64 / 10.0),
            };
            asked.push((bench.records.len(), verb, value));
            bench.ask(Some(&job), verb, value);
        }
        bench.ask(Some(&job), OperatorVerb::Resume, 0.0);
        bench.until(Some(&job), ControllerState::Idle, 12_000);
        let case = format!("seed {seed}: {asked:?}");
        check_marks(&bench, &job, 0.4, &case);
        assert_eq!(bench.reports.last().unwrap().completed, 1, "{case}");
        let sharpest = sharpest(&bench.records, &machine);
        assert!(sharpest < 10.1, "{case}: a reference changed by {sharpest} m/s²");
    }
}

#[test]
fn without_skipped_light_a_resume_does_not_go_back() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = started(&machine, &job);
    // The last light is over: there is nothing to come back for.
    reach(&mut bench, &job, job.lit[1].1 + 0.01);
    assert!(bench.ask(Some(&job), OperatorVerb::Hold, 0.0));
    assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0), "while still coming to rest");
    bench.until(Some(&job), ControllerState::Idle, 2000);
    let times: Vec<f64> = bench.played().map(|record| record.command.stream_time).collect();
    assert!(times.windows(2).all(|pair| pair[1] >= pair[0]));
    check_marks(&bench, &job, 0.5, "a hold in the dark");
}

#[test]
fn a_programmed_pause_waits_at_its_setpoint_for_a_person() {
    let machine = Machine::builtin();
    let path = Move::new(0.06, 0.25, 10.0, 500.0);
    let parts = [
        Part::Rest(0.02),
        Part::Mark(path.clone(), [1.0, 0.0]),
        Part::Rest(0.005),
        Part::Pause,
        Part::Rest(0.01),
        Part::Mark(path, [-1.0, 0.0]),
        Part::Rest(0.05),
    ];
    let job = job(&machine, 1, &parts, 0.5);
    let mut bench = started(&machine, &job);
    bench.until(Some(&job), ControllerState::Holding, 1000);
    bench.run(Some(&job), 100);
    let time = bench.last().command.stream_time;
    let pause = job.setpoints.iter().find(|setpoint| setpoint.has(2)).unwrap().sequence;
    assert_eq!(time, pause as f64 * 1e-3);
    assert!(bench.ask(Some(&job), OperatorVerb::Resume, 0.0));
    bench.until(Some(&job), ControllerState::Idle, 1000);
    check_marks(&bench, &job, 0.5, "a pause");
}

#[test]
fn a_stop_gives_the_stream_up_at_rest() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = started(&machine, &job);
    reach(&mut bench, &job, job.lit[0].0 + 0.05);
    assert!(bench.ask(Some(&job), OperatorVerb::Stop, 0.0));
    assert!(!bench.last().command.laser.is_lit());
    assert_eq!(bench.state(), ControllerState::Stopping);
    bench.until(Some(&job), ControllerState::Idle, 200);
    let report = bench.reports.last().unwrap();
    assert_eq!((report.is_final, report.completed, report.fault.is_some()), (1, 0, false));
    assert!(!bench.ask(Some(&job), OperatorVerb::Resume, 0.0), "there is nothing to resume");
    bench.run(Some(&job), 50);
    assert_eq!(bench.state(), ControllerState::Idle);
    assert!(sharpest(&bench.records, &machine) < 10.6);
}
