//! `graver plan`: plans a job without running it.

pub mod preview;

use crate::arguments::PlanArguments;
use crate::commands::path_check::{self, PathCheckFacts};
use crate::commands::pulses::{self, Motion, PulseFacts, PulseFiles};
use crate::exit::{Exit, Failure};
use crate::files::Sources;
use crate::output::say;
use crate::{inputs, output};
use machine::Machine;
use messages::Setpoint;
use messages::plan::{InterpolationFacts, LayerFacts};
use messages::time::SETPOINT_TIME;
use planner::paper::{PaperFacts, Profile, SpeedTime};
use planner::{Job, Plan, PlanError, PlanFacts};
use runtime::message;
use serde::Serialize;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
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
    /// Time from the beginning of reading until the first setpoint of a run could leave [s]: when the first window
    /// was checked, or all of a job that is planned as a whole before anything moves. Null of a plan on paper.
    pub first_setpoint: Option<f64>,
    /// What a G-code program asks for; null for other jobs.
    pub program: Option<planner::job::gcode::ProgramFacts>,
    /// How far from home a drawing was put that says no place of its own and has no room there, in x and y [m]; null of
    /// any other job.
    pub placed: Option<[f64; 2]>,
    /// With `--path-check`, how far the tool strays from all strokes; else null.
    pub path_check: Option<PathCheckFacts>,
    /// With `--profile`, the same job on paper; else null.
    pub paper: Option<PaperFacts>,
    /// With `--pulses` or `--pulse-path`, what the pulses of all steppers come to; else null.
    pub pulses: Option<PulseFacts>,
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
    let input = inputs::machine(&arguments.machine)?.with(&arguments.options);
    let mut request = inputs::job_request(
        arguments.job.as_deref(),
        &input.machine,
        input.folder.as_deref(),
        &input.job_overrides,
    );
    request.offsets = input.source.offsets()?;
    request.confined = arguments.confined;
    refuse_contradictions(arguments, &input.machine)?;
    let counts = arguments.pulses.is_some() || arguments.pulse_path.is_some();
    let started = Instant::now();
    let job = request.open(&input.machine)?;
    let leaves_early = job.is_surely_within_reach(&input.machine);
    let refuse = |error: PlanError| request.refuse(&error);
    let mut sources = Sources::new(arguments.machine.machine.as_deref(), &job.files);
    if let Some(path) = &arguments.preview {
        preview::write(path, &input.machine, &job, &mut sources, refuse)?;
        if arguments.preview_only {
            return Ok(Exit::Done);
        }
    }
    let is_listed = arguments.samples.is_some() || arguments.path_check.is_some() || counts;
    let mut first = None;
    let mut note_first = |_: &[Setpoint]| {
        first.get_or_insert_with(|| started.elapsed().as_secs_f64());
    };
    let planned = if arguments.ideal {
        Planned::Whole(Box::new(planner::plan_ideal(&input.machine, &job).map_err(refuse)?))
    } else if is_listed {
        let plan = planner::plan_telling(&input.machine, &job, &mut note_first).map_err(refuse)?;
        Planned::Whole(Box::new(plan))
    } else {
        let facts = planner::plan_through(&input.machine, &job, note_first).map_err(refuse)?;
        Planned::Facts(Box::new(facts))
    };
    let all = started.elapsed().as_secs_f64();
    let first_setpoint = first.map(|first| if leaves_early { first } else { all });
    let paper = arguments.profile.map(|profile| {
        planner::paper::on_paper(&input.machine, &job, profile.into()).map_err(refuse)
    });
    let paper = paper.transpose()?;
    let plan_time = started.elapsed().as_secs_f64();
    let checked = match (&arguments.path_check, &planned) {
        (Some(path), Planned::Whole(plan)) => {
            Some(check_paths(path, plan, &job, &input.machine, &mut sources)?)
        }
        _ => None,
    };
    // Of a profile where there is one: only what is written of it has to be within reach.
    let motion = |is_asked: bool| -> Result<Option<Motion<'_>>, Failure> {
        match (&paper, &planned) {
            (Some(paper), _) if is_asked => {
                let setpoints = paper.setpoints(&input.machine, 1).map_err(refuse)?;
                Ok(Some(Motion { setpoints, planned: Box::new(|time| paper.reference(time)) }))
            }
            (None, Planned::Whole(plan)) if is_asked => Ok(Some(Motion::of(plan))),
            _ => Ok(None),
        }
    };
    if let (Some(path), Some(motion)) = (&arguments.samples, motion(arguments.samples.is_some())?) {
        let file = sources.create("--samples", path)?;
        written(path, write_samples(file, &input.machine, motion.setpoints))?;
    }
    let mut pulses = None;
    if let Some(motion) = motion(counts)? {
        let mut create = |argument, path: &Option<PathBuf>| match path {
            Some(path) => Ok::<_, Failure>(Some((sources.create(argument, path)?, path.clone()))),
            None => Ok(None),
        };
        let list = create("--pulses", &arguments.pulses)?;
        let path = create("--pulse-path", &arguments.pulse_path)?;
        pulses = Some(pulses::follow(&input.machine, motion, PulseFiles { list, path })?);
    }
    for warning in input.machine.job_warnings() {
        message::tell(&format!("warning: {warning}"));
    }
    let mut facts = match planned {
        Planned::Whole(plan) => plan.facts,
        Planned::Facts(facts) => *facts,
    };
    let paper = paper.map(|paper| {
        facts.notes.extend(paper.notes);
        paper.facts
    });
    let report = PlanReport {
        machine: input.machine.name.clone(),
        time: facts.duration,
        plan_time,
        first_setpoint,
        program: job.program,
        placed: job.placed,
        path_check: checked,
        paper,
        pulses,
        facts,
    };
    if arguments.json {
        output::json(&report)?;
    } else {
        print_text(&report, &input.machine);
    }
    Ok(Exit::Done)
}

