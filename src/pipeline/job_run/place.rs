//! Where a job is, so that its summary can say where it ended.

use super::{JobRun, Stage};
use messages::ControllerState;
use monitor::summary::JobPlace;

impl JobRun<'_> {
    /// Notes where the job is while it is played.
    pub(super) fn note_place(&mut self) {
        let progress = &self.pipeline.latest.progress;
        let is_played = matches!(
            ControllerState::from_wire(progress.state),
            ControllerState::Running | ControllerState::Holding | ControllerState::Stopping
        );
        if !is_played || Some(progress.stream) != self.stream {
            return;
        }
        let before = self.run_outcome.place.take().unwrap_or_default();
        let line = Some(progress.line).filter(|line| *line > 0).or(before.line);
        let stroke = if progress.stroke > 0 { progress.stroke } else { before.stroke };
        let (file, tool) = (self.file.clone(), Some(progress.tool));
        self.run_outcome.place = Some(JobPlace { file, line, stroke, tool, bounds: None });
    }

    /// Takes over the place of what the planner refused, unless the job was played already.
    pub(super) fn note_refused_place(&mut self) {
        let Some(error) = &self.run_outcome.error else { return };
        if error.line.is_some() && !matches!(self.stage, Stage::Playing) {
            let (file, line) = (error.file.clone(), error.line);
            self.run_outcome.place = Some(JobPlace { file, line, ..JobPlace::default() });
        }
    }
}
