//! Any error: dark with the very next command, then to rest, then latched until a reset.

#![allow(clippy::unwrap_used)]

mod support;

use controller::Presence;
use machine::Machine;
use messages::feedback::status;
use messages::setpoint::flags;
use messages::{
    CommandMode, ControllerState, Fault, FaultCode, FaultQuantity, Feedback, Nanoseconds,
    OperatorVerb, Setpoint,
};
use support::{Bench, Job, stalling, two_marks};

/// In the middle of the first mark, lit.
fn marking(machine: &Machine, job: &Job) -> Bench {
    let mut bench = Bench::enabled(machine);
    assert!(bench.ask(Some(job), OperatorVerb::Start, 1.0));
    while !bench.last().command.laser.is_lit() {
        bench.run(Some(job), 1);
    }
    bench.run(Some(job), 30);
    assert!(bench.last().command.laser.is_lit());
    bench
}

/// After one cycle with `spoil`: dark at once, then at rest and latched with `code`.
fn check(code: FaultCode, actuator: u16, mode: CommandMode, spoil: impl Fn(&mut Feedback) + Copy) {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = marking(&machine, &job);
    bench.cycle(Some(&job), None, spoil);
    let command = bench.last().command;
    assert!(!command.laser.is_lit(), "{code:?}: lit in the very next command");
    assert_eq!((command.fault.code(), command.fault.actuator), (code, actuator));
    assert_eq!((command.state(), command.mode()), (ControllerState::Stopping, mode), "{code:?}");
    settle(&mut bench, &job, code);
}

/// Faulted in good time and latched; a reset and an enable later idle again.
fn settle(bench: &mut Bench, job: &Job, code: FaultCode) {
    bench.until(Some(job), ControllerState::Faulted, 1100);
    for _ in 0..50 {
        bench.run(Some(job), 1);
        let command = bench.last().command;
        assert_eq!((command.mode(), command.fault.code()), (CommandMode::Disabled, code));
        assert!(!command.laser.is_lit() && command.voltage.iter().all(|voltage| *voltage == 0.0));
    }
    let report = bench.reports.last().unwrap();
    assert_eq!((report.is_final, report.completed, report.fault.code()), (1, 0, code));
    for verb in [OperatorVerb::Enable, OperatorVerb::Start, OperatorVerb::Resume] {
        assert!(!bench.ask(Some(job), verb, 2.0), "{code:?}: {verb:?} without a reset");
    }
    bench.peers = controller::Peers::default();
    assert!(bench.ask(Some(job), OperatorVerb::Reset, 0.0));
    assert!(!bench.last().command.fault.is_some());
    assert!(bench.last().command.reset > 0);
    assert!(bench.ask(None, OperatorVerb::Enable, 0.0));
    bench.until(None, ControllerState::Idle, 60);
    assert!(!bench.ask(None, OperatorVerb::Start, 1.0), "{code:?}: a stream given up stays so");
}

#[test]
fn a_feedback_that_cannot_be_trusted_brakes_the_drives() {
    let quick = CommandMode::QuickStop;
    check(FaultCode::NotFinite, 2, quick, |feedback| feedback.position[1] = f64::NAN);
    check(FaultCode::NotFinite, 1, quick, |feedback| feedback.current[0] = f64::INFINITY);
    let most = Machine::builtin().realtime.feedback_gap();
    check(FaultCode::StaleFeedback, 0, quick, |feedback| feedback.cycle.0 += most);
    check(FaultCode::StaleFeedback, 0, quick, |feedback| feedback.cycle.0 -= 1);
    check(FaultCode::StaleFeedback, 0, quick, |feedback| feedback.epoch += 1);
    check(FaultCode::StaleCommand, 0, quick, |feedback| {
        feedback.status |= status::WATCHDOG_TRIPPED
    });
    check(FaultCode::DriveFault, 0, quick, |feedback| feedback.status = 0);
    // 1 mm of following error is 0.8 rad at the motor.
    check(FaultCode::FollowingError, 2, quick, |feedback| feedback.position[1] += 0.81);
    check(FaultCode::FollowingError, 1, quick, |feedback| feedback.position[0] -= 0.81);
}

