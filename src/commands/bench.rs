//! `graver bench`: measures this PC.

pub mod latency;
pub mod planning;

use crate::arguments::BenchArguments;
use crate::exit::{Exit, Failure};
use crate::output::say;
use crate::{inputs, output};
use drives::PlantOptions;
use messages::time::Period;
use serde::Serialize;
use std::time::Duration;

/// What `bench simulate --json` prints.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct SpeedReport {
    /// The job.
    pub job: String,
    /// How often it was done.
    pub repetitions: u64,
    /// Wall time of one repetition: the median [s].
    pub wall: f64,
    /// The fastest [s].
    pub wall_min: f64,
    /// Setpoints handled in a second, by the median.
    pub setpoints_per_second: f64,
    /// Time of the job over wall time, by the median.
    pub realtime_factor: f64,
}

/// Simulates a job again and again; planning is not counted.
///
/// # Errors
/// A machine or job that does not hold.
pub fn simulate(arguments: &BenchArguments) -> Result<Exit, Failure> {
    let input = inputs::machine(&arguments.machine)?;
    let request = inputs::job_request(
        arguments.job.as_deref(),
        &input.machine,
        input.folder.as_deref(),
        &input.job_overrides,
    );
    let planned = request.plan(&input.machine)?;
    speed(arguments, input.machine.realtime.period, || {
        let simulated = workbench::simulation::simulate(
            &input.machine,
            &input.plant,
            &planned,
            PlantOptions::default(),
            |_| (),
        )
        .map_err(Failure::bad_input)?;
        Ok((planned.facts.name.clone(), simulated.controller.cycles, simulated.stepping))
    })
}

fn speed(
    arguments: &BenchArguments,
    period: Period,
    mut once: impl FnMut() -> Result<(String, u64, Duration), Failure>,
) -> Result<Exit, Failure> {
    let mut walls = Vec::new();
    let (mut job, mut samples, first) = once()?;
    let mut spent = first;
    while walls.is_empty() || spent.as_secs_f64() < arguments.seconds {
        let wall;
        (job, samples, wall) = once()?;
        spent += wall;
        walls.push(wall.as_secs_f64());
    }
    walls.sort_by(f64::total_cmp);
    let median = walls[walls.len() / 2];
    let report = SpeedReport {
        job,
        repetitions: walls.len() as u64,
        wall: median,
        wall_min: walls[0],
        setpoints_per_second: samples as f64 / median,
        realtime_factor: period.of(samples).seconds() / median,
    };
    if arguments.json {
        output::json(&report)?;
    } else {
        say!("job        {}", report.job);
        say!("repeated   {} times", report.repetitions);
        say!("wall time  {:.3} ms median, {:.3} ms least", median * 1e3, report.wall_min * 1e3);
        say!("setpoints  {:.0} a second", report.setpoints_per_second);
        say!("speed      {:.0} × real time", report.realtime_factor);
    }
    Ok(Exit::Done)
}
