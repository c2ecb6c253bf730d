//! The summary of a run: what `run` and `simulate` print and keep as `summary.json`.
//!
//! The names and their meaning are what users' scripts rely on; further keys may be added.
//! SI units and radians, latencies in nanoseconds.

pub mod drives;
pub mod fault;
pub mod left;
mod place;
pub mod stalls;
pub mod text;

use crate::latency::HopLatency;
use crate::marks::Marks;
use crate::recording::continuity::RecordingSummary;
use messages::plan::{Binding, LayerFacts};
use messages::{ControllerReport, RealtimeFacts};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

pub use drives::{DrivesSummary, LinkSummary};
pub use fault::FaultSummary;
pub use left::LeftSummary;
pub use place::JobPlace;
pub use stalls::StallSummary;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The job was played to its end.
    Completed,
    /// A person stopped it.
    Stopped,
    /// A fault stopped the machine.
    Faulted,
    /// The arguments, the machine file or the job were refused, before anything moved.
    Refused,
    /// A service could not start or died, or the instance was in use.
    Aborted,
}

impl Outcome {
    /// The name in the summary.
    pub fn name(self) -> &'static str {
        match self {
            Self::Completed => "completed",
            Self::Stopped => "stopped",
            Self::Faulted => "faulted",
            Self::Refused => "refused",
            Self::Aborted => "aborted",
        }
    }
}

/// Everything to say about one run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Summary {
    /// How it ended.
    pub outcome: Outcome,
    /// The fault that stopped the machine.
    pub fault: Option<FaultSummary>,
    /// What was refused, or why it was aborted.
    pub error: Option<ErrorSummary>,
    /// Where the job was; null of one that was completed, and where it is not known.
    #[serde(default)]
    pub place: Option<JobPlace>,
    /// All that is wrong, `error` the first of it.
    #[serde(default)]
    pub errors: Vec<ErrorSummary>,
    /// The job.
    pub job: JobSummary,
    /// The machine.
    pub machine: MachineSummary,
    /// What drove the motors.
    #[serde(default)]
    pub drives: DrivesSummary,
    /// Duration of the motion, first to last [s].
    pub time: f64,
    /// Wall time of the whole command [s].
    pub wall: f64,
    /// `time` over the wall time of the stepping loop; null in real time.
    pub realtime_factor: Option<f64>,
    /// What was left of the job when it ended, as planned or estimated [s]; 0 of one that was completed.
    #[serde(default)]
    pub time_left: f64,
    /// Time from job offer to the first setpoint [s].
    pub plan_time: f64,
    /// Time to judge the marks and write the run folder [s].
    pub report_time: f64,
    /// What was marked; null when nothing of it was recorded.
    pub marks: Option<Marks>,
    /// What of the job was not due yet when it ended, and where to go on; null of a job that was played to its end,
    /// or whose marks are not judged.
    #[serde(default)]
    pub left: Option<LeftSummary>,
    /// How complete the recording is; null without one.
    pub recording: Option<RecordingSummary>,
    /// Setpoint minus feedback at the motors.
    pub following_error: FollowingError,
    /// The largest share of each limit used, as planned.
    pub limits: LimitUse,
    /// Least and greatest override of the power while the laser was lit: so many times what the job asks for.
    #[serde(default = "no_override")]
    pub power_override: [f64; 2],
    /// What bound the motion as planned, the limit that ruled longest first.
    #[serde(default)]
    pub binding: Vec<Binding>,
    /// Control cycles from the first setpoint to the last.
    pub cycles: u64,
    /// Cycles whose work did not end before the next deadline, slips and skipped cycles included.
    pub overruns: u64,
    /// Times in which the control cycle stood still.
    #[serde(default)]
    pub stalls: StallSummary,
    /// Latencies by hop; empty in virtual time.
    pub latency: BTreeMap<String, HopLatency>,
    /// Real-time set-up of the processes.
    pub realtime: Realtime,
    /// Hash over what the commands meant, in hexadecimal.
    pub digest: String,
    /// The run folder; null when none was written.
    pub out: Option<String>,
    /// What a person should know, each said once.
    #[serde(default)]
    pub warnings: Vec<String>,
}

fn no_override() -> [f64; 2] {
    [1.0; 2]
}

