//! The judge on synthetic recordings, with numbers worked out by hand.
#![allow(clippy::unwrap_used)]

mod gaps;

use super::*;
use messages::artwork::Stroke;
use messages::feedback::status;
use messages::time::SETPOINT_TIME as CYCLE_TIME;
use messages::{Command, ControllerState, Cycle, Feedback, GateEdge, LaserCycle, Nanoseconds};

type Point = [f64; 3];

/// Evaluates the marks of a recording of a job that was completed.
fn evaluation(artwork: &Artwork, records: &[CycleRecord]) -> Result<MarkEvaluation, Unevaluated> {
    let mut evaluator = MarkEvaluator::new(artwork, Period::OF_SETPOINTS);
    records.iter().for_each(|record| evaluator.push(record));
    let last_cycle = Cycle(FIRST);
    let completed = ControllerReport { completed: 1, last_cycle, ..ControllerReport::default() };
    evaluator.finish(StreamEnd::Reported(&completed))
}

/// The marks of a recording of which nothing is missing.
fn evaluate(artwork: &Artwork, records: &[CycleRecord]) -> Result<Marks, Unevaluated> {
    let evaluation = evaluation(artwork, records)?;
    assert_eq!((evaluation.marks.unrecorded, evaluation.unrecorded_strokes), (0.0, None));
    Ok(evaluation.marks)
}

const SPEED: f64 = 0.25;

/// A plan by time [s]: where the tool is, which stroke has light, if any.
struct Plan<'a> {
    tool: &'a dyn Fn(f64) -> Point,
    /// `(stroke, from, to)` [s].
    light: &'a [(u64, f64, f64)],
    duration: f64,
}

/// Plays a plan: what the true tool and the true gate edges do is `truth`'s business.
fn play(
    plan: &Plan<'_>,
    truth: impl Fn(f64, Point) -> Point,
    delay: impl Fn(usize, f64) -> f64,
) -> Vec<CycleRecord> {
    let cycles = (plan.duration / CYCLE_TIME).round() as u64;
    let true_light: Vec<(u64, f64, f64)> = (plan.light.iter().enumerate())
        .map(|(index, &(stroke, from, to))| {
            (stroke, from + delay(index, from), to + delay(index, to))
        })
        .collect();
    let stroke_in = |from: f64| {
        let overlaps =
            plan.light.iter().find(|(_, on, off)| *on < from + CYCLE_TIME && *off > from);
        overlaps.map_or(0, |(stroke, _, _)| *stroke)
    };
    (0..cycles)
        .map(|cycle| {
            // The record's own time: a few cycles in, so that stroke times may begin at 0.
            let time = cycle as f64 * CYCLE_TIME - START;
            let planned = (plan.tool)(time);
            CycleRecord {
                feedback: Feedback {
                    cycle: Cycle(cycle + FIRST),
                    command_cycle: Cycle((cycle + FIRST).saturating_sub(1)),
                    command_received: Nanoseconds(1),
                    status: status::TOOL_KNOWN,
                    tool: truth(time, planned),
                    laser: laser(&true_light, time - CYCLE_TIME),
                    ..Feedback::default()
                },
                command: Command {
                    cycle: Cycle(cycle + FIRST),
                    stream: u64::from(time >= 0.0),
                    stream_time: time.max(0.0),
                    state: ControllerState::Running as u32,
                    laser: laser(plan.light, time + CYCLE_TIME),
                    stroke: stroke_in(time + CYCLE_TIME),
                    mode: 4,
                    tool: planned,
                    ..Command::default()
                },
            }
        })
        .collect()
}

const FIRST: u64 = 1234;
const START: f64 = 0.02;

