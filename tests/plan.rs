//! `graver plan`: jobs on paper beside what is planned, and how far the tool strays from its strokes.

#![allow(clippy::unwrap_used)]

mod support;

use support::Place;

/// Source 004's line from (300, 360) to (420, 420) mm at 20 mm/s and 0.1 m/s², which makes 80,660 pulses of
/// one actuator and −34,926 of the other.
#[test]
fn a_line_on_paper_makes_the_golden_pulses() {
    let place = Place::new();
    let job = place.file("line.ngc", "G21 G90\nM4 S1000 F1200\nG1 X20 Y60\nM5\nM2\n");
    let machine = support::source("machines").join("twin_actuator.toml");
    let samples = place.path("samples.csv");
    let graver = |more: &[&str]| {
        let arguments = ["plan", job.to_str().unwrap(), "--machine", machine.to_str().unwrap()];
        let settings = [
            "machine.home=[\"300 mm\", \"360 mm\"]",
            "machine.area.x=[\"290 mm\", \"450 mm\"]",
            "machine.path.acceleration=\"0.1 m/s^2\"",
        ];
        let settings = settings.iter().flat_map(|setting| ["--set", setting]);
        let all: Vec<&str> = arguments.into_iter().chain(settings).chain(more.to_vec()).collect();
        place.graver(&all)
    };
    let pulses = place.path("pulses.csv");
    let files = ["--pulses", pulses.to_str().unwrap(), "--samples", samples.to_str().unwrap()];
    let paper = [&["--json", "--ideal", "--profile", "velocity"], &files[..]].concat();
    let report = graver(&paper).json(0);
    support::assert_valid("plan", &report);
    assert_eq!(report["pulses"]["counts"], serde_json::json!([80660, -34926]));
    let of = |key: &str| report["pulses"][key].as_f64().unwrap();
    let bound = of("bound");
    assert!((bound / 1.248_012_86e-6 - 1.0).abs() < 1e-4, "{bound}");
    // At each pulse and not each millisecond: at least what the golden vectors have.
    let most = of("deviation_max");
    assert!((1.228e-6..=1.02 * bound).contains(&most), "{most} against {bound}");
    let paper = &report["paper"];
    let time = paper["time"].as_f64().unwrap();
    assert!((time - 6.908_203_932_499_37).abs() < 1e-9, "{time}");
    assert_eq!(paper["profile"], "velocity");
    assert_eq!(paper["strokes"][0]["line"], 3);
    // What Graver makes of it is beside it: with a jerk of 10 m/s³ it takes a little longer.
    let own = report["time"].as_f64().unwrap();
    assert!(own > time && own < 1.02 * time, "{own}");
    let rows = std::fs::read_to_string(&samples).unwrap().lines().count();
    assert_eq!(rows, 6909 + 2, "a heading and both ends");

    let told = graver(&["--ideal", "--profile", "velocity"]);
    told.accepted();
    assert!(
        told.error.contains("6.9082 s at 0.0200 m/s by a trapezoid of velocity"),
        "{}",
        told.error
    );
}

#[test]
fn a_profile_is_for_paper_only() {
    let place = Place::new();
    let refused = place.graver(&["plan", "--profile", "trapezoid", "--json"]);
    let error = refused.json(2);
    let message = error["error"]["message"].as_str().unwrap();
    assert!(message.contains("--ideal"), "{message}");
    let machine = support::source("machines").join("mcm.toml");
    let machine = machine.to_str().unwrap();
    let refused = place.graver(&[
        "plan",
        "--machine",
        machine,
        "--ideal",
        "--profile",
        "trapezoid",
        "--json",
    ]);
    let error = refused.json(2);
    let message = error["error"]["message"].as_str().unwrap();
    assert!(message.contains("[surface]"), "{message}");
}

