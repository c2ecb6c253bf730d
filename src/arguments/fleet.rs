//! Arguments of what concerns a fleet of machines.

use clap::{Args, Subcommand};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// How a machine takes part in its fleet.
#[derive(Debug, Clone, Default, PartialEq, Eq, Args, Serialize, Deserialize)]
pub struct PublishArguments {
    /// Say what this machine is doing to the NATS server of a fleet, which must have JetStream: nats://HOST:PORT, or
    /// tls://HOST:PORT for an encrypted connection.
    #[arg(long, value_name = "URL")]
    pub publish: Option<String>,
    /// The machine's name in the fleet; without it this computer's, with the instance's unless that is `default`.
    #[arg(long, value_name = "NAME", requires = "publish")]
    pub publish_as: Option<String>,
    /// The file that lets the machine in: a NATS user's (.creds), the seed of an nkey, or lines `token=…`, `user=…`,
    /// `password=…`. It must be its user's alone.
    #[arg(long, value_name = "FILE", requires = "publish")]
    pub publish_credentials: Option<PathBuf>,
    /// Certificates by which the server is known, in place of those of this computer.
    #[arg(long, value_name = "FILE", requires = "publish")]
    pub publish_ca: Option<PathBuf>,
    /// Take the jobs that the fleet has for this group, one when the machine has nothing else to do. They begin without a
    /// person at the machine.
    #[arg(long, value_name = "GROUP", requires = "publish")]
    pub jobs_of: Option<String>,
}

/// The server of a fleet.
#[derive(Debug, Clone, Args)]
pub struct FleetServer {
    /// The server: nats://HOST:PORT, or tls://HOST:PORT for an encrypted connection.
    #[arg(value_name = "URL")]
    pub server: String,
    /// The file that lets you in, as of `--publish-credentials`.
    #[arg(long, value_name = "FILE")]
    pub credentials: Option<PathBuf>,
    /// Certificates by which the server is known, in place of those of this computer.
    #[arg(long, value_name = "FILE")]
    pub ca: Option<PathBuf>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// What can be done with a fleet.
#[derive(Debug, Clone, Subcommand)]
pub enum FleetCommand {
    /// Hand a job to the machines of a group; the first that has nothing else to do takes it.
    Submit(FleetSubmitArguments),
    /// Say what all machines are doing, which jobs wait, and what has become of the newest.
    Status(FleetStatusArguments),
}

/// Arguments of `fleet submit`.
#[derive(Debug, Clone, Args)]
pub struct FleetSubmitArguments {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub server: FleetServer,
    /// Job: one file with all that it needs.
    pub job: PathBuf,
    /// The group of machines.
    #[arg(long, value_name = "GROUP")]
    pub group: String,
    /// Change a value of the job. Can be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

/// Arguments of `fleet status`.
#[derive(Debug, Clone, Args)]
pub struct FleetStatusArguments {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub server: FleetServer,
}

/// Arguments of the service `monitor`; machine and drives are the domain's.
#[derive(Debug, Clone, Args)]
pub struct MonitorArguments {
    /// Name of the pipeline.
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub instance: String,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub publish: PublishArguments,
}
