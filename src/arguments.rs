//! The command line.

use crate::exit;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use workbench::new::Kind;

const RUN_EXAMPLES: &str = "\
Examples:
  graver run                                        the letters NASO, 20 mm, on a CoreXY
  graver run jobs/square_arcs.ngc --machine machines/cartesian.toml
  graver run --set letters.text=S --set letters.height=\"10 mm\" --out runs/s
  graver run --set plant.axis.a.friction.coulomb=\"7 mN m\"   a plant that differs from the plan
  graver run --json > summary.json                  for scripts

While it runs, from another terminal: graver hold, resume, override, stop, status.";

const SIMULATE_EXAMPLES: &str = "\
Examples:
  graver simulate                                   what `graver run` would mark
  graver simulate jobs/square_arcs.ngc --out runs/a with recording, picture and report
  graver simulate --set machine.path.jerk=\"1000 m/s^3\" --json";

const PLAN_EXAMPLES: &str = "\
Examples:
  graver plan jobs/square_arcs.ngc                  time, length, limits, notes
  graver plan --samples setpoints.csv               every setpoint, one row a millisecond
  graver plan --machine twin.toml --pulses p.csv    every step pulse with its time and count
  graver plan --ideal --set letters.style=h2        within the limits of the path only
  graver plan --ideal --profile trapezoid           the time by the source's profile beside it
  graver plan --machine machines/mcm.toml --path-check check.csv";

const CHECK_EXAMPLES: &str = "\
Examples:
  graver check --machine machines/cartesian.toml    the machine file alone
  graver check jobs/square_arcs.ngc                 and whether the machine can do the job";

