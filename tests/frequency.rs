//! The frequency of the laser's pulses, from layers and files to what the simulated source did.

#![allow(clippy::unwrap_used)]

mod support;

use std::collections::BTreeMap;
use std::path::Path;

use drives::PlantOptions;
use machine::{Machine, Override};
use planner::Job;
use planner::job::JobError;
use workbench::simulation::simulate;

/// Two lines of two colours.
const LINES: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" width="20mm" height="10mm" viewBox="0 0 20 10">
<path d="M2 2 H 18" fill="none" stroke="red"/><path d="M2 8 H 18" fill="none" stroke="blue"/></svg>"##;

/// Two recipes of LightBurn, of which one sets the frequency [Hz].
fn project(frequency: &str) -> String {
    let shape = |cut: u32, y: u32| {
        format!(
            "<Shape Type='Rect' W='6' H='4' Cr='0' CutIndex='{cut}'><XForm>1 0 0 1 50 {y}</XForm></Shape>"
        )
    };
    format!(
        "<?xml version='1.0'?><LightBurnProject AppVersion='1.4.00' FormatVersion='0'>\
         <CutSetting type='Cut'><index Value='0'/><name Value='deep'/><speed Value='100'/>\
         <frequency Value='{frequency}'/></CutSetting>\
         <CutSetting type='Cut'><index Value='1'/><name Value='plain'/><speed Value='100'/></CutSetting>\
         {}{}</LightBurnProject>",
        shape(0, 40),
        shape(1, 60)
    )
}

fn machine(changes: &[&str]) -> Machine {
    let changes: Vec<Override> = changes.iter().map(|text| text.parse().unwrap()).collect();
    Machine::load(&support::source("machines/corexy.toml"), &changes).unwrap()
}

fn pulsed(more: &[&str]) -> Machine {
    machine(&[&[r#"laser.frequency=["20 kHz", "80 kHz"]"#], more].concat())
}

fn read(name: &str, text: &str, machine: &Machine, changes: &[&str]) -> Result<Job, JobError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    let changes: Vec<Override> = changes.iter().map(|text| text.parse().unwrap()).collect();
    Job::read(Path::new(&path), &changes, machine)
}

/// Which frequencies each stroke was marked with, as the plant fired [pulses/s], and the digest.
fn fired(machine: &Machine, job: &Job) -> (BTreeMap<u32, Vec<f64>>, u64) {
    let plan = planner::plan(machine, job).unwrap();
    let mut strokes: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
    let simulated = simulate(machine, machine, &plan, PlantOptions::default(), |records| {
        for laser in records.iter().map(|record| &record.feedback.laser) {
            let edges = laser.edges().iter().map(|edge| edge.gate);
            for stroke in edges.chain([laser.gate]).filter(|gate| *gate != 0) {
                let found = strokes.entry(stroke).or_default();
                if found.last() != Some(&laser.frequency) {
                    found.push(laser.frequency);
                }
            }
        }
    })
    .unwrap();
    assert_eq!(simulated.controller.completed, 1, "{:?}", simulated.controller);
    (strokes, simulated.controller.digest)
}

/// That strokes have the `right` frequencies, in order, each stroke one of them.
fn assert_fired(machine: &Machine, job: &Job, right: &[f64]) {
    let (strokes, _) = fired(machine, job);
    assert!(strokes.values().all(|found| found.len() == 1), "{strokes:?}");
    let mut found: Vec<f64> = strokes.into_values().flatten().collect();
    found.dedup();
    assert_eq!(found, right);
}

#[test]
fn each_layer_is_marked_with_its_own_frequency() {
    let layers = ["layers.red.frequency=25 kHz", "layers.blue.power=0.5", "order.repeat=2"];
    let all = [25e3, 0.0, 25e3, 0.0];
    assert_fired(&pulsed(&[]), &read("l.svg", LINES, &pulsed(&[]), &layers).unwrap(), &all);
    let with_default = [&layers[..], &["marking.frequency=30000 Hz"]].concat();
    let all = [25e3, 30e3, 25e3, 30e3];
    assert_fired(&pulsed(&[]), &read("l.svg", LINES, &pulsed(&[]), &with_default).unwrap(), &all);
}

#[test]
fn delays_of_the_source_and_long_cycles_change_no_strokes_frequency() {
    let layers = ["layers.red.frequency=80 kHz", "layers.blue.frequency=20 kHz"];
    for more in [
        &["laser.on_delay=20 ms", "laser.off_delay=35 ms"][..],
        &["realtime.period=2 ms"],
        &["realtime.period=250 us", "laser.off_delay=300 us"],
    ] {
        let machine = pulsed(more);
        assert_fired(&machine, &read("l.svg", LINES, &machine, &layers).unwrap(), &[80e3, 20e3]);
    }
}

#[test]
fn programs_and_letters_have_the_frequency_of_the_whole_job() {
    let machine = pulsed(&[]);
    let program = "G21 G90\nM3 S500\nG1 X10 F3000\nM5\nG0 X20\nM4 S500\nG1 X30\nM2\n";
    let job = read("p.ngc", program, &machine, &["marking.frequency=40 kHz"]).unwrap();
    assert_fired(&machine, &job, &[40e3]);
    let cloud = "[points]\npoints = [[\"5 mm\", \"0 mm\"]]\n[marking]\nfrequency = \"50 kHz\"\n";
    let job = read("p.toml", cloud, &machine, &[]).unwrap();
    assert_fired(&machine, &job, &[50e3]);
}

#[test]
fn a_recipe_of_lightburn_sets_it_where_the_machine_can() {
    let machine = pulsed(&[]);
    assert_fired(
        &machine,
        &read("b.lbrn2", &project("60000"), &machine, &[]).unwrap(),
        &[60e3, 0.0],
    );
    let error = read("b.lbrn2", &project("200000"), &machine, &[]).unwrap_err().to_string();
    let right = "layer `deep` of the drawing asks for 200 kHz, which this laser cannot do";
    assert!(error.contains(right), "{error}");
    let plain = self::machine(&[]);
    let job = read("b.lbrn2", &project("60000"), &plain, &[]).unwrap();
    let note = job.drawing.notes.iter().filter(|note| note.text.contains("laser.frequency"));
    assert_eq!(note.count(), 1, "{:?}", job.drawing.notes);
    assert_fired(&plain, &job, &[0.0]);
}

#[test]
fn a_frequency_that_the_machine_cannot_set_is_refused_with_its_range() {
    let refused = |machine: &Machine, change: &str, right: &str| {
        let error = read("l.svg", LINES, machine, &[change]).unwrap_err();
        let JobError::Document(error) = error else { panic!("{error}") };
        assert!(error.message().contains(right), "{}", error.message());
    };
    let range = "write 20 to 80 kHz, the range of `laser.frequency`";
    refused(&pulsed(&[]), "layers.red.frequency=100 kHz", range);
    refused(&pulsed(&[]), "marking.frequency=19.9 kHz", range);
    refused(
        &machine(&[]),
        "layers.red.frequency=50 kHz",
        "frequency of this machine's pulses cannot be",
    );
}

#[test]
fn only_a_frequency_that_is_set_changes_the_digest() {
    let (plain, pulsed) = (machine(&[]), pulsed(&[]));
    let digest = |machine: &Machine, changes: &[&str]| {
        fired(machine, &read("l.svg", LINES, machine, changes).unwrap()).1
    };
    assert_eq!(digest(&plain, &[]), digest(&pulsed, &[]));
    assert_ne!(digest(&pulsed, &[]), digest(&pulsed, &["marking.frequency=20 kHz"]));
}