/// The laser in the cycle from `start` [s], for light in these spans: `(stroke, from, to)` [s].
fn laser(light: &[(u64, f64, f64)], start: f64) -> LaserCycle {
    let power = |gate: u32| if gate == 0 { 0.0 } else { 1.0 };
    let mut edges: Vec<(i64, u32)> = Vec::new();
    let mut cycle = LaserCycle::OFF;
    for &(stroke, from, to) in light {
        for (at, gate) in [(from, stroke as u32), (to, 0)] {
            let offset = ((at - start) * 1e9).round() as i64;
            if offset <= 0 {
                cycle.gate = gate;
                cycle.power = power(gate);
            } else if offset < 1_000_000 {
                edges.push((offset, gate));
            }
        }
    }
    edges.sort_unstable();
    // Where one stroke ends and the next begins, the gate changes its number and stays open.
    edges.dedup_by(|later, earlier| {
        let together = later.0 == earlier.0;
        if together {
            earlier.1 = later.1;
        }
        together
    });
    for (offset, gate) in edges {
        assert!(cycle.push(GateEdge { offset: offset as u32, gate, power: power(gate) }));
    }
    cycle
}

fn straight(from: Point, to: Point) -> Stroke {
    Stroke { points: vec![from, to], line: 0 }
}

fn artwork(strokes: Vec<Stroke>) -> Artwork {
    Artwork { strokes }
}

/// 20 mm along x at 0.25 m/s from time 0, run-in and run-out going straight on.
fn along_x(time: f64) -> Point {
    [SPEED * time, 0.0, 0.0]
}

const STROKE_TIME: f64 = 0.0801234;

fn one_line() -> Artwork {
    artwork(vec![straight([0.0; 3], [SPEED * STROKE_TIME, 0.0, 0.0])])
}

fn one_plan() -> Plan<'static> {
    Plan { tool: &along_x, light: &[(1, 0.0, STROKE_TIME)], duration: 0.15 }
}

fn near(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value:e}, expected {expected:e}");
}

/// Rounding of gate edges to nanoseconds: 0.25 nm at this speed, at both ends.
const ROUNDING: f64 = 1e-9;

#[test]
fn a_perfect_mark_has_no_error() {
    let marks = evaluate(&one_line(), &play(&one_plan(), |_, tool| tool, |_, _| 0.0)).unwrap();
    near(marks.length, SPEED * STROKE_TIME, ROUNDING, "length");
    for (value, what) in [
        (marks.missing, "missing"),
        (marks.double, "double"),
        (marks.error_max, "error_max"),
        (marks.tracking_max, "tracking_max"),
        (marks.missing_end_max, "missing_end_max"),
        (marks.double_end_max, "double_end_max"),
        (marks.stray, "stray"),
    ] {
        near(value, 0.0, ROUNDING, what);
    }
    near(marks.speed_min, SPEED, 1e-12, "speed_min");
    near(marks.speed_max, SPEED, 1e-12, "speed_max");
    assert_eq!((marks.strokes_lost, marks.source), (0, Source::Plant));
}

#[test]
fn an_offset_is_split_into_contour_and_tracking() {
    let truth = |_, [x, y, z]: Point| [x - 4e-6, y + 3e-6, z];
    let marks = evaluate(&one_line(), &play(&one_plan(), truth, |_, _| 0.0)).unwrap();
    near(marks.error_max, 3e-6, 1e-12, "error_max");
    near(marks.error_rms, 3e-6, 1e-12, "error_rms");
    near(marks.tracking_max, 5e-6, 1e-12, "tracking_max");
    near(marks.tracking_rms, 5e-6, 1e-12, "tracking_rms");
    // 4 µm behind the plan: begins before the stroke, ends before its end.
    near(marks.double_end_max, 4e-6, ROUNDING, "double_end_max");
    near(marks.missing_end_max, 4e-6, ROUNDING, "missing_end_max");
}

#[test]
fn a_gate_0_2_ms_late_costs_50_um_at_each_end() {
    let marks = evaluate(&one_line(), &play(&one_plan(), |_, tool| tool, |_, _| 2e-4)).unwrap();
    near(marks.missing_end_max, 5e-5, ROUNDING, "missing_end_max");
    near(marks.double_end_max, 5e-5, ROUNDING, "double_end_max");
    near(marks.missing, 5e-5, ROUNDING, "missing");
    near(marks.double, 5e-5, ROUNDING, "double");
    near(marks.error_max, 0.0, ROUNDING, "error_max");
}

