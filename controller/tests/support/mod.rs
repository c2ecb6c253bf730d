//! A motor, a move and a bench to run the controller on, all independent of the product's own
//! plant and planner.

#![allow(dead_code, unreachable_pub, missing_docs, clippy::unwrap_used)]

use controller::{Controller, Inputs, Outputs, Peers};
use machine::{Actuator, Machine, StallTolerance};
use messages::feedback::status;
use messages::setpoint::flags;
use messages::time::SETPOINT_PERIOD as CYCLE_PERIOD;
use messages::{
    Command, CommandMode, ControllerReport, ControllerState, Feedback, GateEdge, LaserCycle,
    Nanoseconds, OperatorReply, OperatorRequest, OperatorVerb, Progress, Setpoint,
};

/// Steps in which the motor is integrated [s]; its half is the largest shift in time, 0.25 µm at
/// 0.25 m/s.
const STEP: f64 = 2e-6;

/// The same where only the commands are looked at.
pub const COARSE: f64 = 40e-6;

const CYCLE_TIME: f64 = 1e-3;

/// A DC motor with a rigid load, true stiction, and an encoder.
pub struct Motor {
    actuator: Actuator,
    pub angle: f64,
    pub speed: f64,
    pub current: f64,
    counts: i64,
}

impl Motor {
    pub fn new(actuator: &Actuator, angle: f64) -> Self {
        let actuator = actuator.clone();
        let mut motor = Self { actuator, angle, speed: 0.0, current: 0.0, counts: 0 };
        motor.counts = motor.read();
        motor
    }

    fn read(&self) -> i64 {
        (self.angle / self.actuator.encoder.resolution()).round() as i64
    }

    /// One cycle with `voltage`, or with the phases open.
    fn run(&mut self, voltage: Option<f64>, step: f64) {
        let (motor, friction) = (*self.actuator.motor.dc().unwrap(), self.actuator.friction);
        let inertia = self.actuator.gains.inertia;
        for _ in 0..(CYCLE_TIME / step).round() as usize {
            self.current = match voltage {
                Some(voltage) => {
                    let voltage = voltage.clamp(-motor.voltage, motor.voltage);
                    self.current + motor.current_rate(voltage, self.current, self.speed) * step
                }
                None => 0.0,
            };
            let torque = motor.torque_constant * self.current - friction.viscous * self.speed;
            let free = self.speed + torque / inertia * step;
            let held = friction.coulomb / inertia * step;
            let before = self.speed;
            self.speed = free - free.clamp(-held, held);
            self.angle += (before + self.speed) / 2.0 * step;
        }
    }
}

/// A jerk-limited move of one path coordinate from rest to rest: phases of constant jerk.
#[derive(Clone)]
pub struct Move {
    phases: Vec<(f64, f64)>,
}

impl Move {
    /// Over `length` with a cruise at `speed`; both limits reached on the way.
    pub fn new(length: f64, speed: f64, acceleration: f64, jerk: f64) -> Self {
        let rise = acceleration / jerk;
        let flat = speed / acceleration - rise;
        let cruise = length / speed - (speed / acceleration + rise);
        assert!(flat >= 0.0 && cruise >= 0.0, "the move must reach its limits");
        let up = [(jerk, rise), (0.0, flat), (-jerk, rise)];
        let down = [(-jerk, rise), (0.0, flat), (jerk, rise)];
        let phases = up.into_iter().chain([(0.0, cruise)]).chain(down).collect();
        Self { phases }
    }

    pub fn duration(&self) -> f64 {
        self.phases.iter().map(|(_, time)| time).sum()
    }

    /// When the cruise begins and ends.
    pub fn cruise(&self) -> (f64, f64) {
        let begin: f64 = self.phases[..3].iter().map(|(_, time)| time).sum();
        (begin, begin + self.phases[3].1)
    }

    /// Position, velocity, acceleration and jerk at `time`.
    pub fn at(&self, time: f64) -> [f64; 4] {
        let [mut position, mut velocity, mut acceleration] = [0.0; 3];
        let mut left = time.clamp(0.0, self.duration());
        let mut jerk = 0.0;
        for (phase, length) in &self.phases {
            let t = left.min(*length);
            position += t * (velocity + t * (acceleration / 2.0 + t * phase / 6.0));
            velocity += t * (acceleration + t * phase / 2.0);
            acceleration += t * phase;
            left -= t;
            if left > 0.0 || t < *length {
                jerk = *phase;
            }
            if t < *length {
                break;
            }
        }
        if time <= 0.0 || time >= self.duration() {
            [position, 0.0, 0.0, 0.0]
        } else {
            [position, velocity, acceleration, jerk]
        }
    }
}

