//! The motor against independent solutions: exact responses of `V = R·i + L·i′ + k·ω`,
//! `J·ω̇ = k·i − γ·ω − T` for both motors of source 003, at the default substep.
#![allow(clippy::unwrap_used)]

mod shaft;

use drives::plant::dynamics::Dynamics;
use drives::plant::friction;
use drives::plant::motors::Motors;
use drives::plant::state::{Phases, State};
use machine::Friction;
use nalgebra::Vector1;
use serde_json::Value;
use shaft::Shaft;

const SUBSTEP: f64 = 50e-6;

/// Relative tolerance of the response at the default substep: fourth order at 50 µs leaves some
/// 1e-8 while the current rises, and the golden numbers carry 1e-12.
const TOLERANCE: f64 = 1e-6;

fn golden() -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/golden/dc_motor.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is missing"))
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn motor(parameters: &Value, inertia: f64, friction: Friction, load: f64) -> Dynamics<1, Shaft> {
    let mut actuator = shaft::actuator(inertia, friction);
    let motor = actuator.motor.dc_mut().unwrap();
    motor.resistance = number(parameters, "R");
    motor.inductance = number(parameters, "L");
    motor.torque_constant = number(parameters, "kt");
    motor.voltage = number(parameters, "U");
    let motors = Motors::of(&[shaft::axis()], &[actuator]);
    Dynamics::new(Shaft { load, spread: 0.0 }, motors, Vector1::zeros()).unwrap()
}

fn rest() -> State<1> {
    let zero = Vector1::zeros();
    State { current: zero, angle: zero, speed: zero, load: zero, load_speed: zero }
}

/// The states at `times` [s] under `voltage`, whole numbers of substeps apart.
fn respond(
    dynamics: &mut Dynamics<1, Shaft>,
    start: State<1>,
    voltage: f64,
    times: &[f64],
) -> Vec<State<1>> {
    let weights = dynamics.motors().windings.weights(SUBSTEP);
    let phases = Phases::Driven(Vector1::new(voltage));
    let (mut state, mut done) = (start, 0);
    times
        .iter()
        .map(|time| {
            let steps = (time / SUBSTEP).round() as usize;
            for _ in done..steps {
                state = friction::advance(dynamics, &state, &phases, &weights).unwrap();
            }
            done = steps;
            state
        })
        .collect()
}

fn assert_close(name: &str, ours: f64, golden: f64, scale: f64) -> f64 {
    let error = (ours - golden).abs() / golden.abs().max(1e-3 * scale);
    assert!(error <= TOLERANCE, "{name}: {ours} against {golden}, relative {error:e}");
    error
}

#[test]
fn responses_agree_with_the_exact_solution() {
    let golden = golden();
    let mut worst: f64 = 0.0;
    for name in ["EC035.120", "EC020.120"] {
        let parameters = &golden[name]["params"];
        let voltage = number(parameters, "U");
        for case in golden[name]["cases"].as_array().unwrap() {
            let locked = case["name"] == "locked";
            let mut dynamics = if locked {
                // Stiction that nothing overcomes.
                let friction = Friction { coulomb: 1e3, viscous: 0.0 };
                motor(parameters, 2e-6, friction, 0.0)
            } else {
                let friction = Friction { coulomb: 0.0, viscous: number(case, "gamma") };
                motor(parameters, number(case, "J"), friction, number(case, "T_load"))
            };
            let times = numbers(&case["t"]);
            let states = respond(&mut dynamics, rest(), voltage, &times);
            let currents = numbers(&case["i"]);
            for (index, state) in states.iter().enumerate() {
                let at = format!("{name} {} at {} s", case["name"], times[index]);
                let scale = number(parameters, "stall_current");
                worst = worst.max(assert_close(
                    &format!("{at}, current"),
                    state.current[0],
                    currents[index],
                    scale,
                ));
                if locked {
                    assert_eq!(state.speed[0], 0.0, "{at}");
                    continue;
                }
                let speeds = numbers(&case["omega"]);
                let scale = number(parameters, "no_load_speed");
                let speed = state.speed[0];
                worst =
                    worst.max(assert_close(&format!("{at}, speed"), speed, speeds[index], scale));
            }
        }
    }
    println!("worst relative error {worst:e}");
}

#[test]
fn one_cycle_is_the_exact_discretisation() {
    let golden = golden();
    for name in ["EC035.120", "EC020.120"] {
        let parameters = &golden[name]["params"];
        for case in golden[name]["cases"].as_array().unwrap() {
            let zoh = &case["zoh_1kHz"];
            if zoh.is_null() {
                continue;
            }
            let friction = Friction { coulomb: 0.0, viscous: number(case, "gamma") };
            let inertia = number(case, "J");
            let cycle = |current: f64, speed: f64, voltage: f64, load: f64| {
                let mut dynamics = motor(parameters, inertia, friction, load);
                let start =
                    State { current: Vector1::new(current), speed: Vector1::new(speed), ..rest() };
                let end = respond(&mut dynamics, start, voltage, &[1e-3])[0];
                [end.current[0], end.speed[0]]
            };
            let columns = [
                (cycle(1.0, 0.0, 0.0, 0.0), "Ad", 0),
                (cycle(0.0, 1.0, 0.0, 0.0), "Ad", 1),
                (cycle(0.0, 0.0, 1.0, 0.0), "Bd", 0),
                (cycle(0.0, 0.0, 0.0, 1.0), "Bd", 1),
            ];
            for (ours, matrix, column) in columns {
                for (row, ours) in ours.into_iter().enumerate() {
                    let exact = zoh[matrix][row][column].as_f64().unwrap();
                    let label = format!("{name} {} {matrix}[{row}][{column}]", case["name"]);
                    assert_close(&label, ours, exact, exact.abs());
                }
            }
        }
    }
}
