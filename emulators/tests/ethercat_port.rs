//! The EtherCAT port against the emulated line of drives and terminals, in virtual time: it comes to act, moves
//! the motors, opens the gate, and bears frames that are lost, late, doubled or damaged.

mod line;

use drives::discipline::Discipline;
use drives::{Actuation, Port as _, Power};
use emulators::ethercat::faults::Rates;
use line::Line;
use messages::{GateEdge, LaserCycle, Nanoseconds};

const PERIOD: i64 = 1_000_000;
const LATENCY: i64 = 500_000;
/// Samples of the gate in a cycle.
const SAMPLES: i64 = 100;

fn line(seed: u64) -> Line {
    line::open(line::corexy("position"), Rates::default(), seed)
}

/// A line whose drives follow.
fn enabled(seed: u64) -> Line {
    let mut line = line(seed);
    line.cycles(&Actuation::DISABLED, 200);
    let standing = line.driven(0.0, 0.0, LaserCycle::OFF);
    line.cycles(&standing, 200);
    assert_eq!(line.measurement.power, Power::On, "{:?}", line.port.link());
    assert!(!line.measurement.fault.is_some(), "{:?}", line.measurement.fault);
    line
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
    let mut bench = enabled(0);
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
fn the_port_is_held_to_the_age_of_its_measurements() {
    let bench = line(0);
    let profile = bench.port.profile();
    assert!(profile.actuators.iter().all(|it| it.age == Nanoseconds(PERIOD - LATENCY)));
    let mut machine = bench.machine.clone();
    machine.actuators[1].age = Nanoseconds(0);
    let error = drives::port::check(profile, &machine).expect_err("another age");
    assert_eq!(
        error.to_string(),
        "the actuator `b` is measured 500 us before its deadline; the controller counts on 0 us"
    );
}

#[test]
fn an_edge_of_the_gate_is_within_the_resolution_that_the_port_declares() {
    let mut bench = enabled(0);
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
    let mut bench = enabled(0);
    let delay = Nanoseconds(3_000_000);
    let rates = Rates { lost: 0.01, late: 0.01, delay, duplicated: 0.01, corrupted: 0.0 };
    bench.cable.with(|link, _| link.set_rates(rates));
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
    let mut bench = enabled(0);
    for _ in 0..20 {
        bench.cycle(&bench.driven(0.0, 0.0, laser(1, &[])));
    }
    let died = bench.deadline.0;
    bench.cable.go_to(Nanoseconds(died + 100 * PERIOD));
    let last = bench.cable.lit().last().map_or(0, |span| span[1]);
    assert!(last <= died + LATENCY + PERIOD, "{last} {died}");
}

#[test]
fn a_clock_that_drifts_is_followed() {
    let mut bench = enabled(1);
    let mut discipline = Discipline::new(bench.machine.realtime.period);
    let mut left = Nanoseconds(0);
    for cycle in 0..30_000_u32 {
        bench.cycle(&bench.driven(0.0, 0.0, laser(1, &[])));
        let fault = bench.measurement.fault;
        assert!(!fault.is_some(), "{fault:?} in cycle {cycle}");
        let ahead = bench.measurement.clock_offset.expect("an answer in each cycle");
        bench.moved(discipline.follow(ahead));
        left = ahead;
    }
    // It drifts by 20 ppm at most, alone for the 400 cycles until the drives follow.
    let apart = bench.port.link().clock_error_max;
    assert!(apart < 20_000 && left.0.abs() < 500, "{apart} ns, {left:?} at the end");
}

#[test]
fn a_clock_that_has_drifted_away_is_a_fault_and_dark() {
    let mut bench = enabled(1);
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
