//! What every port must do, whatever stands behind it: the contract of [`drives::port`] as tests. A port brings its
//! [`Subject`]s and calls [`suite!`].

#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stdout, reason = "the report of a failing test")]

use drives::{Actuation, Freshness, Measurement, Port, Power};
use machine::{ActuatorMode, Machine};
use messages::laser::{GateEdge, MAX_EDGES};
use messages::{CommandMode, FaultCode, LaserCycle, MAX_ACTUATORS};

/// Speed at which motors are driven in the tests [rad/s].
const SPEED: f64 = 5.0;

/// A port under test, open, with what its machine can bear.
pub(crate) struct Subject {
    pub(crate) name: &'static str,
    pub(crate) machine: Machine,
    pub(crate) port: Box<dyn Port>,
    /// A voltage that moves every axis from rest, for actuators that follow one [V].
    pub(crate) voltage: f64,
    /// Cycles until what stands behind it acts on what it is told, from the first one on or from disabled.
    pub(crate) starting: usize,
    /// Cycles in which its brake stops any motion that the tests cause.
    pub(crate) stopping: usize,
    /// Pulses of light that its gate gives in a cycle.
    pub(crate) pulses: usize,
    /// Counts by which a motor that is held may still move: none of a brake, one of a loop.
    pub(crate) holding: i64,
    /// Whether it measures what flows in the motors.
    pub(crate) measures_current: bool,
    /// What was measured last.
    pub(crate) measured: Measurement,
}

/// A change of the light: when, from the beginning of a timeline [ns], and to what.
type Change = (i64, u32, f64);

impl Subject {
    pub(crate) fn new(name: &'static str, machine: Machine, port: Box<dyn Port>) -> Self {
        Self {
            name,
            machine,
            port,
            voltage: 6.0,
            starting: 0,
            stopping: 300,
            pulses: MAX_EDGES / 2 + 1,
            holding: 0,
            measures_current: true,
            measured: Measurement::default(),
        }
    }

    fn actuators(&self) -> usize {
        self.port.profile().actuators.len()
    }

    fn period(&self) -> i64 {
        self.machine.realtime.period.time().0
    }

    fn exchange(&mut self, actuation: &Actuation) -> Measurement {
        self.port.exchange(actuation, &mut self.measured);
        self.measured
    }

    /// What moves every motor on from where it was measured.
    fn driving(&self) -> Actuation {
        let (freshness, mode) = (Freshness::Fresh, CommandMode::Driven);
        let mut actuation = Actuation { freshness, mode, ..Actuation::DISABLED };
        let ahead = SPEED * 2.5 * self.machine.realtime.period.seconds();
        for row in 0..self.actuators() {
            actuation.position[row] = self.measured.position[row] + ahead;
            actuation.velocity[row] = SPEED;
            actuation.effort[row] = 0.02;
            actuation.voltage[row] = self.voltage;
        }
        actuation
    }

    /// What holds the motors where they were measured.
    fn standing(&self) -> Actuation {
        let position = self.measured.position;
        Actuation {
            position,
            velocity: [0.0; MAX_ACTUATORS],
            effort: [0.0; MAX_ACTUATORS],
            voltage: [0.0; MAX_ACTUATORS],
            ..self.driving()
        }
    }

    fn drive(&mut self, cycles: usize) -> Measurement {
        for _ in 0..cycles {
            self.exchange(&self.driving());
        }
        self.measured
    }

    fn run(&mut self, actuation: &Actuation, cycles: usize) -> Measurement {
        (0..cycles).for_each(|_| {
            self.exchange(actuation);
        });
        self.measured
    }

    /// Brings it to where it follows, standing.
    fn start(&mut self) {
        self.run(&Actuation::DISABLED, self.starting + 1);
        let standing = self.standing();
        self.run(&standing, self.starting + 1);
        assert_eq!(self.measured.power, Power::On, "{:?}", self.measured.fault);
    }

    /// Asserts that the motors are where they were `stopped`.
    fn assert_held(&self, stopped: &Measurement) {
        let pairs = self.measured.counts.iter().zip(&stopped.counts);
        let most = pairs.map(|(now, then)| (now - then).abs()).max();
        assert!(most <= Some(self.holding), "{:?} {:?}", self.measured.counts, stopped.counts);
    }

    /// The changes of the light that it tells of cycles with these actuations, and of as many in the dark as it takes
    /// to tell them.
    fn light(&mut self, actuations: &[Actuation]) -> Vec<Change> {
        let (mut changes, mut last) = (Vec::new(), (0, 0.0));
        let dark = self.standing();
        let after = 3 + self.port.profile().gate_latency.0 / self.period();
        let all = actuations.iter().chain((0..after).map(|_| &dark));
        for (cycle, actuation) in (0..).zip(all) {
            let laser = self.exchange(actuation).laser;
            // It tells the cycle before; of the first of all, what was before this.
            let start = (cycle - 1) * self.period();
            let first = GateEdge { offset: 0, gate: laser.gate, power: laser.power };
            for edge in core::iter::once(&first).chain(laser.edges()) {
                let power = if edge.gate == 0 { 0.0 } else { edge.power };
                if (edge.gate, power) != last {
                    last = (edge.gate, power);
                    changes.push((start + i64::from(edge.offset), edge.gate, power));
                }
            }
        }
        changes
    }

