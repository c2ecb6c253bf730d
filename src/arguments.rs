//! The command line.

use crate::exit::EXIT_CODES;
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Real-time motion controller for laser marking and engraving machines.
#[derive(Debug, Parser)]
#[command(name = "graver", version, after_help = EXIT_CODES, propagate_version = true)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What can be done.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a job in real time: planner, controller, drives and monitor as processes.
    Run(RunArguments),
    /// Run the same stages in one process in virtual time, bit for bit repeatable.
    Simulate(SimulateArguments),
    /// Plan a job without running it.
    Plan(PlanArguments),
    /// Say whether a machine file and a job are sound.
    Check(CheckArguments),
    /// Kinematics and dynamics: JSON lines in, JSON lines out.
    Kinematics(KinematicsArguments),
    /// Measure this PC.
    #[command(subcommand)]
    Bench(BenchCommand),
    /// Hand a job to a running pipeline and follow it.
    Submit(SubmitArguments),
    /// Feed hold: laser off, to rest along the path.
    Hold(InstanceArguments),
    /// Go on from a hold without losing or doubling a mark.
    Resume(InstanceArguments),
    /// Play the job at another rate.
    Override(OverrideArguments),
    /// Give the job up: laser off, to rest along the path.
    Stop(InstanceArguments),
    /// Clear a latched fault.
    Reset(InstanceArguments),
    /// Power the motors.
    Enable(InstanceArguments),
    /// Unpower the motors.
    Disable(InstanceArguments),
    /// Say what a running pipeline is doing.
    Status(InstanceArguments),
    /// Create and hold an instance's channels; the four services run below it.
    Domain(DomainArguments),
    /// The planner service.
    Planner(ServiceArguments),
    /// The controller service.
    Controller(ServiceArguments),
    /// The drives service.
    Drives(ServiceArguments),
    /// The monitor service.
    Monitor(ServiceArguments),
    /// Hold a summary to what must be true of every one; for scripts.
    #[command(hide = true)]
    VerifySummary {
        /// The summary.
        file: PathBuf,
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

/// The machine and the changes to it.
#[derive(Debug, Clone, Args)]
pub struct MachineArguments {
    /// Machine file; without it a built-in CoreXY.
    #[arg(long, value_name = "FILE")]
    pub machine: Option<PathBuf>,
    /// Change a value: `letters.text=S`, `machine.path.jerk="5000 m/s^3"`, or `plant.…` for the
    /// simulated plant alone. Can be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

/// Which running pipeline is meant.
#[derive(Debug, Clone, Args)]
pub struct InstanceArguments {
    /// Name of the pipeline.
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
    /// Let no deadline slip, as on hardware: a late command closes the gate.
    #[arg(long)]
    pub strict: bool,
    /// CPU for controller and drives; without it the last one.
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
    /// Seed of the simulation's random numbers; the nominal plant draws none.
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
    /// Check the path limits only, as if motors were ideal.
    #[arg(long)]
    pub ideal: bool,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `check`.
#[derive(Debug, Clone, Args)]
pub struct CheckArguments {
    /// Job to check on the machine.
    pub job: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
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
    /// Velocity and force ellipses.
    Ellipse,
}

/// What `bench` measures.
#[derive(Debug, Clone, Subcommand)]
pub enum BenchCommand {
    /// Latency of every hop between the processes.
    Latency(LatencyArguments),
    /// Planning speed.
    Plan(BenchArguments),
    /// Simulation speed.
    Simulate(BenchArguments),
}

/// Arguments of `bench latency`.
#[derive(Debug, Clone, Args)]
pub struct LatencyArguments {
    /// How long to measure [s].
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0)]
    pub seconds: f64,
    /// Print each period of the drives' clock [ns], one a line, and nothing else.
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

/// Arguments of the other benchmarks.
#[derive(Debug, Clone, Args)]
pub struct BenchArguments {
    /// Job; without it the machine's sample job.
    pub job: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    /// How long to measure [s].
    #[arg(long, value_name = "SECONDS", default_value_t = 3.0)]
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
    /// Rate: `50 %` or `0.5`, between 10 % and 200 %; limits cap it.
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
