//! Holds, resumes and overrides at many places of planned jobs: what the references do from cycle to
//! cycle stays within the limits of the path and of the joints.
//!
//! Planner and controller only. The motors follow exactly, so that nothing but the references speaks.

#![allow(clippy::unwrap_used)]

use controller::{Controller, Inputs, Outputs, Peers};
use machine::kinematics::Joints;
use machine::{Machine, Mechanism, MechanismVisitor};
use messages::feedback::status;
use messages::time::{Period, SETPOINT_TIME};
use messages::{
    CommandMode, ControllerState, Cycle, Feedback, Nanoseconds, OperatorRequest, OperatorVerb,
    Setpoint,
};
use planner::job::Job;
use std::path::Path;

/// Tool, and joints on the load side, at one cycle.
#[derive(Clone, Copy, Default)]
struct Place {
    tool: [f64; 3],
    joints: [f64; messages::MAX_AXES],
}

/// The largest of what was used of the limits, by differences over the time of a setpoint.
#[derive(Clone, Copy, Default, Debug, PartialEq)]
struct Uses {
    acceleration: f64,
    jerk: f64,
    joint_acceleration: f64,
    joint_jerk: f64,
}

impl Uses {
    fn largest(&self) -> f64 {
        let Self { acceleration, jerk, joint_acceleration, joint_jerk } = *self;
        [acceleration, jerk, joint_acceleration, joint_jerk].into_iter().fold(0.0, f64::max)
    }

    fn raise(&mut self, other: &Self) {
        self.acceleration = self.acceleration.max(other.acceleration);
        self.jerk = self.jerk.max(other.jerk);
        self.joint_acceleration = self.joint_acceleration.max(other.joint_acceleration);
        self.joint_jerk = self.joint_jerk.max(other.joint_jerk);
    }

    /// Between four places, the time of a setpoint apart.
    fn of(machine: &Machine, places: &[Place; 4]) -> Self {
        let [a, b, c, d] = places;
        let second = |a: f64, b: f64, c: f64| (c - 2.0 * b + a) / (SETPOINT_TIME * SETPOINT_TIME);
        let third = |a: f64, b: f64, c: f64, d: f64| {
            (d - 3.0 * c + 3.0 * b - a) / (SETPOINT_TIME * SETPOINT_TIME * SETPOINT_TIME)
        };
        let norm = |part: &dyn Fn(usize) -> f64| {
            (0..3).map(|index| part(index) * part(index)).sum::<f64>().sqrt()
        };
        let tool = |i: usize| [a.tool[i], b.tool[i], c.tool[i], d.tool[i]];
        let joint = |i: usize| [a.joints[i], b.joints[i], c.joints[i], d.joints[i]];
        let mut uses = Self {
            acceleration: norm(&|i| {
                let [_, b, c, d] = tool(i);
                second(b, c, d)
            }) / machine.path.acceleration,
            jerk: norm(&|i| {
                let [a, b, c, d] = tool(i);
                third(a, b, c, d)
            }) / machine.path.jerk,
            ..Self::default()
        };
        for (index, axis) in machine.axes.iter().enumerate() {
            let [a, b, c, d] = joint(index);
            let acceleration = second(b, c, d).abs() / axis.limits.acceleration;
            let jerk = third(a, b, c, d).abs() / axis.limits.jerk;
            uses.joint_acceleration = uses.joint_acceleration.max(acceleration);
            uses.joint_jerk = uses.joint_jerk.max(jerk);
        }
        uses
    }
}

/// The tool of a machine with its joints here.
struct Forward([f64; messages::MAX_AXES]);

impl MechanismVisitor for Forward {
    type Output = [f64; 3];

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> [f64; 3] {
        let joints = Joints::<N>::from_fn(|index, _| self.0[index]);
        let state = mechanism.solve(&joints, mechanism.branch(), None).unwrap();
        mechanism.pose(&state).position.into()
    }
}

/// A planned job.
struct Planned {
    name: &'static str,
    machine: Machine,
    setpoints: Vec<Setpoint>,
}

impl Planned {
    fn new(name: &'static str, machine: Machine, job: &Job) -> Self {
        let plan = planner::plan(&machine, job).unwrap();
        let setpoints = plan.setpoints(1).collect();
        Self { name, machine, setpoints }
    }

    fn builtin() -> Self {
        let machine = Machine::builtin();
        let job = Job::builtin(&[], &machine).unwrap();
        Self::new("letters", machine, &job)
    }

    /// With another period of the control cycle.
    fn at(mut self, period: Nanoseconds) -> Self {
        self.machine.realtime.period = Period::new(period).unwrap();
        self
    }

