//! Every JSON object that a command prints has a committed schema, generated from its type, and
//! what is really printed is valid against it.
//!
//! `GRAVER_WRITE_SCHEMA=1 cargo test --test schemas` writes the schemas anew.

#![allow(clippy::unwrap_used)]

mod support;

use graver::commands::bench::SpeedReport;
use graver::commands::bench::latency::{LatencyReport, RatesReport};
use graver::commands::bench::planning::PlanBenchReport;
use graver::commands::check::CheckReport;
use graver::commands::doctor::DoctorReport;
use graver::commands::faults::FaultsReport;
use graver::commands::figures::FiguresReport;
use graver::commands::kinematics::lines::Reply;
use graver::commands::machine::NewReport;
use graver::commands::machine::export::ProfileReport;
use graver::commands::motion::MotionReply;
use graver::commands::offset::OffsetsReport;
use graver::commands::plan::PlanReport;
use graver::commands::plan::preview::PreviewReport;
use graver::commands::replay::ReplayReport;
use monitor::summary::Summary;
use operator::fleet::{
    FleetStatus, FleetSubmitted, JobRecord, JobRefusal, JobTicket, MachineFaults, MachineJob,
    MachineMetrics, MachineState,
};
use operator::{Queue, Status, Submitted, VerbReply};
use schemars::{Schema, schema_for};
use support::{Place, assert_valid, lines};
use workbench::calibrate::CalibrationReport;
use workbench::compare::Comparison;
use workbench::size::report::SizeReport;
use workbench::thesis::TablesReport;

/// The schemas by the name of their file.
fn schemas() -> Vec<(&'static str, Schema)> {
    vec![
        ("calibrate", schema_for!(CalibrationReport)),
        ("check", schema_for!(CheckReport)),
        ("compare", schema_for!(Comparison)),
        ("doctor", schema_for!(DoctorReport)),
        ("faults", schema_for!(FaultsReport)),
        ("figures", schema_for!(FiguresReport)),
        ("fleet_faults", schema_for!(MachineFaults)),
        ("fleet_job", schema_for!(MachineJob)),
        ("fleet_metrics", schema_for!(MachineMetrics)),
        ("fleet_record", schema_for!(JobRecord)),
        ("fleet_refusal", schema_for!(JobRefusal)),
        ("fleet_state", schema_for!(MachineState)),
        ("fleet_status", schema_for!(FleetStatus)),
        ("fleet_submitted", schema_for!(FleetSubmitted)),
        ("fleet_ticket", schema_for!(JobTicket)),
        ("kinematics", schema_for!(Reply)),
        ("latency", schema_for!(LatencyReport)),
        ("latency_rates", schema_for!(RatesReport)),
        ("machine_export", schema_for!(ProfileReport)),
        ("machine_new", schema_for!(NewReport)),
        ("motion", schema_for!(MotionReply)),
        ("offsets", schema_for!(OffsetsReport)),
        ("plan", schema_for!(PlanReport)),
        ("preview", schema_for!(PreviewReport)),
        ("queue", schema_for!(Queue)),
        ("replay", schema_for!(ReplayReport)),
        ("reply", schema_for!(VerbReply)),
        ("speed", schema_for!(SpeedReport)),
        ("planning", schema_for!(PlanBenchReport)),
        ("status", schema_for!(Status)),
        ("submitted", schema_for!(Submitted)),
        ("summary", schema_for!(Summary)),
        ("size", schema_for!(SizeReport)),
        ("tables", schema_for!(TablesReport)),
    ]
}

#[test]
fn the_committed_schemas_are_the_generated_ones() {
    for (name, schema) in schemas() {
        let path = support::source("docs/schema").join(format!("{name}.json"));
        let generated = serde_json::to_string_pretty(&schema).unwrap() + "\n";
        if std::env::var_os("GRAVER_WRITE_SCHEMA").is_some() {
            std::fs::write(&path, &generated).unwrap();
        }
        let committed = std::fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(committed, generated, "{name}: write it anew with GRAVER_WRITE_SCHEMA=1");
    }
}

#[test]
fn the_schemas_of_files_are_printed_as_they_are_committed() {
    let place = Place::new();
    for (file, committed) in [
        ("machine", "machines/schema.json"),
        ("job", "jobs/schema.json"),
        ("catalogue", "catalogues/schema.json"),
    ] {
        let ended = place.graver(&["schema", file]);
        ended.accepted();
        assert_eq!(ended.output, std::fs::read_to_string(support::source(committed)).unwrap());
    }
}

