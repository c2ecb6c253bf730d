//! What a job that was not played to its end has left, and where to go on.

use super::text::length;
use crate::marks::MarkEvaluation;
use messages::plan::PlanFacts;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A shorter beginning of a stroke is none [m].
const NOTHING: f64 = 1e-7;

/// What was not due yet when a job ended. Strokes are counted as the whole job has them, those included that it was
/// told to pass over (`marking.from_stroke`).
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LeftSummary {
    /// Length marked in this run, each place once [m].
    pub marked: f64,
    /// Length not due yet, as far as the job was planned [m].
    pub length: f64,
    /// Strokes of the job that are done, in this run or passed over.
    pub strokes_done: u64,
    /// Strokes of the job, as far as it was planned.
    pub strokes: u64,
    /// Whether the job was planned to its end: then `length` and `strokes` are those of all of it.
    pub is_whole: bool,
    /// The stroke to go on with, from 1: the first that is not done. `--set marking.from_stroke=N` begins there.
    pub from_stroke: u64,
    /// How much of that stroke is marked already [m]: `--set marking.from_along=…` goes on behind it.
    pub along: f64,
}

impl LeftSummary {
    /// Of marks as judged, where the job was not played to its end.
    pub fn of(evaluation: &MarkEvaluation, plan: &PlanFacts) -> Option<Self> {
        let left = evaluation.left?;
        let marks = &evaluation.marks;
        let done = plan.passed_over + (left.stroke - 1);
        let strokes = plan.passed_over + plan.strokes as u64;
        // Nobody needs to go on with what has no strokes.
        (strokes > 0 && !(plan.is_whole && done >= strokes)).then(|| Self {
            marked: (marks.length - marks.double).max(0.0),
            length: left.length,
            strokes_done: done,
            strokes,
            is_whole: plan.is_whole,
            from_stroke: done + 1,
            // Of the first stroke a part may have been marked in a run before this.
            along: left.begun + if left.stroke == 1 { plan.passed_along } else { 0.0 },
        })
    }
}

impl core::fmt::Display for LeftSummary {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { marked, strokes_done, strokes, from_stroke, along, is_whole, .. } = self;
        let marked = length(*marked);
        // Of a job that was not planned to its end nobody knows the whole.
        if *is_whole {
            let left = length(self.length);
            write!(
                formatter,
                "{strokes_done} of {strokes} strokes done, {marked} marked, {left} left"
            )?;
        } else {
            write!(formatter, "{strokes_done} strokes done, {marked} marked")?;
        }
        write!(formatter, "; go on with --set marking.from_stroke={from_stroke}")?;
        if *along > NOTHING {
            write!(formatter, " --set marking.from_along=\"{:.4} mm\"", along * 1e3)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::marks::{Left, MarkEvaluator, StreamEnd};
    use crate::recording::CycleRecord;
    use messages::artwork::Artwork;
    use messages::feedback::status;
    use messages::time::Period;
    use messages::{Command, Cycle, Feedback};

    /// An evaluation of nothing but its end.
    fn evaluation(left: Option<Left>) -> MarkEvaluation {
        let artwork = Artwork::default();
        let mut evaluator = MarkEvaluator::new(&artwork, Period::OF_SETPOINTS);
        let feedback =
            Feedback { cycle: Cycle(1), status: status::TOOL_KNOWN, ..Feedback::default() };
        let command = Command { cycle: Cycle(1), stream: 1, mode: 4, ..Command::default() };
        evaluator.push(&CycleRecord { feedback, command });
        let mut evaluation = evaluator.finish(StreamEnd::Unknown).unwrap();
        evaluation.left = left;
        (evaluation.marks.length, evaluation.marks.double) = (1.25, 0.05);
        evaluation
    }

    #[test]
    fn a_job_that_went_on_from_a_stroke_counts_those_before_it_as_done() {
        let left = Left { stroke: 5, begun: 0.0032, place: None, length: 40.5 };
        let plan =
            PlanFacts { strokes: 240, passed_over: 100, is_whole: true, ..PlanFacts::default() };
        let told = LeftSummary::of(&evaluation(Some(left)), &plan).unwrap();
        let expect = "104 of 340 strokes done, 1200.000 mm marked, 40500.000 mm left; go on with --set \
                      marking.from_stroke=105 --set marking.from_along=\"3.2000 mm\"";
        assert_eq!(told.to_string(), expect);
        // One that is stopped again in the stroke that it goes on with.
        let plan = PlanFacts { passed_along: 0.0032, ..plan };
        let again = |stroke| {
            let left = Left { stroke, begun: 0.0001, ..left };
            LeftSummary::of(&evaluation(Some(left)), &plan).unwrap().along
        };
        assert_eq!((again(1), again(2)), (0.0001 + 0.0032, 0.0001));
        let done = Left { stroke: 241, ..Left::default() };
        assert_eq!(LeftSummary::of(&evaluation(Some(done)), &plan), None);
        assert_eq!(LeftSummary::of(&evaluation(None), &plan), None);
    }

    #[test]
    fn of_a_job_that_was_not_planned_to_its_end_no_whole_is_told() {
        let left = Left { stroke: 5, length: 0.5, ..Left::default() };
        let plan = PlanFacts { strokes: 9, ..PlanFacts::default() };
        let told = LeftSummary::of(&evaluation(Some(left)), &plan).unwrap();
        assert_eq!((told.length, told.strokes, told.is_whole), (0.5, 9, false));
        let expect = "4 strokes done, 1200.000 mm marked; go on with --set marking.from_stroke=5";
        assert_eq!(told.to_string(), expect);
    }
}
