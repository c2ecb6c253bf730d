//! The bridge with the plant behind it: latching, freshness, the watchdog's stops and how they
//! are cleared, stamps and counts.
#![allow(clippy::unwrap_used)]

use std::sync::{Arc, Mutex};

use drives::{
    Actuation, ActuatorProfile, Bridge, BridgeOptions, Deadlines, Freshness, GatePermission,
    Measurement, PlantOptions, Port, Profile, SimulatedPlant,
};
use machine::{ActuatorMode, Machine, StallTolerance, Timing};
use messages::feedback::status;
use messages::laser::{GateEdge, LaserCycle, MAX_EDGES};
use messages::time::Period;
use messages::{
    Command, CommandMode, Cycle, Fault, FaultCode, FaultQuantity, Feedback, Nanoseconds,
    RealtimeFacts, axis::actuator_array,
};

const EPOCH: u64 = 77;
const PERIOD: i64 = 1_000_000;

/// Cycles that may lack a command here; the machine file's default is longer.
const TOLERATED: i64 = 2;

fn options(deadlines: Deadlines) -> BridgeOptions {
    let period = Period::OF_SETPOINTS;
    let stall = StallTolerance::new(Nanoseconds(TOLERATED * PERIOD), period).unwrap();
    let timing = Timing { period, stall };
    BridgeOptions { epoch: EPOCH, deadlines, timing }
}

/// A bridge over the built-in machine, run in virtual time.
struct Run {
    bridge: Bridge,
    deadline: Nanoseconds,
}

impl Run {
    fn new(deadlines: Deadlines) -> Self {
        Self::of(&Machine::builtin(), deadlines)
    }

    fn of(machine: &Machine, deadlines: Deadlines) -> Self {
        let port = SimulatedPlant::new(machine, PlantOptions::default()).unwrap();
        let bridge = Bridge::new(port, options(deadlines));
        Self { bridge, deadline: Nanoseconds(5_000_000_000) }
    }

    /// One cycle, answered by what `answer` makes of the feedback.
    fn cycle(&mut self, answer: impl FnOnce(&Feedback) -> Option<Command>) -> Feedback {
        let deadline = self.deadline;
        self.deadline = deadline + Nanoseconds(PERIOD);
        self.bridge.begin(deadline + Nanoseconds(100), deadline);
        let feedback = *self.bridge.stamp(deadline + Nanoseconds(4_100));
        match answer(&feedback) {
            Some(command) => {
                self.bridge.latch(&command, deadline + Nanoseconds(20_000));
            }
            None => self.bridge.miss(),
        }
        self.bridge.finish(deadline + Nanoseconds(21_000));
        feedback
    }

    fn answered(&mut self, mode: CommandMode, laser: LaserCycle) -> Feedback {
        self.cycle(|feedback| Some(command(feedback, mode, laser)))
    }

    fn missed(&mut self) -> Feedback {
        self.cycle(|_| None)
    }

    /// The handshake, and 30 cycles under voltage in the dark.
    fn moving() -> Self {
        let mut run = Self::new(Deadlines::Strict);
        run.answered(CommandMode::Disabled, LaserCycle::OFF);
        for _ in 0..30 {
            run.answered(CommandMode::Driven, LaserCycle::OFF);
        }
        run
    }

    fn is_moving(&mut self) -> bool {
        let before = self.missed().counts;
        self.missed().counts != before
    }
}

fn command(feedback: &Feedback, mode: CommandMode, laser: LaserCycle) -> Command {
    Command {
        epoch: feedback.epoch,
        cycle: feedback.cycle,
        published: feedback.published + Nanoseconds(10_000),
        mode: mode as u32,
        voltage: actuator_array(&[4.0, -2.0]),
        laser,
        ..Command::default()
    }
}

fn lit() -> LaserCycle {
    LaserCycle { gate: 1, power: 1.0, ..LaserCycle::OFF }
}

