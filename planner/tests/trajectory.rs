//! What every plan must keep, over random drawings and the letters: continuity of position,
//! velocity and acceleration over all pieces, limits as norms, laser instants, setpoints that are
//! the derivatives of each other, smoothed joins within tolerance.

#![allow(clippy::unwrap_used)]

use machine::kinematics::{Joints, ToolMotion};
use machine::{Machine, Mechanism, MechanismVisitor, Override};
use messages::AxisArray;
use messages::random::SplitMix64;
use messages::setpoint::flags;
use nalgebra::Vector3;
use planner::drawing::{Action, Curve, Drawing, Power, Step};
use planner::trajectory::{Errand, Motion, Piece, Reference, Trajectory};
use planner::verify::checker::Quantity;
use planner::{Job, MarkingSpeed, Plan, PlanError, plan};

fn step(action: Action) -> Step {
    Step { action, line: 7 }
}

fn mark(curve: Curve, speed: Option<f64>) -> Step {
    let power = Power { level: 0.5, follows_speed: speed.is_some() };
    step(Action::Mark { curve, speed, power })
}

fn job(steps: Vec<Step>, machine: &Machine) -> Job {
    let drawing = Drawing {
        name: "test".to_owned(),
        start: Vector3::from(machine.home),
        steps,
        notes: Vec::new(),
    };
    Job::of(drawing)
}

/// An arc that starts at `from` with the direction `heading`, and the point and heading it ends with.
fn arc(from: Vector3<f64>, heading: f64, radius: f64, sweep: f64) -> (Curve, Vector3<f64>, f64) {
    use messages::math::{cos, sin};
    let left = Vector3::new(-sin(heading), cos(heading), 0.0) * sweep.signum();
    let centre = from + left * radius;
    let major = -left * radius;
    let curve = Curve::Arc {
        centre,
        major,
        minor: Vector3::new(-major.y, major.x, 0.0),
        start: 0.0,
        sweep,
        rise: Vector3::zeros(),
    };
    (curve, curve.to(), heading + sweep)
}

/// Strokes of lines, arcs and ellipses, some going on into each other with or without a small kink,
/// with rapids, feeds in the dark, dwells and dots between them.
fn random_drawing(random: &mut SplitMix64, machine: &Machine) -> Job {
    let mut steps = Vec::new();
    let home = Vector3::from(machine.home);
    let mut place = home;
    let mut heading = 0.0;
    for _ in 0..8 {
        let to = home + Vector3::new(random.between(-0.03, 0.03), random.between(-0.03, 0.03), 0.0);
        match random.bits() % 8 {
            0 => {
                steps.push(step(Action::Rapid { to }));
                place = to;
            }
            1 => {
                steps.push(step(Action::Feed {
                    curve: Curve::Line { from: place, to },
                    speed: 0.1,
                }));
                place = to;
            }
            2 => {
                let (curve, to, _) = arc(place, heading, random.between(0.001, 0.02), 2.0);
                steps.push(step(Action::Feed { curve, speed: 0.2 }));
                place = to;
            }
            3 => {
                let lit = random.bits().is_multiple_of(2).then_some(0.3);
                steps.push(step(Action::Dwell { time: random.between(0.001, 0.02), lit }));
            }
            4 => {
                let curve = Curve::Arc {
                    centre: home,
                    major: Vector3::new(random.between(0.005, 0.03), 0.0, 0.0),
                    minor: Vector3::new(0.0, random.between(0.005, 0.03), 0.0),
                    start: random.between(0.0, 6.0),
                    sweep: random.between(-6.2, 6.2),
                    rise: Vector3::zeros(),
                };
                steps.push(mark(curve, None));
                place = curve.to();
            }
            _ => {
                let speed = random.bits().is_multiple_of(2).then(|| random.between(0.02, 0.25));
                for _ in 0..1 + random.bits() % 4 {
                    // A kink below the corner of 1°.
                    heading += random.between(-0.017, 0.017);
                    let (curve, to, turned) = match random.bits() % 2 {
                        0 => {
                            let along = Vector3::new(
                                messages::math::cos(heading),
                                messages::math::sin(heading),
                                0.0,
                            );
                            let to = place + along * random.between(0.0005, 0.02);
                            (Curve::Line { from: place, to }, to, heading)
                        }
                        _ => {
                            let radius = random.between(0.001, 0.03);
                            arc(place, heading, radius, random.between(-3.0, 3.0))
                        }
                    };
                    steps.push(mark(curve, speed));
                    (place, heading) = (to, turned);
                }
            }
        }
    }
    job(steps, machine)
}

