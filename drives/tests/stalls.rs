//! Stalls of drives with strict deadlines: skipped cycles are dark, the plant moves on through them
//! with what was in force, and a stall is a fault exactly when it is longer than tolerated.
#![allow(clippy::unwrap_used)]

use drives::{
    Actuation, ActuatorProfile, Bridge, BridgeOptions, Deadlines, Measurement, PlantOptions, Port,
    Profile, SimulatedPlant,
};
use machine::{ActuatorMode, LaserSource, Machine, StallTolerance, Timing};
use messages::feedback::status;
use messages::laser::{GateEdge, LaserCycle};
use messages::random::SplitMix64;
use messages::time::Period;
use messages::{
    Command, CommandMode, Cycle, FaultCode, Feedback, Nanoseconds, RealtimeFacts, StallCause,
    axis::actuator_array,
};

const EPOCH: u64 = 77;
const PERIOD: i64 = 1_000_000;
const START: i64 = 5_000_000_000;

/// A bridge with strict deadlines over a plant, run in virtual time.
struct Run {
    bridge: Bridge,
    deadline: Nanoseconds,
}

impl Run {
    fn new(machine: &Machine, tolerated: i64, deadlines: Deadlines) -> Self {
        let port = SimulatedPlant::new(machine, PlantOptions::default()).unwrap();
        Self::over(port, tolerated, deadlines)
    }

    fn over(port: Box<dyn Port>, tolerated: i64, deadlines: Deadlines) -> Self {
        let period = Period::OF_SETPOINTS;
        let stall = StallTolerance::new(Nanoseconds(tolerated * PERIOD), period).unwrap();
        let timing = Timing { period, stall };
        let bridge = Bridge::new(port, BridgeOptions { epoch: EPOCH, deadlines, timing });
        Self { bridge, deadline: Nanoseconds(START) }
    }

    /// Powered and moving.
    fn moving(machine: &Machine, tolerated: i64) -> Self {
        let mut run = Self::new(machine, tolerated, Deadlines::Strict);
        run.cycle(0, Some((CommandMode::Disabled, LaserCycle::OFF)));
        for _ in 0..30 {
            run.dark();
        }
        run
    }

    /// Skips cycles, then one cycle with this answer.
    fn cycle(&mut self, skipped: i64, answer: Option<(CommandMode, LaserCycle)>) -> Feedback {
        self.deadline = self.deadline + Nanoseconds(skipped * PERIOD);
        let deadline = self.deadline;
        self.deadline = deadline + Nanoseconds(PERIOD);
        // Late within the period too: that changes nothing.
        self.bridge.begin(deadline + Nanoseconds(400_000), deadline);
        let feedback = *self.bridge.stamp(deadline + Nanoseconds(404_000));
        match answer {
            Some((mode, laser)) => {
                let command = command(&feedback, mode, laser);
                self.bridge.latch(&command, deadline + Nanoseconds(420_000));
            }
            None => self.bridge.miss(),
        }
        self.bridge.finish(deadline + Nanoseconds(421_000));
        feedback
    }

    fn dark(&mut self) -> Feedback {
        self.cycle(0, Some((CommandMode::Driven, LaserCycle::OFF)))
    }

    fn lit(&mut self, laser: LaserCycle) -> Feedback {
        self.cycle(0, Some((CommandMode::Driven, laser)))
    }

    fn stall(&mut self, skipped: i64) -> Feedback {
        self.cycle(skipped, Some((CommandMode::Driven, LaserCycle::OFF)))
    }
}

fn command(feedback: &Feedback, mode: CommandMode, laser: LaserCycle) -> Command {
    Command {
        epoch: feedback.epoch,
        cycle: feedback.cycle,
        published: feedback.published + Nanoseconds(10_000),
        stream: 1,
        mode: mode as u32,
        voltage: actuator_array(&[4.0, -2.0]),
        laser,
        ..Command::default()
    }
}

fn lit() -> LaserCycle {
    LaserCycle { gate: 1, power: 1.0, ..LaserCycle::OFF }
}

#[test]
fn cycle_numbers_are_the_time_whatever_was_skipped() {
    let mut run = Run::moving(&Machine::builtin(), 50);
    let mut random = SplitMix64::new(1);
    let mut cycle = run.dark().cycle.0;
    for _ in 0..500 {
        let skipped = (random.bits() % 49).saturating_sub(40) as i64;
        let feedback = run.stall(skipped);
        cycle += 1 + skipped as u64;
        assert_eq!((feedback.cycle, feedback.skipped), (Cycle(cycle), skipped as u16));
        assert_eq!(feedback.deadline.0, START + PERIOD * cycle as i64);
        assert_eq!(feedback.has(status::COMMAND_MISSED), skipped > 0);
        assert!(!feedback.has(status::WATCHDOG_TRIPPED));
    }
}

