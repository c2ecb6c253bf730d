//! Whole pulses along the paths of the golden vectors of the twin actuators (source 004).

#![allow(clippy::unwrap_used)]

use machine::kinematics::{Attitude, Joints, ToolMotion};
use machine::mechanisms::{ActuatorBodies, TwinActuator, TwinBranch};
use machine::pulses::{PulseScale, crossings, nearest, quantisation_bound};
use machine::{Mechanism, Pose};
use messages::math;
use nalgebra::{Vector2, Vector3};
use serde_json::Value;

fn golden() -> Value {
    let path = format!("{}/../tests/golden/twin_actuator.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn pair(value: &Value) -> Vector2<f64> {
    Vector2::new(number(&value[0]), number(&value[1]))
}

fn place(at: Vector2<f64>) -> Pose {
    Pose::at(Vector3::new(at.x, at.y, 0.0))
}

#[track_caller]
fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    let error = (found - expected).abs();
    assert!(error <= tolerance, "{what}: {found} against {expected}, off by {error:e}");
}

fn mechanism(params: &Value) -> TwinActuator {
    let bodies = ActuatorBodies {
        housing_inertia: 0.01,
        rod_mass: 0.4,
        rod_inertia: 0.002,
        rod_center: 0.15,
    };
    TwinActuator {
        bases: [pair(&params["A"]), pair(&params["B"])],
        offset: number(&params["h"]),
        offset_angle: number(&params["th_h"]),
        bodies: [bodies; 2],
        tool_mass: 0.3,
        baseline_limit: number(&params["sin_min"]),
        near_limit: number(&params["sing_a"]),
        branch: TwinBranch { elbow: 1 },
        elasticity: None,
    }
}

fn scale(params: &Value, microsteps: f64, home: f64) -> PulseScale {
    let value = |key: &str| number(&params[key]);
    PulseScale::of_screw(value("steps_rev"), microsteps, value("gear"), value("lead"), home)
}

#[test]
fn single_poses_are_rounded_within_the_bound() {
    let file = golden();
    let params = &file["params"];
    let mechanism = mechanism(params);
    let scales = ["La", "Lb"].map(|fixed| scale(params, 16.0, number(&params[fixed])));
    assert_eq!(scales[0].per_length, number(&file["K"]));
    for case in file["cases"].as_array().unwrap() {
        let output = &case["output"];
        let lengths = pair(&output["L_total"]);
        let counts = [0, 1].map(|axis| scales[axis].count(lengths[axis]));
        for axis in 0..2 {
            assert_eq!(counts[axis] as f64, number(&output["pulses_from_home"][axis]));
            let rate = scales[axis].rate(number(&output["L_rate"][axis]));
            let expected = number(&output["pulse_rate"][axis]);
            near("pulse rate", rate, expected, 1e-9 * expected.abs());
        }
        let rounded = Joints::from([0, 1].map(|axis| scales[axis].length(counts[axis])));
        let tool = mechanism.forward(&rounded, mechanism.branch).unwrap().position.xy();
        near("quantised", (tool - pair(&output["P_quantised"])).norm(), 0.0, 1e-14);
        let chain = mechanism.solve(&lengths, mechanism.branch, None).unwrap();
        let per_length = scales.map(|scale| scale.per_length);
        let bound = quantisation_bound(&mechanism.jacobian(&chain), &per_length);
        near("bound", bound, number(&output["quant_bound"]), 1e-9 * bound);
        let error = (tool - pair(&case["input"]["P"])).norm();
        near("error", error, number(&output["quant_err"]), 1e-14);
        assert!(error <= bound * (1.0 + 1e-6), "{error} against {bound}");
    }
}

/// A line or an arc of the source, run at its trapezoidal speed.
struct Course {
    from: Vector2<f64>,
    /// Of the line, or to the arc's centre.
    other: Vector2<f64>,
    /// Of the arc, signed [rad]; `None` for a line.
    sweep: Option<f64>,
    velocity: f64,
    acceleration: f64,
}

