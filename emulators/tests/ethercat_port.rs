//! The EtherCAT port against the emulated line of drives and terminals, in virtual time: it comes to act, moves
//! the motors, opens the gate, and bears frames that are lost, late, doubled or damaged.

use std::sync::{Arc, Mutex, PoisonError};

use drives::ethercat::EthercatPort;
use drives::link::Link as _;
use drives::{Actuation, Freshness, Measurement, PlantOptions, Port, Power};
use emulators::ethercat::faults::Rates;
use emulators::ethercat::{Framing, Layout, Link, Segment};
use machine::{DrivesKind, Machine};
use messages::{CommandMode, GateEdge, LaserCycle, Nanoseconds};

const PERIOD: i64 = 1_000_000;
const LATENCY: i64 = 500_000;
/// Samples of the gate in a cycle.
const SAMPLES: i64 = 100;

struct World {
    link: Link,
    now: Nanoseconds,
}

/// The cable between port and line, whose time is that of the test.
#[derive(Clone)]
struct Cable(Arc<Mutex<World>>);

impl Cable {
    fn with<T>(&self, look: impl FnOnce(&mut World) -> T) -> T {
        look(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn until(&self, at: Nanoseconds) {
        self.with(|world| {
            world.now = world.now.max(at);
            world.link.segment.advance(world.now);
        });
    }

    /// When there was light, in the line's time.
    fn lit(&self) -> Vec<[i64; 2]> {
        self.with(|world| {
            let mut spans = Vec::new();
            let mut since = None;
            for edge in world.link.segment.light() {
                if edge.power > 0.0 {
                    since.get_or_insert(edge.at.0);
                } else if let Some(from) = since.take() {
                    spans.push([from, edge.at.0]);
                }
            }
            spans.extend(since.map(|from| [from, world.now.0]));
            spans
        })
    }
}

impl drives::link::Link for Cable {
    fn send(&mut self, frame: &[u8]) {
        self.with(|world| world.link.send(frame, Framing::Ethernet, world.now));
    }

    fn receive(&mut self, buffer: &mut [u8], until: Nanoseconds) -> Option<usize> {
        self.with(|world| {
            loop {
                if let Some(frame) = world.link.receive(world.now) {
                    let length = frame.len().min(buffer.len());
                    buffer[..length].copy_from_slice(&frame[..length]);
                    return Some(length);
                }
                let next = world.link.next().filter(|next| *next <= until);
                world.now = world.now.max(next.unwrap_or(until));
                world.link.segment.advance(world.now);
                next?;
            }
        })
    }

    fn now(&self) -> Nanoseconds {
        self.with(|world| world.now)
    }
}

/// The built-in machine, whose motors follow targets of `mode` by drives on a bus.
fn machine(mode: &str) -> Machine {
    let mut text = include_str!("../../machines/corexy.toml").to_owned();
    for axis in ["a", "b"] {
        let own = format!("[axis.{axis}]\n");
        text = text.replace(&own, &format!("{own}mode = \"{mode}\"\n"));
    }
    text += "
[drives.ethercat]
udp = \"127.0.0.1:34980\"
gate = { slave = 2, oversampling = 100 }
power = { slave = 3 }

[drives.ethercat.actuators]
a = { slave = 0 }
b = { slave = 1 }
";
    Machine::parse("bus.toml", &text, &[]).expect("the machine")
}

struct Bench {
    machine: Machine,
    cable: Cable,
    port: EthercatPort,
    deadline: Nanoseconds,
    measurement: Measurement,
}

impl Bench {
    fn new(mode: &str, rates: Rates) -> Self {
        Self::on(mode, rates, 0)
    }

    /// The same, with the slaves' clocks drawn by `seed`; 0 for clocks that run right.
    fn on(mode: &str, rates: Rates, seed: u64) -> Self {
        let machine = machine(mode);
        assert!(matches!(machine.drives.kind, DrivesKind::Ethercat(_)));
        let layout = Layout { seed, ..Layout::default() };
        let segment = Segment::new(&machine, &layout, PlantOptions::default()).expect("a line");
        let link = Link::new(segment, rates, 7);
        let cable = Cable(Arc::new(Mutex::new(World { link, now: Nanoseconds(0) })));
        let port = EthercatPort::of(&machine).expect("a port");
        let mut port = port.with_link(Box::new(cable.clone()));
        port.open().expect("an open port");
        drives::port::check(port.profile(), &machine).expect("what the machine file says");
        let deadline = port.first_deadline(cable.now() + Nanoseconds(PERIOD));
        Self { machine, cable, port, deadline, measurement: Measurement::default() }
    }

    /// One cycle; the deadline that it began at.
    fn cycle(&mut self, actuation: &Actuation) -> i64 {
        let at = self.deadline;
        self.cable.until(at);
        self.port.send(actuation);
        self.port.receive(&mut self.measurement);
        self.deadline = Nanoseconds(at.0 + PERIOD);
        at.0
    }

    /// All motors stand at home but the first, which is `angle` [rad] from it.
    fn driven(&self, angle: f64, speed: f64, laser: LaserCycle) -> Actuation {
        let mut actuation = Actuation {
            freshness: Freshness::Fresh,
            mode: CommandMode::Driven,
            laser,
            ..Actuation::DISABLED
        };
        for (row, actuator) in self.machine.actuators.iter().enumerate() {
            let home = self.machine.home_joints[actuator.axis] / actuator.ratio;
            actuation.position[row] = home + if row == 0 { angle } else { 0.0 };
        }
        actuation.velocity[0] = speed;
        actuation
    }

    /// Until the drives follow.
    fn enable(&mut self) {
        for _ in 0..200 {
            self.cycle(&Actuation::DISABLED);
        }
        for _ in 0..200 {
            self.cycle(&self.driven(0.0, 0.0, LaserCycle::OFF));
        }
        assert_eq!(self.measurement.power, Power::On, "{:?}", self.port.link());
        assert!(!self.measurement.fault.is_some(), "{:?}", self.measurement.fault);
    }
}

fn laser(gate: u32, edges: &[(u32, u32)]) -> LaserCycle {
    let mut cycle = LaserCycle { gate, power: 0.5, ..LaserCycle::OFF };
    for (offset, gate) in edges {
        assert!(cycle.push(GateEdge { offset: *offset, gate: *gate, power: 0.5 }));
    }
    cycle
}

#[test]
fn a_motor_follows_its_target() {
    let mut bench = Bench::new("position", Rates::default());
    bench.enable();
    let before = bench.measurement.position[0];
    let rate = core::f64::consts::TAU;
    let mut worst: f64 = 0.0;
    for index in 0..1000_u32 {
        let at = |cycle: f64| 2.0 * (1.0 - messages::math::cos(rate * 1e-3 * cycle));
        bench.cycle(&bench.driven(at(f64::from(index) + 1.0), 0.0, LaserCycle::OFF));
        // What was sent at the deadline before is reached half a period after this one.
        let expected = at(f64::from(index) - 0.5);
        worst = worst.max((bench.measurement.position[0] - before - expected).abs());
    }
    assert_eq!(bench.measurement.power, Power::On);
    // The drive's own loops, without the torque that a planner would have told them.
    assert!(worst < 0.3, "{worst}");
    let link = bench.port.link();
    assert_eq!((link.lost, link.late, link.corrupted), (0, 0, 0), "{link:?}");
}

#[test]
fn an_edge_of_the_gate_is_within_the_resolution_that_the_port_declares() {
    let mut bench = Bench::new("position", Rates::default());
    bench.enable();
    let resolution = bench.port.profile().gate_resolution.0;
    assert_eq!(resolution, PERIOD / SAMPLES);
    let mut asked = Vec::new();
    for index in 0..200_u32 {
        let on = 137_000 + 1_713 * index;
        let at = bench.cycle(&bench.driven(0.0, 0.0, laser(0, &[(on, 1), (on + 300_000, 0)])));
        asked.push([on, on + 300_000].map(|offset| at + LATENCY + i64::from(offset)));
    }
    for _ in 0..3 {
        bench.cycle(&bench.driven(0.0, 0.0, LaserCycle::OFF));
    }
    let lit = bench.cable.lit();
    assert_eq!(lit.len(), asked.len());
    for (lit, asked) in lit.iter().zip(&asked) {
        for (lit, asked) in lit.iter().zip(asked) {
            // Half a sample, and the frame's way along the slaves.
            assert!((lit - asked).abs() <= resolution / 2 + 5_000, "{lit} {asked}");
        }
    }
}

#[test]
fn a_bad_line_costs_no_order_and_lights_nothing_that_was_not_asked() {
    let mut bench = Bench::new("position", Rates::default());
    bench.enable();
    let delay = Nanoseconds(3_000_000);
    let rates = Rates { lost: 0.01, late: 0.01, delay, duplicated: 0.01, corrupted: 0.0 };
    bench.cable.with(|world| world.link.set_rates(rates));
    let mut asked = Vec::new();
    for index in 0..3000_u32 {
        let cycle = if index % 10 < 5 { laser(1, &[]) } else { LaserCycle::OFF };
        let at = bench.cycle(&bench.driven(0.0, 0.0, cycle));
        if index % 10 < 5 {
            asked.push([at + LATENCY, at + LATENCY + PERIOD]);
        }
    }
    assert_eq!(bench.measurement.power, Power::On, "{:?}", bench.measurement.fault);
    for span in bench.cable.lit() {
        let is_asked =
            asked.iter().any(|asked| span[0] >= asked[0] - 10_000 && span[1] <= asked[1] + 10_000);
        assert!(is_asked, "{span:?}");
    }
    let link = bench.port.link();
    assert!(link.lost > 10 && link.late > 5 && link.duplicated > 5, "{link:?}");
}

#[test]
fn a_bridge_that_dies_leaves_the_line_dark() {
    let mut bench = Bench::new("position", Rates::default());
    bench.enable();
    for _ in 0..20 {
        bench.cycle(&bench.driven(0.0, 0.0, laser(1, &[])));
    }
    let died = bench.deadline.0;
    bench.cable.until(Nanoseconds(died + 100 * PERIOD));
    let last = bench.cable.lit().last().map_or(0, |span| span[1]);
    assert!(last <= died + LATENCY + PERIOD, "{last} {died}");
}

#[test]
fn a_clock_that_has_drifted_away_is_a_fault_and_dark() {
    let mut bench = Bench::on("position", Rates::default(), 1);
    bench.enable();
    let mut faulted = None;
    for cycle in 0..60_000_u32 {
        bench.cycle(&bench.driven(0.0, 0.0, laser(1, &[])));
        if bench.measurement.fault.is_some() {
            faulted = Some(cycle);
            break;
        }
    }
    assert!(faulted.is_some_and(|cycle| cycle > 1000), "{faulted:?}: {:?}", bench.port.link());
    let apart = bench.port.link().clock_error_max;
    assert!((200_000..201_000).contains(&apart), "{apart}");
    let at = bench.deadline.0;
    for _ in 0..5 {
        bench.cycle(&bench.driven(0.0, 0.0, laser(1, &[])));
    }
    let last = bench.cable.lit().last().map_or(0, |span| span[1]);
    assert!(last <= at + LATENCY + PERIOD, "{last} {at}");
}