/// One part of a test job.
#[derive(Clone)]
pub enum Part {
    /// Standing still [s].
    Rest(f64),
    /// A move in both joints, with these shares of the path coordinate; the cruise is marked.
    Mark(Move, [f64; 2]),
    /// The same, lit in these stretches of time since its begin [s] only.
    Dashes(Move, [f64; 2], Vec<(f64, f64)>),
    /// Standing, and lit [s].
    Dot(f64),
    /// A programmed pause.
    Pause,
}

/// A test job: its setpoints and where it is lit, in stream time [s].
pub struct Job {
    pub setpoints: Vec<Setpoint>,
    pub lit: Vec<(f64, f64)>,
}

/// Samples `parts` from where the machine's home is.
pub fn job(machine: &Machine, stream: u64, parts: &[Part], power: f64) -> Job {
    let home = home(machine);
    let (mut begin, mut origin) = (0.0, home);
    let mut spans = Vec::new();
    let (mut lit, mut pauses) = (Vec::new(), Vec::new());
    for part in parts {
        match part {
            Part::Rest(time) | Part::Dot(time) => {
                spans.push((begin, begin + time, origin, None));
                if matches!(part, Part::Dot(_)) {
                    lit.push((begin, begin + time));
                }
                begin += time;
            }
            Part::Mark(path, shares) | Part::Dashes(path, shares, _) => {
                spans.push((begin, begin + path.duration(), origin, Some((path, *shares))));
                let dashes = match part {
                    Part::Dashes(_, _, dashes) => dashes.clone(),
                    _ => vec![path.cruise()],
                };
                lit.extend(dashes.iter().map(|(on, off)| (begin + on, begin + off)));
                let length = path.at(path.duration())[0];
                origin = [0, 1].map(|axis| origin[axis] + shares[axis] * length);
                begin += path.duration();
            }
            Part::Pause => pauses.push((begin * 1e3).ceil() as u64 + 1),
        }
    }
    let count = (begin * 1e3).ceil() as u64 + 1;
    let mut setpoints: Vec<Setpoint> = (0..count)
        .map(|sequence| {
            let time = sequence as f64 * CYCLE_TIME;
            let mut setpoint = Setpoint { stream, sequence, ..Setpoint::default() };
            let span = spans.iter().find(|(_, to, ..)| time < *to).or(spans.last()).unwrap();
            let (from, _, origin, motion) = span;
            for (index, axis) in machine.actuators.iter().enumerate() {
                let (path, share) = motion.as_ref().map_or(([0.0; 4], 0.0), |(path, shares)| {
                    (path.at(time - from), shares[index])
                });
                let [position, velocity, acceleration, jerk] = path.map(|value| value * share);
                setpoint.position[index] = origin[index] + position;
                setpoint.velocity[index] = velocity;
                setpoint.acceleration[index] = acceleration;
                setpoint.jerk[index] = jerk;
                setpoint.effort[index] = axis.gains.inertia * acceleration / axis.ratio;
                setpoint.momentum[index] = axis.gains.inertia * velocity / axis.ratio;
            }
            let speeds = setpoint.velocity;
            setpoint.path_velocity = tool(&speeds).iter().map(|v| v * v).sum::<f64>().sqrt();
            let accelerations = setpoint.acceleration;
            setpoint.path_acceleration =
                tool(&accelerations).iter().map(|a| a * a).sum::<f64>().sqrt();
            setpoint.path_jerk = tool(&setpoint.jerk).iter().map(|j| j * j).sum::<f64>().sqrt();
            setpoint.tool = tool(&setpoint.position);
            for (index, (on, off)) in lit.iter().enumerate() {
                let edge = |at: f64| ((at - time) * 1e9).round();
                let inside = |at: f64| (0.0..1e6).contains(&edge(at));
                let gate = index as u32 + 1;
                if edge(*on) < 0.0 && edge(*off) >= 0.0 {
                    (setpoint.laser.gate, setpoint.laser.power) = (gate, power);
                }
                let edges = [(*on, gate, power), (*off, 0, 0.0)];
                for (at, gate, power) in edges.into_iter().filter(|(at, ..)| inside(*at)) {
                    let offset = edge(at) as u32;
                    assert!(setpoint.laser.push(GateEdge { offset, gate, power }));
                }
                if setpoint.laser.is_lit() && setpoint.stroke == 0 {
                    setpoint.stroke = u64::from(gate);
                }
            }
            if pauses.contains(&sequence) {
                setpoint.flags |= flags::PAUSE;
            }
            setpoint
        })
        .collect();
    setpoints.last_mut().unwrap().flags |= flags::LAST;
    Job { setpoints, lit }
}

