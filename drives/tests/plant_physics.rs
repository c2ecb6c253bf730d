//! The plant against what mechanics says of it: energy, order of the integration, stiction, the
//! belt's stretch and modes, saturation, encoders.
#![allow(clippy::unwrap_used)]

mod shaft;

use drives::plant::dynamics::Dynamics;
use drives::plant::motors::Motors;
use drives::plant::state::{Phases, State};
use drives::plant::{Plant, PlantOptions, friction};
use drives::{Actuation, Freshness, Measurement, Port};
use machine::transmission::Elasticity;
use machine::{CoreXy, Friction, LaserSource, Machine, MechanismKind};
use messages::{CommandMode, axis::actuator_array};
use nalgebra::{Vector1, Vector2};
use shaft::Shaft;

const SUBSTEP: f64 = 50e-6;
const DARK: LaserSource = LaserSource::IDEAL;

fn corexy() -> CoreXy {
    match Machine::builtin().mechanism {
        MechanismKind::CoreXy(corexy) => corexy,
        other => panic!("the built-in machine is a {}", other.name()),
    }
}

/// The belts without their dampers.
fn undamped() -> CoreXy {
    let spring = |spring: Elasticity| Elasticity { damping: 0.0, ..spring };
    let mut corexy = corexy();
    corexy.elasticity = corexy.elasticity.map(|springs| springs.map(spring));
    corexy
}

/// The built-in machine with other friction.
fn machine(friction: Friction) -> Machine {
    let mut machine = Machine::builtin();
    machine.actuators.iter_mut().for_each(|actuator| actuator.friction = friction);
    machine
}

fn motors(friction: Friction) -> Motors<2> {
    let Machine { axes, actuators, .. } = machine(friction);
    Motors::of(&axes, &actuators)
}

/// A bare shaft's motor.
fn bare(actuator: machine::Actuator) -> Motors<1> {
    Motors::of(&[shaft::axis()], &[actuator])
}

const SMOOTH: Friction = Friction { coulomb: 0.0, viscous: 0.0 };

fn plant(mechanism: CoreXy, machine: &Machine) -> Plant<2, CoreXy> {
    let Machine { axes, actuators, home_joints, .. } = machine;
    Plant::new(
        mechanism,
        axes,
        actuators,
        &DARK,
        home_joints,
        messages::time::Period::OF_SETPOINTS,
        PlantOptions::default(),
    )
    .unwrap()
}

fn voltage(voltage: &[f64]) -> Actuation {
    Actuation {
        freshness: Freshness::Fresh,
        mode: CommandMode::Driven,
        voltage: actuator_array(voltage),
        ..Actuation::DISABLED
    }
}

/// Exchanges once to put `actuation` in force and once to see its cycle through.
fn cycle(port: &mut impl Port, actuation: &Actuation) -> Measurement {
    let mut measurement = Measurement::default();
    port.exchange(actuation, &mut measurement);
    measurement
}

fn at_rest() -> State<2> {
    let zero = Vector2::zeros();
    State { current: zero, angle: zero, speed: zero, load: zero, load_speed: zero }
}

/// Energy in rotors, load, belts and windings [J].
fn energy(dynamics: &Dynamics<2, CoreXy>, state: &State<2>) -> f64 {
    use machine::Mechanism;
    let motors = dynamics.motors();
    let stretch = motors.ratio.component_mul(&state.angle) - state.load;
    let square = |v: &Vector2<f64>| v.component_mul(v);
    let rotors = motors.inertia.dot(&square(&state.speed));
    let load =
        state.load_speed.dot(&(dynamics.mechanism().mass_matrix(&state.load) * state.load_speed));
    let belts = stretch.dot(&(dynamics.mechanism().stiffness().unwrap() * stretch));
    let windings = motors.windings.inductance.dot(&square(&state.current));
    0.5 * (rotors + load + belts + windings)
}

