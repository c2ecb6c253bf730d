//! How a job ended: what happened on the machine, from what controller, drives and supervisor say.

use crate::summary::Outcome;
use messages::{ControllerReport, Fault, FaultCode};

/// What is known at the end of a job.
#[derive(Debug, Clone, Copy, Default)]
pub struct Evidence {
    /// The controller's final report of the job's stream, if it came.
    pub controller: Option<ControllerReport>,
    /// The fault that the controller has latched at the end, if any.
    pub latched: Fault,
    /// The fault of drives at the end, if any.
    pub drives: Fault,
    /// How whoever watched the job ended it: `Refused` by the planner, `Stopped` by a person,
    /// `Aborted` for a service that died or did not answer; `None` where it ended by itself.
    pub own: Option<Outcome>,
}

/// How a job ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// How.
    pub outcome: Outcome,
    /// The fault that ended it.
    pub fault: Option<Fault>,
    /// A fault that is none of this job's: it was found after the job had ended.
    pub later: Option<Fault>,
}

/// How a job ended.
///
/// What happened on the machine goes before what was asked for: a job that was played to its end is
/// completed, whoever died or gave up afterwards.
pub fn verdict(evidence: &Evidence) -> Verdict {
    let Evidence { controller, latched, drives, own } = evidence;
    let some = |fault: Fault| fault.is_some().then_some(fault);
    let ended_by = controller.and_then(|report| some(report.fault));
    let standing = some(*latched).or(some(*drives));
    let completed = controller.is_some_and(|report| report.completed == 1);
    if completed || *own == Some(Outcome::Refused) {
        let outcome = if completed { Outcome::Completed } else { Outcome::Refused };
        return Verdict { outcome, fault: None, later: ended_by.or(standing) };
    }
    // A stream that the controller ended without a fault was stopped; what it latched then is new.
    let fault = match controller {
        Some(_) => ended_by.or(some(*drives)),
        None => standing,
    };
    let later = some(*latched).filter(|_| fault.is_none());
    let outcome = match (fault.map(|fault| fault.code()), own) {
        (Some(code), _) if is_death(code) => Outcome::Aborted,
        (Some(_), Some(Outcome::Aborted)) if controller.is_some() => Outcome::Aborted,
        (Some(_), _) => Outcome::Faulted,
        (None, Some(own)) => *own,
        (None, None) if controller.is_some() => Outcome::Stopped,
        (None, None) => Outcome::Aborted,
    };
    Verdict { outcome, fault, later }
}

/// Whether the fault is the death of a process.
fn is_death(code: FaultCode) -> bool {
    matches!(
        code,
        FaultCode::PlannerLost
            | FaultCode::ControllerLost
            | FaultCode::DrivesLost
            | FaultCode::SupervisorLost
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use FaultCode::{
        ControllerLost, DriveFault, DrivesLost, FollowingError, PlannerLost, StaleCommand,
        SupervisorLost,
    };
    use Outcome::{Aborted, Completed, Faulted, Refused, Stopped};

    /// How the stream ended, as the controller reports it.
    #[derive(Debug, Clone, Copy)]
    enum Stream {
        /// It never began, or the controller cannot say.
        Untold,
        Played,
        Ended,
        EndedBy(FaultCode),
    }

    fn fault(code: Option<FaultCode>) -> Fault {
        code.map_or(Fault::default(), Fault::new)
    }

    fn report(stream: Stream) -> Option<ControllerReport> {
        let (completed, code) = match stream {
            Stream::Untold => return None,
            Stream::Played => (1, None),
            Stream::Ended => (0, None),
            Stream::EndedBy(code) => (0, Some(code)),
        };
        let fault = fault(code);
        Some(ControllerReport { is_final: 1, completed, fault, ..ControllerReport::default() })
    }

    #[test]
    fn causes_and_outcomes() {
        use Stream::{Ended, EndedBy, Played, Untold};
        // What happened; stream, latched by the controller, drives, watcher; outcome, fault, later.
        type Row = (
            &'static str,
            (Stream, Option<FaultCode>, Option<FaultCode>, Option<Outcome>),
            (Outcome, Option<FaultCode>, Option<FaultCode>),
        );
        let (following, drive) = (Some(FollowingError), Some(DriveFault));
        let rows: [Row; 24] = [
            ("played to its end", (Played, None, None, None), (Completed, None, None)),
            ("stopped too late", (Played, None, None, Some(Stopped)), (Completed, None, None)),
            ("a death afterwards", (Played, None, None, Some(Aborted)), (Completed, None, None)),
            ("a fault afterwards", (Played, following, None, None), (Completed, None, following)),
            ("drives afterwards", (Played, None, drive, None), (Completed, None, drive)),
            (
                "the supervisor afterwards",
                (Played, Some(SupervisorLost), None, Some(Aborted)),
                (Completed, None, Some(SupervisorLost)),
            ),
            ("stopped", (Ended, None, None, Some(Stopped)), (Stopped, None, None)),
            ("stopped by `graver stop`", (Ended, None, None, None), (Stopped, None, None)),
            ("a fault once stopped", (Ended, following, None, None), (Stopped, None, following)),
            ("drives, once stopped or before", (Ended, None, drive, None), (Faulted, drive, None)),
            (
                "a fault in the job",
                (EndedBy(FollowingError), following, None, None),
                (Faulted, following, None),
            ),
            (
                "a fault while stopping",
                (EndedBy(FollowingError), following, None, Some(Stopped)),
                (Faulted, following, None),
            ),
            (
                "a fault of drives, which the controller finds",
                (EndedBy(DriveFault), drive, Some(StaleCommand), None),
                (Faulted, drive, None),
            ),
            (
                "the planner died",
                (EndedBy(PlannerLost), Some(PlannerLost), None, Some(Aborted)),
                (Aborted, Some(PlannerLost), None),
            ),
            (
                "the planner of another starter died",
                (EndedBy(PlannerLost), Some(PlannerLost), None, None),
                (Aborted, Some(PlannerLost), None),
            ),
            (
                "the supervisor died",
                (EndedBy(SupervisorLost), Some(SupervisorLost), None, Some(Aborted)),
                (Aborted, Some(SupervisorLost), None),
            ),
            (
                "drives died",
                (EndedBy(DrivesLost), Some(DrivesLost), None, Some(Aborted)),
                (Aborted, Some(DrivesLost), None),
            ),
            (
                "the controller died",
                (Untold, None, Some(ControllerLost), Some(Aborted)),
                (Aborted, Some(ControllerLost), None),
            ),
            (
                "a service died and a fault came of it",
                (EndedBy(FollowingError), following, None, Some(Aborted)),
                (Aborted, following, None),
            ),
            (
                "a fault before the start",
                (Untold, following, None, Some(Aborted)),
                (Faulted, following, None),
            ),
            ("drives before the start", (Untold, None, drive, None), (Faulted, drive, None)),
            (
                "taken back while planning",
                (Untold, None, None, Some(Stopped)),
                (Stopped, None, None),
            ),
            ("refused", (Untold, None, drive, Some(Refused)), (Refused, None, drive)),
            ("nobody says anything", (Untold, None, None, None), (Aborted, None, None)),
        ];
        for (what, (stream, latched, drives, own), (outcome, by, later)) in rows {
            let evidence = Evidence {
                controller: report(stream),
                latched: fault(latched),
                drives: fault(drives),
                own,
            };
            let found = verdict(&evidence);
            let codes = [found.fault, found.later].map(|fault| fault.map(|fault| fault.code()));
            assert_eq!((found.outcome, codes), (outcome, [by, later]), "{what}");
        }
    }
}