const KINEMATICS_EXAMPLES: &str = "\
Examples, one object a line in and out, SI units and radians:
  forward    {\"q\": [0.2, 0]}
  inverse    {\"pose\": {\"position\": [0.1, 0.1]}}
  jacobian   {\"q\": [0.2, 0]}
  dynamics   {\"q\": [0.2, 0], \"qd\": [0, 0], \"qdd\": [10, 10]}
  ellipse    {\"q\": [0.2, 0]}

A line that asks for an impossible pose or motion gets {\"error\": {\"code\", \"detail\", ..}}, and the next line is
answered; a line that is not such an object ends the command with exit code 2.";

const FIGURES_EXAMPLES: &str = "\
Examples:
  graver figures                                    all figures of source 003, into figures/
  graver figures ellipses modes --machine machines/five_bar.toml
  graver figures torque jobs/letters.toml --machine machines/corexy.toml --out pictures";

const EXPORT_EXAMPLES: &str = "\
Examples:
  graver export runs/20261127-134500-NASO > samples.csv
  graver export runs/a/samples.bin --out samples.csv

SI units and radians, one line a millisecond; a field that was not known is empty.";

const SIZE_EXAMPLES: &str = "\
Examples:
  graver size --machine machines/cartesian.toml     what its sample job needs
  graver size job.ngc --machine mine.toml --motors mine-motors.toml --out new.toml
  graver size --machine mine.toml --motors dc --gears keep --axis x
  graver size --machine mine.toml --motors dc --motors gears --by power --margin 1.5

A catalogue is a TOML file, or one of thesis, dc, bldc, steppers and gears, which are built in.
--out writes the machine file with the motors; its comments stay.";

const NEW_EXAMPLES: &str = "\
Examples:
  graver machine new corexy                         asks for the rest on a terminal
  graver machine new cartesian_lift --area \"300 x 200 mm\" --z \"60 mm\" --head \"0.8 kg\" --yes
  graver machine new five_bar --speed \"0.5 m/s\" --acceleration \"20 m/s^2\" --out mine.toml
  graver machine new prrrp --steppers --motors my-motors.toml --motors gears

The file is written only if `graver check` has nothing to say of it and its sample is marked in
simulation. Where no motor is enough, speed or acceleration is lowered, and the file says so.";

const CALIBRATE_EXAMPLES: &str = "\
Examples:
  graver calibrate poses.csv --machine mine.toml --out calibrated.toml
  graver calibrate poses.csv --machine mine.toml --free legs,base

poses.csv has the columns xD,yD,xE,yE,xF,yF (where the motors say the feet are) and x,y,z,qw,qx,qy,qz (the
measured pose of the tool, with base free in the instrument's own frame), in metres, a pose a line.";

const COMPARE_EXAMPLES: &str = "\
Examples:
  graver compare                                    the four machines of source 003 on its letters
  graver compare jobs/letters.toml --machine machines/cartesian.toml --machine machines/corexy.toml
  graver compare --machine a.toml --machine b.toml --weight time=5 --weight mass=0 --out comparison

Each job is planned, simulated, and simulated on --seeds plants that are other than the file says.";

const TABLES_EXAMPLES: &str = "\
Examples:
  graver tables                                     all ten, on the terminal
  graver tables 5-2 7-1 --format csv                for a spreadsheet
  graver tables --out tables                        a page, and a CSV file for each table

Each value as printed, as the source's own numbers give it, with the errata applied, and as planned.";

const SERVICES: &str = "\
The services are graver drives, controller, planner and monitor with the same --instance;
machine and drives are the domain's. deploy/ has systemd units. SIGTERM or Ctrl-C ends it with
the machine at rest.";

/// Real-time motion controller for laser marking and engraving machines.
#[derive(Debug, Parser)]
#[command(name = "graver", version, after_help = exit::help(), propagate_version = true)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What can be done.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a job in real time: planner, controller, drives and monitor as processes.
    #[command(after_help = RUN_EXAMPLES)]
    Run(RunArguments),
    /// Run the same stages in one process in virtual time, bit for bit repeatable.
    #[command(after_help = SIMULATE_EXAMPLES)]
    Simulate(SimulateArguments),
    /// Plan and check a job without running it.
    #[command(after_help = PLAN_EXAMPLES)]
    Plan(PlanArguments),
    /// Say whether a machine file is sound, and whether the machine can do a job.
    #[command(after_help = CHECK_EXAMPLES)]
    Check(CheckArguments),
    /// Kinematics and dynamics: JSON lines in, JSON lines out.
    #[command(after_help = KINEMATICS_EXAMPLES)]
    Kinematics(KinematicsArguments),
    /// Write the recording of a run as comma-separated values.
    #[command(after_help = EXPORT_EXAMPLES)]
    Export(ExportArguments),
    /// Say what motor and gear each axis needs for a job, and choose them from catalogues.
    #[command(after_help = SIZE_EXAMPLES)]
    Size(SizeArguments),
    /// Identify the leg lengths and the mounting of a tri-planar platform from measured poses.
    #[command(after_help = CALIBRATE_EXAMPLES)]
    Calibrate(CalibrateArguments),
    /// Draw figures of machines, motors and jobs: SVG, the numbers as CSV, and a page of them all.
    #[command(after_help = FIGURES_EXAMPLES)]
    Figures(FiguresArguments),
    /// Make machine files.
    #[command(subcommand)]
    Machine(MachineCommand),
    /// Measure this PC: latencies, planning speed, simulation speed.
    #[command(subcommand)]
    Bench(BenchCommand),
    /// Hand a job to a pipeline that `graver domain` holds, and follow it to its end.
    Submit(SubmitArguments),
    /// Feed hold: laser off at once, then to rest along the path.
    Hold(InstanceArguments),
    /// Go on from a hold without losing or doubling a mark.
    Resume(InstanceArguments),
    /// Play the job at another rate.
    Override(OverrideArguments),
    /// Give the job up: laser off at once, then to rest along the path.
    Stop(InstanceArguments),
    /// Clear a latched fault; the motors stay unpowered until `enable`.
    Reset(InstanceArguments),
    /// Power the motors; `run` and `submit` do so themselves.
    Enable(InstanceArguments),
    /// Unpower the motors, which must be at rest.
    Disable(InstanceArguments),
    /// Say what a running pipeline is doing, with the process ids of its services.
    Status(InstanceArguments),
    /// Compare machines on the same job: time, error, what their motors must give, stiffness, and who
    /// comes first.
    #[command(after_help = COMPARE_EXAMPLES)]
    Compare(CompareArguments),
    /// The tables of the sources: as printed, with the errata applied, and as modelled.
    #[command(after_help = TABLES_EXAMPLES)]
    Tables(TablesArguments),
    /// Create and hold an instance's channels, for services that somebody else starts, and run
    /// the jobs that are submitted.
    #[command(after_help = SERVICES)]
    Domain(DomainArguments),
    /// The planner service: reads, plans and checks a job, and streams its setpoints.
    Planner(ServiceArguments),
    /// The controller service: plays the setpoints and closes the loops, 1 kHz.
    Controller(ServiceArguments),
    /// The drives service: the clock, the port to the motors, and the watchdog, 1 kHz.
    Drives(ServiceArguments),
    /// The monitor service: records and measures; nobody waits for it.
    Monitor(ServiceArguments),
    /// Hold a summary to what must be true of every one; for scripts.
    #[command(hide = true)]
    VerifySummary {
        /// The summary.
        file: PathBuf,
    },
    /// Print the JSON schema of the files that people write, for editors and generators.
    Schema {
        /// Which file.
        #[arg(value_enum)]
        file: SchemaFile,
    },
    /// Print a shell completion script.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Write man pages into a folder.
    Manual {
        /// The folder.
        folder: PathBuf,
    },
}

/// A file that people write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SchemaFile {
    /// The machine file.
    Machine,
    /// The job file.
    Job,
    /// A catalogue of motors and gears.
    Catalogue,
}

/// The machine and the changes to it.
#[derive(Debug, Clone, Args)]
pub struct MachineArguments {
    /// Machine file (.toml); without it a built-in CoreXY.
    #[arg(long, value_name = "FILE")]
    pub machine: Option<PathBuf>,
    /// Change a value: of the job (letters.text=S), of the machine (machine.path.jerk="5000
    /// m/s^3"), or of the simulated plant alone (plant.axis.a.motor.dc.resistance="2.8 ohm").
    /// Can be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

/// Which running pipeline is meant.
#[derive(Debug, Clone, Args)]
pub struct InstanceArguments {
    /// Name of the pipeline: 1 to 32 of a-z, 0-9, '_' and '-'.
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub instance: String,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// What the drives are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DrivesKind {
    /// The simulated plant.
    Sim,
}

/// How the drives keep time.
#[derive(Debug, Clone, Args)]
pub struct DrivesArguments {
    /// What to drive.
    #[arg(long, value_enum, default_value = "sim")]
    pub drives: DrivesKind,
    /// Let no deadline slip, as on hardware: a command later than 0.3 ms closes the gate for that
    /// cycle. Without it the simulated plant waits for up to 100 ms.
    #[arg(long)]
    pub strict: bool,
    /// CPU for controller and drives; without it the last one if SCHED_FIFO is allowed, else any.
    #[arg(long, value_name = "CPU")]
    pub core: Option<usize>,
    /// Ask for no real-time scheduling, even where it is allowed.
    #[arg(long)]
    pub no_realtime: bool,
}

/// Arguments of `run`.
#[derive(Debug, Clone, Args)]
pub struct RunArguments {
    /// Job: .ngc .nc .gcode .tap (G-code) or .toml; without it the machine's sample job.
    pub job: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub drives: DrivesArguments,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
    /// Run folder; without it `runs/DATE-TIME-JOB`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Arguments of `simulate`.
#[derive(Debug, Clone, Args)]
pub struct SimulateArguments {
    /// Job: .ngc .nc .gcode .tap (G-code) or .toml; without it the machine's sample job.
    pub job: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    /// Run folder; without it nothing is written.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Where the encoders' counts lie: 0 puts the start on a count, other seeds between two.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `plan`.
#[derive(Debug, Clone, Args)]
pub struct PlanArguments {
    /// Job: .ngc .nc .gcode .tap (G-code) or .toml; without it the machine's sample job.
    pub job: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    /// Write the 1 kHz setpoints to a CSV file.
    #[arg(long, value_name = "FILE")]
    pub samples: Option<PathBuf>,
    /// Write the step pulses of all steppers, each with its time and count, to a CSV file.
    #[arg(long, value_name = "FILE")]
    pub pulses: Option<PathBuf>,
    /// Write the path that the counted pulses alone make, one row a pulse, to a CSV file.
    #[arg(long, value_name = "FILE")]
    pub pulse_path: Option<PathBuf>,
    /// Write how far the tool strays from each stroke, as it is executed and with its joints interpolated
    /// between knots, to a CSV file.
    #[arg(long, value_name = "FILE")]
    pub path_check: Option<PathBuf>,
    /// Plan within the limits of the path only, as if the motors had no limits.
    #[arg(long)]
    pub ideal: bool,
    /// Also time the job by a speed profile of the sources, for comparison; needs --ideal. --samples,
    /// --pulses and --pulse-path then write the motion of that profile.
    #[arg(long, value_enum)]
    pub profile: Option<ProfileName>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// How the speed of a stroke goes on paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProfileName {
    /// Trapezoid of acceleration, run-in and run-out at every stroke (source 003).
    Trapezoid,
    /// Trapezoid of velocity, from rest to rest along every stroke (source 004).
    Velocity,
}

impl From<ProfileName> for planner::paper::Profile {
    fn from(name: ProfileName) -> Self {
        match name {
            ProfileName::Trapezoid => Self::Trapezoid,
            ProfileName::Velocity => Self::Velocity,
        }
    }
}

/// Arguments of `check`.
#[derive(Debug, Clone, Args)]
pub struct CheckArguments {
    /// Job to check on the machine; without it the machine file alone.
    pub job: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    /// Draw what the machine reaches, and the job's strokes over it, as an SVG.
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `kinematics`.
#[derive(Debug, Clone, Args)]
pub struct KinematicsArguments {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    /// Joint values are motor angles, through gear, screw and pulley.
    #[arg(long)]
    pub motor: bool,
    /// What to compute for each line.
    #[arg(value_enum)]
    pub verb: KinematicsVerb,
}

/// What `kinematics` computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum KinematicsVerb {
    /// Joints to pose.
    Forward,
    /// Pose to joints.
    Inverse,
    /// Tool velocity per joint rate.
    Jacobian,
    /// Efforts for a motion.
    Dynamics,
    /// Mass matrix, velocity terms and gravity, apart.
    Matrices,
    /// Velocity and force ellipses.
    Ellipse,
}

/// Arguments of `export`.
#[derive(Debug, Clone, Args)]
pub struct ExportArguments {
    /// Run folder, or a `samples.bin`; the axes' names are those of the summary beside it.
    #[arg(value_name = "RUN_FOLDER")]
    pub recording: PathBuf,
    /// Write to this file; without it to stdout.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Arguments of `size`.
#[derive(Debug, Clone, Args)]
pub struct SizeArguments {
    /// Job: .ngc .nc .gcode .tap (G-code) or .toml; without it the machine's sample job.
    pub job: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    /// Catalogue of motors and gears: a .toml file, or thesis, dc, bldc, steppers or gears, which are built in.
    /// Can be repeated; without it all that are built in.
    #[arg(long, value_name = "CATALOGUE")]
    pub motors: Vec<String>,
    /// By what every need is multiplied before it is compared with what a motor gives.
    #[arg(long, value_name = "X", default_value_t = 1.25, value_parser = margin)]
    pub margin: f64,
    /// Temperature of the air around the motors [°C].
    #[arg(long, value_name = "T", default_value_t = 25.0, allow_negative_numbers = true, value_parser = temperature)]
    pub ambient: f64,
    /// Look for a motor for this axis only. Can be repeated.
    #[arg(long, value_name = "NAME")]
    pub axis: Vec<String>,
    /// What makes one motor smaller than another.
    #[arg(long, value_enum, default_value = "mass")]
    pub by: SizeOrder,
    /// Which gears to try: without it those of the catalogues, or the machine's where they have none.
    #[arg(long, value_enum)]
    pub gears: Option<SizeGears>,
    /// Write the machine file with the motors and gears that were chosen.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Draw torque over speed of each motor, the machine's and the chosen one, with the points of the job:
    /// SVG and CSV, and a page of them.
    #[arg(long, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `calibrate`.
#[derive(Debug, Clone, Args)]
pub struct CalibrateArguments {
    /// The measured poses: a CSV file with a header.
    pub measurements: PathBuf,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    /// What to identify: any of legs, base (where the stator stands) and tool (where the measured point is on
    /// the platform). The rest stays as the machine file has it.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "legs,base,tool")]
    pub free: Vec<CalibratePart>,
    /// Write the machine file with what was identified.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// What `calibrate` identifies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum CalibratePart {
    /// The lengths of the legs.
    Legs,
    /// Where the stator stands.
    Base,
    /// Where the measured point is on the platform.
    Tool,
}

/// What makes one motor smaller than another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SizeOrder {
    /// Mass of motor and gear; power where one has none.
    Mass,
    /// Rated power.
    Power,
}

/// Which gears `size` tries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SizeGears {
    /// The ratio that the machine has.
    Keep,
    /// Those of the catalogues, and none.
    Catalogue,
    /// Any ratio.
    Any,
}

/// Arguments of `figures`.
#[derive(Debug, Clone, Args)]
pub struct FiguresArguments {
    /// Names of figures (torque, motor, acceleration, stiffness, ellipses, singular, speed, chords,
    /// modes; without any all of them), and a job that the machines mark instead of the source's
    /// letters or their own sample jobs.
    #[arg(value_name = "NAME|JOB")]
    pub what: Vec<String>,
    /// Machine file (.toml), can be repeated; without it the four machines of source 003.
    #[arg(long, value_name = "FILE")]
    pub machine: Vec<PathBuf>,
    /// Change a value of all machines (machine.path.jerk="5000 m/s^3") or of the job, as in `plan`. Can
    /// be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Folder that the files go to.
    #[arg(long, value_name = "DIR", default_value = "figures")]
    pub out: PathBuf,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// What `bench` measures.
#[derive(Debug, Clone, Subcommand)]
pub enum BenchCommand {
    /// Latency of every hop between the processes.
    Latency(LatencyArguments),
    /// Planning speed, on programs that it makes itself, on one core.
    Plan(PlanBenchArguments),
    /// Simulation speed.
    Simulate(BenchArguments),
}

/// Arguments of `bench latency`.
#[derive(Debug, Clone, Args)]
pub struct LatencyArguments {
    /// How long to measure [s].
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds)]
    pub seconds: f64,
    /// Print each period of the drives' clock [ns], one a line, and nothing else on stdout.
    #[arg(long)]
    pub periods: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub drives: DrivesArguments,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `bench plan`.
#[derive(Debug, Clone, Args)]
pub struct PlanBenchArguments {
    /// G-code program; without it some that are made for this.
    pub job: Option<PathBuf>,
    /// Lines of the longest of these.
    #[arg(long, value_name = "COUNT", default_value_t = 1_000_000)]
    pub lines: u64,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `bench simulate`.
#[derive(Debug, Clone, Args)]
pub struct BenchArguments {
    /// Job; without it the machine's sample job.
    pub job: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    /// How long to measure [s].
    #[arg(long, value_name = "SECONDS", default_value_t = 3.0, value_parser = seconds)]
    pub seconds: f64,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `submit`.
#[derive(Debug, Clone, Args)]
pub struct SubmitArguments {
    /// Job: .ngc .nc .gcode .tap (G-code) or .toml.
    pub job: PathBuf,
    /// Change a value of the job. Can be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Run folder; without it `runs/DATE-TIME-JOB`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// Arguments of `override`.
#[derive(Debug, Clone, Args)]
pub struct OverrideArguments {
    /// Rate: "50 %" or 0.5, from 10 % to 200 %; no limit of the machine is broken for it.
    pub rate: String,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// Arguments of `domain`.
#[derive(Debug, Clone, Args)]
pub struct DomainArguments {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub drives: DrivesArguments,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// Arguments of one service; machine and drives are the domain's.
#[derive(Debug, Clone, Args)]
pub struct ServiceArguments {
    /// Name of the pipeline.
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub instance: String,
}

/// Reads by what needs are multiplied.
fn margin(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "this must be a number, such as 1.25".to_owned())?;
    if (1.0..=100.0).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{value} is not from 1, nothing in hand, to 100"))
    }
}

/// Reads a temperature of the air [°C].
fn temperature(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "this must be a number, such as 25".to_owned())?;
    if (-100.0..=200.0).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{value} °C is not from -100 °C to 200 °C"))
    }
}

/// What can be done with machine files.
#[derive(Debug, Clone, Subcommand)]
pub enum MachineCommand {
    /// Write a commented machine file to start from, with motors from catalogues, and a sample job.
    #[command(after_help = NEW_EXAMPLES)]
    New(NewArguments),
}

/// Arguments of `machine new`. What is left out is asked for on a terminal.
#[derive(Debug, Clone, Args)]
pub struct NewArguments {
    /// Kind of the machine.
    #[arg(value_parser = kinds())]
    pub kind: Kind,
    /// Name of the machine; without it that of its kind.
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
    /// Width and depth of the area, 20 mm to 2000 mm each: "300 x 200 mm".
    #[arg(long, value_name = "WIDTHxDEPTH")]
    pub area: Option<String>,
    /// Travel in z, 10 mm to 300 mm; of kinds that move in z.
    #[arg(long, value_name = "LENGTH")]
    pub z: Option<String>,
    /// Mass of the head, 0.01 kg to 20 kg.
    #[arg(long, value_name = "MASS")]
    pub head: Option<String>,
    /// Speed of the tool, 0.01 m/s to 2 m/s.
    #[arg(long, value_name = "SPEED")]
    pub speed: Option<String>,
    /// Acceleration of the tool, 0.1 m/s^2 to 50 m/s^2.
    #[arg(long, value_name = "ACCELERATION")]
    pub acceleration: Option<String>,
    /// Steppers in place of DC motors.
    #[arg(long)]
    pub steppers: bool,
    /// Catalogue of motors and gears: a .toml file, or thesis, dc, bldc, steppers or gears, which are built in.
    /// Can be repeated; without it all that are built in.
    #[arg(long, value_name = "CATALOGUE")]
    pub motors: Vec<String>,
    /// The machine file; without it KIND.toml. The sample job is written beside it, as FILE-sample.toml.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Write over files that are there.
    #[arg(long)]
    pub force: bool,
    /// Ask nothing: what is left out takes its default.
    #[arg(long)]
    pub yes: bool,
    /// Print one JSON object on stdout; nothing is asked.
    #[arg(long)]
    pub json: bool,
}

/// Reads the kind of a machine.
fn kinds() -> impl TypedValueParser<Value = Kind> {
    PossibleValuesParser::new(Kind::ALL.map(Kind::name)).try_map(|name| {
        Kind::ALL.into_iter().find(|kind| kind.name() == name).ok_or("there is no such kind")
    })
}

/// Arguments of `compare`.
#[derive(Debug, Clone, Args)]
pub struct CompareArguments {
    /// Job: .ngc .nc .gcode .tap (G-code) or .toml; without it the first machine's sample job.
    pub job: Option<PathBuf>,
    /// Machine file (.toml). Can be repeated; without any and without a job, the machines of source
    /// 003 are compared on its letters.
    #[arg(long, value_name = "FILE")]
    pub machine: Vec<PathBuf>,
    /// Change a value of the job, of all machines or of all plants, as for `simulate`. Can be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// How much a figure counts: time, error, mismatch, power, mass, footprint, stiffness or
    /// utilisation. Can be repeated.
    #[arg(long, value_name = "NAME=NUMBER")]
    pub weight: Vec<String>,
    /// Plants that are other than the machine file says, of each machine.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(0..=1000))]
    pub seeds: u64,
    /// Write a page, the figures and the pictures into this folder.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// How tables are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum TableFormat {
    /// For people, in the source's units.
    Text,
    /// Comma-separated values, in the source's units and in SI units.
    Csv,
    /// One JSON object.
    Json,
    /// A page that opens offline.
    Html,
}

/// Arguments of `tables`.
#[derive(Debug, Clone, Args)]
pub struct TablesArguments {
    /// Numbers of tables: 3-1, 3-2, 4-1, 5-1, 5-2, 5-3, 6-1, 6-2, 6-3, 7-1; without one all.
    #[arg(value_name = "NAME")]
    pub names: Vec<String>,
    /// Write a page, tables.json and a CSV file for each table into this folder; with `--format` that
    /// alone.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// How to print or write them.
    #[arg(long, value_enum)]
    pub format: Option<TableFormat>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Reads a length of time [s] that can be waited for.
fn seconds(text: &str) -> Result<f64, String> {
    /// A week.
    const LONGEST: f64 = 604_800.0;
    let value: f64 = text.parse().map_err(|_| "this must be a number of seconds".to_owned())?;
    if value > 0.0 && value <= LONGEST {
        Ok(value)
    } else {
        Err(format!("{value} s is not above 0 and at most {LONGEST} s"))
    }
}