impl Course {
    fn new(input: &Value) -> Self {
        let args = &input["args"];
        let (first, second) = (pair(&args[0]), pair(&args[1]));
        let sweep = (input["kind"] == "circle").then(|| number(&args[2]));
        let (from, other) = if sweep.is_some() { (second, first) } else { (first, second) };
        let (velocity, acceleration) = (number(&input["v_max"]), number(&input["a_max"]));
        let mut course = Self { from, other, sweep, velocity, acceleration };
        // The erratum to source 004 eq. 4.18: triangular if twice the run-in is too long.
        course.velocity = velocity.min((course.length() * acceleration).sqrt());
        course
    }

    fn length(&self) -> f64 {
        let distance = (self.other - self.from).norm();
        self.sweep.map_or(distance, |sweep| distance * sweep.abs())
    }

    fn duration(&self) -> f64 {
        self.length() / self.velocity + self.velocity / self.acceleration
    }

    /// Way and speed at `time`.
    fn way(&self, time: f64) -> (f64, f64) {
        let (v, a) = (self.velocity, self.acceleration);
        let rest = self.duration() - time;
        if time < v / a {
            (a * time * time / 2.0, a * time)
        } else if rest > v / a {
            (v * (time - v / a / 2.0), v)
        } else {
            (self.length() - a * rest * rest / 2.0, a * rest)
        }
    }

    fn motion(&self, time: f64) -> ToolMotion {
        let (way, speed) = self.way(time);
        let (position, direction) = match self.sweep {
            None => {
                let along = (self.other - self.from).normalize();
                (self.from + along * way, along)
            }
            Some(sweep) => {
                let spoke = self.from - self.other;
                let (sine, cosine) = math::sin_cos(way / spoke.norm() * sweep.signum());
                let spoke = Vector2::new(
                    spoke.x * cosine - spoke.y * sine,
                    spoke.x * sine + spoke.y * cosine,
                );
                let along = Vector2::new(-spoke.y, spoke.x).normalize() * sweep.signum();
                (self.other + spoke, along)
            }
        };
        let space = |vector: Vector2<f64>| Vector3::new(vector.x, vector.y, 0.0);
        ToolMotion {
            position: space(position),
            velocity: space(direction * speed),
            acceleration: Vector3::zeros(),
            jerk: Vector3::zeros(),
            attitude: Attitude::LEVEL,
        }
    }

    /// Distance of `point` from the path.
    fn miss(&self, point: Vector2<f64>) -> f64 {
        let chord = self.other - self.from;
        match self.sweep {
            None => {
                let along = chord.normalize();
                let off = point - self.from;
                (off - along * off.dot(&along).clamp(0.0, chord.norm())).norm()
            }
            Some(_) => ((point - self.other).norm() - chord.norm()).abs(),
        }
    }
}

