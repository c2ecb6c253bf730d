//! What every plan of every drawing must keep, on random machines and drawings that shrink to the
//! smallest that fails.
//!
//! Ten thousand cases by default, the same ones each time; as many as are asked for, and others, by
//! `GRAVER_CASES=1000000 GRAVER_SEED=7 cargo test --release -p planner --test properties`. Of those that
//! compare two plans few are looked at by default: more limits still cost some per cent of the time in one
//! case of a thousand or so, which `survey` lists (see there).

#![allow(missing_docs, unreachable_pub, clippy::unwrap_used, clippy::print_stdout)]

mod cases;
mod checks;
mod survey;

use cases::{CURVED, Case, Element, LINEAR, Limits, case};
use machine::Machine;
use messages::Setpoint;
use planner::drawing::{Action, Step};
use planner::{Job, plan};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};

/// Cases of the tests of single plans.
const CASES: u32 = 10_000;

/// How much longer a job may get where it should not: the law is optimal to a few parts in a thousand.
const LONGER: f64 = 1.01;

/// The same of lines at one speed that the job leaves open: it is chosen by flights of which the search ends
/// within half a per cent, and by what the joints leave at a few places.
const LONGER_OPEN: f64 = 1.03;

/// What sampling adds to a duration [s].
const CYCLES: f64 = 3e-3;

/// Tries `test` on `count` cases, of [`CASES`] in all, on machines of `range`.
fn for_cases(
    count: u32,
    range: std::ops::Range<usize>,
    number: u8,
    test: impl Fn(&Case, &Change) -> Result<(), TestCaseError>,
) {
    let all = asked_for("GRAVER_CASES").unwrap_or(u64::from(CASES));
    let count = (all * u64::from(count)).div_ceil(u64::from(CASES));
    let mut runner = runner(u32::try_from(count).unwrap_or(u32::MAX), number);
    let found = runner.run(&(case(range), change()), |(case, change)| test(&case, &change));
    if let Err(failure) = found {
        panic!("{failure}");
    }
}

/// What makes `cases` cases, of a test of this `number`.
fn runner(cases: u32, number: u8) -> TestRunner {
    let config = Config {
        cases,
        failure_persistence: None,
        max_shrink_iters: 3000,
        max_shrink_time: 15_000,
        max_global_rejects: u32::MAX,
        ..Config::default()
    };
    let mut seed = [number; 32];
    seed[..8].copy_from_slice(&asked_for("GRAVER_SEED").unwrap_or(0).to_le_bytes());
    let random = TestRng::from_seed(RngAlgorithm::ChaCha, &seed);
    TestRunner::new_with_rng(config, random)
}

/// A number of the environment.
fn asked_for(name: &str) -> Option<u64> {
    std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok())
}

fn linear() -> std::ops::Range<usize> {
    0..LINEAR.len()
}

fn curved() -> std::ops::Range<usize> {
    LINEAR.len()..LINEAR.len() + CURVED.len()
}

/// One limit raised, or the feeds lowered.
#[derive(Debug, Clone)]
struct Change {
    which: usize,
    factor: f64,
}

fn change() -> impl Strategy<Value = Change> {
    (0..7_usize, 1.05..8.0).prop_map(|(which, factor)| Change { which, factor })
}

impl Change {
    /// Raises the limit.
    fn raise(&self, machine: &mut Machine) {
        let Self { which, factor } = *self;
        match which {
            0 => machine.path.speed *= factor,
            1 => machine.path.rapid *= factor,
            2 => machine.path.acceleration *= factor,
            3 => machine.path.jerk *= factor,
            which => machine.axes.iter_mut().for_each(|axis| match which {
                4 => axis.limits.velocity *= factor,
                5 => axis.limits.acceleration *= factor,
                _ => axis.limits.jerk *= factor,
            }),
        }
    }
}

/// The setpoints of a plan and its duration; `None` where it is refused for a place.
fn planned(machine: &Machine, job: &Job) -> Result<Option<(f64, Vec<Setpoint>)>, TestCaseError> {
    match plan(machine, job) {
        Ok(plan) => Ok(Some((plan.facts.duration, plan.setpoints(1).collect()))),
        Err(error) if checks::is_sound(&error) => Ok(None),
        Err(error) => Err(TestCaseError::fail(format!("refused: {error}"))),
    }
}

fn keeps_everything(case: &Case) -> Result<(), TestCaseError> {
    let machine = case.machine();
    let job = case.job(&machine);
    let Some((duration, setpoints)) = planned(&machine, &job)? else { return Ok(()) };
    prop_assert!(duration.is_finite() && duration < 7.0 * 86_400.0, "lasts {duration} s");
    checks::keeps_everything(&setpoints, &job, &machine).map_err(TestCaseError::fail)?;
    // What is within a tolerance of noise or of nothing may be drawn straight.
    let is_plain = |element: &Element| !matches!(element, Element::Chords(..) | Element::Tiny(..));
    if case.elements.iter().all(is_plain) && !case.elements.iter().any(is_dot) {
        checks::marks_all(&setpoints, &job, &machine).map_err(TestCaseError::fail)?;
    }
    Ok(())
}

