//! Recordings with gaps: what passed in them is unrecorded, and the rest is judged as if it were
//! whole.
#![allow(clippy::single_range_in_vec_init, reason = "a list of gaps may have one")]

use super::*;
use crate::conclusion::LIGHT_LAG;

/// One cycle at the speed of the tests.
const STEP: f64 = SPEED * CYCLE_TIME;

/// The records of a plan without those whose time [ms] is in one of these ranges.
fn cut(records: &[CycleRecord], gaps: &[std::ops::Range<i64>]) -> Vec<CycleRecord> {
    let zero = (FIRST + (START / CYCLE_TIME).round() as u64) as i64;
    let gone = |record: &CycleRecord| {
        let time = record.feedback.cycle.0 as i64 - zero;
        gaps.iter().any(|gap| gap.contains(&time))
    };
    records.iter().filter(|record| !gone(record)).copied().collect()
}

fn clean(plan: &Plan<'_>) -> Vec<CycleRecord> {
    play(plan, |_, tool| tool, |_, _| 0.0)
}

/// Evaluates what is left of the records of a completed job.
fn judged(
    art: &Artwork,
    records: &[CycleRecord],
    gaps: &[std::ops::Range<i64>],
) -> Result<MarkEvaluation, Unevaluated> {
    let mut evaluator = MarkEvaluator::new(art, Period::OF_SETPOINTS).with_fastest(SPEED);
    cut(records, gaps).iter().for_each(|record| evaluator.push(record));
    let last_cycle = Cycle(records.last().unwrap().feedback.cycle.0 - LIGHT_LAG);
    let completed = ControllerReport { completed: 1, last_cycle, ..ControllerReport::default() };
    evaluator.finish(StreamEnd::Reported(&completed))
}

/// Asserts what is unrecorded without the records in these gaps, and that nothing of the rest is
/// missing or double.
fn check(
    art: &Artwork,
    records: &[CycleRecord],
    gaps: &[std::ops::Range<i64>],
    unrecorded: f64,
    strokes: Option<(u64, u64)>,
) {
    let evaluation = judged(art, records, gaps).unwrap();
    let marks = &evaluation.marks;
    near(marks.unrecorded, unrecorded, ROUNDING, "unrecorded");
    near(marks.length, art.length() - unrecorded, ROUNDING, "length");
    for (value, what) in [
        (marks.missing - marks.unrecorded, "missing"),
        (marks.double, "double"),
        (marks.missing_end_max, "missing_end_max"),
        (marks.double_end_max, "double_end_max"),
        (marks.error_max, "error_max"),
        (marks.tracking_max, "tracking_max"),
    ] {
        near(value, 0.0, ROUNDING, what);
    }
    assert_eq!((marks.strokes_lost, evaluation.unrecorded_strokes), (0, strokes));
    if marks.speed_max > 0.0 {
        near(marks.speed_min, SPEED, 1e-12, "speed_min");
        near(marks.speed_max, SPEED, 1e-12, "speed_max");
    }
}

#[test]
fn a_gap_inside_a_stroke_is_as_long_as_the_way_between_the_records_beside_it() {
    let records = clean(&one_plan());
    for lost in [1, 2, 3, 17, 40] {
        // Between the last record before and the first after there is one way more.
        let unrecorded = (lost + 1) as f64 * STEP;
        check(&one_line(), &records, &[20..20 + lost], unrecorded, Some((1, 1)));
    }
    // Several; two of them with no more than one or two records between, from which no mark can be
    // told, or one cycle of it.
    check(&one_line(), &records, &[20..25, 40..41], 8.0 * STEP, Some((1, 1)));
    check(&one_line(), &records, &[20..25, 26..30], 11.0 * STEP, Some((1, 1)));
    check(&one_line(), &records, &[20..25, 27..30], 10.0 * STEP, Some((1, 1)));
}

#[test]
fn an_end_in_a_gap_is_neither_missing_nor_double() {
    let records = clean(&one_plan());
    // Light from 0 to 80.1234 ms.
    check(&one_line(), &records, &[-5..10], 10.0 * STEP, Some((1, 1)));
    check(&one_line(), &records, &[70..90], 11.1234 * STEP, Some((1, 1)));
    check(&one_line(), &records, &[-100..30], 30.0 * STEP, Some((1, 1)));
    check(&one_line(), &records, &[60..500], 21.1234 * STEP, Some((1, 1)));
    check(&one_line(), &records, &[-5..100], 80.1234 * STEP, Some((1, 1)));
    // The cycle at whose very end light begins is recorded, and so is the one in which it ended.
    check(&one_line(), &records, &[-15..0], 0.0, None);
    check(&one_line(), &records, &[83..90], 0.0, None);
    check(&one_line(), &records, &[82..500], 0.0, None);
}

