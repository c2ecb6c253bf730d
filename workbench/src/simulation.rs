//! The stages in one process, in virtual time.
//!
//! Sampler, controller and bridge are the ones that run as processes; only what moves the samples
//! between them is different. Nothing here reads a clock but to say how fast it went.

use controller::{Controller, Inputs, Outputs, Peers};
use drives::bridge::BridgeOptions;
use drives::{Bridge, Deadlines, PlantOptions, SimulatedPlant};
use machine::Machine;
use messages::{
    ControllerReport, ControllerState, DrivesReport, Fault, Nanoseconds, OperatorReply,
    OperatorRequest, OperatorVerb, RealtimeFacts, Setpoint,
};
use monitor::recording::CycleRecord;
use monitor::summary::FaultSummary;
use planner::Plan;
use std::time::{Duration, Instant};

/// The stream number of the one job.
const STREAM: u64 = 1;

/// Setpoints handed over in one cycle at most, as the controller service does.
const DRAIN: usize = 16;

/// Cycles stepped between two visits of whoever examines the records: few enough for the records to
/// stay in the cache.
const CHUNK: usize = 256;

/// Cycles after the stream's end in which its last light is still told.
const LIGHT_LAG: usize = monitor::conclusion::LIGHT_LAG as usize + 1;

/// How long enabling may take: the controller gives up before, with a fault that says why.
const ENABLE_PATIENCE: Nanoseconds = Nanoseconds(3_000_000_000);

/// How long homing may take: ten minutes.
const HOMING_PATIENCE: Nanoseconds = Nanoseconds(600_000_000_000);

/// What a simulation gives besides its records.
#[derive(Debug, Clone)]
pub struct Simulated {
    /// The controller's final report.
    pub controller: ControllerReport,
    /// The drives' report at the end.
    pub drives: DrivesReport,
    /// Wall time of the stepping.
    pub stepping: Duration,
}

/// Why a simulation could not be made.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// The machine cannot be simulated.
    #[error(transparent)]
    Plant(#[from] drives::plant::PlantError),
    /// Not all of the job came.
    #[error(transparent)]
    BrokenOff(#[from] BrokenOff),
    /// The controller did not get ready.
    #[error("the controller did not become ready: it is {state}")]
    NotReady {
        /// Its state.
        state: &'static str,
    },
    /// The controller does not start the job.
    #[error("the controller refused to start the job")]
    NotStarted {
        /// Its answer.
        reply: OperatorReply,
    },
    /// The axes could not be enabled.
    #[error("the controller did not become ready: {words}")]
    Faulted {
        /// The fault that was found.
        fault: Fault,
        /// The same, with the axis by its name.
        words: String,
    },
}

/// Who is told of each stretch.
type Examine<'a> = dyn FnMut(&Stretch<'_>) + 'a;

struct Pipeline {
    controller: Controller,
    bridge: Bridge,
    period: Nanoseconds,
    now: Nanoseconds,
    outputs: Outputs,
    /// Records of the cycles before the job.
    powering: Vec<CycleRecord>,
}

impl Pipeline {
    fn new(
        machine: &Machine,
        plant: &Machine,
        plant_options: PlantOptions,
    ) -> Result<Self, SimulationError> {
        // Whatever the plant's file says: drives is the one clock.
        let plant = Machine { realtime: machine.realtime, ..plant.clone() };
        let port = SimulatedPlant::new(&plant, plant_options)?;
        let options =
            BridgeOptions { epoch: 1, deadlines: Deadlines::Strict, timing: machine.realtime };
        Ok(Self {
            controller: Controller::new(machine),
            bridge: Bridge::new(port, options).with_brakes(machine.operating.brakes()),
            period: machine.realtime.period.time(),
            now: Nanoseconds(0),
            outputs: Outputs::default(),
            powering: Vec::new(),
        })
    }

