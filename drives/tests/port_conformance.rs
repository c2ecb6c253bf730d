//! What every port must do, whatever stands behind it: the contract of [`drives::port`] as tests.
//! A new port adds itself to [`subjects`].
#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stdout, reason = "the report of a failing test")]

use drives::{Actuation, Freshness, Measurement, PlantOptions, Port, Power, SimulatedPlant};
use machine::transmission::{Elasticity, screw::at_nut};
use machine::{Cartesian, Machine, MechanismKind};
use messages::laser::{GateEdge, MAX_EDGES};
use messages::time::SETPOINT_PERIOD as CYCLE_PERIOD;
use messages::{CommandMode, FaultCode, LaserCycle, MAX_ACTUATORS};

/// A port under test, with what its machine can bear.
struct Subject {
    name: &'static str,
    port: Box<dyn Port>,
    /// A voltage that moves every axis from rest [V].
    voltage: f64,
    /// Cycles in which its brake stops any motion that the tests cause.
    stopping: usize,
}

fn rigid() -> Machine {
    let mut machine = Machine::builtin();
    if let MechanismKind::CoreXy(corexy) = &mut machine.mechanism {
        corexy.elasticity = None;
    }
    machine
}

fn cartesian() -> Machine {
    let mut machine = Machine::builtin();
    let lead = 0.015 / core::f64::consts::TAU;
    let mass = [1.93, 0.33];
    machine.mechanism = MechanismKind::Cartesian(Cartesian {
        elasticity: Some(mass.map(|mass| Elasticity::damped(at_nut(600.0, lead), mass, 0.9))),
        ..Cartesian::rigid(mass)
    });
    for actuator in &mut machine.actuators {
        actuator.ratio = lead / 3.0;
        actuator.motor.dc_mut().unwrap().rotor_inertia = 2e-6 + 6.468e-6 / 9.0;
        actuator.gains.inertia = 3.94e-6;
    }
    machine
}

fn subjects() -> Vec<Subject> {
    [
        ("plant of elastic belts", Machine::builtin()),
        ("plant of rigid belts", rigid()),
        ("plant of screws", cartesian()),
    ]
    .into_iter()
    .map(|(name, machine)| Subject {
        name,
        port: SimulatedPlant::new(&machine, PlantOptions::default()).unwrap(),
        voltage: 6.0,
        stopping: 300,
    })
    .collect()
}

fn check(test: impl Fn(&mut Subject)) {
    for mut subject in subjects() {
        println!("{}", subject.name);
        test(&mut subject);
    }
}

impl Subject {
    fn exchange(&mut self, actuation: &Actuation) -> Measurement {
        let mut measurement = Measurement::default();
        self.port.exchange(actuation, &mut measurement);
        measurement
    }

    fn driving(&self) -> Actuation {
        let mut voltage = [0.0; MAX_ACTUATORS];
        voltage[..self.port.profile().actuators.len()].fill(self.voltage);
        Actuation {
            freshness: Freshness::Fresh,
            mode: CommandMode::Driven,
            voltage,
            ..Actuation::DISABLED
        }
    }

    fn run(&mut self, actuation: &Actuation, cycles: usize) -> Measurement {
        (0..cycles).map(|_| self.exchange(actuation)).last().unwrap()
    }
}

/// A cycle with the edges at `offsets`, opening and closing in turn.
fn pattern(gate: u32, offsets: &[u32]) -> LaserCycle {
    let mut cycle =
        LaserCycle { gate, power: if gate == 0 { 0.0 } else { 0.7 }, ..LaserCycle::OFF };
    let mut open = gate != 0;
    for offset in offsets {
        open = !open;
        let (gate, power) = if open { (5, 0.7) } else { (0, 0.0) };
        assert!(cycle.push(GateEdge { offset: *offset, gate, power }));
    }
    cycle
}

#[test]
fn the_first_measurement_is_unpowered_dark_and_at_zero_counts() {
    check(|subject| {
        assert!((1..=MAX_ACTUATORS).contains(&subject.port.profile().actuators.len()));
        assert!(subject.port.profile().gate_resolution.0 >= 1);
        let measurement = subject.exchange(&Actuation::DISABLED);
        assert_eq!(measurement.power, Power::Off);
        assert_eq!(measurement.counts, [0; MAX_ACTUATORS]);
        assert_eq!(measurement.current, [0.0; MAX_ACTUATORS]);
        assert!(!measurement.laser.is_lit() && !measurement.fault.is_some());
    });
}

#[test]
fn the_laser_fires_in_the_cycle_it_is_asked_for_and_is_told_after_it() {
    check(|subject| {
        let lit = Actuation { laser: pattern(5, &[]), ..subject.driving() };
        let dark = subject.driving();
        assert!(!subject.exchange(&lit).laser.is_lit());
        assert!(subject.exchange(&dark).laser.is_lit());
        assert!(!subject.exchange(&dark).laser.is_lit());
    });
}