#[test]
fn the_plant_moves_on_through_skipped_cycles_as_if_the_answers_had_been_missed() {
    let machine = Machine::builtin();
    for skipped in 1..8 {
        let mut stalled = Run::moving(&machine, 20);
        let mut missed = Run::moving(&machine, 20);
        // The answer to the last feedback comes to nothing, and so do those in the skipped cycles.
        let before = stalled.cycle(0, None);
        missed.cycle(0, None);
        for _ in 0..skipped {
            missed.cycle(0, None);
        }
        let expected = missed.dark();
        let feedback = stalled.stall(skipped);
        assert_eq!((feedback.cycle, feedback.counts), (expected.cycle, expected.counts));
        assert_eq!((feedback.tool, feedback.current), (expected.tool, expected.current));
        assert_eq!(feedback.missed, expected.missed);
        // The velocity is the mean since the feedback before.
        let time = 1e-3 * (1 + skipped) as f64;
        let mean = (feedback.position[0] - before.position[0]) / time;
        assert!((feedback.velocity[0] - mean).abs() < 1e-9 && mean.abs() > 1.0);
        assert_eq!(stalled.dark().counts, missed.dark().counts);
    }
}

#[test]
fn no_skipped_cycle_is_ever_lit_and_what_was_lit_before_is_told() {
    let mut machine = Machine::builtin();
    for off_delay in [0.0, 30e-6, 2.5e-3] {
        machine.laser = LaserSource { off_delay, ..LaserSource::IDEAL };
        for skipped in 1..8 {
            let mut run = Run::moving(&machine, 20);
            run.lit(lit());
            // In force from here to the next deadline; its successor asks for light as well.
            run.lit(lit());
            let feedback = run.stall(skipped);
            let out = 1_000_000 + (off_delay * 1e9).round() as u32;
            let most = 1_000_000 * (1 + skipped as u32);
            let edges: &[_] = &[GateEdge { offset: out, gate: 0, power: 0.0 }];
            assert_eq!((feedback.laser.gate, feedback.laser.power), (1, 1.0));
            assert_eq!(feedback.laser.edges(), if out < most { edges } else { &[] });
            // The cycle after the stall has no fresh command either.
            let after = run.dark();
            assert_eq!(after.laser.is_lit(), out > most, "{off_delay} s, {skipped} skipped");
            let report = run.bridge.report(RealtimeFacts::default());
            assert_eq!((report.gate_trips, report.missed), (1, skipped as u64 + 1));
        }
    }
}

#[test]
fn edges_before_a_stall_keep_their_places() {
    let mut pulses = LaserCycle::OFF;
    for (offset, gate) in [(100_000, 3), (250_000, 0), (990_000, 3)] {
        assert!(pulses.push(GateEdge { offset, gate, power: f64::from(gate.min(1)) }));
    }
    let mut run = Run::moving(&Machine::builtin(), 20);
    run.lit(pulses);
    run.dark();
    let laser = run.stall(4).laser;
    let mut expected = pulses;
    assert!(expected.push(GateEdge { offset: 1_000_000, gate: 0, power: 0.0 }));
    assert_eq!(laser, expected);
    assert!(!run.dark().laser.is_lit());
}

#[test]
fn a_stall_is_a_fault_exactly_when_it_is_longer_than_tolerated() {
    let machine = Machine::builtin();
    for tolerated in [1, 2, 3, 10, 50] {
        for cycles in [1, tolerated - 1, tolerated, tolerated + 1, tolerated + 7, 5000] {
            // All skipped but the last, all missed, or some of each.
            for skipped in [cycles - 1, 0, cycles / 2] {
                if cycles < 1 || cycles > 100 && skipped == 0 {
                    continue;
                }
                let mut run = Run::moving(&machine, tolerated);
                run.lit(lit());
                let misses = cycles - 1 - skipped;
                run.cycle(0, None);
                let mut feedback = run.cycle(skipped, (misses == 0).then_some(dark()));
                for left in (0..misses).rev() {
                    feedback = run.cycle(0, (left == 0).then_some(dark()));
                }
                let case = format!("{cycles} of {tolerated}, {skipped} skipped");
                let stopped = feedback.has(status::WATCHDOG_TRIPPED);
                assert_eq!(stopped, cycles > tolerated, "{case}");
                assert_eq!(feedback.missed, cycles as u64, "{case}");
                let fault = feedback.fault;
                if stopped {
                    assert_eq!(fault.code(), FaultCode::StaleCommand, "{case}");
                    assert_eq!(fault.limit, tolerated as f64, "{case}");
                    // Known is what has passed when drives finds it out.
                    assert!(fault.value > fault.limit && fault.value <= cycles as f64, "{case}");
                    assert!(skipped < cycles - 1 || fault.value == cycles as f64, "{case}");
                } else {
                    assert!(!fault.is_some(), "{case}");
                    assert!(!run.dark().has(status::COMMAND_MISSED), "{case}");
                }
            }
        }
    }
}

fn dark() -> (CommandMode, LaserCycle) {
    (CommandMode::Driven, LaserCycle::OFF)
}