    /// Cycles in a setpoint.
    fn per_setpoint(&self) -> usize {
        self.machine.realtime.period.cycles_for(Period::OF_SETPOINTS.time()) as usize
    }

    /// With joints that bear less than what the tool may ask of them.
    fn limited() -> Self {
        let mut machine = Machine::builtin();
        for axis in &mut machine.axes {
            (axis.limits.acceleration, axis.limits.jerk) = (11.0, 520.0);
        }
        let job = Job::builtin(&[], &machine).unwrap();
        Self::new("limited joints", machine, &job)
    }

    fn file(machine: &str, job: &'static str) -> Self {
        let source = |path: String| Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
        let machine = Machine::load(&source(format!("machines/{machine}.toml")), &[]).unwrap();
        let read = Job::read(&source(format!("jobs/{job}")), &[], &machine).unwrap();
        Self::new(job, machine, &read)
    }

    /// Load-side joints at a stream time [setpoints], by the cubics between the setpoints.
    fn joints(&self, time: f64) -> [f64; messages::MAX_AXES] {
        let last = self.setpoints.len() - 1;
        let from = (time.max(0.0) as usize).min(last);
        let to = (from + 1).min(last);
        let at = time - from as f64;
        let (from, to) = (&self.setpoints[from], &self.setpoints[to]);
        std::array::from_fn(|index| {
            let slopes = [from, to].map(|setpoint| setpoint.velocity[index] * SETPOINT_TIME);
            let rise = to.position[index] - from.position[index];
            let square = 3.0 * rise - 2.0 * slopes[0] - slopes[1];
            let cube = slopes[0] + slopes[1] - 2.0 * rise;
            from.position[index] + at * (slopes[0] + at * (square + at * cube))
        })
    }
}

/// A controller on a planned job.
struct Bench<'a> {
    planned: &'a Planned,
    controller: Controller,
    outputs: Outputs,
    feedback: Feedback,
    positions: [messages::ActuatorArray; 2],
    sent: usize,
    supply: usize,
    /// Of the newest cycles, the newest last: over the time of three setpoints.
    places: Vec<Place>,
    uses: Uses,
    ticket: u32,
    lit: Vec<(f64, f64)>,
    times: [f64; 3],
    lasers: [messages::LaserCycle; 2],
}

impl<'a> Bench<'a> {
    fn new(planned: &'a Planned) -> Self {
        let first = &planned.setpoints[0];
        let mut feedback = Feedback { epoch: 1, ..Feedback::default() };
        for (index, it) in planned.machine.actuators.iter().enumerate() {
            feedback.position[index] = (first.position[index] + first.lead[index]) / it.ratio;
        }
        feedback.tool = first.tool;
        let place = Place { tool: first.tool, joints: planned.joints(0.0) };
        let mut bench = Self {
            planned,
            controller: Controller::new(&planned.machine),
            outputs: Outputs::default(),
            feedback,
            positions: [feedback.position; 2],
            sent: 0,
            supply: usize::MAX,
            places: vec![place; 3 * planned.per_setpoint() + 1],
            uses: Uses::default(),
            ticket: 0,
            lit: Vec::new(),
            times: [0.0; 3],
            lasers: [messages::LaserCycle::OFF; 2],
        };
        bench.run(3);
        bench.ask(OperatorVerb::Enable, 0.0);
        bench.until(ControllerState::Idle, 100);
        bench.ask(OperatorVerb::Start, 1.0);
        bench.until(ControllerState::Running, 100);
        bench
    }

    fn state(&self) -> ControllerState {
        self.outputs.command.state()
    }

    fn is_over(&self) -> bool {
        self.state() == ControllerState::Idle
    }

    fn rate(&self) -> f64 {
        self.outputs.command.rate
    }

    /// Stream time [setpoints].
    fn time(&self) -> f64 {
        self.outputs.command.stream_time / SETPOINT_TIME
    }