#[test]
fn a_fault_of_the_drives_is_passed_on_as_it_is() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = marking(&machine, &job);
    let code = FaultCode::DriveFault as u32;
    let at = Nanoseconds(123);
    let fault = Fault { code, axis: 2, value: 7.5, at, ..Fault::default() };
    bench.cycle(Some(&job), None, |feedback| feedback.fault = fault);
    assert_eq!(bench.last().command.fault, fault);
    bench.cycle(Some(&job), None, |feedback| feedback.fault = Fault::default());
    assert_eq!(bench.last().command.fault, fault, "the first cause stays");
}

#[test]
fn stream_time_goes_with_the_cycles_and_not_with_the_steps() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = marking(&machine, &job);
    let before = bench.last().command.stream_time;
    bench.skip(2);
    bench.run(Some(&job), 1);
    let after = bench.last().command.stream_time;
    // The hold that makes up for the lost light slows down by 1/3200 in its first cycle.
    assert!((after - before - 3e-3).abs() < 1e-6, "{}", after - before);
    assert_eq!(bench.state(), ControllerState::Holding);
}

#[test]
fn a_lost_peer_stops_the_axes_along_the_path() {
    for (code, lose) in
        [(FaultCode::PlannerLost, 0), (FaultCode::SupervisorLost, 1), (FaultCode::DrivesLost, 2)]
    {
        let machine = Machine::builtin();
        let job = two_marks(&machine, 0.25, 0.5);
        let mut bench = marking(&machine, &job);
        let peer = match lose {
            0 => &mut bench.peers.planner,
            1 => &mut bench.peers.supervisor,
            _ => &mut bench.peers.drives,
        };
        *peer = Presence::Lost;
        bench.run(Some(&job), 1);
        let command = bench.last().command;
        assert!(!command.laser.is_lit(), "{code:?}");
        assert_eq!(command.fault.code(), code);
        if lose < 2 {
            assert_eq!(command.mode(), CommandMode::Driven);
            bench.until(Some(&job), ControllerState::Faulted, 200);
            let worst = bench.played().map(|record| record.tracking).fold(0.0, f64::max);
            assert!(worst < 20e-6, "{worst} m off the path with {code:?}");
        }
        settle(&mut bench, &job, code);
    }
}

#[test]
fn setpoints_that_break_the_stream_or_a_limit_are_never_played() {
    type Spoil = fn(&mut Setpoint);
    let cases: [(FaultCode, Spoil); 17] = [
        (FaultCode::StreamBroken, |setpoint| setpoint.sequence += 1),
        (FaultCode::StreamBroken, |setpoint| setpoint.stream = 2),
        (FaultCode::SetpointLimit, |setpoint| setpoint.velocity[1] = 0.7),
        (FaultCode::SetpointLimit, |setpoint| setpoint.position[0] = 0.5),
        // Within every limit, and not where the one before leads to.
        (FaultCode::SetpointLimit, |setpoint| setpoint.position[1] += 20e-6),
        (FaultCode::SetpointLimit, |setpoint| setpoint.lead[0] = 300e-6),
        // Nothing of these is seen before the rate changes.
        (FaultCode::SetpointLimit, |setpoint| setpoint.static_lead[0] = 300e-6),
        (FaultCode::SetpointLimit, |setpoint| setpoint.static_lead[1] = -300e-6),
        (FaultCode::SetpointLimit, |setpoint| setpoint.lead_momentum[0] = 30e-6),
        (FaultCode::SetpointLimit, |setpoint| setpoint.lead_momentum[1] = -1.0),
        (FaultCode::SetpointLimit, |setpoint| setpoint.effort[0] = 0.12),
        // A rest that is none.
        (FaultCode::SetpointLimit, |setpoint| setpoint.flags |= flags::PAUSE),
        (FaultCode::SetpointLimit, |setpoint| setpoint.flags |= flags::LAST),
        (FaultCode::NotFinite, |setpoint| setpoint.jerk[0] = f64::NAN),
        (FaultCode::NotFinite, |setpoint| setpoint.tool[0] = f64::NAN),
        (FaultCode::NotFinite, |setpoint| setpoint.static_lead[1] = f64::INFINITY),
        (FaultCode::SetpointLimit, |setpoint| setpoint.laser.power = 1.5),
    ];
    for (code, spoil) in cases {
        let machine = Machine::builtin();
        let mut job = two_marks(&machine, 0.25, 0.5);
        spoil(&mut job.setpoints[420]);
        let mut bench = Bench::enabled(&machine);
        bench.supply = 400;
        assert!(bench.ask(Some(&job), OperatorVerb::Start, 1.0));
        bench.run(Some(&job), 60);
        bench.run(Some(&job), 100);
        bench.supply = usize::MAX;
        bench.run(Some(&job), 1);
        assert_eq!(bench.last().command.fault.code(), code);
        assert!(!bench.last().command.laser.is_lit());
        bench.until(Some(&job), ControllerState::Faulted, 200);
        let furthest = bench.played().map(|record| record.command.stream_time).fold(0.0, f64::max);
        assert!(furthest < 0.419, "{furthest}");
        settle(&mut bench, &job, code);
    }
}

