//! Arguments of what runs a job: as processes, in one process, and by services.

use super::{AccessArguments, InstanceArguments, JobOptions, MachineArguments, PublishArguments};
use clap::{Args, ValueEnum};
use monitor::recording::file::parts::Extent;
use monitor::recording::level::Level;
use std::path::PathBuf;

/// What the drives are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DrivesKind {
    /// What the machine file says; the simulated plant where it says nothing.
    Machine,
    /// The simulated plant, whatever the machine file says.
    Sim,
}

/// How the drives keep time.
#[derive(Debug, Clone, Args)]
pub struct DrivesArguments {
    /// What to drive.
    #[arg(long, value_enum, default_value = "machine")]
    pub drives: DrivesKind,
    /// Let no deadline slip, as on hardware: a command later than 0.3 of the period closes the gate for that
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

/// How much is recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RecordLevel {
    /// Nothing.
    Off,
    /// What happens: states, faults, strokes, inputs, outputs, gaps.
    Events,
    /// That, and a hundred cycles a second.
    Decimated,
    /// Every cycle.
    Full,
}

/// What stays of the recording.
#[derive(Debug, Clone, Args)]
pub struct RecordArguments {
    /// What stays of the recording once the run has been judged, by all of its cycles.
    #[arg(long, value_enum, value_name = "LEVEL", default_value = "full")]
    pub record: RecordLevel,
}

impl RecordArguments {
    /// The level.
    pub fn level(&self) -> Level {
        match self.record {
            RecordLevel::Off => Level::Off,
            RecordLevel::Events => Level::Events,
            RecordLevel::Decimated => Level::Decimated,
            RecordLevel::Full => Level::Full,
        }
    }
}

/// How large a recording may grow.
#[derive(Debug, Clone, Args)]
pub struct QuotaArguments {
    /// How large a recording may grow, such as "2 GB"; its oldest part makes room, and what was marked in that is not judged.
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub record_quota: Option<u64>,
}

/// Bytes, such as "500 MB" or "2 GB".
fn size(text: &str) -> Result<u64, String> {
    let wrong = || format!("{text:?} is no size: such as \"500 MB\" or \"2 GB\"");
    let split = text.find(|character: char| character.is_alphabetic()).ok_or_else(wrong)?;
    let (number, unit) = text.split_at(split);
    let unit = match unit.trim() {
        "MB" => 1_000_000,
        "GB" => 1_000_000_000,
        _ => return Err(wrong()),
    };
    let bytes = number.trim().parse::<u64>().ok().and_then(|number| number.checked_mul(unit));
    bytes.filter(|bytes| *bytes > 0).ok_or_else(wrong)
}

/// Arguments of whatever is a pipeline: its machine, its drives, what is recorded, and who may speak to it.
#[derive(Debug, Clone, Args)]
pub struct PipelineArguments {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub drives: DrivesArguments,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub record: RecordArguments,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub quota: QuotaArguments,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub access: AccessArguments,
}

impl PipelineArguments {
    /// How much is recorded, and how large that may grow.
    pub fn extent(&self) -> Extent {
        Extent { level: self.record.level(), quota: self.quota.record_quota }
    }
}

/// Arguments of `run`.
#[derive(Debug, Clone, Args)]
pub struct RunArguments {
    /// Job: G-code, a drawing (.svg .dxf .lbrn2 .plt …), an image or a job file (.toml);
    /// without it the machine's sample job.
    pub job: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub options: JobOptions,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub pipeline: PipelineArguments,
    /// Run folder; without it `runs/DATE-TIME-JOB`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Find the references of axes that have to be homed, before the job; without it such a machine refuses it.
    #[arg(long)]
    pub home: bool,
}

/// Arguments of `simulate`.
#[derive(Debug, Clone, Args)]
pub struct SimulateArguments {
    /// Job: G-code, a drawing (.svg .dxf .lbrn2 .plt …), an image or a job file (.toml);
    /// without it the machine's sample job.
    pub job: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub machine: MachineArguments,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub options: JobOptions,
    /// Run folder; without it nothing is written.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Where the encoders' counts lie: 0 puts the start on a count, other seeds between two.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub record: RecordArguments,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `submit`.
#[derive(Debug, Clone, Args)]
pub struct SubmitArguments {
    /// Job: G-code, a drawing (.svg .dxf .lbrn2 .plt …), an image or a job file (.toml).
    pub job: PathBuf,
    /// Change a value of the job. Can be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub options: JobOptions,
    /// Run folder; without it `runs/DATE-TIME-JOB`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Do not follow the job: say its number as soon as it waits. It outlives this terminal; `graver queue` and
    /// `graver status` tell of it.
    #[arg(long)]
    pub detach: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// Arguments of `status`.
#[derive(Debug, Clone, Args)]
pub struct StatusArguments {
    /// Go on until Ctrl-C or the end of the pipeline: one line that is drawn again, or with --json an object a line,
    /// twice a second.
    #[arg(long)]
    pub watch: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// Arguments of `override`.
#[derive(Debug, Clone, Args)]
pub struct OverrideArguments {
    /// Rate: "50 %" or 0.5, from 10 % to 200 %; no limit of the machine is broken for it.
    #[arg(required_unless_present_any = ["power", "rapid"])]
    pub rate: Option<String>,
    /// Power: "80 %" or 0.8 of what the job asks for, from 10 % to 200 %, never above full power; 100 % again when
    /// the job ends.
    #[arg(long, value_name = "POWER")]
    pub power: Option<String>,
    /// Rate of what is flown between marks: "25 %" or 0.25, from 10 % to 100 %.
    #[arg(long, value_name = "RATE")]
    pub rapid: Option<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// Arguments of `domain`.
#[derive(Debug, Clone, Args)]
pub struct DomainArguments {
    /// Start the four services too, as `run` does; without it somebody else starts them, such as systemd.
    #[arg(long)]
    pub services: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub publish: PublishArguments,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub pipeline: PipelineArguments,
}

/// Arguments of one service; machine and drives are the domain's.
#[derive(Debug, Clone, Args)]
pub struct ServiceArguments {
    /// Name of the pipeline.
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub instance: String,
}