    fn cycle(&mut self, request: Option<OperatorRequest>) {
        let feedback = &mut self.feedback;
        feedback.cycle = Cycle(feedback.cycle.0 + 1);
        let powered = self.outputs.command.mode() != CommandMode::Disabled;
        feedback.status = if powered { status::POWERED } else { 0 };
        let follows = self.outputs.command.stream != 0;
        if follows {
            feedback.position = self.positions[0];
        }
        let room = self.controller.room().min(16);
        let end = (self.sent + room).min(self.planned.setpoints.len());
        let end = end.min(self.supply).max(self.sent);
        let inputs = Inputs {
            feedback,
            received: Nanoseconds(1),
            setpoints: &self.planned.setpoints[self.sent..end],
            request,
            peers: Peers::default(),
            slow: 0,
        };
        self.sent = end;
        self.controller.step(Nanoseconds(1), &inputs, &mut self.outputs);
        let command = self.outputs.command;
        assert!(!command.fault.is_some(), "{}: {:?}", self.planned.name, command.fault);
        self.positions = [self.positions[1], command.position];
        if !follows {
            self.positions[0] = self.feedback.position;
        }
        if command.stream == 0 {
            return;
        }
        let joints = self.planned.joints(command.stream_time / SETPOINT_TIME);
        let tool = self.planned.machine.mechanism.clone().visit(Forward(joints));
        let place = Place { tool, joints };
        self.places.remove(0);
        self.places.push(place);
        let apart = self.planned.per_setpoint();
        let uses = Uses::of(&self.planned.machine, &[0, 1, 2, 3].map(|i| self.places[i * apart]));
        self.uses.raise(&uses);
        self.times = [self.times[1], self.times[2], command.stream_time];
        self.note_light();
        self.lasers = [self.lasers[1], command.laser];
    }

    /// Light of the command of two cycles ago: over the stream time of the last cycle.
    fn note_light(&mut self) {
        let laser = self.lasers[0];
        let period = self.planned.machine.realtime.period.time().0 as f64;
        let [_, from, to] = self.times;
        let (mut since, mut gate) = (0.0, laser.gate);
        let ends = laser.edges().iter().map(|edge| (f64::from(edge.offset) / period, edge.gate));
        for (offset, next) in ends.chain([(1.0, 0)]) {
            if gate != 0 && offset > since {
                let stretch = (from + (to - from) * since, from + (to - from) * offset);
                match self.lit.last_mut() {
                    Some(last) if (last.1 - stretch.0).abs() < 1e-8 => last.1 = stretch.1,
                    _ => self.lit.push(stretch),
                }
            }
            (since, gate) = (offset, next);
        }
    }

    fn run(&mut self, cycles: usize) {
        for _ in 0..cycles {
            self.cycle(None);
        }
    }

    fn ask(&mut self, verb: OperatorVerb, value: f64) {
        self.ticket += 1;
        self.cycle(Some(OperatorRequest {
            verb: verb as u32,
            ticket: self.ticket,
            value,
            ..OperatorRequest::default()
        }));
        let reply = self.outputs.reply.unwrap();
        assert_eq!(reply.accepted, 1, "{}: {verb:?} in {:?}", self.planned.name, self.state());
    }

    fn until(&mut self, state: ControllerState, milliseconds: usize) {
        for _ in 0..milliseconds * self.planned.per_setpoint() {
            if self.state() == state {
                return;
            }
            self.cycle(None);
        }
        panic!("{}: {:?} instead of {state:?}", self.planned.name, self.state());
    }

    /// Until it stands; how many cycles that took.
    fn until_rest(&mut self) -> usize {
        let mut cycles = 0;
        while self.rate() != 0.0 {
            self.cycle(None);
            cycles += 1;
            assert!(cycles < 40_000, "{}: never comes to rest", self.planned.name);
        }
        cycles
    }

    /// Until it plays as planned, or is over.
    fn until_rate(&mut self, rate: f64) -> usize {
        let mut cycles = 0;
        while self.rate() != rate && !self.is_over() {
            self.cycle(None);
            cycles += 1;
            assert!(cycles < 80_000, "{}: never at {rate}", self.planned.name);
        }
        cycles
    }
}

fn jobs() -> Vec<Planned> {
    vec![
        Planned::limited(),
        Planned::builtin(),
        Planned::file("corexy", "square_arcs.ngc"),
        Planned::file("corexy", "preamble.ngc"),
        Planned::file("twin_actuator", "twin_actuator.ngc"),
        Planned::file("five_bar", "five_bar.toml"),
        Planned::file("prrrp", "prrrp.toml"),
        Planned::file("serial", "serial.toml"),
        Planned::file("tri_planar", "tri_planar.toml"),
    ]
}

/// What differences over the cycles may come to: the plan's own limits, and what is unknown of it between
/// two setpoints.
const MOST: f64 = 1.02;

impl Bench<'_> {
    /// Plays to the end, and has the marks and the limits as they must be.
    fn finish(mut self, marks: &[(f64, f64)], case: &str) {
        while !self.is_over() {
            self.cycle(None);
        }
        let name = self.planned.name;
        assert!(self.uses.largest() < MOST, "{name}, {case}: {:?}", self.uses);
        assert_eq!(self.lit.len(), marks.len(), "{name}, {case}");
        for (found, planned) in self.lit.iter().zip(marks) {
            let apart = (found.0 - planned.0).abs().max((found.1 - planned.1).abs());
            assert!(apart < 3e-9, "{name}, {case}: {found:?} instead of {planned:?}");
        }
    }
}

