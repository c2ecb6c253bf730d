//! What a stepper's driver is told has no step, with a load that leans on it all the time: not where
//! a stream starts, pauses, is held, goes on, or ends.

#![allow(clippy::unwrap_used)]

mod support;

use std::path::Path;

use controller::{Controller, Inputs, Outputs, Peers};
use machine::Machine;
use messages::feedback::status;
use messages::setpoint::flags;
use messages::time::{Period, SETPOINT_PERIOD as CYCLE_PERIOD};
use messages::{
    ActuatorArray, CommandMode, ControllerState, Feedback, MAX_ACTUATORS, OperatorRequest,
    OperatorVerb, Setpoint,
};
use support::Move;

/// How far gravity has the second motor's field ahead of its joint [m]: far more than a pulse.
const LEAD: f64 = 30e-6;

fn machine() -> Machine {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../machines/cartesian_steppers.toml");
    Machine::load(&path, &[]).unwrap()
}

/// A move of x, a programmed pause, and a move back; y bears its load at rest.
fn setpoints(machine: &Machine) -> Vec<Setpoint> {
    let path = Move::new(0.06, 0.2, 5.0, 200.0);
    let [home_x, home_y, _] = machine.home;
    let moving = (path.duration() * 1e3).ceil() as u64 + 1;
    let sample = |sequence: u64| {
        let (time, back) = match sequence.checked_sub(moving) {
            None => (sequence as f64 * 1e-3, false),
            Some(later) => (later as f64 * 1e-3, true),
        };
        let [mut position, mut velocity, mut acceleration, mut jerk] = path.at(time);
        if back {
            position = path.at(path.duration())[0] - position;
            [velocity, acceleration, jerk] = [-velocity, -acceleration, -jerk];
        }
        let axis = &machine.actuators[0];
        let mut setpoint = Setpoint { stream: 1, sequence, ..Setpoint::default() };
        setpoint.position[..2].copy_from_slice(&[home_x + position, home_y]);
        setpoint.tool = [home_x + position, home_y, 0.0];
        (setpoint.velocity[0], setpoint.acceleration[0]) = (velocity, acceleration);
        setpoint.jerk[0] = jerk;
        setpoint.effort[0] = axis.gains.inertia * acceleration / axis.ratio;
        setpoint.momentum[0] = axis.gains.inertia * velocity / axis.ratio;
        setpoint.path_velocity = velocity.abs();
        setpoint.path_acceleration = acceleration.abs();
        setpoint.path_jerk = jerk.abs();
        (setpoint.lead[1], setpoint.static_lead[1]) = (LEAD, LEAD);
        (setpoint.effort[1], setpoint.static_effort[1]) = (0.05, 0.05);
        if sequence == moving {
            setpoint.flags |= flags::PAUSE;
        }
        if sequence == 2 * moving {
            setpoint.flags |= flags::LAST;
        }
        setpoint
    };
    (0..=2 * moving).map(sample).collect()
}

/// The controller, and drivers that do what they are told one cycle later.
struct Drivers {
    machine: Machine,
    controller: Controller,
    feedback: Feedback,
    sent: usize,
    /// What the drivers were told while powered, in joint units.
    told: Vec<[f64; 2]>,
    state: ControllerState,
    ticket: u32,
    /// Positions and speeds at the end of the command before the newest [rad, rad/s].
    position_before: ActuatorArray,
    velocity_before: ActuatorArray,
    newest: (ActuatorArray, ActuatorArray),
    /// How far the drivers are ahead of the measurement that comes, after a stall [rad].
    ahead: ActuatorArray,
}

impl Drivers {
    fn new(machine: &Machine) -> Self {
        let mut feedback = Feedback { epoch: 5, ..Feedback::default() };
        for (axis, motor) in machine.actuators.iter().enumerate() {
            let ahead = if axis == 1 { LEAD } else { 0.0 };
            feedback.position[axis] = (machine.home[axis] + ahead) / motor.ratio;
        }
        Self {
            machine: machine.clone(),
            controller: Controller::new(machine),
            feedback,
            sent: 0,
            told: Vec::new(),
            state: ControllerState::default(),
            ticket: 0,
            position_before: [0.0; MAX_ACTUATORS],
            velocity_before: [0.0; MAX_ACTUATORS],
            newest: ([0.0; MAX_ACTUATORS], [0.0; MAX_ACTUATORS]),
            ahead: [0.0; MAX_ACTUATORS],
        }
    }