fn is_dot(element: &Element) -> bool {
    matches!(element, Element::Dot(_))
}

fn raised_limits_never_cost_time(case: &Case, change: &Change) -> Result<(), TestCaseError> {
    let machine = case.machine();
    let job = case.job(&machine);
    let mut better = machine.clone();
    change.raise(&mut better);
    let Some((slow, fast)) = plan_both(&machine, &job, &better, &job)? else { return Ok(()) };
    if case.marks_at_one_speed() && (slow.marks_slower || fast.marks_slower) {
        return Ok(());
    }
    let longer = if case.marks_at_one_speed() { LONGER_OPEN } else { LONGER };
    let (slow, fast) = (slow.duration, fast.duration);
    prop_assert!(fast <= slow * longer + CYCLES, "{fast} s with more, {slow} s with less");
    Ok(())
}

fn lowered_feeds_never_save_time(case: &Case, change: &Change) -> Result<(), TestCaseError> {
    // At one speed a lower feed has a shorter run-in and run-out, which can save more than it costs.
    if case.marks_at_one_speed() {
        return Ok(());
    }
    let machine = case.machine();
    let job = case.job(&machine);
    let mut slower = job.clone();
    slower.drawing.steps.iter_mut().for_each(|step| lower(step, machine.path.speed, change.factor));
    let Some((slow, fast)) = plan_both(&machine, &slower, &machine, &job)? else { return Ok(()) };
    let (slow, fast) = (slow.duration, fast.duration);
    prop_assert!(fast <= slow * LONGER + CYCLES, "{fast} s as drawn, {slow} s at a lower feed");
    Ok(())
}

fn lower(step: &mut Step, most: f64, factor: f64) {
    match &mut step.action {
        Action::Mark { speed, .. } => *speed = Some(speed.unwrap_or(most).min(most) / factor),
        Action::Feed { speed, .. } => *speed /= factor,
        _ => {}
    }
}

/// What two plans are compared by.
struct Timed {
    duration: f64,
    /// Whether a limit slows a line below what it asks for. Of lines at one speed, such a one is marked
    /// faster where there is more of the limit, from a longer run-in.
    marks_slower: bool,
}

/// Both plans, unless one is refused for a place.
fn plan_both(
    one: &Machine,
    job: &Job,
    other: &Machine,
    other_job: &Job,
) -> Result<Option<(Timed, Timed)>, TestCaseError> {
    let timed = |machine: &Machine, job: &Job| match plan(machine, job) {
        Ok(plan) => {
            let asks_for_more = job.drawing.steps.iter().any(|step| match &step.action {
                Action::Mark { speed, .. } => speed.is_some_and(|speed| speed > machine.path.speed),
                _ => false,
            });
            let is_slowed = |note: &planner::drawing::Note| {
                note.text.starts_with("slowed") || note.text.contains("in proportion")
            };
            let marks_slower = asks_for_more || plan.facts.notes.iter().any(is_slowed);
            Ok(Some(Timed { duration: plan.facts.duration, marks_slower }))
        }
        Err(error) if checks::is_sound(&error) => Ok(None),
        Err(error) => Err(TestCaseError::fail(format!("refused: {error}"))),
    };
    Ok(timed(one, job)?.zip(timed(other, other_job)?))
}

#[test]
fn plans_on_straight_joints_keep_every_limit() {
    for_cases(8000, linear(), 1, |case, _| keeps_everything(case));
}

#[test]
fn plans_on_turning_joints_keep_every_limit() {
    for_cases(2000, curved(), 2, |case, _| keeps_everything(case));
}

#[test]
fn a_raised_limit_never_costs_time_on_straight_joints() {
    for_cases(120, linear(), 3, raised_limits_never_cost_time);
}

#[test]
fn a_raised_limit_never_costs_time_on_turning_joints() {
    for_cases(30, curved(), 4, raised_limits_never_cost_time);
}

#[test]
fn a_lowered_feed_never_saves_time() {
    for_cases(90, linear(), 5, lowered_feeds_never_save_time);
}

/// What springs make of the jerk at the end of a line is seen only with the samples after it, when only the
/// line itself can still mend it.
#[test]
fn the_end_of_a_line_that_breaks_a_limit_is_planned_again() {
    let case = Case {
        machine: 0,
        limits: Limits {
            speed: 0.0,
            rapid: 0.0,
            acceleration: 0.487_456_937_831_558_36,
            jerk: 1.341_557_108_086_386_5,
            axis_velocity: -0.976_853_527_841_121,
            axis_acceleration: None,
            axis_jerk: None,
            current: 1.0,
            voltage: 0.503_542_631_282_977_2,
        },
        exact: false,
        delays: [0.0; 2],
        size: 0.0,
        elements: vec![Element::Chords(13, 8.881e-5, -2.280_034, 0.0, 0.0, 0)],
    };
    let machine = case.machine();
    plan(&machine, &case.job(&machine)).unwrap();
    keeps_everything(&case).unwrap();
}