#[test]
fn after_a_stall_too_long_the_axes_have_braked_and_rest_in_the_dark() {
    let mut run = Run::moving(&Machine::builtin(), 10);
    run.lit(lit());
    run.stall(1500);
    // The brake had more than a second.
    let still = run.dark();
    assert_eq!(run.dark().counts, still.counts);
    assert!(still.has(status::WATCHDOG_TRIPPED) && !still.laser.is_lit());
    let report = run.bridge.report(RealtimeFacts::default());
    assert_eq!((report.stops, report.missed, report.lit), (1, 1501, 0));
    assert_eq!((report.stalls.count, report.stalls.longest), (1, Nanoseconds(1501 * PERIOD)));
}

#[test]
fn each_stall_is_counted_once_with_its_length_and_place() {
    let mut run = Run::moving(&Machine::builtin(), 20);
    let first = run.dark().cycle;
    let check = |run: &mut Run, otherwise: u32, cycle: u64, cycles: i64| {
        let (number, stall) = run.bridge.take_stall().unwrap();
        assert_eq!((stall.cycle.0, stall.length.0), (first.0 + cycle, cycles * PERIOD));
        assert_eq!(
            (stall.began.0, stall.otherwise),
            (START + stall.cycle.0 as i64 * PERIOD, otherwise)
        );
        assert_eq!(run.bridge.take_stall(), None);
        number
    };
    // Drives late for three cycles; without an answer until the cycle after.
    run.stall(3);
    assert_eq!(run.bridge.take_stall(), None, "it has not ended");
    run.dark();
    let number = check(&mut run, 0, 1, 4);
    run.bridge.explain(number, StallCause::Steal.bit());
    // The controller late, for two cycles: 6 was answered before.
    run.cycle(0, None);
    run.cycle(0, None);
    run.dark();
    run.dark();
    check(&mut run, StallCause::LateAnswer.bit(), 7, 2);
    let stalls = run.bridge.report(RealtimeFacts::default()).stalls;
    assert_eq!((stalls.stream, stalls.count, stalls.total), (1, 2, Nanoseconds(6 * PERIOD)));
    assert_eq!(
        (stalls.longest, stalls.longest_cycle),
        (Nanoseconds(4 * PERIOD), Cycle(first.0 + 1))
    );
    assert_eq!(stalls.longest_causes, StallCause::Steal.bit());
    assert_eq!(stalls.causes, [1, 0, 0, 0, 0, 0, 0, 1]);
}

#[test]
fn a_clock_that_slips_skips_nothing_and_counts_what_it_waited() {
    let mut run = Run::new(&Machine::builtin(), 10, Deadlines::Slipping);
    run.cycle(0, Some((CommandMode::Disabled, LaserCycle::OFF)));
    for _ in 0..5 {
        run.dark();
    }
    let before = run.lit(lit());
    let feedback = run.stall(7);
    assert_eq!((feedback.cycle, feedback.skipped), (before.cycle.next(), 0));
    assert!(!feedback.has(status::COMMAND_MISSED));
    let (_, stall) = run.bridge.take_stall().unwrap();
    assert_eq!((stall.cycle, stall.length.0), (feedback.cycle, 7 * PERIOD));
    // Later by less than a period is a slip and no stall.
    run.deadline = run.deadline + Nanoseconds(PERIOD - 1);
    run.dark();
    assert_eq!(run.bridge.take_stall(), None);
    assert_eq!(run.bridge.report(RealtimeFacts::default()).slips, 2);
}

#[test]
fn a_hardware_port_is_told_of_passed_cycles_and_exchanges_only_once() {
    use std::sync::{Arc, Mutex};

    #[derive(Default)]
    struct Told {
        passed: Vec<Actuation>,
        exchanged: usize,
    }

    /// Keeps what it is told.
    struct Listening(Arc<Mutex<Told>>, Profile);

    impl Port for Listening {
        fn profile(&self) -> &Profile {
            &self.1
        }
        fn send(&mut self, _: &Actuation) {
            self.0.lock().unwrap().exchanged += 1;
        }
        fn receive(&mut self, _: &mut Measurement) {}
        fn pass(&mut self, actuation: &Actuation) {
            self.0.lock().unwrap().passed.push(*actuation);
        }
    }

    let told = Arc::new(Mutex::new(Told::default()));
    let profile = Profile::of(vec![ActuatorProfile::immediate(ActuatorMode::Voltage); 2]);
    let mut run = Run::over(Box::new(Listening(told.clone(), profile)), 3, Deadlines::Strict);
    run.cycle(0, Some((CommandMode::Disabled, LaserCycle::OFF)));
    run.lit(lit());
    run.lit(lit());
    run.stall(5);
    let told = told.lock().unwrap();
    assert_eq!((told.exchanged, told.passed.len()), (4, 5));
    assert!(told.passed.iter().all(|actuation| !actuation.laser.is_lit()));
    let modes: Vec<_> = told.passed.iter().map(|actuation| actuation.mode).collect();
    let [held, braking] = [CommandMode::Driven, CommandMode::QuickStop];
    assert_eq!(modes, [held, held, held, braking, braking]);
}
