//! A cycle of a port to hardware takes nothing from the heap, whatever happens on its cable. What the emulated
//! hardware takes on the other end is not counted.

mod board;
mod line;

use std::cell::Cell;

use drives::ethercat::EthercatPort;
use drives::hostmot2::Hostmot2Port;
use drives::link::Link;
use drives::{Actuation, PlantOptions, Port, Power};
use emulators::cable::{Bench, Cable, Hardware};
use emulators::ethercat::faults::Rates;
use emulators::ethercat::{self, Layout, Segment};
use emulators::hostmot2::Faults;
use messages::{CommandMode, LaserCycle, Nanoseconds};
use runtime::allocation::{Allocations, CountingAllocator};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

thread_local! {
    /// Blocks that the far end of the cable has taken and given back.
    static ABROAD: Cell<u64> = const { Cell::new(0) };
}

fn abroad<T>(work: impl FnOnce() -> T) -> T {
    let (result, spent) = Allocations::during(work);
    ABROAD.set(ABROAD.get() + spent.allocations + spent.releases);
    result
}

/// A link whose far end is not counted.
struct Uncounted<L>(L);

impl<L: Link> Link for Uncounted<L> {
    fn send(&mut self, datagram: &[u8]) {
        abroad(|| self.0.send(datagram));
    }

    fn receive(&mut self, buffer: &mut [u8], until: Nanoseconds) -> Option<usize> {
        abroad(|| self.0.receive(buffer, until))
    }

    fn now(&self) -> Nanoseconds {
        abroad(|| self.0.now())
    }
}

/// How many cycles followed, how many had a fault, and whether anything was counted at all.
#[derive(Debug, Default)]
struct Seen {
    followed: u32,
    faults: u32,
    /// Blocks that the far end took and gave back.
    abroad: u64,
}

/// Asserts that `cycles` of `actuation` take nothing from the heap on this side of the cable.
fn exchange<P: Port, H: Hardware>(
    bench: &mut Bench<P, H>,
    actuation: &Actuation,
    cycles: u32,
    seen: &mut Seen,
) {
    for _ in 0..cycles {
        bench.cable.go_to(bench.deadline);
        let before = ABROAD.get();
        let ((), spent) = Allocations::during(|| {
            bench.port.send(actuation);
            bench.port.receive(&mut bench.measurement);
        });
        let abroad = ABROAD.get() - before;
        seen.abroad += abroad;
        assert_eq!(spent.allocations + spent.releases, abroad, "{actuation:?}");
        bench.deadline = bench.deadline + bench.machine.realtime.period.time();
        seen.followed += u32::from(bench.measurement.power == Power::On);
        seen.faults += u32::from(bench.measurement.fault.is_some());
    }
}

#[test]
fn a_cycle_of_the_bus_does_not_allocate() {
    let machine = line::gantry("position");
    let layout = Layout { seed: 0, ..Layout::default() };
    let segment = Segment::new(&machine, &layout, PlantOptions::default()).expect("a line");
    let cable = Cable::new(ethercat::Link::new(segment, Rates::default(), 7));
    let port = EthercatPort::of(&machine).expect("a port");
    let port = port.with_link(Box::new(Uncounted(cable.clone())));
    let mut bench = Bench::open(machine, cable.clone(), port).expect("an open port");
    let lit = LaserCycle { gate: 1, power: 0.5, ..LaserCycle::OFF };
    let standing = bench.driven(0.0, 0.0, lit);
    let wrong = Actuation { position: [f64::NAN; messages::MAX_ACTUATORS], ..standing };
    let braked = Actuation { mode: CommandMode::QuickStop, ..standing };
    let delay = Nanoseconds(3_000_000);
    let bad = Rates { lost: 0.05, late: 0.05, delay, duplicated: 0.05, corrupted: 0.05 };
    let stages = [
        (Actuation::DISABLED, 100, Rates::default(), 10),
        (standing, 200, Rates::default(), 10),
        (standing, 500, bad, 10),
        (wrong, 20, Rates::default(), 10),
        (Actuation::DISABLED, 100, Rates::default(), 10),
        (standing, 100, Rates::default(), 10),
        (braked, 100, Rates::default(), 10),
        (standing, 50, Rates::default(), 3),
        (standing, 50, Rates::default(), 0),
        (Actuation::DISABLED, 600, Rates::default(), 10),
    ];
    let mut seen = Seen::default();
    for (actuation, cycles, rates, reached) in stages {
        cable.with(|link, now| {
            link.set_rates(rates);
            link.segment.cut(reached, now);
        });
        exchange(&mut bench, &actuation, cycles, &mut seen);
    }
    assert!(seen.followed > 300 && seen.faults > 40 && seen.abroad > 1000, "{seen:?}");
}

#[test]
fn a_cycle_of_the_board_does_not_allocate() {
    let machine = board::shipped("hostmot2_steppers", &[]);
    // The cable is cut for a while after two seconds.
    let cut = [2_000_000_000, 2_050_000_000].map(Nanoseconds);
    let faults = Faults {
        loss: 0.02,
        late: 0.02,
        duplicate: 0.02,
        corrupt: 0.02,
        cut: Some(cut),
        ..Faults::default()
    };
    let cable = board::cable(&machine, &faults);
    let port = Hostmot2Port::of(&machine).expect("a port");
    let port = port.with_link(Box::new(Uncounted(cable.clone())));
    let mut bench = Bench::open(machine, cable, port).expect("an open port");
    let lit = LaserCycle { gate: 1, power: 0.5, ..LaserCycle::OFF };
    let standing = bench.driven(0.0, 0.0, lit);
    let wrong = Actuation { position: [f64::NAN; messages::MAX_ACTUATORS], ..standing };
    let braked = Actuation { mode: CommandMode::QuickStop, ..standing };
    let mut seen = Seen::default();
    for (actuation, cycles) in [
        (Actuation::DISABLED, 100),
        (standing, 700),
        (wrong, 20),
        (Actuation::DISABLED, 100),
        (standing, 300),
        (braked, 100),
        (standing, 900),
        (Actuation::DISABLED, 200),
    ] {
        exchange(&mut bench, &actuation, cycles, &mut seen);
    }
    assert!(bench.deadline > cut[1], "the cable was cut");
    assert!(seen.followed > 1000 && seen.faults > 20 && seen.abroad > 1000, "{seen:?}");
}
