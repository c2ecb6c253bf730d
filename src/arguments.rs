//! The command line.

mod bench;
mod doctor;
mod examples;
mod fleet;
mod offset;
mod operating;
mod options;
mod pipeline;
mod planning;
mod queue;
mod serve;
#[cfg(feature = "watch")]
mod watch;
mod workbench;

pub use self::workbench::{
    CalibrateArguments, CalibratePart, CompareArguments, FiguresArguments, MachineCommand,
    NewArguments, ProfileArguments, SizeArguments, SizeGears, SizeOrder, TableFormat,
    TablesArguments,
};
pub use bench::{BenchArguments, BenchCommand, LatencyArguments, PlanBenchArguments};
pub use doctor::DoctorArguments;
pub use fleet::{
    FleetCommand, FleetServer, FleetStatusArguments, FleetSubmitArguments, MonitorArguments,
    PublishArguments,
};
pub use offset::{OffsetArguments, OffsetClearArguments, OffsetCommand, OffsetPlace};
pub use operating::{
    HomeArguments, InputArguments, InputLevel, JogArguments, OutputArguments, ProbeArguments,
    TestPulseArguments,
};
pub use options::JobOptions;
pub use pipeline::{
    DomainArguments, DrivesArguments, DrivesKind, OverrideArguments, PipelineArguments,
    QuotaArguments, RecordArguments, RecordLevel, RunArguments, ServiceArguments,
    SimulateArguments, StatusArguments, SubmitArguments,
};
pub use planning::{
    CheckArguments, ExportArguments, ExportFormat, KinematicsArguments, KinematicsVerb,
    PlanArguments, ProfileName, ReplayArguments,
};

pub use queue::{QueueCommand, QueueJobArguments, QueueMoveArguments};
pub use serve::{AccessArguments, ServeArguments};
#[cfg(feature = "watch")]
pub use watch::WatchArguments;

use crate::exit;
use clap::{Args, Parser, Subcommand, ValueEnum};
use examples::{
    CALIBRATE_EXAMPLES, CHECK_EXAMPLES, COMPARE_EXAMPLES, DOCTOR_EXAMPLES, EXPORT_EXAMPLES,
    FIGURES_EXAMPLES, KINEMATICS_EXAMPLES, PLAN_EXAMPLES, QUEUE_EXAMPLES, REPLAY_EXAMPLES,
    RUN_EXAMPLES, SERVE_EXAMPLES, SERVICES, SIMULATE_EXAMPLES, SIZE_EXAMPLES, SUBMIT_EXAMPLES,
    TABLES_EXAMPLES,
};
use std::path::PathBuf;

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
    /// Write the recording of a run as comma-separated values, or as one MCAP file.
    #[command(after_help = EXPORT_EXAMPLES)]
    Export(ExportArguments),
    /// Feed the stages with a recorded simulation, and compare their outputs bit for bit.
    #[command(after_help = REPLAY_EXAMPLES)]
    Replay(ReplayArguments),
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
    /// Say whether this PC is fit for real time, and what to change.
    #[command(after_help = DOCTOR_EXAMPLES)]
    Doctor(DoctorArguments),
    /// Hand a job to a pipeline that `graver domain` holds, and follow it to its end.
    #[command(after_help = SUBMIT_EXAMPLES)]
    Submit(SubmitArguments),
    /// The jobs of a pipeline: list, cancel, move, repeat, and begin those that wait.
    #[command(subcommand, after_help = QUEUE_EXAMPLES)]
    Queue(QueueCommand),
    /// Feed hold: laser off at once, then to rest along the path.
    Hold(InstanceArguments),
    /// Go on from a hold without losing or doubling a mark.
    Resume(InstanceArguments),
    /// Play the job at another rate, or with another power.
    Override(OverrideArguments),
    /// Give the job up: laser off at once, then to rest along the path.
    Stop(InstanceArguments),
    /// Clear a latched fault; the motors stay unpowered until `enable`.
    Reset(InstanceArguments),
    /// Power the motors; `run` and `submit` do so themselves.
    Enable(InstanceArguments),
    /// Unpower the motors, which must be at rest.
    Disable(InstanceArguments),
    /// Find the references of the axes, and go home.
    Home(HomeArguments),
    /// Move an axis by a distance, or on until Ctrl-C.
    Jog(JogArguments),
    /// Light the laser for a moment, weak and short.
    TestPulse(TestPulseArguments),
    /// Move an axis until the probe touches, and say where.
    Probe(ProbeArguments),
    /// Set an input of a simulated machine, such as its door.
    Input(InputArguments),
    /// Switch an output that a job could switch, such as the air assist.
    Output(OutputArguments),
    /// Set, clear and list offsets: origins of work coordinate systems, and of the tool.
    #[command(subcommand)]
    Offset(OffsetCommand),
    /// Say what a running pipeline is doing, with the process ids of its services.
    Status(StatusArguments),
    /// Show a running pipeline in the terminal, live, and operate it by keys.
    #[cfg(feature = "watch")]
    #[command(after_help = examples::WATCH_EXAMPLES)]
    Watch(WatchArguments),
    /// Say what faults an instance had, also before its start, whether or not it runs.
    Faults(InstanceArguments),
    /// Compare machines on the same job: time, error, what their motors must give, stiffness, and who
    /// comes first.
    #[command(after_help = COMPARE_EXAMPLES)]
    Compare(CompareArguments),
    /// The tables of the sources: as printed, with the errata applied, and as modelled.
    #[command(after_help = TABLES_EXAMPLES)]
    Tables(TablesArguments),
    /// Create and hold an instance's channels, start its services or wait for those that somebody else
    /// starts, and run the jobs that are submitted.
    #[command(after_help = SERVICES)]
    Domain(DomainArguments),
    /// Let people and programs in beside the command line: live page, HTTP, metrics, and grbl 1.1.
    #[command(after_help = SERVE_EXAMPLES)]
    Serve(ServeArguments),
    /// Many machines on one NATS server: jobs for a group of them, and how all of them are.
    #[command(subcommand, after_help = examples::FLEET_EXAMPLES)]
    Fleet(FleetCommand),
    /// The planner service: reads, plans and checks a job, and streams its setpoints.
    Planner(ServiceArguments),
    /// The controller service: plays the setpoints and closes the loops.
    Controller(ServiceArguments),
    /// The drives service: the clock, the port to the motors, and the watchdog.
    Drives(ServiceArguments),
    /// The monitor service: records and measures; nobody waits for it.
    Monitor(MonitorArguments),
    /// The Modbus service: asks chiller, extraction and source of the machine file, and switches its outputs there; for a
    /// build with the feature `modbus`.
    Modbus(ServiceArguments),
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