/// A job of two marks there and back, crossing each other's joints.
pub fn two_marks(machine: &Machine, speed: f64, power: f64) -> Job {
    let there = Move::new(0.06, speed, 10.0, 500.0);
    let parts = [
        Part::Rest(0.0203),
        Part::Mark(there.clone(), [1.0, 0.6]),
        Part::Rest(0.0101),
        Part::Mark(there, [-0.7, 1.0]),
        Part::Rest(0.05),
    ];
    job(machine, 1, &parts, power)
}

/// The built-in machine, bearing stalls of `tolerance`.
pub fn stalling(tolerance: Nanoseconds) -> Machine {
    let mut machine = Machine::builtin();
    let period = machine.realtime.period;
    machine.realtime.stall = StallTolerance::new(tolerance, period).unwrap();
    machine
}

/// Joints at home of a CoreXY, or of a Cartesian machine, whose motors are steppers here.
pub fn home(machine: &Machine) -> [f64; 2] {
    let [x, y, _] = machine.home;
    match machine.actuators[0].motor {
        machine::Motor::Dc(_) => [x + y, x - y],
        machine::Motor::Stepper(_) => [x, y],
    }
}

/// The machine file of this name.
pub fn load(name: &str) -> Machine {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../machines");
    Machine::load(&folder.join(name), &[]).unwrap()
}

/// Tool of a CoreXY.
pub fn tool(joints: &[f64]) -> [f64; 3] {
    [(joints[0] + joints[1]) / 2.0, (joints[0] - joints[1]) / 2.0, 0.0]
}

/// What happened in one cycle.
#[derive(Clone, Copy)]
pub struct Record {
    pub feedback: Feedback,
    pub command: Command,
    /// Distance of the tool from where the plan has it [m].
    pub tracking: f64,
}

/// The controller on motors, with the timing of drives.
pub struct Bench {
    pub machine: Machine,
    pub controller: Controller,
    pub motors: Vec<Motor>,
    pub records: Vec<Record>,
    pub reports: Vec<ControllerReport>,
    /// The newest.
    pub progress: Option<Progress>,
    pub feedback: Feedback,
    pub peers: Peers,
    pub sent: usize,
    /// Setpoints that the planner has sent at most, by now.
    pub supply: usize,
    /// Commands that will come too late for their cycle.
    pub late: u32,
    /// Steps in which the motors are integrated [s].
    pub step: f64,
    latched: Command,
    in_force: Command,
    ticket: u32,
}

impl Bench {
    pub fn new(machine: &Machine) -> Self {
        // The motors stand off the encoder's grid, as real ones do.
        let motors = machine
            .actuators
            .iter()
            .zip(home(machine))
            .map(|(actuator, joint)| Motor::new(actuator, joint / actuator.ratio))
            .collect();
        Self {
            machine: machine.clone(),
            controller: Controller::new(machine),
            motors,
            records: Vec::new(),
            reports: Vec::new(),
            progress: None,
            feedback: Feedback { epoch: 5, ..Feedback::default() },
            peers: Peers::default(),
            sent: 0,
            supply: usize::MAX,
            late: 0,
            step: STEP,
            latched: Command::default(),
            in_force: Command::default(),
            ticket: 0,
        }
    }

    pub fn state(&self) -> ControllerState {
        self.records.last().unwrap().command.state()
    }

    pub fn last(&self) -> &Record {
        self.records.last().unwrap()
    }

    pub fn request(&mut self, verb: OperatorVerb, value: f64) -> OperatorRequest {
        self.ticket += 1;
        OperatorRequest {
            verb: verb as u32,
            ticket: self.ticket,
            value,
            ..OperatorRequest::default()
        }
    }

