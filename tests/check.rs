//! `graver check` explains machines of every kind.

#![allow(clippy::unwrap_used)]

mod support;

use messages::math;
use serde_json::{Value, json};
use support::{Place, assert_valid, number};

/// What `check --json` says of a machine in the source tree, with these further arguments.
fn check(machine: &str, more: &[&str]) -> Value {
    let place = Place::new();
    let machine = support::source("machines").join(format!("{machine}.toml"));
    let mut arguments = vec!["check", "--machine", machine.to_str().unwrap(), "--json"];
    arguments.extend(more);
    let report = place.graver(&arguments).json(0);
    assert_valid("check", &report);
    report
}

/// Whether the five-bar of machines/five_bar.toml comes to `(x, y)`, by the law of cosines from
/// each motor, elbows out, with its axes' limits and margins of 0.1.
fn five_bar_reaches(x: f64, y: f64) -> bool {
    let (base, proximal, distal) = (0.05, 0.2, 0.25);
    let mut elbows = [[0.0; 2]; 2];
    for (arm, side) in [1.0, -1.0].into_iter().enumerate() {
        let (dx, dy) = (x + side * base, y);
        let span: f64 = f64::sqrt(dx * dx + dy * dy);
        let inner = (span * span + proximal * proximal - distal * distal) / (2.0 * proximal * span);
        if inner.abs() > 1.0 {
            return false;
        }
        let angle = math::atan2(dy, dx) + side * math::acos(inner);
        let limits = [[60.0, 170.0], [10.0, 120.0]][arm];
        if !(limits[0]..=limits[1]).contains(&angle.to_degrees()) {
            return false;
        }
        elbows[arm] = [-side * base + proximal * math::cos(angle), proximal * math::sin(angle)];
    }
    let distals = elbows.map(|[ex, ey]| [x - ex, y - ey]);
    let sine = |[ax, ay]: [f64; 2], [bx, by]: [f64; 2]| {
        (ax * by - ay * bx).abs() / (math::hypot(ax, ay) * math::hypot(bx, by))
    };
    let proximals = [[elbows[0][0] + base, elbows[0][1]], [elbows[1][0] - base, elbows[1][1]]];
    let limit = 0.1;
    sine(distals[0], distals[1]) >= limit
        && (0..2).all(|arm| sine(proximals[arm], distals[arm]) >= limit)
}

#[test]
fn a_five_bar_reaches_what_its_triangles_allow() {
    let report = check("five_bar", &[]);
    let mut count = 0;
    for row in 0..41 {
        for column in 0..41 {
            let x = -0.08 + 0.16 * f64::from(column) / 40.0;
            let y = 0.27 + 0.12 * f64::from(row) / 40.0;
            count += u32::from(five_bar_reaches(x, y));
        }
    }
    let share = number(&report, "/reach/reached");
    let expected = f64::from(count) / 1681.0;
    println!("reached {share}, expected {expected}\n{:#}", report["reach"]);
    assert!((share - expected).abs() < 1e-12, "{share}, not {expected}");
    assert_eq!(report["axes"][0]["unit"], "rad");
    assert!(report["job"].is_null());
    let sample = report["sample_job"].as_str().unwrap();
    assert!(sample.ends_with("jobs/five_bar.toml") && !sample.contains(".."), "{sample}");
}

/// Its sample is built in as well: the path in its text leads nowhere from here.
#[test]
fn the_built_in_machine_names_no_file_as_its_sample() {
    let report = Place::new().graver(&["check", "--json"]).json(0);
    assert!(report["sample_job"].is_null(), "{}", report["sample_job"]);
}

#[test]
fn a_polar_machine_is_nearest_to_its_center_there() {
    // Two lines, one of them 2 mm beside the centre of the table.
    let place = Place::new();
    let text = "G21 G90 G54\nG0 X30 Y2\nM3 S800 F3000\nG1 X-30\nM5\nM2\n";
    let job = place.file("beside.ngc", text);
    let report = check("polar", &[job.to_str().unwrap()]);
    let margins = report["job"]["margins"].as_array().unwrap();
    let center = margins.iter().find(|margin| margin["name"] == "center").unwrap();
    println!("{center:#}");
    // The determinant a₁·c·sin θ₁ at a radius of ρ = 2·a₁·sin(θ₁/2): ρ·√(a₁² − ρ²/4) for a₁ = c.
    let radius = 2e-3_f64;
    let expected = radius * f64::sqrt(0.25 * 0.25 - radius * radius / 4.0);
    let value = number(center, "/value");
    // Looked at every 5 ms, at up to 50 mm/s: 0.125 mm beside the nearest place.
    assert!((value - expected).abs() < 3e-3 * expected, "{value}, not {expected}");
    assert_eq!(center["stroke"], 1);
    assert!(number(center, "/position/0").abs() < 2e-4, "{center}");
    // Its table turns without end, which JSON has no number for.
    assert_eq!(report["axes"][1]["position"], json!([null, null]));
    for motor in report["job"]["motors"].as_array().unwrap() {
        assert!(motor["pulse_rate"].is_null() && motor["heat"].is_number(), "{motor}");
    }
    // Straight over the centre, but not in it: one place of the grid is singular.
    assert_eq!(number(&report, "/reach/singular"), 1.0 / 1681.0);
}

