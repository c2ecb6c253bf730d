//! What a machine is like at a place: ellipses, stiffness, modes, accelerations, bodies.

#![allow(clippy::unwrap_used)]

use core::f64::consts::{FRAC_1_SQRT_2, TAU};

use machine::analysis::{Hold, Place, Principal, Rotors, footprint, places};
use machine::kinematics::Joints;
use machine::mechanisms::MechanismKind;
use machine::transmission::Elasticity;
use machine::{Machine, Mechanism, MechanismVisitor};
use nalgebra::{Vector2, Vector3};
use serde_json::Value;

fn machine(name: &str) -> Machine {
    let path = format!("{}/../machines/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap();
    Machine::parse(&path, &text, &[]).unwrap()
}

/// Every machine file that the project ships.
fn machines() -> Vec<Machine> {
    let folder = format!("{}/../machines", env!("CARGO_MANIFEST_DIR"));
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .filter_map(|entry| {
            entry
                .unwrap()
                .file_name()
                .into_string()
                .unwrap()
                .strip_suffix(".toml")
                .map(str::to_owned)
        })
        .collect();
    names.sort();
    names.iter().map(|name| machine(name)).collect()
}

fn golden(name: &str) -> Value {
    let path = format!("{}/../tests/golden/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[track_caller]
fn near(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{found} for {expected}");
}

/// The source's five-bar, with the bending of its arms as 3·E·J/L.
fn elastic_five_bar() -> Machine {
    let mut machine = machine("five_bar");
    if let MechanismKind::FiveBar(linkage) = &mut machine.mechanism {
        linkage.elasticity = Some([Elasticity { stiffness: 2750.0, damping: 0.0 }; 2]);
    }
    machine
}

fn values(axes: &[Principal]) -> Vec<f64> {
    axes.iter().map(|axis| axis.value).collect()
}

#[test]
fn singular_values_and_angles_are_those_of_the_golden_vectors() {
    // Joints of the files are motor angles but for the five-bar's.
    for name in ["cartesian", "corexy", "five_bar", "prrrp"] {
        let machine = machine(name);
        let file = golden(name);
        for pose in file["poses"].as_array().unwrap() {
            let number = |key: &str, index: usize| pose[key][index].as_f64().unwrap();
            let place =
                Place::with_tool_at(&machine, [number("x", 0), number("x", 1), 0.0]).unwrap();
            let ratio = if name == "five_bar" { 1.0 } else { machine.actuators[0].ratio };
            let found = place.manipulability().unwrap();
            for (index, axis) in found.velocity.iter().enumerate() {
                near(axis.value * ratio, number("singular_values", index), 1e-9);
            }
            let determinant = place.determinant().unwrap() * ratio * ratio;
            near(determinant, pose["det_J"].as_f64().unwrap(), 1e-9);
            near(found.value(), place.determinant().unwrap().abs(), 1e-9);
            // Where both axes are alike neither has a direction.
            if found.isotropy() < 1.0 - 1e-9 {
                let expected = pose["manip_major_axis_angle"].as_f64().unwrap();
                let turns = (found.velocity[0].angle() - expected) / core::f64::consts::PI;
                assert!((turns - turns.round()).abs() < 1e-9, "{name}: {turns}");
            }
        }
    }
}

#[test]
fn the_five_bars_ellipses_are_those_of_its_figures() {
    let machine = elastic_five_bar();
    for ([x, y], [major, minor], angle) in [
        ([0.0, 0.33], [0.200_116, 0.198_309], 90.0),
        ([0.0, 0.27], [0.237_375, 0.166_169], 90.0),
        ([0.08, 0.33], [0.203_651, 0.190_841], -22.892),
        ([-0.08, 0.33], [0.203_651, 0.190_841], 22.892),
    ] {
        let place = Place::with_tool_at(&machine, [x, y, 0.0]).unwrap();
        let found = place.manipulability().unwrap();
        near(found.velocity[0].value, major, 5e-6);
        near(found.velocity[1].value, minor, 5e-6);
        near(found.isotropy(), minor / major, 1e-5);
        let off = found.velocity[0].angle().to_degrees() - angle;
        assert!((off - 180.0 * (off / 180.0).round()).abs() < 1e-3, "{x}, {y}: {off}");
        // Forces are the other way round, in the same directions.
        let force = found.force().unwrap();
        near(force[0].value, 1.0 / minor, 5e-6);
        assert!((force[0].direction - found.velocity[1].direction).norm() < 1e-12);
    }
}

#[test]
fn the_prrrps_ellipses_follow_from_its_triangle() {
    let machine = machine("prrrp");
    let MechanismKind::Prrrp(prrrp) = &machine.mechanism else { panic!() };
    let link = prrrp.link;
    for share in [0.45, 0.6, 0.72, 0.85] {
        let x = share * link;
        let place = Place::with_tool_at(&machine, [x, 0.02, 0.0]).unwrap();
        let mut found: Vec<f64> =
            values(&place.manipulability().unwrap().velocity).iter().map(|one| one * one).collect();
        found.sort_by(f64::total_cmp);
        let mut expected = [(link * link - x * x) / (2.0 * x * x), 0.5];
        expected.sort_by(f64::total_cmp);
        near(found[0], expected[0], 1e-12);
        near(found[1], expected[1], 1e-12);
    }
}

#[test]
fn carriages_swing_as_masses_on_their_springs() {
    let corexy = machine("corexy");
    let modes = Place::home(&corexy).unwrap().modes(Rotors::Held);
    near(modes[0].frequency, 37.865, 2e-5);
    near(modes[1].frequency, 67.864, 2e-5);
    // The heavy bridge moves in y, the head alone in x.
    assert!(modes[0].tool.y.abs() > 1.0 - 1e-12 && modes[1].tool.x.abs() > 1.0 - 1e-12);

    let cartesian = machine("cartesian");
    let MechanismKind::Cartesian(carriages) = &cartesian.mechanism else { panic!() };
    let modes = Place::home(&cartesian).unwrap().modes(Rotors::Held);
    let mut expected: Vec<f64> = (0..2)
        .map(|axis| {
            (carriages.elasticity.unwrap()[axis].stiffness / carriages.mass[axis]).sqrt() / TAU
        })
        .collect();
    expected.sort_by(f64::total_cmp);
    for (mode, expected) in modes.iter().zip(expected) {
        near(mode.frequency, expected, 1e-12);
    }
    // With its rotors free each axis is two masses on a spring.
    let free = Place::home(&cartesian).unwrap().modes(Rotors::Free);
    assert!(free[0].frequency < 1e-3 && free[1].frequency < 1e-3, "{free:?}");
    let mut expected: Vec<f64> = (0..2)
        .map(|axis| {
            let settings = &cartesian.actuators[axis];
            let rotor = settings.motor.rotor_inertia() / (settings.ratio * settings.ratio);
            let stiffness = carriages.elasticity.unwrap()[axis].stiffness;
            (stiffness * (1.0 / carriages.mass[axis] + 1.0 / rotor)).sqrt() / TAU
        })
        .collect();
    expected.sort_by(f64::total_cmp);
    near(free[2].frequency, expected[0], 1e-9);
    near(free[3].frequency, expected[1], 1e-9);
}

#[test]
fn the_five_bar_swings_at_home_as_a_hand_computes() {
    let machine = elastic_five_bar();
    let modes = Place::with_tool_at(&machine, [0.0, 0.33, 0.0]).unwrap().modes(Rotors::Held);
    // The arms are alike, so they swing together or against each other: K/(M₁₁ ± M₁₂).
    let [own, cross] = [0.029_237_38, -0.003_659_38];
    near(modes[0].frequency, (2750.0_f64 / (own - cross)).sqrt() / TAU, 1e-6);
    near(modes[1].frequency, (2750.0_f64 / (own + cross)).sqrt() / TAU, 1e-6);
    near(modes[0].frequency, 46.016, 1e-5);
    near(modes[1].frequency, 52.186, 1e-5);
}

/// A load let go beside its rest, its motors held: half of its period, by its own equations of motion.
struct Swing<'a> {
    place: &'a Place,
    mode: usize,
}

impl MechanismVisitor for Swing<'_> {
    type Output = f64;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> f64 {
        let mode = &self.place.modes(Rotors::Held)[self.mode];
        let rest = Joints::<N>::from_fn(|axis, _| self.place.joints[axis]);
        let shape = Joints::<N>::from_fn(|axis, _| mode.joints[axis]);
        let shape = shape * (1e-6 / shape.amax());
        let branch = mechanism.branch();
        let stiffness = mechanism.stiffness().unwrap();
        let held = mechanism.gravity(&mechanism.solve(&rest, branch, None).unwrap());
        let accelerations = |q: &Joints<N>, velocity: &Joints<N>| {
            let chain = mechanism.solve(q, branch, None).unwrap();
            let effort = held - stiffness * (q - rest) - mechanism.bias(&chain, velocity);
            mechanism.mass_matrix(&chain).cholesky().unwrap().solve(&effort)
        };
        let step = 1e-3 / mode.frequency;
        let (mut q, mut velocity) = (rest + shape, Joints::<N>::zeros());
        let mut before = shape.dot(&(q - rest));
        let mut time = 0.0;
        // Störmer and Verlet's steps.
        loop {
            velocity += accelerations(&q, &velocity) * (step / 2.0);
            q += velocity * step;
            velocity += accelerations(&q, &velocity) * (step / 2.0);
            time += step;
            let now = shape.dot(&(q - rest));
            if now <= 0.0 {
                // A quarter of the period has gone by.
                return 4.0 * (time - step * now / (now - before));
            }
            before = now;
        }
    }
}

#[test]
fn loads_that_are_let_go_swing_in_their_modes() {
    for machine in machines().iter().chain([&elastic_five_bar()]) {
        let Ok(place) = Place::home(machine) else { continue };
        for (index, mode) in place.modes(Rotors::Held).iter().enumerate() {
            let period = machine.mechanism.visit(Swing { place: &place, mode: index });
            near(1.0 / period, mode.frequency, 5e-3);
        }
    }
}

#[test]
fn a_tool_gives_way_to_a_push_as_its_springs_do() {
    let corexy = machine("corexy");
    let found = Place::home(&corexy).unwrap().tool_stiffness(Hold::Clamped).unwrap();
    let MechanismKind::CoreXy(belts) = &corexy.mechanism else { panic!() };
    for axis in &found {
        near(axis.value, belts.elasticity.unwrap()[0].stiffness, 1e-9);
    }
    // At the five-bar a push turns each arm by its own torque.
    let machine = elastic_five_bar();
    let place = Place::with_tool_at(&machine, [0.03, 0.31, 0.0]).unwrap();
    let MechanismKind::FiveBar(linkage) = &machine.mechanism else { panic!() };
    let joints = Joints::<2>::from_fn(|axis, _| place.joints[axis]);
    let force = Vector2::new(2.0, -1.0);
    let chain = linkage.solve(&joints, linkage.branch, None).unwrap();
    let turned = joints + chain.jacobian.transpose() * force / 2750.0 * 1e-3;
    let moved = linkage.forward(&turned, linkage.branch).unwrap().position - place.position;
    let compliance = place.tool_compliance(Hold::Clamped).unwrap();
    let expected = compliance * force * 1e-3;
    assert!((moved.x - expected[0]).abs() < 1e-3 * moved.norm(), "{moved} {expected}");
    assert!((moved.y - expected[1]).abs() < 1e-3 * moved.norm());
    // Loops that hold the motors add their own give.
    let loops = place.tool_stiffness(Hold::Loops).unwrap();
    let clamped = place.tool_stiffness(Hold::Clamped).unwrap();
    assert!(loops[0].value < clamped[0].value);
    let gains = &machine.actuators[0].gains;
    let hold = gains.inertia * gains.velocity * gains.position
        / (machine.actuators[0].ratio * machine.actuators[0].ratio);
    let same_axes = (1.0 / 2750.0 + 1.0 / hold) * 2750.0;
    near(clamped[0].value / loops[0].value, same_axes, 1e-9);
}

#[test]
fn a_rigid_machine_has_neither_stiffness_nor_modes() {
    let mut machine = elastic_five_bar();
    if let MechanismKind::FiveBar(linkage) = &mut machine.mechanism {
        linkage.elasticity = None;
    }
    let place = Place::home(&machine).unwrap();
    assert_eq!(place.tool_stiffness(Hold::Clamped), None);
    assert!(place.modes(Rotors::Held).is_empty());
    assert!(place.tool_stiffness(Hold::Loops).unwrap()[0].value > 0.0);
}

#[test]
fn motors_accelerate_the_tool_as_the_source_computes() {
    let cartesian = machine("cartesian");
    let place = Place::home(&cartesian).unwrap();
    // Source 003 sec. 3.4 with its missing 2π: 10 m/s² with 1.93 kg in x, 0.33 kg in y.
    let torques = [0.015_358_451, 0.002_626_057];
    for (axis, along) in [Vector3::x(), Vector3::y()].iter().enumerate() {
        let found = place.acceleration(along, &torques, false);
        near(found.value, 10.0, 1e-6);
        assert_eq!(found.axis, Some(axis));
    }
    // Both at once: either axis still gives its own.
    let diagonal = Vector3::new(FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);
    near(place.acceleration(&diagonal, &torques, false).value, 10.0 * 2.0_f64.sqrt(), 1e-6);

    let corexy = machine("corexy");
    let place = Place::home(&corexy).unwrap();
    let torques = [0.008_687_5; 2];
    near(place.acceleration(&Vector3::x(), &torques, false).value, 42.121_212, 1e-7);
    near(place.acceleration(&Vector3::y(), &torques, false).value, 13.113_208, 1e-7);
    near(place.force(&Vector3::x(), &torques).value, 2.0 * 0.008_687_5 / 1.25e-3, 1e-12);
    // Rotors take their share: 2e-6 kg·m² behind 1.25 mm/rad.
    let with = place.acceleration(&Vector3::x(), &torques, true).value;
    let rotors = 2.0 * 2e-6 / (1.25e-3 * 1.25e-3);
    near(with, 2.0 * 0.008_687_5 / 1.25e-3 / (0.33 + rotors), 1e-9);
}

#[test]
fn what_hangs_falls_faster_than_it_rises() {
    let mut machine = machine("polar");
    if let MechanismKind::Polar(polar) = &mut machine.mechanism {
        polar.load.counterbalance = 0.0;
    }
    let place = Place::home(&machine).unwrap();
    let MechanismKind::Polar(polar) = &machine.mechanism else { panic!() };
    let (mass, weight) = (polar.load.head_mass, polar.load.head_mass * polar.load.gravity);
    let ratio = machine.actuators[2].ratio;
    let torques = [1.0, 1.0, 2.0 * weight * ratio];
    near(place.acceleration(&Vector3::z(), &torques, false).value, weight / mass, 1e-9);
    near(place.acceleration(&-Vector3::z(), &torques, false).value, 3.0 * weight / mass, 1e-9);
    // A motor that cannot hold the weight gives nothing in any direction.
    let weak = [1.0, 1.0, 0.5 * weight * ratio];
    assert_eq!(place.acceleration(&Vector3::x(), &weak, false).value, 0.0);
}

/// The acceleration that one direction allows is reached: the joints' efforts at it are within the
/// motors' torques, and one of them is at its own.
#[test]
fn the_largest_acceleration_uses_one_motor_fully_on_every_machine() {
    struct Efforts<'a>(&'a Machine, &'a Place, Vector3<f64>, f64);
    impl MechanismVisitor for Efforts<'_> {
        type Output = Vec<f64>;
        fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Vec<f64> {
            let Self(machine, place, along, acceleration) = self;
            let q = Joints::<N>::from_fn(|axis, _| place.joints[axis]);
            let chain = mechanism.solve(&q, mechanism.branch(), None).unwrap();
            let mut motion = machine::kinematics::ToolMotion::rest(&mechanism.pose(&chain));
            motion.acceleration = along * acceleration;
            let joints = mechanism.joint_motion(&motion, mechanism.branch(), &q).unwrap();
            let effort = mechanism.inverse_dynamics(&chain, &Joints::zeros(), &joints.acceleration);
            // The motors of an axis together, as if all were at the first one's shaft.
            let axes = machine.driven().enumerate();
            axes.map(|(axis, (_, actuators))| {
                let at_joint = |actuator: &machine::Actuator| {
                    actuator.motor.rotor_inertia() / (actuator.ratio * actuator.ratio)
                };
                let rotors: f64 = actuators.iter().map(at_joint).sum();
                actuators[0].ratio.abs() * (effort[axis] + rotors * joints.acceleration[axis])
            })
            .collect()
        }
    }
    for machine in machines() {
        let place = Place::home(&machine).unwrap();
        let torques = place.standstill_torques();
        for along in [Vector3::x(), Vector3::y(), Vector3::new(0.6, -0.8, 0.0)] {
            let found = place.acceleration(&along, &torques, true);
            let Some(axis) = found.axis else { continue };
            let motors = machine.mechanism.visit(Efforts(&machine, &place, along, found.value));
            for (index, (torque, most)) in motors.iter().zip(&torques).enumerate() {
                let used = torque.abs() / most;
                assert!(used <= 1.0 + 1e-6, "{}: axis {index} {used}", machine.name);
                if index == axis {
                    near(used, 1.0, 1e-6);
                }
            }
        }
    }
}

