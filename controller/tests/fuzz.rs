//! Whatever comes in, in any order: no step panics, and light is only given where the stream has it
//! and nothing speaks against it.

#![allow(clippy::unwrap_used)]

mod support;

use controller::{Controller, Inputs, Outputs, Peers, Presence};
use machine::{Machine, StallTolerance};
use messages::feedback::status;
use messages::random::SplitMix64;
use messages::{
    CommandMode, ControllerState, Feedback, Nanoseconds, OperatorRequest, OperatorVerb, Setpoint,
};
use support::{Job, Move, Part, home, job, load};
use zerocopy::{FromBytes, IntoBytes};

/// Steps of one case.
const STEPS: u64 = 1200;

/// `sample` with one of its bits turned round, or with 8 bytes of it at random.
fn spoilt<T: IntoBytes + FromBytes + zerocopy::Immutable>(
    sample: &T,
    random: &mut SplitMix64,
) -> T {
    let mut bytes = sample.as_bytes().to_vec();
    let at = random.below(bytes.len() as u64) as usize;
    if random.below(2) == 0 {
        bytes[at] ^= 1 << random.below(8);
    } else {
        let at = at / 8 * 8;
        let word = random.bits().to_le_bytes();
        let end = bytes.len().min(at + 8);
        bytes[at..end].copy_from_slice(&word[..end - at]);
    }
    T::read_from_bytes(&bytes).unwrap()
}

fn work(machine: &Machine) -> Job {
    let path = Move::new(0.03, 0.2, 10.0, 500.0);
    let parts = [
        Part::Dot(0.004),
        Part::Rest(0.01),
        Part::Mark(path.clone(), [1.0, 0.4]),
        Part::Rest(0.1),
        Part::Pause,
        Part::Rest(0.1),
        Part::Dot(0.003),
        Part::Mark(path, [-1.0, 0.3]),
        Part::Rest(0.05),
    ];
    job(machine, 1, &parts, 0.5)
}

/// One run of the controller against inputs that `random` chooses, of which about one in `doubts` steps
/// has something wrong. Gives the cycles with light and the states seen.
fn play(machine: &Machine, job: &Job, doubts: u64, random: &mut SplitMix64) -> (u64, [u64; 7]) {
    let mut controller = Controller::new(machine);
    let mut outputs = Outputs::default();
    let mut feedback = Feedback { epoch: 3, status: status::POWERED, ..Feedback::default() };
    for (index, actuator) in machine.actuators.iter().enumerate().take(2) {
        feedback.position[index] = home(machine)[index] / actuator.ratio;
    }
    let (mut sent, mut lit, mut seen) = (0, 0, [0; 7]);
    // Whether all setpoints that came in were the job's.
    let mut clean = true;
    for step in 1..STEPS {
        let doubtful = |random: &mut SplitMix64| random.below(doubts) == 0;
        let skipped = if doubtful(random) { random.below(14) } else { 0 };
        feedback.cycle.0 += 1 + skipped;
        feedback.missed += skipped + u64::from(skipped > 0 || doubtful(random));
        feedback.skipped = skipped as u16;
        let follows = outputs.command.mode() == CommandMode::Driven;
        if follows {
            feedback.position = outputs.command.reference;
        }
        let told = if doubtful(random) { spoilt(&feedback, random) } else { feedback };
        let peers = Peers {
            planner: presence(random.below(20 * doubts) == 0),
            drives: presence(random.below(20 * doubts) == 0),
            supervisor: presence(random.below(20 * doubts) == 0),
        };
        let request = match step {
            5 => Some((OperatorVerb::Enable as u32, 0.0)),
            40 => Some((OperatorVerb::Start as u32, 1.0)),
            _ if random.below(60) == 0 => {
                let verb = random.below(12) as u32;
                let value = if random.below(2) == 0 {
                    random.between(0.0, 2.5)
                } else {
                    f64::from_bits(random.bits())
                };
                Some((verb, value))
            }
            _ => None,
        };
        let request = request.map(|(verb, value)| OperatorRequest {
            verb,
            ticket: 9,
            value,
            ..OperatorRequest::default()
        });
        // A planner that is late now and then.
        let room = controller.room().min(random.below(9) as usize);
        let end = (sent + room).min(job.setpoints.len());
        let mut setpoints: Vec<Setpoint> = job.setpoints[sent..end].to_vec();
        sent = end;
        if random.below(10 * doubts) == 0
            && let Some(setpoint) = setpoints.last_mut()
        {
            *setpoint = spoilt(setpoint, random);
            clean = false;
        }
        let inputs = Inputs {
            feedback: &told,
            received: Nanoseconds(step as i64),
            setpoints: &setpoints,
            request,
            peers,
            slow: 0,
        };
        let state_before = outputs.command.state();
        controller.step(Nanoseconds(step as i64), &inputs, &mut outputs);

        let command = &outputs.command;
        seen[command.state as usize] += 1;
        let targets = [command.position, command.velocity, command.effort, command.voltage];
        assert!(targets.iter().flatten().all(|target| target.is_finite()), "{targets:?}");
        assert!(command.laser.is_valid(messages::time::SETPOINT_PERIOD), "{:?}", command.laser);
        if !command.laser.is_lit() {
            continue;
        }
        lit += 1;
        let state = command.state();
        assert!(matches!(state, ControllerState::Running), "lit in {state:?}");
        assert_eq!(peers, Peers::default(), "lit without a peer");
        assert!(!command.fault.is_some() && !told.fault.is_some(), "{:?}", command.fault);
        let against = status::GATE_INHIBITED | status::WATCHDOG_TRIPPED;
        assert!(told.status & against == 0 && told.has(status::POWERED), "{:b}", told.status);
        let stop = [OperatorVerb::Hold, OperatorVerb::Stop].map(|verb| verb as u32);
        let stopped = request.is_some_and(|request| stop.contains(&request.verb));
        assert!(!stopped, "lit right after a hold, from {state_before:?}");
        let begin = (command.stream_time * 1e3).floor() as usize;
        let around = begin..(begin + 4).min(job.setpoints.len());
        let due = job.setpoints[around].iter().any(|setpoint| setpoint.laser.is_lit());
        assert!(due || !clean, "lit at {} s", command.stream_time);
    }
    (lit, seen)
}

fn presence(lost: bool) -> Presence {
    if lost { Presence::Lost } else { Presence::Present }
}

#[test]
fn whatever_comes_in_no_step_panics_and_no_light_is_given_that_is_not_due() {
    let mut builtin = Machine::builtin();
    let period = builtin.realtime.period;
    builtin.realtime.stall = StallTolerance::new(period.of(12), period).unwrap();
    let mut steppers = load("cartesian_steppers.toml");
    steppers.laser.min_power = 0.2;
    let (mut lit, mut seen) = (0, [0; 7]);
    for machine in [builtin, steppers] {
        let job = work(&machine);
        for seed in 0..400 {
            let mut random = SplitMix64::new(seed);
            // From a doubt every few cycles to one in a run.
            let doubts = 10 << random.below(8);
            let (cycles, states) = play(&machine, &job, doubts, &mut random);
            lit += cycles;
            for (all, state) in seen.iter_mut().zip(states) {
                *all += state;
            }
        }
    }
    // All of it came up.
    assert!(lit > 10_000, "{lit} cycles lit");
    assert!(seen.iter().all(|state| *state > 100), "{seen:?}");
}
