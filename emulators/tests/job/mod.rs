//! A whole job in virtual time on a port to emulated hardware: planner, controller and bridge are the ones that run
//! in real time.

#![allow(dead_code, reason = "each test binary uses its own part")]
#![allow(unreachable_pub)]

use controller::digest::Digest;
use controller::{Controller, Inputs, Outputs, Peers};
use drives::{Bridge, BridgeOptions, Deadlines, PlantOptions, Port, SimulatedPlant};
use emulators::cable::{Bench, Cable, Event, Hardware};
use machine::Machine;
use messages::artwork::{Artwork, Stroke, distance};
use messages::{
    Command, ControllerReport, DrivesReport, LaserCycle, MAX_ACTUATORS, Nanoseconds,
    OperatorRequest, OperatorVerb, RealtimeFacts, Setpoint,
};
use monitor::recording::CycleRecord;
use planner::Plan;
use planner::job::Job;

/// The cycle in which the job starts: the drives follow by then.
const START: u64 = 300;
/// Cycles after the job's end in which its last light is still told.
const LAG: u64 = 5;
/// Setpoints handed over in one cycle at most, as the controller service does.
const DRAIN: usize = 16;
/// By how much a deadline is moved at most after a bus's clock [ns].
const MOVED: i64 = 1000;
/// Cycles that no job of these tests takes.
const MOST: u64 = 100_000;

/// What a job came to.
pub struct Played<H> {
    /// Every cycle from the job's start on.
    pub records: Vec<CycleRecord>,
    /// What the controller said of the job at its end.
    pub report: ControllerReport,
    /// What drives said then.
    pub drives: DrivesReport,
    /// The cable, whose time is a few cycles after the end.
    pub cable: Cable<H>,
    /// The finest step of a gate edge [ns].
    pub resolution: i64,
}

/// The letters, planned for `machine`.
pub fn letters(machine: &Machine) -> Plan {
    let job = Job::builtin(&[], machine).expect("the letters");
    planner::plan(machine, &job).expect("a plan")
}

/// Plays `plan` on `bench`; at `event.0` after the first deadline [ns], `event.1` happens to its hardware.
pub fn play<P: Port + 'static, H: Hardware + 'static>(
    bench: Bench<P, H>,
    plan: &Plan,
    event: Option<(i64, Event<H>)>,
) -> Played<H> {
    let (machine, cable) = (bench.machine.clone(), bench.cable.clone());
    let resolution = bench.profile().gate_resolution.0;
    let deadline = bench.deadline;
    if let Some((after, event)) = event {
        cable.plan(deadline + Nanoseconds(after), event);
    }
    let Run { records, report, drives } = run(Box::new(bench), &machine, deadline, plan);
    Played { records, report, drives, cable, resolution }
}

/// What a run of a job came to.
pub struct Run {
    /// Every cycle from the job's start on.
    pub records: Vec<CycleRecord>,
    /// What the controller said of the job at its end.
    pub report: ControllerReport,
    /// What drives said then.
    pub drives: DrivesReport,
}

/// Plays `plan` on the simulated plant of `machine`, with the latencies that its file declares.
pub fn simulate(machine: &Machine, plan: &Plan) -> Run {
    let plant = SimulatedPlant::new(machine, PlantOptions::default()).expect("a plant");
    run(plant, machine, machine.realtime.period.time(), plan)
}

/// Plays `plan` on `port`, from `deadline` on.
fn run(port: Box<dyn Port>, machine: &Machine, mut deadline: Nanoseconds, plan: &Plan) -> Run {
    let timing = machine.realtime;
    let options = BridgeOptions { epoch: 1, deadlines: Deadlines::Strict, timing };
    let mut bridge = Bridge::new(port, options);
    let mut controller = Controller::new(machine);
    let (mut outputs, mut setpoints) = (Outputs::default(), plan.setpoints(1));
    let (mut records, mut ended) = (Vec::new(), None::<ControllerReport>);
    for cycle in 1_u64.. {
        assert!(cycle < MOST, "the job does not end: {:?}", outputs.command.state());
        bridge.begin(deadline, deadline);
        let feedback = *bridge.feedback();
        let verb = match cycle {
            2 => Some((OperatorVerb::Enable, 0.0)),
            START => Some((OperatorVerb::Start, 1.0)),
            _ => None,
        };
        let request = verb.map(|(verb, value)| {
            let verb = verb as u32;
            OperatorRequest { verb, ticket: 1, value, ..OperatorRequest::default() }
        });
        let room = if cycle > START { controller.room().min(DRAIN) } else { 0 };
        let waiting: Vec<Setpoint> = setpoints.by_ref().take(room).collect();
        let peers = Peers::default();
        let inputs = Inputs {
            feedback: &feedback,
            received: deadline,
            setpoints: &waiting,
            request,
            peers,
            slow: 0,
        };
        controller.step(deadline, &inputs, &mut outputs);
        bridge.latch(&outputs.command, deadline);
        bridge.finish(deadline);
        if cycle >= START {
            records.push(CycleRecord { feedback, command: outputs.command });
        }
        ended = outputs.report.filter(|report| report.is_final == 1).or(ended);
        if ended.is_some_and(|report| cycle > report.last_cycle.0 + LAG) {
            break;
        }
        deadline = deadline + timing.period.time() + bridge.follow_clock();
    }
    let report = ended.expect("a final report");
    let drives = bridge.report(RealtimeFacts::default());
    Run { records, report, drives }
}