/// An error in a file, or of a service.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ErrorSummary {
    /// The file at fault; null when it is none.
    pub file: Option<String>,
    /// Line from 1.
    pub line: Option<u64>,
    /// Column from 1.
    pub column: Option<u64>,
    /// What is wrong, and what would be right.
    pub message: String,
}

impl std::fmt::Display for ErrorSummary {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(file) = &self.file {
            write!(formatter, "{file}:")?;
            for number in [self.line, self.column].into_iter().map_while(|it| it) {
                write!(formatter, "{number}:")?;
            }
            write!(formatter, " ")?;
        }
        write!(formatter, "{}", self.message)
    }
}

/// The job of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JobSummary {
    /// Its name.
    pub name: String,
    /// Strokes to mark.
    pub strokes: u64,
    /// Length to mark [m].
    pub length: f64,
    /// Whether it was a dry run: the whole motion, and nothing lit.
    #[serde(default)]
    pub dry_run: bool,
    /// The layers of a drawing in the order of marking.
    #[serde(default)]
    pub layers: Vec<LayerFacts>,
}

/// The machine of a run.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct MachineSummary {
    /// Its name.
    pub name: String,
    /// The kind of mechanism, such as `corexy`.
    pub mechanism: String,
    /// The axes' names, in the order of every per-axis list here.
    pub axes: Vec<String>,
    /// The actuators' names, in the order of every per-actuator list here: those of their axes, but where
    /// an axis has several.
    pub actuators: Vec<String>,
}

/// |Setpoint − feedback| per actuator, at the motor [rad].
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FollowingError {
    /// The largest.
    pub max: Vec<f64>,
    /// The root mean square.
    pub rms: Vec<f64>,
}

/// Largest value used over limit; 1 is at the limit.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LimitUse {
    /// Joint velocity per axis.
    pub velocity: Vec<f64>,
    /// Joint acceleration per axis.
    pub acceleration: Vec<f64>,
    /// Joint jerk per axis.
    pub jerk: Vec<f64>,
    /// Commanded motor current per actuator.
    pub effort: Vec<f64>,
    /// Acceleration along and across the path together.
    pub path_acceleration: f64,
    /// Jerk along and across the path together.
    pub path_jerk: f64,
}

/// The real-time set-up that a run really had.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Realtime {
    /// `fifo`, `other`, or `virtual` when there was no clock.
    pub scheduler: String,
    /// Priority of the controller's thread, 0 without SCHED_FIFO.
    pub priority: u32,
    /// CPU that each process was pinned to; those that were not are absent.
    pub cores: BTreeMap<String, u32>,
    /// Whether the memory of controller and drives was locked.
    pub locked: bool,
    /// What is missing for real time, and how to get it.
    pub warnings: Vec<String>,
}

impl Realtime {
    /// The set-up as the controller and drives report it.
    pub fn of(controller: &RealtimeFacts, drives: &RealtimeFacts, warnings: Vec<String>) -> Self {
        let fifo = controller.fifo != 0 && drives.fifo != 0;
        let cores = [("controller", controller.core), ("drives", drives.core)]
            .into_iter()
            .filter_map(|(name, core)| Some((name.to_owned(), u32::try_from(core).ok()?)))
            .collect();
        Self {
            scheduler: if fifo { "fifo" } else { "other" }.to_owned(),
            priority: if fifo { controller.priority } else { 0 },
            cores,
            locked: controller.locked != 0 && drives.locked != 0,
            warnings,
        }
    }

    /// The set-up of a run in virtual time.
    pub fn in_virtual_time() -> Self {
        Self { scheduler: "virtual".to_owned(), ..Self::default() }
    }
}

impl Summary {
    /// A summary of nothing yet, for a job and a machine.
    pub fn new(outcome: Outcome, job: JobSummary, machine: MachineSummary) -> Self {
        Self {
            outcome,
            fault: None,
            error: None,
            place: None,
            errors: Vec::new(),
            job,
            machine,
            drives: DrivesSummary::default(),
            time: 0.0,
            wall: 0.0,
            realtime_factor: None,
            time_left: 0.0,
            plan_time: 0.0,
            report_time: 0.0,
            marks: None,
            left: None,
            recording: None,
            following_error: FollowingError::default(),
            limits: LimitUse::default(),
            power_override: no_override(),
            binding: Vec::new(),
            cycles: 0,
            overruns: 0,
            stalls: StallSummary::default(),
            latency: BTreeMap::new(),
            realtime: Realtime::default(),
            digest: String::new(),
            out: None,
            warnings: Vec::new(),
        }
    }

