//! A recording played again: the stages get what they got, and must give what they gave, bit for bit.
//!
//! The controller is fed with the recorded feedback, setpoints and requests. Of a simulation the simulated drives are fed
//! with the recorded commands too. Neither hears the other, so a difference is where it arose. In real time, drives depend on
//! more than commands, and are not played.

use controller::{Controller, Inputs, Outputs, Peers};
use drives::bridge::BridgeOptions;
use drives::{Bridge, Deadlines, PlantOptions, SimulatedPlant};
use machine::Machine;
use messages::{Command, Feedback, Given, OperatorRequest, Setpoint};
use monitor::recording::CycleRecord;
use monitor::recording::continuity::{Stamp, Succession};
use monitor::recording::file::RecordingError;
use monitor::recording::file::reader::Entry;
use monitor::recording::message::difference::{Difference, difference};

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
    /// The controller cannot be brought to where it begins.
    #[error(
        "it begins with cycle {cycle}, when the controller had given {answers} answers: only a recording that begins \
         with its controller can be played, which is that of `graver simulate`, of `graver run`, and of the first job \
         of a `graver domain`, at --record full"
    )]
    NotFromTheStart {
        /// Its first cycle with an answer.
        cycle: u64,
        /// Answers before it.
        answers: u64,
    },
    /// Its commands do not tell what they were made of.
    #[error(
        "it was recorded by an earlier version, which did not record what the controller was given"
    )]
    Untold,
    /// Cycles are missing in it.
    #[error("cycle {cycle} follows cycle {before}: what lies between was not recorded")]
    Gap {
        /// The last one before the gap.
        before: u64,
        /// The first one after it.
        cycle: u64,
    },
    /// Setpoints are missing in it.
    #[error(
        "in cycle {cycle} the controller took {taken} setpoints, of which {recorded} were recorded"
    )]
    Setpoints {
        /// The cycle.
        cycle: u64,
        /// How many there were.
        taken: u32,
        /// How many of them are in the recording.
        recorded: usize,
    },
}

/// The controller, and the answer before.
struct Answering {
    controller: Controller,
    outputs: Outputs,
    /// How many answers it has given, and the cycle of the newest.
    newest: (u64, u64),
}

impl Answering {
    /// Answers a cycle that was answered; what differs.
    fn play(
        &mut self,
        machine: &Machine,
        record: &CycleRecord,
        setpoints: &[Setpoint],
    ) -> Result<Option<StageDifference>, ReplayError> {
        let CycleRecord { feedback, command } = record;
        let cycle = feedback.cycle.0;
        let (answers, before) = self.newest;
        match command.number {
            0 => return Err(ReplayError::Untold),
            1 if answers > 0 => self.controller = Controller::new(machine),
            number if number == answers + 1 => {}
            number if answers == 0 => {
                return Err(ReplayError::NotFromTheStart {
                    cycle,
                    answers: number.saturating_sub(1),
                });
            }
            _ => return Err(ReplayError::Gap { before, cycle }),
        }
        self.newest = (command.number, cycle);
        let Given { setpoints: taken, lost, slow, request, .. } = command.given;
        if taken as usize != setpoints.len() {
            return Err(ReplayError::Setpoints { cycle, taken, recorded: setpoints.len() });
        }
        let inputs = Inputs {
            feedback,
            received: command.received,
            setpoints,
            request: (request != OperatorRequest::default()).then_some(request),
            peers: Peers::without(lost),
            slow,
        };
        self.controller.step(command.received, &inputs, &mut self.outputs);
        // Its service stamps it as it leaves.
        self.outputs.command.published = command.published;
        let answered = difference::<Command>(command, &self.outputs.command, &record.origin());
        Ok(answered.map(|difference| StageDifference { stage: "controller", cycle, difference }))
    }
}

/// Simulated drives.
struct Driving {
    bridge: Bridge,
    newest: Option<Stamp>,
}

impl Driving {
    /// Of a plant whose clock is that of the machine.
    fn new(machine: &Machine, plant: &Machine, options: PlantOptions) -> Result<Self, ReplayError> {
        let plant = Machine { realtime: machine.realtime, ..plant.clone() };
        let port = SimulatedPlant::new(&plant, options)?;
        let options =
            BridgeOptions { epoch: 1, deadlines: Deadlines::Strict, timing: machine.realtime };
        let bridge = Bridge::new(port, options).with_brakes(machine.operating.brakes());
        Ok(Self { bridge, newest: None })
    }

    /// Measures in a cycle and latches its command; what differs.
    fn play(&mut self, record: &CycleRecord) -> Result<Option<StageDifference>, ReplayError> {
        let CycleRecord { feedback, command } = record;
        let stamp = Stamp::of(feedback);
        if let Some(before) = self.newest.replace(stamp)
            && Succession::between(before, stamp) != Succession::Next
        {
            return Err(ReplayError::Gap { before: before.cycle, cycle: stamp.cycle });
        }
        let now = feedback.deadline;
        self.bridge.begin(now, now);
        let measured = difference::<Feedback>(feedback, self.bridge.feedback(), &record.origin());
        self.bridge.latch(command, now);
        self.bridge.finish(now);
        let cycle = feedback.cycle.0;
        Ok(measured.map(|difference| StageDifference { stage: "drives", cycle, difference }))
    }
}

/// What is recorded with a plant that is simulated in virtual time.
#[derive(Debug, Clone, Copy)]
pub struct Simulated<'a> {
    /// The plant.
    pub plant: &'a Machine,
    /// Its options.
    pub options: PlantOptions,
}

/// Plays a recording of a controller for `machine` again, and of its simulated drives where it is of a simulation.
///
/// # Errors
/// [`ReplayError`].
pub fn replay(
    machine: &Machine,
    simulated: Option<Simulated<'_>>,
    entries: impl Iterator<Item = Result<Entry, RecordingError>>,
) -> Result<Replayed, ReplayError> {
    let mut answering = Answering {
        controller: Controller::new(machine),
        outputs: Outputs::default(),
        newest: (0, 0),
    };
    let mut driving = match simulated {
        Some(Simulated { plant, options }) => Some(Driving::new(machine, plant, options)?),
        None => None,
    };
    let mut replayed = Replayed { cycles: 0, difference: None };
    for entry in entries {
        let (Entry::Cycle(record, setpoints) | Entry::Lead(record, setpoints)) = entry? else {
            continue;
        };
        if record.is_answered() {
            replayed.difference = answering.play(machine, &record, &setpoints)?;
        }
        if replayed.difference.is_none()
            && let Some(driving) = &mut driving
        {
            replayed.difference = driving.play(&record)?;
        }
        replayed.cycles += 1;
        if replayed.difference.is_some() {
            break;
        }
    }
    Ok(replayed)
}