fn facts() -> RealtimeFacts {
    RealtimeFacts::default()
}

#[test]
fn a_command_acts_one_cycle_after_the_feedback_it_answers() {
    let mut run = Run::new(Deadlines::Strict);
    let first = run.answered(CommandMode::Disabled, LaserCycle::OFF);
    assert_eq!((first.epoch, first.cycle, first.command_received.0), (EPOCH, Cycle(0), 0));
    assert_eq!(first.exchange, Nanoseconds(4_000));
    let second = run.answered(CommandMode::Driven, lit());
    assert_eq!(second.command_cycle, Cycle(0));
    assert!(!second.has(status::POWERED));
    let third = run.answered(CommandMode::Driven, LaserCycle::OFF);
    // In force since the third deadline, so nothing has been fired yet.
    assert_eq!(third.command_cycle, Cycle(1));
    assert_eq!(third.command_received, second.deadline + Nanoseconds(20_000));
    assert_eq!(third.command_published, second.published + Nanoseconds(10_000));
    assert_eq!(third.command_applied, third.deadline + Nanoseconds(100));
    assert!(third.has(status::POWERED) && !third.laser.is_lit());
    let fourth = run.answered(CommandMode::Driven, LaserCycle::OFF);
    assert_eq!(fourth.laser, lit());
    assert!(!run.answered(CommandMode::Driven, LaserCycle::OFF).laser.is_lit());
    assert_eq!(run.bridge.report(facts()).gate_trips, 0);
}

#[test]
fn velocity_is_the_difference_of_positions_over_a_cycle() {
    let mut run = Run::moving();
    let before = run.answered(CommandMode::Driven, LaserCycle::OFF);
    let after = run.answered(CommandMode::Driven, LaserCycle::OFF);
    for axis in 0..2 {
        assert_eq!(after.velocity[axis], (after.position[axis] - before.position[axis]) / 1e-3);
        assert!(after.velocity[axis].abs() > 1.0);
    }
    assert!(after.velocity[2..].iter().all(|velocity| *velocity == 0.0));
}

#[test]
fn the_first_stale_cycle_is_dark_for_every_pattern_of_edges() {
    // Every subset of eight instants at which the gate may change, from either state.
    let mut run = Run::moving();
    let mut trips = 0;
    for bits in 0..512_u32 {
        let mut laser = LaserCycle { gate: bits & 1, power: 1.0, ..LaserCycle::OFF };
        let mut gate = laser.gate;
        for slot in 0..8 {
            if bits >> (slot + 1) & 1 != 0 {
                gate = 1 - gate;
                assert!(laser.push(GateEdge { offset: slot * 120_000, gate, power: 1.0 }));
            }
        }
        run.answered(CommandMode::Driven, laser);
        // In force from here; the answer is lost.
        run.missed();
        let stale = run.answered(CommandMode::Driven, LaserCycle::OFF);
        assert_eq!(stale.laser, laser, "{bits:#b}");
        assert!(stale.has(status::COMMAND_MISSED));
        let after = run.answered(CommandMode::Driven, LaserCycle::OFF);
        assert!(!after.laser.is_lit(), "{bits:#b}: {:?}", after.laser);
        assert!(!after.has(status::COMMAND_MISSED) && !after.has(status::WATCHDOG_TRIPPED));
        trips += u64::from(laser.last().0 != 0);
        assert_eq!(run.bridge.report(facts()).gate_trips, trips, "{bits:#b}");
    }
    assert_eq!(run.bridge.report(facts()).missed, 512);
    const { assert!(MAX_EDGES >= 8) };
}