    /// One cycle: measure, answer, move on with the command before.
    pub fn cycle(
        &mut self,
        job: Option<&Job>,
        request: Option<OperatorRequest>,
        spoil: impl FnOnce(&mut Feedback),
    ) -> Option<OperatorReply> {
        let feedback = &mut self.feedback;
        feedback.cycle = feedback.cycle.next();
        feedback.deadline = feedback.deadline + CYCLE_PERIOD;
        feedback.measured = feedback.deadline;
        let elapsed = feedback.elapsed() as f64 * CYCLE_TIME;
        feedback.status =
            if self.latched.mode() == CommandMode::Disabled { 0 } else { status::POWERED };
        for (index, motor) in self.motors.iter_mut().enumerate() {
            let counts = motor.read();
            let resolution = motor.actuator.encoder.resolution();
            feedback.counts[index] = counts;
            feedback.position[index] = counts as f64 * resolution;
            feedback.velocity[index] = (counts - motor.counts) as f64 * resolution / elapsed;
            feedback.current[index] = motor.current;
            motor.counts = counts;
        }
        spoil(feedback);
        let setpoints = job.map_or(&[][..], |job| {
            let room = self.controller.room().min(64);
            let end = (self.sent + room).min(job.setpoints.len()).min(self.supply.max(self.sent));
            let batch = &job.setpoints[self.sent..end];
            self.sent = end;
            batch
        });
        let now = feedback.deadline;
        let inputs = Inputs {
            feedback: &self.feedback,
            received: now,
            setpoints,
            request,
            peers: self.peers,
            slow: 0,
        };
        let mut outputs = Outputs::default();
        self.controller.step(now, &inputs, &mut outputs);
        self.feedback.skipped = 0;
        self.reports.extend(outputs.report);
        self.progress = outputs.progress.or(self.progress);
        let joints: Vec<f64> =
            self.motors.iter().map(|motor| motor.angle * motor.actuator.ratio).collect();
        let tracking = messages::artwork::distance(&tool(&joints), &outputs.command.tool);
        self.records.push(Record { feedback: self.feedback, command: outputs.command, tracking });
        self.run_motors();
        if self.late == 0 {
            self.latched = outputs.command;
        } else {
            self.late -= 1;
            self.miss();
            self.records.last_mut().unwrap().command.laser = LaserCycle::OFF;
        }
        outputs.reply
    }

    /// Cycles whose feedback the controller never sees. The records keep what it had promised.
    pub fn skip(&mut self, cycles: u64) {
        for _ in 0..cycles {
            self.feedback.cycle = self.feedback.cycle.next();
            self.feedback.deadline = self.feedback.deadline + CYCLE_PERIOD;
            for motor in &mut self.motors {
                motor.counts = motor.read();
            }
            self.run_motors();
            self.miss();
            let mut record = *self.last();
            record.command.stream_time += CYCLE_TIME * record.command.rate;
            record.command.laser = LaserCycle::OFF;
            self.records.push(record);
        }
    }

    /// Cycles that drives skips: the newest command comes to nothing, in them and in the cycle after,
    /// and nobody measures. The records keep what the controller had promised.
    pub fn stall(&mut self, cycles: u64) {
        self.latched = self.in_force;
        let [.., before, last] = &mut self.records[..] else { panic!("nothing came before") };
        last.command.laser = LaserCycle::OFF;
        // Out of a planned rest the rate jumps: the command in force has told so by its light.
        let sets_off = last.command.rate == 0.0 && before.command.laser.is_lit();
        let rate = if sets_off { 1.0 } else { last.command.rate };
        self.miss();
        for _ in 0..cycles {
            self.feedback.cycle = self.feedback.cycle.next();
            self.feedback.deadline = self.feedback.deadline + CYCLE_PERIOD;
            self.feedback.skipped += 1;
            self.feedback.overruns += 1;
            self.run_motors();
            self.miss();
            let mut record = *self.last();
            record.command.stream_time += CYCLE_TIME * rate;
            self.records.push(record);
        }
    }

    /// As drives do: the axes go on with what they have, in the dark.
    fn miss(&mut self) {
        self.feedback.missed += 1;
        self.latched.laser = LaserCycle::OFF;
    }

    fn run_motors(&mut self) {
        self.in_force = self.latched;
        for (index, motor) in self.motors.iter_mut().enumerate() {
            let voltage = match self.latched.mode() {
                CommandMode::Disabled => None,
                CommandMode::Driven => Some(self.latched.voltage[index]),
                _ => Some(0.0),
            };
            motor.run(voltage, self.step);
        }
    }

    /// Cycles without anything special.
    pub fn run(&mut self, job: Option<&Job>, cycles: usize) {
        for _ in 0..cycles {
            self.cycle(job, None, |_| {});
        }
    }

    /// One cycle with a request; whether it was accepted.
    pub fn ask(&mut self, job: Option<&Job>, verb: OperatorVerb, value: f64) -> bool {
        let request = self.request(verb, value);
        let reply = self.cycle(job, Some(request), |_| {}).unwrap();
        assert_eq!(reply.ticket, request.ticket);
        reply.accepted == 1
    }

    /// Enabled and idle.
    pub fn enabled(machine: &Machine) -> Self {
        Self::enabled_with(machine, STEP)
    }