    /// Enabled, and playing `setpoints`.
    fn running(machine: &Machine, setpoints: &[Setpoint]) -> Self {
        let mut drivers = Self::new(machine);
        for _ in 0..3 {
            drivers.cycle(&[], None);
        }
        drivers.cycle(&[], Some(OperatorVerb::Enable));
        drivers.until(&[], ControllerState::Idle);
        drivers.cycle(setpoints, Some(OperatorVerb::Start));
        drivers.until(setpoints, ControllerState::Running);
        drivers
    }

    fn cycle(&mut self, setpoints: &[Setpoint], verb: Option<OperatorVerb>) {
        self.feedback.cycle = self.feedback.cycle.next();
        self.feedback.deadline = self.feedback.deadline + CYCLE_PERIOD;
        self.feedback.measured = self.feedback.deadline;
        for (position, ahead) in self.feedback.position.iter_mut().zip(&self.ahead) {
            *position -= ahead;
        }
        self.ahead = [0.0; MAX_ACTUATORS];
        let end = (self.sent + self.controller.room().min(64)).min(setpoints.len());
        let request = verb.map(|verb| {
            self.ticket += 1;
            let value = if verb == OperatorVerb::Start { 1.0 } else { 0.0 };
            OperatorRequest {
                verb: verb as u32,
                ticket: self.ticket,
                value,
                ..OperatorRequest::default()
            }
        });
        let now = self.feedback.deadline;
        let inputs = Inputs {
            feedback: &self.feedback,
            received: now,
            setpoints: &setpoints[self.sent..end],
            request,
            peers: Peers::default(),
            slow: 0,
        };
        self.sent = end;
        let mut outputs = Outputs::default();
        self.controller.step(now, &inputs, &mut outputs);
        if verb.is_some() {
            assert_eq!(outputs.reply.unwrap().accepted, 1, "{verb:?}");
        }
        let command = outputs.command;
        self.state = command.state();
        self.feedback.status = 0;
        self.feedback.skipped = 0;
        if command.mode() == CommandMode::Disabled {
            return;
        }
        self.feedback.status = status::POWERED;
        assert_eq!(command.mode(), CommandMode::Driven);
        let before = self.feedback.position;
        (self.position_before, self.velocity_before) = (self.newest.0, self.newest.1);
        self.newest = (command.position, command.velocity);
        self.feedback.position = command.position;
        let moved = before.iter().zip(&command.position);
        for (velocity, (before, now)) in self.feedback.velocity.iter_mut().zip(moved) {
            *velocity = (now - before) / 1e-3;
        }
        let joint = |axis: usize| command.position[axis] * self.machine.actuators[axis].ratio;
        self.told.push([joint(0), joint(1)]);
    }

    /// Cycles that drives skips, and the one after them: the drivers go on at the speed that they
    /// were told last in force, which is that of the command before the newest.
    fn stall(&mut self, cycles: u64) {
        let coasting = self.velocity_before;
        // The newest command comes to nothing.
        let _ = self.told.pop();
        self.feedback.position = self.position_before;
        for _ in 0..=cycles {
            for (position, speed) in self.feedback.position.iter_mut().zip(&coasting) {
                *position += speed * 1e-3;
            }
            let ratio = |axis: usize| self.machine.actuators[axis].ratio;
            let joint = |axis: usize| self.feedback.position[axis] * ratio(axis);
            self.told.push([joint(0), joint(1)]);
        }
        // What is measured is where they are at the deadline: a cycle before the end of all that.
        self.ahead = coasting.map(|speed| speed * 1e-3);
        self.feedback.cycle.0 += cycles;
        self.feedback.skipped = u16::try_from(cycles).unwrap();
        self.feedback.missed += cycles + 1;
        self.feedback.deadline = self.feedback.deadline + Period::OF_SETPOINTS.of(cycles);
    }

    /// Until a hold has come to rest.
    fn rest(&mut self, setpoints: &[Setpoint]) {
        for _ in 0..300 {
            self.cycle(setpoints, None);
        }
        assert_eq!(self.state, ControllerState::Holding);
    }

