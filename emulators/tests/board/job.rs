//! A whole job in virtual time: planner, controller and bridge are the ones that run, the HostMot2 port speaks to
//! the emulated board.

use controller::{Controller, Inputs, Outputs, Peers};
use drives::hostmot2::Hostmot2Port;
use drives::{Bridge, BridgeOptions, Deadlines};
use emulators::hostmot2::Faults;
use machine::Machine;
use messages::{
    ControllerReport, ControllerState, DrivesReport, Nanoseconds, OperatorRequest, OperatorVerb,
    RealtimeFacts, Setpoint,
};
use monitor::marks::StreamEnd;
use monitor::recording::CycleRecord;
use monitor::run_analysis::{Clock, RunAnalysis, RunResults};
use planner::Plan;

use super::Cable;

/// The cycle in which the job starts: enabled, and the port knows when its requests arrive.
const START: u64 = 200;
/// Cycles after the end in which the last light is still told.
const LAG: u64 = 5;
/// Setpoints handed over in one cycle at most, as the controller service does.
const DRAIN: usize = 16;

/// What a job came to.
pub(crate) struct Played {
    pub(crate) records: Vec<CycleRecord>,
    pub(crate) report: ControllerReport,
    pub(crate) drives: DrivesReport,
    pub(crate) results: RunResults,
    pub(crate) cable: Cable,
    /// The finest step of a gate edge.
    pub(crate) resolution: Nanoseconds,
}

/// Plays `plan` on the board of `machine`.
pub(crate) fn play(machine: &Machine, plan: &Plan, faults: &Faults) -> Played {
    let cable = Cable::new(machine, faults);
    let port = Hostmot2Port::of(machine).expect("a port").with_link(Box::new(cable.clone()));
    let resolution = drives::Port::profile(&port).gate_resolution;
    let timing = machine.realtime;
    let options = BridgeOptions { epoch: 1, deadlines: Deadlines::Strict, timing };
    let mut bridge = Bridge::new(Box::new(port), options);
    bridge.open(machine).expect("an open port");
    let period = timing.period.time();
    let mut deadline = Nanoseconds((cable.now().0 / period.0 + 2) * period.0);
    let mut controller = Controller::new(machine);
    let (mut outputs, mut setpoints) = (Outputs::default(), plan.setpoints(1));
    let (mut records, mut ended) = (Vec::new(), None::<ControllerReport>);
    for cycle in 1_u64.. {
        assert!(cycle < 100_000, "the job does not end: {:?}", outputs.command.state());
        cable.until(deadline);
        bridge.begin(deadline, deadline);
        let feedback = *bridge.feedback();
        let verb = match cycle {
            2 => Some((OperatorVerb::Enable, 0.0)),
            START => Some((OperatorVerb::Start, 1.0)),
            _ => None,
        };
        let request = verb.map(|(verb, value)| OperatorRequest {
            verb: verb as u32,
            ticket: 1,
            value,
            ..OperatorRequest::default()
        });
        let room = if cycle > START { controller.room().min(DRAIN) } else { 0 };
        let waiting: Vec<Setpoint> = setpoints.by_ref().take(room).collect();
        let peers = Peers::default();
        let inputs =
            Inputs { feedback: &feedback, received: deadline, setpoints: &waiting, request, peers };
        controller.step(deadline, &inputs, &mut outputs);
        bridge.latch(&outputs.command, deadline);
        bridge.finish(deadline);
        if cycle >= START {
            assert_ne!(outputs.command.state(), ControllerState::Faulted, "{:?}", feedback.fault);
            records.push(CycleRecord { feedback, command: outputs.command });
        }
        ended = outputs.report.filter(|report| report.is_final == 1).or(ended);
        if ended.is_some_and(|report| cycle > report.last_cycle.0 + LAG) {
            break;
        }
        deadline = deadline + period;
    }
    let report = ended.expect("a final report");
    let mut analysis = RunAnalysis::new(&plan.artwork, Clock::Virtual, timing.period);
    analysis = analysis.with_fastest(plan.facts.speed).with_machine(machine);
    records.iter().for_each(|record| analysis.push(record));
    let results = analysis.finish(StreamEnd::Reported(&report));
    let drives = bridge.report(RealtimeFacts::default());
    bridge.close().expect("a closed port");
    Played { records, report, drives, results, cable, resolution }
}