/// Three lines of 10 mm one after another, 20 ms of dark between them.
fn three() -> (Artwork, Vec<CycleRecord>) {
    let line = |from: f64| straight([from, 0.0, 0.0], [from + 40.0 * STEP, 0.0, 0.0]);
    let art = artwork(vec![line(0.0), line(60.0 * STEP), line(120.0 * STEP)]);
    let light = [(1, 0.0, 0.04), (2, 0.06, 0.1), (3, 0.12, 0.16)];
    (art, clean(&Plan { tool: &along_x, light: &light, duration: 0.24 }))
}

#[test]
fn strokes_that_pass_in_a_gap_are_not_lost() {
    let (art, records) = three();
    check(&art, &records, &[45..55], 0.0, None);
    check(&art, &records, &[55..105], 40.0 * STEP, Some((2, 2)));
    check(&art, &records, &[30..130], (11.0 + 40.0 + 10.0) * STEP, Some((1, 3)));
    check(&art, &records, &[30..115], (11.0 + 40.0) * STEP, Some((1, 2)));
    check(&art, &records, &[-100..115], 80.0 * STEP, Some((1, 2)));
    check(&art, &records, &[45..500], 80.0 * STEP, Some((2, 3)));
}

#[test]
fn what_is_known_to_be_missing_stays_missing_beside_a_gap() {
    let (art, _) = three();
    // The second line gets no light; the plan for it is recorded, or it is not.
    let light = [(1, 0.0, 0.04), (2, 0.06, 0.1), (3, 0.12, 0.16)];
    let plan = Plan { tool: &along_x, light: &light, duration: 0.24 };
    let dark = |index: usize, at: f64| if index == 1 && at == 0.1 { -0.04 } else { 0.0 };
    let records = play(&plan, |_, tool| tool, dark);
    let lost = |gap: std::ops::Range<i64>| {
        let marks = judged(&art, &records, &[gap]).unwrap().marks;
        let sum = marks.length + marks.missing - marks.double;
        near(sum, art.length(), ROUNDING, "sum");
        (
            marks.strokes_lost,
            ((marks.missing - marks.unrecorded) / STEP).round(),
            (marks.unrecorded / STEP).round(),
        )
    };
    assert_eq!(lost(45..50), (1, 40.0, 0.0));
    assert_eq!(lost(30..50), (1, 40.0, 11.0));
    assert_eq!(lost(105..115), (1, 40.0, 0.0));
    assert_eq!(lost(55..115), (0, 0.0, 40.0));
    // Half of it: what came before it was due again in the recording is not known.
    assert_eq!(lost(55..80).0, 0);
}

#[test]
fn a_dot_in_a_gap_is_not_lost() {
    let dot = |x: f64| Stroke { points: vec![[x, 0.0, 0.0]], line: 0 };
    let art = artwork(vec![dot(0.01), dot(0.01), dot(0.01)]);
    let tool = |_: f64| [0.01, 0.0, 0.0];
    let light = [(1, 0.01, 0.02), (2, 0.03, 0.04), (3, 0.05, 0.06)];
    let records = clean(&Plan { tool: &tool, light: &light, duration: 0.1 });
    for (gap, strokes) in [
        (22..28, None),
        (25..45, Some((2, 2))),
        (15..55, Some((1, 2))),
        (45..500, Some((3, 3))),
        (-100..25, Some((1, 1))),
    ] {
        let evaluation = judged(&art, &records, std::slice::from_ref(&gap)).unwrap();
        assert_eq!(evaluation.marks.strokes_lost, 0, "{gap:?}");
        assert_eq!(evaluation.unrecorded_strokes, strokes, "{gap:?}");
    }
}

#[test]
fn a_lost_command_costs_nothing_but_the_tracking_beside_it() {
    let mut records = clean(&one_plan());
    records[60].command = Command::default();
    check(&one_line(), &records, &[], 0.0, None);
}