    fn until(&mut self, setpoints: &[Setpoint], state: ControllerState) {
        for _ in 0..3000 {
            if self.state == state {
                return;
            }
            self.cycle(setpoints, None);
        }
        panic!("{:?} instead of {state:?}", self.state);
    }
}

#[test]
fn a_loaded_steppers_position_has_no_step() {
    let machine = machine();
    let setpoints = setpoints(&machine);
    let mut drivers = Drivers::running(&machine, &setpoints);
    for _ in 0..100 {
        drivers.cycle(&setpoints, None);
    }
    drivers.cycle(&setpoints, Some(OperatorVerb::Hold));
    drivers.rest(&setpoints);
    drivers.cycle(&setpoints, Some(OperatorVerb::Resume));
    drivers.until(&setpoints, ControllerState::Running);
    // The programmed pause.
    drivers.until(&setpoints, ControllerState::Holding);
    drivers.rest(&setpoints);
    drivers.cycle(&setpoints, Some(OperatorVerb::Resume));
    drivers.until(&setpoints, ControllerState::Running);
    drivers.until(&setpoints, ControllerState::Idle);
    for _ in 0..50 {
        drivers.cycle(&setpoints, None);
    }

    assert!(drivers.told.len() > 600, "{}", drivers.told.len());
    // The loaded axis has nothing to do at all.
    let held = machine.home[1] + LEAD;
    let off = drivers.told.iter().map(|told| (told[1] - held).abs()).fold(0.0, f64::max);
    assert!(off < 1e-9, "the loaded axis was told to move by {off:e} m");
    // The other one accelerates by 5 m/s² at most, and by what a hold may add.
    let sharpest = drivers
        .told
        .windows(3)
        .map(|told| ((told[2][0] - told[1][0]) - (told[1][0] - told[0][0])).abs() / 1e-6)
        .fold(0.0, f64::max);
    assert!(sharpest < 5.5, "{sharpest} m/s²");
    let moved = drivers.told.iter().map(|told| told[0] - machine.home[0]).fold(0.0, f64::max);
    assert!((moved - 0.06).abs() < 1e-6, "{moved}");
}

#[test]
fn a_stepper_comes_back_from_a_stall_without_a_step() {
    let machine = machine();
    let setpoints = setpoints(&machine);
    // While it speeds up, cruises, and slows down.
    for moment in [30, 150, 290] {
        let mut drivers = Drivers::running(&machine, &setpoints);
        for _ in 0..moment {
            drivers.cycle(&setpoints, None);
        }
        drivers.stall(9);
        assert!(drivers.told.len() > 10);
        for _ in 0..200 {
            drivers.cycle(&setpoints, None);
        }
        let sharpest = drivers
            .told
            .windows(3)
            .map(|told| ((told[2][0] - told[1][0]) - (told[1][0] - told[0][0])).abs() / 1e-6)
            .fold(0.0, f64::max);
        // The plan's 5 m/s², as much again to come back, and the end of the coasting.
        assert!(sharpest < 11.0, "{sharpest} m/s² at {moment}");
        // On the plan again by the pause.
        drivers.until(&setpoints, ControllerState::Holding);
        drivers.rest(&setpoints);
        let stands = drivers.told.last().unwrap()[0] - machine.home[0];
        assert!((stands - 0.06).abs() < 1e-9, "{stands}");
    }
}

#[test]
fn a_stream_that_a_stall_met_at_its_end_is_over_when_its_steppers_stand_on_it() {
    let machine = machine();
    let mut setpoints = setpoints(&machine);
    // The move out alone.
    setpoints.truncate(setpoints.len() / 2 + 1);
    let last = setpoints.last_mut().unwrap();
    last.flags = flags::LAST;
    for before_the_end in [45, 30, 20] {
        let mut drivers = Drivers::running(&machine, &setpoints);
        for _ in 0..setpoints.len() - before_the_end {
            drivers.cycle(&setpoints, None);
        }
        drivers.stall(9);
        drivers.until(&setpoints, ControllerState::Idle);
        for _ in 0..100 {
            drivers.cycle(&setpoints, None);
            assert_eq!(drivers.newest.1, [0.0; MAX_ACTUATORS], "{before_the_end}");
        }
        let stands = drivers.told.last().unwrap()[0] - machine.home[0];
        assert!((stands - 0.06).abs() < 1e-9, "{stands} at {before_the_end}");
    }
}
