//! Limits, ends, bounds and directions of the travel.

use super::course::SPEED_SHARE;
use super::*;
use messages::random::SplitMix64;

const PERIOD: f64 = 1e-3;

/// Differences of the planned places keep the limits, and the ways end where they shall.
#[test]
fn random_requests_never_break_a_limit() {
    let machine = Machine::builtin();
    let pace = Pace::new(&machine, &machine.axes[0]);
    let ratio = machine.actuators[0].ratio;
    for seed in 1..200 {
        let mut random = SplitMix64::new(seed);
        let mut travel = Travel::new(&machine, PERIOD);
        let mut standing = Planned::default();
        let mut joints = [0.0; 4];
        for _ in 0..4000 {
            if random.fraction() < 0.01 {
                match (random.fraction() * 3.0) as u32 {
                    0 => travel.run(0, (random.fraction() - 0.5) * 4.0 * pace.velocity, &standing),
                    1 => travel.stop(0),
                    _ if travel.rests(0) => travel.go(0, random.fraction() - 0.5, 1.0, &standing),
                    _ => {}
                }
            }
            standing = travel.advance(|_| {}).unwrap_or(standing);
            joints.rotate_left(1);
            joints[3] = standing.angle[0] * ratio;
            let [a, b, c, d] = joints;
            let velocity = (d - c) / PERIOD;
            let acceleration = (d - 2.0 * c + b) / (PERIOD * PERIOD);
            let jerk = (d - 3.0 * c + 3.0 * b - a) / (PERIOD * PERIOD * PERIOD);
            let most = pace.velocity / SPEED_SHARE;
            assert!(velocity.abs() <= most, "seed {seed}: {velocity}");
            assert!(acceleration.abs() <= 1.01 * pace.acceleration, "seed {seed}: {acceleration}");
            assert!(jerk.abs() <= 1.05 * pace.jerk, "seed {seed}: {jerk}");
        }
    }
}

#[test]
fn a_joint_that_is_kept_within_stops_before_the_end_and_close_to_it() {
    let machine = Machine::builtin();
    let mut bounds = [None; MOVERS];
    bounds[0] = Some([-0.1, 0.1]);
    for speed in [0.01, 0.1, 0.2] {
        let mut travel = Travel::new(&machine, PERIOD);
        let mut standing = Planned::default();
        travel.run(0, speed, &standing);
        for _ in 0..20_000 {
            travel.keep_within(0, &bounds, &standing);
            standing = travel.advance(|_| {}).unwrap_or(standing);
            assert!(travel.place(0, &standing) <= 0.1);
        }
        assert!(travel.is_at_rest());
        assert!(travel.place(0, &standing) > 0.1 - 1.1e-3 * speed.max(0.1), "{speed}");
    }
}

#[test]
fn the_tool_of_a_corexy_goes_straight_and_no_joint_leads_it_out_of_the_area() {
    let machine = Machine::builtin();
    let [x, y] = [MAX_AXES, MAX_AXES + 1];
    let mut travel = Travel::new(&machine, PERIOD);
    let mut standing = Planned::default();
    travel.go(y, 0.02, 0.1, &standing);
    while let Some(mut planned) = travel.advance(|_| {}) {
        let joint = |index: usize| planned.angle[index] * machine.actuators[index].ratio;
        assert!((joint(0) + joint(1)).abs() < 1e-12, "x stays");
        planned.tool[1] = (joint(0) - joint(1)) / 2.0;
        standing = planned;
    }
    assert!((travel.place(y, &standing) - 0.02).abs() < 1e-12);
    assert!((travel.place(0, &standing) - 0.02).abs() < 1e-12);
    // Belt a takes the tool along x and y at once: x ends it.
    let mut bounds = [None; MOVERS];
    bounds[x] = Some([-0.01, 0.03]);
    let far = travel.beyond(0, 0.1, &bounds, &standing).expect("a bound");
    assert_eq!((far.mover, far.limit), (x, 0.03));
    assert!((far.end - 0.05).abs() < 1e-12);
    travel.run(0, 0.1, &standing);
    let mut told = None;
    for _ in 0..5000 {
        told = told.or(travel.keep_within(0, &bounds, &standing));
        assert!(travel.place(x, &standing) <= 0.03);
        let Some(mut planned) = travel.advance(|_| {}) else { break };
        planned.tool[0] = 0.5 * (planned.angle[0] * machine.actuators[0].ratio - 0.02);
        standing = planned;
    }
    assert_eq!(told.map(|it| it.mover), Some(x));
    assert!(travel.is_at_rest());
}

#[test]
fn a_way_ends_exactly_where_it_shall_and_a_shift_moves_nothing() {
    let machine = Machine::builtin();
    let mut travel = Travel::new(&machine, PERIOD);
    let mut standing = Planned::default();
    travel.go(1, -0.05, 0.1, &standing);
    while let Some(planned) = travel.advance(|_| {}) {
        standing = planned;
    }
    assert!((travel.place(1, &standing) + 0.05).abs() < 1e-12);
    assert_eq!(standing.speed, [0.0; MAX_ACTUATORS]);
    travel.go(1, 0.05, 0.1, &standing);
    travel.advance(|_| {});
    let before = travel.place(1, &standing);
    let mut shift = [0.0; MAX_ACTUATORS];
    shift[1] = 3.0;
    travel.shift(&shift);
    let moved = travel.place(1, &standing) - before;
    assert!((moved - 3.0 * machine.actuators[1].ratio).abs() < 1e-12);
}