#[test]
fn a_push_feels_the_masses_and_the_rotors() {
    let place = Place::home(&machine("corexy")).unwrap();
    let rotors = 2.0 * 2e-6 / (1.25e-3 * 1.25e-3);
    let found = place.effective_mass().unwrap();
    near(found[0].value, 1.06 + rotors, 1e-9);
    near(found[1].value, 0.33 + rotors, 1e-9);
    assert!(found[0].direction.y.abs() > 1.0 - 1e-9);
}

#[test]
fn all_that_moves_is_counted() {
    for (name, mass) in
        [("cartesian", 1.93), ("corexy", 1.06), ("five_bar", 1.218), ("prrrp", 1.384)]
    {
        let place = Place::home(&machine(name)).unwrap();
        near(place.bodies.moving_mass, mass, 1e-9);
    }
    for machine in machines() {
        let place = Place::home(&machine).unwrap();
        // Mirrors turn about their own centres of mass.
        let turns_only = machine.mechanism.name() == "galvo";
        assert_eq!(place.bodies.moving_mass > 0.0, !turns_only, "{}", machine.name);
        assert!(!place.bodies.points.is_empty(), "{}", machine.name);
        for point in &place.bodies.points {
            assert!(point.iter().all(|value| value.is_finite()), "{}", machine.name);
        }
    }
}

