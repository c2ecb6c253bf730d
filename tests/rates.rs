//! The tool while the rate changes: planner, controller and elastic plant together, in virtual
//! time.

#![allow(clippy::unwrap_used)]

mod chain;

use chain::{Chain, START};
use controller::Peers;
use machine::Machine;
use messages::artwork::distance;
use messages::{ControllerReport, ControllerState, OperatorVerb};
use planner::job::Job;
use planner::plan;

/// What a run came to.
struct Played {
    /// Largest distance of the tool from the plan with the laser on [m].
    lit: f64,
    /// Cycles with light while the rate changed.
    changing: u32,
    report: ControllerReport,
}

/// Plays the sample job, asking for `requests` at their cycles after its start.
fn play(machine: &Machine, requests: &[(u64, OperatorVerb, f64)]) -> Played {
    let job = Job::builtin(&[], machine).unwrap();
    let plan = plan(machine, &job).unwrap();
    let mut chain = Chain::new(machine, &plan);
    let (mut lit, mut changing) = (0.0_f64, 0);
    let mut rate = 0.0;
    while chain.cycle < 100_000 {
        let feedback = chain.begin();
        let cycle = chain.cycle;
        let asked = requests
            .iter()
            .find(|(at, ..)| START + at == cycle)
            .map(|(_, verb, value)| (*verb, *value));
        chain.finish(&feedback, asked, Peers::default());
        let outputs = &chain.outputs;
        if let Some(reply) = outputs.reply {
            assert_eq!(reply.accepted, 1, "{asked:?} in cycle {cycle}");
        }
        let command = &outputs.command;
        if command.stream != 0 {
            let error = distance(&feedback.tool, &command.tool);
            if feedback.laser.is_lit() || command.laser.is_lit() {
                lit = lit.max(error);
                changing += u32::from(command.rate != rate);
            }
        }
        rate = command.rate;
        if let Some(report) = outputs.report.filter(|report| report.is_final == 1) {
            assert_eq!(outputs.command.state(), ControllerState::Idle);
            return Played { lit, changing, report };
        }
    }
    panic!("the job does not end");
}

#[test]
fn the_tool_stays_on_its_path_while_the_rate_changes_in_the_light() {
    let machine = Machine::builtin();
    let plain = play(&machine, &[]);
    assert_eq!(plain.changing, 0);
    let slow = play(&machine, &[(1, OperatorVerb::Override, 0.5)]);
    let mut ramps = Vec::new();
    // 100 % to 50 % and back, again and again: some ramps fall onto every part of the job.
    for period in 0..12 {
        ramps.push((300 + period * 900, OperatorVerb::Override, 0.5));
        ramps.push((750 + period * 900, OperatorVerb::Override, 1.0));
    }
    let ramped = play(&machine, &ramps);
    // At other rates than the planned one the lead does not scale with the square alone; the belts'
    // damping and the rotors' part are suspected, not proven. With the laser on: 4.9 µm as planned,
    // 21.2 µm at a steady 70 %, 18.6 µm at 50 %, 21.0 µm in this train of ramps. The worst single
    // ramp of 80, begun every 0.1 s, reached 23.9 µm; the bound on the train is that plus 5 %.
    assert!(plain.lit < 10e-6, "{} m off as planned", plain.lit);
    assert!(slow.lit < 20e-6, "{} m off at 50 %", slow.lit);
    assert!(ramped.lit < 25e-6, "{} m off while ramping", ramped.lit);
    assert_eq!((ramped.report.completed, ramped.report.fault.is_some()), (1, false));
    assert!(ramped.changing > 200, "{} lit cycles with a changing rate", ramped.changing);
    // `a·r² + v·ṙ` and `3·a·r·ṙ + j·r³` with ṙ ≤ 2/s at 0.25 m/s and 10 m/s²: 5 and 12 % at most.
    let report = &ramped.report;
    assert!(report.path_acceleration_use < 1.05, "{}", report.path_acceleration_use);
    assert!(report.path_jerk_use < 1.12, "{}", report.path_jerk_use);
}

#[test]
fn a_hold_adds_no_more_than_it_says() {
    let machine = Machine::builtin();
    let requests: Vec<_> = (0..16)
        .flat_map(|index| {
            let at = 150 + index * 1100 + index * 37;
            [(at, OperatorVerb::Hold, 0.0), (at + 300, OperatorVerb::Resume, 0.0)]
        })
        .collect();
    let held = play(&machine, &requests);
    assert_eq!((held.report.completed, held.report.fault.is_some()), (1, false));
    assert!(held.lit < 15e-6, "{} m off in the light", held.lit);
    // The report adds sizes, whatever their directions; `holds` measures what the tool does.
    let report = &held.report;
    assert!(report.path_acceleration_use < 1.06, "{}", report.path_acceleration_use);
    assert!(report.path_jerk_use < 1.6, "{}", report.path_jerk_use);
}

#[test]
fn the_sample_job_is_marked_at_every_rate_of_the_cycle() {
    // Seen: 3.7 um at 1 kHz; 18 um at 500 Hz and 73 um at 250 Hz, where the loops are slower in proportion.
    for (period, most) in
        [("125 us", 10e-6), ("250 us", 10e-6), ("1.5 ms", 12e-6), ("2 ms", 25e-6), ("4 ms", 100e-6)]
    {
        let change = format!("realtime.period={period}").parse().unwrap();
        let machine = Machine::builtin_with(&[change]).unwrap();
        let played = play(&machine, &[]);
        let report = &played.report;
        assert_eq!((report.completed, report.fault.is_some()), (1, false), "{period}");
        assert!(played.lit < most, "{} m off at {period}", played.lit);
    }
}