/// What gravity takes of the lead stays in a hold: a stream that says anything else where it rests would
/// carry the axes off when it is held.
#[test]
fn a_stream_whose_lead_at_rest_is_not_that_of_its_rests_is_never_played() {
    let machine = Machine::builtin();
    let spoils: [fn(&mut Setpoint); 2] =
        [|setpoint| setpoint.static_lead[0] = 260e-6, |setpoint| setpoint.lead[1] = -260e-6];
    for spoil in spoils {
        let mut job = two_marks(&machine, 0.25, 0.5);
        job.setpoints.iter_mut().for_each(spoil);
        let mut bench = Bench::enabled(&machine);
        assert!(bench.ask(None, OperatorVerb::Start, 1.0));
        bench.run(Some(&job), 1);
        let fault = bench.last().command.fault;
        assert_eq!(fault.code(), FaultCode::SetpointLimit);
        assert_eq!((fault.value.abs(), fault.limit), (260e-6, 250e-6));
        assert_eq!(bench.played().count(), 0);
    }
}

#[test]
fn drives_may_be_late_for_as_long_as_a_stall_is_tolerated_and_a_clock_that_slips_for_ever() {
    for milliseconds in [1, 3, 10, 17] {
        let tolerated = Nanoseconds(milliseconds * 1_000_000);
        let machine = stalling(tolerated);
        let job = two_marks(&machine, 0.25, 0.5);
        let late = |slipping: u32, cycles: i64| {
            let mut bench = marking(&machine, &job);
            for _ in 0..cycles {
                bench.cycle(Some(&job), None, |feedback| {
                    feedback.overruns += 1;
                    feedback.status |= slipping;
                });
            }
            // A cycle in time ends it.
            bench.run(Some(&job), 1);
            bench.last().command.fault
        };
        assert_eq!(late(0, milliseconds).code(), FaultCode::None);
        let fault = late(0, milliseconds + 1);
        let found = (fault.code(), fault.value, fault.limit);
        assert_eq!(found, (FaultCode::Overrun, milliseconds as f64 + 1.0, milliseconds as f64));
        assert_eq!(late(status::SLIPPING, 3 * milliseconds).code(), FaultCode::None);
    }
}

