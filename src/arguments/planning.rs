//! Arguments of what plans, checks and reads.

use super::{JobOptions, MachineArguments};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Arguments of `plan`.
#[derive(Debug, Clone, Args)]
pub struct PlanArguments {
    /// Job: G-code, a drawing (.svg .dxf .lbrn2 .plt …), an image or a job file (.toml);
    /// without it the machine's sample job.
    pub job: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub options: JobOptions,
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
    /// Write what is marked, by power, and the ways in the dark to an SVG drawing in mm, or what is
    /// marked to a JSON file; the name's end says which. "-" prints the drawing on stdout. It is written
    /// before anything is planned, also of a job that is refused then.
    #[arg(long, value_name = "FILE.svg|FILE.json")]
    pub preview: Option<PathBuf>,
    /// Plan nothing: read the job and write the preview alone.
    #[arg(long, requires = "preview")]
    pub preview_only: bool,
    /// Plan within the limits of the path only, as if the motors had no limits.
    #[arg(long)]
    pub ideal: bool,
    /// Also time the job by a speed profile of the sources, for comparison; needs --ideal. --samples,
    /// --pulses and --pulse-path then write the motion of that profile.
    #[arg(long, value_enum)]
    pub profile: Option<ProfileName>,
    /// Open only files below the job's own folder, by relative paths without `..` and symbolic links: for a job
    /// that a stranger may have sent.
    #[arg(long)]
    pub confined: bool,
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
    #[command(flatten)]
    #[allow(missing_docs)]
    pub options: JobOptions,
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

/// What `export` writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ExportFormat {
    /// Comma-separated values, a line a cycle.
    Csv,
    /// One MCAP file, all parts of the recording in it.
    Mcap,
}

/// Arguments of `replay`.
#[derive(Debug, Clone, Args)]
pub struct ReplayArguments {
    /// Run folder, or its `samples.mcap`.
    #[arg(value_name = "RECORDING")]
    pub recording: PathBuf,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `export`.
#[derive(Debug, Clone, Args)]
pub struct ExportArguments {
    /// Run folder, or a recording: `samples.mcap`, or `samples.bin` of an earlier version.
    #[arg(value_name = "RUN_FOLDER")]
    pub recording: PathBuf,
    /// What to write.
    #[arg(long, value_enum, default_value = "csv")]
    pub format: ExportFormat,
    /// Write to this file; without it to stdout.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}
