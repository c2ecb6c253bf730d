//! Any part of a recording may be missing: what passed in it is unrecorded, and of the rest the
//! evaluation says nothing else than that of the whole.

#![allow(clippy::unwrap_used)]
#![allow(clippy::single_range_in_vec_init, reason = "a list of gaps may have one")]

mod support;

use drives::PlantOptions;
use machine::Machine;
use messages::ControllerReport;
use messages::artwork::{Artwork, distance};
use messages::random::SplitMix64;
use messages::time::Period;
use monitor::marks::tool_path::LitSpans;
use monitor::marks::{MarkEvaluation, MarkEvaluator, StreamEnd};
use monitor::recording::CycleRecord;
use planner::Job;
use support::Place;
use workbench::simulation::simulate;

struct Recorded {
    artwork: Artwork,
    speed: f64,
    records: Vec<CycleRecord>,
    report: ControllerReport,
}

impl Recorded {
    /// A job on the built-in machine.
    fn of(job: &str) -> Self {
        let place = Place::new();
        let machine = Machine::builtin();
        let job = Job::read(&place.file("job.ngc", job), &[], &machine).unwrap();
        let plan = planner::plan(&machine, &job).unwrap();
        let mut records = Vec::new();
        let simulated =
            simulate(&machine, &machine, &plan, PlantOptions::default(), |new| records.extend(new))
                .unwrap();
        assert_eq!(simulated.controller.completed, 1);
        let speed = plan.facts.speed;
        Self { artwork: plan.artwork, speed, records, report: simulated.controller }
    }

    fn evaluate(&self, kept: impl Fn(usize) -> bool) -> MarkEvaluation {
        let mut evaluator =
            MarkEvaluator::new(&self.artwork, Period::OF_SETPOINTS).with_fastest(self.speed);
        for (index, record) in self.records.iter().enumerate() {
            if kept(index) {
                evaluator.push(record);
            }
        }
        evaluator.finish(StreamEnd::Reported(&self.report)).unwrap()
    }

    /// Length that was lit in the cycles of which not both ends are kept [m].
    fn lit_unseen(&self, kept: impl Fn(usize) -> bool) -> f64 {
        let pairs = self.records.windows(2).enumerate();
        let unseen = pairs.filter(|(index, _)| !(kept(*index) && kept(index + 1)));
        unseen
            .map(|(_, pair)| {
                let way = distance(&pair[0].feedback.tool, &pair[1].feedback.tool);
                way * LitSpans::of(&pair[1].feedback.laser, Period::OF_SETPOINTS.time()).share()
            })
            .sum()
    }
}

/// Asserts that a recording without some stretches says of the rest what the whole says.
fn check(recorded: &Recorded, whole: &MarkEvaluation, gaps: &[std::ops::Range<usize>]) {
    let kept = |index: usize| !gaps.iter().any(|gap| gap.contains(&index));
    let marks = recorded.evaluate(kept).marks;
    let whole = &whole.marks;
    let what = || format!("{gaps:?}: {marks:#?}");
    let balance = |marks: &monitor::marks::Marks| {
        marks.length + marks.missing - marks.double - recorded.artwork.length()
    };
    // Each side of a gap, and each stroke in it, may be off by the accuracy of a stroke's end.
    let tolerance = 5e-6 * (gaps.len() + recorded.artwork.strokes.len()) as f64;
    assert!((balance(&marks) - balance(whole)).abs() <= tolerance, "{}", what());
    let unseen = recorded.lit_unseen(kept);
    assert!((marks.unrecorded - unseen).abs() <= tolerance, "{unseen:e} lit unseen; {}", what());
    // Where a gap cuts a stroke, the place of the tool is interpolated: some nanometres.
    for (value, most) in [
        (marks.error_max, whole.error_max),
        (marks.tracking_max, whole.tracking_max),
        (marks.speed_max, whole.speed_max),
        (marks.double_end_max, whole.double_end_max),
        (marks.missing_end_max, whole.missing_end_max),
        (marks.missing - marks.unrecorded, whole.missing + 1e-8),
        (marks.double, whole.double + 1e-8),
    ] {
        assert!(value <= most, "{value:e} above {most:e}; {}", what());
    }
    let judged = marks.speed_max > 0.0;
    assert!(!judged || marks.speed_min >= whole.speed_min, "{}", what());
    assert_eq!((marks.strokes_lost, marks.stray), (0, 0.0), "{}", what());
}

/// Lines, a circle, a figure that crosses itself and comes back, and one short line.
const JOB: &str = "G21 G90 G54
M3 S800 F6000
G0 X-15 Y0
G1 X15
G0 Y10
G2 X15 Y10 I5 J0
G0 X-10 Y-10
G1 X10 Y10
G1 X10 Y-10
G1 X-10 Y10
G0 X0 Y20
G1 X0.3 F3000
M5
M2
";

#[test]
fn whatever_is_cut_out_of_a_recording_is_unrecorded_and_changes_nothing_else() {
    let recorded = Recorded::of(JOB);
    let all = recorded.records.len();
    let whole = recorded.evaluate(|_| true);
    assert_eq!((whole.marks.unrecorded, whole.unrecorded_strokes), (0.0, None));
    let mut random = SplitMix64::new(20);
    for case in 0..400 {
        let longest = [2, 20, 200, 900][case % 4];
        let gaps: Vec<_> = (0..=random.below(4))
            .map(|_| {
                let from = random.below(all as u64) as usize;
                from..from + 1 + random.below(longest) as usize
            })
            .collect();
        check(&recorded, &whole, &gaps);
    }
    // Nothing but the beginning, nothing but the end.
    check(&recorded, &whole, &[all / 2..all]);
    check(&recorded, &whole, &[0..all / 2]);
}