/// The tool's motion in a piece of the built-in machine: where the joints rest, that follows from
/// them.
fn tool(motion: &Motion, time: f64, machine: &Machine) -> ToolMotion {
    match motion.at(time) {
        Reference::Tool(tool) => tool,
        Reference::Joints(joints) => {
            let still = [joints.velocity, joints.acceleration, joints.jerk];
            assert!(still.into_iter().flatten().all(|rate| rate == 0.0), "{joints:?}");
            machine.mechanism.visit(At(joints.position))
        }
    }
}

/// The tool at rest with the joints here.
struct At(AxisArray);

impl MechanismVisitor for At {
    type Output = ToolMotion;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> ToolMotion {
        let joints = Joints::<N>::from_fn(|axis, _| self.0[axis]);
        ToolMotion::rest(&mechanism.forward(&joints, mechanism.branch()).unwrap())
    }
}

fn machine_of_any_size() -> Machine {
    let mut machine = Machine::builtin();
    machine.area.lower = [-10.0; 3];
    machine.area.upper = [10.0; 3];
    for axis in &mut machine.axes {
        axis.limits.position = [-20.0, 20.0];
    }
    machine
}

/// Position, velocity and acceleration are continuous where pieces meet, and where the shapes of a
/// stroke's path do; within pieces each is the derivative of the one before, and norms keep limits.
fn check_motion(trajectory: &Trajectory, machine: &Machine, case: &str) {
    let limits = &machine.path;
    let mut before: Option<ToolMotion> = None;
    for (index, piece) in trajectory.pieces.iter().enumerate() {
        let name = format!("{case}, piece {index} of line {}", piece.line);
        let first = tool(&piece.motion, 0.0, machine);
        if let Some(before) = before {
            let jump = first.position - before.position;
            assert!(jump.norm() < 1e-8, "{name}: jumps by {jump}");
            let jump = first.velocity - before.velocity;
            assert!(jump.norm() < 1e-8, "{name}: velocity jumps by {jump}");
            let jump = first.acceleration - before.acceleration;
            assert!(jump.norm() < 1e-5, "{name}: acceleration jumps by {jump}");
        }
        before = Some(tool(&piece.motion, piece.duration, machine));
        let mut instants = vec![0.0, piece.duration];
        if let Motion::Path { path, law, .. } = &piece.motion {
            let places = law.places();
            for seam in path.seams().filter(|seam| places.contains(seam)) {
                let time = law.time_at(seam);
                let speed = law.at(time).velocity;
                let (left, right) = (path.at(seam * (1.0 - 1e-14)), path.at(seam));
                assert!((left.point - right.point).norm() < 1e-8, "{name}");
                let jump = (left.first - right.first) * speed;
                assert!(jump.norm() < 1e-8, "{name}: velocity jumps by {jump} at {seam}");
                let jump = (left.second - right.second) * (speed * speed);
                assert!(jump.norm() < 1e-5, "{name}: acceleration jumps by {jump} at {seam}");
                instants.push(time);
            }
        }
        let count = 200;
        instants.extend(
            (0..=count).map(|sample| piece.duration * f64::from(sample) / f64::from(count)),
        );
        for time in instants {
            let now = tool(&piece.motion, time, machine);
            let over = now.acceleration.norm() / limits.acceleration;
            assert!(over <= 1.0005, "{name}: acceleration {over} of the limit at {time}");
            let over = now.jerk.norm() / limits.jerk;
            assert!(over <= 1.0005, "{name}: jerk {over} of the limit at {time}");
            assert!(now.velocity.norm() <= limits.rapid * 1.005, "{name}: {}", now.velocity);
            if matches!(piece.motion, Motion::Path { errand: Errand::Marks, .. }) {
                let over = now.velocity.norm() / limits.speed;
                // On smoothed joins with the tightest arcs of these drawings; blend.rs.
                assert!(over <= 1.0 + 7e-3, "{name}: {over} of the marking speed at {time}");
            }
            // Simpson over a short step; its error is a third derivative of bounded functions.
            let step = 1e-6_f64.min(piece.duration / 4.0);
            if time + 2.0 * step <= piece.duration && step > 0.0 {
                let middle = tool(&piece.motion, time + step, machine);
                let end = tool(&piece.motion, time + 2.0 * step, machine);
                let mean = (now.velocity + middle.velocity * 4.0 + end.velocity) / 6.0;
                let off = (end.position - now.position) / (2.0 * step) - mean;
                assert!(off.norm() < 1e-8, "{name}: velocity is off by {off} at {time}");
                let mean = (now.acceleration + middle.acceleration * 4.0 + end.acceleration) / 6.0;
                let off = (end.velocity - now.velocity) / (2.0 * step) - mean;
                // A change of jerk inside the step: 2·J·step.
                let most = 2.0 * limits.jerk * step + 1e-6;
                assert!(off.norm() < most, "{name}: acceleration is off by {off} at {time}");
            }
        }
    }
    let last = before.unwrap();
    assert!(last.velocity.norm() < 1e-9 && last.acceleration.norm() < 1e-6, "{case}");
}

