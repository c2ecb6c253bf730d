//! What interlocks and warnings have to do with a job.

use super::{JobRun, Stage};
use crate::pipeline::{refusals, slow};
use machine::operating::InputFunction;
use messages::OperatorReply;

impl JobRun<'_> {
    /// Notes each interlock and warning that comes while the job is played, once, for its summary.
    pub(super) fn note_inputs(&mut self) {
        if !matches!(self.stage, Stage::Playing) {
            return;
        }
        let latest = &self.pipeline.latest;
        let fresh = latest.progress.inputs & !self.told;
        for (function, what) in
            [(InputFunction::Interlock, "the job was held: "), (InputFunction::Warning, "")]
        {
            let active = slow::active(&self.pipeline.machine, function, fresh, &latest.slow);
            self.run_outcome.warnings.extend(active.iter().map(|words| format!("{what}{words}")));
        }
        self.told |= fresh;
    }

    /// Why the controller does not start the job, by its `reply`.
    pub(super) fn why_refused(&self, reply: &OperatorReply) -> String {
        let (machine, latest) = (&self.pipeline.machine, &self.pipeline.latest);
        let inputs = latest.progress.inputs;
        let missing = slow::active(machine, InputFunction::Interlock, inputs, &latest.slow);
        refusals::not_started(reply, machine, &missing)
    }
}