#[test]
fn a_gate_cycles_early_or_late_is_measured_all_the_same() {
    for cycles in [-2.0_f64, 3.0] {
        let delay = cycles * CYCLE_TIME;
        let marks =
            evaluate(&one_line(), &play(&one_plan(), |_, tool| tool, |_, _| delay)).unwrap();
        let expected = SPEED * delay.abs();
        near(marks.missing, expected, ROUNDING, "missing");
        near(marks.double_end_max, expected, ROUNDING, "double_end_max");
    }
}

#[test]
fn a_hold_and_resume_merge_into_one_stroke() {
    // Closed at 10 mm, on to 12 mm, back to 8 mm, and forward: lit again at `relit`.
    for (relit, missing, double) in [(0.01, 0.0, 0.0), (0.0107, 7e-4, 0.0), (0.0094, 0.0, 6e-4)] {
        let tool = |time: f64| {
            let x = match time {
                t if t < 0.048 => SPEED * t,
                t if t < 0.064 => 0.012 - SPEED * (t - 0.048),
                t => 0.008 + SPEED * (t - 0.064),
            };
            [x, 0.0, 0.0]
        };
        let on = 0.064 + (relit - 0.008) / SPEED;
        let end = 0.064 + (SPEED * STROKE_TIME - 0.008) / SPEED;
        let plan = Plan { tool: &tool, light: &[(1, 0.0, 0.04), (1, on, end)], duration: 0.2 };
        let marks = evaluate(&one_line(), &play(&plan, |_, tool| tool, |_, _| 0.0)).unwrap();
        near(marks.missing, missing, ROUNDING, "missing");
        near(marks.double, double, ROUNDING, "double");
        near(marks.missing_end_max, 0.0, ROUNDING, "missing_end_max");
        near(marks.double_end_max, 0.0, ROUNDING, "double_end_max");
        near(marks.error_max, 0.0, ROUNDING, "error_max");
    }
}

/// A V there and back over the same line: two strokes, one place.
#[test]
fn strokes_that_touch_do_not_hide_each_other() {
    let length = 0.01;
    let art = artwork(vec![
        straight([0.0; 3], [length, 0.0, 0.0]),
        straight([length, 0.0, 0.0], [0.0; 3]),
    ]);
    let tool =
        |time: f64| [if time < 0.05 { SPEED * time } else { SPEED * (0.1 - time) }, 0.0, 0.0];
    let light = [(1, 0.0, 0.04), (2, 0.06, 0.1)];
    let plan = Plan { tool: &tool, light: &light, duration: 0.15 };
    let marks = evaluate(&art, &play(&plan, |_, tool| tool, |_, _| 0.0)).unwrap();
    near(marks.missing, 0.0, ROUNDING, "missing");
    near(marks.double, 0.0, ROUNDING, "double");

    // The second one late by 1 ms: hidden in a picture, not here.
    let late = |index: usize, _| if index == 1 { 1e-3 } else { 0.0 };
    let marks = evaluate(&art, &play(&plan, |_, tool| tool, late)).unwrap();
    near(marks.missing_end_max, 2.5e-4, ROUNDING, "missing_end_max");
    near(marks.double_end_max, 2.5e-4, ROUNDING, "double_end_max");
}

#[test]
fn a_lost_stroke_is_missing_whole() {
    let length = SPEED * 0.04;
    let art = artwork(vec![
        straight([0.0; 3], [length, 0.0, 0.0]),
        straight([0.02, 0.0, 0.0], [0.02 + length, 0.0, 0.0]),
    ]);
    let light = [(1, 0.0, 0.04)];
    let plan = Plan { tool: &along_x, light: &light, duration: 0.16 };
    let marks = evaluate(&art, &play(&plan, |_, tool| tool, |_, _| 0.0)).unwrap();
    near(marks.missing, length, ROUNDING, "missing");
    near(marks.missing_end_max, length, ROUNDING, "missing_end_max");
    assert_eq!(marks.strokes_lost, 1);
}

