//! The HostMot2 port against the emulated board, in virtual time: motion, the gate's edges, and what happens
//! when frames are lost, late, doubled or damaged, when the cable is cut and when a side dies.

mod board;

use board::{BoardCable, OnBoard};
use drives::hostmot2::session::{Counters, Trouble};
use drives::hostmot2::{Config, Connection, Hostmot2Port};
use drives::{Actuation, Port};
use emulators::cable::Bench;
use emulators::hostmot2::Faults;
use machine::Machine;
use messages::{GateEdge, LaserCycle, Nanoseconds};

const PERIOD: i64 = 1_000_000;
const LATENCY: i64 = 400_000;
const FLIGHT: i64 = board::FLIGHT.0;

fn machine() -> Machine {
    let mut machine = board::shipped("cartesian_steppers", &[]);
    machine.drives.gate_latency = Nanoseconds(LATENCY);
    machine
}

fn config(machine: &Machine) -> Config {
    let stepgen =
        |index| (Connection::Stepgen { stepgen: index, encoder: Some(index) }, Nanoseconds(0));
    Config {
        address: "emulated".to_owned(),
        watchdog: Nanoseconds(5_000_000),
        gate: vec![0, 1, 2, 3],
        gate_latency: Nanoseconds(LATENCY),
        power: Some(0),
        actuators: (0..machine.actuators.len() as u32).map(stepgen).collect(),
        inputs: Vec::new(),
        outputs: Vec::new(),
    }
}

/// The bench of these tests: a port with a configuration of its own on a board with these faults.
fn bench(faults: &Faults) -> OnBoard {
    let machine = machine();
    let cable = board::cable(&machine, faults);
    let port = Hostmot2Port::new(&machine, config(&machine)).expect("a port");
    let port = port.with_link(Box::new(cable.clone()));
    Bench::open(machine, cable, port).expect("an open port")
}

/// The angle from home [rad] and speed [rad/s] at the end of the cycle `index`: a slow swing.
fn swing(index: u32) -> [f64; 2] {
    let (turn, rate) = (2.0, core::f64::consts::TAU * 2.0);
    let at = rate * 1e-3 * f64::from(index + 1);
    [turn * (1.0 - messages::math::cos(at)), turn * rate * messages::math::sin(at)]
}

/// How far the first motor was measured from home [rad].
fn turned(bench: &OnBoard) -> f64 {
    bench.measurement.position[0] - bench.home(0)
}

/// `cycles` at home in the dark: the port learns when its requests arrive.
fn idle(bench: &mut OnBoard, cycles: u32) {
    let standing = bench.driven(0.0, 0.0, LaserCycle::OFF);
    bench.cycles(&standing, cycles);
}

/// `cycles` of the swing, with the light that `laser` has in each; what was asked to be lit.
fn run(bench: &mut OnBoard, cycles: u32, laser: impl Fn(u32) -> LaserCycle) -> Vec<[i64; 2]> {
    let mut asked = Vec::new();
    for index in 0..cycles {
        let [angle, speed] = swing(index);
        let laser = laser(index);
        let actuation = bench.driven(angle, speed, laser);
        let at = bench.cycle(&actuation);
        let (mut since, mut gate) = (0, laser.gate);
        let end = GateEdge { offset: PERIOD as u32, gate: 0, power: 0.0 };
        for edge in laser.edges().iter().chain([&end]) {
            let offset = i64::from(edge.offset);
            if gate != 0 && offset > since {
                asked.push([since, offset].map(|time| at + FLIGHT + LATENCY + time));
            }
            (since, gate) = (offset, edge.gate);
        }
    }
    merged(asked)
}

/// Spans that meet are one.
fn merged(spans: Vec<[i64; 2]>) -> Vec<[i64; 2]> {
    let mut merged: Vec<[i64; 2]> = Vec::new();
    for span in spans {
        match merged.last_mut() {
            Some(last) if last[1] == span[0] => last[1] = span[1],
            _ => merged.push(span),
        }
    }
    merged
}

/// Two pulses in two of three cycles, the second of them into the third cycle.
fn strokes(index: u32) -> LaserCycle {
    let mut laser = LaserCycle::OFF;
    let edges: &[(u32, u32)] = match index % 3 {
        0 => &[(1230, 1), (345_670, 0)],
        1 => &[(20, 2), (100_000, 0), (777_770, 3)],
        _ => {
            laser.gate = 3;
            laser.power = 0.5;
            &[(654_320, 0)]
        }
    };
    for &(offset, gate) in edges {
        assert!(laser.push(GateEdge { offset, gate, power: if gate == 0 { 0.0 } else { 0.5 } }));
    }
    laser
}