/// A number for what the commands of a job mean, from where the axes have come to its start on: how they come there
/// depends on where they stood. Without `targets` stream time, rate, light and outputs alone: targets of loops that are
/// closed here answer what was measured.
pub fn digest(records: &[CycleRecord], targets: bool) -> u64 {
    let mut digest = Digest::new();
    let is_played = |command: &Command| command.stream != 0 && command.stream_time > 0.0;
    let played = records.iter().map(|record| record.command).filter(is_played);
    let mut cycles = 0;
    for mut command in played {
        if !targets {
            command.position = [command.stream_time; MAX_ACTUATORS];
            command.velocity = [command.rate; MAX_ACTUATORS];
            command.effort = [0.0; MAX_ACTUATORS];
        }
        digest.add(&command, MAX_ACTUATORS);
        cycles += 1;
    }
    assert!(cycles > 1000, "{cycles}");
    digest.value()
}

/// The light that the commands asked for, by the clock of the cable, when the gate is `later` than the deadline
/// [ns]; what goes on through the end of a cycle is one.
pub fn asked(records: &[CycleRecord], machine: &Machine, later: i64) -> Vec<[i64; 2]> {
    let period = machine.realtime.period.time().0;
    let mut asked: Vec<[i64; 2]> = Vec::new();
    for record in records {
        // It acts in the cycle after the one that it answers.
        let start = record.feedback.deadline.0 + period + later;
        for span in spans(&record.command.laser, period) {
            let span = span.map(|at| start + at);
            match asked.last_mut() {
                Some(last) if (last[1] - span[0]).abs() <= MOVED => last[1] = span[1],
                _ => asked.push(span),
            }
        }
    }
    asked
}

/// The times with light that `laser` asks for in a cycle of `period`, from its beginning [ns].
fn spans(laser: &LaserCycle, period: i64) -> Vec<[i64; 2]> {
    let (mut spans, mut since, mut gate) = (Vec::new(), 0, laser.gate);
    let edges = laser.edges().iter().map(|edge| (i64::from(edge.offset), edge.gate));
    for (offset, next) in edges.chain([(period, 0)]) {
        if gate != 0 && offset > since {
            spans.push([since, offset]);
        }
        (since, gate) = (offset, next);
    }
    spans
}

impl<H> Played<H> {
    /// Where the tool truly was at `at` by the clock of the cable [ns], between two deadlines in proportion [m].
    fn tool_at(&self, at: i64) -> [f64; 3] {
        let after = self.records.partition_point(|record| record.feedback.deadline.0 <= at);
        let around =
            after.checked_sub(1).map(|before| &self.records[before]).zip(self.records.get(after));
        let (from, to) = around.expect("a time in the record");
        let [start, end] = [from, to].map(|record| record.feedback.deadline.0);
        let part = (at - start) as f64 / (end - start) as f64;
        core::array::from_fn(|axis| {
            let [from, to] = [from, to].map(|record| record.feedback.tool[axis]);
            from + part * (to - from)
        })
    }

    /// The largest distance of the true tool from the stroke while the true light was on, one span of `lit` for each,
    /// and of either end of the light from the end of its stroke [m].
    pub fn error(&self, lit: &[[i64; 2]], artwork: &Artwork) -> f64 {
        error(lit, artwork, |at| self.tool_at(at))
    }
}

/// The largest distance of the `tool`, as it is at a time [ns], from the stroke while the light was on, one span of `lit`
/// for each, and of either end of the light from the end of its stroke [m].
pub fn error(lit: &[[i64; 2]], artwork: &Artwork, tool: impl Fn(i64) -> [f64; 3]) -> f64 {
    assert_eq!(lit.len(), artwork.strokes.len());
    let mut worst = 0.0_f64;
    for ([from, to], stroke) in lit.iter().zip(&artwork.strokes) {
        for part in 0..=1000 {
            worst = worst.max(to_line(stroke, &tool(from + (to - from) * part / 1000)));
        }
        for (at, end) in [(from, stroke.points.first()), (to, stroke.points.last())] {
            worst = worst.max(distance(&tool(*at), end.expect("a point")));
        }
    }
    worst
}

/// The distance of `place` from the line of `stroke` [m].
fn to_line(stroke: &Stroke, place: &[f64; 3]) -> f64 {
    let parts = stroke.points.windows(2).map(|ends| {
        let [from, to] = [&ends[0], &ends[1]];
        let (mut along, mut square) = (0.0, 0.0);
        for axis in 0..3 {
            along += (place[axis] - from[axis]) * (to[axis] - from[axis]);
            square += (to[axis] - from[axis]) * (to[axis] - from[axis]);
        }
        let part = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
        let foot = core::array::from_fn(|axis| from[axis] + part * (to[axis] - from[axis]));
        distance(place, &foot)
    });
    parts.fold(f64::MAX, f64::min)
}