    /// Enabled and idle, its motors integrated in steps of `step` [s].
    pub fn enabled_with(machine: &Machine, step: f64) -> Self {
        let mut bench = Self { step, ..Self::new(machine) };
        bench.run(None, 3);
        assert!(bench.ask(None, OperatorVerb::Enable, 0.0));
        bench.run(None, 40);
        assert_eq!(bench.state(), ControllerState::Idle);
        bench
    }

    /// Until `state`, at most `cycles` long.
    pub fn until(&mut self, job: Option<&Job>, state: ControllerState, cycles: usize) {
        for _ in 0..cycles {
            if self.state() == state {
                return;
            }
            self.run(job, 1);
        }
        panic!("{:?} after {cycles} cycles instead of {state:?}", self.state());
    }

    /// The commands given while a stream was played.
    pub fn played(&self) -> impl Iterator<Item = &Record> {
        self.records.iter().filter(|record| record.command.stream != 0)
    }
}

/// Stretches of stream time [s] that a run lit, from stroke to stroke, and the exposure [s].
///
/// The command of cycle k is lit over the stream time from that of k+1 to that of k+2.
pub fn lit_stretches(records: &[Record]) -> (Vec<(f64, f64)>, f64) {
    let mut stretches: Vec<(f64, f64)> = Vec::new();
    let mut exposure = 0.0;
    for window in records.windows(3) {
        let laser: LaserCycle = window[0].command.laser;
        if !laser.is_lit() {
            continue;
        }
        let (from, to) = (window[1].command.stream_time, window[2].command.stream_time);
        let (mut since, mut gate, mut power) = (0.0, laser.gate, laser.power);
        let end = GateEdge { offset: CYCLE_PERIOD.0 as u32, gate: 0, power: 0.0 };
        for edge in laser.edges().iter().chain([&end]) {
            let share = f64::from(edge.offset) / CYCLE_PERIOD.0 as f64;
            if gate != 0 && share > since {
                let stretch = (from + (to - from) * since, from + (to - from) * share);
                exposure += (share - since) * CYCLE_TIME * power;
                match stretches.last_mut() {
                    Some(last) if (last.1 - stretch.0).abs() < 1e-8 => last.1 = stretch.1,
                    _ => stretches.push(stretch),
                }
            }
            (since, gate, power) = (share, edge.gate, edge.power);
        }
    }
    (stretches, exposure)
}

/// Edges are whole nanoseconds of a cycle; two of them bound a stretch [s].
const EDGE: f64 = 3e-9;

/// Every planned stretch lit exactly once, in order.
pub fn check_marks(bench: &Bench, job: &Job, power: f64, case: &str) {
    let (stretches, exposure) = lit_stretches(&bench.records);
    assert_eq!(stretches.len(), job.lit.len(), "{case}: {stretches:?} instead of {:?}", job.lit);
    for (found, planned) in stretches.iter().zip(&job.lit) {
        let apart = (found.0 - planned.0).abs().max((found.1 - planned.1).abs());
        assert!(apart < EDGE, "{case}: {found:?} instead of {planned:?}");
    }
    let planned: f64 = job.lit.iter().map(|(on, off)| (off - on) * power).sum();
    assert!((exposure - planned).abs() < 1e-7, "{case}: exposure {exposure} not {planned}");
}

/// A bench that has just begun to play `job`.
pub fn started(machine: &Machine, job: &Job) -> Bench {
    started_with(machine, job, STEP)
}

/// The same, its motors integrated in steps of `step` [s].
pub fn started_with(machine: &Machine, job: &Job, step: f64) -> Bench {
    let mut bench = Bench::enabled_with(machine, step);
    assert!(bench.ask(Some(job), OperatorVerb::Start, 1.0));
    bench.until(Some(job), ControllerState::Running, 20);
    bench
}

/// Runs until stream time `time` [s] is at most two cycles away.
pub fn reach(bench: &mut Bench, job: &Job, time: f64) {
    while bench.last().command.stream_time < time - 2e-3 {
        bench.run(Some(job), 1);
    }
}

/// Largest second difference of the references, as an acceleration of the joints [m/s²].
pub fn sharpest(records: &[Record], machine: &Machine) -> f64 {
    let actuators = machine.actuators.iter().enumerate();
    actuators
        .flat_map(|(index, axis)| {
            records.windows(3).map(move |window| {
                let [a, b, c] = [0, 1, 2].map(|at| window[at].command.reference[index]);
                ((c - b) - (b - a)).abs() * axis.ratio / 1e-6
            })
        })
        .fold(0.0, f64::max)
}
