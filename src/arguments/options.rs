//! Options of a job that have a key in it too: `marking.dry_run` and its like.

use clap::Args;
use machine::document::Override;

/// How much of a job is done, and whether it is lit.
#[derive(Debug, Clone, Default, Args)]
pub struct JobOptions {
    /// Move as the job says, and light nothing (marking.dry_run).
    #[arg(long)]
    pub dry_run: bool,
    /// Go round the box around all that would be marked, instead of marking it: in the dark, or lit
    /// with --set marking.frame_power="1 %" (marking.frame).
    #[arg(long)]
    pub frame: bool,
    /// Begin with stroke N, from 1, as after a job that was stopped (marking.from_stroke).
    #[arg(long, value_name = "N", conflicts_with = "from_line")]
    pub from_stroke: Option<u64>,
    /// Begin so far along that stroke, such as "12.5 mm": what is marked already is not marked again
    /// (marking.from_along).
    #[arg(long, value_name = "LENGTH", conflicts_with = "from_line")]
    pub from_along: Option<String>,
    /// Begin with line N of a G-code program, from 1 (marking.from_line).
    #[arg(long, value_name = "N")]
    pub from_line: Option<u64>,
}

impl JobOptions {
    /// The same as changes of the job.
    pub fn overrides(&self) -> Vec<Override> {
        let keys = [
            ("dry_run", self.dry_run.then(|| "true".to_owned())),
            ("frame", self.frame.then(|| "true".to_owned())),
            ("from_stroke", self.from_stroke.map(|stroke| stroke.to_string())),
            ("from_along", self.from_along.clone()),
            ("from_line", self.from_line.map(|line| line.to_string())),
        ];
        let keys = keys.into_iter().filter_map(|(key, value)| Some((key, value?)));
        keys.map(|(key, value)| Override { key: format!("marking.{key}"), value }).collect()
    }
}
