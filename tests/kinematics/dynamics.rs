//! Efforts: the equation of motion as matrices, friction, and what the tool exerts.

use machine::Machine;
use messages::math;
use messages::random::SplitMix64;
use serde_json::{Value, json};

use super::support::{self, Place, golden, number};
use super::{
    ALL, Golden, MACHINES, ask, assert_close, cases, kinematics, lossless_motion, replies,
    without_screws,
};

/// The friction of a golden joint as that of its motor, `ratio` joint units per turn of the motor.
fn friction(axis: &str, ratio: f64, golden: &Value, index: usize) -> [String; 2] {
    let coulomb = number(golden, &format!("/coul/{index}")) * ratio;
    let viscous = number(golden, &format!("/visc/{index}")) * ratio * ratio;
    [
        format!("axis.{axis}.friction.coulomb={coulomb} N m"),
        format!("axis.{axis}.friction.viscous={viscous} N m s/rad"),
    ]
}

/// The shipped polar machine with the friction of the golden one.
fn polar(golden: &Value) -> Golden {
    let lead = 0.005 / (2.0 * core::f64::consts::PI);
    let changes: Vec<String> = [("th1", 1.0 / 50.0), ("th2", 1.0 / 20.0), ("d", lead)]
        .iter()
        .enumerate()
        .flat_map(|(index, (axis, ratio))| friction(axis, *ratio, &golden["params"], index))
        .collect();
    Golden::new("polar", &changes)
}

#[test]
fn the_polar_machine_gives_its_golden_efforts_and_matrices() {
    let golden = golden("polar");
    let machine = polar(&golden);
    let cases = cases(&golden, "cases");
    let motion = |case: &Value| {
        let input = &case["input"];
        json!({ "q": case["output"]["q"], "qd": input["qd"], "qdd": input["qdd"] })
    };
    machine.check("dynamics", cases, motion, &[("/effort", "/output/tau")]);
    let state = |case: &Value| json!({ "q": case["output"]["q"], "qd": case["input"]["qd"] });
    machine.check("matrices", cases, state, &[("/v", "/output/V"), ("/g", "/output/G")]);
    for (reply, case) in machine.ask("matrices", cases, state).iter().zip(cases) {
        let diagonal = |axis: usize| number(case, &format!("/output/M_diag/{axis}"));
        let mass: Vec<Vec<f64>> = (0..3)
            .map(|row| (0..3).map(|at| if at == row { diagonal(row) } else { 0.0 }).collect())
            .collect();
        assert_close(&reply["m"], &json!(mass), "M");
        let (nothing, none) = (json!(vec![[0.0; 3]; 3]), json!(vec![0.0; 3]));
        assert_eq!((&reply["c"], &reply["b"], &reply["v"]), (&nothing, &nothing, &none));
    }
}

/// The golden wrench is in the frame of the arm, that of the command in the frame of the work.
#[test]
fn the_polar_machine_gives_its_golden_statics_moments_included() {
    let golden = golden("polar");
    let cases = cases(&golden, "cases");
    let wrench = |case: &Value| -> Vec<f64> {
        let at = |axis: usize| number(case, &format!("/output/q/{axis}"));
        let (sine, cosine) = math::sin_cos(at(0) - at(1));
        ["wrench_f", "wrench_m"]
            .iter()
            .flat_map(|key| {
                let [x, y, z] = [0, 1, 2].map(|row| number(case, &format!("/input/{key}/{row}")));
                [x * cosine - y * sine, x * sine + y * cosine, z]
            })
            .collect()
    };
    let still = [0, 0, 0];
    let statics = |case: &Value| json!({ "q": case["output"]["q"], "qd": still, "qdd": still, "wrench": wrench(case) });
    for (reply, case) in polar(&golden).ask("dynamics", cases, statics).iter().zip(cases) {
        let [x, y] = [0, 1].map(|row| number(case, &format!("/output/fk/{row}")));
        let wrench = wrench(case);
        // The table bears the force about its axis, and the moment, the other way round.
        let table = -(x * wrench[1] - y * wrench[0]) - wrench[5];
        let held = json!([
            number(case, "/output/static/0"),
            table,
            number(case, "/output/static/1") + number(case, "/output/G/2"),
        ]);
        assert_close(&reply["effort"], &held, "statics");
    }
}

/// A place for the tool of the shipped machine `name` near to its home, and a motion of its joints.
fn motions(name: &str, axes: usize, motor: bool, count: usize) -> Vec<Value> {
    let path = support::source("machines").join(format!("{name}.toml"));
    let machine = Machine::load(&path, &[]).unwrap();
    let mut random = SplitMix64::new(11);
    let ratio = |axis: usize| if motor { machine.actuators[axis].ratio } else { 1.0 };
    let mut list = |offset: &dyn Fn(usize) -> f64, scale: f64| -> Vec<f64> {
        (0..axes)
            .map(|axis| (offset(axis) + scale * random.between(-1.0, 1.0)) / ratio(axis))
            .collect()
    };
    let home = |axis: usize| machine.home_joints[axis];
    let zero = |_: usize| 0.0;
    (0..count)
        .map(|_| {
            json!({
                "q": list(&home, 0.005),
                "qd": list(&zero, 0.3),
                "qdd": list(&zero, 5.0),
            })
        })
        .collect()
}

