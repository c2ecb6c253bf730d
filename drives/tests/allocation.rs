//! A cycle of the bridge and the plant takes nothing from the heap, in any of its states, on any
//! machine.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use drives::{Bridge, BridgeOptions, Deadlines, PlantOptions, SimulatedPlant};
use machine::Machine;
use messages::{
    Command, CommandMode, LaserCycle, Nanoseconds, RealtimeFacts, axis::actuator_array,
};
use runtime::allocation::{Allocations, CountingAllocator};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn machine_files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../machines");
    let entries = folder.read_dir().unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|kind| kind == "toml")).collect()
}

/// Runs the bridge of `machine` to and fro about home, with commands missed and cycles skipped now and
/// then, and at the end with a voltage that is not a number, which stops the axes.
fn assert_allocates_nothing(name: &str, machine: &Machine) {
    let (port, built) =
        Allocations::during(|| SimulatedPlant::new(machine, PlantOptions::default()));
    assert!(built.allocations > 0, "the counting allocator does not count");
    let options =
        BridgeOptions { epoch: 1, deadlines: Deadlines::Strict, timing: machine.realtime };
    let mut bridge = Bridge::new(port.unwrap(), options);
    let mut home = None;
    let mut moved = 0.0_f64;
    let ((), cycles) = Allocations::during(|| {
        let mut skipped = 0;
        for index in 0..1000_i64 {
            skipped += if index % 200 == 150 { 4 } else { 0 };
            let deadline = Nanoseconds(1_000_000 * (index + skipped + 1));
            bridge.begin(deadline, deadline);
            let feedback = *bridge.stamp(deadline + Nanoseconds(3000));
            let home = *home.get_or_insert(feedback.position);
            moved = moved.max((feedback.position[0] - home[0]).abs());
            let mode = match index {
                0..10 => CommandMode::Disabled,
                _ => CommandMode::Driven,
            };
            let side = if index % 20 < 10 { 1.0 } else { -1.0 };
            let volts = if index < 900 { side } else { f64::NAN };
            let command = Command {
                epoch: feedback.epoch,
                cycle: feedback.cycle,
                mode: mode as u32,
                voltage: actuator_array(&[volts, 0.4 * side]),
                position: home.map(|angle| angle + 0.02 * side),
                laser: LaserCycle { gate: 1, power: 1.0, ..LaserCycle::OFF },
                ..Command::default()
            };
            if index % 300 == 299 {
                bridge.miss();
            } else {
                bridge.latch(&command, deadline + Nanoseconds(20_000));
            }
            bridge.finish(deadline + Nanoseconds(21_000));
            bridge.report(RealtimeFacts::default());
            bridge.take_stall();
        }
    });
    assert_eq!(cycles, Allocations::default(), "{name}");
    assert!(moved > 0.01, "{name}: moved by {moved} rad");
    assert_eq!(bridge.report(RealtimeFacts::default()).stops, 1, "{name}");
}

#[test]
fn a_cycle_does_not_allocate() {
    assert_allocates_nothing("built in", &Machine::builtin());
    for file in machine_files() {
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        let mut machine = Machine::load(&file, &[]).unwrap();
        assert_allocates_nothing(&name, &machine);
        // A gap needs a spring to lie behind.
        if ["cartesian", "corexy", "mcm"].contains(&name.as_str()) {
            for axis in &mut machine.axes {
                axis.backlash = 20e-6;
            }
            assert_allocates_nothing(&format!("{name} with backlash"), &machine);
        }
    }
}