/// The stretches of time in which a stroke or dot of `trajectory` may be lit, by its number: its lit
/// pieces and the rests at its dots, joined where one follows the other.
fn lit_spans(trajectory: &Trajectory) -> Vec<[f64; 2]> {
    let may_be_lit = |piece: &&Piece| {
        matches!(piece.motion, Motion::Path { errand: Errand::Marks, .. } | Motion::Rest(_))
    };
    let mut spans: Vec<[f64; 2]> = Vec::new();
    for piece in trajectory.pieces.iter().filter(may_be_lit) {
        let end = piece.start + piece.duration;
        match spans.last_mut() {
            Some(last) if (last[1] - piece.start).abs() < 1e-12 => last[1] = end,
            _ => spans.push([piece.start, end]),
        }
    }
    spans
}

/// Light is only where something is marked, to the nanosecond, each stroke in its order, and of all
/// strokes the laser is dark between them.
fn check_laser(plan: &Plan, case: &str) {
    let trajectory = &plan.trajectory;
    let spans = lit_spans(trajectory);
    let (mut on, mut open, mut most) = (0.0, 0, 0);
    for change in &trajectory.laser {
        let time = change.time.seconds();
        if open == 0 {
            (on, most) = (time, most + 1);
            assert_eq!(change.stroke, most, "{case}: {change:?} is not the next stroke");
        }
        if change.stroke == 0 {
            let within =
                spans.iter().any(|[from, to]| on >= from - 0.51e-9 && time <= to + 0.51e-9);
            assert!(within, "{case}: stroke {open} is lit from {on} to {time} s, beside its marks");
        } else {
            assert!(change.power > 0.0 && change.power <= 1.0, "{case}: {change:?}");
        }
        open = change.stroke;
    }
    assert_eq!(open, 0, "{case}: the laser stays on");
    assert_eq!(most as usize, plan.artwork.strokes.len(), "{case}: strokes lit");
    let lengths = lit_lengths(trajectory);
    assert!(
        (lengths - plan.facts.length).abs() < 2e-3 * plan.facts.length + 1e-9,
        "{case}: {lengths} m lit of {} m",
        plan.facts.length
    );
}

/// How far the tool goes with the laser on, along paths [m].
fn lit_lengths(trajectory: &Trajectory) -> f64 {
    let mut total = 0.0;
    for piece in &trajectory.pieces {
        let Motion::Path { law, errand: Errand::Marks, .. } = &piece.motion else { continue };
        for pair in trajectory.laser.windows(2).filter(|pair| pair[0].stroke != 0) {
            let [from, to] = [pair[0], pair[1]]
                .map(|change| (change.time.seconds() - piece.start).clamp(0.0, piece.duration));
            total += law.at(to).position - law.at(from).position;
        }
    }
    total
}