#[test]
fn a_free_elastic_plant_keeps_its_energy() {
    let mut dynamics = Dynamics::new(undamped(), motors(SMOOTH), Vector2::zeros()).unwrap();
    let weights = dynamics.motors().windings.weights(SUBSTEP);
    let mut state = State { load: Vector2::new(2e-4, -1e-4), ..at_rest() };
    let before = energy(&dynamics, &state);
    for _ in 0..20_000 {
        state = friction::advance(&mut dynamics, &state, &Phases::Open, &weights).unwrap();
    }
    let drift = (energy(&dynamics, &state) / before - 1.0).abs();
    println!("energy drift over 1 s: {drift:e}");
    // RK4 loses (w·h)⁶/72 a step: at 453 rad/s and 50 µs some 4e-8 over a second.
    assert!(drift < 1e-7, "{drift:e}");
}

#[test]
fn electrical_work_is_heat_and_stored_energy() {
    let mut dynamics = Dynamics::new(undamped(), motors(SMOOTH), Vector2::zeros()).unwrap();
    let weights = dynamics.motors().windings.weights(SUBSTEP);
    let volts = Vector2::new(6.0, -2.0);
    let resistance = dynamics.motors().windings.resistance;
    let power = |state: &State<2>| {
        volts.dot(&state.current) - resistance.dot(&state.current.component_mul(&state.current))
    };
    let mut state = at_rest();
    let mut work = 0.0;
    for _ in 0..1000 {
        // Simpson's rule over two substeps.
        let middle =
            friction::advance(&mut dynamics, &state, &Phases::Driven(volts), &weights).unwrap();
        let end =
            friction::advance(&mut dynamics, &middle, &Phases::Driven(volts), &weights).unwrap();
        work += (power(&state) + 4.0 * power(&middle) + power(&end)) * SUBSTEP / 3.0;
        state = end;
    }
    let error = (energy(&dynamics, &state) / work - 1.0).abs();
    println!("work against energy after 0.1 s: {error:e}");
    assert!(error < 1e-6, "{error:e}");
}

/// Load and motor positions after 20 ms at a substep, under a voltage that reverses.
fn swing(friction: Friction, substep: f64) -> [f64; 4] {
    let mut dynamics = Dynamics::new(corexy(), motors(friction), Vector2::zeros()).unwrap();
    let weights = dynamics.motors().windings.weights(substep);
    let steps = (5e-3 / substep).round() as usize;
    let mut state = at_rest();
    for volts in [[8.0, 3.0], [-8.0, 5.0], [2.0, -6.0], [-1.0, 6.0]] {
        let phases = Phases::Driven(Vector2::from(volts));
        for _ in 0..steps {
            state = friction::advance(&mut dynamics, &state, &phases, &weights).unwrap();
        }
    }
    let ratio = dynamics.motors().ratio;
    [state.load[0], state.load[1], state.angle[0] * ratio[0], state.angle[1] * ratio[1]]
}

fn error(friction: Friction, substep: f64, exact: &[f64; 4]) -> f64 {
    let ours = swing(friction, substep);
    ours.iter().zip(exact).map(|(ours, exact)| (ours - exact).abs()).fold(0.0, f64::max)
}