#[test]
fn commands_of_another_cycle_or_epoch_are_stale() {
    let mut run = Run::moving();
    let feedback = *run.bridge.feedback();
    let good = command(&feedback, CommandMode::Driven, lit());
    for stale in [
        Command { cycle: Cycle(feedback.cycle.0 - 1), ..good },
        Command { cycle: feedback.cycle.next(), ..good },
        Command { epoch: EPOCH + 1, ..good },
    ] {
        assert_eq!(run.bridge.latch(&stale, feedback.published), Freshness::Stale);
    }
    assert_eq!(run.bridge.latch(&good, feedback.published), Freshness::Fresh);
    run.bridge.miss();
    let stale = Command { epoch: EPOCH + 1, ..good };
    let next = run.cycle(|_| Some(stale));
    assert!(next.has(status::COMMAND_MISSED));
    assert!(run.missed().has(status::COMMAND_MISSED));
}

#[test]
fn more_misses_than_tolerated_stop_the_axes_until_a_reset_and_a_new_start() {
    let mut run = Run::moving();
    run.missed();
    for expected in [false, false, true] {
        let feedback = run.missed();
        assert!(feedback.has(status::COMMAND_MISSED));
        assert_eq!(feedback.has(status::WATCHDOG_TRIPPED), expected);
    }
    let fault = run.bridge.feedback().fault;
    assert_eq!((fault.code(), fault.value, fault.limit), (FaultCode::StaleCommand, 3.0, 2.0));
    for _ in 0..300 {
        run.missed();
    }
    assert!(!run.is_moving());
    let report = run.bridge.report(facts());
    assert_eq!((report.stops, report.at_rest, report.lit), (1, 1, 0));

    // Neither commands, nor disabling, nor a restarted controller that knows of no reset.
    for mode in [CommandMode::Driven, CommandMode::Disabled, CommandMode::Driven] {
        let feedback = run.answered(mode, lit());
        assert!(feedback.has(status::WATCHDOG_TRIPPED) && !feedback.laser.is_lit());
    }
    let reset = |run: &mut Run, mode, reset| {
        run.cycle(|feedback| Some(Command { reset, ..command(feedback, mode, lit()) }))
    };
    // A reset while it still asks for voltage does not start it.
    reset(&mut run, CommandMode::Driven, 9);
    assert!(reset(&mut run, CommandMode::Driven, 9).has(status::WATCHDOG_TRIPPED));
    reset(&mut run, CommandMode::Disabled, 9);
    let cleared = reset(&mut run, CommandMode::Driven, 9);
    assert!(!cleared.has(status::WATCHDOG_TRIPPED) && !cleared.fault.is_some());
    assert!(reset(&mut run, CommandMode::Driven, 9).has(status::POWERED));
    assert!(reset(&mut run, CommandMode::Driven, 9).laser.is_lit());

    // The same ticket does not clear the next stop.
    for _ in 0..300 {
        run.missed();
    }
    reset(&mut run, CommandMode::Disabled, 9);
    assert!(reset(&mut run, CommandMode::Disabled, 9).has(status::WATCHDOG_TRIPPED));
    assert_eq!(run.bridge.report(facts()).stops, 2);
}

#[test]
fn power_needs_a_command_that_starts_from_disabled() {
    let mut run = Run::new(Deadlines::Strict);
    run.answered(CommandMode::Driven, lit());
    let refused = run.answered(CommandMode::Driven, lit());
    assert!(refused.has(status::WATCHDOG_TRIPPED) && !refused.has(status::POWERED));
    assert!(!run.answered(CommandMode::Driven, lit()).laser.is_lit());
}

#[test]
fn a_controller_that_leaves_unpowered_stops_nothing() {
    let mut run = Run::new(Deadlines::Strict);
    for _ in 0..10 {
        run.missed();
    }
    assert_eq!(run.bridge.feedback().missed, 0);
    run.answered(CommandMode::Disabled, LaserCycle::OFF);
    for _ in 0..10 {
        run.missed();
    }
    let feedback = run.missed();
    assert!(!feedback.fault.is_some() && !feedback.has(status::WATCHDOG_TRIPPED));
    assert_eq!(feedback.missed, 3);
}