/// The stream is whole, starts and ends at rest in the dark, and its gate is what the trajectory
/// says.
fn check_stream(plan: &Plan, case: &str) {
    let stream: Vec<_> = plan.setpoints(3).collect();
    assert_eq!(stream.len() as u64, plan.facts.samples, "{case}");
    let mut lit = 0_i64;
    let mut gate = 0;
    let mut strokes = 0;
    for (index, setpoint) in stream.iter().enumerate() {
        assert_eq!((setpoint.stream, setpoint.sequence), (3, index as u64), "{case}");
        assert_eq!(setpoint.laser.gate, gate, "{case}: the gate jumps between cycles");
        let mut since = 0;
        for edge in setpoint.laser.edges() {
            assert!(edge.offset < 1_000_000 && i64::from(edge.offset) >= since, "{case}");
            lit += i64::from(gate != 0) * (i64::from(edge.offset) - since);
            since = i64::from(edge.offset);
            gate = edge.gate;
        }
        lit += i64::from(gate != 0) * (1_000_000 - since);
        assert_eq!(setpoint.stroke != 0, setpoint.laser.is_lit(), "{case}");
        assert!(setpoint.stroke == 0 || setpoint.stroke >= strokes, "{case}");
        strokes = strokes.max(setpoint.stroke);
        assert_eq!(setpoint.has(flags::LAST), index + 1 == stream.len(), "{case}");
    }
    let expected: f64 = plan
        .trajectory
        .laser
        .windows(2)
        .filter(|pair| pair[0].stroke != 0)
        .map(|pair| (pair[1].time - pair[0].time).seconds())
        .sum();
    assert!((lit as f64 * 1e-9 - expected).abs() < 1e-12, "{case}: lit {lit} ns of {expected} s");
    assert_eq!(strokes as usize, plan.artwork.strokes.len(), "{case}");
    for setpoint in stream.iter().take(2).chain(stream.iter().rev().take(2)) {
        assert_eq!(setpoint.path_velocity, 0.0, "{case}");
        assert!(setpoint.lead.iter().all(|lead| lead.abs() < 2e-9), "{case}: {:?}", setpoint.lead);
        assert!(setpoint.effort.iter().all(|effort| effort.abs() < 1e-5), "{case}");
    }
}

#[test]
fn random_drawings_are_smooth_and_keep_their_limits() {
    let machine = machine_of_any_size();
    for seed in 0..120 {
        let mut random = SplitMix64::new(seed);
        let job = random_drawing(&mut random, &machine);
        let case = format!("seed {seed}");
        let planned = match plan(&machine, &job) {
            Ok(planned) => planned,
            Err(error) => panic!("{case}: {error}"),
        };
        check_motion(&planned.trajectory, &machine, &case);
        check_laser(&planned, &case);
        check_stream(&planned, &case);
    }
}

#[test]
fn letters_are_smooth_and_keep_their_limits() {
    let machine = Machine::builtin();
    for style in ["curves", "h1"] {
        let setting = Override { key: "letters.style".to_owned(), value: style.to_owned() };
        let job = Job::builtin(&[setting], &machine).unwrap();
        let planned = plan(&machine, &job).unwrap();
        check_motion(&planned.trajectory, &machine, style);
        check_laser(&planned, style);
        check_stream(&planned, style);
        let strokes = if style == "h1" { 3 + 3 + 19 + 20 } else { 3 + 3 + 1 + 1 };
        assert_eq!(planned.facts.strokes, strokes);
    }
}