/// Where a job is lit as planned [s], from stroke to stroke.
fn marks(planned: &Planned) -> Vec<(f64, f64)> {
    let mut bench = Bench::new(planned);
    while !bench.is_over() {
        bench.cycle(None);
    }
    // Where cycles end between setpoints, the cubics through these are what is played.
    let most = if planned.per_setpoint() == 1 { 1.0 + 1e-6 } else { MOST };
    assert!(bench.uses.largest() < most, "{}: {:?}", planned.name, bench.uses);
    bench.lit
}

#[test]
fn a_hold_at_every_seventh_cycle_stays_within_the_limits_and_loses_no_mark() {
    for planned in jobs() {
        hold_every(7.0, &planned);
    }
}

#[test]
fn at_4_and_8_khz_a_hold_stays_within_the_limits_and_loses_no_mark() {
    for (period, apart) in [(250_000, 41.0), (125_000, 173.0)] {
        for planned in [Planned::limited(), Planned::builtin()] {
            hold_every(apart, &planned.at(Nanoseconds(period)));
        }
    }
}

/// Holds and resumes whenever so many setpoints have been played.
fn hold_every(setpoints: f64, planned: &Planned) {
    let marks = marks(planned);
    let mut bench = Bench::new(planned);
    let (mut longest, mut next) = (0, setpoints);
    while !bench.is_over() {
        bench.cycle(None);
        let runs = bench.state() == ControllerState::Running && bench.rate() == 1.0;
        if !runs || bench.time() < next {
            continue;
        }
        next = bench.time() + setpoints;
        bench.ask(OperatorVerb::Hold, 0.0);
        longest = longest.max(bench.until_rest());
        bench.run(3);
        if !bench.is_over() {
            bench.ask(OperatorVerb::Resume, 0.0);
            bench.until_rate(1.0);
        }
    }
    let most = 250 * planned.per_setpoint();
    assert!(longest < most, "{}: {longest} cycles to rest", planned.name);
    bench.finish(&marks, "holds");
}

#[test]
fn holds_in_holds_resumes_and_overrides_at_any_time_stay_within_the_limits() {
    let fast = Planned::builtin().at(Nanoseconds(250_000));
    for (planned, seeds) in [(Planned::limited(), 6), (Planned::builtin(), 6), (fast, 2)] {
        let marks = marks(&planned);
        let scale = planned.per_setpoint();
        for seed in 1..=seeds {
            let mut random = messages::random::SplitMix64::new(seed);
            let mut bench = Bench::new(&planned);
            for _ in 0..24 {
                let holds = bench.state() == ControllerState::Holding;
                let (verb, value) = match random.below(5) {
                    0 | 1 if holds => (OperatorVerb::Resume, 0.0),
                    0..=2 => (OperatorVerb::Hold, 0.0),
                    3 => (OperatorVerb::Override, 1.0),
                    _ => (OperatorVerb::Override, [0.1, 0.5, 0.8, 2.0][random.below(4) as usize]),
                };
                if !bench.is_over() {
                    bench.ask(verb, value);
                }
                bench.run(random.below(160) as usize * scale);
            }
            bench.ask(OperatorVerb::Override, 1.0);
            if bench.state() == ControllerState::Holding {
                bench.ask(OperatorVerb::Resume, 0.0);
            }
            bench.finish(&marks, &format!("seed {seed}"));
        }
    }
}

#[test]
fn a_stream_that_runs_dry_stops_and_goes_on_within_the_limits() {
    let planned = Planned::builtin();
    let marks = marks(&planned);
    for supply in (700..2800).step_by(177) {
        let mut bench = Bench::new(&planned);
        bench.supply = supply;
        bench.until(ControllerState::Holding, 5000);
        bench.until_rest();
        assert_eq!(bench.sent, supply);
        assert!(bench.time() <= (supply - 1) as f64, "beyond {supply}");
        bench.supply = usize::MAX;
        bench.finish(&marks, &format!("dry after {supply}"));
    }
}

#[test]
fn a_stop_stays_within_the_limits() {
    let planned = Planned::builtin();
    for at in (20..3000).step_by(97) {
        let mut bench = Bench::new(&planned);
        while bench.time() < f64::from(at) {
            bench.cycle(None);
        }
        bench.ask(OperatorVerb::Stop, 0.0);
        bench.until(ControllerState::Idle, 300);
        assert!(bench.uses.largest() < MOST, "at {at}: {:?}", bench.uses);
    }
}