    /// Takes over what the controller counted: cycles, digest, limits and following error. Uses
    /// axes and actuators of `machine`, which must be set.
    pub fn take_controller(&mut self, report: &ControllerReport) {
        let first = |values: &[f64], names: &[String]| -> Vec<f64> {
            values.iter().take(names.len()).copied().collect()
        };
        let MachineSummary { axes, actuators, .. } = &self.machine;
        let squares = report.following_error_squares;
        let count = report.count.max(1) as f64;
        self.cycles = report.cycles;
        if report.power_override[1] > 0.0 {
            self.power_override = report.power_override;
        }
        self.digest = format!("{:016x}", report.digest);
        self.following_error = FollowingError {
            max: first(&report.following_error_max, actuators),
            rms: first(&squares.map(|squares| (squares / count).sqrt()), actuators),
        };
        self.limits = LimitUse {
            velocity: first(&report.velocity_use, axes),
            acceleration: first(&report.acceleration_use, axes),
            jerk: first(&report.jerk_use, axes),
            effort: first(&report.effort_use, actuators),
            path_acceleration: report.path_acceleration_use,
            path_jerk: report.path_jerk_use,
        };
    }

    /// The JSON schema of the summary, as committed in `docs/schema/summary.json`.
    pub fn schema() -> schemars::Schema {
        schemars::schema_for!(Summary)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn summary() -> Summary {
        let machine = MachineSummary {
            name: "corexy".into(),
            mechanism: "corexy".into(),
            axes: vec!["a".into(), "b".into()],
            actuators: vec!["a".into(), "b".into()],
        };
        Summary::new(Outcome::Completed, JobSummary::default(), machine)
    }

    /// The keys that the command line promises.
    #[test]
    fn every_promised_key_is_there() {
        let json = serde_json::to_value(summary()).unwrap();
        for key in [
            "outcome",
            "fault",
            "error",
            "job",
            "machine",
            "drives",
            "time",
            "wall",
            "realtime_factor",
            "plan_time",
            "report_time",
            "marks",
            "recording",
            "following_error",
            "limits",
            "cycles",
            "overruns",
            "stalls",
            "latency",
            "realtime",
            "digest",
            "out",
        ] {
            assert!(json.get(key).is_some(), "{key}");
        }
        assert_eq!(json["outcome"], "completed");
        let parsed: Summary = serde_json::from_value(json).unwrap();
        assert_eq!(parsed, summary());
    }

    /// `GRAVER_WRITE_SCHEMA=1 cargo test -p monitor` writes the file that is compared here.
    #[test]
    fn the_committed_schema_is_the_generated_one() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/schema/summary.json");
        let generated = serde_json::to_string_pretty(&Summary::schema()).unwrap() + "\n";
        if std::env::var_os("GRAVER_WRITE_SCHEMA").is_some() {
            std::fs::create_dir_all(std::path::Path::new(path).parent().unwrap()).unwrap();
            std::fs::write(path, &generated).unwrap();
        }
        let committed = std::fs::read_to_string(path).unwrap();
        assert_eq!(committed, generated, "write it anew with GRAVER_WRITE_SCHEMA=1");
    }

    #[test]
    fn a_mean_is_over_the_samples_behind_it() {
        let mut report = ControllerReport { count: 4, ..ControllerReport::default() };
        report.following_error_squares[1] = 1.0;
        let mut summary = summary();
        summary.take_controller(&report);
        assert_eq!(summary.following_error.rms, [0.0, 0.5]);
        assert_eq!(summary.power_override, [1.0; 2], "nothing was lit");
        assert!(!summary.text().contains("power override"));
        report.power_override = [0.8, 1.2];
        summary.take_controller(&report);
        let row = "power override    80 to 120 %, 100 % again after the job\n";
        assert!(summary.text().contains(row), "{}", summary.text());
    }

    #[test]
    fn outcomes_are_written_by_their_names() {
        use Outcome::*;
        for outcome in [Completed, Stopped, Refused, Faulted, Aborted] {
            assert_eq!(serde_json::to_value(outcome).unwrap(), outcome.name());
        }
    }
}
