//! One job on one machine: planned, simulated, and simulated on other plants.

use drives::PlantOptions;
use machine::Machine;
use messages::artwork::Artwork;
use messages::plan::{Binding, LimitUtilization};
use messages::time::SETPOINT_TIME;
use monitor::conclusion::{self, RunOutcome};
use monitor::marks::StreamEnd;
use monitor::run_analysis::{Clock, RunAnalysis};
use monitor::summary::{Outcome, Summary};
use planner::Plan;
use planner::request::JobRequest;

use super::{Contender, JobReport, mismatched};
use crate::operating::{AxisCourse, Demand, courses};
use crate::simulation::simulate;

/// Cycles from one operating point that is drawn to the next.
const DRAWN_EVERY: usize = 4;

/// A job as it went.
#[derive(Debug, Clone)]
pub(super) struct Run {
    pub(super) report: JobReport,
    /// Largest distance of the tool from where it should have been [m].
    pub(super) tracking_max: Option<f64>,
    /// Time lit, as planned [s].
    pub(super) lit: f64,
    /// What each motor must give.
    pub(super) demands: Vec<Demand>,
    /// Speed [rad/s] and torque [N·m] of each motor, now and then.
    pub(super) points: Vec<Vec<[f64; 2]>>,
    pub(super) uses: LimitUtilization,
    pub(super) binding: Vec<Binding>,
    /// What is marked.
    pub(super) artwork: Artwork,
    /// Largest error of the marks on each other plant [m]; `None` where it did not come to its end.
    pub(super) mismatch: Vec<Option<f64>>,
}

/// Plans and simulates `job`; on `seeds` other plants too.
///
/// # Errors
/// Why the job is refused, in words.
pub(super) fn run(contender: &Contender, job: &JobRequest, seeds: u64) -> Result<Run, String> {
    let Contender { machine, plant, .. } = contender;
    let plan = job.plan(machine).map_err(|refusal| refusal.message)?;
    let courses = courses(machine, &plan);
    let summary = examine(machine, plant, &plan, 0)?;
    let mismatch = (1..=seeds)
        .map(|seed| {
            let summary = examine(machine, &mismatched(plant, seed), &plan, seed).ok()?;
            let marks = summary.marks.filter(|_| summary.outcome == Outcome::Completed)?;
            Some(marks.error_max)
        })
        .collect();
    let lit = courses
        .first()
        .map_or(0, |course| course.points.iter().filter(|point| point.is_lit).count());
    let marks = summary.marks.as_ref();
    Ok(Run {
        report: JobReport {
            name: plan.facts.name.clone(),
            outcome: summary.outcome.name().to_owned(),
            time: summary.time,
            planned: plan.facts.duration,
            error_max: marks.map(|marks| marks.error_max),
            error_rms: marks.map(|marks| marks.error_rms),
        },
        tracking_max: marks.map(|marks| marks.tracking_max),
        lit: lit as f64 * SETPOINT_TIME,
        demands: courses.iter().map(Demand::of).collect(),
        points: courses.iter().map(drawn).collect(),
        uses: plan.facts.uses.clone(),
        binding: plan.facts.binding.clone(),
        artwork: plan.artwork,
        mismatch,
    })
}

fn drawn(course: &AxisCourse) -> Vec<[f64; 2]> {
    let points = course.points.iter().step_by(DRAWN_EVERY);
    points.map(|point| [point.speed, point.torque()]).collect()
}

fn examine(machine: &Machine, plant: &Machine, plan: &Plan, seed: u64) -> Result<Summary, String> {
    let mut analysis = RunAnalysis::new(&plan.artwork, Clock::Virtual, machine.realtime.period);
    let options = PlantOptions { seed, ..PlantOptions::default() };
    let simulated = simulate(machine, plant, plan, options, |records| {
        records.iter().for_each(|record| analysis.push(record));
    })
    .map_err(|error| error.to_string())?;
    let results = analysis.finish(StreamEnd::Reported(&simulated.controller));
    let outcome = RunOutcome {
        controller: Some(simulated.controller),
        drives: Some(simulated.drives),
        ..RunOutcome::default()
    };
    Ok(conclusion::summarise(machine, &plan.facts, &outcome, Some(&results), Clock::Virtual))
}