#[test]
fn a_tool_that_was_not_known_is_as_good_as_not_recorded() {
    let mut records = clean(&one_plan());
    for record in &mut records[60..63] {
        record.feedback.status = 0;
    }
    check(&one_line(), &records, &[], 4.0 * STEP, Some((1, 1)));
    assert_eq!(judged(&one_line(), &records, &[]).unwrap().unknown, 3);
}

#[test]
fn where_the_job_was_broken_off_only_what_may_have_been_marked_is_hidden() {
    let (art, records) = three();
    let evaluate = |kept: &[CycleRecord], last: i64, fastest: f64| {
        let mut evaluator = MarkEvaluator::new(&art, Period::OF_SETPOINTS).with_fastest(fastest);
        kept.iter().for_each(|record| evaluator.push(record));
        let zero = FIRST as i64 + (START / CYCLE_TIME).round() as i64;
        let last_cycle = Cycle((zero + last) as u64);
        let stopped = ControllerReport { last_cycle, ..ControllerReport::default() };
        let evaluation = evaluator.finish(StreamEnd::Reported(&stopped)).unwrap();
        let Marks { missing, unrecorded, strokes_lost, .. } = evaluation.marks;
        let left = evaluation.left.unwrap();
        near(evaluation.marks.length + missing + left.length, art.length(), ROUNDING, "sum");
        near(missing - unrecorded, 0.0, ROUNDING, "missing");
        // What is recorded ends 30 steps along the first of the three strokes.
        assert_eq!((left.stroke, (left.begun / STEP).round(), strokes_lost), (1, 30.0, 0));
        ((left.length / STEP).round(), (unrecorded / STEP).round(), evaluation.open_end)
    };
    // Stopped at 30 ms and recorded to the end: all the rest is left, whatever the speed.
    let stopped = cut(&records, &[31..500]);
    assert_eq!(evaluate(&stopped, 28, SPEED), (90.0, 0.0, false));
    // Four cycles more were played, at most at twice the speed: 8 steps; or nobody knows.
    assert_eq!(evaluate(&stopped, 32, SPEED), (82.0, 8.0, false));
    assert_eq!(evaluate(&stopped, 32, 0.0), (0.0, 90.0, true));
    // A gap and dark cycles after it, to the end.
    let mut late = cut(&records, &[31..36]);
    late.truncate(late.iter().position(|record| record.command.stream_time > 0.0465).unwrap());
    for record in late.iter_mut().filter(|record| record.command.stream_time > 0.0305) {
        (record.feedback.laser, record.command.laser) = (LaserCycle::OFF, LaserCycle::OFF);
        (record.command.stroke, record.command.state) = (0, ControllerState::Stopping as u32);
    }
    assert_eq!(evaluate(&late, 44, SPEED), (78.0, 12.0, false));
}

#[test]
fn without_a_report_the_watchdog_says_that_no_light_follows() {
    let (art, records) = three();
    let mut kept = cut(&records, &[31..500]);
    let evaluate = |kept: &[CycleRecord], end: StreamEnd<'_>| {
        let mut evaluator = MarkEvaluator::new(&art, Period::OF_SETPOINTS).with_fastest(SPEED);
        kept.iter().for_each(|record| evaluator.push(record));
        let evaluation = evaluator.finish(end).unwrap();
        let steps = (evaluation.marks.unrecorded / STEP).round();
        (steps, evaluation.marks.strokes_lost, evaluation.open_end)
    };
    assert_eq!(evaluate(&kept, StreamEnd::Unknown), (90.0, 0, true));
    // Drives died: what it had been told fell for two cycles more, at most at twice the speed.
    assert_eq!(evaluate(&kept, StreamEnd::Silenced), (4.0, 0, false));
    kept.last_mut().unwrap().feedback.status |= status::WATCHDOG_TRIPPED;
    assert_eq!(evaluate(&kept, StreamEnd::Unknown), (0.0, 0, false));
}

#[test]
fn a_gap_before_the_job_or_after_it_hides_nothing() {
    let mut records = clean(&Plan { duration: 0.4, ..one_plan() });
    // At rest after the end, as after a job that is over.
    for record in records.iter_mut().filter(|record| record.command.stream_time > 0.12) {
        (record.command.stream, record.command.stream_time) = (0, 0.0);
    }
    check(&one_line(), &records, &[-15..-5], 0.0, None);
    check(&one_line(), &records, &[150..200], 0.0, None);
    // All of the job between two idle records.
    let idle = judged(&one_line(), &records, &[-5..200]);
    assert_eq!(idle, Err(Unevaluated::Unrecorded));
}