#[test]
fn the_steps_are_where_they_are_asked_to_be() {
    let mut bench = bench(&Faults::default());
    let per_radian = bench.machine.actuators[0].encoder.counts / core::f64::consts::TAU;
    let (mut worst, mut measured) = (0.0_f64, 0.0_f64);
    for index in 0..600 {
        let [angle, speed] = swing(index);
        let before = if index == 0 { 0.0 } else { swing(index - 1)[0] };
        let actuation = bench.driven(angle, speed, LaserCycle::OFF);
        bench.cycle(&actuation);
        // The request arrived a flight after the deadline, where the path was.
        let position = turned(&bench);
        measured = measured.max((position - before).abs());
        // The next one leaves at its deadline. Until it arrives the rate stays.
        bench.cable.go_to(bench.deadline);
        let arrived = bench.cable.delivered() + bench.cable.speed() * 1e-9 * FLIGHT as f64;
        worst = worst.max((arrived - angle * per_radian).abs());
    }
    assert!(worst < 0.005, "{worst} steps off at an arrival");
    // By encoder: the rotor is on its spring behind the steps.
    assert!(measured < 0.05, "{measured} rad measured");
    assert_eq!(bench.port.counters(), Counters { sent: 600, ..Counters::default() });
}

#[test]
fn missed_deadlines_are_gone_through_at_the_speed_before() {
    let mut bench = bench(&Faults::default());
    let per_radian = bench.machine.actuators[0].encoder.counts / core::f64::consts::TAU;
    let (mut off, mut fastest) = (0.0, 0.0_f64);
    for index in 0..600 {
        // Three are missed every now and then, the last of them two cycles before the end.
        if index % 50 > 46 {
            let standing = bench.driven(0.0, 0.0, LaserCycle::OFF);
            bench.pass(&standing);
            continue;
        }
        let [angle, speed] = swing(index);
        let actuation = bench.driven(angle, speed, LaserCycle::OFF);
        bench.cycle(&actuation);
        bench.cable.go_to(bench.deadline);
        fastest = fastest.max(bench.cable.speed().abs());
        let arrived = bench.cable.delivered() + bench.cable.speed() * 1e-9 * FLIGHT as f64;
        if index % 50 > 0 {
            off = f64::max(off, (arrived - angle * per_radian).abs());
        }
    }
    // ±2 rad at 2 Hz are 12,800 steps a second; what is made up for is the turn of the path within 3 ms.
    assert!(off < 0.005 && fastest < 14_000.0, "{off} steps off, {fastest} steps/s");
}

#[test]
fn edges_fall_within_the_resolution_and_light_goes_on_through_cycles() {
    let mut bench = bench(&Faults::default());
    idle(&mut bench, 70);
    let asked = run(&mut bench, 300, strokes);
    idle(&mut bench, 70);
    let lit = bench.cable.lit();
    assert_eq!(lit.len(), asked.len());
    let most = bench.port.profile().gate_resolution.0 / 2;
    for (lit, asked) in lit.iter().zip(&asked) {
        for (lit, asked) in lit.iter().zip(asked) {
            assert!((lit - asked).abs() <= most, "{lit} ns instead of {asked}");
        }
    }
}

#[test]
fn what_is_measured_of_the_light_is_what_was_lit() {
    let mut bench = bench(&Faults::default());
    idle(&mut bench, 70);
    let mut laser = LaserCycle::OFF;
    assert!(laser.push(GateEdge { offset: 100_000, gate: 7, power: 0.5 }));
    assert!(laser.push(GateEdge { offset: 900_000, gate: 0, power: 0.0 }));
    let actuation = bench.driven(0.0, 0.0, laser);
    bench.cycle(&actuation);
    let actuation = bench.driven(0.0, 0.0, LaserCycle::OFF);
    bench.cycle(&actuation);
    let edges = bench.measurement.laser.edges().to_vec();
    assert_eq!(edges, [GateEdge { offset: 500_000, gate: 7, power: 0.5 }]);
    let actuation = bench.driven(0.0, 0.0, LaserCycle::OFF);
    bench.cycle(&actuation);
    assert_eq!(bench.measurement.laser.gate, 7);
    let edges = bench.measurement.laser.edges().to_vec();
    assert_eq!(edges, [GateEdge { offset: 300_000, gate: 0, power: 0.0 }]);
}

