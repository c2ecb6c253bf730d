//! The proof of a machine file: it is sound, and it marks its sample.

use super::{LESS, Short};
use crate::simulation::simulate;
use drives::PlantOptions;
use machine::Machine;
use monitor::conclusion::{self, RunOutcome};
use monitor::marks::StreamEnd;
use monitor::run_analysis::{Clock, RunAnalysis};
use monitor::summary::Outcome;
use planner::Job;

/// What the sample came to on the machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proof {
    /// Its time [s].
    pub time: f64,
    /// Largest deviation of a mark [m].
    pub error: f64,
}

/// Reads, checks and simulates the machine file `text` with its job `sample`.
pub(super) fn prove(text: &str, sample: &str) -> Result<Proof, Short> {
    let failed = |what: String| Short::Acceleration(LESS, what);
    let machine =
        Machine::parse("machine.toml", text, &[]).map_err(|error| failed(error.to_string()))?;
    if let Some(warning) = machine.warnings.first() {
        return Err(Short::Inertia(warning.text.clone()));
    }
    let job = Job::parse("sample.toml", sample, &machine)
        .map_err(|error| failed(format!("the sample: {error}")))?;
    let plan = planner::plan(&machine, &job)
        .map_err(|error| failed(format!("the sample cannot be planned: {error}")))?;
    let mut analysis = RunAnalysis::new(&plan.artwork, Clock::Virtual, machine.realtime.period);
    let simulated = simulate(&machine, &machine, &plan, PlantOptions::default(), |records| {
        records.iter().for_each(|record| analysis.push(record));
    })
    .map_err(|error| failed(error.to_string()))?;
    let results = analysis.finish(StreamEnd::Reported(&simulated.controller));
    let outcome = RunOutcome {
        controller: Some(simulated.controller),
        drives: Some(simulated.drives),
        ..RunOutcome::default()
    };
    let summary =
        conclusion::summarise(&machine, &plan.facts, &outcome, Some(&results), Clock::Virtual);
    if summary.outcome != Outcome::Completed {
        let fault = summary.fault.map_or_else(String::new, |fault| {
            let axis = fault.axis.map_or_else(String::new, |axis| format!(" of axis {axis}"));
            format!(": {}{axis}, {}", fault.code, fault.detail)
        });
        return Err(Short::Motor(format!("the sample ends as {}{fault}", summary.outcome.name())));
    }
    let Some(error) = summary.marks.map(|marks| marks.error_max) else {
        return Err(failed("the sample marks nothing".to_owned()));
    };
    // Put this way an error that is no number does not pass.
    if error <= machine.path.tolerance {
        return Ok(Proof { time: plan.facts.duration, error });
    }
    Err(Short::Inertia(format!(
        "marks of the sample are off by {:.1} µm, and the tolerance is {:.0} µm",
        error * 1e6,
        machine.path.tolerance * 1e6
    )))
}
