//! Sizing: the numbers of one operating point, the choice from a catalogue, and the file that is written.

#![allow(clippy::unwrap_used)]

mod by_hand;
mod catalogues;
mod choice;
mod pictures;

use machine::Machine;
use planner::Job;
use planner::request::JobRequest;
use workbench::catalogue::Catalogue;
use workbench::size::report::SizeReport;
use workbench::size::{Gears, MachineFile, Options, Order, size};

/// What the command has without arguments, but for the gears: the machine's.
const OPTIONS: Options = Options {
    margin: 1.25,
    ambient: 25.0,
    axes: Vec::new(),
    order: Order::Mass,
    gears: Gears::Keep,
};

/// The text of a machine file that is shipped.
fn shipped(name: &str) -> String {
    let path = format!("{}/../machines/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

/// A short job.
fn letters(machine: &Machine) -> Job {
    let set = vec!["letters.text=N".to_owned(), "letters.height=10 mm".to_owned()];
    JobRequest { job: None, set, offsets: None, confined: false }.read(machine).unwrap()
}

fn sized(text: &str, catalogue: &Catalogue, options: &Options) -> (SizeReport, Option<String>) {
    let machine = Machine::parse("it.toml", text, &[]).unwrap();
    let file = MachineFile { name: "it.toml", text, overrides: &[] };
    size(file, &machine, &letters(&machine), catalogue, options).unwrap()
}

fn close(found: f64, expected: f64) {
    assert!((found / expected - 1.0).abs() < 1e-4, "{found} for {expected}");
}
