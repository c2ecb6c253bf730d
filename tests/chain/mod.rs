//! Planned setpoints through controller, bridge and plant, in virtual time: cycle after cycle, with
//! whatever a test does in between.

#![allow(dead_code, reason = "each test binary uses its own part")]
#![allow(clippy::unwrap_used)]

use controller::{Controller, Inputs, Outputs, Peers};
use drives::{Bridge, BridgeOptions, Deadlines, PlantOptions, SimulatedPlant};
use machine::Machine;
use messages::time::Period;
use messages::{Feedback, Nanoseconds, OperatorRequest, OperatorVerb, Setpoint};
use planner::Plan;

/// The cycle in which the job starts.
pub(crate) const START: u64 = 100;

/// Setpoints handed over in one cycle at most, as the controller service does.
const DRAIN: usize = 16;

/// The stages behind the planner.
pub(crate) struct Chain<'a> {
    pub(crate) controller: Controller,
    pub(crate) bridge: Bridge,
    /// What the controller said last.
    pub(crate) outputs: Outputs,
    /// Whether the controller gets setpoints while it plays.
    pub(crate) is_fed: bool,
    /// The number of the cycle, from 1.
    pub(crate) cycle: u64,
    period: Period,
    deadline: Nanoseconds,
    setpoints: Box<dyn Iterator<Item = Setpoint> + 'a>,
}

impl<'a> Chain<'a> {
    /// A chain that will play `plan`.
    pub(crate) fn new(machine: &Machine, plan: &'a Plan) -> Self {
        Self::of(machine, plan.setpoints(1))
    }

    /// A chain that has nothing to play.
    pub(crate) fn idle(machine: &Machine) -> Self {
        Self::of(machine, core::iter::empty())
    }

    fn of(machine: &Machine, setpoints: impl Iterator<Item = Setpoint> + 'a) -> Self {
        let port = SimulatedPlant::new(machine, PlantOptions::default()).unwrap();
        let timing = machine.realtime;
        let options = BridgeOptions { epoch: 1, deadlines: Deadlines::Strict, timing };
        Self {
            controller: Controller::new(machine),
            bridge: Bridge::new(port, options),
            outputs: Outputs::default(),
            is_fed: true,
            cycle: 0,
            period: timing.period,
            deadline: Nanoseconds(0),
            setpoints: Box::new(setpoints),
        }
    }

    /// Begins the next cycle and gives what was measured.
    pub(crate) fn begin(&mut self) -> Feedback {
        self.cycle += 1;
        self.deadline = self.deadline + self.period.time();
        self.bridge.begin(self.deadline, self.deadline);
        *self.bridge.feedback()
    }

    /// Ends the cycle: the motors are enabled in the second one and the job starts in [`START`], and `ask`
    /// is what a person asks for in any other.
    pub(crate) fn finish(
        &mut self,
        feedback: &Feedback,
        ask: Option<(OperatorVerb, f64)>,
        peers: Peers,
    ) {
        let verb = match self.cycle {
            2 => Some((OperatorVerb::Enable, 0.0)),
            START => Some((OperatorVerb::Start, 1.0)),
            _ => ask,
        };
        let request = verb.map(|(verb, value)| OperatorRequest {
            verb: verb as u32,
            ticket: 1,
            value,
            ..OperatorRequest::default()
        });
        let plays = self.cycle > START && self.is_fed;
        let room = if plays { self.controller.room().min(DRAIN) } else { 0 };
        let setpoints: Vec<Setpoint> = self.setpoints.by_ref().take(room).collect();
        let (received, setpoints) = (self.deadline, setpoints.as_slice());
        let inputs = Inputs { feedback, received, setpoints, request, peers, slow: 0 };
        self.controller.step(self.deadline, &inputs, &mut self.outputs);
        self.bridge.latch(&self.outputs.command, self.deadline);
        self.bridge.finish(self.deadline);
    }

    /// Lets drives skip `cycles`.
    pub(crate) fn skip(&mut self, cycles: u64) {
        self.deadline = self.deadline + self.period.of(cycles);
    }
}
