//! `graver plan`: plans a job without running it.

use crate::arguments::PlanArguments;
use crate::commands::pulses;
use crate::exit::{Exit, Failure};
use crate::files::Sources;
use crate::output::say;
use crate::{inputs, output};
use machine::Machine;
use messages::Setpoint;
use messages::time::CYCLE_TIME;
use planner::{Plan, PlanError, PlanFacts};
use runtime::message;
use serde::Serialize;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::time::Instant;

/// What `plan --json` prints.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct PlanReport {
    /// What the plan comes to.
    #[serde(flatten)]
    pub facts: PlanFacts,
    /// The machine's name.
    pub machine: String,
    /// From the first motion to the last [s].
    pub time: f64,
    /// Time that reading, planning and checking took [s].
    pub plan_time: f64,
    /// What a G-code program asks for; null for other jobs.
    pub program: Option<planner::job::gcode::ProgramFacts>,
}

/// A plan, or what it comes to where nothing else of it is asked for.
enum Planned {
    Whole(Box<Plan>),
    Facts(Box<PlanFacts>),
}

/// Runs the command.
///
/// # Errors
/// A machine or job that does not hold, or a file that cannot be written.
pub fn run(arguments: &PlanArguments) -> Result<Exit, Failure> {
    let input = inputs::machine(&arguments.machine)?;
    let request = inputs::job_request(
        arguments.job.as_deref(),
        &input.machine,
        input.folder.as_deref(),
        &input.job_overrides,
    );
    let started = Instant::now();
    let job = request.open(&input.machine)?;
    let refuse = |error: PlanError| request.refuse(&error);
    let is_listed = arguments.samples.is_some() || arguments.pulses.is_some();
    let planned = if arguments.ideal {
        Planned::Whole(Box::new(planner::plan_ideal(&input.machine, &job).map_err(refuse)?))
    } else if is_listed {
        Planned::Whole(Box::new(planner::plan(&input.machine, &job).map_err(refuse)?))
    } else {
        let facts = planner::plan_through(&input.machine, &job, |_| ()).map_err(refuse)?;
        Planned::Facts(Box::new(facts))
    };
    let plan_time = started.elapsed().as_secs_f64();
    let mut sources = Sources::new(arguments.machine.machine.as_deref(), &job.files);
    let written = |path: &Path, result: io::Result<()>| {
        result.map_err(|error| Failure::output(format!("{}: {error}", path.display())))
    };
    if let (Some(path), Planned::Whole(plan)) = (&arguments.samples, &planned) {
        let file = sources.create("--samples", path)?;
        written(path, write_samples(file, &input.machine, plan))?;
    }
    if let (Some(path), Planned::Whole(plan)) = (&arguments.pulses, &planned) {
        if !pulses::has_steppers(&input.machine) {
            let name = &input.machine.name;
            let message = format!("--pulses: {name} has no steppers, and DC motors take no pulses");
            return Err(Failure::bad_input(message));
        }
        let file = sources.create("--pulses", path)?;
        written(path, pulses::write(file, &input.machine, plan))?;
    }
    for warning in input.machine.job_warnings() {
        message::tell(&format!("warning: {warning}"));
    }
    let facts = match planned {
        Planned::Whole(plan) => plan.facts,
        Planned::Facts(facts) => *facts,
    };
    let report = PlanReport {
        machine: input.machine.name.clone(),
        time: facts.duration,
        plan_time,
        program: job.program,
        facts,
    };
    if arguments.json {
        output::json(&report)?;
    } else {
        print_text(&report);
    }
    Ok(Exit::Done)
}

fn print_text(report: &PlanReport) {
    let facts = &report.facts;
    say!("job       {}", facts.name);
    say!("machine   {}", report.machine);
    let draws = facts.length > 0.0;
    if draws || facts.strokes == 0 {
        say!("strokes   {}, {:.3} mm", facts.strokes, facts.length * 1e3);
    } else {
        say!("dots      {}", facts.strokes);
    }
    say!("time      {:.4} s", report.time);
    if draws {
        say!("speed     {:.4} m/s at most while the laser is on", facts.speed);
    }
    say!(
        "limits    path acceleration {:.1} %, path jerk {:.1} %",
        facts.uses.path_acceleration * 100.0,
        facts.uses.path_jerk * 100.0
    );
    say!("planning  {:.1} ms", report.plan_time * 1e3);
    for note in &facts.notes {
        match note.line {
            0 => say!("note      {}", note.text),
            line => say!("note      line {line}: {}", note.text),
        }
    }
}

/// One row a setpoint: `t`, the tool, then per axis position, velocity, acceleration and effort,
/// then laser on and power.
fn write_samples(file: File, machine: &Machine, plan: &Plan) -> io::Result<()> {
    let mut file = BufWriter::new(file);
    write!(file, "t,x,y,z")?;
    for axis in &machine.axes {
        let name = &axis.name;
        write!(file, ",{name}_position,{name}_velocity,{name}_acceleration,{name}_effort")?;
    }
    writeln!(file, ",laser,power")?;
    for setpoint in plan.setpoints(1) {
        write_row(&mut file, machine.axes.len(), &setpoint)?;
    }
    file.flush()
}

fn write_row(file: &mut impl Write, axes: usize, setpoint: &Setpoint) -> io::Result<()> {
    let [x, y, z] = setpoint.tool;
    write!(file, "{},{x},{y},{z}", setpoint.sequence as f64 * CYCLE_TIME)?;
    for axis in 0..axes {
        write!(
            file,
            ",{},{},{},{}",
            setpoint.position[axis],
            setpoint.velocity[axis],
            setpoint.acceleration[axis],
            setpoint.effort[axis]
        )?;
    }
    let lit = u32::from(setpoint.laser.gate != 0);
    writeln!(file, ",{lit},{}", if lit == 1 { setpoint.laser.power } else { 0.0 })
}