/// Refuses options that do not go with each other or with the machine.
fn refuse_contradictions(arguments: &PlanArguments, machine: &Machine) -> Result<(), Failure> {
    if arguments.profile.is_some() && !arguments.ideal {
        let message = "--profile is a comparison on paper, against the limits of the path only: give \
                       --ideal with it";
        return Err(Failure::bad_input(message));
    }
    let is_printed = arguments.preview.as_deref().is_some_and(preview::is_stdout);
    if is_printed && arguments.json {
        let message = "--preview - and --json both print on stdout: give the preview a file";
        return Err(Failure::bad_input(message));
    }
    let option = match (&arguments.pulses, &arguments.pulse_path) {
        (Some(_), _) => "--pulses",
        (None, Some(_)) => "--pulse-path",
        (None, None) => return Ok(()),
    };
    if !pulses::has_steppers(machine) {
        let name = &machine.name;
        let message = format!("{option}: {name} has no steppers, and DC motors take no pulses");
        return Err(Failure::bad_input(message));
    }
    Ok(())
}

/// Checks the strokes of `plan`, and writes what came of it to `path`.
fn check_paths(
    path: &Path,
    plan: &Plan,
    job: &Job,
    machine: &Machine,
    sources: &mut Sources,
) -> Result<PathCheckFacts, Failure> {
    let tolerance = job.marking.tolerance.unwrap_or(machine.path.tolerance);
    let checks = plan.path_check(job.surface.as_ref(), tolerance).map_err(|error| {
        Failure::bad_input(format!("--path-check: a stroke cannot be followed: {error}"))
    })?;
    let file = sources.create("--path-check", path)?;
    written(path, path_check::write(file, &checks, job.surface.is_some()))?;
    Ok(path_check::facts(&checks, tolerance, job.surface.is_some()))
}

/// What the file system says of the output at `path`.
fn written(path: &Path, result: io::Result<()>) -> Result<(), Failure> {
    result.map_err(|error| Failure::output(format!("{}: {error}", path.display())))
}

fn print_text(report: &PlanReport, machine: &Machine) {
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
    facts.layers.iter().for_each(print_layer);
    if let Some([least, most]) = facts.power {
        let from = if least < most { format!("{} % to ", percent(least)) } else { String::new() };
        say!("power     {from}{} % of full power", percent(most));
    }
    say!(
        "limits    path acceleration {:.1} %, path jerk {:.1} %",
        facts.uses.path_acceleration * 100.0,
        facts.uses.path_jerk * 100.0
    );
    if let (Some(found), true) = (&facts.interpolation, draws) {
        print_interpolation(found);
    }
    if let Some(checked) = &report.path_check {
        path_check::print(checked);
    }
    if let Some(paper) = &report.paper {
        print_paper(paper, report.time);
    }
    if let Some(pulses) = &report.pulses {
        print_pulses(pulses, machine);
    }
    let first = report
        .first_setpoint
        .map_or_else(String::new, |first| format!(", first setpoint after {:.1} ms", first * 1e3));
    say!("planning  {:.1} ms{first}", report.plan_time * 1e3);
    for note in &facts.notes {
        match note.line {
            0 => say!("note      {}", note.text),
            line => say!("note      line {line}: {}", note.text),
        }
    }
}

