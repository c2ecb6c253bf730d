//! The faults of an instance, of now and of before.

use super::operator::send_checked;
use crate::arguments::InstanceArguments;
use crate::exit::{Exit, Failure};
use crate::output::{self, say};
use crate::pipeline::fault_history;
use monitor::run_folder::local_time;
use operator::PastFault;
use operator::Request;
use runtime::Instance;
use runtime::socket::{ANSWER_PATIENCE, OperatorClient};
use serde::Serialize;
use std::path::PathBuf;

/// The faults of an instance, as `graver faults --json` prints them.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct FaultsReport {
    /// Where they are kept; null where they are not, and a pipeline knows those since its start.
    pub file: Option<String>,
    /// The faults, the oldest first.
    pub faults: Vec<PastFault>,
}

/// Says what faults there were, whether or not the pipeline runs.
///
/// # Errors
/// A file that cannot be read.
pub fn run(arguments: &InstanceArguments) -> Result<Exit, Failure> {
    let report = report(arguments)?;
    if arguments.json {
        output::json(&report)?;
        return Ok(Exit::Done);
    }
    for fault in &report.faults {
        say!("{}", line(fault));
    }
    if report.faults.is_empty() {
        say!("no faults");
    }
    Ok(Exit::Done)
}

/// A fault in one line.
pub(super) fn line(fault: &PastFault) -> String {
    let job = fault.job.as_ref().map(|job| format!(" (job {job})")).unwrap_or_default();
    format!("{}  {}{job}", local_time(fault.time), fault.detail)
}

fn report(arguments: &InstanceArguments) -> Result<FaultsReport, Failure> {
    let instance = Instance::new(&arguments.instance).map_err(Failure::bad_input)?;
    // A pipeline that runs knows best where it keeps them.
    let file = match OperatorClient::connect(&instance) {
        Ok(mut client) => {
            let status = send_checked(&Request::Status, &mut client, ANSWER_PATIENCE)?;
            match status["faults_file"].as_str() {
                Some(file) => Some(PathBuf::from(file)),
                None => {
                    let faults = serde_json::from_value(status["faults"].clone());
                    let faults = faults.map_err(Failure::service)?;
                    return Ok(FaultsReport { file: None, faults });
                }
            }
        }
        Err(_) => fault_history::path(instance.name()),
    };
    let faults = file.as_deref().map(fault_history::read).transpose();
    let faults = faults.map_err(|error| {
        let file = file.as_deref().unwrap_or(std::path::Path::new(""));
        Failure::output(format!("{}: cannot be read: {error}", file.display()))
    })?;
    let file = file.map(|file| file.display().to_string());
    Ok(FaultsReport { file, faults: faults.unwrap_or_default() })
}
