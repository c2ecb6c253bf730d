//! How far the tool strays from the strokes of a plan, against a recomputation that shares no code with it.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use machine::kinematics::Joints;
use machine::path_check::Deviation;
use machine::{Machine, Mechanism, MechanismVisitor};
use messages::math;
use nalgebra::Vector3;
use planner::trajectory::{Cursor, Errand, Motion, Reference};
use planner::{Job, Plan};

fn machine(name: &str) -> Machine {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../machines").join(name);
    Machine::parse(name, &std::fs::read_to_string(path).unwrap(), &[]).unwrap()
}

fn job(name: &str, machine: &Machine) -> Job {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../jobs").join(name);
    Job::read(&path, &[], machine).unwrap()
}

/// Looks at every millisecond in which a stroke is marked, divided into so many parts.
struct Dense<'a> {
    plan: &'a Plan,
    job: &'a Job,
    parts: u32,
}

impl MechanismVisitor for Dense<'_> {
    type Output = Deviation;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Deviation {
        let trajectory = &self.plan.trajectory;
        let surface = self.job.surface.as_ref().unwrap();
        let setpoints: Vec<_> = self.plan.setpoints(1).collect();
        let mut worst = Deviation::default();
        for pair in setpoints.windows(2) {
            for part in 1..self.parts {
                let share = f64::from(part) / f64::from(self.parts);
                let time = (pair[0].sequence as f64 + share) * 1e-3;
                let piece = trajectory.piece_at(time).unwrap();
                let Motion::Path { errand: Errand::Marks, .. } = &piece.motion else { continue };
                let Reference::Tool(tool) = trajectory.at(time, &mut Cursor::default()) else {
                    panic!("the tool leads along a stroke")
                };
                // Newton's form of the cubic through both ends, each taken twice.
                let q = Joints::<N>::from_fn(|axis, _| {
                    let (from, to) = (pair[0].position[axis], pair[1].position[axis]);
                    let first = pair[0].velocity[axis] * 1e-3;
                    let last = pair[1].velocity[axis] * 1e-3;
                    let (second, third) = (to - from - first, last + first - 2.0 * (to - from));
                    from + share * (first + share * (second + (share - 1.0) * third))
                });
                let pose = mechanism.forward(&q, mechanism.branch()).unwrap();
                let normal = surface.normal_beside(<[f64; 3]>::from(tool.position)).unwrap();
                let sine = pose.rotation.column(2).cross(&Vector3::from(normal)).norm();
                // Nanometres beside it the path is straight.
                let (off, along) = (pose.position - tool.position, tool.velocity.normalize());
                let nearest = (off - along * off.dot(&along)).norm();
                worst = worst.worst(Deviation {
                    matched: (pose.position - tool.position).norm(),
                    geometric: nearest,
                    surface: surface.height(<[f64; 3]>::from(pose.position)).unwrap().abs(),
                    axis: math::asin(sine),
                });
            }
        }
        worst
    }
}

