//! Whether what was chosen does the job: planned and simulated with the new motors.

use super::need::AxisNeed;
use super::{Confirmation, MachineFile, SizeError};
use crate::simulation::simulate;
use drives::PlantOptions;
use machine::Machine;
use monitor::conclusion::{self, RunOutcome};
use monitor::marks::StreamEnd;
use monitor::run_analysis::{Clock, RunAnalysis};
use monitor::summary::Outcome;
use planner::Job;

/// By what the job may take longer than without limits of the motors: rounding, and the ends of windows.
const LONGER: f64 = 1.01;

/// Plans and simulates `job` on the machine of `file`, which takes `asked` [s] without limits of the motors.
///
/// # Errors
/// A machine file that is not sound with the new motors.
pub fn confirm(
    file: MachineFile<'_>,
    job: &Job,
    asked: f64,
    needs: &[AxisNeed],
) -> Result<Confirmation, SizeError> {
    let machine = Machine::parse(file.name, file.text, file.overrides)?;
    let refused = |because: String| Confirmation {
        is_right: false,
        because: Some(because),
        time_asked: asked,
        time: None,
        error: None,
        margin: 1.0,
    };
    let plan = match planner::plan(&machine, job) {
        Ok(plan) => plan,
        Err(error) => return Ok(refused(error.to_string())),
    };
    let mut analysis = RunAnalysis::new(&plan.artwork, Clock::Virtual, machine.realtime.period);
    let simulated = simulate(&machine, &machine, &plan, PlantOptions::default(), |records| {
        records.iter().for_each(|record| analysis.push(record));
    });
    let simulated = match simulated {
        Ok(simulated) => simulated,
        Err(error) => return Ok(refused(error.to_string())),
    };
    let results = analysis.finish(StreamEnd::Reported(&simulated.controller));
    let outcome = RunOutcome {
        controller: Some(simulated.controller),
        drives: Some(simulated.drives),
        ..RunOutcome::default()
    };
    let summary =
        conclusion::summarise(&machine, &plan.facts, &outcome, Some(&results), Clock::Virtual);
    let time = plan.facts.duration;
    let because = if summary.outcome != Outcome::Completed {
        Some(format!("the simulation ended as {}", summary.outcome.name()))
    } else if time > LONGER * asked {
        let binding = plan.facts.binding.iter().find(|binding| {
            binding.axis.as_ref().is_some_and(|axis| needs.iter().any(|need| need.axis == *axis))
        });
        let what = binding.map_or_else(
            || "the motors slow the job down".to_owned(),
            |binding| {
                let axis = binding.axis.as_deref().unwrap_or("?");
                format!("the {} of axis `{axis}` slows the job down", binding.limit)
            },
        );
        Some(what)
    } else {
        None
    };
    Ok(Confirmation {
        is_right: because.is_none(),
        because,
        time_asked: asked,
        time: Some(time),
        error: summary.marks.as_ref().map(|marks| marks.error_max),
        margin: 1.0,
    })
}
