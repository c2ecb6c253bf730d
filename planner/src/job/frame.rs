//! The box around a job, which the tool goes round instead of marking it, to show where it will lie.

use graphics::ReadError;
use machine::Machine;
use messages::plan::Bounds;
use nalgebra::Vector3;

use super::{DrawingError, Frame, Job, JobError, Marking};
use crate::drawing::{Action, Corners, Curve, Drawing, Note, Power, Step};
use crate::error::PlanError;
use crate::preview::{NoOutline, flat_bounds};

/// Edges that are shorter are not gone along [m].
const NOTHING: f64 = 1e-9;

impl Job {
    /// The job that shows the box around this one, if [`Marking::frame`] asks for that; else this one.
    pub(super) fn framed(self, machine: &Machine) -> Result<Self, JobError> {
        let Some(frame) = self.marking.frame else { return Ok(self) };
        let found = flat_bounds(machine, &self).map_err(|error| self.frameless(error))?;
        let bounds = found.ok_or_else(|| self.frameless(NoOutline::Empty))?;
        let rapid = self.rapid.unwrap_or(machine.path.rapid);
        let [width, depth] = [0, 1].map(|row| (bounds.upper[row] - bounds.lower[row]) * 1e3);
        let light = frame.power.map_or_else(
            || "in the dark".to_owned(),
            |power| format!("with {} % of full power", (power * 1e5).round() / 1e3),
        );
        let text = format!(
            "only the frame is shown, {width:.3} mm × {depth:.3} mm, {} times, {light}; nothing is marked",
            frame.passes
        );
        let notes = self.drawing.notes.into_iter().chain([Note { line: 0, text }]).collect();
        let top = self.marking.max_speed.unwrap_or(machine.path.speed);
        let steps = steps(&bounds, &frame, [rapid, top]);
        let drawing = Drawing { steps, notes, ..self.drawing };
        let marking =
            Marking { speed: None, policy: None, from_stroke: 1, from_along: 0.0, ..self.marking };
        Ok(Self {
            marking,
            rapid: self.rapid,
            standing: self.standing,
            placed: self.placed,
            too_large: self.too_large,
            surface: self.surface,
            attitude: self.attitude,
            files: self.files,
            ..Self::of(drawing)
        })
    }

    /// Why it has no box.
    fn frameless(&self, cause: NoOutline) -> JobError {
        let (line, message, help) = match cause {
            NoOutline::Empty => (
                None,
                "nothing is marked, so there is no frame around it".to_owned(),
                "leave `marking.frame` out",
            ),
            NoOutline::Turned { line } => (
                Some(line).filter(|line| *line > 0),
                "a path that turns the tool on its way has no frame".to_owned(),
                "try it with `marking.dry_run` instead",
            ),
            NoOutline::Refused(error) => (
                Some(error.line()).filter(|line| *line > 0),
                match error {
                    PlanError::Unreadable { message, .. } => message,
                    error => error.to_string(),
                },
                "mend the job first",
            ),
        };
        let path = self.files.last().cloned().unwrap_or_else(|| self.drawing.name.clone().into());
        let error = ReadError { line, column: None, message, help: help.to_owned() };
        JobError::Drawing(DrawingError::new(path, error))
    }
}

/// Round the box at the height of its top, from rest to rest along each edge, with the largest speeds in the
/// dark and of marks [m/s]. In the light power goes with the speed, so that no corner burns.
fn steps(bounds: &Bounds, frame: &Frame, [rapid, top]: [f64; 2]) -> Vec<Step> {
    let Bounds { lower, upper } = bounds;
    let corners =
        [[lower[0], lower[1]], [upper[0], lower[1]], [upper[0], upper[1]], [lower[0], upper[1]]]
            .map(|[x, y]| Vector3::new(x, y, upper[2]));
    let edges = (0..4).map(|index| (corners[index], corners[(index + 1) % 4]));
    let edges = edges.filter(|(from, to)| (to - from).norm() > NOTHING);
    let edge = |(from, to)| {
        let curve = Curve::Line { from, to };
        match frame.power {
            None => Action::Feed { curve, speed: rapid },
            Some(level) => {
                let power = Power { level, follows_speed: true };
                Action::Mark { curve, speed: Some(rapid.min(top)), power }
            }
        }
    };
    let round: Vec<Action> = edges.map(edge).collect();
    let rounds = (0..frame.passes).flat_map(|_| round.iter().cloned());
    let begin = [Action::Corners(Corners::Exact), Action::Rapid { to: corners[0] }];
    begin.into_iter().chain(rounds).map(|action| Step { action, line: 0 }).collect()
}
