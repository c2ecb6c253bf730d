//! Times of the letters: the golden conventions, the thesis's table, and the curves that beat it.

#![allow(clippy::unwrap_used)]

use machine::{Machine, Override};
use planner::{Job, plan, plan_ideal};
use serde_json::Value;

fn overrides(settings: &[(&str, &str)]) -> Vec<Override> {
    settings
        .iter()
        .map(|(key, value)| Override { key: (*key).to_owned(), value: (*value).to_owned() })
        .collect()
}

fn job(letter: &str, height: f64, style: &str, speed: &str, machine: &Machine) -> Job {
    let settings = overrides(&[
        ("letters.text", letter),
        ("letters.height", &format!("{height} m")),
        ("letters.style", style),
        ("marking.speed", speed),
    ]);
    Job::builtin(&settings, machine).unwrap()
}

fn golden() -> Value {
    let text = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/golden/letters.json"));
    serde_json::from_str(text).unwrap()
}

/// Every letter and height of a convention: name, height, golden result.
fn results(golden: &Value, convention: &str) -> Vec<(String, f64, Value)> {
    let mut results = Vec::new();
    for name in ["N", "A", "S", "O"] {
        for result in golden[convention]["letters"][name]["results"].as_array().unwrap() {
            results.push((name.to_owned(), result["scale_m"].as_f64().unwrap(), result.clone()));
        }
    }
    assert_eq!(results.len(), 12);
    results
}

#[test]
fn h1_takes_the_golden_times_and_those_of_the_table() {
    let machine = Machine::builtin();
    for (name, height, result) in results(&golden(), "H1_literal_J500") {
        let table = result["thesis"]["T"].as_f64().unwrap();
        let speed = result["thesis"]["V"].as_f64().unwrap();
        let golden = &result["model"]["path_limited"];
        let case = format!("{name} at {height} m");

        let printed = plan(&machine, &job(&name, height, "h1", &format!("{speed} m/s"), &machine))
            .unwrap()
            .facts;
        let expected = golden["T_at_table_V"].as_f64().unwrap();
        assert!((printed.duration - expected).abs() < 1e-9, "{case}: {}", printed.duration);
        assert!((printed.duration / table - 1.0).abs() < 0.06, "{case}: table {table}");
        assert!((printed.speed - speed).abs() < 1e-15, "{case}");

        let best = plan(&machine, &job(&name, height, "h1", "optimum", &machine)).unwrap().facts;
        let expected = golden["T_opt"].as_f64().unwrap();
        // The golden optimum is the best of a grid of 0.01 m/s; ours is refined.
        assert!(best.duration <= expected + 1e-9, "{case}: {} above {expected}", best.duration);
        assert!(best.duration > 0.99 * expected, "{case}: {} below {expected}", best.duration);
        assert!((best.speed - golden["V_opt"].as_f64().unwrap()).abs() < 0.01, "{case}");
        assert!(best.duration <= printed.duration, "{case}");
    }
}

#[test]
fn h2_takes_the_golden_times() {
    let mut machine = Machine::builtin();
    for (jerk, key) in [(5000.0, "J5000_ret"), (500.0, "J500_ret")] {
        machine.path.jerk = jerk;
        for (name, height, result) in results(&golden(), "H2_table_replica") {
            let speed = result["thesis"]["V"].as_f64().unwrap();
            let job = job(&name, height, "h2", &format!("{speed} m/s"), &machine);
            let facts = plan_ideal(&machine, &job).unwrap().facts;
            let expected = result["model"][key]["T_at_table_V"].as_f64().unwrap();
            let off = facts.duration - expected;
            assert!(off.abs() < 1e-9, "{name} at {height} m, {key}: off by {off:e}");
            assert!(plan(&machine, &job).is_err(), "h2 is for paper");
        }
    }
}

#[test]
fn curves_beat_the_table() {
    // At most these shares of table 3-1, A 10 m/s², J 500 m/s³, V ≤ 0.25 m/s.
    let machine = Machine::builtin();
    let heights = [0.01, 0.02, 0.05];
    let letters = [
        ("S", [2.27, 2.99, 4.43], [0.25, 0.25, 0.25]),
        ("O", [2.23, 2.90, 4.26], [0.17, 0.17, 0.215]),
    ];
    for (name, table, shares) in letters {
        for index in 0..3 {
            let job = job(name, heights[index], "curves", "optimum", &machine);
            let plan = plan(&machine, &job).unwrap();
            let facts = &plan.facts;
            let share = facts.duration / table[index];
            println!(
                "{name} at {} m: {:.4} s at {:.4} m/s, {share:.4} of the table, {:?}",
                heights[index], facts.duration, facts.speed, facts.uses
            );
            assert!(share <= shares[index], "{name} at {} m: {share}", heights[index]);
            assert_eq!(facts.strokes, 1);
            assert!(facts.speed <= 0.25);
            assert!(facts.uses.path_acceleration <= 1.001 && facts.uses.path_jerk <= 1.001);
        }
    }
}

/// A speed that is named is compared with what is marked, and not the one that curves leave of it.
#[test]
fn a_letter_that_its_curves_slow_is_noted() {
    let machine = Machine::builtin();
    let notes = |style: &str, speed: &str| {
        let facts = plan(&machine, &job("S", 0.005, style, speed, &machine)).unwrap().facts;
        (facts.notes, facts.speed, facts.speed_asked)
    };
    let (found, speed, asked) = notes("curves", "0.25 m/s");
    assert!(speed < 0.1 && asked == 0.25, "{speed} of {asked} m/s");
    assert_eq!(found.len(), 1, "{found:?}");
    let expected = format!("slowed to {speed:.4} m/s instead of 0.2500 m/s near x ");
    assert!(found[0].text.starts_with(&expected), "{:?}", found[0]);
    // What the curves allow, and what is left to the planner, is no surprise.
    assert_eq!(notes("curves", "0.04 m/s").0, []);
    assert_eq!(notes("curves", "optimum").0, []);
}

#[test]
fn a_speed_beyond_the_largest_marking_speed_is_noted() {
    let machine = Machine::builtin();
    let facts = plan(&machine, &job("N", 0.02, "h1", "1 m/s", &machine)).unwrap().facts;
    let most = machine.path.speed;
    assert_eq!((facts.speed_asked, facts.speed_limit), (1.0, most));
    let expected = format!("asks for 1.0000 m/s, marked at {most:.4} m/s at most: ");
    assert!(facts.notes.iter().any(|note| note.text.starts_with(&expected)), "{:?}", facts.notes);
}
