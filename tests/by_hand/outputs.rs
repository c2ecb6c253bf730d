//! The outputs: who switches them, and what becomes of them when something ends.

use super::cell::Cell;
use super::support::{KILL, lines, service};
use super::{refused, says};
use serde_json::Value;

const OUTPUTS: &str = r#"
[outputs.valve]
function = "general"
[outputs.air]
function = "air"
active = "low"
[outputs.fan]
function = "extraction"
after = "300 ms"
[outputs.red]
function = "signal"
states = ["faulted"]
[outputs.green]
function = "signal"
states = ["running"]
[outputs.brake]
function = "brake"
[outputs.clamp]
function = "general"
"#;

/// Whether exactly these outputs are on.
fn are_on(status: &Value, names: &[&str]) -> bool {
    let outputs = status["outputs"].as_object().unwrap();
    outputs.iter().all(|(name, on)| on.as_bool() == Some(names.contains(&name.as_str())))
}

/// A job with air and digital output 1, the clamp.
fn job(cell: &Cell) -> String {
    let program = format!("M8 M64 P1\n{}", lines(8));
    cell.place.file("job.ngc", &program).to_str().unwrap().to_owned()
}

#[test]
fn a_job_switches_what_is_its_own_and_leaves_nothing_on() {
    let mut cell = Cell::new(OUTPUTS);
    assert!(are_on(&cell.status(), &[]));
    says(&cell.ask(&["output", "valve", "on"]), 0, "valve is on\n");
    cell.until("a valve", |status| are_on(status, &["valve"]));
    // Off it goes at any time, on with a closed door only.
    cell.ask(&["input", "door", "on"]).accepted();
    cell.until("a door", |status| status["inputs"]["door"] == true);
    says(&cell.ask(&["output", "valve", "off"]), 0, "valve is off\n");
    refused(&cell.ask(&["output", "valve", "on"]), "the door is open");
    cell.ask(&["input", "door", "off"]).accepted();
    cell.until("a closed door", |status| status["inputs"]["door"] == false);
    cell.ask(&["output", "valve", "on"]).accepted();
    cell.ask(&["enable"]).accepted();
    cell.ask(&["home"]).accepted();
    cell.until("the brake", |status| are_on(status, &["valve", "brake"]));
    refused(&cell.ask(&["output", "brake", "off"]), "the machine switches this output by itself");
    refused(&cell.ask(&["output", "lamp", "on"]), "the machine has valve, air, fan");
    let (program, out) = (job(&cell), cell.place.path("run"));
    let submit = ["submit", &program, "--json", "--out", out.to_str().unwrap()];
    let submitted = cell.start(&submit);
    // The valve of before is not the job's.
    cell.until("a job", |status| are_on(status, &["air", "clamp", "fan", "green", "brake"]));
    refused(&cell.ask(&["output", "valve", "on"]), "running: a job is under way");
    cell.ask(&["hold"]).accepted();
    cell.until("a hold", |status| are_on(status, &["air", "clamp", "fan", "brake"]));
    cell.ask(&["resume"]).accepted();
    assert_eq!(submitted.wait().json(0)["outcome"], "completed");
    cell.until("fumes that are gone", |status| are_on(status, &["brake"]));
    cell.ask(&["disable"]).accepted();
    cell.until("a brake that holds", |status| are_on(status, &[]));
    cell.end();
}

/// Two layers, of which the second has air.
const LAYERS: &str = r#"
[drawing]
file = "lines.svg"
[layers.first]
colors = ["blue"]
speed = "20 mm/s"
[layers.second]
colors = ["red"]
speed = "20 mm/s"
air = true
"#;

#[test]
fn the_air_of_a_layer_is_switched_with_it() {
    let mut cell = Cell::homed(OUTPUTS);
    let line = |color, y| format!("<path stroke='{color}' fill='none' d='M0 {y} H30'/>");
    let svg = "xmlns='http://www.w3.org/2000/svg' width='30mm' height='20mm' viewBox='0 0 30 20'";
    let drawing = format!("<svg {svg}>{}{}</svg>", line("blue", 5), line("red", 15));
    cell.place.file("lines.svg", &drawing);
    let (job, out) = (cell.place.file("job.toml", LAYERS), cell.place.path("run"));
    let submit = ["submit", job.to_str().unwrap(), "--json", "--out", out.to_str().unwrap()];
    let submitted = cell.start(&submit);
    cell.until("the first layer", |status| {
        status["stroke"] == 1 && are_on(status, &["fan", "green", "brake"])
    });
    cell.until("the second", |status| {
        status["stroke"] == 2 && are_on(status, &["air", "fan", "green", "brake"])
    });
    assert_eq!(submitted.wait().json(0)["outcome"], "completed");
    assert_eq!(cell.status()["outputs"]["air"], false);
    cell.end();
}

#[test]
fn what_a_job_has_switched_on_goes_off_when_it_is_stopped_and_when_its_planner_dies() {
    for kills in [false, true] {
        let mut cell = Cell::homed(OUTPUTS);
        let (program, out) = (job(&cell), cell.place.path("run"));
        let submit = ["submit", &program, "--json", "--out", out.to_str().unwrap()];
        let submitted = cell.start(&submit);
        let status = cell.until("light", |status| status["stroke"].as_u64() > Some(0));
        assert!(are_on(&status, &["air", "clamp", "fan", "green", "brake"]), "{status:#}");
        if kills {
            service(&status, "planner").signal(KILL).unwrap();
            assert_eq!(submitted.wait().json(4)["outcome"], "aborted");
            cell.until("a fault", |status| are_on(status, &["red"]));
        } else {
            cell.ask(&["stop"]).accepted();
            assert_eq!(submitted.wait().json(1)["outcome"], "stopped");
            cell.until("rest", |status| are_on(status, &["brake"]));
        }
        cell.end();
    }
}

#[test]
fn a_controller_that_dies_leaves_the_machine_stopped_and_the_status_says_so() {
    let mut cell = Cell::homed(OUTPUTS);
    cell.ask(&["output", "valve", "on"]).accepted();
    let jog = cell.start(&["jog", "x", "--speed", "10 mm/s"]);
    let status = cell.until("a jog", |status| {
        status["state"] == "jogging" && are_on(status, &["valve", "brake"])
    });
    service(&status, "controller").signal(KILL).unwrap();
    assert_eq!(jog.wait().code, Some(4));
    let status = cell.until("a stop", |status| status["state"] == "faulted");
    assert_eq!(status["fault"], "controller_lost");
    assert!(are_on(&status, &[]), "{status:#}");
    says(&cell.ask(&["enable"]), 4, "the controller is not running");
    says(&cell.ask(&["faults"]), 0, "controller_lost: ");
    cell.end();
}