fn list(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// The sum of `rows` times the column `by`.
fn times(rows: &Value, by: &[f64]) -> Vec<f64> {
    let product = |row: &Value| list(row).iter().zip(by).map(|(one, other)| one * other).sum();
    rows.as_array().unwrap().iter().map(product).collect()
}

fn sum(parts: &[&[f64]]) -> Vec<f64> {
    (0..parts[0].len()).map(|row| parts.iter().map(|part| part[row]).sum()).collect()
}

#[test]
fn the_matrices_of_every_machine_add_up_to_its_efforts() {
    let place = Place::new();
    for (name, axes) in ALL {
        let machine = support::source("machines").join(format!("{name}.toml"));
        for motor in [false, true] {
            let motions = motions(name, axes as usize, motor, 20);
            let ask = |verb: &str, request: &dyn Fn(&Value) -> Value| -> Vec<Value> {
                let input: String =
                    motions.iter().map(|motion| request(motion).to_string() + "\n").collect();
                replies(&kinematics(&place, &machine, motor, verb, &input))
            };
            let efforts = ask("dynamics", &Value::clone);
            let lossless = ask("dynamics", &lossless_motion);
            let moving = ask("matrices", &|of| json!({ "q": of["q"], "qd": of["qd"] }));
            let resting = ask("matrices", &|of| json!({ "q": of["q"] }));
            for (index, motion) in motions.iter().enumerate() {
                let what = format!("{name} motor {motor}: {motion}");
                let (matrices, still) = (&moving[index], &resting[index]);
                let [velocity, acceleration] = ["qd", "qdd"].map(|key| list(&motion[key]));
                let [v, g, friction] = ["v", "g", "friction"].map(|key| list(&matrices[key]));
                let inertial = times(&matrices["m"], &acceleration);
                let effort = sum(&[&inertial, &v, &g]);
                assert_close(&lossless[index]["effort"], &json!(effort), &what);
                assert_eq!(lossless[index]["friction"], json!(vec![0.0; axes as usize]));
                assert_close(&efforts[index]["effort"], &json!(sum(&[&effort, &friction])), &what);
                assert_eq!(efforts[index]["friction"], matrices["friction"], "{what}");

                let squares: Vec<f64> = velocity.iter().map(|rate| rate * rate).collect();
                let mut products = Vec::new();
                for (one, rate) in velocity.iter().enumerate() {
                    products.extend(velocity[one + 1..].iter().map(|other| rate * other));
                }
                let centrifugal = times(&matrices["c"], &squares);
                let coriolis = times(&matrices["b"], &products);
                // Beside gravity, from which both are told.
                for row in 0..axes as usize {
                    let error = (centrifugal[row] + coriolis[row] - v[row]).abs();
                    let scale = v[row].abs().max(g[row].abs());
                    assert!(error <= 1e-9 * scale + 1e-14, "{what}: {matrices}");
                }

                for key in ["m", "c", "b", "g"] {
                    assert_eq!(still[key], matrices[key], "{what}: {key} asks no velocity");
                }
                assert_eq!(still["v"], still["friction"], "{what}: both 0 at rest");
                assert_eq!(list(&still["v"]), vec![0.0; axes as usize], "{what}");
            }
        }
    }
}

/// Friction is that of the shafts in the machine file, for each kind of mechanism.
#[test]
fn every_machine_tells_the_friction_of_its_axes() {
    let place = Place::new();
    for (name, axes) in ALL {
        let path = support::source("machines").join(format!("{name}.toml"));
        let machine = Machine::load(&path, &[]).unwrap();
        for motor in [false, true] {
            let motions = motions(name, axes as usize, motor, 5);
            let input: String = motions.iter().map(|motion| motion.to_string() + "\n").collect();
            let replies = replies(&kinematics(&place, &path, motor, "dynamics", &input));
            for (reply, motion) in replies.iter().zip(&motions) {
                let velocity = list(&motion["qd"]);
                let friction: Vec<f64> = machine
                    .actuators
                    .iter()
                    .zip(&velocity)
                    .map(|(axis, rate)| {
                        let ratio = if motor { 1.0 } else { axis.ratio };
                        let speed = rate / ratio;
                        let torque =
                            axis.friction.coulomb * speed.signum() + axis.friction.viscous * speed;
                        torque / ratio
                    })
                    .collect();
                assert!(friction.iter().all(|effort| effort.abs() > 0.0), "{name}: {friction:?}");
                assert_close(&reply["friction"], &json!(friction), name);
            }
        }
    }
}

#[test]
fn a_wrench_at_the_tool_adds_its_virtual_work() {
    for name in MACHINES {
        let place = Place::new();
        let machine = without_screws(&place, name);
        let golden = golden(name);
        let poses = &golden["poses"].as_array().unwrap()[..3];
        let at_rest = ask(
            &place,
            &machine,
            "dynamics",
            poses,
            |pose| json!({ "q": pose["q"], "qd": [0, 0], "qdd": [0, 0], "wrench": [3, -2] }),
        );
        for (reply, pose) in at_rest.iter().zip(poses) {
            let expected: Vec<f64> = [0, 1]
                .map(|axis| {
                    3.0 * number(pose, &format!("/J/0/{axis}"))
                        - 2.0 * number(pose, &format!("/J/1/{axis}"))
                })
                .into();
            assert_close(&reply["effort"], &json!(expected), name);
        }
    }
}