#[test]
fn lost_late_doubled_and_damaged_frames_give_no_wrong_light() {
    for seed in 1..=5 {
        let faults = Faults {
            loss: 0.01,
            late: 0.01,
            duplicate: 0.01,
            corrupt: 0.01,
            seed,
            ..Faults::default()
        };
        let mut bench = bench(&faults);
        idle(&mut bench, 70);
        let asked = run(&mut bench, 3000, strokes);
        let [angle, _] = swing(2999);
        for _ in 0..50 {
            let actuation = bench.driven(angle, 0.0, LaserCycle::OFF);
            bench.cycle(&actuation);
        }
        for [from, to] in bench.cable.lit() {
            let inside = asked.iter().any(|asked| from + 600 >= asked[0] && to <= asked[1] + 600);
            assert!(inside, "seed {seed}: light from {from} to {to} ns was not asked for");
        }
        let lit: i64 = bench.cable.lit().iter().map(|[from, to]| to - from).sum();
        let wanted: i64 = asked.iter().map(|[from, to]| to - from).sum();
        assert!(lit * 10 > wanted * 9, "seed {seed}: {lit} of {wanted} ns were lit");
        let Counters { sent, lost, late, duplicated, .. } = bench.port.counters();
        assert_eq!(sent, 3120);
        assert!(lost > 60 && late > 20 && duplicated > 10, "seed {seed}");
        assert!(!bench.measurement.fault.is_some(), "seed {seed}: {:?}", bench.measurement.fault);
        let position = turned(&bench);
        assert!((position - angle).abs() < 0.02, "seed {seed}: {position} instead of {angle} rad");
        assert!(bench.cable.bites().is_empty());
    }
}

#[test]
fn a_bridge_that_dies_leaves_it_dark_and_the_watchdog_lets_the_axes_go() {
    let mut bench = bench(&Faults::default());
    idle(&mut bench, 70);
    run(&mut bench, 50, |_| LaserCycle { gate: 1, power: 1.0, ..LaserCycle::OFF });
    let last = bench.deadline.0;
    bench.cable.go_to(Nanoseconds(last + 100 * PERIOD));
    let end = bench.cable.lit().last().map_or(0, |span| span[1]);
    assert!((end - (last + FLIGHT + LATENCY)).abs() <= 1000, "{end} ns, {last} ns");
    let bites = bench.cable.bites();
    assert_eq!(bites.len(), 1);
    assert!((bites[0].0 - (last - PERIOD + FLIGHT + 5_000_000)).abs() < 1000, "{bites:?}");
    let stopped = bench.cable.delivered();
    bench.cable.go_to(Nanoseconds(last + 200 * PERIOD));
    assert_eq!(bench.cable.delivered(), stopped);
}

#[test]
fn a_cut_cable_and_a_silent_board_are_a_fault_and_dark() {
    let at = Nanoseconds(2_000_000_000);
    let cut = Faults { cut: Some([at, Nanoseconds(at.0 + 50 * PERIOD)]), ..Faults::default() };
    let silent = Faults { silent_from: Some(at), ..Faults::default() };
    for (faults, returns) in [(cut, true), (silent, false)] {
        let mut bench = bench(&faults);
        let cycles = (at.0 - bench.deadline.0) / PERIOD + 20;
        run(&mut bench, cycles as u32, strokes);
        assert_eq!(bench.port.trouble(), Some(Trouble::Silent));
        assert!(bench.measurement.fault.is_some());
        let end = bench.cable.lit().last().map_or(0, |span| span[1]);
        assert!(end <= at.0 + PERIOD + LATENCY + FLIGHT, "{end}: light after the cut");
        assert_eq!(bench.cable.bites().len(), 1);
        run(&mut bench, 100, |_| LaserCycle::OFF);
        // The same fault until a person resets it, and then the board's own where it answers again.
        assert!(bench.measurement.fault.is_some());
        for _ in 0..5 {
            bench.cycle(&Actuation::DISABLED);
        }
        run(&mut bench, 20, |_| LaserCycle::OFF);
        assert_eq!(bench.measurement.fault.is_some(), !returns);
    }
}

#[test]
fn a_module_that_the_board_lacks_is_named() {
    let mut bench = bench(&Faults::default());
    let mut wrong = config(&bench.machine);
    wrong.actuators[0].0 = Connection::Stepgen { stepgen: 9, encoder: None };
    let port = Hostmot2Port::new(&bench.machine, wrong).expect("a port");
    let error = port.with_link(Box::new(bench.cable.clone())).open();
    let text = error.map_or_else(|error| error.to_string(), |()| String::new());
    assert!(text.contains("stepgen 0 to 5") && text.contains("stepgen 9"), "{text}");
    bench.port.close().expect("closed");
}