#[test]
fn what_drives_found_in_a_stall_comes_before_the_gap_that_it_left() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = marking(&machine, &job);
    let found = Fault::new(FaultCode::StaleCommand).beyond(FaultQuantity::Cycles, 31.0, 10.0);
    bench.cycle(Some(&job), None, |feedback| {
        feedback.cycle.0 += 30;
        feedback.skipped = 30;
        feedback.fault = found;
    });
    let command = bench.last().command;
    assert_eq!((command.fault.code(), command.fault.value), (FaultCode::StaleCommand, 31.0));
    assert_eq!(command.mode(), CommandMode::QuickStop);
}

#[test]
fn an_overloaded_winding_stops_the_machine() {
    let mut machine = Machine::builtin();
    for actuator in &mut machine.actuators {
        actuator.motor.dc_mut().unwrap().continuous_current = Some(0.05);
    }
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = Bench::enabled(&machine);
    assert!(bench.ask(Some(&job), OperatorVerb::Start, 1.0));
    bench.until(Some(&job), ControllerState::Stopping, 700);
    let fault = bench.last().command.fault;
    assert_eq!((fault.code(), fault.quantity()), (FaultCode::Overload, FaultQuantity::Heating));
    bench.until(Some(&job), ControllerState::Faulted, 1100);
    // Unpowered, the windings cool: enabled again after a while, the machine stays so.
    bench.run(None, 10_000);
    assert!(bench.ask(None, OperatorVerb::Reset, 0.0));
    assert!(bench.ask(None, OperatorVerb::Enable, 0.0));
    bench.until(None, ControllerState::Idle, 60);
    bench.run(None, 100);
    assert_eq!(bench.state(), ControllerState::Idle);
}

#[test]
fn an_overload_hides_no_axis_that_is_lost() {
    let mut machine = Machine::builtin();
    machine.actuators[0].motor.dc_mut().unwrap().continuous_current = Some(0.05);
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = Bench::enabled(&machine);
    assert!(bench.ask(Some(&job), OperatorVerb::Start, 1.0));
    bench.until(Some(&job), ControllerState::Stopping, 700);
    assert_eq!(bench.last().command.mode(), CommandMode::Driven);
    bench.cycle(Some(&job), None, |feedback| feedback.position[1] += 0.81);
    let command = bench.last().command;
    assert_eq!(command.mode(), CommandMode::QuickStop);
    assert_eq!(command.fault.code(), FaultCode::Overload, "the first cause stays");
}

#[test]
fn a_planner_that_is_lost_hides_nothing_that_drives_says() {
    let machine = Machine::builtin();
    let job = two_marks(&machine, 0.25, 0.5);
    let mut bench = marking(&machine, &job);
    bench.peers.planner = Presence::Lost;
    bench.run(Some(&job), 2);
    assert_eq!(bench.last().command.mode(), CommandMode::Driven);
    // Two feedbacks lost on the way to rest: the plan goes on by three cycles, not by one.
    let before = bench.last().command.stream_time;
    bench.skip(2);
    bench.run(Some(&job), 1);
    let gone = bench.last().command.stream_time - before;
    assert!(gone > 2.9e-3, "{gone}");
    // A drive fault after that still brakes the axes at once, under the fault that came first.
    bench.cycle(Some(&job), None, |feedback| feedback.fault = Fault::new(FaultCode::DriveFault));
    let command = bench.last().command;
    assert_eq!(command.mode(), CommandMode::QuickStop);
    assert_eq!(command.fault.code(), FaultCode::PlannerLost);
}

#[test]
fn a_stream_must_start_where_the_axes_stand() {
    let machine = Machine::builtin();
    let mut job = two_marks(&machine, 0.25, 0.5);
    for setpoint in &mut job.setpoints {
        setpoint.position[1] += 1e-4;
    }
    let mut bench = Bench::enabled(&machine);
    assert!(bench.ask(Some(&job), OperatorVerb::Start, 1.0));
    bench.until(Some(&job), ControllerState::Faulted, 60);
    let fault = bench.last().command.fault;
    assert_eq!((fault.code(), fault.actuator), (FaultCode::StreamStart, 2));
    assert!((fault.value - 1e-4).abs() < 2e-6, "{} m", fault.value);
}
