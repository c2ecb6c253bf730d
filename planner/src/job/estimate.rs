//! How long a job takes, roughly, before it is planned.

use machine::PathLimits;

use super::Job;
use crate::drawing::Action;
use crate::geometry::bezier;

impl Job {
    /// How long the job takes at the speeds asked for, as if the tool started, stopped and turned in no
    /// time [s]; `marking` gives the speed of a mark that asks for one or none [m/s].
    pub(crate) fn estimate(
        &self,
        limits: &PathLimits,
        marking: &dyn Fn(Option<f64>) -> f64,
    ) -> f64 {
        if let (Some(survey), Some(_)) = (&self.survey, &self.rest) {
            return survey.time;
        }
        let mut place = self.drawing.start;
        let composed = self.composition.as_ref();
        let mut time = composed.map_or(0.0, |composed| composed.time(marking, limits.rapid));
        for step in &self.drawing.steps {
            time += match &step.action {
                Action::Mark { curve, speed, .. } => {
                    place = curve.to();
                    curve.length() / marking(*speed)
                }
                Action::Trace { points, speed, .. } => {
                    place = points[3];
                    bezier::length(points) / marking(*speed)
                }
                Action::Follow { path, .. } => {
                    place = path.end().unwrap_or(place);
                    path.length() / marking(None)
                }
                Action::Feed { curve, speed } => {
                    place = curve.to();
                    curve.length() / speed.min(limits.rapid)
                }
                Action::Rapid { to } => {
                    let way = (to - place).norm();
                    place = *to;
                    way / limits.rapid
                }
                Action::Dwell { time, .. } => *time,
                Action::Output { .. }
                | Action::Frequency { .. }
                | Action::Pause
                | Action::Corners(_) => 0.0,
            };
        }
        time
    }
}
