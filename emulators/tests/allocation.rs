//! A cycle of a port to hardware takes nothing from the heap, whatever happens on its cable. What the emulated
//! hardware takes on the other end is not counted.

mod line;

use std::sync::atomic::{AtomicU64, Ordering};

use drives::ethercat::EthercatPort;
use drives::link::Link;
use drives::{Actuation, PlantOptions, Power};
use emulators::cable::{Bench, Cable};
use emulators::ethercat::faults::Rates;
use emulators::ethercat::{self, Layout, Segment};
use messages::{CommandMode, LaserCycle, Nanoseconds};
use runtime::allocation::{Allocations, CountingAllocator};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Blocks that the far end of the cable has taken and given back.
static ABROAD: AtomicU64 = AtomicU64::new(0);

fn abroad<T>(work: impl FnOnce() -> T) -> T {
    let (result, spent) = Allocations::during(work);
    ABROAD.fetch_add(spent.allocations + spent.releases, Ordering::Relaxed);
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
    let (mut followed, mut faults) = (0, 0);
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
    for (actuation, cycles, rates, reached) in stages {
        cable.with(|link, now| {
            link.set_rates(rates);
            link.segment.cut(reached, now);
        });
        for _ in 0..cycles {
            cable.go_to(bench.deadline);
            let before = ABROAD.load(Ordering::Relaxed);
            let ((), spent) = Allocations::during(|| {
                drives::Port::send(&mut bench.port, &actuation);
                drives::Port::receive(&mut bench.port, &mut bench.measurement);
            });
            let abroad = ABROAD.load(Ordering::Relaxed) - before;
            assert!(abroad > 0, "the counting allocator does not count");
            assert_eq!(spent.allocations + spent.releases, abroad, "{actuation:?}");
            bench.deadline = bench.deadline + Nanoseconds(1_000_000);
            followed += u32::from(bench.measurement.power == Power::On);
            faults += u32::from(bench.measurement.fault.is_some());
        }
    }
    assert!(followed > 300 && faults > 40, "{followed} cycles followed, {faults} with a fault");
}
