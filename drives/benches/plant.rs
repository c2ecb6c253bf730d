//! One cycle of 1 ms of the simulated plant, integrated at 20 kHz or as finely as it needs, for every
//! machine file: `cargo bench -p drives --bench plant -- --quick`.

// A benchmark stops where a test would.
#![allow(missing_docs, clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use drives::{Actuation, Freshness, Measurement, PlantOptions, SimulatedPlant};
use machine::Machine;
use messages::{CommandMode, MAX_AXES, axis::actuator_array};

fn machine_files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../machines");
    let entries = folder.read_dir().unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> =
        entries.filter(|path| path.extension().is_some_and(|kind| kind == "toml")).collect();
    files.sort();
    files
}

/// Cycles after which a plant starts anew from home: open-loop axes would drift away.
const ROUND: u64 = 100;

fn cycles(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("plant, one cycle of 1 ms");
    for file in machine_files() {
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        let machine = Machine::load(&file, &[]).unwrap();
        let mut measurement = Measurement::default();
        group.bench_function(name, |bencher| {
            bencher.iter_custom(|cycles| {
                let mut spent = Duration::ZERO;
                let mut left = cycles;
                while left > 0 {
                    let mut port = SimulatedPlant::new(&machine, PlantOptions::default()).unwrap();
                    port.exchange(&Actuation::DISABLED, &mut measurement);
                    let home = measurement.position;
                    let start = Instant::now();
                    for cycle in 0..left.min(ROUND) {
                        // To and fro, half a volt or a fiftieth of a radian.
                        let side = if cycle % 20 < 10 { 1.0 } else { -1.0 };
                        let actuation = Actuation {
                            freshness: Freshness::Fresh,
                            mode: CommandMode::Driven,
                            voltage: actuator_array(&[0.5 * side; MAX_AXES]),
                            position: home.map(|angle| angle + 0.02 * side),
                            ..Actuation::DISABLED
                        };
                        port.exchange(&actuation, &mut measurement);
                    }
                    spent += start.elapsed();
                    left -= left.min(ROUND);
                }
                spent
            });
        });
    }
    group.finish();
}

criterion_group!(benches, cycles);
criterion_main!(benches);