    /// One cycle, in the order of the real one; no time passes in it.
    fn cycle(&mut self, setpoints: &[Setpoint], request: Option<OperatorRequest>) {
        self.now = self.now + self.period;
        self.bridge.begin(self.now, self.now);
        let feedback = self.bridge.feedback();
        let peers = Peers::default();
        let inputs = Inputs { feedback, received: self.now, setpoints, request, peers, slow: 0 };
        self.controller.step(self.now, &inputs, &mut self.outputs);
        self.bridge.latch(&self.outputs.command, self.now);
        self.bridge.finish(self.now);
    }

    fn record(&self) -> CycleRecord {
        CycleRecord { feedback: *self.bridge.feedback(), command: self.outputs.command }
    }

    /// A cycle before the job.
    fn power_up(&mut self, request: Option<OperatorRequest>, examine: &mut Examine<'_>) {
        self.cycle(&[], request);
        self.powering.push(self.record());
        if self.powering.len() >= CHUNK {
            self.tell_powering(examine);
        }
    }

    fn tell_powering(&mut self, examine: &mut Examine<'_>) {
        examine(&Stretch { is_power_up: true, records: &self.powering, setpoints: &[] });
        self.powering.clear();
    }

    fn enable(
        &mut self,
        machine: &Machine,
        examine: &mut Examine<'_>,
    ) -> Result<(), SimulationError> {
        // Drives powers nothing before it has been greeted by an unpowered command.
        self.power_up(None, examine);
        self.power_up(Some(request(OperatorVerb::Enable, 0.0)), examine);
        let period = machine.realtime.period;
        let mut is_homed = machine.operating.homing.iter().all(Option::is_none);
        let mut left = period.cycles_for(ENABLE_PATIENCE);
        while left > 0 {
            left -= 1;
            match self.outputs.command.state() {
                ControllerState::Idle if is_homed => return Ok(()),
                ControllerState::Idle => {
                    (is_homed, left) = (true, period.cycles_for(HOMING_PATIENCE));
                    self.power_up(Some(request(OperatorVerb::Home, 0.0)), examine);
                }
                ControllerState::Faulted => break,
                _ => self.power_up(None, examine),
            }
        }
        let command = &self.outputs.command;
        let fault = command.fault;
        Err(match FaultSummary::of(&fault, machine) {
            Some(told) => SimulationError::Faulted { fault, words: told.to_string() },
            None => SimulationError::NotReady { state: command.state().name() },
        })
    }
}

fn request(verb: OperatorVerb, value: f64) -> OperatorRequest {
    OperatorRequest { verb: verb as u32, ticket: 1, value, ..OperatorRequest::default() }
}

/// What a simulation did since the stretch before: records in order, and the setpoints that the controller took in their
/// cycles.
#[derive(Debug, Clone, Copy)]
pub struct Stretch<'a> {
    /// Whether the motors are being powered and homed: nothing of the job is in it.
    pub is_power_up: bool,
    /// The records.
    pub records: &'a [CycleRecord],
    /// Setpoints, by the deadline of their cycle.
    pub setpoints: &'a [(Nanoseconds, Setpoint)],
}

impl<'a> Stretch<'a> {
    /// Each record with the setpoints that the controller took in its cycle.
    pub fn cycles(&self) -> impl Iterator<Item = (&'a CycleRecord, Vec<Setpoint>)> {
        let mut setpoints = self.setpoints.iter().peekable();
        self.records.iter().map(move |record| {
            let of_it = |(time, _): &&(Nanoseconds, Setpoint)| *time == record.feedback.deadline;
            let taken = std::iter::from_fn(|| setpoints.next_if(of_it));
            (record, taken.map(|(_, setpoint)| *setpoint).collect())
        })
    }
}

/// Where the setpoints of a simulation come from, in order.
pub trait SetpointSource {
    /// Waits until the next `count` setpoints are there, or all that there are. No time of the stepping is spent here.
    ///
    /// # Errors
    /// Where no more will come, though the stream has not ended.
    fn wait(&mut self, count: usize) -> Result<(), BrokenOff>;

    /// Puts the next setpoints into `setpoints`, `count` at most.
    fn take(&mut self, count: usize, setpoints: &mut Vec<Setpoint>);
}