#[test]
fn an_mcm_has_lines_and_angles() {
    let report = check("mcm", &[]);
    let units: Vec<&str> = report["axes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|axis| axis["unit"].as_str().unwrap())
        .collect();
    assert_eq!(units, ["m", "m", "rad", "rad", "rad"]);
    let place = Place::new();
    let machine = support::source("machines/mcm.toml");
    let told = place.graver(&["check", "--machine", machine.to_str().unwrap()]);
    told.accepted();
    println!("{}", told.error);
    for line in [
        "axis X    100.0 to 500.0 mm, 0.400 of",
        "axis d    -720.0 to 720.0°, 8.000 of",
        "not checked",
    ] {
        assert!(told.error.contains(line), "{line}: {}", told.error);
    }
}

#[test]
fn steppers_are_told_by_pulses_and_a_picture_is_drawn() {
    let place = Place::new();
    let job = place.file("lines.ngc", &support::lines(1));
    let picture = place.path("workspace.svg");
    let more = [job.to_str().unwrap(), "--picture", picture.to_str().unwrap()];
    let report = check("cartesian_steppers", &more);
    // Screws reach the whole area, and know no singularity.
    assert_eq!(number(&report, "/reach/reached"), 1.0);
    assert_eq!(report["job"]["margins"], json!([]));
    // Half a pulse on each of two screws at right angles.
    let half: [f64; 2] = [0, 1].map(|axis| number(&report["axes"][axis], "/resolution") / 2.0);
    let expected = math::hypot(half[0], half[1]);
    assert!((number(&report, "/reach/count_error") - expected).abs() < 1e-12, "{expected}");
    for motor in report["job"]["motors"].as_array().unwrap() {
        assert!(motor["voltage"].is_null() && motor["heat"].is_null(), "{motor}");
        let share = number(motor, "/pulse_rate");
        assert!((0.0..1.0).contains(&share), "{motor}");
    }
    let svg = std::fs::read_to_string(picture).unwrap();
    for word in ["<svg", "x [mm]", "reached", "home", "job"] {
        assert!(svg.contains(word), "{word}");
    }
    let nowhere = place.path("nowhere/workspace.svg");
    let refused = place.graver(&["check", "--picture", nowhere.to_str().unwrap()]);
    assert_eq!(refused.code, Some(2));
    assert!(refused.error.contains("cannot write"), "{}", refused.error);
}

#[test]
fn the_port_is_told_with_modes_and_latencies_and_why_it_would_refuse() {
    let report = check("hostmot2_steppers", &[]);
    let drives = json!({
        "port": "hostmot2",
        "mode": ["position", "position"],
        "latency": [4e-4, 4e-4],
        "gate_latency": 4e-4,
        "link": null,
    });
    assert_eq!((&report["drives"], &report["warnings"]), (&drives, &json!([])));
    // A request that comes so early is not there when its gate is due.
    let early = "machine.drives.hostmot2.gate_latency=\"10 us\"";
    let report = check("hostmot2_steppers", &["--set", early]);
    let warning = report["warnings"][0]["message"].as_str().unwrap();
    let parts = ["`graver run` cannot drive it", "gate has a latency of 10 us", "100 us to 900 us"];
    assert!(parts.iter().all(|part| warning.contains(part)), "{warning}");

    let machine = support::source("machines/hostmot2_steppers.toml");
    let told = Place::new().graver(&["check", "--machine", machine.to_str().unwrap()]);
    told.accepted();
    for line in [
        "drives    hostmot2\n",
        "          x follows a position, 400.0 µs after the deadline\n",
        "          the gate follows 400.0 µs after the deadline\n",
    ] {
        assert!(told.error.contains(line), "{line}: {}", told.error);
    }
}