#[test]
fn links_keep_their_lengths_between_the_points_of_the_bodies() {
    let apart = |place: &Place, one: usize, other: usize| {
        (place.bodies.points[one] - place.bodies.points[other]).norm()
    };
    let five_bar = Place::home(&machine("five_bar")).unwrap();
    for (one, other, length) in [(0, 1, 0.1), (0, 2, 0.2), (1, 3, 0.2), (2, 4, 0.25), (3, 4, 0.25)]
    {
        near(apart(&five_bar, one, other), length, 1e-12);
    }
    let prrrp = Place::home(&machine("prrrp")).unwrap();
    near(apart(&prrrp, 0, 2), 0.3, 1e-12);
    near(apart(&prrrp, 1, 2), 0.3, 1e-12);
    let twin = machine("twin_actuator");
    let place = Place::home(&twin).unwrap();
    near(apart(&place, 0, 2), place.joints[0], 1e-12);
    near(apart(&place, 1, 2), place.joints[1], 1e-12);
    let platform = machine("tri_planar");
    let place = Place::home(&platform).unwrap();
    let MechanismKind::TriPlanar(platform) = &platform.mechanism else { panic!() };
    for (one, other) in [(3, 4), (4, 5), (5, 3)] {
        near(apart(&place, one, other), platform.side, 1e-12);
    }
    // A foot and the ends of its hinge are a triangle like the platform; D hangs on A and C.
    near(apart(&place, 0, 3), platform.side, 1e-9);
    near(apart(&place, 0, 5), platform.side, 1e-9);
}

#[test]
fn the_footprint_is_the_box_of_all_places() {
    let machine = machine("cartesian");
    let found = places(&machine, [5, 5]).unwrap();
    assert!(found.iter().all(Option::is_some));
    let [x, y] = footprint(found.iter().flatten()).unwrap();
    assert_eq!([x[0], y[0]], [machine.area.lower[0], machine.area.lower[1]]);
    assert_eq!([x[1], y[1]], [machine.area.upper[0], machine.area.upper[1]]);
    assert_eq!(footprint([]), None);
    // Places are row by row from the lowest y.
    let second = found[1].as_ref().unwrap().position;
    assert!(second.x > x[0] && second.y == y[0]);
}