#[test]
fn halving_the_substep_divides_the_error_by_sixteen() {
    let exact = swing(SMOOTH, SUBSTEP / 32.0);
    let errors = [1.0, 2.0, 4.0].map(|parts| error(SMOOTH, SUBSTEP / parts, &exact));
    println!("smooth: {errors:?} m");
    // Fourth order: 16, less what the next order adds at these steps.
    for pair in errors.windows(2) {
        assert!((12.0..20.0).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
    assert!(errors[0] < 1e-9, "{errors:?}");
}

#[test]
fn friction_does_not_lower_the_accuracy_below_a_nanometre() {
    let friction = Friction { coulomb: 5e-3, viscous: 1e-6 };
    let exact = swing(friction, SUBSTEP / 64.0);
    let errors = [1.0, 2.0, 4.0, 8.0].map(|parts| error(friction, SUBSTEP / parts, &exact));
    println!("with friction: {errors:?} m");
    assert!(errors[0] < 1e-9, "{errors:?}");
    // At least second order from the coarsest to the finest.
    assert!(errors[0] / errors[3] > 64.0, "{errors:?}");
}

#[test]
fn torque_below_stiction_never_creeps() {
    let machine = Machine::builtin();
    let motor = *machine.actuators[0].motor.dc().unwrap();
    let breakaway =
        motor.voltage(machine.actuators[0].friction.coulomb / motor.torque_constant, 0.0, 0.0);
    let mut plant = plant(corexy(), &machine);
    let start = *plant.state();
    for _ in 0..1000 {
        cycle(&mut plant, &voltage(&[0.99 * breakaway, -0.99 * breakaway]));
    }
    assert_eq!(plant.state().angle, start.angle);
    assert_eq!(plant.state().load, start.load);
    assert_eq!(plant.state().speed, Vector2::zeros());
    for _ in 0..20 {
        cycle(&mut plant, &voltage(&[1.01 * breakaway, -1.01 * breakaway]));
    }
    assert!(plant.state().angle[0] > start.angle[0] && plant.state().angle[1] < start.angle[1]);
}

#[test]
fn a_sliding_rotor_stops_where_and_when_friction_says() {
    let (inertia, coulomb, speed) = (2e-6, 5e-3, 97.3);
    let actuator = shaft::actuator(inertia, Friction { coulomb, viscous: 0.0 });
    let mut dynamics =
        Dynamics::new(Shaft { load: 0.0, spread: 0.0 }, bare(actuator), Vector1::zeros()).unwrap();
    let weights = dynamics.motors().windings.weights(SUBSTEP);
    let zero = Vector1::zeros();
    let mut state = State {
        current: zero,
        angle: zero,
        speed: Vector1::new(speed),
        load: zero,
        load_speed: zero,
    };
    let time = speed * inertia / coulomb;
    let before = (time / SUBSTEP).floor() as usize;
    for _ in 0..before {
        state = friction::advance(&mut dynamics, &state, &Phases::Open, &weights).unwrap();
    }
    let exact = speed - coulomb / inertia * SUBSTEP * before as f64;
    assert!((state.speed[0] - exact).abs() < 1e-11 * speed, "{} {exact}", state.speed[0]);
    for _ in 0..10 {
        state = friction::advance(&mut dynamics, &state, &Phases::Open, &weights).unwrap();
        assert_eq!(state.speed[0], 0.0);
    }
    let distance = speed * speed * inertia / (2.0 * coulomb);
    assert!((state.angle[0] / distance - 1.0).abs() < 1e-12, "{} {distance}", state.angle[0]);
}

#[test]
fn an_inertia_that_grows_slows_the_shaft_by_its_energy() {
    let (rotor, spread, speed) = (2e-6, 5e-6, 40.0);
    let actuator = shaft::actuator(rotor, SMOOTH);
    let mut dynamics =
        Dynamics::new(Shaft { load: 0.0, spread }, bare(actuator), Vector1::zeros()).unwrap();
    let weights = dynamics.motors().windings.weights(SUBSTEP);
    let zero = Vector1::zeros();
    let start = Vector1::new(speed);
    let mut state =
        State { current: zero, angle: zero, speed: start, load: zero, load_speed: start };
    for _ in 0..10_000 {
        state = friction::advance(&mut dynamics, &state, &Phases::Open, &weights).unwrap();
    }
    let angle = state.angle[0];
    assert!(angle > 2.0, "{angle}");
    let inertia = |angle: f64| rotor + spread * (1.0 + angle * angle);
    let exact = speed * (inertia(0.0) / inertia(angle)).sqrt();
    assert!((state.speed[0] / exact - 1.0).abs() < 1e-9, "{} {exact}", state.speed[0]);
}

#[test]
fn one_motor_can_stick_while_the_other_moves_a_rigid_machine() {
    // Rigid belts couple the motors through the load: pushing one accelerates the other.
    let rigid = CoreXy { elasticity: None, ..corexy() };
    let mut plant = plant(rigid, &Machine::builtin());
    let start = *plant.state();
    for _ in 0..10 {
        cycle(&mut plant, &voltage(&[1.2, 0.0]));
    }
    let state = *plant.state();
    assert!(state.angle[0] > start.angle[0] + 0.05, "{}", state.angle[0] - start.angle[0]);
    assert_eq!(state.angle[1], start.angle[1]);
    // Source 003 eq. 4.1: one belt alone moves the head along the diagonal.
    let ratio = plant.dynamics().motors().ratio;
    assert_eq!(state.load, ratio.component_mul(&state.angle));
}

/// Stretch of the belts over the acceleration of the load, along a direction of the tool [s²].
fn stretch(direction: [f64; 2]) -> f64 {
    let machine = Machine::builtin();
    let motor = *machine.actuators[0].motor.dc().unwrap();
    let ratio = machine.actuators[0].ratio;
    let mut plant = plant(corexy(), &self::machine(SMOOTH));
    let [x, y] = direction;
    let belts = [x + y, x - y];
    // The voltage of a motor that accelerates at the load's 10 m/s², cycle by cycle.
    let mass = if y == 0.0 { 0.33 } else { 1.06 };
    let mut before = Vector2::zeros();
    for index in 0..45 {
        let middle = (f64::from(index) + 0.5) * 1e-3;
        let angular = 10.0 / ratio;
        let torque = motor.rotor_inertia * angular + mass * 10.0 * ratio / 2.0;
        let volts = motor.voltage(torque / motor.torque_constant, 0.0, angular * middle);
        before = plant.state().load_speed;
        cycle(&mut plant, &voltage(&belts.map(|belt| belt * volts)));
    }
    let after = plant.state().load_speed;
    let acceleration = (after - before)[0] / 1e-3 / belts[0];
    let state = plant.state();
    let lead = plant.dynamics().motors().ratio.component_mul(&state.angle) - state.load;
    lead[0] / belts[0] / acceleration
}

#[test]
fn belts_stretch_by_mass_over_stiffness() {
    // Source 003: 55 µm in x and 177 µm in y at 10 m/s². The acceleration is steady within what
    // the voltage's steps leave, under 1 %.
    for (direction, expected) in [([1.0, 0.0], 55e-6), ([0.0, 1.0], 176.7e-6)] {
        let stretch = 10.0 * stretch(direction);
        println!("{direction:?}: {:.2} µm", stretch * 1e6);
        assert!((stretch / expected - 1.0).abs() < 0.01, "{direction:?}: {stretch}");
    }
}

/// Frequency of the load on held motors along a direction of the tool [Hz].
fn mode(direction: [f64; 2]) -> f64 {
    let stuck = motors(Friction { coulomb: 1e3, viscous: 0.0 });
    let mut dynamics = Dynamics::new(undamped(), stuck, Vector2::zeros()).unwrap();
    let weights = dynamics.motors().windings.weights(SUBSTEP);
    let [x, y] = direction;
    let mut state = State { load: Vector2::new(x + y, x - y) * 1e-5, ..at_rest() };
    let (mut first, mut last, mut count) = (0.0, 0.0, 0);
    for index in 0..20_000 {
        let next = friction::advance(&mut dynamics, &state, &Phases::Open, &weights).unwrap();
        if state.load[0] < 0.0 && next.load[0] >= 0.0 {
            let share = state.load[0] / (state.load[0] - next.load[0]);
            last = (f64::from(index) + share) * SUBSTEP;
            if count == 0 {
                first = last;
            }
            count += 1;
        }
        state = next;
    }
    f64::from(count - 1) / (last - first)
}

#[test]
fn the_load_swings_on_its_belts_at_68_and_38_hertz() {
    // √(K/m)/2π with K = 60 N/mm and m = 0.33 or 1.06 kg.
    for (direction, expected) in [([1.0, 0.0], 67.864), ([0.0, 1.0], 37.866)] {
        let mode = mode(direction);
        println!("{direction:?}: {mode:.4} Hz");
        assert!((mode / expected - 1.0).abs() < 1e-4, "{direction:?}: {mode}");
    }
}

#[test]
fn voltage_and_current_saturate() {
    let machine = Machine::builtin();
    let mut asked = plant(corexy(), &machine);
    let mut limited = plant(corexy(), &machine);
    for _ in 0..50 {
        cycle(&mut asked, &voltage(&[1000.0, -1000.0]));
        cycle(&mut limited, &voltage(&[12.0, -12.0]));
    }
    assert_eq!(asked.state(), limited.state());
    // Full reverse at speed asks for nearly twice the stall current.
    let mut most: f64 = 0.0;
    for _ in 0..20 {
        let measurement = cycle(&mut asked, &voltage(&[-1000.0, 1000.0]));
        most = most.max(measurement.current[0].abs());
    }
    assert_eq!(most, 5.2);
}

#[test]
fn encoders_count_whole_counts_from_power_on() {
    let machine = Machine::builtin();
    let resolution = core::f64::consts::TAU / 4096.0;
    let mut plant = plant(corexy(), &machine);
    let origin = plant.state().angle;
    let first = cycle(&mut plant, &voltage(&[3.0, -1.0]));
    assert_eq!(first.counts, [0; messages::MAX_ACTUATORS]);
    assert_eq!(first.position[..2], [origin[0], origin[1]]);
    for _ in 0..50 {
        let measurement = cycle(&mut plant, &voltage(&[3.0, -1.0]));
        for (axis, origin) in origin.iter().enumerate() {
            let truth = plant.state().angle[axis];
            let error = measurement.position[axis] - truth;
            assert!(error.abs() <= 0.5 * resolution * (1.0 + 1e-9), "{error}");
            let counted = origin + measurement.counts[axis] as f64 * resolution;
            assert_eq!(measurement.position[axis], counted);
        }
    }
    assert!(plant.state().angle[0] - origin[0] > 100.0 * resolution);
}

#[test]
fn an_elastic_lift_holds_its_height_on_the_brake() {
    use machine::Cartesian;
    let mut actuator = shaft::actuator(2e-6, Friction { coulomb: 1e-3, viscous: 1e-6 });
    actuator.ratio = 0.015 / core::f64::consts::TAU / 3.0;
    let mass = [1.0, 1.0, 5.0];
    let spring = Elasticity { stiffness: 1e6, damping: 500.0 };
    actuator.gains.inertia = 2e-6 + 5.0 * actuator.ratio * actuator.ratio;
    let (axes, actuators) = shaft::alike(&actuator, 3);
    let lift = Cartesian { elasticity: Some([spring; 3]), ..Cartesian::rigid(mass) };
    let mut plant: Plant<3, _> = Plant::new(
        lift,
        &axes,
        &actuators,
        &DARK,
        &[0.1, 0.1, 0.05],
        messages::time::Period::OF_SETPOINTS,
        PlantOptions::default(),
    )
    .unwrap();
    let mut measurement = Measurement::default();
    for _ in 0..2000 {
        measurement = cycle(&mut plant, &Actuation::QUICK_STOP);
    }
    // Gravity asks for 0.039 N·m, far above the friction; the integral holds it to a count or two.
    let sag = 0.05 - measurement.tool.unwrap()[2];
    let count = actuators[2].encoder.resolution() * actuators[2].ratio;
    assert!(sag.abs() < 2.0 * count, "{sag} against counts of {count}");
    assert!(plant.state().speed[2].abs() < 1e-3, "{}", plant.state().speed[2]);
}

#[test]
fn two_runs_give_the_same_bits() {
    let run = || {
        let mut plant = plant(corexy(), &Machine::builtin());
        for index in 0..500_u32 {
            let volts = f64::from((index * 7919) % 1900) / 100.0 - 9.5;
            cycle(&mut plant, &voltage(&[volts, -0.5 * volts]));
        }
        let state = *plant.state();
        [state.current, state.angle, state.speed, state.load, state.load_speed]
            .map(|vector| [vector[0].to_bits(), vector[1].to_bits()])
    };
    assert_eq!(run(), run());
}
