//! `graver check`: is the machine file sound, and can the machine do the job?

use crate::arguments::CheckArguments;
use crate::exit::{Exit, Failure};
use crate::{inputs, output};
use machine::Machine;
use monitor::conclusion::machine_summary;
use monitor::summary::MachineSummary;
use planner::PlanFacts;
use serde::Serialize;

/// What `check --json` prints.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct CheckReport {
    /// The machine.
    pub machine: MachineSummary,
    /// Its axes, in order.
    pub axes: Vec<AxisReport>,
    /// Doubts about the machine file, with the numbers.
    pub warnings: Vec<CheckWarning>,
    /// What the job comes to on it; null without a job.
    pub job: Option<PlanFacts>,
}

/// One axis and what its motor can do.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct AxisReport {
    /// Its name.
    pub name: String,
    /// Soft limits [m or rad].
    pub position: [f64; 2],
    /// Speed limit [m/s or rad/s].
    pub velocity: f64,
    /// Speed at which the supply is used up without load [m/s or rad/s].
    pub no_load_velocity: f64,
    /// Torque at standstill with the supply or the current limit used up [N·m at the motor].
    pub stall_torque: f64,
    /// Angle of one encoder count, seen at the joint [m or rad].
    pub resolution: f64,
}

/// A doubt and its place.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct CheckWarning {
    /// Line of the machine file, 0 for an override.
    pub line: u64,
    /// Column from 1, 0 for an override.
    pub column: u64,
    /// What is doubtful.
    pub message: String,
}

/// Runs the command.
///
/// # Errors
/// A machine or job that does not hold.
pub fn run(arguments: &CheckArguments) -> Result<Exit, Failure> {
    let input = inputs::machine(&arguments.machine)?;
    let job = match &arguments.job {
        None => None,
        Some(path) => {
            let request =
                inputs::job_request(Some(path), &input.machine, None, &input.job_overrides);
            Some(request.plan(&input.machine)?.facts)
        }
    };
    let report = CheckReport {
        machine: machine_summary(&input.machine),
        axes: axes(&input.machine),
        warnings: input
            .machine
            .warnings
            .iter()
            .map(|warning| CheckWarning {
                line: warning.line as u64,
                column: warning.column as u64,
                message: warning.text.clone(),
            })
            .collect(),
        job,
    };
    if arguments.json {
        output::json(&report)?;
    } else {
        print_text(&report);
    }
    Ok(Exit::Done)
}

fn axes(machine: &Machine) -> Vec<AxisReport> {
    machine
        .axes
        .iter()
        .map(|axis| {
            let motor = &axis.motor;
            AxisReport {
                name: axis.name.clone(),
                position: axis.limits.position,
                velocity: axis.limits.velocity,
                no_load_velocity: motor.largest_speed() * axis.ratio,
                stall_torque: motor.stall_torque(),
                resolution: axis.encoder.resolution() * axis.ratio,
            }
        })
        .collect()
}

fn print_text(report: &CheckReport) {
    let MachineSummary { name, mechanism, .. } = &report.machine;
    eprintln!("machine   {name} ({mechanism})");
    for axis in &report.axes {
        let [lower, upper] = axis.position;
        eprintln!(
            "axis {:<4} {:.1} to {:.1} mm, {:.3} of {:.3} m/s, {:.1} mN·m at standstill, {:.2} µm a count",
            axis.name,
            lower * 1e3,
            upper * 1e3,
            axis.velocity,
            axis.no_load_velocity,
            axis.stall_torque * 1e3,
            axis.resolution * 1e6
        );
    }
    for warning in &report.warnings {
        match warning.line {
            0 => eprintln!("warning   {}", warning.message),
            line => {
                eprintln!("warning   line {line}, column {}: {}", warning.column, warning.message)
            }
        }
    }
    let Some(job) = &report.job else {
        eprintln!("the machine file is sound");
        return;
    };
    let percent = |values: &[f64]| -> String {
        values.iter().map(|value| format!("{:.0}", value * 100.0)).collect::<Vec<_>>().join(", ")
    };
    eprintln!("job       {}: {} strokes, {:.3} s", job.name, job.strokes, job.duration);
    eprintln!("velocity  {} % of each axis's limit", percent(&job.uses.velocity));
    eprintln!("current   {} % of each power stage's limit", percent(&job.uses.current));
    eprintln!("voltage   {} % of each supply", percent(&job.uses.voltage));
    eprintln!("heat      {} % of what each winding bears for ever", percent(&job.uses.heat));
    eprintln!(
        "path      acceleration {:.0} %, jerk {:.0} %",
        job.uses.path_acceleration * 100.0,
        job.uses.path_jerk * 100.0
    );
    for note in &job.notes {
        eprintln!("note      line {}: {}", note.line, note.text);
    }
    eprintln!("the machine file is sound, and the machine can do the job");
}
