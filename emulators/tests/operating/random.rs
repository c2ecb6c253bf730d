//! A thousand random sequences of requests and inputs.

use super::cell::{self, CHILLER, Cell, DOOR, ESTOP};
use controller::travel::Pace;
use machine::Machine;
use messages::random::SplitMix64;
use messages::{CommandMode, ControllerState as State, MAX_AXES, OperatorRequest, OperatorVerb};

const COREXY: &str = include_str!("../../../machines/corexy.toml");

/// Cycles of a sequence.
const CYCLES: u32 = 1200;

/// How much more than a limit a reference may change: rounding.
const EXCESS: f64 = 1.01;

#[test]
fn a_thousand_random_sequences_never_jump_and_never_light_unasked() {
    let mut machine = cell::machine("");
    // Near the ends, so that sequences of a second reach them.
    for input in &mut machine.operating.inputs {
        let Some(switch) = &mut input.simulated else { continue };
        switch.at = match input.name.as_str() {
            "x_home" => 0.095,
            "x_min" => 0.085,
            "x_max" => 0.115,
            "y_home" => 0.105,
            "probe" => 0.107,
            _ => switch.at,
        };
    }
    let lit: u32 = (1..=1000).map(|seed| sequence(&machine, seed)).sum();
    assert!(lit > 1000, "pulses were tried: {lit} cycles lit");
}

#[test]
fn random_sequences_on_a_corexy_never_lead_its_tool_out_of_the_area() {
    let machine = Machine::parse("corexy.toml", COREXY, &[]).unwrap();
    let mut far = 0;
    for seed in 1..=300 {
        let mut random = SplitMix64::new(seed);
        let mut cell = Cell::enabled(&machine);
        let mut newest = (0, 0.0);
        for cycle in 0..2 * CYCLES {
            let request = (random.fraction() < 0.03).then(|| direct(&mut random, newest));
            cell.cycle(request);
            let jog = request.filter(|it| it.verb == OperatorVerb::Jog as u32);
            if let (Some(jog), Some(reply)) = (jog, cell.outputs.reply)
                && reply.accepted == 1
            {
                newest = (jog.axis, f64::from(reply.number));
            }
            judge(&cell, &machine, seed, cycle);
            let tool = cell.outputs.command.tool;
            for axis in 0..2 {
                let (lower, upper) = (machine.area.lower[axis], machine.area.upper[axis]);
                let is_inside = (lower - 1e-9..=upper + 1e-9).contains(&tool[axis]);
                assert!(is_inside, "seed {seed}, cycle {cycle}: {tool:?}");
                let end = (tool[axis] - lower).min(upper - tool[axis]);
                far += u32::from(end < 2e-3);
            }
        }
    }
    assert!(far > 1000, "only {far} cycles near an end of the area");
}

/// A jog or a step of a belt or of the tool along x, y or z, or a word for the newest jog.
fn direct(random: &mut SplitMix64, newest: (u32, f64)) -> OperatorRequest {
    let movers = [1, 2, MAX_AXES as u32 + 1, MAX_AXES as u32 + 2, MAX_AXES as u32 + 3];
    let axis = movers[(random.fraction() * 5.0) as usize];
    let sign = if random.fraction() < 0.5 { -1.0 } else { 1.0 };
    let (verb, value, second) = match (random.fraction() * 8.0) as u32 {
        0 | 1 => (OperatorVerb::Jog, sign * random.fraction() * 0.4, 0.0),
        2 => (OperatorVerb::Stop, 0.0, 0.0),
        3 => (OperatorVerb::Step, sign * random.fraction() * 0.15, random.fraction() * 0.3),
        _ => (OperatorVerb::JogOn, newest.1, 0.0),
    };
    let axis = if verb == OperatorVerb::JogOn { newest.0 } else { axis };
    OperatorRequest { verb: verb as u32, ticket: 7, axis, reserved: 0, value, second }
}