#[test]
fn a_schema_refuses_what_it_does_not_describe() {
    for (name, schema) in schemas() {
        let validator = jsonschema::validator_for(schema.as_value()).unwrap();
        for value in [serde_json::json!({}), serde_json::json!([]), serde_json::json!(null)] {
            assert!(!validator.is_valid(&value), "{name} allows {value}");
        }
    }
}

#[test]
fn plan_and_check_print_what_their_schemas_say() {
    let place = Place::new();
    let job = place.file("lines.ngc", &lines(1));
    let job = job.to_str().unwrap();
    for machine in ["cartesian", "corexy"] {
        let machine = support::source("machines").join(format!("{machine}.toml"));
        let machine = machine.to_str().unwrap();
        let graver = |command: &str, more: &[&str]| {
            let mut arguments = vec![command, "--machine", machine, "--json"];
            arguments.extend(more);
            place.graver(&arguments).json(0)
        };
        assert_valid("plan", &graver("plan", &[job]));
        assert_valid("plan", &graver("plan", &["--set", "letters.text=S"]));
        assert_valid("check", &graver("check", &[job]));
        let check = graver("check", &[]);
        assert_valid("check", &check);
        // The motor's table contradicts itself: source 003 table 3-3.
        assert!(!check["warnings"].as_array().unwrap().is_empty(), "{check:#}");
        assert_valid("summary", &graver("simulate", &[job]));
    }
    // Also when it fails, there is one object on standard output, a summary.
    for command in ["plan", "check", "simulate", "run"] {
        let refused = place.graver(&[command, "nowhere.ngc", "--json"]).json(2);
        assert_valid("summary", &refused);
        assert_eq!(refused["outcome"], "refused");
        assert!(refused["error"]["message"].as_str().unwrap().contains("nowhere.ngc"));
    }
}

#[test]
fn tables_and_comparisons_print_what_their_schemas_say() {
    let place = Place::new();
    let tables = place.graver(&["tables", "3-2", "7-1", "--json"]).json(0);
    assert_valid("tables", &tables);
    assert_eq!(tables["tables"][1]["name"], "7-1");
    let job = place.file("lines.ngc", &lines(1));
    let machine = support::source("machines").join("cartesian.toml");
    let arguments = ["compare", job.to_str().unwrap(), "--machine", machine.to_str().unwrap()];
    let compared = place.graver(&[&arguments[..], &["--seeds", "1", "--json"]].concat()).json(0);
    assert_valid("compare", &compared);
    assert_eq!(compared["machines"][0]["rank"], 1);
    assert_valid("summary", &place.graver(&["tables", "8-1", "--json"]).json(2));
}

#[test]
fn benchmarks_print_what_their_schemas_say() {
    let place = Place::new();
    let job = place.file("lines.ngc", &lines(1));
    let arguments = ["bench", "simulate", job.to_str().unwrap(), "--seconds", "0.05", "--json"];
    assert_valid("speed", &place.graver(&arguments).json(0));
    for (of, drawings) in [(vec![job.to_str().unwrap()], 0), (vec!["--lines", "5000"], 3)] {
        let planned = place.graver(&[vec!["bench", "plan", "--json"], of].concat()).json(0);
        assert_valid("planning", &planned);
        let programs = planned["programs"].as_array().unwrap();
        assert!(programs.iter().all(|it| it["setpoints"].as_u64().unwrap() > 100), "{planned:#}");
        let found = planned["drawings"].as_array().unwrap();
        assert_eq!(found.len(), drawings, "{planned:#}");
        // The beginning of each: ten seconds of it.
        assert!(found.iter().all(|it| it["setpoints"].as_u64().unwrap() >= 10_000), "{planned:#}");
    }
    let arguments = ["bench", "latency", "--seconds", "0.3", "--no-realtime", "--json"];
    let latency = place.graver(&arguments).json(0);
    assert_valid("latency", &latency);
    assert!(latency["cycles"].as_u64().unwrap() > 0, "{latency:#}");
}

#[test]
fn operators_are_told_what_the_schemas_say() {
    let place = Place::new();
    let job = place.file("lines.ngc", &lines(3));
    let mut running = place.run(&job, "run", &[]);
    place.await_played(&mut running, 50);
    assert_valid("status", &place.ask(&["status", "--json"]).json(0));
    assert_valid("reply", &place.ask(&["override", "150 %", "--json"]).json(0));
    assert_valid("reply", &place.ask(&["reset", "--json"]).json(1));
    assert_valid("reply", &place.ask(&["hold", "--json"]).json(0));
    assert_valid("status", &place.ask(&["status", "--json"]).json(0));
    assert_valid("reply", &place.ask(&["stop", "--json"]).json(0));
    assert_valid("summary", &running.wait().json(1));
    place.assert_nothing_left(&[]);
}