#[test]
fn the_check_of_paths_is_told_and_written() {
    let place = Place::new();
    let machine = support::source("machines").join("mcm.toml");
    let job = support::source("jobs").join("mcm.toml");
    let file = place.path("check.csv");
    let graver = |more: &[&str]| {
        let arguments = ["plan", job.to_str().unwrap(), "--machine", machine.to_str().unwrap()];
        place.graver(&[&arguments, more].concat())
    };
    let report = graver(&["--path-check", file.to_str().unwrap(), "--json"]).json(0);
    support::assert_valid("plan", &report);
    let strokes = report["strokes"].as_u64().unwrap() as usize;
    let checked = &report["path_check"];
    assert_eq!(checked["strokes"], strokes);
    assert!(checked["executed"]["surface"].as_f64().unwrap() < 1e-6, "{checked:#}");
    assert_eq!(checked["linear"]["too_many"], 0);
    let text = std::fs::read_to_string(&file).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(
        text.lines().next(),
        Some("stroke,interpolation,knots,matched,geometric,surface,axis")
    );
    assert_eq!(rows.len(), 1 + 4 * strokes);
    let knots = |name: &str| -> u64 {
        let rows = rows.iter().filter(|row| row[1] == name);
        rows.map(|row| row[2].parse::<u64>().unwrap()).sum()
    };
    for name in ["linear", "natural", "not_a_knot"] {
        assert_eq!(checked[name]["knots"], knots(name));
    }
    let worst = rows.iter().filter(|row| row[1] == "executed").map(|row| row[3].parse().unwrap());
    assert_eq!(checked["executed"]["matched"], worst.fold(0.0, f64::max));

    // Without the file the plan says as much as it saw; and no input is written over.
    let told = graver(&[]);
    told.accepted();
    assert!(told.error.contains("between   the tool strays by 0."), "{}", told.error);
    assert!(told.error.contains("from the surface"), "{}", told.error);
    let plan = graver(&["--json"]).json(0);
    assert_eq!(plan["path_check"], serde_json::Value::Null);
    assert!(plan["interpolation"]["deviation"].as_f64().unwrap() < 1e-6);
    let own = place.file("own.ngc", "G21\nM4 S1000 F600\nG1 X5\nM2\n");
    let own = own.to_str().unwrap();
    let taken = place.graver(&["plan", own, "--path-check", own]);
    assert_eq!(taken.code, Some(2), "{}", taken.error);
    assert!(taken.error.contains("--path-check"), "{}", taken.error);
    assert!(std::fs::read_to_string(own).unwrap().contains("G1 X5"));
}

/// Also of a job that is refused, which shows what is wrong with it.
#[test]
fn a_preview_is_written_before_anything_is_planned() {
    let place = Place::new();
    let program = "G21 G90\nM4 S500 F3000\nG1 X10\nG0 X20\nG1 X900\n";
    let job = place.file("job.ngc", program);
    let job = job.to_str().unwrap();
    let preview = place.path("preview.json");
    let preview = preview.to_str().unwrap();
    let read = || serde_json::from_str(&std::fs::read_to_string(preview).unwrap()).unwrap();
    place.graver(&["plan", job, "--preview", preview, "--json"]).json(2);
    let written: serde_json::Value = read();
    support::assert_valid("preview", &written);
    std::fs::remove_file(preview).unwrap();
    place.graver(&["plan", job, "--preview", preview, "--preview-only"]).accepted();
    assert_eq!(written, read());
    let strokes = written["strokes"].as_array().unwrap();
    assert_eq!(strokes.iter().map(|it| it.as_array().unwrap().len()).collect::<Vec<_>>(), [2, 2]);
    let wide = [0, 1].map(|row| {
        let at = |corner: &str| written["bounds"][corner][row].as_f64().unwrap();
        at("upper") - at("lower")
    });
    assert!((wide[0] - 0.9).abs() < 1e-9 && wide[1] == 0.0, "{wide:?}");

    let printed = place.graver(&["plan", job, "--preview", "-", "--preview-only"]);
    printed.accepted();
    assert!(printed.output.starts_with("<svg ") && printed.output.ends_with("</svg>\n"));
    assert_eq!(printed.output.matches("data-power=\"50\"").count(), 2);
    for (more, what) in [
        (&["--preview", "-", "--json"][..], "stdout"),
        (&["--preview", "a.png"], ".svg"),
        (&["--preview-only"], "--preview"),
    ] {
        let refused = place.graver(&[&["plan", job], more].concat());
        assert_eq!(refused.code, Some(2));
        assert!(refused.error.contains(what), "{}", refused.error);
    }
}