#[test]
fn edges_fire_within_the_resolution() {
    check(|subject| {
        let resolution = subject.port.profile().gate_resolution.0;
        let period = CYCLE_PERIOD.0 as u32;
        let full: Vec<u32> = (0..MAX_EDGES as u32).map(|edge| 31 + edge * 61_003).collect();
        for offsets in [&[1][..], &[period - 1], &[250_000, 250_001], &full] {
            for gate in [0, 5] {
                let asked = pattern(gate, offsets);
                subject.exchange(&Actuation { laser: asked, ..subject.driving() });
                let fired = subject.exchange(&subject.driving()).laser;
                assert_eq!((fired.gate, fired.power), (asked.gate, asked.power));
                assert_eq!(fired.edges().len(), asked.edges().len());
                for (fired, asked) in fired.edges().iter().zip(asked.edges()) {
                    let error = (i64::from(fired.offset) - i64::from(asked.offset)).abs();
                    assert!(2 * error <= resolution, "{fired:?} for {asked:?}");
                    assert_eq!((fired.gate, fired.power), (asked.gate, asked.power));
                }
            }
        }
    });
}

#[test]
fn a_stale_actuation_is_dark() {
    check(|subject| {
        let lit = Actuation { laser: pattern(5, &[]), ..subject.driving() };
        subject.exchange(&lit);
        for laser in [pattern(5, &[]), pattern(0, &[10, 20]), pattern(5, &[999_999])] {
            let stale = Actuation { freshness: Freshness::Stale, laser, ..subject.driving() };
            subject.exchange(&stale);
            assert!(!subject.exchange(&stale).laser.is_lit(), "{laser:?}");
        }
    });
}

#[test]
fn there_is_no_light_without_a_mode_that_follows() {
    check(|subject| {
        for mode in [CommandMode::Disabled, CommandMode::QuickStop] {
            let actuation = Actuation { mode, laser: pattern(5, &[]), ..subject.driving() };
            subject.exchange(&actuation);
            assert!(!subject.exchange(&actuation).laser.is_lit(), "{mode:?}");
        }
    });
}

#[test]
fn disabled_motors_carry_no_current_and_start_no_motion() {
    check(|subject| {
        let disabled = Actuation { mode: CommandMode::Disabled, ..subject.driving() };
        for _ in 0..50 {
            let measurement = subject.exchange(&disabled);
            assert_eq!(measurement.power, Power::Off);
            assert_eq!(measurement.current, [0.0; MAX_ACTUATORS]);
            assert_eq!(measurement.counts, [0; MAX_ACTUATORS]);
        }
    });
}

#[test]
fn voltage_moves_every_axis() {
    check(|subject| {
        let driving = subject.driving();
        let moved = subject.run(&driving, 20);
        assert_eq!(moved.power, Power::On);
        for axis in 0..subject.port.profile().actuators.len() {
            assert!(moved.counts[axis] > 0 && moved.current[axis] > 0.0, "axis {axis}: {moved:?}");
        }
    });
}

#[test]
fn a_quick_stop_comes_to_rest_and_stays() {
    check(|subject| {
        let driving = subject.driving();
        let before = subject.run(&driving, 30);
        let stopping = subject.stopping;
        let stopped = subject.run(&Actuation::QUICK_STOP, stopping);
        assert!(stopped.counts != before.counts);
        for _ in 0..1000 {
            let later = subject.exchange(&Actuation::QUICK_STOP);
            assert_eq!((later.counts, later.power), (stopped.counts, Power::On));
        }
    });
}

/// The port takes nothing but a brake after `actuation`, tells why, and recovers when disabled.
fn check_refusal(subject: &mut Subject, actuation: &Actuation, code: FaultCode) {
    let driving = subject.driving();
    subject.run(&driving, 20);
    let actuation = Actuation { laser: pattern(5, &[]), ..*actuation };
    assert_eq!(subject.exchange(&actuation).fault.code(), code);
    assert!(!subject.exchange(&actuation).laser.is_lit());
    // Latched: a good actuation does not move it again.
    let stopping = subject.stopping;
    let stopped = subject.run(&driving, stopping);
    assert_eq!(stopped.fault.code(), code);
    assert_eq!(subject.run(&driving, 20).counts, stopped.counts);
    assert!(!subject.exchange(&Actuation::DISABLED).fault.is_some());
    let resumed = subject.run(&driving, 20);
    assert!(resumed.counts != stopped.counts && !resumed.fault.is_some());
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        check(|subject| {
            let mut actuation = subject.driving();
            actuation.voltage[subject.port.profile().actuators.len() - 1] = number;
            check_refusal(subject, &actuation, FaultCode::NotFinite);
        });
    }
}

#[test]
fn a_laser_cycle_that_makes_no_sense_is_refused() {
    let mut unordered = pattern(0, &[10, 20]);
    unordered.edges.swap(0, 1);
    let late = pattern(0, &[CYCLE_PERIOD.0 as u32]);
    let many = LaserCycle { edge_count: MAX_EDGES as u32 + 1, ..LaserCycle::OFF };
    let strong = LaserCycle { power: 1.5, ..pattern(5, &[]) };
    let broken = LaserCycle { power: f64::NAN, ..pattern(5, &[]) };
    for laser in [unordered, late, many, strong, broken] {
        check(|subject| {
            let driving = subject.driving();
            subject.run(&driving, 2);
            let fault = subject.exchange(&Actuation { laser, ..driving }).fault;
            assert_eq!(fault.code(), FaultCode::DriveFault, "{laser:?}");
            assert!(!subject.exchange(&driving).laser.is_lit());
        });
    }
}
