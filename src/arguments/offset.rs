//! Arguments of `offset`.

use super::InstanceArguments;
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// What is done with the offsets of a machine.
#[derive(Debug, Subcommand)]
pub enum OffsetCommand {
    /// Say what the offsets are.
    List(OffsetPlace),
    /// Put the origin of a work coordinate system, or the tool's offset, somewhere.
    Set(OffsetArguments),
    /// Put the origin where the tool is now, or so that the tool is at these coordinates.
    Here(OffsetArguments),
    /// Take an origin, or the tool's offset, back: the machine file decides again.
    Clear(OffsetClearArguments),
}

/// Whose offsets.
#[derive(Debug, Clone, Args)]
pub struct OffsetPlace {
    /// The machine file; without it that of the running pipeline.
    #[arg(long, value_name = "FILE")]
    pub machine: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// Arguments of `offset set` and `offset here`.
#[derive(Debug, Clone, Args)]
pub struct OffsetArguments {
    /// g54 to g59, g59.1 to g59.3, or tool.
    pub system: String,
    /// X, such as "10 mm".
    #[arg(long, allow_hyphen_values = true)]
    pub x: Option<String>,
    /// Y.
    #[arg(long, allow_hyphen_values = true)]
    pub y: Option<String>,
    /// Z.
    #[arg(long, allow_hyphen_values = true)]
    pub z: Option<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub place: OffsetPlace,
}

/// Arguments of `offset clear`.
#[derive(Debug, Clone, Args)]
pub struct OffsetClearArguments {
    /// g54 to g59, g59.1 to g59.3, tool, or all.
    pub system: String,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub place: OffsetPlace,
}