#[test]
fn a_closed_circle_starts_and_ends_in_one_place() {
    let radius = 0.005;
    let turn = std::f64::consts::TAU * radius / SPEED;
    let on_circle = |angle: f64| {
        let (sine, cosine) = messages::math::sin_cos(angle);
        [radius * cosine, radius * sine, 0.0]
    };
    let sides = 1000;
    let points = (0..=sides)
        .map(|index| on_circle(std::f64::consts::TAU * f64::from(index) / f64::from(sides)))
        .collect();
    let art = artwork(vec![Stroke { points, line: 0 }]);
    let tool = |time: f64| on_circle(SPEED * time / radius);
    let light = [(1, 0.0, turn)];
    let plan = Plan { tool: &tool, light: &light, duration: turn + 0.08 };

    // The chord error of 1000 sides is r(1 − cos(π/1000)) = 25 nm; the cubic's is below 1 nm.
    let marks = evaluate(&art, &play(&plan, |_, tool| tool, |_, _| 0.0)).unwrap();
    near(marks.error_max, 0.0, 2.6e-8, "error_max");
    near(marks.missing, 0.0, 2.6e-8, "missing");
    near(marks.double, 0.0, 2.6e-8, "double");
    near(marks.length, std::f64::consts::TAU * radius, 3e-6, "length");
    near(marks.speed_min, SPEED, 1e-6, "speed_min");
    near(marks.speed_max, SPEED, 1e-6, "speed_max");

    // Late: misses 50 µm of the start and marks them at the end, which is the same place.
    let marks = evaluate(&art, &play(&plan, |_, tool| tool, |_, _| 2e-4)).unwrap();
    near(marks.missing_end_max, 5e-5, 2e-8, "missing_end_max");
    near(marks.double_end_max, 5e-5, 2e-8, "double_end_max");
    // Early: the other way round.
    let marks = evaluate(&art, &play(&plan, |_, tool| tool, |_, _| -2e-4)).unwrap();
    near(marks.missing_end_max, 5e-5, 2e-8, "missing_end_max");
    near(marks.double_end_max, 5e-5, 2e-8, "double_end_max");
}

#[test]
fn a_dot_is_judged_by_distance() {
    let art = artwork(vec![
        Stroke { points: vec![[0.01, 0.0, 0.0]], line: 0 },
        Stroke { points: vec![[0.03, 0.0, 0.0]], line: 0 },
    ]);
    let tool = |_: f64| [0.01, 0.0, 0.0];
    let plan = Plan { tool: &tool, light: &[(1, 0.01, 0.0213)], duration: 0.1 };
    let truth = |_, [x, y, z]: Point| [x + 3e-6, y - 4e-6, z];
    let marks = evaluate(&art, &play(&plan, truth, |_, _| 0.0)).unwrap();
    near(marks.error_max, 5e-6, 1e-15, "error_max");
    near(marks.error_rms, 5e-6, 1e-15, "error_rms");
    assert_eq!((marks.missing, marks.double, marks.double_end_max), (0.0, 0.0, 0.0));
    assert_eq!((marks.strokes_lost, marks.speed_max), (1, 0.0));
}

/// One line in two strokes that meet without a dark gap: inside a cycle, or at a deadline.
#[test]
fn a_change_of_stroke_without_a_dark_gap_splits_the_light() {
    let whole = SPEED * STROKE_TIME;
    for change in [0.0401234, 0.04] {
        let middle = SPEED * change;
        let art = artwork(vec![
            straight([0.0; 3], [middle, 0.0, 0.0]),
            straight([middle, 0.0, 0.0], [whole, 0.0, 0.0]),
        ]);
        let light = [(1, 0.0, change), (2, change, STROKE_TIME)];
        let plan = Plan { tool: &along_x, light: &light, duration: 0.15 };
        let marks = evaluate(&art, &play(&plan, |_, tool| tool, |_, _| 0.0)).unwrap();
        near(marks.length, whole, ROUNDING, "length");
        near(marks.missing, 0.0, ROUNDING, "missing");
        near(marks.double, 0.0, ROUNDING, "double");
        near(marks.error_max, 0.0, ROUNDING, "error_max");
        near(marks.speed_min, SPEED, 1e-12, "speed_min");
        near(marks.speed_max, SPEED, 1e-12, "speed_max");
        assert_eq!((marks.strokes_lost, marks.stray), (0, 0.0), "{change}");

        // The change 0.2 ms late: the light is unbroken, yet 50 µm of it are on the wrong stroke.
        let late = |_, at: f64| if at == change { 2e-4 } else { 0.0 };
        let marks = evaluate(&art, &play(&plan, |_, tool| tool, late)).unwrap();
        near(marks.length, whole, ROUNDING, "length");
        near(marks.missing_end_max, 5e-5, ROUNDING, "missing_end_max");
        near(marks.double_end_max, 5e-5, ROUNDING, "double_end_max");
        near(marks.missing, 5e-5, ROUNDING, "missing");
        near(marks.double, 5e-5, ROUNDING, "double");
    }
}

