//! How far a job has come, for people.

use monitor::summary::text::duration;

use super::{JobRun, Stage};

impl JobRun<'_> {
    pub(super) fn progress(&self) -> (f64, String) {
        let latest = &self.pipeline.latest;
        let what = match self.stage {
            Stage::Starting(_) => "starting".to_owned(),
            Stage::Homing(_) => "homing".to_owned(),
            Stage::Planning => "planning".to_owned(),
            Stage::Ready(_) if self.control.is_held() => "held".to_owned(),
            Stage::Ready(_) => "starting".to_owned(),
            Stage::Playing => {
                let strokes = match latest.planner.is_complete {
                    0 => String::new(),
                    _ => format!(" of {}", latest.planner.strokes),
                };
                let left = match latest.time_left() {
                    Some(left) => format!(", {} left", duration(left)),
                    None => String::new(),
                };
                let rate = latest.progress.rate * 100.0;
                format!("stroke {}{strokes}, rate {rate:.0} %{left}", latest.progress.stroke)
            }
            Stage::Resting(_) => "coming to rest".to_owned(),
        };
        let is_ours = Some(latest.progress.stream) == self.stream;
        let share = if is_ours { latest.share() } else { 0.0 };
        (share, format!("{}: {what}", self.name))
    }
}
