//! Arguments of the benchmarks.

use super::{DrivesArguments, MachineArguments, seconds};
use clap::{Args, Subcommand};
use std::path::PathBuf;

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
    /// Period of the control cycle, such as "250 us", in place of the machine file's.
    #[arg(long, value_name = "TIME", conflicts_with = "rates")]
    pub period: Option<String>,
    /// Measure 250 Hz, 500 Hz, 1, 2, 4 and 8 kHz, one after the other, for that long each.
    #[arg(long, conflicts_with = "periods")]
    pub rates: bool,
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
