//! Prints how long one cycle of the plant takes: `cargo run --release -p drives --example
//! cycle_time`.

#![allow(clippy::print_stdout, reason = "an example for people")]

use std::time::Instant;

use drives::plant::PlantError;
use drives::{Actuation, Freshness, Measurement, PlantOptions, SimulatedPlant};
use machine::Machine;
use messages::{CommandMode, axis::actuator_array};

fn main() -> Result<(), PlantError> {
    let mut port = SimulatedPlant::new(&Machine::builtin(), PlantOptions::default())?;
    let mut measurement = Measurement::default();
    for round in 0..5 {
        let cycles = 20_000_u32;
        let start = Instant::now();
        for index in 0..cycles {
            let volts = if index % 100 < 50 { 5.0 } else { -5.0 };
            let actuation = Actuation {
                freshness: Freshness::Fresh,
                mode: CommandMode::Driven,
                voltage: actuator_array(&[volts, 0.5 * volts]),
                ..Actuation::DISABLED
            };
            port.exchange(&actuation, &mut measurement);
        }
        let each = start.elapsed().as_secs_f64() / f64::from(cycles);
        println!("round {round}: {:.3} µs a cycle, tool at {:?}", each * 1e6, measurement.tool);
    }
    Ok(())
}
