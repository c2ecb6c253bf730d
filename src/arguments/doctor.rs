//! Arguments of `doctor`.

use clap::Args;
use std::path::PathBuf;

/// Arguments of `doctor`.
#[derive(Debug, Clone, Args)]
pub struct DoctorArguments {
    /// Machine file (.toml): its network card is examined too, and wake-ups are measured at its period.
    #[arg(long, value_name = "FILE")]
    pub machine: Option<PathBuf>,
    /// CPU for controller and drives; without it the last one, as `run` takes.
    #[arg(long, value_name = "CPU")]
    pub core: Option<usize>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
    /// Examine the files of another computer, with its /proc and /sys below this folder.
    #[arg(long, value_name = "DIR", default_value = "/", hide = true)]
    pub root: PathBuf,
}
