//! Lists the pairs of plans that take longer with more of a limit, and shows single ones.
//!
//! `GRAVER_CASES=9000 cargo test -p planner --test properties survey -- --ignored --nocapture` plans the first so
//! many pairs on straight joints and prints those that are more than 2 % longer; `GRAVER_FIRST` is the number of the
//! first, and `GRAVER_ALL=1` prints every one of them, each with what was asked and what the paths were marked at.

use std::cell::Cell;

use machine::Machine;
use planner::{Job, Plan, plan};

use super::{Case, Change, asked_for, case, change, linear, runner};

/// A pair whose times differ by more is told.
const TOLD: f64 = 1.02;

/// What two plans are known by.
fn told(plan: &Plan) -> String {
    let facts = &plan.facts;
    let notes: Vec<&str> = facts.notes.iter().map(|note| note.text.as_str()).collect();
    format!(
        "{:.5} s, {} strokes, up to {:.5} m/s {notes:?}",
        facts.duration, facts.strokes, facts.speed
    )
}

fn look(number: u64, case: &Case, change: &Change, tells_all: bool) -> Option<f64> {
    let machine = case.machine();
    let job: Job = case.job(&machine);
    let mut better: Machine = machine.clone();
    change.raise(&mut better);
    let slow = plan(&machine, &job).ok()?;
    let fast = plan(&better, &job).ok()?;
    let ratio = fast.facts.duration / slow.facts.duration;
    if ratio > TOLD || tells_all {
        let policy = if case.marks_at_one_speed() { "open" } else { "M4" };
        println!("{number} {policy} {ratio:.4} {change:?}");
        println!("  less: {}\n  more: {}", told(&slow), told(&fast));
        if tells_all {
            println!("  {:?}\n  {case:?}", machine.path);
        }
    }
    Some(ratio)
}

#[test]
#[ignore = "lists cases for whoever works on the planner"]
fn survey() {
    let first = asked_for("GRAVER_FIRST").unwrap_or(0);
    let count = asked_for("GRAVER_CASES").unwrap_or(1);
    let tells_all = asked_for("GRAVER_ALL").is_some();
    let number = Cell::new(0);
    let mut runner = runner(u32::try_from(first + count).unwrap(), 3);
    let found = runner.run(&(case(linear()), change()), |(case, change)| {
        let now = number.replace(number.get() + 1);
        if now >= first {
            look(now, &case, &change, tells_all);
        }
        Ok(())
    });
    found.unwrap();
}
