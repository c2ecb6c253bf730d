//! Arguments of what operates a machine by hand.

use super::InstanceArguments;
use clap::{Args, ValueEnum};

/// Arguments of `home`.
#[derive(Debug, Clone, Args)]
pub struct HomeArguments {
    /// Axes by name; all that have to be homed when none is named.
    pub axes: Vec<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// Arguments of `jog`.
#[derive(Debug, Clone, Args)]
pub struct JogArguments {
    /// The axis.
    pub axis: String,
    /// How far, such as "10 mm" or "-5 deg"; without it the axis goes on until Ctrl-C.
    #[arg(allow_hyphen_values = true)]
    pub distance: Option<String>,
    /// How fast, such as "20 mm/s"; with a sign where there is no distance.
    #[arg(long, allow_hyphen_values = true)]
    pub speed: String,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// Arguments of `test-pulse`.
#[derive(Debug, Clone, Args)]
pub struct TestPulseArguments {
    /// Power: "5 %" or 0.05, at most the machine's `safety.test_power`.
    pub power: String,
    /// For how long, such as "10 ms", at most the machine's `safety.test_time`.
    pub time: String,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// Arguments of `probe`.
#[derive(Debug, Clone, Args)]
pub struct ProbeArguments {
    /// The axis.
    pub axis: String,
    /// How far at most, such as "-10 mm".
    #[arg(allow_hyphen_values = true)]
    pub distance: String,
    /// How fast, such as "2 mm/s".
    #[arg(long)]
    pub speed: String,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// Arguments of `input`.
#[derive(Debug, Clone, Args)]
pub struct InputArguments {
    /// The input's name in the machine file.
    pub name: String,
    /// Whether it is active.
    pub level: InputLevel,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// Arguments of `output`.
#[derive(Debug, Clone, Args)]
pub struct OutputArguments {
    /// The output's name in the machine file.
    pub name: String,
    /// Whether it is on.
    pub level: InputLevel,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// Whether an input is active, or an output on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum InputLevel {
    /// It is.
    On,
    /// It is not.
    Off,
}