#[test]
fn a_command_that_makes_no_sense_stops_at_once() {
    for number in [f64::NAN, f64::INFINITY] {
        let mut run = Run::moving();
        run.answered(CommandMode::Driven, lit());
        run.cycle(|feedback| {
            let good = command(feedback, CommandMode::Driven, lit());
            Some(Command { voltage: actuator_array(&[1.0, number]), ..good })
        });
        let feedback = run.answered(CommandMode::Driven, lit());
        assert_eq!((feedback.fault.code(), feedback.fault.actuator), (FaultCode::NotFinite, 2));
        assert!(feedback.has(status::WATCHDOG_TRIPPED));
        assert!(!run.answered(CommandMode::Driven, lit()).laser.is_lit());
        assert_eq!(run.bridge.report(facts()).gate_trips, 1);
        for _ in 0..300 {
            run.answered(CommandMode::Driven, lit());
        }
        assert!(!run.is_moving());
    }
}

/// Two motors that do nothing; keeps what it is told, and tells a fault word when it is lit.
struct Stub {
    profile: Profile,
    told: Arc<Mutex<Vec<Actuation>>>,
    word: u32,
}

impl Stub {
    fn new(told: &Arc<Mutex<Vec<Actuation>>>, word: u32) -> Box<Self> {
        let actuators = vec![ActuatorProfile::immediate(ActuatorMode::Voltage); 2];
        Box::new(Self { profile: Profile::of(actuators), told: told.clone(), word })
    }
}

impl Port for Stub {
    fn profile(&self) -> &Profile {
        &self.profile
    }
    fn send(&mut self, actuation: &Actuation) {
        self.told.lock().unwrap().push(*actuation);
    }
    fn receive(&mut self, measurement: &mut Measurement) {
        if self.word != 0 && self.told.lock().unwrap().last().unwrap().laser.is_lit() {
            let fault = Fault::new(FaultCode::DriveFault).on_actuator(1);
            measurement.fault = fault.with(FaultQuantity::DriveWord, f64::from(self.word));
        }
    }
}

#[test]
fn a_fault_word_of_a_drive_stops_the_axes_and_is_told() {
    let port = Stub::new(&Arc::default(), 0x2310);
    let bridge = Bridge::new(port, options(Deadlines::Strict));
    let mut run = Run { bridge, deadline: Nanoseconds(5_000_000_000) };
    run.answered(CommandMode::Disabled, LaserCycle::OFF);
    run.answered(CommandMode::Driven, lit());
    let feedback = run.answered(CommandMode::Driven, lit());
    let fault = feedback.fault;
    assert_eq!((fault.code(), fault.actuator), (FaultCode::DriveFault, 2));
    assert_eq!((fault.quantity(), fault.value), (FaultQuantity::DriveWord, f64::from(0x2310)));
    assert_eq!(fault.at, feedback.measured);
    assert!(feedback.has(status::WATCHDOG_TRIPPED));
}