/// A stroke that goes round twice: where in it the light is after a gap, only the time tells.
#[test]
fn a_stroke_that_comes_by_twice_is_found_by_its_time_or_not_judged() {
    let radius = 0.005;
    let turn = std::f64::consts::TAU * radius / SPEED;
    let on_circle = |angle: f64| {
        let (sine, cosine) = messages::math::sin_cos(angle);
        [radius * cosine, radius * sine, 0.0]
    };
    let points = (0..=2000)
        .map(|index| on_circle(std::f64::consts::TAU * f64::from(index) / 1000.0))
        .collect();
    let art = artwork(vec![Stroke { points, line: 0 }]);
    let tool = |time: f64| on_circle(SPEED * time / radius);
    let light = [(1, 0.0, 2.0 * turn)];
    let records = clean(&Plan { tool: &tool, light: &light, duration: 2.0 * turn + 0.08 });
    for (gap, unrecorded) in [
        (30..33, 4.0 * STEP),
        (30..150, 121.0 * STEP),
        (100..220, 121.0 * STEP),
        // The beginning is gone, and with it the place: nothing of it is judged.
        (-100..30, art.length()),
    ] {
        let marks = judged(&art, &records, std::slice::from_ref(&gap)).unwrap().marks;
        let what = format!("{gap:?}");
        // The chords of the cubic are a little shorter than the circle.
        near(marks.unrecorded, unrecorded, 2e-6, &what);
        near(marks.length + marks.unrecorded, art.length(), 6e-6, &what);
        near(marks.missing - marks.unrecorded, 0.0, 1e-7, &what);
        near(marks.double, 0.0, 1e-7, &what);
        near(marks.error_max, 0.0, 3e-8, &what);
    }
}

/// A hold on a stroke that crosses itself, cut at any place: before the hold, in it, in the way
/// back, after the light came again.
#[test]
fn a_hold_in_a_gap_is_no_loss() {
    let eight = Eight::new();
    let length = eight.length();
    let art = artwork(vec![Stroke { points: eight.points.clone(), line: 0 }]);
    let held_at = 60.0 * CYCLE_TIME;
    let held = SPEED * held_at;
    let turn = held_at + 2e-3 / SPEED;
    let back = turn + 5e-3 / SPEED;
    let along = |time: f64| match time {
        t if t < turn => SPEED * t,
        t if t < back => held + 2e-3 - SPEED * (t - turn),
        t => held - 3e-3 + SPEED * (t - back),
    };
    let tool = |time: f64| eight.point(along(time));
    let relit = back + 3e-3 / SPEED;
    let end = back + (length - held + 3e-3) / SPEED;
    let light = [(1, 0.0, held_at), (1, relit, end)];
    let mut records = clean(&Plan { tool: &tool, light: &light, duration: end + 0.04 });
    for (index, record) in records.iter_mut().enumerate() {
        let time = index as f64 * CYCLE_TIME - START;
        record.command.stream_time = (along(time) / SPEED).max(0.0);
        // The command acts in the next cycle; the hold ends where the way back begins.
        let acts = time + 1.5 * CYCLE_TIME;
        if acts > held_at && acts < turn {
            record.command.state = ControllerState::Holding as u32;
        }
    }
    let whole = evaluate(&art, &records).unwrap();
    let lit_way = |from: i64, to: i64| {
        // What of the light falls into the cycles from the last record before to the first after.
        let (from, to) = ((from - 1) as f64 * CYCLE_TIME, to as f64 * CYCLE_TIME);
        light.iter().map(|(_, on, off)| (to.min(*off) - from.max(*on)).max(0.0)).sum::<f64>()
            * SPEED
    };
    for from in (-10..120).step_by(3) {
        for lost in [1, 4, 25, 60] {
            let gap = from..from + lost;
            let marks = judged(&art, &records, std::slice::from_ref(&gap)).unwrap().marks;
            let what = format!("{gap:?}");
            near(marks.missing - marks.unrecorded, whole.missing, 2e-7, &what);
            near(marks.double, whole.double, 2e-7, &what);
            near(marks.unrecorded, lit_way(from, from + lost), 1e-6, &what);
            near(marks.length + marks.unrecorded, whole.length, 2e-6, &what);
            assert!(marks.error_max <= whole.error_max, "{what}: {:e}", marks.error_max);
        }
    }
}