/// The stream of a simulation was broken off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the job was broken off while it was planned")]
pub struct BrokenOff;

/// The setpoints of a plan, made as they are asked for.
struct OfPlan(Box<dyn Iterator<Item = Setpoint> + Send>);

impl SetpointSource for OfPlan {
    fn wait(&mut self, _count: usize) -> Result<(), BrokenOff> {
        Ok(())
    }

    fn take(&mut self, count: usize, setpoints: &mut Vec<Setpoint>) {
        setpoints.extend(self.0.by_ref().take(count));
    }
}

/// Plays `plan` on a controller for `machine` and a simulated `plant`; `examine` gets every record
/// of the job in order.
///
/// # Errors
/// A machine that cannot be simulated, or a controller that does not get ready.
pub fn simulate(
    machine: &Machine,
    plant: &Machine,
    plan: &Plan,
    plant_options: PlantOptions,
    mut examine: impl FnMut(&[CycleRecord]),
) -> Result<Simulated, SimulationError> {
    let mut source = OfPlan(plan.setpoints(STREAM));
    simulate_all(machine, plant, &mut source, plant_options, |_, stretch| {
        if !stretch.is_power_up {
            examine(stretch.records);
        }
    })
}

/// Plays the setpoints of `source`, whose stream is number 1, from the first cycle on; `examine` gets all that went in
/// and came out.
///
/// # Errors
/// A machine that cannot be simulated, a controller that does not get ready, or a source that is broken off.
pub fn simulate_all<S: SetpointSource>(
    machine: &Machine,
    plant: &Machine,
    source: &mut S,
    plant_options: PlantOptions,
    mut examine: impl FnMut(&mut S, &Stretch<'_>),
) -> Result<Simulated, SimulationError> {
    let mut pipeline = Pipeline::new(machine, plant, plant_options)?;
    {
        let examine = &mut |stretch: &Stretch<'_>| examine(source, stretch);
        let enabled = pipeline.enable(machine, examine);
        pipeline.tell_powering(examine);
        enabled?;
    }
    let mut waiting: Vec<Setpoint> = Vec::with_capacity(DRAIN);
    // Written once, so that its pages are there before the clock runs.
    let mut records = vec![pipeline.record(); CHUNK];
    let mut given: Vec<(Nanoseconds, Setpoint)> = Vec::with_capacity(CHUNK * DRAIN);
    let mut stepping = Duration::ZERO;
    let mut start = Some(request(OperatorVerb::Start, STREAM as f64));
    let mut report = ControllerReport::default();
    let mut remaining = usize::MAX;
    while remaining > 0 {
        records.clear();
        given.clear();
        source.wait(CHUNK * DRAIN)?;
        let began = Instant::now();
        while records.len() < CHUNK && remaining > 0 {
            waiting.clear();
            if start.is_none() {
                let room = pipeline.controller.room().min(DRAIN);
                source.take(room, &mut waiting);
            }
            let paused = pipeline.outputs.command.state() == ControllerState::Holding;
            // Nobody is there to answer a program's pause.
            let resume = paused.then(|| request(OperatorVerb::Resume, 0.0));
            let is_start = start.is_some();
            pipeline.cycle(&waiting, start.take().or(resume));
            if is_start && let Some(reply) = pipeline.outputs.reply.filter(|it| it.accepted == 0) {
                return Err(SimulationError::NotStarted { reply });
            }
            records.push(pipeline.record());
            given.extend(waiting.iter().map(|setpoint| (pipeline.now, *setpoint)));
            remaining = remaining.saturating_sub(1);
            if let Some(new) = pipeline.outputs.report {
                report = new;
                if report.is_final == 1 {
                    remaining = remaining.min(LIGHT_LAG);
                }
            }
        }
        stepping += began.elapsed();
        let (records, setpoints) = (&records[..], &given[..]);
        examine(source, &Stretch { is_power_up: false, records, setpoints });
    }
    let drives = pipeline.bridge.report(RealtimeFacts::default());
    Ok(Simulated { controller: report, drives, stepping })
}