#[test]
fn the_light_tells_its_stroke_whatever_the_command_says() {
    for commanded in [0, 2] {
        let mut records = play(&one_plan(), |_, tool| tool, |_, _| 0.0);
        records.iter_mut().for_each(|record| record.command.stroke = commanded);
        let marks = evaluate(&one_line(), &records).unwrap();
        near(marks.length, SPEED * STROKE_TIME, ROUNDING, "length");
        near(marks.missing, 0.0, ROUNDING, "missing");
        near(marks.double, 0.0, ROUNDING, "double");
        assert_eq!(marks.stray, 0.0, "{commanded}");
    }
}

#[test]
fn light_for_a_stroke_beyond_the_artwork_is_stray() {
    let whole = SPEED * STROKE_TIME;
    let light = [(2, 0.0, STROKE_TIME)];
    let plan = Plan { light: &light, ..one_plan() };
    let marks = evaluate(&one_line(), &play(&plan, |_, tool| tool, |_, _| 0.0)).unwrap();
    near(marks.length, whole, ROUNDING, "length");
    near(marks.stray, whole, ROUNDING, "stray");
    near(marks.double, whole, ROUNDING, "double");
    near(marks.missing, whole, ROUNDING, "missing");
    assert_eq!((marks.strokes_lost, marks.error_max, marks.speed_max), (1, 0.0, 0.0));

    // The number changes halfway along the stroke: only what follows is stray.
    let change = 0.0401234;
    let light = [(1, 0.0, change), (u64::from(u32::MAX), change, STROKE_TIME)];
    let plan = Plan { light: &light, ..one_plan() };
    let marks = evaluate(&one_line(), &play(&plan, |_, tool| tool, |_, _| 0.0)).unwrap();
    let rest = whole - SPEED * change;
    near(marks.length, whole, ROUNDING, "length");
    near(marks.stray, rest, ROUNDING, "stray");
    near(marks.double, rest, ROUNDING, "double");
    near(marks.missing_end_max, rest, ROUNDING, "missing_end_max");
    near(marks.double_end_max, 0.0, ROUNDING, "double_end_max");
    near(marks.speed_min, SPEED, 1e-12, "speed_min");
    assert_eq!(marks.strokes_lost, 0);
}

/// Light that first comes far along a stroke which crosses itself: the place is known from the
/// dark cycles before it.
#[test]
fn light_that_comes_late_is_found_where_it_falls() {
    let eight = Eight::new();
    let art = artwork(vec![Stroke { points: eight.points.clone(), line: 0 }]);
    let end = eight.length() / SPEED;
    let tool = |time: f64| eight.point(SPEED * time);
    let plan = Plan { tool: &tool, light: &[(1, 0.0, end)], duration: end + 0.04 };
    // The crossing is a quarter of the way along; the second branch through it is three quarters.
    for part in [0.1, 0.25, 0.5, 0.75] {
        let dark = part * end;
        let late = |_, at: f64| if at == 0.0 { dark } else { 0.0 };
        let marks = evaluate(&art, &play(&plan, |_, tool| tool, late)).unwrap();
        // As in the test of holds: the cubic's error in the tightest bend.
        near(marks.missing_end_max, SPEED * dark, 1.1e-7, "missing_end_max");
        near(marks.missing, SPEED * dark, 1.1e-7, "missing");
        near(marks.double, 0.0, 1.1e-7, "double");
    }
}