/// Plays the sequence of a seed; cycles in which there was light.
fn sequence(machine: &Machine, seed: u64) -> u32 {
    let mut random = SplitMix64::new(seed);
    let mut cell = Cell::new(machine);
    cell.run(3);
    let (mut inputs, mut pulse_left, mut lit) = (0, 0.0, 0);
    for cycle in 0..CYCLES {
        let request =
            (cycle == 0 || random.fraction() < 0.02).then(|| wish(&mut random, cycle == 0));
        if random.fraction() < 0.003 {
            inputs ^= [ESTOP, DOOR, DOOR, CHILLER][(random.fraction() * 4.0) as usize];
            cell.bridge.set_inputs(inputs);
        }
        let forbidden = cell.feedback().inputs & (ESTOP | DOOR | CHILLER) != 0 && inputs != 0;
        cell.cycle(request);
        let pulse = request.filter(|it| it.verb == OperatorVerb::TestPulse as u32);
        if let (Some(pulse), Some(reply)) = (pulse, cell.outputs.reply)
            && reply.accepted == 1
        {
            pulse_left = pulse.second;
        }
        if cell.outputs.command.laser.is_lit() {
            lit += 1;
            let now = cell.feedback().inputs & (ESTOP | DOOR | CHILLER);
            assert!(cell.state() == State::Pulsing, "seed {seed}: light while {:?}", cell.state());
            assert!(pulse_left > -1e-9 && now == 0 && !forbidden, "seed {seed}, cycle {cycle}");
            pulse_left -= 1e-3;
        }
        judge(&cell, machine, seed, cycle);
    }
    lit
}

/// A request of any kind, most of them sensible.
fn wish(random: &mut SplitMix64, is_first: bool) -> OperatorRequest {
    use OperatorVerb::*;
    let verbs = [
        Enable, Enable, Disable, Hold, Resume, Stop, Reset, Override, Start, Home, Jog, Jog, JogOn,
        JogOn, Jog, Step, Step, TestPulse, TestPulse, Probe,
    ];
    let verb = verbs[(random.fraction() * verbs.len() as f64) as usize];
    let verb = if is_first { Enable } else { verb };
    let sign = if random.fraction() < 0.5 { -1.0 } else { 1.0 };
    let odd = random.fraction() < 0.1;
    let (value, second) = match verb {
        Jog => (sign * random.fraction() * 0.3, 0.0),
        Step | Probe => (sign * random.fraction() * 0.02, random.fraction() * 0.2),
        TestPulse => (random.fraction() * 0.12, random.fraction() * 0.11),
        Start => (1.0, 0.0),
        JogOn => ((random.fraction() * 40.0).floor(), 0.0),
        _ => (random.fraction() * 2.0, 0.0),
    };
    let value = if odd {
        [f64::NAN, -1e9, f64::INFINITY][(random.fraction() * 3.0) as usize]
    } else {
        value
    };
    let axis = (random.fraction() * 3.3) as u32;
    OperatorRequest { verb: verb as u32, ticket: 7, axis, reserved: 0, value, second }
}

/// While the axes follow the plan, the plan keeps the limits of their motion from cycle to cycle.
fn judge(cell: &Cell, machine: &Machine, seed: u64, cycle: u32) {
    let [first, second] = &cell.before;
    let third = &cell.outputs.command;
    if [first, second, third].iter().any(|it| it.mode() != CommandMode::Driven) {
        return;
    }
    // The plan is taken from the feedback while the axes are enabled.
    if [first, second, third].iter().any(|it| it.state() == State::Enabling) {
        return;
    }
    for (index, actuator) in machine.actuators.iter().enumerate() {
        let pace = Pace::new(machine, &machine.axes[actuator.axis]);
        let joint = |command: &messages::Command| command.reference[index] * actuator.ratio;
        let speed = (joint(third) - joint(second)) * 1e3;
        let change = (joint(third) - 2.0 * joint(second) + joint(first)) * 1e6;
        let at = || format!("seed {seed}, cycle {cycle}, {}, {:?}", actuator.name, third.state());
        assert!(speed.abs() <= EXCESS * pace.velocity / 0.85, "{}: {speed} m/s", at());
        assert!(change.abs() <= EXCESS * pace.acceleration, "{}: {change} m/s²", at());
    }
}
