//! How far a resume goes back, where the limits hinder every change of the rate: never to what the
//! ring has forgotten.

#![allow(clippy::unwrap_used)]

use controller::lookahead::{HISTORY, Lookahead};
use controller::player::Player;
use controller::stream_time::StreamTime;
use machine::Machine;
use messages::{Setpoint, math};

/// Lit throughout, and to and fro at this many times the largest acceleration and jerk of the path: at
/// one of the two at any instant.
fn setpoint(machine: &Machine, sequence: u64, times: f64) -> Setpoint {
    let path = &machine.path;
    let pace = path.jerk / path.acceleration;
    let reach = times * path.acceleration / (pace * pace);
    let mut setpoint = Setpoint { stream: 1, sequence, ..Setpoint::default() };
    setpoint.tool[0] = reach * math::sin(pace * sequence as f64 * 1e-3);
    (setpoint.laser.gate, setpoint.laser.power) = (1, 0.5);
    setpoint
}

/// A hold, a stall in it and a resume at `moment` of a stream whose ring is full: how far back behind the
/// place that was reached the player went [setpoints].
fn way_back(machine: &Machine, times: f64, moment: u64, stall: u64) -> f64 {
    let mut player = Player::new(machine);
    let mut lookahead = Lookahead::new();
    let mut sent = 0;
    let mut cycle = |player: &mut Player, lookahead: &mut Lookahead| {
        while lookahead.room() > 0 {
            lookahead.accept(&setpoint(machine, sent, times)).unwrap();
            sent += 1;
        }
        player.advance(lookahead);
        lookahead.pass(player.now().time);
        let time = player.after().time;
        assert!(time >= lookahead.beginning() && time <= lookahead.end(), "{time:?} is not held");
    };
    cycle(&mut player, &mut lookahead);
    player.resume(&lookahead);
    for _ in 0..moment {
        cycle(&mut player, &mut lookahead);
    }
    assert_eq!(player.now().rate, 1.0);
    player.hold();
    for at in 0..900 {
        // A stall, in the middle of which the hold may begin.
        cycle(&mut player, &mut lookahead);
        if at < stall {
            let given = player.given(&lookahead);
            if given.laser.unwrap().is_lit() {
                player.lose(given.from.max(given.dark_until));
            }
        }
    }
    assert!(player.is_at_rest(), "{:?}", player.now());
    let furthest = player.now().time;
    player.resume(&lookahead);
    let mut back = furthest;
    for _ in 0..4000 {
        cycle(&mut player, &mut lookahead);
        back = back.min(player.after().time);
        if player.after().time > furthest + StreamTime::of(10) {
            return (furthest - back).setpoints();
        }
    }
    panic!("it does not come back from {back:?} to {furthest:?}: {:?}", player.now());
}

#[test]
fn a_hindered_hold_is_gone_back_for_within_what_the_ring_keeps() {
    let machine = Machine::builtin();
    // All of the limits and more than a plan ever uses of them; then far beyond, where a hold is hindered
    // until its patience ends, and the turn of the way back without end.
    for (times, most) in [(0.5, 256.0), (1.0, 256.0), (1.3, 256.0), (30.0, HISTORY as f64)] {
        for phase in (0..125).step_by(6) {
            let back = way_back(&machine, times, 2500 + phase, 50);
            assert!(back < most, "{back} setpoints at {times} times the limits, {phase}");
        }
    }
}