#[test]
fn holding_brakes_go_with_the_power_and_all_other_outputs_off_with_the_commands() {
    const BRAKE: u64 = 4;
    let told = Arc::default();
    let port = Stub::new(&told, 0);
    let bridge = Bridge::new(port, options(Deadlines::Strict)).with_brakes(BRAKE);
    let mut run = Run { bridge, deadline: Nanoseconds(5_000_000_000) };
    // Whatever the command says of the brake; the outputs beside it are its own.
    let with = |mode, outputs| {
        move |feedback: &Feedback| {
            Some(Command { outputs, ..command(feedback, mode, LaserCycle::OFF) })
        }
    };
    run.cycle(with(CommandMode::Disabled, BRAKE | 1));
    run.cycle(with(CommandMode::Driven, 3));
    run.cycle(with(CommandMode::Driven, BRAKE | 2));
    for _ in 0..TOLERATED + 3 {
        run.missed();
    }
    for _ in 0..100 {
        run.cycle(with(CommandMode::Disabled, BRAKE | 3));
    }
    let told = told.lock().unwrap();
    let on: Vec<(CommandMode, u64)> = told.iter().map(|it| (it.mode, it.outputs)).collect();
    let driven = CommandMode::Driven;
    assert_eq!(
        on[..4],
        [
            (CommandMode::Disabled, 0),
            (CommandMode::Disabled, 1),
            (driven, BRAKE | 3),
            (driven, BRAKE | 2),
        ]
    );
    // Within the tolerated stall the axes go on with the last command, then they are braked, and rest.
    let stopped = on.iter().position(|(mode, _)| *mode == CommandMode::QuickStop).unwrap();
    assert!(on[4..stopped].iter().all(|it| *it == (driven, BRAKE | 2)), "{on:?}");
    assert!(
        on[stopped..].iter().all(|(mode, outputs)| match mode {
            CommandMode::QuickStop => *outputs == BRAKE,
            _ => *outputs == 0,
        }),
        "{on:?}"
    );
    assert_eq!(on.last(), Some(&(CommandMode::Disabled, 0)));
}

#[test]
fn a_dead_peer_closes_the_gate_and_leaves_the_axes_to_the_controller() {
    let mut run = Run::moving();
    run.answered(CommandMode::Driven, lit());
    run.answered(CommandMode::Driven, lit());
    run.bridge.permit(GatePermission::Inhibited);
    // At this deadline the gate closes, though a fresh command asks for light.
    let feedback = run.answered(CommandMode::Driven, lit());
    assert!(feedback.laser.is_lit() && feedback.has(status::GATE_INHIBITED));
    for _ in 0..5 {
        let feedback = run.answered(CommandMode::Driven, lit());
        assert!(!feedback.laser.is_lit() && !feedback.has(status::WATCHDOG_TRIPPED));
    }
    assert_eq!(run.bridge.report(facts()).gate_trips, 1);
    assert_eq!(run.bridge.feedback().missed, 0);
}

/// How a controller brings the axes to rest is its own to say, whoever else has died: drivers that took
/// its positions for stale would go on at the speed of the last cycle before.
#[test]
fn steppers_follow_the_controller_to_rest_in_the_dark_after_a_peer_has_died() {
    /// From this cycle on a peer is dead.
    const DEATH: u32 = 60;
    /// Cycles from full speed to rest.
    const STOP: u32 = 150;
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../machines");
    let machine = Machine::load(&folder.join("cartesian_steppers.toml"), &[]).unwrap();
    let pulse = machine.actuators[0].encoder.resolution();
    // Slow enough that no following error would ever be noticed, and fast.
    for speed in [0.01, 0.2] {
        let mut run = Run::of(&machine, Deadlines::Strict);
        let home = run.answered(CommandMode::Disabled, LaserCycle::OFF).position;
        let fastest = speed / machine.actuators[0].ratio;
        let mut told = home;
        for cycle in 0..DEATH + STOP + 50 {
            let rate = match cycle {
                0..DEATH => f64::from(cycle + 1) / f64::from(DEATH),
                _ => 1.0 - f64::from(cycle - DEATH).min(f64::from(STOP)) / f64::from(STOP),
            };
            let dead = cycle >= DEATH;
            run.bridge.permit(if dead {
                GatePermission::Inhibited
            } else {
                GatePermission::Granted
            });
            let mut velocity = [0.0; messages::MAX_ACTUATORS];
            velocity[0] = rate * fastest;
            let before = told;
            told[0] += velocity[0] * 1e-3;
            let feedback = run.cycle(|feedback| {
                let moving = command(feedback, CommandMode::Driven, lit());
                Some(Command { position: told, velocity, ..moving })
            });
            // What is told now acts from the next deadline to the one after.
            let late = 2.0 * velocity[0].max(fastest / f64::from(STOP)) * 1e-3;
            let off = (feedback.position[0] - before[0]).abs();
            assert!(off <= late + pulse, "{off} rad off in cycle {cycle} at {speed} m/s");
            assert!(!feedback.has(status::WATCHDOG_TRIPPED), "{:?}", feedback.fault);
            assert!(cycle <= DEATH || !feedback.laser.is_lit(), "lit in cycle {cycle}");
        }
        // It stands where it was told to, to the pulse.
        let stands = run.cycle(|feedback| {
            let moving = command(feedback, CommandMode::Driven, LaserCycle::OFF);
            Some(Command { position: told, velocity: [0.0; messages::MAX_ACTUATORS], ..moving })
        });
        assert!((stands.position[0] - told[0]).abs() <= pulse, "{stands:?}");
        assert_eq!(stands.velocity[0], 0.0);
        assert!(told[0] - home[0] > 50.0 * pulse);
        // The gate was open, and was closed though a fresh command asked for light.
        assert_eq!(run.bridge.report(facts()).gate_trips, 1);
    }
}