fn print_layer(layer: &LayerFacts) {
    let name = layer.name.as_deref().unwrap_or("(none)");
    let speed = layer.speed.map_or_else(String::new, |speed| format!(" at {speed:.4} m/s"));
    let passes =
        if layer.passes == 1 { String::new() } else { format!(", {} passes", layer.passes) };
    let power = percent(layer.power);
    say!("layer     {name}: {:.3} mm{speed}, {power} %{passes}", layer.length * 1e3);
}

/// A fraction as a person reads it, in per cent.
fn percent(fraction: f64) -> String {
    let text = format!("{:.3}", fraction * 100.0);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn print_interpolation(found: &InterpolationFacts) {
    let surface = found.surface.map_or_else(String::new, |off| {
        format!(", {:.3} nm from the surface, {:.3} nrad of its axis", off * 1e9, found.axis * 1e9)
    });
    say!(
        "between   the tool strays by {:.3} nm at most between two setpoints{surface}",
        found.deviation * 1e9
    );
}

fn print_paper(paper: &PaperFacts, own: f64) {
    let name = match paper.profile {
        Profile::Trapezoid => "trapezoid of acceleration",
        Profile::Velocity => "trapezoid of velocity",
    };
    let (time, speed) = (paper.time, paper.speed);
    say!("paper     {time:.4} s at {speed:.4} m/s by a {name}, {:.3} times the plan's", time / own);
    if let Some(SpeedTime { speed, time }) = paper.least {
        say!("          {time:.4} s at the least, with all strokes at {speed:.4} m/s");
    }
}

fn print_pulses(pulses: &PulseFacts, machine: &Machine) {
    let steppers = machine.actuators.iter().enumerate();
    let steppers = steppers.filter(|(_, actuator)| actuator.motor.stepper().is_some());
    let counts = steppers.map(|(index, actuator)| {
        let (count, rate) = (pulses.counts[index], pulses.largest_rate[index] * 1e-3);
        format!("{} {count:+} pulses from start to end, {rate:.1} kHz at most", actuator.name)
    });
    say!("pulses    {}", counts.collect::<Vec<_>>().join("; "));
    say!(
        "counted   {:.3} µm off the plan at most, {:.3} µm while the laser is on, {:.3} µm rms; \
         rounding allows {:.3} µm",
        pulses.deviation_max * 1e6,
        pulses.deviation_lit_max * 1e6,
        pulses.deviation_rms * 1e6,
        pulses.bound * 1e6
    );
}

/// One row a setpoint: `t`, the tool, then per axis position, velocity, acceleration and the
/// efforts of its actuators, then laser on and power.
fn write_samples(
    file: File,
    machine: &Machine,
    setpoints: impl Iterator<Item = Setpoint>,
) -> io::Result<()> {
    let mut file = BufWriter::new(file);
    write!(file, "t,x,y,z")?;
    for (axis, actuators) in machine.driven() {
        let name = &axis.name;
        write!(file, ",{name}_position,{name}_velocity,{name}_acceleration")?;
        actuators.iter().try_for_each(|actuator| write!(file, ",{}_effort", actuator.name))?;
    }
    writeln!(file, ",laser,power,frequency")?;
    for setpoint in setpoints {
        write_row(&mut file, machine, &setpoint)?;
    }
    file.flush()
}

fn write_row(file: &mut impl Write, machine: &Machine, setpoint: &Setpoint) -> io::Result<()> {
    let [x, y, z] = setpoint.tool;
    write!(file, "{},{x},{y},{z}", setpoint.sequence as f64 * SETPOINT_TIME)?;
    for (index, axis) in machine.axes.iter().enumerate() {
        let Setpoint { position, velocity, acceleration, .. } = setpoint;
        write!(file, ",{},{},{}", position[index], velocity[index], acceleration[index])?;
        let mut efforts = setpoint.effort[axis.actuators.clone()].iter();
        efforts.try_for_each(|effort| write!(file, ",{effort}"))?;
    }
    let lit = u32::from(setpoint.laser.gate != 0);
    let laser = &setpoint.laser;
    writeln!(file, ",{lit},{},{}", if lit == 1 { laser.power } else { 0.0 }, laser.frequency)
}
