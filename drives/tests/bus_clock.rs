//! Deadlines follow the clock of a bus, without a cycle that counts as late.

#![allow(clippy::unwrap_used)]

use drives::{
    Actuation, ActuatorProfile, Bridge, BridgeOptions, Deadlines, Measurement, Port, PortClock,
    Profile,
};
use machine::{ActuatorMode, Machine};
use messages::{Nanoseconds, RealtimeFacts};

/// A port with a clock that is 50 ppm fast.
struct Bus {
    profile: Profile,
    /// How far it is ahead [ns], shared with the test.
    ahead: std::sync::Arc<std::sync::Mutex<f64>>,
}

impl Port for Bus {
    fn profile(&self) -> &Profile {
        &self.profile
    }

    fn send(&mut self, _actuation: &Actuation) {
        *self.ahead.lock().unwrap() += 50.0;
    }

    fn receive(&mut self, measurement: &mut Measurement) {
        let ahead = self.ahead.lock().unwrap().round() as i64;
        *measurement =
            Measurement { clock_offset: Some(Nanoseconds(ahead)), ..Measurement::default() };
    }

    fn moved(&mut self, by: Nanoseconds) {
        *self.ahead.lock().unwrap() += by.0 as f64;
    }
}

fn bridge(clock: PortClock) -> (Bridge, std::sync::Arc<std::sync::Mutex<f64>>) {
    let machine = Machine::builtin();
    let drive = ActuatorProfile::immediate(ActuatorMode::Voltage);
    let profile = Profile { clock, ..Profile::of(vec![drive; machine.actuators.len()]) };
    let ahead = std::sync::Arc::default();
    let port = Bus { profile, ahead: std::sync::Arc::clone(&ahead) };
    let options =
        BridgeOptions { epoch: 1, deadlines: Deadlines::Strict, timing: machine.realtime };
    (Bridge::new(Box::new(port), options), ahead)
}

#[test]
fn deadlines_follow_a_bus_and_no_cycle_is_late_by_that() {
    let (mut bridge, ahead) = bridge(PortClock::Bus);
    let period = Machine::builtin().realtime.period.time();
    let mut deadline = Nanoseconds(1_000_000_000);
    for cycle in 0..4000 {
        let feedback = bridge.begin(deadline, deadline);
        assert_eq!((feedback.overruns, feedback.skipped), (0, 0), "cycle {cycle}");
        bridge.finish(deadline);
        let moved = bridge.follow_clock();
        assert!(moved.0.abs() < 100, "{moved:?} in cycle {cycle}");
        deadline = deadline + period + moved;
    }
    // As it will be at the next deadline.
    let ahead = *ahead.lock().unwrap() + 50.0;
    assert!(ahead.abs() < 10.0, "{ahead} ns");
    let nominal = 1_000_000_000 + 4000 * period.0;
    let earlier = nominal - deadline.0;
    assert!((earlier - 4000 * 50).abs() < 10_000, "{earlier} ns");
    assert_eq!(bridge.report(RealtimeFacts::default()).overruns, 0);
}

#[test]
fn a_port_by_our_clock_moves_no_deadline() {
    let (mut bridge, _ahead) = bridge(PortClock::Ours);
    let deadline = Nanoseconds(1_000_000_000);
    for _ in 0..10 {
        bridge.begin(deadline, deadline);
        assert_eq!(bridge.follow_clock(), Nanoseconds(0));
    }
}