#[test]
fn where_nothing_was_recorded_nothing_is_judged() {
    let art = one_line();
    assert_eq!(evaluate(&art, &[]), Err(Unevaluated::Unrecorded));
    let mut records = play(&one_plan(), |_, tool| tool, |_, _| 0.0);
    // The cycles before the stream are none of the job's.
    assert_eq!(evaluate(&art, &records[..10]), Err(Unevaluated::Unrecorded));
    records.iter_mut().for_each(|record| record.feedback.status = 0);
    assert_eq!(evaluate(&art, &records), Err(Unevaluated::ToolUnknown));
}

/// A closed figure of eight: it crosses itself, and ends where it starts.
struct Eight {
    points: Vec<Point>,
    along: Vec<f64>,
}

impl Eight {
    fn new() -> Self {
        let count = 4000;
        let points: Vec<Point> = (0..=count)
            .map(|index| {
                let angle = std::f64::consts::TAU * f64::from(index) / f64::from(count);
                let (sine, cosine) = messages::math::sin_cos(angle);
                [0.01 * cosine, 0.01 * sine * cosine, 0.0]
            })
            .collect();
        let mut along = vec![0.0];
        for pair in points.windows(2) {
            along.push(along.last().unwrap() + messages::artwork::distance(&pair[0], &pair[1]));
        }
        Self { points, along }
    }

    fn length(&self) -> f64 {
        *self.along.last().unwrap()
    }

    /// The point at an arc length, going round and round.
    fn point(&self, at: f64) -> Point {
        let at = at.rem_euclid(self.length());
        let index = self.along.partition_point(|&along| along <= at).clamp(1, self.along.len() - 1);
        let (from, to) = (self.points[index - 1], self.points[index]);
        let part = (at - self.along[index - 1]) / (self.along[index] - self.along[index - 1]);
        std::array::from_fn(|axis| from[axis] + part * (to[axis] - from[axis]))
    }
}

/// Holds at random places of the eight, resumes that gap or overlap, and edges that are all late
/// or early: what is missing and double is known from the arc lengths alone.
#[test]
fn holds_on_a_stroke_that_crosses_itself_are_measured_anywhere() {
    let eight = Eight::new();
    let length = eight.length();
    let art = artwork(vec![Stroke { points: eight.points.clone(), line: 0 }]);
    let mut numbers = messages::random::SplitMix64::new(1);
    let mut random = |low: f64, high: f64| numbers.between(low, high);
    for case in 0..200 {
        let held = random(0.15, 0.85) * length;
        let overlap = random(-1e-3, 1e-3);
        let late = random(-4e-4, 4e-4);
        // On by 2 mm in the dark, back by 5 mm, forward again.
        let turn = (held + 2e-3) / SPEED;
        let back = turn + 5e-3 / SPEED;
        let along = |time: f64| match time {
            t if t < turn => SPEED * t,
            t if t < back => held + 2e-3 - SPEED * (t - turn),
            t => held - 3e-3 + SPEED * (t - back),
        };
        let tool = |time: f64| eight.point(along(time));
        let relit = back + (3e-3 - overlap) / SPEED;
        let end = back + (length - held + 3e-3) / SPEED;
        let light = [(1, 0.0, held / SPEED), (1, relit, end)];
        let plan = Plan { tool: &tool, light: &light, duration: end + 0.04 };
        let marks = evaluate(&art, &play(&plan, |_, tool| tool, |_, _| late)).unwrap();

        let place = format!("case {case}: held {held}, overlap {overlap}, late {late}");
        let shift = SPEED * late;
        let beyond = shift.abs();
        // The cubic's error in the tightest bend: v³/r² = 2500 m/s³ there, 52 nm at each edge.
        let tolerance = 1.1e-7;
        near(marks.missing, beyond + (-overlap).max(0.0), tolerance, &place);
        near(marks.double, beyond + overlap.max(0.0), tolerance, &place);
        near(marks.missing_end_max, beyond, tolerance, &place);
        near(marks.double_end_max, beyond, tolerance, &place);
        // Beyond an end the line goes on straight while the tool goes on curving.
        near(marks.error_max, 0.0, beyond * beyond / 0.004 + tolerance, &place);
    }
}