#[test]
fn a_plan_tells_powers_and_bounds_of_what_is_marked() {
    let place = Place::new();
    let program = "G21 G90\nM4 S250 F3000\nG0 X5\nG1 X10 Y2\nS800\nX12\nG0 X30\n";
    let job = place.file("job.ngc", program);
    let report = place.graver(&["plan", job.to_str().unwrap(), "--json"]).json(0);
    support::assert_valid("plan", &report);
    assert_eq!(report["power"], serde_json::json!([0.25, 0.8]));
    let bounds = &report["bounds"];
    let wide = [0, 1].map(|row| {
        let at = |corner: &str| bounds[corner][row].as_f64().unwrap();
        at("upper") - at("lower")
    });
    assert!((wide[0] - 7e-3).abs() < 1e-9 && (wide[1] - 2e-3).abs() < 1e-9, "{bounds:#}");
}

/// A font, a list of serial numbers, a drawing: what a job file names is an input too.
#[test]
fn no_file_that_a_job_names_is_written_over() {
    let place = Place::new();
    let csv = place.file("names.csv", "name\nAnna\nBo\n");
    let drawing =
        place.file("path.svg", "<svg width='9mm' height='9mm'><path d='M0 0L9 9'/></svg>");
    let job = "[drawings.a]\nfile = \"path.svg\"\n[drawings.b]\ntext.content = \"{name}\"\n\
               serial.csv = \"names.csv\"\narray = { columns = 2, spacing = [\"9 mm\", \"9 mm\"] }\n";
    let job = place.file("job.toml", job);
    let (job, folder) = (job.to_str().unwrap(), place.path(""));
    let folder = folder.to_str().unwrap();
    // As after a run there.
    std::fs::write(place.path("summary.json"), "{}").unwrap();
    for arguments in [
        ["plan", job, "--samples", csv.to_str().unwrap()],
        ["plan", job, "--preview", drawing.to_str().unwrap()],
        ["check", job, "--picture", drawing.to_str().unwrap()],
        ["simulate", job, "--out", folder],
        ["run", job, "--out", folder],
    ] {
        let refused = match arguments[0] {
            "run" => place.ask(&arguments),
            _ => place.graver(&arguments),
        };
        assert_eq!(refused.code, Some(2), "{arguments:?} {}", refused.error);
        assert!(refused.error.contains("a file of the job"), "{arguments:?} {}", refused.error);
    }
    assert_eq!(std::fs::read_to_string(csv).unwrap(), "name\nAnna\nBo\n");
    assert!(std::fs::read_to_string(drawing).unwrap().starts_with("<svg width='9mm'"));
}

#[test]
fn all_that_is_wrong_is_told_in_json_the_first_apart() {
    let place = Place::new();
    let program = place.file("job.ngc", "G21\nG1 X1\nF600 G1 X2 Q7\nG0 X3 W1\nM2\n");
    let file = "[points]\npoints = [[1, 2]]\ndwel = 3\n[marking]\nspeed = \"fast\"\n";
    let file = place.file("job.toml", file);
    for (job, lines) in [(program, [2, 3]), (file, [3, 5])] {
        let job = job.to_str().unwrap();
        for command in ["plan", "check", "simulate", "run"] {
            let refused = match command {
                "run" => place.ask(&[command, job, "--json"]),
                _ => place.graver(&[command, job, "--json"]),
            };
            let refused = refused.json(2);
            support::assert_valid("summary", &refused);
            let errors = refused["errors"].as_array().unwrap();
            assert_eq!(errors[0], refused["error"]);
            let told: Vec<u64> = errors.iter().filter_map(|error| error["line"].as_u64()).collect();
            assert!(lines.iter().all(|line| told.contains(line)), "{command} {job} {errors:#?}");
            for error in errors {
                assert_eq!(error["file"], job);
                assert!(error["column"].as_u64().is_some() && error["message"].is_string());
            }
        }
    }
}