    /// Asserts that the light changed as `asked`, later by the latency of the gate, to half its resolution.
    fn assert_light(&self, told: &[Change], asked: &[Change]) {
        let profile = self.port.profile();
        assert_eq!(told.len(), asked.len(), "{told:?} for {asked:?}");
        for (told, asked) in told.iter().zip(asked) {
            let error = (told.0 - asked.0 - profile.gate_latency.0).abs();
            assert!(2 * error <= profile.gate_resolution.0, "{told:?} for {asked:?}");
            assert_eq!((told.1, told.2), (asked.1, asked.2));
        }
    }
}

fn check(subjects: fn() -> Vec<Subject>, test: impl Fn(&mut Subject)) {
    for mut subject in subjects() {
        println!("{}", subject.name);
        test(&mut subject);
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

/// The changes that a cycle of `laser` asks for between two dark ones.
fn changes(laser: &LaserCycle, period: i64) -> Vec<Change> {
    let mut changes = Vec::new();
    if laser.gate != 0 {
        changes.push((0, laser.gate, laser.power));
    }
    changes
        .extend(laser.edges().iter().map(|edge| (i64::from(edge.offset), edge.gate, edge.power)));
    if laser.last().0 != 0 {
        changes.push((period, 0, 0.0));
    }
    changes
}

pub(crate) fn the_first_measurement_is_unpowered_dark_and_at_zero_counts(
    subjects: fn() -> Vec<Subject>,
) {
    check(subjects, |subject| {
        assert!((1..=MAX_ACTUATORS).contains(&subject.actuators()));
        assert!(subject.port.profile().gate_resolution.0 >= 1);
        let measurement = subject.exchange(&Actuation::DISABLED);
        assert_eq!(measurement.power, Power::Off);
        assert_eq!(measurement.counts, [0; MAX_ACTUATORS]);
        assert_eq!(measurement.current, [0.0; MAX_ACTUATORS]);
        assert!(!measurement.laser.is_lit() && !measurement.fault.is_some());
    });
}

pub(crate) fn the_laser_fires_in_the_cycle_it_is_asked_for_and_is_told_after_it(
    subjects: fn() -> Vec<Subject>,
) {
    check(subjects, |subject| {
        subject.start();
        let laser = pattern(5, &[]);
        let told = subject.light(&[Actuation { laser, ..subject.standing() }]);
        subject.assert_light(&told, &changes(&laser, subject.period()));
    });
}

pub(crate) fn edges_fire_within_the_resolution(subjects: fn() -> Vec<Subject>) {
    check(subjects, |subject| {
        subject.start();
        let (period, resolution) = (subject.period(), subject.port.profile().gate_resolution.0);
        let last = period as u32 - 1;
        let apart = resolution.max(2) as u32;
        let full: Vec<u32> = (0..MAX_EDGES as u32).map(|edge| 31 + edge * 61_003).collect();
        for offsets in [&[1][..], &[last], &[250_000, 250_000 + apart], &full] {
            for gate in [0, 5] {
                // Light that is on at the beginning is a pulse without an edge before it.
                let most = 2 * subject.pulses - usize::from(gate != 0);
                let offsets = offsets.get(..most).unwrap_or(offsets);
                let asked = pattern(gate, offsets);
                let told = subject.light(&[Actuation { laser: asked, ..subject.standing() }]);
                subject.assert_light(&told, &changes(&asked, period));
            }
        }
    });
}

pub(crate) fn a_stale_actuation_is_dark(subjects: fn() -> Vec<Subject>) {
    check(subjects, |subject| {
        subject.start();
        for laser in [pattern(5, &[]), pattern(0, &[10, 20]), pattern(5, &[999_999])] {
            let fresh = Actuation { laser: pattern(5, &[]), ..subject.standing() };
            let stale = Actuation { freshness: Freshness::Stale, laser, ..subject.standing() };
            let told = subject.light(&[fresh, stale, stale]);
            subject.assert_light(&told, &changes(&fresh.laser, subject.period()));
        }
    });
}

pub(crate) fn there_is_no_light_without_a_mode_that_follows(subjects: fn() -> Vec<Subject>) {
    check(subjects, |subject| {
        subject.start();
        for mode in [CommandMode::QuickStop, CommandMode::Disabled] {
            let actuation = Actuation { mode, laser: pattern(5, &[]), ..subject.standing() };
            assert_eq!(subject.light(&[actuation, actuation]), [], "{mode:?}");
        }
    });
}

pub(crate) fn disabled_motors_carry_no_current_and_start_no_motion(subjects: fn() -> Vec<Subject>) {
    check(subjects, |subject| {
        subject.exchange(&Actuation::DISABLED);
        for _ in 0..50 {
            let disabled = Actuation { mode: CommandMode::Disabled, ..subject.driving() };
            let measurement = subject.exchange(&disabled);
            assert_eq!(measurement.power, Power::Off);
            assert_eq!(measurement.current, [0.0; MAX_ACTUATORS]);
            assert_eq!(measurement.counts, [0; MAX_ACTUATORS]);
        }
    });
}

pub(crate) fn its_targets_move_every_axis(subjects: fn() -> Vec<Subject>) {
    check(subjects, |subject| {
        subject.start();
        let moved = subject.drive(20);
        assert_eq!(moved.power, Power::On);
        for axis in 0..subject.actuators() {
            assert!(moved.counts[axis] > 0, "axis {axis}: {moved:?}");
            let flows = moved.current[axis] > 0.0;
            let follows_voltage = subject.machine.actuators[axis].mode == ActuatorMode::Voltage;
            assert!(flows || !subject.measures_current || !follows_voltage, "{moved:?}");
        }
    });
}

pub(crate) fn a_quick_stop_comes_to_rest_and_stays(subjects: fn() -> Vec<Subject>) {
    check(subjects, |subject| {
        subject.start();
        let before = subject.drive(30);
        let stopped = subject.run(&Actuation::QUICK_STOP, subject.stopping);
        assert!(stopped.counts != before.counts);
        for _ in 0..1000 {
            let later = subject.exchange(&Actuation::QUICK_STOP);
            subject.assert_held(&stopped);
            assert_eq!(later.power, Power::On);
        }
    });
}

/// The port takes nothing but a brake after what `wrong` makes of an actuation, tells why, and recovers when disabled.
fn check_refusal(subject: &mut Subject, wrong: impl Fn(&mut Actuation), code: FaultCode) {
    subject.start();
    subject.drive(20);
    let mut actuation = Actuation { laser: pattern(5, &[]), ..subject.driving() };
    wrong(&mut actuation);
    let told = subject.light(&[actuation, actuation]);
    assert_eq!(subject.measured.fault.code(), code);
    assert_eq!(told, [], "{:?}", actuation.laser);
    // Latched: a good actuation does not move it again.
    let stopping = subject.stopping;
    let stopped = subject.drive(stopping);
    assert_eq!(stopped.fault.code(), code);
    subject.drive(20);
    subject.assert_held(&stopped);
    assert!(!subject.exchange(&Actuation::DISABLED).fault.is_some());
    subject.start();
    let resumed = subject.drive(20);
    assert!(resumed.counts != stopped.counts && !resumed.fault.is_some());
}

pub(crate) fn numbers_that_are_not_finite_are_refused(subjects: fn() -> Vec<Subject>) {
    for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        check(subjects, |subject| {
            let last = subject.actuators() - 1;
            let mode = subject.machine.actuators[last].mode;
            let wrong = |actuation: &mut Actuation| match mode {
                ActuatorMode::Voltage => actuation.voltage[last] = number,
                ActuatorMode::Torque => actuation.effort[last] = number,
                ActuatorMode::Velocity => actuation.velocity[last] = number,
                ActuatorMode::Position => actuation.position[last] = number,
            };
            check_refusal(subject, wrong, FaultCode::NotFinite);
        });
    }
}

pub(crate) fn a_laser_cycle_that_makes_no_sense_is_refused(subjects: fn() -> Vec<Subject>) {
    let late = |period: i64| pattern(0, &[period as u32]);
    let mut unordered = pattern(0, &[10, 20]);
    unordered.edges.swap(0, 1);
    let many = LaserCycle { edge_count: MAX_EDGES as u32 + 1, ..LaserCycle::OFF };
    let strong = LaserCycle { power: 1.5, ..pattern(5, &[]) };
    let broken = LaserCycle { power: f64::NAN, ..pattern(5, &[]) };
    check(subjects, |subject| {
        for laser in [unordered, late(subject.period()), many, strong, broken] {
            let wrong = |actuation: &mut Actuation| actuation.laser = laser;
            check_refusal(subject, wrong, FaultCode::DriveFault);
        }
    });
}

/// The whole suite as tests, for what `$subjects` gives.
macro_rules! suite {
    ($subjects:path) => {
        conformance::suite! { $subjects =>
            the_first_measurement_is_unpowered_dark_and_at_zero_counts
            the_laser_fires_in_the_cycle_it_is_asked_for_and_is_told_after_it
            edges_fire_within_the_resolution
            a_stale_actuation_is_dark
            there_is_no_light_without_a_mode_that_follows
            disabled_motors_carry_no_current_and_start_no_motion
            its_targets_move_every_axis
            a_quick_stop_comes_to_rest_and_stays
            numbers_that_are_not_finite_are_refused
            a_laser_cycle_that_makes_no_sense_is_refused
        }
    };
    ($subjects:path => $($test:ident)*) => {
        $( #[test]
        fn $test() {
            conformance::$test($subjects);
        } )*
    };
}
pub(crate) use suite;
