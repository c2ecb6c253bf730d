//! A recording played again: the stages get what they got, and must give what they gave, bit for bit.
//!
//! The controller is fed with the recorded feedback, setpoints and requests, the simulated drives with
//! the recorded commands. Neither hears the other, so a difference is where it arose.

use controller::{Controller, Inputs, Outputs, Peers};
use drives::bridge::BridgeOptions;
use drives::{Bridge, Deadlines, PlantOptions, SimulatedPlant};
use machine::Machine;
use messages::{Command, Feedback, OperatorRequest, Setpoint};
use monitor::recording::CycleRecord;
use monitor::recording::file::RecordingError;
use monitor::recording::file::reader::Entry;
use monitor::recording::message::difference::{Difference, difference};
use std::collections::VecDeque;

/// What a replay found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Replayed {
    /// Cycles that were played.
    pub cycles: u64,
    /// The first output that differs from the recorded one.
    pub difference: Option<StageDifference>,
}

/// An output of a stage that is not what was recorded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StageDifference {
    /// `controller` or `drives`.
    pub stage: &'static str,
    /// The cycle.
    pub cycle: u64,
    /// What differs.
    pub difference: Difference,
}

/// Why a recording cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// It cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The machine cannot be simulated.
    #[error(transparent)]
    Plant(#[from] drives::plant::PlantError),
    /// The stages cannot be brought to where it begins.
    #[error(
        "it begins with cycle {first}, when the stages have run already: only a whole recording can be played"
    )]
    NotFromTheStart {
        /// Its first cycle.
        first: u64,
    },
    /// Cycles are missing in it.
    #[error("cycle {cycle} follows cycle {before}: what lies between was not recorded")]
    Gap {
        /// The last one before the gap.
        before: u64,
        /// The first one after it.
        cycle: u64,
    },
}

/// The stages, and what waits to be given to them.
struct Stages {
    controller: Controller,
    bridge: Bridge,
    outputs: Outputs,
    setpoints: VecDeque<(i64, Setpoint)>,
    requests: VecDeque<(i64, OperatorRequest)>,
    given: Vec<Setpoint>,
}

impl Stages {
    fn new(machine: &Machine, plant: &Machine, options: PlantOptions) -> Result<Self, ReplayError> {
        let plant = Machine { realtime: machine.realtime, ..plant.clone() };
        let port = SimulatedPlant::new(&plant, options)?;
        let options =
            BridgeOptions { epoch: 1, deadlines: Deadlines::Strict, timing: machine.realtime };
        Ok(Self {
            controller: Controller::new(machine),
            bridge: Bridge::new(port, options).with_brakes(machine.operating.brakes()),
            outputs: Outputs::default(),
            setpoints: VecDeque::new(),
            requests: VecDeque::new(),
            given: Vec::new(),
        })
    }

    /// Plays one cycle; the first output that differs.
    fn play(&mut self, record: &CycleRecord) -> Option<StageDifference> {
        let CycleRecord { feedback, command } = record;
        let now = feedback.deadline;
        self.bridge.begin(now, now);
        let cycle = feedback.cycle.0;
        let differs = |stage, difference| StageDifference { stage, cycle, difference };
        let measured = difference::<Feedback>(feedback, self.bridge.feedback(), &record.origin());
        if let Some(difference) = measured {
            return Some(differs("drives", difference));
        }
        self.given.clear();
        while let Some((_, setpoint)) = self.setpoints.pop_front_if(|(time, _)| *time <= now.0) {
            self.given.push(setpoint);
        }
        let request = self.requests.pop_front_if(|(time, _)| *time <= now.0);
        let inputs = Inputs {
            feedback,
            received: command.received,
            setpoints: &self.given,
            request: request.map(|(_, request)| request),
            peers: Peers::default(),
        };
        self.controller.step(now, &inputs, &mut self.outputs);
        self.bridge.latch(command, now);
        self.bridge.finish(now);
        let answered = difference::<Command>(command, &self.outputs.command, &record.origin());
        answered.map(|difference| differs("controller", difference))
    }
}

/// Plays a recording of a simulation of `plant` under a controller for `machine` again.
///
/// # Errors
/// [`ReplayError`].
pub fn replay(
    machine: &Machine,
    plant: &Machine,
    options: PlantOptions,
    entries: impl Iterator<Item = Result<Entry, RecordingError>>,
) -> Result<Replayed, ReplayError> {
    let mut stages = Stages::new(machine, plant, options)?;
    let mut replayed = Replayed { cycles: 0, difference: None };
    let mut before = 0;
    for entry in entries {
        match entry? {
            Entry::Event(_) => {}
            Entry::Setpoint(time, setpoint) => stages.setpoints.push_back((time, *setpoint)),
            Entry::Request(time, request) => stages.requests.push_back((time, request)),
            Entry::Cycle(record) => {
                let cycle = record.feedback.cycle.0;
                match replayed.cycles {
                    0 if record.feedback.deadline != machine.realtime.period.time() => {
                        return Err(ReplayError::NotFromTheStart { first: cycle });
                    }
                    1.. if cycle != before + record.feedback.elapsed() => {
                        return Err(ReplayError::Gap { before, cycle });
                    }
                    _ => {}
                }
                before = cycle;
                replayed.cycles += 1;
                replayed.difference = stages.play(&record);
                if replayed.difference.is_some() {
                    break;
                }
            }
        }
    }
    Ok(replayed)
}