/// The smoothed S stays within the tolerance of its two arcs, and leaves them at all.
#[test]
fn a_jump_of_curvature_is_smoothed_within_the_tolerance() {
    for (height, most) in [(0.01, 2e-6), (0.02, 2e-6), (0.05, 2e-6)] {
        let machine = Machine::builtin();
        let settings = [
            Override { key: "letters.text".to_owned(), value: "S".to_owned() },
            Override { key: "letters.height".to_owned(), value: format!("\"{height} m\"") },
        ];
        let planned = plan(&machine, &Job::builtin(&settings, &machine).unwrap()).unwrap();
        let stroke = planned
            .trajectory
            .pieces
            .iter()
            .find_map(|piece| match &piece.motion {
                Motion::Path { path, errand: Errand::Marks, .. } => Some(path.clone()),
                _ => None,
            })
            .unwrap();
        let drawn = &planned.artwork.strokes[0];
        // Chords are shorter than the curve by κ·(chord error)/3, at most 11 ppm here.
        assert!((drawn.length() / stroke.length() - 1.0).abs() < 2e-5);
        assert!((planned.facts.length / stroke.length() - 1.0).abs() < 1e-12);
        let middle = stroke.length() / 2.0;
        let mut worst: f64 = 0.0;
        for index in -400..=400 {
            let point = stroke.at(middle + f64::from(index) * 1e-5).point;
            let nearest = drawn
                .points
                .windows(2)
                .map(|pair| {
                    let (a, b) = (Vector3::from(pair[0]), Vector3::from(pair[1]));
                    let along =
                        ((point - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                    (point - a - (b - a) * along).norm()
                })
                .fold(f64::INFINITY, f64::min);
            worst = worst.max(nearest);
        }
        println!("S at {height} m leaves its line by {worst:e} m");
        assert!(worst <= most && worst > 1e-8, "{height}: {worst:e}");
    }
}

/// The motor's torque over any stretch of cycles adds up to the change of its momentum: rotor and
/// load get what the samples say.
#[test]
fn efforts_add_up_to_momentum() {
    let machine = Machine::builtin();
    let planned = plan(&machine, &Job::builtin(&[], &machine).unwrap()).unwrap();
    let stream: Vec<_> = planned.setpoints(1).collect();
    for axis in 0..2 {
        let (mut impulse, mut worst, mut peak) = (0.0_f64, 0.0_f64, 0.0_f64);
        for pair in stream.windows(2) {
            impulse += (pair[0].effort[axis] + pair[1].effort[axis]) / 2.0 * 1e-3;
            // Momentum of the rotor's lead is left out: B·λ̇ + K·λ = τ makes it 2 % of the peak.
            worst = worst.max((impulse - pair[1].momentum[axis]).abs());
            peak = peak.max(pair[1].momentum[axis].abs());
        }
        assert!(worst < 0.06 * peak, "axis {axis}: {worst:e} of {peak:e} N m s");
        assert!(impulse.abs() < 1e-4 * peak, "axis {axis}: {impulse:e} of {peak:e} N m s left");
    }
}

/// Off the ends of the area: refused with its place.
#[test]
fn a_mark_off_the_area_is_refused_with_its_place() {
    let machine = Machine::builtin();
    let found = match plan(&machine, &line_along_x(0.12, &machine)).unwrap_err() {
        PlanError::Limit { line, place, violation, zero: None } => {
            assert_eq!(line, 7);
            assert_eq!(place.time, violation.time);
            violation
        }
        other => panic!("{other}"),
    };
    assert_eq!((found.quantity, found.limit), (Quantity::ToolPosition(0), 0.2));
    // The end of the drawn line, which says how much is missing.
    assert!((found.value - 0.22).abs() < 1e-9, "{}", found.value);
    let message = plan(&machine, &line_along_x(0.12, &machine)).unwrap_err().to_string();
    assert_eq!(
        message,
        "stroke 1: x of the tool would be 220.000 mm in machine coordinates, outside the area, which \
         ends at 200.000 mm"
    );
}

fn line_along_x(length: f64, machine: &Machine) -> Job {
    let from = Vector3::from(machine.home);
    job(vec![mark(Curve::Line { from, to: from + Vector3::x() * length }, Some(0.2))], machine)
}

/// What an override of rapids slows is the way from mark to mark, and neither marks nor dark lines at a speed of their own.
#[test]
fn only_what_is_as_fast_as_may_be_is_a_rapid() {
    let machine = Machine::builtin();
    // To the side: a gap between lines that go straight on is no move from mark to mark.
    let at = |x: f64| {
        let side = if x < 0.02 { 0.0 } else { 0.01 };
        Vector3::from(machine.home) + Vector3::new(x, side, 0.0)
    };
    let dark = Power { level: 0.0, follows_speed: true };
    let line = |from: f64, to: f64| Curve::Line { from: at(from), to: at(to) };
    let steps = vec![
        mark(line(0.0, 0.01), Some(0.1)),
        step(Action::Rapid { to: at(0.04) }),
        mark(line(0.04, 0.05), Some(0.1)),
        step(Action::Mark { curve: line(0.05, 0.08), speed: Some(0.05), power: dark }),
        mark(line(0.08, 0.09), Some(0.1)),
    ];
    let plan = plan(&machine, &job(steps, &machine)).unwrap();
    let moving = plan.setpoints(1).filter(|setpoint| setpoint.path_velocity > 1e-3);
    let mut seen = [0; 2];
    for setpoint in moving {
        let x = setpoint.tool[0] - machine.home[0];
        let expect = x > 0.0105 && x < 0.0395;
        // The ways in and out of the marks are theirs.
        let near = [0.01, 0.04].iter().any(|end| (x - end).abs() < 3e-3);
        assert!(near || setpoint.has(flags::RAPID) == expect, "at {x}");
        assert!(!(setpoint.laser.is_lit() && setpoint.has(flags::RAPID)), "lit at {x}");
        seen[usize::from(setpoint.has(flags::RAPID))] += 1;
    }
    assert!(seen[0] > 300 && seen[1] > 50, "{seen:?}");
}

/// A motor or an axis that is too weak for a line as fast as asked marks it slower, within its limit.
#[test]
fn a_weak_axis_slows_a_line_and_keeps_its_limit() {
    let strong = Machine::builtin();
    let fast = plan(&strong, &line_along_x(0.05, &strong)).unwrap();
    let slowed = |machine: &Machine| {
        let planned = plan(machine, &line_along_x(0.05, machine)).unwrap();
        assert!(planned.facts.duration > fast.facts.duration);
        assert_eq!(planned.facts.strokes, 1);
        assert!((planned.facts.length - 0.05).abs() < 1e-12);
        check_motion(&planned.trajectory, machine, "weak");
        check_laser(&planned, "weak");
        check_stream(&planned, "weak");
        planned
    };
    // Less than the speed asked for takes on axis b, whose spring takes a part too.
    let mut weak = strong.clone();
    weak.actuators[1].motor.dc_mut().unwrap().voltage = 3.0;
    let planned = slowed(&weak);
    assert!(planned.facts.uses.voltage[1] > 0.8, "{:?}", planned.facts.uses.voltage);
    assert!(planned.facts.uses.voltage.iter().all(|share| *share <= 1.0));

    let mut weak = strong.clone();
    weak.actuators[0].motor.dc_mut().unwrap().current = 0.5;
    let planned = slowed(&weak);
    assert!(planned.facts.uses.current[0] > 0.8, "{:?}", planned.facts.uses.current);
    assert!(planned.facts.uses.current.iter().all(|share| *share <= 1.0));

    let mut slow = strong.clone();
    slow.axes[0].limits.velocity = 0.1;
    let planned = slowed(&slow);
    let most = planned.setpoints(1).map(|sample| sample.velocity[0].abs()).fold(0.0, f64::max);
    assert!(most > 0.099 && most <= 0.1, "{most} m/s of axis a");
    let binding = &planned.facts.binding;
    assert!(binding.iter().any(|limit| limit.axis.as_deref() == Some("a")), "{binding:?}");
}

#[test]
fn a_speed_beyond_the_path_is_reduced_with_one_note() {
    let machine = Machine::builtin();
    let from = Vector3::from(machine.home);
    let (curve, ..) = arc(from, 0.0, 1e-3, 3.0);
    let power = Power { level: 0.5, follows_speed: false };
    let constant = || step(Action::Mark { curve, speed: Some(0.2), power });
    let steps = vec![constant(), step(Action::Pause), constant()];
    let planned = plan(&machine, &job(steps, &machine)).unwrap();
    // V³κ² ≤ J binds at this radius: (500·10⁻⁶)^⅓ = 79.4 mm/s, below √(A·R) = 100 mm/s.
    assert!((planned.facts.speed / 0.079_370 - 1.0).abs() < 6e-3, "{}", planned.facts.speed);
    assert_eq!(planned.facts.notes.len(), 1);
    let note = &planned.facts.notes[0];
    assert_eq!(note.line, 7);
    assert!(note.text.contains("instead of 0.2000 m/s"), "{}", note.text);
    assert_eq!(planned.trajectory.laser[0].power, 0.5);
    // M4 begins and ends at rest, no faster in between, and its power follows the speed.
    let steps = vec![mark(curve, Some(0.2)), step(Action::Pause), mark(curve, Some(0.2))];
    let planned = plan(&machine, &job(steps, &machine)).unwrap();
    let speed = planned.facts.speed;
    assert!(speed > 0.06 && speed <= 0.079_371, "{speed}");
    for change in planned.trajectory.laser.iter().filter(|change| change.stroke != 0) {
        assert!(change.power <= 0.5 * 0.079_371 / 0.2, "{change:?}");
    }
    let pauses: Vec<_> =
        planned.setpoints(1).filter(|setpoint| setpoint.has(flags::PAUSE)).collect();
    assert_eq!(pauses.len(), 1);
    assert_eq!(pauses[0].path_velocity, 0.0);
    assert!(pauses[0].lead.iter().all(|lead| lead.abs() < 1e-8), "{:?}", pauses[0].lead);
}

#[test]
fn laser_delays_are_compensated() {
    let mut machine = Machine::builtin();
    machine.laser.on_delay = 150e-6;
    machine.laser.off_delay = 50e-6;
    let from = Vector3::from(machine.home);
    let curve = Curve::Line { from, to: from + Vector3::x() * 0.01 };
    let planned = plan(&machine, &job(vec![mark(curve, Some(0.1))], &machine)).unwrap();
    let stroke = planned
        .trajectory
        .pieces
        .iter()
        .find(|piece| matches!(piece.motion, Motion::Path { errand: Errand::Marks, .. }));
    let stroke = stroke.unwrap();
    let on = planned.trajectory.laser[0].time.seconds();
    let off = planned.trajectory.laser.last().unwrap();
    assert_eq!((off.power, off.stroke), (0.0, 0));
    let off = off.time.seconds();
    assert!((stroke.start - on - 150e-6).abs() < 1e-9);
    assert!((stroke.start + stroke.duration - off - 50e-6).abs() < 1e-9);
}

/// The rest before the first motion is as long as the source must be told ahead, in whole cycles.
#[test]
fn a_slow_source_is_told_during_the_rest_before_the_first_motion() {
    let mut machine = Machine::builtin();
    let from = Vector3::from(machine.home);
    let curve = Curve::Line { from, to: from + Vector3::x() * 0.01 };
    let job = job(vec![mark(curve, Some(0.1))], &machine);
    for (delay, rest) in [(0.0, 0.002), (1e-9, 0.003), (0.0015, 0.004), (1.0, 1.002)] {
        machine.laser.on_delay = delay;
        let planned = plan(&machine, &job).unwrap();
        let found = planned.trajectory.pieces[0].duration;
        assert!((found - rest).abs() < 1e-12, "{delay} s: {found} s");
        assert!(planned.trajectory.laser[0].time.0 >= 0, "{delay} s");
    }
    // Such a delay cannot be in a machine file; the plan still ends, with an error.
    machine.laser.on_delay = 1e15;
    assert!(matches!(plan(&machine, &job), Err(PlanError::TooLong { .. })));
}

#[test]
fn dots_are_lit_where_and_as_long_as_asked() {
    let machine = Machine::builtin();
    let place = Vector3::from(machine.home) + Vector3::new(0.01, -0.02, 0.0);
    let steps = vec![
        step(Action::Rapid { to: place }),
        step(Action::Dwell { time: 0.0123, lit: Some(0.4) }),
        step(Action::Dwell { time: 0.002, lit: Some(0.8) }),
        step(Action::Output { bit: 2, on: true }),
    ];
    let planned = plan(&machine, &job(steps, &machine)).unwrap();
    assert_eq!(planned.artwork.strokes.len(), 1);
    assert_eq!(planned.artwork.strokes[0].points, vec![[place.x, place.y, place.z]]);
    let changes: Vec<_> = planned.trajectory.laser.iter().map(|change| change.power).collect();
    assert_eq!(changes, [0.4, 0.8, 0.0]);
    let lit = planned.trajectory.laser[2].time - planned.trajectory.laser[0].time;
    assert_eq!(lit.0, 14_300_000);
    let last = planned.setpoints(1).last().unwrap();
    assert_eq!(last.outputs, 4);
    assert!((Vector3::from(last.tool) - place).norm() < 1e-15);
}

#[test]
fn a_fixed_speed_rules_over_the_program() {
    let machine = Machine::builtin();
    let from = Vector3::from(machine.home);
    let curve = Curve::Line { from, to: from + Vector3::x() * 0.02 };
    let mut job = job(vec![mark(curve, Some(0.2))], &machine);
    job.marking.speed = Some(MarkingSpeed::Constant(0.05));
    assert_eq!(plan(&machine, &job).unwrap().facts.speed, 0.05);
    job.marking.speed = Some(MarkingSpeed::Optimum);
    job.marking.max_speed = Some(0.01);
    assert_eq!(plan(&machine, &job).unwrap().facts.speed, 0.01);
}