#[test]
fn the_sample_on_a_cone_is_executed_within_a_micrometre_as_a_dense_recomputation_finds() {
    let machine = machine("mcm.toml");
    let job = job("mcm.toml", &machine);
    let plan = planner::plan(&machine, &job).unwrap();
    let tolerance = 5e-6;
    let checks = plan.path_check(job.surface.as_ref(), tolerance).unwrap();
    assert_eq!(checks.len(), plan.facts.strokes);
    let numbers: Vec<u64> = checks.iter().map(|check| check.stroke).collect();
    assert!(numbers.iter().copied().eq(1..=checks.len() as u64), "{numbers:?}");
    let executed =
        checks.iter().map(|check| check.executed).fold(Deviation::default(), Deviation::worst);
    assert!(executed.matched < 1e-6 && executed.matched > 0.0, "{executed:?}");
    assert!(executed.axis < 1e-5, "{executed:?}");
    let dense = |parts| machine.mechanism.visit(Dense { plan: &plan, job: &job, parts });
    let (alike, denser) = (dense(8), dense(64));
    for (name, found, expected, most) in [
        ("matched", executed.matched, alike.matched, denser.matched),
        ("geometric", executed.geometric, alike.geometric, denser.geometric),
        ("surface", executed.surface, alike.surface, denser.surface),
        ("axis", executed.axis, alike.axis, denser.axis),
    ] {
        // To rounding of the forward kinematics and of angles.
        let off = (found - expected).abs();
        assert!(off <= 1e-3 * expected + 1e-14, "{name}: {found:e} against {expected:e}");
        // Where a stroke begins within a millisecond, closer looks see a little more.
        assert!((found..1.5 * found).contains(&most), "{name}: {found:e} against {most:e}");
    }
    // What the planner found while it planned is the middle of the cycles.
    let facts = plan.facts.interpolation.unwrap();
    assert!(facts.deviation <= executed.matched * (1.0 + 1e-9), "{facts:?} {executed:?}");
    assert!(facts.deviation > 0.9 * executed.matched, "{facts:?} {executed:?}");
    assert!(facts.surface.unwrap() <= executed.surface && facts.axis <= executed.axis);

    // Interpolated between knots every stroke stays within tolerance, straight joints with the most knots.
    let mut knots = [0; 3];
    for check in &checks {
        for (count, found) in knots.iter_mut().zip(check.interpolated) {
            let found = found.unwrap();
            assert!(found.deviation.matched <= tolerance, "{check:?}");
            assert!(found.deviation.geometric <= found.deviation.matched * (1.0 + 1e-9));
            *count += found.knots;
        }
    }
    assert!(knots.is_sorted_by(|more, fewer| more > fewer), "{knots:?}");
    // What no number of knots makes is told as that.
    let hopeless = plan.path_check(job.surface.as_ref(), 1e-17).unwrap();
    assert!(hopeless.iter().all(|check| check.interpolated == [None; 3]));
}

/// Straight lines of straight joints need both ends and no more.
#[test]
fn straight_joints_follow_lines_from_end_to_end() {
    let machine = Machine::builtin();
    let set = machine::Override { key: "letters.text".into(), value: "N".into() };
    let job = Job::builtin(&[set], &machine).unwrap();
    let plan = planner::plan(&machine, &job).unwrap();
    assert_eq!(plan.facts.interpolation, None);
    let checks = plan.path_check(None, machine.path.tolerance).unwrap();
    assert_eq!(checks.len(), 3);
    for check in checks {
        // Along the line the jerk steps between two setpoints.
        assert!(check.executed.geometric < 1e-12 && check.executed.matched < 5e-9, "{check:?}");
        for found in check.interpolated {
            let found = found.unwrap();
            assert_eq!(found.knots, 2);
            assert!(found.deviation.matched < 1e-12 && found.deviation.surface == 0.0);
        }
    }
}

/// Through the centre of its table the arm of a polar machine goes on to the other side: another branch,
/// and joints that go on.
#[test]
fn a_line_through_the_centre_of_a_table_is_one_stroke() {
    let machine = machine("polar.toml");
    let program = "G21 G90 G17\nG0 X-20 Y0\nM4 S1000 F600\nG1 X20 Y0\nM5\nM2\n";
    let read = planner::job::gcode::read("line.ngc", program, &machine).unwrap();
    let plan = planner::plan(&machine, &Job::of(read.drawing)).unwrap();
    let checks = plan.path_check(None, machine.path.tolerance).unwrap();
    assert_eq!(checks.len(), 1, "{checks:?}");
    let check = &checks[0];
    assert!(check.executed.matched <= machine.path.tolerance, "{check:?}");
    let facts = plan.facts.interpolation.unwrap();
    assert!(facts.deviation <= check.executed.matched * (1.0 + 1e-9), "{facts:?}");
    assert_eq!((facts.surface, facts.line), (None, 4));
    for found in check.interpolated {
        assert!(found.unwrap().deviation.matched <= machine.path.tolerance, "{check:?}");
    }
}
