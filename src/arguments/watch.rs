//! Arguments of `watch`.

use clap::Args;

/// Arguments of `watch`.
#[derive(Debug, Clone, Args)]
pub struct WatchArguments {
    /// Name of the pipeline.
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub instance: String,
}