/// Every step of every path: the counts, their error at the tool within the bound, and the instants
/// of the pulses inside the steps.
#[test]
fn the_paths_are_followed_within_the_bound_of_rounding() {
    let file = golden();
    let mechanism = mechanism(&file["params"]);
    let branch = mechanism.branch;
    let paths = file["paths"].as_array().unwrap();
    assert_eq!(paths.len(), 5);
    for path in paths {
        let (input, output) = (&path["input"], &path["output"]);
        let course = Course::new(input);
        near("T", course.duration(), number(&output["T"]), 1e-9);
        let start = mechanism.inverse(&place(course.from), branch, &Joints::zeros()).unwrap();
        let scales =
            [start[0], start[1]].map(|home| scale(&file["params"], number(&input["micro"]), home));
        let at = |time: f64| {
            let motion = mechanism.joint_motion(&course.motion(time), branch, &start).unwrap();
            [0, 1].map(|axis| {
                let rate = scales[axis].rate(motion.velocity[axis]);
                (scales[axis].course(motion.position[axis]), rate)
            })
        };
        for sample in output["samples"].as_array().unwrap() {
            let found = at(number(&sample["t"])).map(|(pulses, _)| pulses);
            near("Nd", (Vector2::from(found) - pair(&sample["Nd"])).norm(), 0.0, 1e-7);
        }

        let rule = &output["round_rule"];
        let (dt, duration) = (number(&input["dt"]), course.duration());
        let steps = (duration / dt).ceil() as usize;
        assert_eq!(steps as f64, number(&rule["steps"]));
        let (mut lag, mut pos_err, mut path_err, mut bound) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
        let (mut fastest, mut burst) = (0.0_f64, 0);
        let mut counts = [0_i64; 2];
        let mut behind = at(0.0);
        for step in 0..=steps {
            let begin = step.saturating_sub(1) as f64 * dt;
            let time = (step as f64 * dt).min(duration);
            let ahead = at(time);
            for axis in 0..2 {
                let ((from, from_rate), (to, to_rate)) = (behind[axis], ahead[axis]);
                let next = nearest(to);
                let cycle = time - begin;
                let mut passed = counts[axis];
                for pulse in crossings(from, to, from_rate * cycle, to_rate * cycle) {
                    // The exact course at that instant is at the half-integer that was passed, but
                    // for the steps in which the acceleration jumps: a·dt²/8 there, and a length
                    // changes by less than twice what the tool does.
                    let exact = at(begin + pulse.share * cycle)[axis].0;
                    let jump = scales[axis].per_length * course.acceleration * dt * dt / 8.0;
                    let half = (pulse.count + passed) as f64 / 2.0;
                    near("instant", exact, half, 2.0 * jump);
                    passed = pulse.count;
                }
                assert_eq!(passed, next, "{input} step {step}");
                burst = burst.max((next - counts[axis]).abs());
                fastest = fastest.max((to - from).abs());
                lag = lag.max((to - next as f64).abs());
                counts[axis] = next;
            }
            behind = ahead;
            let rounded = Joints::from([0, 1].map(|axis| scales[axis].length(counts[axis])));
            let tool = mechanism.solve(&rounded, branch, None).unwrap().tool;
            pos_err = pos_err.max((tool - course.motion(time).position.xy()).norm());
            path_err = path_err.max(course.miss(tool));
            let lengths =
                [0, 1].map(|axis| scales[axis].home + ahead[axis].0 / scales[axis].per_length);
            let chain = mechanism.solve(&Joints::from(lengths), branch, None).unwrap();
            let per_length = scales.map(|scale| scale.per_length);
            bound = bound.max(quantisation_bound(&mechanism.jacobian(&chain), &per_length));
        }
        assert_eq!(counts.map(|count| count as f64), [0, 1].map(|axis| number(&rule["N"][axis])));
        assert_eq!(burst as f64, number(&rule["max_burst"]));
        near("lag", lag, number(&rule["lag_pulses"]), 1e-7);
        near("rate", fastest, number(&rule["max_rate_per_step"]), 1e-7);
        near("position", pos_err, number(&rule["pos_err"]), 1e-12);
        near("path", path_err, number(&rule["path_err"]), 1e-12);
        near("bound", bound, number(&rule["bound"]), 1e-4 * bound);
        assert!(pos_err <= bound, "{pos_err} against {bound}");
    }
}

/// 0.15 m/s asks for 91 kHz of a driver that bears 40.
#[test]
fn a_line_that_is_too_fast_shows_in_the_pulse_rate() {
    let file = golden();
    let failing = file["failing"].as_array().unwrap();
    let case = failing.iter().find(|case| case["expect"] == "pulse_rate_exceeded").unwrap();
    let mechanism = mechanism(&file["params"]);
    let course = Course::new(&case["input"]);
    let scale = scale(&file["params"], 16.0, 0.0);
    let steps = (course.duration() / 0.001).ceil() as usize;
    let peak = (0..=steps)
        .map(|step| {
            let time = (step as f64 * 0.001).min(course.duration());
            let motion = mechanism
                .joint_motion(&course.motion(time), mechanism.branch, &Joints::zeros())
                .unwrap();
            scale.rate(motion.velocity.amax())
        })
        .fold(0.0, f64::max);
    // The golden peak is that of the rounded course over one step.
    near("peak", peak, number(&case["peak_rate"]), 1e-3 * peak);
    assert!(peak > number(&case["f_max"]));
}