#[test]
fn a_stop_from_outside_overrides_a_fresh_command() {
    let mut run = Run::moving();
    run.answered(CommandMode::Driven, lit());
    let now = run.deadline;
    run.bridge.stop(FaultCode::ControllerLost, now);
    let feedback = run.missed();
    assert_eq!(feedback.fault.code(), FaultCode::ControllerLost);
    assert!(!run.missed().laser.is_lit());
    // The first cause stays.
    run.bridge.stop(FaultCode::SupervisorLost, now);
    assert_eq!(run.missed().fault.code(), FaultCode::ControllerLost);
}

#[test]
fn overruns_and_slips_are_counted_once() {
    for (deadlines, slips, skipped) in [(Deadlines::Slipping, 1, 1), (Deadlines::Strict, 0, 4)] {
        let mut run = Run::new(deadlines);
        let feedback = run.answered(CommandMode::Disabled, LaserCycle::OFF);
        assert_eq!(feedback.has(status::SLIPPING), deadlines == Deadlines::Slipping);
        // Late by the work, then the clock goes on four periods later.
        let start = run.deadline;
        run.bridge.begin(start, start);
        run.bridge.finish(start + Nanoseconds(PERIOD + 1));
        assert_eq!(run.bridge.feedback().overruns, 1);
        let next = start + Nanoseconds(5 * PERIOD);
        let feedback = *run.bridge.begin(next, next);
        assert_eq!(feedback.skipped, if deadlines == Deadlines::Strict { 4 } else { 0 });
        assert_eq!(run.bridge.feedback().overruns, skipped);
        assert_eq!(run.bridge.report(facts()).slips, slips);
        // A jump that no late work announced counts too.
        run.bridge.finish(start + Nanoseconds(5 * PERIOD + 10));
        let next = start + Nanoseconds(6 * PERIOD + 5);
        run.bridge.begin(next, next);
        assert_eq!(run.bridge.feedback().overruns, skipped + 1);
        // Strict cycles are numbered by the time: four were skipped.
        let cycle = if deadlines == Deadlines::Strict { 7 } else { 3 };
        assert_eq!(run.bridge.feedback().cycle, Cycle(cycle));
    }
}

#[test]
fn a_released_port_is_dark_and_unpowered() {
    let told = Arc::default();
    let bridge = Bridge::new(Stub::new(&told, 0), options(Deadlines::Strict));
    let mut run = Run { bridge, deadline: Nanoseconds(5_000_000_000) };
    run.answered(CommandMode::Disabled, LaserCycle::OFF);
    run.answered(CommandMode::Driven, lit());
    run.answered(CommandMode::Driven, lit());
    let last = *told.lock().unwrap().last().unwrap();
    assert!(last.mode == CommandMode::Driven && last.laser.is_lit());
    run.bridge.close().unwrap();
    assert_eq!(told.lock().unwrap().last(), Some(&Actuation::DISABLED));
}
