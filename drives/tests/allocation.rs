//! A cycle of the bridge and the plant takes nothing from the heap, in any of its states.
#![allow(clippy::unwrap_used)]

use drives::{Bridge, BridgeOptions, PlantOptions, SimulatedPlant};
use machine::Machine;
use runtime::allocation::{Allocations, CountingAllocator};
use signals::{Command, CommandMode, LaserCycle, Nanoseconds, RealtimeFacts, axis::axis_array};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn a_cycle_does_not_allocate() {
    let (port, built) =
        Allocations::during(|| SimulatedPlant::new(&Machine::builtin(), PlantOptions::default()));
    assert!(built.allocations > 0, "the counting allocator does not count");
    let mut bridge = Bridge::new(port.unwrap(), BridgeOptions::default());
    let ((), cycles) = Allocations::during(|| {
        for index in 0..2000_i64 {
            let deadline = Nanoseconds(1_000_000 * (index + 1));
            bridge.begin(deadline, deadline);
            let feedback = *bridge.stamp(deadline + Nanoseconds(3000));
            let mode = match index {
                0..10 => CommandMode::Disabled,
                10..900 => CommandMode::Voltage,
                // A mode that the plant refuses, with all that follows.
                _ => CommandMode::Position,
            };
            let volts = if index % 200 < 100 { 5.0 } else { -5.0 };
            let command = Command {
                epoch: feedback.epoch,
                cycle: feedback.cycle,
                mode: mode as u32,
                voltage: axis_array(&[volts, 0.4 * volts]),
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
        }
    });
    assert_eq!(cycles, Allocations::default());
    assert_eq!(bridge.report(RealtimeFacts::default()).stops, 1);
}
